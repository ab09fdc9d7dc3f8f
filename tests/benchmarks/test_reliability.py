"""What counts as a right verdict, and the page that says how many were."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.practice.cases import Case
from benchmarks.reliability import Source, judged_case, judged_machine, judged_spike, page


def case(folder: Path, group: str, *kinds: str) -> Case:
    effects = [{"kind": kind, "on": "x", "parameters": {"k": 1.0}} for kind in kinds]
    truth = {"group": group, "effects": effects, "equivalents": [[] for _ in kinds]}
    folder.mkdir(exist_ok=True)
    (folder / "truth.json").write_text(json.dumps(truth))
    return Case("standard", folder)


def said(verdict: str, *kinds: str, noise: float = 1.0) -> dict[str, Any]:
    effects = [{"kind": kind, "parameters": {"k": 1.0}} for kind in kinds]
    named = effects if verdict == "effect" else []
    return {"verdict": verdict, "effects": named, "candidates": effects, "rivals": [], "data": {"level_final": noise}}


@pytest.mark.parametrize(
    ("group", "true", "verdict", "named", "right"),
    [
        ("single", ["spring"], "effect", ["spring"], True),
        ("single", ["spring"], "effect", ["spring", "viscous"], False),
        ("double", ["spring", "viscous"], "effect", ["spring"], True),
        ("foreign", [], "effect", ["spring"], False),
        ("none", [], "effect", ["spring"], False),
        ("none", [], "none", [], True),
        ("unident_dead", ["spring"], "none", [], True),
        ("unident_dead", ["spring"], "effect", ["spring"], False),
        ("single", ["spring"], "none", [], False),
        ("single", ["spring"], "ambiguous", ["cogging", "spring"], True),
        ("single", ["spring"], "ambiguous", ["cogging", "offset"], False),
        ("unident_pair", ["spring"], "ambiguous", ["cogging", "offset"], True),
    ],
)
def test_a_verdict_on_a_made_log_is_judged_by_the_truth(
    tmp_path: Path, group: str, true: list[str], verdict: str, named: list[str], right: bool
) -> None:
    found = judged_case(case(tmp_path / "case_0001", group, *true), said(verdict, *named))
    assert found == (f"{verdict}, at the noise", right)


def test_a_verdict_that_claims_nothing_is_not_counted(tmp_path: Path) -> None:
    assert judged_case(case(tmp_path / "case_0001", "single", "spring"), said("unknown")) is None
    assert judged_case(case(tmp_path / "case_0001", "single", "spring"), {"verdict": "refused"}) is None


def test_a_spiked_log_is_judged_beside_the_plain_one() -> None:
    truth = {"effects": [{"kind": "spring", "parameters": {"k": 1.0}}], "equivalents": [[]]}
    plain = said("none")
    assert judged_spike(plain, said("effect", "spring", noise=20.0), truth) == ("effect, above the noise", True)
    assert judged_spike(plain, said("effect", "cogging", noise=20.0), truth) == ("effect, above the noise", False)
    assert judged_spike(plain, said("none", noise=20.0), truth) is None


@pytest.mark.parametrize(
    ("group", "identifiable", "true", "verdict", "named", "right"),
    [
        ("single", True, ["spring"], "effect", ["spring"], True),
        ("single", True, ["spring"], "effect", ["spring", "compliance"], False),
        ("double", True, ["spring", "offset"], "effect", ["spring"], True),
        ("single", True, ["spring"], "none", [], False),
        ("single", False, ["spring"], "none", [], True),
        ("single", True, ["spring"], "ambiguous", ["spring", "cogging"], True),
        ("single", True, ["spring"], "ambiguous", ["offset", "cogging"], False),
        ("none", False, [], "none", [], True),
        ("none", False, [], "ambiguous", ["offset", "cogging"], False),
        ("foreign", True, [], "effect", ["saturation"], False),
        ("foreign", True, [], "none", [], False),
    ],
)
def test_a_verdict_on_a_machine_of_another_simulator_is_judged_by_the_truth(
    group: str, identifiable: bool, true: list[str], verdict: str, named: list[str], right: bool
) -> None:
    truth = {
        "group": group,
        "identifiable": identifiable,
        "foreign": "cable" if group == "foreign" else "",
        "effects": [{"kind": kind} for kind in true],
        "equivalents": [[] for _ in true],
    }
    found = said(verdict, *named, noise=20.0)
    found["rivals"] = [{"kind": kind} for kind in named] if verdict == "ambiguous" else []
    assert judged_machine(truth, found) == (f"{verdict}, above the noise", right)
    assert judged_machine(truth, said("unknown")) is None


def test_the_page_states_what_was_counted_and_what_was_checked() -> None:
    """9 of 10 with Jeffreys' prior: (9 + 1/2)/(10 + 1) = 0.86."""
    name = "effect, at the noise"
    fit = [
        Source("made logs of seed 11", ((name, True),) * 7 + ((name, False),), ("abc",)),
        Source("real logs", ((name, True),) * 2, ("def",)),
    ]
    text = page(fit, [Source("made logs of seed 12", ((name, True),) * 4, ("abc",))])
    assert "| effect, at the noise | 9 of 10 | 0.86 | 0.62 to 0.99 | 4 of 4: 100 % (51 … 100) | yes |" in text
    assert "| made logs of seed 11 | 7 of 8 | abc |" in text
    assert "| real logs | 2 of 2 | def |" in text
    wrong = page(fit, [Source("made logs of seed 12", ((name, False),) * 8, ("abc",))])
    assert "| 0 of 8: 0 % (0 … 32) | **no** |" in wrong
