"""The kernel: polynomials, and when a matrix of them is positive semidefinite on a box. Standard library only.

Numbers are exact, but for the exp, sine or cosine of a number (lemma 8). A claim that is not shown raises an exception,
of any class. Trusted are this file, decimals.py, Python, and limits and numbers of frame.py. The rest of the checker
reduces its claims to these:

- IDENTITIES. ``Text`` evaluates expressions and straight-line C as polynomials (lemmas 1, 7 to 9). If two of them are
  equal without reciprocals (``cleared``, lemma 3), they are the same function.
- INEQUALITIES. ``semidefinite``: a symmetric matrix of polynomials is positive semidefinite where its variables are in
  a box (lemmas 2 to 5). ``contracts``: so is f P - F'PF, for a matrix F of quotients of polynomials (lemma 6).
"""

import ast
import re
from collections import defaultdict
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate, compress, product
from math import comb, gcd, lcm, prod
from operator import mul
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import decimals, frame

demand = frame.demand  # raises ValueError if a condition fails or the time limit is reached
LEAST, SHORT, MOST_TERMS = Fraction(1, 10**40), 30, 300_000  # SHORT: bits of a short number. MOST_TERMS take 100 MB


# LEMMA 1. A polynomial is {monomial: coefficient, not 0}, a monomial its names, sorted, each as often as its power. Two
# are one real function if and only if they are equal here. "sign.…" is 1 or -1: pairs of it are left out.
class Poly(dict[tuple[str, ...], Any]):
    def __hash__(self) -> int:  # type: ignore[override]  # a dict has no hash; a Poly is not changed once it is a key
        return hash(frozenset(self.items()))

    def __add__(self, other: "Poly") -> "Poly":
        fewer, more = sorted((self, other), key=len)
        terms = Poly(more | {m: more[m] + c if m in more else c for m, c in fewer.items()})
        return terms if all(terms.values()) else Poly({m: c for m, c in terms.items() if c})

    def __sub__(self, other: "Poly") -> "Poly":
        return self + Poly({m: -c for m, c in other.items()})

    def __mul__(self, other: "Poly") -> "Poly":
        terms = Poly()
        signs = (found := {x for x in other.names() if x.startswith("sign.")}) and found & self.names()
        for n, d in other.items():
            demand(len(terms) < MOST_TERMS, "more terms than the limit")
            for m, c in self.items():
                pairs = signs.intersection(m, n) if signs else ()
                monomial = tuple(sorted(x for x in m + n if x not in pairs) if pairs else sorted(m + n)) if n else m
                terms[monomial] = terms[monomial] + c * d if monomial in terms else c * d
        return terms if all(terms.values()) else Poly({m: c for m, c in terms.items() if c})

    def names(self) -> set[str]:
        return set().union(*self)

    def constant(self) -> Fraction:
        demand(not any(self), f"{sorted(self.names())[:3]} in place of a number" if any(self) else "")
        return Fraction(self.get((), 0))


Box = dict[str, Any]  # variable -> its ends
Known = dict[tuple[str, Poly], Poly]  # function and argument -> value


def term(c: Any, *names: str) -> Poly:
    c = c if type(c) in (int, Fraction) else Fraction(c)
    return Poly({names: c.numerator if c.denominator == 1 else c} if c else {})  # whole numbers are fast


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
# Short numbers are tried first: b_ij is a_ij / 2^(s_i + s_j), rounded down. What is cut off is a symmetric matrix with
# entries in [0, 1): its eigenvalues are above -n. So A is definite if (b_ij), less n on the diagonal, is semidefinite.
@lru_cache(8)  # a certificate and its proof ask the same
def positive(A: tuple[tuple[int, ...], ...], definite: bool = False) -> bool:
    s, n = [max(row[i].bit_length() - SHORT, 0) // 2 for i, row in enumerate(A)], len(A)
    if max(s, default=0) > SHORT // 3:
        short = (tuple((a >> s[i] + s[j]) - n * (i == j) for j, a in enumerate(row)) for i, row in enumerate(A))
        if positive(tuple(short)):
            return True
    rest, last = [[*row[k:]] for k, row in enumerate(A)], 1  # the upper half of the matrix is all
    while rest:
        (p, *r), *rest = rest
        if p < 0 or (p == 0 and (definite or any(r))):
            return False
        demand(True, "")
        for k, a in enumerate(r if p else ()):
            rest[k] = [(p * x - a * b) // last for x, b in zip(rest[k], r[k:], strict=True)]
        last = p or last
    return True


# LEMMA 3. Let x = a/b, b > 0, in a polynomial, the sum of q_k x^k, k <= n. Times b^n it is that of q_k a^k b^(n-k), and
# of the same sign. So reciprocals 1/p go, p > 0 to be shown; the last one first, as its p may contain earlier ones.
def replaced(sum_: Poly, x: str, a: Poly, b: Poly) -> Poly:  # x := a/b, times b^n
    parts: dict[int, Poly] = {}
    for m, c in sum_.items():
        rest = tuple(y for y in m if y != x) if x in m else m
        parts.setdefault(len(m) - len(rest), Poly())[rest] = c
    powers = {k: prod([a] * k + [b] * (max(parts) - k), start=term(1)) for k in parts}
    return sum((part * powers[k] for k, part in parts.items()), Poly())


def cleared(sum_: Poly, known: Known, nonnegative: Any = None) -> Poly:
    """Without reciprocals and, if `nonnegative` is given and shows that q >= 0, without each exp(-q) (lemma 8)."""
    for (name, p), r in reversed(known.items()):
        x = min(r.names(), default="")
        if name == "1/":
            sum_ = replaced(sum_, x, term(1), p)
        elif name == "exp" and nonnegative and x in sum_.names():
            nonnegative(q := Poly() - p)
            rising = term(1) + q + term("1/2") * q * q + term("1/6") * q * q * q
            sum_ = replaced(sum_, x, term(1, f"{x} share t"), rising)
    return sum_


# LEMMA 4. On a cell x is (low + high t)/(1 + t) with t >= 0, but for x = high, its limit. So (1 + t)^n times a
# polynomial of degree n in x is a sum of c_k t^k (lemma 3). c_k over the binomial coefficient of n and k is its k-th
# Bernstein coefficient; of a polynomial without x, each is the polynomial itself. So, one variable after the other and
# with the same n for all entries, a matrix becomes a sum of matrices of numbers, each times a product that is not below
# 0. It is positive semidefinite if all of these are. ``coefficients`` yields them, times a number > 0, for each leaf.
def coefficients(A: Any, box: Box, tree: Any, known: Known) -> Any:
    entries = cleared(joined(A), known, lambda q: semidefinite([[q]], box, tree, known))
    (whole,), _ = integers([entries.values()])
    inside, degree = defaultdict[str, set[str]](set), defaultdict[str, int](int)  # inside: place -> variables there
    for place, *names in entries:
        inside[place].update(names)
        degree |= {x: max(degree[x], names.count(x)) for x in names}
    most = sum(prod(degree[x] + 1 for x in variables) for variables in inside.values())  # of all entries
    demand(max(10 * len(A) * prod(n + 1 for n in degree.values()), most) < 10**6, "more terms than the limit")
    terms = {(m[0], *(m.count(x) for x in degree if x in inside[m[0]])): c for m, c in zip(entries, whole, strict=True)}
    for cell in leaves(box, tree):
        columns = {x: [*zip(*bernstein(n, *ends(x, cell)), strict=True)] for x, n in degree.items()}
        tables, common = defaultdict[Any, Any](lambda: defaultdict(list)), 0  # variables -> k of each -> coefficients
        for place, variables in inside.items():
            mask, scale = tuple(x in variables for x in degree), prod(columns[x][0][0] for x in {*degree} - variables)
            keys = [*product(*(range(degree[x] + 1) for x in compress(degree, mask)))]
            table = [scale * terms.get((place, *key), 0) for key in keys]
            for each in (columns[x] for x in compress(degree, mask)):  # its powers, the first, go; k comes behind
                demand(True, "")
                step = len(table) // len(each)
                table = [sum(map(mul, column, table[at::step])) for at in range(step) for column in each]
            common, (i, j) = gcd(common, *table), map(int, place[1:].split())
            for key, c in zip(keys, table, strict=True):
                tables[mask][key].append((i, j, c))
        found = set()
        for key in product(*(range(n + 1) for n in degree.values())):
            matrix = [[0] * len(row) for row in A]
            for mask, table in tables.items():
                for i, j, c in table[tuple(compress(key, mask))]:
                    matrix[i][j] = c // (common or 1)  # short is fast
            found.add(tuple(map(tuple, matrix)))  # many are the same, as of two signs
        yield from found


def joined(A: Any) -> Poly:  # the sum of the entries, each times the name "#i j" of its place
    return Poly({(f"#{i} {j}", *m): c for i, row in enumerate(A) for j, p in enumerate(row) for m, c in p.items()})


def bernstein(n: int, low: Any, high: Any) -> list[list[int]]:
    """For each power x^j, j = 0 ... n, its coefficients k = 0 ... n in degree n, all times one number above 0."""
    one, binomial, rows = lcm(low.denominator, high.denominator), [comb(n, k) for k in range(n + 1)], []
    a, b = int(low * one), int(high * one)
    demand(n < 2**7 and n * max(map(int.bit_length, (a, b, one))) <= 2**15, "too high a power of a range")
    row, common = [one**n * c for c in binomial], lcm(*binomial)
    for _ in range(n + 1):  # row: (low + high t)^j (1 + t)^(n - j); the next one is this over 1 + t, times low + high t
        rows.append([c * (common // ways) for c, ways in zip(row, binomial, strict=True)])
        over = [c // one for c in accumulate(row[:-1], lambda before, c: c - before)]
        row = [a * c + b * d for c, d in zip([*over, 0], [0, *over], strict=True)]
    return rows


def ends(x: str, cell: Box) -> Any:
    """Its range: a sign's is within -1 and 1, that of lemmas 7 and 8 within 0 and 1."""
    demand(x in cell or re.match(r"sign\.|.* t$", x), f"{x} without a range")
    low, high = cell.get(x, [Fraction(-x.startswith("sign.")), Fraction(1)])
    demand(low <= high, f"{x}: the range from {low} to {high} is empty")
    return low, high


# LEMMA 5. The two parts of a cell that is cut between its ends cover it: what holds on each leaf of a tree of cuts
# [x, number, tree of the lower part, tree of the upper part] holds on the box.
def leaves(cell: Box, tree: Any) -> Any:
    if tree == "":
        yield cell
    else:
        x, cut, lower, upper = tree
        demand(re.fullmatch("-?[0-9]{1,40}(/[1-9][0-9]{0,39})?", cut), f"{x} is cut at no number")
        (low, high), middle = ends(x, cell), Fraction(cut)
        demand(low < middle < high, f"{x} is not cut between its ends")
        yield from leaves(cell | {x: [low, middle]}, lower)
        yield from leaves(cell | {x: [middle, high]}, upper)


def semidefinite(A: Any, box: Box, tree: Any, known: Known, least: Any = 0) -> None:
    """A, less a number times the unit matrix: it is definite if that is above 0."""
    demand([*zip(*A, strict=True)] == [*map(tuple, A)], "a matrix is not symmetric")
    less = [[p - term(least) if i == j else p for j, p in enumerate(row)] for i, row in enumerate(A)]
    demand(all(map(positive, coefficients(less, box, tree, known))), "not positive semidefinite")


# LEMMA 6. Let F = N/D, D > 0 a polynomial and N a matrix of them. By lemma 4, D is a sum of w d and N that of w n, with
# the same products w >= 0. If all d > 0, F is the mean of the matrices n/d with the weights w d/D. P is definite, so
# V(e) = e'Pe is convex, and V(F e) <= f V(e) if V(n e) <= f d^2 V(e) of all: if f d^2 P - n'Pn is semidefinite.
def contracts(F: Any, P: Any, f: Fraction, box: Box, tree: Any, known: Known) -> None:
    (weights,), (a, b) = coefficients(P, {}, "", {}), f.as_integer_ratio()
    demand([*zip(*weights, strict=True)] == [*weights] and positive(weights, True), "P: not symmetric or not definite")
    demand({len(P)} == {len(F), *map(len, F)}, "P: not of the size of the matrix")
    for *n, (d,) in coefficients([*F, [term(1)]], box, tree, known):
        columns, scale = [*zip(*n, strict=True)], a * d * d
        pushed = [[sum(map(mul, row, x)) for row in weights] for x in columns]  # P times each
        gap = (tuple(scale * weights[i][j] - b * sum(map(mul, x, pushed[j])) if j >= i else 0 for j in range(len(P)))
               for i, x in enumerate(columns))  # fmt: skip  # the upper half is all that is read
        demand(d > 0 and positive(tuple(gap)), "V may not fall")


# LEMMA 7. Let k and m be the signs of the cosine and sine of an angle, b the angle in [0, pi/2] whose cosine and sine
# are their magnitudes, and t = tan(b/2), in [0, 1]. Then they are k (1 - t^2)/(1 + t^2) and m 2 t/(1 + t^2).
# Any other sign, and a reciprocal, is a variable too, one for each argument; a claim is shown for all values of it.
# LEMMA 8. With d the terms of p that hold an error, exp(p) = exp(p - d) (1 + d + d d r), r a number for each d: it is
# (exp(d) - 1 - d)/d^2, near 1/2 for small errors. Where q >= 0, exp(-q) = u/(1 + q + q^2/2 + q^3/6) with a u in [0, 1],
# since exp(q) is not below that sum. The exp, sine or cosine of a number is rounded to 50 digits: claims are shown of
# that decimal.
def function(name: str, p: Poly, known: Known) -> Poly:
    if name == "fabs":
        return function("sgn", p, known) * p
    if name in ("sgn", "1/") and not p.names():
        return term((p.constant() > 0) - (p.constant() < 0) if name == "sgn" else 1 / p.constant())
    if name in ("cos", "exp", "sin") and not p.names():
        return known.setdefault((name, p), term(decimals.decimal(name, p.constant())))
    if name in ("cos", "sin") and (name, p) not in known:  # the t of a variable x is called "x t"
        angle = next((x for x in p.names() if p == term(1, x) and x[:5] != "sign."), f"?{len(known)}")
        t, k, m = term(1, f"{angle} t"), term(1, f"sign.cos {angle}"), term(1, f"sign.sin {angle}")
        u = function("1/", term(1) + t * t, known)
        known["cos", p], known["sin", p] = k * (term(2) * u - term(1)), term(2) * m * t * u
    if name == "exp" and (d := Poly({m: c for m, c in p.items() if any(x[:9] == "error of " for x in m)})):
        return function(name, p - d, known) * (term(1) + d + d * d * function("exp beyond", d, known))
    return known.setdefault((name, p), term(1, f"?{len(known)}"))


# LEMMA 9. Names, numbers, calls of functions of doubles and + - * / ( ) mean the same in Python and in C, but for whole
# numbers, which C divides otherwise (frame.py lets none pass), and for what EXPRESSION does not let pass. Assignments
# are run in their order; a local or an output that is not set yet has no value.
NUMBER, fraction = re.compile(f"-?{frame.WHOLE}(/{frame.WHOLE})?"), lru_cache(1000)(Fraction)  # many are repeated
EXPRESSION = r"(?!.*(--|\+\+|\*\*|//|\b[0-9][0-9.]*+(?:e[+-]?[0-9]++)?+[A-Za-z_]))[A-Za-z0-9_. ()\[\]+*/-]{1,20000}"
TREES = {False: lru_cache(500)(ast.parse), True: lru_cache(8)(ast.parse)}  # many of long texts would fill the memory


class Text:  # evaluates expressions over names, and runs assignments; known: (function, argument) -> its value
    def __init__(self, names: dict[str, Poly], known: Known, precision: Any = frame.EXACT) -> None:
        self.names, self.known, self.precision, self.size = dict(names), known, precision, 0

    def value(self, text: str) -> Poly:
        if NUMBER.fullmatch(text := text.strip(" ")):
            return term(fraction(text))
        demand(re.fullmatch(EXPRESSION, text), f"{text[:80]!r} is no expression of at most 20000 characters")
        return self.of(TREES[len(text) > 200](text, mode="eval").body, text)

    def of(self, node: ast.expr, text: str) -> Poly:
        here = text[node.col_offset : node.end_col_offset]
        match node:
            case ast.BinOp(left, operator, right):
                a, b = self.of(left, text), self.of(right, text)
                b = function("1/", b, self.known) if isinstance(operator, ast.Div) else b
                done = a + b if isinstance(operator, ast.Add) else a - b if isinstance(operator, ast.Sub) else a * b
            case ast.Constant():
                demand(re.fullmatch(f"{frame.DOUBLE}|{frame.WHOLE}", here), f"{here} is out of place")
                return term(Fraction(here))
            case ast.UnaryOp(ast.USub(), operand):
                return Poly() - self.of(operand, text)
            case ast.Call(ast.Name(name), [argument], []):
                demand(name in ("cos", "exp", "fabs", "sgn", "sin"), f"C calls {name}")
                done = function(name, self.of(argument, text), self.known)
            case _:
                demand(here in self.names, f"{here[:80]} is nothing that is known here")
                return self.names[here]
        demand(self.precision.holds(done), "a number is too large or small for its type, or a power too high")
        return done

    def run(self, assignments: list[tuple[str, str]], writable: list[str]) -> dict[str, Poly]:
        for name, value in assignments:
            demand("." not in name.split("[")[0] or name in writable, f"{name} is set")
            self.names[name] = self.value(value)
            self.size += len(self.names[name])
            demand(self.size < MOST_TERMS, "more terms than the limit")
        return self.names
