"""MCAP files and ROS 2 bag folders that the reference libraries wrote, and what is no log among them."""

from __future__ import annotations

import sqlite3
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ros_bags import COLUMNS, EPOCH, JOINTS, joint_states, stamp, write_folder, write_mcap
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import LogDescription, read_log
from codegen.logs.formats import mcap_file
from codegen.logs.formats import source as extras
from codegen.logs.formats import source as log_source
from codegen.logs.formats.ros_log import RosFile
from codegen.logs.term import identifier

pytest.importorskip("mcap_ros2", reason="needs the extra mcap")
import zstandard
from mcap.writer import CompressionType, Writer

from tests.expected_errors import refused

MADE = {name: values[:2500] for name, values in rows().items()}
SENT = joint_states(MADE)


def check(log: Any) -> None:
    assert np.allclose(log.time, MADE["t"], atol=1e-9) and log.sample_time == pytest.approx(0.002, rel=1e-9)
    assert np.array_equal(log.positions[:, 0], MADE["x"]) and np.array_equal(log.inputs[:, 0], MADE["w"])
    assert np.array_equal(log.velocities[:, 0], MADE["v"])


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("index", [True, False])
def test_mcap(tmp_path: Path, spec: Any, compression: CompressionType, index: bool) -> None:
    """The stamps are those of the headers; joints go by their names, whatever their order in a message."""
    path = write_mcap(
        tmp_path / "a.mcap", {"/joint_states": (JOINTS, SENT)}, compression=compression, chunk_size=20_000
    )
    if not index:
        data = path.read_bytes()
        footer = len(data) - 8 - 20 - 9
        path.write_bytes(data[: footer + 9] + struct.pack("<QQI", 0, 0, 0) + data[-8:])
    check(read_log(path, spec, columns=COLUMNS))


@pytest.mark.parametrize("joint", ["shoulder", "mm", "0"])
def test_a_joint_in_brackets_is_no_unit(tmp_path: Path, spec: Any, joint: str) -> None:
    """A joint called mm was taken for millimetres, any other for a unit that cannot be converted to metres."""
    sent = [(ns, m | {"name": [joint if name == "rail" else name for name in m["name"]]}) for ns, m in SENT]
    path = write_mcap(tmp_path / "a.mcap", {"/joint_states": (JOINTS, sent)})
    columns = {symbol: name.replace("rail", joint) for symbol, name in COLUMNS.items()}
    log = read_log(path, spec, columns=columns)
    check(log)
    assert not log.raw_data.findings and not any("unit" in note for note in log.notes)
    half = read_log(path, spec, columns=columns | {"w": f"{identifier(columns['w'])}/2"})
    assert np.array_equal(half.inputs[:, 0], MADE["w"] / 2) and not half.raw_data.findings


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_bag_folder(tmp_path: Path, spec: Any, storage: str) -> None:
    pytest.importorskip("rosbags")
    check(read_log(write_folder(tmp_path / "bag", storage, SENT), spec, columns=COLUMNS))


def test_a_bag_without_definitions(tmp_path: Path, spec: Any) -> None:
    """As ROS 2 Humble writes them: those of the commonest messages are known."""
    pytest.importorskip("rosbags")
    (file,) = write_folder(tmp_path / "bag", "SQLITE3", SENT).glob("*.db3")
    with sqlite3.connect(file) as bag:
        bag.execute("DROP TABLE message_definitions")
    check(read_log(file, spec, columns=COLUMNS))
    with sqlite3.connect(file) as bag:
        bag.execute("UPDATE topics SET type = 'my_msgs/msg/State'")
    with refused("LOG001 `/joint_states`: my_msgs/msg/State mcap"):
        read_log(file, spec, columns=COLUMNS)


def test_topics_at_several_rates(tmp_path: Path, spec: Any) -> None:
    """The force on a topic of its own at a tenth of the rate: by lines, or held, where the description says so."""
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    stamps = [EPOCH + 20_000_000 * k + 1_000_000 for k in range(250)]
    forces = [
        (ns, {"header": header(ns), "wrench": {"force": zero | {"x": 5.0 * k}, "torque": zero}})
        for k, ns in enumerate(stamps)
    ]
    topics = {"/joint_states": (JOINTS, SENT), "/force": ("geometry_msgs/msg/WrenchStamped", forces)}
    path = write_mcap(tmp_path / "a.mcap", topics)
    columns = COLUMNS | {"w": "/force.wrench.force.x"}
    log = read_log(path, spec, columns=columns)
    # the first row in the common span is that at 2 ms
    inside = (MADE["t"] >= 0.001) & (MADE["t"] <= 249 * 0.02 + 0.001)
    assert np.array_equal(log.positions[:, 0], MADE["x"][inside])
    assert np.allclose(log.inputs[:, 0], 250 * (MADE["t"][inside] - 0.001), atol=1e-9)
    assert "`/force` (50 Hz) is converted to the times of `/joint_states` (500 Hz) by linear interpolation" in log.notes
    (tmp_path / "meta.yaml").write_text("hold: /force\n")
    held = read_log(path, spec, columns=columns)
    assert np.array_equal(held.inputs[:, 0], 5.0 * np.floor((MADE["t"][inside] - 0.001 + 1e-9) / 0.02))
    assert any("by holding the last value" in note for note in held.notes)
    (tmp_path / "meta.yaml").write_text("hold: /forces\n")
    with refused("LOG013 meta.yaml:1: hold: `/forces`"):
        read_log(path, spec, columns=columns)


def test_rows_in_a_gap_of_another_topic_are_left_out(tmp_path: Path, spec: Any) -> None:
    forces = [(ns, {"data": 1.0}) for k, (ns, _) in enumerate(SENT) if not 1000 < k < 1200]
    path = write_mcap(tmp_path / "a.mcap", {"/joint_states": (JOINTS, SENT), "/w": ("std_msgs/msg/Float64", forces)})
    log = read_log(path, spec, columns=COLUMNS | {"w": "/w.data"})
    assert any("no stamps in its messages' headers; those of the recorder are taken" in note for note in log.notes)
    assert len(log.gaps) == 1 and any("rows in its gaps left out" in note for note in log.notes)


def test_only_chunks_of_the_wanted_topics_are_unpacked(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    first = {"/joint_states": (JOINTS, SENT)}
    other = {"/other": ("std_msgs/msg/Float64", [(EPOCH - 10**9 - k, {"data": 1.0}) for k in range(20_000)])}
    path = write_mcap(tmp_path / "a.mcap", first | other, chunk_size=20_000)
    storage = mcap_file.McapStorage(path)
    source = RosFile(storage, log_source.Allowance(), LogDescription())
    unpacked: list[int] = []
    own = zstandard.ZstdDecompressor
    monkeypatch.setattr(zstandard, "ZstdDecompressor", lambda **options: unpacked.append(1) or own(**options))
    source.load(["t", *COLUMNS.values()])
    chunks = len(storage._offsets)
    assert 0 < len(unpacked) < chunks / 2


def changed(messages: list[tuple[int, dict[str, Any]]], k: int, **fields: Any) -> list[tuple[int, dict[str, Any]]]:
    return [(ns, m | fields if j == k else m) for j, (ns, m) in enumerate(messages)]


def header(ns: int) -> dict[str, Any]:
    return {"stamp": stamp(ns), "frame_id": ""}


def raw_mcap(path: Path, schema: tuple[str, str, bytes] | None, encoding: str, messages: list[bytes]) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        key = writer.register_schema(*schema) if schema else 0
        channel = writer.register_channel("/joint_states", encoding, key)
        for k, data in enumerate(messages):
            writer.add_message(channel, EPOCH + 2_000_000 * k, data, EPOCH + 2_000_000 * k)
        writer.finish()
    return path


FEW = SENT[:300]


def test_time_that_runs_backwards(tmp_path: Path, spec: Any) -> None:
    sent = changed(FEW, 100, header=header(EPOCH))
    path = write_mcap(tmp_path / "a.mcap", {"/joint_states": (JOINTS, sent)})
    with refused("LOG007 /joint_states: 100 0.198"):
        read_log(path, spec, columns=COLUMNS)


def test_names_that_are_not_there(tmp_path: Path, spec: Any) -> None:
    sent = [(ns, m | {"effort": []}) for ns, m in FEW]
    path = write_mcap(tmp_path / "a.mcap", {"/joint_states": (JOINTS, sent)})
    with pytest.raises(
        BadInput, match=r"no column `/joint_state\.position\[rail\]`.*did you mean '/joint_states\.position\[rail\]'"
    ):
        read_log(path, spec, columns=COLUMNS | {"x": "/joint_state.position[rail]"})
    with refused("LOG003 `/joint_states.effort[rail]`"):
        read_log(path, spec, columns=COLUMNS)


DEFINITION = write_mcap.__globals__["DEFINITIONS"][JOINTS].encode()
CODE = b"float64 data 1.0 if __import__('os').system('touch ran') else 2.0"
REFUSED = {
    "no schema": (None, "cdr", [b"\0\1\0\0" + b"\0" * 60], "the file has no schema for its messages"),
    "json": ((JOINTS, "jsonschema", b"{}"), "json", [b"{}"], "its messages are in `json`, not CDR of ROS 2"),
    "idl": ((JOINTS, "ros2idl", b"module x {};"), "cdr", [b"\0\1\0\0"], "its schema is in `ros2idl`, not ros2msg"),
    "a definition that is none": ((JOINTS, "ros2msg", b"\xff 1 2"), "cdr", [b"\0\1\0\0"], "damaged file"),
    "a part without definition": ((JOINTS, "ros2msg", b"a_msgs/B b"), "cdr", [b"\0\1\0\0" + b"\0" * 9], "does not fit"),
    "a type inside itself": (
        (JOINTS, "ros2msg", b"sensor_msgs/JointState b"),
        "cdr",
        [b"\0\1\0\0" + b"\0" * 9],
        "does not fit",
    ),
    "code": ((JOINTS, "ros2msg", CODE), "cdr", [b"\0\1\0\0" + b"\0" * 8], "damaged file"),
    "zero length": ((JOINTS, "ros2msg", DEFINITION), "cdr", [b""] * 9, "no topic with numbers"),
    "short": ((JOINTS, "ros2msg", DEFINITION), "cdr", [b"\0\1\0\0" + b"\0" * 9], "does not fit its definition"),
    "a list that is longer than it is": (
        (JOINTS, "ros2msg", b"float64[] x"),
        "cdr",
        [b"\0\1\0\0\xff\xff\xff\xff" + b"\0" * 20],
        "a message of 28 bytes that does not fit its definition",
    ),
    "no message": ((JOINTS, "ros2msg", DEFINITION), "cdr", [], "no topic with numbers"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_messages_that_are_none(tmp_path: Path, spec: Any, case: str, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    *parts, words = REFUSED[case]
    path = raw_mcap(tmp_path / "a.mcap", *parts)
    with pytest.raises(BadInput) as told:
        read_log(path, spec, columns=COLUMNS)
    assert words in str(told.value) and "a.mcap" in str(told.value) and len(str(told.value)) < 700
    assert not (tmp_path / "ran").exists()


def test_an_empty_message_among_others_is_left_out(tmp_path: Path, spec: Any) -> None:
    path = write_mcap(tmp_path / "b.mcap", {"/joint_states": (JOINTS, FEW)}, compression=CompressionType.NONE)
    data = [message.data for message in mcap_file.McapStorage(path).messages({"/joint_states"})]
    path = raw_mcap(tmp_path / "a.mcap", (JOINTS, "ros2msg", DEFINITION), "cdr", [*data[:50], b"", *data[50:]])
    assert "`/joint_states`: 1 messages of no bytes left out" in read_log(path, spec, columns=COLUMNS).notes


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.9, 0.999])
def test_cut_off(tmp_path: Path, spec: Any, share: float) -> None:
    path = write_mcap(tmp_path / "a.mcap", {"/joint_states": (JOINTS, FEW)}, chunk_size=5000)
    path.write_bytes(path.read_bytes()[: round(share * path.stat().st_size)])
    words = "without the mark of its end: cut off" if share > 0.1 else ""
    with pytest.raises(BadInput, match=rf"a\.mcap: .*{words}.*expected an MCAP log of ROS 2 messages"):
        read_log(path, spec, columns=COLUMNS)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("said", [1000, 200_000_000, 10**15])
def test_a_chunk_that_lies_about_its_size(tmp_path: Path, spec: Any, compression: str, said: int) -> None:
    """100 MB of zeros in some kilobytes are unpacked to the size that is stated, and not further."""
    import lz4.frame
    import zstandard
    from mcap.data_stream import RecordBuilder
    from mcap.records import Chunk, Footer, Header

    bomb = bytes(100_000_000)
    data = zstandard.compress(bomb) if compression == "zstd" else lz4.frame.compress(bomb)
    builder = RecordBuilder()
    builder.write(b"\x89MCAP0\r\n")
    Header(profile="ros2", library="").write(builder)
    Chunk(
        compression=compression, data=data, message_start_time=0, message_end_time=0, uncompressed_crc=0,
        uncompressed_size=said,
    ).write(builder)  # fmt: skip
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(builder)
    builder.write(b"\x89MCAP0\r\n")
    (tmp_path / "a.mcap").write_bytes(builder.end())
    with pytest.raises(BadInput, match=f"a chunk of .* bytes where it says {said}"):
        read_log(tmp_path / "a.mcap", spec, columns=COLUMNS)


def test_numbers_are_counted_while_they_are_read(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    path = write_mcap(tmp_path / "a.mcap", {"/joint_states": (JOINTS, SENT)})
    monkeypatch.setattr(log_source, "LARGEST", 100_000)
    with refused("LOG010 180000 100000"):
        read_log(path, spec, columns=COLUMNS)


def test_a_library_that_is_not_installed(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(extras.importlib, "import_module", absent)
    with refused("TOOL003 `mcap` 'stiction[mcap]'"):
        read_log(tmp_path / "a.mcap", spec, columns=COLUMNS)


HOSTILE_SQL = {
    "a view": ["ALTER TABLE messages RENAME TO m", "CREATE VIEW messages AS SELECT * FROM m"],
    "no table": ["DROP TABLE messages"],
    "text as data": ["UPDATE messages SET data = 'x'"],
    "no time": ["UPDATE messages SET timestamp = 'x'"],
    "a computed column": [
        "ALTER TABLE messages RENAME TO m",
        "CREATE TABLE messages (id, topic_id, timestamp, data GENERATED ALWAYS AS (zeroblob(1000000000)))",
    ],
}


@pytest.mark.parametrize("case", HOSTILE_SQL)
def test_hostile_bags(tmp_path: Path, spec: Any, case: str) -> None:
    pytest.importorskip("rosbags")
    (file,) = write_folder(tmp_path / "bag", "SQLITE3", FEW).glob("*.db3")
    with sqlite3.connect(file) as bag:
        for line in HOSTILE_SQL[case]:
            bag.execute(line)
    with refused("LOG001 .db3:"):
        read_log(file, spec, columns=COLUMNS)
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    with refused("LOG001 .db3:"):
        read_log(file, spec, columns=COLUMNS)


METADATA = {
    "a: 1\n": "no list of files",
    "rosbag2_bagfile_information: {relative_file_paths: [../x.mcap]}\n": "in another folder",
    "rosbag2_bagfile_information: {relative_file_paths: [x.mcap, y.mcap, x.mcap]}\n": "`x.mcap` more than once",
    "rosbag2_bagfile_information: {relative_file_paths: [x.db3.zstd]}\n": "`zstd -d`",
    "rosbag2_bagfile_information: {relative_file_paths: [x.mcap]}\n": "no such file",
    "rosbag2_bagfile_information: {compression_mode: MESSAGE, relative_file_paths: [x.mcap]}\n": "compressed one",
}


@pytest.mark.parametrize("text", METADATA)
def test_metadata(tmp_path: Path, spec: Any, text: str) -> None:
    (tmp_path / "metadata.yaml").write_text(text)
    with pytest.raises(BadInput, match=METADATA[text]):
        read_log(tmp_path, spec, columns=COLUMNS)


def test_a_chunk_that_the_index_names_often_is_refused(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    """A file of 100 kB took a minute with 200 of them, and an hour with 10 000."""
    own = Writer._Writer__finalize_chunk

    def again(self: Any) -> None:
        own(self)
        self._Writer__chunk_indices.extend(self._Writer__chunk_indices[:1])

    monkeypatch.setattr(Writer, "_Writer__finalize_chunk", again)
    write_mcap(tmp_path / "a.mcap", {"/joint_states": (JOINTS, SENT)})
    with refused("LOG001 a.mcap: index chunk within the one before"):
        read_log(tmp_path / "a.mcap", spec, columns=COLUMNS)
