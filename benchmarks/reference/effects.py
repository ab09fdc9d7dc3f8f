"""docs/effects.md and its pictures, from the docstrings and attributes of the effect classes.

A picture, as SVG, shows the force residual that an effect causes in an example motion.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import sympy

from benchmarks.panels import framed, rounded, svg_of
from benchmarks.text import render
from codegen.base.arrays import Array
from codegen.effects import CATALOGUE, Effect
from codegen.effects.declare import effect_symbols, places_of
from codegen.mechanics import System, build_system
from codegen.report.effects import effect_view
from codegen.report.examples import EXAMPLES
from codegen.report.style import CURVE
from codegen.report.wording import with_unit
from codegen.simulate.controller import Feedback, sampled
from codegen.simulate.observed_loop import SampledLoop, run_loop
from codegen.spec import parse_spec

MASS, LEVEL, STIFFNESS = 2.0, 3.0, 40.0
"""Mass in kg, friction level in N and spring stiffness in N/m of the example axis; for angles kg m², N m, N m/rad."""
TIME: Array = np.arange(0, 12, 0.002)
"""Sample times, s."""
COMMAND: Array = 9 * np.sin(1.7 * TIME) + 5 * np.sin(4.3 * TIME + 0.4) + 2 * np.sin(11.9 * TIME)
"""Input of the first coordinate at these times, N or N m."""
SUBSTEPS = 20
"""Integration steps in one sample."""
EVERY = 6
"""Every how many samples one is drawn."""
SLOWEST = 0.01
"""Share of the top speed below which the residual is not drawn, since friction at rest is indeterminate."""
ENDS = 50
"""Samples at each end that are not drawn: the derivatives there are one-sided."""


def effects_page() -> str:
    """The text of docs/effects.md."""
    axis = {"mass": MASS, "level": LEVEL, "stiffness": STIFFNESS}
    views = [{**effect_view(effect), "drawn": _drawn(effect)} for effect in CATALOGUE.values()]
    return render("effects.md.j2", effects=views, axis=axis)


def effect_pictures() -> dict[str, str]:
    """Path below docs/ → SVG, of the effects with an example."""
    return {f"effects/{kind}.svg": effect_picture(e) for kind, e in CATALOGUE.items() if kind in EXAMPLES.effects}


def _drawn(effect: Effect) -> str:
    """The parameters with which an effect's picture is drawn; "" without one."""
    angular = effect.needs == "a coordinate in rad"
    units = {"F": "N*m" if angular else "N", "q": "rad" if angular else "m", "w": "N"}
    drawn = EXAMPLES.effects.get(effect.kind)
    values = ((p.name, drawn[p.name], p.unit.format(**units)) for p in effect.parameters) if drawn else ()
    return ", ".join(f"{name} = {with_unit(value, unit)}" for name, value, unit in values)


def example_residual(effect: Effect, parameters: dict[str, float]) -> tuple[Array, Array]:
    """The force residual w − k x − m a − F_c sgn(v) of an axis model over the simulated motion of one with the effect.

    Of two coordinates it is that of the first.

    Args:
        parameters: of the effect, in SI.

    Returns:
        (variable that shows the effect best, in SI; residual in N or N m, NaN near standstill and reversals).
    """
    angular = effect.needs == "a coordinate in rad"
    plain = _axis("rad" if angular else "m", 2 if effect.sits_on == "two coordinates" else 1)
    symbols = effect_symbols(effect, places_of(effect, plain)[0], plain)
    values = {symbols[name]: sympy.Rational(str(value)) for name, value in parameters.items()}
    system = effect.add(plain.with_parameters(values, {}), 0, symbols)
    n = plain.degrees_of_freedom
    commands = np.column_stack([COMMAND, -0.7 * np.roll(COMMAND, 700)])[:, :n]
    period = float(TIME[1])
    drive = Feedback(n, feedforward=sampled(commands, period))
    run = run_loop(system, SampledLoop(drive), period, len(TIME), substeps=SUBSTEPS)
    x = run.positions
    v = np.gradient(x, TIME, axis=0) if system.sensor_errors else run.true_velocities
    a = np.gradient(v, TIME, axis=0)
    # The command is held between samples, so its mean about a sample is that of the command before and the one after.
    w = np.vstack([commands[:1], (commands[:-1] + commands[1:]) / 2])
    force = (w - STIFFNESS * x - MASS * a - LEVEL * np.sign(v))[:, 0]
    axis = {
        "velocity": v[:, 0] - (v[:, 1] if n > 1 else 0),
        "position": x[:, 0],
        "load": w[:, 0],
        "time": TIME,
        "acceleration": a[:, 0],
        "input": w[:, 0],
        "input rate": np.gradient(w[:, 0], TIME),
    }[effect.seen_over]
    sliding = np.abs(v) > SLOWEST * np.max(np.abs(v))
    direction = np.sign(v)
    in_one_direction = (direction == np.roll(direction, 1, 0)) & (direction == np.roll(direction, -1, 0))
    drawn = (sliding & in_one_direction).all(axis=1)
    drawn[:ENDS] = drawn[-ENDS:] = False
    return axis, np.where(drawn, force, np.nan)


def _axis(unit: str, count: int) -> System:
    """``count`` equal masses on springs, each with Coulomb friction and an input."""
    names = [f"{k + 1}" if count > 1 else "" for k in range(count)]
    force, mass = ("N", "kg") if unit == "m" else ("N*m", "kg*m^2")
    diagonal = np.eye(count, dtype=int)
    spec = {
        "name": "axis",
        "coordinates": {f"x{name}": {"velocity": f"v{name}", "unit": unit} for name in names},
        "inputs": {f"w{name}": {"unit": force} for name in names},
        "parameters": {"m": {"value": MASS, "unit": mass}, "k": {"value": STIFFNESS, "unit": f"{force}/{unit}"}},
        "mass_matrix": [["m" if entry else 0 for entry in row] for row in diagonal.tolist()],
        "force": [f"w{name} - k*x{name}" for name in names],
        "friction": {
            "distribution": diagonal.tolist(),
            "contacts": [{"name": f"rail{name}", "law": "coulomb", "a": LEVEL, "unit": force} for name in names],
        },
    }
    return build_system(parse_spec(json.dumps(spec), Path("axis.yaml")))  # JSON is YAML


def effect_picture(effect: Effect) -> str:
    """The SVG of an effect's picture."""
    axis, force = example_residual(effect, EXAMPLES.effects[effect.kind])
    angular = effect.needs == "a coordinate in rad"
    units = {
        "velocity": "velocity in rad/s" if angular else "velocity in m/s",
        "position": "position in rad" if angular else "position in m",
        "load": "drive force in N",
        "time": "time in s",
        "acceleration": "acceleration in m/s²",
        "input": "input in N",
        "input rate": "rate of the input in N/s",
    }
    label = "difference of two velocities in m/s" if effect.sits_on == "two coordinates" else units[effect.seen_over]

    def draw(axes: Any) -> None:
        x, y = rounded(axis[::EVERY]), rounded(force[::EVERY])
        axes.plot(x, y, color=CURVE, linewidth=1.0)
        room = 0.05 * float(np.nanmax(np.abs(y)))
        axes.set_ylim(min(0.0, float(np.nanmin(y))) - room, max(0.0, float(np.nanmax(y))) + room)
        framed(axes, label, "residual in N*m" if angular else "residual in N")

    return svg_of((draw,))
