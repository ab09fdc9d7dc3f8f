"""The picture of docs/calibration.md: measured over nominal rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.panels import framed, svg_of
from codegen.report.style import CURVE, INK, QUIET, SECOND, THIRD

LEAST = 1e-4
COLOURS = (CURVE, SECOND, THIRD)


def picture(ways: Mapping[str, Mapping[str, Sequence[float]]], alpha: float) -> str:
    """The SVG: way → group → p of its surrogates, a panel a way."""
    return svg_of(tuple(partial(_panel, way=way, groups=groups, alpha=alpha) for way, groups in ways.items()))


def steps(values: Sequence[float]) -> tuple[list[float], list[float]]:
    """The share of values at or below each of them, as the corners of its stairs from ``LEAST`` to 1."""
    p = np.sort(np.clip(values, LEAST, 1.0))
    share = np.arange(1, len(p) + 1) / len(p)
    return [*map(float, p), 1.0], [*map(float, share), 1.0]


def _panel(axes: Any, way: str, groups: Mapping[str, Sequence[float]], alpha: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.plot([LEAST, 1], [LEAST, 1], color=QUIET, linewidth=1.2, linestyle=(0, (4, 3)))
    axes.axvline(alpha, color=QUIET, linewidth=0.8)
    lowest = min((1 / len(p) for p in groups.values() if len(p)), default=0.1)
    for k, (group, values) in enumerate(groups.items()):
        if len(values):
            axes.step(*steps(values), where="post", color=COLOURS[k % len(COLOURS)], linewidth=1.8, label=group)
    axes.set_xlim(LEAST, 1)
    axes.set_ylim(min(lowest / 2, alpha / 2), 1.1)
    axes.set_title(way, color=INK)
    axes.legend(frameon=False, loc="upper left", fontsize=10)
    _framed_log(axes)


def _framed_log(axes: Any) -> None:
    locate, axes.locator_params = axes.locator_params, lambda **_: None  # a logarithmic axis has its own ticks
    framed(axes, "nominal rate", "share with p below it")
    axes.locator_params = locate
