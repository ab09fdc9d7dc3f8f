"""MCAP files: messages of some topics, read chunk by chunk, so that a file may be larger than memory."""

from collections.abc import Collection, Iterator
from os import SEEK_END
from pathlib import Path
from typing import IO, Any

from codegen.logs.formats.ros_log import Message, Storage, Topic

MAGIC = b"\x89MCAP0\r\n"
LARGEST_CHUNK = 256_000_000
"""Most bytes of a chunk, packed and unpacked; recorders write some megabytes."""


class McapStorage(Storage):
    """An MCAP file whose channels are known, by its summary or, if it has none, by reading it once."""

    expected = "an MCAP log of ROS 2 messages (a file that a recorder left unfinished: `mcap recover`)"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.library("mcap", "mcap")
        self._channels: dict[int, Any] = {}
        self._schemas: dict[int, Any] = {}
        self._offsets: list[tuple[int, frozenset[int]]] = []
        with self.opened() as stream, self.reading():
            self._survey(stream)
        self.topics = {c.topic: self._topic(c) for c in self._channels.values()}

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """The messages of these topics in the order of the file; with an index, chunks without them are skipped."""
        with self.opened() as stream:
            for record in self._records(stream, topics):
                if type(record).__name__ == "Message" and (topic := self._channels[record.channel_id].topic) in topics:
                    yield Message(topic, record.publish_time or record.log_time, record.data)

    def _survey(self, stream: IO[bytes]) -> None:
        from mcap.reader import SeekingReader

        self._refuse_cut_off(stream)
        summary = SeekingReader(stream, record_size_limit=LARGEST_CHUNK).get_summary()
        if summary is not None and summary.channels and summary.chunk_indexes:
            self._channels, self._schemas = summary.channels, summary.schemas
            self._offsets = [(c.chunk_start_offset, frozenset(c.message_index_offsets)) for c in summary.chunk_indexes]
            self._offsets.sort(key=lambda chunk: chunk[0])
            return
        for record in self._records(stream, None):
            if type(record).__name__ == "Channel":
                self._channels[record.id] = record
            elif type(record).__name__ == "Schema":
                self._schemas[record.id] = record

    def _refuse_cut_off(self, stream: IO[bytes]) -> None:
        """Raise BadInput for a file that begins as MCAP and ends otherwise: there is no summary to read."""
        first, size = stream.read(len(MAGIC)), stream.seek(0, SEEK_END)
        stream.seek(max(size - len(MAGIC), 0))
        if first == MAGIC and stream.read() != MAGIC:
            found = f"a file of {size} bytes without the mark of its end: cut off, or still being written"
            raise self.fault(found)
        stream.seek(0)

    def _records(self, stream: IO[bytes], topics: Collection[str] | None) -> Iterator[Any]:
        from mcap.stream_reader import StreamReader

        if not self._offsets:
            stream.seek(0)
            for record in StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST_CHUNK).records:
                yield from self._inside(record)
            return
        read = 0
        for offset, channels in self._offsets:
            if offset < read:  # else a short file could read one chunk a thousand times
                raise self.fault(f"an index with a chunk at {offset}, within the one before")
            if topics is not None and channels and not any(self._channels[c].topic in topics for c in channels):
                continue
            stream.seek(offset)
            reader = StreamReader(stream, skip_magic=True, emit_chunks=True, record_size_limit=LARGEST_CHUNK)
            record = next(iter(reader.records))
            read = stream.tell()
            yield from self._inside(record)

    def _inside(self, record: Any) -> Iterator[Any]:
        """A record, or the records of a chunk, unpacked to at most the size that it states."""
        from mcap.stream_reader import breakup_chunk

        if type(record).__name__ != "Chunk":
            yield record
            return
        data = _unpacked(record.compression, record.data, min(record.uncompressed_size, LARGEST_CHUNK) + 1)
        if len(data) != record.uncompressed_size:
            size = f"more than {len(data) - 1}" if len(data) > record.uncompressed_size else str(len(data))
            found = f"a chunk of {size} bytes where it says {record.uncompressed_size}"
            raise self.fault(found, f"{self.expected}, chunks of at most {LARGEST_CHUNK} bytes")
        record.compression, record.data = "", data
        yield from breakup_chunk(record, validate_crc=True)

    def _topic(self, channel: Any) -> Topic:
        schema = self._schemas.get(channel.schema_id)
        if channel.message_encoding != "cdr":
            return Topic(channel.topic, "", "", f"its messages are in `{channel.message_encoding}`, not CDR of ROS 2")
        if schema is None or not schema.data:
            return Topic(channel.topic, schema.name if schema else "", "", "the file has no schema for its messages")
        if schema.encoding != "ros2msg":
            return Topic(channel.topic, schema.name, "", f"its schema is in `{schema.encoding}`, not ros2msg")
        return Topic(channel.topic, schema.name, schema.data.decode("utf-8", "replace"))


def _unpacked(compression: str, data: bytes, most: int) -> bytes:
    """At most so many bytes of unpacked data."""
    if compression == "zstd":
        import io

        import zstandard

        unpacked = io.BytesIO()
        with zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(data) as stream:
            while unpacked.tell() < most and (part := stream.read(min(1 << 20, most - unpacked.tell()))):
                unpacked.write(part)
        return unpacked.getvalue()
    if compression == "lz4":
        import lz4.frame

        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most))
    if compression:
        raise ValueError(f"chunks packed by `{compression}`, not zstd or lz4")
    return data
