"""The documents name what the registries hold, and the README stays short and true."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.reference.effects import effect_picture, effects_page
from benchmarks.reference.laws import law_picture, laws_page
from codegen.app import cli, verbs
from codegen.base.errors import LONGEST_PART
from codegen.base.input_files import LARGEST_GENERATED, LARGEST_TEXT
from codegen.checker import files, verify
from codegen.effects import CATALOGUE
from codegen.friction import LAWS
from codegen.logs import binding
from codegen.logs.formats import csv_file, mat_file, numpy_file, source, text_lines
from codegen.observers import OBSERVERS
from codegen.report.examples import EXAMPLES
from codegen.spec import parse_spec, yaml_limits
from codegen.spec.urdf import LARGEST as LARGEST_URDF

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SPECIFICATION = (ROOT / "docs" / "specification.md").read_text(encoding="utf-8")
PAGE_OF_LAWS = (ROOT / "docs" / "laws.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=list(CATALOGUE))
def test_every_effect_is_documented_with_its_parameters(effect) -> None:
    (row,) = [line for line in SPECIFICATION.splitlines() if line.startswith(f"| `{effect.kind}` |")]
    assert f"| {effect.sits_on}" in row
    assert all(f"`{p.name}`" in row for p in effect.parameters)


def test_every_law_and_observer_is_documented() -> None:
    """The specification names each law; its row, parameters and picture are on the page of the laws."""
    for law in LAWS.values():
        assert f"`{law.name}`" in SPECIFICATION
        (row,) = [line for line in PAGE_OF_LAWS.splitlines() if line.startswith(f"| `{law.name}` |")]
        assert all(f"`{p.name}`" in row for p in law.parameters)
        assert f"](laws/{law.name}.svg)" in PAGE_OF_LAWS
        assert (ROOT / "docs" / "laws" / f"{law.name}.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert all(f"`{kind}`" in SPECIFICATION for kind in OBSERVERS)


def test_the_page_of_the_laws_is_current() -> None:
    """Written again by ``make reference``; the pictures are drawn from the same classes."""
    assert laws_page() == PAGE_OF_LAWS


def test_a_law_without_an_example_is_on_the_page_without_a_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(EXAMPLES.laws, "lugre")
    page = laws_page()
    assert "| `lugre` |" in page and "### `lugre`" in page and "](laws/lugre.svg)" not in page
    assert "](laws/dahl.svg)" in page


def test_the_page_of_the_effects_is_current() -> None:
    """Written again by ``make reference``; each effect has its section and its picture."""
    page = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")
    assert effects_page() == page
    for kind in CATALOGUE:
        assert f"\n## {kind}\n" in page and f"](effects/{kind}.svg)" in page
        assert (ROOT / "docs" / "effects" / f"{kind}.svg").read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.slow
def test_the_page_s_own_effect_can_be_registered(tmp_path: Path) -> None:
    (text,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "effects.md").read_text(encoding="utf-8"), re.S)
    (tmp_path / "my_effects.py").write_text(text, encoding="utf-8")
    spec = (ROOT / "specs" / "one_mass.yaml").read_text(encoding="utf-8")
    one = "effects: [{kind: magnetic_pull, on: x, parameters: {p: 3, x_0: 0.1}}]"
    (tmp_path / "spec.yaml").write_text(spec.replace("effects: []", one), encoding="utf-8")
    command = [sys.executable, "-m", "codegen.app.cli"]
    done = {
        options: subprocess.run(
            [*command, *options, "check", "spec.yaml"], cwd=tmp_path, capture_output=True, text=True
        )
        for options in ((), ("--effects", "my_effects.py"), ("--effects", "spec.yaml"))
    }
    unknown, known, wrong = done.values()
    assert unknown.returncode == 2 and "unknown effect `magnetic_pull`" in unknown.stderr
    assert known.returncode == 0 and "magnetic_pull_x_x_0" in known.stdout
    assert wrong.returncode == 2 and "the ending `.yaml`; expected a Python file" in wrong.stderr


@pytest.mark.parametrize("kind", ["presliding", "coupling"])
def test_a_picture_of_an_effect_comes_out_the_same_each_time(kind: str) -> None:
    assert effect_picture(CATALOGUE[kind]) == effect_picture(CATALOGUE[kind])


@pytest.mark.parametrize("name", ["lugre", "karnopp", "static_viscous"])
def test_a_picture_comes_out_the_same_each_time(name: str) -> None:
    assert law_picture(LAWS[name]) == law_picture(LAWS[name])


def test_the_readme_is_short_and_its_spec_is_one() -> None:
    assert len(README.splitlines()) <= 100
    assert "[checker](codegen/checker/)" in README
    (text,) = re.findall(r"```yaml\n(.*?)```", README, re.S)
    assert parse_spec(text, Path("readme.yaml")).observer is not None


def test_the_c_of_the_readme_compiles_and_prints_what_it_says(tmp_path: Path) -> None:
    (source,) = re.findall(r"```c\n(.*?)```", README, re.S)
    (printed,) = re.findall(r"It prints `(.*?)`", README)
    (tmp_path / "main.c").write_text(source)
    folder = ROOT / "generated" / "two_mass"
    command = ["cc", "-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", f"-I{folder}", str(tmp_path / "main.c")]
    subprocess.run([*command, str(folder / "two_mass.c"), "-lm", "-o", str(tmp_path / "a.out")], check=True)
    done = subprocess.run([str(tmp_path / "a.out")], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == printed


def test_the_stated_sizes_are_those_of_the_code() -> None:
    (section,) = re.findall(r"^## Files, their sizes.*", SPECIFICATION, re.S | re.M)
    limits = [LARGEST_TEXT, LARGEST_GENERATED, LARGEST_URDF, verify.MAX_TEXT, files.MAX_FILE, source.LARGEST]
    limits += [source.LARGEST_STREAM, csv_file.MOST_ROWS, text_lines.LONGEST_LINE, mat_file.MOST_VARIABLES]
    limits += [numpy_file.LONGEST_HEADER, binding.MOST_COLUMNS, yaml_limits.MOST_NODES]
    for limit in limits:
        assert f" {limit:,} ".replace(",", " ") in section
    assert f"at most {yaml_limits.DEEPEST} deep" in section and f"{yaml_limits.LONGEST_NUMBER} digits" in section
    assert f"at most {yaml_limits.LONGEST_KEY} characters" in " ".join(section.split())
    assert f"at most {LONGEST_PART} characters" in section
    for code in (verbs.REFUSED, verbs.STALE, cli.INTERNAL, cli.INTERRUPTED):
        assert f"\n| {code} | " in section
