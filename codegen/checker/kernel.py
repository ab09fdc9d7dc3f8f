"""The kernel: it verifies proof.json, the claimed error dynamics of an observer, against the text of its C code.

Standard library only; verify.py runs it on files. Lemmas 1 to 6 are in algebra.py: polynomials, and when a matrix of
polynomials is positive semidefinite over a box.

THEOREM. Let the step of NAME.c run in exact arithmetic with the values of NAME_PARAMETERS, from any state and on any
inputs, in samples with fault 0. Let a machine move by v[k+1] = v[k] + h acceleration[k] and x[k+1] = x[k] + h v[k]
("semi_implicit": h v[k+1]; "exponential": h ((1 - q) v[k] + q v[k+1]) with a number q = `mean` of x in [0, 1]), the
positions x and those v that are inputs measured exactly, all else of it constant.
Assume further, at each sample:
- every sign is 1 or -1, the same in machine and code, and does not change from one sample to the next;
- every expression of `domain` is positive;
- a state whose formula in `states` contains no estimate has the value of that formula.
Let e = sign * (truth - estimate) be the errors. A state with a formula is determined by estimates and measurements, so
e describes all of these states. Then
- e[k+1] = matrix e[k] + rest, exactly, or to first order in e where the result says "first order";
- V(matrix e) <= (1 - 2 decay_rate h) V(e) with V = e'Pe, wherever the variables are in `box`. A variable of the box is
  a truth times the sign that `along` assigns to it, by default the sign of its error.
Nothing is claimed about states without a formula (`aside`). Those listed in `shared` are assumed to be states of the
machine too, with the same values (a clock, a delay line, a lag).
Trusted: this file, algebra.py, frame.py, which reads the C, Python, and that the machine is yours. Not covered:
rounding, samples with a fault, and the sample in which a sign changes. theorem.py verifies the further fields of a
proof: `mass_matrix`, `force`, `reversals`, how `shared` states move, that no state of `aside` can feed a growing value
back, and, by an example point, that `domain` and `box` are not empty.
"""

import ast
import re
from decimal import Context
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import algebra, frame

demand = frame.demand  # raises ValueError if a condition fails or the time limit is reached
Poly = algebra.Poly
Known = algebra.Known
LEAST, term, times, integers, positive = algebra.LEAST, algebra.term, algebra.times, algebra.integers, algebra.positive
joined, cleared, semidefinite, contracts = algebra.joined, algebra.cleared, algebra.semidefinite, algebra.contracts


# LEMMA 7. An angle has signs k and m, of its cosine and sine, and a t in [0, 1], the tangent of half of the angle
# between 0 and pi/2 that has the same cosine and sine but for them: they are k (1 - t^2)/(1 + t^2) and m 2 t/(1 + t^2).
# Any other sign, and a reciprocal, is a variable too, one for each argument: what holds for all values holds for that.
# LEMMA 8. With d the terms of p that hold an error, exp(p) = exp(p - d) (1 + d + d d r), r a number for each d: it is
# (exp(d) - 1 - d)/d^2, near 1/2 for small errors. Where q >= 0, exp(-q) = u/(1 + q + q^2/2 + q^3/6) with a u in [0, 1],
# since exp(q) is not below that sum. Of a number, exp is taken to 50 digits.
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
    if name == "exp" and not p.names():
        digits = Context(50).exp(Context(99).divide(*p.constant().as_integer_ratio()))
        demand(digits, "exp of a number that is too small")
        return known.setdefault((name, p), term(Fraction(digits)))
    if name == "exp" and (d := Poly({m: c for m, c in p.items() if any(x[:9] == "error of " for x in m)})):
        return function(name, p - d, known) * (term(1) + d + d * d * function("exp beyond", d, known))
    return known.setdefault((name, p), term(1, f"?{len(known)}"))


# LEMMA 9. Names, numbers, calls of functions of doubles and + - * / ( ) mean the same in Python and in C, but for whole
# numbers, which C divides otherwise (frame.py lets none pass), and for what EXPRESSION does not let pass. Assignments
# are run in their order; a local or an output that is not set yet has no value.
NUMBER = f"-?{frame.WHOLE}(/{frame.WHOLE})?"  # most of a matrix; as an expression it is the same
EXPRESSION = r"(?!.*(--|\+\+|\*\*|//|\b[0-9][0-9.]*+(?:e[+-]?[0-9]++)?+[A-Za-z_]))[A-Za-z0-9_. ()\[\]+*/-]{1,20000}"


def tree(text: str) -> ast.expr:
    demand(re.fullmatch(EXPRESSION, text), f"{text[:80]!r} is no expression")
    return ast.parse(text, mode="eval").body


SHORT, short, long = 200, lru_cache(500)(tree), lru_cache(8)(tree)  # many long ones would fill the memory


def parsed(text: str) -> ast.expr:
    """The syntax tree of an expression, which is read several times."""
    return (short if len(text) < SHORT else long)(text)


class Text:
    """Symbolic evaluation of expressions and assignments, exactly, as polynomials.

    `names` maps each readable name to its polynomial. `known` maps (function, argument) to the polynomial that stands
    for its value; a new function value gets a new variable there. Raises ValueError for anything else, and for numbers
    beyond `precision`.
    """

    def __init__(self, names: dict[str, Poly], known: Known, precision: Any = frame.EXACT) -> None:
        self.names, self.known, self.precision = dict(names), known, precision

    def value(self, text: str) -> Poly:
        if re.fullmatch(NUMBER, text := text.strip(" ")):
            return term(Fraction(text))
        return self.of(parsed(text), text)

    def of(self, node: ast.expr, text: str) -> Poly:
        here = text[node.col_offset : node.end_col_offset]
        match node:
            case ast.Constant():
                demand(re.fullmatch(f"{frame.DOUBLE}|{frame.WHOLE}", here), f"{here} is out of place")
                return term(Fraction(here))
            case ast.UnaryOp(ast.USub(), operand):
                return Poly() - self.of(operand, text)
            case ast.Call(ast.Name(name), [argument], []):
                demand(name in ("cos", "exp", "fabs", "sgn", "sin"), f"C calls {name}")
                done = function(name, self.of(argument, text), self.known)
            case ast.BinOp(left, operator, right):
                a, b = self.of(left, text), self.of(right, text)
                b = function("1/", b, self.known) if isinstance(operator, ast.Div) else b
                done = a + b if isinstance(operator, ast.Add) else a - b if isinstance(operator, ast.Sub) else a * b
            case _:
                demand(here in self.names, f"{here[:80]} is nothing that is known here")
                return self.names[here]
        demand(self.precision.holds(done), "a number is too large or small, or a power")
        return done

    def run(self, assignments: list[tuple[str, str]], writable: list[str]) -> dict[str, Poly]:
        for name, value in assignments:
            demand("." not in name.split("[")[0] or name in writable, f"{name} is set")
            self.names[name] = self.value(value)
        return self.names


@frame.limited()
def prove(proof: dict[str, Any], files: dict[str, str]) -> dict[str, Any]:
    """Verifies the theorem above for a proof and its files (name: text); ValueError if it is not shown.

    Returns the polynomials that further checks use: of the C, the names, states before and after a sample, the matrix.
    """
    signs, errors, formulas, velocity = (proof[x] for x in ("signs", "errors", "states", "positions"))
    c = frame.read(proof["name"], files)
    # Parameters are what `prepare` makes of the values, exactly: the decimals there are that, rounded. But one that is
    # the exp of a number is its decimal, for all that is made of it, and so is this exp wherever it stands, but exp(0).
    known: Known = {}
    decimals: Known = {}  # of an exp: one, or those of many parameters could lead away from it
    prepared = Text({x: term(v) for x, v in c.values.items() if x not in dict(c.prepare)}, known, c.precision)
    for parameter, text in c.prepare:
        exact = prepared.run([(parameter, text)], [*c.values])[parameter]
        decimal = c.values.get(parameter, exact.constant())
        demand(abs(exact.constant() - decimal) <= abs(decimal) * c.precision.rounding, "prepare gives others")
        exps = {(f, p): term(decimal) for (f, p), e in known.items() if f == "exp" and p and e == exact}
        demand(all(decimals.setdefault(key, e) == e for key, e in exps.items()), "prepare gives others")
        known |= exps
        prepared.names |= {parameter: term(decimal)} if exps else {}
    # Free are inputs, truth, signs, errors, and states without a formula. An estimate is truth less sign * error.
    truths, estimates, turned = ([e[part] for e in errors] for part in ("truth", "estimate", "sign"))
    hidden, aside = [f"error of {x}" for x in truths], [z for z in c.states if z not in formulas]
    along = dict(zip(truths, turned, strict=True)) | proof.get("along", {})
    named = all(re.fullmatch(rf"{of}\.\w+", x, re.A) for of, all_ in (("true", truths), ("sign", signs)) for x in all_)
    named = named and {*along} == {*truths} and {*turned, *along.values()} <= {"", *signs}
    demand(named and len({*truths}) == len({*estimates} & {*c.outputs}) == len(errors) <= 100, "not so named")
    names = {p: prepared.names[p] for p in c.values} | {"": term(1)}
    names |= {x: term(1, x) for x in (*c.inputs, *truths, *signs, *aside)}
    # A sign is that of a polynomial with an estimate or a measured velocity, and without a truth: that of an error is
    # 0 in the machine. So there are points where it is 1 in machine and code.
    slips = {*estimates, *velocity.values()}
    visible = {x: p for x, p in names.items() if x not in (*truths, *signs, *aside)}
    visible |= {x: term(1, x) for x in estimates}
    sign_arguments = [Text(visible, {}).value(of).names() for of in signs.values()]
    demand(all(x & slips and visible.keys() >= x for x in sign_arguments), "no sign of a slip")
    names |= {t: names[s] * names[t] for t, s in along.items()}
    machine, error = Text(names, known), [term(1, e) for e in hidden]
    triples = [(y, t, names[s]) for y, t, s in zip(estimates, truths, turned, strict=True)]
    names |= {y: names[t] - s * e for (y, t, s), e in zip(triples, error, strict=True)}
    claim = Text(names, known)
    sign_definitions = [(names[s], claim.value(of)) for s, of in signs.items()]
    positive_products = [(names[s], names[s] * p) for s in ("", *signs) for p in map(claim.value, proof["domain"])]
    for s, p in sign_definitions + positive_products:  # s p > 0 tells that s is the sign of p
        known |= {("sgn", term(way) * p): term(way) * s for way in (-1, 1)}
    # LEMMA 10. From the states that formulas of n estimates give, the n of them that move with one, `step` shows these
    # same estimates: a map of R^n to R^n that is one-to-one, hence, being polynomial, onto (linear algebra where it is
    # affine, else Bialynicki-Birula and Rosenlicht 1962). So every state is met, and shows its estimates.
    before = {z: claim.value(of) for z, of in formulas.items()}
    moving = [z for z, p in before.items() if not p.names().isdisjoint(hidden)]
    with_errors = {*hidden}  # and the values of functions of these
    for (_, of), p in known.items():
        with_errors |= p.names() - {*signs} if of.names() & with_errors else set()
    demand({*before} <= {*c.states} and len(moving) == len(errors), "not an error for each state")
    polynomial = all(p.names() & with_errors <= {*hidden} for p in before.values())
    demand(polynomial, "a state is no polynomial of the estimates")
    code = Text({x: p for x, p in names.items() if x not in c.outputs} | before, known, c.precision)
    code.run(c.step, [])
    after = code.run(c.commit, c.states + c.outputs)
    demand(all(after[y] == names[y] for y in estimates), "the states do not show the estimates")
    # The machine a sample later, and the states that show the errors which the matrix gives: they are the code's.
    phi = [[machine.value(x) for x in row] for row in proof["matrix"]]
    rate, h = {v: machine.value(a) for v, a in proof["acceleration"].items()}, names["parameters.sample_time"]
    rest = [*map(machine.value, proof.get("rest", ["0"] * len(errors)))]
    moves = {*velocity.values()} <= {*rate} <= {*truths, *c.inputs} and {*velocity} <= {*c.inputs} - {*rate}
    demand(moves, "not a velocity for each position")
    later = names | {z: after[z] for z in aside} | {x: term(1, f"{x} later") for x in c.inputs}
    later |= {v: names[v] + h * rate[v] for v in rate}
    ends, mean = {"euler": "0", "semi_implicit": "1"}, proof.get("mean", {})
    demand(proof["step"] in (["exponential"] if mean else ends), "a step of another mean velocity")
    shares = {x: machine.value(q) for x, q in (mean or dict.fromkeys(velocity, ends.get(proof["step"], ""))).items()}
    demand({*shares} == {*velocity} and all(0 <= q.constant() <= 1 for q in shares.values()), "no mean velocity")
    later |= {x: names[x] + h * (names[v] + shares[x] * (later[v] - names[v])) for x, v in velocity.items()}
    next_errors = [e + r for (e,), r in zip(times(phi, [[e] for e in error], Poly()), rest, strict=True)]
    expected = Text(later | {y: later[t] - s * e for (y, t, s), e in zip(triples, next_errors, strict=True)}, known)
    remainders = {z: cleared(after[z] - expected.value(of), known) for z, of in formulas.items()}
    # A term of more than one error is beyond the first order; where such are left, that is said.
    wrong = [z for z, p in remainders.items() for m in p if z not in moving or sum(x in hidden for x in m) < 2]
    demand(not wrong, f"the matrix does not move the errors: {wrong[:3]}")
    # V falls, by the lemmas of the algebra.
    box = {x: [machine.value(end).constant() for end in (low, high)] for x, (low, high) in proof["box"].items()}
    fall = 1 - 2 * machine.value(proof["decay_rate"]).constant() * h.constant()
    demand({*box} <= {*c.inputs, *truths} and fall > 0 < h.constant(), "a box of no free variable, or V negative")
    entries = {x: machine.value(x).constant() for row in proof["lyapunov_matrix"] for x in row}  # most stand twice
    P = [[term(entries[x]) for x in row] for row in proof["lyapunov_matrix"]]
    for p in (p for name, p in [*known] if name == "1/"):
        semidefinite([[p]], box, proof["cover"], known, LEAST)
    contracts(phi, P, fall, box, proof["cover"], known)
    conditions = proof["domain"] or box or any(rest) or aside or len(moving) < len(formulas)
    result: dict[str, Any] = {"c": c, "names": names, "known": known, "aside": aside, "moving": moving}
    result |= {"before": before, "after": after, "matrix": phi, "first order": any(remainders.values())}
    return result | {"fall": fall, "box": box, "along": along, "whole": not conditions}
