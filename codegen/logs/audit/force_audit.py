"""Preflight of signs, scales, units and columns, by the balance of forces along the measured motion.

    M(x) a − g(x, v, 0) + U λ  =  g(x, v, w) − g(x, v, 0)

On the left is the force that the motion requires, with the declared friction; on the right the force of the inputs. The
least-squares factor of each input between the two sides is near one if sign and scale are right, also if friction is
larger than inertia. For coordinates on which no input acts, the correlation of g − U λ with M a is judged instead. If a
coordinate exceeds the spec's envelope by as large a factor, the finding is about that coordinate and not the input.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from codegen.base.arrays import Array
from codegen.base.errors import Place
from codegen.base.significant import in_percent
from codegen.effects.declare import system_of
from codegen.logs.audit.exchanged_columns import exchanged_columns
from codegen.logs.audit.flipped_signs import flipped_signs
from codegen.logs.audit.force_balance import Balance, Forces, unexplained
from codegen.logs.audit.input_audit import SCALE_OFF, TELLING, Outside, audit_inputs, audit_undriven, not_judged
from codegen.logs.audit.position_scale import gear_ratio, position_scales
from codegen.logs.column_names import is_convertible
from codegen.logs.log import Finding, Log
from codegen.logs.motion import Motion, scaled
from codegen.spec.model import Spec
from codegen.spec.units import si_factor

USUAL = 0.95
"""Quantile by which the size of a coordinate is judged, so that single peaks do not count."""
FEWEST = 50
"""Least number of samples in motion."""
LONGEST_STEP = 0.5
"""Sample time in s from which on the unit of time is in doubt, and not that of a coordinate."""
INERTIA_OFF, FRICTION_FITS = 10.0, 3.0
"""Least factor on the declared inertia, and largest on the declared friction, at which a scale is reported as wrong."""
SUSPECT = 7.0
"""Least factor on the inertia at which other units are tried: a power of ten, less what else the model lacks."""
INERTIA_SEEN, FRICTION_SEEN = 0.5, 0.15
"""Partial correlations with the input's force from which on inertia and friction show in a log."""
TOO_MUCH = 30.0
"""Ratio of the required force to the force of the inputs, near 1 in a right log, from which on a scale is wrong."""
UNITS = ("m", "cm", "mm", "um", "rad", "deg", "mrad")
SAME_MOTION, APART = 0.9, 2.0
"""Least correlation of a measured velocity with the position's derivative, and the ratio from which on they differ."""
NEAR = 0.05
"""Relative deviation of a ratio from the power of ten that it is taken for."""
FITS, BETTER = 0.25, 0.5
"""Largest misfit that is accepted of another unit, and its largest ratio to that of any other."""
FACTOR_RANGE, FACTORS_TRIED, SURE_FACTOR, NO_UNIT = 10.0, 41, 0.02, 1.5
"""Search for a scale factor that is no unit conversion: range about a starting value, number of factors on that grid,
largest misfit at which the factor is named, and least ratio to the unit's factor (nearer: a parameter error)."""
KNOTS = 60
"""Number of knots of the piecewise linear function of the position."""
COMPUTED = 0.01
"""Largest share of the input's force that a function of the position leaves unexplained if it was computed from it."""
CARRIED, MATERIAL = 10.0, 0.03
"""The part of the required force that no such function explains, over that part of the input's force, and as a share of
both forces, from which on an unlogged force must move the machine."""
SWINGING = 0.5
"""Share of the inertia force, less such a function, that friction explains in a free oscillation."""


def audit_force(log: Log, spec: Spec, motion: Motion, steady: frozenset[int] = frozenset()) -> Iterator[Finding]:
    """Findings by the balance of forces: on columns, signs, scales and units.

    Args:
        steady: the coordinates that run at constant speed, whose inertia is not judged.

    Raises:
        BadInput: if the spec's mechanics or declared effects cannot be built.
    """
    system = system_of(spec)
    if not motion.usable.any():
        return
    balance = Balance(system)
    forces = balance.along(log, motion)
    bindings = [f for tried in (exchanged_columns, flipped_signs) for f in tried(log, spec, balance, motion, forces)]
    if bindings:  # other findings on scales and signs would only follow from it
        yield min(bindings, key=lambda finding: finding.figures["misfit_mended"])
        return
    yield from _against_velocity(log, spec, motion)
    if len(forces.inertia) < FEWEST:
        words = "Too few samples in motion to compare the input's force with the acceleration."
        yield Finding("info", "sign and scale", words, {"samples": float(len(forces.inertia))})
        return
    doubted = log.intake.doubted & {*spec.positions, *spec.velocities}
    if doubted:
        for i in spec.inputs:
            yield not_judged(i.name, " and ".join(sorted(doubted)))
        return
    outside = _furthest_outside(log, spec, motion)
    if not log.intake.doubted:
        off = _off_scale(forces, spec, steady)
        suspected = off or outside or _steps_apart(log) or _off_scale(forces, spec, steady, SUSPECT)
        if suspected and log.sample_time < LONGEST_STEP:
            known = {finding.topic: finding.figures for finding in off}
            if outside:
                topic = f"scale of {outside.coordinate}"
                known[topic] = {"times": outside.times, **known.get(topic, {})}
            off = list(_other_unit(log, spec, balance, motion, forces, off)) or off
            off = [replace(f, figures={**f.figures, **known.get(f.topic, {})}) for f in off]
        off = off or list(_computed_from_position(forces, spec, steady))
        off = off or [f for f in position_scales(log, spec, balance, motion, forces) if not steady]
        yield from off
        if any(f.severity == "problem" for f in off):  # with a position in a wrong unit an input cannot be judged
            return
    yield from audit_inputs(forces, spec, outside, log)
    yield from audit_undriven(forces, spec, outside)


def _furthest_outside(log: Log, spec: Spec, motion: Motion) -> Outside | None:
    """The coordinate furthest outside its declared range, by a factor of at least ``SCALE_OFF``; None where none is."""
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
                found.append(Outside(c.name, what, size / bound))
    return max(found, key=lambda o: o.times, default=None)


def _off_scale(forces: Forces, spec: Spec, steady: frozenset[int], least: float = INERTIA_OFF) -> list[Finding]:
    """Findings on coordinates in a wrong unit, by the ratio of inertia to friction, or to the force of the inputs.

    Inertia scales with the coordinate and Coulomb friction does not. If the input's force fits the declared friction,
    but a multiple or a fraction of the declared inertia, the position or the time is in another unit.

    Args:
        steady: the coordinates that run at constant speed, whose acceleration is ripple and noise alone.
        least: least factor on the declared inertia that is reported.
    """
    found = []
    for i, c in enumerate(spec.coordinates):
        required, push = forces.inertia[:, i] - forces.rest[:, i], forces.given[:, i]
        sizes = float(np.linalg.norm(required)), float(np.linalg.norm(push))
        if min(sizes) == 0.0 or i in steady:
            continue
        topic, start = f"scale of {c.name}", f"The scale of {c.name} or of time seems off:"
        end = f"Check unit and scale of {c.name} and t."
        if sizes[0] > TOO_MUCH * sizes[1] and float(required @ push) < TELLING * sizes[0] * sizes[1]:
            words = (
                f"{start} its motion requires {sizes[0] / sizes[1]:.3g} times the force of the inputs, and does not "
                f"correlate with it. {end}"
            )
            found.append(Finding("problem", topic, words, {"times": sizes[0] / sizes[1]}))
            continue
        (inertia, r_inertia), (friction, r_friction) = forces.inertia_factor(i), forces.friction_factor(i)
        fits = r_friction > FRICTION_SEEN and 1 / FRICTION_FITS < friction < FRICTION_FITS
        if fits and r_inertia > INERTIA_SEEN and not 1 / least < inertia < least:
            words = (
                f"{start} the input fits the declared friction on {c.name} (factor {friction:.2g}), but "
                f"{inertia:.3g} times the declared inertia. {end}"
            )
            figures = {"inertia": inertia, "friction": friction, "correlation": r_inertia}
            found.append(Finding("problem", topic, words, figures))
    return found


def _other_unit(
    log: Log, spec: Spec, balance: Balance, motion: Motion, forces: Forces, found: Sequence[Finding]
) -> Iterator[Finding]:
    """A finding on the coordinate that makes the forces balance if it is taken in another unit; none if no one does.

    With coupled masses, a coordinate in a wrong unit disturbs the balance of all, and another one's may be worse. So
    each coordinate is tried in each other usual unit.

    Args:
        found: findings on the scale of coordinates, each by its own balance.
    """
    tried = []
    for j, c in enumerate(spec.coordinates):
        inertia, seen = forces.inertia_factor(j)
        for unit, factor in _other_units(log.units.get(c.name, c.unit)):
            if found or (seen > INERTIA_SEEN and 1 / SCALE_OFF < inertia / factor < SCALE_OFF):
                tried.append((balance.misfit(log, scaled(motion, j, factor)), j, unit))
    if not tried:
        return
    least, j, unit = min(tried)
    now = forces.misfit
    others = [now, *(left for left, k, _ in tried if k != j)]
    name = spec.coordinates[j].name
    taken = log.units.get(name, spec.coordinates[j].unit)
    fits = least <= FITS and least <= BETTER * min(others)
    unit_factor = dict(_other_units(taken))[unit]
    inertia, _ = forces.inertia_factor(j)
    if fits or (found and inertia > 0):
        factor, fitted = _best_factor(log, balance, motion, j, unit_factor if fits else inertia)
        if fitted < min(SURE_FACTOR, BETTER * least) and not 1 / NO_UNIT < factor / unit_factor < NO_UNIT:
            misfits = {"misfit": now, "misfit_in_unit": least, "misfit_scaled": fitted}
            yield _no_unit(name, log, spec, 1 / factor, misfits)
            return
    if not fits:
        return
    words = (
        f"The scale of {name} seems off: is {name} in {unit}? As {taken}, {in_percent(now)} of the squared forces stay "
        f"unbalanced; as {unit}, {in_percent(least)}. "
        f"(`units: {{{name}: {unit}}}` in meta.yaml beside the log)"
    )
    yield Finding("problem", f"scale of {name}", words, {"misfit": now, "misfit_in_unit": least})


def _best_factor(log: Log, balance: Balance, motion: Motion, j: int, about: float) -> tuple[float, float]:
    """The factor on coordinate j with the least misfit, within ``FACTOR_RANGE`` of ``about``, and that misfit."""

    def misfit(power: float) -> float:
        return balance.misfit(log, scaled(motion, j, 10.0**power))

    powers = np.log10(about) + np.linspace(-1, 1, FACTORS_TRIED) * np.log10(FACTOR_RANGE)
    k = int(np.argmin([misfit(power) for power in powers]))
    ends = float(powers[max(k - 1, 0)]), float(powers[min(k + 1, len(powers) - 1)])
    found = minimize_scalar(misfit, bounds=ends, method="bounded", options={"xatol": 1e-3})
    return float(10.0**found.x), float(found.fun)


def _no_unit(name: str, log: Log, spec: Spec, factor: float, misfits: dict[str, float]) -> Finding:
    """The finding on a scale that is wrong by a factor of no usual unit; it names a gear ratio of this value.

    Args:
        factor: the values in the log over the right ones.
        misfits: unbalanced share of the squared forces: as read, in the best usual unit, and divided by the factor.
    """
    gear, ratio = gear_ratio(spec, factor)
    same = f" The parameter {gear} has this value: is {name} measured on the other side of a gear?" if gear else ""
    left = {key: f"{in_percent(value)}" for key, value in misfits.items()}
    words = (
        f"The scale of {name} seems off by a factor of {factor:.3g}. As read, {left['misfit']} of the squared forces "
        f"stay unbalanced; divided by it, {left['misfit_scaled']}; in the best usual unit, {left['misfit_in_unit']}."
        f"{same} "
        f"({log.scale_lines({name: 1 / ratio}, spec)} in meta.yaml beside the log)"
    )
    return Finding("problem", f"scale of {name}", words, misfits)


def _against_velocity(log: Log, spec: Spec, motion: Motion) -> Iterator[Finding]:
    """Findings on positions whose derivative is a multiple of the measured velocity, if both are logged."""
    if log.velocities is None:
        return
    for j, c in enumerate(spec.coordinates):
        logged, slope = log.velocities[motion.usable, j], motion.velocities[motion.usable, j]
        sizes = float(np.linalg.norm(logged)), float(np.linalg.norm(slope))
        if min(sizes) == 0 or abs(float(logged @ slope)) < SAME_MOTION * sizes[0] * sizes[1]:
            continue
        factor = float(logged @ slope) / sizes[0] ** 2
        if 1 / APART < factor < APART:
            continue
        unit = log.units.get(c.name, c.unit)
        meant = [other for other, by in _other_units(unit) if abs(by * factor - 1) < NEAR]
        key = f"`units: {{{c.name}: {meant[0]}}}`" if meant else log.scale_lines({c.name: 1 / factor}, spec)
        words = (
            f"{c.name} moves {factor:.3g} times as far as the measured {c.velocity} says: one of the two has a wrong "
            f"scale or sign. If it is {c.name}: {key} in meta.yaml beside the log."
        )
        yield Finding("warning", f"scale of {c.name}", words, {"factor": factor})


def _steps_apart(log: Log) -> bool:
    """Whether a position's quantisation step is a power of ten times the described one."""
    for seen, stated in zip(log.intake.smallest_step or (), log.encoder_step or (), strict=False):
        power = float(np.log10(seen / stated)) if seen > 0 and stated > 0 else 0.0
        if round(power) != 0 and abs(power - round(power)) < np.log10(1 + NEAR):
            return True
    return False


def _other_units(unit: str) -> list[tuple[str, float]]:
    """Each other usual unit of the same kind, with the factor on values that were read in ``unit``."""
    here = Place("")
    usual = [other for other in UNITS if other != unit and is_convertible(other, unit)]
    return [(other, float(si_factor(other, here) / si_factor(unit, here))) for other in usual]


def _computed_from_position(forces: Forces, spec: Spec, left_out: frozenset[int]) -> Iterator[Finding]:
    """Findings on inputs that were computed from the position, so that the force that moves the machine is not logged.

    A controller that compensates gravity commands u = f(q). If the machine is moved by hand meanwhile, u contains
    neither friction nor inertia. The position controller of a spring commands such an input too; there the machine
    oscillates freely, inertia against friction, and no other force is needed.
    """
    given, n = forces.given, forces.given.shape[1]
    for i, c in enumerate(spec.coordinates):
        size = float(np.std(given[:, i]))
        if i in left_out or size == 0:
            continue
        inertia, friction = forces.inertia[:, i], forces.friction[:, i]
        x, v = forces.motion[:, i], forces.motion[:, n + i]
        required = inertia - forces.rest[:, i]
        left = _without_function_of(x, np.column_stack([given[:, i], required, inertia, friction, v]))
        share, other = (float(np.sqrt(np.mean(y**2))) / size for y in left.T[:2])
        least = max(CARRIED * share, MATERIAL, MATERIAL * float(np.std(required)) / size)
        if share > COMPUTED or other < least or _oscillates_freely(left[:, 2], left[:, 3:]):
            continue
        words = (
            f"The input's force on {c.name} is a function of {c.name} alone, to {in_percent(share)}, as from a "
            f"controller that compensates gravity. The motion takes another {in_percent(other)}: what moves the "
            "machine (a hand?) is in no column, so friction, inertia and effects cannot be learnt from this log."
        )
        yield Finding("problem", f"input computed from {c.name}", words, {"share": share, "taken": other})


def _without_function_of(x: Array, columns: Array) -> Array:
    """Columns (K, m) less their least-squares piecewise linear functions of x, (K,)."""
    knots = np.unique(np.quantile(x, np.linspace(0, 1, KNOTS)))
    if len(knots) < 3:
        return np.asarray(columns - columns.mean(axis=0))
    hats = np.column_stack([np.interp(x, knots, row) for row in np.eye(len(knots))])
    gram = hats.T @ hats + 1e-9 * len(x) / len(knots) * np.eye(len(knots))
    return np.asarray(columns - hats @ np.linalg.solve(gram, hats.T @ columns))


def _oscillates_freely(inertia: Array, against: Array) -> bool:
    """Whether friction and damping, the columns of ``against``, explain most of the inertia force, (K,)."""
    left = unexplained(inertia, against)
    return bool(left @ left <= (1 - SWINGING) * (inertia @ inertia))
