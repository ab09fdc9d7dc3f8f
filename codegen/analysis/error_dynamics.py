"""Linearised error dynamics of any observer: the Jacobian Ψ in continuous time, and A in discrete time.

With e = truth − estimate and the plant M(x) v' = g(x, v, w) − F, linearised at e = 0 between reversals,

    de/dt = Ψ e,    e[k+1] = (I + h A) e[k]  (explicit step),    (I − h A) e[k+1] = e[k]  (backward Euler).

``_linearise`` writes every quantity of the observer as a function of truth and e; ``_flow``, ``_explicit_step`` and
``_implicit_step`` differentiate these. Expressions stay short because M⁻¹ is kept as symbols W_ij (as 1/M_ii where M is
diagonal), and the entries of ∂v̂'/∂e as symbols that are inserted at the end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from codegen.analysis.polynomials import expand_products
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.sparse import each, jacobian, scaled
from codegen.mechanics.system import Matrix, System
from codegen.observers.equations import LawFunction, Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

SHORT = 6
"""Most operations in the value or slope of a friction law that is inserted; a longer one stays a symbol."""
ROUNDING = 1e-9
"""Largest rate of a vanishing error where all quantities are about 1: what is not more is rounding."""


@dataclass(frozen=True)
class ErrorDynamics:
    """The matrices Ψ and A of an observer's linearised error dynamics (equations: module).

    Attributes:
        jacobian: Ψ, m by m, over gains, parameters, x, v, w, ``inverse_mass`` symbols and slip signs.
        sampled: A, m by m, also over the sample time (symbol ``h``), for the observer's integration method.
        inverse_mass: symbol W_ij → (i, j); empty where M is diagonal.
        next_velocity: symbol of v[k+1] in A → symbol of v[k]; with an implicit step, of v[k−1] → of v[k]. Both have the
            range that the envelope gives v.
        slopes: symbol of a friction law's value or partial derivative at the true slip and state → its expression.
    """

    observer: Observer
    jacobian: Matrix
    sampled: Matrix
    inverse_mass: Mapping[sympy.Symbol, tuple[int, int]]
    next_velocity: Mapping[sympy.Symbol, sympy.Symbol]
    slopes: Mapping[sympy.Symbol, Any] = field(default_factory=dict)

    @property
    def errors(self) -> tuple[sympy.Symbol, ...]:
        """Symbols of the components of e."""
        return tuple(e.symbol for e in self.observer.errors)

    @property
    def implicit(self) -> bool:
        """Whether the observer is integrated by backward Euler: (I − h A) e[k+1] = e[k]."""
        return self.observer.integration == "implicit"

    @property
    def period(self) -> float:
        """h in the Lyapunov inequality A'P + PA + h A'PA < 0 of V = e'Pe, s; 0 with an implicit step.

        With an implicit step, (I − h A) e[k+1] = e[k], V decreases for any h if A'P + PA < 0.
        """
        return 0.0 if self.implicit else float(self.observer.sample_time)

    def at(self, sample_time: Any) -> ErrorDynamics:
        """The dynamics at another sample time (exact, s); A has h as a symbol, so nothing is derived again."""
        return self._with_observer(replace(self.observer, sample_time=sample_time))

    def _with_observer(self, observer: Observer) -> ErrorDynamics:
        """The same matrices for an observer with other numbers; the cache of ``in_force`` is shared."""
        other = replace(self, observer=observer)
        other.__dict__["_in_force"] = self._in_force
        return other

    def multipliers(self, eigenvalues: Any, h: Any) -> Any:
        """Eigenvalues z of the map e[k] → e[k+1], from the eigenvalues of A (array) and h in s."""
        return 1 / (1 - h * eigenvalues) if self.implicit else 1 + h * eigenvalues

    @property
    def inverse_mass_matrix(self) -> Matrix:
        """W = M⁻¹ in the symbols of Ψ, n by n."""
        return inverse_mass_symbols(self.observer.system)[0]

    def normal_form(self, matrix: Matrix) -> Matrix:
        """A matrix over the system's symbols, in the normal form of Ψ: slip signs as symbols, products expanded."""
        slips = _slip_signs(self.observer, {})
        return each(matrix, lambda e: _tidy(e, slips, self.observer.signs))

    def in_force(self, matrix: Matrix) -> Matrix:
        """S Ψ S or S A S, for force errors s e_a instead of level errors e_a; S is diagonal, of slip signs s and ones.

        A slip sign s = ±1 is constant between reversals, so S S = I. For diagonal K_F the signs cancel, and the error
        dynamics do not depend on the directions of slip.
        """
        if not self.observer.level_errors:
            return matrix
        if matrix not in self._in_force:
            s = [1 if e.contact is None else self.observer.signs[e.contact] for e in self.observer.errors]
            in_force = each(scaled(s, matrix, s), lambda e: drop_squares(expand_products(e), self.observer.signs))
            self._in_force[matrix] = in_force
        return self._in_force[matrix]

    @cached_property
    def _in_force(self) -> dict[Matrix, Matrix]:
        """Cache of ``in_force``."""
        return {}


def drop_squares(expression: Any, signs: tuple[sympy.Symbol, ...]) -> Any:
    """Replace s² by 1 for every slip sign."""
    present = expression.free_symbols & set(signs)
    if not present:
        return expression
    return expression.replace(
        lambda e: e.is_Pow and e.base in present and e.exp.is_Integer, lambda e: e.base ** (e.exp % 2)
    )


def inverse_mass_symbols(system: System) -> tuple[Matrix, dict[sympy.Symbol, tuple[int, int]]]:
    """W = M⁻¹: reciprocals where M is diagonal, otherwise symbols W_ij, symmetric."""
    n = system.degrees_of_freedom
    mass = system.mass_matrix
    if mass.is_diagonal():
        return Matrix(sympy.diag(*[1 / mass[i, i] for i in range(n)])), {}
    names: dict[sympy.Symbol, tuple[int, int]] = {}
    inverse = sympy.zeros(n, n)
    for i in range(n):
        for j in range(i, n):
            s = symbol(f"W{i + 1}{j + 1}" if n < 10 else f"W{i + 1}_{j + 1}")
            names[s] = (i, j)
            inverse[i, j] = inverse[j, i] = s
    return Matrix(inverse), names


def derive_error_dynamics(observer: Observer, differential: ErrorDynamics | None = None) -> ErrorDynamics:
    """Ψ from an observer's differential equations, and A from its step.

    ``differential``: error dynamics of the same differential equations with an explicit step, whose Ψ is reused.
    """
    if differential is None and (observer.euler is None or observer.integration == "implicit"):
        return _derive(observer, SHORT)
    stepped = derive_step(observer)
    differential = differential or _derive(observer.euler or observer, SHORT, step=False)
    return replace(
        stepped,
        jacobian=differential.jacobian,
        inverse_mass={**differential.inverse_mass, **stepped.inverse_mass},
        slopes={**differential.slopes, **stepped.slopes},
    )


def derive_step(observer: Observer, longest: int = SHORT) -> ErrorDynamics:
    """Error dynamics with A alone, and zeros for Ψ; ``longest``: as ``SHORT``."""
    return _derive(observer, longest, psi=False)


def _derive(observer: Observer, longest: int, psi: bool = True, step: bool = True) -> ErrorDynamics:
    """Ψ and A, zero where ``psi`` or ``step`` is false; cached for observers that differ only in numbers."""
    key = (_symbolic(observer), longest, psi, step)
    if key not in _cache:
        if len(_cache) == MOST_KEPT:
            del _cache[next(iter(_cache))]
        _cache[key] = _derive_anew(observer, longest, psi, step)
    return _cache[key]._with_observer(observer)


MOST_KEPT = 32
_cache: dict[Any, ErrorDynamics] = {}
"""Key of ``_symbolic`` → derivation; the last ``MOST_KEPT``."""


def _symbolic(observer: Observer) -> tuple[Any, ...]:
    """Cache key: everything that determines the symbolic error dynamics, without values of parameters and gains."""
    system = observer.system
    laws = [tuple((f.label, tuple(f.arguments.items())) for f in e.law) for e in observer.equations]
    equations = [(e.name, e.symbols, e.expression, e.form, e.state) for e in observer.equations]
    errors = tuple((e.symbol, e.truth, e.of, e.contact) for e in observer.errors)
    own = (observer.states, observer.rates, observer.signs, observer.integration, observer.euler is None)
    machine = (system.positions, system.velocities, system.mass_matrix, system.slip_velocity)
    return (tuple(equations), tuple(laws), errors, observer.level_errors, observer.exact, own, machine)


def _derive_anew(observer: Observer, longest: int, psi: bool, step: bool) -> ErrorDynamics:
    """As ``_derive``, without the cache."""
    inverse_mass, inverse_names = inverse_mass_symbols(observer.system)
    linear = _linearise(observer, inverse_mass, longest)
    zeros = Matrix(sympy.zeros(len(observer.errors)))
    continuous = _flow(observer, linear) if psi else zeros
    sampled, other_sample = zeros, dict[sympy.Symbol, sympy.Symbol]()
    if step:
        of_method = _implicit_step if observer.integration == "implicit" else _explicit_step
        sampled, other_sample = of_method(observer, linear)

    slips = _slip_signs(observer, {})
    system, h = observer.system, symbol("h") * (-1 if observer.integration == "implicit" else 1)
    moved = {x: x + h * v for x, v in zip(system.positions, system.velocities, strict=True)}  # as in the step
    slips |= _slip_signs(observer, moved | {v: name for name, v in other_sample.items()})
    acceleration_slopes = linear.acceleration_slopes
    continuous = each(continuous.xreplace(acceleration_slopes), lambda x: _tidy(x, slips, observer.signs))
    sampled = each(sampled, lambda x: _tidy(_speeds_as_slips(x, slips), slips, observer.signs))
    in_either = continuous.free_symbols | sampled.free_symbols
    return ErrorDynamics(
        observer,
        continuous,
        sampled,
        {s: ij for s, ij in inverse_names.items() if s in in_either},
        {name: v for name, v in other_sample.items() if name in sampled.free_symbols},
        {s: e for s, e in linear.slopes.items() if s in in_either},
    )


@dataclass(frozen=True)
class _Linearised:
    """An observer's quantities as functions of the truth and the error e, to first order in e.

    Attributes:
        values: symbol of an estimate, a state or another equation's element → its expression in truth and e.
        slopes: as in ``ErrorDynamics``.
        acceleration_slopes: symbol → entry of ∂v̂'/∂e.
        at_truth: error symbol → 0.
        states, rates: z and dz/dt.
    """

    values: Mapping[sympy.Symbol, Any]
    slopes: Mapping[sympy.Symbol, Any]
    acceleration_slopes: Mapping[sympy.Symbol, Any]
    at_truth: Mapping[sympy.Symbol, Any]
    states: Matrix
    rates: Matrix

    def slope(self, column: Matrix) -> Matrix:
        """∂column/∂e at e = 0."""
        return jacobian(column, list(self.at_truth), self.at_truth)


def _linearise(observer: Observer, inverse_mass: Matrix, longest: int) -> _Linearised:
    """Every quantity of the observer over truth and e, by substitution through the equations in order.

    An estimate with a state z has the form z + rest, so that z = truth − e − rest. The acceleration computed by the
    model is v̂' = v' + (∂v̂'/∂e) e, with symbols for the true v'.
    """
    e = [error.symbol for error in observer.errors]
    at_truth = dict.fromkeys(e, sympy.S.Zero)
    errors = iter(observer.errors)
    slip_signs = _slip_signs(observer, {})
    longest_law = 0 if observer.integration == "implicit" else longest
    values: dict[sympy.Symbol, Any] = {}
    slopes: dict[sympy.Symbol, Any] = {}
    acceleration_slopes: dict[sympy.Symbol, Any] = {}
    for equation in observer.equations:
        if equation.law:
            for element, value, function in zip(equation.symbols, equation.expression, equation.law, strict=True):
                values[element] = _first_order(value, function, values, at_truth, slip_signs, slopes, longest_law)
        elif equation.state is not None:
            rests = (equation.expression - equation.state).xreplace(values)
            for element, state, rest in zip(equation.symbols, equation.state, rests, strict=True):
                error = next(errors)
                values[element] = error.truth - error.symbol
                values[state] = values[element] - rest
        elif equation.form == "mass_solve":
            slope = inverse_mass * jacobian(equation.expression.xreplace(values), e, at_truth)
            acceleration_slopes = {
                sympy.Dummy(f"slope{k}", real=True): entry for k, entry in enumerate(slope) if entry != 0
            }
            name_of = {entry: name for name, entry in acceleration_slopes.items()}
            first_order = each(slope, name_of.__getitem__) * Matrix(e)
            for element, a, change in zip(equation.symbols, observer.system.accelerations, first_order, strict=True):
                values[element] = a + change
        else:
            values.update(zip(equation.symbols, equation.expression.xreplace(values), strict=True))
    states, rates = observer.states.xreplace(values), observer.rates.xreplace(values)
    return _Linearised(values, slopes, acceleration_slopes, at_truth, states, rates)


def _flow(observer: Observer, linear: _Linearised) -> Matrix:
    """Ψ = −∂/∂e (d/dt estimate(z, x, v)), by the chain rule with the observer's dz/dt and the plant's x' = v, v'.

    Raises ValueError for an observer that is ``exact`` though e = 0 is no equilibrium of these equations.
    """
    system, estimates = observer.system, _estimates_of_state(observer)
    states = dict(zip(observer.states, linear.states, strict=True))
    plant = dict(zip((*system.positions, *system.velocities), (*system.velocities, *system.accelerations), strict=True))
    flow = jacobian(estimates, observer.states) * Matrix(linear.rates)
    flow += jacobian(estimates, list(plant)) * Matrix(list(plant.values()))
    flow = flow.xreplace(states)
    if observer.exact:
        _require_equilibrium(observer, flow.xreplace(linear.at_truth))
    return -linear.slope(flow)


def _require_equilibrium(observer: Observer, flow: Matrix) -> None:
    """Raise ValueError if e = 0 is no equilibrium: if an estimate without error has another rate than the true value.

    The true rate is v' of a velocity and 0 of a friction force or level. The error of an estimate that leaks, for
    example, tends to another value than 0, and a certificate of the decay of V(e) would be false. The state of a law
    is left out: its rate is that of the law that the observer assumes, which the builder compares with the plant's.
    """
    random, slips = np.random.default_rng(0), observer.system.slip_velocity
    true_rates = dict(zip(observer.system.velocities, observer.system.accelerations, strict=True))
    for error, rate in zip(observer.errors, flow, strict=True):
        if error.of == "state":
            continue
        drift = true_rates.get(error.truth, 0) - rate
        named = sorted((drift.free_symbols | slips.free_symbols) - {*observer.signs}, key=str)
        values: dict[sympy.Symbol, Any] = dict(zip(named, random.uniform(0.5, 1.5, len(named)), strict=True))
        values |= {s: np.sign(float(to_casadi(u, values))) for s, u in zip(observer.signs, slips, strict=True)}
        if abs(float(to_casadi(drift, values))) > ROUNDING:
            found = f"at e = 0 the error {error.symbol} of a {observer.kind} changes at the rate {drift}"
            raise ValueError(f"{found}, so e = 0 is no equilibrium; an observer that is meant so has exact=False")


def _explicit_step(observer: Observer, linear: _Linearised) -> tuple[Matrix, dict[sympy.Symbol, sympy.Symbol]]:
    """A = (−∂estimate[k+1]/∂e[k] − I)/h, and the symbols of v[k+1] → v[k].

    z[k+1] = z + h dz/dt by the observer, x[k+1] = x + h v by the plant to first order in h, and v' = (v[k+1] − v)/h.
    """
    system, h = observer.system, symbol("h")
    next_velocity = {symbol(f"{v.name}_next"): v for v in system.velocities}
    stepped: dict[sympy.Symbol, Any] = dict(zip(observer.states, linear.states + h * linear.rates, strict=True))
    stepped |= {x: x + h * v for x, v in zip(system.positions, system.velocities, strict=True)}
    if observer.euler is not None:
        # With a method other than Euler, e = 0 is an equilibrium only if the velocity states at e = 0 give
        # v̂[k+1] = v[k+1]: x, and with it Γ x, changes by the plant's mean velocity over the sample.
        velocity = observer.equations[0]
        change = sympy.Matrix([stepped[z] for z in observer.states[: len(next_velocity)]])
        rest = (velocity.expression - velocity.state).xreplace(stepped)
        corrected = sympy.Matrix(list(next_velocity)) - rest + change - change.xreplace(linear.at_truth)
        stepped |= dict(zip(observer.states, corrected, strict=False))
    stepped |= {v: name for name, v in next_velocity.items()}
    next_estimates = _estimates_of_state(observer).xreplace(stepped)
    sampled = (-linear.slope(next_estimates) - sympy.eye(len(observer.errors))) / h
    accelerations = {
        a: (name - v) / h for a, (name, v) in zip(system.accelerations, next_velocity.items(), strict=True)
    }
    return sampled.xreplace(linear.acceleration_slopes).xreplace(accelerations), next_velocity


def _implicit_step(observer: Observer, linear: _Linearised) -> tuple[Matrix, dict[sympy.Symbol, sympy.Symbol]]:
    """A = (I + (∂estimate/∂z)[k−1] ∂(z − h dz/dt)/∂e[k])/h, and the symbols of v and law states at k−1 → at k.

    Backward Euler solves z[k] − h (dz/dt)[k] = z[k−1]. Of the plant, x[k−1] = x − h v and v' = (v − v[k−1])/h; the
    rates of friction laws' states are replaced alike.
    """
    system, h = observer.system, symbol("h")
    state_rates = _true_state_rates(observer, linear)
    before = {symbol(f"{s.name}_before"): s for s in (*system.velocities, *state_rates)}
    earlier = {x: x - h * v for x, v in zip(system.positions, system.velocities, strict=True)}
    earlier |= {s: name for name, s in before.items()}
    states_before = dict(zip(observer.states, linear.states.xreplace(linear.at_truth).xreplace(earlier), strict=True))
    from_state = jacobian(_estimates_of_state(observer), observer.states).xreplace(earlier).xreplace(states_before)
    residual = linear.slope(linear.states - h * linear.rates)
    sampled = (sympy.eye(len(observer.errors)) + from_state * residual) / h
    moving = (*system.accelerations, *state_rates.values())
    differences = {rate: (s - name) / h for rate, (name, s) in zip(moving, before.items(), strict=True)}
    return sampled.xreplace(linear.acceleration_slopes).xreplace(differences), before


def _true_state_rates(observer: Observer, linear: _Linearised) -> dict[sympy.Symbol, Any]:
    """Symbol of a friction law's true state → symbol of its true rate ξ."""
    rates = next((e.symbols for e in observer.equations if e.name == "friction_state_rate"), ())
    of_state = [e.truth for e in observer.errors if e.of == "state"]
    return {f: linear.values[r].xreplace(linear.at_truth) for f, r in zip(of_state, rates, strict=True)}


def _first_order(
    value: Any,
    function: LawFunction,
    values: Mapping[sympy.Symbol, Any],
    zero: Mapping[sympy.Symbol, Any],
    slips: Mapping[Any, sympy.Symbol],
    slopes: dict[sympy.Symbol, Any],
    longest: int,
) -> Any:
    """First-order expansion f(truth) + Σ ∂f/∂s (ŝ − s) of a friction law f in its arguments s.

    Value and slopes with more than ``longest`` operations become symbols, whose expressions are added to ``slopes``;
    with ``longest`` = 0 so do all those of a state's rate ξ.
    """
    true = {s: values[s].xreplace(zero) for s in function.arguments.values()}

    def inserted_or_named(label: str, expression: Any) -> Any:
        expression = expression.xreplace(true)
        expression = expression.replace(Sgn, lambda u: _sign(sympy.expand(u), slips))
        if int(sympy.count_ops(expression)) <= longest and not (longest == 0 and label.startswith("xi")):
            return expression
        slopes[symbol(label)] = expression
        return symbol(label)

    total = inserted_or_named(function.label, value)
    for letter, s in function.arguments.items():
        total += inserted_or_named(function.slope_label(letter), value.diff(s)) * (values[s] - true[s])
    return total


def _estimates_of_state(observer: Observer) -> Matrix:
    """The estimates whose errors are e, in the order of e, as functions of z, x and v."""
    values: dict[sympy.Symbol, Any] = {}
    estimates: list[Any] = []
    for equation in observer.equations:
        if equation.form == "mass_solve":
            break
        expression = equation.expression.xreplace(values)
        values.update(zip(equation.symbols, expression, strict=True))
        if equation.state is not None:
            estimates += list(expression)
    return sympy.Matrix(estimates)


def _slip_signs(observer: Observer, rename: Mapping[sympy.Symbol, Any]) -> dict[Any, sympy.Symbol]:
    """Slip velocity of each contact, expanded → its sign symbol; ``rename`` replaces positions and velocities in it."""
    slips = observer.system.slip_velocity.xreplace(rename)
    return {sympy.expand(u): s for u, s in zip(slips, observer.signs, strict=True)}


def _tidy(expression: Any, slips: Mapping[Any, sympy.Symbol], signs: tuple[sympy.Symbol, ...]) -> Any:
    """Normal form: sgn of a slip as its sign symbol, u·sgn(u) as |u|, s² = 1, products expanded."""
    if expression.has(Sgn, Magnitude):
        expression = expression.replace(lambda e: e.func in (Sgn, Magnitude), lambda e: e.func(sympy.expand(e.args[0])))
        expression = expression.replace(Sgn, lambda u: _sign(sympy.expand(u), slips))
    expression = drop_squares(expand_products(expression), signs)
    for atom in list(expression.atoms(Sgn)):
        u = atom.args[0]
        expression = expand_products(expression.subs(u * atom, Magnitude(u)))
    return expression


def _speeds_as_slips(expression: Any, slips: Mapping[Any, sympy.Symbol]) -> Any:
    """Replace |u| by s u for slip velocities u, so that terms of u[k] and u[k+1] cancel; s is constant here."""

    def speed(u: Any) -> Any:
        sign = _sign(sympy.expand(u), slips)
        return Magnitude(u) if sign.has(Sgn) else sign * u

    return expression.replace(Magnitude, speed)


def _sign(u: Any, slips: Mapping[Any, sympy.Symbol]) -> Any:
    """sgn(u) as ±s if ±u is the slip velocity of a contact with sign symbol s; else Sgn(u)."""
    if u in slips:
        return slips[u]
    if sympy.expand(-u) in slips:
        return -slips[sympy.expand(-u)]
    return Sgn(u)
