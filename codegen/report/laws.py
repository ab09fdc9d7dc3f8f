"""docs/laws.md and its pictures, from the docstrings and attributes of the law classes.

A picture, as SVG, shows the force of a law in prescribed slip motions. It is deterministic.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import sympy

from codegen.base.own_files import write_page
from codegen.base.result import named
from codegen.base.text import render
from codegen.friction import LAWS, FrictionLaw, LawParameter
from codegen.mechanics.contacts import admissible
from codegen.report.examples import EXAMPLES, Example, Panel
from codegen.report.style import CURVE, QUIET, SECOND, framed, rounded, svg_of
from codegen.report.wording import prefixed, with_unit
from codegen.spec.functions import Magnitude

SPEED = sympy.Symbol("s", nonnegative=True)
SAMPLES = 1200
"""Samples in one period of the slip."""
FORCE = "force in N"
RESTS = (0.1, 0.5, 2.0)
"""s at rest, between slips of ``SLIP`` s."""
SLIP = 0.3
PULL = 100.0
"""N to which the pull rises in each rest."""


def law_groups() -> list[dict[str, Any]]:
    """The forms of laws: title, a sentence about the form, and its laws in the order of the registry."""
    return [
        {"title": title, "about": about, "laws": [law_view(law) for law in LAWS.values() if law.form == (title, about)]}
        for title, about in dict.fromkeys(law.form for law in LAWS.values())
    ]


def law_view(law: FrictionLaw) -> dict[str, Any]:
    """The fields of a law for the template."""
    drawn = law.name in EXAMPLES.laws
    first, *remarks = inspect.cleandoc(type(law).__doc__ or "").split("\n\n")
    # A parameter that must be positive is a positive symbol, so that expressions simplify without absolute values.
    symbols = {p.name: _symbol(p) for p in law.parameters}
    return {
        "name": law.name,
        "equation": first.removesuffix("."),
        "remarks": [" ".join(r.split()).replace("``", "`") for r in remarks],
        "parameters": [
            {
                "name": p.name,
                "unit": p.unit.format(F="F", q="q"),
                "range": admissible(p),
                "meaning": p.meaning,
                "default": "" if p.default is None else str(p.default),
            }
            for p in law.parameters
        ],
        "states": [{"name": s.name, "unit": s.unit.format(F="F", q="q"), "meaning": s.meaning} for s in law.states],
        "level": _plain(law.level(SPEED, symbols)),
        "bound": _bound(law.slope_bound(symbols)),
        "drives": law.drives or "neither",
        **named(law, "why_not source"),
        "caption": caption(law) if drawn else None,
        "example": "Drawn with " + ", ".join(f"{n} = {with_unit(v, u)}" for n, v, u in _values(law)) if drawn else None,
    }


def laws_page() -> str:
    """The text of docs/laws.md."""
    return render("text/laws.md.j2", groups=law_groups())


def write_laws(folder: Path) -> Path:
    """Write laws.md and the pictures of laws with an example into laws/ below it; return the page's path.

    Raises:
        BadInput: if the folder cannot be written, or has files of these names that stiction did not write.
    """
    drawn = [law for law in LAWS.values() if law.name in EXAMPLES.laws]
    pictures = {f"laws/{law.name}.svg": law_picture(law) for law in drawn}
    write_page(folder / "laws.md", laws_page(), pictures)
    return folder / "laws.md"


def _symbol(p: LawParameter) -> sympy.Symbol:
    if p.lowest is None or p.lowest < 0:
        return sympy.Symbol(p.name, real=True)
    return sympy.Symbol(p.name, positive=True) if p.positive else sympy.Symbol(p.name, nonnegative=True)


def _values(law: FrictionLaw) -> list[tuple[str, float, str]]:
    values = EXAMPLES.laws[law.name].parameters
    return [(p.name, values[p.name], p.unit.format(F="N", q="m")) for p in law.parameters]


def _plain(expression: sympy.Expr) -> str:
    magnitude = expression.replace(Magnitude, sympy.Abs)
    return str(magnitude).replace("Abs", "abs").replace("Max", "max").replace("Min", "min").replace("**", "^")


def _bound(bound: sympy.Expr) -> str:
    if bound == sympy.oo:
        return "none"
    if isinstance(bound, sympy.Piecewise):
        return ", otherwise ".join(
            _bound(value) + ("" if where is sympy.true else f" where `{_condition(where)}`")
            for value, where in bound.args
        )
    return f"`{_plain(bound)}`"


def _condition(where: Any) -> str:
    if isinstance(where, sympy.And):
        return " and ".join(sorted(_condition(part) for part in where.args))
    signs = {sympy.Eq: "=", sympy.Ne: "≠"}
    for kind, sign in signs.items():
        if isinstance(where, kind):
            return f"{where.lhs} {sign} {where.rhs}"
    return str(where)


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
    """From rest: the virgin curve and two hysteresis loops."""
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
    "loop": (
        "hysteresis under a sinusoidal velocity of {example.frequency:g} Hz (steady sliding dashed)",
        _loop,
    ),
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
