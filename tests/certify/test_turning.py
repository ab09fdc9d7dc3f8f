"""One V for all signs of the slips: what is proved holds in all products of the steps; what is denied no SDP finds.

A step has one sign throughout; that a slip turns within it is claimed nowhere, and may make the error grow.
"""

from __future__ import annotations

import itertools
import json
import re
from typing import Any

import cvxpy
import numpy as np
import pytest

from codegen.certify.certify import Certificate, certify
from codegen.checker import verify
from codegen.emit.package import emit_sources, make_header
from codegen.program import build_program
from codegen.replay.engine import Engine
from tests.slow_cases import slow_except

from .certified import analysis_of, lyapunov, outcome, step_matrix

SPECS = {
    "one_mass": "{{kind: cfo, velocity: {v}, gains: {{K_F: 30, K_v: 90}}, sample_time: 0.001, integration: {step}}}",
    "two_mass": "{{kind: gcfo, velocity: {v}, gains: {{K_F: [[40, 0], [0, 60]], K_v: [[80, 0], [0, 90]]}}, "
    "sample_time: 0.002, integration: {step}}}",
}


def found(name: str, step: str, velocity: str = "estimated") -> Certificate:
    text = SPECS[name].format(step=step, v=velocity)
    result = outcome(name, text if velocity == "estimated" else re.sub(r", K_v: [^}]*}", "}", text))
    assert isinstance(result, Certificate)
    return result


def turned(certificate: Certificate) -> list[Any]:
    """The step in levels for every choice of signs; the errors of the contacts stand last."""
    phi = step_matrix(certificate.content, {})
    flips = [r["flips"] for r in certificate.content["reversals"]]
    result = []
    for chosen in itertools.product((False, True), repeat=len(flips)):
        turn = np.eye(len(phi))
        for indices, on in zip(flips, chosen, strict=True):
            turn[indices, indices] = -1.0 if on else 1.0
        result.append(turn @ phi @ turn)
    return result


def common_exists(steps: list[Any]) -> bool:
    """By an SDP over all symmetric P, in coordinates in which the steps are well scaled."""
    size = np.sqrt(np.abs(steps[0]).sum(axis=0) / np.abs(steps[0]).sum(axis=1))
    scaled = [s / size[None, :] * size[:, None] for s in steps]
    p, slack = cvxpy.Variable(steps[0].shape, symmetric=True), cvxpy.Variable()
    constraints = [p >> np.eye(len(size)) * 1e-4, cvxpy.trace(p) == 1]
    constraints += [(p - s.T @ p @ s) >> slack * np.eye(len(size)) for s in scaled]
    cvxpy.Problem(cvxpy.Maximize(slack), constraints).solve(solver=cvxpy.CLARABEL)
    return bool(slack.value > 1e-7)


@pytest.mark.parametrize("name", slow_except(list(SPECS), ["one_mass"]))
def test_v_falls_whatever_the_signs_do(name: str) -> None:
    certificate = found(name, "semi_implicit")
    turning = certificate.turning
    assert turning is not None and certificate.turning_rate is not None
    assert 0 < certificate.turning_rate < certificate.decay_rate
    assert set(certificate.proofs) == {"certificate.json", "limit.json", "turning.json"}
    report = verify.check(json.dumps(turning))
    assert sum(" 1-fold, and 0 samples later" in fact for fact in report.facts) == len(turning["reversals"])
    assert turning["claim"].startswith("In every sample in which no slip reverses, with one V for all signs")
    p, steps = lyapunov(turning), turned(certificate)
    h = 0.001 if name == "one_mass" else 0.002
    fall, dice, e = 1 - 2 * certificate.turning_rate * h, np.random.default_rng(4), np.ones(len(p))
    for _ in range(2000):
        e_next = steps[dice.integers(len(steps))] @ e
        assert e_next @ p @ e_next <= fall * (e @ p @ e) * (1 + 1e-12)
        e = e_next / np.linalg.norm(e_next) if dice.random() < 0.9 else dice.normal(size=len(p))
    assert common_exists(steps)


@pytest.mark.parametrize("name", SPECS)
def test_explicit_euler_has_none(name: str) -> None:
    certificate = found(name, "euler")
    assert certificate.turning is None
    assert not common_exists(turned(certificate))
    assert common_exists(turned(certificate)[:1])


def test_the_sample_in_which_a_slip_turns_is_not_claimed() -> None:
    """Two runs of the C that see the same samples, their v_hat turning in every one: the error between them grows.

    A level is read with the new sign, z_F - K_F |v_hat|, and made with the old one; the certified steps have one.
    """
    text = SPECS["one_mass"].format(v="estimated", step="semi_implicit").replace("0.001", "0.01")
    text = text.replace("K_F: 30, K_v: 90", "K_F: 255, K_v: 30")
    spec, analysis = analysis_of("one_mass", text)
    certificate = certify(spec, analysis, {"a.c": "0" * 64}, "none")
    assert isinstance(certificate, Certificate) and certificate.turning is not None
    assert any("while a slip chatters" in sentence for sentence in certificate.turning["assumptions"])
    assert not any("while a slip chatters" in sentence for sentence in certificate.content["assumptions"])
    program = build_program(analysis.dynamics.observer)
    engine = Engine(program, emit_sources(program, make_header("rail.yaml", "0" * 64, "")))
    names = [name for name, _, _ in program.outputs]
    columns = [names.index(n) for n in ("v_hat", "a_hat_rail", "F_hat_rail")]

    def run(rows: Any) -> Any:
        engine.start(rows[0])
        return engine.run(rows)[0][:, columns]

    samples = 20
    rows = np.column_stack([0.2 * (np.arange(samples) % 2), np.zeros(samples)])
    for k in range(samples):  # the input that leaves v_hat to the measured steps to and fro
        rows[k, 1] = run(rows[: k + 1])[-1, 2] + 30 * rows[k, 0]
    base, other = run(rows), run(rows + 1e-9 * np.outer(np.arange(samples) == 0, [0, 1]))
    for found in (base, other):
        assert (np.sign(found[2:, 0]) == -np.sign(found[1:-1, 0])).all()
    e, p = (base - other)[2:, :2], lyapunov(certificate.turning)
    grown = np.einsum("ki,ij,kj->k", e, p, e)
    assert (grown[1:] > 2 * grown[:-1]).all()


def test_nothing_is_said_where_nothing_turns() -> None:
    certificate = found("one_mass", "euler", "measured")
    assert certificate.turning is None
    assert certificate.content["reversals"][0]["growth"] == "1"
