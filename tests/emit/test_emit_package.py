"""Program → files: what the texts say, and that they say it the same way each time."""

from __future__ import annotations

import ast
import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.base.files import sha256
from codegen.effects.declare import add_declared_effects
from codegen.emit.expression import Language
from codegen.emit.package import emit_manifest, emit_readme, emit_sources, make_header
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.program import Program, build_program, lower
from codegen.spec.reader import parse_spec

SPECS = Path(__file__).parents[2] / "specs"
NAMES = ("one_mass", "two_mass", "emps", "belt_axis")
HEADER = make_header("machine.yaml", "f" * 64, "a book")
DOUBLE, SINGLE = Language({}), Language({}, single=True, number="{digits}f")


def program_of(name: str) -> Program:
    spec = parse_spec((SPECS / f"{name}.yaml").read_text(encoding="utf-8"), Path("machine.yaml"))
    return build_program(build_observer(spec, add_declared_effects(build_system(spec), spec)))


@pytest.fixture(params=NAMES)
def program(request):
    return program_of(request.param)


def test_the_head_of_every_file_says_where_it_is_from(program):
    files = emit_sources(program, HEADER)
    build_files = ["CMakeLists.txt", f"{program.name}.mk"]
    assert list(files) == [f"{program.name}.h", f"{program.name}.c", "example_main.c", *build_files, "__init__.py"]
    for name in (f"{program.name}.h", f"{program.name}.c", "__init__.py"):
        assert "f" * 64 in files[name][:1000] and "stiction generate machine.yaml" in files[name][:1000]
    assert " * Source: a book.\n" in files[f"{program.name}.h"]


def test_every_line_carries_its_unit_and_every_block_its_equation(program):
    files = emit_sources(program, HEADER)
    for line in lower(program).step:
        if line.source:
            assert f"/* {line.title}, {line.source} */" in files[f"{program.name}.c"]
            assert f"# {line.title}, {line.source}\n" in files["__init__.py"]
        assert f"    const double {line.name} = " in files[f"{program.name}.c"]
        assert not line.unit or f"; /* {line.unit} */" in files[f"{program.name}.c"]
    for name, unit, meaning in program.outputs:
        assert f"double {name}; /* {unit}: {meaning} */" in files[f"{program.name}.h"]


def test_twin_imports_the_standard_library_only(program):
    tree = ast.parse(emit_sources(program, HEADER)["__init__.py"])
    modules = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    modules |= {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert modules == {"math", "dataclasses"}


def test_the_same_twice(program):
    assert emit_sources(program, HEADER) == emit_sources(program_of(program.name), HEADER)


def test_text_is_tidy(program):
    for name, text in emit_sources(program, HEADER).items():
        assert text.endswith("\n") and not text.endswith("\n\n"), name
        assert "\t" not in text and "\r" not in text and not [x for x in text.splitlines() if x != x.rstrip()], name
        assert "\n\n\n\n" not in text, name


def test_readme_lists_every_output_and_input(program):
    text = emit_readme(program, HEADER, "no reason at all", list(emit_sources(program, HEADER)))
    for name, unit, meaning in program.outputs:
        assert f"| `{name}` | {unit} | {meaning} |" in text
    for f in program.inputs:
        assert f"{f.name} in {f.unit}" in text
    assert "**No certificate**: no reason at all" in text and "stiction verify" not in text


def test_manifest():
    files = {"b.c": "int b;\n", "a.c": "µ\n"}
    manifest = json.loads(emit_manifest(HEADER, files))
    assert manifest["files"] == {"a.c": sha256("µ\n"), "b.c": sha256("int b;\n")}
    assert list(manifest["files"]) == ["a.c", "b.c"]
    assert manifest["spec"] == {"file": "machine.yaml", "sha256": "f" * 64}


@pytest.mark.parametrize("value", [0.1, -0.1, 1e-300, 1e22, 123456789012345678, 5e-324, 1 / 3, 0.0])
def test_literals_are_the_double_and_no_integer(value):
    text = DOUBLE.literal(value)
    assert float(text) == float(value)
    assert "." in text or "e" in text
    if value not in (1e-300, 5e-324):
        text = SINGLE.literal(value)
        assert np.float32(text.removesuffix("f")) == np.float32(value)
        assert text.endswith("f") and len(text) < 24 and ("." in text or "e" in text)


def test_single_literals_keep_the_decimals_of_the_double_where_a_compiler_reads_the_same_float():
    assert SINGLE.literal(0.45359237) == "0.45359237f" and SINGLE.literal(float(np.float32(1 / 3))) == "0.33333334f"
    tie = 1 + 2.0**-24  # 1.0000000596046448 in seventeen digits, which is above it, and rounds up
    assert Fraction(repr(tie)) > Fraction(tie) and np.float32(tie) == 1
    assert SINGLE.literal(tie) == "1.0f"


@pytest.mark.parametrize("value", [float("inf"), float("-inf"), float("nan")])
def test_literals_that_there_are_not(value):
    with pytest.raises(BadInput):
        DOUBLE.literal(value)


@pytest.mark.parametrize("value", [1e39, -4e38, 1e-60])
def test_single_literals_that_there_are_not(value):
    with pytest.raises(BadInput) as told:
        SINGLE.literal(value)
    assert told.value.code == "SPEC028" and "single" in told.value.expected


def test_the_readme_says_whose_assumption_exact_measurements_are() -> None:
    """Where the bounds include noise, "measurements are exact" is an assumption of the claim alone."""
    for name, bounded in (("one_mass", True), ("two_link_arm", False)):
        text = (SPECS.parent / "generated" / name / "README.md").read_text()
        assert "measurements are exact" in text
        assert ("Assumptions of the claim; the bounds include position noise within their limits:" in text) is bounded
