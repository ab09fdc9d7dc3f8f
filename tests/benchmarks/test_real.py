"""The measured sets: specs and descriptions that fit, files read as published, tables between markers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.real.page import MARKERS, SAID, page_of, row, table, words
from benchmarks.real.runs import kept
from benchmarks.real.sets import DATA, ROOT, SETS, SPECS, Diagnosed, spec_of
from benchmarks.real.steady import mean_errors
from benchmarks.text import replaced
from codegen.base.errors import BadInput
from codegen.logs import read_description, read_logs
from codegen.spec import read_spec
from tests.slow_cases import slow_except

RUNS = [(name, run) for name, runs in SETS.items() for run in runs]
IDS = [f"{name}/{run.name}" for name, run in RUNS]
FIRSTS = [(name, runs[0]) for name, runs in SETS.items()]
BEGIN, END = MARKERS
RUN = Diagnosed("one", "a → b", "s.yaml", ("a.csv",), ("b.csv",), "9 %")


def error(force: float, *free: float | None) -> dict[str, Any]:
    return {"relative_force_error": force, "free_run_position_rmse_by_coordinate": list(free)}


def found(**more: Any) -> dict[str, Any]:
    return {
        "verdict": "effect",
        "headline": "Missing effect: it.",
        "facts": [{"topic": "evidence", "words": "The log shows | it.\nSo it is.", "detail": "Much."}],
        "effects": [{"kind": "coupling", "on": ["q1", "q2"], "parameters": {"c": 1.23456}, "units": {"c": "N*m*s"}}],
        "error": {
            "declared": error(0.5, 0.1, 2.0),
            "refit": error(0.4, 0.2, None),
            "augmented": error(0.123456, 0.3, 1.0),
        },
        "data": {"coordinates": [{"unit": "rad"}, {"unit": "m"}]},
        **more,
    }


def left(folder: Path, diagnosis: dict[str, Any] | None, failure: str = "") -> Path:
    folder.mkdir(parents=True)
    (folder / "run.json").write_text(json.dumps({"wall_s": 3.0, "failure": failure}))
    if diagnosis is not None:
        (folder / "diagnosis.json").write_text(json.dumps(diagnosis))
    return folder


def test_a_row_says_verdict_and_errors_before_and_after(tmp_path: Path) -> None:
    assert row(RUN, left(tmp_path / "one", found())) == (
        "| a → b | `effect`: coupling on q1, q2: c = 1.23 N*m*s | 50 % / 40 % / 12.3 % "
        "| 0.1 / 0.2 / 0.3 rad<br>2 / diverges / 1 m | 9 % |\n"
    )


def test_a_row_names_the_first_parameters_and_a_restart_that_is_not_the_usual_one(tmp_path: Path) -> None:
    waves = {f"sin_{k}": float(k) for k in range(1, 31)}
    effect = {"kind": "cogging_harmonics", "on": "q", "parameters": waves, "units": {}}
    data = {"coordinates": [{"unit": "rad"}, {"unit": "m"}], "restart_s": 0.0625}
    said = row(RUN, left(tmp_path / "one", found(effects=[effect], data=data)))
    assert "sin_7 = 7, and 23 more |" in said and "1 m<br>every 0.0625 s |" in said


def test_a_row_of_steady_logs_has_the_errors_of_their_means(tmp_path: Path) -> None:
    folder = left(tmp_path / "one", found())
    (folder / "run.json").write_text(json.dumps({"wall_s": 3.0, "failure": "", "means": [1.2345e-4, 1e-4, 5e-5]}))
    assert "12.3 %<br>means of the logs: 0.123 / 0.1 / 0.05 mN·m |" in row(RUN, folder)


def test_a_row_of_a_refusal_has_its_words_and_one_that_was_not_run_says_so(tmp_path: Path) -> None:
    assert row(RUN, left(tmp_path / "one", None, "exit code 2: a | b")) == (
        "| a → b | no verdict: exit code 2: a \\| b | | | 9 % |\n"
    )
    assert row(RUN, tmp_path / "none") == "| a → b | not run | | | 9 % |\n"
    assert kept(tmp_path / "none") is None


def test_below_the_rows_stands_what_is_said_of_each(tmp_path: Path) -> None:
    said = "**Missing effect: it.**\n  - *evidence*: The log shows | it. So it is.\n"
    assert words(RUN, left(tmp_path / "one", found())) == f"- a → b: {said}"
    assert words(RUN, tmp_path / "none") == ""
    name, (first, *_) = next(iter(SETS.items()))
    assert SAID not in table(name, tmp_path / "nothing")
    left(tmp_path / name / first.name, found())
    assert table(name, tmp_path).endswith(f"\n\n{SAID}\n\n- {first.words}: {said}")


def test_the_table_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    page = f"# T\n{BEGIN}\nold\n{END}\nrest\n"
    assert replaced(page, "| new |\n", MARKERS, "p.md") == f"# T\n{BEGIN}\n| new |\n{END}\nrest\n"
    for bad in ("# T\n", f"{END}\n{BEGIN}\n", page + BEGIN):
        with pytest.raises(BadInput, match=r"p\.md"):
            replaced(bad, "", MARKERS, "p.md")


@pytest.mark.parametrize("name", SETS)
def test_each_set_has_its_page_with_a_row_for_each_run(name: str, tmp_path: Path) -> None:
    page = page_of(name).read_text(encoding="utf-8")
    replaced(page, table(name, tmp_path), MARKERS, page_of(name).name)
    inside = page.split(BEGIN)[1].split(END)[0]
    for run in SETS[name]:
        assert sum(line.startswith(f"| {run.words} |") for line in inside.splitlines()) == 1
    for file in {file for run in SETS[name] for file in (run.spec, run.about) if file}:
        assert (SPECS / name / file).resolve().relative_to(ROOT).as_posix() in page


@pytest.mark.parametrize(("name", "run"), RUNS, ids=IDS)
def test_the_spec_and_the_description_are_sound(name: str, run: Diagnosed) -> None:
    spec = read_spec(spec_of(name, run))
    if run.about:
        described = read_description(SPECS / name / run.about)
        assert described.columns
        symbols = {"t", *spec.positions, *spec.velocities, *(i.name for i in spec.inputs)}
        assert {*described.columns} <= symbols
        assert len((SPECS / name / run.about).read_text(encoding="utf-8").splitlines()) <= 10
    assert not {*run.train} & {*run.test}


@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is not here")
@pytest.mark.parametrize(("name", "run"), slow_except(RUNS, FIRSTS, several=True), ids=IDS)
def test_the_files_are_read_as_published(name: str, run: Diagnosed) -> None:
    spec = read_spec(spec_of(name, run))
    for files in filter(None, (run.train, run.test)):
        about = SPECS / name / run.about if run.about else None
        log = read_logs([DATA / name / file for file in files], spec, description=about)
        assert len(log.joints) == len(files) - 1 and log.used >= 200
        assert log.used * log.sample_time >= 3


@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is not here")
def test_the_means_of_steady_logs_are_those_that_the_set_s_readme_has(tmp_path: Path) -> None:
    """By the coefficients of an expert's fit to the training logs, 0.1343 mN·m are left on the test logs."""
    (run,) = (run for run in SETS["rvim_screw_drives"] if run.name == "drive_1")
    expert = {"b": 0.018e-3, "offset": 0.351e-3, "nut_a": 2.94e-3}
    values = {name: {"declared": 0.0, "refit": value, "augmented": 0.0} for name, value in expert.items()}
    left(tmp_path / "one", {"values": values, "effects": [], "data": {"cutoff_hz": 2.5}})
    declared, refit, augmented = mean_errors("rvim_screw_drives", run, tmp_path / "one")
    assert refit == augmented == pytest.approx(0.1343e-3, rel=0.05)
    assert declared != refit
