"""Random changes of the C of a step: one that verify accepts in the same words computes the same."""

from __future__ import annotations

import copy
import ctypes
import hashlib
import json
import math
import random
import re
from pathlib import Path

import pytest

from codegen.checker import verify
from tests.checker.forged import certificate, sources
from tests.compiled.build import compile_shared
from tests.slow_cases import slow_except

DRIVER = """#include "NAME.h"
#include <string.h>
static NAME_parameters p = UPPER_PARAMETERS;
static NAME_state s;
static NAME_inputs i;
static NAME_outputs o;
int inputs(void) { return sizeof i / sizeof(double); }
int outputs(void) { return sizeof o / sizeof(double); }
void start(const double *in) { memcpy(&i, in, sizeof i); memset(&o, 0, sizeof o); NAME_init(&s, &p, &i); }
void step(const double *in, double *out) {
    memcpy(&i, in, sizeof i);
    NAME_step(&s, &p, &i, &o);
    memcpy(out, &o, sizeof o);
}
"""
TOKEN = re.compile(r"[A-Za-z_]\w*(?:->\w+)?|\d+\.\d*|[-+*/]")
NUMBERS = ("0.0", "1.0", "2.0", "0.5", "1e-12")


def mutant(text: str, begin: int, dice: random.Random) -> str:
    """The text with one change behind ``begin``: of a name, a number, an operator, a term or a line."""
    tokens = [found for found in TOKEN.finditer(text, begin) if found[0] not in ("if", "double", "const", "int")]
    names = sorted({t[0] for t in tokens if "->" in t[0]} | {*re.findall(r"double (\w+)", text[begin:])})
    token = dice.choice([t for t in tokens if t[0] in names or not t[0][0].isalpha()])
    way, x = dice.randrange(4), dice.choice(names)
    if way == 3:
        lines = text[begin:].split("\n")
        k = dice.choice([k for k, line in enumerate(lines) if line.endswith(";")])
        lines[k : k + 1] = dice.choice([[], [lines[k]] * 2, [lines[k], f"    {x} += {token[0]};"]])
        return text[:begin] + "\n".join(lines)
    if token[0] in names:
        y = token[0]
        changes = x, f"({y} + {x} - {x})", f"fabs({y})", f"(-{y})", f"({y} + 1e-9 * {x})", f"({y} * {x} / {x})"
        new = dice.choice(changes)
    else:
        new = dice.choice(NUMBERS if token[0][0].isdigit() else "+-*/")
    return text[: token.start()] + new + text[token.end() :]


def run_of(folder: Path, name: str, code: str, header: str) -> list[list[float]] | None:
    """Outputs of samples, valid ones and such with a NaN; None if the C does not compile."""
    folder.mkdir()
    (folder / f"{name}.h").write_text(header)
    (folder / f"{name}.c").write_text(code)
    driver = DRIVER.replace("NAME", name).replace("UPPER", name.upper())
    (folder / "driver.c").write_text(f'#include "{name}.c"\n{driver}')
    try:
        library = ctypes.CDLL(str(compile_shared(folder, "driver.c", "-O0")))
    except Exception:
        return None
    count, width = library.inputs(), library.outputs()
    dice, found = random.Random(5), []
    for scale in (1.0, 1e-3, 1e3):
        x, row = [dice.uniform(-1, 1) * scale for _ in range(count)], (ctypes.c_double * width)()
        library.start((ctypes.c_double * count)(*x))
        for k in range(60):
            x = [v + dice.gauss(0, 0.01) * scale for v in x]
            library.step((ctypes.c_double * count)(*([math.nan] * count if k in (30, 31) else x)), row)
            found.append(list(row)[:-1])  # the last holds the fault
    return found


@pytest.mark.parametrize("name", slow_except(["one_mass", "two_mass", "rig_to"], ["rig_to"]))
def test_a_change_that_is_accepted_in_the_same_words_changes_nothing(tmp_path: Path, name: str) -> None:
    genuine, files = certificate(name), sources(name)
    code, header = (files[f"{name}.{end}"].decode() for end in "ch")
    begin = code.index("{", code.index(f"void {name}_step("))

    def check(text: str) -> verify.Report:
        content = copy.deepcopy(genuine)
        content["subject"]["files"][f"{name}.c"] = hashlib.sha256(text.encode()).hexdigest()
        return verify.check(json.dumps(content), sources=files | {f"{name}.c": text.encode()})

    words, expected = check(code).proved, run_of(tmp_path / "genuine", name, code, header)
    assert expected is not None
    dice, accepted = random.Random(name), 0
    for k in range(200):
        text = mutant(code, begin, dice)
        try:
            if text == code or check(text).proved != words:
                continue
        except verify.Refused:
            continue
        found = run_of(tmp_path / str(k), name, text, header)
        accepted += found is not None
        pairs = zip(expected, found or expected, strict=True)
        assert all(x == pytest.approx(y, rel=1e-6, abs=1e-6, nan_ok=True) for x, y in pairs), text
    assert accepted > 5
