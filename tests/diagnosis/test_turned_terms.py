"""An accepted force that is −2 times a term of the spec along the log is named with that term's sign."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import Fact, FoundEffect
from codegen.diagnosis.verdict.wrong_values import turned_terms
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, among, log_of, stage, system_of


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory):
    return smooth_motion(log_of(stage(), tmp_path_factory.mktemp("stage"), "log.csv"))


def found(kind: str, **values: float) -> FoundEffect:
    return FoundEffect(kind, "rail" if kind in ("coulomb_asymmetry", "viscous") else "x", values, {})


def facts(motion, *effects: FoundEffect, force: str = "w - b*v + c*g0", verdict: str = "effect") -> list[Fact]:
    """Of a stage with a weight of 2 kg times 10 m/s², a spring of 50 N/m and a rest position to choose from."""
    text = STAGE.format(effects="[]", level=4, reference=TRAIN, duration=8.0, noise=0).replace("w - b*v", force)
    more = "  c: {value: 2, unit: kg}\n  g0: {value: 10, unit: m/s^2}\n  k: {value: 50, unit: N/m}\n"
    more += "  rest: {value: 0.1, unit: m}\n  b: {value"
    system = system_of(parse_spec(text.replace("  b: {value", more), Path("s.yaml")))
    augmented = with_effects(system, effects)
    answer = SimpleNamespace(verdict=verdict, refit=system, augmented=augmented, effects=effects)
    return turned_terms(answer, Problem(system, motion, {}))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("force", "effect", "term"),
    [
        ("w - b*v + c*g0", found("offset", f0=-39), "c*g0"),
        ("w - b*v - c*g0", found("offset", f0=39), "-c*g0"),
        ("w - b*v - c*g0", found("coulomb_asymmetry", d=-39), "-c*g0"),
        ("w - b*v + k*x", found("spring", k=101), "k*x"),
        ("w + b*v", found("viscous", b=11.7), "b*v"),
    ],
    ids=["weight", "counterweight", "by friction", "spring", "damper"],
)
def test_a_force_of_minus_twice_a_term_is_its_sign(motion, force: str, effect: FoundEffect, term: str) -> None:
    """Only constants found as an offset were told."""
    (fact,) = facts(motion, effect, force=force)
    assert fact.topic == "next" and f"the sign of {term} in the force on x" in fact.words
    assert f"{effect.kind} on {effect.on} is " in fact.words and "times it along this log" in fact.words


@pytest.mark.parametrize("f0", [39, -20, -30, -50])
def test_another_constant_is_none(motion, f0: float) -> None:
    assert facts(motion, found("offset", f0=f0)) == []


@pytest.mark.parametrize("k", [-100, 50, 150])
def test_another_spring_is_none(motion, k: float) -> None:
    assert facts(motion, found("spring", k=k), force="w - b*v + k*x") == []


def test_a_weight_that_follows_the_position_is_no_constant(motion) -> None:
    assert facts(motion, found("offset", f0=-40), force="w - b*v + c*g0*sgn(x)") == []


def test_beside_another_effect_and_by_two_together(motion) -> None:
    cogging = found("cogging", amplitude=3, period=0.02, phase=0)
    assert len(facts(motion, found("offset", f0=-40), cogging)) == 1
    both = found("spring", k=100), found("offset", f0=10)  # of -(-k)*(x - rest) turned
    (fact,) = facts(motion, *both, force="w - b*v + k*(x - rest)")
    assert "spring on x and offset on x is -2 times it" in fact.words


@pytest.mark.parametrize("verdict", ["none", "unknown", "ambiguous"])
def test_what_is_not_accepted_turns_nothing(motion, verdict: str) -> None:
    assert facts(motion, found("offset", f0=-40), verdict=verdict) == []


def test_a_diagnosis_names_the_term(tmp_path: Path) -> None:
    """A small weight with the wrong sign; preflight names the sign of a larger one."""

    def weighed(sign: str, reference: str) -> Spec:
        text = STAGE.format(effects="[]", level=4, reference=reference, duration=8.0, noise=2e-6)
        text = text.replace("  b: {value", "  weight: {value: 1, unit: N}\n  k: {value: 300, unit: N/m}\n  b: {value")
        return parse_spec(text.replace("[w - b*v]", f"[w - b*v - k*x {sign} weight]"), Path("s.yaml"))

    logs = [log_of(weighed("+", r), tmp_path, f"{k}.csv") for k, r in enumerate((TRAIN, TEST))]
    declared = weighed("-", TRAIN)
    with among("offset", "viscous"):
        found, _ = diagnose_log(declared, system_of(declared), *logs)
    assert [one.kind for one in found.effects] == ["offset"]
    assert any("Check the sign of" in words for words in found.statement.of("next"))
