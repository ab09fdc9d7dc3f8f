"""docs/laws.md and its pictures, from the docstrings and attributes of the law classes.

A picture, as SVG, shows the force of a law in prescribed slip motions. It is deterministic.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from benchmarks.panels import framed, rounded, svg_of
from benchmarks.text import render
from codegen.friction import LAWS, FrictionLaw
from codegen.report.examples import EXAMPLES, Example, Panel
from codegen.report.laws import law_groups
from codegen.report.style import CURVE, QUIET, SECOND
from codegen.report.wording import prefixed, with_unit

SAMPLES = 1200
"""Samples in one period of the slip."""
FORCE = "force in N"
RESTS = (0.1, 0.5, 2.0)
"""s at rest, between slips of ``SLIP`` s."""
SLIP = 0.3
PULL = 100.0
"""N to which the pull rises in each rest."""


def laws_page() -> str:
    """The text of docs/laws.md."""
    groups = law_groups()
    for view in (view for group in groups for view in group["laws"]):
        view |= _picture_words(LAWS[view["name"]])
    return render("laws.md.j2", groups=groups)


def law_pictures() -> dict[str, str]:
    """Path below docs/ → SVG, of the laws with an example."""
    return {f"laws/{name}.svg": law_picture(law) for name, law in LAWS.items() if name in EXAMPLES.laws}


def _picture_words(law: FrictionLaw) -> dict[str, str | None]:
    """The caption of a law's picture, and the values with which it is drawn; None without a picture."""
    if law.name not in EXAMPLES.laws:
        return {"caption": None, "example": None}
    values = EXAMPLES.laws[law.name].parameters
    shown = [f"{p.name} = {with_unit(values[p.name], p.unit.format(F='N', q='m'))}" for p in law.parameters]
    return {"caption": caption(law), "example": f"Drawn with {', '.join(shown)}"}


def caption(law: FrictionLaw) -> str:
    """Caption of a law's picture."""
    example = EXAMPLES.laws[law.name]
    return ", and ".join(PANELS[panel][0].format(example=example) for panel in example.panels)


def law_picture(law: FrictionLaw) -> str:
    """The SVG of a law's picture."""
    example = EXAMPLES.laws[law.name]
    return svg_of(tuple(partial(PANELS[panel][1], law=law, example=example) for panel in example.panels))


def _steady(axes: Any, law: FrictionLaw, example: Example) -> None:
    """Force over velocity in both directions, with the range of forces at standstill as a vertical line."""
    speed = np.concatenate(([0.0, 0.0], np.geomspace(example.top_speed * 1e-6, example.top_speed, SAMPLES // 2)))
    level = np.array(law.sliding_level(speed, example.parameters))
    level[0] = 0.0
    for side in (-1, 1):
        _plot(axes, side * speed, side * level)
    framed(axes, "velocity in m/s", FORCE)


def _slow(axes: Any, law: FrictionLaw, example: Example) -> None:
    speed = np.geomspace(1e-8, 1e-3, 60)
    _plot(axes, speed, law.sliding_level(speed, example.parameters))
    axes.set_xscale("log")
    framed(axes, "velocity in m/s", FORCE)


def _under_sine(law: FrictionLaw, example: Example, periods: float, top: float) -> tuple[Any, Any, Any]:
    """Time, velocity and force over some periods of a sinusoidal velocity, or of a cosine's for ``top`` below 0."""
    omega = 2 * np.pi * example.frequency
    time = np.linspace(0, periods / example.frequency, round(periods * SAMPLES) + 1)
    velocity = top * np.sin(omega * time) if top > 0 else -top * np.cos(omega * time)
    return time, velocity, law.response(time, velocity, example.parameters)


def _loop(axes: Any, law: FrictionLaw, example: Example) -> None:
    top = example.top_speed
    time, velocity, force = _under_sine(law, example, 3, top)
    speed = np.geomspace(top * 1e-4, top, SAMPLES // 4)
    level = law.sliding_level(speed, example.parameters)
    factor, unit = prefixed([top], "m")
    for side in (-1, 1):
        _plot(axes, side * speed * factor, side * level, QUIET, (0, (4, 3)), 1.2)
    last = time >= 2 / example.frequency
    _plot(axes, velocity[last] * factor, force[last])
    framed(axes, f"velocity in {unit}/s", FORCE)


def _presliding(axes: Any, law: FrictionLaw, example: Example) -> None:
    """The virgin curve from rest, and two hysteresis loops."""
    omega = 2 * np.pi * example.frequency
    factor, unit = prefixed([max(example.presliding)], "m")
    for amplitude, colour in zip(reversed(example.presliding), (CURVE, SECOND), strict=False):
        time, _, force = _under_sine(law, example, 2.25, -amplitude * omega)
        _plot(axes, factor * amplitude * np.sin(omega * time), force, colour)
    framed(axes, f"displacement in {unit}", FORCE)


def _over_time(axes: Any, law: FrictionLaw, example: Example) -> None:
    time, velocity, force = _under_sine(law, example, 2, example.top_speed)
    moving = np.abs(velocity) > 1e-9
    steady = law.sliding_level(np.abs(velocity[moving]), example.parameters) * np.sign(velocity[moving])
    _plot(axes, time[moving], steady, QUIET, (0, (4, 3)), 1.2)
    _plot(axes, time[moving], force[moving])
    framed(axes, "time in s", FORCE)


def _velocity_step(axes: Any, law: FrictionLaw, example: Example) -> None:
    length, slow = example.parameters["L"], example.parameters["v_0"]
    slip = np.concatenate([np.linspace(a, b, SAMPLES) for a, b in ((0, 2), (2, 12), (12, 22))]) * length
    velocity = np.repeat([slow, 10 * slow, slow], SAMPLES)
    time = np.concatenate(([0.0], np.cumsum(np.maximum(np.diff(slip), 1e-9 * length) / velocity[1:])))
    factor, unit = prefixed([float(slip[-1])], "m")
    _plot(axes, factor * slip, law.response(time, velocity, example.parameters))
    framed(axes, f"displacement in {unit}", FORCE)


def _rests(axes: Any, law: FrictionLaw, example: Example) -> None:
    """Slip in one direction with rests, in each of which the pull rises steadily to ``PULL``."""
    stops = np.cumsum([(SLIP, rest) for rest in RESTS]).reshape(-1, 2)  # begin and end of each rest
    time = np.linspace(0, stops[-1, 1] + SLIP, 2 * SAMPLES)
    pull = np.max([PULL * (time - a) / (b - a) * ((a <= time) & (time <= b)) for a, b in stops], axis=0)
    velocity = np.where(pull > 0, 0.0, example.top_speed)
    _plot(axes, time, law.response(time, velocity, example.parameters, pull))
    framed(axes, "time in s", FORCE)


def _plot(axes: Any, x: Any, y: Any, colour: str = CURVE, dashes: Any = "-", width: float = 2.2) -> None:
    """Plot values rounded to some digits, so that rounding differences between platforms have no effect."""
    axes.plot(rounded(x), rounded(y), color=colour, linestyle=dashes, linewidth=width)


PANELS: dict[Panel, tuple[str, Callable[..., None]]] = {
    "steady": ("force against velocity", _steady),
    "slow": ("force of steady sliding", _slow),
    "loop": ("hysteresis under a sinusoidal velocity of {example.frequency:g} Hz (steady sliding dashed)", _loop),
    "presliding": ("under small displacements", _presliding),
    "time": ("its force over time", _over_time),
    "step": ("the force through a step of the velocity to ten times as much and back", _velocity_step),
    "rests": (
        "over time with rests of {} and {:g} s, in each of which a pull rises beyond the static level".format(
            ", ".join(f"{rest:g}" for rest in RESTS[:-1]), RESTS[-1]
        ),
        _rests,
    ),
}
"""Panel → its words in the caption, and the function that draws it."""
