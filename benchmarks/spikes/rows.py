"""Rows of the page: spikes, what became of each, and by which code; kept in rows.json from one run to the next."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from pydantic import TypeAdapter

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


ADAPTER: TypeAdapter[list[Part]] = TypeAdapter(list[Part])


def merged(new: Sequence[Part], kept: Sequence[Part]) -> list[Part]:
    """The kept parts with new rows in place of theirs, then parts that are new.

    An outcome was judged with the verdict of its own version on the log without a spike; the newest verdict is shown.
    """
    found = {one.name: one for one in kept}
    for one in new:
        before = found[one.name].rows if one.name in found else ()
        rows = {(row.kind, row.percent): row for row in (*before, *one.rows)}
        found[one.name] = replace(one, rows=tuple(rows.values()))
    return list(found.values())


def text_of(parts: Sequence[Part]) -> str:
    """The parts as JSON."""
    return json.dumps([asdict(one) for one in parts], indent=1, default=sorted) + "\n"


def parts_in(file: Path) -> list[Part]:
    """The parts of a file written by ``text_of``; none where there is no file."""
    return ADAPTER.validate_json(file.read_bytes()) if file.is_file() else []
