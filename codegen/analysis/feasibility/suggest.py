"""Gain suggestion by random search, and the spec's text with the suggested gains.

The search maximises the decay rate −ln(max |z|)/h of the sampled error, z the eigenvalues of I + hA at all operating
points, subject to a bound on the noise of the friction estimate and a gain margin. Candidates are shares 0…1 of the
axes' ranges, (sets, axes): the axes have different units, and some are logarithmic.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import getitem

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml.comments import CommentedMap

from codegen.analysis.feasibility.axes import GainAxis
from codegen.analysis.feasibility.gain_dynamics import GainDynamics, Settings, joined
from codegen.analysis.feasibility.noise import NoiseModel
from codegen.analysis.feasibility.region import GRID, LINE, stable
from codegen.base.arrays import Array
from codegen.spec.free_gains import gain_entries
from codegen.spec.model import FreeGain, Spec
from codegen.spec.yaml_text import changed_text, load_mapping

NOISE_SHARE = 0.05
"""Bound on the ratio of a friction estimate's RMS noise to the friction level."""
GAIN_FACTOR = 2.0
"""Gain margin: each axis alone may be multiplied or divided by this factor (6 dB) without losing stability."""
AS_FAST = 0.98
"""Sets whose decay rate is at least this share of the best count as equally fast; the least noise then decides."""
SEED = 3
"""Seed of the random sets: the same spec gets the same suggestion."""
SCATTERED = 3000
"""Random sets of the first search over three or more axes."""
LOCAL, LOCAL_ROUNDS = 200, 10
"""Random sets around the best one in each round, and number of rounds."""
WIDEST, NARROWING = 0.2, 0.68
"""Half width of the first of these rounds, as a share of each range, and its ratio from round to round."""
CHUNK = 100
"""Number of sets whose gain margin is checked at a time, the fastest first; mostly one of the first passes."""
LEAST_RADIUS = 1e-12
"""Lower limit of a radius, so that a deadbeat set (all z = 0) has a finite decay rate."""
USEFUL = 0.2
"""Ratio of the certified error bound to the friction up to which no slower gains are suggested."""
DIGITS = 3
"""Significant digits of the suggested numbers."""
WRITTEN_DIGITS = 6
"""Significant digits of a gain in the spec, which removes rounding errors of weight · number."""


@dataclass(frozen=True)
class Suggestion:
    """A gain set and the rule by which it was chosen.

    Attributes:
        numbers: axis name → value, to three digits.
        rule: "fastest": the fastest decay that satisfies the bounds on noise and gain margin; "product": no set in the
            range satisfies both, so the least product of noise and decay time.
        tried: number of gain sets evaluated.
        divisor: by which all numbers were divided after the search.
        kept: whether these are the spec's own gains, since the search found nothing better by the same rule.
    """

    numbers: Mapping[str, float]
    settings: Settings
    rule: str
    tried: int
    divisor: int = 1
    kept: bool = False

    def over(self, divisor: int) -> dict[str, float]:
        """Axis name → value divided by ``divisor``, to three digits."""
        return {name: float(f"{number / divisor:.{DIGITS}g}") for name, number in self.numbers.items()}


@dataclass(frozen=True)
class NothingStable:
    """Result of a search in which no gain set is stable; ``settings`` is the set whose error grows least."""

    settings: Settings
    tried: int


def suggest(
    dynamics: GainDynamics, noise: NoiseModel, base: Settings, axes: Sequence[GainAxis]
) -> Suggestion | NothingStable:
    """Random search over all axes: first in the whole range, then in shrinking boxes around the best set.

    ``base``: one gain set, with the gains that have no axis.
    """
    generator = np.random.default_rng(SEED)
    shares = _initial_shares(len(axes), generator)
    tried = len(shares)
    best, rule = _best(dynamics, noise, base, axes, shares)
    for k in range(LOCAL_ROUNDS):
        width = WIDEST * NARROWING**k
        around = best + generator.uniform(-width, width, (LOCAL, len(axes)))
        tried += LOCAL
        local_best, local_rule = _best(dynamics, noise, base, axes, np.vstack([best, np.clip(around, 0, 1)]))
        if rule != "fastest" or local_rule == "fastest":  # a set that satisfies both bounds is kept
            best, rule = local_best, local_rule
    settings = _sets(base, axes, best[None, :])
    if rule == "none":
        return NothingStable(settings, tried)
    # The search evaluated the deciding operating points only. The suggestion is checked at every point; points at which
    # it is unstable become deciding ones, and the search is repeated.
    claimed = _claimed(settings, axes, rule)
    unstable = ~stable(dynamics, "sampled", claimed, every=True)
    if unstable.any():
        dynamics.focus(claimed.rows(unstable))
        return suggest(dynamics, noise, base, axes)
    numbers = {axis.name: float(_numbers(axis, best[[k]])[0]) for k, axis in enumerate(axes)}
    return Suggestion(numbers, settings, rule, tried)


def divided(dynamics: GainDynamics, axes: Sequence[GainAxis], suggestion: Suggestion, divisor: int) -> Suggestion:
    """The suggestion with all numbers divided; unchanged if the divided set is unstable or lacks the gain margin."""
    numbers = suggestion.over(divisor)
    settings = suggestion.settings
    for axis in axes:
        settings = settings.along(axis, numbers[axis.name])
    if not stable(dynamics, "sampled", _claimed(settings, axes, suggestion.rule), every=True).all():
        return suggestion
    return replace(suggestion, numbers=numbers, settings=settings, divisor=divisor)


def own_or_found(
    dynamics: GainDynamics,
    noise: NoiseModel,
    axes: Sequence[GainAxis],
    own: Settings,
    found: Suggestion,
    bound_share: Callable[[Mapping[str, float]], float | None],
) -> Suggestion:
    """The spec's own gains where the set found is not better by more than 2 % (``AS_FAST``); else that set.

    So a suggestion that is written into the spec is suggested again, though the search around it has other ranges.
    The order is the one of the search: within the bounds on noise and gain margin before outside, a useful certified
    bound before another one, then the decay rate, the smaller bound, or the product of noise and decay time.
    ``bound_share``: numbers → certified error bound over the friction; None if it is unknown.
    """
    both = joined([own, found.settings])
    radius = dynamics.worst("sampled", both, True)
    if radius[0] >= 1:
        return found
    numbers = {axis.name: float(own.numbers(axis)[0]) for axis in axes}
    (own_noise, found_noise), (own_rate, found_rate) = noise.share(both, radius < 1), -np.log(radius)
    quiet = own_noise <= NOISE_SHARE and stable(dynamics, "sampled", _claimed(own, axes, "fastest"), every=True).all()
    kept = Suggestion(numbers, own, "fastest" if quiet else "product", found.tried, kept=True)
    if kept.rule != found.rule:
        return kept if quiet else found
    found_bound = bound_share(found.numbers)
    if found_bound is not None:
        own_bound = bound_share(numbers)
        if own_bound is None or (own_bound <= USEFUL) != (found_bound <= USEFUL):
            return found if own_bound is None or own_bound > USEFUL else kept
        if own_bound > USEFUL:
            return kept if AS_FAST * own_bound <= found_bound else found
    if quiet or not np.isfinite([own_noise, found_noise]).all():
        return kept if own_rate >= AS_FAST * found_rate else found
    return kept if AS_FAST * own_noise / own_rate <= found_noise / found_rate else found


def wide_margin(dynamics: GainDynamics, base: Settings, axes: Sequence[GainAxis]) -> NDArray[np.bool_]:
    """Whether each set has the gain margin ``GAIN_FACTOR`` on every axis, (sets,)."""
    has_margin = np.ones(len(base), dtype=bool)
    for scaled in _scaled(base, axes):
        has_margin &= stable(dynamics, "sampled", scaled)
    return has_margin


def _claimed(settings: Settings, axes: Sequence[GainAxis], rule: str) -> Settings:
    """The sets that must be stable for a suggestion: itself, and under "fastest" the ends of its gain margins."""
    return joined([settings, *_scaled(settings, axes)]) if rule == "fastest" else settings


def _scaled(base: Settings, axes: Sequence[GainAxis]) -> list[Settings]:
    """The sets with one axis multiplied or divided by ``GAIN_FACTOR``, for each axis."""
    factors = (GAIN_FACTOR, 1 / GAIN_FACTOR)
    return [base.along(axis, factor * base.numbers(axis)) for axis in axes for factor in factors]


def _initial_shares(axis_count: int, generator: np.random.Generator) -> Array:
    """Shares (sets, axes) over the whole range: a line for one axis, a grid for two, random for more."""
    if axis_count == 1:
        return np.linspace(0, 1, LINE)[:, None]
    if axis_count == 2:
        line = np.linspace(0, 1, GRID)
        return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    return generator.uniform(0, 1, (SCATTERED, axis_count))


def _numbers(axis: GainAxis, shares: Array) -> Array:
    """Values of an axis at shares, rounded to ``DIGITS`` digits and clipped to the range."""
    rounded = np.array([float(f"{v:.{DIGITS}g}") for v in np.atleast_1d(axis.at(shares))])
    clipped: Array = np.clip(rounded, axis.low, axis.high)
    return clipped


def _sets(base: Settings, axes: Sequence[GainAxis], shares: Array) -> Settings:
    """The gain sets at shares (sets, axes) of the ranges; gains without an axis as in ``base``."""
    for k, axis in enumerate(axes):
        base = base.along(axis, _numbers(axis, shares[:, k]))
    return base


def _best(
    dynamics: GainDynamics, noise: NoiseModel, base: Settings, axes: Sequence[GainAxis], shares: Array
) -> tuple[Array, str]:
    """Shares (axes,) of the best of the sets with ``shares`` (sets, axes), and the rule that chose it.

    "fastest": of the sets that satisfy the bounds on noise and gain margin, those with the fastest decay, and of these
    the one with the least noise; "product": no set satisfies both, so the least noise/decay rate; "none": no set is
    stable, so the least radius.
    """
    sets, h = _sets(base, axes, shares), float(base.sample_time[0])
    radius = dynamics.worst("sampled", sets)
    noise_share = noise.share(sets, radius < 1)
    decay_rate = -np.log(np.clip(radius, LEAST_RADIUS, None)) / h
    quiet = np.flatnonzero((radius < 1) & (noise_share <= NOISE_SHARE))
    fastest_first = quiet[np.argsort(-decay_rate[quiet], kind="stable")]
    for start in range(0, len(fastest_first), CHUNK):
        chunk = fastest_first[start : start + CHUNK]
        passed = chunk[wide_margin(dynamics, sets.rows(chunk), axes)]
        if len(passed):
            as_fast = passed[decay_rate[passed] >= AS_FAST * decay_rate[passed].max()]
            quietest = as_fast[noise_share[as_fast].argmin()]
            return shares[quietest], "fastest"
    good = np.flatnonzero(radius < 1)
    if len(good):
        product = noise_share[good] / decay_rate[good]
        # If the noise is infinite, the product is so for all sets; the radius then decides.
        least = good[np.lexsort((radius[good], product))[0]]
        return shares[least], "product"
    return shares[int(radius.argmin())], "none"


def suggested_text(spec: Spec, axes: Sequence[GainAxis], suggestion: Suggestion) -> str:
    """The spec's text with the suggested gains, and a comment with the old values; other text is unchanged."""
    if suggestion.kept:
        return spec.text
    document, _ = load_mapping(spec.text, str(spec.path))
    section = document["observer"]
    gains = section["gains"]
    before = {(entry.gain, entry.path): entry.value for entry in gain_entries(spec.required_observer.gains)}
    for axis in axes:
        for (gain, path), weight in axis.entries.items():
            *above, last = gain, *path
            number = float(f"{weight * suggestion.numbers[axis.name]:.{WRITTEN_DIGITS}g}")  # not 499.9999999999999
            whole = number.is_integer() and abs(number) < 10**WRITTEN_DIGITS
            reduce(getitem, above, gains)[last] = int(number) if whole else number
    for name in dict.fromkeys(gain for axis in axes for gain, _ in axis.entries):
        values = (value for (gain, _), value in before.items() if gain == name)
        was = ", ".join(f"free {float(v.low):g} to {float(v.high):g}" if isinstance(v, FreeGain) else v for v in values)
        _comment(section, gains, name, f"{name} suggested by stiction gains, was {was}")
    return changed_text(spec.text, document)


def _comment(section: CommentedMap, gains: CommentedMap, name: str, note: str) -> None:
    """Append a comment to the gain, or after the whole mapping where it is on one line; old comments stay.

    ruamel.yaml keeps one comment at the end of a line and would replace it, so the old one is read and put in front.
    """
    parent, key = (section, "gains") if gains.fa.flow_style() else (gains, name)
    # One slot for each position of a comment around the key: None, a token, or a list of comments on lines above.
    slots = parent.ca.items.get(key) or []
    tokens = [slot for slot in slots if slot is not None and not isinstance(slot, list)]
    old = "; ".join(token.value.strip().lstrip("# ") for token in tokens if token.value.strip())
    parent.yaml_add_eol_comment(f"{old}; {note}" if old else note, key, column=0)
