"""docs/gallery: the page with a table of statements and verdicts, and readings.json with each figure's last results.

Numbers are stored as the page prints them. The texts of the page are read from ``claims/`` when it is written, so that
they can be corrected without a run. A figure whose statements, conditions or settings have changed counts as not run.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from codegen.base.errors import BadInput
from codegen.base.files import write_all
from codegen.base.own_files import page_says_ours, refuse_unlisted
from codegen.base.text import render
from codegen.report.wording import number, unit_text, with_unit
from codegen.thesis.gallery.build import FOLDER, GalleryResult, Verdict
from codegen.thesis.gallery.statement import Figure, Statement, read_figures

KEPT = "readings.json"
DIGITS = 3
ROUNDING = 1e-12
"""Size below which a number is rounding error, and printed as 0."""
Kept = dict[str, Any]


def gallery_json(results: Sequence[GalleryResult]) -> dict[str, Kept]:
    """Figure → its readings and verdicts, as they are stored."""
    return {
        result.figure.figure: {
            "pid": [number(g, DIGITS) for g in result.pid or ()],
            "settings": _setting_names(result.figure),
            "rows": [_kept_row(verdict) for verdict in result.verdicts],
        }
        for result in results
    }


def read_kept(folder: Path) -> dict[str, Kept]:
    """Figure → its stored results; {} without a file. Raises BadInput for a file that is no JSON."""
    path = folder / KEPT
    if not path.is_file():
        return {}
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except ValueError as error:
        raise BadInput(path.name, str(error), f"the {KEPT} that `stiction gallery` writes", code="FILE004") from error


def is_of(kept: Kept, figure: Figure) -> bool:
    """Whether stored results are of the figure's present statements and settings."""
    asked = [[s.measure, s.holds] for s in figure.statements]
    answered = [[row["measure"], row["condition"]] for row in kept["rows"]]
    return asked == answered and kept["settings"] == _setting_names(figure)


def _setting_names(figure: Figure) -> list[str]:
    return figure.settings if figure.statements else []


def _kept_row(verdict: Verdict) -> Kept:
    entry, drawn = verdict.statement, verdict.readings[0]
    unit = f" {unit_text(drawn.unit)}" if unit_text(drawn.unit) else ""
    return {
        "measure": entry.measure,
        "condition": entry.holds,
        "value": with_unit(drawn.value, entry.unit, DIGITS),
        "parts": [f"{name}: {number(v if abs(v) >= ROUNDING else 0.0, DIGITS)}{unit}" for name, v in drawn.parts],
        "holds": verdict.holds,
        "others": [[s.name, with_unit(r.value, entry.unit, DIGITS)] for s, r in verdict.others],
    }


PAGE = "README.md"


def write_gallery(results: Sequence[GalleryResult], folder: Path) -> tuple[Path, ...]:
    """Write pictures and readings, and the page if every figure has been run; returns the paths.

    Other figures keep the readings of their last run.

    Raises BadInput if the folder cannot be written or has files of these names that stiction did not write, or its
    readings cannot be read.
    """
    figures = read_figures()
    earlier = read_kept(folder)
    kept = earlier | gallery_json(results)
    files: dict[str, str | bytes] = {picture_name(r.figure.figure): r.picture for r in results}
    in_order = {n: kept[n] for n in figures if n in kept}
    files[KEPT] = json.dumps(in_order, indent=1, ensure_ascii=False) + "\n"
    if all(n in kept and is_of(kept[n], figure) for n, figure in figures.items()):
        files[PAGE] = gallery_page(kept)
    listed = [KEPT, *map(picture_name, earlier)] if earlier else []
    listed += [PAGE] if page_says_ours(folder / PAGE) else []
    refuse_unlisted(folder, dict.fromkeys(files), dict.fromkeys(listed), KEPT)
    write_all(folder, files)
    return tuple(folder / name for name in files)


def gallery_page(kept: Mapping[str, Kept]) -> str:
    """The text of docs/gallery/README.md, from the stored results of every figure."""
    return render("text/gallery.md.j2", **_view(kept))


def gallery_summary(results: Sequence[GalleryResult]) -> str:
    """The statements and verdicts for a terminal."""
    return render("text/gallery.txt.j2", **_view(gallery_json(results)))


def picture_name(figure: str) -> str:
    """figure_2_4.png for "2.4"."""
    return f"figure_{figure.replace('.', '_')}.png"


def _view(kept: Mapping[str, Kept]) -> dict[str, Any]:
    figures = {n: figure for n, figure in read_figures().items() if n in kept}
    rows = [
        _row(n, statement, row, len(kept[n]["settings"]) + 1)
        for n, figure in figures.items()
        for statement, row in zip(figure.statements, kept[n]["rows"], strict=True)
    ]
    holds, robust = sum(row["holds"] for row in rows), sum(not row["others"] for row in rows)
    counts = {"holds": holds, "fails": len(rows) - holds, "robust": robust, "hangs": len(rows) - robust}
    return {"rows": rows, "figures": [_figure(f, kept[n]) for n, f in figures.items()], "counts": counts}


def _figure(entry: Figure, kept: Kept) -> dict[str, Any]:
    more = {"picture": picture_name(entry.figure), "folder": FOLDER, "open": " ".join(entry.open.split())}
    return entry.model_dump() | kept | more


def _row(figure: str, entry: Statement, row: Kept, settings: int) -> dict[str, Any]:
    more = {"figure": figure, "condition": entry.holds.replace("-", "−"), "settings": settings}
    return entry.model_dump() | row | more | {"note": " ".join(entry.note.split())}
