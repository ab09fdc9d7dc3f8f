"""What happens once in a log (a push, a payload that drops, friction that swings), and noise, in which nothing does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.changes_in_time import changes_in_time
from codegen.diagnosis.evidence.residual_regression import STATE, at_once, changed_by, since_reversal, splines
from codegen.diagnosis.fit.signals import low_pass
from codegen.spec import parse_spec
from tests.diagnosis.own_stage import simulated
from tests.diagnosis.stage import STAGE, among, log_of, stage, system_of
from tests.slow_cases import drawn, slow_except

H, COUNT, CUTOFF = 0.002, 15000, 20.0
TIME = H * np.arange(COUNT)
EVERY = np.ones(COUNT, dtype=bool)
ACCELERATION = np.sin(1.3 * TIME) + 0.4 * np.sin(4.1 * TIME)
TERMS = {"force": np.ones(COUNT), "inertia": ACCELERATION, "friction level": np.sign(np.cos(1.3 * TIME))}


def noise(seed: int, differences: int) -> np.ndarray:
    """Low-passed white noise, or that of a position differentiated so often."""
    white = np.diff(np.random.default_rng(seed).normal(size=COUNT + 2000 + differences), differences)
    filtered = low_pass(white, CUTOFF, H)[1000:-1000]  # without the ends, where the filter is not settled
    return filtered / np.std(filtered)


@pytest.mark.parametrize("differences", [0, 2])
@drawn(25, 100)
def test_in_noise_nothing_changes(differences: int, draws: int) -> None:
    found = [changes_in_time(noise(seed, differences), EVERY, TERMS, TIME, CUTOFF) for seed in range(draws)]
    assert sum(bool(one.changes) for one in found) <= 1


@pytest.mark.parametrize(
    ("term", "start", "stop"), [("force", 11.0, 12.5), ("inertia", 15.0, 30.0), ("friction level", 6.0, 16.0)]
)
def test_an_interval_is_found_with_its_term_and_size(term: str, start: float, stop: float) -> None:
    inside = (start <= TIME) & (stop > TIME)
    r = 0.1 * noise(7, 0) + np.where(inside, 1.5 * TERMS[term], 0.0)
    found = changes_in_time(r, EVERY, TERMS, TIME, CUTOFF)
    first = found.changes[0]
    assert first.term == term and first.coefficient == pytest.approx(1.5, rel=0.05)
    assert [first.start, first.stop] == pytest.approx([start, stop], abs=3 / CUTOFF)
    share = float(np.sum((1.5 * TERMS[term][inside]) ** 2) / np.sum(r**2))
    assert found.share == pytest.approx(share, abs=0.08)  # the edges are those of blocks of 0.05 s


def test_what_is_the_same_all_the_time_is_no_change() -> None:
    r = 0.1 * noise(3, 0) + 2.0 - 1.5 * ACCELERATION
    assert changes_in_time(r, EVERY, TERMS, TIME, CUTOFF).changes == ()


@pytest.mark.parametrize("pushed", [False, True])
@pytest.mark.parametrize("seed", slow_except([1, 2, 3], [1]))
def test_a_force_of_the_motion_with_memory_is_no_change_in_time(seed: int, pushed: bool) -> None:
    """Hysteresis of a cable chain: for the time of a move its force is constant, as that of a push would be."""
    rng, moves, at = np.random.default_rng(seed), list[float](), 0.0
    while len(moves) < COUNT:
        goal, steps = rng.uniform(-0.35, 0.35), int(rng.uniform(0.4, 2.0) / H)
        s = np.linspace(0, 1, steps)
        moves += [*(at + (goal - at) * (10 * s**3 - 15 * s**4 + 6 * s**5)), *[goal] * 60]
        at = goal
    x = np.array(moves[:COUNT])
    v, h = np.gradient(x, H), np.zeros(COUNT)
    for k in range(1, COUNT):
        d = x[k] - x[k - 1]
        h[k] = np.clip(h[k - 1] + (d - abs(d) * h[k - 1]) / 0.04, -1, 1)
    push = np.where(pushed & (TIME >= 12.0) & (TIME < 15.0), 20.0, 0.0)
    pull, sign, a = low_pass(-9 * h * (1 + 0.8 * x) - 3 * x + push, CUTOFF, H), np.sign(v), np.gradient(v, H)
    rows = np.abs(v) > 0.03
    along, load = splines(x, 40), low_pass(6 * a + 20 * v + 15 * sign, CUTOFF, H)
    over = (
        np.column_stack([splines(v, 14), sign]),
        np.column_stack([along, along * sign[:, None]]),
        splines(load, 14),
        splines(a, 14),
        splines(since_reversal(x, v), 14) * sign[:, None],
    )
    r = pull - np.mean(pull[rows] * sign[rows]) * sign + 0.05 * noise(seed, 0)
    terms = {"force": np.ones(COUNT), "friction level": sign, "viscous friction": v}
    found = changed_by(r, rows, TIME, CUTOFF, terms, dict(zip(STATE, over, strict=True)).__getitem__, 0.0)
    assert found.share > 0.5 if pushed else found.share < 0.25


@pytest.mark.parametrize("lost", [0.0, 0.5])
def test_noise_of_the_acceleration_is_no_lost_inertia(lost: float) -> None:
    """Where the machine hardly moves, the measured acceleration is noise, and the residual is minus that noise."""
    moving = np.where(TIME < 20.0, 1.0, 0.02)
    true, error = moving * ACCELERATION, 0.1 * noise(11, 2)
    measured = true + error
    r = -error - np.where(TIME < 8.0, lost * true, 0.0)
    terms = {**TERMS, "inertia": measured}
    assert len(changes_in_time(r, EVERY, terms, TIME, CUTOFF).changes) > bool(lost)
    found = changes_in_time(r, EVERY, terms, TIME, CUTOFF, {"inertia": 0.01}).changes
    if not lost:
        assert found == ()
    else:
        assert [one.term for one in found] == ["inertia"]
        assert abs(found[0].coefficient) == pytest.approx(lost, rel=0.1)
        assert min(abs(edge - 8.0) for edge in (found[0].start, found[0].stop)) < 0.1


@pytest.mark.parametrize(("length", "told"), [(0.5, True), (8.0, False)])
def test_half_of_the_squares_in_a_short_time_is_one_event(length: float, told: bool) -> None:
    """Of 30 s: a push of half a second, and one of eight; where it holds nearly all, its half is half as long."""
    inside = (TIME >= 12.0) & (12.0 + length > TIME)
    found = at_once(0.01 * noise(5, 0) + inside, EVERY)
    assert (found is not None) is told
    if found is not None:
        first, last = (TIME[k] for k in found)
        assert first >= 12.0 and last < 12.5 and last - first == pytest.approx(0.25, abs=0.02)
    assert at_once(noise(6, 0), EVERY) is None and at_once(np.zeros(COUNT), EVERY) is None


@pytest.mark.parametrize("push", [25.0, 0.0])
def test_a_push_in_held_out_data_is_told(push: float, tmp_path: Path) -> None:
    """Of a pendulum that was kicked in the last part of a log, an error of 517 % of the drive was printed alone."""
    log = log_of(stage(), tmp_path, "train.csv")
    inputs = log.inputs.copy()
    inputs[(log.time > 11.0) & (log.time < 11.4), 0] -= push
    with among("viscous"):
        diagnosis, _ = diagnose_log(stage(), system_of(stage()), replace(log, inputs=inputs))
    words = diagnosis.statement.of("log")
    assert len(words) == (push > 0) and all("from 11." in w and "A push, or another event" in w for w in words)


SPEC = parse_spec(STAGE.format(level=4.0, effects="[]", duration=1, reference="0", noise=0), Path("stage.yaml"))

PUSHED = {"push": lambda t: 8.0 if 9.0 < t < 10.5 else 0.0}
DROPPED = {"mass": lambda t: 2.0 if t < 9.0 else 1.4}
SWUNG = {"level": lambda t, v: 4.5 * (1 + 0.3 * np.sin(2 * np.pi * t / 16.0))}


ALL: tuple[str, ...] = ()
FEW = ("offset", "viscous", "coulomb_asymmetry", "spring", "input_gain", "inertia_error", "friction_drift")
CHANGES = [
    (PUSHED, "a force of +8", FEW),
    (PUSHED, "a force of +8", ALL),
    (DROPPED, "the inertia is smaller by 30 % of the declared one", ALL),
    (SWUNG, "changes in time", ALL),
    ({}, "", ALL),
]


@pytest.mark.parametrize(("change", "words", "kinds"), slow_except(CHANGES, CHANGES[:1], several=True))
def test_what_happens_once_is_unknown_and_told_over_time(
    change: dict, words: str, kinds: tuple[str, ...], tmp_path: Path
) -> None:
    with among(*kinds):
        diagnosis, _ = diagnose_log(SPEC, system_of(SPEC), simulated(tmp_path, SPEC, **change))
    (left,) = diagnosis.remainder
    assert diagnosis.verdict == ("unknown" if words else "none"), diagnosis.sentence
    assert diagnosis.effects == ()
    assert left.is_changing(diagnosis.material) == bool(words) and words in diagnosis.sentence
    if words:
        assert max(left.over, key=lambda name: left.over[name]) == "time" and left.nature(0.02) == "structured"
