"""What replaces functions of slow imports computes the same bits: splines, standstill, observer's response, spectra."""

import numpy as np
from scipy import signal
from scipy.interpolate import BSpline
from scipy.ndimage import binary_closing, binary_opening, maximum_filter1d

from codegen.diagnosis.evidence.residual_regression import DEGREE, _b_splines
from codegen.diagnosis.fit.residual import _dilated, _eroded
from codegen.diagnosis.verdict.replay import DAMPING, _bilinear_second_order
from codegen.report.series import _power_density

RNG = np.random.default_rng(11)


def test_b_splines():
    for knots in (4, 9, 20):
        z = np.round(RNG.normal(size=700), 2)
        inner = np.unique(np.quantile(z, np.linspace(0, 1, knots)))
        t = np.concatenate([[inner[0]] * DEGREE, inner, [inner[-1]] * DEGREE])
        assert np.array_equal(_b_splines(z, t), BSpline.design_matrix(z, t, DEGREE).toarray())


def test_openings_and_closings():
    for size in (2, 3, 8, 15):
        before, reach = size // 2, 3
        after = size - 1 - before
        for density in (0.1, 0.5, 0.9):
            flags = RNG.random(200) < density
            closed = _eroded(_dilated(flags, after, before), before, after)
            opened = _dilated(_eroded(flags, before, after), after, before)
            assert np.array_equal(closed, binary_closing(flags, np.ones(size)))
            assert np.array_equal(opened, binary_opening(flags, np.ones(size)))
            widest = maximum_filter1d(flags, 2 * reach + 1, mode="constant")
            assert np.array_equal(_dilated(flags, reach, reach), widest)


def test_second_order_response():
    for bandwidth, h in ((30.0, 1e-3), (126.0, 1e-3), (250.0, 2.5e-4)):
        system = ([bandwidth**2], [1.0, 2 * DAMPING * bandwidth, bandwidth**2])
        b, a, _ = signal.cont2discrete(system, h, method="bilinear")
        own = _bilinear_second_order(bandwidth, h)
        assert np.array_equal(own[0], b[0])
        assert np.array_equal(own[1], a)


def test_power_density():
    for length, count in ((64, 64), (64, 1000), (1024, 9000)):
        x = np.cumsum(RNG.normal(size=count))
        _, density = signal.welch(x, fs=1 / 0.00437, nperseg=length, detrend=False)
        assert np.array_equal(_power_density(x, length, 1 / 0.00437), density)
