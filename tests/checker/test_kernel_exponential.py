"""An exponential step bound to its C: the machine moves x by a mean velocity of the sample, and forged ones do not.

With v̂ = z + Γ x, Γ = (1 − e^(−hK))/h and Φ = Γ/K, the velocity's error e = v − v̂ becomes e⁺ = (1 − hΓ) e + hΦ (v' − v̂')
+ h (1 − Φ) v' − Γ (Δx − h v). So it stays 0 just where Δx = h v + q h² v' with q = (1 − Φ)/(hΓ).
"""

from __future__ import annotations

import json
import math
import re
import runpy
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import verify
from codegen.spec import parse_spec
from tests.checker.forged import changed, check
from tests.checker.test_kernel import spec_path

H, K = 0.001, 100.0
Change = Callable[[Any], Any]


@cache
def made(name: str, *others: tuple[str, str]) -> tuple[str, str, dict[str, str]]:
    """(certificate, proof, files) of a shipped spec with an exponential step, and others of its texts."""
    text = spec_path(name).read_text("utf-8")
    for old, new in (("  velocity: estimated", "  integration: exponential\n  velocity: estimated"), *others):
        assert old in text
        text = text.replace(old, new, 1)
    machine = Derived(parse_spec(text, Path(f"{name}.yaml")))
    outcome = machine.outcome
    assert isinstance(outcome, Certificate), outcome
    assert outcome.kernel is not None, outcome.not_by_kernel
    return outcome.text, outcome.kernel, dict(machine.files)


def checked(name: str, change: Change = lambda c: c, proof: Change = lambda p: p, code: Change = lambda s: s) -> Any:
    certificate, text, files = made(name)
    sources = {x: of.encode() for x, of in files.items()}
    sources |= {
        f"{name}.c": code(files[f"{name}.c"]).encode(),
        "proof.json": json.dumps(proof(json.loads(text))).encode(),
    }
    content = change(json.loads(certificate))
    content["subject"]["files"].pop(f"{name}.c")
    content["subject"]["files"][f"{name}.c"] = verify.hashlib.sha256(sources[f"{name}.c"]).hexdigest()
    return verify.check(json.dumps(content), sources=sources)


@pytest.mark.parametrize("name", ["one_mass", "rig_to", "belt_axis", "emps"])
def test_it_is_proved_of_the_c(name: str) -> None:
    report = checked(name)
    assert verify.status(report) == 0
    assert any(" moves by " in line for line in report.proved)


def test_a_gain_that_loses_digits_is_bound_as_far_as_its_terms_are_rounded() -> None:
    """h K_v = 0.01: 1 − exp(−0.01) in doubles is off by 1e-14 of itself, which is the rounding of 1; not by 1e-12."""
    name = "one_minus_exp_minus_h_K_v"
    text = spec_path("two_mass").read_text("utf-8")
    text = text.replace("  velocity: estimated", "  integration: exponential\n  velocity: estimated", 1)
    derived = Derived(parse_spec(text, Path("two_mass.yaml")))
    assert isinstance(derived.outcome, Certificate)
    proof = derived.outcome.kernel
    assert proof is not None
    sources = {f"two_mass.{x}": derived.files[f"two_mass.{x}"] for x in ("c", "h")}
    value, *_ = re.findall(rf"([\d.]+),? /\* {name}", sources["two_mass.h"])
    exact = -math.expm1(-0.01)
    assert exact * 1e-15 < abs(float(value) - exact) < 2**-52
    for factor, holds in ((1 + 1e-15, True), (1 + 1e-12, False)):
        header = sources["two_mass.h"].replace(value, repr(float(value) * factor))
        given = {x: of.encode() for x, of in (sources | {"two_mass.h": header}).items()}
        if holds:
            assert verify.check(proof, sources=given).whole
        else:
            with pytest.raises(verify.Refused, match=f"prepare gives others: parameters.{name}"):
                verify.check(proof, sources=given)


def test_the_mean_velocity_is_that_of_the_equations() -> None:
    """By hand: 1/(1 − e^(−hK)) − 1/(hK), in floating point."""
    (text,) = json.loads(made("one_mass")[1])["mean"].values()
    text = text.replace("parameters.K_v", str(K)).replace("parameters.sample_time", str(H))
    value = eval(text, {"exp": math.exp, "__builtins__": {}})
    assert value == pytest.approx(1 / (1 - math.exp(-H * K)) - 1 / (H * K), rel=1e-10)


def test_the_twin_keeps_a_right_estimate_on_that_motion_and_on_no_other(tmp_path: Path) -> None:
    """The generated step, run: right estimates stay right to rounding where x moves by q, not by 0 or 1/2."""
    (tmp_path / "twin.py").write_text(made("one_mass")[2]["__init__.py"], "utf-8")
    namespace = runpy.run_path(str(tmp_path / "twin.py"))
    q, a, force, v, x = 1 / (1 - math.exp(-H * K)) - 1 / (H * K), 50.0, 90.0, 1.0, 0.0
    for share, stays in ((q, True), (0.0, False), (0.5, False), (1.0, False)):
        parameters = namespace["Parameters"]()
        gamma = (1 - math.exp(-H * K)) / H
        state = namespace["State"](v - gamma * x, a + parameters.K_F * v)
        namespace["step"](state, parameters, namespace["Inputs"](x, force))
        rate = (force - a) / parameters.m
        moved = namespace["Inputs"](x + H * (v + share * H * rate), force)
        out = namespace["step"](state, parameters, moved)
        assert (abs(out.v_hat - (v + H * rate)) < 1e-12) == stays


def test_each_position_is_printed_with_its_own_mean() -> None:
    """Whatever their order in the file: with the two turned round, each was printed with the mean of the other."""
    _, text, files = made("two_mass", ("K_F: [500, 700], K_v: [10, 10]", "K_F: [100, 100], K_v: [100, 300]"))
    proof, sources = json.loads(text), {x: of.encode() for x, of in files.items()}
    turned = proof | {"mean": dict(reversed(proof["mean"].items()))}
    assert [*turned["mean"]] == ["inputs.x2", "inputs.x1"] and len({*turned["mean"].values()}) == 2
    printed = [verify.check(json.dumps(p), sources=sources).proved for p in (proof, turned)]
    assert printed[0] == printed[1]
    for i in (1, 2):
        (line,) = (line for line in printed[0] if line.startswith(f"in a sample x{i} moves by "))
        assert f"K_v_v{i}" in line and f"K_v_v{3 - i}" not in line


@pytest.mark.parametrize(
    "forged",
    [
        {"mean": {}},
        {"mean": {"inputs.x": "0"}},
        {"mean": {"inputs.x": "1/2"}},
        {"mean": {"inputs.x": "0.5083305514353"}},
        {"mean": {"inputs.x": "1"}},
        {"mean": {"inputs.w": "1/2"}},
        {"mean": {"inputs.x": "true.v"}},
        {"step": "euler"},
        {"step": "semi_implicit"},
        {"step": "euler", "mean": {}},
        {"step": "semi_implicit", "mean": {}},
        {"step": "implicit"},
    ],
)
def test_another_motion_is_refused(forged: dict[str, Any]) -> None:
    _, text, files = made("one_mass")
    with pytest.raises(verify.Refused):
        verify.by_kernel_alone(json.loads(text) | forged, {x: of.encode() for x, of in files.items()})


def test_a_mean_velocity_beyond_the_two_ends_is_refused() -> None:
    """With q = 3/2 a C that steps back would be proved: v̂ = z + Γ x, Γ = 2 (1 − Φ)/(3 h), is another machine's."""
    shipped = Path(__file__).parents[2] / "generated/one_mass"
    sources = {x.name: x.read_bytes() for x in shipped.glob("one_mass.[ch]")}
    proof = json.loads((shipped / "proof.json").read_text("utf-8"))
    for mean, step in (("3/2", "exponential"), ("-1", "exponential"), ("0", "euler"), ("1", "exponential")):
        with pytest.raises(verify.Refused):
            verify.by_kernel_alone(proof | {"step": step, "mean": {"inputs.x": mean}}, sources)
    verify.by_kernel_alone(proof | {"step": "exponential", "mean": {"inputs.x": "0"}}, sources)  # the same machine


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("1.0 - exp(-(parameters->sample_time", "1.0 - exp(-(1.5 * parameters->sample_time"),
        ("one_minus_exp_minus_h_K_v / parameters->K_v", "one_minus_exp_minus_h_K_v / parameters->sample_time"),
        ("parameters->constant_2 * v_dot_hat", "parameters->sample_time * v_dot_hat"),
        ("parameters->one_minus_exp_minus_h_K_v * v_hat", "parameters->constant_2 * v_hat"),
    ],
)
def test_another_c_is_refused(old: str, new: str) -> None:
    assert made("one_mass")[2]["one_mass.c"].count(old) == 1
    with pytest.raises(verify.Refused):
        checked("one_mass", code=lambda text: text.replace(old, new))


def test_a_certificate_of_another_exponential_is_not_bound() -> None:
    """One whose V falls, by its own algebra, and is not that of the C: e^(−1/9) or a decimal near e^(−1/10)."""
    near = "90483741803595957316424905944/100000000000000000000000000000"
    for other in (["exp", "-1/9"], near):

        def forged(content: Any, other: Any = other) -> Any:
            (parameter,) = content["parameters"]
            assert parameter["expression"] == ["exp", "-1/10"]
            slower = {"decay_rate": "5", "reversals": []}  # e^(−1/9) is slower than the V of the spec
            return content | {"parameters": [parameter | {"expression": other}], **slower}

        assert verify.status(checked("one_mass", forged)) == 5


def test_what_is_left_of_an_exponential_beside_its_decimal_is_not_taken_for_nothing() -> None:
    """e^(−1/10) less the decimal that the kernel has for it, times 10⁶⁰: the algebra refuses, whatever the C is."""
    from decimal import Context

    digits = str(Context(50).exp(Context(50).divide(-1, 10)))

    def forged(content: Any) -> Any:
        (parameter,) = content["parameters"]
        rest = ["*", str(10**60), ["+", ["exp", "-1/10"], ["neg", digits_as_fraction(digits)]]]
        return content | {"parameters": [parameter | {"expression": ["+", parameter["expression"], rest]}]}

    with pytest.raises(verify.Refused, match="V may not fall"):
        checked("one_mass", forged)


def test_exp_of_zero_is_one_in_certificate_and_code() -> None:
    """A parameter exp(0.0) whose decimal is 1 + 8e-16: with this for exp(0), which the algebra has as 1, the matrix
    -150 + 6.25e16 (exp(0) - 1), -150 to the algebra, was bound with status 0 to a C of which it is -100.
    """
    content, files = changed(
        "one_mass", ("    parameters->h_K_F =", "    parameters->c = exp(0.0);\n    parameters->h_K_F =")
    )
    header = files["one_mass.h"].decode().replace("    double h_K_F;", "    double c;\n    double h_K_F;")
    header = header.replace("0.01 /* h_K_F", "1.0000000000000008, 0.01 /* h_K_F")
    files |= {"one_mass.h": header.encode()}
    content["subject"]["files"]["one_mass.h"] = verify.hashlib.sha256(header.encode()).hexdigest()
    assert verify.status(check(content, files)) == 0
    content["parameters"] = [
        {"name": "q", "expression": ["*", str(50 * 10**16 // 8), ["+", ["exp", "0"], "-1"]]},
    ]
    content["matrix"][0][0], content["reversals"], content["decay_rate"] = ["+", "-150", "q"], [], "1"
    report = check(content, files)
    assert report.unproved and not report.proved


def digits_as_fraction(text: str) -> str:
    whole, _, after = text.partition(".")
    return f"{int(whole + after)}/{10 ** len(after)}"
