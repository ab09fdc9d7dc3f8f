"""What holds of every target of the export, found by the registry: a new one is tested without a line here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from codegen.app.derived import Derived
from codegen.base.errors import BadInput
from codegen.certify.outcome import Refusal
from codegen.export.generated_observer import GeneratedObserver
from codegen.export.targets import TARGETS, Choices, Written
from codegen.spec import parse_spec

ONE = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text(encoding="utf-8")
RIPPLE = "[{kind: cogging, on: x, parameters: {amplitude: 3, period: 0.8975979010256552, phase: 0}}]"  # 2 pi/7
MACHINES = {
    "a mass": ONE,
    "a motor with cogging": ONE.replace("unit: m}", "unit: rad}")
    .replace("unit: N}", "unit: N*m}")
    .replace("unit: kg}", "unit: kg*m^2}")
    .replace("effects: []", f"effects: {RIPPLE}"),
}
HEADER = "made by a test"


def written(target: str, text: str) -> Written:
    """The files of a machine, whose export does not wait for a certificate."""
    machine = Derived(parse_spec(text, Path("machine.yaml")))

    def uncertified(precision: str, cancelling: bool) -> GeneratedObserver:
        refused = Refusal("not asked for", None, 0.0, (), 0.0)
        return replace(machine.generated_observer(precision, cancelling), certify=lambda: refused)

    gear = 1.0 if TARGETS[target].is_map else None
    return TARGETS[target].write(machine.spec, machine.system, uncertified, Choices([HEADER], gear=gear))


@pytest.mark.parametrize("target", TARGETS)
def test_it_writes_a_machine_and_says_what_it_holds(target: str) -> None:
    found, faults = [], []
    for text in MACHINES.values():
        try:
            found.append(written(target, text))
        except BadInput as fault:
            faults.append(str(fault))
    assert found, faults
    for files, remarks in found:
        assert ([*files] == [""]) == bool(TARGETS[target].endings)
        assert remarks and any(HEADER in text for text in files.values())


@pytest.mark.parametrize("target", TARGETS)
def test_code_handles_an_invalid_sample_where_the_spec_says_so(target: str) -> None:
    """A template that leaves ``program.fault`` out would use NaN; no file of a model is changed by it."""
    text = MACHINES["a motor with cogging" if TARGETS[target].is_map else "a mass"]
    (held, remarks), (unheld, _) = written(target, text), written(target, text + "code: {fault: none}\n")
    is_code = any(remark.where == "certificate" for remark in remarks)
    assert (sum(map(len, held.values())) > sum(map(len, unheld.values()))) == is_code
    assert is_code or held == unheld
