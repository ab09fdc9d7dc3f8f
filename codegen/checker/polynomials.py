"""Polynomials with rational coefficients, and whether a matrix of them is positive semidefinite on a box.

Standard library only; the algebra of the kernel (kernel.py), which reads the C, in a file of its own: it knows of no
machine and of no C. A quotient or an angle is no polynomial: a reciprocal, and a sine and cosine, are new variables
with an equation, and lemmas 5 and 6 say what these are worth.
"""

import re
from collections.abc import Callable
from fractions import Fraction
from itertools import product
from math import lcm, prod
from operator import mul
from typing import Any, ClassVar


def demand(holds: Any, why: str, steps: int = 0) -> None:
    Poly.work += steps  # each of about a microsecond, so that no file takes more than seconds
    if not holds or Poly.work > 5_000_000:
        raise ValueError("more work than the limit" if holds else why)


# LEMMA 1. A polynomial is {monomial: coefficient, not 0}, a monomial its names, sorted, each as often as its power. Two
# are the same real function just if they are the same here. A name of Poly.signs is 1 or -1: pairs of it are left out.
# Poly.divisors: what a reciprocal is one of, by its name; a later one may hold earlier reciprocals.
class Poly(dict[tuple[str, ...], Fraction]):
    signs, work = frozenset[str](), 0
    divisors: "ClassVar[dict[str, Poly]]"

    def after(self, steps: int) -> "Poly":
        bits = [(len(m), c.numerator.bit_length(), c.denominator.bit_length()) for m, c in self.items()]
        size = max((n + max(a, b) // 9 + abs(a - b) * 3 // 5 for n, a, b in bits), default=0)  # within normal doubles
        demand(size < 600, "a power or a coefficient is too large", steps * (9 + size) // 9)
        return self

    def __add__(self, other: "Poly") -> "Poly":
        terms = self | {m: self.get(m, 0) + c for m, c in other.items()}
        return Poly({m: c for m, c in terms.items() if c}).after(len(self) + len(other))

    def __sub__(self, other: "Poly") -> "Poly":
        return self + term(-1) * other

    def __mul__(self, other: "Poly") -> "Poly":
        terms: dict[tuple[str, ...], Fraction] = {}
        for (m, c), (n, d) in product(self.after(3 * len(self) * len(other)).items(), other.items()):
            key = tuple(sorted(x for x in m + n if not (x in self.signs and x in m and x in n)))
            terms[key] = terms.get(key, 0) + c * d
        return Poly({m: c for m, c in terms.items() if c}).after(0)

    def names(self) -> set[str]:
        return {name for m in self for name in m}

    def constant(self) -> Fraction:
        demand(not self.names(), f"{sorted(self.names())[:3]} in place of a number")
        return self.get((), Fraction(0))


Poly.divisors = {}
Matrix = list[list[Poly]]
Box = dict[str, tuple[Fraction, Fraction]]


def term(c: Any, *names: str) -> Poly:
    return Poly({names: Fraction(c)} if c else {})


def times(A: Any, B: Any) -> Matrix:
    columns = list(zip(*B, strict=True))
    return [[sum((a * b for a, b in zip(row, c, strict=True) if a and b), Poly()) for c in columns] for row in A]


# LEMMA 2. Let p be the first diagonal entry of a symmetric A, r the rest of its row, B what is left without both. If
# p > 0, A is positive semidefinite (definite) just if B - r r'/p is; if p = 0, semidefinite just if r = 0 and B is; if
# p < 0, never. Times p and over the last p, entries that are whole stay whole (Bareiss).
def positive(A: list[list[Any]], definite: bool = False) -> bool:
    bits = sum(x.denominator.bit_length() for row in A for x in row)
    demand([[*column] for column in zip(*A, strict=True)] == A, "a matrix is not symmetric", bits * bits // 10**6)
    common, last = lcm(*(x.denominator for row in A for x in row)), 1
    rest = [[int(x * common) for x in row] for row in A]
    while rest:
        (p, *r), *rest = rest
        demand(True, "", len(r) ** 2 * (1 + max(p, last, *map(abs, r)).bit_length() // 500) ** 2)
        if p < 0 or (p == 0 and (definite or any(r))):
            return False
        rest = [[(p * x - a * b) // last if p else x for x, b in zip(row, r, strict=True)] for a, *row in rest]
        last = p or last
    return True


def replaced(A: Matrix, x: str, above: Poly, below: Poly) -> Matrix:
    """A with above/below for x, times below to the highest power of x in A."""
    most = max((m.count(x) for row in A for p in row for m in p), default=0)
    powers = [prod([above] * n + [below] * (most - n), start=term(1)) for n in range(most + 1)]
    return A if not most else [
        [sum((Poly({tuple(y for y in m if y != x): c for m, c in p.items() if m.count(x) == n}) * powers[n]
              for n in range(most + 1)), Poly()) for p in row] for row in A]  # fmt: skip


# LEMMA 3. On a cell x = low s + high t with s and t >= 0, s + t = 1. Times powers of s + t each term has of s and t as
# many factors as any (Bernstein's form): A is the sum of products of such s and t, which are >= 0, times coefficients.
def coefficients(A: Matrix, cell: Box) -> list[list[list[int]]]:
    """Those of A, times one whole number > 0."""
    common = lcm(*(c.denominator for row in A for p in row for c in p.values()))
    parts = [[{(m, ()): int(c * common) for m, c in p.items()} for p in row] for row in A]
    for x in sorted({x for row in A for p in row for x in p.names()}):
        demand(x in cell, f"{x} without a range")
        most, q = max(m.count(x) for row in A for p in row for m in p), lcm(*(end.denominator for end in cell[x]))
        ends = [int(end * q) for end in cell[x]]
        powers = [spread([ends] * i + [[q, q]] * (most - i)) for i in range(most + 1)]
        parts = [[along(x, p, powers) for p in row] for row in parts]
    return [[[p.get(m, 0) for p in row] for row in parts] for m in {m for row in parts for p in row for m in p}]


def spread(factors: list[list[int]]) -> list[int]:
    """The coefficients of a product of forms a s + b t, from the highest power of s on."""
    row = [1]
    demand(True, "", len(factors) ** 2)
    for a, b in factors:
        row = [a * x + b * y for x, y in zip([*row, 0], [0, *row], strict=True)]
    return row


def along(x: str, p: dict[Any, int], powers: list[list[int]]) -> dict[Any, int]:
    """p with powers of x in s and t; a key is what is left of a monomial, and the powers of t."""
    found: dict[Any, int] = {}
    demand(True, "", len(p) * len(powers))
    for (m, at), c in p.items():
        rest = tuple(y for y in m if y != x)
        for j, w in enumerate(powers[m.count(x)]):
            found[rest, (*at, j)] = found.get((rest, (*at, j)), 0) + c * w
    return found


# LEMMA 4. The two parts of a cell cut between its ends cover it: what holds on every leaf of a tree of cuts holds on
# the box. On a leaf a matrix of polynomials is positive semidefinite if all its coefficients are.
def on_leaves(holds: Callable[[Box], bool], cell: Box, tree: Any, what: str) -> None:
    while tree != "":
        (x, cut, below, above), (low, high) = tree, cell[tree[0]]
        demand(re.fullmatch("-?[0-9]{1,40}(/[1-9][0-9]{0,39})?", cut), f"{x} is cut at no number")
        demand(low < (cut := Fraction(cut)) < high, f"{x} is not cut between its ends")
        on_leaves(holds, cell | {x: (low, cut)}, below, what)
        cell, tree = cell | {x: (cut, high)}, above
    demand(True, "", 100)
    demand(holds(cell), f"{what} in {cell}")


def semidefinite(A: Matrix, cell: Box, tree: Any) -> None:
    on_leaves(lambda leaf: all(map(positive, coefficients(A, leaf))), cell, tree, "not positive semidefinite")


# LEMMA 5. Let p > 0, and r be a new variable with r p = 1, that is 1/p. Times p^n, n the highest power of r in A, A is
# a matrix A' without r. As p^n > 0, A is 0, or semidefinite where that is asked, just if A' is. From the last r on.
def cleared(A: Matrix) -> Matrix:
    for r, p in reversed(Poly.divisors.items()):
        A = replaced(A, r, term(1), p)
    return A


def above_zero(A: Matrix, cell: Box, tree: Any) -> None:
    """A - 1e-99 is semidefinite: A is definite."""
    least = [[p - term(Fraction(int(i == j), 10**99)) for j, p in enumerate(row)] for i, row in enumerate(A)]
    semidefinite(cleared(least), cell, tree)


def reciprocal(p: Poly, known: dict[Any, Any]) -> Poly:
    """1/p: a number, or the variable for it; that p > 0 is left to be shown, of every one of Poly.divisors."""
    if not p.names():
        return term(1 / p.constant())
    if (key := ("1/", frozenset(p.after(len(p)).items()))) not in known:
        known[key] = term(1, name := f"?1/{len(Poly.divisors)}")  # no other has this name, whoever asks
        Poly.divisors = Poly.divisors | {name: p}
    found: Poly = known[key]
    return found


# LEMMA 6. Every angle has signs k and m, of its cosine and sine, and a t in [0, 1], the tangent of half of the angle
# between 0 and pi/2 that has the same cosine and sine but for them: they are k (1 - t^2)/(1 + t^2) and m 2 t/(1 + t^2).
def angle(name: str, p: Poly, known: dict[Any, Any]) -> Poly:
    """The sine or cosine of p, over variables of its own: of x they are called x t, x k and x m."""
    of = frozenset(p.after(len(p)).items())
    if ("cos", of) not in known:
        own = x if len(p.names()) == 1 and p == term(1, x := min(p.names())) else f"?{len(Poly.divisors)}"
        t, k, m = (term(1, f"{own} {x}") for x in "tkm")
        Poly.signs = Poly.signs | k.names() | m.names()
        u = reciprocal(term(1) + t * t, known)
        known["cos", of], known["sin", of] = k * (term(2) * u - term(1)), term(2) * m * t * u
    found: Poly = known[name, of]
    return found


def ranges() -> Box:
    """Those of the signs, and of the tangents of lemma 6."""
    tangents = {x for p in Poly.divisors.values() for x in p.names() if x.endswith(" t")}
    return {x: (Fraction(-(x in Poly.signs)), Fraction(1)) for x in Poly.signs | tangents}


# LEMMA 7. Let D > 0 and N be polynomials, P definite, N/D = F. With the Bernstein coefficients d > 0 and n of D and N,
# F is the mean of the matrices n/d with weights that are the products times d over D. |x|^2 = x'Px is convex, so that
# F'PF <= f P (semidefinite) if n'Pn <= f d^2 P of all. At one point each this is also D > 0.
def contracts(F: Matrix, P: list[list[Fraction]], f: Fraction, cell: Box, tree: Any) -> None:
    whole = lcm(*(x.denominator for row in P for x in row), f.denominator)
    Q, top, size = [[int(x * whole) for x in row] for row in P], int(f * whole), range(len(P))
    A = cleared([*F, [term(1)] * len(P)])

    def fall(leaf: Box) -> bool:
        return all(smaller(*n) for n in {tuple(map(tuple, C)) for C in coefficients(A, leaf)})

    def smaller(*rows: tuple[int, ...]) -> bool:
        *n, (d, *_) = rows
        demand(True, "", len(P) ** 3 // 2)
        columns = [*zip(*n, strict=True)]
        moved = [[sum(map(mul, row, column)) for row in Q] for column in columns]
        gap = [[top * d * d * Q[i][j] - whole * sum(map(mul, columns[i], moved[j])) for j in size] for i in size]
        return d > 0 and positive(gap)

    on_leaves(fall, cell, tree, "V may not fall")
