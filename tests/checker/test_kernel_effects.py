"""Declared effects of the position and the input, which machine and code compute alike, are proved of the C."""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import kernel, verify
from codegen.spec import parse_spec

SPEC = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text("utf-8")
Values = Mapping[str, float]
ROOM = {"a": 50.0, "m": 1.0}


def turn(v: Values, k: int = 1) -> float:
    return 2 * math.pi * k * v["x"] / 0.7


def dead(w: float) -> float:
    return 0.0 if abs(w) < 2 else w - math.copysign(2, w)


# Effect, its parameters, and m v' as the catalogue's page has it, typed by hand: s is the sign of the slip.
EFFECTS: dict[str, tuple[str, Callable[[Values], float]]] = {
    "cogging": (
        "x], parameters: {amplitude: 3, period: 0.7, phase: 0.4}",
        lambda v: v["w"] - v["s"] * v["a"] + 3 * math.sin(turn(v) + 0.4)),
    "cogging_harmonics": (
        "x], parameters: {period: 0.7, sin_1: 1, cos_1: 2, sin_3: -1, cos_3: 0.5}",
        lambda v: v["w"] - v["s"] * v["a"] + math.sin(turn(v)) + 2 * math.cos(turn(v)) - math.sin(turn(v, 3))
        + 0.5 * math.cos(turn(v, 3))),
    "position_dependent_friction": (
        "rail], parameters: {amplitude: 3, period: 0.7, phase: 0.4}",
        lambda v: v["w"] - v["s"] * (v["a"] + 3 * math.sin(turn(v) + 0.4))),
    "load_dependent_friction": (
        "rail], parameters: {mu: 0.1}", lambda v: v["w"] - v["s"] * (v["a"] + 0.1 * abs(v["w"]))),
    "input_gain": ("w], parameters: {gain: 1.1}", lambda v: 1.1 * v["w"] - v["s"] * v["a"]),
    "dead_zone": ("w], parameters: {width: 2}", lambda v: dead(v["w"]) - v["s"] * v["a"]),
    "saturation": ("w], parameters: {limit: 4}", lambda v: max(-4, min(4, v["w"])) - v["s"] * v["a"]),
}  # fmt: skip


@cache
def made(kind: str, precision: str = "double") -> tuple[Certificate, dict[str, str]]:
    effects = f"effects: [{{kind: {kind}, on: [{EFFECTS[kind][0]}}}]"
    text = SPEC.replace("effects: []", effects) + f"code: {{precision: {precision}}}\n"
    machine = Derived(parse_spec(text, Path("made.yaml")))
    assert isinstance(machine.outcome, Certificate)
    return machine.outcome, machine.sources


def number(text: str, values: Mapping[str, float]) -> float:
    """An expression of a proof in floating point."""
    names = {re.sub(r"\W", "_", x): y for x, y in values.items()}
    code = re.sub(r"\b(parameters|inputs|true|sign)\.", r"\1_", text)
    functions = {"sin": math.sin, "cos": math.cos, "fabs": abs, "sgn": lambda x: (x > 0) - (x < 0)}
    return float(eval(code, {"__builtins__": {}}, functions | names))


@pytest.mark.parametrize("kind", EFFECTS)
def test_a_declared_effect_is_proved_with_the_machine_of_the_catalogue(kind: str) -> None:
    outcome, sources = made(kind)
    assert outcome.kernel is not None, outcome.not_by_kernel
    proof = json.loads(outcome.kernel)
    shown = kernel.prove(proof, sources)
    assert shown["whole"] and not shown["first order"]
    given = {f"parameters.{p[11:]}": float(x) for p, x in shown["values"].items()}
    dice = random.Random(kind)
    for _ in range(20):
        v = {"x": dice.uniform(-2, 2), "w": dice.uniform(-9, 9), "s": dice.choice([-1, 1]), "a": dice.uniform(1, 90)}
        at = given | {"inputs.x": v["x"], "inputs.w": v["w"], "sign.rail": v["s"], "true.a_rail": v["a"]}
        assert number(proof["force"][0], at) == pytest.approx(EFFECTS[kind][1](v), rel=1e-12, abs=1e-12)


FORGED = {
    "cogging": ("6.283185307179586 /", "6.283185307179587 /"),
    "cogging_harmonics": ("18.84955592153876", "18.849555921538"),
    "position_dependent_friction": ("rail_amplitude * sign_rail", "rail_amplitude"),
    "load_dependent_friction": ("sign_rail * fabs(inputs->w)", "sign_rail * inputs->w"),
    "input_gain": ("parameters->input_gain_w_gain * inputs->w", "inputs->w"),
    "dead_zone": ("fabs(inputs->w - ", "fabs(1.01 * inputs->w - "),
    "saturation": ("0.5 * fabs(inputs->w\n", "0.4 * fabs(inputs->w\n"),
}


@pytest.mark.parametrize("kind", FORGED)
def test_another_effect_in_the_c_is_refused(kind: str) -> None:
    outcome, sources = made(kind)
    assert outcome.kernel is not None
    old, new = FORGED[kind]
    assert old in sources["one_mass.c"]
    other = sources | {"one_mass.c": sources["one_mass.c"].replace(old, new)}
    with pytest.raises(ValueError, match=r"does not move the errors|prepare gives others"):
        kernel.prove(json.loads(outcome.kernel), other)


@pytest.mark.parametrize("kind", ["cogging_harmonics", "dead_zone"])
def test_single_precision_has_a_turn_of_its_own_digits(kind: str) -> None:
    outcome, sources = made(kind, "single")
    assert outcome.kernel is not None, outcome.not_by_kernel
    files = {name: text.encode() for name, text in sources.items()}
    report: Any = verify.check(outcome.kernel, sources=files)
    assert report.whole and ("6.2831855*x" in "\n".join(report.proved)) == (kind == "cogging_harmonics")
