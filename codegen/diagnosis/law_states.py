"""Friction laws with states in free-run simulation: λ = force(u, y), y' = rates(u, y) for each contact that has one.

Laws of Dahl's form around the contact's own level use the simulator's closed form instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import ContactFriction, System
from codegen.simulate.dynamic_contact import DIRECTION, LawTerms, exponents, has_states, sign_of, state_terms


def law_terms(contact: ContactFriction) -> LawTerms | None:
    """The terms of a contact's law; None without states, or for Dahl's form."""
    if not has_states(contact) or contact.law.bristle_stiffness(contact.law_parameters) != 0:
        return None
    return state_terms(contact)


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
        plain = exponents(contact, {s: v for s, v in system.values.items() if s not in free})
        own = {s: y[k + i] for i, s in enumerate(terms.states)}
        at = numbers | own | {contact.slip: slip[c], DIRECTION: sign_of(slip[c])}
        force[c] = to_casadi(terms.force.subs(plain), at)
        for expression in terms.rates:
            rate[k], push[k] = to_casadi(expression.subs(plain), at), force[c]
            k += 1
    by_slip = casadi.vertcat(*[casadi.jacobian(force[c], slip[c]) for c in range(count)])
    by_state = casadi.vertcat(*[casadi.jacobian(push[i], y[i]) for i in range(states)])
    driven = casadi.vertcat(*[casadi.sum2(casadi.jacobian(rate[i], slip)) for i in range(states)])
    decay = casadi.vertcat(*[casadi.jacobian(rate[i], y[i]) for i in range(states)])
    outputs = [force, by_slip, by_state, rate, driven, decay]
    return casadi.Function(name, [slip, y, p], [casadi.densify(o) for o in outputs], {"cse": True})
