"""Progress of a long verb: a bar on a terminal, plain lines where stderr is none, the first before anything is read."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout, suppress
from time import sleep
from types import SimpleNamespace

import pytest

import stiction
from codegen.app import demo, derived
from codegen.app import diagnose as diagnosing
from codegen.app.cli import main
from codegen.base import progress as told
from codegen.base import terminal
from codegen.base.errors import BadInput
from codegen.base.progress import LOADING, begin, never_falling, progress
from tests.slow_cases import slow_except

from .command import SPECS


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(told.time, "monotonic", lambda: now[0])
    return now


def test_a_line_for_each_station_and_every_five_seconds(clock, capsys) -> None:
    with progress(lines=True) as tell:
        for seconds, station, share in (
            (0, "preflight", 0.0),
            (0, "preflight", 0.0),
            (1, "refit", 0.05),
            (3, "refit", 0.06),
            (4, "effect 1", 0.1),
            (8, "effect 1", 0.2),
            (9, "effect 1", 0.21),
            (13, "effect 1", 0.3),
            (14, "effect 1", 0.34),
            (15, "done", 1.0),
        ):
            clock[0] = 100.0 + seconds
            tell(station, share)
    out, err = capsys.readouterr()
    assert out == ""
    shown = [f"{LOADING} ...", "preflight ...", "refit, 5 %", "effect 1, 10 %", "effect 1, 21 %", "effect 1, 34 %"]
    assert err.splitlines() == shown


def test_a_step_that_begins_is_shown_by_the_open_display_alone(capsys) -> None:
    begin("reading the spec")
    with progress(lines=True):
        begin("reading the spec")
    begin("building the model")
    assert capsys.readouterr() == ("", f"{LOADING} ...\nreading the spec ...\n")


FIRST = """
import sys
class Watched:
    def write(self, text):
        if text.strip():
            sys.__stdout__.write(text + " ".join(name for name in ("numpy", "sympy", "casadi") if name in sys.modules))
            sys.__stdout__.flush()
            sys.exit(0)
    def flush(self): pass
    def isatty(self): return False
sys.stderr = Watched()
from stiction import main
main()
"""


def test_the_first_line_of_a_diagnosis_comes_before_any_library_is_loaded() -> None:
    """They and a robot's file took 6 s, in which a pipe was silent."""
    command = [sys.executable, "-c", FIRST, "diagnose", "no.yaml", "no.csv"]
    done = subprocess.run(command, cwd=SPECS.parent, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == f"{LOADING} ..."


def test_each_step_of_a_diagnosis_is_named_before_it_is_done(monkeypatch, tmp_path, capsys) -> None:
    """The model of an arm with seven joints takes seconds to be read and built."""
    shown: list[str] = []

    def steps() -> list[str]:
        shown.extend(capsys.readouterr().err.splitlines())
        return [*shown]

    reading, building = derived.read_spec, derived.system_of
    seen = {}

    def read(path, *checks):
        seen["read"] = steps()
        return reading(path, *checks)

    def build(spec):
        seen["build"] = steps()
        return building(spec)

    monkeypatch.setattr(derived, "read_spec", read)
    monkeypatch.setattr(derived, "system_of", build)
    log = tmp_path / "log.csv"
    log.write_text("t,x,w\n0,0,0\n")
    with monkeypatch.context() as caught, pytest.raises(SystemExit):
        caught.setattr(sys, "argv", ["stiction", "diagnose", str(SPECS / "one_mass.yaml"), str(log)])
        main()
    assert seen["read"] == [f"{LOADING} ...", "reading the spec ..."]
    assert seen["build"] == [*seen["read"], "building the model ..."]
    after = [line for line in steps() if line.endswith(" ...")]
    assert "reading the logs ..." in after[len(seen["build"]) :]


def test_the_steps_of_a_library_call_are_not_shown(capsys) -> None:
    with pytest.raises(BadInput):
        derived.derived_from("no.yaml")
    assert capsys.readouterr() == ("", "")


def test_the_share_of_a_part_of_the_work_is_told_to_its_display_alone() -> None:
    outer, inner = list[float](), list[float]()
    told.share_display()(0.1)  # nobody watches
    with told.shares_to(outer.append):
        told.share_display()(0.2)
        with suppress(ZeroDivisionError), told.shares_to(inner.append):
            told.share_display()(0.3)
            _ = 1 / 0
        told.share_display()(0.4)
    told.share_display()(0.5)
    assert (outer, inner) == ([0.2, 0.4], [0.3])


def test_a_share_never_decreases(monkeypatch, tmp_path) -> None:
    """After 78 % of "effect 3" came 60 %: a search may begin a round again."""
    log = tmp_path / "log.csv"
    stiction.simulate(SPECS / "one_mass.yaml", log)
    told: list[tuple[str, float]] = []

    def searching(spec, system, train, held_out, progress, *_) -> None:
        for step, share in (("effect 3", 0.775), ("effect 3", 0.6), ("values and held-out error", 0.78)):
            progress(step, share)
        raise BadInput("here", "an end", "none", code="LOG009")

    monkeypatch.setattr(diagnosing, "diagnose_log", searching)
    with pytest.raises(BadInput, match="an end"):
        stiction.diagnose(SPECS / "one_mass.yaml", log, out=tmp_path / "out", progress=lambda *tell: told.append(tell))
    assert told == [("effect 3", 0.775), ("values and held-out error", 0.78)]


def test_a_caller_s_progress_is_called_where_something_changed_and_by_one_thread_at_a_time(clock) -> None:
    """A diagnosis called it 600 times, 300 of them with the same step and share, and from several threads at once."""
    told: list[tuple[str, float]] = []
    report = never_falling(lambda *one: told.append(one))
    for _ in range(100):
        report("effect 1", 0.1)
    report("effect 1", 0.1004)
    report("effect 1", 0.12)
    report("effect 2", 0.12)
    assert told == [("effect 1", 0.1), ("effect 1", 0.12), ("effect 2", 0.12)]
    clock[0] += 1.5
    report("effect 2", 0.12)
    assert len(told) == 4, "a caller that ends the work by an exception is asked every second"

    inside, most = 0, 0

    def slow(step: str, share: float) -> None:
        nonlocal inside, most
        inside += 1
        most = max(most, inside)
        sleep(0.01)
        inside -= 1

    report = never_falling(slow)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda k: report(f"effect {k}", 0.1), range(8)))
    assert most == 1


def test_the_bar_of_the_demo_never_goes_back(monkeypatch, tmp_path) -> None:
    """Its two simulations filled the bar, and the diagnosis after them began at 0 again."""
    shares: list[float] = []

    def work(*_, progress) -> None:
        for share in (0.5, 1.0):
            progress("a step", share)

    monkeypatch.setattr(demo, "generate", lambda spec, folder: SimpleNamespace(outcome=None))
    monkeypatch.setattr(demo, "simulate", lambda spec, log, progress: work(progress=progress))
    result = SimpleNamespace(text=lambda paths: "")
    monkeypatch.setattr(demo, "diagnose", lambda *_, progress: work(progress=progress) or result)
    monkeypatch.setattr(demo, "render", lambda *_, **__: "")
    demo.run_demo(tmp_path, lambda text: None, lambda step, share: shares.append(share))
    assert len(shares) == 6 and shares == sorted(shares) and shares[-1] == 1


def test_a_simulation_tells_step_and_share(tmp_path) -> None:
    """It told the share alone, so that one function did not fit all verbs."""
    told: list[tuple[str, float]] = []

    def tell(step: str, share: float) -> None:
        told.append((step, share))

    stiction.simulate(SPECS / "one_mass.yaml", tmp_path / "log.csv", progress=tell)
    shares = [share for _, share in told]
    assert {step for step, _ in told} == {"simulate"} and shares == sorted(shares) and shares[-1] == 1


def test_other_verbs_stay_silent_off_a_terminal(capsys) -> None:
    with progress() as tell:
        tell("simulate", 0.5)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("verb", slow_except(["certify", "generate", "gains"], ["certify"]))
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
    assert LOADING.encode() in seen and b"0:00:0" in seen


class Screen(io.StringIO):
    """A terminal, as far as a stream can tell."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("verb", ["certify", "generate", "gains"])
def test_so_does_it_on_a_stream_that_is_a_terminal(verb: str, tmp_path, monkeypatch) -> None:
    """As the test before it, which starts a process for each: of some verbs in `make check-all` alone."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(terminal.errors, "is_interactive", True)
    monkeypatch.setattr(sys, "argv", ["stiction", verb, str(SPECS / "one_mass.yaml"), "-o", str(tmp_path / "out.json")])
    screen = Screen()
    with redirect_stdout(io.StringIO()), redirect_stderr(screen), pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    assert "0:00:0" in screen.getvalue()
