"""The open-loop protocol of EMPS, and the rules that choose by the training record alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.emps.choice import Candidate, as_good, least, rules
from benchmarks.emps.floor import drift_mm
from benchmarks.emps.models import BY_DIRECTION, LOST_MM, Model, score
from benchmarks.emps.records import EVERY, FREE_SAMPLES, ROOT, Measured, blocks, start_state, without
from codegen.mechanics import build_system
from codegen.spec import read_spec

H = 1e-3


def candidate(kinds: tuple[str, ...], seconds: float | None, *errors: float) -> Candidate:
    return Candidate(kinds, seconds, errors, (1.0,), ())


def emps() -> Model:
    return Model(build_system(read_spec(ROOT / "specs" / "emps.yaml")), ())


def coasting(seconds: float) -> Measured:
    """The declared axis at the steady speed of a constant command: 203.5034 v = 35.1507 · 2 − 20.3935 + 3.1648."""
    t = np.arange(0, seconds, H)
    speed = (35.1507 * 2.0 - 20.3935 + 3.1648) / 203.5034
    return Measured(0.1 + speed * t, np.full_like(t, speed), 0.1 + speed * t, np.full_like(t, 2.0), H)


def test_a_run_starts_from_the_first_samples_alone() -> None:
    t = np.arange(200) * H
    x = 0.3 + 0.05 * t - 0.4 * t**2
    x[FREE_SAMPLES:] = 7.0
    assert start_state(x, H) == pytest.approx((0.3, 0.05), abs=1e-9)


def test_the_free_samples_are_not_scored_and_a_run_that_diverges_is_lost() -> None:
    measured = np.zeros(100)
    wrong = np.zeros(100)
    wrong[:FREE_SAMPLES] = 1.0
    assert score(wrong, measured) == 0.0
    assert score(np.full(100, 2e-3), measured) == pytest.approx(2.0)
    assert score(np.full(100, np.nan), measured) == LOST_MM


def test_blocks_are_all_of_a_record_and_what_is_left_of_it_is_the_rest() -> None:
    parts = blocks(4, 103)
    assert parts[0][0] == 0 and parts[-1][1] == 103 and all(a[1] == b[0] for a, b in pairwise(parts))
    assert without(parts[0], 103) == [(parts[0][1], 103)]
    assert without(parts[1], 103) == [(0, parts[1][0]), (parts[1][1], 103)]


def test_runs_of_a_fit_take_means_of_the_command_and_every_so_many_positions() -> None:
    n = 23 * EVERY
    data = Measured(*(np.arange(n, dtype=float) + k for k in range(4)), H)
    record = data.runs(EVERY, n, 5 * EVERY * H)
    assert record.length == 5 and list(record.start) == [0, 5, 10, 15]
    assert record.sample_time == pytest.approx(EVERY * H)
    assert record.measured[:2, 0] == pytest.approx([EVERY + 2, 2 * EVERY + 2])
    assert record.commands[0, 0] == pytest.approx(np.mean(np.arange(EVERY, 2 * EVERY)) + 3)
    assert data.runs(0, n, None).length == 23


def test_a_free_run_of_the_declared_axis_keeps_its_steady_speed() -> None:
    model, data = emps(), coasting(3.0)
    assert score(model.predicted(model.start, data.free_run()), data.measured) < 2e-3
    # Behind the start a force of 0.1 N moves it at 0.1 N over the damping, less the lag.
    t, lag = np.arange(0, 3.0, H), 95.1089 / 203.5034
    moved = 0.1 / 203.5034 * (t - lag * (1 - np.exp(-t / lag)))
    expected = 1e3 * float(np.sqrt(np.mean(moved[FREE_SAMPLES:] ** 2)))
    assert drift_mm(model, model.start, data, 0.1) == pytest.approx(expected, rel=1e-2)


def test_a_fit_finds_the_damping_that_made_a_motion() -> None:
    model, data = emps(), coasting(3.0)
    off = model.start.copy()
    off[2] *= 1.2  # viscous coefficient
    before = score(model.predicted(off, data.free_run()), data.measured)
    found = model.fitted(off, data, [(0, len(data))], None)
    assert score(model.predicted(found, data.free_run()), data.measured) < 0.02 * before


def test_the_rules_choose_by_the_blocks_and_by_the_verdict() -> None:
    best, near, far = candidate(("a", "b"), 2.0, 1.0, 1.2), candidate((), None, 1.1, 1.2), candidate((), 0.5, 3.0, 3.0)
    named = [candidate(("a",), 0.5, 2.0, 2.4), candidate(("a",), None, 2.0, 2.1)]
    found = [far, near, best, *named]
    assert least(found) is best
    assert as_good(found) == [near, best]
    by_words = [rule(found) for rule in rules(("a",)).values()]
    assert by_words == [[best], [near, best], [named[1]]]


def test_a_structure_has_a_parameter_for_each_effect() -> None:
    assert len(Model(emps().system, BY_DIRECTION).start) == len(emps().start) + 1
    assert Model(emps().system, BY_DIRECTION).flat(np.array([20.0, 95.0, 200.0, 1.0, -30.0]))["d_b"] == pytest.approx(
        -30
    )
