"""Same bits everywhere: the Python twin, gcc and clang at every level, SIMD lanes, on every shipped spec.

By default 2^12 steps through all of them; the slow tests run 2^20 steps through every C build, and through the twin,
which takes ten to thirty seconds a spec and over a minute for the seven-joint arm.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import pytest

from .driver import Loaded, load
from .lane_driver import load_lanes
from .shipped import PRECISIONS, REPRESENTATIVE, SHIPPED, excitation, interface, program, sources
from .signals import broken, broken_at_first, episodes, huge, ordinary
from .toolchain import CLANG, GCC, Workshop
from .twin_run import Twin

BUILDS = ((GCC, "-O2"), (GCC, "-O0"), (GCC, "-O3"), (CLANG, "-O2"), (CLANG, "-O3"))
CALLS_LIBM = ("seven_joint_arm", "two_link_arm")
"""Their twins in single precision differ: NumPy's sine of a float is its own and not libm's sinf."""
CHUNK = 1 << 15


class Runner(Protocol):
    dtype: np.dtype

    def start(self, row: np.ndarray) -> None: ...

    def run(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...


def builds(workshop: Workshop, spec: str, precision: str) -> list[Loaded]:
    """Every build whose compiler is here, and the SIMD lanes."""
    here = [(compiler, flag) for compiler, flag in BUILDS if shutil.which(compiler.command)]
    files, face = sources(spec, precision), interface(spec, precision)
    found = [load(workshop, files, face, compiler, flag) for compiler, flag in here]
    return [*found, load_lanes(workshop, spec, precision)] if shutil.which(GCC.command) else found


def first_build(workshop: Workshop, spec: str, precision: str) -> Loaded:
    return load(workshop, sources(spec, precision), interface(spec, precision), *BUILDS[0])


def first_difference(runners: Sequence[Runner], rows: Sequence[np.ndarray]) -> str:
    """Where a runner gives other bits than the first, or nothing. Each part of ``rows`` begins with an init."""
    done = 0
    for part in rows:
        for runner in runners:
            runner.start(part[0])
        for at in range(0, len(part), CHUNK):
            expected = runners[0].run(part[at : at + CHUNK])
            for k, runner in enumerate(runners[1:], start=1):
                for what, a, b in zip(("output", "state"), expected, runner.run(part[at : at + CHUNK]), strict=True):
                    if a.tobytes() != b.tobytes():
                        bits = f"u{a.itemsize}"
                        row, column = np.argwhere(a.view(bits) != b.view(bits))[0]
                        return f"runner {k}, {what} {column}, step {done + at + row}: {a[row, column]} {b[row, column]}"
        done += len(part)
    return ""


def steps(spec: str, samples: int, precision: str = "double") -> list[np.ndarray]:
    return episodes(interface(spec, precision), excitation(spec, precision), samples)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", REPRESENTATIVE)
def test_twin_and_compilers_agree(workshop, spec, precision):
    face = interface(spec, precision)
    assert face.real == {"double": "double", "single": "float"}[precision]
    runners: list[Runner] = [*builds(workshop, spec, precision)]
    if precision == "double" or spec not in CALLS_LIBM:
        runners.insert(0, Twin(sources(spec, precision)["__init__.py"], face))
    samples = 1 << 12 if precision == "double" else 1 << 11  # NumPy's floats are slow
    assert first_difference(runners, steps(spec, samples, precision)) == ""


@pytest.mark.slow
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", SHIPPED)
def test_a_million_steps_through_every_compiler(workshop, spec, precision):
    assert first_difference(builds(workshop, spec, precision), steps(spec, 1 << 20, precision)) == ""


@pytest.mark.slow
@pytest.mark.parametrize("spec", SHIPPED)
def test_a_million_steps_through_the_twin(workshop, spec):
    face = interface(spec)
    twin = Twin(sources(spec)["__init__.py"], face)
    assert first_difference([twin, first_build(workshop, spec, "double")], steps(spec, 1 << 20)) == ""


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", SHIPPED)
def test_ordinary_motion_stays_finite_and_moves_every_output(workshop, spec, precision):
    face = interface(spec, precision)
    observer = first_build(workshop, spec, precision)
    rows = ordinary(excitation(spec, precision), 1 << 12)
    observer.start(rows[0])
    outputs, states = observer.run(rows)
    assert np.all(np.isfinite(outputs)) and np.all(np.isfinite(states))
    names = face.elements("outputs")  # a verdict may stand still: no machine of this model moves so
    reals = [k for k in range(outputs.shape[1]) if k not in face.flags and names[k] != "in_domain"]
    assert np.all(np.std(outputs[:, reals], axis=0) > 0)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", SHIPPED)
def test_a_broken_sensor_holds_the_estimate_and_raises_the_flag(workshop, spec, precision):
    face = interface(spec, precision)
    observer = first_build(workshop, spec, precision)
    rows = broken(excitation(spec, precision), 1 << 12)
    observer.start(rows[0])
    outputs, states = observer.run(rows)
    flag = [member.name for member in face.outputs for _ in member.elements].index("fault")
    bad = ~np.all(np.isfinite(rows), axis=1)
    assert np.all(np.isfinite(outputs)) and np.all(np.isfinite(states))
    flagged = outputs[:, flag] != 0
    anew = flagged & ~bad  # a good one after many that were bad sets the states
    assert np.all(flagged[bad]) and np.all(bad[np.flatnonzero(anew) - 1])
    at = np.flatnonzero(flagged)
    others = [k for k in range(outputs.shape[1]) if k != flag]
    assert np.array_equal(outputs[at][:, others], outputs[at - 1][:, others])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", SHIPPED)
def test_no_state_or_output_is_ever_nan(workshop, spec, precision):
    face, drive = interface(spec, precision), excitation(spec, precision)
    observer = first_build(workshop, spec, precision)
    raised = 0
    for rows in (*(huge(drive, 1 << 11, seed) for seed in range(8)), broken_at_first(drive, 100)):
        observer.start(rows[0])
        outputs, states = observer.run(rows)
        assert np.all(np.isfinite(outputs)) and np.all(np.isfinite(states))
        raised += np.count_nonzero(outputs[:, list(face.flags)])
        assert np.all(np.any(outputs[:, list(face.flags)], axis=1)[~np.all(np.isfinite(rows), axis=1)])
    assert raised > 0


def test_a_last_bit_is_noticed(workshop):
    """The comparison can fail: an input is off by its last bit."""
    files, face = dict(sources("two_mass")), interface("two_mass")
    code = files["two_mass.c"]
    changed = code.replace("inputs->x1", "(inputs->x1 * 1.0000000000000002)")
    assert changed != code
    altered = load(workshop, files | {"two_mass.c": changed}, face, GCC, "-O2")
    rows = steps("two_mass", 1 << 12)
    assert "step" in first_difference([load(workshop, files, face, GCC, "-O2"), altered], rows)


@pytest.mark.parametrize("flag", ["-ffast-math"])
def test_unsafe_optimisation_is_noticed(workshop, flag):
    """The comparison can fail: unsafe arithmetic gives other bits on some shipped spec."""
    found = []
    for spec in ("thesis/two_mass_gdfo", "seven_joint_arm"):
        files, face = sources(spec), interface(spec)
        unsafe = load(workshop, files, face, GCC, "-O3", flag)
        found.append(first_difference([first_build(workshop, spec, "double"), unsafe], steps(spec, 1 << 12)))
    assert any(found)


def test_names_of_both_precisions_are_the_same():
    for spec in SHIPPED:
        double, single = interface(spec), interface(spec, "single")
        for part in ("parameters", "state", "inputs", "outputs"):
            assert double.elements(part) == single.elements(part)
        assert double.elements("inputs") == tuple(program(spec).reference(f.name) for f in program(spec).inputs)
