"""The models that may be written, in order of preference, and their check on held-out data.

On these a model may be worse neither than the declared one nor than the refit. The held-out log chooses nothing; it can
only refuse options, whose order is by the training log.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np

from codegen.base.text import render
from codegen.diagnosis.evidence.adoption import SAME, Refit
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import TIE_LEVEL, random_signs
from codegen.diagnosis.fit.drive import drive_gain, drive_left
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.trial import in_unit, with_values
from codegen.diagnosis.results import ErrorFigures, Fact
from codegen.diagnosis.verdict.answer import Answer
from codegen.mechanics.system import System

FORCE, RUN = "residual force", "simulation error"
AS_DECLARED = "declared values"
REFIT_WORSE = 0.05
"""Share by which an effect may increase either error over that of the refit, which noise can cause."""
FALLS = 1 - REFIT_WORSE
"""Ratio of errors up to which an error counts as smaller."""
UNSEEN = 1e-3
"""Relative change of both errors up to which an effect counts as not acting on the held-out data."""
MOST_VALUES = 4
"""Largest number of refused values in a message."""
Measured = Callable[[System], ErrorFigures]
"""Errors of a system on held-out data."""
Option = tuple[str, System]
"""A model that may be written, with its description."""


@dataclass(frozen=True)
class Refusal:
    """An option that held-out data refuse, compared with a ``model`` ("as declared", "without the effect on j1").

    Attributes:
        worse: criterion → error over that model's; empty if the reason is that no error is sufficiently smaller.
    """

    option: str
    model: str
    worse: Mapping[str, float] = field(default_factory=dict)

    @property
    def test(self) -> tuple[str, tuple[str, ...]]:
        """The test that refuses it: the model, and the criteria that are worse."""
        return self.model, tuple(self.worse)


def merged(
    refusals: Sequence[Refusal], say: Literal["against", "written"] = "against", all_refitted: bool = True
) -> tuple[Fact, ...]:
    """Refusals in words, one fact for each test; that of most options first.

    Args:
        all_refitted: whether all refitted values are refused, if they are one test.
    """
    tests: dict[tuple[str, tuple[str, ...]], list[Refusal]] = {}
    for one in refusals:
        tests.setdefault(one.test, []).append(one)
    facts = []
    for (model, criteria), group in sorted(tests.items(), key=lambda item: -len(item[1])):
        given: dict[str, Any] = {
            "model": model,
            "least": 1 - FALLS,
            "every": len(group) == len(refusals) and all_refitted,
        }
        given |= {"worse": {name: [one.worse[name] for one in group] for name in criteria}}
        given |= {"options": [one.option for one in group]}
        words, detail = (render("text/refusal.j2", say=asked, **given).strip() for asked in (say, "detail"))
        facts.append(Fact("not accepted" if say == "against" else "spec.yaml", words, detail))
    return tuple(facts)


@dataclass(frozen=True, eq=False)
class Admitted:
    """The first option that held-out data do not refuse.

    Attributes:
        option: None if all are refused; ``figures`` are then of the first.
        refusals: of the options before it.
    """

    option: Option | None
    figures: ErrorFigures
    refusals: tuple[Refusal, ...]

    @property
    def remarks(self) -> tuple[Fact, ...]:
        """Facts on values that held-out data refuse, with the values that are written instead."""
        facts = merged(self.refusals, "written", self.option is not None and self.option[0] == AS_DECLARED)
        if not facts or self.option is None:
            return facts
        instead = f"Written instead: {self.option[0]}."
        return (*facts[:-1], replace(facts[-1], words=f"{facts[-1].words} {instead}"))


def refused_values(refused: System, declared: System) -> tuple[Fact, ...]:
    """A fact on the values of a refit that is not written, those that change most first; empty if none changes.

    Held-out data may refuse a refit for one of its values, and its owner may know which of the others is right.
    """
    changes = {}
    for s, declared_value in declared.values.items():
        was, now = float(declared_value), float(refused.values[s])
        if abs(now - was) > UNSEEN * max(abs(now), abs(was)):
            changes[s] = abs(now - was) / max(abs(now), abs(was))
    most = sorted(changes, key=lambda s: -changes[s])[:MOST_VALUES]
    values = [
        f"{s} = {float(refused.values[s]):.3g}{in_unit(declared, s)} (declared {float(declared.values[s]):.3g})"
        for s in most
    ]
    more = len(changes) - len(most)
    return (Fact.worded("spec.yaml", "refused values", values=values, more=more),) if values else ()


class Reference(NamedTuple):
    """Held-out errors with which those of an option are compared.

    Attributes:
        refit: of the model without the effects, which an option may exceed by at most the share ``most``; if that is
            negative, it must be better by so much. None for a model without effects.
    """

    declared: ErrorFigures
    refit: ErrorFigures | None = None
    most: float = REFIT_WORSE

    def on(self, rows: Sequence[int]) -> Reference:
        """The errors of some coordinates."""
        return Reference(self.declared.on(rows), self.refit and self.refit.on(rows), self.most)


def admitted(
    options: Sequence[Option],
    measured: Measured,
    reference: Reference | Callable[[System], Reference],
    shown: Callable[[], bool] = lambda: True,
    acting: Mapping[int, str] = MappingProxyType({}),
) -> Admitted:
    """Check the options in their order on held-out data.

    Args:
        reference: of all options, or as a function of an option's model.
        shown: function that returns whether an effect that gains nothing on these data is refused for that. One that
            does not act on them and is material in the training log is not. Called only if nothing is gained.
        acting: index → name of the coordinates on which the effects act; an option is also judged on these alone, so
            that refitted values of other joints do not compensate for an effect that makes its own joint worse.
    """
    refusals: list[Refusal] = []
    tried: list[ErrorFigures] = []
    for name, model in options:
        figures, compared = measured(model), reference if isinstance(reference, Reference) else reference(model)
        tried.append(figures)
        every = tuple(range(len(compared.declared.force_rms_rows)))
        judged_on = {"": every}
        if compared.refit is not None and 0 < len(acting) < len(every):
            judged_on[f" on {' and '.join(acting.values())}"] = tuple(acting)
        against = (
            refusal(name, where, figures.on(rows), compared.on(rows), shown) for where, rows in judged_on.items()
        )
        found = next((one for one in against if one), None)
        if found is None:
            return Admitted((name, model), figures, tuple(refusals))
        refusals.append(found)
    return Admitted(None, tried[0], tuple(refusals))


def refusal(
    option: str, where: str, figures: ErrorFigures, compared: Reference, shown: Callable[[], bool]
) -> Refusal | None:
    """The refusal of an option by held-out errors on the coordinates ``where``, as of ``admitted``; else None.

    The free-run error over a few restarts may increase by chance; then it refuses no effect if the force error
    decreases. With effects, an error must also be smaller than that of the declared model, and than that without the
    effects (``gains_nothing``).
    """
    declared, refit, most = compared
    if refit is None:
        worse = worsened(figures, declared)
        return Refusal(option, "as declared" + where, worse) if worse else None
    others = (declared, "as declared", SAME), (refit, "without the effect", most)
    for other, model, share in others:
        worse = worsened(figures, other, share)
        if worse and not (most >= 0 and may_be_chance(worse, figures, other)):
            return Refusal(option, model + where, worse)
    for other, model, _ in others:
        if gains_nothing(figures, other, refit) and shown():
            return Refusal(option, model + where)
    return None


def worsened(figures: ErrorFigures, declared: ErrorFigures, most: float = SAME) -> dict[str, float]:
    """Criterion → error over that of the declared model, if it is larger by more than the share ``most``."""
    return {name: ratio for name, ratio in _ratios(figures, declared).items() if ratio > 1 + most}


def _ratios(figures: ErrorFigures, declared: ErrorFigures) -> dict[str, float]:
    """Criterion → error over that of the declared model; NaN if it was not measured."""
    return {
        FORCE: _over(figures.force_rms_rows, declared.force_rms_rows),
        RUN: _over(figures.free_run_rmse_rows, declared.free_run_rmse_rows),
    }


def gains_nothing(figures: ErrorFigures, other: ErrorFigures, refit: ErrorFigures) -> bool:
    """Whether an effect reduces no held-out error compared with another model; ``refit``: errors without the effect.

    No error falls to ``FALLS`` of the other's on a coordinate on which it differs from the refit's, and not both errors
    decrease by ``SAME``.
    """
    pairs = [
        (_ratio(a, b), abs(_ratio(a, c) - 1) > UNSEEN)
        for rows in ("force_rms_rows", "free_run_rmse_rows")
        for a, b, c in zip(getattr(figures, rows), getattr(other, rows), getattr(refit, rows), strict=True)
        if not (np.isnan(a) or np.isnan(b))
    ]
    return not reduces_both(figures, other) and not any(ratio <= FALLS for ratio, differs in pairs if differs)


def reduces_both(figures: ErrorFigures, other: ErrorFigures) -> bool:
    """Whether both errors are smaller than another model's, by more than ``SAME``."""
    return all(ratio < 1 - SAME for ratio in _ratios(figures, other).values())


def reduces_runs(figures: ErrorFigures, other: ErrorFigures) -> bool:
    """Whether the free-run error falls to ``FALLS`` of another model's."""
    return _ratios(figures, other)[RUN] <= FALLS


def acts(figures: ErrorFigures, refit: ErrorFigures) -> bool:
    """Whether an effect acts on the held-out data: the errors differ from those of the same values without it."""
    return any(abs(ratio - 1) > UNSEEN for ratio in _ratios(figures, refit).values())


def may_be_chance(worse: Mapping[str, float], figures: ErrorFigures, other: ErrorFigures) -> bool:
    """Whether only the free-run error is larger than another model's, perhaps by chance, and the force error falls."""
    falls = _over(figures.force_rms_rows, other.force_rms_rows) <= FALLS
    return set(worse) == {RUN} and falls and not is_shown_worse(figures, other)


def outweighed(worse: Mapping[str, float], figures: ErrorFigures, other: ErrorFigures, drive: Iterable[float]) -> bool:
    """Whether only the free-run error is larger than another model's, and the force error falls by a larger factor.

    ``drive``: for each coordinate the drive force over the other model's. The force error falls with it, which predicts
    nothing better; so the other model's is multiplied by it where it is below 1.
    """
    rows = tuple(rms * min(float(share), 1.0) for rms, share in zip(other.force_rms_rows, drive, strict=True))
    ratios = _ratios(figures, replace(other, force_rms_rows=rows))
    return set(worse) == {RUN} and ratios[FORCE] * ratios[RUN] < 1


def is_shown_worse(figures: ErrorFigures, other: ErrorFigures) -> bool:
    """Whether the free runs of a model are worse than another's by more than chance, by a sign test on their parts.

    With so few parts that the test can never be significant, they count as worse. The test needs three parts by the
    normal approximation; the probability that all are worse by chance is 1/8 for three parts and 1/16 for four.
    """
    parts, others = np.array(figures.free_run_parts), np.array(other.free_run_parts)
    if min(len(parts), len(others)) == 0 or random_signs(np.sqrt(len(parts))) > TIE_LEVEL:
        return True
    more = ((parts - others) / np.maximum(others.mean(axis=0), 1e-300)).mean(axis=1)
    spread = float(np.sqrt((more**2).sum()))
    return spread > 0 and random_signs(float(more.sum()) / spread) <= TIE_LEVEL


def _over(errors: Iterable[float], declared: Iterable[float]) -> float:
    """RMS over coordinates of the ratio of errors, which has no unit; NaN if none was measured."""
    ratios = [_ratio(a, b) for a, b in zip(errors, declared, strict=True) if not (np.isnan(a) or np.isnan(b))]
    return float(np.sqrt(np.mean(np.square(ratios)))) if ratios else float("nan")


def _ratio(error: float, declared: float) -> float:
    if not np.isfinite(declared):
        return 1.0 if not np.isfinite(error) else 0.0
    return error / declared if declared > 0 else float(error > 0) + 1.0


def reference_of(
    augmented: System, plain: Answer, problem: Problem, settled: bool = False, near: bool = True
) -> Reference:
    """The errors with which those of a model with effects are compared.

    For a load behind a spring, and if free runs have ``settled`` the question, the squared free-run error must decrease
    by ``LEAST_SHARE``. The force residual is then not tested, unless free runs have not settled it and the log is not
    ``near`` the noise, where free runs say more of a motion that is not measured: then its square must decrease by as
    much, in proportion to the drive force.

    Force residuals are in proportion to the drive force, which a refitted motor constant changes. For other effects
    than a load behind a spring, the refit's is divided by the share of the drive force that the model's friction
    leaves, which amplifies the noise of the acceleration too.
    """
    declared, refit = plain.figures[:2]
    least = float(np.sqrt(1 - acceptance.LEAST_SHARE)) - 1
    of_declared = in_proportion(declared, augmented, problem.system, problem)
    of_refit = in_proportion(refit, augmented, plain.refit, problem)
    if settled or (augmented.transmissions and near):
        unknown = (float("nan"),) * len(refit.force_rms_rows)
        return Reference(replace(declared, force_rms_rows=unknown), replace(refit, force_rms_rows=unknown), least)
    if augmented.transmissions:
        return Reference(of_declared, of_refit, least)
    left = drive_left(augmented, problem.motion) / drive_left(plain.refit, problem.motion)
    rows = tuple(rms / min(float(share), 1.0) for rms, share in zip(of_refit.force_rms_rows, left, strict=True))
    return Reference(of_declared, replace(refit, force_rms_rows=rows))


def in_proportion(figures: ErrorFigures, augmented: System, system: System, problem: Problem) -> ErrorFigures:
    """The errors of a system, its force residuals in proportion to a smaller drive force of the augmented one."""
    gains = drive_gain(augmented, system, problem.motion)
    rows = tuple(rms * min(float(gain), 1.0) for rms, gain in zip(figures.force_rms_rows, gains, strict=True))
    return replace(figures, force_rms_rows=rows)


def options_of(system: System, refit: Refit, without: Mapping[str, float] | None = None) -> list[Option]:
    """Models that may be written, each once, in order of preference.

    A model with effects is offered with one set of refitted values only, so that it does not gain by being tried often.
    """
    others = () if without else refit.others
    ways: dict[str, Mapping[str, float]] = {
        "refitted values": refit.mapping(),
        **{f"values refitted by {criterion}": refit.mapping(values) for criterion, values in others},
        "refitted friction levels alone": refit.mapping(refit.levels),
        **({"values fitted without the effect": without} if without else {}),
        AS_DECLARED: refit.mapping(refit.declared),
    }
    options: list[Option] = []
    tried: list[Mapping[str, float]] = []
    last = next(reversed(ways))
    for name, values in ways.items():
        if values not in tried:
            tried.append(values)
            options.append((last if values == ways[last] else name, with_values(system, values)))
    return options
