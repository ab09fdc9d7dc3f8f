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


@pytest.mark.parametrize(
    ("old", "new"), [(LEVEL, LEVEL), (LEVEL, OTHER_LAW.format(20, 50)), (LEVEL, OTHER_LAW.format(0, 5))]
)
def test_nothing_is_noted_of_what_is_usual(tmp_path: Path, old: str, new: str) -> None:
    assert notes(tmp_path, old, new) == []
