"""Measured logs: readers, which give SI values on a uniform time grid, and the preflight checks.

What cannot be used, or cannot be decided, is a BadInput with file and line, or the column.
"""

from codegen.logs.audit.preflight import preflight
from codegen.logs.description import LogDescription, read_description
from codegen.logs.excerpt import excerpt
from codegen.logs.file_formats import FORMATS
from codegen.logs.formats.source import Allowance
from codegen.logs.log import Finding, Log, RawData
from codegen.logs.readers import read_log, read_logs

__all__ = [
    "FORMATS",
    "Allowance",
    "Finding",
    "Log",
    "LogDescription",
    "RawData",
    "excerpt",
    "preflight",
    "read_description",
    "read_log",
    "read_logs",
]
