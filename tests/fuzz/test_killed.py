"""A verb that is killed, kill -9, at each thing it does to its folder: no half file, and the next run works.

A child process is told by Python's audit hooks each time it opens, renames, removes or changes a file of the folder,
and kills itself at the one of a given number. So every moment is tried, and the same ones each time.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.app.command import SPECS, contents, process

CHILD = """
import json, os, signal, sys
from pathlib import Path
from codegen.base import files

folder, at, arguments = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
EVENTS = ("open", "os.rename", "os.remove", "os.chmod", "os.mkdir", "os.rmdir", "os.truncate", "os.link", "os.symlink")
here = os.path.abspath(folder)
seen = 0

def hook(event, given):
    global seen
    if event not in EVENTS or not given or isinstance(given[0], int):
        return
    if os.path.abspath(os.fsdecode(given[0])).startswith(here):
        seen += 1
        if seen == at:
            os.kill(os.getpid(), signal.SIGKILL)

sys.addaudithook(hook)
if arguments[0] == "write":
    files.write_all(Path(folder), json.loads(arguments[1]))
else:
    from codegen.app.cli import main
    sys.argv = ["stiction", *arguments]
    try:
        main()
    except SystemExit as end:
        assert not end.code, end.code
print("", seen, sep="\\n")
"""


def child(folder: Path, at: int, *arguments: str) -> tuple[int, int]:
    """(Exit code, events seen) of a run that is killed at an event; at none where ``at`` is 0."""
    command = [sys.executable, "-c", CHILD, str(folder), str(at), *arguments]
    done = subprocess.run(command, cwd=folder.parent, capture_output=True, check=False)
    assert done.returncode in (0, -signal.SIGKILL), done.stderr.decode()
    events = 0 if done.returncode else int(done.stdout.split()[-1])
    return done.returncode, events


def whole(folder: Path) -> dict[str, bytes]:
    """The files of a folder that have a name of their own: not the hidden ones that wait to take their place."""
    return {name: text for name, text in contents(folder).items() if not Path(name).name.startswith(".")}


def test_a_write_that_is_killed_at_any_moment_leaves_old_files_or_new_ones(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    old = {"a.txt": "old a", "b/c.txt": "old c"}
    new = {"a.txt": "new a" * 5000, "b/c.txt": "new c", "d.txt": "new d"}

    def again() -> None:
        for name, text in old.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)
        (folder / "d.txt").unlink(missing_ok=True)

    again()
    code, events = child(folder, 0, "write", json.dumps(new))
    assert code == 0 and events >= 9  # each of three files is opened, given its permissions and renamed
    for at in range(1, events + 1):
        again()
        assert child(folder, at, "write", json.dumps(new))[0] == -signal.SIGKILL, at
        for name, text in whole(folder).items():
            assert text.decode() in (old.get(name), new.get(name)), (at, name)
        assert set(old) <= set(whole(folder))
    assert child(folder, 0, "write", json.dumps(new))[0] == 0
    assert whole(folder) == {name: text.encode() for name, text in new.items()}


VERBS = {
    "generate": ("generate", str(SPECS / "one_mass.yaml"), "-o", "out/one_mass"),
    "certify": ("certify", str(SPECS / "one_mass.yaml"), "-o", "out/certificate.json"),
    "simulate": ("simulate", str(SPECS / "one_mass_domain.yaml"), "-o", "out/log.csv"),
    "gains": ("gains", str(SPECS / "one_mass.yaml"), "-o", "out"),
}


def empty(folder: Path) -> None:
    """Make the folder anew: only from the same start does a run do the same things, a folder it makes being one."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()


def after_a_kill(folder: Path, verb: str, at: int, good: dict[str, bytes]) -> None:
    empty(folder)
    assert child(folder, at, *VERBS[verb])[0] == -signal.SIGKILL
    for name, text in whole(folder).items():
        assert text == good[name], name
    assert child(folder, 0, *VERBS[verb])[0] == 0
    assert whole(folder) == good


def good_run(folder: Path, verb: str) -> tuple[int, dict[str, bytes]]:
    empty(folder)
    code, events = child(folder, 0, *VERBS[verb])
    assert code == 0 and events > 2
    return events, whole(folder)


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["generate"])
def test_a_verb_that_is_killed_amid_its_files_is_run_again(verb: str, tmp_path: Path) -> None:
    events, good = good_run(tmp_path / "out", verb)
    after_a_kill(tmp_path / "out", verb, 2 * events // 3, good)


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_that_is_killed_at_many_moments_is_run_again(verb: str, tmp_path: Path) -> None:
    events, good = good_run(tmp_path / "out", verb)
    for at in sorted({*range(1, events, max(1, events // 8)), events}):
        after_a_kill(tmp_path / "out", verb, at, good)


@pytest.mark.slow
def test_a_replay_that_is_killed_leaves_no_part_of_a_log(tmp_path: Path) -> None:
    """Its output is written in blocks, and takes its name at the end."""
    folder = tmp_path / "out"
    empty(folder)
    rows = "\n".join(f"{k / 1000},{k * k / 1e6},{k % 7}" for k in range(4500))
    (tmp_path / "log.csv").write_text(f"t,x,w\n{rows}\n")
    arguments = ("replay", str(SPECS / "one_mass.yaml"), "log.csv", "-o", "out/estimates.csv")
    code, events = child(folder, 0, *arguments)
    assert code == 0
    good = whole(folder)
    for at in {1, events // 2 or 1, events}:
        empty(folder)
        assert child(folder, at, *arguments)[0] == -signal.SIGKILL
        assert whole(folder) in ({}, good)
    result = process(*arguments, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(SPECS.parent)})
    assert result.code == 0, result.err
    assert whole(folder) == good
