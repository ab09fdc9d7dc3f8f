"""``stiction generate`` with choices of precision, fault policy and target, and names that no code can have."""

from __future__ import annotations

import shutil

import pytest

from .command import SPECS, contents, stiction

TEXT = (SPECS / "one_mass.yaml").read_text(encoding="utf-8")
SOURCES = {"one_mass.h", "one_mass.c", "example_main.c", "CMakeLists.txt", "one_mass.mk"}
BESIDE = {"certificate.json", "proof.json", "ellipsoid.json", "limit.json", "manifest.json", "README.md"}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(SPECS / "one_mass.yaml", tmp_path / "one_mass.yaml")
    return tmp_path


def test_single_by_the_command_and_by_the_spec(folder):
    assert stiction("generate", "one_mass.yaml", "--precision", "single", "-o", "a").code == 0
    (folder / "one_mass.yaml").write_text(TEXT + "code: {precision: single}\n")
    assert stiction("generate", "one_mass.yaml", "-o", "b").code == 0
    a, b = ((folder / name / "one_mass.c").read_text() for name in "ab")
    assert "stiction generate one_mass.yaml --precision single\n" in a
    assert a.splitlines()[8:] == b.splitlines()[8:] and "double" not in a and "fabsf" in a
    assert stiction("generate", "one_mass.yaml", "-o", "b", "--precision", "double").code == 0
    assert "double precision" in (folder / "b" / "one_mass.c").read_text()


def test_no_fault_policy(folder):
    assert stiction("generate", "one_mass.yaml", "--fault", "none", "-o", "a").code == 0
    for name in ("one_mass.c", "one_mass.h", "example_main.c", "__init__.py"):
        assert "fault" not in (folder / "a" / name).read_text().replace("--fault", "")


@pytest.mark.parametrize("target", ["c", "python"])
def test_one_target(folder, target):
    assert stiction("generate", "one_mass.yaml", "--target", target, "-o", "a").code == 0
    python = {"__init__.py"} | BESIDE - {"proof.json", "ellipsoid.json"}  # which is of the C
    assert set(contents(folder / "a")) == (python if target == "python" else SOURCES | BESIDE)


@pytest.mark.parametrize(
    ("option", "value"), [("--precision", "half"), ("--fault", "ignore"), ("--target", "rust"), ("--target", "../c")]
)
def test_choices_that_there_are_not(folder, option, value):
    result = stiction("generate", "one_mass.yaml", option, value, "-o", "a")
    assert result.code == 2 and option in result.err and f"`{value}`" in result.err
    assert not (folder / "a").exists()


@pytest.mark.parametrize(
    "name", ["I", "E", "while", "lambda", "double", "None", "X", "Ground", "INFINITY", "a/b", ".."]
)
def test_names_that_no_code_can_have(folder, name):
    text = TEXT.replace("  m: {value", f"  m: {{value: 1, unit: kg}}\n  {name}: {{value").replace("[m]", f"[{name}]")
    (folder / "one_mass.yaml").write_text(text.replace("name: rail", "name: ground"))
    result = stiction("generate", "one_mass.yaml")
    if name in ("X", "Ground"):  # beside the coordinate x and the contact ground
        assert result.code == 0
    else:
        assert result.code == 2 and name in result.err
        assert list(contents(folder)) == ["one_mass.yaml"]


@pytest.mark.parametrize("name", ["../up", "a/b", "/x", "int", "class", ""])
def test_machines_that_no_folder_can_have(folder, name):
    (folder / "one_mass.yaml").write_text(TEXT.replace("name: one_mass", f"name: '{name}'", 1))
    result = stiction("generate", "one_mass.yaml")
    assert result.code == 2 and "one_mass.yaml" in result.err
    assert list(contents(folder)) == ["one_mass.yaml"]


def test_a_bad_code_section(folder):
    (folder / "one_mass.yaml").write_text(TEXT + "code: {precision: quadruple}\n")
    result = stiction("generate", "one_mass.yaml")
    assert result.code == 2 and "code.precision" in result.err
