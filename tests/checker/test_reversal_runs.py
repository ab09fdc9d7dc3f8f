"""Reversals of the compiled C at the worst moments: what they leave, and the bounds after them, are as claimed.

ellipsoid.json says what a reversal of a CFO leaves of errors that are within their long-run bounds, if it takes at most
so many samples and the estimated slip changes its sign once. Here the machine is driven through zero slip, beside the
C, while noise and drift have the signs that make an error the largest there. A tracker's errors after a reversal are
those of any friction.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.spec import read_spec
from tests.checker.test_kernel import numbers, spec_path
from tests.checker.test_worst_runs import DOUBLES, LONGS, Attack, Stated, fractions, pointer

ONE_CONTACT = ("belt_axis", "emps", "one_mass", "one_mass_cfo_semi_implicit", "rig", "rig_to")

LEFT = {
    "belt_axis": (0.739, 0.816),
    "emps": (0.78, 0.784),
    "one_mass": (0.792, 0.892),
    "one_mass_cfo_semi_implicit": (0.779, 0.888),
    "rig": (0.689, 0.715),
    "rig_to": (0.883, 0.997),
}
"""Largest errors of velocity and friction at the first sample after a reversal, over what is claimed."""
HARD = (0.75, 1.5, 1.75, 2.0, 2.25, 2.75, 2.9)
"""Samples between zero slip at the hardest braking and the moment of the largest error: the worst ones."""
BRAKING = ((1, 1), (1, 1 / 4), (1 / 2, 1 / 2), (1 / 4, 1 / 4), (1 / 4, 1 / 50), (1 / 20, 1 / 20), (1 / 20, 1 / 200))
"""Accelerations before and after zero slip, over the largest of the envelope."""


class Layout(ctypes.Structure):
    """``reversal`` of reversal.c."""

    _fields_ = (
        ("drive", ctypes.c_long),
        ("per_drive", ctypes.c_double),
        ("signed_level", ctypes.c_long),
        ("side", ctypes.c_double),
        *((name, ctypes.c_long) for name in ("braked", "ended")),
        *((name, ctypes.c_double) for name in ("braking", "speeding", "fastest")),
        ("exact", ctypes.c_long),
    )


class Claimed(ctypes.Structure):
    """``claimed`` of reversal.c."""

    _fields_ = (
        *((name, DOUBLES) for name in ("before", "after")),
        *((name, ctypes.c_long) for name in ("samples", "turns", "bounds")),
        ("since", LONGS),
        ("bound", DOUBLES),
    )


@dataclass
class Found:
    """What runs of one kind of reversal show: the largest figures, as ``reversals`` of reversal.c says."""

    claimed: Any
    settled: Any
    bound: float
    any_bound: float
    samples: int
    turns: int
    runs: int
    within: int


class Reversals(Attack):
    """The compiled C of a spec with one contact, and its machine with a drive."""

    def __init__(self, name: str, folder: Path) -> None:
        super().__init__(name, folder)
        envelope = read_spec(spec_path(name)).envelope
        velocity = self.speeds[0].removeprefix("true.")
        self.fastest, self.most = (float(max(envelope[x])) for x in (velocity, f"{velocity}_dot"))
        force = self.proof["acceleration"][self.speeds[0]]
        self.drive = next(i for i, x in enumerate(self.inputs) if x in force and x not in self.places)
        drive = self.inputs[self.drive]
        self.per_drive = numbers(force, self.quiet | {drive: 1.0}) - numbers(force, self.quiet)
        self.level = float(Fraction(self.claim["friction"][self.frictions[0]]))
        starts = [line for line in self.lines if len(line.start) and not line.any_friction]
        left, before, limits = starts[0].start, ["1e300"] * 2, (0, 0)
        for turn in self.claim.get("reversals", []):
            left, before, limits = fractions(turn["after"]), turn["before"], (int(turn["samples"]), int(turn["turns"]))
            assert float(Fraction(turn["change"])) == pytest.approx(self.layout.h * self.most)
        self.after = [line for line in starts if (line.start == left).all()]
        self.left, self.before = left, np.array([float(Fraction(x)) for x in before])
        self.since = np.array([line.since for line in self.after], dtype=ctypes.c_long)
        self.bound = np.array([line.bound for line in self.after])
        self.claimed = Claimed(
            *(x.ctypes.data_as(DOUBLES) for x in (self.before, self.left)),
            *(*limits, len(self.after)),
            self.since.ctypes.data_as(LONGS),
            self.bound.ctypes.data_as(DOUBLES),
        )
        self.pulses = self.responses()

    def begun_to(self, side: float, speed: float) -> Any:
        """A machine that slides to a side, and an observer without an error."""
        force = self.level if self.proof["signs"] else side * self.level
        truth = dict(zip(self.estimates, (side * speed, force), strict=True))
        at = self.quiet | dict.fromkeys(self.proof["signs"], side) | truth
        return np.array([0.0, side * speed, self.level, *(numbers(text, at) for text in self.known)])

    def toward(self, row: Any, samples: int, side: float) -> Any:
        """Disturbances of so many samples that make the row of errors the largest at the last."""
        line = Stated(np.array(row) * (1.0, side if self.proof["signs"] else 1.0), 1.0, 0, (), any_friction=False)
        return self.worst(self.pulses, line)[1][-samples:]

    def run(
        self,
        side: float,
        row: Any,
        late: float,
        braking: float,
        speeding: float,
        runs: int,
        dice: int,
        exact: bool = False,
    ) -> Found:
        """The errors are worst ``late`` samples after the slip passes zero."""
        speed, h = self.fastest, self.layout.h
        brake = speed / (braking * h)
        turn = max(self.samples // 2, int(brake)) + 10
        longest = max(line.since for line in self.after)
        slow = min(int(4 * self.left[0] / (speeding * h)), 4 * longest)
        kind = Layout(self.drive, self.per_drive, bool(self.proof["signs"]), side, turn - int(brake), 0,
                      braking, speeding, speed, exact)  # fmt: skip
        kind.ended = turn + slow + longest + 50
        worst = np.zeros((kind.ended, len(self.limits)))
        peak = turn + round(late)
        before = self.toward(row, min(peak, self.samples), side)
        worst[peak - len(before) : peak] = before
        answer = self.toward((0.0, 1.0), self.samples, -side)
        left = kind.ended - peak
        worst[peak:] = answer[-left:] if left <= len(answer) else np.resize(answer, (left, len(self.limits)))
        found = np.zeros(8)
        scratch, errors = np.zeros_like(worst), np.zeros((kind.ended, 2))
        seen = (ctypes.c_int * kind.ended)()
        within = self.library.reversals(
            ctypes.byref(self.layout), ctypes.byref(kind), ctypes.byref(self.claimed),
            pointer(self.begun_to(side, speed + late % 1 * braking * h)), pointer(worst), ctypes.c_long(runs),
            ctypes.c_uint64(2 * dice + 1), pointer(scratch), pointer(errors), seen, pointer(found),
        )  # fmt: skip
        return Found(found[:2], found[2:4], found[4], found[5], int(found[6]), int(found[7]), runs, within)


def reversed_at_the_worst(name: str, folder: Path, hard: Sequence[float], others: Sequence[float], runs: int) -> int:
    """So many runs of each moment, direction and error, for each pair of accelerations; and the position exact.

    Returns how many of them were as the claim says.
    """
    machine = Reversals(name, folder)
    left, within = np.zeros(2), 0
    for braking, speeding in BRAKING:
        accelerations = machine.most * braking, machine.most * speeding
        moments = hard if braking == speeding == 1 else others
        cases = product((1.0, -1.0), ((1.0, 0.0), (0.0, 1.0)), (1.0, -1.0), moments)
        for dice, (side, row, sign, late) in enumerate(cases):
            found = machine.run(side, sign * np.array(row), late, *accelerations, runs, dice)
            of = (name, braking, speeding, side, row, sign, late)
            assert (found.claimed <= 1).all() and found.bound <= 1, of
            assert (found.settled <= 1).all() and found.any_bound <= 1, of  # of all runs; no claim says so
            left, within = np.maximum(left, found.settled), within + found.within
            if braking == speeding == 1:
                assert found.within == runs, of  # as the claim says
                found = machine.run(side, sign * np.array(row), late, *accelerations, 1, 0, exact=True)
                assert (found.claimed <= 1).all() and found.bound <= 1 and found.within == 1, of
    assert (left > 0.97 * np.array(LEFT[name])).all(), left
    if runs == 1:  # else runs near these too, some of which leave more
        assert (left < 1.03 * np.array(LEFT[name])).all(), left
    return within


@pytest.mark.parametrize("name", ONE_CONTACT)
def test_what_a_reversal_leaves_and_the_bounds_after_it(name: str, tmp_path: Path) -> None:
    assert reversed_at_the_worst(name, tmp_path, HARD, (-1.5,), 1) > 60


@pytest.mark.slow
@pytest.mark.parametrize("name", ONE_CONTACT)
def test_many_reversals_at_the_worst_moments(name: str, tmp_path: Path) -> None:
    moments = [float(x) for x in np.arange(-12, 13) / 4]
    assert reversed_at_the_worst(name, tmp_path, (*HARD, *moments), moments[::2], 240) > 50_000
