"""docs/gallery: one table of all statements with verdicts, then every figure with its picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from codegen.files import write_all
from codegen.gallery.build import FOLDER, GalleryResult, Verdict, figure_numbers
from codegen.gallery.measures import Reading
from codegen.report.wording import number, unit_text, with_unit
from codegen.text import render

PAGE = "README.md"
DIGITS = 3
ROUNDING = 1e-12
"""What rounding may leave where nothing moves; shown as 0."""


def write_gallery(results: Sequence[GalleryResult], folder: Path) -> tuple[Path, ...]:
    """Write the pictures, and the page where every figure is among them; the paths written.

    Raises:
        BadInput: if the folder cannot be written.
    """
    files: dict[str, str | bytes] = {picture_name(r.text.entry.figure): r.picture for r in results}
    if {r.text.entry.figure for r in results} == set(figure_numbers()):
        files[PAGE] = gallery_page(results)
    write_all(folder, files)
    return tuple(folder / name for name in files)


def gallery_page(results: Sequence[GalleryResult]) -> str:
    """The text of docs/gallery/README.md."""
    return render("text/gallery.md.j2", **_view(results))


def gallery_summary(results: Sequence[GalleryResult]) -> str:
    """The statements and verdicts for a terminal."""
    return render("text/gallery.txt.j2", **_view(results))


def picture_name(figure: str) -> str:
    """figure_2_4.png for "2.4"."""
    return f"figure_{figure.replace('.', '_')}.png"


def _view(results: Sequence[GalleryResult]) -> dict[str, Any]:
    rows = [_row(result, verdict) for result in results for verdict in result.verdicts]
    figures = [
        {
            "number": r.text.entry.figure,
            "title": r.text.entry.title,
            "picture": picture_name(r.text.entry.figure),
            "specs": [f"{name}.yaml" for name in r.text.entry.specs],
            "folder": FOLDER,
            "open": " ".join(r.text.entry.open.split()),
            "pid": [number(g, DIGITS) for g in r.pid] if r.pid is not None else [],
            "settings": [s.name for s in r.verdicts[0].settings[1:]] if r.verdicts else [],
        }
        for r in results
    ]
    held = [row["holds"] for row in rows]
    robust = [not row["others"] for row in rows]
    counts = {
        "holds": sum(held),
        "fails": len(held) - sum(held),
        "robust": sum(robust),
        "hangs": len(robust) - sum(robust),
    }
    return {"rows": rows, "figures": figures, "counts": counts}


def _row(result: GalleryResult, verdict: Verdict) -> dict[str, Any]:
    entry, drawn = verdict.statement.entry, verdict.readings[0]
    return {
        "figure": result.text.entry.figure,
        "says": entry.says,
        "where": entry.where,
        "number": entry.number,
        "condition": entry.holds.replace("-", "−"),
        "value": with_unit(drawn.value, entry.unit, DIGITS),
        "parts": _parts(drawn),
        "holds": verdict.holds,
        "others": [{"setting": s.name, "value": with_unit(r.value, entry.unit, DIGITS)} for s, r in verdict.others],
        "settings": len(verdict.settings),
        "note": " ".join(entry.note.split()),
    }


def _parts(reading: Reading) -> list[str]:
    unit = unit_text(reading.unit)
    parts = [(name, 0.0 if abs(value) < ROUNDING else value) for name, value in reading.parts]
    return [f"{name}: {number(value, DIGITS)}{' ' + unit if unit else ''}" for name, value in parts]
