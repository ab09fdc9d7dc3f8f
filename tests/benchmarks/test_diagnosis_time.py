"""The time of diagnoses in docs/performance.md: one section, and goals by the clock on a quiet machine alone."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from benchmarks.diagnosis_time import page
from benchmarks.diagnosis_time.page import BEGIN, END, Measured, goals, with_section
from benchmarks.page import kept
from benchmarks.page import page as whole_page
from benchmarks.practice.runs import Run


def measured(load: float, arm: Run | None = None) -> Measured:
    runs = tuple(Run(f"case {k}", 5.0 + k, 9.0 + k, 24_000, "", "code") for k in range(5))
    return Measured("a processor", 2, load, runs, arm, (*(f"case {k}: effect" for k in range(5)), "arm: none"))


def test_wall_times_are_judged_only_where_the_machine_had_no_other_work() -> None:
    assert [goal.reached for goal in goals(measured(0.9))] == [7.0, pytest.approx(8.6), None]
    assert [goal.reached for goal in goals(measured(7.0))] == [None, None, None]
    slow = Run("arm", 50.0, 181.0, 5000, "", "code")
    assert [goal.verdict for goal in goals(measured(0.9, slow))] == ["met", "met", "**missed**"]
    failed = Run("arm", 50.0, 20.0, 0, "exit code 2", "code")
    assert goals(measured(0.9, failed))[2].reached is None


def test_the_section_is_written_once_and_stays_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "KEPT", tmp_path / "times.json")
    page.KEPT.write_text(json.dumps(asdict(measured(7.0, Run("arm", 50.0, 40.0, 5000, "", "code")))))
    once = with_section("# Page\n\n## Other\n\ntext\n")
    assert once.count(BEGIN) == once.count(END) == 1 and once.startswith("# Page\n\n## Other\n\ntext\n\n" + BEGIN)
    assert "| case 2 | 24000 | 7.0 | 11.0 | effect |" in once and "| arm | 5000 | 50.0 | 40.0 | none |" in once
    assert "not judged" in once and with_section(once + "\n## Behind\n") == once + "\n## Behind\n"


def test_the_page_of_the_other_benchmarks_keeps_it() -> None:
    results = kept()
    assert results is not None
    assert whole_page(results).count(BEGIN) == page.KEPT.exists()
