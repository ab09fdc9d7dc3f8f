"""Pictures of the report as SVG: axes and text as vectors, samples as a bitmap; one panel per picture."""

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.ticker import NullFormatter, ScalarFormatter

from codegen.base.parallel import in_processes
from codegen.report.evidence import LawPanel
from codegen.report.series import CoordinateSeries, half_range
from codegen.report.style import INK, QUIET, figure_bytes, labelled
from codegen.report.wording import number, prefixed, unit_text

COLOURS = {"declared": "#7d848d", "refit": "#e08214", "augmented": "#1f6fb4"}
DARK = {"declared": "#3b4047", "refit": "#8c4a00", "augmented": "#0b3c6b"}
SMOOTH, LAW = "#26282b", "#1f6fb4"
SIZE_IN = (4.3, 2.95)
"""Size of a panel: 410 pixels wide, so that its text is readable on a screen of 390."""
AXES_BOX = (0.185, 0.185, 0.975 - 0.185, 0.9 - 0.185)
"""Position of the axes in a panel: left, bottom, width and height as shares of its size."""
DPI = 110
TICKS_HZ = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
DOTS: dict[str, Any] = {"markersize": 2.4, "markeredgewidth": 0, "alpha": 0.3, "rasterized": True}


@dataclass(frozen=True)
class Panel:
    """A picture: its title, and the SVG as a data URL."""

    title: str
    data_url: str


@dataclass(frozen=True)
class Drawing:
    """A picture to be drawn: its title, and the function that draws it on axes."""

    title: str
    draw: Callable[[Any], None]


def drawn(groups: Sequence[Sequence[Drawing]]) -> list[tuple[Panel, ...]]:
    """The pictures of drawings, in their groups; drawn in several processes, since matplotlib is not thread-safe."""
    found = iter(in_processes(_panel, [one for group in groups for one in group], threads=False))
    return [tuple(next(found) for _ in group) for group in groups]


def residual_drawings(coordinate: CoordinateSeries) -> tuple[Drawing, ...]:
    """Drawings of one coordinate: residual force over four variables, time and frequency, and the free-run error."""
    force = f"residual in {unit_text(coordinate.force_unit)}"
    factor, unit = _scale([m.over["position"][0].x for m in coordinate.models.values()], coordinate.unit)
    over = (  # variable, label of its axis, factor from SI to the unit of the label
        ("velocity", f"{coordinate.velocity} in {unit_text(coordinate.unit)}/s", 1.0),
        ("position", f"{coordinate.name} in {unit_text(unit)}", factor),
        ("load", f"load that the refit predicts in {unit_text(coordinate.force_unit)}", 1.0),
        ("acceleration", f"acceleration in {unit_text(coordinate.unit)}/s²", 1.0),
    )

    def scatter(name: str, label: str, factor: float) -> Callable[[Any], None]:
        def draw(axes: Any) -> None:
            _scatter(axes, coordinate, name, factor)
            _frame(axes, label, force)

        return draw

    def by_time(axes: Any) -> None:
        for name, model in coordinate.models.items():
            axes.plot(model.by_time.x, model.by_time.y, color=COLOURS[name], linewidth=0.7, alpha=0.85)
        axes.set_ylim(-coordinate.limit, coordinate.limit)
        axes.margins(x=0.01)
        _frame(axes, "time in s", force)

    on = coordinate.name
    return (
        *(Drawing(f"residual on {on} over {name}", scatter(name, label, factor)) for name, label, factor in over),
        Drawing(f"residual on {on} over time", by_time),
        Drawing(f"residual on {on} by frequency", lambda axes: _spectrum(axes, coordinate)),
        Drawing(f"free run of {on} over time", lambda axes: _free_run(axes, coordinate)),
    )


def law_drawing(panel: LawPanel, variable: str, units: tuple[str, str], title: str) -> Drawing:
    """The residual of the model without an effect, a smooth curve through it, and the force of the effect's law.

    ``units``: of the variable, of the force.
    """
    factor, unit = _scale([panel.samples.x], units[0]) if variable == "position" else (1.0, units[0])

    def draw(axes: Any) -> None:
        axes.plot(factor * panel.samples.x, panel.samples.y, ".", color=COLOURS["refit"], **DOTS)
        axes.plot(factor * panel.law.x, panel.law.y, color="white", linewidth=3.6)
        axes.plot(factor * panel.law.x, panel.law.y, color=LAW, linewidth=1.9)
        axes.plot(factor * panel.smooth.x, panel.smooth.y, color=SMOOTH, linewidth=1.5, linestyle=(0, (3, 2)))
        if len(panel.samples.y):
            half_height = half_range([panel.samples.y])
            axes.set_ylim(-half_height, half_height)
        _frame(axes, f"{variable} in {unit_text(unit)}" if unit else variable, f"residual in {unit_text(units[1])}")

    return Drawing(title, draw)


def _free_run(axes: Any, coordinate: CoordinateSeries) -> None:
    factor, unit = _scale([c.y for c in coordinate.free_run.values()], coordinate.unit)
    for name, curve in coordinate.free_run.items():
        axes.plot(curve.x, factor * curve.y, color=COLOURS[name], linewidth=0.9, alpha=0.9)
    _frame(axes, "time in s", f"error of {coordinate.name} in {unit_text(unit)}")
    axes.margins(x=0.01)
    if not any(np.isfinite(c.y).any() for c in coordinate.free_run.values()):
        _write_only(axes, "no prediction stays finite")


def _scatter(axes: Any, coordinate: CoordinateSeries, over: str, factor: float) -> None:
    """Samples as small dots, and their mean in bins as a line."""
    for name, model in coordinate.models.items():
        dots, _ = model.over[over]
        axes.plot(factor * dots.x, dots.y, ".", color=COLOURS[name], **DOTS)
    for name, model in coordinate.models.items():
        _, mean = model.over[over]
        axes.plot(factor * mean.x, mean.y, color="white", linewidth=3.2, solid_capstyle="round")
        axes.plot(factor * mean.x, mean.y, color=DARK[name], linewidth=1.7, solid_capstyle="round")
    axes.set_ylim(-coordinate.limit, coordinate.limit)


def _spectrum(axes: Any, coordinate: CoordinateSeries) -> None:
    """Power spectral density on logarithmic axes, with a line at the cutoff of the residual's low-pass."""
    spectra = [(name, m.spectrum) for name, m in coordinate.models.items() if m.spectrum is not None]
    if not spectra:
        _frame(axes, "", "")
        _write_only(axes, "no stretch of motion\nis long enough")
        return
    for name, curve in spectra:
        axes.plot(curve.x, curve.y, color=COLOURS[name], linewidth=1.4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axvline(coordinate.cutoff_hz, color=QUIET, linewidth=1, linestyle=(0, (4, 3)))
    shown = spectra[0][1].x
    in_range = [t for t in TICKS_HZ if shown[0] <= t <= shown[-1]]
    ticks = in_range[::-2][::-1]  # every second one, the highest among them
    axes.set_xticks(ticks, [number(t) for t in ticks])
    axes.set_xticks([], minor=True)
    # At least a decade high, by the values below the cutoff: above it the filter dominates.
    below = np.concatenate([c.y[c.x <= coordinate.cutoff_hz] for _, c in spectra])
    axes.set_ylim(min(below.min(), below.max() / 10) / 2, below.max() * 3)
    axes.yaxis.set_minor_formatter(NullFormatter())
    unit = unit_text(coordinate.force_unit)
    _frame(axes, "frequency in Hz", f"power in {f'({unit})' if '·' in unit else unit}²/Hz")


def _frame(axes: Any, x: str, y: str) -> None:
    """Labels and grid; on linear axes also a line at zero, few ticks and scientific notation."""
    labelled(axes, x, y, grid=0.6)
    if axes.get_yscale() == "linear":
        axes.axhline(0, color=QUIET, linewidth=0.8, zorder=1.5)
        axes.locator_params(axis="both", nbins=5)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(_PlainLabels(useMathText=True))
        axes.ticklabel_format(axis="both", style="sci", scilimits=(-3, 4))


class _PlainLabels(ScalarFormatter):
    """Tick labels as plain text; only the power of ten is mathtext, which takes milliseconds per label."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return super().__call__(x, pos).replace("$\\mathdefault{", "").replace("}$", "")


def _write_only(axes: Any, sentence: str) -> None:
    """Write a sentence instead of curves, on axes without ticks."""
    axes.text(0.5, 0.5, sentence, transform=axes.transAxes, ha="center", va="center", color=QUIET)
    axes.set_xticks([])
    axes.set_yticks([])


def _scale(values: Sequence[Any], unit: str) -> tuple[float, str]:
    """Factor and prefixed unit for the largest finite value of several series."""
    finite = np.concatenate([v[np.isfinite(v)] for v in values])
    return prefixed([float(np.abs(finite).max())] if len(finite) else [], unit)


def _panel(drawing: Drawing) -> Panel:
    """The SVG of a drawing, as a data URL."""

    def on_figure(figure: Any) -> None:
        axes = figure.add_axes(AXES_BOX)
        drawing.draw(axes)
        axes.set_title(drawing.title, color=INK, loc="left", fontweight="bold", fontsize=10.5, x=-0.16)

    encoded = base64.b64encode(figure_bytes(on_figure, SIZE_IN, "svg", DPI)).decode("ascii")
    return Panel(drawing.title, f"data:image/svg+xml;base64,{encoded}")
