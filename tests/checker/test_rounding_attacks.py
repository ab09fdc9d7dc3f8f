"""Rounding that a quotient, a function or a derived constant passes on: 0 in exact arithmetic, large in doubles.

Each of these was bound to its C with status 0, and its velocity estimate was off by more than 1 m/s.
"""

from __future__ import annotations

import decimal
import json
import math
import re
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

from codegen.checker import frame, kernel, rounding, verify
from tests.checker.forged import certificate, changed, check, sources
from tests.checker.test_kernel_exponential import made

V_HAT = "const double v_hat = state->z_v + parameters->K_v * inputs->x"
H_K_F = "parameters->h_K_F = parameters->sample_time * parameters->K_F"
LEFT = "0.1 + 0.2 - 0.3"  # 5.6e-17 in doubles
E = decimal.Context(50).exp(-1)


@pytest.mark.parametrize(
    ("added", "prepared"),
    [
        (f"1e8 * (1e-11 / ({LEFT} + 1e-11) - 1.0)", ""),
        (f"1e10 * (exp(-(1e10 * ({LEFT}) + 1.0)) - {E})", ""),
        (f"1e8 * (sin(inputs->x + 1e10 * ({LEFT})) - sin(inputs->x))", ""),
        ("1e10 * (parameters->h_K_F - 0.01)", f"1e8 * ({LEFT})"),
        ("1e3 * (parameters->h_K_F - 0.01)", f"1e14 * ({LEFT})"),
    ],
)
def test_an_error_that_is_passed_on_is_not_forgotten(added: str, prepared: str) -> None:
    text = added.replace("inputs->x", "0.25").replace("parameters->h_K_F", f"(0.001 * 10.0 + {prepared or 0})")
    assert abs(eval(text, {"exp": math.exp, "sin": math.sin, "__builtins__": {}})) > 1  # as doubles of the C
    pairs = [(V_HAT, f"{V_HAT} + {added}"), *([(H_K_F, f"{H_K_F} + {prepared}")] if prepared else [])]
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(*changed("one_mass", *pairs))


def test_what_cancels_in_the_step_is_no_input_gain() -> None:
    """The header's 2999999999999999 is 3e15 + 1/m to one rounding, and leaves a gain of -1 in place of 1."""
    here = "sample_time * (v_dot_hat -"
    there = "(parameters->large * inputs->w - 3e15 * inputs->w - parameters->one_over_m * F_hat_rail -"
    large = f"    parameters->large = 1.0 / parameters->m + 3e15;\n    {H_K_F}"
    _, files = changed("one_mass", (f"    {H_K_F}", large), (here, f"sample_time * {there}"))
    header = files["one_mass.h"].decode().replace("    double h_K_F;", "    double large;\n    double h_K_F;")
    files["one_mass.h"] = header.replace("        0.01 /*", "        2999999999999999.0, 0.01 /*").encode()
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(certificate("one_mass", "proof.json"), files)


@pytest.mark.parametrize(("tiny", "bound"), [("1e-99 * 1e-99 * 1e-99", False), ("1e-90", True)])
def test_a_sign_that_underflow_makes_zero_is_refused(tiny: str, bound: bool) -> None:
    """1e-297 times a speed below 1e-27 m/s is 0 in doubles, and so was the sign; above 1e-6 m/s all is well."""
    sign, files = f"one_mass_sign({tiny} * ", sources("one_mass")
    text = files["one_mass.c"].decode().replace("one_mass_sign(v_hat)", f"{sign}v_hat)")
    text = re.sub(r"fabs\((outputs->)?v_hat\)", lambda m: f"({sign}{m[1] or ''}v_hat) * {m[1] or ''}v_hat)", text)
    proof = certificate("one_mass", "proof.json") | {"signs": {"sign.rail": f"{tiny}*outputs.v_hat"}}
    files = {"one_mass.c": text.encode(), "one_mass.h": files["one_mass.h"]}
    assert float(eval(tiny)) * 1e-27 == (0.0 if not bound else 1e-117)
    if bound:
        assert check(proof, files).proved
    else:
        with pytest.raises(verify.Refused, match="a number is too large or small"):
            check(proof, files)


@pytest.mark.parametrize(("large", "small", "bound"), [("1e99 * 1e66", 8, False), ("1.0", 0, True)])
def test_a_product_of_quotients_that_underflow_makes_zero_is_refused(large: str, small: int, bound: bool) -> None:
    """The input gain 1/(2 + sin x)^10 was 0 in the C, which divides by 1e165 twice before it multiplies by 1e330."""
    wave = "(2.0 + sin(inputs->x))"
    gain = "1.0" + f" / ({large} * {wave})" * 2 + f" / (1e-39 * {wave})" * small + " * 1e18" * bool(small)
    at_zero = eval(gain.replace("inputs->x", "0.0"), {"sin": math.sin, "__builtins__": {}})
    assert at_zero == (0.25 if bound else 0.0)
    _, files = changed("one_mass", ("inputs->w - F_hat_rail", f"inputs->w * ({gain}) - F_hat_rail"))
    text = json.dumps(certificate("one_mass", "proof.json"))
    assert text.count("inputs.w") == 2  # of the force and the acceleration
    proof = json.loads(text.replace("inputs.w", f"inputs.w * ({gain.replace('->', '.')})"))
    of_c = {name: files[name] for name in ("one_mass.c", "one_mass.h")}
    if bound:
        assert check(proof, of_c).proved
    else:
        with pytest.raises(verify.Refused, match="a quotient, or a product with it, is too large or small"):
            check(proof, of_c)


def times(factor: str, count: int) -> str:
    return " * ".join([factor] * count)


@pytest.mark.parametrize(
    ("wave", "x"),
    [
        (times("sin(x)", 22), math.pi),  # the double next to pi, whose sine is 1.2e-16
        (times("sin(1e-20 * x)", 13), 1e-6),
        (f"1e-99 * 1e-99 * 1e-40 * {times('sin(x)', 6)}", math.pi),
        (times("sin(x)", 12), math.pi),
        (times("sin(1e-20 * x)", 2), 1e-6),
        (times("cos(x)", 4), math.pi / 2),
        (f"(0.5 + {times('sin(x)', 4)})", math.pi),
    ],
)
def test_a_sign_that_underflow_of_a_sine_makes_zero_is_refused(wave: str, x: float) -> None:
    """The machine's input gain is the sign of an even power of a sine, 1 but at multiples of pi; the C's was 0."""
    names = {"sin": math.sin, "cos": math.cos, "x": x, "__builtins__": {}}
    bound = eval(wave, names) != 0
    of_c = wave.replace("x)", "inputs->x)")
    _, files = changed("one_mass", ("inputs->w - F_hat_rail", f"inputs->w * one_mass_sign({of_c}) - F_hat_rail"))
    text = json.dumps(certificate("one_mass", "proof.json"))
    proof = json.loads(text.replace("inputs.w", f"inputs.w * sgn({of_c.replace('->', '.')})"))
    files = {name: files[name] for name in ("one_mass.c", "one_mass.h")}
    if bound:
        assert check(proof, files).proved
    else:
        with pytest.raises(verify.Refused, match="a sign of what may be 0 by underflow or rounding"):
            check(proof, files)


@pytest.mark.parametrize(
    ("positive", "box", "at", "answer"),
    [
        (times("(1.0 / (1.0 + x * x))", 30), ["0", "1000000"], 1e6, "a quotient, or a product with it"),
        (times("(1.0 / (1.0 + x * x))", 4), ["0", "1000000"], 1e6, ""),
        (f"1.0 / ({times('(1.0 / x)', 60)})", ["1/1000000", "1"], 1e-6, "a quotient, or a product with it"),
        (f"1.0 / ({times('(1.0 / x)', 4)})", ["1/1000000", "1"], 1e-6, ""),
        ("exp(-x * x)", [], 28.0, "a sign of an exp"),
        ("(0.5 + exp(-x * x))", [], 28.0, "a sign of an exp"),
    ],
)
def test_the_sign_of_a_positive_value_that_underflow_makes_zero_is_refused(
    positive: str, box: list[str], at: float, answer: str
) -> None:
    """The C's friction was 0 at this position, since the sign of a positive number times that of the velocity was."""
    if answer and not positive.startswith("(0.5"):  # as doubles of the C: 0, or one over infinity
        names: dict[str, Any] = {"x": np.float64(at), "exp": np.exp, "__builtins__": {}}
        with np.errstate(over="ignore", under="ignore"):
            assert eval(positive, names) == 0
    position = re.sub(r"\bx\b", "inputs->x", positive)
    of_v = f"one_mass_sign(one_mass_sign(v_hat) * {position})"
    _, files = changed("one_mass", ("one_mass_sign(v_hat)", of_v))
    proof = certificate("one_mass", "proof.json")
    truths = dict.fromkeys(("true.v", "outputs.v_hat", "true.a_rail", "outputs.a_hat_rail"), "1")
    witness = {"inputs.x": "1", "inputs.w": "0", **truths}
    proof |= {"domain": [position.replace("->", ".")], "witness": witness, "box": {"inputs.x": box} if box else {}}
    of_c = {name: files[name] for name in ("one_mass.c", "one_mass.h")}
    if answer:
        with pytest.raises(verify.Refused, match=answer):
            check(proof, of_c)
    else:
        assert check(proof, of_c).proved


@pytest.mark.parametrize(
    ("sum_", "x"),
    [
        ("1e99 * 1e99 * 1e99 * exp(-x * x) - 1e-99 * 1e-99", 28.0),  # 3e-44 in exact arithmetic
        ("1e99 * 1e99 * 1e90 * (1e-99 * 1e-99 * 1e-90 * exp(-x * x)) - 1e-99 * 1e-99", 15.0),  # 2e-98
    ],
)
def test_a_sign_that_an_exp_decides_is_refused(sum_: str, x: float) -> None:
    """The machine's input gain is 1 at this position, and the C's is -1: the exp, or a product with it, is 0 there."""
    assert eval(sum_, {"exp": math.exp, "x": x, "__builtins__": {}}) < 0
    of_c = re.sub(r"\bx\b", "inputs->x", sum_)
    _, files = changed("one_mass", ("inputs->w - F_hat_rail", f"inputs->w * one_mass_sign({of_c}) - F_hat_rail"))
    text = json.dumps(certificate("one_mass", "proof.json"))
    proof = json.loads(text.replace("inputs.w", f"inputs.w * sgn({of_c.replace('->', '.')})"))
    with pytest.raises(verify.Refused, match="a sign of an exp"):
        check(proof, {name: files[name] for name in ("one_mass.c", "one_mass.h")})


FIVE = times("w", 5)


@pytest.mark.parametrize(
    ("of", "x", "w", "answer"),
    [
        (times("(x - 1.0)", 46), 1.0 + 5e-8, 1.0, "a sign of what may be 0"),
        (times("(x - w)", 30), 0.3 + 1e-11, 0.3, "a sign of what may be 0"),
        (f"1e99 * ({times('(x - w)', 20)})", 0.3 + 2**-54, 0.3, "a sign of what may be 0"),
        (f"{times('(fabs(x) - 1.0)', 22)} / 3.0", 1.0 + 2**-52, 1.0, "a sign of what may be 0"),
        (f"2.0 * {times('x', 5)} + {FIVE} - {FIVE}", 0.1, 2e3, "a sign of what may be 0"),
        (f"(2.0 * {times('x', 5)} + {FIVE} - {FIVE}) / 3.0", 0.1, 2e3, "a sign of what may be 0"),
        ("(x - 1.0) * (x - 2.0) * (w - 3.0)", 1.0 + 2**-52, 2.9, ""),
        (times("(x - w)", 13), 0.3 + 2**-54, 0.3, ""),
        ("(x + w) * (x - w)", 0.3 + 2**-54, 0.3, ""),
    ],
)
def test_a_sign_that_cancelling_makes_zero_is_refused(of: str, x: float, w: float, answer: str) -> None:
    """The machine's input gain is the sign in exact arithmetic, 1 or -1 at this point; the C's is 0 where refused."""
    exact = eval(
        re.sub(r"(?<![\w.])\d[\de.]*", r"F('\g<0>')", of),
        {"F": Fraction, "fabs": abs, "x": Fraction(x), "w": Fraction(w)},
    )
    assert exact != 0 and (eval(of, {"fabs": abs, "x": x, "w": w}) == 0) == bool(answer)
    of_c = re.sub(r"\b([xw])\b", r"inputs->\1", of)
    _, files = changed("one_mass", ("inputs->w - F_hat_rail", f"inputs->w * one_mass_sign({of_c}) - F_hat_rail"))
    text = json.dumps(certificate("one_mass", "proof.json"))
    proof = json.loads(text.replace("inputs.w", f"inputs.w * sgn({of_c.replace('->', '.')})"))
    files = {name: files[name] for name in ("one_mass.c", "one_mass.h")}
    if answer:
        with pytest.raises(verify.Refused, match=answer):
            check(proof, files)
    else:
        assert check(proof, files).proved


@pytest.mark.parametrize(
    ("precision", "binary", "exponents"), [("double", 53, (-1074, 971)), ("float", 24, (-149, 104))]
)
def test_no_number_is_nearer_to_a_multiple_of_half_pi_than_is_assumed(
    precision: str, binary: int, exponents: tuple[int, int]
) -> None:
    """The least |m a - k|, a = 2^e/(pi/2), of all m < 2^53 and k > 0 is at a denominator m of the fraction of a."""
    with mpmath.workprec(1300):
        half = Fraction(int(mpmath.floor(mpmath.pi * mpmath.mpf(2) ** 1260)), 2**1261)
    least = Fraction(1)
    for e in range(exponents[0], exponents[1] + 1):
        rest, (before, m), (k_before, k) = Fraction(2) ** e / half, (0, 1), (1, 0)
        rest, k_before, k = 1 / (rest - int(rest)), 1, int(rest)
        while m < 2**binary:
            if k > 0:
                least = min(least, abs(m * Fraction(2) ** e - k * half))
            whole = int(rest)
            before, m = m, whole * m + before
            k_before, k = k, whole * k + k_before
            rest = 1 / (rest - whole)
    digits = rounding.Bounded({}, {}, frame.PRECISIONS[precision]).digits
    assert digits == binary - 1
    assert Fraction(2) ** -(digits + 9) <= least < Fraction(2) ** -(digits + 6)


def test_parts_of_an_expression_are_not_kept() -> None:
    """A sum of a hundred terms kept a hundred polynomials and their bounds, beyond the limit of a run."""
    x = kernel.Poly({("x",) * k: 1 for k in range(1, 50)})
    text = rounding.Bounded({"x": x}, {}, frame.PRECISIONS["double"]._replace(most=10**300, usual=1))
    seen: list[int] = []
    bound = text.bound

    def counted(node: Any, whole: str, p: Any) -> Any:
        seen.append(len(text.parts))
        return bound(node, whole, p)

    text.bound = counted  # type: ignore[method-assign]
    text.value(" + ".join(["x"] * 100))
    assert len(seen) == 199 and max(seen) <= 2


@pytest.mark.parametrize("cover", ["", ['" t', "1/2", "", ""]])
def test_a_machine_of_what_is_left_of_a_derived_exponential_is_refused(cover: Any) -> None:
    """1e60 times 1 - exp(-h K_v) less its first 50 digits, under the name that the C gives it: more than 1e6 N."""
    _, text, files = made("one_mass")
    proof, name, wide = json.loads(text), "parameters.one_minus_exp_minus_h_K_v", decimal.Context(99)
    digits = wide.subtract(decimal.Decimal(1), decimal.Context(50).exp(decimal.Decimal("-0.1")))
    exact = wide.subtract(decimal.Decimal(1), wide.exp(decimal.Decimal("-0.1")))
    assert abs(exact - digits) * 10**60 > 10**6
    (force,) = proof["force"]
    force = f"{force} + 1e60*({name} - {digits})"
    proof |= {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}
    proof = {"cover": cover} | proof | {"cover": cover}  # a cut is made of what is nowhere; its quote stands first
    with pytest.raises(verify.Refused, match="is its rounding"):
        verify.check(json.dumps(proof), sources={x: of.encode() for x, of in files.items()})


def test_an_exponential_below_all_decimals_is_not_taken_for_zero() -> None:
    """Its sign is 1: a machine with 1e5 N of friction besides was printed, and proved to be the one without."""
    proof = certificate("one_mass", "proof.json")
    (force,) = proof["force"]
    force += " + 100000*sgn(exp(-1000000000))"
    proof |= {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}
    with pytest.raises(verify.Refused, match="too small"):
        check(proof, sources("one_mass"))


STEP = "const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat)"
CHECK = "const double check = z_v_next + z_rail_next"
RATE = "const double v_dot_hat = parameters->one_over_m * (inputs->w - F_hat_rail)"
COSINE = "const double c = cos(inputs->x);\n    const double s = sin(inputs->x);\n    "
POWER = "const double w2 = inputs->w * inputs->w;\n    const double w16 = w2 * w2 * w2 * w2 * w2 * w2 * w2 * w2;\n    "


@pytest.mark.parametrize(
    ("own", "by"),
    [
        # inputs of 600 N: v_hat is 1e36 m/s
        pytest.param(V_HAT, f"{POWER}{V_HAT} + w16 * ({LEFT})", id="a high power of an input"),
        # 655 of 1000 samples are refused as invalid
        pytest.param(CHECK, f"const double j = 1e99 * 1e99 * inputs->x * ({LEFT});\n    {CHECK} + j", id="the check"),
        # v_hat is -5 in place of 113 m/s
        pytest.param(STEP, f"{COSINE}{STEP} + 1e16 * inputs->w * (s * s + c * c - 1.0)", id="sin^2 + cos^2 - 1"),
        pytest.param(
            CHECK, f"{COSINE}const double j = 1e99 * 1e99 * (s * s + c * c - 1.0);\n    {CHECK} + j", id="both"
        ),
        # v_hat is 4818 m/s
        pytest.param(
            STEP,
            f"{COSINE}const double d = 2.0 + c;\n    {STEP} + 1e16 * inputs->w * ((0.3 * d) / (0.1 * d) - 3.0)",
            id="a quotient of multiples",
        ),
        # the divisor is 0 at x = 0, where every sample is then invalid
        pytest.param(
            RATE,
            f"{COSINE}const double d = 1.00000000000000001 - c;\n    {RATE.replace('= ', '= d * ')} / d",
            id="a divisor of rounding alone",
        ),
    ],
)
def test_what_cancels_by_an_identity_or_in_a_power_is_seen(own: str, by: str) -> None:
    """Each was bound to its C with status 0; what the compiled C gave is said with each."""
    with pytest.raises(verify.Refused, match="is its rounding"):
        check(*changed("one_mass", (own, by)))


NULL = "0.1 * s + 0.2 * s - 0.3 * s"


@pytest.mark.parametrize(
    ("divisor", "answer"),
    [
        ("1.000001 - c", ""),
        (f"2.0 + c + 300.0 * ({NULL})", ""),  # as the terms with cos(q2) of a two-link arm's determinant, which cancel
        (f"2.0 + c + 9000.0 * ({NULL})", rounding.CANCELLATION),
        (f"1.000001 - c + 300.0 * ({NULL})", f"in a divisor {rounding.CANCELLATION}, where it is near 0"),  # at x = 0
    ],
)
def test_terms_of_a_divisor_that_cancel_are_admitted_where_it_is_far_from_their_rounding(
    divisor: str, answer: str
) -> None:
    own, by = RATE, f"{COSINE}const double d = {divisor};\n    {RATE.replace('= ', '= d * ')} / d"
    forged = changed("one_mass", (own, by))
    if answer:
        with pytest.raises(verify.Refused, match=answer):
            check(*forged)
    else:
        assert check(*forged).whole


GAIN = f"1e14 * ({LEFT}) * inputs->w"  # 0.0055 w, where h/m is 0.001
FORCE = "-true.a_rail*sign.rail + inputs.w"


def with_a_gain(gain: str, force: str = "", also: dict[str, Any] | None = None) -> verify.Report:
    """one_mass with ``gain`` added to its next velocity, and a force over inputs.x and inputs.w in machine and C."""
    files = {x: y for x, y in sources("one_mass").items() if x != "ellipsoid.json"}
    text, more = files["one_mass.c"].decode(), f" + {force}" if force else ""
    for old, new in (
        (
            "    const double z_v_next =",
            f"    const double S = one_mass_sign(v_hat + a_hat_rail);\n{'':4}const double z_v_next = {gain} +",
        ),
        ("(inputs->w - F_hat_rail)", f"(inputs->w{more} - F_hat_rail)"),
    ):
        assert old in text
        text = text.replace(old, new.replace("inputs.", "inputs->"))
    proof = certificate("one_mass", "proof.json") | (also or {})
    if force:
        proof |= {"force": [FORCE + more], "acceleration": {"true.v": f"({FORCE}{more})/parameters.m"}}
    return check(proof, files | {"one_mass.c": text.encode()})


@pytest.mark.parametrize(
    ("others", "bound"), [("0.0", True), (GAIN, False), (f"{GAIN} + 1e10 * (S * S - 1.0) * inputs->w", False)]
)
def test_a_sign_of_an_output_that_holds_another_sign_hides_no_rounding(others: str, bound: bool) -> None:
    """S^2 is 1 in the proof; rounding.py took S for an unknown sign, and 1e10 (S^2 - 1) w for a term that is left."""
    signs = {"signs": {"sign.rail": "outputs.v_hat", "sign.q": "outputs.v_hat + outputs.a_hat_rail"}}
    if bound:
        assert with_a_gain(others, also=signs).whole
    else:
        with pytest.raises(verify.Refused, match="is its rounding"):
            with_a_gain(others, also=signs)


@pytest.mark.parametrize(
    ("force", "bound"),
    [
        ("", True),
        ("1e-5*cos(1e5*inputs.x)*inputs.w", True),
        ("1e-50*cos(1e99*1e20*inputs.x)*inputs.w", False),
        ("1e-5*cos(1e20*inputs.x)*inputs.w", False),
        ("1e-5*inputs.w*inputs.x/(2.0 + cos(inputs.x))", True),
        ("1e20*inputs.w*inputs.x/(1e25*(2.0 + cos(inputs.x)))", True),
    ],
)
def test_a_force_that_is_nearly_none_hides_no_rounding(force: str, bound: bool) -> None:
    """The rounding of 1e119 x counted with the cosine of it, which is at most 1; a quotient, whatever it is, as 1."""
    if bound:
        assert with_a_gain("0.0", force).whole
    with pytest.raises(verify.Refused, match="is its rounding"):
        with_a_gain(f"{GAIN} * inputs->x", force)


WAVES = "sin(inputs->x) * sin(inputs->x) + cos(inputs->x) * cos(inputs->x) - 1.0"


@pytest.mark.parametrize(
    ("gain", "bound"),
    [
        ("0.0", True),
        (f"1e16 * ({LEFT})", False),
        (f"{GAIN} * inputs->x", False),
        (f"1e16 * ({WAVES}) * inputs->x * inputs->w", False),
    ],
)
def test_an_input_that_is_never_used_hides_no_rounding(gain: str, bound: bool) -> None:
    """A force of 1e20 y^2 in machine and C: what y = 1 would round in a step is nothing where y is 0."""
    files = {x: y for x, y in sources("one_mass").items() if x != "ellipsoid.json"}
    code, header = (files[f"one_mass.{end}"].decode() for end in "ch")
    for old, new in (
        ("double z_v_next =", f"double z_v_next = {gain} +"),
        ("(inputs->w - F_hat_rail)", "(inputs->w + 1e20 * inputs->y * inputs->y - F_hat_rail)"),
        ("fabs(inputs->w)", "fabs(inputs->w) + fabs(inputs->y)"),
    ):
        assert old in code
        code = code.replace(old, new)
    header = header.replace(
        "    double w; /* N: input */\n", "    double w; /* N: input */\n    double y; /* m: input */\n"
    )
    force = f"{FORCE} + 1e20*inputs.y*inputs.y"
    machine = {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}
    files |= {"one_mass.c": code.encode(), "one_mass.h": header.encode()}
    if bound:
        assert check(certificate("one_mass", "proof.json") | machine, files).whole
    else:
        with pytest.raises(verify.Refused, match="is its rounding"):
            check(certificate("one_mass", "proof.json") | machine, files)
