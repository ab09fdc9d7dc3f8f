"""ROS 2 bags: messages in SQLite (.db3), and folders whose metadata.yaml names the files of one recording."""

import sqlite3
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import is_there, read_text
from codegen.base.user_text import brief
from codegen.logs.formats.mcap_file import McapStorage
from codegen.logs.formats.ros_log import Message, Storage, Topic
from codegen.spec.yaml_text import load_plain

METADATA = "metadata.yaml"
LARGEST_MESSAGE = 64_000_000
"""Bytes."""
TABLES = {"topics": {"id", "name", "type", "serialization_format"}, "messages": {"topic_id", "timestamp", "data"}}
"""Table of a bag in SQLite → its columns that are read."""
_RULE = "\n" + "=" * 80 + "\n"
_HEADER = _RULE + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
_LAYOUT = (
    f"{_RULE}MSG: std_msgs/MultiArrayLayout\nstd_msgs/MultiArrayDimension[] dim\nuint32 data_offset"
    f"{_RULE}MSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride"
)
_WRENCH = (
    f"{_RULE}MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque"
    f"{_RULE}MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z"
)
DEFINITIONS = {
    "sensor_msgs/msg/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    f"float64[] effort{_HEADER}",
    "std_msgs/msg/Float32": "float32 data",
    "std_msgs/msg/Float64": "float64 data",
    "std_msgs/msg/Float64MultiArray": f"std_msgs/MultiArrayLayout layout\nfloat64[] data{_LAYOUT}",
    "geometry_msgs/msg/WrenchStamped": f"std_msgs/Header header\ngeometry_msgs/Wrench wrench{_HEADER}{_WRENCH}",
}
"""Type of a message → its definition, for bags older than ROS 2 Iron, which hold none.

The commonest types, from ros2/common_interfaces, branch humble, without comments. Definitions in the bag come first.
"""


class Db3Storage(Storage):
    """A bag in one SQLite file. Opening it reads topics and definitions only."""

    expected = "a ROS 2 bag in SQLite (.db3)"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.library("mcap_ros2", "mcap")
        with self.opened() as stream:
            if stream.read(16) != b"SQLite format 3\0":
                raise self.fault("no SQLite file")
        self._ids: dict[int, str] = {}
        found = []
        with self.reading(), closing(self._connection()) as bag:
            for table, wanted in TABLES.items():  # views and computed columns do not count, since they are programs
                kinds = {kind for (kind,) in bag.execute("SELECT type FROM sqlite_master WHERE name = ?", [table])}
                columns = {row[1] for row in bag.execute(f"PRAGMA table_xinfo({table})") if row[6] == 0}
                if kinds != {"table"} or not wanted <= columns:
                    raise self.fault(f"no table `{table}` with {', '.join(sorted(wanted))}")
            given = _definitions(bag)
            for key, name, kind, coding in bag.execute("SELECT id, name, type, serialization_format FROM topics"):
                self._ids[int(key)] = str(name)
                found.append(_topic(str(name), str(kind), str(coding), given))
        self.topics = {topic.name: topic for topic in found}

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        keys = [key for key, name in self._ids.items() if name in topics]
        with closing(self._connection()) as bag:
            marks = ", ".join("?" * len(keys))
            query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY rowid"
            for key, stamp, data in bag.execute(query, keys):
                if not isinstance(data, bytes) or not isinstance(stamp, int):
                    raise ValueError("a message that is no bytes, or has no time")
                yield Message(self._ids[key], stamp, data)

    def _connection(self) -> sqlite3.Connection:
        """The file, opened read-only and with limits, since it is not trusted."""
        bag = sqlite3.connect(f"file:{quote(str(self.path.resolve()))}?mode=ro&immutable=1", uri=True)
        bag.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_MESSAGE)
        bag.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        bag.execute("PRAGMA trusted_schema = OFF")
        bag.execute("PRAGMA cell_size_check = ON")
        return bag


def _definitions(bag: sqlite3.Connection) -> dict[str, tuple[str, str]]:
    """Type of a message → (encoding of its definition, definition), for the types that the bag defines."""
    if not bag.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions' AND type = 'table'").fetchone():
        return {}
    rows = bag.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    return {str(kind): (str(encoding), str(text)) for kind, encoding, text in rows}


def _topic(name: str, kind: str, coding: str, given: Mapping[str, tuple[str, str]]) -> Topic:
    """A topic with the definition of its messages, or with the reason why they cannot be read."""
    encoding, text = given.get(kind, ("", ""))
    if coding != "cdr":
        return Topic(name, kind, "", f"its messages are in `{coding}`, not CDR")
    if text and encoding == "ros2msg":
        return Topic(name, kind, text)
    if kind in DEFINITIONS:
        return Topic(name, kind, DEFINITIONS[kind])
    return Topic(name, kind, "", f"the bag has no definition of {kind} (`ros2 bag convert` to mcap adds it)")


STORAGES: Mapping[str, Callable[[Path], Storage]] = {".mcap": McapStorage, ".db3": Db3Storage}


class BagFolder(Storage):
    """A bag's folder: the files that its metadata names, read as one."""

    expected = f"a ROS 2 bag folder: {METADATA} and the .mcap or .db3 files that it names"

    def __init__(self, path: Path) -> None:
        """Open the files."""
        super().__init__(path)
        metadata = path / METADATA
        text = read_text(metadata, self.expected)
        document, _ = load_plain(text, str(metadata), "rosbag2_bagfile_information: …")
        section = document.get("rosbag2_bagfile_information")
        names = section.get("relative_file_paths") if isinstance(section, dict) else None
        if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
            raise self._metadata("no list of files under rosbag2_bagfile_information")
        if str(section.get("compression_mode", "")).upper() == "MESSAGE":
            found = "messages that are compressed one by one"
            raise self._metadata(found, " (`ros2 bag convert` decompresses them)", "LOG002")
        self._parts = []
        if len(set(names)) < len(names):  # else a short list could read one file a thousand times
            raise self._metadata(f"`{brief(Counter(names).most_common(1)[0][0])}` more than once")
        for name in names:
            if Path(name).name != name:
                raise self._metadata(f"`{brief(name)}`, in another folder")
            if Path(name).suffix not in STORAGES:
                found = f"`{brief(name)}`, compressed or of another type"
                raise self._metadata(found, " (`zstd -d` decompresses a file)", "LOG002")
            self._parts.append(STORAGES[Path(name).suffix](path / name))
        self.topics = {name: topic for part in self._parts for name, topic in part.topics.items()}

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        for part in self._parts:
            if any(topic in topics for topic in part.topics):
                yield from part.messages(topics)

    def _metadata(self, found: str, hint: str = "", code: str = "LOG001") -> BadInput:
        place = Place(str(self.path / METADATA), None, "relative_file_paths")
        return BadInput(place, found, f"{self.expected}{hint}", code=code)


def is_bag(path: Path) -> bool:
    """Whether a folder is a ROS 2 bag."""
    return is_there(path / METADATA)
