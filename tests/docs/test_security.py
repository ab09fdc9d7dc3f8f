"""What SECURITY.md says of when something is compiled and run, held to what the verbs do."""

from __future__ import annotations

import ctypes
import os
import re
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import pytest

from tests.app.command import SPECS, stiction

PAGE = (Path(__file__).parents[2] / "SECURITY.md").read_text(encoding="utf-8")
SPEC = SPECS / "one_mass.yaml"
CALLS = {
    "check": (SPEC,),
    "derive": (SPEC,),
    "certify": (SPEC,),
    "verify": (SPECS.parent / "generated" / "one_mass" / "certificate.json",),
    "gains": (SPEC,),
    "generate": (SPEC, "-o", "out"),
    "export": (SPEC, "--to", "mjcf", "-o", "out.xml"),
}


def test_the_verbs_that_compile_nothing_are_those_that_are_named() -> None:
    (row,) = [line for line in PAGE.splitlines() if line.startswith("|") and line.endswith("| nothing |")]
    assert re.findall(r"`(\w+)`", row) == list(CALLS)


@pytest.mark.parametrize("verb", CALLS)
def test_nothing_is_compiled(verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No process is started and no library loaded by the compiler's module, through which all of them go."""
    monkeypatch.chdir(tmp_path)
    load = ctypes.CDLL

    def open_again(name: str, mode: int = ctypes.DEFAULT_MODE) -> ctypes.CDLL:
        """threadpoolctl asks the libraries that are loaded already for their number of threads."""
        assert mode & os.RTLD_NOLOAD, f"{name} loaded"
        return load(name, mode=mode)

    with patch("subprocess.Popen", side_effect=AssertionError("started")), patch("ctypes.CDLL", open_again):
        assert stiction(verb, *CALLS[verb]).code == 0


def test_a_replay_compiles_what_it_generated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the test above would see it; and it is compiled outside of any folder that others can write."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    rows = "\n".join(f"{k / 1000},{k * k / 1e6},{k % 7}" for k in range(4500))
    (tmp_path / "log.csv").write_text(f"t,x,w\n{rows}\n")
    started: list[list[str]] = []
    run = subprocess.run

    def noted(command: list[str], **more: object) -> subprocess.CompletedProcess[str]:
        started.append(command)
        return run(command, **more)  # type: ignore[call-overload]

    with patch("subprocess.run", noted):
        assert stiction("replay", SPEC, "log.csv").code == 0
    assert [Path(command[0]).name for command in started] in (["cc"], ["gcc"], ["clang"])


def test_only_the_compiler_starts_a_process() -> None:
    code = Path(sys.modules["codegen"].__file__ or "").parent
    found = {
        str(path.relative_to(code))
        for path in code.rglob("*.py")
        if re.search(r"\bsubprocess\.|os\.(system|exec\w+|spawn\w+|popen)\(", path.read_text(encoding="utf-8"))
    }
    assert found == {"base/compiler.py"}
