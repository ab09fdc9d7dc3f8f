"""Logs of ROS 2 messages: a column for each numeric field of a topic, at the stamps of the messages' headers."""

from abc import ABC, abstractmethod
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from codegen.base.errors import BadInput
from codegen.base.user_text import brief
from codegen.logs.description import LogDescription
from codegen.logs.formats.series import Signal, SignalFile
from codegen.logs.formats.source import Allowance, File

LOOKED_AT = 20
"""Messages of each topic by which its fields are found; several, since several nodes may publish one topic."""
LARGEST_SIGNAL = 65_536
"""Most bytes of a message of signals; a larger one is an image or a point cloud."""
LONGEST_LIST = 256
"""Most entries of a list of signals."""
LOOKED_THROUGH = 100_000
COUNTED_EVERY = 4096
MOST_COLUMNS = 20_000
Decoder = Callable[[bytes], Any]


class Message(NamedTuple):
    """A stored message: the time at which it was published or else recorded, ns, and its bytes (CDR)."""

    topic: str
    stamp: int
    data: bytes


@dataclass(frozen=True)
class Topic:
    """A topic.

    Attributes:
        kind: the messages' type, such as sensor_msgs/msg/JointState.
        definition: of the type and its parts, in the format ros2msg.
        unread: why its messages cannot be read; empty if they can.
    """

    name: str
    kind: str
    definition: str
    unread: str = ""


class Storage(File, ABC):
    """An opened file or folder of messages; a subclass for each format, whose constructor finds the topics by name."""

    topics: Mapping[str, Topic]

    @abstractmethod
    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """The messages of some topics, in the order in which they were stored.

        ``topics``: may become fewer meanwhile; the messages of the others may then be skipped.
        """


class _Numbers:
    """One column while it is read: (N,) stamps of the headers and of the recorder in ns, and values."""

    def __init__(self) -> None:
        self.stamps, self.recorded, self.values = array("q"), array("q"), array("d")

    def add(self, stamp: int, recorded: int, value: float) -> None:
        self.stamps.append(stamp)
        self.recorded.append(recorded)
        self.values.append(value)


class RosFile(SignalFile):
    """A storage of messages, with the fields of its topics by the first messages of each."""

    expected = "a log of ROS 2 messages"
    joints_in_brackets = True

    def __init__(self, storage: Storage, allowance: Allowance, description: LogDescription) -> None:
        super().__init__(storage.path, allowance, description)
        self._storage = storage
        self._topic_of: dict[str, str] = {}
        self._decoders: dict[str, Decoder] = {}
        for topic in storage.topics.values():
            if topic.unread:
                self.unread[topic.name] = topic.unread
                continue
            try:
                self._decoders[topic.name] = self._decoder(topic)
            except BadInput as error:
                self.unread[topic.name] = error.found
        with self.reading():
            for message in self._first():
                decoded = self._decoded(message)
                self._topic_of |= {name: message.topic for name, _ in numeric_fields(decoded, message.topic)}
                if len(self._topic_of) > MOST_COLUMNS:
                    raise self.fault(f"more than {MOST_COLUMNS} numeric fields", code="LOG010")
        for name in self._decoders.keys() - set(self._topic_of.values()):
            self.unread[name] = "none of its first messages holds a number, or they are too large to be signals"
        if not self._topic_of:
            words = "; ".join(f"`{brief(name)}`: {why}" for name, why in list(self.unread.items())[:3]) or "no topic"
            raise self.fault(f"no topic with numbers ({words})")
        self.set_columns(dict.fromkeys(self._topic_of, 0))  # counted as they are read

    def signals(self, wanted: Sequence[str]) -> dict[str, Signal]:
        numbers = {name: _Numbers() for name in wanted}
        topics = {self._topic_of[name] for name in wanted}
        empty: Counter[str] = Counter()
        for count, message in enumerate(self._storage.messages(topics), 1):
            if message.data:
                decoded = self._decoded(message)
                stamp = header_stamp(decoded) or 0
                for name, value in numeric_fields(decoded, message.topic):
                    if name in numbers:
                        numbers[name].add(stamp, message.stamp, value)
            else:
                empty[message.topic] += 1
            if count % COUNTED_EVERY == 0:
                self._count(numbers)
        self._count(numbers)
        self.own_notes += [f"`{brief(topic)}`: {n} messages of no bytes left out" for topic, n in sorted(empty.items())]
        timed = {topic: self._by_header(topic, numbers) for topic in sorted(topics)}
        stamps = {
            n: np.frombuffer(s.stamps if timed[self._topic_of[n]] else s.recorded, "i8") for n, s in numbers.items()
        }
        origin = min((int(ns[0]) for ns in stamps.values() if len(ns)), default=0)  # doubles do not hold today in ns
        return {
            n: Signal(self._topic_of[n], (ns - origin) / 1e9, np.frombuffer(numbers[n].values))
            for n, ns in stamps.items()
        }

    def _count(self, numbers: Mapping[str, _Numbers]) -> None:
        self.take(24 * sum(len(s.values) for s in numbers.values()))

    def _by_header(self, topic: str, numbers: Mapping[str, _Numbers]) -> bool:
        """Whether a topic's messages have stamps in their headers."""
        stamped = any(any(s.stamps) for name, s in numbers.items() if self._topic_of[name] == topic)
        if not stamped:
            self.own_notes.append(
                f"`{brief(topic)}`: no stamps in its messages' headers; those of the recorder are taken"
            )
        return stamped

    def _decoder(self, topic: Topic) -> Decoder:
        """The decoder of a topic, by a library that parses the definition as data and generates no code from it."""
        factory = self.library("mcap_ros2.decoder", "mcap").DecoderFactory()
        from mcap.records import Schema

        with self.reading("a definition in ros2msg"):
            schema = Schema(id=1, name=topic.kind, encoding="ros2msg", data=topic.definition.encode())
            decoder: Decoder = factory.decoder_for("cdr", schema)
        return decoder

    def _decoded(self, message: Message) -> Any:
        decode = self._decoders[message.topic]
        try:
            return decode(message.data)
        except MemoryError:
            raise
        except Exception as error:  # whatever a message raises that does not fit its definition
            found = f"a message of {len(message.data)} bytes that does not fit its definition ({brief(str(error), 80)})"
            raise self.fault(found, "a message of its topic's type", message.topic) from None

    def _first(self) -> list[Message]:
        """The first messages of each topic of signals, among the first hundred thousand of the file."""
        found: list[Message] = []
        left = dict.fromkeys(set(self._decoders), LOOKED_AT)
        for message in islice(self._storage.messages(left), LOOKED_THROUGH):
            if message.topic not in left:
                continue
            left[message.topic] -= 1
            if 0 < len(message.data) <= LARGEST_SIGNAL:
                found.append(message)
            if not left[message.topic] or len(message.data) > LARGEST_SIGNAL:
                del left[message.topic]
            if not left:
                break
        return found


def numeric_fields(value: Any, path: str, labels: Sequence[list[str]] = ()) -> Iterator[tuple[str, float]]:
    """(path, value) of each number in a decoded message: ``effort[shoulder]``, ``header.stamp.sec``.

    An entry of a list is called by its name if the message, or one around it, has a list of as many names (``name``,
    ``joint_names`` …), else by its number counted from 0.
    """
    if isinstance(value, (bool, int, float)):
        yield path, float(value)
    elif isinstance(value, (list, bytes)):
        if not 0 < len(value) <= LONGEST_LIST:
            return
        named = next((names for names in labels if len(names) == len(value)), None)
        for k, entry in enumerate(value):
            yield from numeric_fields(entry, f"{path}[{named[k] if named else k}]", labels)
    elif hasattr(value, "__slots__"):
        fields = {slot: getattr(value, slot) for slot in value.__slots__}
        own = [inner for slot, inner in fields.items() if slot.endswith(("name", "names")) and _are_names(inner)]
        for slot, inner in fields.items():
            if slot != "header" or header_stamp(value) is None:  # a header's stamp is the time of the other fields
                yield from numeric_fields(inner, f"{path}.{slot}", (*own, *labels))


def header_stamp(message: Any) -> int | None:
    """The stamp of a message with a header, in ns; None for one without."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None or not hasattr(stamp, "sec") or not hasattr(stamp, "nanosec"):
        return None
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], str) and len(set(value)) == len(value)
