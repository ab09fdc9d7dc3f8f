"""A credited constant force is named with the sign of a weight as its alternative where it is −2 times that."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from codegen.diagnosis.results import Fact
from codegen.diagnosis.verdict.wrong_values import flipped_constants
from codegen.spec import parse_spec
from tests.diagnosis.stage import STAGE, TRAIN, system_of


def _facts(effects: str, force: str = "w - b*v + c*g0", verdict: str = "effect") -> list[Fact]:
    """Of a stage whose weight is 2 kg times 10 m/s^2."""

    def system(effects: str):
        text = STAGE.format(effects=effects, level=4, reference=TRAIN, duration=8.0, noise=0)
        parameters = "  c: {value: 2, unit: kg}\n  g0: {value: 10, unit: m/s^2}\n  b: {value"
        return system_of(parse_spec(text.replace("  b: {value", parameters).replace("w - b*v", force), Path("s.yaml")))

    answer = SimpleNamespace(verdict=verdict, refit=system("[]"), augmented=system(effects))
    return flipped_constants(answer)  # type: ignore[arg-type]


def _offset(f0: float) -> str:
    return f"[{{kind: offset, on: x, parameters: {{f0: {f0}}}}}]"


@pytest.mark.parametrize(("force", "f0"), [("w - b*v + c*g0", -39), ("w - b*v - c*g0", 39)])
def test_a_constant_of_minus_twice_the_weight_is_its_sign(force: str, f0: float) -> None:
    (fact,) = _facts(_offset(f0), force)
    assert fact.topic == "next" and "c*g0 in the force on x" in fact.words
    assert f"{f0} N that is added is -1.95 times it" in fact.words


@pytest.mark.parametrize("f0", [39, -20, -30, -50])
def test_another_constant_is_none(f0: float) -> None:
    assert _facts(_offset(f0)) == []


def test_a_weight_that_follows_the_position_is_no_constant() -> None:
    assert _facts(_offset(-40), "w - b*v + c*g0*sgn(x)") == []


def test_a_constant_beside_another_effect_is_found() -> None:
    both = _offset(-40)[:-1] + ", {kind: cogging, on: x, parameters: {amplitude: 3, period: 0.02, phase: 0}}]"
    assert len(_facts(both)) == 1


@pytest.mark.parametrize("verdict", ["none", "unknown", "ambiguous"])
def test_what_is_not_credited_turns_nothing(verdict: str) -> None:
    assert _facts(_offset(-40), verdict=verdict) == []
