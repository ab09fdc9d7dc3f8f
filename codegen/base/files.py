"""Atomic writing of files (complete or not at all), and refusal of targets that must not be overwritten."""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import mkstemp
from typing import Any, Self

from codegen.base.errors import BadInput
from codegen.base.input_files import identity, is_there, read_or_none, unusable_name


def sha256(text: str) -> str:
    """The SHA-256 of a text in UTF-8, in hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()


def named_path(text: str) -> Path:
    """The path given as an option's value. Raises BadInput for "", which Path would read as the current folder."""
    if not text:
        raise BadInput("-o", "an empty name", "a file or folder; `.` for this folder", code="FILE005")
    return Path(text)


def refuse_target(path: Path, sources: Mapping[str, Path] | None = None, endings: Sequence[str] = ()) -> None:
    """Raise BadInput where a target file must not or cannot be written; called before any work is done.

    Args:
        sources: description → file that the command reads; the target must be none of these files.
        endings: those that the target may have; () allows any.
    """
    fault = unusable_name(path)
    if fault is not None:
        raise BadInput(str(path), fault, "a name in UTF-8 for what is written", code="FILE005")
    with writing(path):  # a name that is too long, or a folder that must not be searched
        _refuse_special(path)
        for what, source in (sources or {}).items():
            same = is_there(path) and is_there(source) and path.samefile(source)
            if same or identity(path) == identity(source):
                raise BadInput(str(path), what, "another file to write", code="FILE004")
        if endings:
            refuse_ending(path, endings)
        existing = next(folder for folder in path.absolute().parents if folder.exists())
        if not existing.is_dir():
            named = path.parents[path.absolute().parents.index(existing)]
            found, expected = "cannot be written (a file of that name exists)", "a folder, or a name that is free"
            raise BadInput(str(named), found, expected, code="FILE003")
        handle, probe = mkstemp(".tmp", ".stiction-", existing)  # permissions do not show it of /proc or a full disk
        os.close(handle)
        Path(probe).unlink()


def refuse_ending(path: Path, endings: Iterable[str]) -> None:
    """Raise BadInput where the ending of a file's name is none of these."""
    if path.suffix.lower() not in endings:
        expected = f"a file ending in {' or '.join(endings)}"
        found = f"the ending `{path.suffix}`" if path.suffix else "a name without an ending"
        raise BadInput(str(path), found, expected, code="FILE005")


@contextmanager
def writing(path: Path, what: str = "written", expected: str = "a folder that can be written") -> Iterator[None]:
    """A context within which an OSError becomes BadInput: the file "cannot be ``what``", ``expected`` was expected."""
    try:
        yield
    except OSError as error:
        raise BadInput(str(path), f"cannot be {what} ({error.strerror})", expected, code="FILE003") from None


def refuse_foreign_json(path: Path, form: str) -> None:
    """Raise BadInput where the file exists, but is no JSON object with a field ``format`` that begins with ``form``."""
    if is_there(path) and json_of(path, form) is None:
        found = "a file that stiction did not write"
        raise BadInput(str(path), found, "another folder for the results", code="FILE004")


def json_object(path: Path) -> dict[str, Any]:
    """The JSON object in a file; {} for other content, and for a file that cannot be read."""
    try:
        content = json.loads(read_or_none(path) or "null")
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def json_of(path: Path, form: str) -> dict[str, Any] | None:
    """The JSON object in a file, if its field ``format`` begins with ``form``; else None."""
    content = json_object(path)
    return content if str(content.get("format", "")).startswith(form) else None


def remove(path: Path) -> None:
    """Remove a file that stiction wrote, if it exists. Raises BadInput if it cannot be removed."""
    with writing(path, "removed"):
        path.unlink(missing_ok=True)


def write_atomically(path: Path, text: str) -> None:
    """Write through a temporary file in the target's folder, so that no reader sees an incomplete file.

    Raises BadInput if the folder cannot be made or written.
    """
    write_all(path.parent, {path.name: text})


class Waiting:
    """A file that is being written: a temporary one beside the target, which ``take_place`` renames to the target.

    Without a call of ``take_place`` it is removed at the end of the context, and so are folders made for it.

    Raises BadInput if the folder cannot be made or written, or the target is a folder or a device.
    """

    def __init__(self, path: Path, expected: str = "a folder that can be written") -> None:
        self.path, self._expected = path, expected
        self._made: list[Path] = []
        try:
            with self._writing():
                _refuse_special(path)
                self._made = [folder for folder in path.parents if not folder.exists()]
                path.parent.mkdir(parents=True, exist_ok=True)
                handle, name = mkstemp(".tmp", ".stiction-", path.parent)
                self._temporary, self.stream = Path(name), os.fdopen(handle, "w+b")
        except BadInput:
            self._remove_empty()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._temporary.unlink(missing_ok=True)
        with suppress(OSError):
            self.stream.close()
        self._remove_empty()

    def _remove_empty(self) -> None:
        """Remove the folders that were made for the file, from the innermost to the first that is not empty."""
        with suppress(OSError):
            for folder in self._made:
                folder.rmdir()

    def write(self, data: bytes) -> None:
        """Write further bytes."""
        with self._writing():
            self.stream.write(data)
            self.stream.flush()

    def take_place(self) -> None:
        """Replace the target by the complete file, whose permissions become those of a new file."""
        with self._writing():
            self.stream.close()
            umask = os.umask(0)
            os.umask(umask)
            self._temporary.chmod(0o666 & ~umask)
            self._temporary.replace(self.path)

    def _writing(self) -> AbstractContextManager[None]:
        return writing(self.path, expected=self._expected)


def write_all(folder: Path, files: Mapping[str, str | bytes] | Mapping[str, str], marks: Sequence[str] = ()) -> None:
    """Write several files: all are written as temporaries before the first replaces its target.

    Nothing else in the folder is changed.

    Args:
        files: name, or path below the folder → text, or the bytes of a picture.
        marks: names of those files by which a later run recognises the folder as stiction's (a manifest). A mark that
            is new is renamed first, and one that replaces an old mark last. So after a killed run the folder is
            still recognised, and its files are not taken for edited ones.

    Raises:
        BadInput: if a target is a folder or a device, or a folder cannot be made or written.
    """
    with ExitStack() as stack:
        waiting = []
        for name, text in files.items():
            waiting.append(stack.enter_context(Waiting(folder / name)))
            waiting[-1].write(text.encode() if isinstance(text, str) else text)
        early = [file for file in waiting if file.path.name in marks and not is_there(file.path)]
        late = [file for file in waiting if file.path.name in marks and is_there(file.path)]
        for file in (*early, *(file for file in waiting if file not in early + late), *late):
            file.take_place()


def _refuse_special(path: Path) -> None:
    """Raise BadInput if the path is a folder, a device, a pipe, or a link to nothing, which would be lost."""
    if path.is_symlink() and not path.exists():  # as to a disk that is not mounted
        found = "cannot be written (a link of that name exists, to a file that does not)"
        raise BadInput(str(path), found, "a file, or a free name", code="FILE003")
    if path.is_dir() or (path.exists() and not path.is_file()):
        found = f"cannot be written ({'a folder' if path.is_dir() else 'a device or a pipe'} of that name exists)"
        raise BadInput(str(path), found, "a file, or a free name", code="FILE003")
