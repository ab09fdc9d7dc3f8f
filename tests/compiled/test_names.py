"""Names of a spec that could clash with names of the code it gives."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest

from codegen.spec import parse_spec
from codegen.spec.reserved import reserved
from tests.expected_errors import refused

from .build import Built, motion, same_bits
from .specs import spec_text


def agrees(folder, text: str) -> Built:
    built = Built(folder, text)
    rows = motion(built.program, 300)
    assert all(same_bits(a, b) for a, b in zip(built.c_run(rows), built.python_run(rows), strict=True))
    return built


@pytest.mark.parametrize("name", ["of", "velocity_1", "sign_1", "part_1", "u", "hat", "main", "x_next", "abs_", "math"])
def test_contacts(tmp_path, name):
    agrees(tmp_path, spec_text("one_mass").replace("name: rail", f"name: {name}"))


def test_a_contact_that_gives_an_output_its_coordinate_has(tmp_path):
    with refused("SPEC009 `F_hat_on_x`"):
        Built(tmp_path, spec_text("one_mass").replace("name: rail", "name: on_x"))


def test_a_contact_called_like_a_shared_part(tmp_path):
    text = spec_text("one_mass", "gcfo").replace("name: rail", "name: friction_1")
    effects = """effects:
  - {kind: stribeck, on: friction_1, parameters: {delta: 7, v_s: 0.05}}
  - {kind: viscous, on: friction_1, parameters: {b: 7}}
  - {kind: viscous_asymmetry, on: friction_1, parameters: {d_b: 2}}
  - {kind: stribeck, on: friction_1, parameters: {delta: 3, v_s: 0.05}}"""
    built = agrees(tmp_path, text.replace("effects: []", effects))
    assert "stribeck_friction_1_2_delta" in [p.name for p in built.program.parameters]


@pytest.mark.parametrize("machine", ["main", "init", "step", "Parameters", "e"])
def test_machines(tmp_path, machine):
    agrees(tmp_path, spec_text("one_mass").replace("name: one_mass", f"name: {machine}"))


@pytest.mark.parametrize("machine", ["math", "stdio", "string", "Float", "features"])
def test_machines_whose_header_would_hide_one_of_c(machine):
    with refused(f"SPEC009 `{machine}` {machine}.h"):
        parse_spec(spec_text("one_mass").replace("name: one_mass", f"name: {machine}"), Path("s.yaml"))


def macros() -> set[str]:
    """What a C compiler defines by the headers that generated code includes, without what C keeps for it (_X)."""
    found = set()
    for standard, names in (("c99", "float math stdio stdlib stddef stdint string"), ("gnu11", "float math stdio")):
        headers = "".join(f"#include <{name}.h>\n" for name in names.split())
        command = ["cc", f"-std={standard}", "-dM", "-E", "-xc", "-"]
        done = subprocess.run(command, input=headers, capture_output=True, text=True, check=True)
        found |= {re.split(r"\W", line.split()[1])[0] for line in done.stdout.splitlines()}
    return {name for name in found if not name.startswith("_")}


def test_no_macro_of_a_header_can_be_a_name():
    assert {"DBL_MAX", "FLT_EVAL_METHOD", "INFINITY", "M_PI"} <= macros()
    assert not {name for name in macros() if not reserved(name)}


def test_no_macro_of_a_compiler_for_32_bits_can_be_a_name():
    """`i386` is 1 with gcc -m32, so that `parameters->i386` did not compile."""
    command = ["cc", "-m32", "-std=gnu11", "-dM", "-E", "-xc", "-"]
    done = subprocess.run(command, input="", capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("cc has no -m32")
    found = {re.split(r"\W", line.split()[1])[0] for line in done.stdout.splitlines()}
    assert "unix" in found and not {name for name in found if not name.startswith("_") and not reserved(name)}


@pytest.mark.parametrize("name", ["ONE_MASS_PARAMETERS", "STICTION_ONE_MASS_H", "static_assert", "DBL_MAX", "FLT_MAX"])
@pytest.mark.parametrize("of", ["  m: {value", "  w: {unit", "velocity: v,", "name: rail"])
def test_names_of_the_header_and_of_c(name, of):
    text = spec_text("one_mass")
    assert of in text
    spoilt = of.replace("m:", f"{name}:").replace("w:", f"{name}:").replace(" v,", f" {name},").replace("rail", name)
    with refused(f"SPEC009 `{name}`"):
        parse_spec(text.replace(of, spoilt), Path("s.yaml"))


def test_a_machine_called_like_the_example_is_refused(tmp_path):
    with refused("SPEC009 `example_main`"):
        Built(tmp_path, spec_text("one_mass").replace("name: one_mass", "name: example_main"))


@pytest.mark.parametrize("name", ["first", "z_rail", "slip", "math", "field", "dataclass", "self", "scanf", "j0"])
def test_parameters(tmp_path, name):
    text = spec_text("one_mass").replace("  m: {value", f"  {name}: {{value").replace("[m]", f"[{name}]")
    if name == "z_rail":
        with refused("SPEC009 `z_rail`"):
            Built(tmp_path, text)
    else:
        agrees(tmp_path, text)


@pytest.mark.parametrize(
    "source", ["see /* here */ and there", 'a "quoted" \\ word', "first\nsecond", "what??/", "µ — §"]
)
def test_sources_in_comments(tmp_path, source):
    text = spec_text("one_mass")
    line = next(line for line in text.splitlines() if line.startswith("source:"))
    built = agrees(tmp_path, text.replace(line, f"source: {json.dumps(source)}"))
    assert all(getattr(built.parameters, p.name) > 0 for p in built.program.parameters)
