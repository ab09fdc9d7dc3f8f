"""Where the best candidate is refused, another one that passes every check and leaves nothing material is named."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis import free_runs
from codegen.diagnosis.free_runs import SelectionChecks
from codegen.diagnosis.results import Change, Fact, FoundEffect, Remainder
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.verdict.answer import Answer
from tests.diagnosis.fakes import InRound, part_named
from tests.diagnosis.stage import stage, system_of

SYSTEM = system_of(stage())


def answer(kind: str, verdict: Any, *why: str) -> Answer:
    against = tuple(Fact("not accepted", words) for words in why)
    found = FoundEffect(kind, "x", {}, {}, (), {})
    return Answer(verdict, (found,), SYSTEM, SYSTEM, (None, None, None), against=against)  # type: ignore[arg-type]


def candidate(kind: str, why_not: str = "") -> Any:
    trial = SimpleNamespace(parts=(part_named(kind),))
    return InRound(found=SimpleNamespace(part=trial.parts[0], values=((), ()), trial=trial), why_not=why_not)


@dataclass(frozen=True, eq=False)
class OfKinds(SelectionChecks):
    """The verdict and the remainder of each kind are given."""

    said: dict[str, tuple[str, Remainder]]

    def _examined(self, last: Any, found: Any, complete: bool = True) -> Any:
        return answer(found.kind, self.said[found.kind][0]), found

    def _last_checks(self, answer: Answer, outcome: Outcome) -> Any:
        return answer, (self.said[answer.effects[0].kind][1],), False


def checks(said: dict[str, tuple[str, Remainder]], *first: Any) -> OfKinds:
    """The checks of these candidates of the first round; a fit has the kind and the number of its candidate's form."""
    tried = SimpleNamespace(
        base=None,
        first=first,
        with_final=lambda search, final, rivals: SimpleNamespace(kind=final[0], form=final[1]),
    )
    search = SimpleNamespace(with_parts=lambda base, refitted_values, parts, values: (parts[0].kind, refitted_values))
    selection: Any = SimpleNamespace(search=search, tried=tried, case=SimpleNamespace(material=0.02))
    return OfKinds(selection, said)


LITTLE, MUCH = Remainder(0.1, 0.01, 0.5, {}), Remainder(1.0, 0.1, 0.9, {})
UNJUDGED = Remainder(nan, nan, nan, {})
IN_TIME = Remainder(0.3, 0.03, 0.1, {}, (Change("force", 0.0, 1.0, 0.3),), 0.8)
REFUSED = answer("saturation", "unknown", "a smooth curve explains more")


@pytest.mark.parametrize(
    ("verdict", "left", "named"),
    [
        ("effect", LITTLE, True),
        ("effect", MUCH, False),  # an incomplete law: perhaps a force outside the catalogue
        ("effect", UNJUDGED, False),
        ("effect", IN_TIME, False),
        ("unknown", LITTLE, False),  # a check refuses it too
    ],
)
def test_another_candidate_is_named_if_it_leaves_nothing_material(verdict: str, left: Remainder, named: bool) -> None:
    first = candidate("saturation"), candidate("offset", why_not="may be chance"), candidate("stribeck")
    found = checks({"stribeck": (verdict, left)}, *first)._next_candidate(REFUSED)
    assert (found is not None) is named
    if found is not None:
        assert [one.kind for one in found[0].effects] == ["stribeck"]
        words = found[0].remarks[-1].words
        assert words.startswith("saturation on x, which explains more of the free runs, is refused")
        assert "a smooth curve explains more" in words


def test_two_others_are_examined_each_in_its_best_form() -> None:
    kinds = "saturation", "stribeck", "stribeck", "viscous", "offset"
    first = [candidate(kind) for kind in kinds]
    for form, one in enumerate(first):
        one.found.values = (form, ())
    said = {"stribeck": ("effect", MUCH), "viscous": ("effect", MUCH), "offset": ("effect", LITTLE)}
    assert checks(said, *first)._next_candidate(REFUSED) is None
    found = checks(said | {"stribeck": ("effect", LITTLE)}, *first)._next_candidate(REFUSED)
    assert found is not None and found[1].form == 1  # type: ignore[attr-defined]


@dataclass(frozen=True, eq=False)
class WithAnother(SelectionChecks):
    """The best candidate has this answer; the next one, if it is asked for, is named."""

    best: Answer
    parts: int

    def _accepted(self, report: Any) -> Any:
        return self.best, SimpleNamespace(parts=("part",) * self.parts, final=None)

    def _last_checks(self, answer: Answer, outcome: Outcome) -> Any:
        return (REFUSED if answer.verdict == "ambiguous" else answer), (MUCH,), False

    def _compared(self, outcome: Outcome, report: Any) -> Any:
        return ("one", "other"), "how alike they are", "a motion"

    def _in_common(self, outcome: Outcome) -> Any:
        return None

    def _next_candidate(self, refused: Answer) -> Any:
        return answer("stribeck", "effect"), SimpleNamespace(parts=("other",), final=None), (LITTLE,), False

    def _remarks(self, outcome: Outcome, answer: Answer) -> Any:
        return answer.remarks


@pytest.mark.parametrize(
    ("best", "parts", "named"),
    [
        (REFUSED, 1, True),
        (answer("saturation", "ambiguous"), 1, True),  # a tie that the last checks refuse
        (REFUSED, 2, False),  # several effects together
        (answer("saturation", "unknown"), 1, False),  # nothing says why
        (answer("saturation", "none", "too small"), 1, False),
    ],
)
def test_another_candidate_is_asked_for_where_a_single_effect_is_refused(
    best: Answer, parts: int, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(free_runs, "unknown_above_drive", lambda answer, *_: answer)
    monkeypatch.setattr(free_runs, "unknown_for_a_candidate", lambda answer, *_: answer)
    monkeypatch.setattr(free_runs, "better_than_refused", lambda *_: None)
    monkeypatch.setattr(free_runs, "better_than_named", lambda *_: None)
    case = SimpleNamespace(material=0.02, problem=None)
    selection: Any = SimpleNamespace(search=None, tried=SimpleNamespace(first=()), case=case)
    found = WithAnother(selection, best, parts).conclude(lambda *_: None)
    assert (found.answer.verdict == "effect") is named
    assert found.left == ((LITTLE,) if named else (MUCH,))
    assert (found.tied, found.separation, found.excitation) == ((), None, None), "they are of the refused tie"
