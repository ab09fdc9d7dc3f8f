"""What the head of every generated file says."""

from __future__ import annotations

from dataclasses import dataclass

from codegen.version import VERSION


@dataclass(frozen=True)
class Header:
    """Where generated files are from; no date, so that the same spec gives the same bytes.

    Attributes:
        spec_sha256: of the spec with the robot file that it names.
        robot: that file's name and hash.
    """

    spec_file: str
    spec_sha256: str
    source: str
    version: str
    command: str
    robot: tuple[str, str] | None = None


def make_header(
    spec_file: str, spec_sha256: str, source: str, robot: tuple[str, str] | None = None, options: str = ""
) -> Header:
    """Args:
    options: of the command, with a space before each.
    """
    return Header(spec_file, spec_sha256, source, VERSION, f"stiction generate {spec_file}{options}", robot)
