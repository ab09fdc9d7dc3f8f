"""What the compiled object holds: its three functions, no heap, no data; and that C++ and the example accept it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from .build import FLAGS, Built, motion
from .specs import spec_text

CASES = [
    ("one_mass", "to", "measured", False),
    ("two_mass", "gcfo", "estimated", True),
    ("two_mass", "mgto", "estimated", True),
    ("belt_axis", "gcfo", "estimated", True),
    ("arm", "gcfo", "measured", True),
    ("arm", "gto", "estimated", False),
]


def run(*command: str, cwd: Path, text: str | None = None) -> str:
    done = subprocess.run(command, cwd=cwd, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


@pytest.fixture(scope="module", params=CASES, ids=lambda c: "-".join(map(str, c)))
def built(request, tmp_path_factory):
    return Built(tmp_path_factory.mktemp("c"), spec_text(*request.param))


def symbols(built: Built) -> dict[str, str]:
    """Symbol → nm's letter."""
    name = built.program.name
    run("gcc", *FLAGS, "-O2", "-c", f"{name}.c", "-o", f"{name}.o", cwd=built.folder)
    lines = run("nm", f"{name}.o", cwd=built.folder).splitlines()
    return {line.split()[-1]: line.split()[-2] for line in lines}


def test_three_functions_and_nothing_else(built):
    found, name = symbols(built), built.program.name
    assert sorted(s for s, letter in found.items() if letter.isupper() and letter != "U") == [
        f"{name}_init",
        f"{name}_prepare",
        f"{name}_step",
    ]
    assert set(found.values()) <= {"T", "t", "U", "r"}
    assert {s for s, letter in found.items() if letter == "U"} <= {"sin", "cos", "exp", "tanh", "sqrt", "sincos"}


def test_only_the_target_of_a_state_is_written(built):
    name = built.program.name
    code = built.files[f"{name}.c"]
    assert "malloc" not in code and "free(" not in code
    heads = [f"inline double {name}_sign", *(f"void {name}_{verb}" for verb in ("predict", "resume"))]
    functions = tuple(f"static {head}(" for head in (*heads, f"{name.upper()}_COLD void {name}_handle_fault"))
    assert not [line for line in code.splitlines() if "static" in line and not line.startswith(functions)]


def test_two_observers_do_not_disturb_each_other(built):
    rows = motion(built.program, 200)
    alone = built.c_run(rows)[0]
    built.c_run(motion(built.program, 50, seed=9))
    assert alone.tobytes() == built.c_run(rows)[0].tobytes()


def test_example_prints_what_the_twin_computes(built):
    name = built.program.name
    run("gcc", *FLAGS, "-O2", "example_main.c", f"{name}.c", "-lm", "-o", "example", cwd=built.folder)
    rows = motion(built.program, 40)[30:32]
    text = "\n".join(" ".join(repr(v) for v in row) for row in rows.tolist()) + "\n"
    printed = run("./example", cwd=built.folder, text=text)
    values = np.array([[float(v) for v in line.split()] for line in printed.splitlines()])
    assert values[:, :-1].tobytes() == built.python_run(rows)[0].tobytes()
    assert values[:, -1].tolist() == [0, 0]
    assert run("./example", cwd=built.folder, text="") == ""
    refused = subprocess.run("./example", cwd=built.folder, input="t,x\n" + text, capture_output=True, text=True)
    assert (refused.returncode, refused.stdout) == (1, "") and "sample 1 is not" in refused.stderr


@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no g++ here")
def test_header_can_be_included_from_cpp(built):
    name = built.program.name
    (built.folder / "user.cpp").write_text(
        f'#include "{name}.h"\n'
        f"int main() {{\n    const {name}_parameters parameters = {name.upper()}_PARAMETERS;\n"
        f"    {name}_state state;\n    {name}_inputs inputs = {name}_inputs();\n    {name}_outputs outputs;\n"
        f"    {name}_init(&state, &parameters, &inputs);\n"
        f"    {name}_step(&state, &parameters, &inputs, &outputs);\n    return 0;\n}}\n"
    )
    run("gcc", *FLAGS, "-O2", "-c", f"{name}.c", "-o", f"{name}.o", cwd=built.folder)
    run("g++", "-std=c++11", "-pedantic", "-Wall", "-Werror", "user.cpp", f"{name}.o", "-o", "user", cwd=built.folder)
    run("./user", cwd=built.folder)


def test_header_twice_and_first(built):
    name = built.program.name
    (built.folder / "twice.c").write_text(f'#include "{name}.h"\n#include "{name}.h"\nint one;\n')
    run("gcc", *FLAGS, "-c", "twice.c", "-o", "twice.o", cwd=built.folder)
