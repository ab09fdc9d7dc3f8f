"""Effects of an arm are compared at the joint on which they act."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.diagnosis.fit.acceptance import SIGN_BLOCKS, evidence_of
from codegen.diagnosis.fit.search import joint_of_difference, where_they_differ
from codegen.diagnosis.selection.force_fits import ForceFits
from tests.diagnosis.fakes import Placed


@dataclass(frozen=True)
class Residual:
    """What the comparison of two fits needs of them."""

    trial: Any
    residual: Any
    slopes: Any

    @property
    def held_out_losses(self) -> Any:
        count = self.residual.shape[1]
        return 0.5 * count * np.log1p((self.residual**2).sum(axis=1) / count)


def part(kind: str, joint: int, sits_on: str = "coordinate") -> Any:
    effect = SimpleNamespace(sits_on=sits_on, coordinate=lambda system, place: place)
    return Placed(kind=kind, on=f"j{joint}", names=("p",), place=joint, effect=effect)


def fit(*parts: Any) -> Any:
    return SimpleNamespace(trial=SimpleNamespace(parts=parts), of_joint=lambda joint: (parts, joint))


ARM: Any = SimpleNamespace(rigid=object(), system=None)
WHOLE: Any = SimpleNamespace(rigid=None)
SPRING, DRAG, GEAR = part("spring", 0), part("quadratic_drag", 0), part("cogging", 2)


@pytest.mark.parametrize(
    ("one", "other", "joint"),
    [
        (fit(GEAR), fit(GEAR, SPRING), 0),
        (fit(GEAR, DRAG), fit(SPRING, GEAR), 0),
        (fit(), fit(GEAR, SPRING), None),
        (fit(SPRING), fit(SPRING), None),
        (fit(SPRING), fit(SPRING, part("coupling", 1, "two coordinates")), None),
    ],
)
def test_fits_are_compared_at_the_one_joint_on_which_their_effects_differ(one: Any, other: Any, joint: Any) -> None:
    assert joint_of_difference(ARM, one, other) == joint
    assert joint_of_difference(WHOLE, one, other) is None
    expected = (one, other) if joint is None else (one.of_joint(joint), other.of_joint(joint))
    assert where_they_differ(ARM, one, other) == expected
    assert where_they_differ(WHOLE, one, other) == (one, other)


def test_the_force_at_one_joint_is_judged_by_its_own_residual() -> None:
    """Half of the squared force of one of four joints is an eighth of that of all."""
    rng, samples, joints = np.random.default_rng(1), 4800, 4
    fits: Any = ForceFits.__new__(ForceFits)
    used = np.ones((samples, joints), dtype=bool)
    used[:700, 1] = False  # joints need not have the same samples
    motion = SimpleNamespace(time=np.arange(samples), cutoff_hz=0.25, sample_time=1.0)
    problem = SimpleNamespace(used=used, motion=motion)
    object.__setattr__(fits, "search", SimpleNamespace(rigid=object(), system=None, motion=motion, problem=problem))

    def blocks(forces: Any) -> Any:
        return fits._in_blocks([forces[rows, i] for i, rows in enumerate(fits._rows)])

    def made(forces: Any, *parts: Any) -> Any:
        residual = blocks(forces)
        return Residual(SimpleNamespace(parts=parts), residual, np.zeros((0, *residual.shape)))

    before = 10 * rng.standard_normal((samples, joints))
    after = before * np.where(np.arange(joints) == 2, np.sqrt(0.5), 1.0)
    plain, found = fits.where_they_differ(made(before), made(after, GEAR))
    assert plain.residual.shape == found.residual.shape == (SIGN_BLOCKS, blocks(before).shape[1])
    assert (plain.residual**2).sum() == pytest.approx((before[fits._rows[2], 2] ** 2).sum())
    assert evidence_of(plain, found, floored=False).share == pytest.approx(0.5, abs=0.02)
    assert evidence_of(made(before), made(after, GEAR), floored=False).share < 0.2
