"""The decay of V = e'Pe for the matrix of a certificate, or the proof that no V decays so fast, by the kernel.

Standard library only; part of the checker (verify.py), which passes ``enclosure``, ``forms`` and ``kernel`` in. The
matrix is the certificate's own; nothing is said here about code. It is a polynomial in variables that are in a box:

- without `cover`, in the parameters, each in its enclosure over a cell of the variables. It is affine in each, so that
  its Bernstein coefficients are its values at the vertices of this box;
- with `cover`, in the variables themselves, and in their sines and cosines. Those of one angle are treated as
  dependent, which the vertices of a box of both would not do.
"""

from collections.abc import Callable, Mapping
from fractions import Fraction
from itertools import product
from math import prod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import enclosure, forms, frame, kernel

MAX_VERTICES, MAX_TOTAL = 4096, 200_000  # of a cell, and of all cells
MOST_FACTORS = 100  # of a product of names: a power of a power of a power would fill the memory
FUNCTIONS = {"sin": "sin", "cos": "cos", "exp": "exp", "abs": "fabs"}
Interval = tuple[Fraction, Fraction]


def polynomials(known: dict[Any, Any], enclosed: bool = False) -> Callable[[str, list[Any], str], Any]:
    """The operations of enclosure.parse on polynomials: sums, products, quotients, powers and FUNCTIONS.

    Args:
        known: the reciprocals and angles so far, as of kernel.Text.
        enclosed: whether the exp, sine or cosine of a number may be the kernel's decimal: where the claim is verified
            for all that it can be in its enclosure, in which the decimal then has to be.
    """

    def operate(op: str, args: list[Any], where: str) -> Any:
        first, *others = args
        if op == "number":
            return kernel.term(first)
        if op in FUNCTIONS:
            number = op != "abs" and first and not first.names()
            kernel.demand(enclosed or not number, f"{where}: {op} of a number")
            done = kernel.function(FUNCTIONS[op], first, known)
            if number:
                low, high = enclosure.apply(op, [(first.constant(), first.constant())], where)
                kernel.demand(low <= done.constant() <= high, f"{where}: a decimal beyond the enclosure of its {op}")
            return done
        kernel.demand(op in ("+", "*", "neg", "/", "^"), f"{where}: no {op} of polynomials")
        kernel.demand(op != "/" or others[0], f"{where}: divisor from 0 to 0")
        if op == "^":
            first, others = kernel.term(1), [first] * int(others[0].constant())
        elif op in ("/", "neg"):
            others = [kernel.function("1/", others[0], known) if op == "/" else kernel.term(-1)]
        for other in others:
            first = first + other if op == "+" else first * other
            kernel.demand(all(len(m) < MOST_FACTORS for m in first), "a power is too high")
            longest = max((max(abs(c.numerator), c.denominator) for c in first.values()), default=0)
            kernel.demand(longest < enclosure.TOO_LONG, "a number is too long")  # a power could fill the memory
        return first

    return operate


def read(top: dict[str, Any]) -> tuple[dict[str, Any], list[list[Any]]]:
    """The parameters of a certificate, over its variables, and its matrix over these, as of enclosure.parse."""
    thetas = {e["name"]: enclosure.parse(e["expression"], top["variables"], e["name"]) for e in top["parameters"]}
    return thetas, [[enclosure.parse(entry, thetas, f"matrix[{i}][{j}]", affine=True) for j, entry in enumerate(row)]
                    for i, row in enumerate(top["matrix"])]  # fmt: skip


def step(top: dict[str, Any], names: Mapping[str, Any], operate: Any) -> list[list[Any]]:
    """I + hA of a certificate (as verify.parsed gives it), by ``polynomials``, over these names for its variables."""
    thetas, A = read(top)
    return moved(top, A, {x: value(names, operate) for x, (_, value) in thetas.items()}, operate)


def moved(top: dict[str, Any], A: list[list[Any]], at: Mapping[str, Any], operate: Any) -> list[list[Any]]:
    """I + hA at these values of its parameters."""
    h, same = kernel.term(top["sample_time"]), [kernel.term(0), kernel.term(1)]
    rates = [[value(at, operate) for _, value in row] for row in A]
    return [[same[i == j] + h * p if p else same[i == j] for j, p in enumerate(row)] for i, row in enumerate(rates)]


def require_fall(top: dict[str, Any], axes: dict[str, list[Interval]], fall: Fraction) -> str:
    """That V is multiplied by at most ``fall`` in a sample, or with `along` that no V is; or enclosure.Refused.

    Args:
        axes: variable -> its intervals.

    Returns:
        Words that say for how many matrices.
    """
    thetas, A = read(top)
    used, cells = {name for row in A for names, _ in row for name in names}, prod(map(len, axes.values()))
    each = max(1, len(axes), len(used))
    enclosure.demand(cells * each <= MAX_TOTAL, f"{cells} cells of {each} names, more than {MAX_TOTAL} in all")
    grid = [dict(zip(axes, ends, strict=True)) for ends in product(*axes.values())]
    boxes: list[dict[str, Interval]] = [{} for _ in grid if not top["cover"]]
    for x in used if boxes else ():  # a parameter is evaluated once for all cells that differ in other variables only
        names, value = thetas[x]
        ends = {
            at: enclosure.widen(*value(dict(zip(names, at, strict=True)))) for at in product(*[axes[n] for n in names])
        }
        for cell, box in zip(grid, boxes, strict=True):
            box[x] = ends[tuple(cell[n] for n in names)]
    counts = [2 ** sum(low < high for low, high in box.values()) for box in boxes]
    most, total = max(counts, default=0), sum(counts)
    fault = f"{most} vertices in a cell, {total} in all, more than {MAX_VERTICES} or {MAX_TOTAL}"
    enclosure.demand(most <= MAX_VERTICES and total <= MAX_TOTAL, fault)
    if top["along"]:
        enclosure.demand(cells == 1, "a refutation is of one point: no splits")
        refutes(top, [[value(boxes[0]) for _, value in row] for row in A], fall)
        return "at one point"
    (tree,) = top["cover"] or ("",)
    for cell, box in zip(grid, boxes or grid, strict=True):
        known: dict[Any, Any] = {}
        try:
            if top["cover"]:
                F = step(top, {x: kernel.term(1, x) for x in box}, polynomials(known))
            else:  # a parameter of one value is a number
                point = {x: kernel.term(low) for x, (low, high) in box.items() if low == high}
                F = moved(top, A, {x: kernel.term(1, x) for x in box} | point, polynomials(known))
            decreases(top, F, fall, box, tree, known)
        except (ArithmeticError, LookupError, TypeError, ValueError) as why:
            at = "".join(f", {x} in [{enclosure.show(low)}, {enclosure.show(high)}]" for x, (low, high) in cell.items())
            raise enclosure.Refused(f"V is not shown to fall{at}: {str(why)[:200]}") from None
    if top["cover"]:
        return f"every coefficient of {leaves(tree)} cell{'s' * (tree != '')}"
    corners = "1 corner matrix" if total == 1 else f"{total} corner matrices"
    return f"at {corners} of {cells} part{'s' * (cells > 1)} of the operating region"


@frame.limited()
def decreases(top: dict[str, Any], F: list[list[Any]], fall: Fraction, box: Any, tree: Any, known: Any) -> None:
    """Raises ValueError unless V(F e) <= fall V(e) in the box; or, for an implicit step, V((2 - F)^-1 e) so.

    There E = 2 - F = I - hA and fall = 1/s^2: 0 <= (E - s)'P(E - s) gives E'PE >= s (E'P + PE) - s^2 P, which is at
    least s^2 P if E'P + PE >= 2s P. That is affine in E.
    """
    for p in divisors(known):
        kernel.semidefinite([[p]], box, tree, known, kernel.LEAST)
    P = [[kernel.term(x) for x in row] for row in top["lyapunov_matrix"]]
    if top["observer"]["integration"] != "implicit":
        kernel.contracts(F, P, fall, box, tree, known)
        return
    s = 1 + top["decay_rate"] * top["sample_time"]
    PE = forms.product(P, opposite(F), kernel.Poly())
    gap = [[a + b - kernel.term(2 * s) * p for a, b, p in zip(*rows, strict=True)]
           for rows in zip(PE, zip(*PE, strict=True), P, strict=True)]  # fmt: skip
    kernel.semidefinite(gap, box, tree, known)


def opposite(F: list[list[Any]]) -> list[list[Any]]:
    """I - hA, of I + hA."""
    return [[kernel.term(2 * (i == j)) - p for j, p in enumerate(row)] for i, row in enumerate(F)]


def refutes(top: dict[str, Any], A: list[list[Interval]], fall: Fraction) -> None:
    """Raises Refused unless fall P > F'PF for every A in these intervals; P/fall < E'PE for an implicit step.

    If F (or E) is that of the middles and R the most that another one differs from it, x'F'PFx differs from that of the
    middles by at most |x|'(2 |PF|'R + R'|P|R)|x|: at most the largest sum of a row of this, made symmetric, times x'x.
    """
    h, P, size = top["sample_time"], top["lyapunov_matrix"], range(len(A))
    way, factor = (-1, 1 / fall) if top["observer"]["integration"] == "implicit" else (1, fall)
    F = [[(i == j) + way * h * sum(A[i][j]) / 2 for j in size] for i in size]
    R = [[abs(h) * (high - low) / 2 for low, high in row] for row in A]
    PF = forms.product(P, F, 0)
    square, crossed, own = (
        forms.product([*zip(*X, strict=True)], Y, 0)
        for X, Y in ((F, PF), (magnitudes(PF), R), (R, forms.product(magnitudes(P), R, 0)))
    )
    sums = [sum(crossed[i][j] + crossed[j][i] + own[i][j] for j in size) for i in size]
    gap = [[way * (factor * P[i][j] - square[i][j]) - (i == j) * max(sums) for j in size] for i in size]
    whole = tuple(map(tuple, kernel.integers(gap)[0]))
    enclosure.demand(kernel.positive(whole, True), "that no V with P > 0 falls so fast is not shown")


def magnitudes(X: Any) -> list[list[Any]]:
    return [[*map(abs, row)] for row in X]


def divisors(known: dict[Any, Any]) -> list[Any]:
    """What was divided by, each to be shown to be positive."""
    return [p for name, p in [*known] if name == "1/"]


def leaves(tree: Any) -> int:
    return 1 if tree == "" else leaves(tree[2]) + leaves(tree[3])
