"""What a command loads: help, the version and a wrong word none of the libraries, a verb those that it needs."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from codegen.base.version import VERSION
from tests.slow_cases import slow_except

from .command import SPECS, stiction

ROOT = SPECS.parent
LIBRARIES = ("sympy", "casadi", "numpy", "scipy", "matplotlib", "clarabel", "cvxpy", "pint", "lxml", "ruamel", "jinja2")
SCRIPT = """
import sys
from stiction import main
try:
    main()
except SystemExit:
    pass
print("\\nloaded", *sorted({name.partition(".")[0] for name in sys.modules}))
"""


def loaded(*arguments: object) -> set[str]:
    """The libraries that are in ``sys.modules`` at the end of a command."""
    command = [sys.executable, "-c", SCRIPT, *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    words = done.stdout.splitlines()[-1].split()
    assert words[0] == "loaded" and "codegen" in words
    return set(words) & set(LIBRARIES)


VERBS = ("check", "derive", "certify", "verify", "generate", "gains", "cancel", "simulate", "diagnose", "replay")


@pytest.mark.parametrize("arguments", [("--help",), ("--version",), ("version",), ("chekc",), (), ("check", "--latex")])
def test_words_of_the_command_itself_load_no_library(arguments: tuple[str, ...]) -> None:
    assert loaded(*arguments) == set()


ALL_VERBS = [*VERBS, "init", "schema", "demo", "laws", "effects", "audit", "gallery"]
HELPED = f"""
import sys
from stiction import main
for verb in {ALL_VERBS}:
    sys.argv = ["stiction", verb, "--help"]
    try:
        main()
    except SystemExit:
        pass
    print("\\nloaded", verb, *sorted({{name.partition(".")[0] for name in sys.modules}}))
"""


@pytest.fixture(scope="module")
def helped() -> dict[str, set[str]]:
    """Verb → what is in ``sys.modules`` behind its help, one after the other in one process."""
    done = subprocess.run([sys.executable, "-c", HELPED], cwd=ROOT, capture_output=True, text=True, check=True)
    words = [line.split() for line in done.stdout.splitlines() if line.startswith("loaded ")]
    return {verb: set(found) for _, verb, *found in words}


@pytest.mark.parametrize("verb", ALL_VERBS)
def test_help_of_a_verb_loads_no_library(verb: str, helped: dict[str, set[str]]) -> None:
    assert "codegen" in helped[verb] and helped[verb].isdisjoint(LIBRARIES)


def test_verify_needs_python_alone() -> None:
    assert loaded("verify", "generated/one_mass/certificate.json") == set()


def test_check_of_a_spec_in_si_units_loads_what_derives_and_nothing_that_solves_or_draws() -> None:
    """CasADi is in it: what ``generate`` would refuse is found by building the program."""
    found = loaded("check", "specs/one_mass.yaml")
    assert found == {"sympy", "casadi", "numpy", "ruamel", "jinja2"}


def test_simulate_by_steps_loads_no_solver_and_no_pictures(tmp_path: Path) -> None:
    short = tmp_path / "short.yaml"
    short.write_text((SPECS / "one_mass.yaml").read_text().replace("duration: 12", "duration: 0.1"))
    found = loaded("simulate", short, "-o", tmp_path / "log.csv")
    assert not found & {"matplotlib", "clarabel", "cvxpy", "pint"}


@pytest.mark.parametrize("verb", slow_except(["laws", "effects"], ["effects"]))
def test_the_list_of_a_kind_loads_nothing_that_solves_or_draws(verb: str) -> None:
    assert loaded(verb) == {"sympy", "casadi", "numpy", "ruamel", "jinja2"}


def test_the_version() -> None:
    assert stiction("--version").out == stiction("version").out == f"{VERSION}\n"


def test_a_file_of_the_users_called_codegen_is_not_run(tmp_path: Path) -> None:
    """The command is a script in another folder than the user's: Python looks for modules beside the script."""
    work, bin_folder = tmp_path / "work", tmp_path / "bin"
    work.mkdir()
    bin_folder.mkdir()
    (work / "codegen.py").write_text("raise SystemExit('the user's own')")
    script = bin_folder / "stiction"
    script.write_text("from stiction import main\nmain()\n")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(script), "--version"]
    done = subprocess.run(command, cwd=work, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, f"{VERSION}\n")
