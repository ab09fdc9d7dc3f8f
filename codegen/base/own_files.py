"""Which files of a folder stiction wrote, by its list there, and the refusal to replace other or edited ones."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from codegen.base.errors import BadInput
from codegen.base.files import json_of, sha256, write_all
from codegen.base.input_files import is_there, read_or_none

Texts = Mapping[str, str | None] | Mapping[str, str]
"""Name of a file → its new text; None if that is not known yet."""
FILES_SHA256 = "files_sha256"
"""Field of a JSON result: file beside it → SHA-256 of its text as written, or null; other files are the user's."""
PAGE_MARK = "Written by `stiction "
"""Words at the beginning of a page that a command writes."""
HEAD = 1000
"""Characters at the beginning of a page in which they stand."""


def listed_in(result: Path, form: str) -> Mapping[str, object]:
    """The files beside a JSON result → their hashes, by its field ``FILES_SHA256``; {} if it is not stiction's.

    ``form``: beginning of its field ``format``.
    """
    listed = (json_of(result, form) or {}).get(FILES_SHA256)
    return listed if isinstance(listed, dict) else {}


def text_sha256(text: str) -> str:
    """The SHA-256 of a text with line ends \\n."""
    return sha256(text.replace("\r\n", "\n"))


def text_of(path: Path) -> str | None:
    """A file's text with line ends \\n, which a version control system may have replaced by \\r\\n."""
    text = read_or_none(path)
    return None if text is None else text.replace("\r\n", "\n")


def differs(path: Path, text: str | None) -> bool:
    """Whether a file exists with another text."""
    return is_there(path) and text_of(path) != text


def refuse_unlisted(
    folder: Path,
    files: Texts,
    listed: Mapping[str, object],
    by: str,
    says_ours: Callable[[Path], bool] = lambda path: False,
    force: bool = False,
) -> None:
    """Raise BadInput for files of these names with another text that stiction's list does not name.

    Args:
        files: name → its new text, with which a file is not refused; None if the text is not known yet.
        listed: the files that the list names.
        by: name of the list in the folder.
        says_ours: whether a file says that stiction made it; the user may replace those by ``force``.
        force: whether he does.
    """
    unlisted = [file for file, text in files.items() if file not in listed and differs(folder / file, text)]
    ours = [file for file in unlisted if says_ours(folder / file)]
    refused = [file for file in unlisted if not (force and file in ours)]
    if refused:
        found = f"{', '.join(refused)}, which no {by} lists"
        by_force = ", or --force, which replaces them" if refused == ours else ""
        ways = f"move others away, or choose another -o{by_force}"
        expected = f"only files of these names that stiction wrote: {ways} (nothing was replaced)"
        raise BadInput(str(folder), found, expected, code="FILE004")


def refuse_edited_files(
    folder: Path, files: Texts, listed: Mapping[str, object], by: str, ways: str, others: Sequence[str] = ()
) -> None:
    """Raise BadInput for files that have neither their new text nor the one as stiction wrote it.

    Args:
        listed: file → SHA-256 of its text as written; without one, a file does not count as edited.
        ways: what the user can do.
        others: further files that were edited.
    """
    differing = [file for file, text in files.items() if listed.get(file) and differs(folder / file, text)]
    edited = [file for file in differing if sha256(text_of(folder / file) or "") != listed[file]]
    if edited := [*edited, *others]:
        found = f"{', '.join(edited)}, edited after stiction wrote it ({by} has another SHA-256)"
        raise BadInput(str(folder), found, f"{ways} (nothing was replaced)", code="FILE008")


def page_says_ours(path: Path) -> bool:
    """Whether a page says at its beginning that stiction wrote it."""
    return PAGE_MARK in (text_of(path) or "")[:HEAD]


def write_page(page: Path, text: str) -> None:
    """Write a page; BadInput if a file there does not say at its beginning that stiction wrote it."""
    listed = {page.name: None} if page_says_ours(page) else {}
    refuse_unlisted(page.parent, {page.name: text}, listed, page.name)
    write_all(page.parent, {page.name: text})
