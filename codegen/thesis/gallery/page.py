"""docs/gallery: one table of all statements with verdicts, then every figure with its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from codegen.base.files import write_all
from codegen.base.text import render
from codegen.thesis.gallery.build import FOLDER, GalleryResult
from codegen.thesis.gallery.kept import KEPT, Kept, is_of, kept_of, kept_text, read_kept
from codegen.thesis.gallery.statement import FigureText, StatementEntry, read_figures

PAGE = "README.md"


def write_gallery(results: Sequence[GalleryResult], folder: Path) -> tuple[Path, ...]:
    """Write pictures and readings, and the page where every figure has been run; the paths written.

    Figures that are not among the results keep the readings of their last run.

    Raises:
        BadInput: if the folder cannot be written, or its readings not be read.
    """
    figures = read_figures()
    kept = read_kept(folder) | {r.text.entry.figure: kept_of(r) for r in results}
    files: dict[str, str | bytes] = {picture_name(r.text.entry.figure): r.picture for r in results}
    files[KEPT] = kept_text(kept, list(figures))
    if all(n in kept and is_of(kept[n], text) for n, text in figures.items()):
        files[PAGE] = gallery_page(kept)
    write_all(folder, files)
    return tuple(folder / name for name in files)


def gallery_page(kept: Mapping[str, Kept]) -> str:
    """The text of docs/gallery/README.md, from what is kept of every figure."""
    return render("text/gallery.md.j2", **_view(kept))


def gallery_summary(results: Sequence[GalleryResult]) -> str:
    """The statements and verdicts for a terminal."""
    return render("text/gallery.txt.j2", **_view({r.text.entry.figure: kept_of(r) for r in results}))


def gallery_json(results: Sequence[GalleryResult]) -> dict[str, Any]:
    """Figure → its readings and verdicts."""
    return {r.text.entry.figure: kept_of(r) for r in results}


def picture_name(figure: str) -> str:
    """figure_2_4.png for "2.4"."""
    return f"figure_{figure.replace('.', '_')}.png"


def _view(kept: Mapping[str, Kept]) -> dict[str, Any]:
    texts = {n: text for n, text in read_figures().items() if n in kept}
    rows = [
        _row(n, statement.entry, row, len(kept[n]["settings"]) + 1)
        for n, text in texts.items()
        for statement, row in zip(text.statements, kept[n]["rows"], strict=True)
    ]
    held = [row["holds"] for row in rows]
    robust = [not row["others"] for row in rows]
    counts = {
        "holds": sum(held),
        "fails": len(held) - sum(held),
        "robust": sum(robust),
        "hangs": len(robust) - sum(robust),
    }
    return {"rows": rows, "figures": [_figure(t, kept[n]) for n, t in texts.items()], "counts": counts}


def _figure(text: FigureText, kept: Kept) -> dict[str, Any]:
    entry = text.entry
    more = {"picture": picture_name(entry.figure), "folder": FOLDER, "open": " ".join(entry.open.split())}
    return entry.model_dump() | kept | more


def _row(figure: str, entry: StatementEntry, row: Kept, settings: int) -> dict[str, Any]:
    more = {"figure": figure, "condition": entry.holds.replace("-", "−"), "settings": settings}
    return entry.model_dump() | row | more | {"note": " ".join(entry.note.split())}
