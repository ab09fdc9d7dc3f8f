"""ROS 2 bags in SQLite (.db3): messages of some topics, row by row."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.description import LogDescription
from codegen.logs.library import library, reading
from codegen.logs.ros_definitions import DEFINITIONS
from codegen.logs.ros_log import open_ros
from codegen.logs.ros_storage import Message, Topic
from codegen.logs.source import LARGEST_STREAM, Allowance, Source

EXPECTED = "a ROS 2 bag in SQLite (.db3)"
LARGEST_MESSAGE = 64_000_000
TABLES = {"topics": {"id", "name", "type", "serialization_format"}, "messages": {"topic_id", "timestamp", "data"}}


class Db3Storage:
    """A bag whose topics are known.

    Attributes:
        path: of the file. topics: by name.
    """

    def __init__(self, path: Path) -> None:
        """Read the tables of topics and definitions.

        Raises:
            BadInput: for a file that is no bag, or damaged.
        """
        self.path = path
        library("mcap_ros2", "mcap", path)
        with opened(path, EXPECTED, LARGEST_STREAM) as stream:
            if stream.read(16) != b"SQLite format 3\0":
                raise BadInput(Place(str(path)), "no SQLite file", EXPECTED, code="LOG001")
        self._ids: dict[int, str] = {}
        self.topics: Mapping[str, Topic] = {}
        with reading(path, EXPECTED), closing(self._connection()) as bag:
            self._require_tables(bag)
            given = self._definitions(bag)
            found = []
            for key, name, kind, coding in bag.execute("SELECT id, name, type, serialization_format FROM topics"):
                self._ids[int(key)] = str(name)
                found.append(_topic(str(name), str(kind), str(coding), given))
            self.topics = {topic.name: topic for topic in found}

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """In the order in which they were stored."""
        keys = [key for key, name in self._ids.items() if name in topics]
        with closing(self._connection()) as bag:
            marks = ", ".join("?" * len(keys))
            query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY rowid"
            for key, stamp, data in bag.execute(query, keys):
                if not isinstance(data, bytes) or not isinstance(stamp, int):
                    raise ValueError("a message that is no bytes, or has no time")
                yield Message(self._ids[key], stamp, data)

    def _connection(self) -> sqlite3.Connection:
        bag = sqlite3.connect(f"file:{quote(str(self.path.resolve()))}?mode=ro&immutable=1", uri=True)
        bag.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_MESSAGE)
        bag.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        bag.execute("PRAGMA trusted_schema = OFF")
        bag.execute("PRAGMA cell_size_check = ON")
        return bag

    def _require_tables(self, bag: sqlite3.Connection) -> None:
        """Tables, and not views or computed columns, which would be programs in the file."""
        for table, wanted in TABLES.items():
            kinds = {kind for (kind,) in bag.execute("SELECT type FROM sqlite_master WHERE name = ?", [table])}
            columns = {row[1] for row in bag.execute(f"PRAGMA table_xinfo({table})") if row[6] == 0}
            if kinds != {"table"} or not wanted <= columns:
                found = f"no table `{table}` with {', '.join(sorted(wanted))}"
                raise BadInput(Place(str(self.path)), found, EXPECTED, code="LOG001")

    def _definitions(self, bag: sqlite3.Connection) -> dict[str, tuple[str, str]]:
        """Type → (encoding, definition), as far as the bag holds them."""
        if not bag.execute(
            "SELECT 1 FROM sqlite_master WHERE name = 'message_definitions' AND type = 'table'"
        ).fetchone():
            return {}
        rows = bag.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
        return {str(kind): (str(encoding), str(text)) for kind, encoding, text in rows}


def open_db3(path: Path, allowance: Allowance, description: LogDescription) -> Source:
    """Open a .db3 file.

    Raises:
        BadInput: where its library is not installed, or for a file that cannot be used.
    """
    return open_ros(Db3Storage(path), allowance, description)


def _topic(name: str, kind: str, coding: str, given: Mapping[str, tuple[str, str]]) -> Topic:
    encoding, text = given.get(kind, ("", ""))
    if coding != "cdr":
        return Topic(name, kind, "", f"its messages are in `{coding}`, not CDR")
    if text and encoding == "ros2msg":
        return Topic(name, kind, text)
    if kind in DEFINITIONS:
        return Topic(name, kind, DEFINITIONS[kind])
    return Topic(name, kind, "", f"the bag has no definition of {kind} (`ros2 bag convert` to mcap adds it)")
