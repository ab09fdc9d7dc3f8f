"""Sines and cosines of parameters, as of an inclined axis: proved of the C, with 50 digits that prove nothing false."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import decimals, rounding, verify
from codegen.spec import parse_spec
from tests.checker.forged import POINT, certificate, changed, check, sources

SPEC = """\
name: incline
coordinates:
  x: {velocity: v, unit: m}
  y: {velocity: u, unit: m}
inputs:
  w: {unit: N}
parameters:
  m1: {value: 12, unit: kg}
  m2: {value: 3, unit: kg}
  grav: {value: 9.81, unit: m/s^2}
  alpha: {value: ALPHA, unit: deg}
  beta: {value: 90, unit: deg}
mass_matrix: [[m1 + m2, m2*cos(alpha)], [m2*cos(alpha), m2]]
force: [w*cos(alpha) - m1*grav*cos(beta), -m2*grav*sin(alpha)]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 50, unit: N}
    - {name: top, law: coulomb, a: 5, unit: N}
observer:
  kind: gcfo
  velocity: estimated
  gains: {K_F: [10, 10], K_v: [100, 100]}
  sample_time: 1 ms
code: {precision: PRECISION}
envelope: {v: [-5, 5], u: [-5, 5]}
"""


@cache
def made(alpha: str, precision: str = "double") -> tuple[str, str, dict[str, str]]:
    """(certificate, proof, files) of a cart on an incline of so many degrees."""
    text = SPEC.replace("ALPHA", alpha).replace("PRECISION", precision)
    machine = Derived(parse_spec(text, Path("incline.yaml")))
    outcome = machine.outcome
    assert isinstance(outcome, Certificate), outcome
    assert outcome.kernel is not None, outcome.not_by_kernel
    return outcome.text, outcome.kernel, dict(machine.files)


def alone(proof: dict[str, Any], files: dict[str, str]) -> dict[str, Any]:
    return verify.by_kernel_alone(proof, {name: text.encode() for name, text in files.items()})


@pytest.mark.parametrize("function", ["sin", "cos"])
@pytest.mark.parametrize("x", ["0", "1", "-7/10", "1.5707963267948966", "3.141592653589793", "-99.9", "100"])
def test_the_decimal_is_the_value_to_fifty_places(function: str, x: str) -> None:
    mpmath.mp.dps = 80
    exact = getattr(mpmath, function)(mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator)
    found = decimals.decimal(function, Fraction(x))
    assert abs(mpmath.mpf(found.numerator) / found.denominator - exact) <= mpmath.mpf("0.5000001e-50")
    assert (10**50 * found).denominator == 1


def test_an_angle_of_many_turns_is_refused() -> None:
    with pytest.raises(ValueError, match="beyond 100"):
        decimals.decimal("cos", Fraction("100.1"))


@pytest.mark.parametrize(
    ("alpha", "precision"), [("30", "double"), ("0", "double"), ("-17.5", "double"), ("30", "single")]
)
def test_a_constant_angle_is_proved_of_the_c(alpha: str, precision: str) -> None:
    """cos(beta) is 6e-17 in doubles, and 2e-17 for the header's decimal of 90 degrees."""
    text, proof, files = made(alpha, precision)
    report = verify.check(
        text, sources={name: of.encode() for name, of in files.items()} | {"proof.json": proof.encode()}
    )
    assert report.proved and report.whole and not report.unproved


def test_an_input_gain_that_is_only_rounding_is_refused() -> None:
    """The cosine of a right angle times the force: it is not 0 in the C, and no digit of it is right."""
    text = SPEC.replace("ALPHA", "90").replace("PRECISION", "double")
    outcome = Derived(parse_spec(text, Path("incline.yaml"))).outcome
    assert isinstance(outcome, Certificate) and outcome.kernel is None
    assert outcome.not_by_kernel is not None and "is its rounding" in outcome.not_by_kernel


@pytest.mark.parametrize(
    ("file", "old", "new", "why"),
    [
        ("h", "14.715", "14.7150001", "prepare gives others"),
        ("h", "0.8660254037844386", "0.86602540378444", "prepare gives others"),
        ("c", "sin(parameters->alpha)", "cos(parameters->alpha)", "prepare gives others"),
        ("c", "cos(parameters->alpha)", "sin(parameters->alpha)", "prepare gives others"),
    ],
)
def test_another_value_in_the_c_is_refused(file: str, old: str, new: str, why: str) -> None:
    _, proof, files = made("30")
    name = f"incline.{file}"
    assert old in files[name], old
    with pytest.raises(verify.Refused, match=why):
        alone(json.loads(proof), files | {name: files[name].replace(old, new)})


def test_another_incline_of_the_machine_is_refused() -> None:
    _, proof, files = made("30")
    other = proof.replace("sin(parameters.alpha)", "cos(parameters.alpha)")
    assert other != proof
    with pytest.raises(verify.Refused, match="does not move the errors"):
        alone(json.loads(other), files)


def test_the_bound_of_a_parameter_holds_what_the_rounding_of_its_angle_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """m g cos(90 degrees) is 7.2e-15 N in doubles and 2.3e-15 N exactly; 8 u of its own size is 2e-30 N."""
    found: dict[str, tuple[Any, int]] = {}
    true_bounds = rounding.parameter_bounds

    def kept(*given: Any) -> dict[str, tuple[Any, int]]:
        found.update(true_bounds(*given))
        return found

    monkeypatch.setattr(rounding, "parameter_bounds", kept)
    _, proof, files = made("30")
    alone(json.loads(proof), files)
    mpmath.mp.dps = 40
    exact = 12 * mpmath.mpf("9.81") * mpmath.cos(mpmath.mpf("1.5707963267948966"))
    off = abs(12 * 9.81 * math.cos(1.5707963267948966) - exact)
    size, n = found["parameters.m1_grav_cos_beta"]
    assert 1e-15 < off <= n * 2.0**-53 * float(size.constant()) < 1e-12


def left(argument: str = "1") -> str:
    """1e60 times what is left of a sine beside its first 50 digits, which the kernel takes for it; above 1e8."""
    digits = decimals.decimal("sin", Fraction(1))
    mpmath.mp.dps = 80
    assert abs(mpmath.sin(1) - mpmath.mpf(digits.numerator) / digits.denominator) * 10**60 > 10**8
    return f"1{'0' * 60}*(sin({argument}) - {digits.numerator}/{digits.denominator})"


def with_force(more: str) -> Any:
    """The proof of one_mass with another term in the machine's force."""
    proof = certificate("one_mass", "proof.json")
    (force,) = proof["force"]
    force += f" - {more}"
    return proof | {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}


@pytest.mark.parametrize("argument", ["1", "1 + inputs.x - inputs.x", "sgn(2 + 0*inputs.x)"])
@pytest.mark.parametrize("call", ["sin(", "(sin)(", "((sin)) ("])
def test_a_machine_of_what_is_left_of_a_sine_is_refused(call: str, argument: str) -> None:
    """C and Python call (sin)(x) too: the function was looked for as sin(, and found nowhere."""
    proof = with_force(f"{left(argument).replace('sin(', call)}*true.v")
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(proof, sources("one_mass"))


def test_a_machine_of_what_is_left_of_an_exp_is_refused() -> None:
    digits = decimals.decimal("exp", Fraction(1))
    proof = with_force(f"1{'0' * 60}*((exp)(1) - {digits.numerator}/{digits.denominator})*true.v")
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(proof, sources("one_mass"))


def test_a_sine_with_too_few_digits_is_refused() -> None:
    """sin(1.4e-50) is 1e-50 to 50 places: 1e50 times that was 1 in the proof, and is 1.4 in the C."""
    assert decimals.decimal("sin", Fraction(0)) == 0
    for function, x in (("sin", "1.4e-50"), ("sin", "-1e-60"), ("cos", "1.57079632679489661923132169163975144")):
        with pytest.raises(ValueError, match="below 10"):
            decimals.decimal(function, Fraction(x))
    content, files = changed("one_mass", ("parameters->h_K_F *", "parameters->h_K_F * (1e50 * sin(1.4e-50)) *"))
    with pytest.raises(verify.Refused, match="below 10"):
        check(content, files)
    with pytest.raises(verify.Refused, match="below 10"):
        check(with_force(f"(1{'0' * 50}*sin(14/1{'0' * 51}) - 1)*true.v"), sources("one_mass"))


@pytest.mark.parametrize(
    "domain", ["sin(inputs.x)*sin(inputs.x) + cos(inputs.x)*cos(inputs.x) - 1", "exp(inputs.x)*exp(-inputs.x) - 1"]
)
def test_a_domain_that_only_decimals_meet_is_refused(domain: str) -> None:
    """At every second point or so, 50 digits of sin^2 + cos^2 add up to more than 1."""
    files = {x: y for x, y in sources("one_mass").items() if x != "ellipsoid.json"}
    for n in range(1, 12):
        point = POINT | {"inputs.x": f"{n}/7"}
        with pytest.raises(verify.Refused, match=r"is its rounding|no point of domain"):
            check(certificate("one_mass", "proof.json") | {"domain": [domain], "witness": point}, files)


def test_a_speed_of_what_is_left_of_a_sine_is_refused() -> None:
    """Bounds where |v (1 + 1e60 (sin(1) - d))| > 1, so in nearly all motions, were shown for |v| > 1."""
    proof, files = certificate("one_mass", "proof.json"), sources("one_mass")
    claim = {x: y for x, y in json.loads(files["ellipsoid.json"]).items() if x != "reversals"}

    def with_slip(slip: str) -> verify.Report:
        return check(proof, files | {"ellipsoid.json": json.dumps(claim | {"above": {slip: "1"}}).encode()})

    assert with_slip("true.v").proved
    with pytest.raises(verify.Refused, match="is its rounding"):
        with_slip(f"true.v + {left()}*true.v")


def with_a_third_state(value: str, formula: str = "", z_v: str = "", **of: str) -> tuple[Any, dict[str, bytes]]:
    """The proof and the files of one_mass with a state c that each sample sets to a number.

    Args:
        formula: of c in `states`. z_v: what that of z_v holds besides.
        of: text of the C before (``old``) and after (``new``).
    """
    files, rail = sources("one_mass"), "    state->z_rail = "
    header, c = (files[f"one_mass.{end}"].decode() for end in "hc")
    for old, new in (
        (f"{rail}parameters->rail_a;\n", f"{rail}parameters->rail_a;\n    state->c = {value};\n"),
        ("+ fabs(state->z_rail);", "+ fabs(state->z_rail) + fabs(state->c);"),
        (f"    {rail}0.0;\n", f"    {rail}0.0;\n        state->c = 0.0;\n"),
        ("+ z_rail_next;", "+ z_rail_next + c_next;"),
        ("    const double z_v_next", f"    const double c_next = {value};\n    const double z_v_next"),
        (f"    {rail}z_rail_next;\n", f"    {rail}z_rail_next;\n        state->c = c_next;\n"),
        ("fabs(outputs->v_hat);\n", f"fabs(outputs->v_hat);\n    state->c = {value};\n"),
        *([(of["old"], of["new"])] if of else []),
    ):
        assert c.count(old) == 1, old
        c = c.replace(old, new)
    header = header.replace(
        "z_rail; /* N: observer state */\n", "z_rail; /* N: observer state */\ndouble c; /* 1: c */\n"
    )
    if z_v:  # in the estimate of the velocity, and in the state that shows it
        shown, code = "parameters->K_v * inputs->x;", z_v.replace("state.", "state->").replace("inputs.", "inputs->")
        c = c.replace(f"v_hat = state->z_v + {shown}", f"v_hat = state->z_v + ({code}) + {shown}")
        c = c.replace("z_v_next = state->z_v +", f"z_v_next = state->z_v + ({code}) +")
    proof = certificate("one_mass", "proof.json")
    proof["states"] |= {"state.c": formula} if formula else {}
    if z_v:
        proof["states"]["state.z_v"] += f" - ({z_v})"
        proof |= {"domain": ["3"], "witness": POINT | {"state.c": "1"}, "reversals": []}
    kept = {x: y for x, y in files.items() if x != "ellipsoid.json"}
    return proof, kept | {"one_mass.h": header.encode(), "one_mass.c": c.encode()}


def test_a_state_that_is_a_number_is_a_rounded_one() -> None:
    """49 times a state of 1/49 is 1 - 1.1e-16 in doubles; the sine of one of pi is 1.2e-16 there, and was 2.6e-21."""
    assert check(*with_a_third_state("(1.0 / 49.0)", "1/49")).proved
    step, gain = "z_v_next = state->z_v +", "parameters->h_K_F * sign_rail"
    more = f"{step} 1e14 * (49.0 * state->c - 1.0) * v_hat +"
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(*with_a_third_state("(1.0 / 49.0)", "1/49", old=step, new=more))
    pi = "3.14159265358979323846"
    sine = int(10**50 * decimals.decimal("sin", Fraction(pi)))
    more = f"parameters->h_K_F * (sin(state->c) / {sine}.0 * 1e50) * sign_rail"
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(*with_a_third_state(pi, f"{Fraction(pi)}", old=gain, new=more))


def test_what_is_left_of_a_sine_a_sample_later_is_refused() -> None:
    """The proof claims nothing about state c, but the step sets it to a sine, and formulas of other states hold it."""
    digits = int(10**50 * decimals.decimal("sin", Fraction(1)))
    for value, other in (("sin(1.0)", "state.c"), ("1.0", "sin(state.c)")):
        number = "state.c" if value == "1.0" else "1.0"
        of_c = f"1e60 * ({other} - {digits}.0 * 1e-50 * {number}) * inputs.x"
        with pytest.raises(verify.Refused, match="is its rounding"):
            check(*with_a_third_state(value, z_v=of_c))
    assert check(*with_a_third_state("1.0", z_v="(state.c - 1.0) * inputs.x")).proved


def test_a_matrix_with_the_sine_of_a_number_is_not_rounded() -> None:
    """V of a certificate by itself: the sine is enclosed, and not taken for its decimal."""
    content = json.loads(made("30")[0]) | {"reversals": [], "variables": {}, "splits": {}, "cover": [""]}
    content |= {"error": content["error"][:1]}
    s = decimals.decimal("sin", Fraction(1))
    content["parameters"] = [{"name": "q", "expression": ["*", str(10**60), ["+", ["sin", "1"], str(-s)]]}]
    content |= {"matrix": [[["+", "-1", "q"]]], "lyapunov_matrix": [["1"]], "decay_rate": "1/2"}
    with pytest.raises(verify.Refused, match="sin of a number"):
        verify.check(json.dumps(content), sources={})
