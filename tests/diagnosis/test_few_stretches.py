"""A log with too few stretches in motion is refused with how long it rests, and the idle start to leave out."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.diagnosis.case import case_of
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.record import LEAST_SEGMENTS, record_of
from codegen.logs import Log, read_log
from codegen.logs.joined import join_logs
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage, system_of
from tests.expected_errors import refused

CLOCK_S = 12345.678
"""Time of the first sample of a log by a clock that started long before it."""


def sampled(folder: Path, log: Log, every: int, meta: str = "{}\n") -> Log:
    """Every so manieth row of a log, as a file with a description beside it."""
    rows = np.column_stack([log.time, log.positions, log.inputs])[::every]
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    (folder / "slow.csv").write_text("\n".join(["t,x,w", *lines]) + "\n", encoding="utf-8")
    (folder / "meta.yaml").write_text(meta, encoding="utf-8")
    return read_log(folder / "slow.csv", stage())


def refusal(log: Log) -> str:
    with pytest.raises(BadInput) as told:
        diagnose_log(stage(), system_of(stage()), log)
    assert told.value.code == "LOG009" and f"at least {LEAST_SEGMENTS}" in str(told.value)
    return str(told.value)


@pytest.mark.parametrize(("every", "duration"), [(25, 14.0), (20, 12.0), (10, 5.0)])
def test_a_tenth_of_the_sample_rate_is_the_highest_cutoff(tmp_path: Path, every: int, duration: float) -> None:
    """20 to 50 Hz: it makes the stretches too long for so short a log. A quarter of the rate was proposed, with which a
    log without an effect was called ambiguous.
    """
    words = refusal(sampled(tmp_path, log_of(stage(level=4.5, duration=duration), tmp_path, "log.csv"), every))
    assert f"sample faster than {500 / every:g} Hz" in words and "cutoff_hz" not in words
    (needed,) = re.findall(r"about (\d+) s of such motion", words)
    longer = log_of(stage(level=4.5, duration=float(needed)), tmp_path, "log.csv")
    case = case_of(stage(), system_of(stage()), sampled(tmp_path, longer, every), None, 0.02)
    assert len(record_of(case.problem.motion, case.log).start) >= LEAST_SEGMENTS


def test_an_idle_start_that_hides_enough_motion_is_named_with_the_line_that_leaves_it_out(tmp_path: Path) -> None:
    """It rests until 12 of 20 s, so the training part, the first 14 s, has 2 s of motion. Its clock started before."""
    late = "0.5*(1 + tanh(40*(t - 12)))*0.2*sin(2*pi*0.8*(t - 12))"
    log = log_of(stage(level=4.5, reference=late, duration=20.0), tmp_path, "log.csv")
    log = replace(log, time=log.time + CLOCK_S)
    words = refusal(sampled(tmp_path, log, 1, "cutoff_hz: 5\n"))
    (until,) = re.findall(r"rests until ([\d.]+) s", words)
    (line,) = re.findall(r"`(evaluation: {from_s: [\d.]+})`", words)
    assert float(until) - CLOCK_S == pytest.approx(12.0, abs=0.2) and "sample faster" not in words
    case = case_of(stage(), system_of(stage()), sampled(tmp_path, log, 1, f"cutoff_hz: 5\n{line}\n"), None, 0.02)
    assert len(record_of(case.problem.motion, case.log).start) >= LEAST_SEGMENTS
    assert case.log.time[0] == pytest.approx(float(until) - 1.0, abs=0.01)
    test = log_of(stage(level=4.5, reference=late, duration=20.0), tmp_path, "log.csv")
    beside = case_of(
        stage(), system_of(stage()), *(sampled(tmp_path, one, 1, f"{line}\n") for one in (log, test)), 0.02
    )
    assert beside.test_log is not None and beside.test_log.time[0] == test.time[0]  # held-out data are used whole
    with refused("LOG013 99999.5 12365.676"):
        case_of(stage(), system_of(stage()), sampled(tmp_path, log, 1, "evaluation: {from_s: 99999.5}\n"), None, 0.02)


def test_of_several_logs_none_is_cut_and_a_warning_says_so(tmp_path: Path) -> None:
    log = sampled(tmp_path, log_of(stage(level=4.5), tmp_path, "log.csv"), 1, "evaluation: {from_s: 3}\n")
    case = case_of(stage(), system_of(stage()), join_logs([lambda _: log] * 2), None, 0.02)
    assert case.log.time[0] == 0 and any("from_s: 3" in words for words in case.findings_in_words["train"])


def test_the_duration_counts_the_samples_of_the_shortest_stretch(tmp_path: Path) -> None:
    """At 50 Hz twelve samples are 0.24 s, more than two periods of a stated cutoff of 14 Hz."""
    stated = "cutoff_hz: 14\n"
    words = refusal(sampled(tmp_path, log_of(stage(level=4.5, duration=4.1), tmp_path, "log.csv"), 10, stated))
    (needed,) = re.findall(r"about (\d+) s of such motion", words)
    longer = log_of(stage(level=4.5, duration=float(needed)), tmp_path, "log.csv")
    case = case_of(stage(), system_of(stage()), sampled(tmp_path, longer, 10, stated), None, 0.02)
    assert len(record_of(case.problem.motion, case.log).start) >= LEAST_SEGMENTS


def test_the_duration_counts_what_gaps_take(tmp_path: Path) -> None:
    """A log of 18 s with two gaps and 8 stretches was told to record 20 s."""

    def with_gaps(duration: float) -> Log:
        log = sampled(tmp_path, log_of(stage(level=4.5, duration=duration), tmp_path, "log.csv"), 25, "cutoff_hz: 2\n")
        kept = np.mod(log.time, 4.0) > 0.5
        return sampled(
            tmp_path,
            replace(log, time=log.time[kept], positions=log.positions[kept], inputs=log.inputs[kept]),
            1,
            "cutoff_hz: 2\n",
        )

    (needed,) = re.findall(r"about (\d+) s of such motion", refusal(with_gaps(18.0)))
    case = case_of(stage(), system_of(stage()), with_gaps(float(needed)), None, 0.02)
    assert len(record_of(case.problem.motion, case.log).start) >= LEAST_SEGMENTS


def test_a_log_that_mostly_rests_is_told_so(tmp_path: Path) -> None:
    """It moves in 1 of 12 s; without its start it would have too little motion too."""
    once = "0.1*(1 + tanh(8*(t - 6)))"
    words = refusal(sampled(tmp_path, log_of(stage(level=4.5, reference=once, duration=12.0), tmp_path, "log.csv"), 20))
    (share,) = re.findall(r"x rests in (\d+)% of the time", words)
    assert 85 <= int(share) <= 99 and "without pauses" in words and "from_s" not in words


def test_a_log_that_hardly_leaves_standstill_is_refused(tmp_path: Path) -> None:
    """Two masses that stick but for short jumps: free runs have segments, the force residual has no sample. It ended
    in a ValueError.
    """
    text = Path("specs/two_mass.yaml").read_text(encoding="utf-8")
    weak = "effects: [{kind: saturation, on: w, parameters: {limit: 28}}]"
    log = log_of(parse_spec(text.replace("effects: []", weak), Path("two_mass.yaml")), tmp_path, "log.csv")
    spec = parse_spec(text, Path("two_mass.yaml"))
    with pytest.raises(BadInput, match="no motion long enough away from standstill") as told:
        diagnose_log(spec, system_of(spec), log)
    assert told.value.code == "LOG009"
