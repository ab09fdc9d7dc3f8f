"""Digital filters: Butterworth design, recursion, and filtering forward and backward with zero phase.

Designs and operations are those of ``scipy.signal``, with the same bits. Importing that package takes two thirds of a
second, since it documents its functions and imports ``scipy.stats``; so only its two compiled recursions are loaded.
"""

from __future__ import annotations

from functools import cache
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.arrays import Array

PRIVATE = "scipy.signal."


def lowpass(order: int, share: float) -> tuple[Array, Array]:
    """Butterworth low-pass of even order as numerator and denominator in z; ``share``: of the Nyquist frequency."""
    warped, poles, gain = _lowpass_prototype(order, share)
    return _digital(np.zeros(0), warped * poles, gain * warped**order)


def highpass(order: int, share: float) -> tuple[Array, Array]:
    """Butterworth high-pass of even order as numerator and denominator in z; ``share``: of the Nyquist frequency."""
    warped, poles, gain = _lowpass_prototype(order, share)
    return _digital(np.zeros(order), warped / poles, gain * np.real(1.0 / np.prod(-poles)))


def lowpass_sections(order: int, share: float) -> Array:
    """(order/2, 6) the Butterworth low-pass of even order as second-order sections, the one of most resonance last."""
    warped, poles, gain = _lowpass_prototype(order, share)
    zeros, poles, gain = _bilinear(np.zeros(0), warped * poles, gain * warped**order)
    poles = poles[np.lexsort((abs(poles.imag), poles.real))]
    pairs = (poles[poles.imag > 0] + poles[poles.imag < 0].conj()) / 2
    damped_first = pairs[np.argsort(np.abs(1 - np.abs(pairs)))[::-1]]
    sections = np.array([[*_polynomial(zeros[:2]), *_polynomial(np.array([p, p.conj()]))] for p in damped_first])
    sections[0, :3] *= gain
    return sections


def recursion(b: Array, a: Array, x: Array, start: Array | None = None, axis: int = 0) -> Array:
    """x filtered by b/a along an axis; ``start``: states of the transposed direct form II, by default zero."""
    if start is None:
        return np.asarray(_compiled("_sigtools")._linear_filter(b, a, x, axis))
    return np.asarray(_compiled("_sigtools")._linear_filter(b, a, x, axis, start)[0])


def forward_and_backward(b: Array, a: Array, x: Array, padding: int | None = None) -> Array:
    """x (N, …) filtered by b/a forward and backward along the first axis, its ends extended by odd reflection.

    Args:
        padding: samples of each extension, below N; by default three times the length of the filter.
    """
    states = _settled(b, a).reshape(-1, *[1] * (x.ndim - 1))

    def run(values: Array) -> Array:
        return recursion(b, a, values, states * values[:1])

    return _both_ways(run, x, 3 * max(len(a), len(b)) if padding is None else padding)


def sections_forward_and_backward(sections: Array, x: Array) -> Array:
    """x (N, c) filtered by second-order sections forward and backward, its ends extended by odd reflection."""
    states, scale = np.empty((len(sections), 2)), 1.0
    for k, section in enumerate(sections):
        states[k] = scale * _settled(section[:3], section[3:])
        scale *= section[:3].sum() / section[3:].sum()

    def run(values: Array) -> Array:
        filtered = np.array(values.T, dtype=float, order="C")  # changed in place
        _compiled("_sosfilt")._sosfilt(sections, filtered, states * values[0][:, None, None])
        return filtered.T

    return _both_ways(run, x, 3 * (2 * len(sections) + 1))


def _both_ways(run: Any, x: Array, padding: int) -> Array:
    """A filter applied forward and backward to x and its extensions, without these."""
    if padding >= len(x):
        raise ValueError(f"{len(x)} samples; expected more than the {padding} of each extension")
    ends = 2 * x[:1] - x[padding:0:-1], 2 * x[-1:] - x[-2 : -(padding + 2) : -1]
    extended = np.concatenate([ends[0], x, ends[1]]) if padding else x
    filtered = run(run(extended)[::-1])[::-1]
    return np.asarray(filtered[padding : len(filtered) - padding])


def _settled(b: Array, a: Array) -> Array:
    """The states of the transposed direct form II under a constant input of 1."""
    companion = np.diag(np.ones(len(a) - 2), -1)
    companion[0] = -a[1:] / (1.0 * a[0])
    return np.asarray(np.linalg.solve(np.eye(len(a) - 1) - companion.T, b[1:] - a[1:] * b[0]))


def _lowpass_prototype(order: int, share: float) -> tuple[float, Array, float]:
    """(analog cutoff for a bilinear transform at two samples a second, poles at cutoff 1, gain)."""
    exponents = np.arange(-order + 1, order, 2, dtype=float)
    return float(4.0 * np.tan(np.pi * np.float64(share) / 2.0)), -np.exp(1j * np.pi * exponents / (2 * order)), 1.0


def _digital(zeros: Array, poles: Array, gain: float) -> tuple[Array, Array]:
    """Numerator and denominator of the bilinear transform at two samples a second."""
    zeros, poles, gain = _bilinear(zeros, poles, gain)
    return np.multiply(gain, _polynomial(zeros)), _polynomial(poles)


def _bilinear(zeros: Array, poles: Array, gain: float) -> tuple[Array, Array, float]:
    digital = (4.0 + zeros) / (4.0 - zeros), (4.0 + poles) / (4.0 - poles)
    gain = gain * np.real(np.prod(4.0 - zeros) / np.prod(4.0 - poles))
    return np.concatenate([digital[0], -np.ones(len(poles) - len(zeros))]), digital[1], gain


def _polynomial(roots: Array) -> Array:
    """Coefficients of the monic polynomial with these roots, real or in conjugate pairs."""
    coefficients = np.ones(1, dtype=roots.dtype)
    for root in roots:
        coefficients = np.convolve(coefficients, np.array([1.0, -root]))
    return np.real(coefficients).copy()


@cache
def _compiled(name: str) -> Any:
    """A compiled module of ``scipy.signal`` without its package; through the package where it is no file there."""
    import scipy  # imported here, since lists of effects need no filter

    found = PathFinder.find_spec(PRIVATE + name, [str(Path(scipy.__file__).parent / "signal")])
    if found is None or found.loader is None:
        return __import__(PRIVATE + name, fromlist=[name])
    module = module_from_spec(found)
    found.loader.exec_module(module)
    return module
