"""Colours, fonts and drawing functions of all pictures: reports, laws, effects and gallery."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, Literal

import numpy as np

INK, QUIET, GRID = "#26282b", "#8a8f96", "#dfe2e6"
PANEL_IN, HEIGHT_IN = 4.0, 3.0
"""Width and height of one panel of ``svg_of``, inches."""
DIGITS = 5
"""Digits to which ``rounded`` keeps drawn values."""
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


def load_libraries() -> None:
    """Import the libraries that ``figure_bytes`` needs, in advance of the first picture; takes half a second."""
    for name in ("backends.backend_agg", "backends.backend_svg", "figure", "layout_engine"):
        import_module(f"matplotlib.{name}")


def figure_bytes(
    draw: Callable[[Any], None],
    size: tuple[float, float],
    kind: Literal["png", "svg"],
    dpi: int | None = None,
    spaces: Mapping[str, Any] | None = None,
    look: Mapping[str, Any] = STYLE,
) -> bytes:
    """The bytes of a figure's file, without a date; they depend on matplotlib's defaults and ``look`` only.

    So they are the same in every run.

    Args:
        draw: function that draws the content on a figure.
        size: width and height, inches.
        dpi: resolution of a PNG, and of those parts of an SVG that are bitmaps.
        spaces: distances between the panels that matplotlib arranges; None if ``draw`` positions them.
        look: matplotlib settings.
    """
    import matplotlib  # imported here, since it takes about a second, which lists of laws and effects save
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(look)
        layout = None if spaces is None else ConstrainedLayoutEngine(**spaces)
        figure = Figure(figsize=size, layout=layout, facecolor="white")
        (FigureCanvasSVG if kind == "svg" else FigureCanvasAgg)(figure)
        draw(figure)
        buffer = io.BytesIO()
        undated = {"Date": None, "Creator": None} if kind == "svg" else {"Software": None}
        figure.savefig(buffer, format=kind, dpi=dpi or "figure", metadata=undated)
    return _numbered_clips(buffer.getvalue()) if kind == "svg" else buffer.getvalue()


def _numbered_clips(text: bytes) -> bytes:
    """An SVG with numbers as ids of its clip paths: matplotlib's ids hash sizes whose last bits differ by platform."""
    for k, name in enumerate(dict.fromkeys(re.findall(rb'<clipPath id="(p[0-9a-f]+)">', text))):
        text = text.replace(name, b"clip%d" % k)
    return text


def rounded(values: Any) -> Any:
    """Values rounded to ``DIGITS`` digits of the largest magnitude, so that a picture is the same on every platform.

    Arrays of positive values are not rounded, since small values are visible on a logarithmic axis.
    """
    array = np.asarray(values, dtype=float)
    size = float(np.nanmax(np.abs(array)))
    return array if size == 0 or np.nanmin(array) > 0 else np.round(array / size, DIGITS) * size


def labelled(axes: Any, x: str, y: str, grid: float = 0.8) -> None:
    """Labels, a grid of this line width, and no frame on top and at the right."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(True, color=GRID, linewidth=grid)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def framed(axes: Any, x: str, y: str) -> None:
    """``labelled``, at most five ticks on a linear axis, and lines at zero where the linear axes cross there."""
    labelled(axes, x, y)
    low, high = axes.get_ylim()
    if axes.get_xscale() == "linear":
        axes.locator_params(axis="x", nbins=5)
        if low < 0 < high:
            axes.axhline(0, color=QUIET, linewidth=0.8, zorder=1.5)
            axes.axvline(0, color=QUIET, linewidth=0.8, zorder=1.5)
    axes.locator_params(axis="y", nbins=5)


def svg_of(panels: tuple[Callable[[Any], None], ...]) -> str:
    """The SVG of panels in a row."""

    def draw(figure: Any) -> None:
        for axes, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            panel(axes)

    look = STYLE | {"font.size": 13, "xtick.labelsize": 12, "ytick.labelsize": 12}
    spaces = {"w_pad": 0.08, "h_pad": 0.06, "wspace": 0.05}
    return figure_bytes(draw, (PANEL_IN * len(panels), HEIGHT_IN), "svg", spaces=spaces, look=look).decode()
