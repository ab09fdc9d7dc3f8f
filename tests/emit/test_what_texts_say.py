"""What a reader of the generated texts must be told, and names that a compiler keeps for itself."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from codegen.effects.declare import add_declared_effects
from codegen.emit.package import emit_readme, emit_sources, make_header
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.program import Program, build_program
from codegen.spec.reader import parse_spec

SPECS = Path(__file__).parents[2] / "specs"
HEADER = make_header("machine.yaml", "f" * 64, "")


def program_of(name: str, integration: str = "euler") -> Program:
    text = (SPECS / f"{name}.yaml").read_text(encoding="utf-8")
    if integration != "euler":
        text, count = re.subn(r"(\bsample_time: [\d.]+)", rf"\1\n  integration: {integration}", text, count=1)
        assert count == 1
    spec = parse_spec(text, SPECS / f"{name}.yaml")
    return build_program(build_observer(spec, add_declared_effects(build_system(spec), spec)))


@pytest.mark.parametrize("name", ["chain", "one_mass", "two_mass"])
def test_every_field_of_a_struct_has_a_comment(name):
    header = emit_sources(program_of(name), HEADER)[f"{name}.h"]
    fields = re.findall(r"^    (?:double|int) \w+(?:\[\d+\])?;.*$", header, re.M)
    assert len(fields) > 8
    assert [line for line in fields if not re.search(r"/\* .+ \*/$", line)] == []


def test_an_array_of_constants_says_the_formula_of_its_first():
    header = emit_sources(program_of("chain"), HEADER)["chain.h"]
    assert "double h_K_F_ground[16]; /* sample_time * K_F_ground[0], ... */" in header


def test_no_name_has_two_underscores_in_a_row():
    """Such names are reserved in C++; an elimination calls one quantity several times anew."""
    program = program_of("two_mass", "implicit")
    elements = [e for b in program.blocks for e in b.elements]
    assert {"r5", "r5_"} < set(elements) and len(elements) == len(set(elements))
    assert [e for e in elements if "__" in e] == []


@pytest.mark.parametrize("fault", ["hold", "none"])
def test_a_bad_sample_is_written_about(fault):
    program = replace(program_of("one_mass"), fault=fault)
    files = emit_sources(program, HEADER)
    readme, header = emit_readme(program, HEADER, "no reason", list(files)), files["one_mass.h"]
    lost = "one NaN or infinite input"
    assert (lost in readme and lost in header) == (fault == "none")
    for text in (readme, header, files["one_mass.c"]):
        assert ("ONE_MASS_STARTING" in text) == ("ONE_MASS_HOLDING" in text) == (fault == "hold")
    assert ("state.mode" in files["__init__.py"]) == ("_mode mode;" in header) == (fault == "hold")


def test_a_readme_of_lanes_alone_shows_how_to_build_and_call_them():
    program = program_of("one_mass")
    files = emit_sources(program, HEADER, ("simd",))
    text = emit_readme(program, HEADER, "no reason", list(files))
    for name in ("fill_lanes", "init_lanes", "step_lanes"):
        assert f"one_mass_{name}(" in text and f"one_mass_{name}(" in files["one_mass_lanes.h"]
    assert "one_mass_lanes.c" in text and "-DONE_MASS_LANES=" in text and "one_mass.h" not in text
