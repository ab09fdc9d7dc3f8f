"""Damaged files of each family, each a result or one clear error; `make check-all` has more, `make fuzz` an hour."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.slow_cases import slow_except

from . import proof_cases
from .broken_cases import CALLS
from .campaign import Campaign, campaign, families, table
from .corpus_cases import folders

COUNTS = {"spec": 25, "log": 40, "library": 20, "robot": 10, "proof": 10}
TIMES = [(0, 1), (1, 4)]
"""First case and number of cases, in multiples of the count; the second in `make check-all`."""


@pytest.mark.parametrize(("first", "times"), slow_except(TIMES, TIMES[:1], several=True))
@pytest.mark.parametrize("family", COUNTS)
def test_damaged_files_give_a_result_or_one_clear_error(family: str, first: int, times: int) -> None:
    _skip_without_libraries(family)
    count = times * COUNTS[family]
    found = campaign(family, first * COUNTS[family], count)
    assert found.failures == [], table([found])
    assert found.cases == count
    assert min(found.of("result"), found.of("error")) > count / 20 or family == "proof"


def test_a_campaign_notices_every_way_to_fail_and_keeps_what_is_needed_to_see_it_again(tmp_path: Path) -> None:
    found = campaign("broken", 0, len(CALLS), keep=tmp_path)
    assert found.cases == len(CALLS)
    failures = {told.seed: told.verdict.kind for told in found.failures}
    wanted = {k: kind for k, (_, kind) in enumerate(CALLS.values()) if kind not in ("result", "error")}
    assert failures == wanted
    assert (found.of("result"), found.of("error")) == (3, 1)
    assert len(list(tmp_path.rglob("what.txt"))) == len(wanted)
    (words,) = (tmp_path / "broken").glob("exception-*/3/what.txt")
    assert words.read_text().splitlines()[:3] == ["broken 3", "call", "exception"]
    assert (words.parent / "s.yaml").read_bytes() == b"name: x\n"
    assert "1 broken exception: ZeroDivisionError outside (stage call; seeds 3)" in table([found])


@pytest.mark.parametrize("family", COUNTS)
def test_cases_are_the_same_again(family: str) -> None:
    _skip_without_libraries(family)
    make = families()[family]
    for seed in range(20):
        assert make(seed).files == make(seed).files


def test_faults_that_were_found_stay_mended() -> None:
    found = campaign("corpus", 0, len(folders()))
    assert found.failures == [], "\n".join([table([found]), *(str(folders()[told.seed]) for told in found.failures)])
    assert found.cases == len(folders())
    assert {path.parent.name for path in folders()} == {"spec", "log", "robot", "proof"}


def _skip_without_libraries(family: str) -> None:
    for module in ("mcap_ros2", "pyarrow", "h5py") if family == "library" else ():
        pytest.importorskip(module, reason="needs the test tools of pyproject.toml")


def test_both_files_about_the_c_are_damaged_one_at_a_time_beside_the_c() -> None:
    """A damaged ellipsoid.json was taken for a certificate, and one in 75 cases of proofs could not be made."""
    damaged = set()
    for seed in range(300):
        files = proof_cases.proof(seed).files
        if "ellipsoid.json" in files:
            (name,) = {path.stem for path in map(Path, files) if path.suffix == ".c"} or {""}
            genuine = {file: (proof_cases.GENERATED / name / file).read_bytes() for file in files if name}
            about_c = [file for file in genuine if file in proof_cases.KERNEL or file.endswith((".c", ".h"))]
            damaged |= {tuple(file for file in about_c if genuine[file] != files[file])}
    assert {("proof.json",), ("ellipsoid.json",)} <= damaged
    assert all(len(those) <= 1 for those in damaged)


def test_a_table_counts() -> None:
    one = Campaign("spec")
    one.counts.update({("check", "result"): 2, ("derive", "result"): 1, ("check", "error"): 4})
    assert table([one]).splitlines()[1].split() == ["spec", "7", "3", "4", "0", "check", "6,", "derive", "1"]
