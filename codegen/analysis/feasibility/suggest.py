"""Suggested gains by random search, and the spec's text with them.

The search maximises the decay rate −ln(max |z|)/h of the sampled error, z the eigenvalues of I + hA at all operating
points, subject to a bound on the noise of the friction estimate and a gain margin. Candidates are shares 0…1 of the
axes' ranges, (sets, axes): the axes have different units, and some are logarithmic.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from codegen.analysis.feasibility.axes import GainAxis
from codegen.analysis.feasibility.family import Family, Settings, joined
from codegen.analysis.feasibility.noise import NoiseModel
from codegen.analysis.feasibility.region import GRID, LINE, stable
from codegen.base.arrays import Array
from codegen.spec.free_gains import gain_entries
from codegen.spec.model import FreeGain, Spec
from codegen.spec.yaml_text import changed_text, load_mapping

NOISE_SHARE = 0.05
"""Largest RMS noise of a friction estimate over its friction level."""
GAIN_FACTOR = 2.0
"""Gain margin: each axis alone may be multiplied or divided by this factor (6 dB) without losing stability."""
AS_FAST = 0.98
"""Sets whose decay rate is at least this share of the best count as equally fast; the least noise decides."""
SEED = 3
"""Of the random sets: the same spec gets the same suggestion."""
SCATTERED = 3000
"""Random sets of the first search over three or more axes."""
LOCAL, LOCAL_ROUNDS = 200, 10
"""Random sets around the best one in each round, and number of rounds."""
WIDEST, NARROWING = 0.2, 0.68
"""Half width of the first of these rounds, as a share of each range, and its ratio from round to round."""
CHUNK = 100
"""Sets whose gain margin is checked together, from the fastest on: the check evaluates two further sets an axis, and
the first chunk mostly has a set that passes."""
LEAST_RADIUS = 1e-12
"""Replaces a smaller radius, so that a deadbeat set (all z = 0) has a finite decay rate."""
DIGITS = 3
"""Significant digits of the suggested numbers."""
WRITTEN_DIGITS = 6
"""Significant digits of a gain in the spec: weight times a number of three digits, without rounding noise."""


@dataclass(frozen=True)
class Suggestion:
    """A gain set and the rule by which it was chosen.

    Attributes:
        numbers: axis name → number, to three digits.
        rule: "fastest": the fastest decay within both bounds, on noise and gain margin; "product": no set of the
            range is within both bounds, so the least product of noise and decay time.
        tried: gain sets evaluated.
        divisor: of all numbers, after the rule had chosen them.
    """

    numbers: Mapping[str, float]
    settings: Settings
    rule: str
    tried: int
    divisor: int = 1

    def over(self, divisor: int) -> dict[str, float]:
        """All numbers divided, to three digits."""
        return {name: float(f"{number / divisor:.{DIGITS}g}") for name, number in self.numbers.items()}


@dataclass(frozen=True)
class NothingStable:
    """No evaluated gain set is stable; ``settings`` is the one whose error grows least."""

    settings: Settings
    tried: int


@dataclass(frozen=True)
class _Candidates:
    """Evaluated gain sets.

    Attributes:
        shares: (sets, axes), 0…1 of each axis' range.
        radius: (sets,) largest |z| over the operating points; stable below 1.
        noise: (sets,) RMS noise of the friction estimate over its level; infinite where unstable.
    """

    shares: Array
    radius: Array
    noise: Array


def suggest(family: Family, noise: NoiseModel, base: Settings, axes: Sequence[GainAxis]) -> Suggestion | NothingStable:
    """Random search over all axes together: first the whole range, then shrinking boxes around the best set.

    Args:
        base: one gain set; the axes' numbers replace its values.
    """
    generator = np.random.default_rng(SEED)
    candidates = _evaluated(family, noise, base, axes, _initial_shares(len(axes), generator))
    tried = len(candidates.shares)
    best, rule = _best(family, base, axes, candidates)
    for k in range(LOCAL_ROUNDS):
        width = WIDEST * NARROWING**k
        around = best + generator.uniform(-width, width, (LOCAL, len(axes)))
        candidates = _evaluated(family, noise, base, axes, np.vstack([best, np.clip(around, 0, 1)]))
        tried += LOCAL
        local_best, local_rule = _best(family, base, axes, candidates)
        if rule != "fastest" or local_rule == "fastest":  # a set within both bounds is never given up
            best, rule = local_best, local_rule
    settings = _sets(base, axes, best[None, :])
    if rule == "none":
        return NothingStable(settings, tried)
    # The search evaluated the deciding operating points only. What the suggestion claims is checked at every point;
    # a point that contradicts it becomes a deciding one, and the search starts again.
    claimed = _claimed(settings, axes, rule)
    unstable = ~stable(family, "sampled", claimed, every=True)
    if unstable.any():
        family.focus(claimed.rows(unstable))
        return suggest(family, noise, base, axes)
    numbers = {axis.name: float(_numbers(axis, best[[k]])[0]) for k, axis in enumerate(axes)}
    return Suggestion(numbers, settings, rule, tried)


def divided(family: Family, axes: Sequence[GainAxis], suggestion: Suggestion, divisor: int) -> Suggestion:
    """The suggestion with all its numbers divided; unchanged where the divided set would not keep its claims.

    These are checked again, since a smaller gain can be less stable.
    """
    numbers = suggestion.over(divisor)
    settings = suggestion.settings
    for axis in axes:
        settings = settings.along(axis, numbers[axis.name])
    if not stable(family, "sampled", _claimed(settings, axes, suggestion.rule), every=True).all():
        return suggestion
    return replace(suggestion, numbers=numbers, settings=settings, divisor=divisor)


def wide_margin(family: Family, base: Settings, axes: Sequence[GainAxis]) -> NDArray[np.bool_]:
    """Whether each set has the gain margin: stable when any one axis is multiplied or divided by ``GAIN_FACTOR``."""
    has_margin = np.ones(len(base), dtype=bool)
    for scaled in _scaled(base, axes):
        has_margin &= stable(family, "sampled", scaled)
    return has_margin


def _claimed(settings: Settings, axes: Sequence[GainAxis], rule: str) -> Settings:
    """The sets that a suggestion says are stable: itself, and under "fastest" those of its gain margin."""
    return joined([settings, *_scaled(settings, axes)]) if rule == "fastest" else settings


def _scaled(base: Settings, axes: Sequence[GainAxis]) -> list[Settings]:
    """The sets with one axis multiplied or divided by ``GAIN_FACTOR``, for each axis."""
    factors = (GAIN_FACTOR, 1 / GAIN_FACTOR)
    return [base.along(axis, factor * base.numbers(axis)) for axis in axes for factor in factors]


def _initial_shares(axis_count: int, generator: np.random.Generator) -> Array:
    """(sets, axes) shares over the whole range: a line, a grid, or random where a grid would need too many sets."""
    if axis_count == 1:
        return np.linspace(0, 1, LINE)[:, None]
    if axis_count == 2:
        line = np.linspace(0, 1, GRID)
        return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    return generator.uniform(0, 1, (SCATTERED, axis_count))


def _numbers(axis: GainAxis, shares: Array) -> Array:
    """The numbers that are evaluated and suggested: of ``DIGITS`` digits, within the range."""
    rounded = np.array([float(f"{v:.{DIGITS}g}") for v in np.atleast_1d(axis.at(shares))])
    clipped: Array = np.clip(rounded, axis.low, axis.high)
    return clipped


def _sets(base: Settings, axes: Sequence[GainAxis], shares: Array) -> Settings:
    """The gain sets at shares (sets, axes) of the ranges; gains without an axis as in ``base``."""
    for k, axis in enumerate(axes):
        base = base.along(axis, _numbers(axis, shares[:, k]))
    return base


def _evaluated(
    family: Family, noise: NoiseModel, base: Settings, axes: Sequence[GainAxis], shares: Array
) -> _Candidates:
    settings = _sets(base, axes, shares)
    radius = family.worst("sampled", settings)
    return _Candidates(shares, radius, noise.share(settings, radius < 1))


def _best(family: Family, base: Settings, axes: Sequence[GainAxis], evaluated: _Candidates) -> tuple[Array, str]:
    """Shares (axes,) of the best candidate, and the rule that chose it.

    "fastest": within the bounds on noise and gain margin, of the fastest ones that with the least noise; "product": no
    set is within both, so the least noise/decay rate; "none": no set is stable, so the least radius.
    """
    h = float(base.sample_time[0])
    decay_rate = -np.log(np.clip(evaluated.radius, LEAST_RADIUS, None)) / h
    quiet = np.flatnonzero((evaluated.radius < 1) & (evaluated.noise <= NOISE_SHARE))
    fastest_first = quiet[np.argsort(-decay_rate[quiet], kind="stable")]
    for start in range(0, len(fastest_first), CHUNK):
        chunk = fastest_first[start : start + CHUNK]
        passed = chunk[wide_margin(family, _sets(base, axes, evaluated.shares[chunk]), axes)]
        if len(passed):
            as_fast = passed[decay_rate[passed] >= AS_FAST * decay_rate[passed].max()]
            quietest = as_fast[evaluated.noise[as_fast].argmin()]
            return evaluated.shares[quietest], "fastest"
    good = np.flatnonzero(evaluated.radius < 1)
    if len(good):
        product = evaluated.noise[good] / decay_rate[good]
        # The product is infinite for all sets where the noise has no finite gain; the radius then decides.
        least = good[np.lexsort((evaluated.radius[good], product))[0]]
        return evaluated.shares[least], "product"
    return evaluated.shares[int(evaluated.radius.argmin())], "none"


def suggested_text(spec: Spec, axes: Sequence[GainAxis], suggestion: Suggestion) -> str:
    """The spec's text with the suggested gains in place of the free or chosen ones, and a comment with the old values.

    The text is changed as a YAML tree that keeps the author's comments, order and quotes.
    """
    document, _ = load_mapping(spec.text, str(spec.path))
    section = document["observer"]
    gains = section["gains"]
    before = {(entry.gain, entry.path): entry.value for entry in gain_entries(spec.required_observer.gains)}
    for axis in axes:
        for (gain, path), weight in axis.entries.items():
            _set_at(gains, (gain, *path), _as_written(weight * suggestion.numbers[axis.name]))
    for name in dict.fromkeys(gain for axis in axes for gain, _ in axis.entries):
        was = ", ".join(_words(value) for (gain, _), value in before.items() if gain == name)
        _comment(section, gains, name, f"{name} suggested by stiction gains, was {was}")
    return changed_text(spec.text, document)


def _set_at(gains: CommentedMap, keys: tuple[Any, ...], number: float | int) -> None:
    """gains[keys[0]][keys[1]]… = number."""
    parent: CommentedMap | CommentedSeq = gains
    for key in keys[:-1]:
        parent = parent[key]
    parent[keys[-1]] = number


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


def _words(value: Any) -> str:
    return f"free {float(value.low):g} to {float(value.high):g}" if isinstance(value, FreeGain) else str(value)


def _as_written(value: float) -> float | int:
    """The number as a person would write it in the spec: 500, not 500.0 or 499.9999999999999."""
    short = float(f"{value:.{WRITTEN_DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 10**WRITTEN_DIGITS else short
