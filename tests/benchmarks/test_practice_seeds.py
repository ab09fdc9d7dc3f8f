"""The score of fresh cases: rates, singles that the refit absorbs, the bars, and the rows of all seeds."""

from __future__ import annotations

import json
from dataclasses import replace
from math import sqrt
from pathlib import Path

import pytest

from benchmarks.practice import fresh
from benchmarks.practice.cases import PRACTICE
from benchmarks.practice.fresh import Draw, Unavailable, fresh_cases
from benchmarks.practice.runs import Run
from benchmarks.practice.score import ALARM, BOTH, FIRST, FOREIGN, INTERVALS, OVERCLAIM
from benchmarks.practice.seeds import ADAPTER, BARS, BEGIN, END, section, with_section, with_tally
from benchmarks.practice.tally import Tally, is_absorbed, tally
from benchmarks.rates import Rate
from tests.benchmarks.diagnoses import diagnosis, effect, written

needs_practice = pytest.mark.skipif(not PRACTICE.is_dir(), reason="../shared/practice is not here")

DRAG, SPRING, ZONE = effect("quadratic_drag", c=25.0), effect("spring", k=30.0), effect("dead_zone", "w", width=0.01)


@pytest.mark.parametrize(("hits", "trials"), [(0, 12), (3, 60), (26, 30), (60, 60)])
def test_at_the_ends_of_wilsons_interval_the_rate_is_as_many_deviations_away(hits: int, trials: int) -> None:
    low, high = Rate(hits, trials).interval or (0.0, 0.0)
    for end in {low if hits else high, high if hits < trials else low}:
        assert abs(hits / trials - end) / sqrt(end * (1 - end) / trials) == pytest.approx(1.959964, rel=1e-5)


def test_a_rate_of_nothing_is_none() -> None:
    assert (str(Rate(0, 0)), Rate(0, 0).share, str(Rate(3, 4))) == ("–", None, "3 of 4: 75 % (30 … 95)")


@pytest.mark.parametrize(("refit", "absorbed"), [(1.0, True), (1.04, True), (1.06, False), (2.0, False), (None, False)])
def test_a_single_is_absorbed_where_the_refit_runs_as_well_as_the_truth(
    refit: float | None, absorbed: bool, tmp_path: Path
) -> None:
    said = diagnosis("none", refit=refit)
    assert is_absorbed(written(tmp_path, "case_0000", "single", [ZONE], said), said) is absorbed
    assert not is_absorbed(written(tmp_path, "case_0001", "double", [ZONE, DRAG], said), said)
    assert not is_absorbed(written(tmp_path, "case_0002", "none", [], said), said)


@needs_practice
def test_every_group_is_counted_by_its_own_rule(tmp_path: Path) -> None:
    wide = {**DRAG, "intervals": {"c": [26.0, 30.0]}}
    given = [
        ("single", [DRAG], diagnosis("effect", DRAG, refit=9.0)),
        ("single", [DRAG], diagnosis("effect", wide, SPRING, refit=9.0)),
        ("single", [DRAG], diagnosis("effect", SPRING, refit=9.0)),
        ("single", [DRAG], diagnosis("unknown", tied=["quadratic_drag"], refit=9.0)),
        ("single", [DRAG], diagnosis("none", refit=9.0)),
        ("single", [ZONE], diagnosis("none", refit=1.0)),
        ("single", [ZONE], diagnosis("effect", SPRING, refit=1.0)),
        ("double", [DRAG, SPRING], diagnosis("effect", SPRING, DRAG)),
        ("double", [DRAG, SPRING], diagnosis("effect", SPRING)),
        ("none", [], diagnosis("none")),
        ("none", [], diagnosis("effect", SPRING)),
        ("none", [], diagnosis("unknown")),
        ("unident_small", [DRAG], diagnosis("ambiguous", tied=["spring", "cogging"])),
        ("unident_excitation", [DRAG], diagnosis("effect", DRAG)),
        ("foreign", [], diagnosis("unknown")),
        ("foreign", [], diagnosis("effect", SPRING)),
    ]
    made = [written(tmp_path, f"case_{k:04d}", *row) for k, row in enumerate(given)]
    runs = [Run(case.name, 1.0, float(k), 1000, "", "abc") for k, case in enumerate(made)]
    found = tally((11, 16, "standard", "abc"), tmp_path / "results", made, runs, 1)
    assert {words: (r.hits, r.trials) for words, r in found.rates.items()} == {
        "single effects: first place": (2, 5),
        "single effects: `none`": (1, 5),
        "single effects: an extra effect": (1, 7),
        "absorbed by the refit: `none`, or first place": (1, 2),
        "all single effects: first place": (2, 7),
        "two effects: both": (1, 2),
        "no effect: false alarm": (1, 3),
        "no effect: `none`": (1, 3),
        "cannot be identified: overclaim": (1, 2),
        "foreign disturbance: under a known name": (1, 2),
        # c of the first; not of the second; both of the first double, k alone of the second; c where it is no claim
        "true parameters in their 95 % interval": (5, 6),
    }
    assert found.verdicts == {"ambiguous": 1, "effect": 9, "none": 3, "unknown": 3}
    assert found.cpu == (7.5, 13.5, 15.0)
    assert found.absorbed == ("dead_zone → none", "dead_zone → effect spring")
    assert "quadratic_drag → unknown quadratic_drag" in found.wrong and "none → effect spring" in found.wrong
    assert "dead_zone → effect spring" in found.wrong and "dead_zone → none" not in found.wrong
    assert (found.done, found.failed) == (16, 1)


def score(seed: int, tier: str = "standard", code: str = "abc", hits: int = 3) -> Tally:
    """A score of four cases."""
    return Tally(seed, 4, tier, code, 4, 0, {FIRST: Rate(hits, 4)}, {"none": 4}, (1.0, 2.0, 3.0), (), ())


def test_seeds_are_kept_in_the_order_in_which_they_were_measured_and_shown_newest_first() -> None:
    scores: list[Tally] = []
    for new in (score(12), score(11), score(11, "hard"), score(11, code="new"), score(12, hits=4)):
        scores = with_tally(scores, new)
    assert [s.key for s in scores] == [
        (12, 4, "standard", "abc"),
        (11, 4, "standard", "abc"),
        (11, 4, "hard", "abc"),
        (11, 4, "standard", "new"),
    ]
    assert scores[0].rates[FIRST].hits == 4
    text = section(scores)
    head, line, *rows = text[text.index("| seed | code |") :].split("\n")[:5]
    assert (head, line) == ("| seed | code | first place | CPU s |", "|---|---|---|---|")
    assert rows == ["| 11 | new | 3/4 | 1 |", "| 11 | abc | 3/4 | 1 |", "| 12 | abc | 4/4 | 1 |"]
    assert ADAPTER.validate_json(json.dumps([json.loads(ADAPTER.dump_json(scores))[0]])) == scores[:1]


def test_the_latest_code_is_pooled_and_held_against_its_bars() -> None:
    """83 of 87 is 95.4 % and meets 95 %, 82 of 87 is 94.3 % and does not; the older code is not pooled."""
    for hits, words in ((42, "| 83/87 | 95 |"), (41, "| 82/87 | 94 |")):
        newest = [score(2, code="new"), score(3, code="new")]
        pair = zip(newest, (Rate(41, 43), Rate(hits, 44)), strict=True)
        text = section([score(1, hits=0), *(replace(s, rates={FIRST: found}) for s, found in pair)])
        row = next(line for line in text.split("\n") if line.startswith(f"| {FIRST} |"))
        assert words in row and row.endswith("| met |" if hits == 42 else "| **missed** |")
        assert "code new, seeds 3, 2, 8 cases" in text


@pytest.mark.parametrize(
    ("tier", "name", "rate", "met"),
    [
        ("hard", FIRST, Rate(88, 100), True),
        ("hard", FIRST, Rate(87, 100), False),
        ("standard", BOTH, Rate(8, 10), False),
        ("hard", BOTH, Rate(8, 10), True),
        ("standard", ALARM, Rate(1, 33), False),
        ("standard", OVERCLAIM, Rate(0, 6), True),
        ("hard", OVERCLAIM, Rate(1, 600), False),
        ("hard", FOREIGN, Rate(1, 20), True),
        ("standard", INTERVALS, Rate(89, 100), False),
        ("standard", INTERVALS, Rate(100, 100), False),
        ("hard", INTERVALS, Rate(95, 100), True),
        ("hard", FOREIGN, Rate(0, 0), None),
    ],
)
def test_a_bar_includes_its_ends(tier: str, name: str, rate: Rate, met: bool | None) -> None:
    assert BARS[tier][name].met_by(rate) is met


def test_the_section_takes_the_place_of_the_one_before() -> None:
    first, second = (section([score(seed)]) for seed in (1, 2))
    page = with_section("# Title\n\nWords.\n\n## Time\n\nMore.\n", first)
    assert page.index("Words") < page.index(BEGIN) < page.index("| 1 | abc |") < page.index(END) < page.index("## Time")
    again = with_section(page, second)
    assert again == page.replace(first, second)
    assert with_section("# Title\n", first).startswith("# Title\n")


def test_a_set_that_is_there_is_not_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw = Draw(7, 2, "hard")
    folder = tmp_path / "sets" / "seed_7_2" / "hard"
    asked: list[list[str]] = []

    def make(command: list[str], fault: str, extra: dict[str, str] | None = None) -> None:
        asked.append(command)
        (folder / "index.json").write_text('{"failed": []}')

    monkeypatch.setattr(fresh, "environment", lambda out: tmp_path / "python")
    monkeypatch.setattr(fresh, "run_tool", make)
    for name in ("case_0000",):
        (folder / name).mkdir(parents=True)
        (folder / name / "truth.json").write_text("{}")
    assert [case.title for case in fresh_cases(draw, tmp_path, 1)] == ["hard/case_0000"]
    assert asked[0][-2:] == ["--only", "1"] and asked[0][2:8] == ["--seed", "7", "--count", "2", "--tier", "hard"]
    fresh_cases(draw, tmp_path, 1)
    assert len(asked) == 1


def test_where_the_generator_cannot_run_the_reason_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fresh, "GENERATOR", tmp_path / "absent")
    with pytest.raises(Unavailable, match="is not here"):
        fresh.environment(tmp_path)
    with pytest.raises(Unavailable, match="it failed: so it is"):
        fresh.run_tool(["/bin/sh", "-c", "echo so it is >&2; exit 3"], "it failed")


def test_a_score_without_a_result_has_no_time() -> None:
    assert "| 1 | abc | 3/4 | – |" in section([replace(score(1), cpu=None)])
