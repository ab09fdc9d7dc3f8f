"""Whether the C enters, counts and leaves its modes as it must: the functions that handle a sample with fault 1.

Standard library only; part of the checker (verify.py), which hands ``kernel`` in. The kernel's theorem is about samples
with fault 0. Here every statement that names a mode, the count of invalid samples or the fault must be as in FORM;
between them (``...``) are plain assignments to fields of the state and to locals, without casts and within their
arrays. So, in C that compiles:

- HOLDING follows 1, 2, 4 or 8 invalid samples in a row. The count is at most 8 and cannot overflow.
- A sample is valid if the sum of all inputs is within the limit; `check` of the step is a sum that holds every next
  state once, and depends on every input. A valid sample leaves HOLDING and STARTING, and any value that is not a
  mode; the next mode is RUNNING, or STARTING if the state that this sample gives is invalid.
"""

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING or __package__:
    from codegen.checker import kernel

FORM = """
void NAME_init(NAME_state *state, const NAME_parameters *parameters, const NAME_inputs *inputs) {
    ...
    state->mode = UPPER_RUNNING;
    state->invalid_samples = 0u;
    SUM check
    if (!(fabs(check) <= LIMIT)) {
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
        if (state->invalid_samples >= MOST) {
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
    SUM given
    if (!(fabs(given) <= LIMIT)) {
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
void NAME_step("""
DOUBLES = r"((?:double \w+(?:\[\d+\])?; )+)"
STATE = rf"[^\0]*typedef struct {{ {DOUBLES}NAME_mode mode; unsigned char invalid_samples; }} NAME_state; "
STATE += rf"typedef struct {{ {DOUBLES}}} NAME_inputs;[^\0]*"
WORDS = (
    r"(?:state->)?(?:mode|invalid_samples)|fault|if|while|switch|return|goto|state(?!->)|"
    r"UPPER_(?:RUNNING|HOLDING|STARTING)|NAME_(?:init|predict|resume|handle_fault|step)"
)
CALM = rf"(?!\b(?:{WORDS})\b)[^&{{}}#\"']"
SUMMED = r"[\w.>-]+(?:\[\w+\])?(?: \+ [\w.>-]+(?:\[\w+\])?)*;"
PARTS = {
    r" \.\.\. ": rf"((?:{CALM}|{{(?:{CALM})*+}})*+)",
    "LIMIT": "1e[+]150",
    "MOST": "[1248]u",
    **{
        f" SUM {name} ": rf" ((?:const )?double {name} = {SUMMED} "
        rf"(?:for \(int i = \d+; i < \d+; i\+\+\) {{ {name} \+= {SUMMED} }} )*)"
        for name in ("check", "given")
    },
}
VALUE = r"[\w.()\[\]*/+<>?: -]+"
PLAIN = (
    rf"(?:(?:const )?double \w+(?:\[\d+\])?(?: = {VALUE})?|"
    rf"(?:state\.|(?!(?:state|inputs|outputs|parameters)\b))\w+(?:\[\w+\])? \+?= {VALUE}); ?"
)
LINES = rf"(?: ?\(void\)\w+; ?| ?{PLAIN}|for \(int i = \d+; i < \d+; i\+\+\) {{ (?:{PLAIN})*+}} ?)*+ ?"
LOOP = r"for \(int i = (\d+); i < (\d+); i\+\+\) {{ {} \+= ([^;]*); }}"
CALLS = {"for", "fabs", "sqrt", "sin", "cos", "exp", "tanh"}


def require(name: str, files: dict[str, str]) -> tuple[str, str, str]:
    """What init, predict and resume give the states; ValueError where NAME.c or NAME.h (name: text) is otherwise."""
    form = re.sub(r"[.(){}*+]", r"\\\g<0>", " ".join(FORM.split()))
    for part, meant in PARTS.items():
        form = form.replace(part, meant)
    prepare = rf"void NAME_prepare\(NAME_parameters \*parameters\) {{{kernel.BODY}}}"
    found = kernel.matched(rf"[^\0]*{prepare} {form}([^\0]*)", f"{name}.c", files[f"{name}.c"])
    begun, check, reset, predicted, resumed, given, step = found
    for text in (begun, reset, predicted, resumed):
        calls = {*re.findall(r"(\w+) ?\(", text)} <= CALLS | {f"{name}_sign"}
        plain = re.fullmatch(LINES, text) and not re.search(r"\* ?\)|\( ?\*|= \*", text)
        kernel.demand(plain and calls, f"{name}.c: a state is set by more than plain assignments")
    fields, _, *others = kernel.matched(kernel.HEADER, f"{name}.h", files[f"{name}.h"])
    here = {
        f"{of}.{x}{n and f'[{k}]'}"
        for of, struct in zip(("parameters", "state", "inputs", "outputs"), (fields, *others), strict=True)
        for x, n in re.findall(r"double (\w+)(?:\[(\d+)\])?;", struct)
        for k in range(int(n or 1))
    }
    for text in (begun, reset, predicted, resumed):  # run for its indices alone: each is within its array
        code = kernel.Text({x: kernel.term(1, x) for x in here}, {}, f"{name}_sign")
        code.run(re.sub(r"\(void\)\w+; ?", "", text), {x for x in here if x.startswith("state.")})
    structs = kernel.matched(STATE, f"{name}.h", files[f"{name}.h"])
    states, inputs = (
        {
            f"{of}.{x}{n and f'[{k}]'}"
            for x, n in re.findall(r"double (\w+)(?:\[(\d+)\])?;", struct)
            for k in range(int(n or 1))
        }
        for of, struct in zip(("state", "inputs"), structs, strict=True)
    )
    kernel.demand(terms("given", given) == inputs, f"{name}.c: `given` is not the sum of all inputs")
    kernel.demand(terms("check", check) == inputs | states, f"{name}.c: `check` is not the sum of inputs and states")
    heads, loops = len(re.findall(r"double check = ", step)), len(re.findall(LOOP.format("check"), step))
    kernel.demand(heads == 1 and len(re.findall(r"\bcheck\b", step)) == 2 + loops, f"{name}.c: `check` is set anew")
    follow = {re.sub(r"state\.(\w+)", r"\1_next", x) for x in states}
    summed = terms("check", step)
    kernel.demand(follow <= summed, f"{name}.c: `check` does not hold all next states")
    known = seen(summed, step)
    kernel.demand({re.sub(r"\[\d+\]", "", x) for x in inputs} <= known, f"{name}.c: `check` does not see all inputs")
    return begun, predicted, resumed


def terms(name: str, text: str) -> set[str]:
    """The terms of a sum in C, its loops unrolled; each stands in it once."""
    found = [
        x.replace("[i]", f"[{k}]")
        for a, b, of in re.findall(LOOP.format(name), text)
        for k in range(int(a), int(b))
        for x in of.split(" + ")
    ]
    found += [x for head in re.findall(rf"double {name} = ([^;]*);", text) for x in head.split(" + ") if x != "0.0"]
    kernel.demand(len(found) == len({*found}), f"a term stands twice in `{name}`")
    return {*found}


def seen(names: set[str], step: str) -> set[str]:
    """The inputs that values of these names are computed from, by the assignments of the step."""
    sources: dict[str, set[str]] = {}
    for target, value in re.findall(r"([\w.]+)(?:\[\w+\])? \+?= ([^;={}]+);", step):
        sources.setdefault(target, set()).update(re.findall(r"[A-Za-z_][\w.]*", value))
    reached, left = set(), {re.sub(r"\[\d+\]", "", x) for x in names}
    while left:
        reached |= left
        left = {y for x in left for y in sources.get(x, ())} - reached
    return {x for x in reached if x.startswith("inputs.")}
