"""Parser of the generated C: NAME.h and NAME.c must be HEADER and SOURCE with other text in place of each "...".

Standard library only; part of the checker. Comments are ignored. The text in place of "..." has no # and no
quotes, so that no macro can redefine a name. It must be fields of type double, numbers, assignments (which
kernel.Text.run evaluates), and declarations of functions of this NAME. C in single precision is read as the same C in
doubles, with 1e18 for 1e150: in exact arithmetic both compute the same. So, in C that compiles:

- `step` sets fault 0 if the sum `check` is within the limit and the mode is RUNNING, and else fault 1.
- HOLDING follows 1, 2, 4 or 8 invalid samples in a row. The count is at most 8 and cannot overflow.
- A sample is valid if the sum of all inputs, or of their magnitudes, is within the limit; `check` of the step is a sum
  that holds every next state once, and to which every input passes on its NaN or infinity. A valid sample leaves
  HOLDING and STARTING, and any value that is not a mode; the next mode is RUNNING, or STARTING if the state that this
  sample gives is invalid.
"""

import ast
import gc
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from fractions import Fraction
from time import monotonic, thread_time
from typing import Any, NamedTuple

HEADER = """#ifndef STICTION_UPPER_H
#define STICTION_UPPER_H
#ifdef __cplusplus
extern "C" {
#endif
typedef struct { ... } NAME_parameters;
#define UPPER_PARAMETERS { ... }
typedef enum { UPPER_RUNNING, UPPER_HOLDING, UPPER_STARTING } NAME_mode;
typedef struct { ... NAME_mode mode; unsigned char invalid_samples; } NAME_state;
typedef struct { ... } NAME_inputs;
typedef struct { ... int fault; } NAME_outputs;
void NAME_prepare(NAME_parameters *parameters);
void NAME_init(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs);
void NAME_step(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs, NAME_outputs *outputs);
#ifdef __cplusplus
}
#endif
#endif"""
SOURCE = """#include "NAME.h"
#include <math.h>
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif
#if defined(__GNUC__)
#define UPPER_COLD __attribute__((noinline, cold))
#else
#define UPPER_COLD
#endif
static inline double NAME_sign(double u) { return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0); }
void NAME_prepare(NAME_parameters *parameters) { ... }
void NAME_init(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs) {
    ...
    state->mode = UPPER_RUNNING;
    state->invalid_samples = 0u;
    ...
    if (!(fabs(check) <= 1e+150)) {
        ...
        state->mode = UPPER_STARTING;
    }
}
static void NAME_predict(NAME_state *state, const NAME_parameters *parameters, const NAME_outputs *outputs) {
    ...
    if (state->mode == UPPER_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u;
        }
        state->invalid_samples++;
        if (state->invalid_samples >= ...u) {
            state->mode = UPPER_HOLDING;
        }
    }
}
static void NAME_resume(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs,
    const NAME_outputs *outputs) {
    ...
    state->mode = UPPER_RUNNING;
    state->invalid_samples = 0u;
}
static UPPER_COLD void NAME_handle_fault(NAME_state *state, const NAME_parameters *parameters,
    const NAME_inputs *inputs, NAME_outputs *outputs) {
    ...
    if (!(fabs(given) <= 1e+150)) {
        if (state->mode != UPPER_STARTING) {
            NAME_predict(state, parameters, outputs);
        }
    } else if (state->mode == UPPER_HOLDING) {
        NAME_resume(state, parameters, inputs, outputs);
    } else {
        NAME_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}
void NAME_step(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs, NAME_outputs *outputs) {
    ...
    if (fabs(check) <= 1e+150 && state->mode == UPPER_RUNNING) {
        ...
        outputs->fault = 0;
    } else {
        NAME_handle_fault(state, parameters, inputs, outputs);
    }
}"""
BARE_HEADER = re.sub(r"typedef enum .*\n| NAME_mode mode; unsigned char invalid_samples;| int fault;", "", HEADER)
BARE_SOURCE = (
    re.sub(r"#if defined\(__GNUC__\)(?s:.*?)#endif\n", "", SOURCE.partition("void NAME_init")[0])
    + """
void NAME_init(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs) { ... }
void NAME_step(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs, NAME_outputs *outputs) {
    ...
}"""
)
"""The same without samples that count as invalid (`--fault none`): all of the step is one sequence of statements."""
WHOLE, POWER = "(?:0|[1-9][0-9]{0,99})", "e[+-]?[0-9]{1,2}"
DOUBLE = rf"{WHOLE}(?:\.[0-9]{{0,99}}(?:{POWER})?|{POWER})"
WORDS = "const|volatile|restrict|long|short|signed|unsigned|int|char|float|double|auto|register|static|extern|inline"
"""Behind `double` no name: `double long;` declares no field, and the values behind it are those of other fields."""
FIELD = rf"double ((?!STICTION|(?:{WORDS})\b)[A-Za-z]\w*)(?:\[([1-9]\d{{0,2}})\])?; ?"
INDEX = r"(?:0|[1-9]\d{0,3})"  # not 010, which C reads as 8
LOOP = rf"for \(int i = ({INDEX}); i < ({INDEX}); i\+\+\) {{ "
ARRAY = r"double (\w+)\[([1-9]\d{0,2})\]; ?"
STATEMENT = re.compile(r"((?:const )?double )?([A-Za-z_][\w.]*(?:\[[\d.]+\])?) (\+?=) ([^;={}]+); ?")
SECONDS, OF_ALGEBRA = 15.0, 30.0
MOST_FIELDS, MOST_ARRAYS, MOST_TEXT = 10_000, 100, 1_000_000


QUANTITIES = ("inputs.", "outputs.", "state.", "true.", "error of ")


class Precision(NamedTuple):
    """Limits of a floating-point type that the polynomials of a proof have to respect.

    Attributes:
        rounding: eight times the largest relative error u of one rounding (2^-53, of floats 2^-24).
        limit: the number with which the C compares the sum `check` to detect an invalid sample.
        most: the largest admitted magnitude of a computed value; the smallest, of a term of it, is 1/most.
        usual: these are demanded of all quantities (inputs, states, outputs) between 1/usual and usual, in their units.
    """

    rounding: Fraction
    limit: int
    most: int
    usual: int

    @property
    def cancelled(self) -> int:
        """The largest factor by which rounding may exceed that of one operation: half of the digits are then right."""
        return 1 << (self.rounding.denominator.bit_length() - 1) // 2

    def holds(self, terms: Mapping[tuple[str, ...], Any]) -> bool:
        """Whether the value and its terms are within the limits for quantities between 1/usual and usual."""
        usual, most = self.usual, self.most
        room, each = most.bit_length() - len(terms).bit_length(), usual.bit_length()
        for monomial, c in terms.items():
            top, bottom = c.as_integer_ratio()
            if max(top.bit_length(), bottom.bit_length()) + len(monomial) * each < room and len(monomial) < 100:
                continue  # most are far within
            top = abs(top)
            degree = sum(x.startswith(QUANTITIES) for x in monomial) if usual > 1 else 0
            power = usual**degree
            out = top * power * len(terms) > most * bottom or top * most < bottom * power
            if out or len(monomial) >= 100 or bottom > MOST_NUMBER or top > MOST_NUMBER:
                return False
        return True


MOST_NUMBER = 10**300
EXACT = Precision(Fraction(0), MOST_NUMBER, MOST_NUMBER, 1)
PRECISIONS = {
    "double": Precision(Fraction(1, 2**50), 10**150, 10**300, 10**6),
    "float": Precision(Fraction(1, 2**21), 10**18, 10**37, 10**3),
}


Program = list[tuple[str, str]]


class C(NamedTuple):
    """The parsed C: the fields of its structures, as names like "state.z_v[3]", and each function's assignments."""

    name: str
    precision: Precision
    sums: tuple[str, str, str] | None  # `given`, and `check` of init and of step behind what precedes it
    most: int  # invalid samples in a row that lead to HOLDING; 0 where none counts as invalid
    values: dict[str, Fraction]
    states: list[str]
    inputs: list[str]
    outputs: list[str]
    prepare: Program
    init: Program
    step: Program
    commit: Program
    reset: Program  # this and the next are empty where none counts as invalid
    predict: Program
    resume: Program


class Clock:
    """The time limit: ``end`` in CPU seconds of the thread, and a wall-clock time before which it cannot be reached.

    The wall clock is asked first, since asking for the CPU time is slow.
    """

    end = until = float("inf")


def demand(holds: object, why: str) -> None:
    """Raises ValueError: with the message ``why`` if the condition is false, or if the time limit is reached."""
    if not holds or (monotonic() > Clock.until and thread_time() > Clock.end):
        raise ValueError("more work than the limit" if holds else why)


@contextmanager
def limited(seconds: float | None = None) -> Iterator[None]:
    """Sets the limit of CPU time of what runs within, in seconds (default SECONDS); an outer limit still holds.

    Python's cyclic garbage collector is off within: polynomials contain no reference cycles, and it takes 3 % of the
    time.
    """
    before, collects = (Clock.end, Clock.until), gc.isenabled()
    gc.disable()
    given = SECONDS if seconds is None else seconds
    Clock.until = min(before[1], monotonic() + given)
    Clock.end = min(before[0], thread_time() + given)
    try:
        yield
    finally:
        Clock.end, Clock.until = before
        if collects:
            gc.enable()


def plain(text: str) -> str:
    """C without comments and redundant blanks: a line for each preprocessor directive, and one for all between two."""
    demand(len(text) <= MOST_TEXT, "files that are too long")
    text = text.replace("\\\n", "")
    legible = text.replace("\n", "").isprintable() and not re.search(r"\\|\?\?", text)
    demand(legible, "control characters, \\ or ??")
    comment = r'/\*.*?(\*/|\Z)|("[^"\n]*"|//)'
    text = re.sub(comment, lambda m: m[2] or (" " if m[1] else "//"), text, flags=re.DOTALL)
    fault = "a comment from // on, % or not ASCII, or a comment without an end"
    demand(text.isascii() and not re.search(r"//|%|(?<![\w.])[\w.]{200}", text), fault)
    lines = filter(None, (" ".join(line.split()) for line in text.split("\n")))
    return re.sub(r"(?m)^([^#].*)\n(?!#)", r"\1 ", "\n".join(lines))


def in_doubles(text: str) -> str:
    """A plain text of C in single precision as the same in doubles; ValueError if it has a double too."""
    demand(not re.search(r"\bdouble\b", text), "double and single precision in one file")
    for number in re.findall(rf"(?<![\w.]){DOUBLE}", text):
        within = not Fraction(number) or Fraction(1, 10**37) < Fraction(number) < 10**37
        demand(within, f"{number} is no float")
    text = re.sub(rf"(?<![\w.])({DOUBLE})f\b", r"\1", text)
    text = re.sub(r"\b(fabs|sin|cos|exp)f(?= ?\()", r"\1", text)
    return re.sub(r"\bfloat\b", "double", text)


def between(form: str, name: str, text: str) -> list[str]:
    """The parts of a text of C in place of each "..." of the form, with a dot for ->."""
    found, rest = [], plain(text)
    *pieces, end = re.split(r" ?\.\.\. ?", plain(form).replace("NAME", name).replace("UPPER", name.upper()))
    for piece in pieces:
        part, there, rest = rest.partition(piece)
        demand(there, f"the C is not of the form that is read: no {piece[:200]!r}")
        found.append(part)
    demand(rest.endswith(end) and not found[0], "the C is not of the form that is read")
    found.append(rest.removesuffix(end))
    demand(not re.search("[#\"']", "".join(found)), "the C is not of the form that is read")
    return [part.strip().replace("->", ".") for part in found[1:]]


def passes(first: str, end: str) -> range:
    """The values of i in a loop; ValueError if there are none: a compiler reads its body, and no pass of it is read."""
    demand(int(first) < int(end), "a loop without a pass")
    return range(int(first), int(end))


def unrolled(text: str) -> str:
    """The statements with every loop unrolled; the locals of each pass are renamed, so that they stay separate."""
    parts, size, read, index = [], 0, 0, rf"\[i((?: [+-] {INDEX})?)\]"
    for loop in re.finditer(rf"{LOOP}([^{{}}]*)}} ?", text):
        local = {*re.findall(r"double (\w+)", loop[3])}
        parts.append(text[read : loop.start()])
        for k in passes(loop[1], loop[2]):
            body = re.sub(index, lambda m, k=k: f"[{k + int(m[1].replace(' ', '') or 0)}]", loop[3])
            size += len(body)
            demand(size < MOST_TEXT, "loops that are too long")
            demand(not re.search(r"\bi\b", body), "i in an expression")
            own = {name: f"{name}[{loop.start()}.{k}]" for name in local}
            parts += [own.get(word, word) for word in re.split(r"(\w+)", body)]
        read = loop.end()
    return "".join(parts) + text[read:]


def assignments(text: str, sign: str) -> Program:
    """The statements as pairs (target, expression), in order; the C's sign function becomes sgn."""
    text = re.sub(r"(?:^|(?<=; ))\(void\)\w+; ?", "", text)  # a statement of its own, not the body of a loop
    text, found, end = unrolled(text), [], 0
    arrays = re.findall(ARRAY, text)
    text, sizes = re.sub(ARRAY, "", text), {name: int(size) for name, size in arrays}
    demand(len(sizes) == len(arrays) <= MOST_ARRAYS, "arrays of the same name, or too many")
    local, taken = {f"{name}[{k}]" for name, size in sizes.items() for k in range(size)}, {"sgn", sign}
    demand(not taken & {*sizes}, f"an array is called {sign}")
    number, called = re.compile(rf"(?<![\w.]){DOUBLE}"), re.compile(rf"(?<!\.)\b{sign}(?= ?\()")
    function = re.compile(rf"\bsgn\b|\b{sign}\b")
    while statement := STATEMENT.match(text, end):
        declared, target, way, value = statement.groups()
        end = statement.end()
        demand(target.split("[")[0] not in taken, f"{target} is a function")
        again = target in local or target in sizes  # one may hide another
        demand(not (declared and again), f"{target} is declared twice")
        local |= {target} if declared else set()
        demand("." in target.split("[")[0] or target in local, f"{target} is set")
        whole, other = re.search(r"(?<![\w.[])[0-9]", number.sub("", value)), function.search(called.sub("", value))
        demand(not whole and not other, f"{value[:80]}: a number or a function out of place")
        found.append((target, called.sub("sgn", f"{target} + {value}" if way == "+=" else value)))
    demand(end == len(text), f"{text[end : end + 80]!r} cannot be read")
    return found


def read(name: str, files: dict[str, str]) -> C:
    """What NAME.c and NAME.h (name: text) hold, or ValueError."""
    demand(re.fullmatch("[a-z][a-z0-9_]*", name), "no name")
    source, header, form = plain(files[f"{name}.c"]), plain(files[f"{name}.h"]), SOURCE
    real = "float" if re.search(r"\bfloat\b", header) else "double"
    if real == "float":
        source, header, form = in_doubles(source), in_doubles(header), SOURCE.replace("1e+150", "1e+18")
    guarded = f"{name.upper()}_RUNNING" in source
    form, top = (form, HEADER) if guarded else (BARE_SOURCE, BARE_HEADER)
    if f"{name}_sign" not in source:
        form = re.sub("static inline .*", "", form)
    if guarded:
        prepare, init, begun, reset, predict, most, resume, given, step, commit = between(form, name, source)
        demand(most in ("1", "2", "4", "8"), f"{name}.c: {most} invalid samples in a row")
        sums, bodies = (given, begun, step), [init, reset, predict, resume, step]
    else:
        prepare, init, step = between(form, name, source)
        sums, commit, bodies, most = None, "", [init, step], "0"
    own = rf"{name.upper()}_(?:RUNNING|HOLDING|STARTING|PARAMETERS|COLD)"
    macros = rf"\b(?:{own}|STICTION_\w+)\b"  # which a local could hide, or which the compiler replaces
    for text in (prepare, commit, *bodies, *(sums or ())):
        plain_loops = re.fullmatch(r"[^{}]*+(?:{[^{}]*+}[^{}]*+)*+", text) and not re.search(macros, text)
        demand(plain_loops, f"{name}.c: {text[:80]!r} holds more than statements")
    fields, values, *others = between(top, name, header)
    demand(
        all(re.fullmatch(f"(?:{FIELD})*", struct) for struct in (fields, *others)), f"{name}.h: no fields of doubles"
    )
    arrays = [re.findall(FIELD, struct) for struct in (fields, *others)]
    taken = {"sgn", f"{name}_sign"} & {field for array in arrays for field, _ in array}
    demand(not taken, f"{name}.h: a field is called as a function")
    demand(sum(int(n or 1) for array in arrays for _, n in array) <= MOST_FIELDS, f"{name}.h: too many fields")
    parameters, states, inputs, outputs = (
        [f"{of}.{x}{n and f'[{k}]'}" for x, n in array for k in range(int(n or 1))]
        for of, array in zip(("parameters", "state", "inputs", "outputs"), arrays, strict=True)
    )
    as0 = ", ".join(f"{{ {', '.join('0' * int(n))} }}" if n else "0" for _, n in arrays[0])
    demand(re.sub(f"-?{DOUBLE}", "0", values) == as0, f"{name}.h: values are not as their fields")
    stated = dict(zip(parameters, map(Fraction, re.findall(f"-?{DOUBLE}", values)), strict=True))
    made, start, *faults, before = (assignments(text, f"{name}_sign") for text in (prepare, *bodies))
    whole = assignments(f"{step} {commit}".strip(), f"{name}_sign")
    first = len(before) if guarded else next((k for k, (x, _) in enumerate(whole) if "." in x.split("[")[0]), 0)
    fields_of = (stated, states, inputs, outputs)
    faults = faults or [[], [], []]
    return C(name, PRECISIONS[real], sums, int(most), *fields_of, made, start, whole[:first], whole[first:], *faults)


def detects(c: C) -> None:
    """Raises ValueError where a sum that detects invalid samples lacks an input or a next state (module docstring)."""
    if c.sums is None:  # nothing is compared with a limit
        return
    name, (given, begun, step), states, inputs = c.name, c.sums, c.states, c.inputs
    valid, started = (without_magnitudes(terms(*each)) for each in (("given", given), ("check", begun)))
    demand(valid == {*inputs}, f"{name}.c: `given` is not the sum of all inputs")
    demand(started == {*inputs, *states}, f"{name}.c: `check` is not the sum of inputs and states")
    before, _, sum_ = step.rpartition("double check = ")
    demand(not re.search(r"(?<!\.)\bcheck\b", before), f"{name}.c: `check` is set anew")  # a field may be called so
    follow, summed = [re.sub(r"state\.(\w+)", r"\1_next", z) for z in states], terms("check", f"double check = {sum_}")
    demand({*summed} >= {*follow}, f"{name}.c: `check` does not hold all next states")
    besides = {*summed} - {*follow}
    demand(all(re.fullmatch(r"[\w.]+(?:\[\d+\])?", x) for x in besides), f"{name}.c: `check` holds more than names")
    again = {"check", *follow} & {*dict(c.commit)}  # the size of `check` is that of the last; a next state would differ
    demand(not again, f"{name}.c: {', '.join(f'`{x}`' for x in sorted(again))} is set again")
    committed = [(z, x) for z, x in c.commit if z.startswith("state.")]
    demand(
        sorted(committed) == sorted(zip(states, follow, strict=True)), f"{name}.c: other next states than in `check`"
    )
    shown = {x: {x} for x in inputs}  # name -> inputs whose NaN or infinity it shows, as the statements run
    for target, value in c.step:
        names = passed_on(ast.parse(value := value.strip(), mode="eval").body, value)
        shown[target] = {y for x in names for y in shown.get(x, ())}
    demand({*inputs} <= shown["check"], f"{name}.c: `check` does not see all inputs")


def without_magnitudes(terms: list[str]) -> set[str]:
    """The terms of a sum or, where all of them are magnitudes, of what: x + fabs(x) would hide a large x below 0."""
    within = [re.fullmatch(r"fabs\(([^()]*)\)", x) for x in terms]
    return {x[1] for x in within if x} if all(within) else {*terms}


def passed_on(node: ast.expr, text: str) -> set[str]:
    """Names in an expression of C whose NaN or infinity is passed on: none in a divisor or a call of sign or exp."""
    match node:
        case ast.Name() | ast.Attribute() | ast.Subscript():
            return {text[node.col_offset : node.end_col_offset]}
        case ast.Call(ast.Name(name), [argument]) if name in ("fabs", "sin", "cos"):
            return passed_on(argument, text)
        case ast.BinOp(left, operator, right):
            return passed_on(left, text) | (set() if isinstance(operator, ast.Div) else passed_on(right, text))
        case ast.UnaryOp(_, of):
            return passed_on(of, text)
    return set()


def terms(name: str, text: str) -> list[str]:
    """The terms of the sum that this C computes, with its loops unrolled; each must occur once."""
    head, *loops = re.split(" (?=for )", text)
    first = re.fullmatch(rf"(?:const )?double {name} = ([^;{{}}]*);", head)
    found = first[1].split(" + ") if first else []
    for loop in loops:
        part = re.fullmatch(rf"{LOOP}{name} \+= ([^;{{}}]*); }}", loop)
        demand(part, f"{loop[:80]!r} is no part of a sum")
        each = passes(part[1], part[2]) if part else ()
        demand(len(each) * len(loop) < MOST_TEXT, "loops that are too long")
        found += [x.replace("[i]", f"[{k}]") for k in each for x in part[3].split(" + ")] if part else []
    demand(first and len(found) == len({*found}), f"`{name}` is no sum, or a term occurs twice in it")
    return [x for x in found if x != "0.0"]
