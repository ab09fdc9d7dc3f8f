"""DIAdem headers with binary files, as KUKA's trace writes them: the same numbers, and faults as one message."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.formats.diadem_file import LARGEST_HEADER
from tests.expected_errors import matches

MADE = rows(duration=4.0)
COUNT = len(MADE["t"])
TIME = f"200,Zeit\n202,s\n210,IMPLIZIT\n220,{COUNT}\n240,0\n241,0.002\n260,Time"


def channel(name: str, unit: str, place: int, more: str = "213,BLOCK\n214,REAL64", factor: str = "1") -> str:
    file = "211,C:\\KRC\\TRACE\\run.r64"
    return f"200,{name}\n201,\n202,{unit}\n210,EXPLIZIT\n{file}\n{more}\n220,{COUNT}\n221,{place}\n240,0\n241,{factor}"


def write(folder: Path, channels: list[str], data: bytes) -> Path:
    head = "DIAEXTENDED  {@:ENGLISH\n#BEGINGLOBALHEADER\n101,a trace\n112,High -> Low\n#ENDGLOBALHEADER\n"
    body = "".join(f"#BEGINCHANNELHEADER\n{text}\n#ENDCHANNELHEADER\n\n" for text in channels)
    (folder / "run.dat").write_bytes((head + body).replace("\n", "\r\n").encode("cp1252"))
    (folder / "run.r64").write_bytes(data)
    return folder / "run.dat"


TWO = [TIME, channel("Istposition", "mm", 1, factor="0.5"), channel("Istkraft", "N", 2)]
BLOCK = np.column_stack([2e3 * MADE["x"], MADE["w"]]).astype("<f8").tobytes()
COLUMNS = {"x": "Istposition", "w": "Istkraft"}


@pytest.mark.parametrize("storage", ["BLOCK", "CHANNEL"])
def test_the_same_numbers(tmp_path, spec, storage):
    if storage == "BLOCK":
        path, tolerance = write(tmp_path, TWO, BLOCK), 1e-12
    else:
        more, tolerance = "213,CHANNEL\n214,REAL32", 1e-6
        channels = [TIME, channel("Istposition", "mm", 1, more), channel("Istkraft", "N", COUNT + 1, more)]
        path = write(tmp_path, channels, np.concatenate([1e3 * MADE["x"], MADE["w"]]).astype("<f4").tobytes())
    log = read_log(path, spec, columns=COLUMNS)
    assert log.sample_time == pytest.approx(0.002)
    np.testing.assert_allclose(log.positions[:, 0], MADE["x"], atol=tolerance)
    np.testing.assert_allclose(log.inputs[:, 0], MADE["w"], atol=20 * tolerance)


@pytest.mark.parametrize(
    ("channels", "data", "words"),
    [
        (TWO, BLOCK[:-16], f"LOG001 run.dat: Istposition {len(BLOCK) - 16} run.r64"),
        (TWO, BLOCK * 2, f"LOG001 run.dat: Istposition {2 * len(BLOCK)}"),  # no stride by its size
        (TWO, b"", "LOG009 run.r64 empty"),
        ([TIME, TWO[1].replace("221,1", "221,9"), TWO[2]], BLOCK, "LOG001 run.dat: Istposition"),
        ([TIME, TWO[1].replace("REAL64", "TWOC16"), TWO[2]], BLOCK, "LOG005 run.dat: Istposition `TWOC16` REAL32"),
        ([TIME, TWO[1].replace("241,0.5", "241,nan"), TWO[2]], BLOCK, "LOG001 run.dat: Istposition `nan` 241"),
        ([TIME.replace(f"220,{COUNT}", "220,1e30"), *TWO[1:]], BLOCK, "LOG001 run.dat: Zeit `1e30` 220"),
        ([TIME.replace(f"220,{COUNT}", "220,1e8"), *TWO[1:]], BLOCK, f"LOG011 run.dat: Istposition {COUNT} 100000000"),
        ([TIME, TWO[1].replace("run.r64", ".."), TWO[2]], BLOCK, "FILE001"),
        ([], BLOCK, "LOG001 run.dat no channel"),
    ],
)
def test_faults(tmp_path, spec, channels, data, words):
    path = write(tmp_path, channels, data)
    with pytest.raises(BadInput) as told:
        read_log(path, spec, columns=COLUMNS)
    assert matches(told.value, words), told.value


def test_a_header_of_many_megabytes(tmp_path, spec):
    """Its lines would take a hundred times the memory."""
    path = write(tmp_path, TWO, BLOCK)
    with path.open("ab") as stream:
        stream.write(b"\n" * LARGEST_HEADER)
    with pytest.raises(BadInput) as told:
        read_log(path, spec, columns=COLUMNS)
    assert matches(told.value, f"FILE002 run.dat {LARGEST_HEADER}")


def test_its_numbers_are_sought_in_its_folder_alone(tmp_path, spec):
    (tmp_path / "run").mkdir()
    path = write(tmp_path / "run", [text.replace("C:", "..") for text in TWO], BLOCK)
    (tmp_path / "run" / "run.r64").rename(tmp_path / "run.r64")
    with pytest.raises(BadInput) as told:
        read_log(path, spec, columns=COLUMNS)
    assert matches(told.value, "FILE001 run.r64")
