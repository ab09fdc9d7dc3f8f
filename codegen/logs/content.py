"""What a file with an unknown ending is, by its first bytes: text, or a format that is not read."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from codegen.base.input_files import opened
from codegen.logs.source import LARGEST_STREAM

HEAD = 4096
OTHERS = (
    (rb"PK\x03\x04|\xd0\xcf\x11\xe0", "an Excel workbook or another archive", "its sheet saved as CSV"),
    (rb"\x1f\x8b|\x28\xb5\x2f\xfd|BZh|\xfd7zXZ", "a compressed file", "the file unpacked"),
    (rb"\x80[\x02-\x05]", "a Python pickle, which could run any code", "its arrays saved by `numpy.savez`, or as CSV"),
    (rb"#ROSBAG", "a bag of ROS 1", "a bag of ROS 2, made of it by `rosbags-convert`"),
    (rb"\(\d+\.\d+\) +\S+ +[0-9A-F]+#", "CAN frames of candump", "a column for each signal, decoded by its DBC"),
    (rb"header: *\r?\n", "messages over several lines, as `ros2 topic echo` prints them", "a bag, or `--csv` with it"),
    (rb"FMT, ?\d+, ?\d+, ?FMT", "an ArduPilot log of several kinds of rows", "one kind as CSV, by `mavlogdump.py`"),
    (rb"MDF ", "an MDF file", "an MDF 4 file ending in .mf4"),
    (rb"\x89HDF", "an HDF5 file", "the ending .h5"),
    (rb"WPILOG|\xa3\x95|ULog", "a log of a robot or vehicle", "its export as CSV; ULog ends in .ulg"),
)
"""First bytes, what they begin, and what to give instead."""


def is_text(path: Path, expected: str) -> bool:
    """Whether a file's first bytes are letters, in UTF-8, UTF-16 with its mark or Windows-1252.

    Raises:
        BadInput: as ``input_files.opened``.
    """
    head = _head(path, expected)
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return True
    return bool(head) and not re.search(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f]", head) and _other(head) is None


def other_format(path: Path, expected: str) -> tuple[str, str] | None:
    """What a file is that is not read, and what to give instead; None for bytes that say nothing.

    Raises:
        BadInput: as ``input_files.opened``.
    """
    return _other(_head(path, expected))


def _other(head: bytes) -> tuple[str, str] | None:
    return next(((what, instead) for begin, what, instead in OTHERS if re.match(begin, head)), None)


def _head(path: Path, expected: str) -> bytes:
    with opened(path, expected, LARGEST_STREAM) as stream:
        return stream.read(HEAD)
