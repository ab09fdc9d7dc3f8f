"""Writing of several files: their order, and private folders on a full disk."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from codegen.base.files import Waiting, write_all
from codegen.base.temporary import private_folder
from tests.expected_errors import refused


def test_a_private_folder_is_removed_and_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o700)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with refused("FILE007 No space left"), private_folder() as folder:
        assert folder.stat().st_mode & 0o777 == 0o700 and folder.parent == tmp_path
        (folder / "x.c").write_text("int x;")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert not list(tmp_path.iterdir())


def test_marks_take_their_places_first_where_new_and_last_where_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    taken = Waiting.take_place

    def noted(file: Waiting) -> None:
        order.append(file.path.name)
        taken(file)

    monkeypatch.setattr(Waiting, "take_place", noted)
    for expected in (["mark", "a", "b"], ["a", "b", "mark"]):
        order.clear()
        write_all(tmp_path, {"a": "", "mark": "", "b": ""}, ("mark",))
        assert order == expected
