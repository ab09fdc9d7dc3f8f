"""Runs of the compiled C about the worst ones, of every shipped spec with a bound: none is above it.

Each disturbance has the signs of the C's own impulse response, reversed in time, and its largest size. Of a bound that
holds after a reversal, the run begins with what the worst reversal leaves: each error as large as is assumed, with the
sign to which the C answers most. The others begin without an error. Other runs are near these: they end early, or some
signs are turned. The samples of the reversal itself are left out, as the claims leave them out.
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
from scipy.optimize import linprog

from codegen.app.derived import Derived
from codegen.spec import read_spec
from tests.checker.test_ellipsoid import BOUNDED, bounds, content, ellipsoid
from tests.checker.test_kernel import GENERATED, numbers, seen, spec_path
from tests.compiled.toolchain import compiled
from tests.slow_cases import slow_except
from tests.twin import load_twin

DOUBLES = ctypes.POINTER(ctypes.c_double)
LONGS = ctypes.POINTER(ctypes.c_long)


class Layout(ctypes.Structure):
    """``machine`` of attack.c."""

    _fields_ = (
        *((name, ctypes.c_long) for name in ("positions", "frictions", "states", "errors", "semi_implicit")),
        *((name, LONGS) for name in ("input_of", "estimate_of")),
        *((name, DOUBLES) for name in ("acceleration", "slip")),
        ("h", ctypes.c_double),
    )


@dataclass(frozen=True)
class Stated:
    """|row e| ≤ bound from sample ``since`` on; ``start``: of each error, empty where it holds in the long run."""

    row: Any
    bound: float
    since: int
    start: Any
    any_friction: bool


def fractions(values: Any) -> Any:
    return np.array([float(Fraction(x)) for x in values])


def stated(name: str) -> list[Stated]:
    """What is proved of the spec's C, the noise of the sample itself included."""
    found, claim = [], content(name, "ellipsoid.json")
    for ball, proved in zip(claim["sets"], bounds(name, claim), strict=True):
        for ((*row, _), since, start, _), bound in zip(ellipsoid.claimed_rows(ball), proved, strict=True):
            each = fractions(start or [])
            found.append(Stated(fractions(row), float(bound), int(since) if start else 0, each, "friction" in ball))
    return found


class Attack:
    """The compiled C of a shipped spec and the machine of its proof, which slides in one direction."""

    def __init__(self, name: str, folder: Path) -> None:
        self.proof, self.claim, self.lines = content(name, "proof.json"), content(name, "ellipsoid.json"), stated(name)
        # Without the last bounds after a reversal: springs let no machine slide one way for as long.
        *since, last = sorted({line.since for line in self.lines})
        assert len(since) == 6
        self.lines = [line for line in self.lines if line.since < last]
        self.samples = since[-1] + 1
        given = {"HEADER": f'"{name}.h"', "STEP": f"{name}_step", "PARAMETERS": f"{name.upper()}_PARAMETERS"}
        given |= {part.upper(): f"{name}_{part}" for part in ("state", "inputs", "outputs")}
        given |= {"PARAMETERS_TYPE": f"{name}_parameters"}
        for file in (f"{name}.c", f"{name}.h"):
            (folder / file).write_bytes((GENERATED / name / file).read_bytes())
        for file in ("attack.c", "reversal.c"):
            (folder / file).write_bytes(Path(__file__).with_name(file).read_bytes())
        includes = "".join(f'#include "{file}"\n' for file in (f"{name}.c", "attack.c", "reversal.c"))
        (folder / "all.c").write_text(includes, encoding="utf-8")
        flags = ["-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fno-strict-aliasing"]
        library = folder / f"{name}.so"
        library.write_bytes(compiled(["gcc", *flags, *(f"-D{k}={v}" for k, v in given.items())], folder, "all.c"))
        self.library = ctypes.CDLL(str(library))
        for function in (self.library.follow, self.library.attack, self.library.reversals):
            function.restype = ctypes.c_long
        machine = Derived(read_spec(spec_path(name)))
        program, twin = machine.program, load_twin(machine.sources["__init__.py"], name)
        self.at = seen(twin.Parameters(), "parameters")
        inputs = [f"inputs.{program.reference(f.name)}" for f in program.inputs]
        outputs = [f"outputs.{program.reference(n)}" for n, _, _ in program.outputs]
        self.states = [f"state.{program.reference(f.name)}" for f in program.states]
        self._place(inputs, outputs)

    def _place(self, inputs: list[str], outputs: list[str]) -> None:
        """The machine's matrices, by differences of what the proof states: all of it is affine."""
        proof, self.places = self.proof, list(self.proof["positions"])
        self.speeds = list(proof["positions"].values())
        frictions = [e for e in proof["errors"] if e["truth"] not in self.speeds]
        self.frictions = [e["truth"] for e in frictions]
        assert [e["truth"] for e in proof["errors"]] == [*self.speeds, *self.frictions]
        self.estimates = [e["estimate"] for e in proof["errors"]]
        zero = dict.fromkeys([*inputs, *self.speeds, *self.frictions, *outputs], 0.0) | self.at
        zero |= dict.fromkeys(proof["signs"], 1.0)

        def slopes(texts: list[str], of: list[str]) -> Any:
            found = [[numbers(t, zero | {x: 1.0}) - numbers(t, zero) for x in of] for t in texts]
            return np.ascontiguousarray(np.array(found, dtype=float).reshape(len(texts), len(of)))

        moved = [*self.places, *self.speeds, *self.frictions]
        forces = [proof["acceleration"][v] for v in self.speeds]
        constant = np.array([[numbers(t, zero)] for t in forces])
        self.acceleration = np.ascontiguousarray(np.hstack([slopes(forces, moved), constant]))
        n, f = len(self.places), len(self.frictions)
        self.slip = np.zeros((f, n))
        for j, e in enumerate(frictions):
            if e["sign"]:
                self.slip[j] = slopes([proof["signs"][e["sign"]]], self.estimates[:n])[0]
        self.known = known = [
            proof["states"].get(s, self.places[0]) for s in self.states
        ]  # else the predicted position
        self.inputs, self.quiet = inputs, dict(zero)
        self.kept = [
            np.array(places, dtype=ctypes.c_long)
            for places in (
                [inputs.index(x) for x in self.places],
                [outputs.index(x) for x in self.estimates],
            )
        ]
        self.layout = Layout(
            *(n, f, len(self.states), n + f, int(proof["step"] == "semi_implicit")),
            *(x.ctypes.data_as(LONGS) for x in self.kept),
            *(x.ctypes.data_as(DOUBLES) for x in (self.acceleration, self.slip)),
            self.at["parameters.sample_time"],
        )
        self.limits = np.zeros(3 * n + 2 * f)
        order = [("noise", x) for x in self.places] + [("drift", x) for x in moved]
        order += [("friction", x) for x in self.frictions]
        for k, (kind, of) in enumerate(order):
            self.limits[k] = float(Fraction(self.claim.get(kind, {}).get(of, "0")))
        assert sum(len(self.claim.get(kind, {})) for kind in ("noise", "drift", "friction")) == (self.limits > 0).sum()
        turns = [1.0, -1.0] if n > 1 else [1.0]
        for sides in product(turns, repeat=len(proof["signs"])):
            self.motion, slowest = self._sliding(sides)
            if slowest > 1:
                break
        assert slowest > 1
        zero |= dict(zip(proof["signs"], sides, strict=True))
        signed = zero | {"": 1.0}
        self.sides = np.array([signed[e["sign"]] for e in proof["errors"]])
        self.begin = slopes(known, [*self.places, *self.estimates])
        self.begin_at = np.array([numbers(t, zero) for t in known])

    def _sliding(self, sides: Sequence[float]) -> tuple[Any, float]:
        """Positions and velocities, none above 300, from which the contacts slide to these sides, without friction and
        without a drive; and the slowest slip of all samples."""
        n, h = len(self.places), self.layout.h
        drift = np.block([[np.eye(n), h * np.eye(n)], [h * self.acceleration[:, :n], np.eye(n)]])
        drift[n:, n:] += h * self.acceleration[:, n : 2 * n]
        if self.proof["step"] == "semi_implicit":
            drift[:n] = np.hstack([np.eye(n), np.zeros((n, n))]) + h * drift[n:]
        slips, rows = self.slip[np.abs(self.slip).sum(axis=1) > 0], []
        if not len(slips):
            return np.zeros(2 * n), np.inf
        power = np.eye(2 * n)
        for _ in range(self.samples):
            rows.append(np.array(sides)[:, None] * (slips @ power[n:]))
            power = drift @ power
        over = np.vstack(rows)
        found = linprog(
            [*np.zeros(2 * n), -1.0],
            A_ub=np.hstack([-over, np.ones((len(over), 1))]),
            b_ub=np.zeros(len(over)),
            bounds=[(-300, 300)] * (2 * n) + [(0, None)],
        )
        assert found.success
        return found.x[: 2 * n], float(found.x[-1])

    def true_slips(self, begun: Any, disturbed: Any, sides: Any) -> Any:
        """The slips of a run (samples, contacts), while no true slip reverses; as attack.c moves the machine."""
        n, f, h = len(self.places), len(self.frictions), self.layout.h
        x, v, force = np.split(begun[: 2 * n + f].copy(), [n, 2 * n])
        found = np.zeros((len(disturbed), f))
        for k, of in enumerate(disturbed):
            _, move, push, change, alone = np.split(of, [n, 2 * n, 3 * n, 3 * n + f])
            found[k] = self.slip @ v
            later = v + h * self.acceleration @ np.concatenate([x, v, sides * (force + alone), [1.0]]) + push
            x, v, force = x + h * (later if self.layout.semi_implicit else v) + move, later, force + change
        return found

    def slowing_to(self, least: Any, contact: int, forced: Any) -> Any:
        """Positions and velocities from which each slip, towards its side, is never below ``least``, and the contact's
        is as slow as it can be at the last sample.

        Args:
            forced: slips (samples, contacts) by the disturbances alone.
        """
        n, samples = len(self.places), len(forced)
        unit = np.eye(2 * n, 2 * n + len(self.frictions))
        still = np.zeros((samples, len(self.limits)))
        constant = self.acceleration[:, -1].copy()
        self.acceleration[:, -1] = 0.0
        moved = np.stack([self.true_slips(begun, still, np.zeros(len(least))) for begun in unit], axis=2)
        self.acceleration[:, -1] = constant
        sides = self.sides[n:]
        over = sides[None, :, None] * moved
        room = sides * forced - least
        found = linprog(
            over[-1, contact],
            A_ub=-over.reshape(-1, 2 * n),
            b_ub=room.reshape(-1),
            bounds=[(-300, 300)] * (2 * n),
        )
        assert found.success
        return found.x

    def begun(self, start: Any) -> Any:
        """Where a run begins, with these errors sign (truth − estimate) and every sign 1."""
        n = len(self.places)
        level = 50.0 if self.proof["domain"] else 0.0
        truth = np.concatenate([self.motion[n:], np.full(len(self.frictions), level)])
        estimate = truth - (self.sides * start if len(start) else 0.0)
        state = self.begin_at + self.begin @ np.concatenate([self.motion[:n], estimate])
        return np.concatenate([self.motion, truth[n:], state])

    def follow(self, start: Any, disturbed: Any, samples: int) -> Any:
        errors, lost = self.followed(start, disturbed, samples)
        assert lost == 0
        return errors

    def followed(self, start: Any, disturbed: Any, samples: int) -> tuple[Any, int]:
        """The errors, and the number of samples with a fault or with a slip whose estimate has another sign."""
        errors = np.zeros((samples, self.layout.errors))
        begun = self.begun(start)
        lost = self.library.follow(ctypes.byref(self.layout), pointer(begun), ctypes.c_long(samples),
                                   pointer(disturbed), pointer(errors))  # fmt: skip
        return errors, lost

    def responses(self) -> Any:
        """Errors (disturbances, samples, errors) after a pulse of each disturbance, of its largest size."""
        quiet = self.follow([], np.zeros((self.samples, len(self.limits))), self.samples)
        found = np.zeros((len(self.limits), *quiet.shape))
        for d, size in enumerate(self.limits):
            pulse = np.zeros((self.samples, len(self.limits)))
            pulse[0, d] = size
            found[d] = self.follow([], pulse, self.samples) - quiet
        return found

    def worst(self, responses: Any, line: Stated) -> tuple[Any, Any, int]:
        """The worst start and disturbances for the last sample of a run."""
        n, f = len(self.places), len(self.frictions)
        samples = line.since + 1 if len(line.start) else self.samples
        signs = np.sign(np.einsum("dke,e->kd", responses, line.row)[:samples][::-1])
        limits = self.limits.copy()
        limits[3 * n : 3 * n + f] *= not line.any_friction or not limits[3 * n + f :].any()
        limits[3 * n + f :] *= line.any_friction
        start = line.start
        if len(start):
            none, each = np.zeros((samples, len(limits))), np.diag(start)
            quiet = self.follow([], none, samples)
            start = start * np.array([np.sign((self.follow(e, none, samples) - quiet)[-1] @ line.row) for e in each])
            start = (
                start - np.where(limits > 0, signs[0], 0.0) @ responses[:, 0]
            )  # what is assumed is an error that is seen, with the noise in it
        return start, np.ascontiguousarray(signs * limits), samples

    def attack(self, line: Stated, worst: tuple[Any, Any, int], runs: int, seed: int) -> float:
        """The largest error of these runs over its bound."""
        start, disturbed, samples = worst
        found, dice = ctypes.c_double(0.0), ctypes.c_uint64(2 * seed + 1)
        begun, turned = self.begun(start), self.begun(-start if len(start) else start)
        scratch, errors = np.zeros_like(disturbed), np.zeros((samples, self.layout.errors))
        lost = self.library.attack(
            ctypes.byref(self.layout), pointer(begun), pointer(turned), ctypes.c_long(samples), pointer(disturbed),
            pointer(np.ascontiguousarray(line.row)), ctypes.c_long(line.since), ctypes.c_double(line.bound),
            ctypes.c_long(runs), dice, pointer(scratch), pointer(errors), ctypes.byref(found),
        )  # fmt: skip
        assert lost == 0
        return found.value


def pointer(values: Any) -> Any:
    assert values.dtype == np.float64 and values.flags.c_contiguous
    return values.ctypes.data_as(DOUBLES)


def attacked(name: str, folder: Path, runs: int) -> None:
    """So many runs of a spec, shared by its bounds; the first two of a bound are its worst, to either side."""
    attack = Attack(name, folder)
    responses = attack.responses()
    # in a domain an error as large as after a reversal is outside it, where the code claims nothing
    lines = [line for line in attack.lines if not (attack.proof["domain"] and len(line.start))]
    for seed, line in enumerate(lines):
        reached = attack.attack(line, attack.worst(responses, line), -(-runs // len(lines)), seed)
        least = 0.5 if len(line.start) else 0.985
        assert least < reached <= 1, (name, line, reached)


SIGNED = [name for name in BOUNDED if content(name, "proof.json")["signs"] and name != "one_mass_domain"]
"""Specs whose code has signs of slips. In a domain a slip near its bound is outside it, where nothing is claimed."""


@pytest.mark.parametrize("name", slow_except(SIGNED, ["one_mass", "two_mass"]))
def test_the_sign_of_a_slip_is_right_above_its_threshold_and_can_be_wrong_below(name: str, tmp_path: Path) -> None:
    """Under the worst noise and drift for a slip's estimate, that slip as slow as 1.0001 or 0.97 of its threshold.

    Earlier it is at least as fast. The worst drift of emps drives the slip itself, so that it is faster at the end.
    """
    attack = Attack(name, tmp_path)
    responses, n = attack.responses(), len(attack.places)
    bounds_ = Derived(read_spec(spec_path(name))).outcome.bounds
    thresholds = np.array([slip.threshold for slip in bounds_[0].slip_speeds])
    for contact, side in enumerate(attack.sides[n:]):
        row = np.concatenate([attack.slip[contact], np.zeros(len(attack.frictions))])
        (line,) = (x for x in attack.lines if not len(x.start) and not x.any_friction and (x.row == row).all())
        _, disturbed, samples = attack.worst(responses, line)
        disturbed *= side  # towards a slip whose estimate is too small
        rest = np.concatenate([np.zeros(2 * n), attack.begun([])[2 * n :]])
        forced = attack.true_slips(rest, disturbed, attack.sides[n:])
        for share, wrong in ((1.0001, False), (0.97, True)):
            least = thresholds * np.where(np.arange(len(thresholds)) == contact, share, 1.0001)
            attack.motion = attack.slowing_to(least, contact, forced)
            slips = attack.sides[n:] * attack.true_slips(attack.begun([]), disturbed, attack.sides[n:])
            assert (slips > (1 - 1e-6) * least).all()
            slow = slips[-1, contact] < (1 + 1e-6) * least[contact]
            assert slow == (name != "emps")
            assert (attack.followed([], disturbed, samples)[1] > 0) == (wrong and slow), (name, contact, share)


@pytest.mark.parametrize("name", slow_except([*BOUNDED, "chain"], BOUNDED))
def test_no_run_about_the_worst_is_above_its_bound(name: str, tmp_path: Path) -> None:
    attacked(name, tmp_path, 500)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*BOUNDED, "chain"])
def test_a_million_runs_about_the_worst(name: str, tmp_path: Path) -> None:
    attacked(name, tmp_path, 1_000_000 // (len(BOUNDED) + 1) + 1)
