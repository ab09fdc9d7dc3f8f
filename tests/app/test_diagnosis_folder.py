"""The folder of a diagnosis: replaced by the same log; not by another one, nor where edited, unless told so."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from codegen.app.diagnosis_folder import log_sha256
from tests.slow_cases import slow_except

from .command import SPECS, Result, is_one_message, stiction

SPEC = """name: slider
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: rail, a: 3, unit: N}]}
"""


def log(path: Path, amplitude: float = 0.1) -> None:
    """A log without a force, which is unfit and so takes no fits."""
    t = np.arange(4000) / 500
    table = np.column_stack([t, amplitude * np.sin(3 * t), 0 * t])
    path.parent.mkdir(exist_ok=True)
    np.savetxt(path, table, delimiter=",", header="t,x,w", comments="", fmt="%.9g")


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory, unrendered: None) -> Path:
    """A spec, two logs of one name, and the diagnosis of the first: for ``folder`` alone, which copies it."""
    made = tmp_path_factory.mktemp("diagnosed")
    with pytest.MonkeyPatch.context() as there:
        there.chdir(made)
        Path("s.yaml").write_text(SPEC)
        log(Path("run.csv"))
        log(Path("other/run.csv"), 0.2)
        assert stiction("diagnose", "s.yaml", "run.csv").code == 3
    return made


@pytest.fixture
def folder(diagnosed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of what was diagnosed, each test's own, as the working directory."""
    shutil.copytree(diagnosed, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def is_refused(result: Result) -> bool:
    return is_one_message(result) and "[FILE004]" in result.err and "run_diagnosis" in result.err


def test_another_log_of_the_same_name_does_not_replace_a_diagnosis(folder: Path) -> None:
    """After two minutes of work, the results of the first log were gone."""
    before = contents(folder)
    result = stiction("diagnose", "s.yaml", "other/run.csv")
    assert is_refused(result) and "another log, run.csv" in result.err
    assert "-o DIR" in result.err and "--force" in result.err
    assert contents(folder) == before
    log(Path("run.csv"), 0.3)  # other data under the same path
    assert is_refused(stiction("diagnose", "s.yaml", "run.csv"))
    assert is_refused(stiction("diagnose", "s.yaml", "other/run.csv", "-o", "run_diagnosis"))  # named, but not empty
    for ways in (("-o", "second"), ("-o", "run_diagnosis", "--force")):
        assert stiction("diagnose", "s.yaml", "other/run.csv", *ways).code == 3
    told = [json.loads((folder / d / "diagnosis.json").read_text()) for d in ("second", "run_diagnosis")]
    assert told[0] == told[1]
    assert told[0]["log_sha256"] == [hashlib.sha256(Path("other/run.csv").read_bytes()).hexdigest()]


def test_the_same_log_replaces_its_diagnosis_from_anywhere(folder: Path) -> None:
    Path("run_diagnosis/spec.yaml").unlink()
    Path("run_diagnosis/notes.txt").write_text("mine\n")
    Path("copy").mkdir()
    Path("copy/run.csv").write_bytes(Path("run.csv").read_bytes())
    for name in ("run.csv", "copy/run.csv"):
        assert stiction("diagnose", "s.yaml", name).code == 3
        assert stiction("diagnose", "s.yaml", name, "-o", "run_diagnosis").code == 3
    assert Path("run_diagnosis/spec.yaml").read_text() == SPEC
    assert Path("run_diagnosis/notes.txt").read_text() == "mine\n"


@pytest.mark.parametrize("ways", slow_except([(), ("-o", "run_diagnosis")], [()]))
def test_an_edited_spec_is_not_replaced_unasked(folder: Path, ways: tuple[str, ...]) -> None:
    """The user's notes and values in it were gone, with exit code 3 of the unfit log alone, or 0."""
    written = Path("run_diagnosis/spec.yaml")
    written.write_bytes(SPEC.replace("\n", "\r\n").encode())  # by a version control system: no edit
    assert stiction("diagnose", "s.yaml", "run.csv", *ways).code == 3
    written.write_text(f"# my notes\n{SPEC}")
    before = contents(folder)
    result = stiction("diagnose", "s.yaml", "run.csv", *ways)
    assert is_one_message(result) and all(word in result.err for word in ("[FILE008]", "spec.yaml, edited", "--force"))
    assert contents(folder) == before
    assert stiction("diagnose", "s.yaml", "run.csv", *ways, "--force").code == 3
    assert written.read_text() == SPEC


def test_a_diagnosis_that_names_no_log_is_not_replaced_unasked(folder: Path) -> None:
    """An older version wrote none."""
    file = Path("run_diagnosis/diagnosis.json")
    content = json.loads(file.read_text())
    del content["log_sha256"]
    file.write_text(json.dumps(content))
    assert is_refused(stiction("diagnose", "s.yaml", "run.csv"))
    assert stiction("diagnose", "s.yaml", "run.csv", "--force").code == 3


def test_a_diagnosis_of_a_version_that_kept_no_list_is_replaced_by_force(folder: Path) -> None:
    """--force was refused as well, with words that did not say how to go on.

    Each version wrote spec.yaml and report.html; excitation.csv for some logs only, so that one may be the user's.
    """
    file = Path("run_diagnosis/diagnosis.json")
    content = json.loads(file.read_text())
    del content["files_sha256"]
    file.write_text(json.dumps(content))
    Path("run_diagnosis/report.html").write_text("<p>of an earlier version</p>")
    Path("run_diagnosis/excitation.csv").write_text("mine\n")
    before = contents(folder)
    for ways in ((), ("--force",)):
        result = stiction("diagnose", "s.yaml", "run.csv", *ways)
        assert is_refused(result) and "excitation.csv" in result.err and "--force" not in result.err
        assert ("report.html" in result.err) == (not ways) and contents(folder) == before
    Path("run_diagnosis/excitation.csv").rename("mine.csv")
    result = stiction("diagnose", "s.yaml", "run.csv")
    assert is_refused(result) and "report.html" in result.err and "--force" in result.err
    assert stiction("diagnose", "s.yaml", "run.csv", "--force").code == 3
    assert "files_sha256" in json.loads(file.read_text())
    assert "earlier version" not in Path("run_diagnosis/report.html").read_text()


@pytest.mark.parametrize("name", ["report.html", "excitation.csv", "spec.yaml", "diagnosis.json"])
def test_what_stiction_did_not_write_is_not_replaced(folder: Path, name: str) -> None:
    Path("mine_diagnosis").mkdir()
    Path(f"mine_diagnosis/{name}").write_text("[1]\n")
    Path("run.csv").rename("mine.csv")
    for ways in ((), ("--force",), ("-o", "mine_diagnosis")):
        result = stiction("diagnose", "s.yaml", "mine.csv", *ways)
        assert is_one_message(result) and "[FILE004]" in result.err and name in result.err
        assert contents(Path("mine_diagnosis")) == {name: b"[1]\n"}


def test_a_user_s_file_beside_an_earlier_diagnosis_is_not_replaced(folder: Path) -> None:
    """After the first run, every file with a name of ours counted as ours: the motion that a user had planned was gone.

    This log gives no excitation.csv, so the one that lies there is the user's.
    """
    Path("run_diagnosis/excitation.csv").write_text("t,x\n0,1\n")
    before = contents(folder)
    for ways in ((), ("--force",), ("-o", "run_diagnosis", "--force")):
        result = stiction("diagnose", "s.yaml", "run.csv", *ways)
        assert is_refused(result) and "excitation.csv, which no diagnosis.json lists" in result.err
        assert contents(folder) == before


def test_a_user_s_own_report_is_not_replaced_unasked(folder: Path) -> None:
    Path("run_diagnosis/report.html").write_text("<p>my own report</p>\n")
    before = contents(folder)
    result = stiction("diagnose", "s.yaml", "run.csv")
    assert is_one_message(result) and all(
        word in result.err for word in ("[FILE008]", "report.html, edited", "--force")
    )
    assert contents(folder) == before
    assert stiction("diagnose", "s.yaml", "run.csv", "--force").code == 3
    assert "my own report" not in Path("run_diagnosis/report.html").read_text("utf-8")


def test_an_excitation_of_an_earlier_diagnosis_does_not_stay_beside_the_next(folder: Path) -> None:
    """Its candidates are no longer those of the diagnosis beside it."""
    excitation, result = Path("run_diagnosis/excitation.csv"), Path("run_diagnosis/diagnosis.json")
    excitation.write_text("t,x_reference\n0,1\n")
    content = json.loads(result.read_text("utf-8"))
    content["files_sha256"]["excitation.csv"] = hashlib.sha256(excitation.read_bytes()).hexdigest()
    result.write_text(json.dumps(content), "utf-8")
    assert stiction("diagnose", "s.yaml", "run.csv").code == 3
    assert not excitation.exists()


def test_another_robot_file_by_the_name_of_the_spec_s_is_not_replaced(folder: Path) -> None:
    """The augmented spec names the robot file, so that lies beside it."""
    for name in ("seven_joint_arm.yaml", "seven_joint_arm.urdf"):
        Path(name).write_bytes((SPECS / name).read_bytes())
    Path("mine").mkdir()
    Path("mine/seven_joint_arm.urdf").write_text("<!-- mine -->\n")
    result = stiction("diagnose", "seven_joint_arm.yaml", "run.csv", "-o", "mine")
    assert is_one_message(result) and "seven_joint_arm.urdf, which no diagnosis.json lists" in result.err
    assert contents(Path("mine")) == {"seven_joint_arm.urdf": b"<!-- mine -->\n"}


def test_a_folder_of_signals_is_known_by_the_names_and_bytes_of_its_files(tmp_path: Path) -> None:
    for name in ("b", "a"):
        (tmp_path / f"{name}.csv").write_text(name)
    first = log_sha256(tmp_path)
    listed = "".join(f"{n}.csv {hashlib.sha256(n.encode()).hexdigest()}\n" for n in "ab")
    assert first == hashlib.sha256(listed.encode()).hexdigest()
    (tmp_path / "a.csv").rename(tmp_path / "c.csv")
    assert log_sha256(tmp_path) != first


def test_an_envelope_without_a_needed_range_costs_the_code_but_not_the_diagnosis(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """M depends on x, whose range the certificate needs: SPEC026 came after all fits, and nothing was written."""
    monkeypatch.chdir(tmp_path)
    text = SPEC.replace("[[m]]", "[[m*(2 + sin(x/L))]]").replace("kg}", "kg}, L: {value: 1, unit: m}")
    text += "observer: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 50}, sample_time: 2 ms}\n"
    Path("s.yaml").write_text(text + "envelope: {v: [-1, 1]}\n")
    log(Path("run.csv"))
    done = stiction("diagnose", "s.yaml", "run.csv")
    assert done.code == 3 and "verdict: unfit" in done.out, done.err
    change = json.loads(Path("run_diagnosis/diagnosis.json").read_text("utf-8"))["certificate"]
    assert all("no range for x" in change[when] for when in ("before", "after"))
    assert not Path("run_diagnosis/generated").exists() and "no range for x" in done.out
