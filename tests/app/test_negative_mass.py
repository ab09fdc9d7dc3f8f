"""A mass or an inertia below zero is refused at its own line, also where a sum in the mass matrix hides it."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.effects.declare import system_of
from codegen.spec import parse_spec
from tests.expected_errors import refused

from .command import SPECS, stiction

ONE = (SPECS / "one_mass.yaml").read_text("utf-8")
MASS, ROW = "  m: {value: 1, unit: kg}\n", "  - [m]\n"
LINE = 1 + ONE.split(MASS)[0].count("\n")


def spec_text(parameters: str, entry: str, unit: str = "m", force: str = "N") -> str:
    text = ONE.replace(MASS, parameters).replace(ROW, f"  - [{entry}]\n")
    return text.replace("velocity: v, unit: m}", f"velocity: v, unit: {unit}}}").replace("unit: N}", f"unit: {force}}}")


def test_the_parameter_is_told_with_its_line_and_value(tmp_path: Path) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(spec_text("  m: {value: 3, unit: kg}\n  load: {value: -500, unit: g}\n", "m + load"), "utf-8")
    done = stiction("check", path)
    assert done.code == 2 and done.out == ""
    assert f"{path}:{LINE + 1}: parameters.load" in done.err and "-500 g" in done.err and "SPEC007" in done.err


@pytest.mark.parametrize("load", ["-500", "-5000"], ids=["hidden by the sum", "larger than the sum"])
def test_the_parameter_is_named_and_no_eigenvalue(load: str) -> None:
    text = spec_text(f"  m: {{value: 3, unit: kg}}\n  load: {{value: {load}, unit: g}}\n", "m + load")
    with refused(f"SPEC007 parameters.load {load}") as told:
        system_of(parse_spec(text, Path("s.yaml")))
    assert told.value.place.line == LINE + 1


def test_each_of_several_is_told_in_one_run() -> None:
    text = spec_text("  m: {value: -3, unit: kg}\n  load: {value: -500, unit: g}\n", "m + load")
    with refused("SPEC007 parameters.m") as told:
        system_of(parse_spec(text, Path("s.yaml")))
    assert [fault.place.line for fault in told.value.all] == [LINE, LINE + 1]


def test_what_is_subtracted_is_told_as_an_entry_with_its_values() -> None:
    text = spec_text("  m: {value: 3, unit: kg}\n  load: {value: 5000, unit: g}\n", "m - load")
    with refused("SPEC017 mass_matrix[0][0] -2 m = 3 load = 5"):
        system_of(parse_spec(text, Path("s.yaml")))


@pytest.mark.parametrize(
    ("parameters", "entry", "refuses"),
    [
        ("  J: {value: 3, unit: kg*m^2}\n  K: {value: -1, unit: kg*m^2}\n", "J + K", True),
        (
            "  J: {value: 3, unit: kg*m^2}\n  K: {value: -1, unit: kg*m^2}\n",
            "J + K*cos(x)",
            False,
        ),  # a product of inertia
        ("  J: {value: 3, unit: kg*m^2}\n", "J", False),
    ],
)
def test_an_inertia(parameters: str, entry: str, refuses: bool) -> None:
    spec = parse_spec(spec_text(parameters, entry, "rad", "N*m"), Path("s.yaml"))
    if not refuses:
        system_of(spec)
        return
    with refused("SPEC007 parameters.K"):
        system_of(spec)
