"""The remainder in the sentence: size and nature, and the variables that explain a material share of it."""

from __future__ import annotations

from dataclasses import replace
from inspect import signature
from math import nan
from pathlib import Path
from typing import Any

import pytest

from codegen.app import diagnose
from codegen.base.errors import BadInput
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import FoundEffect, MotionTried, Remainder, Separation, Statement, TiedPair
from codegen.diagnosis.verdict.statement import worst
from tests.app.command import is_one_message, stiction
from tests.diagnosis.stage import TEST, among, log_of, stage, system_of
from tests.diagnosis.statements import statement_of

SMALL = Remainder(0.1, 0.006, 0.8, {"load": 0.8, "speed": 0.3})
NOISE = Remainder(3.0, 0.1, 0.03, {"load": 0.03})
SHAPED = Remainder(2.0, 0.05, 0.9, {"load": 0.81, "speed": 0.05, "position": 0.3})
SPREAD = Remainder(2.0, 0.2, 0.02, {"load": 0.008})


def words(left: Remainder, **given: Any) -> str:
    """What is said of this remainder of a log without an effect."""
    said = statement_of("none", left, **given)
    return " ".join(f"{f.words} {f.detail}" for f in said.facts if f.topic == "unexplained")


def test_variables_are_named_only_where_what_follows_them_is_material() -> None:
    assert "0.6 % of the drive force, below the 2 % that counts." in words(SMALL)
    assert "10 % of the drive force, mostly noise" in words(NOISE)
    assert "predicts 1.7 % of the drive force" in words(NOISE)  # 10 % · √0.03
    assert all("log, reversals left out: " in words(left) for left in (SMALL, NOISE, SHAPED))  # as the table has them
    assert not any(name in words(left) for left in (SMALL, NOISE) for name in ("load", "speed"))
    shares = "Of its mean square, 81 % depends on the load, 30 % depends on the position (these shares overlap)."
    assert shares in words(SHAPED)
    assert "speed" not in words(SHAPED)
    pushed = Remainder(2.0, 0.2, 0.9, {"constant": 0.7, "speed": 0.2})
    assert "Of its mean square, 70 % is constant, 20 % depends on the speed (these shares overlap)." in words(pushed)
    forceful = Remainder(1.0, 0.3, 0.06, {"input rate": 0.06, "speed": 0.0})  # 0.3·√0.06 is 7 % of the drive force
    assert "Of its mean square, 6 % depends on the rate of change of the input." in words(forceful)
    assert "Of its mean square, 2 % depends on all variables together." in words(SPREAD)
    assert "Residual force on q1 in the training log, reversals left out:" in words(SHAPED, left_on="q1")
    assert "smooth curve" not in words(SHAPED)


def test_a_remainder_larger_than_the_drive_is_not_called_noise() -> None:
    left = Remainder(1.4, 1.96, 0.0)
    (said,) = (f.words for f in statement_of("unknown", left).facts if f.topic == "unexplained")
    assert "196 % of the drive force: the model explains nothing of it" in said and "noise" not in said


def test_an_ambiguous_verdict_says_what_would_tell() -> None:
    spring = FoundEffect("spring", "x", {"k": 3.0}, {"k": "N/m"}, intervals={"k": (2.0, 4.0)})
    drag = FoundEffect("viscous", "rail", {"b": 2.123456}, {"b": "N*s/m"})
    pairs = (TiedPair(("spring", "x"), ("viscous", "rail"), 3.0, 0.5, "several speeds"),)
    motion = MotionTried("chirp up and down", 10.0, 1.0, 12.0)

    def said(experiment: Separation) -> Statement:
        return statement_of("ambiguous", SMALL, effects=(spring,), rivals=(drag,), experiment=experiment)

    both = said(Separation(pairs, (motion,), motion, {}, 10.0))
    assert both.headline == "Something is missing, but this log cannot tell spring on x from viscous on rail."
    assert both.of("values") == ("spring on x: k = 3.0 N/m (95 %: 2.0 to 4.0).", "viscous on rail: b = 2.123 N*s/m.")
    assert both.of("next") == (
        "To tell them apart, log another motion, chirp up and down (excitation.csv), and diagnose both logs "
        "together. The catalogue says: several speeds.",
    )
    (none,) = said(Separation(pairs, (motion,), None, {}, 10.0)).of("next")
    assert "excitation.csv" not in none and "under another load" in none and none.endswith("says: several speeds.")
    (unknown,) = said(Separation((replace(pairs[0], catalogue=""),), (), None, {}, 10.0)).of("next")
    assert "catalogue" not in unknown


def test_another_limit_makes_another_nature() -> None:
    assert [SHAPED.nature(limit) for limit in (0.02, 0.049, 0.06)] == ["structured", "noise", "immaterial"]
    assert replace(SHAPED, rms=nan, share=nan).nature(0.02) == "not judged"  # few samples: it was said to be immaterial
    assert "depends on the load" in words(SMALL, material=0.005)


def test_the_sentence_is_of_the_coordinate_with_most_structure() -> None:
    assert worst([SMALL, NOISE, SHAPED], 0.02) == 2
    assert worst([SMALL, NOISE], 0.02) == 1
    assert worst([Remainder(float("nan"), float("nan"), 0.0), SMALL], 0.02) == 1


@pytest.mark.parametrize("text", ["", "much", "0", "-1%", "2", "100 %", "nan", "1e400", "2 %%", "__import__('os')"])
def test_a_share_that_is_none_is_refused(text: str, tmp_path: Path) -> None:
    result = stiction("diagnose", tmp_path / "no.yaml", tmp_path / "no.csv", f"--material={text}")
    assert is_one_message(result)
    assert result.err.startswith("error: --material: ") and "[SPEC007]" in result.err


@pytest.mark.parametrize(("text", "share"), [("2%", 0.02), ("5 %", 0.05), ("0.1", 0.1), (None, 0.02)])
def test_the_option_reaches_the_diagnosis(
    text: str | None, share: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    of_the_function = signature(diagnose.diagnose_log)

    def stop(*given: Any) -> None:
        raise BadInput("stopped", f"material is {of_the_function.bind(*given).arguments['material']}", "nothing more")

    monkeypatch.setattr(diagnose, "diagnose_log", stop)
    (tmp_path / "spec.yaml").write_text(stage().text)
    log = log_of(stage(duration=5.0), tmp_path, "log.csv")
    option = [] if text is None else ["--material", text]
    result = stiction("diagnose", tmp_path / "spec.yaml", log.path, "-o", tmp_path / "out", *option)
    assert f"material is {share};" in result.err


def test_none_says_what_is_left_where_it_is_structured() -> None:
    """Of 11 % of the drive force, which the noise of the position hides in simulation, it said "no missing effect"."""
    left = Remainder(2.0, 0.11, 0.3, {"speed": 0.28, "constant": 0.02})
    said = statement_of("none", left, noise=1.1, far=0.0)
    assert said.headline == (
        "No missing effect found. A residual force of 11 % of the drive force is left that is more than noise: part of "
        "it depends on the speed."
    )
    (following,) = said.of("next")
    assert (
        "hides" in following and "A log with less noise of the position, in which the speed varies more," in following
    )
    (spread,) = statement_of("none", SPREAD, noise=4.0).of("next")
    assert "hides" not in spread and "or a longer one" in spread
    for left in (SMALL, NOISE):
        assert statement_of("none", left).headline == "No missing effect found."


@pytest.mark.parametrize(("share", "verdict"), [(0.02, "none"), (0.001, "effect")])
def test_an_effect_below_half_a_percent_is_named_where_the_user_says_that_less_matters(
    share: float, verdict: str, tmp_path: Path
) -> None:
    """A delay of 0.6 ms takes 0.36 % of the drive force, and makes the simulation error eight times as large."""
    delay = "[{kind: input_delay, on: w, parameters: {T: 0.0006}}]"
    train = log_of(stage(delay, level=0.5, noise=4e-6), tmp_path, "train.csv")
    test = log_of(stage(delay, level=0.5, reference=TEST, noise=4e-6), tmp_path, "test.csv")
    spec = stage(level=0.5)
    with among("input_delay", "inertia_error", "offset"):
        found, _ = diagnose_log(spec, system_of(spec), train, test, material=share)
    assert found.verdict == verdict
    if verdict == "effect":
        assert [one.kind for one in found.effects] == ["input_delay"]
        assert found.effects[0].parameters["T"] == pytest.approx(0.0006, rel=0.02)
