"""The header comment of every generated file; all text of a user that such a file holds is in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from codegen.base.user_text import UserText, file_text
from codegen.base.version import VERSION


@dataclass(frozen=True)
class Header:
    """Where generated files are from; no date, so that the same spec gives the same bytes.

    Attributes:
        spec_file: its name, reduced to letters, digits, ``_``, ``.``, ``-`` and ``+``.
        spec_sha256: of the spec with the robot file that it names.
        robot: that file's name, reduced in the same way, and hash.
        envelope: variable → exact (low, high), the ranges for which the observer is certified or refused.
    """

    spec_file: UserText
    spec_sha256: str
    source: UserText
    version: str
    command: UserText
    robot: tuple[UserText, str] | None = None
    envelope: Mapping[str, tuple[str, str]] = field(default_factory=dict)


def make_header(
    spec_file: str,
    spec_sha256: str,
    source: str,
    robot: tuple[str, str] | None = None,
    options: str = "",
    envelope: Mapping[str, tuple[str, str]] | None = None,
) -> Header:
    """The header of a spec's files.

    Args:
        spec_file: the name of the spec's file, without its folder.
        options: of the command, with a space before each.

    Raises:
        BadInput: for a file whose name generated files cannot print.
    """
    file = file_text(spec_file)
    command = UserText(f"stiction generate {file}{options}")
    named = None if robot is None else (UserText(file_text(robot[0])), robot[1])
    return Header(UserText(file), spec_sha256, UserText(source), VERSION, command, named, envelope or {})
