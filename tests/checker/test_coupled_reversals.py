"""Reversals of one contact of several, in the compiled C: what they leave, and the bounds after them, are as claimed.

A linear program finds positions and velocities at the start, and a drive that is constant over some samples, for which
a contact of the proof's machine reverses at the largest change of slip that the claim allows while all others slide on.
Friction has the sign of the true slip at every moment. Noise and drift have the signs that make an error the largest
just after the reversal, and then at a later sample. The observer only watches: its C runs over the measured rows.
"""

from __future__ import annotations

import ctypes
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from codegen.checker import kernel
from tests.checker.test_kernel import numbers
from tests.checker.test_worst_runs import Attack, fractions, pointer

BEFORE = 150
"""Samples before the reversal."""
NEAR = 12
"""Samples about the reversal in which the slip changes by no more than the claim says."""
SLOWEST, FAR = 0.08, 40
"""A slip is to be this fast, m/s, which is more than its estimate is off: that of another contact, and of the one that
reverses so many samples before and after."""
DRIVEN, STRONGEST = 25, 1e4
"""Samples in which the drive is constant, and its largest magnitude, N."""
ALL, FEW = ((0.9, 0.3), (0.2, 0.8), (BEFORE + 1, BEFORE + 2)), ((0.9,), (0.2,), (BEFORE + 1, BEFORE + 2))
"""Shares of the largest change of slip, and of a sample before the slip is zero; samples of the largest error."""
CASES = [("two_mass", 0, ALL, 0.5), ("two_mass", 1, ALL, 0.5), ("chain", 0, FEW, 0.3), ("chain", 7, FEW, 0.3)]
"""Specs, contacts, and the share of the bound that a run reaches at least."""


class Coupled(Attack):
    """The C of a spec with several contacts, and its machine through a reversal of one of them."""

    def __init__(self, name: str, folder: Path, contact: int) -> None:
        super().__init__(name, folder)
        self.library.observe.restype = ctypes.c_long
        self.contact, self.entry = contact, self.claim["reversals"][contact]
        n, f, h = len(self.places), len(self.frictions), self.layout.h
        assert self.proof["step"] == "euler"
        by = self.acceleration
        self.free = np.block([[np.eye(n), h * np.eye(n)], [h * by[:, :n], np.eye(n) + h * by[:, n : 2 * n]]])
        self.pushed = np.vstack([np.zeros((n, f + 1)), h * by[:, 2 * n :]])
        self.drives = [x for x in self.inputs if x not in self.places]
        forces = [self.proof["acceleration"][v] for v in self.speeds]
        still = [numbers(text, self.quiet) for text in forces]
        driven = [[numbers(text, self.quiet | {w: 1.0}) for w in self.drives] for text in forces]
        self.driven = np.vstack([np.zeros((n, len(self.drives))), h * (np.array(driven) - np.array(still)[:, None])])
        self.levels = np.array([float(Fraction(self.claim["friction"][x])) for x in self.frictions])
        self.after = [line for line in self.lines if len(line.start) and line.row[n + contact]]
        assert all((line.start >= fractions(self.entry["after"])).all() for line in self.after)
        self.longest = max(line.since for line in self.after)

    def motion_through(self, sides: Any, share: float, late: float, disturbed: Any) -> Any:
        """(where a machine begins, its drive in every sample), or None if the linear program has no solution.

        Its contact passes zero ``late`` samples after BEFORE at a share of the change.
        """
        n, c, samples = len(self.places), self.contact, len(disturbed)
        after = sides.copy()
        after[c] = -after[c]
        pieces, drives = -(-samples // DRIVEN), len(self.drives)
        moved, still = np.eye(2 * n, 2 * n + pieces * drives), np.zeros(2 * n)
        slips, offsets = [], []
        for k in range(samples):
            slips.append(self.slip @ moved[n:])
            offsets.append(self.slip @ still[n:])
            force = np.append((sides if k < BEFORE else after) * self.levels, 1.0)
            moved, still = self.free @ moved, self.free @ still + self.pushed @ force + disturbed[k, n : 3 * n]
            first = 2 * n + k // DRIVEN * drives
            moved[:, first : first + drives] += self.driven
        slip, offset = np.array(slips), np.array(offsets)
        change = float(Fraction(self.entry["change"]))
        others = [j for j in range(len(sides)) if j != c]
        rows, most = [-sides[j] * slip[:, j] for j in others], [sides[j] * offset[:, j] - SLOWEST for j in others]
        own = np.where(np.arange(samples) < BEFORE, sides[c], -sides[c])
        away = np.abs(np.arange(samples) - BEFORE)
        apart = away > NEAR
        rows.append(-own[apart, None] * slip[apart, c])
        least = SLOWEST * np.clip((away - NEAR) / (FAR - NEAR), 0.01, 1.0)
        most.append((own * offset[:, c] - least)[apart])
        steps, bias = np.diff(slip[:, c], axis=0), np.diff(offset[:, c])
        near = slice(BEFORE - NEAR, BEFORE + NEAR)
        for way in (1.0, -1.0):
            rows.append(way * steps[near])
            most.append(0.9 * change - way * bias[near])
        equal = np.array([slip[BEFORE, c], steps[BEFORE - 1]])
        to = np.array(
            [sides[c] * late * share * change - offset[BEFORE, c], -sides[c] * share * change - bias[BEFORE - 1]]
        )
        limits = [(-300, 300)] * (2 * n) + [(-STRONGEST, STRONGEST)] * (pieces * drives)
        found = linprog(np.zeros(len(limits)), np.vstack(rows), np.concatenate(most), equal, to, limits)
        if not found.success:
            return None
        return found.x[: 2 * n], found.x[2 * n :].reshape(pieces, drives).repeat(DRIVEN, axis=0)[:samples]

    def worst_for(self, row: Any, sides: Any, samples: int) -> Any:
        """Disturbances of so many samples with the signs that make a row of the errors the largest at the last."""
        ones = dict(zip(self.proof["signs"], sides, strict=True))
        text = kernel.Text({s: kernel.term(int(x)) for s, x in ones.items()}, {})
        sizes = [(kind, x) for kind in ("noise", "drift", "friction") for x in self.claim.get(kind, {})]
        order = [("noise", x) for x in self.places]
        order += [("drift", x) for x in (*self.places, *self.speeds, *self.frictions)]
        push = np.array([[float(text.value(x).constant()) for x in line] for line in self.claim["push"]])
        matrix = np.array([[float(text.value(x).constant()) for x in line] for line in self.proof["matrix"]])
        columns = np.zeros((len(matrix), len(self.limits)))
        for k, of in enumerate(sizes):
            if of in order:
                columns[:, order.index(of)] = push[:, k]
        found = np.zeros((samples, len(self.limits)))
        for k in range(samples - 2, -1, -1):
            found[k] = np.sign(row @ columns) * self.limits
            row = row @ matrix
        return found

    def run(self, begun: Any, drive: Any, sides: Any, disturbed: Any) -> tuple[Any, Any, Any]:
        """Errors truth - estimate, each estimated slip times the sign of the true one, and that sign of the contact."""
        n, c = len(self.places), self.contact
        z, side, samples = begun.copy(), sides.copy(), len(disturbed)
        rows = np.zeros((samples, len(self.inputs)))
        rows[:, [self.inputs.index(x) for x in self.drives]] = drive
        truths, at = np.zeros((samples, self.layout.errors)), [self.inputs.index(x) for x in self.places]
        seen_sides = np.zeros((samples, len(sides)))
        for k in range(samples):
            noise, moves, pushes = (disturbed[k, i * n : (i + 1) * n] for i in range(3))
            rows[k, at] = z[:n] + noise
            truths[k], seen_sides[k] = np.concatenate([z[n:], self.levels]), side
            later = self.free @ z + self.pushed @ np.append(side * self.levels, 1.0)
            later += self.driven @ drive[k] + np.concatenate([moves, pushes])
            now, then = self.slip[c] @ z[n:], self.slip[c] @ later[n:]
            if side[c] * then < 0:  # the friction turns where the slip is zero
                left = then / (then - now)
                side[c] = -side[c]
                later += left * (self.pushed[:, c] * 2 * side[c] * self.levels[c])
                assert side[c] * (self.slip[c] @ later[n:]) >= 0
            z = later
        truth = dict(zip(self.estimates, truths[0], strict=True)) | dict(zip(self.places, begun[:n], strict=True))
        given = self.quiet | dict(zip(self.proof["signs"], sides, strict=True)) | truth
        states = np.array([numbers(text, given) for text in self.known])
        estimates = np.zeros_like(truths)
        assert not self.library.observe(ctypes.byref(self.layout), pointer(states), ctypes.c_long(samples),
                                        ctypes.c_long(len(self.inputs)), pointer(rows), pointer(estimates))  # fmt: skip
        return truths - estimates, seen_sides * (estimates[:, :n] @ self.slip.T), seen_sides[:, c]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "contact", "ways", "least"), CASES)
def test_a_reversal_among_several_contacts_leaves_no_more(
    name: str, contact: int, ways: Any, least: float, tmp_path: Path
) -> None:
    machine = Coupled(name, tmp_path, contact)
    n, entry, runs = len(machine.places), machine.entry, 0
    before, after = fractions(entry["before"]), fractions(entry["after"])
    length, turns = int(entry["samples"]), int(entry["turns"])
    long, short = BEFORE + NEAR + length + machine.longest + 5, BEFORE + NEAR + length + 5
    largest, level = 0.0, np.eye(machine.layout.errors)[n + contact]
    shares, lates, peaks = ways
    tried = [*product((1.0, -1.0), shares, lates, (1.0, -1.0), peaks)]
    for way, share, late, sign, peak in tried:
        found = None
        for total, past in product((long, short), (0, 1)):  # the longer where all can slide on for so long
            sides = np.where(np.arange(len(after) - n) < contact + past, 2 * past - 1, 1 - 2 * past) * way
            turned = sides.copy()
            turned[contact] = -way
            disturbed = np.vstack([machine.worst_for(sign * level, sides, peak),
                                   machine.worst_for(level, turned, total - peak)])  # fmt: skip
            found = machine.motion_through(sides, share, late, disturbed)
            if found is not None:
                break
        assert found is not None
        begun, drive = found
        errors, agree, sides_of = machine.run(begun, drive, sides, disturbed)
        assert (np.delete(agree, contact, axis=1) > 0).all()
        wrong = np.flatnonzero(agree[:, contact] <= 0)
        first = min(wrong.min() if len(wrong) else total, BEFORE) - 1
        last = first + length
        seen = np.diff(np.sign(agree[first : last + 1, contact] * sides_of[first : last + 1]))
        claimed = (agree[last:, contact] > 0).all() and np.count_nonzero(seen) <= turns
        claimed = claimed and (np.abs(errors[first]) <= before).all()
        reached = np.abs(errors[last]) / after
        assert not claimed or (reached <= 1).all(), (way, share, late, sign, peak)
        runs += claimed
        largest = max(largest, claimed * reached[n + contact])
        for line in machine.after if claimed else ():
            assert (np.abs(errors[last + line.since :] @ np.abs(line.row)) <= line.bound).all()
    assert runs == len(tried) and largest > least
