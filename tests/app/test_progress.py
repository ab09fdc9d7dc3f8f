"""Progress of a long verb: a bar on a terminal, plain lines where stderr is none, and none before bad input is told."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from contextlib import suppress

import pytest

from codegen.base import progress as told
from codegen.base.progress import progress

from .command import SPECS


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


@pytest.mark.parametrize("verb", ["certify", "generate", "gains"])
def test_a_verb_that_may_take_a_minute_shows_on_a_terminal_that_it_runs(verb: str, tmp_path) -> None:
    """The certificate of a machine of two coupled coordinates takes a minute, in which nothing was seen."""
    screen, end = pty.openpty()
    command = [sys.executable, "-m", "codegen.app.cli", verb, str(SPECS / "one_mass.yaml"), "-o"]
    environment = {**os.environ, "TERM": "xterm"}
    target = tmp_path / ("c.json" if verb == "certify" else "out")
    running = subprocess.Popen([*command, str(target)], stdout=subprocess.DEVNULL, stderr=end, env=environment)
    os.close(end)
    seen = b""
    with suppress(OSError):  # the end of a closed terminal, on Linux
        while part := os.read(screen, 65536):  # while it runs: a full terminal would stop it
            seen += part
    os.close(screen)
    assert running.wait() == 0
    assert verb.encode() in seen and b"0:00:0" in seen
