"""The map of a feasibility report as a PNG: stable region, decay rate, noise bound, chosen and suggested gains."""

from typing import Any

import matplotlib
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullFormatter

from codegen.analysis.feasibility.axes import SAMPLE_TIME, GainAxis
from codegen.analysis.feasibility.gains import Feasibility
from codegen.analysis.feasibility.suggest import NOISE_SHARE
from codegen.report.style import figure_bytes
from codegen.report.wording import number, unit_text

INK, QUIET, OUTSIDE = "#1d1f22", "#8a8f96", "#d9d9d9"
NOISE, EULER, CONTINUOUS = "#c2410c", "#111827", "#7c3aed"
CHOSEN, SUGGESTED = "#ffffff", "#facc15"
SIZE_IN, DPI = (9.2, 8.4), 130
DECADE_STEPS = (1.0, 2.0, 5.0)
"""Levels of the decay rate in each decade."""
MANY = 500.0
"""Ratio of the 99 % to the 30 % quantile of the decay rates from which on only the powers of ten are levels."""
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 17,
    "axes.labelsize": 19,
    "axes.titlesize": 18,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "legend.fontsize": 15.5,
    "hatch.linewidth": 0.7,
}


def gain_map_png(report: Feasibility) -> bytes:
    """The map as PNG; deterministic for a report."""
    spaces = {"w_pad": 0.08, "h_pad": 0.08}
    return figure_bytes(lambda figure: _draw(figure, figure.subplots(), report), SIZE_IN, "png", DPI, spaces, STYLE)


def decay_levels(decay: Any) -> list[float]:
    """Contour levels: 1, 2, 5 in each decade, or 1 alone where the decay rates span many decades; at most eight."""
    good = decay[np.isfinite(decay) & (decay > 0)]
    if not len(good):
        return []
    low, high = (float(q) for q in np.quantile(good, (0.02, 0.99)))
    steps = DECADE_STEPS if np.quantile(good, 0.99) < MANY * np.quantile(good, 0.3) else DECADE_STEPS[:1]
    powers = range(int(np.floor(np.log10(low))), int(np.floor(np.log10(high))) + 1)
    levels = [step * 10.0**p for p in powers for step in steps]
    return [level for level in levels if low < level < high][-8:]


def _draw(figure: Any, axes: Any, report: Feasibility) -> None:
    region = report.region
    x, y = np.meshgrid(region.x_values, region.y_values, indexing="ij")
    decay = np.where(region.radius < 1, region.decay_rate, np.nan)
    axes.set_facecolor(OUTSIDE)
    handles: list[Any] = [Patch(facecolor=OUTSIDE, edgecolor=QUIET, label="unstable somewhere in the envelope")]
    lines = None
    levels = decay_levels(decay)
    if levels:
        colours = matplotlib.colormaps["GnBu"](np.linspace(0.12, 0.75, len(levels) + 1))
        bounds = [0.0, *levels, float(np.nanmax(decay)) * 1.001]
        axes.contourf(x, y, np.clip(region.decay_rate, -1e9, None), bounds, colors=colours)
        lines = axes.contour(x, y, decay, levels, colors="#1e5f8a", linewidths=1.1)
        handles.append(Line2D([], [], color="#1e5f8a", linewidth=1.5, label="decay rate of the slowest error"))
    for which, colour, dash, words in (
        ("sampled", EULER, "-", "boundary of the sampled code"),
        ("continuous", CONTINUOUS, (0, (4, 2)), "boundary in continuous time"),
    ):
        for line in region.boundary[which]:
            axes.plot(*np.array(line).T, color=colour, linewidth=2.6, linestyle=dash)
        if region.boundary[which]:
            handles.append(Line2D([], [], color=colour, linewidth=2.6, linestyle=dash, label=words))
    share = np.where(np.isfinite(report.noise_share), report.noise_share, np.nan)
    if np.nanmin(np.append(share, np.inf)) < NOISE_SHARE < np.nanmax(np.append(share, -np.inf)):
        axes.contour(x, y, np.log(share), [np.log(NOISE_SHARE)], colors=NOISE, linewidths=2.2, linestyles="dashdot")
        words = f"noise {number(100 * NOISE_SHARE)} % of the friction"
        handles.append(Line2D([], [], color=NOISE, linewidth=2.2, linestyle="dashdot", label=words))
    for judged, marker, colour, words in (
        (report.chosen, "o", CHOSEN, "chosen"),
        (report.suggested, "*", SUGGESTED, "suggested"),
    ):
        if judged is not None:
            period = float(report.observer.sample_time)
            at = [judged.numbers[axis.name] if axis.weights else period for axis in (region.x, region.y)]
            style: dict[str, Any] = {"marker": marker, "markersize": 15 if marker == "o" else 24, "color": colour}
            style |= {"markeredgecolor": INK, "linestyle": ""}
            axes.plot(*at, **style, markeredgewidth=1.8, zorder=5, clip_on=False)
            handles.append(Line2D([], [], **style, label=words))
    _frame(axes, region.x, region.y)
    axes.set_title(
        f"{report.spec.name}: {report.observer.kind.upper()}, velocity {report.observer.velocity}", loc="left"
    )
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False, handlelength=1.8)
    if lines is not None:
        figure.draw_without_rendering()  # labels need the final layout of the lines
        axes.clabel(lines, fmt=lambda v: f"{number(v, 3)}/s", fontsize=14, colors="#123f5e")


def _frame(axes: Any, x: GainAxis, y: GainAxis) -> None:
    axes.set_xscale("log" if x.logarithmic else "linear")
    axes.set_yscale("log" if y.logarithmic else "linear")
    axes.set_xlim(x.low, x.high)
    axes.set_ylim(y.low, y.high)
    axes.set_xlabel(_label(x))
    axes.set_ylabel(_label(y))
    for each in (axes.xaxis, axes.yaxis):
        each.set_minor_formatter(NullFormatter())


def _label(axis: GainAxis) -> str:
    name = "sample time h" if axis.name == SAMPLE_TIME and not axis.weights else axis.label.replace("-", "−")
    unit = unit_text(axis.unit)
    return f"{name} in {unit}" if unit else name
