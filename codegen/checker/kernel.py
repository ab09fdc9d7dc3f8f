"""The kernel: whether a proof is one of the C beside it. Standard library only: python3 kernel.py FOLDER < PROOF.json

The algebra, lemmas 1 to 7, is in polynomials.py beside it. No division is by what may be 0 in the box.

THEOREM. Let NAME.c run in exact arithmetic with the values of NAME_PARAMETERS, in samples with fault 0, from any state,
on any inputs. Let a machine have mass_matrix * acceleration = force, its positions (and velocities that are inputs) be
measured exactly, x[k+1] = x[k] + h v[k] ("semi_implicit": h v[k+1]), v[k+1] = v[k] + h acceleration[k], all else
constant. While every sign is 1 or -1, the same in machine and code and from sample to sample, all of `domain` positive,
and states whose formula holds no estimate are as it says, the errors e = sign * (truth - estimate) of all other states
move by e[k+1] = matrix e[k] + rest; and V(matrix e) <= (1 - 2 decay_rate h) V(e), V(e) = e'Pe, over the box, truths in
it times their sign. With one sign turned V is at most `growth` V, and after `dwell` samples with no turn or rest not
above V. Trusted: this file, Python, that the machine is yours. Not covered: rounding, faults, turns.
"""

import ast
import json
import re
import runpy
import sys
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import polynomials
    from codegen.checker.polynomials import Poly, cleared, demand, positive, semidefinite, term, times
else:
    polynomials = SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("polynomials.py"))))
    Poly, cleared, demand = polynomials.Poly, polynomials.cleared, polynomials.demand
    positive, semidefinite = polynomials.positive, polynomials.semidefinite
    term, times = polynomials.term, polynomials.times
__all__ = ["Poly", "Text", "cleared", "demand", "matched", "once", "positive", "prove", "semidefinite", "term", "times"]


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
        return self.of(ast.parse(text.strip(), mode="eval").body, text.strip())

    def of(self, node: ast.expr, text: str) -> Poly:
        if isinstance(node, ast.Constant):
            digits = text[node.col_offset : node.end_col_offset]
            demand(re.fullmatch(NUMBER, digits) and not (self.sign and digits.isdigit()), f"{digits} is out of place")
            return term(Fraction(digits))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return term(-1) * self.of(node.operand, text)
        if isinstance(node, ast.BinOp):
            a, b = self.of(node.left, text), self.of(node.right, text)
            b = polynomials.reciprocal(b, self.known) if isinstance(node.op, ast.Div) else b
            return {ast.Add: a.__add__, ast.Sub: a.__sub__, ast.Mult: a.__mul__, ast.Div: a.__mul__}[type(node.op)](b)
        if isinstance(node, ast.Call) and len(node.args) == 1 and not node.keywords:
            return self.call(ast.unparse(node.func), self.of(node.args[0], text))
        name = ast.unparse(node)
        if isinstance(node, ast.Subscript) and re.fullmatch(r"\d{1,4}( [+-] \d{1,4}){0,2}", ast.unparse(node.slice)):
            name = f"{ast.unparse(node.value)}[{Text({}, {}).of(node.slice, text).constant()}]"
        demand(name in self.names and "/" not in ast.unparse(node), f"{name[:80]} is nothing that is known here")
        return self.names[name]

    # LEMMA 9. |p| = sgn(p) p. The sign of p is a number's, or s or -s where the proof says so of p or -p. Any other, or
    # another function's value, is a new variable for each argument: what holds for all values holds for that one.
    def call(self, name: str, p: Poly) -> Poly:
        kind = "sgn" if name in ("fabs", self.sign) else name
        demand(not self.sign or name in ("cos", "exp", "fabs", "sin", "tanh", self.sign), f"C calls {name}")
        if name in ("cos", "sin"):
            return polynomials.angle(name, p, self.known)
        value = self.known.setdefault((kind, frozenset(p.after(len(p)).items())), term(1, f"?{len(self.known)}?{kind}"))
        value = term((p.constant() > 0) - (p.constant() < 0)) if kind == "sgn" and not p.names() else value
        return value * p if name == "fabs" else value

    def run(self, text: str, writable: set[str], read: int = 0) -> None:
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
            self.names |= {name: (self.names[name] if way == "+=" else Poly()) + self.value(value)} if name else {}
        demand(read == len(text), f"{text[read : read + 80]!r} cannot be read")


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
    r"\*inputs, NAME_outputs \*outputs\) {((?:(?!if \(|UPPER_RUNN)[^#\"'])*+)if \(fabs\(check\) <= (1e\+150) && state"
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
    prepare, before, limit, good = matched(SOURCE, f"{name}.c", files[f"{name}.c"])
    first, given, *others = matched(HEADER, f"{name}.h", files[f"{name}.h"])
    arrays = [re.findall(r"double (\w+)(?:\[(\d+)\])?;", struct) for struct in (first, *others)]
    as0 = ", ".join(f"{{ {', '.join('0' * int(n))} }}" if n else "0" for _, n in arrays[0])
    demand(True, "", 20 * sum(int(n or 1) for array in arrays for _, n in array))
    demand(re.sub(NUMBER, "0", given) == as0 and "double" not in good, "not as their fields, or a local after check")
    parameters, states, inputs, outputs = ([f"{of}.{x}{n and f'[{k}]'}" for x, n in array for k in range(int(n or 1))]
        for of, array in zip(("parameters", "state", "inputs", "outputs"), arrays, strict=True))  # fmt: skip
    # Parameters are what `prepare` makes of the values, exactly: the decimals there are that, rounded.
    stated = dict(zip(parameters, map(Fraction, re.findall(NUMBER, given)), strict=True))
    (code := Text({p: term(x) for p, x in stated.items()}, {}, f"{name}_sign")).run(prepare, {*parameters})
    demand(all(abs(code.names[p].constant() - x) <= abs(x) / 2**50 for p, x in stated.items()), "prepare gives others")
    # Free are inputs, truth, signs, errors, and states without a formula. An estimate is truth less sign * error.
    truths, estimates, turned = ([e[part] for e in errors] for part in ("truth", "estimate", "sign"))
    aside = [z for z in states if z not in formulas]
    fields = {"".join(sorted(x)) for x in (*errors, *proof["reversals"])} <= {"estimatesigntruth", "dwellgrowthsign"}
    objects = json.dumps(proof).count("{") == 6 + len(errors) + len(proof["reversals"])  # and lists are no objects
    rows = (proof[x] for x in ("matrix", "mass_matrix", "lyapunov_matrix"))
    lists = [
        proof.get("rest", []),
        proof["domain"],
        proof["force"],
        *proof["box"].values(),
        *(x for y in rows for x in y),
    ]
    demand(all(type(x) is list for x in lists), "fields that are no lists")
    demand(fields and objects and {*estimates} <= {*outputs} and not {*truths} & {*signs}, "fields are not so named")
    named = all(re.fullmatch(("true", "sign")[x in signs] + r"\.\w+", x, re.A) for x in [*truths, *signs])
    demand(named and {*turned} <= {"", *signs} and len({*truths}) == len({*estimates}) == len(errors), "not so named")
    Poly.signs, Poly.divisors, free = frozenset(signs), {}, {*inputs, *truths, *signs, *aside}
    names = {p: code.names[p] for p in parameters} | {x: term(1, x) for x in free} | {"": term(1)}
    names |= {t: names[s] * names[t] for t, s in zip(truths, turned, strict=True)}
    hidden = [f"error of {x}" for x in truths]
    errored = zip(estimates, truths, turned, hidden, strict=True)
    names |= {x: names[t] - names[s] * term(1, e) for x, t, s, e in errored}
    # LEMMA 11. From the states that formulas of n estimates give, the n of them that move with one, `step` shows these
    # same estimates: a map of R^n to R^n that is one-to-one, hence, being polynomial, onto (linear algebra where it is
    # affine, else Bialynicki-Birula and Rosenlicht 1962). So every state is met, and shows its estimates.
    claim = Text(names, {})
    # A sign is that of a polynomial of estimates, truths and inputs, not constant: so there are points where all are 1.
    shown = {*names} - {*signs}
    seen = map(Text(names | {x: term(1, x) for x in (*signs, *truths, *estimates)}, {}).value, signs.values())
    demand(all(p.names() and p.names() <= shown for p in seen), "no sign of estimates and inputs")
    told = [(names[s], claim.value(of)) for s, of in signs.items()]
    told += [(names[s], names[s] * claim.value(of)) for s in ("", *signs) for of in proof["domain"]]
    claim.known |= {("sgn", frozenset((way * p).items())): way * s for s, p in told for way in (term(-1), term(1))}
    start = {z: claim.value(of) for z, of in formulas.items()}
    moving = [z for z, p in start.items() if p.names().intersection(hidden)]
    demand({*start} <= {*states} and len(moving) == len(errors), "not an error for each state")
    code = Text({x: p for x, p in names.items() if x not in outputs} | start, claim.known, code.sign)
    code.run(before, set())
    demand(0 < 10**9 * sum(abs(c) for c in code.names["check"].values()) <= Fraction(limit) <= 10**300, "not a sum")
    code.run(good, {*start, *aside, *outputs})
    demand(all(code.names[x] == names[x] for x in estimates), "the states do not show the estimates")
    # The machine a sample later, and the states that show the errors which the matrix gives: they are the code's.
    mass, phi, P = ([[claim.value(x) for x in row] for row in proof[f"{x}matrix"]] for x in ("mass_", "", "lyapunov_"))
    rate, h = {v: claim.value(a) for v, a in proof["acceleration"].items()}, names["parameters.sample_time"]
    pushed = zip(times(mass, [[a] for a in rate.values()]), proof["force"], strict=True)
    demand(not any(cleared([[a - claim.value(f)]])[0][0] for (a,), f in pushed), "mass * acceleration is not force")
    rest = [claim.value(x) for x in proof.get("rest", ["0"] * len(errors))]
    own, moves = free - {*aside}, {*velocity.values()} <= {*rate} <= {*truths, *inputs}
    for (_, of), p in claim.known.items():  # functions of what is the machine's own
        own |= p.names() if {x for m, _ in of for x in m} <= own else set()
    moves = moves and {*velocity} <= {*inputs} - {*rate}
    demand(moves and {x for p in (*rate.values(), *rest) for x in p.names()} <= own, "not the machine's own")
    plain = {x for p in start.values() for x in p.names()} <= own | {*aside, *hidden}
    demand(plain, "a state is no polynomial of the estimates")
    later = names | {x: term(1, f"{x} later") for x in (*inputs, *aside)} | {v: names[v] + h * rate[v] for v in rate}
    later |= {x: names[x] + h * {"euler": names, "semi_implicit": later}[proof["step"]][v] for x, v in velocity.items()}
    moved = [e + r for row, r in zip(times(phi, [[term(1, e)] for e in hidden]), rest, strict=True) for e in row]
    later |= {x: later[t] - names[s] * e for x, t, s, e in zip(estimates, truths, turned, moved, strict=True)}
    off = {z: cleared([[code.names[z] - Text(later, claim.known).value(of)]])[0][0] for z, of in formulas.items()}
    # A term of more than one error is beyond the first order; where such are left, that is said.
    bad = [z for z, p in off.items() for m in p if z not in moving or sum(x in hidden for x in m) < 2]
    demand(not bad, f"the matrix does not move the errors: {bad[:3]}")
    alone = {x for z in aside for x in code.names[z].names() if x in aside or x[0] == "?"}
    demand(not alone, f"nothing is said of what follows {alone}, and may grow")
    box = {x: (claim.value(low).constant(), claim.value(high).constant()) for x, (low, high) in proof["box"].items()}
    fall = 1 - 2 * claim.value(proof["decay_rate"]).constant() * h.constant()
    fixed, why = [[x.constant() for x in row] for row in P], "V negative, or P not positive definite"
    demand({*box} <= free - {*signs} and fall > 0 and positive(fixed, True), f"a box of no free variable, {why}")
    cell, tree = box | polynomials.ranges(), proof["cover"]
    for positively in (mass, *([[p]] for p in Poly.divisors.values())):
        polynomials.above_zero(positively, cell, tree)
    polynomials.contracts(phi, fixed, fall, cell, tree)
    for turn in proof["reversals"]:
        growth, dwell = (claim.value(turn[part]).constant() for part in ("growth", "dwell"))
        J = [-1 if s == turn["sign"] else 1 for s in turned]
        rise = [[(growth - i * j) * p for j, p in zip(J, row, strict=True)] for i, row in zip(J, fixed, strict=True)]
        demand(positive(rise), "not positive semidefinite", min(int(dwell), 10**5) * fall.denominator.bit_length())
        demand(dwell in range(10**5) and fall ** int(dwell) * growth <= 1 and turn["sign"] in signs, "not made good")
    some, more = bool(proof["domain"] or box or any(rest) or aside), any(off.values())
    return {
        "whole": not some and len(moving) == len(formulas),
        "aside": aside,
        "first order": more,
        "fall": fall,
        "values": stated,
        "names": names,
        "known": claim.known,
    }


if __name__ == "__main__":
    try:
        claim = json.loads(sys.stdin.read(10**7), object_pairs_hook=once)
        paths = [Path(sys.argv[1], f"{claim['name']}.{end}") for end in "ch"]
        demand(all(x.is_file() and x.stat().st_size < 10**6 for x in paths), f"{paths[0]} or .h: no file, or too long")
        shown = {"rest": 0} | claim | prove(claim, {path.name: path.read_bytes().decode() for path in paths})
    except Exception as why:
        sys.exit(f"refused: {type(why).__name__} {str(why)[:200]}")
    facts = (f"  {x}: {json.dumps(shown[x], default=str)}" for x in (*FIELDS[1:], "first order", "fall", "values"))
    print(f"{claim['name']}: proved{'' if shown['whole'] else ', in its domain'}", *facts, sep="\n")
    sys.exit(0 if shown["whole"] else 4)  # 4: where domain, box and states are as said, but for the rest; 1: refused
