"""Free runs that end at the noise settle what the low-passed force residual cannot show."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.acceptance import free_runs_settle
from codegen.diagnosis.fit.output_error import Fit
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, among, log_of, system_of


@pytest.mark.parametrize(
    ("level", "far", "share", "times", "settled"),
    [
        (1.2, 0, 0.999, 1.8, True),
        (1.2, 0, 0.93, 3.7, True),
        (1.2, 0, 0.98, 1000.0, False),  # a machine a thousand times too heavy goes on at the measured speed
        (1.2, 0, 0.5, 1.8, False),
        (5.0, 0, 0.999, 1.8, False),  # not at the noise
        (1.2, 10, 0.999, 1.8, False),  # a tenth of the segments is not
    ],
)
def test_free_runs_settle_at_the_noise(level: float, far: int, share: float, times: float, settled: bool) -> None:
    """Of 100 segments of 40 values, each with a sum of squares by its RMS in noise."""
    by_segment = np.full(100, 40 * level**2)
    by_segment[:far] = 40 * 20.0**2
    fit = SimpleNamespace(by_segment=by_segment, residual=np.zeros((100, 40)))
    assert free_runs_settle(cast(Fit, fit), share, times) is settled


def slowly_filtered(effects: str, reference: str) -> Spec:
    text = STAGE.format(effects=effects, level=4.0, reference=reference, duration=14, noise=1e-6)
    return parse_spec(text + "log: {cutoff_hz: 8}\n", Path("stage.yaml"))


FEW = ("stribeck", "viscous")


@pytest.mark.slow  # in make test it is the rule alone
@pytest.mark.parametrize("kinds", [(), FEW])
def test_a_stribeck_peak_that_the_filter_blurs_is_found(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    """The stage passes a peak of 0.01 m/s in 10 to 20 ms at each reversal, and the filter of the force residual lets 8
    Hz pass: with the true peak that residual is larger on the held-out log. The free runs are at the noise.
    """
    peak = "[{kind: stribeck, on: rail, parameters: {delta: 3, v_s: 0.01}}]"
    train, test = (
        log_of(slowly_filtered(peak, way), tmp_path, name) for name, way in (("train.csv", TRAIN), ("test.csv", TEST))
    )
    spec = slowly_filtered("[]", TRAIN)
    with among(*kinds):
        found, _ = diagnose_log(spec, system_of(spec), train, test)
    assert found.augmented.force_rms > found.refit.force_rms
    assert found.augmented.free_run_rmse < 0.5 * found.refit.free_run_rmse
    assert [e.kind for e in found.effects] == ["stribeck"], found.sentence
    assert found.effects[0].parameters == pytest.approx({"delta": 3.0, "v_s": 0.01}, rel=0.02)
    assert found.statement.of("evidence")[0].startswith("Simulation error on held-out data:")
