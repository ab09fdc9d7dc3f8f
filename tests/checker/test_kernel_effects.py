"""Declared effects that machine and code compute alike are proved of the C, with the machine of the catalogue."""

from __future__ import annotations

import json
import math
import random
import re
import runpy
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import errors, verify
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
    "stribeck": (
        "rail], parameters: {delta: 10, v_s: 0.1}",
        lambda v: v["w"] - v["s"] * (v["a"] + 10 * math.exp(-((v["v"] / 0.1) ** 2)))),
    "friction_drift": (
        "rail], parameters: {delta: 5, T: 100}",
        lambda v: v["w"] - v["s"] * (v["a"] + 5 * math.exp(-v["t"] / 100))),
    "quadratic_drag": (
        "x], parameters: {c: 2}", lambda v: v["w"] - v["s"] * v["a"] - 2 * v["s"] * v["v"] * v["v"]),
    "input_delay": (  # 3.4 samples: the command of 3 samples before holds for 0.6 of a sample, that before it for 0.4
        "w], parameters: {T: 0.0034}", lambda v: 0.6 * v["w3"] + 0.4 * v["w4"] - v["s"] * v["a"]),
    "actuator_lag": (  # the mean over a sample of w + (lagged - w) exp(-t/tau)
        "w], parameters: {tau: 0.01}",
        lambda v: v["w"] + (v["lagged"] - v["w"]) * 10 * (1 - math.exp(-0.1)) - v["s"] * v["a"]),
}  # fmt: skip
SHARED = {"friction_drift": {"t"}, "actuator_lag": {"w_lagged"}, "input_delay": {f"w_past_{k}" for k in (1, 2, 3, 4)}}
RANGED, FIRST_ORDER = ("stribeck", "quadratic_drag"), ("stribeck", "quadratic_drag")


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
    code = re.sub(r"\b(parameters|inputs|true|sign|state)\.", r"\1_", text)
    functions = {"exp": math.exp, "sin": math.sin, "cos": math.cos, "fabs": abs, "sgn": lambda x: (x > 0) - (x < 0)}
    return float(eval(code, {"__builtins__": {}}, functions | names))


@pytest.mark.parametrize("kind", EFFECTS)
def test_a_declared_effect_is_proved_with_the_machine_of_the_catalogue(kind: str) -> None:
    outcome, sources = made(kind)
    assert outcome.kernel is not None, outcome.not_by_kernel
    proof = json.loads(outcome.kernel)
    shown = errors.prove(proof, sources)
    assert shown["whole"] == (kind not in SHARED and kind not in RANGED)
    assert shown["first order"] == (kind in FIRST_ORDER)
    assert {*proof.get("shared", {})} == {f"state.{z}" for z in SHARED.get(kind, ())}
    given = {f"parameters.{p[11:]}": float(x) for p, x in shown["c"].values.items()}
    dice = random.Random(kind)
    for _ in range(20):
        v = {"x": dice.uniform(-2, 2), "w": dice.uniform(-9, 9), "s": dice.choice([-1, 1]), "a": dice.uniform(1, 90)}
        v |= {"v": v["s"] * dice.uniform(0, 0.3), "t": dice.uniform(0, 200)}
        v |= {name: dice.uniform(-9, 9) for name in ("w3", "w4", "lagged")}
        at = given | {"inputs.x": v["x"], "inputs.w": v["w"], "sign.rail": v["s"], "true.a_rail": v["a"]}
        at |= {"true.v": v["v"], "state.t": v["t"], "state.w_past_3": v["w3"], "state.w_past_4": v["w4"]}
        at |= {"state.w_lagged": v["lagged"]}
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
        errors.prove(json.loads(outcome.kernel), other)


@pytest.mark.parametrize("kind", ["cogging_harmonics", "dead_zone"])
def test_single_precision_has_a_turn_of_the_same_digits(kind: str) -> None:
    outcome, sources = made(kind, "single")
    assert outcome.kernel is not None, outcome.not_by_kernel
    files = {name: text.encode() for name, text in sources.items()}
    report: Any = verify.check(outcome.kernel, sources=files)
    assert report.whole and ("6.283185307179586*x" in "\n".join(report.proved)) == (kind == "cogging_harmonics")


@pytest.mark.parametrize("kind", FIRST_ORDER)
def test_the_twin_moves_by_the_matrix_and_v_falls(kind: str, tmp_path: Path) -> None:
    """The errors of the generated Python beside the machine of the catalogue, at random speeds of the box."""
    outcome, _ = made(kind)
    assert outcome.kernel is not None
    effect = f"effects: [{{kind: {kind}, on: [{EFFECTS[kind][0]}}}]"
    machine = Derived(parse_spec(SPEC.replace("effects: []", effect), Path("made.yaml")))
    (tmp_path / "twin.py").write_text(machine.sources["__init__.py"])
    twin = SimpleNamespace(**runpy.run_path(str(tmp_path / "twin.py")))
    proof, p = json.loads(outcome.kernel), twin.Parameters()
    P = np.array([[float(Fraction(x)) for x in row] for row in proof["lyapunov_matrix"]])
    fall, dice, h = 1 - 2 * float(Fraction(proof["decay_rate"])) * p.sample_time, random.Random(kind), p.sample_time
    for _ in range(200):
        s, a = dice.choice([-1, 1]), dice.uniform(1, 90)
        v, w = s * dice.choice([dice.uniform(0.02, 0.3), dice.uniform(0.3, 5)]), s * a + dice.uniform(-3, 3)  # no turn

        def later(e: Any, s: int = s, a: float = a, w: float = w, v: float = v) -> Any:
            v_hat, a_hat = v - e[0], a - s * e[1]
            state = twin.State(v_hat, a_hat + p.K_F * abs(v_hat), *[0.0] * (len(twin.State.__slots__) - 2))
            twin.step(state, p, twin.Inputs(0.0, w))
            out = twin.step(state, p, twin.Inputs(h * v, w))
            law = EFFECTS[kind][1]({"w": w, "s": s, "a": a, "v": v})
            return np.array([v + h * law - out.v_hat, s * (a - out.a_hat_rail)])

        assert np.abs(later([0.0, 0.0])).max() < 1e-12
        d = 1e-6 * abs(v)
        found = np.column_stack([(later(d * e) - later(-d * e)) / (2 * d) for e in np.eye(2)])
        at = {"true.v": v, "sign.rail": s}
        matrix = np.array([[number(x, at) for x in row] for row in proof["matrix"]])
        assert np.allclose(found, matrix, rtol=1e-6, atol=1e-6)
        assert np.linalg.eigvalsh(matrix.T @ P @ matrix - fall * P).max() <= 1e-9 * np.abs(P).max()
