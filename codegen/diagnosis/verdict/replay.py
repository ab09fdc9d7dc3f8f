"""Replay of the generated tracking observer over a log, as a second, independent friction estimate."""

from dataclasses import replace

import numpy as np
import sympy
from scipy.signal import cont2discrete, lfilter

from codegen.base.arrays import Array
from codegen.diagnosis.fit.residual import friction_estimate
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.results import Agreement
from codegen.mechanics.system import System
from codegen.spec.model import ObserverChoice, Spec
from codegen.spec.schema import CodeChoice

DAMPING = 0.9
MOST_SAMPLES = 60_000
FASTEST = 0.15
"""Largest bandwidth times sample time, well below the stability limit of explicit Euler."""


def tracking_choice(system: System, motion: Motion, bandwidth: float) -> ObserverChoice:
    """A GTO whose error has the given bandwidth ω at the mean position: K_v = 2ζω, K_2 = −M ω/2ζ, (4.36)."""
    middle = dict(zip(system.positions, motion.positions[motion.usable].mean(axis=0), strict=True))
    mass = np.array(system.mass_matrix.subs(system.values).subs(middle).evalf(), dtype=float)
    gains = {
        "K_v": f"{2 * DAMPING * bandwidth:.9g}",
        "K_2": [[f"{-entry * bandwidth / (2 * DAMPING):.9g}" for entry in row] for row in mass],
        "K_1": "0",
    }
    return ObserverChoice("gto", "estimated", gains, sympy.Rational(f"{motion.sample_time:.12g}"), sympy.Integer(1))


def tracked_friction(spec: Spec, system: System, motion: Motion, bandwidth: float) -> Array:
    """(N, n) generalised friction estimated by the generated tracking observer."""
    # The code generator is imported here, in the process in which the observer is replayed.
    from codegen.observers import build_observer
    from codegen.replay.engine import engine_of

    choice = tracking_choice(system, motion, bandwidth)
    engine = engine_of(spec, build_observer(replace(spec, observer=choice), system), CodeChoice())
    rows = np.hstack([motion.measured, motion.commands])[:MOST_SAMPLES]
    engine.start(rows[0])
    estimates, _ = engine.run(rows)
    return estimates[:, [engine.outputs.index(f"F_hat_on_{x.name}") for x in system.positions]]


def compare_residuals(spec: Spec, system: System, motion: Motion) -> Agreement | None:
    """Agreement of the observer's friction estimate with inverse dynamics; None if the observer diverges."""
    bandwidth = min(2 * np.pi * motion.cutoff_hz, FASTEST / motion.sample_time)
    tracked = tracked_friction(spec, system, motion, bandwidth)
    direct = friction_estimate(system, motion)[: len(tracked)]
    lagged = _second_order(direct, bandwidth, motion.sample_time)
    used = motion.usable[: len(tracked)]
    # Above the coarse cutoff both are noise; compare below it.
    a, b = motion.low_pass(tracked)[used], motion.low_pass(lagged)[used]
    if not np.isfinite(a).all() or len(a) < 10:
        return None
    size = np.sqrt((b**2).mean(axis=0))
    size = np.where(size > 0, size, 1.0)
    difference = np.sqrt(((a - b) ** 2).mean(axis=0)) / size
    correlation = np.corrcoef((a / size).ravel(), (b / size).ravel())[0, 1]
    return Agreement(float(correlation), float(difference.max()), len(tracked))


def _second_order(signals: Array, bandwidth: float, h: float) -> Array:
    """ω²/(s² + 2ζωs + ω²): the observer's response from friction to its estimate, (4.36)."""
    system = ([bandwidth**2], [1.0, 2 * DAMPING * bandwidth, bandwidth**2])
    b, a, _ = cont2discrete(system, h, method="bilinear")
    start = signals[0] * np.array([[sum(b[0][1:]) - sum(a[1:])], [b[0][2] - a[2]]])
    filtered, _ = lfilter(b[0], a, signals, axis=0, zi=start)
    return np.asarray(filtered)
