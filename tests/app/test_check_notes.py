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


@pytest.mark.parametrize(
    ("old", "new"), [(LEVEL, LEVEL), (LEVEL, OTHER_LAW.format(20, 50)), (LEVEL, OTHER_LAW.format(0, 5))]
)
def test_nothing_is_noted_of_what_is_usual(tmp_path: Path, old: str, new: str) -> None:
    assert notes(tmp_path, old, new) == []
