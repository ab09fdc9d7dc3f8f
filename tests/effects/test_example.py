"""The entry that ``stiction effects KIND`` shows, pasted into a spec that ``stiction check`` then accepts."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.effects import CATALOGUE
from codegen.report.effects import effect_view
from tests.app.command import stiction

ONE = """\
name: stage
coordinates: {{x: {{velocity: v, unit: {unit}}}}}
inputs: {{w: {{unit: {force}}}}}
parameters: {{m: {{value: 2, unit: "{mass}"}}}}
mass_matrix: [[m]]
force: [w]
friction: {{distribution: [[1]], contacts: [{{name: rail, law: coulomb, a: 3, unit: {force}}}]}}
"""
TWO = """\
name: stages
coordinates: {x1: {velocity: v1, unit: m}, x2: {velocity: v2, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m, 0], [0, m]]
force: [w, 0]
friction: {distribution: [[1], [0]], contacts: [{name: rail, law: coulomb, a: 3, unit: N}]}
"""


@pytest.mark.parametrize("kind", CATALOGUE)
def test_the_example_of_each_kind_is_accepted(kind: str, tmp_path: Path) -> None:
    effect = CATALOGUE[kind]
    shown = stiction("effects", kind).out.splitlines()
    first = shown.index("effects:")
    entries = [line.partition("{")[2] for line in shown[first + 1 :]]
    assert len(entries) == len(effect.forms)
    units = ("rad", "N*m", "kg*m^2") if effect.needs == "a coordinate in rad" else ("m", "N", "kg")
    spec = TWO if effect.sits_on == "two coordinates" else ONE.format(unit=units[0], force=units[1], mass=units[2])
    for form, entry in zip(effect.forms, entries, strict=True):
        path = tmp_path / "spec.yaml"
        path.write_text(f"{spec}effects:\n  - {{{entry}\n", encoding="utf-8")
        checked = stiction("check", path)
        assert checked.code == 0, checked.err
        assert all(f"{p.name}: " in entry for p in form.parameters)
    (tmp_path / "as_shown.yaml").write_text(spec + "\n".join(shown[first:]) + "\n", encoding="utf-8")
    assert stiction("check", tmp_path / "as_shown.yaml").code == 0


def test_only_what_the_simplest_form_lacks_may_be_left_out() -> None:
    """The coefficient of the simplest form has another range in a richer one; it is needed in both."""
    for effect in CATALOGUE.values():
        optional = {p["name"] for p in effect_view(effect)["parameters"] if p["optional"]}
        possible = {p.name for form in effect.forms for p in form.parameters}
        assert optional == possible - {p.name for p in effect.parameters}
