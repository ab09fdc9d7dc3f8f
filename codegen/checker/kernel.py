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
from itertools import accumulate, pairwise, product
from math import comb, lcm
from pathlib import Path
from typing import Any, ClassVar


def demand(holds: Any, why: str, steps: int = 0) -> None:
    Poly.work += steps  # each of about a microsecond, so that no file takes more than seconds
    if not holds or Poly.work > 5_000_000:
        raise ValueError("more work than the limit" if holds else why)


# LEMMA 1. A polynomial is {monomial: coefficient, not 0}, a monomial its names, sorted, each as often as its power. Two
# are the same real function just if they are the same here. "sign.…" is 1 or -1: pairs of it are left out.
class Poly(dict[tuple[str, ...], Any]):
    work = 0
    divisors: "ClassVar[dict[str, Poly]]"  # what a reciprocal is one of, by its name (lemma 3)

    def size(self) -> int:
        bits = [(len(m), c.numerator.bit_length(), c.denominator.bit_length()) for m, c in self.items()]
        return max((n + max(a, b) // 9 + abs(a - b) * 3 // 5 for n, a, b in bits), default=0)

    def __hash__(self) -> int:  # type: ignore[override]  # none is changed once it is made
        return hash(frozenset(self.items()))

    def __add__(self, other: "Poly") -> "Poly":
        demand(True, "", len(self) + len(other))
        terms = self | {m: self.get(m, 0) + c for m, c in other.items()}
        return Poly({m: c for m, c in terms.items() if c})

    def __sub__(self, other: "Poly") -> "Poly":
        return self + term(-1) * other

    def __mul__(self, other: "Poly") -> "Poly":
        demand(True, "", len(self) * len(other) * (9 + max(self.size(), other.size())) // 18)
        terms: dict[tuple[str, ...], Any] = {}
        pairs = {x for x in self.names() & other.names() if x.startswith("sign.")}
        for (m, c), (n, d) in product(self.items(), other.items()):
            names = [x for x in m + n if not (x in pairs and x in m and x in n)] if pairs else m + n
            monomial = tuple(sorted(names))
            terms[monomial] = terms.get(monomial, 0) + c * d
        return Poly({m: c for m, c in terms.items() if c})

    def names(self) -> set[str]:
        return set().union(*self)

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
    rest, last = [row[k:] for k, row in enumerate(whole(A))], 1  # the upper half is all
    while rest:
        (p, *r), *rest = rest
        demand(True, "", len(r) ** 2 * (1 + max(p, last, *map(abs, r)).bit_length() // 500) ** 2)
        if p < 0 or (p == 0 and (definite or any(r))):
            return False
        if p > 0:
            rest = [[(p * x - a * b) // last for x, b in zip(row, r[k:], strict=True)]
                    for k, (a, row) in enumerate(zip(r, rest, strict=True))]  # fmt: skip
            last = p
    return True


def whole(A: Matrix) -> list[list[int]]:
    common = lcm(*(x.denominator for row in A for x in row))
    return [[int(x * common) for x in row] for row in A]


# LEMMA 3. Let p > 0, and r be a variable with r p = 1. A sum of polynomials q r^k, k <= n, times p^n is that of the
# q p^(n-k), and of the same sign. From the last r on, since a later p may hold earlier r. p > 0 is left to be shown.
def cleared(sum_: Poly) -> Poly:
    for r, p in reversed(Poly.divisors.items()):
        parts = [Poly() for _ in range(1 + max((m.count(r) for m in sum_), default=0))]
        for m, c in sum_.items():
            parts[m.count(r)][tuple(x for x in m if x != r)] = c
        sum_, power = Poly(), term(1)
        for part in reversed(parts):
            sum_, power = sum_ + part * power, power * p
    return sum_


# LEMMA 4. A matrix is here the sum of its entries times names of their places. On a cell every x is low s + high t over
# s + t, with s, t >= 0 and s + t = 1. So x^k is (low s + high t)^k (s + t)^(n-k), and a matrix is a sum of products of
# such s and t, which are not below 0, times matrices of numbers (Bernstein's form).
def joined(A: Matrix) -> Poly:
    entries = [(f"#{i} {j}", p) for i, row in enumerate(A) for j, p in enumerate(row)]
    return Poly({(place, *m): c for place, p in entries for m, c in p.items()})


def coefficients(A: Matrix, joint: Poly, cell: Box) -> set[Any]:
    """These matrices, times one number > 0, of A, which is joined and cleared."""
    places, monomials = [f"#{i} {j}" for i, row in enumerate(A) for j in range(len(row))], [*{m[1:] for m in joint}]
    matrices = whole([[joint.get((place, *m), 0) for place in places] for m in monomials])
    form: dict[Any, list[int]] = dict(zip(monomials, matrices, strict=True))
    for x in sorted(x for x in joint.names() if x[0] != "#"):
        ((low, high, one),), n = whole([[*ends(x, cell), Fraction(1)]]), max(m.count(x) for m in form)
        bits = max(low, high, one, *(c for entries in form.values() for c in entries), key=abs).bit_length()
        demand(True, "", (n**3 + len(form) * (n + 1) * len(places)) * (1 + n * bits // 500))
        power = [[sum(comb(k, i) * low ** (k - i) * high**i * comb(n - k, j - i) * one ** (n - k)
                      for i in range(min(j, k) + 1)) for j in range(n + 1)] for k in range(n + 1)]  # fmt: skip
        parts: dict[Any, list[int]] = {}
        for m, entries in form.items():
            left = tuple(y for y in m if y != x)
            for j, factor in enumerate(power[m.count(x)]):  # of s^(n-j) t^j, from now on j in place of x
                before = parts.get((*left, j), [0] * len(places))
                parts[*left, j] = [a + factor * c for a, c in zip(before, entries, strict=True)]
        form = parts
    return {tuple(tuple(c[a:b]) for a, b in pairwise(accumulate(map(len, A), initial=0))) for c in form.values()}


def ends(x: str, cell: Box) -> tuple[Fraction, Fraction]:
    """Its range: a sign's is within -1 and 1, a tangent's (lemma 7) within 0 and 1."""
    demand(x in cell or re.match(r"sign\.|.* t$", x), f"{x} without a range")
    return cell.get(x, (Fraction(-x.startswith("sign.")), Fraction(1)))


# LEMMA 5. The two parts of a cell cut between its ends cover it: what holds on every leaf of a tree of cuts holds on
# the box.
def on_leaves(holds: Any, A: Matrix, cell: Box, tree: Any, what: str) -> None:
    joint, left = cleared(joined(A)), [(cell, tree)]
    while left:
        cell, tree = left.pop()
        while tree != "":
            (x, cut, below, tree), (low, high) = tree, ends(tree[0], cell)
            demand(re.fullmatch("-?[0-9]{1,40}(/[1-9][0-9]{0,39})?", cut), f"{x} is cut at no number", 100)
            demand(low < (cut := Fraction(cut)) < high, f"{x} is not cut between its ends")
            left.append((cell | {x: (low, cut)}, below))
            cell = cell | {x: (cut, high)}
        demand(all(map(holds, coefficients(A, joint, cell))), f"{what} in {cell}", 100)


def semidefinite(A: Matrix, cell: Box, tree: Any) -> None:
    on_leaves(positive, A, cell, tree, "not positive semidefinite")


def above_zero(A: Matrix, cell: Box, tree: Any) -> None:
    """A is definite: A - 1e-99 is semidefinite."""
    least = term(Fraction(1, 10**99))
    semidefinite([[p - least if i == j else p for j, p in enumerate(row)] for i, row in enumerate(A)], cell, tree)


# LEMMA 6. Let D > 0 and N be polynomials, P definite, N/D = F. With the Bernstein coefficients d > 0 and n of D and N,
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

    on_leaves(falls, [*F, [term(1)]], cell, tree, "V may not fall")


def reciprocal(p: Poly, known: dict[Any, Poly]) -> Poly:
    """1/p: a number, or the variable of lemma 3, of a name that no other has, whoever asks."""
    if not p.names():
        return term(1 / p.constant())
    if ("1/", p) not in known:
        known["1/", p] = term(1, name := f"?1/{len(Poly.divisors)}")
        Poly.divisors[name] = p
    return known["1/", p]


# LEMMA 7. Every angle has signs k and m, of its cosine and sine, and a t in [0, 1], the tangent of half of the angle
# between 0 and pi/2 that has the same cosine and sine but for them: they are k (1 - t^2)/(1 + t^2) and m 2 t/(1 + t^2).
def angle(name: str, p: Poly, known: dict[Any, Poly]) -> Poly:
    """The sine or cosine of p, over variables of its own: the t of x is called "x t"."""
    if ("cos", p) not in known:
        own = next((x for x in p.names() if p == term(1, x) and x[:5] != "sign."), f"?{len(Poly.divisors)}")
        t, k, m = term(1, f"{own} t"), term(1, f"sign.cos {own}"), term(1, f"sign.sin {own}")
        u = reciprocal(term(1) + t * t, known)
        known["cos", p], known["sin", p] = k * (term(2) * u - term(1)), term(2) * m * t * u
    return known[name, p]


# LEMMA 8. Names, numbers, calls of functions of doubles and + - * / ( ), of what EXPRESSION lets pass, mean the same in
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
        return self.of(ast.parse(text := text.strip(), mode="eval").body, text)

    def values(self, texts: list[str]) -> list[Poly]:
        demand(type(texts) is list, "fields are not so named, or no lists")  # of a text the characters would be read
        return [self.value(text) for text in texts]

    def of(self, node: ast.expr, text: str) -> Poly:
        here = text[node.col_offset : node.end_col_offset]
        if isinstance(node, ast.Constant):
            demand(re.fullmatch(NUMBER, here) and not (self.sign and here.isdigit()), f"{here} is out of place")
            return term(Fraction(here))
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
        if index := re.fullmatch(r"(.*\[)(\d{1,4}(?: [+-] \d{1,4}){1,2})\]", here):
            here = f"{index[1]}{sum(map(int, re.findall('[+-]?[0-9]+', index[2].replace(' ', ''))))}]"
        demand(here in self.names, f"{here[:80]} is nothing that is known here")
        return self.names[here]

    # LEMMA 9. |p| = sgn(p) p. The sign of p is a number's, or s or -s where the proof says so of p or -p. Any other is
    # a new variable for each p: what holds for all values holds for that one.
    def call(self, name: str, p: Poly) -> Poly:
        demand(name in ("cos", "fabs", "sin", self.sign), f"C calls {name}")
        if name in ("cos", "sin"):
            return angle(name, p, self.known)
        number, new = p.get((), 0), term(1, f"?sgn{len(self.known)}")
        value = self.known.setdefault(("sgn", p), new) if p.names() else term((number > 0) - (number < 0))
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


# LEMMA 10. Comments aside, the files are of these forms (a blank: any white space): structs of doubles, values, bodies
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
    text, (stem, _) = text.replace("\\\n", ""), file.split(".")
    demand(True, "", len(text) ** 2 // 2000)
    demand(not re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\\]|\?\?|\*\s*\)", text), "control characters, \\, ??, *)")
    plain = re.sub(r'/\*.*?(?:\*/|\Z)|("[^"\n]*"|//)', lambda m: m[1] or " ", text, flags=re.DOTALL)
    demand(plain.isascii() and not re.search(r"//|%|<:|:>|\.i\b", plain), "a comment from // on, % or not ASCII")
    plain = "\n".join(line for line in (" ".join(line.split()) for line in plain.split("\n")) if line)
    form = form.replace(" ", r"\s").replace("NAME", stem).replace("UPPER", stem.upper())
    demand(found := re.fullmatch(form, plain), f"{file} is not of the form that is read")
    return [" ".join(group.split()).replace("->", ".") for group in found.groups()] if found else []


def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    demand(len(dict(pairs)) == len(pairs), "a field appears twice")  # a reader may see the first, and Python the last
    return dict(pairs)


def prove(proof: dict[str, Any], files: dict[str, str]) -> dict[str, Any]:
    """What holds besides the fields of the proof, if it is one of these files (name: text); ValueError if not."""
    Poly.work, Poly.divisors = 0, {}
    name, signs, errors, formulas, velocity = (proof[x] for x in ("name", "signs", "errors", "states", "positions"))
    demand({*proof, "rest"} == {*FIELDS} and re.fullmatch("[a-z][a-z0-9_]*", name), "not just FIELDS")
    fields = {"".join(sorted(x)) for x in [*errors] + proof["reversals"]}  # no text, which would read as none
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
    named = all(re.fullmatch(r"true\.\w+", x, re.A) for x in truths)
    named = named and all(re.fullmatch(r"sign\.\w+", x, re.A) for x in signs) and {*turned} <= {"", *signs}
    demand(named and len({*truths}) == len({*estimates} & {*outputs}) == len(errors), "not so named")
    free = {*inputs, *truths, *signs, *aside}
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
    claim.known |= {("sgn", term(way) * p): term(way) * s for s, p in told for way in (-1, 1)}
    # LEMMA 11. From the states that formulas of n estimates give, the n of them that move with one, `step` shows these
    # same estimates: a map of R^n to R^n that is one-to-one, hence, being polynomial, onto (linear algebra where it is
    # affine, else Bialynicki-Birula and Rosenlicht 1962). So every state is met, and shows its estimates.
    start = {z: claim.value(of) for z, of in formulas.items()}
    moving = [z for z, p in start.items() if not p.names().isdisjoint(hidden)]
    demand({*start} <= {*states} and len(moving) == len(errors), "not an error for each state")
    code = Text({x: p for x, p in names.items() if x not in outputs} | start, claim.known, f"{name}_sign")
    check = code.run(before, set())["check"]
    small = 0 < sum(abs(c) for c in check.values()) <= 10**30 and max(map(len, check)) <= 20
    demand(small, "not a sum")  # so that `check` is within 1e150 while all that stands in it is below 1e6
    after = code.run(good, {*start, *aside, *outputs})
    demand(all(after[y] == names[y] for y in estimates), "the states do not show the estimates")
    # The machine a sample later, and the states that show the errors which the matrix gives: they are the code's.
    mass, phi, P = ([*map(claim.values, proof[f"{x}matrix"])] for x in ("mass_", "", "lyapunov_"))
    rate, h = {v: claim.value(a) for v, a in proof["acceleration"].items()}, names["parameters.sample_time"]
    force, rest = claim.values(proof["force"]), claim.values(proof.get("rest", ["0"] * len(errors)))
    pushed = [[a - f] for (a,), f, _ in zip(times(mass, [[a] for a in rate.values()]), force, rate, strict=True)]
    demand(not cleared(joined(pushed)), "mass * acceleration is not force")
    own = free - {*aside}
    for (_, of), p in claim.known.items():  # functions of what is the machine's own
        own |= p.names() if of.names() <= own else set()
    moves = {*velocity.values()} <= {*rate} <= {*truths, *inputs} and {*velocity} <= {*inputs} - {*rate}
    demand(moves and own.issuperset(x for p in (*rate.values(), *rest) for x in p.names()), "not the machine's own")
    plain = own.issuperset(x for p in start.values() for x in p.names() if x not in (*aside, *hidden))
    demand(plain, "a state is no polynomial of the estimates")
    later = names | {x: term(1, f"{x} later") for x in (*inputs, *aside)} | {v: names[v] + h * rate[v] for v in rate}
    later |= {x: names[x] + h * {"euler": names, "semi_implicit": later}[proof["step"]][v] for x, v in velocity.items()}
    moved = [e + r for (e,), r in zip(times(phi, [[e] for e in error]), rest, strict=True)]
    expected = Text(later | estimated(later, moved), claim.known)
    off = {z: cleared(after[z] - expected.value(of)) for z, of in formulas.items()}
    # A term of more than one error is beyond the first order; where such are left, that is said.
    bad = [z for z, p in off.items() for m in p if z not in moving or sum(x in hidden for x in m) < 2]
    demand(not bad, f"the matrix does not move the errors: {bad[:3]}")
    alone = {x for z in aside for x in after[z].names() if x in aside or x[0] == "?"}
    demand(not alone, f"nothing is said of what follows {alone}, and may grow")
    # V falls, by the lemmas of the algebra.
    sides = {x: claim.values(pair) for x, pair in proof["box"].items()}
    box = {x: (low.constant(), high.constant()) for x, (low, high) in sides.items()}
    fall = 1 - 2 * claim.value(proof["decay_rate"]).constant() * h.constant()
    fixed = [[x.constant() for x in row] for row in P]
    demand({*box} <= free - {*signs}, "a box of no free variable")
    demand(min(fall, h.constant()) > 0 and positive(fixed, True), "V negative, or P not positive definite")
    for turn in proof["reversals"]:
        growth, dwell = (claim.value(turn[part]).constant() for part in ("growth", "dwell"))
        J = [-1 if s == turn["sign"] else 1 for s in turned]
        rise = [[(growth - i * j) * p for j, p in zip(J, row, strict=True)] for i, row in zip(J, fixed, strict=True)]
        demand(positive(rise), "not positive semidefinite", min(int(dwell), 10**5) * 4 * len(f"{fall}"))
        demand(dwell in range(10**5) and fall ** int(dwell) * growth <= 1 and turn["sign"] in signs, "not made good")
    for A in (mass, *([[p]] for p in Poly.divisors.values())):
        above_zero(A, box, proof["cover"])
    contracts(phi, fixed, fall, box, proof["cover"])
    conditions = proof["domain"] or box or any(rest) or aside or len(moving) < len(formulas)
    found = {"aside": aside, "first order": any(off.values()), "fall": fall, "values": stated}
    return found | {"whole": not conditions, "names": names, "known": claim.known}


if __name__ == "__main__":
    try:
        given = json.loads(sys.stdin.read(10**7), object_pairs_hook=once)
        paths = [Path(sys.argv[1], f"{given['name']}.{end}") for end in "ch"]
        demand(all(x.is_file() and x.stat().st_size < 10**6 for x in paths), f"{paths[0]} or .h: no file, or too long")
        shown = prove(given, {path.name: path.read_bytes().decode() for path in paths})
    except Exception as why:
        sys.exit(f"refused: {type(why).__name__} {str(why)[:200]}")
    facts = {x: shown[x] for x in ("fall", "first order", "aside", "values")}
    where = "" if shown["whole"] else ", in its domain"
    print(f"{given['name']}: proved{where}\n{json.dumps(facts, default=str)}")
    sys.exit(0 if shown["whole"] else 4)  # 4: where domain, box and states are as said, but for the rest; 1: refused
