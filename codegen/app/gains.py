"""``stiction gains`` as a function: a spec's feasibility report, and the files that it writes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codegen.analysis.feasibility.gains import Feasibility, assess
from codegen.analysis.feasibility.stated import suggested_text
from codegen.app.derived import Source, derived_from
from codegen.app.readable_gains import gains_json, gains_view
from codegen.base.border import verb
from codegen.base.files import refuse_foreign, refuse_target, write_all
from codegen.base.shown import Result
from codegen.spec.numerics import require_finite

MAP, NUMBERS, SPEC = "gains.png", "gains.json", "spec.yaml"


@dataclass(frozen=True, repr=False)
class GainReport(Result):
    """What ``gains`` found, and the files it wrote."""

    template = "gains"
    feasibility: Feasibility
    files: tuple[Path, ...]

    @property
    def summary(self) -> Mapping[str, object]:
        found = self.feasibility
        varied = {"varied": ", ".join(axis.name for axis in found.axes)}
        if found.suggestion is None:
            return {**varied, "stable gains": "none in the range"}
        return {**varied, "suggested": ", ".join(f"{name} = {v:g}" for name, v in found.suggestion.numbers.items())}

    @property
    def view(self) -> dict[str, Any]:
        """What the text template needs."""
        return {"files": self.files, **gains_view(self.feasibility)}

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object (docs/feasibility.md)."""
        return gains_json(self.feasibility)


@verb
def gains(source: Source, folder: str | Path | None = None, over: Sequence[str] = ()) -> GainReport:
    """Which gains of a spec's observer are stable over its envelope, with what margin, and which to take.

    Args:
        folder: for gains.json, gains.png and, where a gain set is suggested, spec.yaml with it; None writes nothing.
        over: the two gains of the map (``h`` is the sample time).

    Raises:
        BadInput: for a bad spec, gains that the observer does not have, or a folder that cannot be written or where a
            spec lies that we did not write.
    """
    machine = derived_from(source)
    spec = machine.spec
    if folder is not None:
        for name in (NUMBERS, MAP, SPEC):
            refuse_target(Path(folder) / name, {"the spec itself": spec.path})
        refuse_foreign(Path(folder), SPEC, (NUMBERS,))
    report = assess(spec, machine.nominal.observer, over)
    require_finite(spec, gains_json(report), "what the gains do")
    if folder is None:
        return GainReport(report, ())
    from codegen.report.gain_map import gain_map_png  # matplotlib costs a second that the text need not pay

    files: dict[str, str | bytes] = {
        NUMBERS: json.dumps(gains_json(report), indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        MAP: gain_map_png(report),
    }
    if report.suggestion is not None:
        files[SPEC] = suggested_text(spec, report.axes, report.suggestion)
    write_all(Path(folder), files, (NUMBERS,))
    return GainReport(report, tuple(Path(folder) / name for name in files))
