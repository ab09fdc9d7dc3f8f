"""``--json`` of every verb: one JSON object on standard output, with the exit status of the words."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

from codegen.app.verbs import app
from codegen.base.error_codes import CODES
from codegen.base.result import plain
from codegen.effects import CATALOGUE
from codegen.friction import LAWS

from .command import SPECS, is_one_message, stiction

ROOT = SPECS.parent
ONE, TWO = SPECS / "one_mass.yaml", SPECS / "two_mass.yaml"
SHIPPED = ROOT / "generated" / "one_mass"
WITHOUT = {"init", "schema", "demo", "version"}
"""Verbs that print paths, a schema that is JSON itself, the stations of a demonstration, and a number."""


def printed(*arguments: object, code: int = 0) -> Any:
    done = stiction(*arguments, "--json")
    assert done.code == code, done.err
    content = json.loads(done.out)
    assert content["format"].startswith("stiction-")
    return content


def test_every_verb_with_a_result_has_it() -> None:
    group = typer.main.get_command(app)
    assert isinstance(group, typer.core.TyperGroup)
    flags = {name: [p for p in verb.params if "--json" in p.opts] for name, verb in group.commands.items()}
    assert {name for name, found in flags.items() if not found} == WITHOUT
    assert all(p.is_flag for found in flags.values() for p in found)


def test_the_page_of_the_commands_names_the_verbs_without_it() -> None:
    page = (ROOT / "docs" / "commands.md").read_text("utf-8")
    (named,) = re.findall(r"its result as JSON; ([^.]*) do not have it", page)
    assert set(re.findall(r"`(\w+)`", named)) == WITHOUT


def test_before_the_verb_it_is_told_where_it_belongs() -> None:
    """It said *No such option: --json (Possible options: --version)*."""
    told = stiction("--json", "check", ONE)
    assert is_one_message(told) and "`stiction check SPEC --json`" in told.err
    assert "--json" not in stiction("--help").out


def test_check() -> None:
    found = printed("check", SPECS / "two_mass.yaml")
    assert found["mass_matrix"] == [["m1", "0"], ["0", "m2"]]
    assert [c["name"] for c in found["contacts"]] == ["between", "ground"]
    assert found["values"]["m2"] == {"value": 50.0, "unit": "kg"}
    assert found["observer"]["gains"]["K_F_between"]["value"] == 500.0


def test_check_shows_the_tolerances(tmp_path: Path) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(ONE.read_text("utf-8").replace("unit: kg}", "unit: kg, tolerance: 2.5 %}"), "utf-8")
    assert printed("check", path)["values"]["m"] == {"value": 1.0, "unit": "kg", "tolerance": 0.025}
    line = next(line for line in stiction("check", path).out.splitlines() if line.split()[:1] == ["m"])
    assert line.endswith("1 kg, tolerance 2.5 %")


def test_verify(tmp_path: Path) -> None:
    found = printed("verify", SHIPPED / "certificate.json")
    assert found["verified"] and found["status"] == "verified"
    words = stiction("verify", SHIPPED / "certificate.json", "--details").out
    assert found["claim"] in words and all(fact in words for fact in found["facts"])
    text = (SHIPPED / "certificate.json").read_text("utf-8")
    alone = tmp_path / "certificate.json"
    alone.write_text(text, "utf-8")
    loose = printed("verify", alone, code=5)
    assert (loose["status"], loose["verified"]) == ("not_bound", False), "a reader could take it for bound to the C"
    assert loose["facts"] == found["facts"][: len(loose["facts"])] and loose["unproved"]
    guarded = printed("verify", SHIPPED.with_name("one_mass_domain"), code=4)
    assert (guarded["status"], guarded["verified"], guarded["whole"]) == ("verified_under_conditions", True, False)
    content = json.loads(text)
    alone.write_text(json.dumps(content | {"decay_rate": "1000000"}), "utf-8")
    refused = printed("verify", alone, code=3)
    assert (refused["status"], refused["verified"]) == ("refused", False) and refused["refused"]


def test_generate_says_what_it_wrote_and_what_is_stale(tmp_path: Path) -> None:
    folder = tmp_path / "one_mass"
    shutil.copytree(SHIPPED, folder, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "one_mass.c").write_text("")
    (found,) = printed("generate", ONE, "-o", folder, "--check", code=4)["machines"]
    assert found["stale"] == ["one_mass.c"] and found["certified"]
    (found,) = printed("generate", ONE, "-o", folder, "--force")["machines"]
    assert set(found["files"]) <= {path.name for path in folder.iterdir()} and found["stale"] == []


def test_simulate_and_replay(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    assert printed("simulate", ONE, "-o", log)["log"] == str(log) and log.is_file()
    found = printed("replay", ONE, log, "-o", tmp_path / "out.csv")
    header, *rows = (tmp_path / "out.csv").read_text("utf-8").splitlines()
    assert found["samples"] == len(rows)
    assert "F_hat_rail" in {p["name"] for p in found["peaks"]} <= set(header.split(","))


def test_lists() -> None:
    laws = [law["name"] for group in printed("laws")["groups"] for law in group["laws"]]
    assert sorted(laws) == sorted(LAWS)
    assert [effect["kind"] for effect in printed("effects")["effects"]] == list(CATALOGUE)
    assert {row["code"]: (row["meaning"], row["advice"]) for row in printed("errors")["codes"]} == CODES


def test_bad_input_is_one_message_and_the_same_as_json() -> None:
    done = stiction("check", "none.yaml", "--json")
    assert done.code == 2 and done.err.startswith("error: none.yaml") and done.err.endswith(" [FILE001]\n")
    content = json.loads(done.out)
    (error,) = content["errors"]
    assert content["format"] == "stiction-errors/1"
    assert (error["code"], error["file"], error["line"], error["nearest"]) == ("FILE001", "none.yaml", None, None)
    assert f"{error['file']}: {error['found']}; expected {error['expected']}" in done.err


def test_every_fault_of_a_spec_is_in_the_json(tmp_path: Path) -> None:
    text = TWO.read_text("utf-8").replace("eta3*x1 -", "etta3*x1 -").replace("v1: [-5, 5]", "v1: [5, -5]")
    (tmp_path / "bad.yaml").write_text(text, "utf-8")
    found = printed("check", tmp_path / "bad.yaml", code=2)["errors"]
    assert {"SPEC008", "SPEC007"} == {error["code"] for error in found}
    assert all(error["line"] for error in found)


def test_what_is_no_number_is_null() -> None:
    assert plain({"a": (float("nan"), float("inf"), 1.5, 2, True, None, Path("x"))}) == {
        "a": [None, None, 1.5, 2, True, None, "x"]
    }


@pytest.mark.parametrize(
    ("words", "offered"), [("stiction che", ["check"]), ("stiction certify --js", ["--json"]), ("stiction di", None)]
)
def test_the_shell_completes_verbs_and_options(words: str, offered: list[str] | None) -> None:
    given = {"_STICTION_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    command = [sys.executable, "-c", "from stiction import main; main()"]
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, **given}, capture_output=True, text=True, check=False)
    assert done.stdout.split() == (["diagnose"] if offered is None else offered), done.stderr


def test_completion_can_be_installed(tmp_path: Path) -> None:
    """Into a home folder of its own; the script calls this command and loads none of its libraries."""
    environment = {
        **os.environ,
        "HOME": str(tmp_path),
        "SHELL": "/bin/bash",
        "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1",
    }
    command = [sys.executable, "-c", "from stiction import main; main()", "--install-completion", "bash"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    scripts = [path for path in tmp_path.rglob("*stiction*") if path.is_file()]
    assert any("_STICTION_COMPLETE=complete_bash" in path.read_text("utf-8") for path in scripts)
