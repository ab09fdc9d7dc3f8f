"""Pictures of docs/ as SVG: panels in a row, with values that are the same on every platform."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from codegen.report.style import QUIET, STYLE, figure_bytes, labelled

PANEL_IN, HEIGHT_IN = 4.0, 3.0
"""Width and height of one panel of ``svg_of``, inches."""
DIGITS = 5
"""Digits to which ``rounded`` keeps drawn values."""


def rounded(values: Any) -> Any:
    """Values rounded to ``DIGITS`` digits of the largest magnitude, so that a picture is the same on every platform.

    Arrays of positive values are not rounded, since small values are visible on a logarithmic axis.
    """
    array = np.asarray(values, dtype=float)
    size = float(np.nanmax(np.abs(array)))
    return array if size == 0 or np.nanmin(array) > 0 else np.round(array / size, DIGITS) * size


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
