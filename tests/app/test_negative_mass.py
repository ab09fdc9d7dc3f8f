"""``stiction check`` warns of a mass or an inertia below zero that a sum in the mass matrix hides."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.app.command import SPECS, stiction

ONE = (SPECS / "one_mass.yaml").read_text("utf-8")
MASS, ROW = "  m: {value: 1, unit: kg}\n", "  - [m]\n"


def checked(folder: Path, parameters: str, entry: str, unit: str = "m", force: str = "N") -> list[str]:
    text = ONE.replace(MASS, parameters).replace(ROW, f"  - [{entry}]\n")
    text = text.replace("velocity: v, unit: m}", f"velocity: v, unit: {unit}}}").replace("unit: N}", f"unit: {force}}}")
    path = folder / "spec.yaml"
    path.write_text(text, "utf-8")
    done = stiction("check", path)
    assert done.code == 0, done.err
    told = [line for line in done.out.splitlines() if line.startswith("warning: ")]
    words = json.loads(stiction("check", path, "--json").out)["warnings"]
    assert words == [line.removeprefix("warning: ") for line in told]
    return told


def test_a_negative_mass_is_told_with_its_line(tmp_path: Path) -> None:
    two = "  m: {value: 3, unit: kg}\n  load: {value: -500, unit: g}\n"
    (told,) = checked(tmp_path, two, "m + load")
    line = 1 + ONE.split(MASS)[0].count("\n") + 1
    assert told.startswith(f"warning: {tmp_path / 'spec.yaml'}:{line}: parameters.load")
    assert "a mass of -500 g" in told and "sum" in told


@pytest.mark.parametrize(
    ("parameters", "entry", "warned"),
    [
        ("  J: {value: 3, unit: kg*m^2}\n  K: {value: -1, unit: kg*m^2}\n", "J + K", True),
        (
            "  J: {value: 3, unit: kg*m^2}\n  K: {value: -1, unit: kg*m^2}\n",
            "J + K*cos(x)",
            False,
        ),  # a product of inertia
        ("  J: {value: 3, unit: kg*m^2}\n", "J", False),
    ],
)
def test_an_inertia(tmp_path: Path, parameters: str, entry: str, warned: bool) -> None:
    assert bool(checked(tmp_path, parameters, entry, "rad", "N*m")) == warned


def test_no_shipped_spec_is_warned_of() -> None:
    for path in ("one_mass.yaml", "two_mass.yaml", "two_link_arm.yaml", "rig.yaml"):
        assert "warning" not in stiction("check", SPECS / path).out
