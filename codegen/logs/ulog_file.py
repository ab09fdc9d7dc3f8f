"""ULog, the log of PX4: the fields of topics, ``TOPIC.field`` or ``TOPIC[instance].field``; read whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from codegen.base.input_files import opened
from codegen.logs.description import LogDescription
from codegen.logs.library import library, reading
from codegen.logs.signal_source import Signal, SignalSource
from codegen.logs.source import LARGEST, Allowance

EXPECTED = "a ULog file of PX4 (.ulg)"
COPIES = 3
"""Times its bytes that a file takes while it is read."""


def open_ulog(path: Path, allowance: Allowance, description: LogDescription) -> SignalSource:
    """Open a .ulg file; the time of a topic is its ``timestamp``, when it was published.

    Raises:
        BadInput: where its library is not installed, or for a file that is none or damaged.
    """
    pyulog = library("pyulog", "ulog", path)
    with opened(path, EXPECTED, LARGEST) as stream, reading(path, EXPECTED):
        allowance.take(path, COPIES * stream.seek(0, 2), EXPECTED)
        stream.seek(0)
        log = pyulog.ULog(stream)
        if log.file_corruption:
            raise ValueError("parts that are no messages")
        topics = {d.name if not d.multi_id else f"{d.name}[{d.multi_id}]": d.data for d in log.data_list}
    columns = {f"{t}.{name}": len(values) for t, data in topics.items() for name, values in data.items()}
    unread = {topic: "it has no timestamp" for topic, data in topics.items() if "timestamp" not in data}
    columns = {name: n for name, n in columns.items() if name.partition(".")[0] not in unread and n}

    def signal(name: str) -> Signal:
        topic, _, field = name.partition(".")
        data = topics[topic]
        return topic, data["timestamp"].astype(np.int64) / 1e6, np.asarray(data[field], dtype=np.float64)

    return SignalSource(path, EXPECTED, columns, {}, unread, signal, description, allowance)
