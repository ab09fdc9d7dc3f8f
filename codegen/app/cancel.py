"""``stiction cancel`` as a function: what the inputs of a spec can do against its friction, and how."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from codegen.app.derived import Source, derived_from
from codegen.app.readable_cancellation import cancellation_json, cancellation_view, hunting_json
from codegen.base.border import verb
from codegen.base.files import refuse_target, write_all
from codegen.base.shown import Result
from codegen.cancellation import Plan, RankFalls, Reach, make_plan, reach
from codegen.cancellation.leftover import Leftover, leftover
from codegen.simulate.hunting import Hunting, hunting
from codegen.spec import Spec
from codegen.spec.model import CancellationChoice
from codegen.spec.numerics import require_finite

NUMBERS = "cancellation.json"


@dataclass(frozen=True, repr=False)
class CancelReport(Result):
    """What ``cancel`` found.

    Attributes:
        choice: the spec's ``cancellation:``, or the default.
        reach: which friction can be cancelled, and why.
        plan, left: how the input is computed, and what it leaves; None where no input acts, or with a refusal.
        refusal: why no input can be generated, where the rank of B falls in the envelope.
        hunting: whether the closed loop goes into a limit cycle, and up to which gain it does not; None if not asked.
        files: what was written.
    """

    template = "cancel"
    spec: Spec
    choice: CancellationChoice
    reach: Reach
    plan: Plan | None
    left: Leftover | None
    refusal: RankFalls | None = None
    hunting: Hunting | None = None
    files: tuple[Path, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        refused = {} if self.refusal is None else {"refused": self.refusal}
        return {
            "machine": self.spec.name,
            "rank": self.reach.rank,
            "contacts": len(self.reach.system.contacts),
            **refused,
        }

    @property
    def view(self) -> dict[str, Any]:
        """What the text template needs."""
        words = cancellation_view(self.choice, self.reach, self.plan, self.left)
        return {"spec": self.spec, "files": self.files, "refusal": self.refusal, "hunting": self.hunting, **words}

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object (docs/cancellation.md)."""
        content = cancellation_json(self.choice, self.reach, self.plan, self.left)
        content["refused"] = str(self.refusal) if self.refusal is not None else None
        content["hunting"] = hunting_json(self.hunting, self.reach.system) if self.hunting is not None else None
        return content


@verb
def cancel(
    source: Source,
    folder: str | Path | None = None,
    hunt: bool = False,
    progress: Callable[[float], None] | None = None,
) -> CancelReport:
    """Which friction the inputs of a spec can cancel, and the input that does it best.

    Args:
        folder: for cancellation.json; None writes nothing.
        hunt: close the spec's loop with its observer and look for limit cycles, in simulation.
        progress: called with the share of that which is done, from 0 to 1.

    Raises:
        BadInput: for a bad spec, a force that is not linear in the inputs, or a folder that cannot be written.
    """
    machine = derived_from(source)
    spec = machine.spec
    if folder is not None:
        refuse_target(Path(folder) / NUMBERS, {"the spec itself": spec.path})
    system = machine.system
    choice = spec.cancellation or CancellationChoice()
    found = reach(spec, system, choice.weight)
    plan, refusal = None, None
    if found.rank:
        try:
            plan = make_plan(spec, choice, found)
        except RankFalls as error:
            refusal = error
    report = CancelReport(spec, choice, found, plan, leftover(found, plan) if plan is not None else None, refusal)
    if hunt and plan is not None:
        report = replace(report, hunting=hunting(spec, system, progress))
    require_finite(spec, report.content, "the cancellation")
    if folder is None:
        return report
    text = json.dumps(report.content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    write_all(Path(folder), {NUMBERS: text})
    return replace(report, files=(Path(folder) / NUMBERS,))
