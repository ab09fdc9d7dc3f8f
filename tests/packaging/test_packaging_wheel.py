"""The wheel: everything inside, and the demo from an empty environment outside the source tree."""

from __future__ import annotations

import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(*command: object, cwd: Path) -> str:
    done = subprocess.run([*map(str, command)], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def files_under(folder: Path) -> set[str]:
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and "__pycache__" not in p.parts}


def wheel_of(folder: Path, *more: str) -> Path:
    run(sys.executable, "-m", "pip", "wheel", ROOT, "--no-deps", "-q", "-w", folder, *more, cwd=folder)
    return next(folder.glob("stiction-*.whl"))


def test_resources_are_declared_and_found():
    """What hatchling is told to put in is what ``resource_folder`` looks for."""
    import tomllib

    from codegen.base.resources import resource_folder

    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel["force-include"] == {name: f"codegen/shipped/{name}" for name in ("templates", "specs")}
    assert wheel["packages"] == ["codegen", "stiction.py"]
    for name in wheel["force-include"]:
        assert files_under(resource_folder(name)) == files_under(ROOT / name) != set()


@pytest.mark.slow
def test_contents(tmp_path):
    with zipfile.ZipFile(wheel_of(tmp_path)) as archive:
        names = set(archive.namelist())
    for folder in ("templates", "specs"):
        assert {f"codegen/shipped/{folder}/{name}" for name in files_under(ROOT / folder)} <= names
    assert {f"codegen/{name}" for name in files_under(ROOT / "codegen")} <= names
    outside = {n for n in names if not n.startswith("codegen/") and ".dist-info/" not in n}
    assert outside == {"stiction.py"}


@pytest.mark.slow
def test_demo_from_an_empty_environment(tmp_path):
    wheel = wheel_of(tmp_path)
    venv.create(tmp_path / "venv", with_pip=True)
    python, away = tmp_path / "venv" / "bin" / "python", tmp_path / "away"
    away.mkdir()
    run(python, "-m", "pip", "install", "-q", "--disable-pip-version-check", wheel, cwd=away)
    where = run(python, "-I", "-c", "import codegen; print(codegen.__file__)", cwd=away)
    assert str(tmp_path / "venv") in where
    (away / "codegen.py").write_text("raise SystemExit('the user's own')")
    script = "import stiction; m = stiction.load('my.yaml'); print(m.verify()); m.generate('out')"
    run(tmp_path / "venv" / "bin" / "stiction", "init", "my", cwd=away)
    assert "<Verified: machine my, status verified, proved of the C" in run(python, "-c", script, cwd=away)
    assert {"my.c", "my.h", "certificate.json"} <= files_under(away / "out")
    assert "my" in run(python, "-m", "stiction", "check", "my.yaml", cwd=away)
    (away / "codegen.py").unlink()
    said = run(tmp_path / "venv" / "bin" / "stiction", "demo", cwd=away)
    assert "cogging" in said
    written = files_under(away / "demo")
    wanted = {"belt_axis.c", "belt_axis.h", "__init__.py", "certificate.json", "manifest.json", "README.md"}
    assert {f"generated/belt_axis/{name}" for name in wanted} <= written
    assert {"train.csv", "test.csv"} <= written
    assert {f"diagnosis/{name}" for name in ("diagnosis.json", "spec.yaml", "report.html")} <= written
    run(python, "-I", "-m", "codegen.checker.verify", "demo/generated/belt_axis/certificate.json", cwd=away)
