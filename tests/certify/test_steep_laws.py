"""Bounds with a friction law that is steep near standstill: they take its slope where they hold, and no run is above.

The motions are exact: constant acceleration within a sample, w = m a + F(v). The estimates come from the compiled C.
"""

from __future__ import annotations

import json
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.app.derived import Derived
from codegen.base.text import environment
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.bound.friction_bounds import _steepest
from codegen.checker import ellipsoid, theorem, verify
from codegen.friction import LAWS
from codegen.friction.law import ZeroMemoryLaw
from codegen.replay.engine import Engine
from codegen.replay.samples import Block
from codegen.replay.watch import Watch
from codegen.spec import parse_spec
from tests.friction.samples import draw, level

MASS, A, NOISE, H, TOP = 50.0, 0.5, 1e-5, 0.02, 0.5
LAW = {"F_c": 400.0, "F_s": 600.0, "v_s": 0.05, "F_v": 100.0}
TEXT = """
name: press
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 50, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts: [{name: rod, law: gaussian, F_c: 400, F_s: 600, v_s: 0.05, F_v: 100, unit: N}]
observer: {kind: gcfo, velocity: estimated, gains: {K_F: 900, K_v: 20}, sample_time: 0.02}
envelope: {v: [-0.5, 0.5], v_dot: [-0.5, 0.5], x_noise: [-1e-5, 1e-5]}
"""
TRACKER = TEXT.replace("kind: gcfo", "kind: to").replace("K_F: 900", "K_1: 0, K_2: -900")
SAMPLES, SETTLE = 150, 120  # the slowest error decays by e in 8 samples


@cache
def derived(text: str = TEXT) -> Any:
    return Derived(parse_spec(text, Path("press.yaml")))


def stated(text: str = TEXT) -> ErrorBound:
    (bound,) = derived(text).outcome.bounds
    assert bound.proved
    return bound


def friction(v: Any) -> Any:
    return LAW["F_c"] + (LAW["F_s"] - LAW["F_c"]) * np.exp(-((v / LAW["v_s"]) ** 2)) + LAW["F_v"] * v


class Runs:
    """The compiled C beside the machine."""

    def __init__(self, text: str) -> None:
        found, self.bound = derived(text), stated(text)
        self.engine = Engine(found.program, found.sources)
        names = [name for name, _, _ in found.program.outputs]
        self.places = [names.index("v_hat"), names.index("F_hat_on_x")]

    def errors(self, last: float, a: Any, noise: Any) -> Any:
        """(N, 2) errors of velocity and friction, of a motion with these accelerations that ends at a velocity."""
        v = last - H * np.concatenate([np.cumsum(a[-2::-1])[::-1], [0.0]])
        x = np.concatenate([[0.0], np.cumsum(H * v + H * H * a / 2)[:-1]])
        force = np.sign(last) * friction(np.abs(v))
        rows = np.column_stack([x + noise, MASS * a + force])
        self.engine.start(rows[0])
        self.v = v
        return np.column_stack([v, force]) - self.engine.run(rows)[0][:, self.places]

    def noise(self, of: int) -> Any:
        """The worst noise for an error of the last sample: signs of the C's response, reversed in time."""
        still = np.zeros(SAMPLES)
        pulse = self.errors(0.3, still, 1e-6 * (np.arange(SAMPLES) == SETTLE)) - self.errors(0.3, still, still)
        response = pulse[SETTLE:, of]
        return NOISE * np.concatenate([np.zeros(SETTLE), np.sign(response[::-1])])


def test_the_bound_is_for_slip_above_its_threshold_and_a_tenth_of_that_for_all_speeds() -> None:
    """With the slope over all speeds 1.41 (F_s - F_c) exp(-1/2)/v_s - F_v = 3330 N s/m: 245.6 N above 0.219 m/s."""
    bound, anywhere = stated(), stated(TEXT.replace("v: [-0.5, 0.5], ", ""))
    assert bound.steady < 0.1 * anywhere.steady
    (speed,), (other,) = bound.slip_speeds, anywhere.slip_speeds
    assert other.above == 0 and other.threshold == other.error
    assert speed.error < float(speed.above) == speed.threshold <= other.threshold
    module = environment().get_template("text/_slip_speeds.j2").module
    said = module.steep(bound.slip_speeds)
    assert said.startswith("for rod only the slope of the law above its threshold is counted")
    assert not module.steep(anywhere.slip_speeds)


@pytest.mark.parametrize("text", [TEXT, TRACKER], ids=["gcfo", "to"])
def test_no_run_above_the_threshold_exceeds_the_bound_and_one_below_does(text: str) -> None:
    """10^5 samples: the last is at or near the threshold, reached at the largest acceleration or by turns, in both
    directions, with noise along the C's own response; and a machine that slows down to standstill."""
    runs, dice, worst = Runs(text), np.random.default_rng(1), np.zeros(2)
    (speed,) = runs.bound.slip_speeds
    least, limits = float(speed.above), np.array([speed.error, runs.bound.steady])
    for k in range(700):
        of, side, up, count = k % 2, *dice.choice([-1.0, 1.0], 2), int(dice.integers(1, 31))
        a = np.zeros(SAMPLES)
        kind = A * np.array([np.ones(count), dice.choice([-1.0, 1.0], count), -np.ones(count)][k % 3])
        a[-1 - count : -1] = kind if k % 5 else -A * np.sign(np.sin(np.arange(count) * np.pi / 7))
        v = np.concatenate([np.cumsum(a[-2::-1])[::-1], [0.0]]) * H
        last = least + max(v.max(), 0.0) + dice.choice([0.0, dice.exponential(0.02)])
        worst = np.maximum(
            worst, np.abs(runs.errors(side * last, side * a, up * runs.noise(of)))[SETTLE:].max(0) / limits
        )
        assert least - 1e-12 <= np.abs(runs.v).min() and (np.abs(runs.v) <= 1.01 * TOP).all()
    assert worst.max() <= 1 and worst[1] > 0.6, worst
    a = np.concatenate([np.zeros(SAMPLES - 20), np.full(20, -A)])
    assert np.abs(runs.errors(0.01, a, 0 * a))[-1, 1] > 2 * runs.bound.steady


class Steady:
    """In place of an engine: a constant estimate of the velocity."""

    def __init__(self, names: list[str], v: float) -> None:
        self.row = np.array([v if name == "v_hat" else 400.0 for name in names])

    def take(self, block: Block) -> tuple[np.ndarray, np.ndarray]:
        return np.tile(self.row, (len(block.time), 1)), np.zeros(len(block.time), dtype=np.intc)


def test_watch_says_the_speed_of_the_estimate_above_which_it_compares() -> None:
    """The slip is above the threshold where its estimate is above the threshold and the error of the slip together."""
    found, (speed,) = derived(), stated().slip_speeds
    names = [name for name, _, _ in found.program.outputs]

    def watched(v: float) -> Watch:
        done = Watch(found.spec, found.observer, found.program, found.outcome.bounds, Steady(names, v), H, 10)
        rows = np.zeros((2 * done.settle, len(found.program.inputs)))
        done.take(Block(np.arange(len(rows)) * H, rows, True))
        return done

    least = speed.threshold + speed.error
    assert watched(1.001 * least).tally.judged > 0 and watched(0.999 * least).tally.judged == 0
    assert f"rod no faster than {least:.3g} m/s in" in (watched(0.999 * least).uncompared() or "")


LAWS_OF_SPEED = [name for name, law in LAWS.items() if isinstance(law, ZeroMemoryLaw) and name != "canudas"]


@pytest.mark.parametrize("name", LAWS_OF_SPEED)
@pytest.mark.parametrize("seed", range(3))
def test_the_slope_of_a_law_between_two_speeds(name: str, seed: int) -> None:
    """Against secants of the level on a fine grid: none is steeper, and the steepest is near."""
    p, law = {k: round(v, 4) for k, v in draw(name, seed).items()}, LAWS[name]
    assert isinstance(law, ZeroMemoryLaw)
    low, high = Fraction(1, 10), Fraction(2)
    found = _steepest(law, tuple((k, sympy.Rational(str(v))) for k, v in p.items()), low, high)
    if found is None:
        assert name == "bo_pavelescu"  # its exponent
        return
    speeds = np.linspace(0.1, 2, 40_001)
    steepest = np.abs(np.diff(level(name, p)(speeds)) / np.diff(speeds)).max()
    assert steepest <= float(found) * (1 + 1e-9) + 1e-9 and float(found) <= 1.05 * steepest + 1e-6


FORGED = {
    "a speed below the error of the slip": ({"true.v": "18/1000"}, "`above` is below the slip's error"),
    "a sum with a level": ({"true.v + true.a_rod": "1"}, "`above` of what is no slip"),
    "a number": ({"2": "1"}, "`above` of what is no slip"),
    "nothing": ({"0*true.v": "1"}, "`above` of what is no slip"),
    "twice the slip": ({"2*true.v": "1"}, "`above` is below the slip's error"),
    "an estimate": ({"outputs.v_hat": "1"}, ""),
    "no number": ({"true.v": "true.v"}, ""),
}


@pytest.mark.parametrize("case", FORGED)
def test_a_forged_speed_is_refused(case: str) -> None:
    found = derived().outcome
    proof, claim = json.loads(found.kernel), json.loads(found.ellipsoid)
    assert [*claim[ellipsoid.ABOVE]] == ["true.v"]
    sources = {name: text.encode() for name, text in derived().sources.items()}
    shown = theorem.proved(proof, sources)
    theorem.ellipsoid_claim(proof, shown, json.dumps(claim).encode())
    claim[ellipsoid.ABOVE], words = FORGED[case]
    with pytest.raises(verify.Refused) as refused:
        theorem.ellipsoid_claim(proof, shown, json.dumps(claim).encode())
    assert words in str(refused.value)
