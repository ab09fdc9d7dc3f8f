"""``stiction cancel``: the friction that the inputs can cancel, and the input that cancels it."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from codegen.app.derived import Source, derived_from
from codegen.base.border import verb
from codegen.base.files import refuse_foreign_json, refuse_target, write_all
from codegen.base.result import Result, json_text, named
from codegen.cancellation import Plan, RankFalls, Reach, make_plan, reach
from codegen.cancellation.plan import RemainingFriction, remaining_friction
from codegen.mechanics.sampling import POINTS
from codegen.simulate.hunting import Hunting, LimitCycle, hunting
from codegen.spec import Spec
from codegen.spec.model import CancellationChoice
from codegen.spec.numerics import require_finite

NUMBERS = "cancellation.json"
OF_VERDICT = "name cancelled=kind joined_rank acts_without_input_on=undriven removed_share=share"
"""Attributes of a ``Verdict`` in cancellation.json."""
NOTHING = 5e-7
"""Size below which a coefficient is printed as zero, and distance from 1 within which it is left out."""


@dataclass(frozen=True, repr=False)
class CancelReport(Result):
    """The result of ``cancel``.

    Attributes:
        choice: the spec's ``cancellation:``, or the default.
        reach: which friction can be cancelled, and why.
        plan: how the cancelling input is computed; None if no input acts on a coordinate, or with a refusal.
        left: the friction that remains with this input; None as for ``plan``.
        refusal: why no input can be generated: the rank of B falls in the envelope; else None.
        hunting: limit cycles of the closed loop, and the largest gain without one; None if not asked for.
    """

    template = "cancel"
    spec: Spec
    choice: CancellationChoice
    reach: Reach
    plan: Plan | None
    left: RemainingFriction | None
    refusal: RankFalls | None = None
    hunting: Hunting | None = None
    files: tuple[Path, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        refused = {} if self.refusal is None else {"refused": self.refusal}
        counts = {"rank": self.reach.rank, "contacts": len(self.reach.system.contacts)}
        return {"machine": self.spec.name, **counts, **refused}

    @property
    def view(self) -> dict[str, Any]:
        found, plan, left, system = self.reach, self.plan, self.left, self.reach.system
        names = [c.name for c in system.contacts]
        inputs = [w.name for w in system.inputs]
        return {
            **named(self, "spec files refusal hunting choice reach plan left"),
            "system": system,
            "points": POINTS,
            "rows": _texts(found.input_matrix),
            "all_perfect": all(v.kind == "perfect" for v in (*found.contacts, *found.coordinates)),
            "chosen": [names[k] for k in plan.contacts] if plan else [],
            "used": [inputs[k] for k in plan.pivots] if plan and plan.pivots is not None else [],
            "gains": [(w, _sum(left.gains[i], names)) for i, w in enumerate(inputs)] if left else [],
            "rest": [(x.name, _sum(left.force[i], names)) for i, x in enumerate(system.positions)] if left else [],
        }

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object (docs/cancellation.md)."""
        found, reduction = self.reach, self.reach.reduction
        return {
            "format": "stiction-cancellation/1",
            "input_matrix": _texts(found.input_matrix),
            **named(found, "rank exact"),
            "weight": self.choice.weight,
            "contacts": [named(v, OF_VERDICT) for v in found.contacts],
            "coordinates": [named(v, OF_VERDICT) for v in found.coordinates],
            "cancellable_together": found.together,
            "note_2": {
                **named(reduction, "coordinates_without_input=undriven contacts_lost=lost coordinates contacts"),
                "input_matrix": _texts(reduction.input_matrix),
                "distribution": _texts(reduction.distribution),
            },
            "law": None if self.plan is None or self.left is None else self._law(self.plan, self.left),
            "refused": None if self.refusal is None else str(self.refusal),
            "hunting": None if self.hunting is None else self._hunting(self.hunting),
        }

    def _law(self, plan: Plan, left: RemainingFriction) -> dict[str, Any]:
        found, system = self.reach, self.reach.system
        return {
            "method": self.choice.method,
            "gain": float(self.choice.gain),
            "damping": plan.damping,
            "contacts": [system.contacts[k].name for k in plan.contacts],
            "inputs_used": [w.name for k, w in enumerate(system.inputs) if plan.pivots is None or k in plan.pivots],
            "rank_proven_in_envelope": plan.proven,
            "condition": plan.condition if not plan.damping else None,
            "at_centre": {v.name: r[0] for v, r in zip(found.variables, found.points.T, strict=True)},
            "inputs_by_contacts": left.gains.tolist(),
            "force_left_by_contacts": left.force.tolist(),
            "contacts_whose_rest_may_push": list(left.may_feed_energy),
        }

    def _hunting(self, found: Hunting) -> dict[str, Any]:
        positions = self.reach.system.positions

        def cycle(one: LimitCycle | None) -> dict[str, Any] | None:
            if one is None:
                return None
            bounded = math.isfinite(one.amplitude)
            return {
                "coordinate": positions[one.coordinate].name,
                "amplitude": one.amplitude if bounded else None,
                "period": one.period if bounded else None,
            }

        return {
            **named(found, "largest_gain_without=largest delay duration"),
            "from_rest_at": found.away.tolist(),
            "pushed_with": found.push.tolist(),
            "trials": [
                {**named(t, "gain decided"), "from_rest": cycle(t.from_rest), "from_push": cycle(t.from_push)}
                for t in found.trials
            ],
        }


@verb
def cancel(
    source: Source,
    out: str | Path | None = None,
    hunt: bool = False,
    progress: Callable[[str, float], None] | None = None,
) -> CancelReport:
    """The friction that the inputs of a spec can cancel, and the cancelling input of the spec's ``cancellation:``.

    Args:
        out: folder for cancellation.json; None writes nothing.
        hunt: simulate the closed loop of controller, observer and cancelling input, and look for limit cycles.
        progress: called with the step and the share of this simulation that is done, 0 to 1.

    Raises:
        BadInput: for a bad spec, a force that is not linear in the inputs, or a folder that cannot be written or has a
            file of that name that stiction did not write.
    """
    machine = derived_from(source)
    spec = machine.spec
    if out is not None:
        refuse_target(Path(out) / NUMBERS, {"the spec itself": spec.path})
        refuse_foreign_json(Path(out) / NUMBERS, "stiction-cancellation/")
    system = machine.system
    choice = spec.cancellation or CancellationChoice()
    found = reach(spec, system, choice.weight)
    plan, refusal = None, None
    if found.rank:
        try:
            plan = make_plan(spec, choice, found)
        except RankFalls as error:
            refusal = error
    left = remaining_friction(found, plan) if plan is not None else None
    report = CancelReport(spec, choice, found, plan, left, refusal)
    if hunt and plan is not None:
        report = replace(report, hunting=hunting(spec, system, partial(progress, "simulate") if progress else None))
    require_finite(spec, report.content, "the cancellation")
    if out is None:
        return report
    write_all(Path(out), {NUMBERS: json_text(report.content)})
    return replace(report, files=(Path(out) / NUMBERS,))


def _texts(matrix: Any) -> list[list[str]]:
    return [[str(e) for e in matrix.row(i)] for i in range(matrix.rows)]


def _sum(coefficients: Iterable[float], names: list[str]) -> str:
    """A linear combination of contact forces; empty where it is zero."""
    text = ""
    for value, name in zip(coefficients, names, strict=True):
        if abs(value) < NOTHING:
            continue
        size = "" if abs(abs(value) - 1) < NOTHING else f"{abs(value):.6g} "
        sign = "-" if value < 0 else "+" if text else ""
        text += f"{' ' if text else ''}{sign}{' ' if text else ''}{size}F_{name}"
    return text
