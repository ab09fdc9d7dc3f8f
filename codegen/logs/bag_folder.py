"""ROS 2 bag folders: a metadata.yaml that names the files of one recording, read one after the other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import is_there, read_text
from codegen.logs.db3_file import Db3Storage
from codegen.logs.description import LogDescription
from codegen.logs.mcap_file import McapStorage
from codegen.logs.ros_log import open_ros
from codegen.logs.ros_storage import Message, Storage, Topic
from codegen.logs.source import Allowance, Source, shown
from codegen.spec.yaml_text import load_mapping, plain

METADATA = "metadata.yaml"
EXPECTED = f"a ROS 2 bag folder: {METADATA} and the .mcap or .db3 files that it names"
STORAGES: Mapping[str, Callable[[Path], Storage]] = {".mcap": McapStorage, ".db3": Db3Storage}


class Bag:
    """The storages of a folder as one.

    Attributes:
        path: of the folder. topics: by name, of all its files.
    """

    def __init__(self, path: Path, parts: list[Storage]) -> None:
        self.path, self._parts = path, parts
        self.topics: Mapping[str, Topic] = {name: topic for part in parts for name, topic in part.topics.items()}

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        for part in self._parts:
            if any(topic in topics for topic in part.topics):
                yield from part.messages(topics)


def is_bag(path: Path) -> bool:
    """Whether a folder is a ROS 2 bag."""
    return is_there(path / METADATA)


def open_bag(path: Path, allowance: Allowance, description: LogDescription) -> Source:
    """Open the files that a bag folder's metadata names.

    Raises:
        BadInput: for metadata without a list of files, a file that is in another folder, packed whole or of another
            kind, or one that cannot be used.
    """
    metadata = path / METADATA
    document, _ = load_mapping(read_text(metadata, EXPECTED), str(metadata), "rosbag2_bagfile_information: …")
    place = Place(str(metadata), None, "relative_file_paths")
    section = plain(document).get("rosbag2_bagfile_information")
    names = section.get("relative_file_paths") if isinstance(section, dict) else None
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise BadInput(place, "no list of files under rosbag2_bagfile_information", EXPECTED, code="LOG001")
    if str(section.get("compression_mode", "")).upper() == "MESSAGE":
        raise BadInput(
            place,
            "messages that are compressed one by one",
            f"{EXPECTED} (`ros2 bag convert` decompresses them)",
            code="LOG002",
        )
    parts = []
    for name in names:
        if Path(name).name != name:
            raise BadInput(place, f"`{shown(name)}`, in another folder", EXPECTED, code="LOG001")
        if Path(name).suffix not in STORAGES:
            found = f"`{shown(name)}`, compressed or of another type"
            raise BadInput(place, found, f"{EXPECTED} (`zstd -d` decompresses a file)", code="LOG002")
        parts.append(STORAGES[Path(name).suffix](path / name))
    return open_ros(Bag(path, parts), allowance, description)
