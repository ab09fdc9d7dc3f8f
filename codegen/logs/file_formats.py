"""Formats of log files: the registry, and the format of a file by its extension or its first bytes."""

import codecs
import re
from collections.abc import Callable, Mapping
from pathlib import Path

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.input_files import alike, is_there, opened
from codegen.base.user_text import brief
from codegen.logs.description import EMPTY_DESCRIPTION, LogDescription
from codegen.logs.formats.bag_file import BagFolder, Db3Storage, is_bag
from codegen.logs.formats.csv_file import CsvStream, open_csv
from codegen.logs.formats.diadem_file import BEGINS, DiademFile
from codegen.logs.formats.hdf5_file import Hdf5File
from codegen.logs.formats.json_file import JsonFile
from codegen.logs.formats.mat_file import open_mat
from codegen.logs.formats.mcap_file import McapStorage
from codegen.logs.formats.mdf_file import MdfFile
from codegen.logs.formats.numpy_file import NpyFile, NpzFile
from codegen.logs.formats.parquet_file import ParquetFile
from codegen.logs.formats.ros_log import RosFile, Storage
from codegen.logs.formats.source import LARGEST_STREAM, Allowance, BlockFile, LogFile, NotStreamed
from codegen.logs.formats.tdms_file import TdmsFile
from codegen.logs.formats.ulog_file import UlogFile
from codegen.logs.formats.xlsx_file import open_xlsx

Opener = Callable[[Path, Allowance, LogDescription], LogFile]


def _of_messages(storage: Callable[[Path], Storage]) -> Opener:
    """The opener of a format that stores ROS messages."""
    return lambda path, allowance, description: RosFile(storage(path), allowance, description)


FORMATS: Mapping[str, Opener] = {
    ".csv": open_csv,
    ".tsv": open_csv,
    ".txt": open_csv,
    ".mat": open_mat,
    ".npy": NpyFile,
    ".npz": NpzFile,
    ".xlsx": open_xlsx,
    ".xlsm": open_xlsx,
    ".json": JsonFile,
    ".jsonl": JsonFile,
    ".ndjson": JsonFile,
    ".mcap": _of_messages(McapStorage),
    ".db3": _of_messages(Db3Storage),
    ".parquet": ParquetFile,
    ".h5": Hdf5File,
    ".hdf5": Hdf5File,
    ".mf4": MdfFile,
    ".ulg": UlogFile,
    ".tdms": TdmsFile,
}
"""File name extension → its opener. A text file with another extension is read as a table."""
TEXTS: Mapping[bytes, Opener] = {
    BEGINS: DiademFile,
    rb'(\xef\xbb\xbf)?\s*\{\s*"[^\n{]*[\[{]': JsonFile,  # records with lists or objects; plain rows lose their names
}
"""Beginning of a text file, whatever its extension → its opener; any other text is read as a table."""
HEAD = 4096
"""Bytes at the beginning of a file by which its format is recognised."""
OTHERS = (
    (rb"PK\x03\x04", "an Excel workbook or another archive", "the ending .xlsx of a workbook; else the file in it"),
    (rb"\xd0\xcf\x11\xe0", "an old or encrypted Excel workbook", "its sheet saved as .xlsx or CSV"),
    (rb"\x1f\x8b|\x28\xb5\x2f\xfd|BZh\d|\xfd7zXZ", "a compressed file", "the file unpacked"),
    (rb"\x80[\x02-\x05]", "a Python pickle, which could run any code", "its arrays saved by `numpy.savez`, or as CSV"),
    (rb"#ROSBAG", "a bag of ROS 1", "a bag of ROS 2, made of it by `rosbags-convert`"),
    (
        rb"\s*(\(\d+\.\d+\)|[a-z]*can\d) +(\S+ +)?[0-9A-F]{3,8}(#| +\[\d+\](?![^\n]*::))|date [^\n]*\nbase (hex|dec)",
        "CAN frames of candump or in Vector's ASC",
        "a column for each signal, decoded by its DBC, as `cantools decode` prints it behind each frame",
    ),
    (
        rb"header: *\r?\n +(stamp|seq):",
        "messages over several lines, as `ros2 topic echo` or `rostopic echo` prints them",
        "a bag; or `ros2 topic echo --csv`, `rostopic echo -p`",
    ),
    (
        rb"header \{ *\r?\n +stamp \{",
        "messages over several lines, as `gz topic -e` prints them",
        "a row for each message, as CSV",
    ),
    (rb"FMT, ?\d+, ?\d+, ?FMT", "an ArduPilot log of several kinds of rows", "one kind as CSV, by `mavlogdump.py`"),
    (rb"MDF +\d", "an MDF file", "an MDF 4 file ending in .mf4"),
    (rb"\x89HDF", "an HDF5 file", "the ending .h5"),
    (rb"SQLite format 3", "an SQLite database", "its table as CSV; a bag of ROS 2 ends in .db3"),
    (rb"ARROW1", "an Arrow or Feather file", "the table as Parquet or CSV"),
    (rb"# Created by Octave", "Octave's text format", "the same saved by `save -v7 NAME.mat`"),
    (rb"(\xef\xbb\xbf)?<(\?xml|!DOCTYPE|html)", "an XML or HTML file", "its samples as CSV"),
    (rb"WPILOG|\xa3\x95|ULog\x01", "a log of a robot or vehicle", "its export as CSV; ULog ends in .ulg"),
)
"""First bytes, what they begin, and what to give instead."""


def format_of(path: Path) -> Opener:
    """The opener of a file, by its extension, or else by its first bytes; those of a table must not be binary."""
    reader = FORMATS.get(path.suffix.lower())
    if reader is not None and not (reader is open_csv and is_there(path) and path.is_file()):
        return reader
    place = Place(brief(str(path), 200))
    expected = f"text, a log file ending in {', '.join(FORMATS)}, or a ROS 2 bag folder"
    if "\0" not in str(path):
        if is_there(path) and path.is_dir():
            if is_bag(path):
                return _of_messages(BagFolder)
            raise BadInput(place, "a folder", expected, code="FILE001")
        if not is_there(path):
            raise BadInput(place, "no such file", expected, alike(path), code="FILE001")
        with opened(path, expected, LARGEST_STREAM) as stream:
            try:
                head = stream.read(HEAD)
            except OSError as error:
                raise BadInput(place, f"unreadable ({error.strerror})", expected, code="FILE001") from None
        utf_16 = head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        is_text = utf_16 or not re.search(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f]", head)
        others = ((what, instead) for begin, what, instead in OTHERS if re.match(begin, head))
        if other := next(others, None):
            raise BadInput(place, *other, code="LOG002")
        if is_text and (known := next((TEXTS[begin] for begin in TEXTS if re.match(begin, head)), None)):
            return known
        if reader is not None or is_text:
            return open_csv
    found = f"the ending `{brief(path.suffix)}`" if path.suffix else "a name without an ending"
    raise BadInput(place, found, expected, nearest_name(path.suffix.lower(), FORMATS), code="LOG002")


def open_stream(path: Path, description: LogDescription | None = None) -> BlockFile:
    """Open a log to be read in blocks.

    Raises:
        BadInput: for a file that cannot be used.
        NotStreamed: for a format that is read whole, or a file that is no text.
    """
    opener, described = format_of(path), description or EMPTY_DESCRIPTION
    if opener is open_csv:
        return CsvStream(path, Allowance(), described)
    if isinstance(opener, type) and issubclass(opener, BlockFile):
        return opener(path, Allowance(), described)
    raise NotStreamed
