"""Pictures as SVG: axes and words are vectors, clouds of points a bitmap inside; same data, same bytes."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from codegen.report.series import CoordinateSeries, Curve, HeldOutSeries, ModelResidual
from codegen.report.style import GRID, INK, QUIET, STYLE
from codegen.report.wording import number, prefixed, unit_text

COLOURS = {"refit": "#e08214", "augmented": "#1f6fb4"}
DARK = {"refit": "#8c4a00", "augmented": "#0b3c6b"}
LABELS = {"refit": "refit: nothing added", "augmented": "augmented: effect added"}
WIDTH_IN, ROW_IN, RUN_ROW_IN, LEGEND_IN = 12.4, 2.75, 1.9, 0.42
DPI = 130
TICKS_HZ = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
DOTS: dict[str, Any] = {"markersize": 2.4, "markeredgewidth": 0, "alpha": 0.35, "rasterized": True}


def residual_picture(series: HeldOutSeries) -> str:
    """A row of four panels for each coordinate: residual by velocity, position and time, and its spectrum."""

    def draw(figure: Any) -> None:
        grid = figure.subplots(len(series.coordinates), 4, squeeze=False)
        for panels, coordinate in zip(grid, series.coordinates, strict=True):
            _residual_row(panels, coordinate, series)
        for axes, title in zip(grid[0], ("by velocity", "by position", "over time", "by frequency"), strict=True):
            axes.set_title(title, color=INK, loc="left", fontweight="bold")
        _legend(figure, series, means=True)

    return _svg(draw, ROW_IN * len(series.coordinates) + LEGEND_IN)


def free_run_picture(series: HeldOutSeries) -> str:
    """Predicted less measured position over time, one panel a coordinate."""

    def draw(figure: Any) -> None:
        grid = figure.subplots(len(series.coordinates), 1, squeeze=False, sharex=True)[:, 0]
        for axes, coordinate in zip(grid, series.coordinates, strict=True):
            factor, unit = _scale([c.y for c in coordinate.free_run], coordinate.unit)
            for name, curve in zip(series.names, coordinate.free_run, strict=True):
                axes.plot(curve.x, factor * curve.y, color=COLOURS[name], linewidth=0.9, alpha=0.9)
            _frame(axes, "", f"{coordinate.name} error in {unit_text(unit)}")
            axes.margins(x=0.005)
            if not any(np.isfinite(c.y).any() for c in coordinate.free_run):
                _say(axes, "no prediction stays finite")
        grid[-1].set_xlabel("time in s")
        figure.align_ylabels()
        _legend(figure, series, means=False)

    return _svg(draw, RUN_ROW_IN * len(series.coordinates) + LEGEND_IN + 0.3)


def _residual_row(panels: Any, coordinate: CoordinateSeries, series: HeldOutSeries) -> None:
    force = unit_text(coordinate.force_unit)
    by_velocity, by_position, by_time, by_frequency = panels
    _cloud(by_velocity, coordinate, series, lambda m: (m.by_velocity, m.mean_by_velocity), 1.0)
    speed = f"{coordinate.velocity} in {unit_text(coordinate.unit)}/s"
    _frame(by_velocity, speed, f"residual on {coordinate.name} in {force}")
    factor, unit = _scale([m.by_position.x for m in coordinate.models], coordinate.unit)
    _cloud(by_position, coordinate, series, lambda m: (m.by_position, m.mean_by_position), factor)
    _frame(by_position, f"{coordinate.name} in {unit_text(unit)}", "")
    for name, model in zip(series.names, coordinate.models, strict=True):
        by_time.plot(model.by_time.x, model.by_time.y, color=COLOURS[name], linewidth=0.7, alpha=0.85)
    by_time.set_ylim(-coordinate.limit, coordinate.limit)
    by_time.margins(x=0.01)
    _frame(by_time, "time in s", "")
    _spectrum(by_frequency, coordinate, series)
    for axes in (by_position, by_time):
        axes.tick_params(labelleft=False)


def _cloud(
    axes: Any,
    coordinate: CoordinateSeries,
    series: HeldOutSeries,
    pick: Callable[[ModelResidual], tuple[Curve, Curve]],
    factor: float,
) -> None:
    """Samples as small dots, and their mean in bins as a line."""
    for name, model in zip(series.names, coordinate.models, strict=True):
        dots, _ = pick(model)
        axes.plot(factor * dots.x, dots.y, ".", color=COLOURS[name], **DOTS)
    for name, model in zip(series.names, coordinate.models, strict=True):
        _, mean = pick(model)
        axes.plot(factor * mean.x, mean.y, color="white", linewidth=3.6, solid_capstyle="round")
        axes.plot(factor * mean.x, mean.y, color=DARK[name], linewidth=1.9, solid_capstyle="round")
    axes.set_ylim(-coordinate.limit, coordinate.limit)


def _spectrum(axes: Any, coordinate: CoordinateSeries, series: HeldOutSeries) -> None:
    named = zip(series.names, coordinate.models, strict=True)
    spectra = [(name, model.spectrum) for name, model in named if model.spectrum is not None]
    if not spectra:
        _frame(axes, "", "")
        _say(axes, "no stretch of motion\nis long enough")
        return
    for name, curve in spectra:
        axes.plot(curve.x, curve.y, color=COLOURS[name], linewidth=1.4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axvline(series.cutoff_hz, color=QUIET, linewidth=1, linestyle=(0, (4, 3)))
    shown = spectra[0][1].x
    ticks = [t for t in TICKS_HZ if shown[0] <= t <= shown[-1]][::-2][::-1]
    axes.set_xticks(ticks, [number(t) for t in ticks])
    axes.set_xticks([], minor=True)
    below = np.concatenate([c.y[c.x <= series.cutoff_hz] for _, c in spectra])
    axes.set_ylim(min(below.min(), below.max() / 10) / 2, below.max() * 3)
    axes.yaxis.set_minor_formatter(NullFormatter())
    _frame(axes, "frequency in Hz", f"power in {_squared(unit_text(coordinate.force_unit))}/Hz")


def _frame(axes: Any, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if axes.get_yscale() == "linear":
        axes.axhline(0, color=QUIET, linewidth=0.8, zorder=1.5)
        axes.locator_params(axis="both", nbins=5)


def _legend(figure: Any, series: HeldOutSeries, means: bool) -> None:
    """Above all panels, so that it covers no data."""
    handles, labels = [], []
    for name in series.names:
        handles.append(Line2D([], [], color=COLOURS[name], linewidth=3))
        labels.append(LABELS[name])
        if means:
            handles.append(Line2D([], [], color=DARK[name], linewidth=2))
            labels.append("its mean in bins")
    figure.legend(handles, labels, loc="outside upper left", ncols=len(handles), frameon=False, handlelength=1.6)


def _say(axes: Any, words: str) -> None:
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", color=QUIET)
    axes.set_xticks([])
    axes.set_yticks([])


def _scale(values: list[Any], unit: str) -> tuple[float, str]:
    finite = np.concatenate([v[np.isfinite(v)] for v in values])
    return prefixed([float(np.abs(finite).max())] if len(finite) else [], unit)


def _squared(unit: str) -> str:
    return f"({unit})²" if "·" in unit else f"{unit}²"


def _svg(draw: Callable[[Any], None], height: float) -> str:
    """A data address of the SVG that ``draw`` makes; only this block sees the style."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05, wspace=0.02, hspace=0.04)
        figure = Figure(figsize=(WIDTH_IN, height), layout=layout, facecolor="white")
        FigureCanvasSVG(figure)
        draw(figure)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="svg", dpi=DPI, metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
