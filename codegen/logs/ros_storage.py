"""What holds ROS 2 messages: topics, and their messages one by one."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol


class Message(NamedTuple):
    """A message as it was stored.

    Attributes:
        topic: its name. stamp: ns, when it was published or else recorded. data: CDR.
    """

    topic: str
    stamp: int
    data: bytes


@dataclass(frozen=True)
class Topic:
    """A topic.

    Attributes:
        name: such as /joint_states. kind: its messages' type, such as sensor_msgs/msg/JointState.
        definition: of the type and those it is made of, in ROS's format ros2msg.
        unread: why its messages cannot be read; empty where they can.
    """

    name: str
    kind: str
    definition: str
    unread: str = ""


class Storage(Protocol):
    """An opened file or folder of messages."""

    @property
    def path(self) -> Path:
        """Of the file or folder."""

    @property
    def topics(self) -> Mapping[str, Topic]:
        """By name."""

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Those of some topics, in the order in which they were stored.

        Args:
            topics: may become fewer on the way; then the rest is passed over where that saves reading.
        """
