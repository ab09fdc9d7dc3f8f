"""Time stepping of friction laws with states: slip and states together by an L-stable Runge–Kutta method, in CasADi."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.friction import DynamicLaw
from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.solve import solve_by_elimination
from codegen.mechanics.system import ContactFriction, System
from codegen.spec.functions import Sgn

ITERATIONS = 6
"""Newton iterations in one stage of a step."""
STANDSTILL = 1e-9
"""Slip speed at which the regularised sgn(u) reaches ±1, in slip unit/s."""
_GAMMA = 1 - 1 / sqrt(2)
"""Coefficient γ of the two-stage, stiffly accurate SDIRK method of order 2."""
INSIDE = 1 - 1e-9
"""Factor on the states at which slopes are evaluated, just inside their limits, where a slope may be infinite."""
DIRECTION = sympy.Symbol("direction", real=True)
_TOP_SPEED = sympy.Symbol("top_speed", real=True)


def has_states(contact: ContactFriction) -> bool:
    """Whether the contact's law has states that the plant integrates; it cannot for a law without a force at rest."""
    return bool(contact.law.states) and contact.level_at_rest is not None


@dataclass(frozen=True)
class LawTerms:
    """The law of one contact over its slip symbol, ``DIRECTION`` for the sign of slip, and ``states``.

    Attributes:
        force, rates: λ(u, z) and dz/dt.
        limits: (low, high) of each state; None for a limit that depends on the slip speed.
        rest: states at rest without load.
    """

    force: sympy.Expr
    rates: tuple[sympy.Expr, ...]
    states: tuple[sympy.Symbol, ...]
    limits: tuple[tuple[sympy.Expr | None, sympy.Expr | None], ...]
    rest: tuple[sympy.Expr, ...]


def state_terms(contact: ContactFriction) -> LawTerms:
    """The terms of a contact's law with states."""
    law, p = contact.law, contact.law_parameters
    assert isinstance(law, DynamicLaw)
    states = tuple(sympy.Symbol(f"state_{k}", real=True) for k in range(len(law.states)))
    force, *rates = (
        sympy.sympify(e).subs(Sgn(contact.slip), DIRECTION)
        for e in (law.force(contact.slip, states, p), *law.rates(contact.slip, states, p))
    )
    limits = tuple((_fixed(low), _fixed(high)) for low, high in law.state_range(_TOP_SPEED, p))
    return LawTerms(force, tuple(rates), states, limits, law.rest_state(p))


def values_at(
    terms: LawTerms,
    contact: ContactFriction,
    slip: Any,
    states: Any,
    names: Mapping[sympy.Symbol, Any],
    fixed: Mapping[sympy.Symbol, Any],
) -> list[Any]:
    """[λ, rates…] of a contact's law at a slip velocity and states, as SX.

    Args:
        names: symbol → SX or number, of the parameters.
        fixed: values of the parameters that are numbers. Dimensionless ones are inserted before the conversion, so that
            powers become products.
    """
    plain = {q.name for q in contact.law.parameters if q.unit == "1"}
    exponents = {s: fixed[s] for name, s in contact.law_parameters.items() if name in plain and s in fixed}
    direction = casadi.fmax(-1, casadi.fmin(1, slip / STANDSTILL))
    at = {**names, contact.slip: slip, DIRECTION: direction} | {s: states[i] for i, s in enumerate(terms.states)}
    return [to_casadi(e.subs(exponents), at) for e in (terms.force, *terms.rates)]


def _fixed(limit: sympy.Expr) -> sympy.Expr | None:
    limit = sympy.sympify(limit)
    return None if limit.has(_TOP_SPEED) else limit


class DynamicContacts:
    """The contacts of a System with λ = force(u, z), z' = rates(u, z), stepped together.

    Attributes:
        contacts: their indices among the system's contacts, in order.
        rest: (states,) the states at rest without load.
        stiffness: (contacts,) ∂λ/∂z ∂ξ/∂u at rest, the slope of the force over presliding, in force/slip unit.
    """

    def __init__(self, system: System) -> None:
        chosen = [c for c, contact in enumerate(system.contacts) if has_states(contact)]
        self.contacts = tuple(chosen)
        slip = casadi.SX.sym("slip", len(chosen))
        names = symbol_values(system.values)
        forces, rates, symbols, rest = [], [], [], []
        lower, upper, owner = [], [], []
        for k, c in enumerate(chosen):
            contact = system.contacts[c]
            terms = state_terms(contact)
            own = casadi.SX.sym(f"states_{contact.name}", len(terms.states))
            force, *own_rates = values_at(terms, contact, slip[k], own, names, system.values)
            forces.append(force)
            rates += own_rates
            symbols.append(own)
            rest += [float(value.subs(system.values)) for value in terms.rest]
            lower += [-np.inf if low is None else float(low.subs(system.values)) for low, _ in terms.limits]
            upper += [np.inf if high is None else float(high.subs(system.values)) for _, high in terms.limits]
            owner += [k] * len(terms.states)
        states = casadi.vertcat(*symbols) if symbols else casadi.SX(0, 1)
        values = casadi.vertcat(*forces, *rates) if forces else casadi.SX(0, 1)
        slopes = casadi.jacobian(values, casadi.vertcat(slip, states))
        self._laws = casadi.Function("laws", [slip, states], [values])
        self._slopes = casadi.Function("slopes", [slip, states], [slopes], {"cse": True})
        self._lower, self._upper = lower, upper
        self.rest = np.array(rest)
        at_rest = np.asarray(self._slopes(np.zeros(len(chosen)), self.rest))
        self.stiffness = np.zeros(len(chosen))
        for j, k in enumerate(owner):
            self.stiffness[k] += at_rest[k, len(chosen) + j] * at_rest[len(chosen) + j, k]

    def step(self, slip: Any, free: Any, mobility: Any, states: Any, step: Any) -> tuple[Any, Any]:
        """Mean forces over a step and the states after it, by a two-stage, L-stable, second-order SDIRK method.

        u' = free − mobility λ(u, z). Each stage is solved by ``ITERATIONS`` of Newton's method for slips and states
        together. An iterate that would cross u = 0 is set to u = 0, where the laws are not smooth, and the states are
        limited to their invariant range.

        Args:
            slip, free: u at the start and the slip acceleration without these contacts' forces, contacts by 1.
            mobility: contacts by contacts.
            states: z at the start, states by 1.
            step: h, seconds.

        Returns:
            (mean λ, contacts by 1; z at the end, states by 1).

        Source: Alexander 1977, Diagonally implicit Runge–Kutta methods for stiff ODEs; Hairer & Wanner, volume II, IV.6
        """
        count = len(self.contacts)
        part = _GAMMA * step
        first_slip, first_states = self._stage(slip, states, slip, states, free, mobility, part)
        laws = self._laws(first_slip, first_states)
        first_force, first_rate = laws[:count], laws[count:]
        share = (1 - _GAMMA) * step
        base_slip = slip + share * (free - casadi.mtimes(mobility, first_force))
        base_states = states + share * first_rate
        last_slip, last_states = self._stage(base_slip, base_states, first_slip, first_states, free, mobility, part)
        last_force = self._laws(last_slip, last_states)[:count]
        return (1 - _GAMMA) * first_force + _GAMMA * last_force, last_states

    def _stage(
        self, base_slip: Any, base_states: Any, slip: Any, states: Any, free: Any, mobility: Any, part: Any
    ) -> tuple[Any, Any]:
        """Solve U = base + part (free − mobility λ(U, Z)), Z = base + part ξ(U, Z) for U, Z, from an initial guess."""
        count, size = len(self.contacts), len(self.rest)
        for _ in range(ITERATIONS):
            laws, slopes = self._laws(slip, states), self._slopes(slip, INSIDE * states)
            force, rate = laws[:count], laws[count:]
            miss_slip = slip - base_slip - part * (free - casadi.mtimes(mobility, force))
            miss_states = states - base_states - part * rate
            # The states come first in the matrix, since their block is block-diagonal, one block for each law.
            matrix = casadi.blockcat(
                [
                    [casadi.SX.eye(size) - part * slopes[count:, count:], -part * slopes[count:, :count]],
                    [
                        part * casadi.mtimes(mobility, slopes[:count, count:]),
                        casadi.SX.eye(count) + part * casadi.mtimes(mobility, slopes[:count, :count]),
                    ],
                ]
            )
            move = solve_by_elimination(matrix, casadi.vertcat(miss_states, miss_slip))
            there = slip - move[size:]
            slip = casadi.if_else(slip * there < 0, 0, there)
            states = casadi.fmax(self._lower, casadi.fmin(self._upper, states - move[:size]))
        return slip, states
