"""The function block in Structured Text, interpreted by a small interpreter of our own: the bits of the Python twin."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.app.machine import load
from tests.app.command import SPECS, is_one_message, stiction
from tests.twin import load_twin

from .st_interpreter import Block

FAST = ("one_mass", "two_mass", "one_mass_domain")
SLOW = ("two_link_arm", "belt_axis", "emps", "rig", "seven_joint_arm")


def written(path: Path, spec: Path) -> str:
    done = stiction("export", spec, "--to", "structured-text", "-o", path)
    assert done.code == 0, done.err
    return path.read_text("utf-8")


def twin_of(spec: Path) -> Any:
    return load_twin(load(spec).sources["__init__.py"], "twin")


def samples(count: int, wide: int) -> np.ndarray:
    """A slow motion; single samples, a few and many, are no numbers, infinite or too large, the first too."""
    rng = np.random.default_rng(3)
    x = 0.3 * np.sin(0.01 * np.arange(count)[:, None] + rng.uniform(0, 6, wide)) + 1e-4 * rng.normal(size=(count, wide))
    x[:2] = math.nan
    x[100, 0], x[150, -1], x[200, 0] = math.nan, math.inf, 1e200
    x[250:254], x[300:340] = math.nan, math.nan
    x[400:440, 0] = -math.inf
    return x


def bits(value: float) -> str:
    return "nan" if math.isnan(value) else float(value).hex()


@pytest.mark.parametrize("name", [*FAST, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_the_block_has_the_bits_of_the_twin(tmp_path: Path, name: str) -> None:
    spec = SPECS / f"{name}.yaml"
    text, twin = written(tmp_path / "observer.st", spec), twin_of(spec)
    block = Block(text, name)
    inputs = list(twin.Inputs.__slots__)
    state, outputs, parameters, faults = None, twin.Outputs(), twin.Parameters(), 0
    for row in samples(500, len(inputs)).tolist():
        given = dict(zip(inputs, row, strict=True))
        now = twin.Inputs(**given)
        if state is None:
            state = twin.init(parameters, now)
        twin.step(state, parameters, now, outputs)
        found = block.call(**given)
        for field in twin.Outputs.__slots__:
            expected = getattr(outputs, field)
            assert bits(found[field.upper()]) == bits(expected), (row, field)
        for field in twin.State.__slots__:
            assert bits(found[f"S_{field.upper()}"]) == bits(getattr(state, field)), (row, field)
        faults += outputs.fault
    assert 80 < faults < 200


def test_numbers_and_comments_are_those_of_the_standard(tmp_path: Path) -> None:
    """Literals of LREAL have a point and their type: without it a compiler may round them to REAL."""
    text = written(tmp_path / "observer.st", SPECS / "two_mass.yaml")
    code = "".join(part.partition("*)")[2] for part in ("*)" + text).split("(*"))
    assert not re.search(r"(?<![\w#.])[-]?\d", code.replace("LREAL#-", "LREAL#"))
    assert text.count("(*") == text.count("*)") and text.isascii() and "\t" not in text
    blark = pytest.importorskip("blark", reason="needs blark, a parser of Structured Text")
    assert blark.parse_source_code(text)


def test_an_own_division_never_divides_by_zero(tmp_path: Path) -> None:
    text = (SPECS / "one_mass.yaml").read_text()
    wide = text.replace("  - w\n", "  - w - d*v/(1 + (v/v0)**2)\n").replace(
        "parameters:\n", "parameters:\n  d: {value: 1, unit: N*s/m}\n  v0: {value: 1, unit: m/s}\n"
    )
    assert wide != text
    (tmp_path / "s.yaml").write_text(wide)
    st, twin = written(tmp_path / "s.st", tmp_path / "s.yaml"), twin_of(tmp_path / "s.yaml")
    assert "one_mass_quotient(" in st and "a PLC would stop" in st
    block, parameters, outputs = Block(st, "one_mass"), twin.Parameters(), twin.Outputs()
    state = None
    for x, w in np.random.default_rng(0).normal(size=(200, 2)).tolist():
        now = twin.Inputs(x=x, w=w)
        state = twin.init(parameters, now) if state is None else state
        twin.step(state, parameters, now, outputs)
        found = block.call(x=x, w=w)
        assert all(bits(found[f.upper()]) == bits(getattr(outputs, f)) for f in twin.Outputs.__slots__)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("  m: {value: 1, unit: kg}", "  m: {value: 1, unit: kg}\n  M: {value: 1, unit: kg}", "`p_m` and `p_M`"),
        ("  w: {unit: N}", "  step: {unit: N}", "`step`"),
        ("  w: {unit: N}", "  w_: {unit: N}", "`w_`"),
    ],
)
def test_names_that_it_cannot_have_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = (SPECS / "one_mass.yaml").read_text()
    name = new.strip().partition(":")[0]
    if "unit: N}" in new:
        text = text.replace("  - w\n", f"  - {name}\n").replace("{w: ", f"{{{name}: ")
    else:
        text = text.replace("  - w\n", "  - w*M/m\n")
    (tmp_path / "s.yaml").write_text(text.replace(old, new))
    told = stiction("export", tmp_path / "s.yaml", "--to", "structured-text", "-o", tmp_path / "s.st")
    assert is_one_message(told) and words in told.err, told.err


def test_machines_that_it_cannot_hold_are_refused(tmp_path: Path) -> None:
    told = stiction("export", SPECS / "chain.yaml", "--to", "structured-text", "-o", tmp_path / "s.st")
    assert is_one_message(told) and "arrays" in told.err and not list(tmp_path.iterdir())
