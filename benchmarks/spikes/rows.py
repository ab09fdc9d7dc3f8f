"""Rows of the page: spikes, what became of each, and by which code; kept in rows.json from one run to the next."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.spikes.outcome import Outcome, Spike

ROWS = Path(__file__).with_name("rows.json")


@dataclass(frozen=True)
class Row:
    """One spike and what became of it; ``code`` is the version that diagnosed it."""

    kind: str
    percent: float
    spike: Spike
    outcome: Outcome
    code: str


@dataclass(frozen=True)
class Part:
    """One set: what its log got as it is, by the version ``code``, and its spikes."""

    name: str
    verdict: str
    own: tuple[str, ...]
    rows: tuple[Row, ...]
    code: str


def merged(new: Sequence[Part], kept: Sequence[Part]) -> list[Part]:
    """The kept parts with new rows in place of theirs, then parts that are new.

    An outcome was judged beside the verdict of its own code on the log as it is; the new one's is shown.
    """
    by_name = {one.name: one for one in new}
    found = [_joined(by_name[one.name], one) if one.name in by_name else one for one in kept]
    known = {one.name for one in kept}
    return [*found, *(one for one in new if one.name not in known)]


def _joined(new: Part, kept: Part) -> Part:
    rows = {(row.kind, row.percent): row for row in (*kept.rows, *new.rows)}
    return replace(new, rows=tuple(rows.values()))


def text_of(parts: Sequence[Part]) -> str:
    """The parts as JSON."""
    written = [asdict(one) for one in parts]
    return json.dumps(written, indent=1, default=sorted) + "\n"


def parts_in(file: Path) -> list[Part]:
    """The parts of a file written by ``text_of``; none where there is no file."""
    return [_part(one) for one in json.loads(file.read_text())] if file.is_file() else []


def _part(read: Mapping[str, Any]) -> Part:
    rows = tuple(
        Row(
            **{
                **row,
                "spike": Spike(**{**row["spike"], "accepted": frozenset(row["spike"]["accepted"])}),
                "outcome": Outcome(**{**row["outcome"], "said": tuple(row["outcome"]["said"])}),
            }
        )
        for row in read["rows"]
    )
    return Part(**{**read, "own": tuple(read["own"]), "rows": rows})
