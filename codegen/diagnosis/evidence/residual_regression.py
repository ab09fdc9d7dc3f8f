"""Flexible regression of a force residual on each variable, without any law, by penalised B-splines (P-splines).

The low-passed residual r of a coordinate is regressed on one variable at a time, on a line of its spectrum, on all
together, and on the ringing of a load behind a spring. The penalty on second differences is chosen by cross-validation;
shares are 1 − Σ(r − r̂)²/Σr² on held-out parts of the log.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.special import gammaincc

from codegen.base.arrays import Array
from codegen.base.parallel import in_processes
from codegen.diagnosis.evidence.changes_in_time import ChangesInTime, changes_in_time
from codegen.diagnosis.fit.acceptance import exact_sign_flips, random_signs
from codegen.diagnosis.fit.drive import residual_at_drive, residual_without_levels
from codegen.diagnosis.fit.identity_cache import OF_MODELS, identity_cache
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.measure import drive_force, inertia_along, inertial_force
from codegen.diagnosis.fit.residual import Problem, contacts_on, evaluate_forces, slip_velocities
from codegen.diagnosis.fit.signals import Motion, central_difference
from codegen.diagnosis.fit.starting_values import resonances, resonant
from codegen.diagnosis.results import Remainder, Term
from codegen.mechanics.system import Matrix, System

CHUNKS, FOLDS = 48, 8
"""Pieces of equal length of the log; every eighth piece is held out together."""
LONGER = 2.0
"""Least length of a piece where the noise of neighbouring ones has to be independent, in periods of the cutoff."""
KNOTS = 14
POSITION_KNOTS = 40
"""Knots of the splines over the position, and over any other variable (``KNOTS``)."""
MOST_ROWS = 6000
"""Samples of a regression at most, evenly spread over the log."""
PENALTIES = (1e-6, 1e-3, 1e-1, 1e1)
"""Penalties tried, on squared second differences of the weights, over the mean diagonal of the normal matrix."""
DEGREE = 3
LEAST_ROWS = 200
"""Least number of samples of a regression."""
NEIGHBOURS, LEAST_PERIODS = 2, 6
"""Spectral line: neighbouring bins on each side, by which its amplitude may vary; least periods in the log."""
BACKGROUND, SURELY_A_LINE = 7, 0.01
"""Spectral line: bins on each side whose median is the noise there; greatest nominal probability of it in noise."""
Columns = Callable[[str], Array]
"""Variable → (N, m) columns of a regression on it."""
STATE = ("speed", "position", "load", "acceleration", "distance since reversal")
"""Variables of the motion; what these predict is no change in time."""
REGRESSED = (*STATE[:-1], "input rate", "time", STATE[-1], "frequency")
"""Variables on which a residual is regressed, in the order in which they are reported."""
MOSTLY = 0.5
"""Share of a squared residual that state variables predict on held-out parts from which on they come before time."""
REPEATED = 2.0
"""Level of the test of ``_agree``, as the z-score of a normal distribution."""
SURELY_RINGS = 6.0
"""Least weight of a resonance, the best of 120, in standard deviations; 4 would give 1 % of false alarms."""
AT_ONCE = 0.1
"""Largest share of the samples of an interval, with most of the squared residual, that counts as one event."""
SLIDING = 0.03
"""Share of a contact's 95 % speed above which it surely slides; below, friction may balance any load."""


def remainders(system: System, motion: Motion, used: NDArray[np.bool_]) -> tuple[Remainder, ...]:
    """The remainder of a model on each coordinate; ``used``: (N, n) samples away from standstill, ends and gaps."""
    residual = residual_at_drive(system, motion)
    acting = acting_force(system, motion)
    every = range(system.degrees_of_freedom)
    rows = [sliding(system, motion, used, i) for i in every]
    columns = [remainder_columns(system, motion, residual, rows[i], i) for i in every]

    def shape(i: int) -> Remainder:
        return _remainder(residual[:, i], acting[:, i], rows[i], columns[i])

    def resonance(i: int) -> float:
        acceleration = variables_of(system, motion, residual, i)["acceleration"]
        inertia = float(np.mean(inertia_along(system, motion, i)))
        found = ringing(residual[:, i], rows[i], acceleration, inertia, motion)
        return min(found, 1 - noise_share(system, motion, residual[:, i], rows[i], i))

    def changed(i: int) -> ChangesInTime:
        return changed_on(system, motion, residual[:, i], rows[i], columns[i], i)

    tests: list[tuple[Callable[[int], Any], int]] = []
    for i in every:
        tests += [(test, i) for test in (shape, resonance, changed)[: 3 if rows[i].sum() >= LEAST_ROWS else 1]]
    results = in_processes(lambda one: one[0](one[1]), tests, threads=False)
    of = {(test, i): result for (test, i), result in zip(tests, results, strict=True)}
    return tuple(_joined(of[shape, i], of.get((resonance, i), 0.0), of.get((changed, i))) for i in every)


def _joined(left: Remainder, rings: float, changed: ChangesInTime | None) -> Remainder:
    """A remainder with the shares of a resonance and of changes in time; ``changed`` is None for too few samples."""
    if changed is None:
        return left
    over = {**left.over, "ringing": rings}
    if changed.changes:
        over["time"] = max(changed.share, over["time"])
    structured = max(changed.share, rings, left.structured)
    return replace(left, structured=structured, over=over, changes=changed.changes, changed=changed.share)


def varying_terms(system: System, motion: Motion, i: int) -> dict[Term, Array]:
    """(N,) low-passed terms of one coordinate's force balance whose coefficients may change in time."""
    inertia = inertial_force(system, motion)[:, i]
    terms: dict[Term, Array] = {"force": np.ones(len(inertia)), "inertia": inertia}
    touching = contacts_on(system, i)
    if touching:
        slip = slip_velocities(system, motion)[:, touching[0]]
        slip = -slip if system.distribution[i, touching[0]].could_extract_minus_sign() else slip
        terms |= {"friction level": motion.low_pass(np.sign(slip)), "viscous friction": motion.low_pass(slip)}
    return terms


def inertia_noise(system: System, motion: Motion, i: int) -> float:
    """Mean square in the low-passed row i of M a due to white noise of the measured positions or speeds."""
    row = evaluate_forces(system, [Matrix(list(system.mass_matrix[i, :]))], motion)[0]
    return float(np.sum(np.mean(row**2, axis=0) * motion.noise_after(motion.cutoff_hz, 2) ** 2))


def changed_on(
    system: System, motion: Motion, r: Array, rows: NDArray[np.bool_], columns: Columns, i: int
) -> ChangesInTime:
    """``changed_by`` of a residual (N,) of one coordinate; ``columns``: its ``remainder_columns``."""
    terms, noise = varying_terms(system, motion, i), inertia_noise(system, motion, i)
    return changed_by(r, rows, motion.time, motion.cutoff_hz, terms, columns, noise)


def changed_by(
    r: Array,
    rows: NDArray[np.bool_],
    time: Array,
    cutoff_hz: float,
    terms: Mapping[Term, Array],
    columns: Columns,
    noise: float,
) -> ChangesInTime:
    """Changes in time of a residual, or of what a curve over state variables leaves; ``noise``: of the row of M a.

    Such a curve comes first where it explains more, or at least ``MOSTLY`` on held-out parts: intervals, which are
    chosen on the whole log, also follow a force that repeats with the motion, as hysteresis does, since it is about
    constant for the time of a move.
    """
    in_terms: dict[Term, float] = {"inertia": noise}
    about = time, cutoff_hz, in_terms
    plain = changes_in_time(r, rows, terms, *about)
    if not plain.changes:
        return plain
    states = [columns(name) for name in STATE]
    groups = [states, *([one] for one in states)]
    shares = [repeated_share(r, rows, group) for group in groups]
    best = int(np.argmax(shares))
    if plain.whole >= shares[best] and shares[best] < MOSTLY:
        return plain
    curve = smooth_curve(r, rows, np.column_stack(groups[best]))
    left = changes_in_time(r - curve, rows, terms, *about)
    share = float(np.sum((r - curve)[rows] ** 2) / np.sum(r[rows] ** 2))
    return ChangesInTime(left.changes, share * left.share, share * left.whole)


@identity_cache(OF_MODELS)
def acting_force(system: System, motion: Motion) -> Array:
    """(N, n) low-passed force of the inputs on each coordinate; the row of M a if no input acts."""
    drive = motion.low_pass(drive_force(system, motion))
    idle = ~np.any(drive != 0, axis=0)
    if idle.any():
        drive[:, idle] = inertial_force(system, motion)[:, idle]
    return drive


def predicted_load(system: System, motion: Motion, residual: Array) -> Array:
    """(N, n) the acting force less the share of the residual that is not noise of the measured acceleration.

    The residual has the noise of the input, which the acting force has too, less that in the row of M a. The share is
    chosen so that load and residual have no common noise. If no input acts, it is what the model has in place of M a:
    M a itself is that force less the residual, which would follow from it, as noise does.
    """
    reached = np.any(drive_force(system, motion) != 0, axis=0)
    shares = [1 - noise_share(system, motion, r, motion.usable, i) for i, r in enumerate(residual.T)]
    return np.asarray(acting_force(system, motion) - np.where(reached, shares, -1.0) * residual)


def noise_share(system: System, motion: Motion, r: Array, rows: NDArray[np.bool_], i: int) -> float:
    """Share of the squared residual (N,) of one coordinate that is noise of its measured acceleration; at most 1.

    It is most of the residual after a coarse encoder. It is the strongest near the cutoff, as a vibration would be, and
    the force of a spring or a weight has the same noise of the position.
    """
    whole = float(np.mean(r[rows] ** 2)) if rows.any() else 0.0
    return min(1.0, inertia_noise(system, motion, i) / whole) if whole > 0 else 1.0


def sliding(system: System, motion: Motion, used: NDArray[np.bool_], i: int) -> NDArray[np.bool_]:
    """(N,) samples at which every contact on a coordinate surely slides."""
    slip = np.abs(slip_velocities(system, motion))
    fast = [slip[:, c] >= SLIDING * float(np.quantile(slip[:, c], 0.95)) for c in contacts_on(system, i)]
    return np.asarray(np.logical_and.reduce([used[:, i], *fast]))


def at_once(residual: Array, rows: NDArray[np.bool_], share: float = 0.5) -> tuple[int, int] | None:
    """First and last sample of the shortest interval with this share of a squared residual, (N,).

    None if it has more than ``AT_ONCE`` of the samples ``rows``.
    """
    places = np.flatnonzero(rows)
    if len(places) < LEAST_ROWS or not np.any(residual[places]):
        return None
    sums = np.concatenate([[0.0], np.cumsum(residual[places] ** 2)])
    last = np.searchsorted(sums, sums[:-1] + share * sums[-1])  # of each first sample, one behind the last
    lengths = np.where(last < len(sums), last - np.arange(len(places)), len(places) + 1)
    k = int(np.argmin(lengths))
    return (int(places[k]), int(places[last[k] - 1])) if lengths[k] <= AT_ONCE * len(places) else None


def explained_over(residual: Array, rows: NDArray[np.bool_], columns: Sequence[Array]) -> float:
    """Share of the squared residual that these columns, (N, m) each, explain on held-out parts; at least 0."""
    return max(0.0, float(_gains(residual, rows, columns).sum()))


def repeated_share(residual: Array, rows: NDArray[np.bool_], columns: Sequence[Array]) -> float:
    """The explained share if it is significantly positive over the held-out parts (``_agree``); else 0."""
    gains = _gains(residual, rows, columns)
    return float(gains.sum()) if _agree(gains) else 0.0


def added_share(residual: Array, rows: NDArray[np.bool_], columns: Sequence[Array], further: Sequence[Array]) -> float:
    """Share of what ``columns`` leave of a squared residual that ``further`` ones explain, on held-out parts.

    0 if it is not significantly positive over these (``_agree``).
    """
    plain, richer = (_gains(residual, rows, some) for some in (columns, [*columns, *further]))
    gains = richer - plain
    return float(gains.sum()) / max(1 - float(plain.sum()), 1e-300) if _agree(gains) else 0.0


def _agree(gains: Array) -> bool:
    """Whether the sum of the gains of held-out parts is positive by a sign-flip test at the level of ``REPEATED``.

    Under the null hypothesis the gain of each part has either sign with the same probability. The test is exact where
    few parts decide: of a force that acts in a part of the log the z-score is small though nearly all gains there are
    positive, and that of a few equal gains is large by chance. A single event gains on its own parts alone.
    """
    return exact_sign_flips(gains) <= random_signs(REPEATED)


def _gains(residual: Array, rows: NDArray[np.bool_], columns: Sequence[Array]) -> Array:
    """(CHUNKS,) share of the squared residual that is explained on each held-out piece."""
    kept = _thinned(rows)
    if kept.sum() < LEAST_ROWS:
        return np.zeros(CHUNKS)
    return _cross_validated(residual[kept], [c[kept] for c in columns], _pieces(kept))[0]


def smooth_curve(residual: Array, rows: NDArray[np.bool_], columns: Array) -> Array:
    """(N,) the regression curve over one variable's columns, fitted to all rows with the cross-validated penalty."""
    kept = _thinned(rows)
    if kept.sum() < LEAST_ROWS:
        return np.full(len(residual), np.nan)
    weights = _cross_validated(residual[kept], [columns[kept]], _pieces(kept))[1]
    return np.asarray(np.column_stack([columns, np.ones(len(columns))]) @ weights)


def _remainder(r: Array, drive: Array, rows: NDArray[np.bool_], columns: Columns) -> Remainder:
    if rows.sum() < LEAST_ROWS:
        return Remainder(float("nan"), float("nan"), 0.0)
    left, driven = (rms(y[rows]) for y in (r, drive))
    constant = repeated_share(r, rows, [np.ones((len(r), 1))])
    over = {name: repeated_share(r, rows, [columns(name)]) for name in REGRESSED}
    together = max(repeated_share(r, rows, [columns(name) for name in REGRESSED]), *over.values(), constant)
    beyond = {name: max(0.0, share - constant) for name, share in over.items()}
    share = left / driven if driven > 0 else float("inf")
    return Remainder(left, share, together, {"constant": constant} | beyond)


@identity_cache(OF_MODELS)
def variables_of(system: System, motion: Motion, residual: Array, i: int) -> dict[str, Array]:
    """(N,) variables of one coordinate on which a residual may depend; the load is ``predicted_load``."""
    x, v = motion.positions[:, i], motion.velocities[:, i]
    rate = central_difference(acting_force(system, motion)[:, [i]], motion.sample_time)
    touching = contacts_on(system, i)
    reached = np.any(drive_force(system, motion)[:, i] != 0)
    r = residual[:, i]
    share = noise_share(system, motion, r, motion.usable, i) if reached else 1.0  # as in ``predicted_load``
    noise = share * r / inertia_along(system, motion, i)
    return {
        "speed": slip_velocities(system, motion)[:, touching[0]] if touching else v,
        "position": x,
        "load": predicted_load(system, motion, residual)[:, i],
        "acceleration": motion.accelerations[:, i] + noise,  # uncorrelated as in ``predicted_load``
        "input rate": motion.low_pass(rate)[:, 0],
        "time": motion.time,
        "distance since reversal": since_reversal(x, v),
    }


FAR_ABOVE, OF_DRIVE = 10.0, 0.5
"""Least RMS residual in a period of the cutoff of an event: over that of the median period, and over that of the drive
force. Of 22 logs without an effect, training and held-out data, one reaches 0.3 of the drive force."""


def events_of(problem: Problem) -> tuple[int, ...]:
    """The middle sample of each event of the declared model, friction levels refitted, ascending.

    Periods in which the velocity changes its sign are left out: there friction whose sign changes one sample early
    leaves a large residual.
    """
    motion, system, found = problem.motion, problem.system, set[int]()
    for i, residual in enumerate(residual_without_levels(problem, system).T):
        sizes, usual, drive = _by_period(problem, residual, system, i)
        if drive > 0:
            far = np.flatnonzero((sizes >= FAR_ABOVE * usual) & (sizes >= OF_DRIVE * drive))
            found |= {int(e[len(e) // 2]) for e in _groups(far, max(2, motion.step(1)))}
    return tuple(sorted(found))


def _groups(places: NDArray[np.intp], gap: int) -> list[NDArray[np.intp]]:
    """Samples in groups that are more than ``gap`` samples apart."""
    return np.split(places, np.flatnonzero(np.diff(places) > gap) + 1) if len(places) else []


def _by_period(problem: Problem, residual: Array, system: System, i: int) -> tuple[Array, float, float]:
    """(N,) RMS of a residual of coordinate i in the period of the cutoff about each sample; the median; the RMS drive.

    The RMS is zero where not all of the period is used or where it has a reversal; all is zero if little is left.
    """
    motion, rows = problem.motion, problem.used[:, i]
    width = max(2, motion.step(1))
    turns = np.abs(np.diff(np.sign(motion.velocities[:, i]), prepend=0.0)) > 0
    used = rows & (_moving_sum(turns.astype(float), 2 * width + 1) < 0.5)
    whole = _moving_sum(used.astype(float), width) > width - 0.5
    if whole.sum() < LEAST_ROWS:
        return np.zeros(len(rows)), 0.0, 0.0
    sizes = np.sqrt(np.maximum(_moving_sum(np.where(used, residual, 0.0) ** 2, width), 0.0) / width) * whole
    return sizes, float(np.median(sizes[whole])), rms(acting_force(system, motion)[rows, i])


def _moving_sum(values: Array, width: int) -> Array:
    """(N,) sum over ``width`` samples about each, also where ``width`` is above N."""
    return np.asarray(np.convolve(values, np.ones(width))[(width - 1) // 2 :][: len(values)])


def ringing(residual: Array, rows: NDArray[np.bool_], acceleration: Array, inertia: float, motion: Motion) -> float:
    """Share of a squared residual (N,) that one resonance explains on held-out pieces; 0 if it is not significant.

    The residual of a load behind a spring is a weight times the acceleration, filtered by a resonance (``resonances``).
    A few moves may excite nearly all of it, so the weight must be ``SURELY_RINGS`` standard deviations from zero. These
    follow from sums over pieces of column times remainder, with the weight that is fitted to the other folds.

    Args:
        acceleration: (N,) without noise that is in the residual too.
        inertia: of the coordinate.
    """
    kept = _thinned(rows)
    found = resonances(residual, acceleration, rows, inertia, motion, 1) if kept.sum() >= LEAST_ROWS else ()
    if not found:
        return 0.0
    column = resonant(found[0].frequency, found[0].damping_ratio, acceleration, motion)[kept]
    y, piece, fold = residual[kept], _pieces(kept, motion), np.arange(CHUNKS) % FOLDS
    power, along = (np.bincount(piece, weights=z, minlength=CHUNKS) for z in (column**2, column * y))
    rest_power, rest_along = (z.sum() - np.bincount(fold, weights=z)[fold] for z in (power, along))
    weight = rest_along / np.maximum(rest_power, 1e-300)
    deviation = float(np.sqrt(((along - weight * power) ** 2).sum()))
    if -float(along.sum()) < SURELY_RINGS * deviation:
        return 0.0
    return max(0.0, float((2 * weight * along - weight**2 * power).sum()) / max(float(y @ y), 1e-300))


def remainder_columns(system: System, motion: Motion, residual: Array, rows: NDArray[np.bool_], i: int) -> Columns:
    """The columns (N, m) of one coordinate over each variable of ``REGRESSED``, computed when they are first asked for.

    ``rows``: the samples of the regression.
    """
    over, r = variables_of(system, motion, residual, i), residual[:, i]
    sign = motion.low_pass(np.sign(over["speed"])[:, None])

    @cache
    def columns(name: str) -> Array:
        if name == "frequency":
            oscillates = noise_share(system, motion, r, rows, i) < 1
            return line(r, rows, motion) if oscillates else np.ones((len(r), 1))
        along = splines(over[name], POSITION_KNOTS if name == "position" else KNOTS)
        match name:
            case "speed":
                return np.column_stack([along, splines(motion.velocities[:, i], KNOTS), sign])
            case "position":
                return np.column_stack([along, along * sign])
            case "load":
                return np.column_stack([along, splines(np.abs(over[name]), KNOTS) * sign])
            case "distance since reversal":
                return along * sign
            case _:
                return along

    return columns


def line(residual: Array, rows: NDArray[np.bool_], motion: Motion) -> Array:
    """(N, m) sines and cosines at the highest peak of the spectrum below the cutoff, and at neighbouring bins.

    A constant where such a peak is in noise too. In a short log five bins are much of the band below the cutoff, and
    noise in them is smooth enough to be predicted on a held-out piece from the pieces before and behind it.
    """
    resolution, peak = 1 / (len(residual) * motion.sample_time), _peak(residual, rows, motion)
    if peak is None:
        return np.ones((len(residual), 1))
    bins = range(max(1, peak - NEIGHBOURS), peak + NEIGHBOURS + 1)
    if _as_noise(residual, rows, motion, bins) > SURELY_A_LINE:
        return np.ones((len(residual), 1))
    turns = [2 * np.pi * k * resolution * motion.time for k in bins]
    return np.column_stack([f(turn) for turn in turns for f in (np.sin, np.cos)])


def peak_hz(residual: Array, rows: NDArray[np.bool_], motion: Motion) -> float:
    """Frequency of the highest peak of the spectrum below the cutoff; NaN for a log too short to have one."""
    peak = _peak(residual, rows, motion)
    return float("nan") if peak is None else peak / (len(residual) * motion.sample_time)


def _peak(residual: Array, rows: NDArray[np.bool_], motion: Motion) -> int | None:
    """The bin of the highest peak of the spectrum at the samples ``rows``, away from standstill.

    Of those with ``LEAST_PERIODS`` in the log and below the cutoff. None if the log is too short for one.
    """
    count, h = len(residual), motion.sample_time
    power = np.abs(np.fft.rfft(np.where(rows, residual, 0.0))) ** 2
    frequencies = np.fft.rfftfreq(count, h)
    seen = (frequencies > LEAST_PERIODS / (count * h)) & (frequencies < motion.cutoff_hz)
    return int(np.argmax(np.where(seen, power, 0.0))) if seen.any() else None


def _as_noise(residual: Array, rows: NDArray[np.bool_], motion: Motion, bins: range) -> float:
    """Probability of such power in any as many bins below the cutoff, of noise whose spectrum is smooth.

    The power of noise in a bin is exponential about its mean, here the median of the neighbours over log 2.
    """
    power = np.abs(np.fft.rfft(np.where(rows, residual, 0.0))) ** 2
    below = int(motion.cutoff_hz * len(residual) * motion.sample_time)
    near = [power[max(1, k - BACKGROUND) : k + BACKGROUND + 1] for k in bins]
    levels = np.maximum([np.median(one) / np.log(2) for one in near], 1e-300)
    over = float(np.sum(power[bins.start : bins.stop] / levels))
    return min(1.0, below / len(bins) * float(gammaincc(len(bins), over)))


def since_reversal(x: Array, v: Array) -> Array:
    """(N,) square root of the distance moved since the velocity last changed its sign."""
    turned = np.concatenate([[0], np.flatnonzero(np.diff(np.sign(v)) != 0) + 1])
    last = turned[np.searchsorted(turned, np.arange(len(x)), side="right") - 1]
    return np.asarray(np.sqrt(np.abs(x - x[last])))


def splines(z: Array, knots: int) -> Array:
    """(N, m) cubic B-splines of a signal, their knots at its quantiles."""
    inner = np.unique(np.quantile(z, np.linspace(0, 1, knots)))
    if len(inner) < 3 or inner[-1] - inner[0] <= 1e-12 * max(abs(inner[0]), abs(inner[-1]), 1e-300):
        return np.ones((len(z), 1))
    wide = inner[-1] - inner[0]
    inner = inner[np.concatenate([[True], np.diff(inner) > 1e-6 * wide])]
    inner[-1] = max(inner[-1], float(z.max()))
    t = np.concatenate([[inner[0]] * DEGREE, inner, [inner[-1]] * DEGREE])
    return np.asarray(BSpline.design_matrix(np.clip(z, inner[0], inner[-1]), t, DEGREE).toarray())


def _thinned(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """At most ``MOST_ROWS`` of the true entries, evenly spread."""
    places = np.flatnonzero(rows)
    kept = np.zeros_like(rows)
    kept[places[:: max(1, len(places) // MOST_ROWS)]] = True
    return kept


def _pieces(kept: NDArray[np.bool_], motion: Motion | None = None) -> NDArray[np.int64]:
    """The piece of the log in which each kept row lies.

    Args:
        motion: if given, pieces have at least ``LONGER`` periods of its cutoff, so that low-passed noise in one is
            independent of that in the next. A short log then has fewer pieces, but one for each fold.
    """
    places = np.flatnonzero(kept)
    span, count = places[-1] - places[0] + 1, CHUNKS
    if motion is not None:
        count = int(np.clip(span * motion.sample_time * motion.cutoff_hz / LONGER, FOLDS, CHUNKS))
    return np.asarray((places - places[0]) * count // max(1, span))


def _cross_validated(y: Array, groups: Sequence[Array], piece: NDArray[np.int64]) -> tuple[Array, Array]:
    """Ridge regression with the cross-validated penalty: shares of y'y removed, and weights fitted to all rows.

    (CHUNKS,) shares on each piece while its fold is held out; the last weight is that of a constant.
    """
    fold = piece % FOLDS
    a = np.hstack([*groups, np.ones((len(y), 1))])
    roughness = _roughness([g.shape[1] for g in groups])
    held_out = [(a[fold == f], y[fold == f], piece[fold == f]) for f in range(FOLDS)]
    grams = np.array([rows.T @ rows for rows, _, _ in held_out])
    rights = np.array([rows.T @ own for rows, own, _ in held_out])
    gram, right = grams.sum(axis=0), rights.sum(axis=0)
    size = float(np.trace(gram)) / len(gram)
    before = np.bincount(piece, weights=y**2, minlength=CHUNKS)
    total, best, chosen = float(before.sum()), np.full(CHUNKS, np.inf), PENALTIES[0]
    small = 1e-9 * size * np.eye(len(gram))
    for penalty in PENALTIES:
        after = np.zeros(CHUNKS)
        for f, (rows, own, place) in enumerate(held_out):
            weights = np.linalg.solve(gram - grams[f] + penalty * size * roughness + small, right - rights[f])
            after += np.bincount(place, weights=(own - rows @ weights) ** 2, minlength=CHUNKS)
        if after.sum() < best.sum():
            best, chosen = after, penalty
    weights = np.linalg.solve(gram + chosen * size * roughness + small, right)
    return ((before - best) / total if total > 0 else np.zeros(CHUNKS)), weights


def _roughness(widths: Sequence[int]) -> Array:
    """Penalty matrix: squared second differences of the weights of each group, and a small ridge."""
    total = np.zeros((sum(widths) + 1, sum(widths) + 1))
    start = 0
    for width in widths:
        second = np.diff(np.eye(width), 2, axis=0) if width > 2 else np.zeros((0, width))
        total[start : start + width, start : start + width] = second.T @ second + 1e-3 * np.eye(width)
        start += width
    return total
