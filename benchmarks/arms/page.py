"""Diagnosed arms → docs/arms.md; the rows are kept, so that one case can be run anew."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from benchmarks.arms.cases import CASES, PAYLOAD, ArmCase
from benchmarks.practice.runs import Run
from benchmarks.spikes.outcome import named
from benchmarks.text import render
from codegen.base.files import write_atomically
from codegen.effects import CATALOGUE

ROOT = Path(__file__).resolve().parents[2]
PAGE, KEPT = ROOT / "docs" / "arms.md", Path(__file__).with_name("rows.json")
LONGEST_S = 180.0
"""Bar for seven joints over 25 s at 200 Hz: s of the processor."""


@dataclass(frozen=True)
class Row:
    """The outcome of a case.

    Attributes:
        said: the verdict, with effects and their joints, and declared values that are called wrong.
        found: the true effect's parameters as found, SI; empty if it was not named. right: as in ``is_right``.
    """

    case: str
    said: str
    found: dict[str, float]
    right: bool
    run: Run


ADAPTER: TypeAdapter[list[Row]] = TypeAdapter(list[Row])


def row_of(case: ArmCase, run: Run, result: Mapping[str, Any]) -> Row:
    """The row of a case, from its run and its diagnosis."""
    alike = [[effect, *effect.get("also", ())] for effect in result["effects"]]
    effects = [" or ".join(f"{one['kind']} on {one['on']}" for one in group) for group in alike]
    names = [*(effects if result["verdict"] == "effect" else named(result)), *wrong_values(result)]
    said = f"{result['verdict']}: {', '.join(names)}" if names else str(result["verdict"])
    found = next((e["parameters"] for e in result["effects"] if is_named(case, e)), {})
    return Row(case.name, run.failure or said, dict(found), is_right(case, result), run)


def is_named(case: ArmCase, effect: Mapping[str, Any]) -> bool:
    """Whether an effect, or one that no log can tell from it, is the missing one or a richer form, at its joint."""
    at = [one["kind"] for one in (effect, *effect.get("also", ())) if one["on"] in (case.on, f"w_{case.on}")]
    return any(kind == case.kind or CATALOGUE[kind].refines == case.kind for kind in at)


def is_right(case: ArmCase, result: Mapping[str, Any]) -> bool:
    """The missing effect alone; `none` where nothing is missing; a foreign disturbance under no name.

    Declared values are called wrong where there is a payload, those of its joint alone, and nowhere else.
    """
    verdict, effects, values = result["verdict"], result["effects"], wrong_values(result)
    if case.kind == PAYLOAD:
        return verdict == "none" and bool(values) and all(name.startswith(f"{case.on}_") for name in values)
    if values:
        return False
    if case.in_catalogue:
        return verdict == "effect" and len(effects) == 1 and is_named(case, effects[0])
    return verdict == "none" if case.group == "none" else verdict in ("none", "unknown")


def wrong_values(result: Mapping[str, Any]) -> list[str]:
    """Names of the declared values that a diagnosis calls wrong."""
    return [error["name"] for error in result.get("parameter_errors", ())]


def keep(rows: Sequence[Row]) -> None:
    """Put these rows among those of earlier runs, and write the page."""
    new = {row.case: row for row in [*kept(), *rows]}
    ordered = [new[case.name] for case in CASES if case.name in new]
    write_atomically(KEPT, json.dumps([asdict(row) for row in ordered], indent=1, ensure_ascii=False) + "\n")
    write_atomically(PAGE, page(ordered))


def kept() -> list[Row]:
    """The rows of earlier runs."""
    return ADAPTER.validate_json(KEPT.read_bytes()) if KEPT.is_file() else []


def page(rows: Sequence[Row]) -> str:
    """The text of docs/arms.md."""
    by_name = {case.name: case for case in CASES}
    pairs = [(by_name[row.case], row) for row in rows]
    seven = [row.run for case, row in pairs if case.joints == 7 and row.run.samples]
    return render("arms.md.j2", pairs=pairs, seven=seven, longest_s=LONGEST_S, total=len(CASES))
