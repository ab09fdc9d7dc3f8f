"""ROS 2 logs of the sliding mass, written by the reference libraries: mcap with mcap-ros2-support, and rosbags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from slider_log import rows

from codegen.logs.formats.bag_file import DEFINITIONS

EPOCH = 1_700_000_000_000_000_000
"""ns; a double holds stamps of today to 256 ns only."""
LATE = 3_400_000
"""ns by which the recorder's stamps come after those of the headers."""
JOINTS = "sensor_msgs/msg/JointState"
COLUMNS = {
    "x": "/joint_states.position[rail]",
    "v": "/joint_states.velocity[rail]",
    "w": "/joint_states.effort[rail]",
}


def stamp(ns: int) -> dict[str, int]:
    return {"sec": ns // 10**9, "nanosec": ns % 10**9}


def joint_states(made: dict[str, Any] | None = None) -> list[tuple[int, dict[str, Any]]]:
    """(ns, message); beside the mass an idle joint, which comes first in one message and last in the next."""
    made = made or {name: values[:2500] for name, values in rows().items()}
    found = []
    for k, (t, x, v, w) in enumerate(zip(*(made[name] for name in "txvw"), strict=True)):
        ns, turn = EPOCH + round(float(t) * 1e9), 1 if k % 2 else -1
        message = {
            "header": {"stamp": stamp(ns), "frame_id": ""},
            "name": ["idle", "rail"][::turn],
            "position": [7.0, float(x)][::turn],
            "velocity": [0.0, float(v)][::turn],
            "effort": [9.0, float(w)][::turn],
        }
        found.append((ns, message))
    return found


def write_mcap(path: Path, topics: dict[str, tuple[str, list[tuple[int, dict[str, Any]]]]], **options: Any) -> Path:
    """Topic → (type, (ns, message)s), merged by time as a recorder does."""
    from mcap_ros2.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        schemas = {kind: writer.register_msgdef(kind, DEFINITIONS[kind]) for kind, _ in topics.values()}
        merged = [(ns, topic, kind, message) for topic, (kind, sent) in topics.items() for ns, message in sent]
        for ns, topic, kind, message in sorted(merged, key=lambda one: one[0]):
            writer.write_message(topic, schemas[kind], message, log_time=ns + LATE)
        writer.finish()
    return path


def write_folder(path: Path, storage: str, sent: list[tuple[int, dict[str, Any]]]) -> Path:
    """A bag folder by rosbags, whose own serializer makes the CDR."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    with Writer(path, version=9, storage_plugin=StoragePlugin[storage]) as writer:
        connection = writer.add_connection("/joint_states", JOINTS, typestore=store)
        for ns, m in sent:
            header = kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](**m["header"]["stamp"]), "")
            numbers = [np.array(m[key]) for key in ("position", "velocity", "effort")]
            message = kinds[JOINTS](header, m["name"], *numbers)
            writer.write(connection, ns + LATE, store.serialize_cdr(message, JOINTS))
    return path
