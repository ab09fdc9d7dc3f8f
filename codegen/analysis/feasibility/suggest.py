"""Suggested gains: the fastest error decay within bounds on noise and gain margin, by random search; written into the
author's own text with its comments kept.
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
SCATTERED = 3000
"""Random sets of the first search over three or more axes."""
LOCAL, LOCAL_ROUNDS = 200, 10
"""Random sets around the best one in each round, and number of rounds."""
WIDEST, NARROWING = 0.2, 0.68
"""Half width of the first of these rounds, as a share of each range, and its ratio from round to round."""
CHUNK = 100
"""Sets whose gain margin is checked together, from the fastest on."""
DIGITS = 3
"""Significant digits of the suggested numbers."""


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
    """Evaluated gain sets: shares of the ranges, radius and noise share of each."""

    shares: Array
    radius: Array
    noise: Array


def suggest(family: Family, noise: NoiseModel, base: Settings, axes: Sequence[GainAxis]) -> Suggestion | NothingStable:
    """Search over all axes together: first the whole range, then around the best.

    Args:
        base: one gain set; the axes' numbers replace its values.
    """
    generator = np.random.default_rng(3)
    evaluated = _evaluated(family, noise, base, axes, _first(len(axes), generator))
    tried = len(evaluated.shares)
    best, rule = _best(family, base, axes, evaluated)
    for k in range(LOCAL_ROUNDS):
        width = WIDEST * NARROWING**k
        around = best + generator.uniform(-width, width, (LOCAL, len(axes)))
        more = _evaluated(family, noise, base, axes, np.vstack([best, np.clip(around, 0, 1)]))
        tried += LOCAL
        better, found = _best(family, base, axes, more)
        if rule != "fastest" or found == "fastest":
            best, rule = better, found
    settings = _sets(base, axes, best[None, :])
    if rule == "none":
        return NothingStable(settings, tried)
    claimed = joined([settings, *_scaled(settings, axes)]) if rule == "fastest" else settings
    surprises = ~stable(family, "sampled", claimed, True)
    if surprises.any():
        family.focus(claimed.rows(surprises))  # unstable at a point that was not evaluated: repeat with it
        return suggest(family, noise, base, axes)
    numbers = {axis.name: float(_numbers(axis, best[[k]])[0]) for k, axis in enumerate(axes)}
    return Suggestion(numbers, settings, rule, tried)


def divided(family: Family, axes: Sequence[GainAxis], suggestion: Suggestion, divisor: int) -> Suggestion:
    """The suggestion with all its numbers divided; as it was where that set is unstable or has not the gain margin."""
    numbers = suggestion.over(divisor)
    settings = suggestion.settings
    for axis in axes:
        settings = settings.along(axis, numbers[axis.name])
    claimed = joined([settings, *_scaled(settings, axes)]) if suggestion.rule == "fastest" else settings
    if not stable(family, "sampled", claimed, True).all():
        return suggestion
    return replace(suggestion, numbers=numbers, settings=settings, divisor=divisor)


def wide_margin(family: Family, base: Settings, axes: Sequence[GainAxis]) -> NDArray[np.bool_]:
    """Whether each set stays stable when any one axis is doubled or halved."""
    held = np.ones(len(base), dtype=bool)
    for moved in _scaled(base, axes):
        held &= stable(family, "sampled", moved)
    return held


def _scaled(base: Settings, axes: Sequence[GainAxis]) -> list[Settings]:
    """The sets with one axis multiplied or divided by ``GAIN_FACTOR``, for each axis."""
    factors = (GAIN_FACTOR, 1 / GAIN_FACTOR)
    return [base.along(axis, factor * base.numbers(axis)) for axis in axes for factor in factors]


def _first(count: int, generator: np.random.Generator) -> Array:
    """Initial shares: a line, a grid, or random."""
    if count == 1:
        return np.linspace(0, 1, LINE)[:, None]
    if count == 2:
        line = np.linspace(0, 1, GRID)
        return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    return generator.uniform(0, 1, (SCATTERED, count))


def _numbers(axis: GainAxis, shares: Array) -> Array:
    """Numbers of three digits within the range."""
    rounded = np.array([float(f"{v:.{DIGITS}g}") for v in np.atleast_1d(axis.at(shares))])
    clipped: Array = np.clip(rounded, axis.low, axis.high)
    return clipped


def _sets(base: Settings, axes: Sequence[GainAxis], shares: Array) -> Settings:
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
    """The best candidate and the rule: "fastest", "product" or "none"."""
    h = float(base.sample_time[0])
    decay = -np.log(np.clip(evaluated.radius, 1e-12, None)) / h
    eligible = np.flatnonzero((evaluated.radius < 1) & (evaluated.noise <= NOISE_SHARE))
    eligible = eligible[np.argsort(-decay[eligible], kind="stable")]
    for start in range(0, len(eligible), CHUNK):
        chunk = eligible[start : start + CHUNK]
        chunk = chunk[wide_margin(family, _sets(base, axes, evaluated.shares[chunk]), axes)]
        if len(chunk):
            as_fast = chunk[decay[chunk] >= AS_FAST * decay[chunk].max()]
            return evaluated.shares[as_fast[evaluated.noise[as_fast].argmin()]], "fastest"
    good = np.flatnonzero(evaluated.radius < 1)
    if len(good):
        product = evaluated.noise[good] / decay[good]  # infinite for all where the noise has no finite gain
        return evaluated.shares[good[np.lexsort((evaluated.radius[good], product))[0]]], "product"
    return evaluated.shares[int(evaluated.radius.argmin())], "none"


WRITTEN_DIGITS = 6


def suggested_text(spec: Spec, axes: Sequence[GainAxis], suggestion: Suggestion) -> str:
    """The spec's text with the suggested gains in place of the free or chosen ones, and a comment."""
    document, _ = load_mapping(spec.text, str(spec.path))
    section = document["observer"]
    gains = section["gains"]
    before = {(e.gain, e.path): e.value for e in gain_entries(spec.required_observer.gains)}
    for axis in axes:
        for (gain, path), weight in axis.entries.items():
            _place(gains, (gain, *path), _plain(weight * suggestion.numbers[axis.name]))
    for name in dict.fromkeys(gain for axis in axes for gain, _ in axis.entries):
        was = ", ".join(_words(value) for (gain, _), value in before.items() if gain == name)
        _comment(section, gains, name, f"{name} suggested by stiction gains, was {was}")
    return changed_text(spec.text, document)


def _place(gains: CommentedMap, keys: tuple[Any, ...], number: float | int) -> None:
    """Write a number at gains[k][k]…."""
    parent: CommentedMap | CommentedSeq = gains
    for key in keys[:-1]:
        parent = parent[key]
    parent[keys[-1]] = number


def _comment(section: CommentedMap, gains: CommentedMap, name: str, note: str) -> None:
    """Append a comment to the gain, or after the whole mapping where it is on one line; old comments stay."""
    parent, key = (section, "gains") if gains.fa.flow_style() else (gains, name)
    tokens = [t for t in (parent.ca.items.get(key) or []) if t is not None and not isinstance(t, list)]
    words = "; ".join(t.value.strip().lstrip("# ") for t in tokens if t.value.strip())
    parent.yaml_add_eol_comment(f"{words}; {note}" if words else note, key, column=0)


def _words(value: Any) -> str:
    return f"free {float(value.low):g} to {float(value.high):g}" if isinstance(value, FreeGain) else str(value)


def _plain(value: float) -> float | int:
    short = float(f"{value:.{WRITTEN_DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 1e6 else short
