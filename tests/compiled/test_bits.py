"""The compiled C and the Python twin compute the same bits, step after step."""

from __future__ import annotations

import numpy as np
import pytest

from tests.slow_cases import slow_except

from .build import Built, motion, same_bits
from .specs import GAINS, spec_text

CASES = [
    (machine, kind, velocity, effects)
    for kind, machines in GAINS.items()
    for machine in machines
    for velocity, effects in (("estimated", True), ("measured", True), ("estimated", False))
]


def compare(built: Built, samples: int, *flags: str) -> np.ndarray:
    rows = motion(built.program, samples)
    expected, expected_states = built.python_run(rows)
    outputs, states = built.c_run(rows, *flags)
    assert np.all(np.isfinite(outputs)) and np.all(np.isfinite(states))
    assert np.all(np.std(outputs, axis=0) > 0)
    assert same_bits(outputs, expected)
    assert same_bits(states, expected_states)
    return outputs


@pytest.mark.parametrize(
    "case",  # each machine with its equations; the other velocity at one mass and two, no effects at two
    slow_except(
        CASES, [c for c in CASES if c[0] == "two_mass" or (c[3] and (c[2] == "estimated" or c[0] == "one_mass"))]
    ),
    ids=lambda c: "-".join(map(str, c)),
)
def test_every_observer_and_effect(tmp_path, case):
    compare(Built(tmp_path, spec_text(*case)), 1500)


def test_friction_that_follows_the_load(tmp_path):
    """The form mu_load of load_dependent_friction emits other C than the form mu, which two_mass declares."""
    text = spec_text("two_mass", "gcfo", "estimated", True)
    assert "{mu: 0.06}" in text
    folders = tmp_path / "drive", tmp_path / "load"
    for folder in folders:
        folder.mkdir()
    by_drive = compare(Built(folders[0], text), 3000)
    assert not same_bits(by_drive, compare(Built(folders[1], text.replace("{mu: 0.06}", "{mu_load: 0.37}")), 3000))


@pytest.mark.parametrize("machine", slow_except(["two_mass", "emps"], ["two_mass"]))
def test_a_hundred_thousand_steps(tmp_path, machine):
    compare(Built(tmp_path, spec_text(machine)), 100_000)


@pytest.mark.slow
@pytest.mark.parametrize("machine", ["one_mass", "two_mass", "belt_axis", "arm"])
def test_a_hundred_thousand_steps_with_effects(tmp_path, machine):
    compare(Built(tmp_path, spec_text(machine, "gcfo", "estimated", True)), 100_000)


@pytest.mark.parametrize("machine", ["two_mass", "belt_axis", "arm"])
def test_optimisation_changes_no_bit(tmp_path, machine):
    built = Built(tmp_path, spec_text(machine, "gcfo", "estimated", True))
    rows = motion(built.program, 3000)
    results = [built.c_run(rows, flag) for flag in ("-O0", "-O1", "-O2", "-O3", "-Os")]
    assert all(same_bits(a, b) for result in results for a, b in zip(result, results[0], strict=True))


def test_the_motion_reverses_chatters_and_stands(tmp_path):
    built = Built(tmp_path, spec_text("one_mass", "gcfo", "measured"))
    rows = motion(built.program, 4000)
    sign = np.sign(built.python_run(rows)[0][:, -1])
    assert np.sum(sign == 0) > 300
    assert np.sum(sign[1:] * sign[:-1] < 0) > 100
