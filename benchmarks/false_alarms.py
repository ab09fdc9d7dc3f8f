"""How often the force residual credits one of 20 effects that are not there. `python -m benchmarks.false_alarms`.

A residual of n independent values, or one with a slow part, is fitted with 20 candidates by linear least squares along
one motion: 14 of one parameter, 3 of two, two periodic ones with an unknown period and one with an unknown width. A
candidate passes as in ``ranking.combined_p``: it removes 5 % of the squares, and p times 20 over its share of α is at
most α. Left out are the t test where there is most to explain, free runs, and the later checks of a diagnosis.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.signal import lfilter

from codegen.base.arrays import Array
from codegen.diagnosis.credit import ALPHA, LEAST_SHARE, SIGNED, t_of_mean
from codegen.diagnosis.force_evidence import ForceGain, independent
from codegen.diagnosis.ranking import FORCE_SHARE, FORCE_SHARE_OF_FEW

Candidate = tuple[int, list[Array]]
RESIDUALS = ("white", "neighbours' correlation 0.6", "white and a slow force")
LOGS = ((250, FORCE_SHARE_OF_FEW), (600, FORCE_SHARE), (2000, FORCE_SHARE))
BEGIN = 2000


def candidates(n: int) -> tuple[Array, list[Candidate]]:
    """Orthonormal columns of the friction levels, and per candidate its parameters and columns for each trial value."""
    t = np.arange(n)
    x = np.sin(2 * np.pi * 3.3 * t / n) + 0.4 * np.sin(2 * np.pi * 7.7 * t / n + 0.5) + 0.2 * t / n
    v = np.gradient(x)
    a, s, top = np.gradient(v), np.sign(v), np.abs(v).max()
    one = [x, x**3, a, s * v**2, np.ones(n), t / n, s * np.sqrt(np.abs(v)), np.abs(v), s * np.abs(x), a * np.abs(a)]
    one += [x * v, s * np.abs(a), np.sin(3 * x), v**3]
    waves = [
        np.column_stack([f(2 * np.pi * x * k / np.ptp(x)) for f in (np.cos, np.sin)]) for k in np.linspace(1, 40, 160)
    ]
    found: list[Candidate] = [(1, [c[:, None]]) for c in one]
    found += [(2, [np.column_stack(pair)]) for pair in ((x, x**2), (a, a * s), (t / n, s * t / n))]
    found += [(3, waves), (3, [s[:, None] * wave for wave in waves])]
    found.append((2, [(s * np.maximum(np.abs(v) - w * top, 0))[:, None] for w in np.linspace(0.02, 0.95, 40)]))
    levels = np.linalg.qr(np.column_stack([s, v]))[0]
    return levels, [(k, [np.linalg.qr(c - levels @ (levels.T @ c))[0] for c in some]) for k, some in found]


def residual(kind: str, n: int, draw: np.random.Generator) -> Array:
    """(n,) one of ``RESIDUALS``; a slow force has a quarter of the noise's power and a correlation over 33 values."""
    noise = draw.normal(size=n + BEGIN)
    if kind == RESIDUALS[1]:
        noise = lfilter([1], [1, -0.6], noise)
    slow = lfilter([1], [1, -0.97], draw.normal(size=n + BEGIN))[BEGIN:]
    return noise[BEGIN:] + (0.5 * slow / np.std(slow) if kind == RESIDUALS[2] else 0.0)


def passes(r: Array, candidate: Candidate, share: float, count: int) -> bool:
    """Whether a candidate is credited by the residual (n,) that is left without it."""
    k, some = candidate
    columns = max(some, key=lambda c: float(np.sum((c.T @ r) ** 2)))
    force = columns @ (columns.T @ r)
    left = float(np.sum((r - force) ** 2) / np.sum(r**2))
    nats = -0.5 * independent(r - force) * len(r) * float(np.log(left))
    score = t_of_mean(np.array([part.sum() for part in np.array_split(r * force, SIGNED)]))
    p = ForceGain(left, nats, 0.0, 1.0, score).p_added(k)
    return left <= 1 - LEAST_SHARE and count * p / share <= ALPHA


def main() -> None:
    """Print a line for each kind of residual and length of log."""
    parser = argparse.ArgumentParser(description="False alarms of the force residual, in per cent of logs.")
    parser.add_argument("--runs", type=int, default=800)
    runs = parser.parse_args().runs
    for kind in RESIDUALS:
        for n, share in LOGS:
            draw, (levels, tried) = np.random.default_rng(7), candidates(n)
            alarms = 0
            for _ in range(runs):
                r = residual(kind, n, draw)
                r = r - levels @ (levels.T @ r)
                alarms += any(passes(r, one, share, len(tried)) for one in tried)
            print(f"{kind}, {n} values: {100 * alarms / runs:.2f} % of logs; {100 * ALPHA * share:.2g} % is allowed")


if __name__ == "__main__":
    main()
