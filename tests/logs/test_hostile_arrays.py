"""Hostile .npy and .mat files: one message, and never more memory than is stated."""

from __future__ import annotations

import io
import pickle
import resource
import struct
import subprocess
import sys
import tracemalloc
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log, read_logs
from codegen.logs.formats import source as log_source
from codegen.logs.formats.numpy_file import LONGEST_HEADER, read_member
from tests.expected_errors import refused
from tests.slow_cases import examples

FIELDS = "[('t', '<f8'), ('x', '<f8'), ('w', '<f8')]"


def npy(header: str | bytes, body: bytes = b"", version: int = 1) -> bytes:
    data = header.encode("latin-1") if isinstance(header, str) else header
    return b"\x93NUMPY" + bytes([version, 0]) + struct.pack("<H" if version == 1 else "<I", len(data)) + data + body


def described(descr: str = FIELDS, shape: str = "(2,)", order: str = "False") -> str:
    return f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n"


HOSTILE = {
    "unclosed": (npy("{'descr': [('t', "), "no .npy file"),
    "unclosed text": (npy("{'descr': '''"), "no .npy file"),
    "brackets": (npy("(" * 9000), "no .npy file"),
    "signs": (npy("{'descr': " + "-" * 9000 + "1}"), "no .npy file"),
    "a call": (npy(described("__import__('os').abort()")), "no .npy file: malformed node or string;"),
    "a huge length": (npy(described(shape=f"({'9' * 18},)")), "bytes, where its header says"),
    "a longer length": (npy(described(shape=f"({'9' * 30},)")), "lengths cannot be read"),
    "a negative length": (npy(described(shape="(-1,)")), "lengths cannot be read"),
    "a length that is true": (npy(described(shape="(True,)")), "bytes, where its header says"),
    "three dimensions": (npy(described("'<f8'", shape="(2, 2, 2)")), "3 dimensions"),
    "a wide table": (npy(described("'<f8'", shape="(65, 99999)")), "99999 columns"),
    "a row a signal, shorter": (npy(described("'<f8'", shape="(2, 99999)"), bytes(48)), "bytes, where its header"),
    "by columns, shorter": (
        npy(described("'<f8'", shape="(2, 3)", order="True"), bytes(40)),
        "bytes, where its header",
    ),
    "two dimensions": (npy(described(shape="(2, 2)")), "not of one dimension"),
    "no dimension": (npy(described(shape="()")), "not of one dimension"),
    "objects": (npy(described("'|O'"), pickle.dumps([1])), "pickled objects"),
    "an object": (npy(described("[('t', '<f8'), ('x', '|O')]"), pickle.dumps([1])), "pickled objects"),
    "text": (npy(described("[('t', '<U9')]")), "a field `t` of type <U9"),
    "void": (npy(described("[('t', '|V999999999')]")), "a field `t` of type"),
    "a field of arrays": (npy(described("[('t', '<f8', (9,))]")), "a field `t` of type"),
    "no names": (npy(described("'<f8'")), "without names"),
    "names twice": (npy(described("[('t', '<f8'), ('t', '<f8')]")), "name already used"),
    "no field": (npy(described("[]")), "an array of type"),
    "a key twice": (npy(described()[:-2] + "'shape': (3,)}"), "where its header says"),
    "a key less": (npy("{'descr': " + FIELDS + "}"), "correct keys: .'descr'"),
    "a long header": (npy(b" " * (LONGEST_HEADER + 1), version=2), r"length \(65537\)"),
    "a longer header": (b"\x93NUMPY\x02\0\xff\xff\xff\xff", "no .npy file"),
    "version 9": (npy(described(), version=9), "version 9"),
    "not UTF-8": (npy(b"\xff", version=3), "no .npy file"),
    "shorter": (npy(described(), bytes(40)), "bytes, where its header says"),
    "empty": (b"", "no .npy file"),
    "a pickle": (pickle.dumps([1]), "no .npy file"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_an_npy_file(tmp_path, spec, case):
    data, words = HOSTILE[case]
    (tmp_path / "a.npy").write_bytes(data)
    with pytest.raises(BadInput, match=words) as told:
        read_log(tmp_path / "a.npy", spec)
    assert len(str(told.value)) < 500


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize(
    ("before", "words"),
    [
        pytest.param([], r"t .no \.npy file", marks=pytest.mark.slow),  # unpacks the same gigabyte
        ([np.arange(9.0)], "two members of one name"),
    ],
)
def test_a_packed_header_is_not_unpacked_beyond_its_limit(tmp_path, spec, before, words):
    """256 MB of blanks in 256 kB; of two members of a name the last one was read without a word."""
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for array in before:
            with archive.open("t.npy", "w") as member:
                np.save(member, array)
        with archive.open("t.npy", "w", force_zip64=True) as member:
            member.write(b"\x93NUMPY\x02\0\xff\xff\xff\xff")
            for _ in range(256):
                member.write(b" " * (1 << 20))
    with pytest.raises(BadInput, match=words):
        read_log(tmp_path / "a.npz", spec)
    tracemalloc.start()
    try:
        with (
            zipfile.ZipFile(tmp_path / "a.npz") as archive,
            archive.open("t.npy") as packed,
            pytest.raises(ValueError, match=r"no \.npy file"),
        ):
            read_member(packed)
        assert tracemalloc.get_traced_memory()[1] < 1 << 24
    finally:
        tracemalloc.stop()


def test_no_object_is_unpickled(tmp_path, spec, monkeypatch):
    trace = tmp_path / "trace"
    np.save(tmp_path / "a.npy", np.array([(1.0, Path(trace))], dtype=[("t", "f8"), ("x", "O")]), allow_pickle=True)
    monkeypatch.setattr(pickle, "load", lambda *a, **k: trace.write_text("loaded"))
    with refused("LOG001 a.npy pickled"):
        read_log(tmp_path / "a.npy", spec)
    assert not trace.exists()


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_the_header_that_numpy_writes(version):
    dtype = np.dtype([("t", "<f8"), ("x 2", ">f4"), ("it's", "<i2"), ("flag", "|b1"), ("u", "|u1")])
    array = np.zeros(7, dtype=dtype)
    stream = io.BytesIO()
    np.lib.format.write_array(stream, array, version=version)
    stream.seek(0)
    header = read_member(stream)
    assert header.table() == dtype and header.rows == 7 and header.offset == stream.getbuffer().nbytes - array.nbytes


@settings(max_examples=examples(150), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(alphabet="{}[](),:' \"\\<>|=fiubOU0123456789descrfotan_hpT", max_size=120), st.sampled_from([1, 2, 3]))
@example(described(), 1)
def test_any_header(tmp_path, spec, header, version):
    (tmp_path / "f.npy").write_bytes(npy(header.encode(), bytes(48), version))
    with pytest.raises(BadInput):
        read_log(tmp_path / "f.npy", spec)


def mat(*elements: bytes) -> bytes:
    return b"MATLAB 5.0".ljust(124) + b"\x00\x01IM" + b"".join(elements)


def compressed(name: str, count: int, said: int | None = None) -> bytes:
    """A vector of zeros, packed; ``said`` is the size that it gives."""
    name_part = struct.pack("<II", 1, len(name)) + name.encode().ljust(-(-len(name) // 8) * 8, b"\0")
    parts = struct.pack("<IIII", 6, 8, 6, 0) + struct.pack("<IIii", 5, 8, count, 1) + name_part
    size = len(parts) + 8 + 8 * count
    packer = zlib.compressobj(1)
    packed = packer.compress(
        struct.pack("<II", 14, size if said is None else said) + parts + struct.pack("<II", 9, 8 * count)
    )
    block = bytes(1 << 20)
    for start in range(0, 8 * count, len(block)):
        packed += packer.compress(block[: 8 * count - start])
    packed += packer.flush()
    return struct.pack("<II", 15, len(packed)) + packed


def test_all_elements_of_a_mat_file_count(tmp_path, spec, monkeypatch):
    (tmp_path / "a.mat").write_bytes(mat(*(compressed(name, 10_000) for name in "txw")))
    with refused("LOG009 a.mat"):  # it can be read, and its time stands still
        read_log(tmp_path / "a.mat", spec)
    monkeypatch.setattr(log_source, "LARGEST", 200_000)
    with refused("LOG010 a.mat: 240192 200000"):
        read_log(tmp_path / "a.mat", spec)


def test_an_element_is_no_longer_than_it_says(tmp_path, spec):
    (tmp_path / "a.mat").write_bytes(mat(compressed("t", 10_000, said=64)))
    with refused("LOG001 a.mat compressed"):
        read_log(tmp_path / "a.mat", spec)


def test_many_elements(tmp_path, spec):
    (tmp_path / "a.mat").write_bytes(mat(struct.pack("<II", 14, 0) * 20_000))
    with refused("LOG001 a.mat 10000"):
        read_log(tmp_path / "a.mat", spec)


def test_all_logs_of_a_call_count(tmp_path, spec, monkeypatch):
    made = rows()
    for name in ("a.mat", "b.mat"):
        savemat(tmp_path / name, made)
    size = (tmp_path / "a.mat").stat().st_size
    monkeypatch.setattr(log_source, "LARGEST", size + 100)
    assert read_log(tmp_path / "a.mat", spec).size
    with refused("LOG010 b.mat: 160192 320384"):
        read_logs([tmp_path / "a.mat", tmp_path / "b.mat"], spec)


def test_a_bomb_in_little_memory(tmp_path):
    """1.8 GB in less than 10 MB, read by a process that may have 1.5 GB."""
    (tmp_path / "a.mat").write_bytes(mat(*[compressed("x", 5_000_000)] * 45))
    assert (tmp_path / "a.mat").stat().st_size < 10_000_000
    code = """
import sys
from pathlib import Path
from codegen.base.errors import BadInput
from codegen.logs import Allowance, LogDescription
from codegen.logs.formats.mat_file import open_mat
try:
    open_mat(Path(sys.argv[1]), Allowance(), LogDescription())
except BadInput as error:
    print(error)
"""
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (1_500_000_000,) * 2)  # noqa: E731
    command = [sys.executable, "-c", code, str(tmp_path / "a.mat")]
    env = {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=limit, env=env)
    assert "bytes when unpacked" in done.stdout, done.stderr
