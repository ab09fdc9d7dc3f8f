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
from tests.checker.forged import certificate, check, sources

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
    true_bounds = rounding.of_parameters

    def kept(*given: Any) -> dict[str, tuple[Any, int]]:
        found.update(true_bounds(*given))
        return found

    monkeypatch.setattr(rounding, "of_parameters", kept)
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


@pytest.mark.parametrize("argument", ["1", "1 + inputs.x - inputs.x", "sgn(2 + 0*inputs.x)"])
def test_a_machine_of_what_is_left_of_a_sine_is_refused(argument: str) -> None:
    proof = certificate("one_mass", "proof.json")
    (force,) = proof["force"]
    force += f" - {left(argument)}*true.v"
    proof |= {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(proof, sources("one_mass"))


def test_a_matrix_with_the_sine_of_a_number_is_not_rounded() -> None:
    """V of a certificate by itself: the sine is enclosed, and not taken for its decimal."""
    content = json.loads(made("30")[0]) | {"reversals": [], "variables": {}, "splits": {}, "cover": [""]}
    content |= {"error": content["error"][:1]}
    s = decimals.decimal("sin", Fraction(1))
    content["parameters"] = [{"name": "q", "expression": ["*", str(10**60), ["+", ["sin", "1"], str(-s)]]}]
    content |= {"matrix": [[["+", "-1", "q"]]], "lyapunov_matrix": [["1"]], "decay_rate": "1/2"}
    with pytest.raises(verify.Refused, match="sin of a number"):
        verify.check(json.dumps(content), sources={})
