"""Colours, fonts and drawing functions shared by the pictures of reports, laws and gallery."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
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
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE | {name.replace("__", "."): value for name, value in style.items()})
        layout = ConstrainedLayoutEngine(w_pad=0.07, h_pad=0.06, wspace=0.03, hspace=0.04)
        figure = Figure(figsize=size, layout=layout, facecolor="white")
        FigureCanvasAgg(figure)
        draw(figure)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})
    return buffer.getvalue()
