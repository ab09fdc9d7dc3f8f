"""Friction laws with states in free-run simulation: λ = force(u, y), y' = rates(u, y) for each contact that has one.

Laws of Dahl's form around the contact's own level use the simulator's closed form instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import sympy

from codegen.friction import DynamicLaw
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import ContactFriction, System
from codegen.simulate.dynamic_contact import STANDSTILL, has_states
from codegen.spec.functions import Sgn

INSIDE = 1 - 1e-9
"""Factor that keeps states just inside their limits: a power of the distance to the limit may have an infinite slope
there."""
DIRECTION = sympy.Symbol("direction", real=True)
TOP_SPEED = sympy.Symbol("top_speed", real=True)


@dataclass(frozen=True)
class LawTerms:
    """The law of one contact in terms of its slip symbol, ``DIRECTION`` for the sign of slip, and ``states``.

    Attributes:
        limits: (low, high) of each state; None where the limit depends on the slip speed.
        rest: states without load.
    """

    force: sympy.Expr
    rates: tuple[sympy.Expr, ...]
    states: tuple[sympy.Symbol, ...]
    limits: tuple[tuple[sympy.Expr | None, sympy.Expr | None], ...]
    rest: tuple[sympy.Expr, ...]


def law_terms(contact: ContactFriction) -> LawTerms | None:
    """The terms of a contact's law; None without states, or for Dahl's form."""
    law, p = contact.law, contact.law_parameters
    if not isinstance(law, DynamicLaw) or not has_states(contact) or law.bristle_stiffness(p) != 0:
        return None
    states = tuple(sympy.Symbol(f"state_{k}", real=True) for k in range(len(law.states)))
    force, *rates = (
        sympy.sympify(e).subs(Sgn(contact.slip), DIRECTION)
        for e in (law.force(contact.slip, states, p), *law.rates(contact.slip, states, p))
    )
    limits = tuple((_kept(low), _kept(high)) for low, high in law.state_range(TOP_SPEED, p))
    return LawTerms(force, tuple(rates), states, limits, law.rest_state(p))


def all_law_terms(system: System) -> list[tuple[int, LawTerms]]:
    """(contact, terms) of all contacts with terms."""
    found = ((c, law_terms(contact)) for c, contact in enumerate(system.contacts))
    return [(c, terms) for c, terms in found if terms is not None]


def owners(system: System) -> list[int]:
    """The contact of each state, in order."""
    return [c for c, terms in all_law_terms(system) for _ in terms.states]


def law_function(name: str, system: System, free: Sequence[sympy.Symbol], states: int) -> Any:
    """CasADi function (slip, y, p) → (force, ∂force/∂u, ∂force/∂y, rates, ∂rates/∂u, ∂rates/∂y), all dense.

    The first two have one entry a contact, the others one a state: of its own contact's force, and of its own rate.

    Args:
        states: number of y; those that this system does not have are constant.
    """
    count = len(system.contacts)
    slip, y, p = casadi.SX.sym("slip", count), casadi.SX.sym("y", states), casadi.SX.sym("p", len(free))
    numbers: dict[sympy.Symbol, Any] = {s: casadi.SX(float(value)) for s, value in system.values.items()}
    numbers |= {s: p[i] for i, s in enumerate(free)}
    force, push, rate = casadi.SX(count, 1), casadi.SX(states, 1), casadi.SX(states, 1)
    k = 0
    for c, terms in all_law_terms(system):
        contact = system.contacts[c]
        exponents = _exponents(contact, system, free)
        own = {s: y[k + i] for i, s in enumerate(terms.states)}
        at = numbers | own | {contact.slip: slip[c]}
        at[DIRECTION] = casadi.fmax(-1, casadi.fmin(1, slip[c] / STANDSTILL))
        force[c] = to_casadi(terms.force.subs(exponents), at)
        for expression in terms.rates:
            rate[k], push[k] = to_casadi(expression.subs(exponents), at), force[c]
            k += 1
    by_slip = casadi.vertcat(*[casadi.jacobian(force[c], slip[c]) for c in range(count)])
    by_state = casadi.vertcat(*[casadi.jacobian(push[i], y[i]) for i in range(states)])
    driven = casadi.vertcat(*[casadi.sum2(casadi.jacobian(rate[i], slip)) for i in range(states)])
    decay = casadi.vertcat(*[casadi.jacobian(rate[i], y[i]) for i in range(states)])
    outputs = [force, by_slip, by_state, rate, driven, decay]
    return casadi.Function(name, [slip, y, p], [casadi.densify(o) for o in outputs], {"cse": True})


def _kept(limit: sympy.Expr) -> sympy.Expr | None:
    limit = sympy.sympify(limit)
    return None if limit.has(TOP_SPEED) else INSIDE * limit


def _exponents(contact: ContactFriction, system: System, free: Sequence[sympy.Symbol]) -> dict[sympy.Symbol, Any]:
    """Dimensionless law parameters as numbers, so that powers become products; not those that a fit moves."""
    plain = {q.name for q in contact.law.parameters if q.unit == "1"}
    symbols = (s for name, s in contact.law_parameters.items() if name in plain)
    return {s: system.values[s] for s in symbols if s in system.values and s not in free}
