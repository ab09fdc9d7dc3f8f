"""Preflight of signs, scales, units and columns, by the balance of forces along the measured motion.

    M(x) a − g(x, v, 0) + U λ  =  g(x, v, w) − g(x, v, 0)

On the left is the force that the motion requires, with the declared friction; on the right the force of the inputs
(``input_audit``). For coordinates on which no input acts, the correlation of g − U λ with M a is judged instead.
"""

from collections.abc import Iterator

import numpy as np

from codegen.base.arrays import Array
from codegen.effects.declare import system_of
from codegen.logs.audit.changed_columns import Case, changed_columns
from codegen.logs.audit.force_balance import Balance, Forces, hat_functions, unexplained
from codegen.logs.audit.input_audit import SCALE_OFF, audit_inputs, audit_undriven, is_constant, not_judged
from codegen.logs.audit.scales import LONGEST_STEP, scales_of_velocities, wrong_scales
from codegen.logs.log import Finding, Log
from codegen.logs.motion import Motion
from codegen.spec.model import Spec

USUAL = 0.95
"""Quantile by which the size of a coordinate is judged, so that single peaks do not count."""
FEWEST = 50
"""Least number of samples in motion."""
KNOTS = 60
"""Number of knots of the piecewise linear function of the position."""
COMPUTED = 0.01
"""Largest share of the input's force that a function of the position leaves unexplained if it was computed from it."""
TIMES_COMPUTED, MATERIAL = 10.0, 0.03
"""Least part of the required force that is no function of the position, from which on a force that is not logged must
move the machine: over the same part of the input's force, and as a share of both forces."""
SWINGING = 0.5
"""In a free oscillation friction explains this share of the inertia force, functions of the position taken out."""

SIGN_OF = "sign of "
"""How the topic of a finding on a sign begins; the input's or coordinate's name follows."""
EITHER_WAY, ALIKE, ONE_WAY = 10, 1.5, 0.05
"""An input without sign: least samples in motion each way, largest ratio of its mean sizes in the two, and share of
the samples up to which the required force has the other sign, where no change of sign is expected."""


def audit_force(log: Log, spec: Spec, motion: Motion, steady: frozenset[int] = frozenset()) -> Iterator[Finding]:
    """Findings by the balance of forces: on columns, signs, scales and units."""
    system = system_of(spec)
    if not motion.usable.any():
        return
    balance = Balance(system)
    case = Case(log, spec, balance, motion, forces := balance.along(log, motion))
    reverses = len(steady) < len(spec.coordinates)
    time_doubted = log.sample_time > LONGEST_STEP and reverses  # with wrong accelerations any change may fit better
    changed = None if time_doubted else changed_columns(case)
    if changed is not None:  # other findings on scales and signs would only follow from it
        yield changed
        return
    yield from scales_of_velocities(case)
    unsigned = list(_without_sign(forces, log, spec))
    if len(forces.inertia) < FEWEST:
        yield from unsigned
        words = "Too few samples in motion to compare the input's force with the acceleration."
        yield Finding("info", "sign and scale", words, {"samples": float(len(forces.inertia))})
        return
    if before := _before_judging(log, spec):
        yield from unsigned
        yield from (not_judged(i.name, before) for i in spec.inputs)
        return
    outside = _furthest_outside(log, spec, motion)
    if not log.raw_data.doubted:
        off = list(_computed_from_position(forces, spec, steady)) or wrong_scales(case, steady, outside)
        wrong = [f for f in off if f.severity == "problem"]  # with a position in a wrong unit an input cannot be judged
        if not any("misfit_scaled" in f.figures for f in wrong):  # where a unit balances the forces, no sign is missing
            yield from unsigned
        yield from off
        if wrong:
            return
    else:
        yield from unsigned
    told = set[str]()
    for finding in (*audit_inputs(forces, spec, outside, log), *audit_undriven(forces, spec, outside)):
        if finding.topic not in told:  # several inputs, or coordinates without one, may show the same wrong scale
            yield finding
        told.add(finding.topic)


def _before_judging(log: Log, spec: Spec) -> str:
    """What must be done before the forces of the inputs can be judged, as a clause; empty for nothing."""
    if doubted := log.raw_data.doubted & {*spec.positions, *spec.velocities}:
        return f"the numbers of {' and '.join(sorted(doubted))} are corrected"
    unsized = sorted(log.raw_data.unsized)  # forces cannot tell two unknown factors apart
    return f"the units of {' and '.join(unsized)} are stated" if len(unsized) > 1 else ""


def _furthest_outside(log: Log, spec: Spec, motion: Motion) -> Finding | None:
    """The beginning of a finding on the coordinate furthest outside its declared range; None where none is far.

    It is at least ``SCALE_OFF`` times outside, its figure ``times``.
    """
    found = []
    for j, c in enumerate(spec.coordinates):
        signals = {c.name: (log.positions, c.unit), c.velocity: (motion.velocities, f"{c.unit}/s")}
        for name, (values, unit) in signals.items():
            if name not in spec.envelope:
                continue
            size = float(np.quantile(np.abs(values[motion.usable, j]), USUAL))
            bound = max(abs(float(b)) for b in spec.envelope[name])
            if bound > 0 and size >= SCALE_OFF * bound:
                what = f"{name} reaches {size:.3g} {unit}, {size / bound:.3g} times the spec's envelope"
                words = f"The scale of {c.name} seems off: {what}"
                found.append(Finding("problem", f"scale of {c.name}", words, {"times": size / bound}))
    return max(found, key=lambda finding: finding.figures["times"], default=None)


def _computed_from_position(forces: Forces, spec: Spec, left_out: frozenset[int]) -> Iterator[Finding]:
    """Findings on inputs that were computed from the position, so that the force that moves the machine is not logged.

    A controller that compensates gravity commands u = f(q). If the machine is moved by hand meanwhile, u contains
    neither friction nor inertia. The position controller of a spring commands such an input too; there the machine
    oscillates freely, inertia against friction, and no other force is needed.
    """
    given, n = forces.applied, forces.applied.shape[1]
    for i, c in enumerate(spec.coordinates):
        size = float(np.std(given[:, i]))
        if i in left_out or size == 0:
            continue
        inertia, friction = forces.inertia[:, i], forces.friction[:, i]
        x, v = forces.motion[:, i], forces.motion[:, n + i]
        required = inertia - forces.undriven[:, i]
        left = _without_function_of(x, np.column_stack([given[:, i], required, inertia, friction, v]))
        share, other = (float(np.sqrt(np.mean(y**2))) / size for y in left.T[:2])
        least = max(TIMES_COMPUTED * share, MATERIAL, MATERIAL * float(np.std(required)) / size)
        free = unexplained(left[:, 2], left[:, 3:])  # of the inertia force, by friction and damping
        if share > COMPUTED or other < least or free @ free <= (1 - SWINGING) * (left[:, 2] @ left[:, 2]):
            continue
        figures = {"share": share, "taken": other}
        topic = f"input computed from {c.name}"
        yield Finding.worded("problem", topic, "input_audit", "computed", figures, x=c.name, **figures)


def _without_function_of(x: Array, columns: Array) -> Array:
    """Columns (K, m) less their least-squares piecewise linear functions of x, (K,)."""
    hats = hat_functions(x, KNOTS)
    gram = hats.T @ hats + 1e-9 * len(x) / len(hats.T) * np.eye(len(hats.T))
    return np.asarray(columns - hats @ np.linalg.solve(gram, hats.T @ columns))


def _without_sign(forces: Forces, log: Log, spec: Spec) -> Iterator[Finding]:
    """Findings on inputs that never change sign and are as large one way as the other, without a declared weight.

    Against friction and inertia a drive pushes both ways; with a weight W and friction F it gives W + F and W − F. A
    weight is declared if it is half the input's force or more, or, where the input is in another unit, if the required
    force does not change sign either. Of a constant input nothing is known.
    """
    n = len(spec.coordinates)
    for j, i in enumerate(spec.inputs):
        values, on = log.inputs[:, j], np.flatnonzero(np.any(forces.driven[j] != 0, axis=0))
        if len(on) != 1 or is_constant(values) or (values.min() < 0 < values.max()) or i.name in log.raw_data.doubted:
            continue
        at = int(on[0])
        own, speed = np.abs(forces.driven[j, :, at]), forces.motion[:, n + at]
        up, down = speed > 0, speed < 0
        alone = not np.any(np.delete(forces.driven, j, axis=0)[:, :, at])
        if min(up.sum(), down.sum()) < EITHER_WAY or not alone:
            continue
        weight, needed = abs(float(forces.static[:, at].mean())), forces.inertia[:, at] - forces.undriven[:, at]
        if weight > 0.5 * own.mean() or min(np.mean(needed < 0), np.mean(needed > 0)) <= ONE_WAY:
            continue
        rising, falling = float(own[up].mean()), float(own[down].mean())
        if max(rising, falling) > ALIKE * min(rising, falling):
            continue
        given = {"name": i.name, "x": spec.coordinates[at].name, "positive": values.max() > 0}
        figures = {"falling_over_rising": falling / rising}
        yield Finding.worded("warning", f"{SIGN_OF}{i.name}", "input_audit", "no sign", figures, **given, **figures)
