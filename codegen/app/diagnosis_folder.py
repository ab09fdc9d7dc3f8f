"""The folder of a diagnosis: the hashes of its log, and checks that other files are not replaced."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from codegen.base.errors import BadInput
from codegen.base.files import json_of, refuse_foreign_json
from codegen.base.own_files import listed_in, refuse_edited_files, refuse_unlisted, text_sha256

RESULT = "diagnosis.json"
EXCITATION = "excitation.csv"
DIAGNOSIS_FILES = (RESULT, "spec.yaml", "report.html", EXCITATION)
FORMAT = "stiction-diagnosis/"


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


def refuse_not_ours(folder: Path, robot: Mapping[str, str]) -> None:
    """Raise BadInput if the folder has a file that a diagnosis would replace, but stiction did not write.

    Args:
        robot: name of the robot file → its text, with which it is not refused.
    """
    refuse_foreign_json(folder / RESULT, FORMAT)
    written = dict.fromkeys(name for name in DIAGNOSIS_FILES if name != RESULT)
    refuse_unlisted(folder, {**written, **robot}, listed_in(folder / RESULT, FORMAT), RESULT)


def hashes_of(files: Mapping[str, str]) -> dict[str, str]:
    """File → SHA-256 of its text; generated code has its own manifest."""
    return {name: text_sha256(text) for name, text in files.items() if not name.startswith("generated/")}


def refuse_edited_file(folder: Path) -> None:
    """Raise BadInput if the folder has a file that was edited after the diagnosis wrote it."""
    listed = listed_in(folder / RESULT, FORMAT)
    ways = "another folder by -o DIR, or --force to discard the edits"
    refuse_edited_files(folder, dict.fromkeys(listed), listed, RESULT, ways)


def stale_excitation(folder: Path, files: Iterable[str]) -> list[Path]:
    """The excitation of an earlier diagnosis in the folder, where these files do not replace it."""
    written = EXCITATION in listed_in(folder / RESULT, FORMAT)
    return [folder / EXCITATION] if written and EXCITATION not in files else []


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
