"""The folder of a diagnosis: the hashes of its log, and checks that other files are not replaced."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from codegen.base.errors import BadInput
from codegen.base.files import json_of, refuse_foreign, refuse_foreign_json, sha256
from codegen.base.input_files import read_or_none

RESULT = "diagnosis.json"
DIAGNOSIS_FILES = (RESULT, "spec.yaml", "report.html", "excitation.csv")
FORMAT = "stiction-diagnosis/"
FILES_SHA256 = "files_sha256"
"""Field of RESULT: file → SHA-256 of its text as written, of the files that a user may go on to edit."""


def log_sha256(logs: Sequence[str | Path]) -> list[str]:
    """SHA-256 of each log; of a folder, that of the names and bytes of its files.

    Raises:
        BadInput: for a file that can no longer be read.
    """
    return [_sha256(Path(log)) for log in logs]


def _sha256(log: Path) -> str:
    try:
        if not log.is_dir():
            with log.open("rb") as stream:
                return hashlib.file_digest(stream, "sha256").hexdigest()
        files = sorted(file for file in log.rglob("*") if file.is_file())
        listed = (f"{file.relative_to(log).as_posix()} {_sha256(file)}\n" for file in files)
        return hashlib.sha256("".join(listed).encode()).hexdigest()
    except OSError as error:
        raise BadInput(str(log), f"unreadable ({error.strerror})", "the log that was read", code="FILE001") from None


def refuse_not_ours(folder: Path) -> None:
    """Raise BadInput if the folder has a file with a name of ``DIAGNOSIS_FILES`` that stiction did not write."""
    for name in DIAGNOSIS_FILES:
        refuse_foreign(folder, name, (RESULT,))
    refuse_foreign_json(folder / RESULT, FORMAT)


def refuse_other_robot(folder: Path, name: str, text: str) -> None:
    """Raise BadInput if the folder has another file with the name of the robot file."""
    if read_or_none(folder / name) != text:
        refuse_foreign(folder, name, (RESULT,))


def hashes_of(files: Mapping[str, str]) -> dict[str, str]:
    """File → SHA-256 of its text, of those that hold inputs of further work; generated code has its own manifest."""
    apart = "report.html", "generated/"  # the pictures of the report differ between versions of the library for plots
    return {name: _text_sha256(text) for name, text in files.items() if not name.startswith(apart)}


def _text_sha256(text: str) -> str:
    """With line ends \\n, which a version control system may replace by \\r\\n."""
    return sha256(text.replace("\r\n", "\n"))


def refuse_edited_file(folder: Path, names: Iterable[str]) -> None:
    """Raise BadInput if the folder has a file of these names that was edited after the diagnosis wrote it."""
    listed = (json_of(folder / RESULT, FORMAT) or {}).get(FILES_SHA256)
    kept = listed if isinstance(listed, dict) else {}
    texts = {name: read_or_none(folder / name) for name in names if name in kept}
    edited = [name for name, text in texts.items() if text is not None and _text_sha256(text) != kept[name]]
    if edited:
        found = f"{', '.join(edited)}, edited after stiction wrote it ({RESULT} has another SHA-256)"
        expected = "another folder by -o DIR, or --force to discard the edits (nothing was replaced)"
        raise BadInput(str(folder), found, expected, code="FILE008")


def refuse_another_log(folder: Path, hashes: Sequence[str]) -> None:
    """Raise BadInput if the folder has the diagnosis of logs with other hashes."""
    content = json_of(folder / RESULT, FORMAT)
    if content is None or content.get("log_sha256") == list(hashes):
        return
    data = content.get("data")
    named = data.get("train") if isinstance(data, dict) else None
    found = f"the diagnosis of another log{f', {named}' if isinstance(named, str) else ''}"
    if "log_sha256" not in content:
        found = "a diagnosis that does not say of which log it is"
    expected = "another folder by -o DIR, or --force to replace it (nothing was replaced)"
    raise BadInput(str(folder), found, expected, code="FILE004")
