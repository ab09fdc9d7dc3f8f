"""Broken sensors, changed parameters, single precision: C and twin, bit for bit."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest

from .build import Built, compile_shared, motion, same_bits
from .specs import spec_text

BAD = (math.nan, math.inf, -math.inf)


def broken(rows: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Every kind of bad value in every column."""
    rows, at = rows.copy(), []
    for column in range(rows.shape[1]):
        for k, bad in enumerate(BAD):
            at.append(20 + 40 * column + 10 * k)
            rows[at[-1], column] = bad
    return rows, at


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize(
    "case",
    [("one_mass", "to"), ("two_mass", "gcfo"), ("two_mass", "gcfo", "measured"), ("arm", "mgto"), ("emps", "cfo")],
)
def test_a_bad_sample_is_held_and_told(tmp_path, case, precision):
    built = Built(tmp_path, spec_text(*case, effects=True) if len(case) == 3 else spec_text(*case), precision)
    rows, at = broken(motion(built.program, 300))
    outputs, states = built.c_run(rows)
    expected, expected_states = built.python_run(rows)
    assert same_bits(outputs, expected) and same_bits(states, expected_states)
    assert np.all(np.isfinite(states)) and np.all(np.isfinite(outputs))
    assert built.faults == at
    for k in at:
        assert outputs[k].tobytes() == outputs[k - 1].tobytes()


@pytest.mark.parametrize("bad", BAD)
def test_a_bad_first_sample_is_told_until_a_good_one_has_started(tmp_path, bad):
    built = Built(tmp_path, spec_text("two_mass"))
    rows = motion(built.program, 50)
    rows[0, 0] = bad
    outputs, states = built.c_run(rows)
    assert same_bits(states, built.python_run(rows)[1]) and same_bits(outputs, built.python_run(rows)[0])
    assert np.all(np.isfinite(states[1:])) and built.faults == [0, 1]


def test_a_state_that_would_overflow_is_held(tmp_path):
    built = Built(tmp_path, spec_text("one_mass", "to"))
    rows = np.tile([1e308, 0.0], (60, 1))
    rows[30:50] = 0.0, 1.0
    outputs, states = built.c_run(rows)
    assert same_bits(states, built.python_run(rows)[1]) and np.all(np.isfinite(states[30:]))
    assert built.faults == [*range(31), *range(50, 60)]
    assert np.all(outputs[50:] == outputs[49])


def test_new_outputs_are_zero_after_a_fault(tmp_path):
    twin = Built(tmp_path, spec_text("one_mass")).twin
    parameters, state = twin.Parameters(), twin.State()
    outputs = twin.step(state, parameters, twin.Inputs(math.nan, 0.0))
    assert outputs == twin.Outputs(fault=1) and state == twin.State(mode=twin.RUNNING, invalid_samples=1)


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("machine", ["two_mass", "arm", "belt_axis"])
def test_prepare_gives_the_values_that_the_tool_wrote(tmp_path, machine, precision):
    built = Built(tmp_path, spec_text(machine), precision)
    own = {p.name for p in built.program.parameters}
    derived = [name for name in built.twin.Parameters.__slots__ if name not in own]
    assert derived
    written = [float(getattr(built.parameters, name)) for name in derived]
    fresh = built.twin.Parameters()
    library = ctypes.CDLL(str(compile_shared(tmp_path, f"{built.program.name}.c")))
    in_c = built.structs[0]()
    for name in built.twin.Parameters.__slots__:
        setattr(in_c, name, getattr(fresh, name) if name in own else 0.0)
    for name in derived:
        setattr(fresh, name, 0.0)
    built.twin.prepare(fresh)
    getattr(library, f"{built.program.name}_prepare")(ctypes.byref(in_c))
    assert [float(getattr(fresh, name)) for name in derived] == written
    assert [float(getattr(in_c, name)) for name in derived] == written


@pytest.mark.parametrize("machine", ["one_mass", "two_mass", "emps", "belt_axis", "arm"])
def test_single_precision_is_float32_throughout(tmp_path, machine):
    built = Built(tmp_path, spec_text(machine), "single")
    assert "double" not in built.files[f"{built.program.name}.c"].replace("double precision", "")
    rows = motion(built.program, 2000).astype(np.float32).astype(float)
    outputs, states = built.c_run(rows, "-O2", "-Wconversion", "-Wdouble-promotion", "-Wfloat-equal")
    expected, expected_states = built.python_run(rows)
    assert same_bits(outputs, expected) and same_bits(states, expected_states)
    assert np.all(states == states.astype(np.float32))
