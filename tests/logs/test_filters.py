"""The filters have the bits of ``scipy.signal``; a diagnosis imports neither that package nor what it needs."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import signal

from codegen.base import filters

SHARES = (0.0007, 0.004, 0.02, 0.1, 0.37, 0.8, 0.95)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("order", [2, 4, 6])
def test_designs(order, share):
    for own, other in (
        (filters.lowpass(order, share), signal.butter(order, share)),
        (filters.highpass(order, share), signal.butter(order, share, "high")),
    ):
        assert np.array_equal(own[0], other[0])
        assert np.array_equal(own[1], other[1])
    assert np.array_equal(filters.lowpass_sections(order, share), signal.butter(order, share, output="sos"))


@pytest.mark.parametrize("share", [0.02, 0.2])
@pytest.mark.parametrize("columns", [1, 3])
def test_both_ways(columns, share):
    x = np.cumsum(np.random.default_rng(3).normal(size=(2000, columns)), axis=0)
    b, a = filters.lowpass(4, share)
    sections = filters.lowpass_sections(4, share)
    assert np.array_equal(filters.forward_and_backward(b, a, x), signal.filtfilt(b, a, x, axis=0))
    assert np.array_equal(filters.forward_and_backward(b, a, x, 120), signal.filtfilt(b, a, x, axis=0, padlen=120))
    assert np.array_equal(filters.forward_and_backward(b, a, x, 0), signal.filtfilt(b, a, x, axis=0, padlen=0))
    assert np.array_equal(filters.sections_forward_and_backward(sections, x), signal.sosfiltfilt(sections, x, axis=0))


def test_recursion():
    x = np.random.default_rng(4).normal(size=500)
    b, a = filters.lowpass(4, 0.1)
    assert np.array_equal(filters.recursion(b, a, x), signal.lfilter(b, a, x))
    start = signal.lfilter_zi(b, a)
    assert np.array_equal(filters.recursion(b, a, x, start), signal.lfilter(b, a, x, zi=start)[0])


def test_without_the_compiled_file_the_package_is_used(monkeypatch):
    monkeypatch.setattr(filters.PathFinder, "find_spec", lambda *_: None)
    filters._compiled.cache_clear()
    try:
        x = np.random.default_rng(5).normal(size=50)
        assert np.array_equal(filters.recursion(*filters.lowpass(2, 0.1), x), signal.lfilter(*signal.butter(2, 0.1), x))
    finally:
        filters._compiled.cache_clear()


def test_too_short():
    with pytest.raises(ValueError, match="more than the 15 of each extension"):
        filters.forward_and_backward(*filters.lowpass(4, 0.1), np.zeros((15, 1)))


def test_imports_of_a_diagnosis():
    code = "import sys, codegen.app.diagnose, codegen.report.page; print(*sorted(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "codegen.diagnosis.diagnose" in loaded
    for package in ("signal", "stats", "ndimage", "interpolate", "integrate"):
        assert f"scipy.{package}" not in loaded
