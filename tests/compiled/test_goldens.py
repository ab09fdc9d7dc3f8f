"""Everything in generated/ is what the tool writes now, by one command; a second run gives the same bytes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stiction import generate as generate_now

from .shipped import SHIPPED, model, program

ROOT = Path(__file__).parents[2]
SPECS = sorted([*(ROOT / "specs").glob("*.yaml"), *(ROOT / "specs" / "thesis").glob("*.yaml")])
QUICK = [ROOT / "specs" / "two_mass.yaml"]


def stiction(folder: Path, hash_seed: str, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the command in a folder; ``generated/`` there is what it writes or checks."""
    environment = os.environ | {"PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", "from codegen.app.cli import main; main()", *map(str, words)]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def generate(folder: Path, hash_seed: str, specs: list[Path], *more: str) -> subprocess.CompletedProcess[str]:
    folder.mkdir(exist_ok=True)
    return stiction(folder, hash_seed, "generate", *specs, "--uncertified", *more)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


LONG_TO_CERTIFY = (
    "chain",
    "seven_joint_arm",
    "thesis/one_mass_dfo",
    "thesis/rig_dfoa",
    "thesis/rig_dfob",
    "thesis/two_mass_cancellation",
    "thesis/two_mass_gdfo",
)
"""Their certificates take 6 to 20 s of CPU to find; that those that are shipped hold is tested in tests/checker."""


@pytest.mark.parametrize(
    "spec", [pytest.param(spec, marks=pytest.mark.slow if spec in LONG_TO_CERTIFY else ()) for spec in SHIPPED]
)
def test_generated_is_current(spec: str) -> None:
    """Code, certificates and README, as `make goldens` checks them; here each on its own, side by side."""
    done = generate_now(model(spec), ROOT / "generated" / program(spec).name, check_only=True, uncertified=True)
    assert not done.stale, f"run `make generate`: {', '.join(done.stale)}"


@pytest.mark.parametrize("spec", LONG_TO_CERTIFY)
def test_generated_code_is_current(spec: str) -> None:
    folder = ROOT / "generated" / program(spec).name
    assert {name: (folder / name).read_text("utf-8") for name in model(spec).sources} == dict(model(spec).sources)


def test_generated_holds_the_shipped_specs_and_nothing_else():
    folders = {p.name for p in (ROOT / "generated").iterdir() if p.is_dir() and p.name != "__pycache__"}
    assert folders == {p.stem for p in SPECS}


@pytest.mark.slow
@pytest.mark.parametrize("specs", [QUICK, pytest.param(SPECS, marks=pytest.mark.slow)], ids=["one", "all"])
def test_a_second_run_gives_the_same_bytes(tmp_path, specs):
    runs = []
    for seed in ("1", "4711"):
        done = generate(tmp_path / seed, seed, specs)
        assert done.returncode == 0, done.stdout + done.stderr
        runs.append(contents(tmp_path / seed))
    assert runs[0] == runs[1]
    assert len(runs[0]) > 5 * len(specs)


def test_one_changed_letter_is_stale(tmp_path):
    names = ("two_mass.c", "two_mass.h", "__init__.py", "README.md", "example_main.c")
    shutil.copytree(ROOT / "generated" / "two_mass", tmp_path / "generated" / "two_mass")
    for name in names:
        changed = tmp_path / "generated" / "two_mass" / name
        text = changed.read_text(encoding="utf-8")
        changed.write_text(text.replace("two_mass", "two_masS", 1), encoding="utf-8")
    done = generate_now(model("two_mass"), tmp_path / "generated" / "two_mass", check_only=True)
    assert set(done.stale) == set(names)
