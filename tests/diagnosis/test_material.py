"""The remainder in the sentence: size and nature, and the variables that explain a material share of it."""

from __future__ import annotations

from inspect import signature
from pathlib import Path
from typing import Any

import pytest

from codegen.app import diagnose
from codegen.base.errors import BadInput
from codegen.base.text import render
from codegen.diagnosis.results import FoundEffect, MotionTried, Remainder, Separation, SetupTried
from codegen.diagnosis.verdict.conclusion import main_variables, worst
from tests.app.command import is_one_message, stiction
from tests.diagnosis.stage import log_of, stage

SMALL = Remainder(0.1, 0.006, 0.8, {"load": 0.8, "speed": 0.3})
NOISE = Remainder(3.0, 0.1, 0.03, {"load": 0.03})
SHAPED = Remainder(2.0, 0.05, 0.9, {"load": 0.81, "speed": 0.05, "position": 0.3})
SPREAD = Remainder(2.0, 0.2, 0.02, {"load": 0.008})


def words(left: Remainder, **given: Any) -> str:
    """The sentence of a log without an effect, of which this is left."""
    none: dict[str, Any] = {
        "verdict": "none",
        "effects": (),
        "against": (),
        "errors": (),
        "remarks": (),
        "doubts": (),
        "records": 0,
        "changes": (),
    }
    shown = none | {"left": left, "left_on": "", "material": 0.02} | given
    return render("text/verdict.j2", over=main_variables(left, shown["material"]), refused=None, **shown)


def test_variables_are_named_only_where_what_follows_them_is_material() -> None:
    assert "0.6 % of the drive force (RMS, reversals left out), below the 2 % that counts as material." in words(SMALL)
    assert "10 % of the drive force (RMS, reversals left out), mostly noise" in words(NOISE)
    assert "is 1.7 % of the drive force" in words(NOISE)  # 10 % · √0.03
    assert not any(name in words(left) for left in (SMALL, NOISE) for name in ("load", "speed"))
    shares = "81 % of its mean square follows from load, 30 % follows from position (the shares overlap)."
    assert shares in words(SHAPED)
    assert "speed" not in words(SHAPED)
    pushed = Remainder(2.0, 0.2, 0.9, {"constant": 0.7, "speed": 0.2})
    assert "70 % of its mean square is constant, 20 % follows from speed (the shares overlap)." in words(pushed)
    forceful = Remainder(1.0, 0.3, 0.06, {"input rate": 0.06, "speed": 0.0})  # 0.3·√0.06 is 7 % of the drive force
    assert "6 % of its mean square follows from input rate." in words(forceful)
    assert "2 % of its mean square follows from all variables together." in words(SPREAD)
    assert "on q1 (RMS" in words(SHAPED, left_on="q1")
    assert "smooth curve" not in words(SHAPED)


def test_an_ambiguous_verdict_says_what_would_tell() -> None:
    spring = FoundEffect("spring", "x", {"k": 3.0}, {"k": "N/m"}, intervals={"k": (2.0, 4.0)})
    drag = FoundEffect("viscous", "rail", {"b": 2.123456}, {"b": "N*s/m"})
    tried = (SetupTried("load", "a constant force of 3 N on x", 30.0, 1.0), SetupTried("none", "the same", 2.0, 1.0))
    motion = MotionTried("chirp up and down", 10.0, 1.0, 12.0)
    given = {"verdict": "ambiguous", "effects": (spring,), "rivals": (drag,)}
    both = words(SMALL, experiment=Separation((), (motion,), motion, {}, 10.0, tried), **given)
    assert (
        "cannot tell spring on x (k = 3 N/m) from viscous on rail (b = 2.123 N*s/m). What would tell them apart: "
        in both
    )
    assert "another motion, chirp up and down (excitation.csv); or this motion again with a constant force of" in both
    change = words(SMALL, experiment=Separation((), (motion,), None, {}, 10.0, tried), **given)
    assert "What would tell them apart: this motion again with a constant force of 3 N on x." in change
    assert "What would tell" not in words(SMALL, experiment=Separation((), (), None, {}, 10.0, tried[1:]), **given)


def test_another_limit_makes_another_nature() -> None:
    assert [SHAPED.nature(limit) for limit in (0.02, 0.049, 0.06)] == ["structured", "noise", "immaterial"]
    assert "follows from load" in words(SMALL, material=0.005)


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
