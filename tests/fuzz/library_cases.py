"""Logs of the formats that libraries read, damaged byte by byte; those of absent libraries are left out."""

from __future__ import annotations

import importlib.util
import io
import random
import sqlite3
import struct
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from codegen.logs import preflight, read_log
from codegen.logs.formats.bag_file import DEFINITIONS

from .case import Case, Stage
from .log_cases import damaged_bytes, good, observed

JOINTS = "sensor_msgs/msg/JointState"
ROS = {"x": "/j.position[a]", "v": "/j.velocity[a]", "w": "/j.effort[a]"}


def library_log(seed: int) -> Case:
    """The damaged log of that number, read and audited."""
    dice = random.Random(f"library {seed}")
    ending = dice.choice([e for e, (module, _, _) in FORMATS.items() if importlib.util.find_spec(module)])
    _, make, columns = FORMATS[ending]
    content = _made(make, dice.randrange(4))
    for _ in range(dice.choice([0, 1, 1, 1, 3])):
        content = _damaged(content, dice)
    if dice.random() < 0.03:
        ending = dice.choice(list(FORMATS))
    names = dict(columns) if dice.random() < 0.9 else {**columns, "x": dice.choice(["t", "x", "/j", "/j.position[0]"])}

    def read() -> None:
        spec = observed()[0]
        preflight(read_log(f"a{ending}", spec, columns=names), spec)

    return Case({f"a{ending}": content}, (Stage("read", read),))


def _damaged(data: bytes, dice: random.Random) -> bytes:
    """Bytes anew, most of them near one of the ends, where formats keep their tables; or a length that lies."""
    if dice.random() < 0.5:
        return damaged_bytes(data, dice) if dice.random() < 0.5 else damaged_bytes(data[::-1], dice)[::-1]
    at = dice.randrange(max(1, len(data) - 8))
    number = struct.pack("<q", dice.choice([-1, 0, 1, 255, 1 << 16, 1 << 31, (1 << 32) - 1, 1 << 40, (1 << 62) + 1]))
    size = dice.choice([1, 2, 4, 8])
    return data[:at] + number[:size] + data[at + size :]


@cache
def _made(make: Callable[[dict[str, Any], int], bytes], variant: int) -> bytes:
    return make(good(random.Random(variant), 4500 if variant == 3 else 400), variant)


def mcap(columns: dict[str, Any], variant: int) -> bytes:
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    stream = io.BytesIO()
    packing = [CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE][variant]
    writer = Writer(stream, chunk_size=9000, compression=packing, enable_crcs=variant == 1)
    schema = writer.register_msgdef(JOINTS, DEFINITIONS[JOINTS])
    for k, ns in enumerate(np.round(columns["t"] * 1e9).astype(int)):
        writer.write_message("/j", schema, _message(columns, k, int(ns)), int(ns))
    writer.finish()
    return stream.getvalue()


def _message(columns: dict[str, Any], k: int, ns: int) -> dict[str, Any]:
    x, v, w = (float(columns[name][k]) for name in "xvw")
    stamp = {"sec": ns // 10**9, "nanosec": ns % 10**9}
    return {
        "header": {"stamp": stamp, "frame_id": ""},
        "name": ["a"],
        "position": [x],
        "velocity": [v],
        "effort": [w],
    }


def db3(columns: dict[str, Any], variant: int) -> bytes:
    from mcap_ros2._dynamic import serialize_dynamic

    encode = serialize_dynamic(JOINTS, DEFINITIONS[JOINTS])[JOINTS]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.db3"
        bag = sqlite3.connect(path)
        bag.execute("CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        bag.execute("CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        bag.execute("INSERT INTO topics VALUES (1, '/j', ?, 'cdr')", [JOINTS])
        stamps = np.round(columns["t"] * 1e9).astype(int)
        rows = [(1, int(ns), encode(_message(columns, k, int(ns)))) for k, ns in enumerate(stamps)]
        bag.executemany("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", rows)
        bag.commit()
        bag.close()
        return path.read_bytes()


def parquet(columns: dict[str, Any], variant: int) -> bytes:
    import pyarrow
    from pyarrow import parquet

    stream = io.BytesIO()
    table = pyarrow.table({**columns, "x": [[float(x), 0.0] for x in columns["x"]]})
    packing = ["none", "snappy", "zstd", "gzip"][variant]
    parquet.write_table(table, stream, compression=packing, row_group_size=150, use_dictionary=variant == 0)
    return stream.getvalue()


def hdf5(columns: dict[str, Any], variant: int) -> bytes:
    import h5py

    stream = io.BytesIO()
    with h5py.File(stream, "w", userblock_size=512 if variant == 2 else 0) as file:
        for name, values in columns.items():
            packing = [None, "gzip", "lzf", "gzip"][variant]
            file.create_dataset(f"run/{name}", data=values, compression=packing, chunks=(100,) if packing else None)
    return stream.getvalue()


def mdf(columns: dict[str, Any], variant: int) -> bytes:
    import asammdf

    made = asammdf.MDF(version="4.10")
    made.append([asammdf.Signal(samples=columns[n], timestamps=columns["t"], name=n, unit="m") for n in "xvw"])
    stream = io.BytesIO()
    made.save(stream, compression=variant % 3)
    return stream.getvalue()


def tdms(columns: dict[str, Any], variant: int) -> bytes:
    import nptdms

    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        for part in np.array_split(np.arange(len(columns["t"])), 1 + variant):
            writer.write_segment([nptdms.ChannelObject("g", name, values[part]) for name, values in columns.items()])
    return stream.getvalue()


def ulog(columns: dict[str, Any], variant: int) -> bytes:
    def message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<Hc", len(body), kind) + body

    data = b"ULog\x01\x12\x35\x01" + bytes(8) + message(b"B", bytes(40))
    data += message(b"F", b"m:uint64_t timestamp;double x;double v;double w;") + message(b"A", b"\0\0\0m")
    for t, x, v, w in zip(*(columns[name] for name in "txvw"), strict=True):
        data += message(b"D", struct.pack("<HQddd", 0, round(t * 1e6) + 1, x, v, w))
    return data


FORMATS: dict[str, tuple[str, Callable[[dict[str, Any], int], bytes], dict[str, str]]] = {
    ".mcap": ("mcap_ros2", mcap, ROS),
    ".db3": ("mcap_ros2", db3, ROS),
    ".parquet": ("pyarrow", parquet, {"x": "x[0]"}),
    ".h5": ("h5py", hdf5, {name: f"run/{name}" for name in "txvw"}),
    ".mf4": ("asammdf", mdf, {}),
    ".tdms": ("nptdms", tdms, {"x": "g.x", "v": "g.v", "w": "g.w"}),
    ".ulg": ("pyulog", ulog, {"x": "m.x", "v": "m.v", "w": "m.w"}),
}
