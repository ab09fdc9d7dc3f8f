"""Rounding of the C: a step is refused whose rounding errors are much larger than those of storing its states.

Standard library only; part of the checker (verify.py), which hands ``forms``, ``frame`` and ``kernel`` in. The kernel
proves the step in exact arithmetic, in which 1e14 * (0.1 + 0.2 - 0.3) is 0; in doubles it is 0.006. So the rounding
error of every value of the C is bounded, from the operations that compute it:

LEMMA R (Higham, Accuracy and Stability of Numerical Algorithms, section 3.1). Let the result of each operation have a
relative error of at most u. A value is a polynomial, and each term that is added while it is computed then carries at
most n factors 1 + d, |d| <= u. So its error is at most n u/(1 - n u) times the polynomial of the magnitudes of all
these terms, those that cancel included.

`Bounded` computes this polynomial of magnitudes, and n. `require` compares it, for each state and term by term, with
the rounding error that no code with these states can avoid: that of storing them, before and after the step. A term is
a product of inputs, estimates and numbers. Where the bound of a term is more than ``cancelled`` times the unavoidable
error, larger terms cancel, less than half of the digits may be right, and the C is refused. Of a term with an input
this is the only limit, since V has no inputs in it. For the errors there is a second one, `require_decay_when_rounded`:
V must not grow when rounding changes their dynamics. The bounds are to first order in u, and take every variable in a
divisor as 1.
Overflow and underflow of terms are excluded by frame.Precision.holds, for which quotients are between the two ends that
`Bounded.ones` sets, and a sine, a cosine and an exp are 1.

A SIGN in the C is that of the exact value only if the value has no part that underflows, as (x - 1)^46 does next to
x = 1, and no large term that cancels, as in x^5 + w^5 - w^5. `Bounded.spacing` bounds from below every value that is
not 0, from the operations that compute it. A sign is refused of a value with a part that may be below 1/most, with a
sum in which a term cancels, or with an exp: exp(-800) is 0 in doubles.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import islice
from math import prod
from operator import mul
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import forms, frame, kernel

FAR = 10**6  # an exponent of 2 beyond those of all values
NUMERIC, NAME = r"(?<![\w.])(?:cos|exp|sin)\b", r"[A-Za-z_][\w.]*(?:\[[\d.]+\])?"
CANCELLATION = "terms of a sum cancel, and what is left is its rounding error"
MOST_CANCELLED = 1000  # how often a formula or a divisor may have the sum of its terms in terms that cancel to 0
PART, MOST = 2**4, 2**16  # floats hold all multiples of 1/PART up to MOST
OTHER_VALUE = "prepare gives others: {} of the header differs from its formula by more than rounding"


def parameters(c: Any) -> tuple[dict[str, Any], dict[Any, Any]]:
    """(parameter -> its value, function and argument -> its value); ValueError where the header has other decimals.

    A parameter has the value that `prepare` computes from the values, in exact arithmetic. The decimals in the header
    are these values rounded: off by the rounding of the formula's terms, of which ``require`` bounds the effect. A
    parameter that is the exp of a number has its decimal as value, in all that is computed from it, and so has this
    exp wherever it occurs, except exp(0).
    A sine or cosine is off by as much as its argument, too: cos(1.5707963267948966) is 1.9e-17, and 6.1e-17 in doubles.
    """
    known: dict[Any, Any] = {}
    decimals: dict[Any, Any] = {}  # of an exp: one, or those of many parameters could lead away from it
    prepared = Bounded({x: kernel.term(v) for x, v in c.values.items() if x not in dict(c.prepare)}, known, c.precision)
    prepared.bounds |= {x: prepared.number(p) for x, p in prepared.names.items()}
    for parameter, text in c.prepare:
        exact = prepared.run([(parameter, text)], [*c.values])[parameter]
        decimal = c.values.get(parameter, exact.constant())
        exps = {(f, p): kernel.term(decimal) for (f, p), e in known.items() if f == "exp" and p and e == exact}
        size = abs(decimal) if exps else prepared.bounds[parameter][0].constant()
        frame.demand(abs(exact.constant() - decimal) <= size * c.precision.rounding, OTHER_VALUE.format(parameter))
        frame.demand(all(decimals.setdefault(key, e) == e for key, e in exps.items()), OTHER_VALUE.format(parameter))
        known |= exps
        prepared.names |= {parameter: kernel.term(decimal)} if exps else {}
    return {p: prepared.names[p] for p in c.values}, known


def require(proof: dict[str, Any], proven: dict[str, Any]) -> None:
    """Raises ValueError if a step, or another function of the C, or a formula with exp, may round by too much.

    Args:
        proven: what errors.prove returned for the proof.
    """
    code = step(proof, proven)
    require_states_of_estimates(proven)
    added = require_accurate_step(proof, proven, code)
    require_divisors_above_rounding(proof, proven, code)
    require_decay_when_rounded(proof, proven, code, added)
    require_accurate_formulas(proof, proven, code)
    require_accurate_functions(proven)


def require_states_of_estimates(proven: dict[str, Any]) -> None:
    """Raises ValueError if a state is made of more than estimates and measurements.

    Anything else that is added to a state, such as a number, could be large without changing the error matrix, and the
    estimate beside it would lose its digits.
    """
    parts = [m for z in proven["moving"] for m in proven["before"][z]]
    measured = ("true.", "error of ", "inputs.")
    frame.demand(all(any(x.startswith(measured) for x in m) for m in parts), "a state holds more than estimates")


def require_accurate_step(proof: dict[str, Any], proven: dict[str, Any], code: "Bounded") -> dict[str, Any]:
    """State -> bound of what rounding adds to it; ValueError if a next state, estimate or the sum `check` lose digits.

    Of an output that may lose too many digits, nothing is said: its statement is removed from `proven`.
    """
    c, stored = proven["c"], {z: magnitudes(proven["before"][z]) for z in proven["moving"]}
    small, carried = bounded_by_one(code.known), argument_factors(code.known, c.precision)
    ones = code.ones()

    def accepted(x: str) -> Any:
        """The bound of x; ValueError if it is too large."""
        bound = without_bounded(substituted(code.bounds[x][0], stored), small)
        code.require_no_cancellation(code.names[x], f"{x}: {CANCELLATION}", own=x != "check")
        least = substituted(substituted(magnitudes(code.names[x]), carried), stored) + stored.get(x, kernel.Poly())
        least = without_bounded(least, small)
        for values in ({}, ones):  # a quotient counts as 1, and as what it is
            sizes = substituted(least, values), substituted(bound, values)
            code.compare(*sizes, f"{x}: {CANCELLATION}", own=x != "check")
        return bound

    estimates = [e["estimate"] for e in proof["errors"]]
    bounds = {x: accepted(x) for x in (*stored, *estimates, *["check"] * bool(c.sums))}
    for statements, x in [(each, x) for each in (proven["outputs"], proven["other than 0"]) for x in each]:
        try:
            accepted(x)
        except ValueError:
            del statements[x]
    operations = 2 + max(code.bounds[z][1] for z in stored)
    return {z: bounds[z] * kernel.term(operations) for z in stored}


def require_divisors_above_rounding(proof: dict[str, Any], proven: dict[str, Any], code: "Bounded") -> None:
    """Raises ValueError if a divisor may be so small somewhere in the box that it is mostly its rounding error."""
    for (function, q), _ in code.known.items():
        if function == "1/":
            size = max(total(substituted(magnitudes(q), code.ones())), code.divisors.get(q, Fraction(0)))
            least = size / proven["c"].precision.cancelled
            try:
                kernel.semidefinite([[q]], proven["box"], proof["cover"], proven["known"], least)
            except ValueError as why:
                raise ValueError(f"in a divisor {CANCELLATION}, where it is near 0 ({why})") from None


def require_accurate_formulas(proof: dict[str, Any], proven: dict[str, Any], code: "Bounded") -> None:
    """Raises ValueError if a formula of the proof with a rounded value in it may lose too many digits.

    Rounded are an exp, sine or cosine of a number, and a parameter that `prepare` computes (the C need not use it). In
    a formula these values alone are rounded, once: what cancels to 0 may be larger there, as in the linearisation of a
    Stribeck curve.
    """
    c, names, known = proven["c"], proven["names"], proven["known"]
    prepared = {x for x, _ in c.prepare}
    now = Bounded(names, dict(known), c.precision, code.bounds)
    for formula in {*texts(proof), "parameters.sample_time"}:
        if prepared.intersection(re.findall(NAME, formula)) or has_rounded_value(formula, names, known):
            now.require_accurate(now.value(formula), now.latest[0], MOST_CANCELLED)
    # A sample later a state without a formula may be the sine of a number, and a measured velocity may be.
    without_error = {*proven["aside"], *proof["acceleration"]} - {e["truth"] for e in proof["errors"]}
    later = Bounded(proven["later"], dict(known), c.precision)
    for formula in proof["states"].values():
        if without_error.intersection(re.findall(NAME, formula)):
            later.require_accurate(later.value(formula), later.latest[0], c.precision.cancelled)


def require_accurate_functions(proven: dict[str, Any]) -> None:
    """Raises ValueError if a function of the C besides the step sets a state or output that may lose its digits."""
    c = proven["c"]
    for program in (c.init, c.reset, c.predict, c.resume):
        text = from_any_state(proven, outputs=True)
        text.run(program, c.states)
        for target in {x for x, _ in program}:
            text.require_accurate(text.names[target], text.bounds[target][0])


def step(proof: dict[str, Any], proven: dict[str, Any]) -> "Bounded":
    """The step over inputs and states as they are stored, and its bounds: with their formulas, these would cancel."""
    c, names, before, known = proven["c"], proven["names"], proven["before"], dict(proven["known"])
    free = {x: p for x, p in names.items() if x not in c.outputs} | before
    free |= {z: kernel.term(1, z) for z in proven["moving"]}
    # What the outputs are, and so what the signs are of, as in errors.prove; then the bounds with these signs. One can
    # be that of an output that holds another one: so again with the signs that are found, until they stay the same.
    signs = dict[Any, Any]()
    for _ in range(len(proof["signs"]) + 3):
        met = known | signs
        outputs = kernel.Text(free, met, c.precision).run(c.step + c.commit, c.states + c.outputs)
        claim, before_this = kernel.Text(names | {x: outputs[x] for x in c.outputs if x in outputs}, met), signs
        pairs = [(names[s], claim.value(of)) for s, of in proof["signs"].items()]
        pairs += [(names[s], names[s] * p) for s in ("", *proof["signs"]) for p in map(claim.value, proof["domain"])]
        signs = {("sgn", kernel.term(way) * p): kernel.term(way) * s for s, p in pairs for way in (-1, 1)}
        if signs == before_this:
            break
    frame.demand(signs == before_this, "a sign of what depends on itself")
    known |= signs
    code = Bounded(free, known, c.precision, proven["rounded"])
    # A state that is a number, such as 1/49, or one times a sign, holds it rounded: 49 times it need not be 1.
    fixed = {z: p for z, p in before.items() if all(x[:5] == "sign." for x in p.names())}
    code.bounds |= {z: code.number(p) for z, p in fixed.items()}
    code.run(c.step + c.commit, c.states + c.outputs)
    return code


def parameter_bounds(c: Any, names: dict[str, Any], known: dict[Any, Any]) -> dict[str, tuple[Any, int]]:
    """Parameter -> its bound by lemma R: the polynomial of magnitudes, a number, and the n of its rounding errors."""
    values = {x: names[x] for x in c.values}
    made = Bounded({x: p for x, p in values.items() if x not in dict(c.prepare)}, dict(known), c.precision)
    made.bounds |= {x: made.number(p) for x, p in made.names.items()}
    made.run(c.prepare, [*values])
    bounds = {}
    for x, p in values.items():
        size, n = made.bounds.get(x, (magnitudes(p), 0))
        # The header's decimal may be off by 8 u of the formula's magnitudes (parameters), or be rounded itself.
        bounds[x] = size, (0 if n == 0 and c.values[x] == p.constant() and made.exact(p) else max(n, 8))
    return bounds


def from_any_state(proven: dict[str, Any], outputs: bool = False) -> "Bounded":
    """The C over its inputs and states (and held outputs) as they are, whatever these are, with bounds by lemma R."""
    c = proven["c"]
    free = {x: proven["names"][x] for x in c.values} | {x: kernel.term(1, x) for x in (*c.inputs, *c.states)}
    free |= {x: kernel.term(1, x) for x in c.outputs} if outputs else {}
    return Bounded(free, {}, c.precision, proven["rounded"])


def at_point(names: dict[str, Any], proven: dict[str, Any]) -> "Bounded":
    """Expressions where all or some names are numbers."""
    return Bounded(names, {}, proven["c"].precision, proven["rounded"])


def require_decay_when_rounded(
    proof: dict[str, Any], proven: dict[str, Any], code: "Bounded", off: dict[str, Any]
) -> None:
    """Raises ValueError unless V does not grow in a step whose states have rounding errors of up to u times ``off``.

    The proved dynamics are e -> F e, with V(F e) <= fall V(e); rounding changes them to F + D, |D| <= R entry by entry.
    In the norm sqrt(e'Pe), |F e + D e| <= (sqrt(fall) + r) |e| <= |e| with r = (1 - fall)/2, if e'D'P D e <= r r e'Pe.
    With S = R'|P|R and any d > 0, e'D'P D e is at most the sum over i and j of S_ij e_i^2 d_j/d_i. Where V is only
    said to grow by at most fall > 1, the same is demanded with r = (fall - 1)/2.
    """
    R, unit = [], kernel.term(code.precision.rounding / 8)
    stored = {z: magnitudes(proven["before"][z]) for z in off}
    size = {x: max(map(abs, ends)) for x, ends in proven["box"].items()}
    for shows in (magnitudes(code.names[e["estimate"]]) for e in proof["errors"]):
        used = {z: p for z, p in off.items() if z in shows.names()}
        change = sum((substituted(derivative(shows, z), stored) * p * unit for z, p in used.items()), kernel.Poly())
        row = {f"error of {e['truth']}": Fraction(0) for e in proof["errors"]}
        for m, c in change.items():
            for x in row.keys() & {*m}:
                row[x] += c * prod(size.get(y, 1) for y in m)  # at most
        R.append([*row.values()])
    P = proven["numbers"]["P"]
    (rows_R, by_R), (rows_P, by_P) = kernel.integers(R), kernel.integers(P)
    sizes = [[*map(abs, row)] for row in rows_P]
    S, by = forms.product([*zip(*rows_R, strict=True)], forms.product(sizes, rows_R, 0), 0), by_R * by_R * by_P
    bits = [(row[i].denominator.bit_length() - row[i].numerator.bit_length()) // 2 for i, row in enumerate(P)]
    d = [Fraction(2) ** n for n in bits]  # near 1/sqrt(P_ii)
    kept = ((1 - proven["fall"]) / 2) ** 2
    (less,), over = kernel.integers([[sum(map(mul, row, d)) / d[i] / by for i, row in enumerate(S)]])
    whole, unit = kept.numerator * over, kept.denominator * by_P  # r^2 P - diag(less), times over and unit
    rest = (tuple(whole * p - unit * less[i] * (i == j) for j, p in enumerate(row)) for i, row in enumerate(rows_P))
    frame.demand(kernel.positive(tuple(rest)), "V may grow by rounding")


def derivative(p: Any, x: str) -> Any:
    """The derivative of a polynomial with respect to one of its variables."""
    found = kernel.Poly()
    for m, c in p.items():
        if x in m:
            at = m.index(x)
            found += kernel.term(c * m.count(x), *m[:at], *m[at + 1 :])
    return found


def substituted(p: Any, values: dict[str, Any]) -> Any:
    """A polynomial with variables replaced by polynomials; ``values``: name of a variable -> its polynomial."""
    parts: dict[tuple[str, ...], Any] = {}  # names that are replaced -> what they are multiplied by
    terms = kernel.Poly()
    for m, c in p.items():
        if values.keys().isdisjoint(m):
            terms[m] = c
        else:
            replaced = tuple(x for x in m if x in values)
            parts.setdefault(replaced, kernel.Poly())[tuple(x for x in m if x not in values)] = c
    for names, part in parts.items():
        for m, c in (part * prod((values[x] for x in names), start=kernel.term(1))).items():
            terms[m] = terms[m] + c if m in terms else c
    return terms if all(terms.values()) else kernel.Poly({m: c for m, c in terms.items() if c})


def argument_factors(known: Any, precision: Any) -> dict[str, Any]:
    """Variable for a sin, cos or exp -> 1 + |argument|.

    The 1 is for the rounding of its own value, |argument| for that of the argument: the function passes on at most the
    whole error of its argument. As its value is at most 1, that counts only as far as ``cancelled`` times as much
    rounding is at most 1.
    """
    found: dict[str, Any] = {}
    for (function, argument), value in known.items():
        if function in ("sin", "cos", "exp"):
            size, most = magnitudes(argument), 8 / precision.rounding / precision.cancelled
            share = min(Fraction(1), most / (total(size) or 1))
            found |= dict.fromkeys(value.names(), kernel.term(1) + kernel.term(share) * size)
    return found


def bounded_by_one(known: Any) -> set[str]:
    """Variables of magnitude at most 1: signs, values of exp, and functions of an angle (t of lemma 7, kernel.py)."""
    small: set[str] = set()
    for (function, argument), value in known.items():
        if function in ("sgn", "exp") or {x[-2:] for x in argument.names()} == {" t"}:
            small |= value.names()
    return small


def without_bounded(p: Any, small: set[str]) -> Any:
    """A polynomial of magnitudes with 1 for each sign, each t of lemma 7, and each of the variables ``small``."""
    terms = kernel.Poly()
    for m, c in p.items():
        rest = tuple(x for x in m if not (x in small or x[:5] == "sign." or x[-2:] == " t"))
        terms[rest] = terms.get(rest, 0) + c
    return terms


def texts(part: Any) -> Iterator[str]:
    """All texts in a JSON value but the names of its fields."""
    if isinstance(part, str):
        yield part
    elif part:
        for inner in part.values() if isinstance(part, dict) else part:
            yield from texts(inner)


def has_rounded_value(formula: str, names: dict[str, Any], known: dict[Any, Any]) -> bool:
    """Whether a formula has a value that the kernel rounds to 50 digits: an exp, or a sine or cosine of a number."""
    if not re.search(NUMERIC, formula):  # (sin)(x) is a call too
        return False
    if re.search(r"(?<![\w.])exp\b", formula):
        return True
    met = {(function, of): v for (function, of), v in known.items() if of.names() or function not in ("cos", "sin")}
    kernel.Text(names, met).value(formula)
    return any(function in ("cos", "sin") and not of.names() for function, of in met)


class Bounded(kernel.Text):
    """Symbolic evaluation that also computes, of every assigned value, the polynomial and the n of lemma R.

    And two exponents of 2: a value of the C is 0 or at least 2^least, and a multiple of 2^grid. A number of the type is
    at least 2^least and so a multiple of 2^(least - digits). A sum of multiples of 2^grid is one again, rounded or not.

    Args:
        bounds: those of names that are already set; any other is its polynomial's magnitudes, and exact.
    """

    def __init__(
        self, names: dict[str, Any], known: Any, precision: Any, bounds: dict[str, tuple[Any, int]] | None = None
    ) -> None:
        super().__init__(names, known, precision)
        self.bounds, self.latest = dict(bounds or {}), (kernel.Poly(), 0)
        self.spaced, self.spacings = (FAR, FAR), dict[str, tuple[int, int]]()
        self.digits = precision.rounding.denominator.bit_length() + 1  # 52 of doubles, 23 of floats
        self.reciprocals: dict[str, Any] = {}
        self.divisors: dict[Any, Fraction] = {}  # divisor -> the sum of its bound's terms, all variables 1
        self.counted = 0  # of `known`, whose entries are never removed, those that `ones` has seen
        self.largest, self.smallest = dict[str, Any](), dict[str, Any]()  # of the C's quotients, see `ones`
        # Polynomial, bound and spacing of the parts of an expression, until the larger part that they are in has them.
        self.parts: dict[ast.expr, tuple[Any, tuple[Any, int], tuple[int, int]]] = {}

    def run(self, assignments: list[tuple[str, str]], writable: list[str]) -> dict[str, Any]:
        for name, value in assignments:
            super().run([(name, value)], writable)
            self.bounds[name], self.spacings[name] = self.latest, self.spaced
        return self.names

    def value(self, text: str) -> Any:
        """The polynomial of an expression; the attributes ``latest`` and ``spaced`` are then its bound and spacing."""
        self.parts.clear()
        p = super().value(text)
        parts = [*self.parts.values()] or [(p, self.number(p), self.term_spacing(p))]
        _, self.latest, self.spaced = parts[-1]
        self.parts.clear()
        return p

    def of(self, node: ast.expr, text: str) -> Any:
        """The polynomial of a part of an expression, which the kernel asks for after those that it is made of."""
        p = super().of(node, text)
        self.ones()
        if self.largest and not self.largest.keys().isdisjoint(p.names()):  # the kernel has seen the coefficients alone
            within = [self.precision.holds(substituted(magnitudes(p), end)) for end in (self.largest, self.smallest)]
            frame.demand(all(within), "a quotient, or a product with it, is too large or small")
        spacing = self.spacing(node, text, p)
        self.parts[node] = p, self.bound(node, text, p), spacing
        return p

    def is_exactly(self, name: str, p: Any, like: str = "") -> bool:
        """Whether a name is set to this polynomial, and rounds no further terms than its own, or those of ``like``.

        So 0 is just 0: a program asks whether a flag is, and v*(0.3 - 0.1 - 0.2) is -3e-17 v.
        """
        terms = self.bounds[like][0] if like else magnitudes(p)
        return name in self.bounds and self.names[name] == p and self.bounds[name][0] == terms

    def is_accurate(self, name: str) -> bool:
        """Whether no term of what is assigned to a name is mostly rounding error; with either value of each sign."""
        p, small = self.names[name], bounded_by_one(self.known)
        try:
            self.require_no_cancellation(p, CANCELLATION)
            self.compare(
                without_bounded(magnitudes(p), small), without_bounded(self.bounds[name][0], small), CANCELLATION
            )
        except ValueError:
            return False
        return True

    def require_accurate(self, p: Any, bound: Any, more: int = 1, why: str = CANCELLATION) -> Fraction:
        """``compare``, and ``require_no_cancellation`` before it; the result is that of ``compare``."""
        self.require_no_cancellation(p, why)
        return self.compare(p, bound, why, more)

    def settled(self, text: str) -> Any:
        """The polynomial of an expression; ValueError if it is a number of which rounding may have made another."""
        p = self.value(text)
        if not p.names():
            self.require_accurate(p, self.latest[0])
        return p

    def ones(self) -> dict[str, Any]:
        """Reciprocal -> 1 over the sum of the magnitudes of its divisor's terms, with all variables 1.

        Also sets ``largest`` and ``smallest``: powers of 2 between which a quotient of the C is. `require` shows that
        the divisor is not below that sum over ``cancelled``; with quantities up to ``usual`` it is not above the sum
        of its terms. Those of lemma 7, which are between 1/2 and 1 and are no quotients of the C, are left out.
        """
        new, self.counted = [*islice(self.known.items(), self.counted, None)], len(self.known)
        for (function, q), r in new:
            if function == "1/" and not r.names() <= self.reciprocals.keys():
                (x,), size = r.names(), total(substituted(magnitudes(q), self.reciprocals))
                self.reciprocals[x] = kernel.term(1 / size)
                if {y[-2:] for y in q.names()} != {" t"}:
                    self.largest[x] = kernel.term(self.precision.cancelled * Fraction(2) ** (1 - power(size)))
                    self.smallest[x] = kernel.term(Fraction(2) ** (-1 - power(self.most(q))))
        return self.reciprocals

    def most(self, p: Any) -> Fraction:
        """The sum of the magnitudes of p's terms, with quantities as large as ``usual``, quotients as ``largest``."""
        terms = substituted(magnitudes(p), self.largest)
        usual = self.precision.usual
        return sum((c * usual ** degree(x for x in m if x[-2:] != " t") for m, c in terms.items()), Fraction(0))

    def term_spacing(self, p: Any) -> tuple[int, int]:
        """The spacing of a number, a quantity or a product of them; of a sum, that of its smallest term.

        What is named otherwise stands for a function or a quotient, of which this says nothing.
        """
        if not all(x.startswith((*frame.QUANTITIES, "sign.")) for x in p.names()):
            return -FAR, -FAR
        small = [power(Fraction(abs(c)) / self.precision.usual ** degree(m)) - 1 for m, c in p.items()]
        least = min(small, default=FAR)
        grid = least - self.digits
        if not p.names():
            of = Fraction(p.constant()).denominator
            grid = max(grid, 1 - of.bit_length()) if of & (of - 1) == 0 else grid
        return (least if len(small) < 2 else grid), grid

    def spacing(self, node: ast.expr, text: str, p: Any) -> tuple[int, int]:
        """(least, grid) of a part of an expression with the polynomial p, of those of its own parts.

        No number of the type is nearer to a multiple of pi/2 than 2^-(digits + 9), but for 0: of all doubles the
        nearest is 4.7e-19 away, of all floats 1.6e-9. What may underflow, and a sum in which a term cancels, has the
        exponents -FAR, and so has what is made of it.
        """
        of = [self.parts[part][2] for part in ast.iter_child_nodes(node) if part in self.parts]
        match node:
            case ast.Constant():
                return self.term_spacing(p)
            case ast.UnaryOp() | ast.Call(ast.Name("fabs")):
                return of[0]
            case ast.Call(ast.Name("sgn")):
                return 0, 0
            case ast.Call(ast.Name(name)):
                least = min(of[0][0] - 1, -self.digits - 9) if name in ("sin", "cos") else 0
                grid = least - self.digits
            case ast.BinOp(left, ast.Add() | ast.Sub(), right):
                kept = {*self.parts[left][0], *self.parts[right][0]} == {*p}
                least = grid = min(grid for _, grid in of) if kept else -FAR
            case ast.BinOp(_, ast.Mult(), _):
                (a, i), (b, j) = of
                least, grid = a + b, max(a + b - self.digits, i + j)
            case ast.BinOp(_, ast.Div(), divisor):
                least = of[0][0] - power(self.most(self.parts[divisor][0])) - 1
                grid = least - self.digits
            case _:
                return self.spacings.get(text[node.col_offset : node.end_col_offset]) or self.term_spacing(p)
        holds = least > -power(Fraction(self.precision.most)) and (-FAR, -FAR) not in of
        return (least, grid) if holds else (-FAR, -FAR)

    def require_no_cancellation(self, p: Any, why: str, more: int = 1, own: bool = False) -> None:
        """Raises ValueError where terms of p cancel only once its reciprocals are multiplied out.

        Examples are sin^2 + cos^2 - 1 (kernel lemma 7) and 3q/q - 3. With reciprocals as variables these polynomials
        are not 0, so `compare` alone would not see that they are rounding error only.
        """
        if {f for f, _ in self.known}.isdisjoint({"1/"}):
            return
        joined, ones = p, self.ones()
        for (function, q), r in reversed(self.known.items()):
            (x,) = r.names() if function == "1/" else ("",)
            if n := max((m.count(x) for m in joined), default=0):
                joined = kernel.replaced(joined, x, kernel.term(1), q) * kernel.term(ones[x].constant() ** n)
        small = bounded_by_one(self.known)
        terms = without_bounded(substituted(magnitudes(p), ones), small)
        self.compare(without_bounded(magnitudes(joined), small), terms, why, more, own)

    def compare(self, p: Any, bound: Any, why: str, more: int = 1, own: bool = False) -> Fraction:
        """The ratio of a bound to the magnitudes of p, all variables 1; ValueError if a term is mostly rounding error.

        A constant, such as a force that is nearly balanced, and a term that cancels to 0 may have as much rounding
        error as ``more`` times all terms of p together. A term that cancels may not have a higher degree than these:
        with large quantities its rounding error would exceed them.

        Args:
            own: whether a term that cancels may have only as much as the terms of p in its own quantities, a constant
                only as much as those without an input: the terms of an input that is never used are 0.
        """
        factors = argument_factors(self.known, self.precision)
        left, highest = total(p), max(map(degree, substituted(p, factors)), default=0)
        still = sum((abs(c) for m, c in p.items() if not any(x.startswith("inputs.") for x in m)), Fraction(0))
        for term, size in bound.items():
            cancels, these = term not in p and degree(term) <= highest, left
            if own:
                these = sum(abs(c) for m, c in p.items() if {*m} <= {*term}) if term and cancels else still
            rest = more * these if not term or cancels else 0
            frame.demand(size <= max(self.precision.cancelled * abs(p.get(term, 0)), rest), why)
        return total(bound) / left if bound else Fraction(1)

    def number(self, p: Any) -> tuple[Any, int]:
        """The bound of a number that is written down."""
        return magnitudes(p), int(not self.exact(p))

    def bound(self, node: ast.expr, text: str, p: Any) -> tuple[Any, int]:
        """The bound of a part of an expression with the polynomial p, of those of its own parts."""
        match node:
            case ast.Constant():
                return self.number(p)
            case ast.UnaryOp(_, operand):
                return self.parts.pop(operand)[1]
            case ast.Call(ast.Name(name), [argument], []):
                of, (size, n), (least, _) = self.parts.pop(argument)
                self.require_no_cancellation(of, CANCELLATION, int(name != "sgn"))
                self.compare(of, size, CANCELLATION)
                if name == "sgn":
                    frame.demand(least > -FAR, "a sign of what may be 0 by underflow or rounding")
                    exps = set().union(*(v.names() for (f, _), v in self.known.items() if f == "exp"))
                    frame.demand(exps.isdisjoint(of.names()), "a sign of an exp, which may underflow to 0")
                if name in ("fabs", "sgn"):
                    sign = magnitudes(kernel.function("sgn", of, self.known))
                    return (sign * size, n) if name == "fabs" else (sign, 0)
                p = magnitudes(p)
                return (p + size * p if name == "exp" else p + size) if n else p, n + 4
            case ast.BinOp(left, operator, right):
                (_, (a, n), _), (divisor, (b, m), _) = self.parts.pop(left), self.parts.pop(right)
                if isinstance(operator, ast.Div):
                    size = total(substituted(b, self.ones()))
                    self.divisors[divisor] = max(size, self.divisors.get(divisor, size))
                    name = text[right.col_offset : right.end_col_offset]
                    lost = self.require_accurate(divisor, b, MOST_CANCELLED, f"in the divisor {name} {CANCELLATION}")
                    b = magnitudes(kernel.function("1/", divisor, self.known)) * kernel.term(lost)
                if not n and not m and self.exact(p):
                    return magnitudes(p), 0
                return (a + b, max(n, m) + 1) if isinstance(operator, (ast.Add, ast.Sub)) else (a * b, n + m + 1)
        return self.bounds.get(text[node.col_offset : node.end_col_offset]) or (magnitudes(p), 0)

    def exact(self, p: Any) -> bool:
        """Whether p is a sum of signs and short numbers, which is computed without rounding."""
        signs = {x for (f, _), v in self.known.items() if f == "sgn" for x in v.names()}
        named = all(x in signs or x[:5] == "sign." for x in p.names())
        return named and total(p) <= MOST and all(PART % Fraction(c).denominator == 0 for c in p.values())


def magnitudes(p: Any) -> Any:
    """A polynomial with the magnitudes of its coefficients."""
    return kernel.Poly({m: abs(c) for m, c in p.items()})


def degree(monomial: Iterable[str]) -> int:
    """How many quantities a monomial is a product of."""
    return sum(x.startswith(frame.QUANTITIES) for x in monomial)


def power(x: Fraction) -> int:
    """A whole n with 2^(n - 1) < x < 2^(n + 1), for x > 0."""
    return x.numerator.bit_length() - x.denominator.bit_length()


def total(p: Any) -> Fraction:
    """The sum of the magnitudes of a polynomial's coefficients."""
    return Fraction(sum(map(abs, p.values())))
