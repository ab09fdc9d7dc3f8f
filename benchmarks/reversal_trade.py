"""The picture of docs/certificates.md: how much less V grows at a reversal where a slower rate is certified.

For two errors, of which a reversal turns the second, all P are searched on a grid: P = [[1, r s], [r s, s^2]] has the
growth (1 + |r|)/(1 - |r|), whatever s > 0, and for F = I + hA the eigenvalues of P^-1 F'PF have the product det(F)^2.
So V falls by a factor c just if the trace of P^-1 F'PF is at most c + det(F)^2/c.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.panels import svg_of
from codegen.report.style import CURVE, INK, SECOND, THIRD, labelled

DRAWN = {"one_mass": CURVE, "rig": SECOND, "belt_axis": THIRD}
SHARES = np.round(np.linspace(0.6, 0.995, 80), 6)
CORRELATIONS = np.linspace(-0.9995, 0.9995, 2001)
SCALES = np.geomspace(1e-4, 1e4, 2001)
"""Of s, over the square root of |F_01 / F_10|."""


class Trade:
    """Least growth and dwell time of one machine over the share of the best rate.

    Attributes:
        shipped: (share, growth, dwell in samples) of its certificate.
    """

    def __init__(self, path: Path) -> None:
        content = json.loads(path.read_text("utf-8"))
        self.h = float(Fraction(content["sample_time"]))
        matrix = np.array([[float(Fraction(x)) for x in row] for row in content["matrix"]])
        self.step = np.eye(2) + self.h * matrix
        self.best = (1 - float(np.abs(np.linalg.eigvals(self.step)).max()) ** 2) / (2 * self.h)
        (turn,) = content["reversals"]
        share = float(Fraction(content["decay_rate"])) / self.best
        self.shipped = (share, float(Fraction(turn["growth"])), int(turn["dwell_samples"]))
        (a, b), (c, d) = self.step
        r, s = CORRELATIONS[:, None], SCALES[None, :] * np.sqrt(abs(b / c))
        beside = (a - d) * (c * s - b / s)
        whole = a * a + d * d + (b / s) ** 2 + (c * s) ** 2 - 2 * r * r * (a * d + b * c) + 2 * r * beside
        self.trace = whole / (1 - r * r)

    def at(self, share: float) -> tuple[float, int]:
        """Growth and dwell in samples."""
        fall = 1 - 2 * share * self.best * self.h
        holds = (self.trace <= fall + np.linalg.det(self.step) ** 2 / fall).any(axis=1)
        r = float(np.abs(CORRELATIONS[holds]).min())
        growth = (1 + r) / (1 - r)
        return growth, int(np.ceil(np.log(growth) / -np.log(fall)))


def picture(generated: Path) -> str:
    """The SVG: growth and dwell over the share of the best rate, and where the shipped certificates are."""
    trades = {name: Trade(generated / name / "certificate.json") for name in DRAWN}

    def growth(axes: Any) -> None:
        axes.set_yscale("log")
        _curves(axes, trades, 0)
        labelled(axes, "certified rate / best rate", "growth of V at a reversal")

    def dwell(axes: Any) -> None:
        _curves(axes, trades, 1)
        labelled(axes, "certified rate / best rate", "dwell time in samples")

    return svg_of((growth, dwell))


def _curves(axes: Any, trades: Mapping[str, Trade], which: int) -> None:
    for name, trade in trades.items():
        values = [trade.at(share)[which] for share in SHARES]
        axes.plot(SHARES, values, color=DRAWN[name], linewidth=1.8, label=name)
        axes.plot(trade.shipped[0], trade.shipped[1 + which], "o", color=DRAWN[name], markersize=5)
    axes.axvline(0.95, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    axes.legend(frameon=False, fontsize=10)
