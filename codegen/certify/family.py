"""The sampled error matrix A as a multi-affine family: A(θ), with each parameter θ in an interval over the envelope.

Each varying expression in A (a term of M⁻¹(x), a slope ∂g/∂v, the sign of a slip) is one parameter. An expression that
occurs in several entries is the same parameter in all of them, so that it has one value there. A is affine in each
parameter; a term may be a product of several.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations, permutations, product
from typing import Any

import sympy

from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.polynomials import expand_products
from codegen.certify.certificate_text import fraction, to_prefix
from codegen.checker import verify
from codegen.mechanics.computed import ComputedEntry
from codegen.mechanics.system import Matrix
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

LARGEST_INVERSE = 3
"""Largest order of a varying mass matrix that is inverted symbolically."""
PI = symbol("pi_")
"""Variable that stands for π, in the interval [``PI_LOW``, ``PI_LOW`` + 10⁻²⁰]."""
PI_LOW = sympy.Rational("3.14159265358979323846")
"""π to 20 decimals, rounded down."""


class NotEnclosable(Exception):
    """Error: a certificate cannot express or enclose the error matrix; the message gives the reason."""


@dataclass(frozen=True)
class Family:
    """A family of error matrices A(θ), where the parameters θ are expressions in variables with ranges.

    Attributes:
        variables: variable → (low, high), exact.
        parameters: parameter → its expression in the variables, with exact numbers.
        matrix: A, m by m, multi-affine in the parameters, with exact numbers.
        bounded: variable in [−1, 1] → the sgn or tanh that it replaces.
    """

    variables: Mapping[sympy.Symbol, tuple[Any, Any]]
    parameters: Mapping[sympy.Symbol, Any]
    matrix: Matrix
    bounded: Mapping[sympy.Symbol, Any] = field(default_factory=dict)

    def at(self, point: Mapping[sympy.Symbol, Any]) -> Matrix:
        """A at a point: variable → value."""
        known = dict(point)
        return Matrix(self.matrix.xreplace({s: e.xreplace(known) for s, e in self.parameters.items()}))


def build_family(dynamics: ErrorDynamics, ranges: Mapping[sympy.Symbol, tuple[Any, Any]]) -> Family:
    """The family of sampled error matrices: numbers in place of constants, a parameter for each varying expression.

    Args:
        ranges: variable → (low, high), exact.

    Raises:
        NotEnclosable: for a varying mass matrix of an order above 3, for a function that certificates do not have, and
            for M(x) or forces that are computed numerically from a robot file.
    """
    observer = dynamics.observer
    # Numbers in place of constants, slips as variables, |u| in place of s u.
    numbers = {**observer.values, sympy.Symbol("h", real=True): observer.sample_time}
    matrix = dynamics.in_force(dynamics.sampled).xreplace(numbers)
    if matrix.has(ComputedEntry) or (dynamics.inverse_mass and observer.system.mass_matrix.has(ComputedEntry)):
        raise NotEnclosable("the mass matrix or the force comes from a robot file and has no formula")
    matrix, slips = _in_slips(matrix, dynamics, ranges)
    matrix = matrix.applyfunc(expand_products)
    ranges = {**ranges, **slips}
    sign_of = {u: s for u, s in zip(observer.system.slip_velocity, observer.signs, strict=True) if u.is_Symbol}
    sign_of |= {c.slip: s for c, s in zip(observer.system.contacts, observer.signs, strict=True) if c.slip in slips}
    sign_of |= {n: sign_of[v] for n, v in dynamics.next_velocity.items() if v in sign_of}
    matrix = matrix.applyfunc(lambda e: signed_slips(e, sign_of))
    moved = {x: ends for x, ends in ranges.items() if x not in observer.system.positions}
    matrix = matrix.applyfunc(lambda e: small_differences(e, moved))
    # Parameters for M⁻¹(x) and for the slopes of the force; sgn and tanh become variables in [−1, 1].
    inverse, varying = _inverse_mass(dynamics, numbers)
    bounded: dict[Any, sympy.Symbol] = {}
    varying |= {s: _bounded_functions(e.xreplace(numbers), bounded, ranges) for s, e in dynamics.slopes.items()}
    matrix = matrix.xreplace({**inverse, sympy.pi: PI})
    varying = {w: e.xreplace({sympy.pi: PI}) for w, e in varying.items()}
    matrix = matrix.applyfunc(lambda e: _bounded_functions(e, bounded, ranges))

    # Parameters for all other varying factors, and for signs.
    matrix, parameters = _varying_factors(matrix, {*varying, *observer.signs}, ranges)
    parameters |= {w: e for w, e in varying.items() if matrix.has(w)}
    signs = {s: symbol(f"sign_{s.name}") for s in observer.signs if matrix.has(s)}
    parameters |= {name: s for s, name in signs.items()}
    matrix = matrix.xreplace(signs)

    # The variables on which the parameters depend, with their ranges.
    bounds = {s: (sympy.Integer(-1), sympy.Integer(1)) for s in (*bounded.values(), *observer.signs)}
    bounds = {**ranges, **bounds, PI: (PI_LOW, PI_LOW + sympy.Rational(1, 10**20))}
    used = {v for e in parameters.values() for v in e.free_symbols}
    variables = {v: bounds[v] for v in sorted(used & bounds.keys(), key=lambda v: str(v.name))}
    return Family(variables, parameters, matrix, {s: e for e, s in bounded.items()})


def _varying_factors(
    matrix: Matrix, known: set[sympy.Symbol], ranges: Mapping[sympy.Symbol, Any]
) -> tuple[Matrix, dict[sympy.Symbol, Any]]:
    """(A with parameters in place of its varying factors, parameter → expression); equal factors share a parameter.

    Each term becomes number · known parameters · irrational constants · varying rest. An irrational constant, such as
    exp(−hK_v), is a parameter of its own, so that terms with it cancel.
    """
    names: dict[Any, sympy.Symbol] = {}
    prefix = "theta"
    while any(v.name.startswith(prefix) for v in ranges):
        prefix += "_"  # the spec may have a coordinate of the name theta1

    def name_of(expression: Any) -> sympy.Symbol:
        return names.setdefault(expression, symbol(f"{prefix}{len(names) + 1}"))

    def replaced(entry: Any) -> Any:
        total = sympy.Integer(0)
        for term in sympy.Add.make_args(expand_products(entry)):
            coefficient, rest = term.as_coeff_Mul()
            varying = sympy.Integer(1)
            for factor in sympy.Mul.make_args(rest):
                if factor in known or factor.is_Rational:
                    coefficient *= factor
                elif not factor.free_symbols:
                    coefficient *= name_of(factor)
                else:
                    varying *= factor
            total += coefficient * (name_of(varying) if varying != 1 else 1)
        return total

    return matrix.applyfunc(replaced), {name: expression for expression, name in names.items()}


def _inverse_mass(
    dynamics: ErrorDynamics, numbers: Mapping[Any, Any]
) -> tuple[dict[sympy.Symbol, Any], dict[sympy.Symbol, Any]]:
    """(symbol of W_ij → linear combination of parameters, parameter → its expression), W = M⁻¹ = adj(M)/det(M).

    Each different term of adj(M), divided by det(M), is one parameter; entries of W that have a term in common share
    its parameter. The entries of a constant M⁻¹ are numbers, without parameters.
    """
    if not dynamics.inverse_mass:
        return {}, {}
    mass = dynamics.observer.system.mass_matrix.subs(numbers)
    n = mass.rows
    if mass.free_symbols and n > LARGEST_INVERSE:
        raise NotEnclosable(
            f"the mass matrix varies with position and is {n} by {n}, and certificates cover up to"
            f" {LARGEST_INVERSE} by {LARGEST_INVERSE}"
        )
    if not mass.free_symbols:
        exact = mass.inv()
        return {w: exact[i, j] for w, (i, j) in dynamics.inverse_mass.items()}, {}
    determinant = sympy.expand(mass.det(method="berkowitz"))
    adjugate = mass.adjugate().applyfunc(sympy.expand)
    names: dict[Any, sympy.Symbol] = {}
    inverse: dict[sympy.Symbol, Any] = {}
    for w, (i, j) in dynamics.inverse_mass.items():
        total = sympy.Integer(0)
        for term in sympy.Add.make_args(adjugate[i, j]):
            coefficient, rest = term.as_coeff_Mul()
            total += coefficient * names.setdefault(rest, symbol(f"inertia{len(names) + 1}"))
        inverse[w] = total
    return inverse, {s: rest / determinant for rest, s in names.items()}


def _in_slips(
    matrix: Matrix, dynamics: ErrorDynamics, ranges: Mapping[sympy.Symbol, tuple[Any, Any]]
) -> tuple[Matrix, dict[sympy.Symbol, tuple[Any, Any]]]:
    """(A with slip velocities u as variables, slip velocity → its range): of u = v1 − v2, v1 is replaced by u + v2.

    Expressions in v1 − v2 thus become expressions in u alone. Interval arithmetic would treat v1 and v2 as independent
    and overestimate their difference.
    """
    system = dynamics.observer.system
    bounds: dict[sympy.Symbol, tuple[Any, Any]] = {}
    for contact, slip in zip(system.contacts, system.slip_velocity, strict=True):
        velocities = sorted(slip.free_symbols, key=str)
        known = all(v in system.velocities and v in ranges and matrix.has(v) for v in velocities)
        pivot = next((v for v in velocities if abs(slip.coeff(v)) == 1), None)
        if len(velocities) < 2 or pivot is None or not known:
            continue
        rest = sympy.expand(slip - slip.coeff(pivot) * pivot)
        matrix = Matrix(matrix.subs(pivot, (contact.slip - rest) / slip.coeff(pivot)))
        bounds[contact.slip] = range_of(slip, ranges)
    return matrix, bounds


def range_of(x: Any, box: Mapping[sympy.Symbol, tuple[Any, Any]]) -> tuple[Any, Any]:
    """(min, max) of a linear expression over a box, attained at vertices."""
    inside = sorted(x.free_symbols, key=str)
    ends = [x.xreplace(dict(zip(inside, corner, strict=True))) for corner in product(*(box[v] for v in inside))]
    return min(ends), max(ends)


def signed_slips(entry: Any, sign_of: Mapping[sympy.Symbol, sympy.Symbol]) -> Any:
    """The entry with s u replaced by |u| for each slip u with sign s, in denominators too.

    Interval arithmetic would treat s and u as independent, and s u could be negative.
    """
    divisors = [p for p in entry.atoms(sympy.Pow) if p.exp.is_negative and not p.base.is_Symbol]
    entry = entry.subs({p: signed_slips(p.base, sign_of) ** p.exp for p in divisors})
    total = sympy.Integer(0)
    for term in sympy.Add.make_args(expand_products(entry)):
        for u, s in sign_of.items():
            if {s, u} <= {*sympy.Mul.make_args(term)}:
                term = term / (s * u) * Magnitude(u)
        total += term
    return total


def small_differences(entry: Any, ranges: Mapping[sympy.Symbol, tuple[Any, Any]]) -> Any:
    """The expanded entry with products in place of differences of sines, or of cosines, of angles that are close:

        cos a − cos b = −2 sin((a − b)/2) sin((a + b)/2),    sin a − sin b = 2 sin((a − b)/2) cos((a + b)/2)

    A distribution U(x) gives (cos(x + hv) − cos x)/h. Interval arithmetic would treat both cosines as independent: the
    difference could then be as large as 2/h, and on cells of width d still d/h; the product is at most |v|.

    Of c cos a − d cos b, c > d > 0, that is d times the difference, and (c − d) cos a.

    Args:
        ranges: variable other than a position → (low, high); a and b are close if a − b is linear in these, ±1 at most.
    """
    every = sorted(entry.atoms(sympy.sin, sympy.cos), key=str)
    close = {
        (f, g) for f, g in permutations(every, 2) if f.func is g.func and _within_one(f.args[0] - g.args[0], ranges)
    }
    if not close:
        return entry
    terms = [*sympy.Add.make_args(expand_products(entry))]
    products = []
    for i, j in combinations(range(len(terms)), 2):
        for f, g in product(_waves(terms[i]), _waves(terms[j])):
            one, other = terms[i] / f, terms[j] / g
            ratio = -one / other if (f, g) in close else sympy.Integer(0)
            if ratio.is_Rational and ratio > 0:
                apart, middle = ((f.args[0] + way * g.args[0]) / 2 for way in (-1, 1))
                slope = sympy.cos(middle) if f.func is sympy.sin else -sympy.sin(middle)
                shared = min(ratio, 1) / ratio * one
                products.append(2 * shared * sympy.sin(apart) * slope)
                terms[i], terms[j] = terms[i] - shared * f, terms[j] + shared * g
                break
    return sympy.Add(*terms, *products)


def _waves(term: Any) -> list[Any]:
    """The sines and cosines of which a product has a whole power above 0 as a factor, sorted."""
    powers = term.as_powers_dict().items()
    return sorted((f for f, n in powers if f.func in (sympy.sin, sympy.cos) and n.is_Integer and n > 0), key=str)


def _within_one(x: Any, ranges: Mapping[sympy.Symbol, tuple[Any, Any]]) -> bool:
    """Whether an expression is linear in variables with ranges, and within −1 and 1 there."""
    inside = x.free_symbols
    if not inside or not inside <= {*ranges} or any(x.diff(v).free_symbols for v in inside):
        return False
    low, high = range_of(sympy.expand(x), ranges)
    return bool(low >= -1 and high <= 1)


def _bounded_functions(entry: Any, bounded: dict[Any, sympy.Symbol], ranges: Mapping[sympy.Symbol, Any]) -> Any:
    """The entry with a variable in [−1, 1] in place of each sgn and tanh; a sgn that is constant becomes ±1.

    New variables are added to ``bounded``, by the expression that they replace.
    """
    if entry.has(sympy.log):
        raise NotEnclosable("the slope of the force contains a logarithm, which a certificate cannot state")
    for atom in sorted(entry.atoms(Sgn, sympy.tanh), key=str):
        sign = _known_sign(atom.args[0], ranges) if atom.func is Sgn else 0
        if sign:
            entry = entry.subs(atom, sign)
        else:
            bounded.setdefault(atom, symbol(f"bounded{len(bounded) + 1}"))
    return entry.subs(bounded)


def _known_sign(argument: Any, ranges: Mapping[sympy.Symbol, tuple[Any, Any]]) -> int:
    """Sign of an expression on the ranges, 1 or −1, by interval arithmetic; 0 if it may change."""
    if not argument.free_symbols <= set(ranges):
        return 0
    box = {s.name: (fraction(low), fraction(high)) for s, (low, high) in ranges.items()}
    try:
        low, high = verify.parse(to_prefix(argument), box, "sign")[1](box)
    except (verify.Refused, TypeError):
        return 0
    return 1 if low > 0 else -1 if high < 0 else 0
