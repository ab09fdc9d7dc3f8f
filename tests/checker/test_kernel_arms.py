"""What the kernel proves of an arm's C, whose mass matrix turns with the elbow, and the forgeries that it refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.checker import errors, held, kernel, verify
from tests.twin import load_twin

NAME = "two_link_arm"
HERE = Path(__file__).parents[2] / "generated" / NAME
RATES = ("acceleration", "force", "mass_matrix")
NOT_MOVED, RANGE, NOT_ABOVE = "does not move the errors", "without a range", "not positive semidefinite"


def shipped() -> tuple[dict[str, Any], dict[str, str]]:
    proof = json.loads((HERE / "proof.json").read_text("utf-8"))
    return proof, {path.name: path.read_text("utf-8") for path in HERE.glob(f"{NAME}.[ch]")}


def test_the_arm_is_proved_of_its_c_in_its_box_and_to_first_order() -> None:
    proof, files = shipped()
    shown = errors.prove(proof, files)
    assert not shown["whole"] and shown["first order"]
    held.require(proof, shown)


C_FORGERIES = {
    "M11 turns half as far": ("twice_m2_l1_b2 * cos_theta2;", "m2_l1_b2 * cos_theta2;", NOT_MOVED),
    "M21 turns the other way": ("parameters->I2_plus_m2_b2_squared + parameters->m2_l1_b2 * cos",
        "parameters->I2_plus_m2_b2_squared - parameters->m2_l1_b2 * cos", NOT_MOVED),
    "a sine of the other sign": ("= sin(inputs->theta2);", "= -sin(inputs->theta2);", NOT_MOVED),
    "a cosine of the other angle": ("= cos(inputs->theta2);", "= cos(inputs->theta1);", NOT_MOVED),
    "a cosine of an angle that is off": ("= cos(inputs->theta2);", "= cos(inputs->theta2 + 0.001);", NOT_MOVED),
    "a cosine where a sine belongs": ("= sin(inputs->theta2);", "= cos(inputs->theta2);", NOT_MOVED),
    "a cosine of the estimate": ("= cos(inputs->theta2);", "= cos(inputs->theta2 + 0.5 * omega1_hat);", NOT_MOVED),
    "the pivots are swapped": ("one_over_det_M * (parameters->I2_plus_m2_b2_squared * r1 - M21 * r2)",
        "one_over_det_M * (M11 * r1 - M21 * r2)", NOT_MOVED),
    "the rows are swapped": ("(M11 * r2 - M21 * r1)", "(M11 * r1 - M21 * r2)", NOT_MOVED),
    "the determinant is a sum": ("* M11 - M21 * M21)", "* M11 + M21 * M21)", NOT_MOVED),
    "the reciprocal is left out": ("= 1.0 / (parameters->I2_plus_m2_b2_squared * M11 - M21 * M21)", "= 1.0", NOT_MOVED),
    "the reciprocal is of a square": ("= 1.0 / (", "= 1.0 / (M11 - M21 * M21) / (", NOT_MOVED),
    "a Coriolis force is half": ("twice_m2_l1_b2 * omega1_hat)", "m2_l1_b2 * omega1_hat)", NOT_MOVED),
    "gravity is left out": ("* (cos_theta2 * cos_theta1", "* 0.0 * (cos_theta2 * cos_theta1", NOT_MOVED),
    "gravity of the difference of the angles": ("cos_theta1 - sin_theta2", "cos_theta1 + sin_theta2", NOT_MOVED),
    "a division by what may be zero": ("= inputs->w2 -", "= inputs->w2 * (inputs->w1 / inputs->w1) -", RANGE),
    "zero times a division by what may be zero": ("= inputs->w2 -", "= 0.0 / inputs->w1 + inputs->w2 -", RANGE),
    "a division by a cosine": ("= inputs->w2 -", "= 0.0 / cos_theta2 + inputs->w2 -", NOT_ABOVE),
    "a division without value at an angle": ("= inputs->w2 -", "= 0.0 / (1.0 + cos_theta2) + inputs->w2 -", NOT_ABOVE),
    "a division by a negative number": ("= inputs->w2 -", "= 0.0 / (cos_theta2 - 2.0) + inputs->w2 -", NOT_ABOVE),
    "a division by an estimate": ("= inputs->w2 -", "= 0.0 / omega1_hat + inputs->w2 -", RANGE),
    "a division by zero": ("= inputs->w2 -", "= 0.0 / (cos_theta2 - cos_theta2) + inputs->w2 -", "Fraction"),
}  # fmt: skip


@pytest.mark.parametrize("case", C_FORGERIES)
def test_forged_c_is_refused(case: str) -> None:
    old, new, answer = C_FORGERIES[case]
    proof, files = shipped()
    before, step = files[f"{NAME}.c"].split(f"void {NAME}_step(", 1)
    assert step.count(old) == 1, case
    with pytest.raises((ValueError, ZeroDivisionError), match=answer):
        errors.prove(proof, files | {f"{NAME}.c": f"{before}void {NAME}_step({step.replace(old, new)}"})


def test_a_start_that_divides_by_what_may_be_zero_is_refused() -> None:
    proof, files = shipped()
    for function in ("init", "resume"):
        at = files[f"{NAME}.c"].index("{", files[f"{NAME}.c"].index(f"void {NAME}_{function}("))
        own = "omega1_hat" if function == "resume" else "inputs->theta1"
        body = files[f"{NAME}.c"][at:]
        old = "state->z_elbow = parameters->elbow_a" if function == "init" else "state->z_elbow = outputs->a_hat_elbow"
        place = own if function == "init" else f"outputs->{own}"
        forged = files | {f"{NAME}.c": files[f"{NAME}.c"][:at] + body.replace(old, f"{old} + 0.0 / {place}", 1)}
        assert forged != files
        shown = errors.prove(proof, forged)
        with pytest.raises(ValueError, match="a division by what may be zero"):
            held.require(proof, shown)


def with_field(field: str, change: Callable[[Any], Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    return lambda proof: proof | {field: change(proof[field])}


def negated(proof: dict[str, Any]) -> dict[str, Any]:
    """M and the force with the other sign: the same accelerations, of no machine."""
    mass = [[f"-({x})" for x in row] for row in proof["mass_matrix"]]
    return proof | {"mass_matrix": mass, "force": [f"-({x})" for x in proof["force"]]}


def entry(field: str, i: int, j: int, new: Callable[[str], str]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    def change(rows: Any) -> Any:
        return [[new(x) if (i, j) == (k, n) else x for n, x in enumerate(row)] for k, row in enumerate(rows)]

    return with_field(field, change)


def coarser(tree: Any) -> Any:
    """The last cut is left out."""
    if tree != "" and tree[2] == tree[3] == "":
        return ""
    return [*tree[:2], coarser(tree[2]), tree[3]]


PROOF_FORGERIES: dict[str, tuple[Callable[[dict[str, Any]], dict[str, Any]], str]] = {
    "V falls faster than is true": (with_field("decay_rate", lambda _: "178/1000"), "V may not fall"),
    "a wider box": (with_field("box", lambda box: box | {"true.omega2": ["-3", "3"]}), "V may not fall"),
    "no box of a velocity": (with_field("box", lambda box: {"true.omega1": box["true.omega1"]}), RANGE),
    "a box of the angle": (with_field("box", lambda box: box | {"inputs.theta2 t": ["0", "1/8"]}), "no free"),
    "a box of the angle's sign": (with_field("box", lambda box: box | {"inputs.theta2 k": ["1", "1"]}), "no free"),
    "a cover with a cell too coarse": (with_field("cover", coarser), "V may not fall"),
    "a cover with a gap": (with_field("cover", lambda tree: tree[:3]), "not enough values"),
    "a cover that begins elsewhere": (with_field("cover", lambda tree: [tree[0], "5/4", *tree[2:]]), "not cut between"),
    "a cover of the other angle": (
        with_field("cover", lambda tree: json.loads(json.dumps(tree).replace("theta2", "theta1"))), "V may not fall"),
    "a cover of the angle itself": (
        with_field("cover", lambda tree: json.loads(json.dumps(tree).replace("theta2 t", "theta2"))), "inputs.theta2"),
    "a mass that is negative, and the force": (negated, NOT_ABOVE),
    "another mass": (entry("mass_matrix", 1, 1, lambda x: f"2*({x})"), "is not force"),
    "a mass that turns the other way": (entry("mass_matrix", 0, 0, lambda x: x.replace("cos", "-cos")), "is not force"),
    "the matrix is another": (entry("matrix", 0, 0, lambda x: x.replace("sin", "cos", 1)), NOT_MOVED),
    "the matrix without its Coriolis force": (entry("matrix", 0, 1, lambda _: "-1/2000"), NOT_MOVED),
    "a matrix that divides by a cosine": (
        entry("matrix", 0, 0, lambda x: f"{x} + 0/cos(inputs.theta2)"), NOT_ABOVE),
    "a matrix that divides by a velocity": (
        entry("matrix", 0, 0, lambda x: f"{x} + 0/true.omega1"), NOT_ABOVE),
    "a matrix that divides by an estimate": (
        entry("matrix", 0, 0, lambda x: f"{x} + 0/outputs.omega1_hat"), "nothing that is known"),
    "P follows the elbow": (entry("lyapunov_matrix", 0, 0, lambda x: f"{x}*(2 + cos(inputs.theta2))"), "'RATIONAL'"),
    "P of a sign that is wrong": (entry("lyapunov_matrix", 0, 0, lambda x: f"-{x}"), "not definite"),
    "the machine follows its estimate by a cosine": (
        lambda proof: proof | {"rest": ["0", "0", "0", "cos(outputs.omega1_hat) - cos(outputs.omega1_hat)*2"]},
        "nothing that is known"),
    "a state that shows the sine of an estimate": (
        with_field("states", lambda z: z | {"state.z_elbow": z["state.z_elbow"] + " + sin(outputs.omega1_hat)"}), "."),
    "a force that follows the sine of an estimate": (
        with_field("force", lambda f: [f[0], f[1] + " + sin(outputs.omega1_hat)"]), "nothing that is known"),
    "growth is too small": (with_field("reversals", lambda r: [r[0] | {"growth": "2"}, r[1]]), NOT_ABOVE),
    "dwell is too short": (with_field("reversals", lambda r: [r[0] | {"dwell": "2600"}, r[1]]), "has not recovered"),
}  # fmt: skip


@pytest.mark.parametrize("case", PROOF_FORGERIES)
def test_forged_proofs_are_refused(case: str) -> None:
    change, answer = PROOF_FORGERIES[case]
    proof, files = shipped()
    assert change(proof) != proof
    with pytest.raises(verify.Refused, match=answer):
        verify.by_kernel_alone(change(proof), {name: text.encode() for name, text in files.items()})


@pytest.mark.parametrize(
    ("ranges", "cover"),
    [
        ({"theta2": ["-19/10", "-19/10"], "omega1": ["0", "0"], "omega2": ["0", "0"]}, False),
        ({"theta2": ["-19/10", "-19/10"]}, False),
        ({"omega1": ["0", "0"], "omega2": ["0", "0"]}, True),
    ],
)
def test_a_certificate_over_less_than_its_proof_is_not_bound_to_the_code(ranges: dict[str, Any], cover: bool) -> None:
    """It was printed as verified in the proof's wider ranges, and at any angle, where V falls slower than it says."""
    top = json.loads((HERE / "certificate.json").read_text("utf-8"))
    top["variables"] |= ranges
    top |= {"reversals": [], "cover": top["cover"] * cover, "decay_rate": "178/1000" if cover else "200/1000"}
    report = verify.check(
        json.dumps(top), None, None, {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    )
    assert any("V is multiplied by at most" in fact for fact in report.facts)
    assert verify.status(report) == verify.NO_CODE and "ranges" in report.unproved and not report.proved


def test_the_matrix_is_how_the_twin_moves_and_v_falls_along_its_motions() -> None:
    """Small errors of the generated Python beside a machine of this test's own, from sample to sample."""
    proof, _ = shipped()
    twin, dice = load_twin((HERE / "__init__.py").read_text("utf-8"), NAME), np.random.default_rng(4)
    p, h = (
        np.array([[float(kernel.Text({}, {}).value(x).constant()) for x in row] for row in proof["lyapunov_matrix"]]),
        1e-3,
    )
    c = twin.Parameters()
    fall, small, ratios = 1 - 2 * float(kernel.Text({}, {}).value(proof["decay_rate"]).constant()) * h, 1e-6, []
    for _ in range(400):
        x, v, w = (
            dice.uniform(-3.1, 3.1, 2),
            dice.choice([-1, 1], 2) * dice.uniform(0.05, 0.3, 2),
            dice.uniform(-0.1, 0.1, 2),
        )
        level, e = dice.uniform(0, 0.01, 2), dice.normal(size=4) * np.array([1, 1, 0.05, 0.01])
        if dice.random() < 0.5:  # the direction in which V falls least
            e = np.linalg.solve(np.linalg.cholesky(p).T, dice.normal(size=4))
        e *= small / np.abs(e).max()
        s = np.sign(v)
        shown = [*(v - e[:2]), *(level - s * e[2:])]
        state = twin.State()
        K, F = np.array([[1, 0.5], [1, 10]]), np.array([[0.01, 0], [0.01, 0.005]])
        for z, value in zip(("z_omega1", "z_omega2"), shown[:2] - K @ x, strict=True):
            setattr(state, z, value)
        for z, value in zip(("z_shoulder", "z_elbow"), shown[2:] + F @ np.abs(shown[:2]), strict=True):
            setattr(state, z, value)
        outputs = twin.Outputs()

        def sample(position: Any, force: Any, state: Any = state, outputs: Any = outputs) -> list[float]:
            inputs = twin.Inputs()
            inputs.theta1, inputs.theta2, inputs.w1, inputs.w2 = map(float, (*position, *force))
            twin.step(state, c, inputs, outputs)
            assert outputs.fault == 0
            return [outputs.omega1_hat, outputs.omega2_hat, outputs.a_hat_shoulder, outputs.a_hat_elbow]

        assert np.allclose(sample(x, w), shown, atol=1e-12)
        m, k = 0.0036150724999999997, np.cos(x[1])
        mass = np.array([[0.023732505 + 2 * m * k, 0.0024662425 + m * k], [0.0024662425 + m * k, 0.0024662425]])
        coriolis = m * np.sin(x[1]) * np.array([v[1] * (v[1] + 2 * v[0]), -(v[0] ** 2)])
        heavy = np.array([0.8475873 * np.cos(x[0]) + 0.1728181 * np.cos(sum(x)), 0.1728181 * np.cos(sum(x))])
        a = np.linalg.solve(mass, w - s * level + coriolis - heavy)
        if (np.sign(v + h * a) != s).any():
            continue
        after = np.array(sample(x + h * v, w))
        new = np.array([*(v + h * a - after[:2]), *(s * (level - after[2:]))])
        ratios.append(float(new @ p @ new / (e @ p @ e)))
    assert len(ratios) > 200 and max(ratios) <= fall + 2e-5  # the remainder of first order, and the twin's rounding
    assert max(ratios) > 0.99
