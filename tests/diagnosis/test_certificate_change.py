"""A diagnosis says which proofs beside the certificate the augmented spec has no longer, and why."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from codegen.app.derived import Derived
from codegen.app.diagnosis_folder import certificate_change
from codegen.base.text import render
from codegen.diagnosis.results import CertificateChange
from codegen.spec import parse_spec

SPEC = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text("utf-8")
NAMES = ("ellipsoid.json", "proof.json")
DELAY = "[{kind: input_delay, on: w, parameters: {T: 0.001}}]"
ECCENTRIC = "[{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.001, period: 1, phase: 0}}]"
COGGING = "[{kind: cogging, on: x, parameters: {amplitude: 1, period: 1, phase: 0}}]"
UNSTABLE = "[{kind: inertia_error, on: x, parameters: {delta: -0.999}}]"


def machine(effects: str) -> Derived:
    assert "effects: []" in SPEC
    return Derived(parse_spec(SPEC.replace("effects: []", f"effects: {effects}"), Path("made.yaml")))


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        ("[]", ()),
        (DELAY, ()),
        (ECCENTRIC, ("the code corrects a sensor error by iteration", "the sensor of x reads wrong")),
        (COGGING, ()),
        (UNSTABLE, ("no certificate",)),
    ],
)
def test_the_files_that_are_lost_are_named_with_the_reason(effects: str, words: tuple[str, ...]) -> None:
    """Against the files that are written of each."""
    before, after = machine("[]"), machine(effects)
    change = certificate_change(before.outcome, after.outcome)
    assert sorted(name for name, _ in change.lost) == [n for n in NAMES if n in before.files and n not in after.files]
    text = render("text/certificate_change.j2", d=SimpleNamespace(certificate=change))
    assert (
        text.count("is not made for the spec with it")
        == len(change.lost)
        == len(text.splitlines()) - 2 - (effects == UNSTABLE)
    )
    assert all(f"{name} (the " in text for name, _ in change.lost)
    assert all(some in text for some in words)
    assert not certificate_change(after.outcome, after.outcome).lost


@pytest.mark.parametrize(
    ("after", "advised"),
    [("the error is unstable", True), ("no code was generated: K_v", False), (55.0, False)],
)
def test_a_refused_spec_with_the_effect_is_followed_by_what_to_do(after: str | float, advised: bool) -> None:
    """After a Stribeck curve was found, the observer was unstable, and the text went on to "go on with spec.yaml"."""
    change = CertificateChange(55.0, after, ())
    text = render("text/certificate_change.j2", d=SimpleNamespace(certificate=change))
    assert ("`stiction certify`" in text) == advised
