"""Stability region over two gains, stable intervals of one, gain and sample-time margins; boundaries by bisection."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from contourpy import contour_generator
from numpy.typing import NDArray

from codegen.analysis.feasibility.axes import GainAxis
from codegen.analysis.feasibility.gain_dynamics import GainDynamics, Settings, joined
from codegen.base.arrays import Array

SYSTEMS = ("sampled", "continuous")
LIMIT = {"sampled": 1 - 1e-12, "continuous": -1e-9}
"""A gain set is stable if its spectral radius, or its spectral abscissa in 1/s, is below this."""
GRID = 49
"""Points of a map along each axis."""
LINE = 193
"""Points at which one axis or factor is examined."""
SPARSE = 16
"""Every so many of these points are checked at all operating points."""
BISECTIONS = 16
"""Steps of bisection that locate an end of the stable range between two examined points."""
ROUNDS = 4
"""Most repetitions with further deciding operating points."""
SEARCHED = 1000.0
"""Largest factor of a margin."""


@dataclass(frozen=True)
class GainMap:
    """Stability region in the plane of two axes.

    Attributes:
        base: one set, with the other gains and the sample time.
        x_values, y_values: the grid, (GRID,) each.
        radius: spectral radius of the step over all operating points, (x, y).
        decay_rate: −ln(radius)/h in 1/s, (x, y); negative where unstable.
        abscissa: spectral abscissa of Ψ, 1/s, (x, y).
        boundary: "sampled" and "continuous" → polylines of (x, y), each vertex within 0.1 % of the boundary.
    """

    x: GainAxis
    y: GainAxis
    base: Settings
    x_values: Array
    y_values: Array
    radius: Array
    decay_rate: Array
    abscissa: Array
    boundary: Mapping[str, tuple[tuple[tuple[float, float], ...], ...]]

    @property
    def settings(self) -> Settings:
        """All sets of the grid, y fastest."""
        return grid(self.base, self.x, self.y, self.x_values, self.y_values)


@dataclass(frozen=True)
class Margin:
    """Gain margin: how far one axis may change before the sampled error is unstable.

    Attributes:
        name: of the axis, or "all gains", or "sample time".
        up, down: largest and smallest factor (up > 1 > down); None if there is no boundary within a factor of 1000.
        at_up, at_down: the eigenvalue z on the unit circle there.
    """

    name: str
    up: float | None
    down: float | None
    at_up: complex | None
    at_down: complex | None


def stable(dynamics: GainDynamics, which: str, settings: Settings, every: bool = False) -> NDArray[np.bool_]:
    """Whether the step ("sampled") or Ψ ("continuous") is stable, (sets,)."""
    found: NDArray[np.bool_] = dynamics.worst(which, settings, every) < LIMIT[which]
    return found


def grid(base: Settings, x: GainAxis, y: GainAxis, x_values: Array, y_values: Array) -> Settings:
    """The sets of a grid, y fastest."""
    first, second = np.meshgrid(x_values, y_values, indexing="ij")
    return base.along(x, first.ravel()).along(y, second.ravel())


def map_region(dynamics: GainDynamics, base: Settings, x: GainAxis, y: GainAxis) -> GainMap:
    """The stability region over two axes.

    Its boundary is checked at all operating points; those at which it is unstable become deciding points, and the
    region is computed again.
    """
    shares = np.linspace(0, 1, GRID)
    x_values, y_values = np.asarray(x.at(shares)), np.asarray(y.at(shares))
    settings = grid(base, x, y, x_values, y_values)
    coarse = np.arange(GRID * GRID).reshape(GRID, GRID)[::4, ::4].ravel()
    dynamics.focus(settings.rows(coarse))
    for _ in range(ROUNDS):
        measures = {which: dynamics.worst(which, settings).reshape(GRID, GRID) for which in SYSTEMS}
        located = {which: _boundary(dynamics, which, base, x, y, measures[which] < LIMIT[which]) for which in SYSTEMS}
        wrong = []
        for which, (_, inner) in located.items():
            if len(inner):
                edge = base.along(x, x.at(inner[:, 0])).along(y, y.at(inner[:, 1]))
                wrong.append(edge.rows(~stable(dynamics, which, edge, True)))
        if not any(len(s) for s in wrong):
            break
        dynamics.focus(joined([s for s in wrong if len(s)]))
    period = settings.sample_time.reshape(GRID, GRID)
    radius = measures["sampled"]
    decay = -np.log(np.clip(radius, 1e-300, None)) / period
    lines = {which: lines for which, (lines, _) in located.items()}
    return GainMap(x, y, base, x_values, y_values, radius, decay, measures["continuous"], lines)


def intervals(dynamics: GainDynamics, which: str, base: Settings, axis: GainAxis) -> tuple[tuple[float, float], ...]:
    """The stable intervals of one axis through ``base``, within the range of the axis."""
    shares = np.linspace(0, 1, LINE)
    inside = stable(dynamics, which, base.along(axis, axis.at(shares)))
    at = np.flatnonzero(inside[1:] != inside[:-1])
    good = np.where(inside[at], shares[at], shares[at + 1])
    bad = np.where(inside[at], shares[at + 1], shares[at])
    crossings = [
        float(t) for t in bisect(lambda t: stable(dynamics, which, base.along(axis, axis.at(t))), good, bad)[0]
    ]
    ends = ([0.0] if inside[0] else []) + crossings + ([1.0] if inside[-1] else [])
    numbers = [float(axis.at(t)) for t in ends]
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))


def margin(dynamics: GainDynamics, name: str, scaled: Callable[[Array], Settings]) -> Margin:
    """The margin of a gain set; ``scaled``: N factors → N sets; the set at factor 1 is stable."""
    up, at_up = _one_way(dynamics, scaled, SEARCHED)
    down, at_down = _one_way(dynamics, scaled, 1 / SEARCHED)
    return Margin(name, up, down, at_up, at_down)


def bisect(inside: Callable[[Array], NDArray[np.bool_]], good: Array, bad: Array) -> tuple[Array, Array]:
    """The boundary between stable and unstable shares by bisection, elementwise; (middle, stable end)."""
    for _ in range(BISECTIONS if len(good) else 0):
        middle = (good + bad) / 2
        ok = inside(middle)
        good, bad = np.where(ok, middle, good), np.where(ok, bad, middle)
    return (good + bad) / 2, good


def _boundary(
    dynamics: GainDynamics, which: str, base: Settings, x: GainAxis, y: GainAxis, inside: NDArray[np.bool_]
) -> tuple[tuple[tuple[tuple[float, float], ...], ...], Array]:
    """Polylines of the boundary, and for each vertex the shares (x, y) at which its bisection ended as stable."""
    # Contour lines at 0.5 pass through the midpoints of grid edges between a stable and an unstable point.
    lines: Any = contour_generator(z=inside.T.astype(float)).lines(0.5)
    if not lines:
        return (), np.empty((0, 2))
    crossings = np.vstack(lines)
    low, high = np.floor(crossings).astype(int), np.ceil(crossings).astype(int)
    low_inside = inside[low[:, :1], low[:, 1:]]
    good, bad = (np.where(low_inside, *ends) / (GRID - 1) for ends in ((low, high), (high, low)))

    def holds(share: Array) -> NDArray[np.bool_]:
        at = good + share[:, None] * (bad - good)
        return stable(dynamics, which, base.along(x, x.at(at[:, 0])).along(y, y.at(at[:, 1])))

    middle, inner = bisect(holds, np.zeros(len(good)), np.ones(len(good)))
    at = good + middle[:, None] * (bad - good)
    numbers = np.column_stack([x.at(at[:, 0]), y.at(at[:, 1])])
    parts = np.split(numbers, np.cumsum([len(line) for line in lines])[:-1])
    return tuple(tuple((float(p), float(q)) for p, q in part) for part in parts), good + inner[:, None] * (bad - good)


def _one_way(
    dynamics: GainDynamics, scaled: Callable[[Array], Settings], farthest: float
) -> tuple[float | None, complex | None]:
    """The first factor towards ``farthest`` at which stability is lost, and the eigenvalue z on the unit circle."""

    def inside(share: Array) -> NDArray[np.bool_]:
        return stable(dynamics, "sampled", scaled(farthest**share))

    shares = np.linspace(0, 1, LINE)
    for _ in range(ROUNDS):
        lost = np.flatnonzero(~inside(shares))
        first = max(int(lost[0]), 1) if len(lost) else LINE - 1
        inner = shares[[first]]
        if len(lost):
            middle, inner = bisect(inside, shares[[first - 1]], inner)
        reached = scaled(farthest ** np.append(shares[:first:SPARSE], inner))
        unstable = ~stable(dynamics, "sampled", reached, True)
        if not unstable.any():
            break
        dynamics.focus(reached.rows(unstable))  # unstable at a point that was not evaluated
    if not len(lost):
        return None, None
    factor = farthest ** float(middle[0])
    edge = scaled(np.array([factor]))
    point = int(dynamics.every[dynamics.measures("sampled", edge, dynamics.every)[0].argmax()])
    return factor, dynamics.worst_eigenvalue("sampled", edge, point)
