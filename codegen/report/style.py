"""Colours, fonts and drawing functions of all pictures: reports, gallery and pages of docs/."""

import io
import re
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, Literal

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


def labelled(axes: Any, x: str, y: str, grid: float = 0.8) -> None:
    """Labels, a grid of this line width, and no frame on top and at the right."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(True, color=GRID, linewidth=grid)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
