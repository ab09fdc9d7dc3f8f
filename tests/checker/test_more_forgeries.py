"""Forgeries of one_mass found by a reader who had not seen the checker before: each must be refused, or bind nothing.

Each case is a change of the genuine files that makes a printed statement false. The kinds are others than those of
counterexamples.py, test_attacks.py and the test_kernel files. Texts are replaced once, and hashes are set anew.
"""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Callable
from typing import Any

import pytest

from codegen.checker import verify
from tests.checker.forged import certificate, changed, check, sources
from tests.checker.test_effects_attacks import made

LAW = "parameters->one_over_m * (inputs->w - F_hat_rail)"
V_HAT = "    const double v_hat ="
COMMIT = "        state->z_v = z_v_next;\n        state->z_rail = z_rail_next;\n"
CHECK = "    const double check = z_v_next + z_rail_next;"

# why: the texts before and after. The file is the C, or the header where the name says so.
C_TEXTS = {
    "a quotient of whole numbers that is all of a statement": (
        V_HAT, f"    const double half = 1/2;\n    const double drift = half * inputs->x;\n{V_HAT} drift +"),
    "a negative quotient of whole numbers": (V_HAT, f"    const double half = -1/2;\n{V_HAT} half * inputs->w +"),
    "states that change places": (
        COMMIT, "        state->z_v = z_rail_next;\n        state->z_rail = z_v_next;\n"),
    "a state that is computed from the next one of another": (
        "= state->z_rail + parameters->h_K_F",
        "= state->z_rail + 0.5 * (z_v_next - z_v_next * 1.1) + parameters->h_K_F"),
    "an output of the next sample": ("outputs->a_hat_rail = a_hat_rail;", "outputs->a_hat_rail = z_rail_next;"),
    "the gain in place of its product with the sample time": (
        "parameters->h_K_F * sign_rail", "parameters->K_F * sign_rail"),
    "the magnitude in place of the value": ("parameters->K_v * inputs->x;", "parameters->K_v * fabs(inputs->x);"),
    "a level that is never negative": ("= sign_rail * a_hat_rail", "= sign_rail * fabs(a_hat_rail)"),
    "the sign of the level as well": (
        "= sign_rail * a_hat_rail", "= sign_rail * one_mass_sign(a_hat_rail) * a_hat_rail"),
    "the sign of another quantity": ("one_mass_sign(v_hat)", "one_mass_sign(inputs->x)"),
    "the sign of a shifted slip": ("one_mass_sign(v_hat)", "one_mass_sign(v_hat + 1e-3)"),
    "the sign of a square": ("one_mass_sign(v_hat)", "one_mass_sign(v_hat * v_hat)"),
    "zero over what may be zero": (LAW, f"{LAW} + 0.0 / v_hat"),
    "a quotient that cancels but at zero": (LAW, f"{LAW} * (v_hat / v_hat)"),
    "a sine that is small near zero": (LAW, f"{LAW} + sin(v_hat) - v_hat"),
    "a cosine for one": (LAW, f"{LAW} * cos(v_hat)"),
    "what the sine and cosine of unlike angles add to": (
        LAW, f"{LAW} * (sin(v_hat) * sin(v_hat) + cos(inputs->x) * cos(inputs->x))"),
    "an exponential for one": (LAW, f"{LAW} * exp(-v_hat * v_hat)"),
    "a number in hexadecimal": (LAW, f"{LAW} * 0x1p0"),
    "a number with a suffix": (LAW, f"{LAW} * 1.0f"),
    "a number that begins with its point": (LAW, f"{LAW} * .5"),
    "two points in a number": (LAW, f"{LAW} * 1.0.0"),
    "a constant of math.h": (LAW, f"{LAW} * M_PI"),
    "a macro that a compiler defines": (LAW, f"{LAW} * linux"),
    "the guard of the header as a name": (LAW, f"{LAW} * STICTION_ONE_MASS_H"),
    "a word of C++ for an operator": (LAW, f"{LAW} * (v_hat and v_hat)"),
    "a list of values": (LAW, f"{LAW} * (v_hat, 1.0)"),
    "an address": (LAW, f"{LAW} * *&parameters->m"),
    "a size": (LAW, f"{LAW} * sizeof(v_hat)"),
    "an index that is an expression": (LAW, f"{LAW} * (&parameters->m)[0]"),
    "a start at another level than a constant": ("state->z_rail = parameters->rail_a;", "state->z_rail = inputs->w;"),
    "a start with a speed": ("-(parameters->K_v * inputs->x);", "-(parameters->K_v * inputs->x) + 3.0;"),
    "an invalid sample that adds to the level": (
        "K_v * outputs->v_hat;\n", "K_v * outputs->v_hat;\n    state->z_rail = state->z_rail + 1.0;\n"),
    "a resumption at half the level": (
        "= outputs->a_hat_rail + parameters->K_F", "= 0.5 * outputs->a_hat_rail + parameters->K_F"),
    "a check of one state alone": (CHECK, "    const double check = z_v_next + z_v_next;"),
    "a parameter that becomes what it is divided by": (
        "= 1.0 / parameters->m;", "= parameters->m / 1.0;\n    parameters->m = 2.0;"),
    "a parameter that is no number": ("= 1.0 / parameters->m;", "= 1.0 / (parameters->m - 1.0);"),
    "a count that wraps later": ("invalid_samples >= 8u", "invalid_samples >= 256u"),
    "header: a sample time below zero": ("0.001, /* sample_time */", "-0.001, /* sample_time */"),
    "header: a sample time of zero": ("0.001, /* sample_time */", "0.0, /* sample_time */"),
    "header: a value too many": ("10.0, /* K_F */", "10.0, 10.0, /* K_F */"),
    "header: a count of one bit": ("unsigned char invalid_samples;", "unsigned invalid_samples : 1;"),
    "header: two values change places": (
        "50.0, /* rail_a */ \\\n        10.0, /* K_F */", "10.0, /* K_F */ \\\n        50.0, /* rail_a */"),
    "header: a field of single precision": ("double z_v;", "float z_v;"),
    "header: a field that points": ("double z_v;", "double *z_v;"),
    "header: a sample time in minutes": ("double sample_time; /* s:", "double sample_time; /* min:"),
    "header: a level per length": ("double a_hat_rail; /* N:", "double a_hat_rail; /* N/m:"),
}  # fmt: skip


@pytest.mark.parametrize("why", C_TEXTS)
def test_c_of_another_law_is_refused(why: str) -> None:
    old, new = C_TEXTS[why]
    with pytest.raises(verify.Refused):
        check(*changed("one_mass", (old, new), end="h" if why.startswith("header") else "c"))


def put(*places: tuple[Any, ...]) -> Callable[[Any], None]:
    """A change of JSON: each place is keys and, at the end, the new value."""

    def change(content: Any) -> None:
        for *keys, key, value in places:
            at = content
            for k in keys:
                at = at[k]
            at[key] = value

    return change


RATE = "-true.a_rail*sign.rail + inputs.w"
PROOFS: dict[str, Callable[[Any], object]] = {
    "the machine without friction, whose level is an input": put(
        ("force", ["-inputs.w*sign.rail + inputs.w"]),
        ("acceleration", {"true.v": "(-inputs.w*sign.rail + inputs.w)/parameters.m"})),
    "friction that does not change its sign": put(
        ("force", ["-true.a_rail + inputs.w"]), ("acceleration", {"true.v": "(-true.a_rail + inputs.w)/parameters.m"})),
    "a mass that depends on the speed": put(("mass_matrix", [["parameters.m*true.v"]])),
    "a mass of zero and no force": put(("mass_matrix", [["0"]]), ("force", ["0"])),
    "a mass matrix with a row too many": lambda p: p["mass_matrix"].append(["0"]),
    "an acceleration of nothing": put(("acceleration", {})),
    "an acceleration of an input that is no velocity": lambda p: p["acceleration"].update({"inputs.w": "0"}),
    "a position that moves by an estimate": put(("positions", {"inputs.x": "outputs.v_hat"})),
    "a position that moves by itself": put(("positions", {"inputs.x": "inputs.x"})),
    "a level that turns by a second sign of the same slip": put(
        ("signs", {"sign.rail": "outputs.v_hat", "sign.other": "-outputs.v_hat"}), ("errors", 1, "sign", "sign.other")),
    "a sign of a slip plus a level": put(("signs", "sign.rail", "outputs.v_hat + outputs.a_hat_rail")),
    "an error between two others": put(("errors", 0, "truth", "true.a_rail")),
    "one estimate for both errors": put(("errors", 1, "estimate", "outputs.v_hat")),
    "an error of the force in place of the level": put(("errors", 1, "estimate", "outputs.F_hat_rail")),
    "a state that no code has": lambda p: p["states"].update({"state.z_more": "outputs.v_hat"}),
    "a state by what it is itself": put(("states", "state.z_v", "state.z_v")),
    "a product of errors in the matrix": put(("matrix", 0, 0, "9/10 + true.v - outputs.v_hat")),
    "a matrix over what follows": put(("matrix", 0, 0, "9/10 + 0*inputs.later")),
    "a matrix of three columns": lambda p: [row.append("0") for row in p["matrix"]],
    "V of one error alone": put(("lyapunov_matrix", [["1186/25"]])),
    "V that is a hair from singular": put(("lyapunov_matrix", [["4", "2"], ["2", "1"]])),
    "V with a number that is a sum": put(("lyapunov_matrix", 0, 0, "47 + 11/25")),
    "a rate with a unit": put(("decay_rate", "10 1/s")),
    "a growth below one": put(("reversals", 0, "growth", "1/2")),
    "a dwell time of less than no sample": put(("reversals", 0, "dwell", "-54")),
    "a dwell time of half a sample": put(("reversals", 0, "dwell", "107/2")),
    "a reversal of a sign that is not there": put(("reversals", 0, "sign", "sign.ground")),
    "a rest that is a level": put(("rest", ["0", "true.a_rail"])),
    "a box of both ends the wrong way round": put(("box", {"true.v": ["5", "-5"]})),
    "a box that hides in a sign": put(("box", {"sign.rail": ["1", "1"]})),
    "a cover that cuts what it does not hold": put(("cover", ["true.q", "0", "", ""])),
    "a cover of a text": put(("cover", "abcd")),
    "a mean velocity of a step that has none": put(("mean", {"inputs.x": "1/2"})),
    "a shared state that is an error's": put(("shared", {"state.z_rail": "state.z_rail"})),
    "along a sign that is none": put(("along", {"true.v": "sign.no"})),
    "a name that is the machine's": put(("errors", 0, "truth", "true.")),
}  # fmt: skip


@pytest.mark.parametrize("why", PROOFS)
def test_a_proof_of_another_machine_or_claim_is_refused(why: str) -> None:
    """Of proof.json alone."""
    files, proof = sources("one_mass"), certificate("one_mass", "proof.json")
    PROOFS[why](proof)
    with pytest.raises(verify.Refused):
        verify.by_kernel_alone(proof, files)


SETS: dict[str, Callable[[Any], object]] = {
    "a noise of a velocity": put(("noise", {"true.v": "0"})),
    "a drift of what is not there": lambda e: e["drift"].update({"true.q": "0"}),
    "a set that is a point": put(("sets", 0, "matrix", [["0", "0"], ["0", "0"]])),
    "a set around a direction": put(("sets", 0, "matrix", [["1", "0"], ["0", "0"]])),
    "a weight that is left out": lambda e: e["sets"][0]["weights"].pop(),
    "a weight of a disturbance that is none": put(("sets", 0, "weights", 1, "0")),
    "a bound below zero": put(("sets", 0, "rows", 0, 2, "-1")),
    "a bound from the first sample on": put(("sets", 0, "samples", "0")),
    "samples below zero": put(("sets", 0, "samples", "-1")),
    "samples as a number with a point": put(("sets", 0, "samples", "267.0")),
    "a start at which nothing is known": put(("sets", 0, "after", 0, "start", ["1", "1000"])),
    "a start of one error": put(("sets", 0, "after", 0, "start", ["1"])),
    "bounds that come too early": put(("sets", 0, "after", 0, "bounds", 0, 0, "1")),
    "a box that is not within the set": put(("sets", 0, "within", ["1", "10", "10"])),
    "friction of any kind with a sign in the proof": put(("sets", 0, "friction", "any")),
    "a reversal of no samples": put(("reversals", 0, "samples", "0"), ("reversals", 0, "after", ["0", "0"])),
    "a reversal without a change of the slip": put(("reversals", 0, "change", "0")),
    "a reversal from larger errors": put(("reversals", 0, "before", 1, "20")),
    "a reversal of more turns": put(("reversals", 0, "turns", "3")),
    "a jump the other way": put(("reversals", 0, "jump", "-20")),
    "half of the friction": put(("push", 0, 2, "-1/2000*sign.rail")),
    "a shift without its sign": put(("shifts", 1, "(-1000)*noise.inputs.x")),
    "accelerations at measured places by another word": put(("forces", "true")),
}  # fmt: skip


@pytest.mark.parametrize("why", SETS)
def test_bounds_that_are_not_proved_are_refused(why: str) -> None:
    claim = certificate("one_mass", "ellipsoid.json")
    SETS[why](claim)
    files = sources("one_mass") | {"ellipsoid.json": json.dumps(claim).encode()}
    with pytest.raises(verify.Refused):
        check(certificate("one_mass", "proof.json"), files)


CERTIFICATES: dict[str, Callable[[Any], object]] = {
    "a matrix that is not its proof's": put(("matrix", 1, 0, "999")),
    "a reversal that turns nothing": put(("reversals", 0, "flips", [])),
    "a reversal that turns one error twice": put(("reversals", 0, "flips", [1, 1])),
    "a reversal of another contact": put(("reversals", 0, "contact", "ground")),
    "an error by another name": put(("error", 1, "name", "e_a_ground")),
    "a sample time of half": put(("sample_time", "1/2000")),
    "a rate that is too large": put(("decay_rate", "12")),
    "a growth that is too small": put(("reversals", 0, "growth", "3")),
    "a variable in two factors": put(
        ("variables", {"v": ["-5", "5"]}), ("parameters", [{"name": "q", "expression": "v"}]),
        ("matrix", 0, 0, ["*", "q", "q"])),
    "a parameter over one that follows": put(("parameters", [
        {"name": "q", "expression": "r"}, {"name": "r", "expression": "1"}]), ("matrix", 0, 0, ["+", "-101", "q"])),
    "a parameter that stands for two": put(("parameters", [
        {"name": "q", "expression": "1"}, {"name": "q", "expression": "0"}]), ("matrix", 0, 0, ["+", "-101", "q"])),
    "a variable that is a parameter too": put(
        ("variables", {"q": ["1", "1"]}), ("parameters", [{"name": "q", "expression": "0"}])),
    "a range turned round": put(("variables", {"v": ["5", "-5"]})),
    "a cut outside the range": put(("variables", {"v": ["-5", "5"]}), ("splits", {"v": ["-5", "7", "5"]})),
    "a step that it is not": put(("observer", "integration", "implicit")),
    "a direction and a reversal": put(("along", ["1", "0"])),
    "P of one error": put(("lyapunov_matrix", [["1"]])),
}  # fmt: skip


@pytest.mark.parametrize("why", CERTIFICATES)
def test_a_certificate_of_something_else_is_refused_or_bound_to_no_code(why: str) -> None:
    content = copy.deepcopy(certificate("one_mass"))
    CERTIFICATES[why](content)
    try:
        report = check(content, sources("one_mass"))
    except verify.Refused:
        return
    assert report.unproved and not report.proved


def test_a_truth_that_is_called_as_a_sign_has_no_range_of_one() -> None:
    """A V of its own was shown to fall for s_rail in [-1, 1], a sign by its name, and bound to a C where it is a speed.

    The proof is about speeds true.s_rail in [-5, 5], of which the certificate's V says nothing beyond 1.
    """
    text, files, proof_text = made("quadratic_drag")
    code = files["one_mass.c"].replace("v_hat * abs_v_hat", "v_hat * v_hat")
    proof = json.loads(proof_text.replace("true.v", "true.s_rail"))
    force = "-true.a_rail*sign.rail - parameters.quadratic_drag_x_c*true.s_rail*true.s_rail + inputs.w"
    proof |= {
        "force": [force],
        "acceleration": {"true.s_rail": f"({force})/parameters.m"},
        "along": {"true.s_rail": ""},
    }
    proof["matrix"][0][0] = "1 + 1/1000*(-100 + -4*true.s_rail)"
    proof |= {"box": {"true.s_rail": ["-5", "5"]}, "decay_rate": "-100", "reversals": []}
    content = json.loads(text) | {"variables": {"s_rail": ["-1", "1"]}, "splits": {}, "reversals": []}
    content["parameters"] = [{"name": "q", "expression": "s_rail"}]
    content["matrix"] = [[["+", "-100", ["*", "-4", "q"]], "-1"], ["1000", "0"]]
    content["subject"]["files"]["one_mass.c"] = hashlib.sha256(code.encode()).hexdigest()
    given = {name: each.encode() for name, each in (files | {"one_mass.c": code}).items()}
    verify.by_kernel_alone(proof, given)
    report = check(content, given | {"proof.json": json.dumps(proof).encode()})
    assert report.unproved and not report.proved
