"""A counterexample in exact numbers: an operating point at which the sampled error is unstable."""

from __future__ import annotations

from fractions import Fraction

import sympy

from codegen.analysis.analysis import Analysis
from codegen.analysis.polynomials import characteristic_polynomial
from codegen.mechanics.computed import ComputedEntry


def unstable_point(analysis: Analysis) -> dict[str, str] | None:
    """The worst sampled point as rationals, if I + hA is proved unstable there; else None.

    Where A is rational at the point the proof is exact: the polynomial of I + hA fails the Jury table in rationals. A
    point where A holds sines or roots is not given as proved.
    """
    dynamics = analysis.dynamics
    observer = dynamics.observer
    point = {name: sympy.Rational(str(round(value, 6))) for name, value in analysis.worst.items()}
    values = {**observer.values, sympy.Symbol("h", real=True): observer.sample_time}
    values |= {s: point[s.name] for s in analysis.points.variables}
    matrix = dynamics.in_force(dynamics.sampled).subs(dynamics.slopes).subs(values)
    if dynamics.inverse_mass:
        mass = observer.system.mass_matrix.subs(values)
        if mass.has(ComputedEntry):
            return None
        inverse = mass.inv()
        matrix = matrix.subs({w: inverse[i, j] for w, (i, j) in dynamics.inverse_mass.items()})
    if not all(e.is_Rational for e in matrix):
        return None
    unit, change = sympy.eye(matrix.rows), observer.sample_time * matrix
    if dynamics.implicit and (unit - change).det() == 0:
        return None
    step = (unit - change).inv() if dynamics.implicit else unit + change
    coefficients = [Fraction(int(c.p), int(c.q)) for c in characteristic_polynomial(step)]
    return {name: str(value) for name, value in point.items()} if not schur_stable(coefficients) else None


def schur_stable(coefficients: list[Fraction]) -> bool:
    """Whether all roots lie inside the unit circle: the Schur–Cohn (Jury) recursion in exact numbers.

    Args:
        coefficients: highest power first.
    """
    row = list(coefficients)
    while len(row) > 1:
        if abs(row[-1]) >= abs(row[0]):
            return False
        factor = row[-1] / row[0]
        row = [a - factor * b for a, b in zip(row[:-1], row[:0:-1], strict=True)]
    return True
