"""Verdicts on printed formulas and conditions, by comparison with our derivations at random rational points."""

import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import sympy

from codegen.analysis.conditions import reduce_conditions
from codegen.analysis.polynomials import characteristic_polynomial, routh_hurwitz
from codegen.base.errors import Place, refuse_unknown
from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.claim import Claim, Finding, Verdict, read_claims
from codegen.thesis.audit.derivation import (
    Derivations,
    Derived,
    Misfit,
    as_matrix,
    as_text,
    evaluate,
    inequalities,
    readable,
    tidy,
)
from codegen.thesis.audit.derivations import DERIVATIONS

DENOMINATORS = (1, 1, 2, 5, 10, 20, 100)
"""Denominators of random numbers: these are decimals with few digits, so that a point can be printed as it is."""
PATIENCE = 200
"""Most points that are drawn for each point that satisfies the given conditions."""
POINTS, TRIALS = 3, 2000
"""Number of points at which an equality is tested, and at which conditions are."""
PRINTABLE = 14
"""Most numbers of a counterexample that is printed."""
NEGLIGIBLE = sympy.Rational(1, 10**35)
"""Relative difference of numbers that are equal."""
CLEAR = 1e-3
"""Least distance of an eigenvalue or an inequality from zero at which its sign is tested exactly."""
NOT_SO = "not so at the counterexample"
"""What the table shows in place of the right formula for an inequality that is violated."""
VIOLATED: dict[str, Verdict] = {"inequality": "wrong", "implies": "insufficient"}
"""Test of a claim → the verdict if a point violates it."""
Condition = tuple[Any, bool]
"""An expression that must be positive, and whether strictly."""


def run_audit(progress: Callable[[float], None]) -> list[Finding]:
    """Judge all shipped claims; ``progress`` is called with the share that is done."""
    claims, findings = read_claims(), []
    for claim in claims:
        findings.append(judge(claim))
        progress(len(findings) / len(claims))
    return findings


def judge(claim: Claim) -> Finding:
    """The computed verdict on one claim.

    Raises BadInput for an unknown derivation, or a printed formula with unknown names.
    """
    if claim.test == "definition":
        return Finding(claim, "holds")
    name, _, quantity = claim.entry.against.partition(".")
    refuse_unknown(name, DERIVATIONS, claim.place, "no derivation", ", ".join(DERIVATIONS), code="CALL001")
    ours = derivations_of(name)
    if claim.test in ("inequality", "implies"):
        return judge_inequality(claim, ours)
    refuse_unknown(quantity, ours.derived, claim.place, f"`{name}` derives no", code="CALL001")
    derived = ours.derived[quantity]
    if claim.test == "equal":
        return judge_equality(claim, ours, derived)
    return judge_conditions(claim, ours, derived)


@cache
def derivations_of(name: str) -> Derivations:
    """What our derivation of that name gives, derived once; each closed form in it is proved first."""
    ours = DERIVATIONS[name]()
    for derived in ours.derived.values():
        if derived.form:
            form = as_matrix(evaluate(derived.form, ours.names, Place("the form of a derivation")))
            if form.shape != derived.value.shape or difference_point(form, derived.value, ours, []) is not None:
                raise ArithmeticError(f"the form `{as_text(derived.form)}` is not what was derived")
    return ours


def order(symbols: Iterable[Any]) -> list[Any]:
    """Symbols by name, so that a seed gives the same point in every process."""
    return sorted(symbols, key=lambda s: s.name)


def draw(symbols: Sequence[Any], ours: Derivations, generator: random.Random) -> dict[Any, Any]:
    """One point: a nonzero rational for each symbol, in its range."""
    point = {}
    for s in symbols:
        if s in ours.ranges:
            point[s] = sympy.sympify(generator.choice(ours.ranges[s]))
            continue
        value = sympy.Rational(generator.randint(1, 50), generator.choice(DENOMINATORS))
        point[s] = value if s in ours.positive or generator.random() < 0.5 else -value
    return point


def points(
    symbols: Iterable[Any], ours: Derivations, given: Sequence[Condition], seed: int, count: int
) -> Iterator[dict[Any, Any]]:
    """Up to ``count`` points at which every expression of ``given`` is positive (or not negative, where not strict)."""
    ordered, generator, found = order(symbols), random.Random(seed), 0
    tests = [(numeric(expression, ordered), strict) for expression, strict in given]
    for _ in range(count * PATIENCE):
        point = draw(ordered, ours, generator)
        values = [float(x) for x in point.values()]
        if all(test(*values) > 0 or (not strict and test(*values) == 0) for test, strict in tests):
            found += 1
            yield point
            if found == count:
                return


def numeric(expression: Any, symbols: Sequence[Any]) -> Any:
    """A fast float function of an expression or matrix."""
    return sympy.lambdify(list(symbols), expression, modules=[{"Sgn": np.sign, "Magnitude": np.abs}, "numpy"])


def exactly(expression: Any, point: Mapping[Any, Any]) -> Any:
    """The value at a point: rational if possible, else with 50 digits."""
    value = expression.xreplace(dict(point))
    if value.is_Rational:
        return value
    return sympy.N(value.replace(Magnitude, sympy.Abs).replace(Sgn, sympy.sign), 50)


def judge_equality(claim: Claim, ours: Derivations, derived: Derived) -> Finding:
    """``holds`` if the printed formula equals the derived value at every point, else ``wrong`` with a point."""
    steady = dict.fromkeys(ours.steady, sympy.S.Zero) if claim.entry.constant_U else {}
    value = derived.value.xreplace(steady) if steady else derived.value
    right = as_text(readable(Derived(value, derived.form)))
    try:
        printed = as_matrix(evaluate(claim.entry.printed, ours.names, claim.place)).xreplace(steady)
    except Misfit:
        return Finding(claim, "wrong", right, None, "the shapes of its matrices do not fit")
    if printed.has(sympy.zoo, sympy.nan):
        return Finding(claim, "wrong", right, None, "it inverts a matrix whose determinant is identically zero")
    if printed.shape != value.shape:
        evidence = f"shape {printed.shape[0]} by {printed.shape[1]}, derived {value.shape[0]} by {value.shape[1]}"
        return Finding(claim, "wrong", right, None, evidence)
    given = _conditions(claim, claim.entry.given, ours)
    point = difference_point(printed, value, ours, given)
    if point is None:
        return Finding(claim, "holds", right)
    evidence = ""
    if ours.steady and not steady:
        zero = dict.fromkeys(ours.steady, sympy.S.Zero)
        same = difference_point(printed.xreplace(zero), value.xreplace(zero), ours, given) is None
        evidence = "holds where U is constant" if same else "differs where U is constant, too"
    return Finding(claim, "wrong", right, _numbers(printed, value, point), evidence)


def difference_point(printed: Any, value: Any, ours: Derivations, given: Any) -> dict[Any, Any] | None:
    """A point at which the two differ, or None."""
    symbols = printed.free_symbols | value.free_symbols | {s for e, _ in given for s in e.free_symbols}
    for point in points(symbols, ours, given, seed=1, count=POINTS):
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


def _plain(point: Mapping[Any, Any]) -> dict[str, Any]:
    return {s.name: plain_number(x) for s, x in point.items()}


def _conditions(claim: Claim, texts: Sequence[str], ours: Derivations) -> list[Condition]:
    return [pair for text in texts for pair in inequalities(text, ours.names, claim.place)]


def _numbers(printed: Any, value: Any, point: dict[Any, Any]) -> dict[str, Any] | None:
    """The counterexample at the first entry that differs; None if it has too many symbols to be printed."""
    for a, b in zip(printed, value, strict=True):
        ours, theirs = exactly(b, point), exactly(a, point)
        if not same_number(ours, theirs):
            used = {s: x for s, x in point.items() if s in a.free_symbols | b.free_symbols}
            if len(used) > PRINTABLE:
                return None
            return {**_plain(used), "printed": plain_number(theirs), "derived": plain_number(ours), "eigenvalue": None}
    return None


def judge_conditions(claim: Claim, ours: Derivations, derived: Derived) -> Finding:
    """The verdict on printed conditions for the stability of a matrix, or for its negative definiteness.

    ``insufficient`` with a point that satisfies them at which the matrix is unstable; ``unnecessary`` with one that
    violates them at which it is stable; else ``holds``. A symmetric matrix is negative definite where it is stable.
    """
    matrix = derived.value
    if claim.test == "negative_definite":
        matrix = (matrix + matrix.T) / 2
    printed, given = _conditions(claim, claim.entry.printed, ours), _conditions(claim, claim.entry.given, ours)
    symbols = order({s for e in [matrix, *(e for e, _ in printed + given)] for s in e.free_symbols})
    right = "; ".join(_right_conditions(matrix, ours, given))
    matrix_at = numeric(matrix, symbols)

    def numbers(point: Mapping[Any, Any]) -> dict[str, Any]:
        return {**_plain(point), "eigenvalue": float(f"{_largest(matrix_at, point):.6g}")}

    def exact(point: Mapping[Any, Any]) -> list[Any]:
        """Coefficients and Hurwitz determinants: a negative one proves a root with positive real part."""
        return [value for _, value in routh_hurwitz(characteristic_polynomial(matrix.xreplace(point)))]

    for point in points(symbols, ours, given + printed, seed=2, count=TRIALS):
        if _largest(matrix_at, point) > CLEAR and any(value < 0 for value in exact(point)):
            return Finding(claim, "insufficient", right, numbers(point))
    for point in points(symbols, ours, given, seed=3, count=TRIALS):
        values = [(exactly(expression, point), strict) for expression, strict in printed]
        met = all(value > 0 or (not strict and value == 0) for value, strict in values)
        stable = not met and _largest(matrix_at, point) < -CLEAR
        if stable and all(value > 0 for value in exact(point)):
            return Finding(claim, "unnecessary", right, numbers(point))
    return Finding(claim, "holds", right)


def judge_inequality(claim: Claim, ours: Derivations) -> Finding:
    """``wrong`` with a point at which the given conditions hold and a printed inequality does not, else ``holds``.

    If the claim is that the given conditions imply it, the verdict is ``insufficient``.
    """
    printed, given = _conditions(claim, claim.entry.printed, ours), _conditions(claim, claim.entry.given, ours)
    symbols = order({s for e, _ in printed + given for s in e.free_symbols})
    quick = numeric([e for e, _ in printed], symbols)
    for point in points(symbols, ours, given, seed=4, count=TRIALS // 4):
        sizes = quick(*[float(x) for x in point.values()])
        for (expression, strict), size in zip(printed, sizes, strict=True):
            if size > CLEAR:
                continue
            value = exactly(expression, point)
            if value < 0 or (strict and value == 0):
                return Finding(claim, VIOLATED[claim.test], NOT_SO, {**_plain(point), "eigenvalue": None})
    return Finding(claim, "holds", "; ".join(claim.entry.printed))


def _largest(matrix_at: Any, point: Mapping[Any, Any]) -> float:
    """The largest real part of the eigenvalues of a matrix at a point; ``matrix_at``: its function of the symbols."""
    values = matrix_at(*[float(x) for x in point.values()])
    return float(np.linalg.eigvals(np.array(values, dtype=float)).real.max())


def _right_conditions(matrix: Any, ours: Derivations, given: list[Condition]) -> list[str]:
    """The Routh–Hurwitz conditions of a matrix in words, without factors that are known to be positive."""
    if matrix.shape == (1, 1):
        return [f"{tidy(-matrix[0])} > 0"]
    raw = routh_hurwitz(characteristic_polynomial(matrix))
    known = {e for e, strict in given if strict and e.is_Symbol} | set(ours.positive)
    reduced = [e for _, e in reduce_conditions(tuple(raw), frozenset(known))]
    return ["never"] if any(e.is_number for e in reduced) else [f"{sympy.factor(e)} > 0" for e in reduced]
