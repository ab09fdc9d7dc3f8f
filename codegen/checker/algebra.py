"""Sparse polynomials with rational coefficients, and proofs that a matrix of them is positive semidefinite on a box.

Standard library only; kernel.py and covered.py use it. Nothing here knows of C, machines or certificates. Numbers are
integers and fractions; every result is exact.
"""

import re
from collections import defaultdict
from fractions import Fraction
from itertools import accumulate, compress, product
from math import comb, gcd, lcm, prod
from operator import mul
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import frame

demand = frame.demand  # raises ValueError if a condition fails or the time limit is reached
LEAST = Fraction(1, 10**40)
LONG, SHORT = 64, 30  # binary digits of a long number, and of a short one


# LEMMA 1. A polynomial is {monomial: coefficient, not 0}, a monomial its names, sorted, each as often as its power. Two
# are the same real function just if they are the same here. "sign.…" is 1 or -1: pairs of it are left out.
class Poly(dict[tuple[str, ...], Any]):
    def __hash__(self) -> int:  # type: ignore[override]  # dict has none: a Poly is a key once it is made, and is not changed then
        return hash(frozenset(self.items()))

    def __add__(self, other: "Poly") -> "Poly":
        fewer, more = sorted((self, other), key=len)
        terms = Poly(more)
        for m, c in fewer.items():
            terms[m] = terms[m] + c if m in terms else c
            if not terms[m]:
                del terms[m]
        return terms

    def __sub__(self, other: "Poly") -> "Poly":
        return self + Poly({m: -c for m, c in other.items()})

    def __mul__(self, other: "Poly") -> "Poly":
        terms = Poly()
        signs = {x for x in other.names() if x.startswith("sign.")}
        signs = signs and signs & self.names()
        for n, d in other.items():
            demand(len(terms) < 10**6, "more terms than the limit")
            for m, c in self.items():
                pairs = signs.intersection(m, n) if signs else ()
                monomial = tuple(sorted(x for x in m + n if x not in pairs) if pairs else sorted(m + n)) if n else m
                terms[monomial] = terms[monomial] + c * d if monomial in terms else c * d
        return terms if all(terms.values()) else Poly({m: c for m, c in terms.items() if c})

    def names(self) -> set[str]:
        return set().union(*self)

    def constant(self) -> Fraction:
        demand(not self.names(), f"{sorted(self.names())[:3]} in place of a number")
        return Fraction(self.get((), 0))


Box = dict[str, Any]  # variable -> its ends
Known = dict[tuple[str, Poly], Poly]  # function and argument -> value


def term(c: Any, *names: str) -> Poly:
    c = c if type(c) in (int, Fraction) else Fraction(c)
    return Poly({names: c.numerator if c.denominator == 1 else c} if c else {})  # whole numbers are fast


def times(A: Any, B: Any, zero: Any) -> Any:
    columns = list(zip(*B, strict=True))
    return [[sum((a * b for a, b in zip(row, c, strict=True) if a and b), zero) for c in columns] for row in A]


def integers(rows: Any) -> tuple[list[list[int]], int]:
    """(D * rows, D) with the least D > 0 for which all entries are whole."""
    rows, common = [[*row] for row in rows], 1
    for denominator in {x.denominator for row in rows for x in row}:  # one of all of them could fill the memory
        common = lcm(common, denominator)
        demand(common.bit_length() <= 2**14, "a common denominator is too large")
    return [[x.numerator * (common // x.denominator) for x in row] for row in rows], common


# LEMMA 2. Let p be the first diagonal entry of a symmetric A, r the rest of its row, B what is left without both. If
# p > 0, A is positive semidefinite just if B - r r'/p is; if p = 0, just if r = 0 and B is; if p < 0, never. Definite
# just if all p > 0. Times p and over the last p, entries that are whole stay whole (Bareiss).
# Short numbers are tried first: b_ij is a_ij / 2^(s_i + s_j), rounded down. What is cut off is a symmetric matrix of
# entries below 1, whose eigenvalues are above -n. So A is definite if (b_ij), less n on the diagonal, is semidefinite.
def positive(A: Any, definite: bool = False) -> bool:
    sizes = [A[i][i].bit_length() for i in range(len(A))]
    shifts = [max(size - SHORT, 0) // 2 for size in sizes if max(sizes) > LONG]
    short = [[A[i][j] >> shifts[i] + shifts[j] for j in range(i, len(A))] for i in range(len(shifts))]
    for row in short:
        row[0] -= len(A)
    return (short and eliminated(short, False)) or eliminated([row[k:] for k, row in enumerate(A)], definite)


def eliminated(rest: Any, definite: bool) -> bool:
    last = 1  # the upper half of the matrix is all
    while rest:
        (p, *r), *rest = rest
        if p < 0 or (p == 0 and (definite or any(r))):
            return False
        demand(True, "")
        for k, a in enumerate(r if p else ()):
            rest[k] = [(p * x - a * b) // last for x, b in zip(rest[k], r[k:], strict=True)]
        last = p or last
    return True


# LEMMA 3. Let x = a/b, b > 0, in a sum of polynomials q x^k, k <= n. Times b^n it is the sum of q a^k b^(n-k), and of
# the same sign. So a reciprocal r = 1/p goes, p > 0 to be shown: the last one first, since a later p may hold it.
def replaced(sum_: Poly, x: str, a: Poly, b: Poly) -> Poly:
    parts: dict[int, Poly] = {}
    for m, c in sum_.items():
        rest = tuple(y for y in m if y != x) if x in m else m
        parts.setdefault(len(m) - len(rest), Poly())[rest] = c
    powers = {k: prod([a] * k + [b] * (max(parts) - k), start=term(1)) for k in parts}
    return sum((part * powers[k] for k, part in parts.items()), Poly())


def cleared(sum_: Poly, known: Known, below: Any = None) -> Poly:
    """Without reciprocals; if `below` shows a q >= 0, without each exp(-q) too (lemma 8)."""
    for (name, p), r in reversed(known.items()):
        x = min(r.names(), default="")
        if name == "1/":
            sum_ = replaced(sum_, x, term(1), p)
        elif name == "exp" and below and x in sum_.names():
            below(q := Poly() - p)
            rising = term(1) + q + term("1/2") * q * q + term("1/6") * q * q * q
            sum_ = replaced(sum_, x, term(1, f"{x} share t"), rising)
    return sum_


# LEMMA 4. On a cell x is (low + high t)/(1 + t) with t >= 0, but for x = high, its limit. So times (1 + t)^n a
# polynomial of degree n in x is a sum of c_k t^k (lemma 3). c_k over the binomial coefficient of n and k is its k-th
# Bernstein coefficient, and that is the polynomial if x is not in it. With one n for all entries, and so for each
# variable, a matrix is a sum of matrices of numbers, its coefficients, times products that are not below 0. It is
# positive semidefinite if these are. Here they stand times a number above 0, on each leaf of the tree (lemma 5).
def joined(A: Any) -> Poly:
    """The sum of the entries, each times the name "#i j" of its place."""
    return Poly({(f"#{i} {j}", *m): c for i, row in enumerate(A) for j, p in enumerate(row) for m, c in p.items()})


def powers(n: int, low: Any, high: Any) -> tuple[list[list[int]], int]:
    """D times the Bernstein coefficients k = 0 ... n of each power x^j, j = 0 ... n, and D > 0.

    Those of x^j, times binomial coefficients, are those of (low + high t)^j (1 + t)^(n - j). Each such product is the
    one before over 1 + t, times low + high t.
    """
    one = lcm(low.denominator, high.denominator)
    a, b = int(low * one), int(high * one)
    demand(n < 2**7 and n * max(map(int.bit_length, (a, b, one))) <= 2**15, "too high a power of a range")
    binomial, rows = [comb(n, k) for k in range(n + 1)], []
    row, common = [one**n * c for c in binomial], lcm(*binomial)
    for _ in range(n + 1):
        demand(True, "")
        rows.append([c * (common // ways) for c, ways in zip(row, binomial, strict=True)])
        over = [c // one for c in accumulate(row[:-1], lambda before, c: c - before)]
        row = [a * c + b * d for c, d in zip([*over, 0], [0, *over], strict=True)]
    return rows, one**n * common


def coefficients(A: Any, box: Box, tree: Any, known: Known) -> Any:
    joint = cleared(joined(A), known, lambda q: semidefinite([[q]], box, tree, known))
    (whole,), _ = integers([joint.values()])
    places = {f"#{i} {j}": (i, j) for i, row in enumerate(A) for j in range(len(row))}
    own, degree = defaultdict[Any, Any](set), defaultdict[Any, Any](int)  # place -> its variables, variable -> power
    for place, *m in joint:
        own[place].update(m)
        degree |= {x: max(degree[x], m.count(x)) for x in m}
    numbers = sum(prod(degree[x] + 1 for x in variables) for variables in own.values())  # in all tables
    demand(max(10 * len(A) * prod(n + 1 for n in degree.values()), numbers) < 10**6, "more terms than the limit")
    keys = {place: [range(n + 1) for x, n in degree.items() if x in own[place]] for place in own}  # of its table
    terms = {(m[0], *[m.count(x) for x in degree if x in own[m[0]]]): c for m, c in zip(joint, whole, strict=True)}
    tables = {place: [terms.get((place, *power), 0) for power in product(*keys[place])] for place in own}
    for cell in leaves(box, tree):
        turned = {x: powers(n, *ends(x, cell)) for x, n in degree.items()}
        made, common = dict[str, list[int]](), 0
        for place, table in tables.items():
            of_others = prod(one for x, (_, one) in turned.items() if x not in own[place])
            for rows in ([[of_others]], *(rows for x, (rows, _) in turned.items() if x in own[place])):
                table = of_next(table, rows)
            made[place], common = table, gcd(common, *table)  # short numbers are fast
        parts: Any = defaultdict(lambda: defaultdict(list))  # which variables -> k of each -> entries
        for place, table in made.items():
            where = tuple(x in own[place] for x in degree)
            for key, c in zip(product(*keys[place]), table, strict=True):
                demand(True, "")
                parts[where][key].append((*places[place], c // (common or 1)))
        found = set()
        for key in product(*(range(n + 1) for n in degree.values())):
            matrix = [[0] * len(row) for row in A]
            for where, entries in parts.items():
                for i, j, c in entries[tuple(compress(key, where))]:
                    matrix[i][j] = c
            found.add(tuple(map(tuple, matrix)))  # many are the same, as of two signs
        yield from found


def of_next(table: list[int], rows: list[list[int]]) -> list[int]:
    """The table with k in place of the power of its first variable, now the last: so each in its turn is the first."""
    step, found = len(table) // len(rows), list[list[int]]()
    parts = [table[at : at + step] for at in range(0, len(table), step)]  # one for each power
    for weights in zip(*rows, strict=True):
        demand(True, "")
        scaled = [[weight * c for c in part] for weight, part in zip(weights, parts, strict=True)]
        found.append([*map(sum, zip(*scaled, strict=True))])
    return [c for of_each in zip(*found, strict=True) for c in of_each]


def ends(x: str, cell: Box) -> Any:
    """Its range: a sign's is within -1 and 1, that of lemmas 7 and 8 within 0 and 1."""
    demand(x in cell or re.match(r"sign\.|.* t$", x), f"{x} without a range")
    return cell.get(x, [Fraction(-x.startswith("sign.")), Fraction(1)])


# LEMMA 5. The two parts of a cell that is cut between its ends cover it: what holds on each leaf of a tree of cuts
# [x, where, what is below, what is above] holds on the box.
def leaves(cell: Box, tree: Any) -> Any:
    if tree == "":
        yield cell
    else:
        x, cut, below, above = tree
        demand(re.fullmatch("-?[0-9]{1,40}(/[1-9][0-9]{0,39})?", cut), f"{x} is cut at no number")
        (low, high), middle = ends(x, cell), Fraction(cut)
        demand(low < middle < high, f"{x} is not cut between its ends")
        yield from leaves(cell | {x: [low, middle]}, below)
        yield from leaves(cell | {x: [middle, high]}, above)


def semidefinite(A: Any, box: Box, tree: Any, known: Known, least: Any = 0) -> None:
    """A, less a number times the unit matrix: it is definite if that is above 0."""
    demand([*zip(*A, strict=True)] == [*map(tuple, A)], "a matrix is not symmetric")
    less = [[p - term(least) if i == j else p for j, p in enumerate(row)] for i, row in enumerate(A)]
    demand(all(map(positive, coefficients(less, box, tree, known))), "not positive semidefinite")


# LEMMA 6. Let D > 0 and N be polynomials, P definite, N/D = F. With the Bernstein coefficients d > 0 and n of D and N,
# F is the mean of the matrices n/d with weights that are the products times d over D. V is convex, so that
# V(F e) <= f V(e) if n'Pn <= f d^2 P of all.
def contracts(F: Any, P: Any, f: Fraction, box: Box, tree: Any, known: Known) -> None:
    (weights,), (a, b) = coefficients(P, {}, "", {}), f.as_integer_ratio()
    demand([*zip(*weights, strict=True)] == [*weights] and positive(weights, True), "P: not symmetric or not definite")
    demand({len(P)} == {len(F), *map(len, F)}, "P: not of the size of the matrix")
    for *n, (d,) in coefficients([*F, [term(1)]], box, tree, known):
        columns = [*zip(*n, strict=True)]
        pushed = [[sum(map(mul, row, x)) for row in weights] for x in columns]  # P times each
        gap = [  # the upper half is all that is read
            [a * d * d * weights[i][j] - b * sum(map(mul, x, pushed[j])) if j >= i else 0 for j in range(len(P))]
            for i, x in enumerate(columns)
        ]
        demand(d > 0 and positive(gap), "V may not fall")
