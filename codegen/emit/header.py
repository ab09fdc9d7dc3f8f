"""What the head of every generated file says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from codegen.version import VERSION


@dataclass(frozen=True)
class Header:
    """Where generated files are from; no date, so that the same spec gives the same bytes.

    Attributes:
        spec_sha256: of the spec with the robot file that it names.
        robot: that file's name and hash.
        envelope: variable → exact (low, high), the ranges for which the observer is certified or refused.
    """

    spec_file: str
    spec_sha256: str
    source: str
    version: str
    command: str
    robot: tuple[str, str] | None = None
    envelope: Mapping[str, tuple[str, str]] = field(default_factory=dict)


def make_header(
    spec_file: str,
    spec_sha256: str,
    source: str,
    robot: tuple[str, str] | None = None,
    options: str = "",
    envelope: Mapping[str, tuple[str, str]] | None = None,
) -> Header:
    """Args:
    options: of the command, with a space before each.
    """
    command = f"stiction generate {spec_file}{options}"
    return Header(spec_file, spec_sha256, source, VERSION, command, robot, envelope or {})
