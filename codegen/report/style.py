"""Colours, fonts and drawing functions shared by the pictures of reports, laws and gallery."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Any, Literal

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

INK, QUIET, GRID = "#26282b", "#8a8f96", "#dfe2e6"
CURVE, SECOND, THIRD = "#1f6fb4", "#e08214", "#4d9221"
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 10.5,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.titlesize": 11,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "axes.unicode_minus": True,
    "svg.fonttype": "path",
    "svg.hashsalt": "stiction",
    "path.simplify": True,
}


def png(draw: Callable[[Any], None], size: tuple[float, float], dpi: int, **style: Any) -> bytes:
    """The PNG of what ``draw`` draws on a figure; deterministic.

    Args:
        size: width and height in inches.
        style: matplotlib settings in addition to ``STYLE``, dots in their names as double underscores.
    """
    spaces = {"w_pad": 0.07, "h_pad": 0.06, "wspace": 0.03, "hspace": 0.04}
    return _drawn(draw, size, "png", dpi, spaces, style)


def svg(
    draw: Callable[[Any], None], size: tuple[float, float], dpi: int | None = None, fits: bool = False, **style: Any
) -> bytes:
    """The same as SVG.

    Args:
        dpi: of what is drawn as a bitmap.
        fits: whether panels are fitted into the figure; else ``draw`` places them.
    """
    return _drawn(draw, size, "svg", dpi, {"w_pad": 0.08, "h_pad": 0.06, "wspace": 0.05} if fits else None, style)


def _drawn(
    draw: Callable[[Any], None],
    size: tuple[float, float],
    kind: Literal["png", "svg"],
    dpi: int | None,
    spaces: Mapping[str, Any] | None,
    style: Mapping[str, Any],
) -> bytes:
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE | {name.replace("__", "."): value for name, value in style.items()})
        layout = None if spaces is None else ConstrainedLayoutEngine(**spaces)
        figure = Figure(figsize=size, layout=layout, facecolor="white")
        (FigureCanvasSVG if kind == "svg" else FigureCanvasAgg)(figure)
        draw(figure)
        buffer = io.BytesIO()
        undated = {"Date": None, "Creator": None} if kind == "svg" else {"Software": None}
        figure.savefig(buffer, format=kind, dpi=dpi or "figure", metadata=undated)
    return buffer.getvalue()
