"""Effects that are one motion on the training log and two on the held-out one: held-out data refuse the wrong one."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import Diagnosis
from codegen.diagnosis.signals import TRIM_S
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TRAIN, among, log_of, system_of

QUICK = "0.1*sin(2*pi*0.9*t) + 0.05*sin(2*pi*2.3*t)"
TRUTHS = {
    "dead_zone": "[{kind: dead_zone, on: w, parameters: {width: 1.5}}]",
    "offset": "[{kind: offset, on: x, parameters: {f0: -1.5}}]",
}


def hanging(effects: str, reference: str, duration: float) -> Spec:
    """The stage with a weight of 20 N, which the drive holds: in slow motion the input does not change its sign."""
    text = STAGE.format(effects=effects, level=4, reference=reference, duration=duration, noise=0)
    text = text.replace("  b: {value", "  c: {value: 20, unit: N}\n  b: {value").replace("w - b*v", "w - b*v - c")
    return parse_spec(text.replace("2e-6", "2e-5"), Path("stage.yaml"))


def told(truth: str, held_out: str, folder: Path) -> Diagnosis:
    effects = TRUTHS[truth]
    train = log_of(hanging(effects, TRAIN, 14.0), folder, "train.csv")
    test = log_of(hanging(effects, held_out, 8.0), folder, "test.csv")
    after = round(TRIM_S / train.sample_time)  # the weight falls at first: the drive starts without force
    assert train.inputs[after:].min() > 1.5
    assert (test.inputs[after:].min() > 1.5) == (held_out == TRAIN)
    spec = hanging("[]", TRAIN, 14.0)
    with among("dead_zone", "offset", "coulomb_asymmetry", "viscous"):
        return diagnose_log(spec, system_of(spec), train, test)[0]


@pytest.mark.parametrize(("truth", "other"), [("dead_zone", "offset on x"), ("offset", "dead_zone on w")])
def test_held_out_data_refuse_what_is_another_motion_there(truth: str, other: str, tmp_path: Path) -> None:
    found = told(truth, QUICK, tmp_path)
    assert found.verdict == "effect", found.sentence
    assert {"offset" if e.kind == "coulomb_asymmetry" else e.kind for e in found.effects} == {truth}
    assert any(other in words and "ties with" in words and "refused" in words for words in found.remarks)


def test_what_is_one_motion_on_both_logs_stays_ambiguous(tmp_path: Path) -> None:
    found = told("dead_zone", TRAIN, tmp_path)
    assert found.verdict == "ambiguous"
    assert not any("ties with" in words for words in found.remarks)
