"""An input that works against a force over the position: a missing force of the spec, and no flipped sign."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import TEXT, write_csv

from codegen.logs import Finding, read_log
from codegen.logs.audit.force_balance import Forces
from codegen.logs.audit.input_audit import audit_inputs
from codegen.spec.reader import parse_spec

STIFFNESS = 600.0


def judged(folder: Path, scale: float = 1.0, noise: float = 0.0, declared: float = 0.0) -> Finding:
    """The finding on the input of an axis of 10 kg with 2 N of friction on a spring.

    Args:
        scale: of the inertia and friction in the input, in which the spring is whole.
        noise: RMS of the noise of the inertia, N.
        declared: stiffness of the spring in the spec, N/m.
    """
    t = np.arange(4000) / 250
    x, v, a = (
        sum(b * o**n * np.sin(o * t + p + n * np.pi / 2) for b, o, p in ((0.1, 3.1, 0.0), (0.002, 12.0, 0.4)))
        for n in (0, 1, 2)
    )
    friction, spring = 2.0 * np.sign(v), -declared * x
    inertia = 10.0 * a + noise * np.random.default_rng(3).normal(size=len(t))
    given = scale * (10.0 * a + friction) + max(1.0, scale) * STIFFNESS * x
    parts = (force[:, None] for force in (inertia, spring - friction, friction, spring))
    forces = Forces(*parts, given[None, :, None], np.column_stack([x, v]))
    spec = parse_spec(TEXT, Path("slider.yaml"))
    log = read_log(write_csv(folder / "a.csv", {"t": t, "x": x, "v": v, "w": given}), spec)
    (found,) = audit_inputs(forces, spec, None, log)
    assert found.figures["correlation"] < -0.4
    return found


def test_the_sign_is_right_where_the_input_agrees_with_a_force_over_the_position_fitted_too(tmp_path: Path) -> None:
    found = judged(tmp_path)
    assert found.severity == "warning" and "the sign of w is right" in found.words
    assert found.figures["factor_beside_positions"] == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize("scale", [-1.0, 0.2, 5.0])
def test_an_input_with_another_sign_or_scale_beside_the_force_is_a_problem(tmp_path: Path, scale: float) -> None:
    assert judged(tmp_path, scale).severity == "problem"


def test_noise_in_which_the_input_is_not_seen_is_no_agreement(tmp_path: Path) -> None:
    assert judged(tmp_path, noise=8.0).severity == "problem"


def test_a_declared_spring_with_the_wrong_sign_is_said_to_be_that(tmp_path: Path) -> None:
    found = judged(tmp_path, declared=-STIFFNESS)
    assert found.severity == "problem" and "Check the sign of gravity and springs in the spec" in found.words
