"""Which outputs of the generated code a certificate's errors are of, and for its reader where its variables are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy

from codegen.certify.family import Family
from codegen.certify.prefix import to_prefix
from codegen.observers.equations import Observer


def code_reading(observer: Observer, family: Family, places: Mapping[str, str]) -> dict[str, Any]:
    """The certificate's ``code``: what the code does not show is left out, and the checker says so.

    Args:
        places: name of an input or output of the code → its place there, such as outputs.v_hat[3].
    """
    shown = _truth(observer, places)
    variables = {}
    for variable in family.variables:
        expression = _meaning(observer, variable)
        if expression is not None and expression.free_symbols <= set(shown):
            variables[variable.name] = to_prefix(expression.subs(shown))
    errors = [_shown(estimate, shown, places) for estimate in _estimates(observer)]
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


def _shown(estimate: Any, shown: Mapping[sympy.Symbol, sympy.Symbol], places: Mapping[str, str]) -> Any:
    """An estimate, or a slip's sign times one, in places of the code; empty where it is not shown."""
    sign, symbol = estimate
    if symbol.name not in places or (sign is not None and not sign.free_symbols <= set(shown)):
        return ""
    return places[symbol.name] if sign is None else ["*", to_prefix(sign.subs(shown)), places[symbol.name]]


def _meaning(observer: Observer, variable: sympy.Symbol) -> Any:
    """A variable of the family over positions and velocities; None where it is none of them."""
    system = observer.system
    if variable in observer.signs:
        return _sign(observer, observer.signs.index(variable))
    slips = {c.slip: u for c, u in zip(system.contacts, system.slip_velocity, strict=True)}
    if variable in slips:
        return slips[variable].subs(observer.values)
    return variable if variable in (*system.positions, *system.velocities) else None


def _sign(observer: Observer, contact: int) -> Any:
    slip = observer.system.slip_velocity[contact].subs(observer.values)
    return slip / sympy.Abs(slip)


def _estimates(observer: Observer) -> list[tuple[Any, sympy.Symbol]]:
    """By each error (sign of slip or None, estimate): of a level that is certified as a force, with that sign."""
    symbols = [s for equation in observer.equations if equation.state is not None for s in equation.symbols]
    turned = [e.contact if observer.level_errors else None for e in observer.errors]
    return [(None if c is None else _sign(observer, c), s) for c, s in zip(turned, symbols, strict=True)]
