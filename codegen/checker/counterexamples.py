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
FIRST = "    const double v_hat ="
PREPARE = "void one_mass_prepare("
LAW = "parameters->one_over_m * (inputs->w - F_hat_rail)"
SET = "        state->z_v = z_v_next;\n"
GUARD = "    const double check = z_v_next"
SHOW = "outputs->v_hat = v_hat;"
E_50 = "2.7182818284590452353602874713526624977572470937000"  # the exp(1.0) of the kernel
S_50 = "0.84147098480789650665250232163029899962256306079837"  # its sin(1.0)
NOT_KNOWN, FIELDS = "is nothing that is known here", "fields are not so named"
NOT_READ, NOT_SHOWN, NOT_MOVED = "cannot be read", "do not show the estimates", "does not move the errors"
NO_WORD, FORM = "is no expression", "is not of the form that is read"


CHANGES = {  # (file, a part of what the checker answers) -> (why it must be refused, text before, text after)
    ("c", NOT_MOVED): [
        ("the code's gain is ten times the header's", "parameters->h_K_F * sign", "10.0 * parameters->h_K_F * sign"),
        ("friction acts the wrong way round", "inputs->w - F_hat_rail", "inputs->w + F_hat_rail"),
        ("another law for slow slips", STEP, f"{STEP} (1.0 - one_mass_sign(fabs(v_hat) - 300.0)) * v_hat +"),
        ("another law for the slowest slips", STEP, f"{STEP} (1.0 - one_mass_sign(fabs(v_hat) - 5.0)) * v_hat +"),
        ("another law at no sampled point", STEP, f"{STEP} (v_hat - 3.0) * (v_hat + 7.0) * v_hat +"),
        ("another law by rounding", STEP, f"{STEP} (v_hat + 1e90 - 1e90 - v_hat) + 1e-9 +"),
        ("gravity that the machine has not", LAW, f"{LAW} - 9.81"),
        ("another exponential", LAW, f"({LAW}) + 0.001 * exp(-v_hat * v_hat)"),
        ("a state that is never set", SET, ""),
        ("a state set by what it was", SET, "        state->z_v = state->z_v;\n"),
    ],
    ("c", "is its rounding"): [
        ("what rounding leaves of a sum", STEP, f"{STEP} 1e14 * (0.1 + 0.2 - 0.3) * v_hat +"),
        ("what 50 digits leave of an exp", STEP, f"{STEP} 1e60 * (exp(1.0) - {E_50}) * v_hat +"),
        ("what 50 digits leave of a sine", STEP, f"{STEP} 1e60 * (sin(1.0) - {S_50}) * v_hat +"),
        ("a slip that rounding turns", STEP, f"{STEP} 0.0 * fabs(v_hat + 1e20 * inputs->x - 1e20 * inputs->x) +"),
    ],
    ("c", "a number is too large or small"): [
        ("a slip that underflow makes 0", "one_mass_sign(v_hat)", "one_mass_sign(1e-99 * 1e-99 * 1e-99 * v_hat)")
    ],
    ("c", "a quotient, or a product with it, is too large or small"): [
        (
            "a product of quotients that underflow makes 0",
            STEP,
            f"{STEP} 0.0 * (1.0 / (1e99 * 1e66 * (2.0 + sin(inputs->x))) / (1e99 * 1e66 * (2.0 + sin(inputs->x)))) +",
        )
    ],
    ("c", NOT_SHOWN): [
        ("a constant added to the level", "fabs(v_hat); /* N */", "fabs(v_hat) + 5.0; /* N */"),
        ("a velocity shown too large", SHOW, "outputs->v_hat = 1.01 * v_hat;"),
    ],
    ("c", "outputs.v_hat"): [("a velocity that is not shown", SHOW, "")],
    ("c", "is nothing that is known"): [
        ("the held output of the last sample is read", LAW, f"{LAW} + outputs->v_hat"),
        ("an array beyond its end", STEP, "z_v_next = more[2] + state->z_v +"),
    ],
    ("c", "parameters.K_F is set"): [("a parameter is set in the step", SET, f"{SET}        parameters->K_F = 0.0;\n")],
    ("c", "inputs.x is set"): [("an input is set in the step", SET, f"{SET}        inputs->x = 0.0;\n")],
    ("c", "z_v is set"): [
        ("a state is set in a sample with a fault too", GUARD, f"    state->z_v = z_v_next;\n{GUARD}")
    ],
    ("c", "v_hat is set"): [("an output is shown in a sample with a fault too", GUARD, f"    {SHOW}\n{GUARD}")],
    ("c", "state.mode is set"): [("the guard's own state is set", SET, f"{SET}        state->mode = 0.0;\n")],
    ("c", "C calls tanh"): [("a function that is no polynomial", LAW, f"({LAW}) + 0.0 * tanh(v_hat)")],
    ("c", "exp of what may be above 0"): [("an exponential", LAW, f"({LAW}) + exp(v_hat) - exp(v_hat)")],
    ("c", "C calls log"): [("a logarithm", LAW, f"({LAW}) + log(2.0) - log(2.0)")],
    ("c", "C calls sqrt"): [("a root of a negative number", LAW, f"({LAW}) + 0.0 * sqrt(-1.0)")],
    ("c", FORM): [
        ("a fault that is reported of another step", "    outputs->fault = 1;", "    outputs = 0; outputs->fault = 1;"),
        ("a fault for what is not large", "if (fabs(check) <= 1e+150 && state", "if (fabs(check) <= 1e+3 && state"),
        ("another guard", "RUNNING) {\n        outputs", "RUNNING && v_hat < 5.0) {\n        outputs"),
        ("another mode is the one of the step", "RUNNING) {\n        out", "HOLDING) {\n        out"),
        ("a sample that is not used shows fault 0", "    outputs->fault = 1;\n}", "    outputs->fault = 0;\n}"),
        ("fault 1 at times", "    outputs->fault = 1;\n}", "    if (given > 0.0) outputs->fault = 1;\n}"),
        ("a fault that is no longer reported", "    outputs->fault = 1;\n}", "    return;\n    outputs->fault = 1;\n}"),
        ("the sign function is another", "(u > 0.0) ?", "(u > 300.0) ?"),
        ("a macro in the code", "#include <math.h>\n", "#include <math.h>\n#define fabs(u) 0.0\n"),
        ("a file of a like name is included", '"one_mass.h"', '"one_mass-h"'),
        ("a file whose name holds an arrow is included", '"one_mass.h"', '"one_mass->h"'),
        ("another library's file is included", "<math.h>", "<math->h>"),
        ("a limit that is infinite", "if (fabs(check) <= 1e+150 && state", "if (fabs(check) <= 1e+999 && state"),
        ("another file is included", "#include <math.h>\n", '#include <math.h>\n#include "more.h"\n'),
        ("code that some compilers leave out", "#endif\n\n#if", "double g;\n#endif\n\n#if"),
        ("a global", PREPARE, f"double memory;\n\n{PREPARE}"),
        ("a function of another name", PREPARE, f"double fabs(double u) {{ return 7.0; }}\n{PREPARE}"),
        ("text that is run", LAW, "__import__('os')"),
    ],
    ("c", "not hold all"): [("most samples are faults", "check = z_v_next", "check = 1e75 * 1e75 * z_v_next")],
    ("c", "out of place"): [
        ("a number that no double holds", LAW, f"({LAW}) * 1e-400 * 1e200 * 1e200"),
        ("whole numbers divide otherwise", LAW, f"{LAW} + 1 / 2"),
    ],
    ("c", "state.mode is nothing that is known"): [("a mode in the law", LAW, f"({LAW}) * state->mode")],
    ("c", "invalid_samples is nothing that is known"): [
        ("a count in the law", LAW, f"({LAW}) * state->invalid_samples")
    ],
    ("h", FORM): [
        ("a mode of another value", "    ONE_MASS_HOLDING,", "    ONE_MASS_HOLDING = 0,"),
        ("modes in another order", "    ONE_MASS_HOLDING,", "    ONE_MASS_STARTING, ONE_MASS_HOLDING,"),
        ("modes declared twice", "} one_mass_mode;", "} one_mass_mode;\nenum { ONE_MASS_IDLE };"),
        ("a macro for a mode", "typedef enum", "#define ONE_MASS_RUNNING 1\ntypedef enum"),
        ("a macro in the header", "#ifdef __cplusplus\n", "#define K_F K_v\n#ifdef __cplusplus\n"),
    ],
    ("c", "holds more than statements"): [
        ("a local that hides a mode", FIRST, f"    const double ONE_MASS_RUNNING = 1.0;\n{FIRST}")
    ],
    ("c", NOT_READ): [
        ("a static in the step", FIRST, "    static double v_hat ="),
        ("a branch", SET, f"        if (v_hat < 5.0) {{ state->z_v = 0.0; }}\n{SET}"),
        ("a comment that ends by a backslash", "/* velocity estimate", "/* *\\\n/ double g; /* velocity estimate"),
        (
            "a loop over nothing, with a block behind it that is run once",
            SET,
            f"{SET}        for (int i = 0; i < 0; i++) (void)state; {{ state->z_v += 1.0; }}\n",
        ),
        (
            "a function that C++ declares, and behind it what is set",
            FIRST,
            f"    double q = 0.0; double f(void)noexcept; q = 1.0; double fq2 = q;\n{FIRST} q +",
        ),
        ("a loop without end", SET, f"        for (;;) {{ }}\n{SET}"),
    ],
    ("c", "a loop without a pass"): [
        (
            "a declaration in a loop without a pass, by which the compiler calls cos as sin",
            SET,
            f"        for (int i = 0; i < 0; i++) {{ extern double sin(double) __asm__(__STRING(cos)); }}\n{SET}",
        )
    ],
    ("c", NO_WORD): [
        ("a choice", LAW, f"({LAW}) * (v_hat < 5.0 ? 1.0 : 2.0)"),
        ("a comparison as a number", LAW, f"({LAW}) * (1.0 + (v_hat < 5.0))"),
        ("a decrement that looks like a sum", "state->z_v + parameters->K_v", "0.0 - --state->z_v + parameters->K_v"),
    ],
    ("c", "C calls int"): [("a cast", LAW, f"(int)(-{LAW})")],
    ("c", ""): [("an octal number", "- parameters->K_F * fabs", "- 010.0 * fabs")],
    ("c", "a comment from // on"): [("a comment from // on", LAW, f"{LAW} //* */ 2.0\n")],
    ("c", "??"): [("a comment that ends by a trigraph", "/* velocity estimate", "/* *??/\n/ velocity estimate")],
    ("c", "not ASCII"): [("a letter that looks like another", "sign_rail * a_hat", "sign_r\u0430il * a_hat")],
    ("c", "declared twice"): [
        ("a local that hides another", SET, f"        const double z_v_next = 0.0;\n{SET}"),
        ("a local that begins as the one that it hides", SET, f"        const double v_hat = v_hat + 1.0;\n{SET}"),
    ],
    ("c", "signgam is set"): [("a global of math.h", STEP, f"{STEP} 0.0; signgam = 3.0; const double more = v_hat +")],
    ("c", "t[010] is set"): [
        ("an element by octal digits", FIRST, f"    double t[9];\n    t[8] = 1.0;\n    t[010] = 2.0;\n{FIRST}")
    ],
    ("c", "t[2] is set"): [("an element behind its array", FIRST, f"    double t[2];\n    t[2] = 1.0;\n{FIRST}")],
    ("c", "i in an expression"): [
        (
            "the count of a loop as a number",
            FIRST,
            f"    double t[2];\n    for (int i = 0; i < 2; i++) {{\n        t[i] = i / 2;\n    }}\n{FIRST}",
        )
    ],
    ("c", "holds more than names"): [
        ("a check in which a next state cancels", "check = z_v_next", "check = z_v_next + z_v_next * -1.0")
    ],
    ("h", "prepare gives others"): [
        ("the header starts from another derived value", "0.01 /* h_K_F */", "0.02 /* h_K_F */"),
        ("the header has another gain", "10.0, /* K_F */", "100.0, /* K_F */"),
    ],
    ("c", "prepare gives others"): [
        ("prepare derives another value", "sample_time * parameters->K_F;", "sample_time * parameters->K_v;")
    ],
    ("h", "not as their fields"): [
        ("a value in braces, and so the next one shifted", "1.0, /* m */", "{ 1.0, 2.0 }, /* m */"),
        ("an octal value", "10.0, /* K_F */", "012, /* K_F */"),
        ("a value that is none", "10.0, /* K_F */", "NAN, /* K_F */"),
    ],
    ("h", ""): [
        ("an unstable state that no error covers", "    double z_rail;", "    double z_y;\n    double z_rail;")
    ],
    ("h", "has two units"): [
        (
            "a unit in a remark within the remark",
            "friction level, (4.11)",
            "friction level; double a_hat_rail; /* kN: of it",
        )
    ],
    ("h", "is not that of x per second"): [("a velocity in N", "m/s: velocity estimate", "N: velocity estimate")],
    ("p", "V may not fall"): [("V falls faster than is true", '"213/20"', '"12"')],
    ("p", "V negative"): [("V falls so fast that it would be negative", '"213/20"', '"1000"')],
    ("p", "not definite"): [("P is not definite", '"2371/50000"', '"0"')],
    ("p", "not symmetric"): [("P is not symmetric", '"98/125"\n  ],', '"99/125"\n  ],')],
    ("p", NOT_MOVED): [
        ("the matrix is another", '"9/10"', '"8/10"'),
        ("another step", '"step": "euler"', '"step": "semi_implicit"'),
    ],
    ("p", "not positive semidefinite"): [("growth is too small", '"3190351/1000000"', '"3190345/1000000"')],
    ("p", "has not recovered"): [
        ("dwell is too short", '"54"', '"50"'),
        ("dwell is no number", '"54"', '"3520000000"'),
    ],
    ("p", "is not force"): [
        ("the machine is twice as heavy", '"parameters.m"', '"2*parameters.m"'),
        ("the machine has a negative mass", '"parameters.m"', '"-parameters.m"'),
        ("the level is the declared number", "true.a_rail*sign.rail", "parameters.rail_a*sign.rail"),
    ],
    ("p", NOT_KNOWN): [("the machine follows its estimate", "/parameters.m", "/parameters.m + 0.001*outputs.v_hat")],
    ("p", "not so named"): [
        ("the error is scaled by a gain", '"sign.rail"\n  }\n ]', '"parameters.K_v"\n  }\n ]'),
        ("the error is of an input", '"outputs.v_hat",\n   "sign"', '"inputs.x",\n   "sign"'),
        ("a truth of any name", '"truth": "true.v"', '"truth": "v"'),
    ],
    ("p", NOT_SHOWN): [("the state is another formula", "-parameters.K_v*inputs.x", "-2*parameters.K_v*inputs.x")],
    ("p", "not an error for each"): [
        (
            "an error is left out",
            ',\n  "state.z_rail": "parameters.K_F*sign.rail*outputs.v_hat + outputs.a_hat_rail"',
            "",
        )
    ],
    ("p", ""): [
        ("the sign is of something else", '"sign.rail": "outputs.v_hat"', '"sign.rail": "inputs.x"'),
        ("a number that is none", '"213/20"', "NaN"),
        ("a division by zero", '"213/20"', '"1/0"'),
        ("nested too deeply", '"213/20"', '"' + "(" * 5000 + "1" + ")" * 5000 + '"'),
        ("a long row of minus signs", '"213/20"', '"' + "- " * 9000 + '1"'),
        ("a number without an end", '"213/20"', '"' + "9" * 5000 + '"'),
        ("a step that there is not", '"step": "euler"', '"step": "implicit"'),
    ],
    ("p", "is nothing that is known"): [
        (
            "a sign of itself, turned round",
            '"sign.rail": "outputs.v_hat"',
            '"sign.rail": "outputs.v_hat", "sign.q": "-sign.q"',
        )
    ],
    ("p", "expected is a list"): [("an object in place of a list", '"domain": []', '"domain": {"1": "everywhere"}')],
    ("p", "box of no free variable"): [
        ("the box is of no variable", '"box": {}', '"box": {"true.y": ["0", "1"]}'),
        ("the box is of an estimate", '"box": {}', '"box": {"outputs.v_hat": ["0", "1"]}'),
    ],
    ("p", "`witness` is not of"): [("a domain without a point", '"domain": []', '"domain": ["-1"]')],
    ("p", "too many values"): [("a range of three ends", '"box": {}', '"box": {"inputs.w": ["0", "1", "2"]}')],
    ("p", "is not cut between its ends"): [
        ("a cut that is none", '"cover": ""', '"cover": ["sign.rail", "2", "", ""]')
    ],
    ("p", "not enough values"): [("a cover with a gap", '"cover": ""', '"cover": ["sign.rail", "0", ""]')],
    ("p", FIELDS): [
        ("a remark in a reversal", '"dwell": "54"', '"dwell": "54", "claim": "at once"'),
        ("a unit of its own", '"cover": ""', '"cover": "", "unit": "mN"'),
        ("a remark of its own", '"cover": ""', '"cover": "", "claim": "rounding adds -7.7e-06 N"'),
    ],
    ("p", "is no 'RATIONAL'"): [
        ("a power tower", '"213/20"', '"9**9**9"'),
        ("text that is run in a proof", '"213/20"', "\"__import__('os')\""),
    ],
    ("p", "two_mass.c"): [("another machine's folder", '"name": "one_mass"', '"name": "two_mass"')],
    ("p", "no name"): [("a way out of the folder", '"name": "one_mass"', '"name": "../one_mass/one_mass"')],
}
CASES = [Case(why, file, old, new, answer) for (file, answer), changes in CHANGES.items() for why, old, new in changes]


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
