"""The JSON Schema against the reader: it takes every shipped spec, and refuses what the reader refuses by form."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from codegen.base.errors import BadInput
from codegen.spec.schema import SpecDocument, json_schema
from codegen.spec.urdf_section import expand_robot
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_mapping, plain

from .faults import FAULTS, GOOD, UNITS

SPECS = Path(__file__).parents[2] / "specs"
SHIPPED = sorted(path for path in SPECS.rglob("*.yaml") if "\nname:" in f"\n{path.read_text()}")


@pytest.fixture(scope="module")
def checker() -> jsonschema.Draft202012Validator:
    schema = json.loads(json.dumps(json_schema()))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def as_an_editor_reads(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


def is_read(text: str) -> bool:
    """Whether the reader takes the form of a spec."""
    document, places = load_mapping(text, "s.yaml")
    try:
        filled, _ = expand_robot(plain(document), SPECS / "s.yaml", places)
        validate(SpecDocument, filled, places, "s.yaml")
    except BadInput:
        return False
    return True


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_spec_fits(checker: jsonschema.Draft202012Validator, path: Path) -> None:
    assert [error.message for error in checker.iter_errors(as_an_editor_reads(path.read_text()))] == []


@pytest.mark.parametrize("fault", [*FAULTS, *UNITS])
def test_a_fault_of_form_is_seen_by_both(checker: jsonschema.Draft202012Validator, fault: str) -> None:
    old, new, *_ = (FAULTS | UNITS)[fault]
    text = GOOD.replace(old, new, 1)
    assert checker.is_valid(as_an_editor_reads(text)) == is_read(text)


def test_some_of_the_faults_are_of_form() -> None:
    assert sum(not is_read(GOOD.replace(old, new, 1)) for old, new, *_ in FAULTS.values()) > 10


@pytest.mark.parametrize(
    "change",
    [
        ("sample_time: 0.001", "sample_time: 1 ms"),
        ("sample_time: 0.001", "sample_time: '1e-3'"),
        ("sample_time: 0.001", "sample_time: fast"),
        ("K_F: 10", "K_F: {free: [1, 2]}"),
        ("K_F: 10", "K_F: {free: [1]}"),
        ("K_F: 10", "K_F: [[1, 0], [0, 2]]"),
        ("x: [-1, 1]", "x: [-1, 1, 2]"),
        ("a: 1, unit: N*m}", "a: 1, unit: 1}"),
        ("a: 1, unit: N*m}", "a: 1, unit: 2}"),
    ],
    ids=lambda change: change[1],
)
def test_numbers_ranges_and_gains(checker: jsonschema.Draft202012Validator, change: tuple[str, str]) -> None:
    assert change[0] in GOOD
    text = GOOD.replace(*change, 1)
    assert checker.is_valid(as_an_editor_reads(text)) == is_read(text)
