"""Provenance of generated files: the header comment of each, and the manifest with their hashes."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from codegen.base.files import sha256
from codegen.base.user_text import UserText, file_text
from codegen.base.version import VERSION

OWN = "sha256"
"""Manifest field with the hash of all other fields as JSON without blanks, so that line ends and layout may change."""


def manifest_text(content: Mapping[str, Any]) -> str:
    """The manifest with these fields and its own hash; one among the fields is replaced."""
    fields = {name: value for name, value in content.items() if name != OWN}
    return json.dumps({**fields, OWN: _hash(fields)}, indent=2) + "\n"


def is_edited(text: str) -> bool:
    """Whether a manifest's own hash differs from that of its content; a manifest of an older version has none."""
    try:
        content = json.loads(text)
        stated = content.pop(OWN, None)
    except (ValueError, AttributeError, TypeError, RecursionError):
        return False
    return stated is not None and stated != _hash(content)


def _hash(fields: Mapping[str, Any]) -> str:
    return sha256(json.dumps(fields, separators=(",", ":")))


@dataclass(frozen=True)
class Header:
    """Provenance that generated files print; no date, so that the same spec gives the same bytes.

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
    """The header of a spec's files; BadInput for a file whose name generated files cannot print.

    Args:
        spec_file: the name of the spec's file, without its folder.
        options: of the command, with a space before each.
    """
    file = file_text(spec_file)
    command = UserText(f"stiction generate {file}{options}")
    named = None if robot is None else (UserText(file_text(robot[0])), robot[1])
    return Header(UserText(file), spec_sha256, UserText(source), VERSION, command, named, envelope or {})
