"""Logs of ROS 2 messages: the numeric fields of topics as columns, at the stamps of the messages' own headers."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.logs.description import LogDescription
from codegen.logs.library import library, reading
from codegen.logs.ros_fields import header_stamp, numeric_fields
from codegen.logs.ros_storage import Message, Storage, Topic
from codegen.logs.series import TIME, check_held, joined, together
from codegen.logs.source import Allowance, Columns, shown

EXPECTED = "a log of ROS 2 messages"
LOOKED_AT = 20
"""Messages of each topic that tell which fields it has: several nodes may publish one topic."""
LARGEST_SIGNAL = 65_536
"""Bytes of a message beyond which it is a picture or a cloud."""
LOOKED_THROUGH = 100_000
COUNTED_EVERY = 4096
MOST_COLUMNS = 20_000
Decoder = Callable[[bytes], Any]


class _Signal:
    """Numbers of one column: (N,) stamps of the header and of the recorder in ns, and values."""

    def __init__(self) -> None:
        self.stamps, self.recorded, self.values = array("q"), array("q"), array("d")

    def add(self, stamp: int, recorded: int, value: float) -> None:
        self.stamps.append(stamp)
        self.recorded.append(recorded)
        self.values.append(value)


@dataclass(eq=False)
class RosSource:
    """An opened storage whose topics' fields are known.

    Attributes:
        columns: path of a field → topic.
        unread: topic → why none of its fields is a column.
        notes: what was done, complete once ``load`` has run.
    """

    storage: Storage
    decoders: Mapping[str, Decoder]
    columns: Mapping[str, str]
    unread: Mapping[str, str]
    description: LogDescription
    allowance: Allowance
    notes: list[str] = field(default_factory=list)

    @property
    def names(self) -> tuple[str, ...]:
        return (TIME, *self.columns)

    @property
    def place(self) -> Place:
        return Place(str(self.storage.path))

    @property
    def units(self) -> Mapping[str, str]:
        return {}

    @property
    def joints_in_brackets(self) -> bool:
        return True

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted fields, of all topics at common times; see ``series.joined``.

        Raises:
            BadInput: for a damaged file, a message that does not fit its definition, or too many numbers.
        """
        path = self.storage.path
        signals = {name: _Signal() for name in wanted if name != TIME}
        topics = {self.columns[name] for name in signals}
        empty: Counter[str] = Counter()
        with reading(path, EXPECTED):
            for count, message in enumerate(self.storage.messages(topics), 1):
                if message.data:
                    self._take(message, signals)
                else:
                    empty[message.topic] += 1
                if count % COUNTED_EVERY == 0:
                    self._count(signals)
        self._count(signals)
        self.notes += [f"`{shown(topic)}`: {n} messages of no bytes left out" for topic, n in sorted(empty.items())]
        timed = {topic: self._by_header(topic, signals) for topic in sorted(topics)}
        stamps = {
            n: np.frombuffer(s.stamps if timed[self.columns[n]] else s.recorded, "i8") for n, s in signals.items()
        }
        origin = min((int(ns[0]) for ns in stamps.values() if len(ns)), default=0)  # doubles do not hold today in ns
        times = {n: (ns - origin) / 1e9 for n, ns in stamps.items()}
        series = together({n: (self.columns[n], times[n], np.frombuffer(s.values)) for n, s in signals.items()})
        columns, words = joined(str(path), series, wanted, self.description)
        self.notes += words
        return columns

    def _count(self, signals: Mapping[str, _Signal]) -> None:
        self.allowance.take(self.storage.path, 24 * sum(len(s.values) for s in signals.values()), EXPECTED)

    def _take(self, message: Message, signals: Mapping[str, _Signal]) -> None:
        decoded = _decoded(self.decoders[message.topic], message, self.place)
        stamp = header_stamp(decoded) or 0
        for name, value in numeric_fields(decoded, message.topic):
            signal = signals.get(name)
            if signal is not None:
                signal.add(stamp, message.stamp, value)

    def _by_header(self, topic: str, signals: Mapping[str, _Signal]) -> bool:
        """Whether a topic's messages have stamps of their own."""
        stamped = any(any(s.stamps) for name, s in signals.items() if self.columns[name] == topic)
        if not stamped:
            self.notes.append(f"`{shown(topic)}`: no stamps in its messages' headers; those of the recorder are taken")
        return stamped


def open_ros(storage: Storage, allowance: Allowance, description: LogDescription) -> RosSource:
    """Look at the first messages of each topic for their fields.

    Raises:
        BadInput: for a damaged file, or one in which no topic has a number.
    """
    unread = {topic.name: topic.unread for topic in storage.topics.values() if topic.unread}
    decoders: dict[str, Decoder] = {}
    for topic in storage.topics.values():
        if topic.name not in unread:
            try:
                decoders[topic.name] = _decoder(topic, storage)
            except BadInput as error:
                unread[topic.name] = error.found
    columns: dict[str, str] = {}
    place = Place(str(storage.path))
    with reading(storage.path, EXPECTED):
        for message in _first(storage, set(decoders)):
            decoded = _decoded(decoders[message.topic], message, place)
            columns |= {name: message.topic for name, _ in numeric_fields(decoded, message.topic)}
            if len(columns) > MOST_COLUMNS:
                raise BadInput(place, f"more than {MOST_COLUMNS} numeric fields", EXPECTED, code="LOG010")
    for name in decoders.keys() - set(columns.values()):
        unread[name] = "none of its first messages holds a number, or they are too large to be signals"
    if not columns:
        words = "; ".join(f"`{shown(name)}`: {why}" for name, why in list(unread.items())[:3]) or "no topic"
        raise BadInput(place, f"no topic with numbers ({words})", EXPECTED, code="LOG001")
    check_held(description, columns)
    return RosSource(storage, decoders, columns, unread, description, allowance)


def _decoder(topic: Topic, storage: Storage) -> Decoder:
    """Made from the definition, which is parsed as data: no code is generated from it, as other libraries do."""
    factory = library("mcap_ros2.decoder", "mcap", storage.path).DecoderFactory()
    from mcap.records import Schema

    with reading(storage.path, "a definition in ros2msg"):
        schema = Schema(id=1, name=topic.kind, encoding="ros2msg", data=topic.definition.encode())
        decoder: Decoder = factory.decoder_for("cdr", schema)
    return decoder


def _decoded(decoder: Decoder, message: Message, place: Place) -> Any:
    try:
        return decoder(message.data)
    except MemoryError:
        raise
    except Exception as error:  # whatever a message raises that does not fit its definition
        found = f"a message of {len(message.data)} bytes that does not fit its definition ({shown(str(error), 80)})"
        raise BadInput(
            Place(place.file, None, shown(message.topic, 80)), found, "a message of its topic's type", code="LOG001"
        ) from None


def _first(storage: Storage, topics: set[str]) -> list[Message]:
    """The first messages of each topic, as far as they are signals; found among the first hundred thousand."""
    found: list[Message] = []
    left = dict.fromkeys(topics, LOOKED_AT)
    for message in islice(storage.messages(left), LOOKED_THROUGH):
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
