"""Error dynamics of an observer: Ψ of the continuous error and the matrix of the sampled one, for all kinds.

Both are derived to first order in the error e at e = 0, between reversals, with the plant M v' = g − F. M⁻¹ stays a
symbol W (or 1/M_ii where M is diagonal), and the model's acceleration stays a symbol with its derivative by e, so that
expressions stay short.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import sympy

from codegen.analysis.polynomials import expand_products
from codegen.mechanics.sparse import each, jacobian, scaled
from codegen.mechanics.system import Matrix, System
from codegen.observers.equations import LawFunction, Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

SHORT = 6


@dataclass(frozen=True)
class ErrorDynamics:
    """de/dt = Ψ e and e[k+1] = (I + h A) e[k], to first order, between reversals; (I − h A) e[k+1] = e[k] if implicit.

    Attributes:
        jacobian: Ψ, m by m, over gains, parameters, x, v, w, ``inverse_mass`` symbols and slip signs.
        sampled: A at sample time h (symbol ``h``), by the observer's integration; in force errors by ``in_force``.
        inverse_mass: symbol W_ij → (i, j); empty where M is diagonal.
        next_velocity: symbol → velocity: that of one sample later (before, if implicit), in the same envelope.
        slopes: symbol for the value or a slope of a friction law at the true slip and state → its expression.
    """

    observer: Observer
    jacobian: Matrix
    sampled: Matrix
    inverse_mass: Mapping[sympy.Symbol, tuple[int, int]]
    next_velocity: Mapping[sympy.Symbol, sympy.Symbol]
    slopes: Mapping[sympy.Symbol, Any] = field(default_factory=dict)

    @property
    def errors(self) -> tuple[sympy.Symbol, ...]:
        return tuple(e.symbol for e in self.observer.errors)

    @property
    def implicit(self) -> bool:
        """Whether the step is (I − h A) e[k+1] = e[k]."""
        return self.observer.integration == "implicit"

    @property
    def period(self) -> float:
        """h in the condition A'P + PA + hA'PA < 0 of a V = e'Pe that falls, s: 0 where the step is implicit."""
        return 0.0 if self.implicit else float(self.observer.sample_time)

    def at(self, sample_time: Any) -> ErrorDynamics:
        """The same at another sample time, exact, s."""
        other = replace(self, observer=replace(self.observer, sample_time=sample_time))
        other.__dict__["_in_force"] = self._in_force  # h is a symbol there
        return other

    def multipliers(self, eigenvalues: Any, h: Any) -> Any:
        """Eigenvalues of the step over one sample, from those of A (array) and h in s."""
        return 1 / (1 - h * eigenvalues) if self.implicit else 1 + h * eigenvalues

    @property
    def inverse_mass_matrix(self) -> Matrix:
        """W = M⁻¹ in the symbols of Ψ, n by n."""
        return inverse_mass_symbols(self.observer.system)[0]

    def tidied(self, matrix: Matrix) -> Matrix:
        """A matrix over the system's symbols in the form of Ψ: slip signs as symbols, products expanded."""
        slips = _slip_signs(self.observer, {})
        return each(matrix, lambda e: _tidy(e, slips, self.observer.signs))

    def in_force(self, matrix: Matrix) -> Matrix:
        """Ψ or A with force errors s·e_a in place of level errors e_a.

        Between reversals s is constant; for diagonal K_F the signs cancel, so that the error dynamics do not switch.
        """
        if not self.observer.level_errors:
            return matrix
        if matrix not in self._in_force:
            self._in_force[matrix] = self._turned(matrix)
        return self._in_force[matrix]

    @cached_property
    def _in_force(self) -> dict[Matrix, Matrix]:
        """Cache of ``in_force``."""
        return {}

    def _turned(self, matrix: Matrix) -> Matrix:
        signs = [1 if e.contact is None else self.observer.signs[e.contact] for e in self.observer.errors]
        return each(scaled(signs, matrix, signs), lambda e: drop_squares(expand_products(e), self.observer.signs))


def drop_squares(expression: Any, signs: tuple[sympy.Symbol, ...]) -> Any:
    """Replace s² by 1 for every slip sign."""
    there = expression.free_symbols & set(signs)
    if not there:
        return expression
    return expression.replace(
        lambda e: e.is_Pow and e.base in there and e.exp.is_Integer, lambda e: e.base ** (e.exp % 2)
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


def derive_error_dynamics(
    observer: Observer, longest: int = SHORT, differential: ErrorDynamics | None = None
) -> ErrorDynamics:
    """Derive Ψ from an observer's differential equations, and the sampled matrix from its step.

    Args:
        longest: most operations of a law's value or slope that is inserted; longer ones stay symbols.
        differential: of the same equations with an explicit step, where these are known.
    """
    if differential is None and (observer.euler is None or observer.integration == "implicit"):
        return _derive(observer, longest)
    stepped = derive_step(observer, longest)
    differential = differential or _derive(observer.euler or observer, longest, step=False)
    return replace(
        stepped,
        jacobian=differential.jacobian,
        inverse_mass={**differential.inverse_mass, **stepped.inverse_mass},
        slopes={**differential.slopes, **stepped.slopes},
    )


def derive_step(observer: Observer, longest: int = SHORT) -> ErrorDynamics:
    """The sampled matrix alone, with zeros for Ψ; ``longest`` as of ``derive_error_dynamics``."""
    return _derive(observer, longest, psi=False)


def _derive(observer: Observer, longest: int, psi: bool = True, step: bool = True) -> ErrorDynamics:
    """Both matrices, or zeros in place of one that is not asked for; observers that differ in numbers share them."""
    key = (_symbolic(observer), longest, psi, step)
    if key not in _derived:
        if len(_derived) == MOST_KEPT:
            del _derived[next(iter(_derived))]
        _derived[key] = _derive_anew(observer, longest, psi, step)
    found = replace(_derived[key], observer=observer)
    found.__dict__["_in_force"] = _derived[key]._in_force
    return found


MOST_KEPT = 32
_derived: dict[Any, ErrorDynamics] = {}
"""What was derived last."""


def _symbolic(observer: Observer) -> tuple[Any, ...]:
    """All of an observer that its error dynamics follow from: everything but numbers, which are symbols there."""
    system = observer.system
    laws = [tuple((f.label, tuple(f.arguments.items())) for f in e.law) for e in observer.equations]
    equations = [(e.name, e.symbols, e.expression, e.form, e.state) for e in observer.equations]
    errors = tuple((e.symbol, e.truth, e.of, e.contact) for e in observer.errors)
    own = (observer.states, observer.rates, observer.signs, observer.integration, observer.euler is None)
    machine = (system.positions, system.velocities, system.mass_matrix, system.slip_velocity)
    return (tuple(equations), tuple(laws), errors, observer.level_errors, own, machine)


def _derive_anew(observer: Observer, longest: int, psi: bool, step: bool) -> ErrorDynamics:
    system = observer.system
    inverse_mass, inverse_names = inverse_mass_symbols(system)
    e = [error.symbol for error in observer.errors]
    zero = dict.fromkeys(e, sympy.S.Zero)
    h = symbol("h")
    accelerations = system.accelerations

    # Substitute in order: estimates are truth − e, states follow from them, the acceleration is v' + (∂a/∂e) e.
    truth = {error.truth: error.truth - error.symbol for error in observer.errors}
    estimate_of = iter(observer.errors)
    values: dict[sympy.Symbol, Any] = {}
    slopes: dict[sympy.Symbol, Any] = {}
    signs_of_slip = _slip_signs(observer, {})
    carried: dict[sympy.Symbol, Any] = {}
    for equation in observer.equations:
        if equation.law:
            for element, value, function in zip(equation.symbols, equation.expression, equation.law, strict=True):
                short = 0 if observer.integration == "implicit" else longest
                values[element] = _first_order(value, function, values, zero, signs_of_slip, slopes, short)
            continue
        expression = equation.expression.xreplace(values)
        if equation.state is not None:
            rest = (equation.expression - equation.state).xreplace(values)
            for element, state, other in zip(equation.symbols, equation.state, rest, strict=True):
                values[element] = truth[next(estimate_of).truth]
                values[state] = values[element] - other
        elif equation.form == "mass_solve":
            slope = (inverse_mass * jacobian(expression, e)).xreplace(zero)
            # Each slope gets a symbol of its own, so that the expressions differentiated below stay short.
            carried = {sympy.Dummy(f"slope{k}", real=True): entry for k, entry in enumerate(slope) if entry != 0}
            name_of = {entry: name for name, entry in carried.items()}
            first_order = each(slope, name_of.__getitem__) * Matrix(e)
            for element, a, change in zip(equation.symbols, accelerations, first_order, strict=True):
                values[element] = a + change
        else:
            values.update(zip(equation.symbols, expression, strict=True))

    state_values = observer.states.xreplace(values)
    rate_values = observer.rates.xreplace(values)
    estimates = _estimates_of_state(observer)
    position_rate = dict(zip(system.positions, system.velocities, strict=True))
    velocity_rate = dict(zip(system.velocities, accelerations, strict=True))

    # Continuous: the chain rule on estimate(z, x, v).
    at_truth = dict(zip(observer.states, state_values, strict=True))
    moved = {**position_rate, **velocity_rate}
    flow = jacobian(estimates, observer.states) * Matrix(rate_values)
    flow += jacobian(estimates, list(moved)) * Matrix(list(moved.values()))
    none = Matrix(sympy.zeros(len(e)))
    slope_of_flow = -jacobian(flow.xreplace(at_truth), e).xreplace(zero) if psi else none

    # Sampled: one step of the states, and the plant's own motion to first order in h.
    rate_of = _true_state_rates(observer, values, zero) if observer.integration == "implicit" else {}
    if observer.integration == "implicit":
        later = {symbol(f"{s.name}_before"): s for s in (*system.velocities, *rate_of)}
        earlier = {x: x - h * v for x, v in position_rate.items()} | {v: name for name, v in later.items()}
        at_truth = dict(zip(observer.states, state_values.xreplace(zero).xreplace(earlier), strict=True))
        from_state = jacobian(estimates, observer.states).xreplace(earlier).xreplace(at_truth)
        ahead = jacobian(state_values - h * rate_values, e).xreplace(zero)
        sampled = (sympy.eye(len(e)) + from_state * ahead) / h
        moving = (*accelerations, *rate_of.values())
        to_next = {rate: (s - n) / h for rate, (n, s) in zip(moving, later.items(), strict=True)}
    else:
        stepped: dict[sympy.Symbol, Any] = dict(zip(observer.states, state_values + h * rate_values, strict=True))
        stepped |= {x: x + h * v for x, v in position_rate.items()}
        later = {symbol(f"{v.name}_next"): v for v in system.velocities}
        if (
            observer.euler is not None
        ):  # v̂ = v must stay an equilibrium: the plant's mean velocity over the sample moves Γ x
            change = sympy.Matrix([stepped[z] for z in observer.states[: len(later)]])
            known = (observer.equations[0].expression - observer.equations[0].state).xreplace(stepped)
            held = sympy.Matrix(list(later)) - known + change - change.xreplace(zero)
            stepped |= dict(zip(observer.states, held, strict=False))
        stepped |= {v: name for name, v in later.items()}
        next_estimates = estimates.xreplace(stepped)
        sampled = (-jacobian(next_estimates, e).xreplace(zero) - sympy.eye(len(e))) / h if step else none
        to_next = {a: (n - v) / h for a, (n, v) in zip(accelerations, later.items(), strict=True)}
    sampled = sampled.xreplace(carried).xreplace(to_next)
    slips = {**signs_of_slip, **_slip_signs(observer, {v: n for n, v in later.items()})}
    flowing = each(slope_of_flow.xreplace(carried), lambda x: _tidy(x, slips, observer.signs))
    stepping = each(sampled, lambda x: _tidy(_speeds_as_slips(x, slips), slips, observer.signs))
    in_step = stepping.free_symbols
    either = flowing.free_symbols | in_step
    used = {s: ij for s, ij in inverse_names.items() if s in either}
    slopes = {s: e for s, e in slopes.items() if s in either}
    return ErrorDynamics(observer, flowing, stepping, used, {n: v for n, v in later.items() if n in in_step}, slopes)


def _true_state_rates(observer: Observer, values: Mapping[sympy.Symbol, Any], zero: Any) -> dict[sympy.Symbol, Any]:
    """True friction state → its rate ξ at the truth, a symbol."""
    rates = next((e.symbols for e in observer.equations if e.name == "friction_state_rate"), ())
    of_state = [e.truth for e in observer.errors if e.of == "state"]
    return {f: values[r].xreplace(zero) for f, r in zip(of_state, rates, strict=True)}


def _first_order(
    value: Any,
    function: LawFunction,
    values: Mapping[sympy.Symbol, Any],
    zero: Mapping[sympy.Symbol, Any],
    slips: Mapping[Any, sympy.Symbol],
    slopes: dict[sympy.Symbol, Any],
    longest: int,
) -> Any:
    """A law at the estimates: value at the truth plus slopes times errors; longer terms become symbols."""
    at = {s: values[s].xreplace(zero) for s in function.arguments.values()}

    def written(label: str, expression: Any) -> Any:
        plain = expression.xreplace(at)
        plain = plain.replace(Sgn, lambda u: _sign(sympy.expand(u), slips))
        if int(sympy.count_ops(plain)) <= longest and not (longest == 0 and label.startswith("xi")):
            return plain
        slopes[symbol(label)] = plain
        return symbol(label)

    total = written(function.label, value)
    for letter, s in function.arguments.items():
        total += written(function.slope_label(letter), value.diff(s)) * (values[s] - at[s])
    return total


def _estimates_of_state(observer: Observer) -> Matrix:
    """The estimates whose errors are e, as functions of z, x and v only."""
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


def _slip_signs(observer: Observer, rename: Mapping[sympy.Symbol, sympy.Symbol]) -> dict[Any, sympy.Symbol]:
    """Slip expression → its sign symbol."""
    slips = observer.system.slip_velocity.xreplace(rename)
    return {sympy.expand(u): s for u, s in zip(slips, observer.signs, strict=True)}


def _tidy(expression: Any, slips: Mapping[Any, sympy.Symbol], signs: tuple[sympy.Symbol, ...]) -> Any:
    """Signs of slips as ±1 symbols, u·sgn(u) as |u|, products expanded."""
    expression = expression.replace(lambda e: e.func in (Sgn, Magnitude), lambda e: e.func(sympy.expand(e.args[0])))
    expression = expression.replace(Sgn, lambda u: _sign(sympy.expand(u), slips))
    expression = drop_squares(expand_products(expression), signs)
    for atom in list(expression.atoms(Sgn)):
        u = atom.args[0]
        expression = expand_products(expression.subs(u * atom, Magnitude(u)))
    return expression


def _speeds_as_slips(expression: Any, slips: Mapping[Any, sympy.Symbol]) -> Any:
    """Replace |u| by s·u for slips, whose sign is constant between reversals; terms of neighbouring samples cancel."""

    def speed(u: Any) -> Any:
        sign = _sign(sympy.expand(u), slips)
        return Magnitude(u) if sign.has(Sgn) else sign * u

    return expression.replace(Magnitude, speed)


def _sign(u: Any, slips: Mapping[Any, sympy.Symbol]) -> Any:
    if u in slips:
        return slips[u]
    if sympy.expand(-u) in slips:
        return -slips[sympy.expand(-u)]
    return Sgn(u)
