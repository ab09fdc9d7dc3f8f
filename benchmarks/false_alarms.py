"""How often the force residual accepts one of 20 effects, none there or one. `python -m benchmarks.false_alarms`.

A residual of n independent values, or one with a slow part, is fitted with 20 candidates by linear least squares along
one motion: 14 of one parameter, 3 of two, two periodic ones with an unknown period and one with an unknown width. A
candidate passes as in ``significance.combined_p``: it removes 5 % of the squares, and p times 20, for a periodic one
times 40 periods, over its share of α is at most α. Left out are the t test where there is most to explain, free runs,
and the later checks of a diagnosis. For the power, one of five forces is added that makes up a fifth of all squares.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.signal import lfilter

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.force_gain import ForceGain, slow_noise_likelihood, t_of_scores
from codegen.diagnosis.fit.acceptance import ALPHA, LEAST_SHARE, SIGN_BLOCKS
from codegen.diagnosis.selection.significance import FORCE_SHARE, FORCE_SHARE_OF_FEW

Candidate = tuple[int, float, list[Array]]
RESIDUALS = ("white", "neighbours' correlation 0.6", "white and a slow force")
LOGS = ((250, FORCE_SHARE_OF_FEW), (600, FORCE_SHARE), (2000, FORCE_SHARE))
BEGIN = 2000
PERIODS, WIDTHS = np.linspace(1, 40, 160), np.linspace(0.02, 0.95, 40)
FORCES = {"spring": (0, 0), "mass": (2, 0), "offset": (4, 0), "drift": (5, 0), "wave": (17, 60)}
"""Index of the candidate and of its trial value."""
ADDED = 0.2


def candidates(n: int) -> tuple[Array, list[Candidate]]:
    """Orthonormal columns of the friction levels; per candidate parameters, periods, and columns for trial values."""
    t = np.arange(n)
    x = np.sin(2 * np.pi * 3.3 * t / n) + 0.4 * np.sin(2 * np.pi * 7.7 * t / n + 0.5) + 0.2 * t / n
    v = np.gradient(x)
    a, s, top = np.gradient(v), np.sign(v), np.abs(v).max()
    one = [x, x**3, a, s * v**2, np.ones(n), t / n, s * np.sqrt(np.abs(v)), np.abs(v), s * np.abs(x), a * np.abs(a)]
    one += [x * v, s * np.abs(a), np.sin(3 * x), v**3]
    waves = [np.column_stack([f(2 * np.pi * x * k / np.ptp(x)) for f in (np.cos, np.sin)]) for k in PERIODS]
    found: list[Candidate] = [(1, 1, [c[:, None]]) for c in one]
    found += [(2, 1, [np.column_stack(pair)]) for pair in ((x, x**2), (a, a * s), (t / n, s * t / n))]
    found += [(3, PERIODS[-1], waves), (3, PERIODS[-1], [s[:, None] * wave for wave in waves])]
    found.append((2, 1, [(s * np.maximum(np.abs(v) - w * top, 0))[:, None] for w in WIDTHS]))
    levels = np.linalg.qr(np.column_stack([s, v]))[0]
    return levels, [(k, m, [np.linalg.qr(c - levels @ (levels.T @ c))[0] for c in some]) for k, m, some in found]


def residual(kind: str, n: int, draw: np.random.Generator) -> Array:
    """(n,) one of ``RESIDUALS``; a slow force has a quarter of the noise's power and a correlation over 33 values."""
    noise = draw.normal(size=n + BEGIN)
    if kind == RESIDUALS[1]:
        noise = lfilter([1], [1, -0.6], noise)
    slow = lfilter([1], [1, -0.97], draw.normal(size=n + BEGIN))[BEGIN:]
    return noise[BEGIN:] + (0.5 * slow / np.std(slow) if kind == RESIDUALS[2] else 0.0)


def passes(r: Array, candidate: Candidate, share: float, count: int) -> bool:
    """Whether a candidate is accepted by the residual (n,) that is left without it."""
    k, periods, some = candidate
    columns = max(some, key=lambda c: float(np.sum((c.T @ r) ** 2)))
    force = columns @ (columns.T @ r)
    left = float(np.sum((r - force) ** 2) / np.sum(r**2))
    nats = slow_noise_likelihood(r - force, 1.0) - slow_noise_likelihood(r, 1.0)
    scores, sizes = (np.array([p.sum() for p in np.array_split(y * force, SIGN_BLOCKS)]) for y in (r, force))
    p = ForceGain(left, 0.0, t_of_scores(scores, sizes), nats).p_added(k)
    return left <= 1 - LEAST_SHARE and count * periods * p / share <= ALPHA


def main() -> None:
    """Print false alarms and power for each kind of residual and length of log."""
    parser = argparse.ArgumentParser(description="False alarms and power of the force residual, in per cent of logs.")
    parser.add_argument("--runs", type=int, default=800)
    runs = parser.parse_args().runs
    for kind in RESIDUALS:
        for n, share in LOGS:
            draw, (levels, tried) = np.random.default_rng(7), candidates(n)
            alarms, hits = 0, dict.fromkeys(FORCES, 0)
            for _ in range(runs):
                r = residual(kind, n, draw)
                r = r - levels @ (levels.T @ r)
                alarms += any(passes(r, one, share, len(tried)) for one in tried)
                for name, (k, value) in FORCES.items():
                    force = tried[k][2][value][:, 0] * float(np.linalg.norm(r)) * np.sqrt(ADDED / (1 - ADDED))
                    hits[name] += passes(r + force, tried[k], share, len(tried))
            print(f"{kind}, {n} values: {100 * alarms / runs:.2f} % of logs; {100 * ALPHA * share:.2g} % is allowed")
            print("    found: " + ", ".join(f"{name} {100 * hit / runs:.0f} %" for name, hit in hits.items()))


if __name__ == "__main__":
    main()
