"""Other spellings of C, of a header and of JSON: refused, or of the same meaning to a compiler."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import verify
from codegen.checker.verify import Refused
from tests.checker.forged import certificate, changed, check, sources
from tests.checker.test_step_mutants import run_of

DOT = "    const double v_dot_hat ="
GAIN = "parameters->h_K_F * sign_rail"
FORCE = "(inputs->w - F_hat_rail)"
FIELD = "    double z_v;"
NOT_C = {
    "kept from call to call": (DOT, f"    static double kept = 0.0;\n{DOT}"),
    "volatile": (DOT, "    volatile double v_dot_hat ="),
    "register": (DOT, "    register double v_dot_hat ="),
    "longer digits": (DOT, "    long double v_dot_hat ="),
    "shorter digits": (DOT, "    const float v_dot_hat ="),
    "two in one declaration": (DOT, "    const double other = 1.0, v_dot_hat ="),
    "comma operator": (FORCE, "(inputs->w - F_hat_rail, 0.0)"),
    "hexadecimal number": (GAIN, f"0x1p1 * {GAIN}"),
    "long double number": (GAIN, f"1.0L * {GAIN}"),
    "decimal floating point": (GAIN, f"1.0df * {GAIN}"),
    "imaginary number": (GAIN, f"1.0i * {GAIN}"),
    "imaginary number of Python": (GAIN, f"1.0j * {GAIN}"),
    "separators of digits": (GAIN, f"1'0.0 * {GAIN}"),
    "separators of digits in Python": (GAIN, f"1_0.0 * {GAIN}"),
    "quotient of whole numbers": (GAIN, f"(3 / 2) * {GAIN}"),
    "cast to whole numbers": (FORCE, "(int)(inputs->w - F_hat_rail)"),
    "cast to a float": (FORCE, "(float)(inputs->w - F_hat_rail)"),
    "size of a type": (GAIN, f"sizeof(double) * {GAIN}"),
    "shift": (GAIN, f"(1 << 1) * {GAIN}"),
    "condition": (FORCE, "(inputs->w > 9.0 ? 0.0 : inputs->w - F_hat_rail)"),
    "condition of Python": (FORCE, "(inputs->w - F_hat_rail if v_hat else 0.0)"),
    "pointer": (FORCE, "((*inputs).w - F_hat_rail)"),
    "blanks about an arrow": (FORCE, "(inputs -> w - F_hat_rail)"),
    "name in another alphabet": (FORCE, "(inputs->w - F_hat_r\u0430il)"),
    "universal character name": (FORCE, "(inputs->w - F_hat_\\u0072ail)"),
    "digits in another alphabet": (GAIN, f"\uff12.0 * {GAIN}"),
    "text that runs from right to left": ("/* N */", "/* N \u202e */"),
    "new line of Unicode": ("/* N */", "/* N \u0085 */"),
    "mark of the byte order": ("/*\n * one_mass", "\ufeff/*\n * one_mass"),
    "form feed": (DOT, f"\f{DOT}"),
    "continued line with a blank": (FORCE, "(inputs->w - F_hat_\\ \nrail)"),
    "continued comment of C++": (DOT, f"    // and so is \\\n{DOT}"),
    "digraphs of an index": (DOT, f"    double other<:1:>;\n{DOT}"),
    "digraph of a directive": ("#include <math.h>", "%:include <math.h>"),
    "number of a line": ("#include <math.h>", '#line 7 "other.c"\n#include <math.h>'),
    "header read once": ("#include <math.h>", "#pragma once\n#include <math.h>"),
    "next header of the name": ("#include <math.h>", "#include_next <math.h>"),
    "header of the folder first": ("#include <math.h>", '#include "math.h"'),
    "type before the header": ('#include "one_mass.h"', 'typedef float other;\n#include "one_mass.h"'),
    "global": ("void one_mass_prepare", "static double other;\nvoid one_mass_prepare"),
    "attribute of a local": (DOT, "    __attribute__((unused)) const double v_dot_hat ="),
    "contraction of products": ("FP_CONTRACT OFF", "FP_CONTRACT ON"),
    "subtraction in place": ("z_rail = z_rail_next;", "z_rail = z_rail_next; state->z_rail -= 1.0;"),
    "two set at once": ("state->z_rail = z_rail_next;", "state->z_rail = state->z_v = z_rail_next;"),
    "comparison": ("state->z_rail = z_rail_next;", "state->z_rail == z_rail_next;"),
}
NOT_A_HEADER = {
    "volatile field": (FIELD, "    volatile double z_v;"),
    "bits of a field": (FIELD, "    double z_v : 32;"),
    "union": ("typedef struct {\n    double z_v;", "typedef union {\n    double z_v;"),
    "packed": ("} one_mass_state;", "} __attribute__((packed)) one_mass_state;"),
    "array without elements": (FIELD, "    double z_v[0];"),
    "field that the values lack": ("    double K_v;", "    double other; double K_v;"),
    "double is another word": ("#define ONE_MASS_PARAMETERS", "#define double float\n#define ONE_MASS_PARAMETERS"),
}
SAME = {
    "number without decimals": (GAIN, f"1.e0 * {GAIN}"),
    "continued name": (FORCE, "(inputs->w - F_hat_\\\nrail)"),
    "continued beginning of a comment": (DOT, f"    /\\\n* and so is {DOT.strip()} */\n{DOT}"),
    "continued end of a comment": (DOT, f"    /* and so is *\\\n/\n{DOT}"),
    "comment that seems to end at once": (DOT, f"    /*/ {DOT.strip()} */\n{DOT}"),
    "three signs": (FORCE, "(inputs->w - - - F_hat_rail)"),
}


@pytest.mark.parametrize("why", NOT_C)
def test_other_c_is_refused(why: str) -> None:
    with pytest.raises(Refused, match="does not prove"):
        check(*changed("one_mass", NOT_C[why]))


@pytest.mark.parametrize("why", NOT_A_HEADER)
def test_another_header_is_refused(why: str) -> None:
    with pytest.raises(Refused, match="does not prove"):
        check(*changed("one_mass", NOT_A_HEADER[why], end="h"))


@pytest.mark.parametrize("why", SAME)
def test_what_is_accepted_computes_the_same(why: str, tmp_path: Path) -> None:
    """By a compiler, bit for bit."""
    code, header = (sources("one_mass")[f"one_mass.{end}"].decode() for end in "ch")
    content, files = changed("one_mass", SAME[why])
    assert check(content, files).proved == check(certificate("one_mass"), sources("one_mass")).proved
    genuine = run_of(tmp_path / "genuine", "one_mass", code, header)
    other = run_of(tmp_path / "other", "one_mass", files["one_mass.c"].decode(), header)
    assert genuine is not None and repr(other) == repr(genuine)  # also where it is NaN


Bytes = Callable[[bytes], bytes]
NOT_JSON: dict[str, Bytes] = {
    "mark of the byte order": lambda text: b"\xef\xbb\xbf" + text,
    "UTF-16": lambda text: text.decode().encode("utf-16"),
    "UTF-32": lambda text: text.decode().encode("utf-32"),
    "a byte of Latin-1": lambda text: text.replace(b'"name": "', b'"name": "\xe9', 1),
    "two objects": lambda text: text + b"{}",
    "a key with an escape, twice": lambda text: text.replace(b'"matrix"', b'"matri\\u0078": [], "matrix"', 1),
    "brackets without end": lambda _: b"[" * 100_000,
}


@pytest.mark.parametrize("why", NOT_JSON)
@pytest.mark.parametrize("file", ["certificate.json", "proof.json", "ellipsoid.json"])
def test_other_json_proves_nothing(why: str, file: str) -> None:
    files = sources("one_mass")
    if file == "ellipsoid.json" and why.startswith("a key"):
        return
    files[file] = NOT_JSON[why](files[file])
    try:
        found = verify.check(files["certificate.json"].decode(), sources=files)
    except (Refused, ValueError):
        return
    assert file == "proof.json" and verify.status(found) == verify.NO_CODE


NUMBERS = (
    "NaN",
    "Infinity",
    "1e99999999",
    "1e999999",
    "1_0",
    "\u0661\u0660",
    "10\n",
    "10/0",
    "10/-1",
    "+10",
    "0x10",
    "",
)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("bare", [False, True])
def test_other_numbers_are_refused(number: str, bare: bool) -> None:
    content: Any = certificate("one_mass") | {"decay_rate": "10"}
    text = json.dumps(content).replace('"decay_rate": "10"', f'"decay_rate": {number if bare else json.dumps(number)}')
    with pytest.raises((Refused, ValueError)):
        verify.check(text, sources=sources("one_mass"))
