"""Pictures of the friction laws as SVG: the force of a law in prescribed slip motions. Deterministic."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import casadi
import numpy as np

from codegen.friction import LAWS, DynamicLaw, FrictionLaw, MemoryLaw
from codegen.friction.memory import Karnopp, RisingStatic
from codegen.friction.state_space import LinkerDieterich, Ruina
from codegen.mechanics.casadi_form import to_casadi
from codegen.report.examples import EXAMPLES
from codegen.report.style import CURVE, INK, QUIET, SECOND, THIRD, framed, rounded, svg_of
from codegen.report.wording import prefixed
from codegen.spec.functions import Magnitude
from codegen.spec.model import symbol

SAMPLES = 1200
"""Samples in one period of the slip."""
FORCE = "force in N"


DRAG = {"mass": 1.0, "stiffness": 1000.0, "speed": 0.1}
"""Mass in kg, spring in N/m and drive speed in m/s of the stick–slip example of Karnopp's law."""


def caption(law: FrictionLaw) -> str:
    """Caption of a law's picture."""
    match law:
        case Ruina() | LinkerDieterich():
            return "force of steady sliding, and the force through a step of the velocity to ten times as much and back"
        case RisingStatic():
            return "force against velocity after three times at rest, and the static level against the time at rest"
        case Karnopp():
            return (
                f"force against velocity and over time, of a mass of {DRAG['mass']:g} kg dragged by a spring of "
                f"{DRAG['stiffness']:g} N/m whose end moves at {DRAG['speed']:g} m/s"
            )
        case DynamicLaw() | MemoryLaw():
            example = EXAMPLES.laws[law.name]
            loop = f"hysteresis under a sinusoidal velocity of {example.frequency:g} Hz (steady sliding dashed)"
            return f"{loop}, and {'under small displacements' if example.presliding else 'its force over time'}"
        case _:
            return "force against velocity"


def steady_level(law: FrictionLaw, speed: Any) -> Any:
    """level(|u|) at speeds, in N."""
    u, p = symbol("u"), {name: symbol(name) for name in EXAMPLES.laws[law.name].parameters}
    level = _function(law.level(Magnitude(u), p), {u: None}, law)
    return np.array([level(v) for v in speed])


def steady_force(law: FrictionLaw, velocity: Any) -> Any:
    """level(|u|) sgn(u) at velocities, in N."""
    return steady_level(law, velocity) * np.sign(velocity)


def force_over(law: FrictionLaw, time: Any, velocity: Callable[[float], float]) -> Any:
    """The force of a law during a slip motion, in N; a law with states starts at rest without load."""
    p = EXAMPLES.laws[law.name].parameters
    u_over_time = np.array([velocity(t) for t in time])
    if isinstance(law, MemoryLaw):
        return law.response(time, u_over_time, p)
    if not isinstance(law, DynamicLaw):
        return steady_force(law, u_over_time)
    u, z = symbol("u"), tuple(symbol(s.name) for s in law.states)
    symbols = {name: symbol(name) for name in p}
    arguments = dict.fromkeys((u, *z))
    rate = _function(law.rates(u, z, symbols)[0], arguments, law)
    force = _function(law.force(u, z, symbols), arguments, law)
    start = [float(e.subs({symbols[n]: v for n, v in p.items()})) for e in law.rest_state(symbols)]
    from scipy.integrate import solve_ivp  # imported here, since the list of laws without pictures does not need it

    done = solve_ivp(
        lambda t, state: [rate(velocity(t), state[0])],
        (time[0], time[-1]),
        start,
        "LSODA",
        time,
        rtol=1e-7,
        atol=1e-9,
        max_step=(time[-1] - time[0]) / 200,
    )
    return np.array([force(v, state) for v, state in zip(u_over_time, done.y[0], strict=True)])


def dragged_mass() -> tuple[Any, Any, Any]:
    """Time, velocity and friction of a mass dragged over Karnopp's contact by a spring whose end moves steadily."""
    law, p = LAWS["karnopp"], EXAMPLES.laws["karnopp"].parameters
    if not isinstance(law, Karnopp):
        raise TypeError("karnopp is not Karnopp's law")
    step = 2e-4
    time = np.arange(0, 3.0, step)
    velocity, friction = np.zeros_like(time), np.zeros_like(time)
    x = v = 0.0
    for k, t in enumerate(time):
        pull = DRAG["stiffness"] * (DRAG["speed"] * t - x)
        friction[k] = law.response([t], [v], p, [pull])[0]
        velocity[k] = v
        stuck = abs(v) <= p["D_v"] and abs(pull) <= p["F_s"]
        v = 0.0 if stuck else v + step * (pull - friction[k]) / DRAG["mass"]
        x += step * v
    return time, velocity, friction


def _function(expression: Any, arguments: Mapping[Any, None], law: FrictionLaw) -> Callable[..., float]:
    """A numerical function of the arguments, at the law's example parameters."""
    entries = {s: casadi.SX.sym(s.name) for s in arguments}
    names = entries | {symbol(n): casadi.SX(v) for n, v in EXAMPLES.laws[law.name].parameters.items()}
    function = casadi.Function("law", list(entries.values()), [casadi.SX(to_casadi(expression, names))])
    return lambda *values: float(function(*values))


def law_picture(law: FrictionLaw) -> str:
    """The SVG of a law's picture."""
    panels: tuple[Callable[[Any], None], ...]
    match law:
        case Ruina() | LinkerDieterich():
            panels = (lambda axes: _steady_rate(axes, law), lambda axes: _velocity_step(axes, law))
        case RisingStatic():
            panels = (lambda axes: _after_rest(axes, law), lambda axes: _static_level(axes, law))
        case Karnopp():
            time, velocity, friction = dragged_mass()
            over = (velocity, "velocity in m/s"), (time, "time in s")
            panels = tuple(partial(_drag, over=x, friction=friction, label=label) for x, label in over)
        case DynamicLaw() | MemoryLaw():
            second = _presliding if EXAMPLES.laws[law.name].presliding else _over_time
            panels = (lambda axes: _loop(axes, law), lambda axes: second(axes, law))
        case _:
            panels = (lambda axes: _characteristic(axes, law),)
    return svg_of(panels)


def _characteristic(axes: Any, law: FrictionLaw) -> None:
    """Force over velocity in both directions, with the range of forces at standstill as a vertical line."""
    top = EXAMPLES.laws[law.name].top_speed
    speed = np.concatenate(([0.0, 0.0], np.geomspace(top * 1e-6, top, SAMPLES // 2)))
    level = steady_level(law, speed)
    level[0] = 0.0
    for side in (-1, 1):
        _plot(axes, side * speed, side * level, CURVE)
    framed(axes, "velocity in m/s", FORCE)


def _under_sine(law: FrictionLaw, periods: int) -> tuple[Any, Any, Any]:
    """Time, velocity and force over some periods of the example's sinusoidal velocity."""
    example = EXAMPLES.laws[law.name]
    omega = 2 * np.pi * example.frequency
    time = np.linspace(0, periods / example.frequency, periods * SAMPLES + 1)
    force = force_over(law, time, lambda t: example.top_speed * np.sin(omega * t))
    return time, example.top_speed * np.sin(omega * time), force


def _loop(axes: Any, law: FrictionLaw) -> None:
    example = EXAMPLES.laws[law.name]
    time, velocity, force = _under_sine(law, 3)
    speed = np.geomspace(example.top_speed * 1e-4, example.top_speed, SAMPLES // 4)
    factor, unit = prefixed([example.top_speed], "m")
    for side in (-1, 1):
        _plot(axes, side * speed * factor, steady_force(law, side * speed), QUIET, (0, (4, 3)), 1.2)
    last = time >= 2 / example.frequency
    _plot(axes, velocity[last] * factor, force[last], CURVE)
    framed(axes, f"velocity in {unit}/s", FORCE)


def _presliding(axes: Any, law: FrictionLaw) -> None:
    """From rest: the virgin curve and two hysteresis loops."""
    example = EXAMPLES.laws[law.name]
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
    time, velocity, force = _under_sine(law, 2)
    moving = np.abs(velocity) > 1e-9
    _plot(axes, time[moving], steady_force(law, velocity[moving]), QUIET, (0, (4, 3)), 1.2)
    _plot(axes, time[moving], force[moving], CURVE)
    framed(axes, "time in s", FORCE)


def _steady_rate(axes: Any, law: FrictionLaw) -> None:
    speed = np.geomspace(1e-8, 1e-3, 60)
    _plot(axes, speed, steady_force(law, speed), CURVE)
    axes.set_xscale("log")
    framed(axes, "velocity in m/s", FORCE)


def _velocity_step(axes: Any, law: FrictionLaw) -> None:
    p = EXAMPLES.laws[law.name].parameters
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
    p = EXAMPLES.laws[law.name].parameters
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
    _plot(axes, dwell, law.static_level(dwell, EXAMPLES.laws[law.name].parameters), CURVE)
    axes.set_xscale("log")
    framed(axes, "time at rest in s", "static level in N")


def _drag(axes: Any, over: Any, friction: Any, label: str) -> None:
    _plot(axes, over, friction, CURVE)
    framed(axes, label, FORCE)


def _plot(axes: Any, x: Any, y: Any, colour: str, dashes: Any = "-", width: float = 2.2) -> None:
    """Plot values rounded to some digits, so that rounding differences between platforms have no effect."""
    axes.plot(rounded(x), rounded(y), color=colour, linestyle=dashes, linewidth=width)
