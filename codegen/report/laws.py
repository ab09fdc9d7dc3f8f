"""What ``stiction laws`` shows, from the docstrings and attributes of the law classes."""

import inspect
from typing import Any

import sympy

from codegen.base.result import named
from codegen.friction import LAWS, FrictionLaw, LawParameter
from codegen.mechanics.contacts import admissible
from codegen.spec.functions import Magnitude

SPEED = sympy.Symbol("s", nonnegative=True)


def law_groups() -> list[dict[str, Any]]:
    """The forms of laws: title, a sentence about the form, and its laws in the order of the registry."""
    return [
        {"title": title, "about": about, "laws": [law_view(law) for law in LAWS.values() if law.form == (title, about)]}
        for title, about in dict.fromkeys(law.form for law in LAWS.values())
    ]


def law_view(law: FrictionLaw) -> dict[str, Any]:
    """The fields of a law for the template."""
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
    }


def _symbol(p: LawParameter) -> sympy.Symbol:
    if p.lowest is None or p.lowest < 0:
        return sympy.Symbol(p.name, real=True)
    return sympy.Symbol(p.name, positive=True) if p.positive else sympy.Symbol(p.name, nonnegative=True)


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
