"""What a DFO knows of the true friction state when the envelope says little."""

from __future__ import annotations

from pathlib import Path

import pytest
import sympy

from codegen.analysis.analysis import analyse
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec
from tests.machines import ONE_MASS

RANGES = {
    "dahl": ("{name: rail, law: dahl, a: 5, c: 100, unit: N}", (-1, 1)),
    "lugre": (
        "{name: rail, law: lugre, sigma_0: 200, sigma_1: 2, sigma_2: 1, F_c: 4, F_s: 6, v_s: 0.1, unit: N}",
        None,
    ),
    "reset": ("{name: rail, law: reset_integrator, a: 5, c: 100, unit: N}", None),
}


@pytest.mark.parametrize("envelope", ["", "envelope: {v: [-2, 2]}\n"])
@pytest.mark.parametrize("law", RANGES)
def test_an_envelope_without_slip_speeds_still_gives_an_observer(law: str, envelope: str) -> None:
    """Dahl's state stays in [-1, 1] whatever the speed, and without a range of v this once ended in a traceback."""
    contact, known = RANGES[law]
    text = ONE_MASS.replace("{name: rail, law: coulomb, a: 5, unit: N}", contact) + envelope
    text += "observer: {kind: dfo, velocity: estimated, gains: {K_a: -3, K_f1: 1, K_v: 50}, sample_time: 0.001}\n"
    spec = parse_spec(text, Path("one_mass.yaml"))
    observer = build_observer(spec, build_system(spec))
    state = sympy.Symbol("f_rail", real=True)
    if known is not None:
        assert observer.truth_ranges[state] == known
    elif law == "lugre":  # max(F_c, F_s)/sigma_0, at any speed
        assert [float(end) for end in observer.truth_ranges[state]] == [-0.03, 0.03]
    else:  # the reset integrator's deflection grows with the speed
        assert (state in observer.truth_ranges) == bool(envelope)
    assert state in analyse(spec, observer).points.ranges
