"""Preflight of a coordinate's scale: what tells it from an input's, the spec's envelope and the friction.

Inertia grows with the scale of a coordinate and Coulomb friction does not. So where the input's force fits the declared
friction and takes many times the declared inertia, or a small part of it, the position or the time is in another unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codegen.logs.finding import Finding
from codegen.logs.log import Array, Log
from codegen.logs.motion import Motion
from codegen.spec.model import Spec

USUAL = 0.95
"""Quantile: single peaks say nothing of a scale."""
INERTIA_OFF, FRICTION_FITS = 10.0, 3.0
SUSPECT = 7.0
"""Least factor on the inertia at which other units are tried: a power of ten, less what else the model lacks."""
INERTIA_SEEN, FRICTION_SEEN = 0.5, 0.15
"""Partial correlations with the input's force."""
TOO_MUCH, TELLING = 30.0, 0.6
"""Force that the motion takes over the force that is given, and correlation of the two: right logs are near 1 and 1."""


@dataclass(frozen=True)
class Outside:
    """A coordinate that the log has far outside the envelope.

    Attributes:
        coordinate: its name.
        what: its position or velocity, by name; value: how large that is, SI; unit: its unit.
        times: value over the envelope's bound.
    """

    coordinate: str
    what: str
    value: float
    unit: str
    times: float

    @property
    def words(self) -> str:
        """For a message."""
        return f"{self.what} reaches {self.value:.3g} {self.unit}, {self.times:.3g} times the spec's envelope"


def furthest_outside(log: Log, spec: Spec, motion: Motion, least: float) -> Outside | None:
    """The coordinate furthest outside its declared range, by a factor of at least ``least``; None where none is."""
    found = []
    for j, c in enumerate(spec.coordinates):
        signals = {c.name: (log.positions, c.unit), c.velocity: (motion.velocities, f"{c.unit}/s")}
        for name, (values, unit) in signals.items():
            if name in spec.envelope and motion.usable.any():
                size, bound = _usual(values[motion.usable, j]), max(abs(float(b)) for b in spec.envelope[name])
                if bound > 0 and size >= least * bound:
                    found.append(Outside(c.name, name, size, unit, size / bound))
    return max(found, key=lambda o: o.times, default=None)


def _usual(values: Array) -> float:
    return float(np.quantile(np.abs(values), USUAL))


def audit_scale(
    given: Array,
    inertia: Array,
    rest: Array,
    friction: Array,
    motion: Array,
    spec: Spec,
    steady: frozenset[int] = frozenset(),
    least: float = INERTIA_OFF,
) -> list[Finding]:
    """The coordinates whose motion is out of all proportion to their friction, or to what the inputs give.

    Springs, dampers and offsets that the spec may lack stand beside the two, so that they are not taken for inertia.

    Args:
        given: (K, n) generalised force of the inputs. inertia: (K, n) M a. friction: (K, n) U λ as declared.
        rest: (K, n) g without inputs − U λ.
        motion: (K, 2n) positions and velocities.
        steady: the coordinates that run at constant speed: they are accelerated by waves and noise alone.
        least: factor on the declared inertia from which on it tells.
    """
    found = []
    for i, c in enumerate(spec.coordinates):
        taken, push = inertia[:, i] - rest[:, i], given[:, i]
        sizes = float(np.linalg.norm(taken)), float(np.linalg.norm(push))
        if min(sizes) == 0.0 or i in steady:
            continue
        if sizes[0] > TOO_MUCH * sizes[1] and float(taken @ push) < TELLING * sizes[0] * sizes[1]:
            words = (
                f"The scale of {c.name} or of time seems off: its motion takes {sizes[0] / sizes[1]:.3g} times the "
                f"force that the inputs give, and at other times. Check unit and scale of {c.name} and t."
            )
            found.append(Finding("problem", f"scale of {c.name}", words, {"times": sizes[0] / sizes[1]}))
            continue
        beside = np.column_stack([motion, np.ones(len(motion))])
        heavy, r_inertia = inertia_factor(given, inertia, friction, motion, i)
        slid, r_friction = partial(push, friction[:, i], np.column_stack([inertia[:, i], beside]))
        fits = r_friction > FRICTION_SEEN and 1 / FRICTION_FITS < slid < FRICTION_FITS
        if fits and r_inertia > INERTIA_SEEN and not 1 / least < heavy < least:
            words = (
                f"The scale of {c.name} or of time seems off: the input fits the declared friction on {c.name} (factor "
                f"{slid:.2g}), and takes {heavy:.3g} times the declared inertia. "
                f"Check unit and scale of {c.name} and t."
            )
            figures = {"inertia": heavy, "friction": slid, "correlation": r_inertia}
            found.append(Finding("problem", f"scale of {c.name}", words, figures))
    return found


def inertia_factor(given: Array, inertia: Array, friction: Array, motion: Array, i: int) -> tuple[float, float]:
    """By how much the inputs' force on coordinate i is inertia, over the declared one, and the partial correlation."""
    beside = np.column_stack([friction[:, i], motion, np.ones(len(motion))])
    return partial(given[:, i], inertia[:, i], beside)


def partial(wanted: Array, column: Array, others: Array) -> tuple[float, float]:
    """Least-squares weight of a column beside others, and its partial correlation; zeros where it says nothing."""
    size = np.linalg.norm(others, axis=0)
    basis = others[:, size > 0] / size[size > 0]
    left = np.column_stack([wanted, column])
    left = left - basis @ np.linalg.lstsq(basis, left, rcond=1e-8)[0]
    power = float(left[:, 1] @ left[:, 1])
    if power <= 1e-12 * float(column @ column):
        return 0.0, 0.0
    product, whole = float(left[:, 0] @ left[:, 1]), float(left[:, 0] @ left[:, 0])
    return product / power, product / float(np.sqrt(power * whole)) if whole > 0 else 0.0
