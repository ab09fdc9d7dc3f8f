"""What ``stiction effects`` shows, from the docstrings and attributes of the effect classes."""

import inspect
from collections.abc import Mapping
from typing import Any

from codegen.base.result import named
from codegen.effects import CATALOGUE, Effect, EffectParameter
from codegen.effects.effect import Place
from codegen.report.examples import EXAMPLES

EXAMPLE_PLACES: dict[Place, str] = {
    "contact": "rail",
    "coordinate": "x",
    "two coordinates": "[x1, x2]",
    "axis": "x",
    "input": "w",
    "sensor": "x",
}
"""Kind of place → its name in the examples."""


def effect_view(effect: Effect) -> dict[str, Any]:
    """The fields of an effect for the template of the page."""
    _, *remarks = inspect.cleandoc(type(effect).__doc__ or "").split("\n\n")
    drawn = EXAMPLES.effects.get(effect.kind, {})  # parameter → its value in the examples
    # Every parameter of any form, each with the last form that has it.
    parameters = {p.name: (form, p) for form in effect.forms for p in form.parameters}
    return {
        **named(effect, "kind sits_on equation signature seen_over needs refines confused_with"),
        "remarks": [" ".join(r.split()) for r in remarks],
        "parameters": [
            {
                "name": p.name,
                "unit": p.unit.format(F="F", q="q", w="w"),
                "range": ", ".join(p.limits) or "any",
                "meaning": p.meaning,
                "start": _start(form, p),
                "optional": p.name not in [q.name for q in effect.parameters],
            }
            for form, p in parameters.values()
        ],
        "examples": [_example(form, drawn) for form in effect.forms],
        "named": EXAMPLE_PLACES[effect.sits_on],
    }


def _example(effect: Effect, drawn: Mapping[str, float]) -> str:
    """An entry of ``effects:`` in a spec, with parameters in SI."""
    values = ", ".join(f"{p.name}: {drawn.get(p.name, _inside(p)):g}" for p in effect.parameters)
    return f"{{kind: {effect.kind}, on: {EXAMPLE_PLACES[effect.sits_on]}, parameters: {{{values}}}}}"


def _inside(p: EffectParameter) -> float:
    """A value within the bounds of a parameter."""
    if p.low is None:
        return 1.0 if p.high is None else p.high - 1.0
    return p.low + 1.0 if p.high is None else (p.low + p.high) / 2


def effect_views() -> list[dict[str, Any]]:
    """Every effect of the catalogue, in its order."""
    return [effect_view(e) for e in CATALOGUE.values()]


def _start(effect: Effect, p: EffectParameter) -> str:
    """Start values of a fit of the parameter, in words: the docstring of the function that computes them."""
    if p not in effect.shapes:
        return "by least squares"
    own_combinations = type(effect).starts is not Effect.starts  # the class chooses start values of all shapes together
    if p.start is None and not own_combinations:
        return "at a tenth and a half of what makes the effect as large as the force"
    function = effect.starts if own_combinations else p.start
    text = inspect.cleandoc(function.__doc__ or "").split("\n\n")[0].rstrip(".")
    return " ".join(text.split())
