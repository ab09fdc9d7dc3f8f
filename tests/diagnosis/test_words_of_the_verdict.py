"""What a diagnosis says of candidates that pass and are not named, and of a residual that an effect leaves."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast, get_args

import pytest
from sympy import Float, Symbol

from codegen.app.diagnose import Diagnosed
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import (
    TOPICS,
    Candidate,
    Change,
    Diagnosis,
    ErrorFigures,
    Fact,
    FoundEffect,
    Remainder,
    Round,
    Separation,
    Statement,
    TiedPair,
    Verdict,
)
from codegen.diagnosis.verdict.admission import FORCE, RUN, Admitted, Refusal, merged, refused_values
from codegen.diagnosis.verdict.answer import by_remainder
from codegen.diagnosis.verdict.statement import best_refused, changes_in_words
from codegen.logs import read_logs
from codegen.mechanics import System
from tests.diagnosis.fakes import InRound, Placed
from tests.diagnosis.stage import log_of, stage, system_of
from tests.diagnosis.statements import statement_of

NONE: Any = SimpleNamespace()
FIGURES = ErrorFigures(1.0, (1.0,), 0.1, 1e-3, (1e-3,))


def candidate(kind: str, gain: float, why_not: str = "") -> Candidate:
    return Candidate(kind, "x", {}, gain, 3.0, 8, 8, 0.5, not why_not, why_not, ())


def diagnosis(verdict: str, *candidates: Candidate, later: tuple[Round, ...] = (), **more: Any) -> Diagnosis:
    named = (FoundEffect("cogging", "x", {}, {}, (), {}),) if verdict == "effect" else ()
    coordinates = [{"name": "x", "unit": "m", "force_unit": "N"}]
    data = {"test": "t", "forces_compared_with": "drive force", "coordinates": coordinates}
    fixed: dict[str, Any] = {"training": (0, 0, 0), "refitted": {}, "agreement": None, "findings": {}}
    fixed |= dict.fromkeys(("declared", "refit", "augmented"), FIGURES) | {"certificate": None, "data": data}
    fixed |= {"effects": named, "later_rounds": later, "candidates": candidates, **more}
    return Diagnosis(verdict, Statement("S."), **fixed)  # type: ignore[arg-type]


CASES = [
    ((), "explains less than cogging on x; not tested together with it"),
    ((candidate("spring", 0.01, "removes 1 %"),), "explains less than cogging on x; together with it: removes 1 %"),
    (
        (candidate("spring", 0.3),),
        "explains less than cogging on x; together with it: passes, but adds too little",
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
    assert "explains more, but the residual force or the later rounds prefer" in found.not_named(found.candidates[0])
    rival = FoundEffect("spring", "x", {}, {}, (), {})
    tied = diagnosis("ambiguous", candidate("cogging", 0.72), candidate("spring", 0.7), rivals=(rival,))
    assert tied.not_named(tied.candidates[1]) == "this log cannot tell it from the others that fit alike"
    # A rival may be one that alone may be chance: "no: may be chance" stood below a headline that names it.
    doubtful = (candidate("cogging", 0.72), candidate("spring", 0.3, "may be chance: p = 0.1"))
    text = Diagnosed(diagnosis("ambiguous", *doubtful, rivals=(rival,)), Path(), ()).text(paths=False)
    assert "tied with the first; alone: may be chance: p = 0.1" in text and "no: " not in text
    leading = (candidate("cogging", 0.72, "may be chance: p = 0.1"), candidate("spring", 0.7))
    text = Diagnosed(diagnosis("ambiguous", *leading, rivals=(rival,)), Path(), ()).text(paths=False)
    assert "tied with others; alone: may be chance: p = 0.1" in text and "tied with the first" not in text
    forms = [replace(candidate("cogging", 0.8), parameters={name: 1.0}) for name in ("amplitude", "sin_1")]
    named = (FoundEffect("cogging", "x", {"amplitude": 1.0}, {}, (), {}),)
    found = diagnosis("effect", *forms, effects=named)
    assert [found.not_named(one) for one in forms] == ["", "the form with amplitude is named"]
    for verdict in ("unknown", "none"):
        other = diagnosis(verdict, candidate("cogging", 0.72))
        assert "see the verdict" in other.not_named(other.candidates[0])


def test_candidates_are_shown_named_tied_passed_refused_and_then_by_what_they_explain() -> None:
    """A refused one that explained 18 % stood above a refused one of 99 %, and no order was said."""
    refused = [
        candidate(kind, gain, "fails") for kind, gain in (("lag", 0.18), ("delay", float("nan")), ("hitch", 0.99))
    ]
    passed = [candidate("spring", 0.3), candidate("viscous", 0.8)]
    named = candidate("cogging", 0.5)
    found = diagnosis("effect", *refused, *passed, named)
    order = ["cogging", "viscous", "spring", "hitch", "lag", "delay"]
    assert [c.kind for c in found.in_order(found.candidates)] == order
    rival = FoundEffect("spring", "x", {}, {}, (), {})
    tied = diagnosis("ambiguous", named, *refused, *passed, rivals=(rival,))
    assert [c.kind for c in tied.in_order(tied.candidates)][:3] == ["cogging", "spring", "viscous"]
    lines = Diagnosed(found, Path(), ()).text(paths=False).splitlines()
    table = [line.split()[0] for line in lines if " on x  " in line]
    assert table == order and any(line.startswith("  Order: named effects") for line in lines)


def remainder(structured: float) -> Remainder:
    return Remainder(rms=1.0, share=0.05, structured=structured, over={"position": structured})


SPRING = FoundEffect("spring", "x", {"k": 18.0}, {"k": "N/m"})
PLAY = FoundEffect("backlash", "x", {"gap": 1e-4}, {"gap": "m"})


def test_every_topic_is_explained_in_the_docs() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "diagnosis.md").read_text(encoding="utf-8")
    section = page.partition("## The words of a verdict")[2].partition("\n## ")[0]
    assert [line.split("`")[1] for line in section.splitlines() if line.startswith("| `")] == list(TOPICS)


def topics(said: Statement) -> list[str]:
    return [fact.topic for fact in said.facts]


@pytest.mark.parametrize(("structured", "all_of_it"), [(0.9, False), (0.0, True)])
def test_the_verdict_is_no_stronger_than_what_is_left_allows(structured, all_of_it):
    said = statement_of("effect", remainder(structured), effects=(SPRING,))
    begins = "Missing effect: spring on x, k = 18 N/m." if all_of_it else "Part of what is missing: spring on x"
    assert said.headline.startswith(begins)
    (left, *_) = said.of("unexplained")
    assert ("Another effect is missing too, or a similar one is missing instead of this one." in left) != all_of_it
    (what_to_do,) = said.of("next")
    assert ("go on with spec.yaml" in what_to_do) == all_of_it
    assert ("Something else is missing too" in what_to_do) != all_of_it


def test_several_effects_are_named_in_the_headline_and_their_values_below():
    one = FoundEffect("viscous", "rail", {"b": 2.0}, {"b": "N*s/m"}, (("asymmetry", "rail"),), {"b": (1.9, 2.1)})
    said = statement_of("effect", effects=(SPRING, one))
    assert said.headline == "Missing effects: spring on x and viscous on rail."
    spring, drag = "spring on x: k = 18 N/m.", "viscous on rail: b = 2.00 N*s/m (95 %: 1.90 to 2.10)."
    assert said.of("values")[:2] == (spring, drag)
    assert "asymmetry on rail" in said.of("values")[2]


def test_a_sum_of_many_waves_is_whole_in_the_detail_only():
    waves = {f"sin_{k}": float(k) for k in range(1, 13)}
    (values, *_) = statement_of(
        "effect", effects=(FoundEffect("cogging", "x", waves, dict.fromkeys(waves, "N")),)
    ).facts
    assert values.topic == "values" and "and 8 more" in values.words
    assert all(f"{name} = " in values.detail for name in waves)


def test_the_evidence_compares_with_declared_and_refitted_values():
    falls = statement_of("effect", effects=(SPRING,), declared=2.0, refit=1.5, augmented=0.5)
    (words,) = falls.of("evidence")
    assert "2 N as declared, 0.5 N with the effect (75 % smaller); 1.5 N with refitted values alone" in words
    apart = {"declared": 5.84, "refit": 0.1, "augmented": 0.09, "training": (0.226, 0.123, 0.0094)}
    (words,) = statement_of("effect", effects=(SPRING,), **apart).of("evidence")
    assert "5.84 N as declared, 0.1 N with refitted values alone, 0.09 N with the effect (10 % smaller than" in words
    assert "on the training log the relative force error is 12 % refitted, 0.94 % with the effect." in words
    assert "times" not in words and words.count("refitted values alone") == 1
    (words,) = statement_of("effect", effects=(SPRING,), augmented=2.1).of("evidence")
    assert "does not fall" in words and "smaller" not in words and "refitted values alone are no better" in words
    (words,) = statement_of("effect", effects=(SPRING,), by_force=False, unit="m", declared=float("inf")).of("evidence")
    assert "diverges as declared, 1 m with the effect;" in words


@pytest.mark.parametrize("why", ["is too small", ""])
def test_none_says_why_the_best_candidate_is_not_accepted(why: str) -> None:
    """One that removes 89 % and is too small must not be counted with those that remove nothing."""
    part, evidence = Placed(kind="stribeck", on="rail", form=""), SimpleNamespace(share=0.89)
    ranked = InRound(found=SimpleNamespace(part=part), evidence=evidence, why_not=why)
    outcome: Any = SimpleNamespace(first=(ranked,))
    refused = best_refused(outcome)
    assert refused == (("stribeck", "rail", why) if why else None)
    said = statement_of("none", refused=refused)
    assert said.headline == "No missing effect found."
    assert said.of("not accepted") == (("stribeck on rail, the best candidate, is too small.",) if why else ())
    assert bool(said.of("evidence")) is not bool(why)  # that no candidate removes a share


def test_the_best_refused_candidate_is_named_with_its_form_as_in_the_table() -> None:
    """Two forms of one effect had one name in the sentence, which then seemed to give the other row's reason."""

    def row(share: float, why: str, *names: str) -> Any:
        part = Part("stribeck", 0, "rail", names, (), ())
        return InRound(found=SimpleNamespace(part=part), evidence=SimpleNamespace(share=share), why_not=why)

    plain, split = row(0.2, "too small", "delta", "v_s"), row(0.3, "by chance", "delta", "v_s", "d_delta")
    outcome: Any = SimpleNamespace(first=(plain, split))
    assert best_refused(outcome) == ("stribeck with d_delta", "rail", "by chance")
    outcome.first = (plain,)
    assert best_refused(outcome) == ("stribeck", "rail", "too small")


@pytest.mark.parametrize("verdict", ["none", "unknown"])
def test_nothing_is_claimed_of_all_effects_where_one_passed_and_was_refused_later(verdict: str) -> None:
    """A play that removed 81 % of the free-run error was refused later: 'no effect removes a share' is false."""
    said = statement_of(verdict, effects=(PLAY,), against=(Fact("not accepted", "it is worse on held-out data"),))
    assert said.of("not accepted") == (
        "backlash on x (gap = 0.0001 m), the best candidate: it is worse on held-out data.",
    )
    assert said.of("evidence") == () and "explains it" not in said.headline


@pytest.mark.parametrize(
    ("over", "refused", "headline"),
    [
        ([("position", 0.6)], None, "Something is missing, but no effect of the catalogue explains it."),
        (
            [("position", 0.6)],
            ("cogging", "x", "fits no better"),
            "Something is missing, but no effect of the catalogue passes the tests.",
        ),
        ([("constant", 0.6)], None, "Mainly a constant force is missing, but no effect of the catalogue explains it."),
        (
            [("position", 0.6), ("constant", 0.5)],
            None,
            "Something is missing, but no effect of the catalogue explains it.",
        ),
        ([], None, "Something is missing, but no effect of the catalogue explains it."),
    ],
)
@pytest.mark.parametrize("records", [0, 24])
def test_unknown_says_no_more_than_its_reason(over: Any, refused: Any, headline: str, records: int) -> None:
    """It began "Something is missing that is not in the catalogue", of a constant and of refused candidates too."""
    said = statement_of("unknown", refused=refused, records=records, over=over)
    assert said.headline == headline
    assert said.of("not accepted") == (("cogging on x, the best candidate, fits no better.",) if refused else ())
    assert ("24 steady records" if records else "5.2 times the measurement noise") in said.of("evidence")[0]


def test_unknown_with_a_value_that_would_explain_it_says_so_first_and_asks_for_no_new_effect() -> None:
    """A load of 24 kg, declared as 20: the advice was to write an effect of one's own."""
    value, advice = Fact("declared value", "m = 24 kg would explain 100 %"), Fact("next", "Give m a `tolerance`")
    said = statement_of("unknown", remarks=(value, advice))
    assert said.headline.endswith("A declared value may be wrong.")
    first, then = said.of("next")
    assert first == "Give m a `tolerance`." and "effect of your own" not in then
    assert "effect of your own" in statement_of("unknown").of("next")[0]
    assert "declared value" not in statement_of("unknown", remarks=(advice,)).headline


def test_a_candidate_that_is_refused_alone_and_named_in_the_end_is_no_plain_refusal() -> None:
    """Beside cogging, a Stribeck peak was accepted; alone it may be chance, and the table said "no: may be chance"."""
    peak, other = candidate("stribeck", 0.2, "may be chance"), candidate("backlash", 0.1, "may be chance")
    found = diagnosis("effect", candidate("cogging", 0.9), peak, other)
    found = replace(found, effects=tuple(replace(SPRING, kind=c.kind, on=c.on) for c in (found.candidates[0], peak)))
    assert [found.is_named(c) for c in (peak, other)] == [True, False]
    assert not replace(found, verdict="unknown").is_named(peak)
    form = replace(candidate("cogging", 0.95, "may be chance"), parameters={"sin_1": 1.0})  # another one passes
    assert not replace(found, candidates=(*found.candidates, form)).is_named(form)
    shown = Diagnosed(found, Path(), ()).text(paths=False)
    rows = {line.split()[0]: line for line in shown.splitlines() if line.endswith("may be chance")}
    assert rows["stribeck"].endswith("named in the end; alone: may be chance")
    assert rows["backlash"].endswith("no: may be chance") and "named" not in rows["backlash"]


def test_an_effect_prints_its_values_with_their_units() -> None:
    values, units = {"amplitude": 0.39995, "exponent": 2.0}, {"amplitude": "N*m", "exponent": "1"}
    found = FoundEffect("cogging", "roll", values, units)
    assert repr(found) == "<FoundEffect: kind cogging, on roll, amplitude 0.4 N*m, exponent 2>"
    assert "<td>0.4 N*m</td>" in found._repr_html_()


def test_an_effect_that_a_later_round_found_has_a_row_too() -> None:
    """Cogging of one joint and viscous friction of another: the table said nothing of the second effect."""
    cogging, spring, viscous = candidate("cogging", 0.9), candidate("spring", 0.1), candidate("viscous", 0.99)
    refused = candidate("viscous", 0.5, "may be chance")
    rounds = (
        Round((("cogging", "x"),), (viscous, candidate("offset", 0.1))),
        Round((("cogging", "x"), ("viscous", "x")), (candidate("offset", 0.2), refused)),
    )
    found = diagnosis("effect", cogging, spring, later=rounds)
    effects = tuple(replace(SPRING, kind=kind, on="x") for kind in ("cogging", "viscous", "stribeck"))
    found = replace(found, effects=effects, in_no_round=(candidate("stribeck", 0.3),))
    others = [candidate("dead_zone", 0.01 * k, "may be chance") for k in range(6)]
    for shown in (found, replace(found, candidates=(*found.candidates, *others))):
        text = Diagnosed(shown, Path(), ("spec.yaml",)).text()
        lines = text.split("candidates ")[1].splitlines()[1:]
        assert [line.split()[0] for line in lines[:4]] == ["cogging", "viscous", "stribeck", "spring"]
        assert lines[1].endswith("passes, in addition to cogging on x") and "99.0 %" in lines[1]
        assert lines[2].endswith("passes, in place of another effect")
        assert not any("offset" in line for line in lines) and "your spec, with the effects\n" in text
        assert sum(line.startswith("  ") and " on x " in line for line in lines) == min(8, len(shown.candidates) + 2)


@pytest.mark.parametrize(("changed", "over", "in_time"), [(0.8, 0.3, True), (0.4, 0.3, False), (0.6, 0.7, False)])
def test_a_remainder_that_changes_in_time_asks_for_a_log_and_no_effect(changed, over, in_time):
    left = Remainder(
        rms=1.0, share=0.2, structured=0.9, over={"velocity": over, "time": 0.9}, changed=changed,
        changes=(Change("friction level", 1.0, 3.0, 2.0),),
    )  # fmt: skip
    (advice,) = statement_of("unknown", left, changes=["from 1 s to 3 s ..."]).of("next")
    assert ("`friction_drift`" in advice) is in_time and ("effect of your own" in advice) is not in_time


def test_unknown_names_the_candidate_that_leaves_most() -> None:
    (words,) = statement_of("unknown", effects=(PLAY,)).of("not accepted")
    assert words.startswith("backlash on x (gap = 0.0001 m), the best candidate, leaves most of the simulation error")


def test_every_verdict_says_what_was_written_and_what_to_do_next() -> None:
    for verdict in get_args(Verdict):
        named = (SPRING,) if verdict in ("effect", "ambiguous") else ()
        said = statement_of(verdict, effects=named, rivals=(PLAY,) if verdict == "ambiguous" else ())
        assert topics(said)[-1] == "next" and "spec.yaml" in topics(said)
        assert len(said.headline.split()) <= 25 and all(len(f.words.split()) <= 30 for f in said.facts)


def test_facts_are_ordered_by_topic_and_all_of_them_in_the_text_and_in_the_json() -> None:
    said = statement_of(
        "none", remainder(0.9), remarks=(Fact("log", "A push."), Fact("next", "Log it again.", "Twice."))
    )
    assert topics(said) == sorted(topics(said), key=TOPICS.index) and topics(said)[0] == "log"
    found = replace(diagnosis("none"), statement=said)
    stored = found.as_json()
    assert stored["headline"] == said.headline and len(stored["facts"]) == len(said.facts)
    assert {"topic": "next", "words": "Log it again.", "detail": "Twice."} in stored["facts"]
    text = " ".join(Diagnosed(found, Path(), ()).text(paths=False).split())
    for fact in said.facts:
        assert fact.words in stored["sentence"] and fact.detail in stored["sentence"] and fact.words in text


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
    option = ("refitted friction levels alone", NONE)
    refusal = Refusal("refitted values", "as declared", {FORCE: 1.075})
    (fact,) = Admitted(option, FIGURES, (refusal,)).remarks
    assert fact.topic == "spec.yaml" and fact.words == (
        "Refitted values are not written: on held-out data the residual force is 7.5 % larger than as declared. "
        "Written instead: refitted friction levels alone."
    )
    (fact,) = Admitted(None, FIGURES, (refusal,)).remarks
    assert "instead" not in fact.words
    assert Admitted(option, FIGURES, ()).remarks == ()


def test_the_values_of_a_refused_refit_are_told() -> None:
    """Of a cart that rested too long, the refit was refused and shown nowhere, so its owner learnt nothing from it."""
    names = ("m", "b", "k", "c", "d", "e", "same")
    symbols = {name: Symbol(name, real=True) for name in names}
    units = {symbols["m"]: "kg", symbols["b"]: "N*s/m"}
    declared = (2.0, 6.0, 0.0, 1.0, 1.0, 1.0, 5.0)
    refit = (2.5, 0.0, 3.0, -1.0, 1.1, 1.2, 5.0 + 1e-9)
    one, other = (
        cast(
            System,
            SimpleNamespace(units=units, values={symbols[n]: Float(v) for n, v in zip(names, some, strict=True)}),
        )
        for some in (refit, declared)
    )
    (fact,) = refused_values(one, other)
    assert fact.topic == "spec.yaml" and fact.words == (
        "Refused: c = -1 (declared 1), b = 0 N*s/m (declared 6), k = 3 (declared 0), m = 2.5 kg (declared 2), "
        "and 2 others"
    )
    assert refused_values(other, other) == ()


def test_refusals_by_the_same_test_are_one_statement_and_that_of_most_options_is_first() -> None:
    """A pendulum's verdict said four times over that neither error would be 5 % smaller."""
    options = (
        "refitted values",
        "refitted friction levels alone",
        "values fitted without the effect",
        "declared values",
    )
    alike = [Refusal(option, "as declared") for option in options]
    (fact,) = merged(alike)
    assert fact.words == (
        "on held-out data neither residual force nor simulation error is 5 % smaller than as declared, "
        "whichever values are used."
    )
    assert all(option in fact.detail for option in options)
    worse = [Refusal(o, "as declared", {FORCE: r}) for o, r in zip(options[:2], (1.1, 1.14), strict=True)]
    first, second = merged([worse[0], *alike[1:]])
    assert "neither" in first.words and first.words.endswith(
        "with refitted friction levels alone, values fitted without the effect or declared values alike."
    )
    assert "the residual force is 10 % larger" in second.words and second.words.endswith("with refitted values.")
    (both,) = merged(worse)
    assert "the residual force is 10 to 14 % larger" in both.words
    (far,) = merged([Refusal("declared values", "as declared", {RUN: float("inf"), FORCE: 3.0})])
    assert (
        "infinitely larger (the simulation diverges) and the residual force larger by a factor of 3 than as declared"
        in far.words
    )
    (less,) = merged([Refusal("declared values", "without the effect", {RUN: 0.99})])
    assert "the simulation error is only 1 % smaller than without the effect" in less.words


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
    assert ("refit: the same, since" in text) is said


PUSH = Change("force", 9.0, 10.5, -8.0)


@pytest.mark.parametrize(
    ("before", "share", "structured", "changed", "after"),
    [
        ("none", 0.39, 0.55, 0.0, "unknown"),  # a pendulum whose angle at the start was not known: 29 % of the drive
        ("none", 0.1, 0.55, 0.0, "none"),
        ("none", 0.39, 0.001, 0.0, "none"),
        ("none", 0.1, 0.001, 0.5, "unknown"),
        ("none", 0.1, 0.001, 0.01, "none"),
        ("unknown", 0.1, 0.55, 0.0, "unknown"),
        ("unknown", 0.1, 0.001, 0.0, "none"),
        ("unknown", 1.96, 0.0, 0.0, "unknown"),  # a pendulum that is controlled upright: twice the drive is left
        ("unknown", 0.1, 0.001, 0.5, "unknown"),
        ("effect", 0.1, 0.001, 0.0, "effect"),
        ("effect", 0.39, 0.55, 0.5, "effect"),
    ],
)
def test_what_is_left_decides_between_none_and_unknown(
    before: Verdict, share: float, structured: float, changed: float, after: Verdict
) -> None:
    """Predicted by the motion, or by a change in time, it is material from 2 % of the drive force on."""
    quiet = Remainder(1.0, 0.001, 0.0)
    one = Remainder(1.0, share, structured, {}, (PUSH,) if changed else (), changed)
    assert by_remainder(before, (quiet, one), 0.02) == after


def test_a_force_that_nothing_shows_is_no_number() -> None:
    """The end of a pendulum's log, held still: the table had `nan nan nan N` and `inf inf inf %`."""
    still = replace(FIGURES, force_rms_rows=(nan,), relative_force=inf)
    figures = dict.fromkeys(("declared", "refit", "augmented"), still)
    text = Diagnosed(diagnosis("none", **figures), Path(), ()).text(paths=False)
    assert "nan" not in text and "inf" not in text and "–: the machine stands still there" in text


def test_a_diagnosis_shows_itself_in_one_line() -> None:
    shown = repr(diagnosis("effect", candidate("cogging", 0.72)))
    assert (
        shown.startswith("<Diagnosis: verdict effect, effects cogging on x") and "\n" not in shown and len(shown) < 200
    )


def test_a_time_that_seems_wrong_is_said_beside_an_effect() -> None:
    """At half the sample rate a sound machine has an inertia error and viscous friction, with all evidence for them."""
    words = "The time of the log seems 2 times too long"
    for verdict, said in (("effect", True), ("ambiguous", True), ("none", False)):
        facts = statement_of(
            verdict, effects=(SPRING,), rivals=(PLAY,) if verdict == "ambiguous" else (), misread=[words]
        ).facts
        assert any(f.topic == "log" and f.words == f"The log itself may be the cause: {words}." for f in facts) is said


@pytest.mark.parametrize(("structured", "said"), [(0.9, True), (0.0, False)])
def test_what_a_slow_log_leaves_beside_an_effect_may_be_the_log_s(structured: float, said: bool) -> None:
    """At 20 Hz Stribeck friction was found to 1 %, and 2.5 % of the force was left: `another effect is missing too`."""
    words = "Sampled at 20 Hz (every 50 ms). That is slow for friction"
    facts = statement_of("effect", remainder(structured), effects=(SPRING,), doubts=[words]).facts
    found = [f.words for f in facts if f.topic == "log"]
    assert found == ([f"What is left may come from the log itself: {words}."] if said else [])


@pytest.mark.parametrize("verdict", ["effect", "ambiguous"])
def test_effects_on_two_coordinates_have_figures_of_both(verdict: str) -> None:
    """The evidence was of the first one's coordinate alone. Effects that tie are compared on that one."""
    second = {"by_force": False, "declared": 3e-3, "refit": 2e-3, "augmented": 1e-3, "unit": "rad", "where": "q2"}
    effects = (replace(SPRING, on="q1"), replace(SPRING, kind="viscous", on="q2"))
    said = statement_of(verdict, effects=effects, where="q1", elsewhere=[second])
    (words,) = said.of("evidence")
    assert words.startswith("Residual force on q1 on held-out data: 2 N as declared, 1 N with ")
    of_second = " Simulation error of q2: 0.003 rad as declared, 0.002 rad with refitted values alone, 0.001 rad with"
    assert (of_second in words) is (verdict == "effect")
    (fact,) = [f for f in said.facts if f.topic == "evidence"]
    assert "Residual force:" in fact.detail and ("Simulation error:" in fact.detail) is (verdict == "effect")
