"""``check`` notes what is valid and seldom meant; it said nothing of these specs."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.app.check import check, check_json, check_text

from .command import SPECS

ONE = (SPECS / "one_mass.yaml").read_text()
LEVEL, SAMPLE = "law: coulomb, a: 50", "  sample_time: 0.001\nenvelope"
OTHER_LAW = "law: gaussian, F_c: {}, F_s: {}, v_s: 0.01, F_v: 0"


def notes(folder: Path, old: str, new: str) -> list[str]:
    """The notes of the shipped example with one change; those of the text and of the JSON are the same."""
    assert ONE.count(old) == 1
    spec = folder / "s.yaml"
    spec.write_text(ONE.replace(old, new))
    machine = check(spec)
    found: list[str] = check_json(machine)["notes"]
    assert [
        line.split("note", 1)[1].strip() for line in check_text(machine).splitlines() if "  note  " in line
    ] == found
    return found


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (SAMPLE, SAMPLE.replace("0.001", "1"), "with a sample_time of 1 s the observer is unstable"),
        (LEVEL, OTHER_LAW.format(50, 20), "rail: the static level F_s = 20 N is below the Coulomb level F_c = 50 N"),
        (LEVEL, "law: coulomb, a: 0", "rail: the friction level is zero at all speeds"),
    ],
)
def test_a_slip_of_writing_is_noted(tmp_path: Path, old: str, new: str, words: str) -> None:
    (told,) = notes(tmp_path, old, new)
    assert told.startswith(words)


def test_the_limit_of_the_sample_time_is_that_of_the_equations(tmp_path: Path) -> None:
    """Just below the limit that the note gives, there is no note."""
    (told,) = notes(tmp_path, SAMPLE, SAMPLE.replace("0.001", "0.023"))
    limit = float(told.split("stable below ")[1].split(" s")[0])
    assert notes(tmp_path, SAMPLE, SAMPLE.replace("0.001", str(0.99 * limit))) == []


TILTED = "parameters:\n  gravity: {value: 9.81, unit: m/s^2}\n  tilt: {value: 30, unit: UNIT}\n"


@pytest.mark.parametrize(("unit", "noted"), [("rad", 1), ("1", 1), ("deg", 0)])
@pytest.mark.parametrize("term", ["sin(tilt)", "cos(tilt)"])
def test_a_constant_angle_of_more_than_a_turn_is_noted(tmp_path: Path, unit: str, noted: int, term: str) -> None:
    """An axis that is tilted by 30 degrees, written as 30, was one of 4.77 turns, without a word."""
    tilted = ONE.replace("parameters:\n", TILTED.replace("UNIT", unit)).replace(
        "  - w\n", f"  - w - m*gravity*{term}\n"
    )
    (tmp_path / "s.yaml").write_text(tilted)
    machine = check(tmp_path / "s.yaml")
    found = check_json(machine)["notes"]
    assert len(found) == noted and all(note.startswith("tilt = 30") and term in note for note in found)


PENDULUM = """\
name: pendulum
coordinates: {phi: {velocity: w, unit: rad}}
inputs: {u: {unit: N*m}}
parameters:
  J: {value: 0.01, unit: kg*m^2}
  G: {value: 2, unit: N*m}
mass_matrix: [[MASS]]
force: [u - TERM]
friction:
  distribution: [[1]]
  contacts: [{name: bearing, law: coulomb, a: 0.1, unit: N*m}]
envelope: {phi: RANGE}
"""


@pytest.mark.parametrize(
    ("mass", "term", "range_", "noted"),
    [
        ("J", "G*sin(phi)", "[-80, 80]", True),
        ("J", "G*sin(phi + 1)", "[0, 30]", True),
        ("J*(2 + cos(phi)**2)", "G*sin(phi)", "[-80, 80]", True),  # a crank
        ("J", "G*sin(phi)", "[-80 deg, 80 deg]", False),
        ("J", "G*sin(phi)", "[-12, 12]", False),
        ("J", "G*sin(12*phi)", "[-80, 80]", False),  # cogging of a motor, whose turns are many
        ("J", "G*sin(phi) + G*phi/10", "[-80, 80]", False),  # a spiral spring does not repeat
        ("J", "G", "[-80, 80]", False),
    ],
)
def test_a_links_range_of_many_turns_is_noted(tmp_path: Path, mass: str, term: str, range_: str, noted: bool) -> None:
    """A pendulum with `phi: [-80, 80]` had a range of 25 turns, without a word."""
    spec = tmp_path / "pendulum.yaml"
    spec.write_text(PENDULUM.replace("MASS", mass).replace("TERM", term).replace("RANGE", range_))
    found = check_json(check(spec))["notes"]
    assert len(found) == noted
    assert all(note.startswith("phi: ") and note.endswith(" deg]`.") for note in found)


@pytest.mark.parametrize(
    ("old", "new"), [(LEVEL, LEVEL), (LEVEL, OTHER_LAW.format(20, 50)), (LEVEL, OTHER_LAW.format(0, 5))]
)
def test_nothing_is_noted_of_what_is_usual(tmp_path: Path, old: str, new: str) -> None:
    assert notes(tmp_path, old, new) == []
