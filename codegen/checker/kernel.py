"""The kernel: whether a proof is one of the C beside it. Standard library only: python3 kernel.py FOLDER < PROOF.json

THEOREM. Let NAME.c run in exact arithmetic with the values of NAME_PARAMETERS, in samples with fault 0, from any state,
on any inputs. Let a machine have mass_matrix * acceleration = force, its positions (and velocities that are inputs) be
measured exactly, x[k+1] = x[k] + h v[k] ("semi_implicit": h v[k+1]), v[k+1] = v[k] + h acceleration[k], all else
constant. While every sign is 1 or -1, the same in machine and code and from sample to sample, all of `domain` positive,
and states whose formula holds no estimate are as it says, the errors e = sign * (truth - estimate) of all other states
move by e[k+1] = matrix e[k] + rest (to first order in e, if it says so; of states without a formula, `aside`, nothing
is said); and V(matrix e) <= (1 - 2 decay_rate h) V(e), V(e) = e'Pe, over the box, truths in it times their sign. With
one sign turned V is at most `growth` V, and after `dwell` samples with no turn or rest not above V.
Trusted: this file, Python, that the machine is yours. Not covered: rounding, faults, turns.
"""

import ast
import json
import re
import sys
from fractions import Fraction
from itertools import product
from math import lcm, prod
from pathlib import Path
from typing import Any, ClassVar


def demand(holds: Any, why: str, steps: int = 0) -> None:
    Poly.work += steps  # each of about a microsecond, so that no file takes more than seconds
    if not holds or Poly.work > 5_000_000:
        raise ValueError("more work than the limit" if holds else why)


# LEMMA 1. A polynomial is {monomial: coefficient, not 0}, a monomial its names, sorted, each as often as its power. Two
# are the same real function just if they are the same here. A name of Poly.signs is 1 or -1: pairs of it are left out.
# Poly.divisors: what a reciprocal is one of, by its name (lemma 6).
class Poly(dict[tuple[str, ...], Any]):
    signs, work = frozenset[str](), 0
    divisors: "ClassVar[dict[str, Poly]]"

    def size(self) -> int:
        bits = [(len(m), c.numerator.bit_length(), c.denominator.bit_length()) for m, c in self.items()]
        return max((n + max(a, b) // 9 + abs(a - b) * 3 // 5 for n, a, b in bits), default=0)

    def __add__(self, other: "Poly") -> "Poly":
        demand(True, "", len(self) + len(other))
        terms = self | {m: self.get(m, 0) + c for m, c in other.items()}
        return Poly({m: c for m, c in terms.items() if c})

    def __sub__(self, other: "Poly") -> "Poly":
        return self + term(-1) * other

    def __mul__(self, other: "Poly") -> "Poly":
        demand(True, "", len(self) * len(other) * (9 + max(self.size(), other.size())) // 18)
        terms: dict[tuple[str, ...], Any] = {}
        pairs = self.signs & self.names() & other.names()
        for (m, c), (n, d) in product(self.items(), other.items()):
            names = [x for x in m + n if not (x in pairs and x in m and x in n)] if pairs else m + n
            monomial = tuple(sorted(names))
            terms[monomial] = terms.get(monomial, 0) + c * d
        return Poly({m: c for m, c in terms.items() if c})

    def names(self) -> set[str]:
        return {name for m in self for name in m}

    def constant(self) -> Fraction:
        demand(not self.names(), f"{sorted(self.names())[:3]} in place of a number")
        return Fraction(self.get((), 0))


ZERO, Poly.divisors = Poly(), {}
Matrix = list[list[Any]]
Box = dict[str, tuple[Fraction, Fraction]]


def term(c: Any, *names: str) -> Poly:
    c = Fraction(c)
    return Poly({names: c.numerator if c.denominator == 1 else c} if c else {})  # whole numbers are fast


def times(A: Any, B: Any, zero: Any = ZERO) -> Matrix:
    columns = list(zip(*B, strict=True))
    return [[sum((a * b for a, b in zip(row, c, strict=True) if a and b), zero) for c in columns] for row in A]


# LEMMA 2. Let p be the first diagonal entry of a symmetric A, r the rest of its row, B what is left without both. If
# p > 0, A is positive semidefinite (definite) just if B - r r'/p is; if p = 0, semidefinite just if r = 0 and B is; if
# p < 0, never. Times p and over the last p, entries that are whole stay whole (Bareiss).
def positive(A: Matrix, definite: bool = False) -> bool:
    bits = sum(x.denominator.bit_length() for row in A for x in row)
    demand([*zip(*A, strict=True)] == [*map(tuple, A)], "a matrix is not symmetric", bits * bits // 10**6)
    rest, last = whole(A), 1
    while rest:
        (p, *r), *rest = rest
        demand(True, "", len(r) ** 2 * (1 + max(p, last, *map(abs, r)).bit_length() // 500) ** 2)
        if p < 0 or (p == 0 and (definite or any(r))):
            return False
        rest = [[(p * x - a * b) // last if p else x for x, b in zip(row, r, strict=True)] for a, *row in rest]
        last = p or last
    return True


def whole(A: Matrix) -> list[list[int]]:
    """A times the least number > 0 by which it is whole."""
    common = lcm(*(x.denominator for row in A for x in row))
    return [[int(x * common) for x in row] for row in A]


# LEMMA 3. Let B > 0, and n be the highest power of x in A. A with T/B for x, times B^n, has no fractions, and is 0, or
# positive semidefinite, just where A is.
def replaced(A: Matrix, x: str, top: Poly, below: Poly) -> Matrix:
    most = max((m.count(x) for row in A for p in row for m in p), default=0)
    powers = [prod([top] * n + [below] * (most - n), start=term(1)) for n in range(most + 1)]

    def put(p: Poly) -> Poly:
        parts = [Poly() for _ in powers]
        for m, c in p.items():
            parts[m.count(x)][tuple([y for y in m if y != x])] = c
        return sum((part * power for part, power in zip(parts, powers, strict=True)), ZERO)

    return [[put(p) for p in row] for row in A] if most else A


# LEMMA 4. On a cell every x is low s + high t over s + t, s and t >= 0 and s + t = 1. With this for x (lemma 3) A is a
# sum of products of such s and t, which are >= 0, times matrices (Bernstein's form).
def coefficients(A: Matrix, cell: Box) -> set[Any]:
    """These matrices, times one whole number > 0."""
    common = lcm(*(c.denominator for row in A for p in row for c in p.values()))
    A = [[Poly({m: int(c * common) for m, c in p.items()}) for p in row] for row in A]
    for x in sorted({x for row in A for p in row for x in p.names()}):
        demand(x in cell, f"{x} without a range")
        ((low, high, one),) = whole([[*cell[x], Fraction(1)]])
        s, t = (f"{x} low",), (f"{x} high",)
        A = replaced(A, x, Poly({s: low, t: high}), Poly({s: one, t: one}))
    monomials = {m for row in A for p in row for m in p}
    return {tuple(tuple(p.get(m, 0) for p in row) for row in A) for m in monomials}


# LEMMA 5. The two parts of a cell cut between its ends cover it: what holds on every leaf of a tree of cuts holds on
# the box. On a leaf a matrix of polynomials is positive semidefinite if all its coefficients are.
def on_leaves(holds: Any, A: Matrix, cell: Box, tree: Any, what: str) -> None:
    while tree != "":
        (x, cut, below, above), (low, high) = tree, cell[tree[0]]
        demand(re.fullmatch("-?[0-9]{1,40}(/[1-9][0-9]{0,39})?", cut), f"{x} is cut at no number")
        demand(low < (cut := Fraction(cut)) < high, f"{x} is not cut between its ends")
        on_leaves(holds, A, cell | {x: (low, cut)}, below, what)
        cell, tree = cell | {x: (cut, high)}, above
    demand(True, "", 100)
    demand(all(map(holds, coefficients(A, cell))), f"{what} in {cell}")


def semidefinite(A: Matrix, cell: Box, tree: Any) -> None:
    on_leaves(positive, A, cell, tree, "not positive semidefinite")


def above_zero(A: Matrix, cell: Box, tree: Any) -> None:
    """A is definite: A - 1e-99 is semidefinite."""
    least = [[p - term(Fraction(int(i == j), 10**99)) for j, p in enumerate(row)] for i, row in enumerate(A)]
    semidefinite(cleared(least), cell, tree)


# LEMMA 6. Let p > 0, and r be a new variable with r p = 1. Then 1/p for r in A, times a power of p, is lemma 3's. From
# the last r on, since a later p may hold earlier r. That every p > 0 is left to be shown.
def cleared(A: Matrix) -> Matrix:
    for r, p in reversed(Poly.divisors.items()):
        A = replaced(A, r, term(1), p)
    return A


def key(kind: str, p: Poly) -> tuple[str, Any]:
    demand(True, "", len(p) * (9 + p.size()) // 9)
    return kind, frozenset(p.items())


def reciprocal(p: Poly, known: dict[Any, Poly]) -> Poly:
    """1/p: a number, or the variable for it, of a name that no other has, whoever asks."""
    if not p.names():
        return term(1 / p.constant())
    if (of := key("1/", p)) not in known:
        known[of] = term(1, name := f"?1/{len(Poly.divisors)}")
        Poly.divisors = Poly.divisors | {name: p}
    return known[of]


# LEMMA 7. Every angle has signs k and m, of its cosine and sine, and a t in [0, 1], the tangent of half of the angle
# between 0 and pi/2 that has the same cosine and sine but for them: they are k (1 - t^2)/(1 + t^2) and m 2 t/(1 + t^2).
def angle(name: str, p: Poly, known: dict[Any, Poly]) -> Poly:
    """The sine or cosine of p, over variables of its own: of x they are called x t, x k and x m."""
    if key("cos", p) not in known:
        alone = len(p.names()) == 1 and p == term(1, min(p.names()))
        own = min(p.names()) if alone else f"?{len(Poly.divisors)}"
        t, k, m = (term(1, f"{own} {x}") for x in "tkm")
        Poly.signs = Poly.signs | k.names() | m.names()
        u = reciprocal(term(1) + t * t, known)
        known[key("cos", p)], known[key("sin", p)] = k * (term(2) * u - term(1)), term(2) * m * t * u
    return known[key(name, p)]


def ranges() -> Box:
    """Those of the signs, and of the tangents."""
    tangents = {x for p in Poly.divisors.values() for x in p.names() if x.endswith(" t")}
    return {x: (Fraction(-(x in Poly.signs)), Fraction(1)) for x in Poly.signs | tangents}


# LEMMA 8. Let D > 0 and N be polynomials, P definite, N/D = F. With the Bernstein coefficients d > 0 and n of D and N,
# F is the mean of the matrices n/d with weights that are the products times d over D. |x|^2 = x'Px is convex, so that
# F'PF <= f P (semidefinite) if n'Pn <= f d^2 P of all. At one point each this is also D > 0.
def contracts(F: Matrix, P: Matrix, f: Fraction, cell: Box, tree: Any) -> None:
    P, (a, b) = whole(P), f.as_integer_ratio()

    def falls(C: Matrix) -> bool:
        *n, (d, *_) = C
        demand(True, "", len(P) ** 3 // 2)
        moved = times(zip(*n, strict=True), times(P, n, 0), 0)
        gap = [[a * d * d * p - b * x for p, x in zip(*rows, strict=True)] for rows in zip(P, moved, strict=True)]
        return d > 0 and positive(gap)

    on_leaves(falls, cleared([*F, [term(1)] * len(P)]), cell, tree, "V may not fall")


# LEMMA 9. Names, numbers, calls of functions of doubles and + - * / ( ), of what EXPRESSION lets pass, mean the same in
# Python and in C, whose -> is a dot here; whole numbers, which C divides otherwise, stand in indices only, as sums of
# three below 10^4, which fit any int. A loop is the sequence of its bodies, each with locals of its own.
EXPRESSION = r"(?!.*(--|\+\+|\*\*|//))[A-Za-z0-9_. ()\[\]+*/-]{1,20000}"
NUMBER = r"-?(?:0|[1-9][0-9]{0,99})(?:\.[0-9]{0,99})?(?:e[+-]?[0-9]{1,2})?"
STATEMENT = (r"(const double |double |)([A-Za-z_][\w.]*(?:\[\d+\])?) (\+?=) ([^;={}]+); ?|"
    r"double (\w[\w.]*)\[([1-9]\d{0,3})\]; ?")  # fmt: skip
FIELDS = ("name", "step", "positions", "mass_matrix", "force", "acceleration", "signs", "domain", "errors", "states",
          "matrix", "rest", "lyapunov_matrix", "box", "decay_rate", "reversals", "cover")  # fmt: skip


class Text:  # expressions over `names`, and statements that set them; `sign`: what C calls the sign function
    def __init__(self, names: dict[str, Poly], known: dict[Any, Poly], sign: str = "") -> None:
        self.names, self.known, self.sign = names, known, sign

    def value(self, text: str) -> Poly:
        demand(re.fullmatch(EXPRESSION, text), f"{text[:80]!r} is no expression", 20 + 5 * len(text))
        return self.of(ast.parse(text.strip(), mode="eval").body, text.strip())

    def values(self, texts: list[str]) -> list[Poly]:
        demand(type(texts) is list, "fields are not so named, or no lists")  # of a text the characters would be read
        return [self.value(text) for text in texts]

    def of(self, node: ast.expr, text: str) -> Poly:
        if isinstance(node, ast.Constant):
            digits = text[node.col_offset : node.end_col_offset]
            demand(re.fullmatch(NUMBER, digits) and not (self.sign and digits.isdigit()), f"{digits} is out of place")
            return term(Fraction(digits))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return term(-1) * self.of(node.operand, text)
        if isinstance(node, ast.BinOp):
            a, b = self.of(node.left, text), self.of(node.right, text)
            b = reciprocal(b, self.known) if isinstance(node.op, ast.Div) else b
            done = {ast.Add: a.__add__, ast.Sub: a.__sub__, ast.Mult: a.__mul__, ast.Div: a.__mul__}[type(node.op)](b)
            demand(done.size() < 600, "a power or a coefficient is too large")  # within normal doubles
            return done
        if isinstance(node, ast.Call) and len(node.args) == 1 and not node.keywords:
            return self.call(ast.unparse(node.func), self.of(node.args[0], text))
        name = ast.unparse(node)
        if isinstance(node, ast.Subscript) and re.fullmatch(r"\d{1,4}( [+-] \d{1,4}){0,2}", ast.unparse(node.slice)):
            name = f"{ast.unparse(node.value)}[{Text({}, {}).of(node.slice, text).constant()}]"
        demand(name in self.names and "/" not in ast.unparse(node), f"{name[:80]} is nothing that is known here")
        return self.names[name]

    # LEMMA 10. |p| = sgn(p) p. The sign of p is a number's, or s or -s where the proof says so of p or -p. Any other,
    # or another function's value, is a new variable for each argument: what holds for all values holds for that one.
    def call(self, name: str, p: Poly) -> Poly:
        kind = "sgn" if name in ("fabs", self.sign) else name
        demand(not self.sign or name in ("cos", "exp", "fabs", "sin", "tanh", self.sign), f"C calls {name}")
        if name in ("cos", "sin"):
            return angle(name, p, self.known)
        value = self.known.setdefault(key(kind, p), term(1, f"?{len(self.known)}?{kind}"))
        value = term((p.constant() > 0) - (p.constant() < 0)) if kind == "sgn" and not p.names() else value
        return value * p if name == "fabs" else value

    def run(self, text: str, writable: set[str], read: int = 0) -> dict[str, Poly]:
        while loop := re.search(r"for \(int i = (0|[1-9]\d{0,3}); i < (0|[1-9]\d{0,3}); i\+\+\) \{ ([^{}]*)\} ?", text):
            own, bodies = "|".join(re.findall(r"double (\w+)", loop[3])) or "(?!)", ""
            for k in range(int(loop[1]), int(loop[2])):
                demand(True, "", len(loop[3]) * (9 + own.count("|")) // 9 + len(text) // 99)
                bodies += re.sub(rf"\b({own})\b", rf"\1.loop{loop.start()}.k{k}", re.sub(r"\bi\b", str(k), loop[3]))
            text = text[: loop.start()] + bodies + text[loop.end() :]
        while found := re.compile(STATEMENT, re.ASCII).match(text, read):
            read, (local, name, way, value, array, size) = found.end(), found.groups()
            demand(not name or local or name in writable, f"{name} is set", int(size or 0))
            writable |= {f"{array}[{k}]" for k in range(int(size or 0))} | ({name} if local == "double " else set())
            self.names |= {name: (self.names[name] if way == "+=" else ZERO) + self.value(value)} if name else {}
        demand(read == len(text), f"{text[read : read + 80]!r} cannot be read")
        return self.names


# LEMMA 11. Comments aside, the files are of these forms (a blank: any white space): structs of doubles, values, bodies
# of functions. No macro, type or global, in digraphs neither, changes what `step` or a parameter means; `else` sets
# fault 1.
BODY = r"(?:[^{}#\"']++|{(?:[^{}#\"']++|{[^{}#\"']*+})*+})*+"
STRUCT = r"typedef struct { ((?:double (?!STICTION)[A-Za-z]\w*(?:\[[1-9]\d{0,2}\])?; )+)(?:(?!double)[\w ]+; )*} NAME_"
HEADER = (r'#ifndef STICTION_UPPER_H\n#define STICTION_UPPER_H\n#ifdef __cplusplus\nextern "C" {\n#endif\n'
    rf"{STRUCT}parameters;\n#define UPPER_PARAMETERS (?!.*[ -]\d{{16}}){{ ([^\n]*) }}\ntypedef enum {{ UPPER_RUNNING, "
    rf"UPPER_HOLDING, UPPER_STARTING }} NAME_mode; {STRUCT}state; {STRUCT}inputs; {STRUCT}outputs;"
    r"(?: void NAME_\w+\([\w\s*,]*\);)*\n#ifdef __cplusplus\n}\n#endif\n#endif")  # fmt: skip
SOURCE = (r'#include "NAME\.h"\n#include <math\.h>\n#if defined\(__clang__\)\n#pragma STDC FP_CONTRACT OFF\n#endif\n#'
    r"if defined\(__GNUC__\)\n#define UPPER_COLD __attribute__\(\(noinline, cold\)\)\n#else\n#define UPPER_COLD\n#endif"
    r"(?: static inline double NAME_sign\(double u\) { return \(u > 0\.0\) \? 1\.0 : \(\(u < 0\.0\) \? -1\.0 : 0\.0\); "
    rf"}}|(?![^#]*\bNAME_sign\b))(?![^#]*\b(?:return|goto)\b) void NAME_prepare\(NAME_parameters "
    rf"\*parameters\) {{({BODY})}}(?: (?:static )?"
    rf"void NAME_\w+\([\w *,]*\) {{{BODY}}})*? static UPPER_COLD void NAME_handle_fault\(NAME_state \*state,"
    r" const NAME_parameters \*parameters, const NAME_inputs \*inputs, NAME_outputs \*outputs\) {(?=(?:, outputs\)|"
    rf"(?!outputs)[^#])*+outputs->fault = 1; }} void NAME_step\b){BODY}(?<=[;}}] outputs->fault = 1; )"
    r"} void NAME_step\(NAME_state \*state, const NAME_parameters \*parameters, const NAME_inputs "
    r"\*inputs, NAME_outputs \*outputs\) {((?:(?!if \(|UPPER_RUNN)[^#\"'])*+)if \(fabs\(check\) <= 1e\+150 && state"
    r"->mode == UPPER_RUNNING\) {([^#]*?)outputs->fault = 0; } else { "
    r"NAME_handle_fault\(state, parameters, inputs, outputs\); } }")  # fmt: skip


def matched(form: str, file: str, text: str) -> list[str]:
    """What the form's groups are in the file's text without comments and needless blanks."""
    text, (stem, _), size = text.replace("\\\n", ""), file.split("."), len(text) ** 2 // 2000
    demand(not re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\\]|\?\?|\*\s*\)", text), "control characters, \\, ??, *)")
    plain = re.sub(r'/\*.*?(?:\*/|\Z)|("[^"\n]*"|//)', lambda m: m[1] or " ", text, flags=re.DOTALL)
    demand(plain.isascii() and not re.search(r"//|%|<:|:>|\.i\b", plain), "a comment from // on, % or not ASCII", size)
    plain = "\n".join(line for line in (" ".join(line.split()) for line in plain.split("\n")) if line)
    form = form.replace(" ", r"\s").replace("NAME", stem).replace("UPPER", stem.upper())
    demand(found := re.fullmatch(form, plain), f"{file} is not of the form that is read")
    return [" ".join(group.split()).replace("->", ".") for group in found.groups()] if found else []


def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    demand(len(dict(pairs)) == len(pairs), "a field appears twice")  # a reader may see the first, and Python the last
    return dict(pairs)


def prove(proof: dict[str, Any], files: dict[str, str]) -> dict[str, Any]:
    """What holds besides the fields of the proof, if it is one of these files (name: text); ValueError if not."""
    name, signs, errors, formulas, velocity = (proof[x] for x in ("name", "signs", "errors", "states", "positions"))
    demand({*proof, "rest"} == {*FIELDS} and re.fullmatch("[a-z][a-z0-9_]*", name), "not just FIELDS", -Poly.work)
    fields = {"".join(sorted(x)) for x in (*errors, *proof["reversals"])}
    demand(fields <= {"estimatesigntruth", "dwellgrowthsign"}, "fields are not so named")
    prepare, before, good = matched(SOURCE, f"{name}.c", files[f"{name}.c"])
    first, given, *others = matched(HEADER, f"{name}.h", files[f"{name}.h"])
    arrays = [re.findall(r"double (\w+)(?:\[(\d+)\])?;", struct) for struct in (first, *others)]
    as0 = ", ".join(f"{{ {', '.join('0' * int(n))} }}" if n else "0" for _, n in arrays[0])
    demand(True, "", 20 * sum(int(n or 1) for array in arrays for _, n in array))
    demand(re.sub(NUMBER, "0", given) == as0 and "double" not in good, "not as their fields, or a local after check")
    parameters, states, inputs, outputs = (
        [f"{of}.{x}{n and f'[{k}]'}" for x, n in array for k in range(int(n or 1))]
        for of, array in zip(("parameters", "state", "inputs", "outputs"), arrays, strict=True)
    )
    # Parameters are what `prepare` makes of the values, exactly: the decimals there are that, rounded.
    stated = dict(zip(parameters, map(Fraction, re.findall(NUMBER, given)), strict=True))
    made = Text({p: term(x) for p, x in stated.items()}, {}, f"{name}_sign").run(prepare, {*parameters})
    demand(all(abs(made[p].constant() - x) <= abs(x) / 2**50 for p, x in stated.items()), "prepare gives others")
    # Free are inputs, truth, signs, errors, and states without a formula. An estimate is truth less sign * error.
    truths, estimates, turned = ([e[part] for e in errors] for part in ("truth", "estimate", "sign"))
    hidden, aside = [f"error of {x}" for x in truths], [z for z in states if z not in formulas]
    named = all(re.fullmatch(("true", "sign")[x in signs] + r"\.\w+", x, re.A) for x in (*truths, *signs))
    single = len({*truths} - {*signs}) == len({*estimates} & {*outputs}) == len(errors)
    demand(named and single and {*turned} <= {"", *signs}, "not so named")
    Poly.signs, Poly.divisors, free = frozenset(signs), {}, {*inputs, *truths, *signs, *aside}
    names = {p: made[p] for p in parameters} | {x: term(1, x) for x in free} | {"": term(1)}
    # A sign is that of a polynomial of estimates, truths and inputs, not constant: so there are points where all are 1.
    visible = {x: p for x, p in names.items() if x not in signs} | {x: term(1, x) for x in estimates}
    seen = [Text(visible, {}).value(of).names() for of in signs.values()]
    demand(all(x and visible.keys() >= x for x in seen), "no sign of estimates and inputs")
    names |= {t: names[s] * names[t] for t, s in zip(truths, turned, strict=True)}

    def estimated(at: dict[str, Poly], e: list[Poly]) -> dict[str, Poly]:
        return {y: at[t] - names[s] * p for y, t, s, p in zip(estimates, truths, turned, e, strict=True)}

    names |= estimated(names, error := [term(1, e) for e in hidden])
    claim = Text(names, {})
    told = [(names[s], claim.value(of)) for s, of in signs.items()]
    told += [(names[s], names[s] * p) for s in ("", *signs) for p in claim.values(proof["domain"])]
    claim.known |= {key("sgn", term(way) * p): term(way) * s for s, p in told for way in (-1, 1)}
    # LEMMA 12. From the states that formulas of n estimates give, the n of them that move with one, `step` shows these
    # same estimates: a map of R^n to R^n that is one-to-one, hence, being polynomial, onto (linear algebra where it is
    # affine, else Bialynicki-Birula and Rosenlicht 1962). So every state is met, and shows its estimates.
    start = {z: claim.value(of) for z, of in formulas.items()}
    moving = [z for z, p in start.items() if not p.names().isdisjoint(hidden)]
    demand({*start} <= {*states} and len(moving) == len(errors), "not an error for each state")
    code = Text({x: p for x, p in names.items() if x not in outputs} | start, claim.known, f"{name}_sign")
    check = code.run(before, set())["check"]
    small = 0 < sum(abs(c) for c in check.values()) <= 10**30 and max(map(len, check)) <= 20
    small = small and not any(x.endswith("?exp") for x in check.names())  # which is large where nothing else is
    demand(small, "not a sum")  # so that `check` is within 1e150 while all that stands in it is below 1e6
    after = code.run(good, {*start, *aside, *outputs})
    demand(all(after[y] == names[y] for y in estimates), "the states do not show the estimates")
    # The machine a sample later, and the states that show the errors which the matrix gives: they are the code's.
    mass, phi, P = ([*map(claim.values, proof[f"{x}matrix"])] for x in ("mass_", "", "lyapunov_"))
    rate, h = {v: claim.value(a) for v, a in proof["acceleration"].items()}, names["parameters.sample_time"]
    force, rest = claim.values(proof["force"]), claim.values(proof.get("rest", ["0"] * len(errors)))
    pushed = [[a - f] for (a,), f in zip(times(mass, [[a] for a in rate.values()]), force, strict=True)]
    demand(not any(p for (p,) in cleared(pushed)), "mass * acceleration is not force")
    own = free - {*aside}
    for (_, of), p in claim.known.items():  # functions of what is the machine's own
        own |= p.names() if {x for m, _ in of for x in m} <= own else set()
    moves = {*velocity.values()} <= {*rate} <= {*truths, *inputs} and {*velocity} <= {*inputs} - {*rate}
    demand(moves and own.issuperset(x for p in (*rate.values(), *rest) for x in p.names()), "not the machine's own")
    plain = own.issuperset(x for p in start.values() for x in p.names() if x not in (*aside, *hidden))
    demand(plain, "a state is no polynomial of the estimates")
    later = names | {x: term(1, f"{x} later") for x in (*inputs, *aside)} | {v: names[v] + h * rate[v] for v in rate}
    later |= {x: names[x] + h * {"euler": names, "semi_implicit": later}[proof["step"]][v] for x, v in velocity.items()}
    moved = [e + r for (e,), r in zip(times(phi, [[e] for e in error]), rest, strict=True)]
    expected = Text(later | estimated(later, moved), claim.known)
    off = {z: cleared([[after[z] - expected.value(of)]])[0][0] for z, of in formulas.items()}
    # A term of more than one error is beyond the first order; where such are left, that is said.
    bad = [z for z, p in off.items() for m in p if z not in moving or sum(x in hidden for x in m) < 2]
    demand(not bad, f"the matrix does not move the errors: {bad[:3]}")
    alone = {x for z in aside for x in after[z].names() if x in aside or x[0] == "?"}
    demand(not alone, f"nothing is said of what follows {alone}, and may grow")
    # V falls, by the lemmas of the algebra.
    ends = {x: claim.values(pair) for x, pair in proof["box"].items()}
    box = {x: (low.constant(), high.constant()) for x, (low, high) in ends.items()}
    fall = 1 - 2 * claim.value(proof["decay_rate"]).constant() * h.constant()
    fixed = [[x.constant() for x in row] for row in P]
    demand({*box} <= free - {*signs}, "a box of no free variable")
    demand(min(fall, h.constant()) > 0 and positive(fixed, True), "V negative, or P not positive definite")
    for turn in proof["reversals"]:
        growth, dwell = (claim.value(turn[part]).constant() for part in ("growth", "dwell"))
        J = [-1 if s == turn["sign"] else 1 for s in turned]
        rise = [[(growth - i * j) * p for j, p in zip(J, row, strict=True)] for i, row in zip(J, fixed, strict=True)]
        demand(positive(rise), "not positive semidefinite", min(int(dwell), 10**5) * fall.denominator.bit_length())
        demand(dwell in range(10**5) and fall ** int(dwell) * growth <= 1 and turn["sign"] in signs, "not made good")
    cell, tree = box | ranges(), proof["cover"]
    for A in (mass, *([[p]] for p in Poly.divisors.values())):
        above_zero(A, cell, tree)
    contracts(phi, fixed, fall, cell, tree)
    conditions = proof["domain"] or box or any(rest) or aside or len(moving) < len(formulas)
    found = {"aside": aside, "first order": any(off.values()), "fall": fall, "values": stated}
    return found | {"whole": not conditions, "names": names, "known": claim.known}


if __name__ == "__main__":
    try:
        claim = json.loads(sys.stdin.read(10**7), object_pairs_hook=once)
        paths = [Path(sys.argv[1], f"{claim['name']}.{end}") for end in "ch"]
        demand(all(x.is_file() and x.stat().st_size < 10**6 for x in paths), f"{paths[0]} or .h: no file, or too long")
        shown = prove(claim, {path.name: path.read_bytes().decode() for path in paths})
    except Exception as why:
        sys.exit(f"refused: {type(why).__name__} {str(why)[:200]}")
    facts = {x: shown[x] for x in ("fall", "first order", "aside", "values")}
    where = "" if shown["whole"] else ", in its domain"
    print(f"{claim['name']}: proved{where}\n{json.dumps(facts, default=str)}")
    sys.exit(0 if shown["whole"] else 4)  # 4: where domain, box and states are as said, but for the rest; 1: refused
