"""Preflight of scales: a position in another unit, or a multiple of the spec's, as one measured before a gear; and a
time that is too long or too short by a factor, as by a wrong sample rate.

If the position is k times too large, q = k x, the machine M a + d v + U λ = u appears in the log as

    (M/k) a_q + (d/k) v_q + U λ = u.

Forces that are linear in position or speed are divided by k; Coulomb levels and constant forces are not. If instead the
input is c times too small, all forces are divided by c:

    (M/c) a + (d/c) v + (U λ)/c = u.

So inertia, damping and springs do not distinguish k from c. Friction levels and constant forces do; a level that is
known to a factor of three, only if k or 1/k is larger than that. A mass that is k times too large differs from both in
damping and springs, if the log shows these.

If the time is c times too long, speeds appear divided by c and accelerations by c²:

    (c² M) a + (c d) v + U λ = u.

Inertia alone does not distinguish c from a mass that is too small; damping, friction and springs do.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from codegen.logs.audit.changed_columns import Case
from codegen.logs.audit.force_balance import Forces
from codegen.logs.audit.input_audit import MATCHED, SCALE_OFF, other_units
from codegen.logs.log import Finding, Severity
from codegen.logs.motion import scaled
from codegen.logs.uniform import earlier
from codegen.spec.model import Spec, symbol

APPARENT, SURE = 1.5, 3.0
"""Least factor on a position, either way, that is reported (a smaller one is an error of a parameter), and that is a
problem, if friction distinguishes it from a wrong scale of the input."""
INERTIA_SHOWN, FRICTION_SHOWN = 0.5, 0.15
"""Partial correlations with the input's force from which on a log shows the inertia and the friction."""
INERTIA_OFF, SUSPECT, FRICTION_FITS = 10.0, 7.0, 3.0
"""Least factor on the declared inertia that is no error of a mass; least one at which other units are tried, below the
ten of a wrong unit, since other errors of the model may reduce it; largest factor on the declared friction that still
agrees with it."""
TOO_MUCH = 30.0
"""Ratio of the required force to the force of the inputs, near 1 in a right log, from which on a scale is wrong."""
FITS, BETTER = 0.25, 0.5
"""Largest misfit that is accepted of another unit, and its largest ratio to that of any other."""
EXPLAINED, MUCH_LESS = 0.02, 0.25
"""Largest unbalanced share of the squared forces with a factor, and its largest ratio to that without."""
ALIKE = 2.0
"""Ratio of unbalanced shares up to which two explanations are not distinguished."""
RATE_KNOWN = 0.01
"""Relative error of an estimated sample rate, by which the proposed one is rounded."""
ABOUT, TOLERANCE = 2.0, 1e-3
"""Range of the search for a factor about its starting value, either way, and its relative accuracy."""
DELAYS = 0.01, 0.04, 0.16, 0.64
"""Starting values, in s, of the search for a delay of the inputs: with that range they cover 5 ms to 1.28 s."""
SAME_MOTION, APART = 0.9, 2.0
"""Least correlation of a measured velocity with the position's derivative, and the ratio from which on they differ."""
SCALE_OF_TIME = "scale of time"
"""Topic of the finding on a wrong time, which by itself looks like missing effects."""
LONGEST_STEP = 0.5
"""Sample time in s from which on the unit of time is in doubt, and not that of a coordinate."""
NEAR = 0.05
"""Relative deviation of a factor from a unit's, a parameter's or a power of ten that explains it."""
UNITS = ("m", "cm", "mm", "um", "rad", "deg", "mrad")
SPEEDS = ("m/s", "cm/s", "mm/s", "rad/s", "rpm", "deg/s", "rev/s")


def wrong_scales(case: Case, steady: frozenset[int], outside: Finding | None) -> list[Finding]:
    """Findings on the scale of positions or, where that balances the forces far better, of the time.

    ``outside``: the coordinate furthest outside the envelope.
    """
    found = _wrong_positions(case, steady, outside)
    time = None if steady else _wrong_time(case)
    least = min((f.figures.get("misfit_scaled", np.inf) for f in found), default=np.inf)
    if time is None or ALIKE * time.figures["misfit_scaled"] >= least:
        return found
    sure = any(f.severity == "problem" for f in found)
    return [Finding("problem" if sure else "warning", time.topic, time.words, time.figures)]


def _wrong_positions(case: Case, steady: frozenset[int], outside: Finding | None) -> list[Finding]:
    """Findings on the scale of positions: in another unit, off by another factor, or off without a factor that fits.

    ``outside``: the coordinate furthest outside the envelope.
    """
    doubtful = _off_scale(case, steady)
    off = [f for f in doubtful if not 1 / INERTIA_OFF < f.figures.get("inertia", np.inf) < INERTIA_OFF]
    each = [] if steady else [_position_scale(case, j) for j in range(len(case.spec.coordinates))]
    factors = {f.topic: f for f in each if f is not None}
    if not (doubtful or outside) or case.log.sample_time >= LONGEST_STEP:
        return off or list(factors.values())
    known = {f.topic: f.figures for f in off}
    if outside:
        known[outside.topic] = {**outside.figures, **known.get(outside.topic, {})}
    unit = _other_unit(case, tried_anyway=bool(off))
    found = list(factors.values()) or off
    if unit is not None:
        other = factors.get(unit.topic, unit)  # the same coordinate, by a factor that need not be a unit's
        same = 1 / APPARENT < other.figures["factor"] / unit.figures["factor"] < APPARENT
        better = ALIKE * unit.figures["misfit_scaled"] < other.figures.get("misfit_scaled", 0.0)
        found = [unit if same or better else other]
    return [Finding(f.severity, f.topic, f.words, {**f.figures, **known.get(f.topic, {})}) for f in found]


def _finding(severity: Severity, x: str, figures: Mapping[str, float], say: str, **given: Any) -> Finding:
    """A finding on the scale of a coordinate ``x`` in words of templates/text/scales.j2, as by ``Finding.worded``."""
    return Finding.worded(severity, f"scale of {x}", "scales", say, figures, x=x, **given)


def _off_scale(case: Case, steady: frozenset[int]) -> list[Finding]:
    """Findings on coordinates by the ratio of inertia to friction, or to the inputs' force."""
    forces, found = case.forces, []
    for i, c in enumerate(case.spec.coordinates):
        required, push = forces.inertia[:, i] - forces.undriven[:, i], forces.applied[:, i]
        sizes = float(np.linalg.norm(required)), float(np.linalg.norm(push))
        if min(sizes) == 0.0 or i in steady:
            continue
        (inertia, r_inertia), (friction, r_friction) = forces.inertia_factor(i), forces.friction_factor(i)
        fits = r_friction > FRICTION_SHOWN and 1 / FRICTION_FITS < friction < FRICTION_FITS
        if sizes[0] > TOO_MUCH * sizes[1] and float(required @ push) < MATCHED * sizes[0] * sizes[1]:
            figures = {"times": sizes[0] / sizes[1]}
        elif fits and r_inertia > INERTIA_SHOWN and not 1 / SUSPECT < inertia < SUSPECT:
            figures = {"inertia": inertia, "friction": friction, "correlation": r_inertia}
        else:
            continue
        found.append(_finding("problem", c.name, figures, "off", **figures))
    return found


def _other_unit(case: Case, tried_anyway: bool) -> Finding | None:
    """A finding on coordinates that make the forces balance if they are taken in another unit; None if none does.

    With coupled masses, a coordinate in a wrong unit disturbs the balance of all, and another one's may be worse. So
    each coordinate is tried in each other usual unit, and all that are read in the same unit together. Where the mass
    matrix depends on the position, as with J + m r(x)², the inertia is wrong by another factor than the accelerations:
    its factor then suggests no unit. ``tried_anyway``: also units that the factor on the inertia does not suggest.
    """
    spec, read = case.spec, [case.log.units.get(c.name, c.unit) for c in case.spec.coordinates]
    alike = [[j for j, unit in enumerate(read) if unit == one] for one in dict.fromkeys(read)]
    tried = []
    for group in [*([j] for j in range(len(read))), *(some for some in alike if len(some) > 1)]:
        for unit, factor in other_units(read[group[0]], UNITS):
            if tried_anyway or all(_suggests(case, j, factor) for j in group):
                motion = case.motion
                for j in group:
                    motion = scaled(motion, j, factor)
                tried.append((case.balance.along(case.log, motion).misfit, group, unit, factor))
    least, group, unit, factor = min(tried, default=(1.0, [0], "", 1.0))
    now = case.forces.misfit
    if least > FITS or least > BETTER * min([now, *(misfit for misfit, others, *_ in tried if others != group)]):
        return None
    names = [spec.coordinates[j].name for j in group]
    figures = {"misfit": now, "misfit_scaled": least, "factor": 1 / factor}
    given = {"names": names, "unit": unit, "read": read[group[0]], "now": now, "least": least}
    return _finding("problem", " and ".join(names), figures, "unit", **given)


def _suggests(case: Case, j: int, factor: float) -> bool:
    """Whether the inertia of a coordinate may be wrong since its unit is, by this factor."""
    inertia, correlation = case.forces.inertia_factor(j)
    mass = case.spec.mass_matrix
    moved = mass is not None and symbol(case.spec.coordinates[j].name) in mass.free_symbols
    return moved or (correlation > INERTIA_SHOWN and 1 / SCALE_OFF < inertia / factor < SCALE_OFF)


def scales_of_velocities(case: Case) -> Iterator[Finding]:
    """Findings on positions whose derivative is a multiple of the measured velocity, if both are logged."""
    log, motion = case.log, case.motion
    if log.velocities is None:
        return
    for j, c in enumerate(case.spec.coordinates):
        logged, slope = log.velocities[motion.usable, j], motion.velocities[motion.usable, j]
        sizes = float(np.linalg.norm(logged)), float(np.linalg.norm(slope))
        if min(sizes) == 0 or abs(float(logged @ slope)) < SAME_MOTION * sizes[0] * sizes[1]:
            continue
        factor = float(logged @ slope) / sizes[0] ** 2
        if 1 / APART < factor < APART:
            continue
        unit = log.units.get(c.name, c.unit)
        meant = [other for other, by in other_units(unit, UNITS) if abs(by * factor - 1) < NEAR]
        key = f"`units: {{{c.name}: {meant[0]}}}`" if meant else log.scale_lines({c.name: 1 / factor}, case.spec)
        speed = log.units.get(c.velocity, f"{c.unit}/s")
        speeds = [other for other, by in other_units(speed, SPEEDS) if abs(by / factor - 1) < NEAR]
        given = {"factor": factor, "v": c.velocity, "key": key, "speeds": speeds}
        yield _finding("warning", c.name, {"factor": factor}, "velocity", **given)


@dataclass(frozen=True)
class Explanation:
    """A wrong scale of one quantity as the explanation of unbalanced forces.

    Attributes:
        factor: by which the quantity is too large or too small.
        misfit: share of the squared forces that stays unbalanced once it is corrected.
        level: factor on the declared friction level that then leaves least.
    """

    factor: float
    misfit: float
    level: float

    @property
    def level_fits(self) -> bool:
        """Whether the factor on the declared friction is within its uncertainty."""
        return 1 / FRICTION_FITS < self.level < FRICTION_FITS


def _position_scale(case: Case, j: int) -> Finding | None:
    """A finding on a position that balances the forces much better if it is divided by a factor.

    Explanations that the log does not exclude are named too; none is reported if one of these is better.
    """

    def divided(factor: float) -> Forces:
        return case.balance.along(case.log, scaled(case.motion, j, 1 / factor))

    c, (inertia, correlation) = case.spec.coordinates[j], case.forces.inertia_factor(j)
    if correlation < INERTIA_SHOWN or inertia <= 0 or 1 / APPARENT < inertia < APPARENT:
        return None
    position = _best(lambda factor: _balance(divided(factor), j), 1 / inertia)
    found, plain, k = divided(position.factor), _balance(case.forces, j), position.factor
    explains = position.misfit <= min(EXPLAINED, MUCH_LESS * plain.misfit) and found.misfit < case.forces.misfit
    if 1 / APPARENT < k < APPARENT or not explains:
        return None
    by_mass = _best(lambda factor: _balance(case.forces, j, mass=1 / factor), k)
    other_inputs = _other_inputs(case, j, position, found)
    if by_mass.misfit * ALIKE < position.misfit or other_inputs is None:
        return None
    rivals, excluded = other_inputs
    if by_mass.misfit <= ALIKE * position.misfit and 1 / INERTIA_OFF < by_mass.factor < INERTIA_OFF:
        rivals.append(f"the declared inertia is {by_mass.factor:.3g} times too large")
    gear, ratio = _gear_ratio(case.spec, k)
    sure = not rivals and position.level_fits and not 1 / SURE < k < SURE
    figures = {"factor": k, "level": position.level, "misfit": plain.misfit, "misfit_scaled": position.misfit}
    given = {"k": k, "plain": plain.misfit, "left": position.misfit, "level": position.level, "gear": gear}
    given |= {"line": case.log.scale_lines({c.name: 1 / ratio}, case.spec), "rivals": rivals, "excluded": excluded}
    return _finding("problem" if sure else "warning", c.name, figures, "position", **given)


def _other_inputs(
    case: Case, j: int, position: Explanation, found: Forces
) -> tuple[list[str], dict[str, Any] | None] | None:
    """A wrong scale of an input as another explanation: in words, and the one that is excluded; None if it is better.

    Of the one that is excluded the name, factor and friction level.
    """
    driving = [i.name for i, force in zip(case.spec.inputs, case.forces.driven, strict=True) if np.any(force[:, j])]
    if len(driving) != 1:
        return [], None
    name, by_input = driving[0], _best(lambda c: _balance(case.forces, j, given=c), position.factor)
    shows_friction = found.friction_factor(j)[1] > FRICTION_SHOWN
    better = shows_friction and by_input.level_fits and not position.level_fits
    if better or by_input.misfit * ALIKE < position.misfit:
        return None
    if by_input.misfit > ALIKE * position.misfit:
        return [], None
    if shows_friction and position.level_fits and not by_input.level_fits:
        return [], {"name": name, "factor": by_input.factor, "level": by_input.level}
    line = case.log.scale_lines({name: by_input.factor}, case.spec)
    return [f"{name} is {by_input.factor:.3g} times too small ({line})"], None


def _wrong_time(case: Case) -> Finding | None:
    """A warning that the time is too long by a factor; None if no factor balances the forces.

    One factor must balance them on every coordinate. It is not reported where other masses alone do so as well, or
    inputs that act later: by a delay T a spring k looks like a damping k T and a mass k T²/2 in addition.
    """
    forces, spec, log = case.forces, case.spec, case.log
    each = [forces.inertia_factor(j) for j in range(len(spec.coordinates))]
    factors = [inertia for inertia, correlation in each if correlation > INERTIA_SHOWN and inertia > 0]
    if not factors or all(1 / APPARENT < inertia < APPARENT for inertia in factors):
        return None

    def worst(along: Forces, mass: float = 1.0) -> Explanation:
        return max((_balance(along, j, mass=mass) for j in range(len(each))), key=lambda one: one.misfit)

    def shortened(factor: float) -> Forces:
        """The forces of the same path run through in 1/factor of the time."""
        m = case.motion
        v, a, threshold = m.velocities * factor, m.accelerations * factor**2, m.threshold * factor
        return case.balance.along(log, replace(m, velocities=v, accelerations=a, threshold=threshold))

    middle = float(np.median(factors))
    plain, time = worst(forces), _best(lambda factor: worst(shortened(factor)), float(np.sqrt(middle)))
    by_mass = _best(lambda factor: worst(forces, mass=1 / factor), 1 / middle)
    explains = time.misfit <= min(EXPLAINED, MUCH_LESS * plain.misfit) and time.level_fits
    if not explains:
        return None
    delayed = (_best(lambda delay: worst(_acting_later(case, delay)), about) for about in DELAYS)
    if any(other.misfit <= ALIKE * time.misfit for other in chain([by_mass], delayed)):
        return None
    c, rate = time.factor, 1 / log.sample_time
    # Of fewest digits: 500 for 498.4.
    likely = next(r for n in range(1, 5) if abs((r := float(f"{rate * c:.{n}g}")) / (rate * c) - 1) <= RATE_KNOWN)
    stamped = "t" in log.raw_data.columns
    line = log.scale_lines({"t": rate / likely}, spec) if stamped else f"`sample_rate_hz: {likely:g}`"
    figures = {"factor": c, "misfit": plain.misfit, "misfit_scaled": time.misfit, "misfit_by_mass": by_mass.misfit}
    given = {"c": c, "rate": rate, "likely": likely, "mass": 1 / by_mass.factor, "line": line}
    given |= {"plain": plain.misfit, "left": time.misfit, "by_mass": by_mass.misfit}
    return Finding.worded("warning", SCALE_OF_TIME, "scales", "time", figures, **given)


def _acting_later(case: Case, delay: float) -> Forces:
    """The forces with inputs that act later by a delay in s."""
    rows = delay / case.log.sample_time
    inputs = np.column_stack([earlier(values, -rows) for values in case.log.inputs.T])
    return case.balance.along(replace(case.log, inputs=inputs), case.motion)


def _balance(forces: Forces, j: int, given: float = 1.0, mass: float = 1.0) -> Explanation:
    """The unbalanced share on coordinate j with the friction level fitted, with these factors on input and inertia."""
    push, inertia, friction = given * forces.applied[:, j], mass * forces.inertia[:, j], forces.friction[:, j]
    other = inertia - (forces.undriven[:, j] + friction)
    size = float(friction @ friction)
    level = float(friction @ (push - other)) / size if size > 0 else 1.0
    rest = push - other - level * friction
    power = float(push @ push + inertia @ inertia + (other - inertia) @ (other - inertia)) + level**2 * size
    return Explanation(1.0, float(rest @ rest) / power if power > 0 else 1.0, level)


def _best(corrected: Callable[[float], Explanation], start: float) -> Explanation:
    """The explanation with the least unbalanced share, for a factor within ``ABOUT`` of ``start``."""
    ends = np.log(start) - np.log(ABOUT), np.log(start) + np.log(ABOUT)
    options = {"xatol": TOLERANCE}
    found = minimize_scalar(
        lambda p: corrected(float(np.exp(p))).misfit, bounds=ends, method="bounded", options=options
    )
    factor = float(np.exp(found.x))
    best = corrected(factor)
    return Explanation(factor, best.misfit, best.level)


def _gear_ratio(spec: Spec, factor: float) -> tuple[str, float]:
    """The dimensionless parameter whose value or inverse is near a factor, and this ratio; else "" and the factor."""
    for p in spec.parameters:
        if p.unit in ("", "1") and p.value:
            for ratio in (float(p.value), 1 / float(p.value)):
                if abs(ratio / factor - 1) < NEAR:
                    return p.name, ratio
    return "", factor
