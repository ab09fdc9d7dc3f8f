"""What was accepted although it is false or says nothing: no equation of the machine, turns at which estimates jump."""

from __future__ import annotations

import json
import time
from typing import Any

import pytest

from codegen.checker import errors, theorem, verify
from tests.checker.forged import changed, sources

SIGN_OF_W = (
    ("one_mass_sign(v_hat)", "one_mass_sign(inputs->w)"),
    ("z_rail - parameters->K_F * fabs(v_hat)", "z_rail - parameters->K_F * sign_rail * v_hat"),
    ("K_F * fabs(outputs->v_hat)", "K_F * one_mass_sign(inputs->w) * outputs->v_hat"),
)
GRAVITY = (("(inputs->w - F_hat_rail)", "(inputs->w - F_hat_rail - 9.81)"),)


def proof_of(name: str) -> Any:
    return json.loads(sources(name)["proof.json"])


def judged(proof: Any, files: dict[str, bytes]) -> verify.Report:
    return verify.check(json.dumps(proof), None, None, {x: text for x, text in files.items() if x != "ellipsoid.json"})


def test_a_machine_without_an_equation_for_each_acceleration_is_none() -> None:
    """Of no row the kernel asked nothing: the C subtracts a weight, and no line said that v' does."""
    _, files = changed("one_mass", *GRAVITY)
    proof = proof_of("one_mass")
    proof["acceleration"]["true.v"] = "(-true.a_rail*sign.rail + inputs.w - 9.81)/parameters.m"
    said = proof | {"force": ["-true.a_rail*sign.rail + inputs.w - 9.81"]}
    assert any("9.81" in line for line in judged(said, files).proved)
    with pytest.raises(verify.Refused, match="argument 3 is longer"):
        judged(proof | {"mass_matrix": [], "force": []}, files)


def test_a_sign_of_a_force_changes_while_the_mass_moves_and_the_level_jumps() -> None:
    """State z = a_hat + K_F s v_hat, the same before and after a reversal of s = sgn w: a_hat jumps by 2 K_F |v_hat|.

    From errors of zero V so grows by any factor; said was at most 3.2.
    """
    content, files = changed("one_mass", *SIGN_OF_W)
    proof = proof_of("one_mass") | {"signs": {"sign.rail": "inputs.w"}}
    for said in (proof, proof | {"reversals": []}):
        with pytest.raises(verify.Refused, match="no sign of a slip"):
            judged(said, files)
    with pytest.raises(verify.Refused, match="no sign of a slip"):
        verify.check(json.dumps(content), sources=files | {"proof.json": json.dumps(proof).encode()})


@pytest.mark.parametrize(
    ("formula", "jumps"),
    [
        ("outputs.a_hat_between + sign.between*(outputs.v1_hat - outputs.v2_hat)", False),
        (
            "outputs.a_hat_between + 3*sign.between*(outputs.v1_hat*outputs.v1_hat - outputs.v2_hat*outputs.v2_hat)",
            False,
        ),
        ("outputs.a_hat_between + fabs(outputs.v1_hat)", False),
        ("outputs.a_hat_between + sign.between*(outputs.v1_hat + outputs.v2_hat)", True),
        ("outputs.a_hat_between + sign.between*outputs.v1_hat", True),
        ("outputs.a_hat_between + sign.between*(outputs.v1_hat - outputs.v2_hat) + sign.between/1000", True),
        ("sign.between*outputs.a_hat_between", True),
        ("outputs.a_hat_between + sin(sign.between)", True),
        ("outputs.a_hat_between + outputs.v1_hat/(2 + sign.between)", True),
        ("outputs.a_hat_between + fabs(inputs.w + 5*sign.between)", True),
        ("outputs.a_hat_between + 1/(3 + sin(fabs(sign.between + inputs.w)))", True),
        ("outputs.a_hat_between + cos(inputs.x1)", False),
    ],
)
def test_what_jumps_at_a_reversal_of_the_slip_between_two_masses(formula: str, jumps: bool) -> None:
    """By hand: a state jumps unless the factor of the sign is 0 where v1_hat = v2_hat."""
    proof, files = (
        proof_of("two_mass"),
        {x: y.decode() for x, y in sources("two_mass").items() if x[-2:] in (".c", ".h")},
    )
    shown = errors.prove(proof, files)
    other = proof | {"states": proof["states"] | {"state.z_between": formula}}
    if jumps:
        with pytest.raises(ValueError, match=r"a reversal of sign\.between|sign\.between occurs in a function"):
            theorem.require_continuity(other, shown, ["sign.between"])
    else:
        theorem.require_continuity(other, shown, ["sign.between"])
    theorem.require_continuity(other, shown, ["sign.ground"])


def test_a_dwell_time_with_a_v_that_grows_takes_no_half_minute() -> None:
    """10^150 to the power of 99999: only the digits of the denominator, which is 1, were counted."""
    proof = proof_of("one_mass") | {"decay_rate": "-1e99*1e99*1e42"}
    proof["reversals"][0]["dwell"] = "99999"
    begun = time.process_time()
    with pytest.raises(verify.Refused, match="'RATIONAL'"):
        judged(proof, sources("one_mass"))
    with pytest.raises(verify.Refused, match="has not recovered"):
        judged(proof | {"decay_rate": f"-{10**90}"}, sources("one_mass"))
    assert time.process_time() - begun < 3
