"""Whether the C enters, counts and leaves its modes as it must: the functions that handle a sample with fault 1.

Standard library only; part of the checker (verify.py), which hands ``kernel`` in. The kernel's theorem is about samples
with fault 0. Here every statement that names a mode, the count of invalid samples or the fault must be as in FORM;
what stands between (``...``) names none of these, nor the state as a whole. So, in C that compiles:

- HOLDING follows 1, 2, 4 or 8 invalid samples in a row. The count is at most 8 and cannot overflow.
- A sample is valid if a sum of inputs is within the limit. It leaves HOLDING and STARTING, and any value that is not a
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
STATE = r"[^\0]*; NAME_mode mode; unsigned char invalid_samples; } NAME_state;[^\0]*"
WORDS = (
    r"(?:state->)?(?:mode|invalid_samples)|fault|if|while|switch|return|goto|state(?!->)|"
    r"UPPER_(?:RUNNING|HOLDING|STARTING)|NAME_(?:init|predict|resume|handle_fault|step)"
)
CALM = rf"(?!\b(?:{WORDS})\b)[^&{{}}#\"']"
TERMS = r"(?:inputs|state)->\w+(?:\[\w+\])?(?: \+ (?:inputs|state)->\w+(?:\[\w+\])?)*;"
PARTS = {
    r" \.\.\. ": rf"(?:{CALM}|{{(?:{CALM})*+}})*+",
    "LIMIT": "1e[+]150",
    "MOST": "[1248]u",
    **{
        f" SUM {name} ": rf" (?:const )?double {name} = (?:0\.0;|{TERMS}) "
        rf"(?:for \(int i = \d+; i < \d+; i\+\+\) {{ {name} \+= {TERMS} }} )*"
        for name in ("check", "given")
    },
}


def require(name: str, files: dict[str, str]) -> None:
    """Raises ValueError where NAME.c or NAME.h (name: text) handles samples with fault 1 otherwise."""
    form = re.sub(r"[.(){}*+]", r"\\\g<0>", " ".join(FORM.split()))
    for part, meant in PARTS.items():
        form = form.replace(part, meant)
    prepare = rf"void NAME_prepare\(NAME_parameters \*parameters\) {{{kernel.BODY}}}"
    kernel.matched(rf"[^\0]*{prepare} {form}[^\0]*", f"{name}.c", files[f"{name}.c"])
    kernel.matched(STATE, f"{name}.h", files[f"{name}.h"])
