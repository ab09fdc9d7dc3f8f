"""A diagnosis says which proofs beside the certificate the augmented spec has no longer, and why."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from codegen.app.derived import Derived
from codegen.app.diagnosis_folder import certificate_change
from codegen.base.text import render
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
    assert text.count("is not made for the spec with it") == len(change.lost) == len(text.splitlines()) - 2
    assert all(f"{name} (the " in text for name, _ in change.lost)
    assert all(some in text for some in words)
    assert not certificate_change(after.outcome, after.outcome).lost
