"""Text of a spec and the names of files are data: nothing of them is executed, whatever the verb."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.twin import load_twin

from .command import SPECS, Result, contents, is_one_message, stiction

ONE = (SPECS / "one_mass.yaml").read_text()
LINE = "source: Mentzelopoulou 1994, sections 2.3 and 3.3"
MARK = "executed"
CALL = (
    f'__attribute__((constructor)) static void own(void) {{ extern int system(const char *); system("touch {MARK}"); }}'
)
SOURCES = {
    "a splice": f"*\\\n/ {CALL} /\\\n*",
    "a splice with a blank behind it": f"*\\ \n/ {CALL} /\\ \n*",
    "a trigraph": f"*??/\n/ {CALL} /??/\n*",
}
FILES = {
    "a docstring": f'x"""; import os; os.mkdir("{MARK}"); """y.yaml',
    "a line of CMake": f"x\nexecute_process(COMMAND touch {MARK})\n#.yaml",
    "a line of make": f"x\nown := $(shell touch {MARK})\n#.yaml",
    "a carriage return": f"x\rown := $(shell touch {MARK})\r#.yaml",
    "a backslash": "x\\.yaml",
}


def with_source(text: str) -> str:
    assert LINE in ONE
    return ONE.replace(LINE, f"source: {json.dumps(text)}")


def log(folder: Path) -> Path:
    rows = "\n".join(f"{k / 1000},{1e-5 * k},1" for k in range(50))
    path = folder / "log.csv"
    path.write_text(f"t,x,w\n{rows}\n")
    return path


def verbs(spec: str, folder: Path) -> list[tuple[object, ...]]:
    return [
        ("generate", "--uncertified", "-o", "made", spec),
        ("generate", "--uncertified", "--target", "fmu", "-o", "made", spec),
        ("replay", spec, log(folder), "-o", "estimates.csv"),
    ]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def all_refused(folder: Path, spec: str) -> list[Result]:
    given = set(contents(folder)) | {"log.csv"}
    results = [stiction(*words) for words in verbs(spec, folder)]
    assert not (folder / MARK).exists()
    assert {p for p in contents(folder) if not p.startswith("cache")} == given
    return results


@pytest.mark.parametrize("kind", SOURCES)
def test_a_source_that_leaves_a_comment_of_c_is_refused(folder, kind):
    (folder / "s.yaml").write_text(with_source(SOURCES[kind]))
    for result in all_refused(folder, "s.yaml"):
        assert is_one_message(result) and "s.yaml:3: source: a line that ends in a backslash" in result.err


@pytest.mark.parametrize("kind", FILES)
def test_a_file_name_that_leaves_a_comment_is_refused(folder, kind):
    (folder / FILES[kind]).write_text(ONE)
    for result in all_refused(folder, FILES[kind]):
        assert is_one_message(result) and "a file name with the character" in result.err
        assert result.err.rstrip("\n").isprintable()


def test_other_file_names_are_reduced(folder):
    """In a Makefile, a shell and CMake these would expand; spaces would part one word into two."""
    name = f"a;$(touch {MARK})`touch {MARK}`#${{ENV}}'é β.yaml"
    (folder / name).write_text(ONE)
    assert stiction("generate", "-o", "made", name).code == 0
    reduced = f"a___touch_{MARK}__touch_{MARK}____ENV__é_β.yaml"
    for file in ("one_mass.h", "one_mass.c", "__init__.py", "CMakeLists.txt", "one_mass.mk", "README.md"):
        assert f"stiction generate {reduced}" in (folder / "made" / file).read_text("utf-8"), file
    for file in ("manifest.json", "certificate.json"):
        assert json.loads((folder / "made" / file).read_text("utf-8"))["tool"]["command"].endswith(reduced)
    assert stiction("verify", "made/certificate.json", "--spec", name).code == 0
    assert stiction("generate", "-o", "made", "--check", name).code == 0
    load_twin((folder / "made" / "__init__.py").read_text("utf-8"), "one_mass")
    assert (
        subprocess.run(["make", "-f", "made/one_mass.mk", "-n"], capture_output=True, check=False).returncode == 2
    )  # no target
    assert not (folder / MARK).exists()


@pytest.mark.skipif(os.name != "posix", reason="file names are bytes on POSIX systems alone")
def test_what_a_terminal_obeys_does_not_reach_it(folder):
    """Escape sequences in a value, a key, a file name and the source are written out, in errors and in output."""
    escape = "\x1b]0;owned\x07\x1b[31m\u202e[red]x[/red]"
    quoted = json.dumps(escape)
    specs = {
        "key.yaml": ONE.replace("effects: []", f"{quoted}: 1\neffects: []"),
        "name.yaml": ONE.replace("name: one_mass", f"name: {quoted}"),
        "unit.yaml": ONE.replace("unit: kg", f"unit: {quoted}"),
        "effect.yaml": ONE.replace("effects: []", f"effects: [{{kind: {quoted}, on: rail, parameters: {{}}}}]"),
        f"{escape.replace('/', '')}.yaml": "name: [",
    }
    for name, text in specs.items():
        (folder / name).write_text(text, encoding="utf-8")
        result = stiction("check", name)
        assert is_one_message(result), name
        assert result.err.rstrip("\n").isprintable() and "\\x1b" in result.err, name
    (folder / "source.yaml").write_text(with_source(escape), encoding="utf-8")
    shown = stiction("check", "source.yaml")
    assert shown.code == 0 and shown.err == ""
    assert "one_mass: \\x1b]0;owned\\x07\\x1b[31m\\u202e[red]x[/red]" in shown.out
    assert all(line.isprintable() for line in shown.out.split("\n"))
