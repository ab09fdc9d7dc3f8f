"""What a killed run leaves: no half file, and temporaries that the next run in the same folder removes."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import IO

import pytest

from codegen.base import files as files_of
from codegen.base.files import write_all
from codegen.base.temporary import private_folder, sweep, temporary_file
from tests.expected_errors import refused

pytestmark = pytest.mark.skipif(os.name != "posix", reason="no locks that end with their process")

STOPPED = """
import sys, time
from pathlib import Path
from typing import IO
import codegen.base.files as files

def stop(*_):
    print("ready", flush=True)
    time.sleep(600)

files.take_place = stop
files.write_all(Path(sys.argv[1]), {"a.txt": "a", "b.txt": "b", "below/c.txt": "c"})
"""


def run(folder: Path, program: str = STOPPED) -> subprocess.Popen[str]:
    """A run that stands still when its temporaries are there."""
    command = [sys.executable, "-c", program, str(folder)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    return process


def end(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGKILL)
    process.communicate()


def files(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.rglob("*") if p.is_file())


def test_the_next_run_removes_the_files_of_a_killed_one_and_no_others(tmp_path: Path) -> None:
    process = run(tmp_path)
    try:
        assert len(files(tmp_path)) == 3
        write_all(tmp_path, {"other.txt": "o"})
        assert len(files(tmp_path)) == 4, "a run that is alive keeps its own"
    finally:
        end(process)
    write_all(tmp_path, {"a.txt": "a", "below/c.txt": "c"})
    assert files(tmp_path) == ["a.txt", "c.txt", "other.txt"]


def test_a_private_folder_is_removed_and_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o700)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with refused("FILE007 No space left"), private_folder() as folder:
        assert folder.stat().st_mode & 0o777 == 0o700 and folder.parent == tmp_path
        (folder / "x.c").write_text("int x;")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert not list(tmp_path.iterdir())


HELD = """
import sys, tempfile, time
from codegen.base.temporary import private_folder

tempfile.tempdir = sys.argv[1]
with private_folder() as folder:
    (folder / "below").mkdir()
    (folder / "below" / "made.so").write_text("half")
    print("ready", flush=True)
    time.sleep(600)
"""


def test_the_next_run_removes_the_folder_of_a_killed_one_and_none_in_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tmp_path.chmod(0o700)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    process = run(tmp_path, HELD)
    try:
        left = list(tmp_path.iterdir())
        with private_folder() as other:
            assert sorted(tmp_path.iterdir()) == sorted([*left, other]), "a run that is alive keeps its own"
        assert list(tmp_path.iterdir()) == left and files(tmp_path) == [".stiction", "made.so"]
    finally:
        end(process)
    with private_folder() as folder:
        assert list(tmp_path.iterdir()) == [folder]


def test_folders_that_no_run_of_ours_left_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One without a mark, one with another name, a link to a folder, and one of another user."""
    for name in ("stiction-abcdefg1", "stiction-fuzz-abcdefg1", "stiction-libraries-0", "mine"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "kept").write_text("mine")
    for name in ("stiction-fuzz-abcdefg1", "stiction-libraries-0", "mine"):
        (tmp_path / name / ".stiction").touch()
    (tmp_path / "stiction-abcdefg2").symlink_to("mine")
    before = sorted(tmp_path.rglob("*"))
    sweep(tmp_path)
    assert sorted(tmp_path.rglob("*")) == before
    (tmp_path / "stiction-abcdefg1" / ".stiction").touch()
    (tmp_path / "stiction-abcdefg1" / "link").symlink_to(tmp_path / "mine")
    with monkeypatch.context() as other:
        other.setattr(os, "getuid", lambda: 12345)
        sweep(tmp_path)
    assert (tmp_path / "stiction-abcdefg1" / "kept").exists()
    sweep(tmp_path)
    assert not (tmp_path / "stiction-abcdefg1").exists() and (tmp_path / "mine" / "kept").exists()


def test_names_that_a_user_might_give_stay(tmp_path: Path) -> None:
    """Among them our pattern with other letters, our names on a folder or a link, and names of before."""
    path, stream = temporary_file(tmp_path)
    stream.close()
    right = path.name
    path.unlink()
    wrong = right.replace("-", "-A", 1)
    kept = [".a.txt.x8h2k1qz", ".stiction", ".stiction-1-2.tmp", f"{right}.bak", f"x{right}", right[1:], wrong]
    for name in kept:
        (tmp_path / name).write_text("mine")
    (tmp_path / "target").write_text("mine")
    (tmp_path / right).symlink_to("target")
    sweep(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([*kept, "target", right])
    (tmp_path / right).unlink()
    (tmp_path / right).mkdir()
    sweep(tmp_path)
    assert (tmp_path / right).is_dir() and (tmp_path / "target").read_text() == "mine"


def test_marks_take_their_places_first_where_new_and_last_where_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    taken = files_of.take_place

    def noted(temporary: Path, stream: IO[bytes], target: Path) -> None:
        order.append(target.name)
        taken(temporary, stream, target)

    monkeypatch.setattr(files_of, "take_place", noted)
    for expected in (["mark", "a", "b"], ["a", "b", "mark"]):
        order.clear()
        write_all(tmp_path, {"a": "", "mark": "", "b": ""}, ("mark",))
        assert order == expected
