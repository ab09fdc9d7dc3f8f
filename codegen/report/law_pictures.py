"""Pictures of the friction laws as SVG; deterministic for the same data."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from codegen.friction import DynamicLaw, FrictionLaw, MemoryLaw
from codegen.friction.memory import Karnopp, RisingStatic
from codegen.friction.state_space import LinkerDieterich, Ruina
from codegen.report.law_examples import EXAMPLES, dragged_mass, force_over, steady_force, steady_level
from codegen.report.style import CURVE, INK, QUIET, SECOND, THIRD, framed, rounded, svg_of
from codegen.report.wording import prefixed

SAMPLES = 1200
FORCE = "force in N"


def law_picture(law: FrictionLaw) -> str:
    """The SVG of a law's picture."""
    panels: tuple[Callable[[Any], None], ...]
    match law:
        case Ruina() | LinkerDieterich():
            panels = (lambda axes: _steady_rate(axes, law), lambda axes: _velocity_step(axes, law))
        case RisingStatic():
            panels = (lambda axes: _after_rest(axes, law), lambda axes: _static_level(axes, law))
        case Karnopp():
            motion = dragged_mass()
            panels = (lambda axes: _drag_velocity(axes, motion), lambda axes: _drag_time(axes, motion))
        case DynamicLaw() | MemoryLaw():
            second = _presliding if EXAMPLES[law.name].presliding else _over_time
            panels = (lambda axes: _loop(axes, law), lambda axes: second(axes, law))
        case _:
            panels = (lambda axes: _characteristic(axes, law),)
    return svg_of(panels)


def _characteristic(axes: Any, law: FrictionLaw) -> None:
    """Force over velocity in both directions, with the range of forces at standstill as a vertical line."""
    top = EXAMPLES[law.name].top_speed
    speed = np.concatenate(([0.0, 0.0], np.geomspace(top * 1e-6, top, SAMPLES // 2)))
    level = steady_level(law, speed)
    level[0] = 0.0
    for side in (-1, 1):
        _plot(axes, side * speed, side * level, CURVE)
    framed(axes, "velocity in m/s", FORCE)


def _loop(axes: Any, law: FrictionLaw) -> None:
    example = EXAMPLES[law.name]
    omega = 2 * np.pi * example.frequency
    time = np.linspace(0, 3 / example.frequency, 3 * SAMPLES + 1)
    force = force_over(law, time, lambda t: example.top_speed * np.sin(omega * t))
    velocity = example.top_speed * np.sin(omega * time)
    speed = np.geomspace(example.top_speed * 1e-4, example.top_speed, SAMPLES // 4)
    factor, unit = prefixed([example.top_speed], "m")
    for side in (-1, 1):
        _plot(axes, side * speed * factor, steady_force(law, side * speed), QUIET, (0, (4, 3)), 1.2)
    last = time >= 2 / example.frequency
    _plot(axes, velocity[last] * factor, force[last], CURVE)
    framed(axes, f"velocity in {unit}/s", FORCE)


def _presliding(axes: Any, law: FrictionLaw) -> None:
    """From rest: the virgin curve and two hysteresis loops."""
    example = EXAMPLES[law.name]
    omega = 2 * np.pi * example.frequency
    time = np.linspace(0, 2.25 / example.frequency, 2 * SAMPLES + 1)
    factor, unit = prefixed([max(example.presliding)], "m")
    for amplitude, colour in zip(reversed(example.presliding), (CURVE, SECOND), strict=False):
        force = force_over(law, time, partial(_cosine, amplitude * omega, omega))
        _plot(axes, factor * amplitude * np.sin(omega * time), force, colour)
    framed(axes, f"displacement in {unit}", FORCE)


def _cosine(top: float, omega: float, t: float) -> float:
    return top * math.cos(omega * t)


def _over_time(axes: Any, law: FrictionLaw) -> None:
    example = EXAMPLES[law.name]
    omega = 2 * np.pi * example.frequency
    time = np.linspace(0, 2 / example.frequency, 2 * SAMPLES + 1)
    velocity = example.top_speed * np.sin(omega * time)
    moving = np.abs(velocity) > 1e-9
    _plot(axes, time[moving], steady_force(law, velocity[moving]), QUIET, (0, (4, 3)), 1.2)
    force = force_over(law, time, lambda t: example.top_speed * np.sin(omega * t))
    _plot(axes, time[moving], force[moving], CURVE)
    framed(axes, "time in s", FORCE)


def _steady_rate(axes: Any, law: FrictionLaw) -> None:
    speed = np.geomspace(1e-8, 1e-3, 60)
    _plot(axes, speed, steady_force(law, speed), CURVE)
    axes.set_xscale("log")
    framed(axes, "velocity in m/s", FORCE)


def _velocity_step(axes: Any, law: FrictionLaw) -> None:
    p = EXAMPLES[law.name].parameters
    slow, fast = p["v_0"], 10 * p["v_0"]
    first, second = 2 * p["L"] / slow, 2 * p["L"] / slow + 10 * p["L"] / fast
    time = np.concatenate(
        [
            np.linspace(0, first, SAMPLES, endpoint=False),
            np.linspace(first, second, SAMPLES, endpoint=False),
            np.linspace(second, second + 10 * p["L"] / slow, SAMPLES),
        ]
    )

    def velocity(t: float) -> float:
        return fast if first <= t < second else slow

    slip = np.concatenate(([0.0], np.cumsum(np.diff(time) * [velocity(t) for t in time[:-1]])))
    factor, unit = prefixed([float(slip[-1])], "m")
    _plot(axes, factor * slip, force_over(law, time, velocity), CURVE)
    framed(axes, f"displacement in {unit}", FORCE)


def _after_rest(axes: Any, law: RisingStatic) -> None:
    p = EXAMPLES[law.name].parameters
    for dwell, colour in ((10.0, CURVE), (1.0, SECOND), (0.1, THIRD)):
        static = float(law.static_level(dwell, p))
        _plot(axes, [0, 0], [-static, static], colour)
        axes.plot([0, 0], [-static, static], "o", color=colour, markersize=6, label=f"{dwell:g} s at rest")
    for side in (-1, 1):
        _plot(axes, [0, side * 0.1], [side * p["F_c"]] * 2, INK)
    framed(axes, "velocity in m/s", FORCE)
    axes.legend(loc="lower right", frameon=False, handletextpad=0.2)


def _static_level(axes: Any, law: RisingStatic) -> None:
    dwell = np.geomspace(1e-3, 1e3, SAMPLES // 4)
    _plot(axes, dwell, law.static_level(dwell, EXAMPLES[law.name].parameters), CURVE)
    axes.set_xscale("log")
    framed(axes, "time at rest in s", "static level in N")


def _drag_velocity(axes: Any, motion: tuple[Any, Any, Any]) -> None:
    _plot(axes, motion[1], motion[2], CURVE)
    framed(axes, "velocity in m/s", FORCE)


def _drag_time(axes: Any, motion: tuple[Any, Any, Any]) -> None:
    _plot(axes, motion[0], motion[2], CURVE)
    framed(axes, "time in s", FORCE)


def _plot(axes: Any, x: Any, y: Any, colour: str, dashes: Any = "-", width: float = 2.2) -> None:
    """Plot values rounded to some digits, so that rounding differences between platforms do not show."""
    axes.plot(rounded(x), rounded(y), color=colour, linestyle=dashes, linewidth=width)
