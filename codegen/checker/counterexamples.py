"""What the checker refuses, and why: python3 counterexamples.py generated/one_mass < PROOF.json shows each.

Every case changes the genuine one_mass.c (c), one_mass.h (h) or its proof (p) in one place, so that the theorem of
errors.py, or what frame.py and theorem.py say, would be false or would be about something else than the C that is
compiled, or so that it is no proof at all.
"""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING or __package__:
    from codegen.checker import verify
else:
    import verify


class Case(NamedTuple):
    """One change: why it must be refused, the file, the texts before and after, a part of what the checker answers."""

    why: str
    file: str
    old: str
    new: str
    answer: str


STEP = "z_v_next = state->z_v +"
LAW = "parameters->one_over_m * (inputs->w - F_hat_rail)"
SET = "        state->z_v = z_v_next;\n"
GUARD = "    const double check = z_v_next"
SHOW = "outputs->v_hat = v_hat;"
E_50 = "2.7182818284590452353602874713526624977572470937000"  # the exp(1.0) of the kernel
NOT_KNOWN, FIELDS = "is nothing that is known here", "fields are not so named"
NOT_READ, NOT_SHOWN, NOT_MOVED = "cannot be read", "do not show the estimates", "does not move the errors"
NO_WORD, FORM = "is no expression", "is not of the form that is read"


def alike(file: str, answer: str, *changes: tuple[str, str, str]) -> list[Case]:
    """Cases with the same answer, of (why, before, after) each."""
    return [Case(why, file, old, new, answer) for why, old, new in changes]


CASES = (
    # the law of the code
    *alike(
        "c",
        NOT_MOVED,
        ("the code's gain is ten times the header's", "parameters->h_K_F * sign", "10.0 * parameters->h_K_F * sign"),
        ("friction acts the wrong way round", "inputs->w - F_hat_rail", "inputs->w + F_hat_rail"),
        ("another law for slow slips", STEP, f"{STEP} (1.0 - one_mass_sign(fabs(v_hat) - 300.0)) * v_hat +"),
        ("another law for the slowest slips", STEP, f"{STEP} (1.0 - one_mass_sign(fabs(v_hat) - 5.0)) * v_hat +"),
        ("another law at no sampled point", STEP, f"{STEP} (v_hat - 3.0) * (v_hat + 7.0) * v_hat +"),
        ("another law by rounding", STEP, f"{STEP} (v_hat + 1e90 - 1e90 - v_hat) + 1e-9 +"),
        ("gravity that the machine has not", LAW, f"{LAW} - 9.81"),
        ("a state that is never set", SET, ""),
        ("a state set by what it was", SET, "        state->z_v = state->z_v;\n"),
    ),
    *alike(
        "c",
        "is its rounding",
        ("what rounding leaves of a sum", STEP, f"{STEP} 1e14 * (0.1 + 0.2 - 0.3) * v_hat +"),
        ("what 50 digits leave of an exp", STEP, f"{STEP} 1e60 * (exp(1.0) - {E_50}) * v_hat +"),  # -4e10 v_hat
    ),
    Case(
        "a slip that rounding turns",
        "c",
        STEP,
        f"{STEP} 0.0 * fabs(v_hat + 1e20 * inputs->x - 1e20 * inputs->x) +",
        "is its rounding",
    ),
    Case(
        "a slip that underflow makes 0",
        "c",
        "one_mass_sign(v_hat)",
        "one_mass_sign(1e-99 * 1e-99 * 1e-99 * v_hat)",
        "a number is too large or small",
    ),
    Case(
        "a product of quotients that underflow makes 0",
        "c",
        STEP,
        f"{STEP} 0.0 * (1.0 / (1e99 * 1e66 * (2.0 + sin(inputs->x))) / (1e99 * 1e66 * (2.0 + sin(inputs->x)))) +",
        "a quotient, or a product with it, is too large or small",
    ),
    Case("a constant added to the level", "c", "fabs(v_hat); /* N */", "fabs(v_hat) + 5.0; /* N */", NOT_SHOWN),
    Case("a velocity shown too large", "c", SHOW, "outputs->v_hat = 1.01 * v_hat;", NOT_SHOWN),
    Case("a velocity that is not shown", "c", SHOW, "", "outputs.v_hat"),
    Case("the held output of the last sample is read", "c", LAW, f"{LAW} + outputs->v_hat", "is nothing that is known"),
    Case("a parameter is set in the step", "c", SET, f"{SET}        parameters->K_F = 0.0;\n", "parameters.K_F is set"),
    Case("an input is set in the step", "c", SET, f"{SET}        inputs->x = 0.0;\n", "inputs.x is set"),
    Case(
        "a state is set in a sample with a fault too", "c", GUARD, f"    state->z_v = z_v_next;\n{GUARD}", "z_v is set"
    ),
    Case("an output is shown in a sample with a fault too", "c", GUARD, f"    {SHOW}\n{GUARD}", "v_hat is set"),
    Case("the guard's own state is set", "c", SET, f"{SET}        state->mode = 0.0;\n", "state.mode is set"),
    Case("a function that is no polynomial", "c", LAW, f"({LAW}) + 0.0 * tanh(v_hat)", "C calls tanh"),
    Case("an exponential", "c", LAW, f"({LAW}) + exp(v_hat) - exp(v_hat)", "exp of what may be above 0"),
    Case("another exponential", "c", LAW, f"({LAW}) + 0.001 * exp(-v_hat * v_hat)", "does not move the errors"),
    Case("a logarithm", "c", LAW, f"({LAW}) + log(2.0) - log(2.0)", "C calls log"),
    Case("a root of a negative number", "c", LAW, f"({LAW}) + 0.0 * sqrt(-1.0)", "C calls sqrt"),
    *alike(
        "c",
        FORM,
        ("a fault that is reported of another step", "    outputs->fault = 1;", "    outputs = 0; outputs->fault = 1;"),
        ("a fault for what is not large", "if (fabs(check) <= 1e+150 && state", "if (fabs(check) <= 1e+3 && state"),
        (
            "another guard",
            "state->mode == ONE_MASS_RUNNING) {\n        outputs",
            "state->mode == ONE_MASS_RUNNING && v_hat < 5.0) {\n        outputs",
        ),
        (
            "another mode is the one of the step",
            "mode == ONE_MASS_RUNNING) {\n        out",
            "mode == ONE_MASS_HOLDING) {\n        out",
        ),
        ("a sample that is not used shows fault 0", "    outputs->fault = 1;\n}", "    outputs->fault = 0;\n}"),
        ("fault 1 at times", "    outputs->fault = 1;\n}", "    if (given > 0.0) outputs->fault = 1;\n}"),
        ("a fault that is no longer reported", "    outputs->fault = 1;\n}", "    return;\n    outputs->fault = 1;\n}"),
    ),
    Case("most samples are faults", "c", "check = z_v_next", "check = 1e75 * 1e75 * z_v_next", "not hold all"),
    Case("a number that no double holds", "c", LAW, f"({LAW}) * 1e-400 * 1e200 * 1e200", "out of place"),
    Case("a mode in the law", "c", LAW, f"({LAW}) * state->mode", "state.mode is nothing that is known"),
    Case(
        "a count in the law", "c", LAW, f"({LAW}) * state->invalid_samples", "invalid_samples is nothing that is known"
    ),
    *alike(
        "h",
        FORM,
        ("a mode of another value", "    ONE_MASS_HOLDING,", "    ONE_MASS_HOLDING = 0,"),
        ("modes in another order", "    ONE_MASS_HOLDING,", "    ONE_MASS_STARTING, ONE_MASS_HOLDING,"),
        ("modes declared twice", "} one_mass_mode;", "} one_mass_mode;\nenum { ONE_MASS_IDLE };"),
        ("a macro for a mode", "typedef enum", "#define ONE_MASS_RUNNING 1\ntypedef enum"),
    ),
    Case(
        "a local that hides a mode",
        "c",
        "    const double v_hat =",
        "    const double ONE_MASS_RUNNING = 1.0;\n    const double v_hat =",
        "holds more than statements",
    ),
    # C that says something else than it seems to
    *alike(
        "c",
        FORM,
        ("the sign function is another", "(u > 0.0) ?", "(u > 300.0) ?"),
        ("a macro in the code", "#include <math.h>\n", "#include <math.h>\n#define fabs(u) 0.0\n"),
        ("a file of a like name is included", '"one_mass.h"', '"one_mass-h"'),
        ("a file whose name holds an arrow is included", '"one_mass.h"', '"one_mass->h"'),
        ("another library's file is included", "<math.h>", "<math->h>"),
        ("a limit that is infinite", "if (fabs(check) <= 1e+150 && state", "if (fabs(check) <= 1e+999 && state"),
        ("another file is included", "#include <math.h>\n", '#include <math.h>\n#include "more.h"\n'),
        (
            "code that some compilers leave out",
            "#endif\n\n#if defined(__GNUC__)",
            "double g;\n#endif\n\n#if defined(__GNUC__)",
        ),
        ("a global", "void one_mass_prepare(", "double memory;\n\nvoid one_mass_prepare("),
        (
            "a function of another name",
            "void one_mass_prepare(",
            "double fabs(double u) { return 7.0; }\nvoid one_mass_prepare(",
        ),
        ("text that is run", LAW, "__import__('os')"),
    ),
    Case("a macro in the header", "h", "#ifdef __cplusplus\n", "#define K_F K_v\n#ifdef __cplusplus\n", FORM),
    *alike(
        "c",
        NOT_READ,
        ("a static in the step", "    const double v_hat =", "    static double v_hat ="),
        ("a branch", SET, f"        if (v_hat < 5.0) {{ state->z_v = 0.0; }}\n{SET}"),
        ("a comment that ends by a backslash", "/* velocity estimate", "/* *\\\n/ double g; /* velocity estimate"),
        (
            "a loop over nothing, with a block behind it that is run once",
            SET,
            f"{SET}        for (int i = 0; i < 0; i++) (void)state; {{ state->z_v += 1.0; }}\n",
        ),
        (
            "a function that C++ declares, and behind it what is set",
            "    const double v_hat =",
            "    double q = 0.0; double f(void)noexcept; q = 1.0; double fq2 = q;\n    const double v_hat = q +",
        ),
        ("a loop without end", SET, f"        for (;;) {{ }}\n{SET}"),
    ),
    Case(
        "a declaration in a loop without a pass, by which the compiler calls cos as sin",
        "c",
        SET,
        f"        for (int i = 0; i < 0; i++) {{ extern double sin(double) __asm__(__STRING(cos)); }}\n{SET}",
        "a loop without a pass",
    ),
    *alike(
        "c",
        NO_WORD,
        ("a choice", LAW, f"({LAW}) * (v_hat < 5.0 ? 1.0 : 2.0)"),
        ("a comparison as a number", LAW, f"({LAW}) * (1.0 + (v_hat < 5.0))"),
        (
            "a decrement that looks like a sum",
            "= state->z_v + parameters->K_v",
            "= 0.0 - --state->z_v + parameters->K_v",
        ),
    ),
    Case("a cast", "c", LAW, f"(int)(-{LAW})", "C calls int"),
    Case("whole numbers divide otherwise", "c", LAW, f"{LAW} + 1 / 2", "out of place"),
    Case("an octal number", "c", "- parameters->K_F * fabs", "- 010.0 * fabs", ""),
    Case("a comment from // on", "c", LAW, f"{LAW} //* */ 2.0\n", "a comment from // on"),
    Case("a comment that ends by a trigraph", "c", "/* velocity estimate", "/* *??/\n/ velocity estimate", "??"),
    Case("a letter that looks like another", "c", "sign_rail * a_hat", "sign_r\u0430il * a_hat", "not ASCII"),
    Case("a local that hides another", "c", SET, f"        const double z_v_next = 0.0;\n{SET}", "declared twice"),
    Case(
        "a local that begins as the one that it hides",
        "c",
        SET,
        f"        const double v_hat = v_hat + 1.0;\n{SET}",
        "declared twice",
    ),
    Case("a global of math.h", "c", STEP, f"{STEP} 0.0; signgam = 3.0; const double more = v_hat +", "signgam is set"),
    Case(
        "an element by octal digits",
        "c",
        "    const double v_hat =",
        "    double t[9];\n    t[8] = 1.0;\n    t[010] = 2.0;\n    const double v_hat =",
        "t[010] is set",
    ),
    Case(
        "an element behind its array",
        "c",
        "    const double v_hat =",
        "    double t[2];\n    t[2] = 1.0;\n    const double v_hat =",
        "t[2] is set",
    ),
    Case(
        "the count of a loop as a number",
        "c",
        "    const double v_hat =",
        "    double t[2];\n    for (int i = 0; i < 2; i++) {\n        t[i] = i / 2;\n    }\n    const double v_hat =",
        "i in an expression",
    ),
    Case("an array beyond its end", "c", STEP, "z_v_next = more[2] + state->z_v +", "is nothing that is known"),
    Case(
        "a check in which a next state cancels",
        "c",
        "check = z_v_next",
        "check = z_v_next + z_v_next * -1.0",
        "holds more than names",
    ),
    # values
    Case(
        "the header starts from another derived value",
        "h",
        "0.01 /* h_K_F */",
        "0.02 /* h_K_F */",
        "prepare gives others",
    ),
    Case("the header has another gain", "h", "10.0, /* K_F */", "100.0, /* K_F */", "prepare gives others"),
    Case(
        "prepare derives another value",
        "c",
        "sample_time * parameters->K_F;",
        "sample_time * parameters->K_v;",
        "prepare gives others",
    ),
    *alike(
        "h",
        "not as their fields",
        ("a value in braces, and so the next one shifted", "1.0, /* m */", "{ 1.0, 2.0 }, /* m */"),
        ("an octal value", "10.0, /* K_F */", "012, /* K_F */"),
        ("a value that is none", "10.0, /* K_F */", "NAN, /* K_F */"),
    ),
    # states
    Case(
        "an unstable state that no error covers", "h", "    double z_rail;", "    double z_y;\n    double z_rail;", ""
    ),
    Case(
        "a unit in a remark within the remark",
        "h",
        "/* N: friction level, (4.11) */",
        "/* N: friction level; double a_hat_rail; /* kN: of it */",
        "has two units",
    ),
    Case("a velocity in N", "h", "m/s: velocity estimate", "N: velocity estimate", "is not that of x per second"),
    # the claim
    Case("V falls faster than is true", "p", '"213/20"', '"12"', "V may not fall"),
    Case("V falls so fast that it would be negative", "p", '"213/20"', '"1000"', "V negative"),
    Case("P is not definite", "p", '"2371/50000"', '"0"', "not definite"),
    Case("P is not symmetric", "p", '"98/125"\n  ],', '"99/125"\n  ],', "not symmetric"),
    Case("the matrix is another", "p", '"9/10"', '"8/10"', NOT_MOVED),
    Case("another step", "p", '"step": "euler"', '"step": "semi_implicit"', NOT_MOVED),
    Case("growth is too small", "p", '"3190351/1000000"', '"3190345/1000000"', "not positive semidefinite"),
    Case("dwell is too short", "p", '"54"', '"50"', "has not recovered"),
    Case("dwell is no number", "p", '"54"', '"3520000000"', "has not recovered"),
    *alike(
        "p",
        "is not force",
        ("the machine is twice as heavy", '"parameters.m"', '"2*parameters.m"'),
        ("the machine has a negative mass", '"parameters.m"', '"-parameters.m"'),
        ("the level is the declared number", "true.a_rail*sign.rail", "parameters.rail_a*sign.rail"),
    ),
    Case("the machine follows its estimate", "p", "/parameters.m", "/parameters.m + 0.001*outputs.v_hat", NOT_KNOWN),
    *alike(
        "p",
        "not so named",
        (
            "the error is scaled by a gain",
            '"sign": "sign.rail"\n  }\n ],\n "states"',
            '"sign": "parameters.K_v"\n  }\n ],\n "states"',
        ),
        ("the error is of an input", '"outputs.v_hat",\n   "sign"', '"inputs.x",\n   "sign"'),
        ("a truth of any name", '"truth": "true.v"', '"truth": "v"'),
    ),
    Case("the state is another formula", "p", "-parameters.K_v*inputs.x", "-2*parameters.K_v*inputs.x", NOT_SHOWN),
    Case(
        "an error is left out",
        "p",
        ',\n  "state.z_rail": "parameters.K_F*sign.rail*outputs.v_hat + outputs.a_hat_rail"',
        "",
        "not an error for each",
    ),
    *alike(
        "p",
        "",
        ("the sign is of something else", '"sign.rail": "outputs.v_hat"', '"sign.rail": "inputs.x"'),
        ("a number that is none", '"213/20"', "NaN"),
        ("a division by zero", '"213/20"', '"1/0"'),
        ("nested too deeply", '"213/20"', '"' + "(" * 5000 + "1" + ")" * 5000 + '"'),
        ("a long row of minus signs", '"213/20"', '"' + "- " * 9000 + '1"'),
        ("a number without an end", '"213/20"', '"' + "9" * 5000 + '"'),
        ("a step that there is not", '"step": "euler"', '"step": "implicit"'),
    ),
    Case(
        "a sign of itself, turned round",
        "p",
        '"sign.rail": "outputs.v_hat"',
        '"sign.rail": "outputs.v_hat", "sign.q": "-sign.q"',
        "is nothing that is known",
    ),
    Case(
        "a remark in a reversal", "p", '"dwell": "54"', '"dwell": "54", "claim": "at once"', "fields are not so named"
    ),
    Case("an object in place of a list", "p", '"domain": []', '"domain": {"1": "everywhere"}', "expected is a list"),
    Case("the box is of no variable", "p", '"box": {}', '"box": {"true.y": ["0", "1"]}', "box of no free variable"),
    Case(
        "the box is of an estimate", "p", '"box": {}', '"box": {"outputs.v_hat": ["0", "1"]}', "box of no free variable"
    ),
    Case("a domain without a point", "p", '"domain": []', '"domain": ["-1"]', "`witness` is not of"),
    Case("a range of three ends", "p", '"box": {}', '"box": {"inputs.w": ["0", "1", "2"]}', "too many values"),
    Case(
        "a cut that is none", "p", '"cover": ""', '"cover": ["sign.rail", "2", "", ""]', "is not cut between its ends"
    ),
    Case("a cover with a gap", "p", '"cover": ""', '"cover": ["sign.rail", "0", ""]', "not enough values"),
    Case("a unit of its own", "p", '"cover": ""', '"cover": "", "unit": "mN"', FIELDS),
    Case("a remark of its own", "p", '"cover": ""', '"cover": "", "claim": "rounding adds -7.7e-06 N"', FIELDS),
    Case("a power tower", "p", '"213/20"', '"9**9**9"', "is no 'RATIONAL'"),
    Case("text that is run in a proof", "p", '"213/20"', "\"__import__('os')\"", "is no 'RATIONAL'"),
    Case("another machine's folder", "p", '"name": "one_mass"', '"name": "two_mass"', "two_mass.c"),
    Case("a way out of the folder", "p", '"name": "one_mass"', '"name": "../one_mass/one_mass"', "no name"),
)


def answer(case: Case, folder: Path, proof: str) -> str:
    """What the checker says of the folder's C and this proof with the change, or "proved"."""
    files = {f"one_mass.{end}": (folder / f"one_mass.{end}").read_text("utf-8") for end in "ch"} | {"p": proof}
    name = "p" if case.file == "p" else f"one_mass.{case.file}"
    files[name] = files[name].replace(case.old, case.new, 1)
    claimed = json.loads(files.pop("p"))
    try:
        verify.by_kernel_alone(claimed, {name: text.encode() for name, text in files.items()})
    except verify.Refused as why:
        return f"{type(why).__name__}: {why}"
    return "proved"


def main() -> None:
    """Print every case and the checker's answer."""
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "one_mass.c").is_file():
        sys.exit("usage: python3 counterexamples.py generated/one_mass < generated/one_mass/proof.json")
    proof = sys.stdin.read()
    for case in CASES:
        print(f"{case.why}:\n    {answer(case, Path(sys.argv[1]), proof)[:300]}")


if __name__ == "__main__":
    main()
