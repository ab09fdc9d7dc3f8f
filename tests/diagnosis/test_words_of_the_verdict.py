"""What a diagnosis says of candidates that pass and are not named, and of a residual that an effect leaves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.app.diagnose import Diagnosed
from codegen.base.text import render
from codegen.diagnosis.diagnose import _is_far_off
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import (
    Candidate,
    Change,
    Diagnosis,
    ErrorFigures,
    FoundEffect,
    Remainder,
    Round,
    Separation,
    TiedPair,
)
from codegen.diagnosis.verdict.answer import Admitted
from codegen.diagnosis.verdict.conclusion import _best_refused, changes_in_words
from codegen.logs import read_logs
from tests.diagnosis.stage import log_of, stage, system_of

NONE: Any = SimpleNamespace()
FIGURES = ErrorFigures(1.0, (1.0,), 0.1, 1e-3, (1e-3,))


def candidate(kind: str, gain: float, why_not: str = "") -> Candidate:
    return Candidate(kind, "x", {}, gain, 3.0, 8, 8, 0.5, not why_not, why_not, ())


def diagnosis(verdict: str, *candidates: Candidate, later: tuple[Round, ...] = (), **more: Any) -> Diagnosis:
    named = (FoundEffect("cogging", "x", {}, {}, (), {}),) if verdict == "effect" else ()
    data = {"test": "t", "coordinates": [{"name": "x", "unit": "m", "force_unit": "N"}]}
    fixed: dict[str, Any] = {"training": (0, 0, 0), "refitted": {}, "agreement": None, "findings": {}}
    fixed |= dict.fromkeys(("declared", "refit", "augmented"), FIGURES) | {"certificate": None, "data": data}
    fixed |= {"effects": named, "later_rounds": later, "candidates": candidates, **more}
    return Diagnosis(verdict, "S.", **fixed)  # type: ignore[arg-type]


CASES = [
    ((), "removes less (35.0 %) than cogging on x (72.0 %); not tried in addition to it"),
    ((candidate("spring", 0.01, "removes 1 %"),), "than cogging on x (72.0 %); in addition to it: removes 1 %"),
    (
        (candidate("spring", 0.3),),
        "than cogging on x (72.0 %); in addition to it: passes, but explains too little more",
    ),
]


@pytest.mark.parametrize(("tried", "words"), CASES)
def test_a_candidate_that_passes_and_is_not_named_has_its_reason(tried, words):
    rounds = (Round((("cogging", "x"),), tried),) if tried else ()
    found = diagnosis("effect", candidate("cogging", 0.72), candidate("spring", 0.35), later=rounds)
    assert found.not_named(found.candidates[0]) == "" and words in found.not_named(found.candidates[1])
    text = Diagnosed(found, Path(), ()).text(paths=False)
    assert f"passes, not named: {found.not_named(found.candidates[1])}" in text
    assert next(line for line in text.splitlines() if line.startswith("  cogging on x")).endswith("passes")


def test_a_better_one_that_is_not_named_and_a_tie():
    found = diagnosis("effect", candidate("spring", 0.8), candidate("cogging", 0.72))
    assert "removes more (80.0 %), but the force residual or the later rounds prefer" in found.not_named(
        found.candidates[0]
    )
    rival = FoundEffect("spring", "x", {}, {}, (), {})
    tied = diagnosis("ambiguous", candidate("cogging", 0.72), candidate("spring", 0.7), rivals=(rival,))
    assert tied.not_named(tied.candidates[1]) == "this log does not tell it from the others that tie"
    forms = [replace(candidate("cogging", 0.8), parameters={name: 1.0}) for name in ("amplitude", "sin_1")]
    named = (FoundEffect("cogging", "x", {"amplitude": 1.0}, {}, (), {}),)
    found = diagnosis("effect", *forms, effects=named)
    assert [found.not_named(one) for one in forms] == ["", "the form with amplitude is named"]
    for verdict in ("unknown", "none"):
        other = diagnosis(verdict, candidate("cogging", 0.72))
        assert "see the verdict" in other.not_named(other.candidates[0])


def remainder(structured: float) -> Remainder:
    return Remainder(rms=1.0, share=0.05, structured=structured, over={"position": structured})


@pytest.mark.parametrize(("structured", "all_of_it"), [(0.9, False), (0.0, True)])
def test_the_verdict_is_no_stronger_than_what_is_left_allows(structured, all_of_it):
    said: dict[str, Any] = {"effects": [FoundEffect("cogging", "x", {}, {})], "left": remainder(structured)}
    said |= dict.fromkeys(("rivals", "against", "errors", "remarks", "faults", "doubts"), ())
    said |= {"declared": 2.0, "refit": 2.0, "augmented": 1.0, "unit": "N", "by_force": True, "material": 0.02}
    said |= {"where": "", "left_on": "", "records": 0, "over": [("position", structured)], "experiment": None}
    said |= {"noise": 1, "far": 0, "far_noise": 10, "near_noise": 2, "changes": ()}
    words = render("text/verdict.j2", verdict="effect", **said)
    assert words.startswith("The log shows what the spec lacks: cogging") == all_of_it
    assert words.startswith("The log shows part of what the spec lacks: cogging") != all_of_it
    assert ("another effect is missing too, or this one stands in for one of a similar shape" in words) != all_of_it


@pytest.mark.parametrize(
    ("why", "words"), [("its force is small", "not credited: its force is small"), ("", "removes a")]
)
def test_none_says_why_the_best_candidate_is_not_credited(why: str, words: str) -> None:
    """One that removes 89 % and is too small must not be counted with those that remove nothing."""
    part, evidence = SimpleNamespace(kind="stribeck", on="rail", form=""), SimpleNamespace(share=0.89)
    ranked = SimpleNamespace(found=SimpleNamespace(part=part), evidence=evidence, why_not=why)
    outcome: Any = SimpleNamespace(first=(ranked,))
    refused = _best_refused(outcome)
    assert refused == (("stribeck", "rail", why) if why else None)
    assert words in render("text/verdict.j2", verdict="none", refused=refused, **dict.fromkeys(UNUSED, ()), left=None)


def test_the_best_refused_candidate_is_named_with_its_form_as_in_the_table() -> None:
    """Two forms of one effect had one name in the sentence, which then seemed to give the other row's reason."""

    def row(share: float, why: str, *names: str) -> Any:
        part = Part("stribeck", 0, "rail", names, (), ())
        return SimpleNamespace(found=SimpleNamespace(part=part), evidence=SimpleNamespace(share=share), why_not=why)

    plain, split = row(0.2, "too small", "delta", "v_s"), row(0.3, "by chance", "delta", "v_s", "d_delta")
    outcome: Any = SimpleNamespace(first=(plain, split))
    assert _best_refused(outcome) == ("stribeck with d_delta", "rail", "by chance")
    outcome.first = (plain,)
    assert _best_refused(outcome) == ("stribeck", "rail", "too small")


def test_none_claims_nothing_of_all_effects_where_one_passed_and_was_refused_later() -> None:
    """A play that removed 81 % of the free-run error was refused later: 'no effect removes a share' is false."""
    play = FoundEffect("backlash", "x", {"gap": 1e-4}, {"gap": "m"}, (), {})
    said = dict.fromkeys(UNUSED, ()) | {"effects": (play,), "against": ("it is worse on held-out data",)}
    words = render("text/verdict.j2", verdict="none", refused=None, left=None, **said)
    assert (
        "as far as this log can show. The best candidate, backlash on x (gap = 0.0001 m), is not credited: it" in words
    )
    assert "no effect removes" not in words


FEW = {"noise": 5.2, "near_noise": 2, "far": 0.9, "far_noise": 10, "changes": ()}


@pytest.mark.parametrize(
    ("over", "refused", "begins"),
    [
        ([("position", 0.6)], None, "The model does not describe this log, and no effect of the catalogue explains"),
        ([("position", 0.6)], ("cogging", "x", "it ties"), "The model does not describe this log, and no effect of"),
        ([("constant", 0.6)], None, "What the model leaves is mainly a constant force, and no effect of the catalogue"),
        ([("position", 0.6), ("constant", 0.5)], None, "The model does not describe this log, and no effect"),
        ([], None, "The model does not describe this log, and no effect of the catalogue explains"),
    ],
)
@pytest.mark.parametrize("records", [0, 24])
def test_unknown_says_no_more_than_its_reason(over: Any, refused: Any, begins: str, records: int) -> None:
    """It began "Something is missing that is not in the catalogue", of a constant and of refused candidates too."""
    said = dict.fromkeys(UNUSED, ()) | FEW | {"records": records, "left": None, "over": over}
    words = render("text/verdict.j2", verdict="unknown", refused=None if records else refused, **said)
    assert words.startswith(begins) and "not in the catalogue" not in words
    if refused and not records:
        assert "no effect of the catalogue is credited" in words and words.count("cogging on x, is not credited") == 1


def test_unknown_names_the_candidate_that_leaves_most() -> None:
    play = FoundEffect("backlash", "x", {"gap": 1e-4}, {"gap": "m"}, (), {})
    said = dict.fromkeys(UNUSED, ()) | FEW | {"effects": (play,), "left": None, "over": [], "refused": None}
    words = render("text/verdict.j2", verdict="unknown", **said)
    assert words.startswith("The model does not describe this log, and the best candidate, backlash on x (gap = 0.0001")


UNUSED = ("effects", "rivals", "against", "errors", "remarks", "records", "doubts", "experiment")


VALUES = {"m": (20.0, 20.4, 25.0), "b": (60.0, 60.0, 60.0), "J": (1.5e-4, 1.5e-4, 1.6e-4)}


@pytest.mark.parametrize(
    ("verdict", "written"),
    [("effect", {"m": (20.0, 25.0), "J": (1.5e-4, 1.6e-4)}), ("none", {"m": (20.0, 20.4)}), ("unfit", {})],
)
def test_values_that_are_written_are_told_with_every_verdict(verdict: str, written: dict[str, Any]) -> None:
    """The written spec had another mass, and the console said nothing of it where no effect was found."""
    found = diagnosis(verdict, refitted=VALUES, units={"m": "kg", "b": "N*s/m", "J": "kg*m^2"})
    assert found.written == written
    text = Diagnosed(found, Path(), ()).text(paths=False)
    rows = {line.split()[0]: line.split()[1:] for line in text.splitlines() if line.split()[:1] and line[:2] == "  "}
    for name, (before, after) in written.items():
        assert [float(v) for v in rows[name][:2]] == [before, after]
    assert set(rows) & set(VALUES) == set(written)


@pytest.mark.parametrize(("distance", "better"), [(3.2, "cogging on x"), (-3.8, "spring on x")])
def test_the_distance_of_two_that_tie_is_no_negative_number(distance: float, better: str) -> None:
    pair = TiedPair(("cogging", "x"), ("spring", "x"), 0.5, distance, "")
    apart = Separation((pair,), (), None, {}, 10.0)
    text = Diagnosed(diagnosis("ambiguous", separation=apart), Path(), ()).text(paths=False)
    (line,) = (line for line in text.splitlines() if "degrees" in line)
    assert f"{better} fits better" in line and f"{abs(distance)} " in line and "-" not in line


def test_what_a_refused_option_leaves_is_told() -> None:
    option = ("refitted values of friction levels alone", NONE)
    (words,) = Admitted(option, FIGURES, ("on held-out data refitted values would be worse",)).remarks
    assert words.endswith(option[0])
    (words,) = Admitted(None, FIGURES, ("on held-out data refitted values would be worse",)).remarks
    assert option[0] not in words
    assert Admitted(option, FIGURES, ()).remarks == ()


def test_times_of_a_log_that_counts_from_1970_are_told_apart() -> None:
    """It said `from 1.715e+09 s to 1.715e+09 s`."""
    force = Change("force", 1715000007.3125, 1715000009.665, -72.0)
    early = Change("force", 7.3114, 9.665, -72.0)
    left = Remainder(10.0, 0.2, 0.9, {}, (force, early), 0.9)
    system = system_of(stage())
    assert changes_in_words(left, system, 0, 0.02) == [
        "from 1715000007.31 s to 1715000009.66 s a force of +72 N acts that the model lacks",
        "from 7.311 s to 9.665 s a force of +72 N acts that the model lacks",
    ]


def test_times_of_several_files_are_those_of_the_files(tmp_path: Path) -> None:
    """Of two logs of 14 s a change was said to be `from 12 s to 18 s`, which is in neither."""
    for name in ("one.csv", "two.csv"):
        log_of(stage(), tmp_path, name)
    log = read_logs([tmp_path / "one.csv", tmp_path / "two.csv"], stage())
    second = float(log.time[log.segments[1][0]])
    changes = (Change("force", 12.0, second + 2.0, -72.0), Change("force", second + 3.0, second + 5.0, -72.0))
    left = Remainder(10.0, 0.2, 0.9, {}, changes, 0.9)
    across, within = changes_in_words(left, system_of(stage()), 0, 0.02, log)
    assert across.startswith("from 12 s of one.csv to 2 s of two.csv a force of +72 N")
    assert within.startswith("from 3 s to 5 s of two.csv a force")


@pytest.mark.parametrize(("refit", "said"), [(4.0, True), (4.5, False)])
def test_a_refit_that_stays_as_declared_is_said_so(refit: float, said: bool) -> None:
    """The table had the same figures twice, and the sentence called them those of refitted values."""
    same = diagnosis("effect", refitted={"rail_a": (4.0, refit, 4.2)})
    text = Diagnosed(same, Path(), ()).text(paths=False)
    assert ("(refit: as declared" in text) is said


@pytest.mark.parametrize(("share", "structured", "far"), [(0.39, 0.55, True), (0.1, 0.55, False), (0.39, 0.001, False)])
def test_none_is_not_said_where_the_motion_predicts_much_of_the_drive(
    share: float, structured: float, far: bool
) -> None:
    """A pendulum of which only the speed was logged, from another angle than zero: 29 % of the drive, and `none`."""
    case: Any = SimpleNamespace(material=0.02)
    assert _is_far_off(Remainder(1.0, share, structured, {}), case) is far


def test_a_diagnosis_shows_itself_in_one_line() -> None:
    shown = repr(diagnosis("effect", candidate("cogging", 0.72)))
    assert (
        shown.startswith("<Diagnosis: verdict effect, effects cogging on x") and "\n" not in shown and len(shown) < 200
    )
