"""The machines: equations of motion with diagonal inertia, M(x) x'' = drive·i + position(x) + motion(x, v) − friction.

Every family gives its equations twice: as Python functions, by which it is simulated, and as the text of a spec, as a
user would write it. Functions take ``m``, the module math for one instant or numpy for a whole log. All in SI.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import pi
from types import ModuleType
from typing import Any

Values = Mapping[str, float]
Terms = Callable[[Values, Sequence[Any], Sequence[Any], ModuleType], list[Any]]
G = 9.81


@dataclass(frozen=True)
class Quantity:
    """A parameter: the range from which its true value is drawn (log-uniform), unit and tolerance in the spec."""

    low: float
    high: float
    unit: str
    tolerance: float = 0.05


@dataclass(frozen=True)
class Axis:
    """A coordinate with one contact of the same index.

    Attributes:
        stroke: range of its stroke. speed: range of its top speed in strokes a second.
        driven: name of its input in A; "" where it has no drive.
    """

    x: str
    v: str
    unit: str
    stroke: tuple[float, float]
    speed: tuple[float, float]
    driven: str = "i"

    @property
    def force_unit(self) -> str:
        return "N" if self.unit == "m" else "N*m"


@dataclass(frozen=True)
class Family:
    """A kind of machine.

    Attributes:
        drive: force per A on each coordinate. mass: diagonal of M. position, motion: forces of x alone, and of x and v.
        spec: lines of the spec that state M and the force, with ``{viscous}`` where damping of the axis may stand.
        gravity: whether a declared force of position acts, so that gain and inertia can be distinguished.
        separate: whether the inertia is constant and the axis alone, so that a load can be put behind a spring.
    """

    name: str
    axes: tuple[Axis, ...]
    quantities: Mapping[str, Quantity]
    drive: Callable[[Values], list[float]]
    mass: Callable[[Values, Sequence[Any], ModuleType], list[Any]]
    position: Callable[[Values, Sequence[Any], ModuleType], list[Any]]
    motion: Terms
    spec: str
    gravity: bool = False
    separate: bool = True

    def force(self, p: Values, x: Sequence[Any], v: Sequence[Any], m: ModuleType) -> list[Any]:
        """Everything but the drive and friction."""
        return [a + b for a, b in zip(self.position(p, x, m), self.motion(p, x, v, m), strict=True)]


def _damped(p: Values, x: Sequence[Any], v: Sequence[Any], m: ModuleType) -> list[Any]:
    return [-p.get("b", 0.0) * v[0]]


def _none(p: Values, x: Sequence[Any], m: ModuleType) -> list[Any]:
    return [0.0 for _ in x]


def _crank(p: Values, q: Any, m: ModuleType) -> tuple[Any, Any]:
    """First and second derivative of the slider's position r cos q + √(l² − r² sin² q) over the crank's angle."""
    s, c = m.sin(q), m.cos(q)
    rod = m.sqrt(p["l"] ** 2 - (p["r"] * s) ** 2)
    first = -p["r"] * s - p["r"] ** 2 * s * c / rod
    return first, -p["r"] * c - p["r"] ** 2 * (c * c - s * s) / rod - p["r"] ** 4 * (s * c) ** 2 / rod**3


def _crank_motion(p: Values, x: Sequence[Any], v: Sequence[Any], m: ModuleType) -> list[Any]:
    first, second = _crank(p, x[0], m)
    return [-p["m"] * first * second * v[0] ** 2 - p.get("b", 0.0) * v[0]]


def _gimbal_motion(p: Values, x: Sequence[Any], v: Sequence[Any], m: ModuleType) -> list[Any]:
    """From T = ½ (Jy + Jd cos² pitch) yaw'² + ½ Jp pitch'²."""
    turn = p["Jd"] * m.sin(x[1]) * m.cos(x[1])
    return [2 * turn * v[0] * v[1], -turn * v[0] ** 2]


BELT_GANTRY = Family(
    "belt_gantry",
    (Axis("x", "v", "m", (0.3, 1.2), (0.5, 1.5)),),
    {
        "m": Quantity(4, 30, "kg"),
        "J": Quantity(2e-4, 2e-3, "kg*m^2", 0.1),
        "r": Quantity(0.012, 0.03, "m", 0.01),
        "kt": Quantity(0.2, 1.0, "N*m/A", 0.03),
        "b": Quantity(2, 20, "N*s/m", 0.3),
    },
    lambda p: [p["kt"] / p["r"]],
    lambda p, x, m: [p["m"] + p["J"] / p["r"] ** 2],
    _none,
    _damped,
    "mass_matrix: [[m + J/r**2]]\nforce: ['kt/r*i{viscous}']",
)
BALL_SCREW = Family(
    "ball_screw",
    (Axis("z", "vz", "m", (0.15, 0.6), (0.4, 1.0)),),
    {
        "m": Quantity(15, 60, "kg"),
        "mc": Quantity(5, 14, "kg"),
        "J": Quantity(1e-4, 6e-4, "kg*m^2", 0.1),
        "lead": Quantity(0.008, 0.025, "m", 0.002),
        "kt": Quantity(0.3, 1.2, "N*m/A", 0.03),
        "b": Quantity(50, 300, "N*s/m", 0.3),
    },
    lambda p: [2 * pi * p["kt"] / p["lead"]],
    lambda p, x, m: [p["m"] + p["mc"] + p["J"] * (2 * pi / p["lead"]) ** 2],
    lambda p, x, m: [-(p["m"] - p["mc"]) * G + 0 * x[0]],
    _damped,
    "mass_matrix: [[m + mc + J*(2*pi/lead)**2]]\nforce: ['2*pi*kt/lead*i - (m - mc)*g{viscous}']",
    gravity=True,
)
TILTING_TABLE = Family(
    "tilting_table",
    (Axis("th", "om", "rad", (1.2, 2.4), (0.6, 1.5)),),
    {
        "Jl": Quantity(0.5, 4, "kg*m^2"),
        "Jm": Quantity(5e-5, 4e-4, "kg*m^2", 0.1),
        "n": Quantity(20, 80, "1", 0.001),
        "kt": Quantity(0.08, 0.3, "N*m/A", 0.03),
        "ml": Quantity(0.3, 1.5, "kg*m", 0.1),
    },
    lambda p: [p["n"] * p["kt"]],
    lambda p, x, m: [p["Jl"] + p["n"] ** 2 * p["Jm"]],
    lambda p, x, m: [-p["ml"] * G * m.sin(x[0])],
    _damped,
    "mass_matrix: [[Jl + n**2*Jm]]\nforce: ['n*kt*i - ml*g*sin(th){viscous}']",
    gravity=True,
)
SLIDER_CRANK = Family(
    "slider_crank",
    (Axis("q", "w", "rad", (10, 30), (0.3, 0.7)),),
    {
        "J": Quantity(0.01, 0.05, "kg*m^2"),
        "m": Quantity(1, 4, "kg"),
        "r": Quantity(0.06, 0.1, "m", 0.002),
        "l": Quantity(0.2, 0.35, "m", 0.002),
        "kt": Quantity(0.5, 1.5, "N*m/A", 0.03),
        "b": Quantity(0.01, 0.06, "N*m*s/rad", 0.3),
    },
    lambda p: [p["kt"]],
    lambda p, x, m: [p["J"] + p["m"] * _crank(p, x[0], m)[0] ** 2],
    _none,
    _crank_motion,
    "lagrangian:\n  kinetic: [J*w**2/2, 'm*((r*sin(q) + r**2*sin(q)*cos(q)/sqrt(l**2 - r**2*sin(q)**2))*w)**2/2']\n"
    "  potential: []\nforce: ['kt*i{viscous}']",
    separate=False,
)
TURNTABLE = Family(
    "turntable",
    (Axis("q", "w", "rad", (4, 14), (0.4, 1.0)),),
    {
        "Jt": Quantity(1, 8, "kg*m^2"),
        "Jm": Quantity(1e-4, 6e-4, "kg*m^2", 0.1),
        "n": Quantity(20, 60, "1", 0.001),
        "kt": Quantity(0.1, 0.4, "N*m/A", 0.03),
        "b": Quantity(0.3, 2, "N*m*s/rad", 0.3),
    },
    lambda p: [p["n"] * p["kt"]],
    lambda p, x, m: [p["Jt"] + p["n"] ** 2 * p["Jm"]],
    _none,
    _damped,
    "mass_matrix: [[Jt + n**2*Jm]]\nforce: ['n*kt*i{viscous}']",
)
TWO_MASS = Family(
    "two_mass_drive",
    (Axis("q1", "w1", "rad", (6, 20), (0.4, 1.0)), Axis("q2", "w2", "rad", (6, 20), (0.4, 1.0), driven="")),
    {
        "J1": Quantity(0.002, 0.006, "kg*m^2"),
        "J2": Quantity(0.003, 0.012, "kg*m^2"),
        "k": Quantity(4, 15, "N*m/rad"),
        "kt": Quantity(0.2, 0.6, "N*m/A", 0.03),
    },
    lambda p: [p["kt"], 0.0],
    lambda p, x, m: [p["J1"], p["J2"]],
    lambda p, x, m: [-p["k"] * (x[0] - x[1]), p["k"] * (x[0] - x[1])],
    lambda p, x, v, m: [0.0, 0.0],
    "mass_matrix: [[J1, 0], [0, J2]]\nforce: [kt*i - k*(q1 - q2), k*(q1 - q2)]",
    gravity=True,
    separate=False,
)
GIMBAL = Family(
    "gimbal",
    (Axis("yaw", "wy", "rad", (2, 5), (0.5, 1.2), "iy"), Axis("pitch", "wp", "rad", (1, 2), (0.5, 1.2), "ip")),
    {
        "Jy": Quantity(0.05, 0.2, "kg*m^2"),
        "Jd": Quantity(0.02, 0.1, "kg*m^2"),
        "Jp": Quantity(0.03, 0.1, "kg*m^2"),
        "ml": Quantity(0.02, 0.06, "kg*m", 0.1),
        "ky": Quantity(0.5, 2, "N*m/A", 0.03),
        "kp": Quantity(0.5, 2, "N*m/A", 0.03),
    },
    lambda p: [p["ky"], p["kp"]],
    lambda p, x, m: [p["Jy"] + p["Jd"] * m.cos(x[1]) ** 2, p["Jp"] + 0 * x[1]],
    lambda p, x, m: [0 * x[0], -p["ml"] * G * m.sin(x[1])],
    _gimbal_motion,
    "mass_matrix: [[Jy + Jd*cos(pitch)**2, 0], [0, Jp]]\n"
    "force: ['ky*iy + 2*Jd*sin(pitch)*cos(pitch)*wy*wp',\n"
    "  'kp*ip - Jd*sin(pitch)*cos(pitch)*wy**2 - ml*g*sin(pitch)']",
    separate=False,
)
FAMILIES = (BELT_GANTRY, BALL_SCREW, TILTING_TABLE, SLIDER_CRANK, TURNTABLE, TWO_MASS, GIMBAL)
