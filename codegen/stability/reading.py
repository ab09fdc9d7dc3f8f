"""Where the generated twin shows what a certificate speaks of, so that the checker can replay it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy

from codegen.observers.equations import Observer
from codegen.stability.family import Family
from codegen.stability.prefix import to_prefix


def code_reading(observer: Observer, family: Family, places: Mapping[str, str]) -> dict[str, Any]:
    """The certificate's ``code``: what the twin does not show is left out, and the checker says so.

    Args:
        places: name of an input or output of the code → its place there, such as outputs.v_hat[3].
    """
    shown = _truth(observer, places)
    variables = {}
    for variable in family.variables:
        expression = _meaning(observer, variable)
        if expression is not None and expression.free_symbols <= set(shown):
            variables[variable.name] = to_prefix(expression.subs(shown))
    errors = [places.get(name, "") for name in _estimates(observer)]
    pairs = zip(observer.system.positions, observer.system.velocities, strict=True)
    return {
        "errors": errors if all(errors) else [],
        "variables": variables,
        "motion": {shown[x].name: shown[v].name for x, v in pairs if x in shown and v in shown},
    }


def _truth(observer: Observer, places: Mapping[str, str]) -> dict[sympy.Symbol, sympy.Symbol]:
    """Positions and velocities → what the code takes for them, where its error is zero."""
    system = observer.system
    names = {x: x.name for x in system.positions if x not in system.sensor_errors}
    names |= {v: v.name if v.name in places else f"{v.name}_hat" for v in system.velocities}
    return {s: sympy.Symbol(places[name]) for s, name in names.items() if name in places}


def _meaning(observer: Observer, variable: sympy.Symbol) -> Any:
    """A variable of the family over positions and velocities; None where it is none of them."""
    system = observer.system
    slips = [u.subs(observer.values) for u in system.slip_velocity]
    if variable in observer.signs:
        slip = slips[observer.signs.index(variable)]
        return slip / sympy.Abs(slip)
    named = {c.slip: slip for c, slip in zip(system.contacts, slips, strict=True)}
    return named.get(variable, variable if variable in (*system.positions, *system.velocities) else None)


def _estimates(observer: Observer) -> list[str]:
    """The output less than truth by each error: of a level with the slip's sign, the contact's force."""
    names = [s.name for equation in observer.equations if equation.state is not None for s in equation.symbols]
    contacts = observer.system.contacts
    return [
        f"F_hat_{contacts[error.contact].name}" if observer.level_errors and error.contact is not None else name
        for error, name in zip(observer.errors, names, strict=True)
    ]
