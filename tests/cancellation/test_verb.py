"""``stiction cancel`` and ``stiction.cancel``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from stiction import cancel
from tests.app.command import stiction

SPECS = Path(__file__).parents[2] / "specs"
THESIS = SPECS / "thesis" / "two_mass_cancellation.yaml"


def test_section_5_4_in_words():
    done = stiction("cancel", str(THESIS))
    assert done.code == 0
    assert "friction at ground: perfectly: it lies in the range of B, rank [B d] = rank B = 1" in done.out
    assert "friction at between: in part, 16.67 %: it acts on x1, where no input does" in done.out
    assert "a friction force on x1: not at all" in done.out
    assert "u_cancel_w = F_ground\n" in done.out
    assert "may feed energy" not in done.out


def test_all_contacts_leave_a_rest_that_may_push(tmp_path):
    spec = tmp_path / "spec.yaml"
    spec.write_text(THESIS.read_text(encoding="utf-8").replace("contacts: cancellable", "contacts: all"), "utf-8")
    done = stiction("cancel", str(spec), "-o", str(tmp_path / "out"))
    assert "u_cancel_w = -F_between + F_ground\n" in done.out
    assert "The remaining force of between may feed energy into the motion" in done.out
    written = json.loads((tmp_path / "out" / "cancellation.json").read_text(encoding="utf-8"))
    assert written["law"]["inputs_by_contacts"] == [[-1, 1]]
    # the least acceleration error leaves the top mass alone with -F_between, whatever its motion is
    assert written["law"]["force_left_by_contacts"] == [[-1, 0], [0, 0]]
    assert written["law"]["contacts_whose_rest_may_push"] == ["between"]


def test_without_the_section_it_says_what_could_be_done():
    report = cancel(SPECS / "two_link_arm.yaml")
    assert report.reach.cancellable == ("shoulder", "elbow")
    assert report.content["format"] == "stiction-cancellation/1"
    assert report.left is not None and report.left.force == pytest.approx(0, abs=1e-12)


def test_a_falling_rank_is_reported_and_no_input_given(tmp_path):
    text = (SPECS / "two_link_arm.yaml").read_text(encoding="utf-8")
    spec = tmp_path / "spec.yaml"
    spec.write_text(text.replace("  - w1\n", "  - cos(theta1)*w1\n"), encoding="utf-8")
    done = stiction("cancel", str(spec), "--json")
    assert done.code == 3
    content = json.loads(done.out)
    assert content["law"] is None and "rank 2 falls at theta1" in content["refused"]
