"""Forgeries of exp, magnitudes and states that machine and code share: each is refused, by C text and by proof."""

from __future__ import annotations

import decimal
import hashlib
import json
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import theorem, verify
from codegen.spec import parse_spec

SPEC = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text("utf-8")
EFFECTS = {
    "stribeck": "rail], parameters: {delta: 10, v_s: 0.1}",
    "friction_drift": "rail], parameters: {delta: 5, T: 100}",
    "quadratic_drag": "x], parameters: {c: 2}",
    "input_delay": "w], parameters: {T: 0.003}",
    "actuator_lag": "w], parameters: {tau: 0.01}",
}


@cache
def made(kind: str) -> tuple[str, dict[str, str], str]:
    """Certificate, C and header, and proof of one_mass with this effect."""
    effect = f"effects: [{{kind: {kind}, on: [{EFFECTS[kind]}}}]"
    machine = Derived(parse_spec(SPEC.replace("effects: []", effect), Path("made.yaml")))
    assert isinstance(machine.outcome, Certificate) and machine.outcome.kernel is not None
    return machine.outcome.text, machine.sources, machine.outcome.kernel


def alone(proof: dict[str, Any], sources: dict[str, str]) -> None:
    verify.by_kernel_alone(proof, {name: text.encode() for name, text in sources.items()})


@pytest.mark.parametrize("kind", EFFECTS)
def test_each_is_verified_in_its_domain(kind: str) -> None:
    text, sources, proof = made(kind)
    files = {name: text.encode() for name, text in sources.items()} | {"proof.json": proof.encode()}
    report = verify.check(text, sources=files)
    assert not report.unproved and report.proved and not report.whole
    said = [line for line in report.proved if line.startswith("only where the machine's")]
    assert len(said) == {"friction_drift": 1, "input_delay": 3, "actuator_lag": 1}.get(kind, 0)
    start = "at its start 0.0, in a sample it becomes sample_time + t"
    assert kind != "friction_drift" or said == [f"only where the machine's t is that of the code: {start}"]


ARGUMENT = "exp(-(parameters->one_over_stribeck_rail_v_s_squared * v_hat * v_hat))"
HEAD = "void one_mass_prepare("
STEP = "    /* velocity estimate, (4.25) */\n"
OTHER = "does not move the errors"
EQUATION = "has another equation in the C"
CLOCK = "    state->t = state->t + parameters->sample_time;\n"
FORM = "not of the form|holds more than|cannot be read|out of place|is a function"
C_TEXTS: list[tuple[str, str, str, str]] = [
    ("stribeck", "* v_hat * v_hat)", "* v_hat * v_hat * 1.01)", OTHER),
    ("stribeck", "exp(-(param", "exp((param", OTHER),
    ("stribeck", ARGUMENT, ARGUMENT.replace("exp", "cos"), OTHER),
    ("stribeck", ARGUMENT, ARGUMENT.replace("exp", "fabs"), OTHER),
    ("stribeck", ARGUMENT, ARGUMENT.replace("exp", "expf"), "C calls expf"),
    ("stribeck", ARGUMENT, ARGUMENT.replace("exp", "exp2"), "C calls exp2"),
    ("stribeck", ARGUMENT, f"({ARGUMENT} * {ARGUMENT})", OTHER),
    ("stribeck", ARGUMENT, f"({ARGUMENT} + 1e-9)", OTHER),
    ("stribeck", ARGUMENT, "1.0", OTHER),
    ("stribeck", ARGUMENT, ARGUMENT.replace("v_hat * v_hat", "v_hat * inputs->x"), OTHER),
    ("stribeck", ARGUMENT, ARGUMENT.replace("v_hat * v_hat", "state->z_v * state->z_v"), OTHER),
    ("stribeck", ARGUMENT, ARGUMENT.replace("v_hat * v_hat", "a_hat_rail * v_hat"), OTHER),
    ("stribeck", ARGUMENT, ARGUMENT.replace("v_hat * v_hat", "v_hat"), OTHER),
    ("stribeck", "known_rail + sign_rail * a", "sign_rail * a_hat_rail - known_rail + 0.0 * a", OTHER),
    ("stribeck", "stribeck_rail_delta * sign_rail", "stribeck_rail_delta * v_hat", OTHER),
    ("stribeck", "stribeck_rail_delta * sign_rail", "stribeck_rail_delta", OTHER),
    ("stribeck", "inputs->w - F_hat_rail", "inputs->w - F_hat_rail + exp(v_hat) - exp(v_hat)", "exp of what may be"),
    ("stribeck", "outputs->F_hat_rail = F", "outputs->F_hat_rail = exp(9.0 * v_hat) + F", "exp of what may be"),
    ("stribeck", "outputs->v_hat - parameters->K_v", "exp(9.0 * outputs->v_hat) - exp(9.0 * outputs->v_hat) + "
     "outputs->v_hat - parameters->K_v", "exp of what may be"),
    ("stribeck", "inputs->w - F_hat_rail", "inputs->w - F_hat_rail + 0.0 * exp(710.0)", "too large"),
    ("stribeck", "const double z_v_next =", "const double z_v_next = 1e60 * v_hat * (exp(1.0) - "
     "2.7182818284590452353602874713526624977572470937000) +", "is its rounding"),
    ("stribeck", "        * parameters->stribeck_rail_v_s);", "        * 0.2);", "prepare gives others"),
    ("stribeck", "h_K_F = ", "h_K_F = 0.0 * exp(710.0) + ", "too large"),
    ("stribeck", "h_K_F = ", "h_K_F = exp(-0.000001) * ", "prepare gives others"),
    ("stribeck", HEAD, f"static double exp(double u) {{ return 1.0; }}\n{HEAD}", FORM),
    ("stribeck", "#include <math.h>\n", "#include <math.h>\n#define exp(u) 1.0\n", FORM),
    ("stribeck", "#include <math.h>\n", "#define exp(u) 1.0\n#include <math.h>\n", FORM),
    ("stribeck", STEP, f"    double (*exp)(double) = cos;\n{STEP}", "cannot be read"),
    ("friction_drift", "state->t + parameters->sample_time;\n\n    /* this", "state->t + 2.0 * parameters->sample_time;"
     "\n\n    /* this", EQUATION),
    ("friction_drift", "const double t_next = state->t ", "const double t_next = 1.5 * state->t ", EQUATION),
    ("friction_drift", "const double t_next = state->t ", "const double t_next = v_hat + state->t ", EQUATION),
    ("friction_drift", "T * state->t))", "T * state->t * 2.0))", OTHER),
    ("friction_drift", "exp(-(", "exp((", "exp of what may be|does not move"),
    ("friction_drift", "T * state->t))", "T * inputs->x))", OTHER),
    ("friction_drift", "state->t = 0.0;\n    state->mode = ONE_MASS_RUNNING", "state->t = -5.0;\n    "
     "state->mode = ONE_MASS_RUNNING", "exp of what may be"),
    ("friction_drift", "state->t = 0.0;\n    state->mode = ONE_MASS_RUNNING", "state->t = inputs->x;\n    "
     "state->mode = ONE_MASS_RUNNING", "exp of what may be"),
    ("friction_drift", "state->t = 0.0;\n    state->mode = ONE_MASS_RUNNING", "state->mode = ONE_MASS_RUNNING",
     "not set"),
    ("friction_drift", CLOCK + "\n    /* after", "    state->t = -100000.0;\n\n    /* after", "does not go on"),
    ("friction_drift", CLOCK + "\n    /* after", "\n    /* after", "does not go on"),
    ("friction_drift", CLOCK + "\n    /* after", "    state->t = state->t + parameters->m;\n\n    /* after",
     "does not go on"),
    ("friction_drift", CLOCK + "    state->mode", "    state->t = state->t - 100000.0;\n    state->mode",
     "does not go on"),
    ("friction_drift", CLOCK + "    state->mode", "    state->mode", "does not go on"),
    ("friction_drift", "state->t = 0.0;\n        state->mode", "state->t = -100000.0;\n        state->mode",
     "exp of what may be"),
    ("friction_drift", "state->t = 0.0;\n    state->mode = ONE_MASS_RUNNING", "const double friction_drift_rail_T = 5.0"
     ";\n    state->t = friction_drift_rail_T;\n    state->mode = ONE_MASS_RUNNING", "nothing that is known here"),
    ("friction_drift", "state->t = 0.0;\n    state->mode = ONE_MASS_RUNNING", "state->t = 0.0;\n    state->t = state->t"
     " + 3.0;\n    state->mode = ONE_MASS_RUNNING", "nothing that is known here"),
    ("stribeck", "outputs->F_hat_rail = F", "outputs->F_hat_rail = exp(-(0.5 * inputs->w * inputs->w + 0.25 * inputs->x"
     " * inputs->x + 0.4 * inputs->x * state->z_v + 0.05 * state->z_v * state->z_v)) + F", "not positive semidefinite"),
    ("quadratic_drag", "v_hat * abs_v_hat)", "v_hat * v_hat)", OTHER),
    ("quadratic_drag", "v_hat * abs_v_hat)", "abs_v_hat * abs_v_hat)", OTHER),
    ("quadratic_drag", "v_hat * abs_v_hat)", "v_hat * fabs(1.01 * v_hat))", OTHER),
    ("quadratic_drag", "v_hat * abs_v_hat)", "v_hat * fabs(inputs->x))", OTHER),
    ("quadratic_drag", "- parameters->quadratic", "+ parameters->quadratic", OTHER),
    ("quadratic_drag", "abs_v_hat = fabs(v_hat)", "abs_v_hat = fabs(v_hat - 0.001)", "do not show|does not move"),
    ("input_delay", "w_past_2_next = state->w_past_1", "w_past_2_next = inputs->w", EQUATION),
    ("input_delay", "w_past_1_next = inputs->w", "w_past_1_next = 1.01 * inputs->w", EQUATION),
    ("input_delay", "w_past_3_next = state->w_past_2", "w_past_3_next = state->w_past_3", EQUATION),
    ("input_delay", "(state->w_past_3 - F", "(state->w_past_2 - F", OTHER),
    ("input_delay", "(state->w_past_3 - F", "(inputs->w - F", OTHER),
    ("actuator_lag", "state->w_lagged - inputs->w", "state->w_lagged + inputs->w", f"{EQUATION}|does not move"),
    ("actuator_lag", "w_lagged_next = inputs->w + ", "w_lagged_next = inputs->w - ", EQUATION),
    ("actuator_lag", "w_effective = inputs->w + parameters->constant_1", "w_effective = inputs->w + 0.5", OTHER),
    ("actuator_lag", "        / parameters->actuator_lag_w_tau));", "        / 0.02));", "prepare gives others"),
    ("actuator_lag", "exp(-(parameters->sample_time", "cos(-(parameters->sample_time", "sin or cos|others"),
]  # fmt: skip


@pytest.mark.parametrize("case", C_TEXTS, ids=lambda case: f"{case[0]}: {case[2][:60].strip()}")
def test_other_c_is_refused(case: tuple[str, str, str, str]) -> None:
    kind, old, new, why = case
    _, sources, proof = made(kind)
    assert sources["one_mass.c"].count(old) == 1
    with pytest.raises(verify.Refused, match=why):
        alone(json.loads(proof), sources | {"one_mass.c": sources["one_mass.c"].replace(old, new)})


def test_a_decimal_of_an_exponential_that_is_another_is_refused() -> None:
    _, sources, proof = made("actuator_lag")
    header = sources["one_mass.h"]
    assert header.count("0.9048374180359595") == 1
    other = sources | {"one_mass.h": header.replace("0.9048374180359595", "0.9048374180359695")}
    with pytest.raises(verify.Refused, match="prepare gives others"):
        alone(json.loads(proof), other)


def texts(proof: dict[str, Any], old: str, new: str, *fields: str) -> None:
    """A text in place of another in these fields."""
    for field in fields:
        said = json.dumps(proof[field])
        assert old in said
        proof[field] = json.loads(said.replace(old, new))


MACHINE = ("force", "acceleration")
PROOFS: list[tuple[str, str, Callable[[dict[str, Any]], object], str]] = [
    ("stribeck", "another argument", lambda p: texts(p, "exp(-true.v*true.v/",
     "exp(-2*true.v*true.v/", *MACHINE), OTHER),
    ("stribeck", "another function", lambda p: texts(p, "exp(", "cos(", *MACHINE), OTHER),
    ("stribeck", "no exp in the machine", lambda p: texts(p, "exp(", "0*exp(", *MACHINE), OTHER),
    ("stribeck", "no exp in the matrix", lambda p: texts(p, "exp(", "0*exp(", "matrix"), OTHER),
    ("stribeck", "an exp of the estimate", lambda p: texts(p, "exp(((-100) * (true.v*true.v)))",
     "exp(((-100) * (outputs.v_hat*outputs.v_hat)))", "matrix"), "nothing that is known"),
    ("stribeck", "a rising exp in the matrix", lambda p: texts(p, "exp(((-100)", "exp(((100)", "matrix"), OTHER),
    ("stribeck", "no range", lambda p: p["box"].clear(), "without a range"),
    ("stribeck", "one cell", lambda p: p.update(cover=""), "V may not fall"),
    ("stribeck", "a faster fall", lambda p: p.update(decay_rate="6"), "V may not fall"),
    ("stribeck", "a gap in the cover", lambda p: p.update(cover=["true.v", "6", "", ""]), "not cut between"),
    ("stribeck", "a range of the variable of exp", lambda p: p["box"].update({"?2": ["0", "0"]}), "no free variable"),
    ("stribeck", "a range of its share", lambda p: p["box"].update({"?2 share t": ["0", "0"]}), "no free variable"),
    ("stribeck", "a cut of its share", lambda p: p.update(cover=["?2 share t", "1/2", "", ""]), "V may not fall"),
    ("stribeck", "a level that is exp", lambda p: p["states"].update(
        {"state.z_rail": p["states"]["state.z_rail"] + "*exp(-outputs.v_hat*outputs.v_hat)"}),
     "no polynomial|do not show"),
    ("friction_drift", "another clock", lambda p: p["shared"].update({"state.t": "2*parameters.sample_time + state.t"}),
     EQUATION),
    ("friction_drift", "no clock", lambda p: p.pop("shared"), "state.t|is fed back to a state"),
    ("friction_drift", "a state with an error too", lambda p: p["shared"].update({"state.z_v": "state.z_v"}),
     "no state without an error"),
    ("friction_drift", "a state that is not there", lambda p: p["shared"].update({"state.z": "0"}),
     "no state without an error"),
    ("friction_drift", "a clock of the truth", lambda p: p["shared"].update({"state.t": "state.t + true.v"}),
     "nothing that is known"),
    ("friction_drift", "a formula besides", lambda p: p["states"].update({"state.t": "0"}),
     "no state without an error|not"),
    ("friction_drift", "a range of the clock", lambda p: p["box"].update({"state.t": ["0", "1"]}), "no free variable"),
    ("quadratic_drag", "no sign", lambda p: texts(p, "sign.rail*true.v", "true.v", "matrix"), OTHER),
    ("quadratic_drag", "another range", lambda p: p["box"].update({"true.v": ["-50", "50"]}), "V may not fall"),
    ("quadratic_drag", "no range", lambda p: p["box"].clear(), "without a range"),
    ("input_delay", "a shorter delay", lambda p: texts(p, "state.w_past_3", "state.w_past_2", *MACHINE), OTHER),
    ("input_delay", "none", lambda p: texts(p, "state.w_past_3", "inputs.w", *MACHINE), OTHER),
    ("input_delay", "one state left out", lambda p: p["shared"].pop("state.w_past_2"), "is fed back to a state"),
    ("input_delay", "in another order", lambda p: p.update(shared=dict(reversed(p["shared"].items()))), "no memory"),
    ("actuator_lag", "another lag", lambda p: texts(p, "actuator_lag_w_tau", "m", "shared"), EQUATION),
    ("actuator_lag", "no lag in the force", lambda p: texts(p, "exp(", "0*exp(", *MACHINE), OTHER),
]  # fmt: skip


@pytest.mark.parametrize("case", PROOFS, ids=lambda case: f"{case[0]}: {case[1]}")
def test_a_forged_proof_is_refused(case: tuple[str, str, Callable[[dict[str, Any]], object], str]) -> None:
    kind, _, change, why = case
    _, sources, text = made(kind)
    proof = json.loads(text)
    change(proof)
    with pytest.raises(verify.Refused, match=why):
        alone(proof, sources)


@pytest.mark.parametrize(
    ("factor", "of"), [("1.5 * ", "3/2*"), ("(-1.0) * ", "-"), ("1.0000001 * ", "10000001/10000000*")]
)
def test_a_shared_state_that_may_grow_is_refused(factor: str, of: str) -> None:
    """So no axis of an observer that is unstable is left out of the errors as one that the machine has too."""
    _, sources, text = made("friction_drift")
    proof = json.loads(text)
    proof["shared"]["state.t"] = f"parameters.sample_time + {of}state.t"
    code = sources["one_mass.c"].replace("const double t_next = state->t ", f"const double t_next = {factor}state->t ")
    with pytest.raises(verify.Refused, match="no memory, lag or clock"):
        alone(proof, sources | {"one_mass.c": code})


def test_a_range_of_a_magnitude_is_one_of_its_own_sign_alone() -> None:
    proof = json.loads(made("quadratic_drag")[2])
    shown = {"along": {e["truth"]: e["sign"] for e in proof["errors"]} | proof["along"]}

    def ranges(box: dict[str, list[int]], **other: Any) -> dict[str, list[Fraction]]:
        return theorem.ranges(proof | other, shown | {"box": box})

    assert proof["box"] == {"true.v": ["0", "5"]}
    assert ranges({"true.v": [0, 5]}) == {"true.v": [-5, 5]}
    assert ranges({"true.v": [0, 5]}, signs={"sign.rail": "outputs.v_hat + inputs.x"}) == {}
    assert ranges({"true.v": [1, 5]}) == {"true.v": [1, 5]}
    assert ranges({"true.v": [-1, 5]}) == {}


def test_a_certificate_of_other_speeds_than_the_proof_is_not_bound() -> None:
    certificate, sources, text = made("quadratic_drag")
    files = {name: text.encode() for name, text in sources.items()}

    def checked(*ends: str) -> verify.Report:
        proof = json.loads(text) | {"box": {"true.v": ends}}
        return verify.check(certificate, sources=files | {"proof.json": json.dumps(proof).encode()})

    assert checked("0", "5").proved and checked("-5", "5").proved
    assert checked("0", "4").unproved
    with pytest.raises(verify.Refused, match="V may not fall"):
        checked("0", "6")


def at_a_point(sign: str, v: str) -> tuple[str, dict[str, bytes]]:
    """A refutation of the quadratic drag of 20 N s2/m2 at this sign and speed: A = [[-100 - 40 s v, -1], [1000, 0]]."""
    effect = "effects: [{kind: quadratic_drag, on: [x], parameters: {c: 20}}]"
    machine = Derived(parse_spec(SPEC.replace("effects: []", effect), Path("made.yaml")))
    assert isinstance(machine.outcome, Certificate) and machine.outcome.kernel is not None
    files = {name: text.encode() for name, text in machine.sources.items()}
    slope = -100 - 40 * float(sign) * float(v)
    step = np.eye(2) + 0.001 * np.array([[slope, -1], [1000, 0]])
    fall = 1 - 2 * 0.001 * (0.001 if slope > 0 else 40)
    P = np.linalg.solve(fall * np.eye(4) - np.kron(step.T, step.T), np.eye(2).flatten()).reshape(2, 2)
    content = json.loads(machine.outcome.text) | {
        "lyapunov_matrix": [[str(Fraction(round(x * 1000), 1000)) for x in row] for row in (P + P.T) / 2],
        "along": [str(Fraction(round(x * 1000), 1000)) for x in np.linalg.eigh(P + P.T)[1][:, 0]],
        "decay_rate": "1/1000" if slope > 0 else "40",
        "reversals": [],
        "variables": {"v": [v, v], "s_rail": [sign, sign]},
        "parameters": [{"name": "q", "expression": ["*", "s_rail", "v"]}],
        "matrix": [[["+", "-100", ["*", "-40", "q"]], "-1"], ["1000", "0"]],
    }
    return json.dumps(content), files | {"proof.json": machine.outcome.kernel.encode()}


@pytest.mark.parametrize(("sign", "v", "bound"), [("-1", "3", False), ("1", "3", True), ("-1", "-3", True)])
def test_a_refutation_is_of_a_point_where_the_sign_is_that_of_the_slip(sign: str, v: str, bound: bool) -> None:
    """At s v = -3 the error would grow, and no machine is there: `limit.json` said so beside a true certificate."""
    text, files = at_a_point(sign, v)
    assert bool(verify.check(text, sources=files).proved) == bound


def test_a_v_of_its_own_is_not_bound_where_it_is_of_one_direction_alone() -> None:
    """Of drag that drives in one direction V was shown to fall for speeds above 0, and both were printed."""
    certificate, sources, text = made("quadratic_drag")
    code = sources["one_mass.c"].replace("v_hat * abs_v_hat", "v_hat * v_hat")
    force = "-true.a_rail*sign.rail - parameters.quadratic_drag_x_c*true.v*true.v + inputs.w"
    proof = json.loads(text) | {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}
    proof["matrix"][0][0] = "1 + 1/1000*(-100 + -4*true.v)"
    proof |= {"box": {"true.v": ["1", "5"]}, "decay_rate": "-100", "reversals": []}
    content = json.loads(certificate) | {"variables": {"v": ["1", "5"]}, "reversals": []}
    content["parameters"] = [{"name": "q", "expression": "v"}]
    content["matrix"] = [[["+", "-100", ["*", "-4", "q"]], "-1"], ["1000", "0"]]
    content["subject"]["files"]["one_mass.c"] = hashlib.sha256(code.encode()).hexdigest()
    files = {name: text.encode() for name, text in (sources | {"one_mass.c": code}).items()}
    report = verify.check(json.dumps(content), sources=files | {"proof.json": json.dumps(proof).encode()})
    assert report.unproved and not report.proved
    alone(proof, sources | {"one_mass.c": code})


def enlarged(digits: int = 50) -> str:
    """1e60 times what is left of e beside its first digits, which were taken for it: -4e10."""
    return f"1e60*(exp(1) - {decimal.Context(digits).exp(1)})"


def test_a_machine_of_what_is_left_of_an_exponential_is_refused() -> None:
    """It was printed, and proved to be the one without."""
    _, sources, text = made("actuator_lag")
    proof, before = json.loads(text), "-true.a_rail*sign.rail"
    for field, key in (("force", 0), ("acceleration", "true.v")):
        assert before in proof[field][key]
        proof[field][key] = proof[field][key].replace(before, f"{before} - {enlarged()}*true.v")
    with pytest.raises(verify.Refused, match="is its rounding"):
        alone(proof, sources)


def test_a_matrix_with_the_exponential_of_a_number_is_not_rounded() -> None:
    """Its V was shown to fall, by numbers of 50 digits, where A is -4e10."""
    content = json.loads(made("actuator_lag")[0]) | {"reversals": [], "variables": {}, "splits": {}, "cover": [""]}
    content |= {"error": content["error"][:1]}
    e = Fraction(str(decimal.Context(50).exp(1)))
    content["parameters"] = [{"name": "q", "expression": ["*", str(10**60), ["+", ["exp", "1"], str(-e)]]}]
    content |= {"matrix": [[["+", "-1", "q"]]], "lyapunov_matrix": [["1"]], "decay_rate": "1/2"}
    with pytest.raises(verify.Refused, match="exp of a number"):
        verify.check(json.dumps(content), sources={})


def test_the_decimals_of_one_exponential_do_not_lead_away_from_it() -> None:
    """Each parameter may be off by 2^-50 from the last: ten thousand by 1e-11."""
    _, sources, text = made("actuator_lag")
    of, value = "exp_minus_h_over_actuator_lag_w_tau", "0.9048374180359595"
    code, header = sources["one_mass.c"], sources["one_mass.h"]
    line = code[code.index(f"    parameters->{of} =") :].split(";")[0] + ";\n"
    code = code.replace(line, line.replace(of, "again") + line)
    assert header.count(f"double {of};") == 1 and header.count(f"{value}, ") == 1
    header = header.replace(f"double {of};", f"double again; double {of};")
    for decimal_of, accepted in ((value, True), ("0.9048374180359596", False)):
        other = {"one_mass.c": code, "one_mass.h": header.replace(f"{value}, ", f"{decimal_of}, {value}, ")}
        if accepted:
            alone(json.loads(text), sources | other)
        else:
            with pytest.raises(verify.Refused, match="prepare gives others"):
                alone(json.loads(text), sources | other)


def test_where_a_lag_starts_is_not_called_as_a_parameter_is() -> None:
    """An input `rail_a` that no field of the proof names: "at its start rail_a" was printed beside "rail_a = 50"."""
    _, sources, text = made("actuator_lag")
    code, header = sources["one_mass.c"], sources["one_mass.h"]
    for old, new in (
        ("state->w_lagged = inputs->w;\n    state->mode", "state->w_lagged = inputs->rail_a;\n    state->mode"),
        (
            "const double check = fabs(inputs->x) + fabs(inputs->w) +",
            "const double check = fabs(inputs->x) + fabs(inputs->w) + fabs(inputs->rail_a) +",
        ),
        (
            "given = fabs(inputs->x) + fabs(inputs->w);",
            "given = fabs(inputs->x) + fabs(inputs->w) + fabs(inputs->rail_a);",
        ),
        (
            "const double check = z_v_next",
            "const double more = inputs->rail_a;\n    const double check = more + z_v_next",
        ),
    ):
        assert old in code
        code = code.replace(old, new, 1)
    assert header.count("double w; /* N: input */") == 1
    header = header.replace("double w; /* N: input */", "double w; /* N: input */ double rail_a; /* N: input */")
    report = verify.check(text, sources={"one_mass.c": code.encode(), "one_mass.h": header.encode()})
    assert any("at its start inputs.rail_a, in a sample" in line for line in report.proved)
    assert any("parameters.rail_a = 50" in line for line in report.proved)
