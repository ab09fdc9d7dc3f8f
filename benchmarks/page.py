"""docs/performance.md from measured rows; these are stored in results.json, so that one row can be measured anew."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter

from benchmarks.diagnosis_time import page as diagnosis_time
from benchmarks.machine import Machine
from benchmarks.result import Entry, Row, figure
from benchmarks.text import render
from codegen.base.files import write_all

ROOT = Path(__file__).resolve().parent.parent
PAGE, RESULTS = "docs/performance.md", "benchmarks/results.json"


@dataclass(frozen=True)
class Results:
    """One run's machine and rows, in the order of the page."""

    machine: Machine
    rows: tuple[Row, ...]


ADAPTER: TypeAdapter[Results] = TypeAdapter(Results)


def kept(root: Path = ROOT) -> Results | None:
    """The results of the last run; None if there are none."""
    file = root / RESULTS
    return ADAPTER.validate_json(file.read_bytes()) if file.exists() else None


def write(results: Results, complete: bool, root: Path = ROOT) -> None:
    """The results so far, and with all rows the page."""
    text = json.dumps(asdict(results), indent=1, ensure_ascii=False) + "\n"
    write_all(root, {RESULTS: text} | ({PAGE: page(results)} if complete else {}))


def page(results: Results) -> str:
    """The text of docs/performance.md."""
    sections = [section(row) for row in results.rows]
    text = render("performance.md.j2", machine=results.machine, rows=results.rows, sections=sections, figure=figure)
    return diagnosis_time.with_section(text)


def section(row: Row) -> str:
    """One row's part of the page."""
    own = [next((e for e in reversed(row.entries[: k + 1]) if e.ours), row.entries[0]) for k in range(len(row.entries))]
    lines = [_cells(entry, ours) for entry, ours in zip(row.entries, own, strict=True)]
    counted = any(entry.count is not None for entry in row.entries)
    return render(f"rows/{row.key}.md.j2", row=row, lines=lines, counted=counted, figure=figure)


def _cells(entry: Entry, ours: Entry) -> dict[str, str]:
    median = entry.times.median if entry.times else None
    own = ours.times.median if ours.times else None
    return {
        "name": entry.name,
        "instructions": figure(entry.instructions, 0),
        "by_count": _ratio(ours.instructions, entry.instructions),
        "median": figure(median, 1),
        "least": figure(entry.times.least if entry.times else None, 1),
        "by_time": _ratio(own, median),
        "difference": "–" if entry.difference is None else f"{entry.difference:.0e}",
        "note": entry.note,
    }


def _ratio(ours: float | None, theirs: float | None) -> str:
    return "–" if ours is None or theirs is None else figure(ours / theirs)
