"""Is a printed formula the derived one? Compared exactly at random rational points, like any polynomial identity."""

from __future__ import annotations

from typing import Any

import sympy

from codegen.thesis.audit.claim import Claim
from codegen.thesis.audit.finding import Finding
from codegen.thesis.audit.formula import Misfit, as_matrix, as_text, evaluate, inequalities
from codegen.thesis.audit.points import exactly, points
from codegen.thesis.audit.world import Derived, World, form_value, readable

POINTS = 3
PRINTABLE = 14
NEGLIGIBLE = sympy.Rational(1, 10**35)


def judge_equality(claim: Claim, world: World, derived: Derived) -> Finding:
    """``holds`` if the printed formula equals the derived value at every point, else ``wrong`` with a point."""
    steady = dict.fromkeys(world.steady, sympy.S.Zero) if claim.entry.constant_U else {}
    value = derived.value.xreplace(steady) if steady else derived.value
    right = as_text(readable(Derived(value, derived.form)))
    try:
        printed = as_matrix(evaluate(claim.entry.printed, world.names, claim.place)).xreplace(steady)
    except Misfit:
        return Finding(claim, "wrong", right, None, "the shapes of its matrices do not fit")
    if printed.has(sympy.zoo, sympy.nan):
        return Finding(claim, "wrong", right, None, "it inverts a matrix whose determinant is identically zero")
    if printed.shape != value.shape:
        evidence = f"shape {printed.shape[0]} by {printed.shape[1]}, derived {value.shape[0]} by {value.shape[1]}"
        return Finding(claim, "wrong", right, None, evidence)
    given = [pair for text in claim.entry.given for pair in inequalities(text, world.names, claim.place)]
    point = difference_point(printed, value, world, given)
    if point is None:
        return Finding(claim, "holds", right)
    evidence = ""
    if world.steady and not steady:
        zero = dict.fromkeys(world.steady, sympy.S.Zero)
        same = difference_point(printed.xreplace(zero), value.xreplace(zero), world, given) is None
        evidence = "holds where U is constant" if same else "differs where U is constant, too"
    return Finding(claim, "wrong", right, _numbers(printed, value, point), evidence)


def difference_point(printed: Any, value: Any, world: World, given: Any) -> dict[Any, Any] | None:
    """A point at which the two differ, or None."""
    symbols = printed.free_symbols | value.free_symbols | {s for e, _ in given for s in e.free_symbols}
    for point in points(symbols, world, given, seed=1, count=POINTS):
        for a, b in zip(printed, value, strict=True):
            if a != b and not same_number(exactly(a, point), exactly(b, point)):
                return point
    return None


def same_number(a: Any, b: Any) -> bool:
    """Exactly for rationals, to 35 digits otherwise."""
    if a.is_Rational and b.is_Rational:
        return bool(a == b)
    return bool(abs(a - b) <= NEGLIGIBLE * (1 + abs(a) + abs(b)))


def plain_number(value: Any) -> int | float:
    """A number for JSON."""
    return int(value) if value.is_Integer else float(f"{float(value):.10g}")


def _numbers(printed: Any, value: Any, point: dict[Any, Any]) -> dict[str, Any] | None:
    for a, b in zip(printed, value, strict=True):
        ours, theirs = exactly(b, point), exactly(a, point)
        if not same_number(ours, theirs):
            used = {s: x for s, x in point.items() if s in a.free_symbols | b.free_symbols}
            if len(used) > PRINTABLE:
                return None
            numbers = {s.name: plain_number(x) for s, x in used.items()}
            return {**numbers, "printed": plain_number(theirs), "derived": plain_number(ours), "eigenvalue": None}
    return None


def prove_form(derived: Derived, world: World) -> None:
    """The form that will be shown says what was derived.

    Raises:
        ArithmeticError: if it does not; a fault of the derivation, not of the thesis.
    """
    form = as_matrix(form_value(derived, world.names))
    if form.shape != derived.value.shape or difference_point(form, derived.value, world, []) is not None:
        raise ArithmeticError(f"the form `{as_text(derived.form)}` is not what was derived")
