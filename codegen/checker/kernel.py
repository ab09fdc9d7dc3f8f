"""The kernel: whether a proof is one of the C beside it. Standard library only; verify.py runs it on files.

THEOREM. Let the step of NAME.c run in exact arithmetic with the values of NAME_PARAMETERS, from any state and on any
inputs, in samples with fault 0. Let a machine move by v[k+1] = v[k] + h acceleration[k] and x[k+1] = x[k] + h v[k]
("semi_implicit": h v[k+1]), the positions x and those v that are inputs measured exactly, all else of it constant.
While every sign is 1 or -1, the same in machine and code and from sample to sample, all of `domain` positive, and
states whose formula holds no estimate are as it says, the errors e = sign * (truth - estimate) of all other states move
by e[k+1] = matrix e[k] + rest (to first order in e, if it says so; of states without a formula, `aside`, nothing is
said), and V(matrix e) <= (1 - 2 decay_rate h) V(e), V(e) = e'Pe, over the box, truths in it times their sign.
Trusted: this file, frame.py, which reads the C, Python, that the machine is yours. Not covered: rounding, faults, turns
of a sign. theorem.py shows what a proof says of `mass_matrix`, `force` and `reversals`, and that `domain` is not empty.
"""

import ast
import re
from collections import defaultdict
from fractions import Fraction
from math import lcm, prod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import frame

demand = frame.demand  # that this holds, and that there is time left, or ValueError
LEAST = Fraction(1, 10**40)


# LEMMA 1. A polynomial is {monomial: coefficient, not 0}, a monomial its names, sorted, each as often as its power. Two
# are the same real function just if they are the same here. "sign.…" is 1 or -1: pairs of it are left out.
class Poly(dict[tuple[str, ...], Any]):
    def __hash__(self) -> int:  # type: ignore[override]  # none is changed once it is made
        return hash(frozenset(self.items()))

    def __add__(self, other: "Poly") -> "Poly":
        terms = self | {m: self.get(m, 0) + c for m, c in other.items()}
        return Poly({m: c for m, c in terms.items() if c})

    def __sub__(self, other: "Poly") -> "Poly":
        return self + Poly({m: -c for m, c in other.items()})

    def __mul__(self, other: "Poly") -> "Poly":
        terms: dict[tuple[str, ...], Any] = {}
        signs = {x for x in self.names() & other.names() if x.startswith("sign.")}
        for n, d in other.items():
            demand(len(terms) < 10**6, "more terms than the limit")
            for m, c in self.items():
                pairs = signs.intersection(m, n) if signs else ()
                monomial = tuple(sorted(x for x in m + n if x not in pairs) if pairs else sorted(m + n))
                terms[monomial] = terms.get(monomial, 0) + c * d
        return Poly({m: c for m, c in terms.items() if c})

    def names(self) -> set[str]:
        return set().union(*self)

    def constant(self) -> Fraction:
        demand(not self.names(), f"{sorted(self.names())[:3]} in place of a number")
        return Fraction(self.get((), 0))


Matrix = list[list[Any]]
Box = dict[str, Any]  # variable -> its ends
Known = dict[tuple[str, Poly], Poly]  # function and argument -> value


def term(c: Any, *names: str) -> Poly:
    c = Fraction(c)
    return Poly({names: c.numerator if c.denominator == 1 else c} if c else {})  # whole numbers are fast


def times(A: Any, B: Any, zero: Any) -> Matrix:
    columns = list(zip(*B, strict=True))
    return [[sum((a * b for a, b in zip(row, c, strict=True) if a and b), zero) for c in columns] for row in A]


# LEMMA 2. Let p be the first diagonal entry of a symmetric A, r the rest of its row, B what is left without both. If
# p > 0, A is positive semidefinite just if B - r r'/p is; if p = 0, just if r = 0 and B is; if p < 0, never. Definite
# just if all p > 0. Times p and over the last p, entries that are whole stay whole (Bareiss).
def positive(A: Any, definite: bool = False) -> bool:
    rest, last = [row[k:] for k, row in enumerate(A)], 1  # the upper half is all
    while rest:
        (p, *r), *rest = rest
        if p < 0 or (p == 0 and (definite or any(r))):
            return False
        for k, a in enumerate(r if p else ()):
            demand(True, "")
            rest[k] = [(p * x - a * b) // last for x, b in zip(rest[k], r[k:], strict=True)]
        last = p or last
    return True


# LEMMA 3. Let x = a/b, b > 0, in a sum of polynomials q x^k, k <= n. Times b^n it is the sum of q a^k b^(n-k), and of
# the same sign. So a reciprocal r = 1/p goes, p > 0 to be shown: the last one first, since a later p may hold it.
def replaced(sum_: Poly, x: str, a: Poly, b: Poly) -> Poly:
    parts: dict[int, Poly] = {}
    for m, c in sum_.items():
        rest = tuple(y for y in m if y != x)
        parts.setdefault(len(m) - len(rest), Poly())[rest] = c
    powers = {k: prod([a] * k + [b] * (max(parts) - k), start=term(1)) for k in parts}
    return sum((part * powers[k] for k, part in parts.items()), Poly())


def cleared(sum_: Poly, known: Known) -> Poly:
    for (name, p), r in reversed(known.items()):
        sum_ = replaced(sum_, r.names().pop(), term(1), p) if name == "1/" else sum_
    return sum_


# LEMMA 4. On a cell x is (low + high t)/(1 + t) with t >= 0, but for x = high, its limit. With this in place of each x
# (lemma 3) a matrix is a sum of products of such t, not below 0, times matrices of numbers, Bernstein's coefficients.
# So it is positive semidefinite if these are. It is here the sum of its entries times names "#i j" of their places.
def coefficients(A: Matrix, box: Box, tree: Any, known: Known) -> Any:
    """On each leaf of the tree (lemma 5), times numbers above 0."""
    places = {f"#{i} {j}": (i, j) for i, row in enumerate(A) for j in range(len(row))}
    joint = cleared(Poly({(at, *m): c for at, (i, j) in places.items() for m, c in A[i][j].items()}), known)
    common = 1
    for c in joint.values():
        common = lcm(common, c.denominator)
        demand(common.bit_length() < 10**4, "a common denominator is too large")
    for cell in leaves(box, tree):
        left = Poly({m: c.numerator * (common // c.denominator) for m, c in joint.items()})
        for x in sorted(joint.names() - {*places}):
            (low, high), t = ends(x, cell), term(1, f"<{x}")
            one = lcm(low.denominator, high.denominator)
            left = replaced(left, x, term(one * low) + term(one * high) * t, term(one) + term(one) * t)
        found: Any = defaultdict(lambda: [[0] * len(row) for row in A])
        for (at, *m), c in left.items():
            demand(len(found) * len(A) < 10**5, "more terms than the limit")
            i, j = places[at]
            found[tuple(m)][i][j] = c
        yield from {tuple(map(tuple, B)) for B in found.values()}  # many are the same, as of two signs


def ends(x: str, cell: Box) -> Any:
    """Its range: a sign's is within -1 and 1, a tangent's (lemma 7) within 0 and 1."""
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


def semidefinite(A: Matrix, box: Box, tree: Any, known: Known, least: Any = 0) -> None:
    """A, less a number times the unit matrix: it is definite if that is above 0."""
    demand([*zip(*A, strict=True)] == [*map(tuple, A)], "a matrix is not symmetric")
    less = [[p - term(least) if i == j else p for j, p in enumerate(row)] for i, row in enumerate(A)]
    demand(all(map(positive, coefficients(less, box, tree, known))), "not positive semidefinite")


# LEMMA 6. Let D > 0 and N be polynomials, P definite, N/D = F. With the Bernstein coefficients d > 0 and n of D and N,
# F is the mean of the matrices n/d with weights that are the products times d over D. V is convex, so that
# V(F e) <= f V(e) if n'Pn <= f d^2 P of all.
def contracts(F: Matrix, P: Matrix, f: Fraction, box: Box, tree: Any, known: Known) -> None:
    (weights,), (a, b) = coefficients(P, {}, "", {}), f.as_integer_ratio()
    demand([*zip(*weights, strict=True)] == [*weights] and positive(weights, True), "P: not symmetric or not definite")
    for *n, (d,) in coefficients([*F, [term(1)]], box, tree, known):
        moved = times(zip(*n, strict=True), times(weights, n, 0), 0)
        gap = [[a * d * d * p - b * q for p, q in zip(*rows, strict=True)] for rows in zip(weights, moved, strict=True)]
        demand(d > 0 and positive(gap), "V may not fall")


# LEMMA 7. An angle has signs k and m, of its cosine and sine, and a t in [0, 1], the tangent of half of the angle
# between 0 and pi/2 that has the same cosine and sine but for them: they are k (1 - t^2)/(1 + t^2) and m 2 t/(1 + t^2).
# Any other sign, and a reciprocal, is a variable too, one for each argument: what holds for all values holds for that.
def function(name: str, p: Poly, known: Known) -> Poly:
    if name == "fabs":
        return function("sgn", p, known) * p
    if name in ("sgn", "1/") and not p.names():
        number = p.constant()
        return term((number > 0) - (number < 0) if name == "sgn" else 1 / number)
    if name in ("cos", "sin") and (name, p) not in known:  # the t of a variable x is called "x t"
        own = next((x for x in p.names() if p == term(1, x) and x[:5] != "sign."), f"?{len(known)}")
        t, k, m = term(1, f"{own} t"), term(1, f"sign.cos {own}"), term(1, f"sign.sin {own}")
        u = function("1/", term(1) + t * t, known)
        known["cos", p], known["sin", p] = k * (term(2) * u - term(1)), term(2) * m * t * u
    return known.setdefault((name, p), term(1, f"?{len(known)}"))


# LEMMA 8. Names, numbers, calls of functions of doubles and + - * / ( ) mean the same in Python and in C, but for whole
# numbers, which C divides otherwise (frame.py lets none pass), and for what EXPRESSION does not let pass. Assignments
# are run in their order; a local or an output that is not set yet has no value.
EXPRESSION = r"(?!.*(--|\+\+|\*\*|//))[A-Za-z0-9_. ()\[\]+*/-]{1,20000}"


class Text:  # expressions over `names`, and assignments to them
    def __init__(self, names: dict[str, Poly], known: Known, precision: Any = frame.EXACT) -> None:
        self.names, self.known, self.precision = dict(names), known, precision

    def value(self, text: str) -> Poly:
        demand(re.fullmatch(EXPRESSION, text), f"{text[:80]!r} is no expression")
        return self.of(ast.parse(text := text.strip(), mode="eval").body, text)

    def of(self, node: ast.expr, text: str) -> Poly:
        here = text[node.col_offset : node.end_col_offset]
        match node:
            case ast.Constant():
                demand(re.fullmatch(f"{frame.DOUBLE}|{frame.WHOLE}", here), f"{here} is out of place")
                return term(Fraction(here))
            case ast.UnaryOp(ast.USub(), operand):
                return Poly() - self.of(operand, text)
            case ast.Call(ast.Name(name), [argument], []):
                demand(name in ("cos", "fabs", "sgn", "sin"), f"C calls {name}")
                return function(name, self.of(argument, text), self.known)
            case ast.BinOp(left, operator, right):
                a, b = self.of(left, text), self.of(right, text)
                b = function("1/", b, self.known) if isinstance(operator, ast.Div) else b
                done = a + b if isinstance(operator, ast.Add) else a - b if isinstance(operator, ast.Sub) else a * b
                demand(self.precision.holds(done), "a number is too large or small, or a power")
                return done
        demand(here in self.names, f"{here[:80]} is nothing that is known here")
        return self.names[here]

    def run(self, assignments: list[tuple[str, str]], writable: list[str]) -> dict[str, Poly]:
        for name, value in assignments:
            demand("." not in name.split("[")[0] or name in writable, f"{name} is set")
            self.names[name] = self.value(value)
        return self.names


@frame.limited()
def prove(proof: dict[str, Any], files: dict[str, str]) -> dict[str, Any]:
    """What holds besides the fields of the proof, if it is one of these files (name: text); ValueError if not."""
    signs, errors, formulas, velocity = (proof[x] for x in ("signs", "errors", "states", "positions"))
    c = frame.read(proof["name"], files)
    # Parameters are what `prepare` makes of the values, exactly: the decimals there are that, rounded.
    own, near = {p: term(x) for p, x in c.values.items() if p not in dict(c.prepare)}, c.precision.rounding
    made = Text(own, {}, c.precision).run(c.prepare, [*c.values])
    demand(all(abs(made[p].constant() - x) <= abs(x) * near for p, x in c.values.items()), "prepare gives others")
    # Free are inputs, truth, signs, errors, and states without a formula. An estimate is truth less sign * error.
    truths, estimates, turned = ([e[part] for e in errors] for part in ("truth", "estimate", "sign"))
    hidden, aside = [f"error of {x}" for x in truths], [z for z in c.states if z not in formulas]
    named = all(re.fullmatch(r"true\.\w+", x, re.A) for x in truths)
    named = named and all(re.fullmatch(r"sign\.\w+", x, re.A) for x in signs) and {*turned} <= {"", *signs}
    demand(named and len({*truths}) == len({*estimates} & {*c.outputs}) == len(errors) <= 100, "not so named")
    known: Known = {}
    names = {p: made[p] for p in c.values} | {x: term(1, x) for x in (*c.inputs, *truths, *signs)} | {"": term(1)}
    # A sign is that of a polynomial with an estimate or a measured velocity: so there are points where all are 1.
    slips = {*estimates, *velocity.values()} - {*truths}
    visible = {x: p for x, p in names.items() if x not in signs} | {x: term(1, x) for x in estimates}
    seen = [Text(visible, {}).value(of).names() for of in signs.values()]
    demand(all(x & slips and visible.keys() >= x for x in seen), "no sign of a slip")
    names |= {t: names[s] * names[t] for t, s in zip(truths, turned, strict=True)}
    machine, error = Text(names, known), [term(1, e) for e in hidden]
    shown = [(y, t, names[s]) for y, t, s in zip(estimates, truths, turned, strict=True)]
    names |= {y: names[t] - s * e for (y, t, s), e in zip(shown, error, strict=True)} | {z: term(1, z) for z in aside}
    claim = Text(names, known)
    told = [(names[s], claim.value(of)) for s, of in signs.items()]
    told += [(names[s], names[s] * p) for s in ("", *signs) for p in map(claim.value, proof["domain"])]
    known |= {("sgn", term(way) * p): term(way) * s for s, p in told for way in (-1, 1)}
    # LEMMA 9. From the states that formulas of n estimates give, the n of them that move with one, `step` shows these
    # same estimates: a map of R^n to R^n that is one-to-one, hence, being polynomial, onto (linear algebra where it is
    # affine, else Bialynicki-Birula and Rosenlicht 1962). So every state is met, and shows its estimates.
    start = {z: claim.value(of) for z, of in formulas.items()}
    moving, follow = [z for z, p in start.items() if not p.names().isdisjoint(hidden)], {*hidden}
    for (_, of), p in known.items():
        follow |= p.names() - {*signs} if of.names() & follow else set()
    demand({*start} <= {*c.states} and len(moving) == len(errors), "not an error for each state")
    demand(all(p.names() & follow <= {*hidden} for p in start.values()), "a state is no polynomial of the estimates")
    code = Text({x: p for x, p in names.items() if x not in c.outputs} | start, known, c.precision)
    code.run(c.step, [])
    after = code.run(c.commit, c.states + c.outputs)
    demand(all(after[y] == names[y] for y in estimates), "the states do not show the estimates")
    # The machine a sample later, and the states that show the errors which the matrix gives: they are the code's.
    phi = [[machine.value(x) for x in row] for row in proof["matrix"]]
    rate, h = {v: machine.value(a) for v, a in proof["acceleration"].items()}, names["parameters.sample_time"]
    rest = [*map(machine.value, proof.get("rest", ["0"] * len(errors)))]
    moves = {*velocity.values()} <= {*rate} <= {*truths, *c.inputs} and {*velocity} <= {*c.inputs} - {*rate}
    demand(moves, "not a velocity for each position")
    later = names | {x: term(1, f"{x} later") for x in (*c.inputs, *aside)} | {v: names[v] + h * rate[v] for v in rate}
    later |= {x: names[x] + h * {"euler": names, "semi_implicit": later}[proof["step"]][v] for x, v in velocity.items()}
    moved = [e + r for (e,), r in zip(times(phi, [[e] for e in error], Poly()), rest, strict=True)]
    expected = Text(later | {y: later[t] - s * e for (y, t, s), e in zip(shown, moved, strict=True)}, known)
    off = {z: cleared(after[z] - expected.value(of), known) for z, of in formulas.items()}
    # A term of more than one error is beyond the first order; where such are left, that is said.
    bad = [z for z, p in off.items() for m in p if z not in moving or sum(x in hidden for x in m) < 2]
    demand(not bad, f"the matrix does not move the errors: {bad[:3]}")
    alone = {x for z in aside for x in after[z].names() if x in aside or x[0] == "?"}
    demand(not alone, f"nothing is said of what follows {alone}, and may grow")
    # V falls, by the lemmas of the algebra.
    box = {x: [machine.value(end).constant() for end in (low, high)] for x, (low, high) in proof["box"].items()}
    fall = 1 - 2 * machine.value(proof["decay_rate"]).constant() * h.constant()
    demand({*box} <= {*c.inputs, *truths} and fall > 0 < h.constant(), "a box of no free variable, or V negative")
    P = [[term(machine.value(x).constant()) for x in row] for row in proof["lyapunov_matrix"]]
    for p in (p for name, p in [*known] if name == "1/"):
        semidefinite([[p]], box, proof["cover"], known, LEAST)
    contracts(phi, P, fall, box, proof["cover"], known)
    conditions = proof["domain"] or box or any(rest) or aside or len(moving) < len(formulas)
    found = {"aside": aside, "first order": any(off.values()), "fall": fall, "values": c.values, "c": c, "matrix": phi}
    return found | {"whole": not conditions, "names": names, "known": known, "box": box, "check": after.get("check")}
