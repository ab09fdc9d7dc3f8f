"""Progress of a long verb: a bar on a terminal, plain lines where stderr is none, and none before bad input is told."""

from __future__ import annotations

import pytest

from codegen.base import progress as told
from codegen.base.progress import progress


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(told.time, "monotonic", lambda: now[0])
    return now


def test_a_line_for_each_station_and_every_ten_seconds(clock, capsys) -> None:
    with progress("reading", lines=True) as tell:
        for seconds, station, share in (
            (0, "preflight", 0.0),
            (1, "refit", 0.05),
            (3, "refit", 0.06),
            (4, "effect 1", 0.1),
            (13, "effect 1", 0.2),
            (14, "effect 1", 0.21),
            (23, "effect 1", 0.3),
            (24, "effect 1", 0.34),
            (25, "done", 1.0),
        ):
            clock[0] = 100.0 + seconds
            tell(station, share)
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines() == ["refit, 5 %", "effect 1, 10 %", "effect 1, 21 %", "effect 1, 34 %"]


def test_other_verbs_stay_silent_off_a_terminal(capsys) -> None:
    with progress() as tell:
        tell("simulate", 0.5)
    assert capsys.readouterr() == ("", "")
