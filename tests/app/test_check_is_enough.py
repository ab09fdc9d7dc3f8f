"""What ``generate`` or ``simulate`` would refuse of a spec, ``check`` refuses, in the same words at the same line."""

from __future__ import annotations

import pytest

from .command import SPECS, contents, is_one_message, stiction

ONE = (SPECS / "one_mass.yaml").read_text()
DELAY = "effects: [{kind: input_delay, on: w, parameters: {T: 100}}]"


def changed(*pairs: tuple[str, str]) -> str:
    text = ONE
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


PARAMETER = "  m: {value: 1, unit: kg}\n"
MASS = "  - [m]\n"
FAULTS = {
    "an output's name": (
        changed(
            (PARAMETER, PARAMETER + "  u_cancel_w: {value: 1, unit: kg}\n"),
            (MASS, "  - [m + u_cancel_w]\n"),
            ("observer:", "cancellation: {}\nobserver:"),
        ),
        "s.yaml:10: parameters.u_cancel_w: two quantities called `u_cancel_w`",
    ),
    "a long delay": (
        changed(("effects: []", DELAY)),
        "s.yaml:18: effects[0].parameters.T: a delay of 100000 samples; expected at most 1000",
    ),
    "a contact called like a coordinate": (
        changed(("name: rail", "name: on_x")),
        "s.yaml:17: friction.contacts[0].name: the name `F_hat_on_x`",
    ),
    "a contact called a": (changed(("name: rail", "name: a")), "s.yaml:17: friction.contacts[0].name: the name `a_a`"),
    "an input h": (
        changed(("  w: {unit", "  h: {unit"), ("  - w\n", "  - h\n"), ("inputs: {w:", "inputs: {h:")),
        "s.yaml:7: inputs.h: the name `h`",
    ),
    "a slope without end": (
        changed(("  velocity: estimated", "  exponent: 0.5\n  velocity: estimated")),
        "s.yaml:21: observer.exponent: h(s) = sqrt(s), whose slope is infinite at rest",
    ),
    "the same of a function": (
        changed(("  velocity: estimated", "  h: sqrt(s) + s\n  velocity: estimated")),
        "s.yaml:21: observer.h: h(s) = sqrt(s) + s, whose slope",
    ),
    "slopes without end in the force": (
        changed(
            ("  - w\n", "  - w - b*sqrt(r + v)\n"),
            (PARAMETER, f"{PARAMETER}  b: {{value: 1, unit: kg*m^0.5/s^1.5}}\n  r: {{value: 5, unit: m/s}}\n"),
        ),
        "s.yaml:26: envelope: the error dynamics are not finite at",
    ),
    "the example's name": (
        changed(("name: one_mass", "name: example_main")),
        "s.yaml:2: name: the name `example_main`",
    ),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("fault", FAULTS)
def test_generate_and_check_agree(folder, fault):
    text, words = FAULTS[fault]
    (folder / "s.yaml").write_text(text)
    result = stiction("check", "s.yaml")
    assert is_one_message(result) and f"error: {words}" in result.err, result
    assert stiction("generate", "s.yaml", "--uncertified") == result
    assert list(contents(folder)) == ["s.yaml"]


SIMULATED = {
    "a sample time that does not divide": (
        changed(("duration: 12\n  sample_time: 0.001", "duration: 12\n  observer: true\n  sample_time: 0.0007")),
        "s.yaml:31: simulation.sample_time: 0.0007 s in the simulation and 0.001 s in the observer",
    ),
    "a gain for nothing": (
        changed(("  encoder_step", "  position_gain: {w: 3}\n  encoder_step")),
        "s.yaml:32: simulation.position_gain.w: a gain",
    ),
    "a law without a plant": (
        changed(("law: coulomb, a: 50", "law: ruina, F_0: 50, a: 1, b: 2, L: 0.001, v_0: 0.1")),
        "s.yaml:17: friction.contacts[0].law: the law ruina at rail in a simulation",
    ),
}


@pytest.mark.parametrize("fault", SIMULATED)
def test_simulate_and_check_agree(folder, fault):
    text, words = SIMULATED[fault]
    (folder / "s.yaml").write_text(text)
    result = stiction("check", "s.yaml")
    assert is_one_message(result) and f"error: {words}" in result.err, result
    assert stiction("simulate", "s.yaml", "-o", "log.csv") == result


def test_check_says_that_a_range_is_missing(folder):
    """No fault for it: derive, simulate and diagnose take such a spec."""
    text = (SPECS / "two_link_arm.yaml").read_text()
    (line,) = (line for line in text.splitlines(keepends=True) if line.startswith("  omega1: [-0.3"))
    (folder / "s.yaml").write_text(text.replace(line, ""))
    result = stiction("check", "s.yaml")
    why = "the envelope has no range for omega1; add `omega1: [low, high]`, since Ψ depends on it"
    assert result.code == 0 and f"  certificate    none: {why}\n" in result.out
    refused = stiction("certify", "s.yaml")
    assert refused.code == 2 and "envelope: no range for omega1" in refused.err and "[SPEC026]" in refused.err
