"""docs/gallery/readings.json: what each figure's last run gave, kept so that a figure can be run without the others.

Numbers are kept as the page prints them. Words of the page come from ``claims/`` when it is written, so that a text can
be mended without a run; a figure whose statements, conditions or settings have changed since counts as not run.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from codegen.base.errors import BadInput
from codegen.report.wording import number, unit_text, with_unit
from codegen.thesis.gallery.build import GalleryResult, Verdict
from codegen.thesis.gallery.measures import Reading
from codegen.thesis.gallery.plots import PLOTS
from codegen.thesis.gallery.statement import FigureText

KEPT = "readings.json"
DIGITS = 3
ROUNDING = 1e-12
"""What rounding may leave where nothing moves; shown as 0."""
Kept = dict[str, Any]


def kept_of(result: GalleryResult) -> Kept:
    """What is kept of a figure's run."""
    return {
        "pid": [number(g, DIGITS) for g in result.pid or ()],
        "settings": _setting_names(result.text),
        "rows": [_row(verdict) for verdict in result.verdicts],
    }


def read_kept(folder: Path) -> dict[str, Kept]:
    """Figure → what was kept, nothing where there is no such file.

    Raises:
        BadInput: for a file that is no JSON.
    """
    path = folder / KEPT
    if not path.is_file():
        return {}
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except ValueError as error:
        raise BadInput(path.name, str(error), f"the {KEPT} that `stiction gallery` writes", code="FILE004") from error


def kept_text(kept: Mapping[str, Kept], order: Sequence[str]) -> str:
    """The file's text, figures in the order of the thesis."""
    return json.dumps({n: kept[n] for n in order if n in kept}, indent=1, ensure_ascii=False) + "\n"


def is_of(kept: Kept, text: FigureText) -> bool:
    """Whether what is kept answers the figure's statements as they are now, in the settings that it has now."""
    asked = [[s.entry.measure, s.entry.holds] for s in text.statements]
    answered = [[row["measure"], row["condition"]] for row in kept["rows"]]
    return asked == answered and kept["settings"] == _setting_names(text)


def _setting_names(text: FigureText) -> list[str]:
    return [s.name for s in PLOTS[text.entry.figure].settings] if text.statements else []


def _row(verdict: Verdict) -> Kept:
    entry, drawn = verdict.statement.entry, verdict.readings[0]
    return {
        "measure": entry.measure,
        "condition": entry.holds,
        "value": with_unit(drawn.value, entry.unit, DIGITS),
        "parts": _parts(drawn),
        "holds": verdict.holds,
        "others": [[s.name, with_unit(r.value, entry.unit, DIGITS)] for s, r in verdict.others],
    }


def _parts(reading: Reading) -> list[str]:
    unit = unit_text(reading.unit)
    parts = [(name, 0.0 if abs(value) < ROUNDING else value) for name, value in reading.parts]
    return [f"{name}: {number(value, DIGITS)}{' ' + unit if unit else ''}" for name, value in parts]
