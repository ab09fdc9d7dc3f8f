"""What a user gets for a log that is broken in a usual way: a message, or the verdict ``unfit``; never a finding."""

from __future__ import annotations

import json
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.app.diagnose import diagnose
from codegen.logs import preflight, read_log
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.spec import read_spec
from tests.diagnosis.stage import stage, system_of

from .command import contents, is_one_message, stiction

Columns = dict[str, np.ndarray]

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Columns:
    """What a stage logs that does what its spec says, but for the level of its friction."""
    path = tmp_path_factory.mktemp("good") / "log.csv"
    plant = stage(level=4.5)
    write_log(path, plant, simulate(plant, system_of(plant)))
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: table[name] for name in ("t", "x", "w")}


def write(folder: Path, columns: Columns) -> None:
    head = ",".join(columns)
    np.savetxt(folder / "log.csv", np.column_stack(list(columns.values())), "%.10g", ",", header=head, comments="")
    (folder / "stage.yaml").write_text(stage().text)


def with_nan(good: Columns, rows: list[int]) -> Columns:
    x = good["x"].copy()
    x[rows] = np.nan
    return good | {"x": x}


REFUSED = {
    "too short": (lambda g: {k: v[:900] for k, v in g.items()}, "900 samples over 1.8 s"),
    "ms as us": (lambda g: g | {"t": g["t"] / 1000}, "is t in another unit?"),
    "nothing moves": (lambda g: g | {"x": 0 * g["x"] + 0.3}, "does not move: it stays within 0 m of 0.3"),
    "all zeros": (lambda g: g | {"x": 0 * g["x"], "w": 0 * g["w"]}, "does not move: it stays within 0 m of 0."),
    "a column missing": (lambda g: {"t": g["t"], "w": g["w"]}, "no column `x`"),
    "a burst of NaN": (lambda g: with_nan(g, list(range(500, 540))), "40 of them in a row"),
    "a NaN": (lambda g: with_nan(g, [500]), "`missing: fill`"),
    "stamps too coarse": (lambda g: g | {"t": np.floor(g["t"] * 100) / 100}, "repeat a time stamp with other data"),
    "rows again": (lambda g: {k: np.r_[v[:3000], v[2990:]] for k, v in g.items()}, "time runs backwards"),
}
UNFIT = {
    "x in mm": (lambda g: g | {"x": 1000 * g["x"]}, "scale of x"),
    "x in km": (lambda g: g | {"x": g["x"] / 1000}, "scale of x"),
    "w in mN": (lambda g: g | {"w": 1000 * g["w"]}, "scale of input w"),
    "w in kN": (lambda g: g | {"w": g["w"] / 1000}, "scale of input w"),
    "t in ms": (lambda g: g | {"t": 1000 * g["t"]}, "milliseconds"),
    "sign of x": (lambda g: g | {"x": -g["x"]}, "sign of input w seems flipped, or that of the coordinate"),
    "sign of w": (lambda g: g | {"w": -g["w"]}, "sign of input w seems flipped"),
    "constant input": (lambda g: g | {"w": 0 * g["w"] + 2}, "constant at 2 N"),
    "no input": (lambda g: g | {"w": 0 * g["w"]}, "zero throughout"),
}


@pytest.mark.parametrize("mode", REFUSED)
def test_refused_with_a_message(mode, good, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    change, words = REFUSED[mode]
    write(tmp_path, change(good))
    before = contents(tmp_path)
    result = stiction("diagnose", "stage.yaml", "log.csv", "-o", "out")
    assert is_one_message(result) and words in result.err
    assert contents(tmp_path) == before


def problems_of(folder: Path) -> list[str]:
    """What the preflight says of the log in a folder."""
    spec = stage()
    return [f.words for f in preflight(read_log(folder / "log.csv", spec), spec) if f.severity == "problem"]


def test_preflight_finds_no_problem_in_the_log_as_it_is(good, tmp_path):
    write(tmp_path, good)
    assert not problems_of(tmp_path)


@pytest.mark.parametrize("mode", UNFIT)
def test_preflight_finds_the_problem(mode, good, tmp_path):
    change, words = UNFIT[mode]
    write(tmp_path, change(good))
    problems = problems_of(tmp_path)
    assert any(words in told for told in problems), problems


def test_the_preflight_is_told_before_anything_is_fitted(good, tmp_path, monkeypatch):
    """The words came after 2 to 15 s of fits that no unfit log needs."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path, UNFIT["x in mm"][0](good))
    events = []
    progress = {"progress": lambda at, _: events.append(at), "on_findings": events.append}
    done = diagnose("stage.yaml", "log.csv", out="one", **progress)
    (found,) = [k for k, event in enumerate(events) if not isinstance(event, str)]
    assert events[:found] == ["preflight"] and events[found] == done.diagnosis.findings


def test_the_certificates_after_the_last_fit_are_a_step_of_the_progress(good, tmp_path, monkeypatch):
    """For a pan and tilt head they took ten minutes, in which "tracking observer, 93 %" was shown."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path, UNFIT["x in mm"][0](good))
    observer = "\nobserver: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 0.002}\n"
    (tmp_path / "stage.yaml").write_text(stage().text + observer)
    events, certified, outcome = [], [], Derived.outcome

    def counted(machine: Derived) -> object:
        certified.append(machine.spec.path.name)
        return outcome.func(machine)

    counting = cached_property(counted)
    counting.__set_name__(Derived, "outcome")
    monkeypatch.setattr(Derived, "outcome", counting)
    done = diagnose("stage.yaml", "log.csv", out="one", progress=lambda at, _: events.append(at))
    assert done.diagnosis.verdict == "unfit" and events[-1] == "certificates and code"
    assert certified == ["spec.yaml"]  # the spec is written as declared, so before is after: certified once
    change = done.diagnosis.certificate
    assert change is not None and change.before == change.after


def test_a_problem_is_the_verdict_unfit_and_exit_code_3(good, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, UNFIT["x in mm"][0](good))
    result = stiction("diagnose", "stage.yaml", "log.csv", "-o", "out")
    assert result.code == 3 and "verdict: unfit" in result.out and "scale of x" in result.out
    # Nothing was fitted or tried, so there is no table of it.
    assert "No effect was tested" in result.out
    assert not [word for word in ("candidates  ", "error on held-out data", "refit ") if word in result.out]
    told = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    found = [f"preflight, train log: {words}" for words in told["preflight"]["train"] if not words.startswith("info")]
    assert found and result.out.startswith("\n".join(found) + "\nverdict: ")  # each once, and before the verdict
    problems = [words.partition("problem: ")[2] for words in told["preflight"]["train"] if words.startswith("problem")]
    printed = " ".join(result.out.split())  # the facts are broken into lines of their own
    assert problems and all(printed.count(" ".join(words.split()[:6])) == 1 for words in problems)
    assert told["verdict"] == "unfit" and told["effects"] == told["candidates"] == []
    page = (tmp_path / "out" / "report.html").read_text()
    assert "log unfit" in page
    # nothing was changed: there is no certificate of a changed spec, and no residual to be trusted
    assert "certificate after" not in result.out and "check of the residual" not in result.out
    assert "after, as changed above" not in page and "correlate with" not in page
    assert (tmp_path / "out" / "spec.yaml").read_text() == (tmp_path / "stage.yaml").read_text()
    assert read_spec(tmp_path / "out" / "spec.yaml").effects == ()
