"""A spec with random damage, all the way to its analysis: a result or BadInput, never another exception."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from codegen.effects.declare import add_declared_effects
from codegen.errors import BadInput
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec
from codegen.stability.analysis import analyse

TEXT = (Path(__file__).resolve().parents[2] / "specs" / "two_mass.yaml").read_text()
PIECES = [
    *"{}[],:-*/+()'\"\n #&!%@0123456789.eE\t\x00é",
    "null",
    "true",
    "1e999",
    "-1",
    "0",
    "sin(",
    "x1",
    "v2",
    "**",
    "1/0",
]
PIECES += [
    ": ",
    "- ",
    "[[",
    "]]",
    "!!python/object:os.x {}",
    "&a",
    "*a",
    "viscous",
    "cfo",
    "mgto",
    "measured",
    "kg",
    "m",
]
EFFECT = "effects:\n  - {kind: viscous, on: ground, parameters: {b: 2}}\n  - {kind: stribeck, on: between, parameters: "
TEXTS = [TEXT, TEXT.replace("effects: []", EFFECT + "{delta: 3, v_s: 0.1}}\n")]


def damaged(seed: int) -> str:
    """One to three characters or lines deleted, replaced, doubled or put in."""
    chance = random.Random(seed)
    text = chance.choice(TEXTS)
    for _ in range(chance.randint(1, 3)):
        lines = text.splitlines(keepends=True)
        at, line = chance.randrange(len(text)), chance.randrange(len(lines))
        match chance.randrange(6):
            case 0:
                text = text[:at] + text[at + chance.randint(1, 8) :]
            case 1:
                text = text[:at] + chance.choice(PIECES) + text[at:]
            case 2:
                text = text[:at] + chance.choice(PIECES) + text[at + 1 :]
            case 3:
                text = "".join(lines[:line] + lines[line + 1 :])
            case 4:
                text = "".join(lines[:line] + [lines[line]] * 2 + lines[line + 1 :])
            case _:
                other = chance.randrange(len(lines))
                lines[line], lines[other] = lines[other], lines[line]
                text = "".join(lines)
        if not text:
            return text
    return text


def outcome(text: str) -> str:
    """How far the text gets."""
    stage = "read"
    try:
        spec = parse_spec(text, Path("two_mass.yaml"))
        stage = "built"
        system = add_declared_effects(build_system(spec), spec)
        observer = build_observer(spec, system)
        analysis = analyse(spec, observer)
    except BadInput as told:
        assert str(told).startswith("two_mass.yaml")
        return f"refused, not {stage}"
    assert analysis.spectral_radius >= 0
    return "analysed"


def run(seeds: range) -> None:
    counts: dict[str, int] = {}
    for seed in seeds:
        found = outcome(damaged(seed))
        counts[found] = counts.get(found, 0) + 1
    assert len(counts) == 3  # the damage reaches every stage, or this tests nothing


def test_damaged_specs() -> None:
    run(range(50, 90))


@pytest.mark.slow
def test_many_damaged_specs() -> None:
    run(range(1000, 4000))
