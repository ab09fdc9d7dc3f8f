"""``stiction init``: what it writes is a spec that ``check`` accepts, and nothing of the user's is replaced."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from codegen.spec import read_spec

from .command import SPECS, contents, is_one_message, stiction


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_new_machine(folder: Path) -> None:
    made = stiction("init", "my_axis")
    assert (made.code, made.out) == (0, "my_axis.yaml\n") and list(contents(folder)) == ["my_axis.yaml"]
    sections = [line for line in Path("my_axis.yaml").read_text().splitlines() if line[:1].isalpha()]
    assert [line for line in sections if "#" not in line] == ["name: my_axis", "friction:", "observer:"]
    assert read_spec("my_axis.yaml").name == "my_axis"
    assert stiction("check", "my_axis.yaml").code == 0


@pytest.mark.parametrize("source", ["two_mass", "specs/two_mass.yaml", "thesis/one_mass_dfo", SPECS / "two_mass.yaml"])
def test_from_a_spec(folder: Path, source: object) -> None:
    assert stiction("init", "other", "--from", source).code == 0
    shipped = SPECS / f"{Path(str(source).removeprefix('specs/')).with_suffix('')}.yaml"
    ours, theirs = (path.read_text().splitlines() for path in (folder / "other.yaml", shipped))
    changed = [(a, b) for a, b in zip(ours, theirs, strict=True) if a != b]
    assert [a for a, _ in changed] == ["name: other"] and changed[0][1].startswith("name:")
    assert read_spec("other.yaml").name == "other"


def test_from_a_spec_with_a_robot(folder: Path) -> None:
    assert stiction("init", "arm", "--from", "seven_joint_arm").out.split() == ["arm.yaml", "seven_joint_arm.urdf"]
    assert read_spec("arm.yaml").robot == read_spec(SPECS / "seven_joint_arm.yaml").robot


def test_from_a_robot_file(folder: Path) -> None:
    (folder / "there").mkdir()
    shutil.copy(SPECS / "seven_joint_arm.urdf", folder / "there" / "arm.urdf")
    assert stiction("init", "own_arm", "--from", "there/arm.urdf").code == 0
    spec = read_spec("own_arm.yaml")
    assert spec.positions == read_spec(SPECS / "seven_joint_arm.yaml").positions
    assert set(spec.envelope) == {*spec.positions, *spec.velocities}
    assert stiction("init", "again", "--from", "arm.urdf").out == "again.yaml\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("my-axis",), "NAME: `my-axis`; expected letters"),
        (("taken",), "taken.yaml: the file exists already"),
        (("new", "--from", "two_maas"), "--from: `two_maas`, no such file; expected"),
        (("new", "--from", "../../etc/passwd"), "no such file"),
        (("new", "--from", "none.urdf"), "none.urdf: no such file"),
        (("new", "--from", "bad.yaml"), "bad.yaml:1: nam: unknown key"),
        (("double",), "the name `double`, a reserved word"),
    ],
)
def test_what_cannot_be_written(folder: Path, arguments: tuple[str, ...], words: str) -> None:
    (folder / "taken.yaml").write_text("mine")
    (folder / "bad.yaml").write_text("nam: x\n")
    before = contents(folder)
    result = stiction("init", *arguments)
    assert result.code == 2 and result.out == "" and words in result.err.splitlines()[0], result
    assert all(line.startswith("error: ") for line in result.err.splitlines())
    assert contents(folder) == before


@pytest.mark.parametrize(("given", "near"), [("foo.yaml", "foo"), ("belt gantry", "belt_gantry"), ("1.yaml", None)])
def test_a_name_that_is_none_is_answered_with_the_nearest(folder: Path, given: str, near: str | None) -> None:
    told = stiction("init", given)
    assert is_one_message(told) and "[SPEC009]" in told.err
    assert told.err.partition("did you mean ")[2].partition("?")[0] == (repr(near) if near else "")


def test_the_nearest_shipped_spec_is_named(folder: Path) -> None:
    result = stiction("init", "new", "--from", "two_maas")
    assert is_one_message(result) and "did you mean 'two_mass'?" in result.err


def robot_called(name: str) -> None:
    """A spec beside a robot file of that name."""
    shutil.copy(SPECS / "seven_joint_arm.urdf", name)
    text = (SPECS / "seven_joint_arm.yaml").read_text().replace("urdf: seven_joint_arm.urdf", f"urdf: {name}")
    Path("source.yaml").write_text(text)


def test_a_robot_file_called_like_the_new_spec_does_not_take_its_place(folder: Path) -> None:
    robot_called("robot.yaml")
    Path("below").mkdir()
    os.chdir("below")
    made = stiction("init", "robot", "--from", "../source.yaml")
    assert made.code == 2 and is_one_message(made) and "`robot.yaml`" in made.err and "[FILE004]" in made.err
    assert list(contents(Path())) == []


def test_a_robot_file_with_the_ending_of_a_spec_replaces_no_file(folder: Path) -> None:
    robot_called("robot.yaml")
    Path("below").mkdir()
    os.chdir("below")
    Path("robot.yaml").write_text("mine\n")
    made = stiction("init", "other", "--from", "../source.yaml")
    assert made.code == 2 and is_one_message(made) and "[FILE004]" in made.err
    assert Path("robot.yaml").read_text() == "mine\n"


@pytest.mark.parametrize("joint", ["a" * 400, "in"])
def test_a_fault_of_a_robot_is_told_of_its_file(folder: Path, joint: str) -> None:
    text = (SPECS / "seven_joint_arm.urdf").read_text()
    Path("arm.urdf").write_text(text.replace('"shoulder_yaw"', f'"{joint}"'))
    made = stiction("init", "my_arm", "--from", "arm.urdf")
    assert made.code == 2 and is_one_message(made) and made.err.startswith("error: arm.urdf: ")
    assert list(contents(folder)) == ["arm.urdf"]
