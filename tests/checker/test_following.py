"""Random certificates of a P that follows: accepted a little below the best rate that samples show, never above."""

from __future__ import annotations

import itertools
import json
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from codegen.checker import verify

from .test_verify import Cert, certificate, followed, largest, number, value

INTERVALS = 32
PARAMETERS = {"p": ["sin", ["*", "3", "q"]], "r": ["/", "1", ["+", "1", ["^", "q", "2"]]], "u": "v", "z": "w", "c": "s"}


def drawn(seed: int) -> Cert:
    """A smooth P(q) for either sign s, and a matrix in functions of q, its velocity v, another w and s."""
    dice = np.random.default_rng(seed)

    def short(low: float, high: float) -> str:
        return str(Fraction(round(float(dice.uniform(low, high)) * 1000), 1000))

    def matrices() -> list[list[list[str]]]:
        a, b, c, phase = dice.uniform([0.1, -0.4, -0.3, 0], [0.5, 0.4, 0.3, 3])
        x = np.linspace(0, 1, INTERVALS + 1)
        entries = 1 + a * np.sin(2 * x + phase), b * np.cos(x + phase), 1 + c * np.cos(3 * x)
        rows = zip(*([str(Fraction(round(e * 10**5), 10**5)) for e in each] for each in entries), strict=True)
        return [[[one, cross], [cross, two]] for one, cross, two in rows]

    def times(low: float, high: float, *names: str) -> list[str]:
        return ["*", short(low, high), *names]

    matrix = [
        [["+", short(-3, -1), times(-1, 1, "p", "u"), times(-0.3, 0.3, "z")], ["+", times(-1, 1, "r", "c")]],
        [["+", times(-1, 1, "r"), times(-0.5, 0.5, "c")], ["+", short(-3, -1), times(-0.4, 0.4, "p", "z")]],
    ]
    matrix[0][1].append(times(-0.5, 0.5, "u"))
    slow = {"variable": "q", "velocity": "v", "stray": "1/10", "signs": ["s"], "matrices": [matrices(), matrices()]}
    return certificate(
        2,
        sample_time="1/100",
        variables={"q": ["0", "1"], "v": ["-1", "1"], "w": ["-1", "1/2"], "s": ["-1", "1"]},
        splits={"q": [str(Fraction(k, INTERVALS)) for k in range(INTERVALS + 1)]},
        parameters=[{"name": name, "expression": e} for name, e in PARAMETERS.items()],
        matrix=matrix,
        lyapunov_matrix=[],
        slow=[slow],
    )


def best_rate(cert: Cert) -> float:
    """The least (1 − V(e[k+1])/V(e[k]))/2h over samples of everything, for the worst e."""
    h, worst = number(cert["sample_time"]), 0.0
    breaks = [number(b) for b in cert["splits"]["q"]]
    columns = [np.array([p.ravel() for p in row]).T for row in followed(cert)]
    for q, v, w, s in itertools.product(np.linspace(0, 1, 97), (-1, -0.3, 0.4, 1), (-1, 0.5), (-1, 1)):
        at = {"q": float(q), "v": v, "w": w, "s": s}
        theta = {entry["name"]: value(entry["expression"], at) for entry in cert["parameters"]}
        step = np.eye(2) + h * np.array([[value(x, theta) for x in row] for row in cert["matrix"]])
        for later in (q + h * (v + off) for off in (-0.1, 0.1)):
            now, then = (np.array([np.interp(x, breaks, e) for e in columns[s < 0]]).reshape(2, 2) for x in (q, later))
            if 0 <= later <= 1:
                worst = max(worst, largest(step.T @ then @ step, now))
    return (1 - worst) / 2 / h


@pytest.mark.parametrize("seed", [1, 4, 5, *(pytest.param(k, marks=pytest.mark.slow) for k in range(10, 60))])
def test_a_rate_is_accepted_just_when_samples_show_it(seed: int) -> None:
    cert = drawn(seed)
    rate = best_rate(cert)
    verify.check(json.dumps(cert | {"decay_rate": str(Fraction(f"{rate - 0.08:.6f}"))}))
    with pytest.raises(verify.Refused, match="V may not fall"):
        verify.check(json.dumps(cert | {"decay_rate": str(Fraction(f"{rate + 1e-4 * max(1, abs(rate)):.6f}"))}))


def test_what_is_taken_off_the_gap_covers_what_the_chords_leave_out() -> None:
    """F'P+F at random velocities and entries beside the chord of F, less its chord in the velocity, by NumPy."""
    dice, unit = np.random.default_rng(3), 2**52
    closest = 0.0
    for _ in range(200):
        P, rise = (dice.integers(-900, 900, (3, 3)) for _ in range(2))
        P, rise = P + P.T + 4000 * np.eye(3, dtype=int), rise + rise.T
        h, width, length = dice.uniform(0.1, 1), dice.uniform(0, 1), 2.0
        F, turn = np.eye(3) + dice.uniform(-0.3, 0.3, (3, 3)), dice.uniform(-1, 1, (3, 3)) * dice.choice([0, 0.1, 1])
        off = dice.uniform(0, 1, (3, 3)) * dice.choice([0, 0.001, 0.1])
        ends = [F - turn / 2, F + turn / 2]
        whole = [[[int(x * unit) for x in row] for row in m] for m in (np.abs(ends).max(axis=0).T, off.T, turn.T)]
        bounds = SimpleNamespace(reach=Fraction(h * width / 2), h=Fraction(h), width=Fraction(width))
        sizes = ([[abs(int(x)) for x in row] for row in m] for m in (P, rise))
        sizes_of_turn = [[abs(x) for x in row] for row in whole[2]]
        D = verify.Following.astray(bounds, *sizes, Fraction(2), whole[0], whole[1], sizes_of_turn)
        above = np.diag([float(d) for d in D]) / unit**2

        def later(
            share: float, F: np.ndarray, P: np.ndarray = P, move: np.ndarray = h * width / length * rise
        ) -> np.ndarray:
            return F.T @ (P + (share - 0.5) * move) @ F

        chord = [later(k, end) for k, end in enumerate(ends)]
        for share in (0.25, 0.5, 0.75):
            beside = ends[0] + share * turn + off * dice.choice([-1, 1], (3, 3))
            more = later(share, beside) - (1 - share) * chord[0] - share * chord[1]
            assert np.linalg.eigvalsh(above - more)[0] > -1e-6
            closest = max(closest, largest(more, above) if off.max() + abs(turn).max() > 0 else 0.0)
    assert 0.3 < closest <= 1
