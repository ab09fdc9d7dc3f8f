"""Starts and restarts: what an observer makes of its first sample, and of good samples after bad ones."""

from __future__ import annotations

import ctypes
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from codegen.emit.package import emit_sources, make_header

from .build import Built, compile_shared, motion, same_bits
from .specs import SPECS, spec_text
from .test_integration import text_of
from .test_lanes import LANES, lane_struct


def with_effects(text: str, *effects: str) -> str:
    return text.replace("effects: []", "effects: [" + ", ".join(effects) + "]")


def implicit_mass(*effects: str) -> str:
    """One kilogram whose velocity is measured, by backward Euler."""
    text = spec_text("one_mass", "to", "measured")
    return with_effects(text.replace("sample_time: 0.001}", "sample_time: 0.001, integration: implicit}"), *effects)


GAIN = "{kind: input_gain, on: w, parameters: {gain: 0.5}}"
LIMIT = "{kind: saturation, on: w, parameters: {limit: 10}}"
ZONE = "{kind: dead_zone, on: w, parameters: {width: 30}}"
LAG = "{kind: actuator_lag, on: w, parameters: {tau: 0.01}}"
DELAY = "{kind: input_delay, on: w, parameters: {T: 0.0025}}"
FORCES = {
    (GAIN,): 50.0,
    (GAIN, LIMIT): 10.0,
    (GAIN, ZONE): 20.0,
    (GAIN, LAG): 50.0,
    (GAIN, LIMIT, DELAY): 10.0,
    (GAIN, ZONE, LIMIT, DELAY, LAG): 10.0,
}


@pytest.mark.parametrize("effects", FORCES, ids=lambda effects: "+".join(e.split(",")[0][7:] for e in effects))
def test_a_constant_command_acts_from_the_first_step_as_ever_after(tmp_path: Path, effects: tuple[str, ...]) -> None:
    """The command is taken to have been held before the first sample, so the first step too sees its effective force.

    At rest dF/dt = K (w - F) from F = 0 with K = 10/s, by backward Euler: F[k] = w (1 - (1 + hK)^-(k+1)).
    """
    built = Built(tmp_path, implicit_mass(*effects))
    outputs, states = built.c_run(np.tile([0.0, 0.0, 100.0], (50, 1)))
    expected = FORCES[effects] * (1 - 1.01 ** -np.arange(1.0, 51.0))
    names = [name for name, _, _ in built.program.outputs]
    np.testing.assert_allclose(outputs[:, names.index("F_hat_on_x")], expected, rtol=1e-12)
    twin = built.python_run(np.tile([0.0, 0.0, 100.0], (50, 1)))
    assert same_bits(outputs, twin[0]) and same_bits(states, twin[1])


THESIS = SPECS / "thesis"
ARM = spec_text("arm", "gcfo")
POISONED = {
    "held": (implicit_mass(), {2: 1e305}),
    "lagged": (implicit_mass(LAG), {2: -1e305}),
    "delayed": (with_effects(spec_text("one_mass", "to"), DELAY), {1: 1e305}),
    "at the limit": (text_of("one_mass", "to", "implicit"), {1: sys.float_info.max}),
    "sums to zero": (
        ARM.replace("sample_time: 0.001}", "sample_time: 0.001, integration: implicit}"),
        {2: 1e305, 3: -1e305},
    ),
    "cubic": ((THESIS / "one_mass_dfo.yaml").read_text(encoding="utf-8"), {1: 1e60}),
    "cubic, implicit": ((THESIS / "one_mass_dfo_implicit.yaml").read_text(encoding="utf-8"), {1: 1e60}),
}


def test_a_start_that_cannot_be_used_shows_in_the_state(tmp_path: Path) -> None:
    twin = Built(tmp_path, spec_text("one_mass")).twin
    parameters = twin.Parameters()
    for position, force, valid in ((1.0, 2.0, 1), (math.nan, 2.0, 0), (1.0, math.inf, 0), (1e200, 2.0, 0)):
        state = twin.init(parameters, twin.Inputs(position, force))
        assert state.mode == (twin.RUNNING if valid else twin.STARTING)
        assert valid or state == twin.State(mode=twin.STARTING)


def test_large_inputs_that_cancel_are_an_invalid_sample(tmp_path: Path) -> None:
    """Their sum was valid, and the observer was started from them; the estimates are held, as at a NaN."""
    built = Built(tmp_path, (SPECS / "two_mass.yaml").read_text(encoding="utf-8"))
    rows = np.random.default_rng(1).normal(size=(60, 3)).cumsum(axis=0) * [1e-4, 1e-4, 0.1]
    large, nan = rows.copy(), rows.copy()
    large[20:23, :2], nan[20:23, :2] = (1e200, -1e200), math.nan
    for run in (built.c_run, built.python_run):
        assert all(same_bits(*pair) for pair in zip(run(large), run(nan), strict=True))
    inputs = built.twin.Inputs(1e200, -1e200, 0.0)
    assert built.twin.init(built.twin.Parameters(), inputs).mode == built.twin.STARTING


def in_lanes(built: Built, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outputs and faults of the last lane; the first of the others gets no bad sample."""
    name = built.program.name
    for file, text in emit_sources(built.program, make_header("m.yaml", "0" * 64, ""), ("simd",)).items():
        (built.folder / file).write_text(text, encoding="utf-8")
    library = ctypes.CDLL(str(compile_shared(built.folder, f"{name}_lanes.c", "-O3")))
    constants, inputs, state, outputs = (lane_struct(s)() for s in built.structs)
    getattr(library, f"{name}_fill_lanes")(ctypes.byref(constants))
    places = [ctypes.byref(x) for x in (state, constants, inputs, outputs)]
    found, faults = [], []
    for k, row in enumerate(rows):
        for (field, _), value in zip(inputs._fields_, row, strict=True):
            for lane in range(LANES):
                getattr(inputs, field)[lane] = value if lane else 0.0
        if k == 0:
            getattr(library, f"{name}_init_lanes")(*places[:3])
        getattr(library, f"{name}_step_lanes")(*places)
        assert outputs.fault[0] == 0
        found.append([getattr(outputs, n)[LANES - 1] for n, _, _ in built.program.outputs])
        faults += [k] if outputs.fault[LANES - 1] else []
    return np.array(found, dtype=float), np.array(faults)


@pytest.mark.parametrize("case", POISONED)
def test_good_samples_end_a_fault(tmp_path: Path, case: str) -> None:
    """One finite but senseless sample, whatever it leaves behind in the state: good ones are used again soon."""
    text, bad = POISONED[case]
    built = Built(tmp_path, text)
    rows = 0.01 * motion(built.program, 120)
    for column, value in bad.items():
        rows[40, column] = value
    outputs, states = built.c_run(rows)
    faults = built.faults
    twin = built.python_run(rows)
    assert same_bits(outputs, twin[0]) and same_bits(states, twin[1])
    lanes, lane_faults = in_lanes(built, rows)
    assert same_bits(outputs, lanes) and lane_faults.tolist() == faults
    assert faults and faults[0] >= 40 and faults[-1] < 60
    assert np.all(np.isfinite(states)) and np.all(np.abs(outputs[60:]) < 1e6)
    if len(bad) == 1 and abs(rows[40]).max() > 1e150:
        assert faults == ([40] if built.program.most_lost > 1 else [40, 41])
        assert outputs[40].tobytes() == outputs[39].tobytes()


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e305])
def test_a_bad_first_sample_leaves_the_start_to_the_first_good_one(tmp_path: Path, bad: float, precision: str) -> None:
    """At rest at 20 m: a start there sees a sample of the level's 50 N, 0.05 m/s; one at zero would see 2000 m/s."""
    built = Built(tmp_path, spec_text("one_mass"), precision)
    rows = np.tile([20.0, 0.3], (6, 1))
    rows[:2, 0] = bad
    outputs, states = built.c_run(rows)
    assert built.faults == [0, 1, 2] and not outputs[:3].any() and not states[:2].any()
    expected, expected_states = built.python_run(rows)
    assert same_bits(outputs, expected) and same_bits(states, expected_states)
    fresh = built.python_run(rows[3:])
    assert same_bits(outputs[3:], fresh[0]) and same_bits(states[3:], fresh[1])
    assert np.all(np.abs(outputs[3:, 0]) < 0.1)
    if precision == "double":
        assert in_lanes(built, np.where(np.isfinite(rows), rows, bad))[1].tolist() == [0, 1, 2]
