"""What holds of every printer, found by the registry: a new output language is tested without a line here."""

from __future__ import annotations

import pkgutil
import re
from dataclasses import replace
from pathlib import Path

import pytest

import codegen.emit
from codegen.base.errors import BadInput
from codegen.emit import PRINTERS
from codegen.emit.package import make_header
from codegen.observers import observer_of
from codegen.program import Program, build_program, lower
from codegen.spec.reader import read_spec

from .lexers import LEXERS

SPECS = Path(__file__).parents[2] / "specs"
HEADER = make_header("machine.yaml", "f" * 64, "")
BUILD = (".txt", ".mk", ".md")
"""Endings of files that hold no step."""
DIGITS = 9
"""Significant digits that every number in single precision needs at most."""


def program_of(name: str, precision: str = "double", fault: str = "hold") -> Program:
    program = build_program(observer_of(read_spec(SPECS / f"{name}.yaml")))
    return replace(program, precision=precision, fault=fault)


def printed(printer: str, program: Program) -> list[str]:
    """The tokens of all that it prints, without comments; the test ends where it refuses such a program."""
    try:
        files = PRINTERS[printer](program, lower(program), HEADER)
    except BadInput as refused:
        pytest.skip(f"refused: {refused}")
    source = {name: text for name, text in files.items() if not name.endswith(BUILD)}
    assert source, "no file holds a step"
    return [token for name, text in source.items() for token in LEXERS[Path(name).suffix](text)]


def test_every_printer_in_the_folder_is_registered() -> None:
    assert {each.name for each in pkgutil.iter_modules(codegen.emit.__path__) if each.ispkg} == set(PRINTERS)


@pytest.mark.parametrize("printer", PRINTERS)
@pytest.mark.parametrize("name", ["one_mass", "chain"])
def test_an_invalid_sample_is_handled_where_the_spec_says_so(printer: str, name: str) -> None:
    """A template that leaves ``program.fault`` out prints one step for both, which uses NaN."""
    held, plain = (printed(printer, program_of(name, fault=fault)) for fault in ("hold", "none"))
    assert len(held) > len(plain)


@pytest.mark.parametrize("printer", PRINTERS)
@pytest.mark.parametrize("name", ["one_mass", "chain"])
def test_single_precision_is_printed_as_such(printer: str, name: str) -> None:
    """A template that leaves ``program.precision`` out prints the numbers and functions of doubles."""
    single, double = (printed(printer, program_of(name, precision)) for precision in ("single", "double"))
    assert single != double
    numbers = [token for token in single if re.fullmatch(r"\d+[.\d]*(e-?\d+)?f?", token)]
    digits = [re.sub(r"e.*|f|\.", "", number).strip("0") for number in numbers]
    assert numbers and [each for each in digits if len(each) > DIGITS] == []


@pytest.mark.parametrize("printer", PRINTERS)
def test_every_output_and_parameter_is_printed(printer: str) -> None:
    program = program_of("two_mass")
    tokens = set(printed(printer, program))
    fields = (*program.parameters, *program.inputs, *program.states)
    assert {field.name for field in fields} | {name for name, _, _ in program.outputs} <= tokens
