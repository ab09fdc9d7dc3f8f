"""Where the best candidate is refused, another one that passes every check and leaves nothing material is named."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis.free_runs import Judge
from codegen.diagnosis.results import Fact, FoundEffect, Remainder
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
class OfKinds(Judge):
    """The verdict and the remainder of each kind are given."""

    said: dict[str, tuple[str, Remainder]]

    def _examined(self, last: Any, found: Any, complete: bool = True) -> Any:
        return answer(found.kind, self.said[found.kind][0]), found

    def _last_checks(self, answer: Answer, outcome: Outcome) -> Any:
        return answer, (self.said[answer.effects[0].kind][1],), False


LITTLE, MUCH = Remainder(0.1, 0.01, 0.5, {}), Remainder(1.0, 0.1, 0.9, {})
UNJUDGED = Remainder(nan, nan, nan, {})


@pytest.mark.parametrize(
    ("verdict", "left", "named"),
    [
        ("effect", LITTLE, True),
        ("effect", MUCH, False),  # an incomplete law: perhaps a force outside the catalogue
        ("effect", UNJUDGED, False),
        ("unknown", LITTLE, False),  # a check refuses it too
    ],
)
def test_another_candidate_is_named_if_it_leaves_nothing_material(verdict: str, left: Remainder, named: bool) -> None:
    tried = SimpleNamespace(
        base=None,
        first=[candidate("saturation"), candidate("offset", why_not="may be chance"), candidate("stribeck")],
        with_final=lambda search, final, rivals: SimpleNamespace(kind=final),
    )
    search = SimpleNamespace(with_parts=lambda base, moved, parts, values: parts[0].kind)
    selection: Any = SimpleNamespace(search=search, tried=tried, case=SimpleNamespace(material=0.02))
    found = OfKinds(selection, {"stribeck": (verdict, left)})._next_candidate(
        answer("saturation", "unknown", "a smooth curve explains more")
    )
    assert (found is not None) is named
    if found is not None:
        assert [one.kind for one in found[0].effects] == ["stribeck"]
        words = found[0].remarks[-1].words
        assert words.startswith("saturation on x, which explains more of the free runs, is refused")
        assert "a smooth curve explains more" in words
