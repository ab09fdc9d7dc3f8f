"""Style of the gallery's panels: true values dark, estimates blue, comparisons orange or green."""

from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.report.style import CURVE, INK, QUIET, SECOND, THIRD, labelled

TRUE, ESTIMATED, OTHER, THIRD_ONE, IDEAL = INK, CURVE, SECOND, THIRD, QUIET
WIDTH_IN, ROW_IN, LEGEND_IN, DPI = 11.0, 2.7, 0.45, 90
STYLE = {"font.size": 13, "axes.titlesize": 13.5, "xtick.labelsize": 12, "ytick.labelsize": 12}
MOST_POINTS = 3000
TIME = "time in s"


def line(
    axes: Any, x: Array, y: Array, colour: str, label: str | None = None, width: float = 1.8, dashes: Any = "-"
) -> None:
    """A curve, thinned to fewer than twice ``MOST_POINTS`` points."""
    stride = max(1, len(x) // MOST_POINTS)
    style: dict[str, Any] = {"color": colour, "linewidth": width, "linestyle": dashes}
    axes.plot(x[::stride], y[::stride], label=label, solid_joinstyle="round", **style)


def dots(axes: Any, x: Array, y: Array, colour: str, label: str | None = None) -> None:
    """Samples as dots."""
    stride = max(1, len(x) // MOST_POINTS)
    axes.plot(x[::stride], y[::stride], ".", color=colour, markersize=2.6, markeredgewidth=0, alpha=0.5, label=label)


def frame(axes: Any, x: str, y: str, title: str = "") -> None:
    """Labels, a light grid and a line at zero."""
    labelled(axes, x, y)
    if title:
        axes.set_title(title, loc="left", color=INK)
    axes.locator_params(axis="both", nbins=5)
    low, high = axes.get_ylim()
    if low < 0 < high:
        axes.axhline(0, color=QUIET, linewidth=0.8, zorder=1.5)


def limit(axes: Any, values: Array, room: float = 1.3) -> None:
    """Vertical limits ± ``room`` times the largest magnitude of ``values``, whatever else the panel shows."""
    top = room * float(np.max(np.abs(values)))
    axes.set_ylim(-top, top)


def legend(figure: Any, *panels: Any) -> None:
    """One legend above all panels, of each label once."""
    found: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    made = figure.legend(found.values(), found, loc="outside upper left", ncols=len(found), frameon=False)
    for handle in made.legend_handles:
        handle.set_linewidth(3)
        handle.set_alpha(1)
        if handle.get_marker() not in (None, "None", ""):
            handle.set_markersize(10)
