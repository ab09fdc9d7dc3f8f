"""Preflight of sign and scale: does the logged input give the force that the measured motion takes?

The force that the motion takes is M(x) a − g(x, v, 0) + U λ with the declared friction; what the input gives is
g(x, v, w) − g(x, v, 0). A least-squares factor per input between the two is near one when sign and scale are right.
It stays telling where friction outweighs inertia, which the plain correlation of g − U λ with M a does not; that one
speaks for coordinates on which no input acts. Where a coordinate is as far outside the spec's envelope, it is named and
not the input.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import casadi
import numpy as np

from codegen.logs.audit_columns import audit_columns
from codegen.logs.audit_position import audit_position
from codegen.logs.audit_record import UNUSABLE_STEP
from codegen.logs.audit_scale import (
    INERTIA_SEEN,
    SUSPECT,
    Outside,
    audit_scale,
    furthest_outside,
    inertia_factor,
    partial,
)
from codegen.logs.audit_unit import audit_unit, audit_velocity, misfit, steps_apart
from codegen.logs.finding import Finding
from codegen.logs.log import Array, Flags, Log
from codegen.logs.motion import Motion, low_pass
from codegen.mechanics import System, build_system
from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.spec.model import Spec

FLIPPED = -0.4
TELLING = 0.6
SCALE_OFF = 3.0
FAR_OUTSIDE = 10.0
"""Times the envelope: by so much a coordinate's scale is off even where forces do not tell."""
ACTING = 1e-3
"""Share of its largest force below which an input does not act: what filters leave where it is off."""
PART_SEEN = 0.2
"""Partial correlation of a modelled force with the input's force, from which on it shows in a log."""
FEWEST = 50


@dataclass(frozen=True, eq=False)
class Forces:
    """Generalised forces along the motion, low-passed, of the K samples where every contact slips.

    Attributes:
        inertia: (K, n) M(x) a.
        rest: (K, n) g(x, v, 0) − U λ with the declared friction.
        friction: (K, n) U λ, which is in ``rest`` too.
        standing: (K, n) g(x, 0, 0): gravity and springs, which is in ``rest`` too.
        driven: (m, K, n) what each input alone adds to g.
        motion: (K, 2n) positions and velocities.
    """

    inertia: Array
    rest: Array
    friction: Array
    standing: Array
    driven: Array
    motion: Array


def audit_force(log: Log, spec: Spec, motion: Motion, steady: frozenset[int] = frozenset()) -> Iterator[Finding]:
    """What there is to say of the sign and scale of inputs and forces.

    Args:
        steady: the coordinates that run at constant speed, whose inertia is not judged.

    Raises:
        BadInput: if the spec's mechanics cannot be built.
    """
    system = build_system(spec)
    if not motion.usable.any():
        return
    forces = _forces(log, system, motion)

    def left_of(other: Log, moved: Motion) -> float:
        one = _forces(other, system, moved)
        return misfit(one.inertia, one.rest, one.driven.sum(axis=0))

    left = misfit(forces.inertia, forces.rest, forces.driven.sum(axis=0))
    exchanged = list(audit_columns(log, spec, motion, left, left_of))
    if exchanged:  # what is wrong with scales and signs follows from it
        yield from exchanged
        return
    yield from audit_velocity(log, spec, motion)
    if len(forces.inertia) < FEWEST:
        words = "Too few samples in motion to compare the input's force with the acceleration."
        yield Finding("info", "sign and scale", words, {"samples": float(len(forces.inertia))})
        return
    doubted = log.intake.doubted & {*spec.positions, *spec.velocities}
    if doubted:
        for i in spec.inputs:
            yield _not_judged(i.name, " and ".join(sorted(doubted)))
        return
    outside = furthest_outside(log, spec, motion, SCALE_OFF)
    given = forces.driven.sum(axis=0)
    off, suspected = [], False
    if not log.intake.doubted:
        judged = given, forces.inertia, forces.rest, forces.friction, forces.motion, spec, steady
        off = audit_scale(*judged)
        suspected = bool(off) or outside is not None or steps_apart(log) or bool(audit_scale(*judged, SUSPECT))
    if suspected and log.sample_time < UNUSABLE_STEP:  # else time is in another unit

        def misfit_of(moved: Motion) -> float:
            return left_of(log, moved)

        def possible(j: int, factor: float) -> bool:
            heavy, seen = inertia_factor(given, forces.inertia, forces.friction, forces.motion, j)
            return bool(off) or (seen > INERTIA_SEEN and 1 / SCALE_OFF < heavy / factor < SCALE_OFF)

        off = list(audit_unit(spec, motion, misfit_of, off, log.description.units, possible)) or off
        if outside is not None:
            off = [_beside_envelope(finding, outside) for finding in off]
    yield from off
    if not off and not log.intake.doubted:
        parts = forces.inertia, forces.rest, forces.friction, forces.motion
        off = list(audit_position(given, *parts, spec, steady))
        yield from off
    if not off:  # beside a motion in another unit an input cannot be judged
        yield from _inputs(forces, spec, outside, log.intake.doubted)
        yield from _undriven(forces, spec, outside)


def _beside_envelope(finding: Finding, outside: Outside) -> Finding:
    """A finding on a scale, with how far outside the envelope the same coordinate is."""
    own = finding.topic == f"scale of {outside.coordinate}" and "times" not in finding.figures
    return replace(finding, figures={**finding.figures, "times": outside.times}) if own else finding


def _forces(log: Log, system: System, motion: Motion) -> Forces:
    before = np.vstack([log.inputs[:1], log.inputs[:-1]])
    mean_input = 0.5 * (before + log.inputs)
    evaluate = _function(system, motion.threshold).map(log.size)
    n, m = len(system.positions), len(system.inputs)

    def along(inputs: Array) -> list[Array]:
        arguments = (motion.positions, motion.velocities, motion.accelerations, inputs)
        results = evaluate(*(np.ascontiguousarray(a.T) for a in arguments))
        return [np.array(r.full(), dtype=np.float64).T for r in results]

    inertia, rest, friction, standing, slip_margin = along(np.zeros_like(mean_input))
    driven = []
    for j in range(m):
        alone = np.zeros_like(mean_input)
        alone[:, j] = mean_input[:, j]
        driven.append(along(alone)[1] - rest)
    stacked = np.hstack([inertia, rest, friction, standing, motion.positions, motion.velocities, *driven])
    finite: Flags = np.all(np.isfinite(stacked), axis=1)
    smooth, _ = low_pass(log, np.where(finite[:, None], stacked, 0.0), motion.cutoff_hz)
    slipping: Flags = np.all(slip_margin > 0, axis=1)
    parts = smooth[motion.usable & finite & slipping].reshape(-1, 6 + m, n)
    moved = parts[:, 4:6].reshape(-1, 2 * n)
    return Forces(parts[:, 0], parts[:, 1], parts[:, 2], parts[:, 3], np.moveaxis(parts[:, 6:], 1, 0), moved)


def _function(system: System, threshold: Array) -> casadi.Function:
    """(x, v, a, w) → M a; g − U λ; U λ; g at rest; |u| less the slip that speeds of ``threshold``, (n), amount to.

    All are columns.
    """
    groups = (system.positions, system.velocities, system.accelerations, system.inputs)
    arguments = [casadi.SX.sym("q", len(group)) for group in groups]
    names = symbol_values(system.values, *zip(groups, arguments, strict=True))
    slip = to_casadi(system.slip_velocity, names)
    names |= {c.slip: slip[k] for k, c in enumerate(system.contacts)}
    friction = casadi.SX.zeros(len(system.positions))
    if system.contacts:
        forces = casadi.vertcat(*(to_casadi(c.force, names) for c in system.contacts))
        friction = casadi.mtimes(to_casadi(system.distribution, names), forces)
    force = to_casadi(system.force, names) - friction
    at_rest = names | {system.velocities[k]: casadi.SX(0.0) for k in range(len(system.velocities))}
    standing = to_casadi(system.force, at_rest)
    inertia = casadi.mtimes(to_casadi(system.mass_matrix, names), arguments[2])
    margin = casadi.fabs(slip) - casadi.mtimes(casadi.fabs(casadi.jacobian(slip, arguments[1])), casadi.DM(threshold))
    return casadi.Function(
        "forces", arguments, [casadi.densify(o) for o in (inertia, force, friction, standing, margin)]
    )


def _inputs(forces: Forces, spec: Spec, outside: Outside | None, doubted: frozenset[str]) -> Iterator[Finding]:
    if not len(forces.driven):
        return
    needed = forces.inertia - forces.rest
    size = np.sqrt(np.mean(needed**2, axis=0))
    weight = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
    columns = (forces.driven * weight).reshape(len(spec.inputs), -1)
    acting = [j for j in range(len(spec.inputs)) if np.any(columns[j])]
    rows = np.any(forces.driven != 0, axis=(0, 1))  # coordinates that no input drives say nothing of inputs
    mask = np.tile(rows, len(needed))
    wanted = (needed * weight).reshape(-1)[mask]
    columns = columns[:, mask]
    if not acting:
        return
    scales = np.linalg.norm(columns[acting], axis=1)
    factors = np.linalg.lstsq((columns[acting] / scales[:, None]).T, wanted, rcond=1e-8)[0] / scales
    whole = wanted - factors @ columns[acting]
    modelled = {
        "inertia": forces.inertia,
        "friction": forces.friction,
        "gravity and springs": -forces.standing,
    }
    parts = {what: (force * weight).reshape(-1)[mask] for what, force in modelled.items()}
    for factor, j in zip(factors, acting, strict=True):
        if spec.inputs[j].name in doubted:
            yield _not_judged(spec.inputs[j].name, spec.inputs[j].name)
            continue
        yield _input(spec.inputs[j].name, float(factor), whole + factor * columns[j], columns[j], outside, parts)


def _not_judged(name: str, doubted: str) -> Finding:
    words = f"Sign and scale of {name} are not judged before the numbers of {doubted} are mended."
    return Finding("info", f"sign and scale of {name}", words)


def _input(
    name: str, factor: float, wanted: Array, given: Array, outside: Outside | None, parts: Mapping[str, Array]
) -> Finding:
    norms = float(np.linalg.norm(wanted) * np.linalg.norm(given))
    correlation = float(wanted @ given) / norms if norms > 0 else 0.0
    figures = {"factor": factor, "correlation": correlation}
    topic = f"sign and scale of {name}"
    if correlation < FLIPPED:
        against, seen = _against(given, parts)
        figures |= {f"against_{what.split()[0]}": value for what, value in seen.items()}
        return Finding("problem", topic, _flipped(name, correlation, against, list(seen)), figures)
    if outside is not None and _blamed(outside, correlation, factor):
        words = (
            f"The scale of {outside.coordinate} seems off: {outside.words}, and the motion takes {factor:.3g} times "
            f"the force that the log's {name} gives. Check unit and scale of {outside.coordinate}, or the envelope."
        )
        return Finding("problem", f"scale of {outside.coordinate}", words, figures | {"times": outside.times})
    if correlation > TELLING and not 1 / SCALE_OFF < factor < SCALE_OFF:
        size = np.abs(given)
        acting = size > ACTING * size.max()
        small = acting & (size <= np.median(size[acting]))
        at_small = float(wanted[small] @ given[small]) / float(given[small] @ given[small])
        figures["factor_at_small_input"] = at_small
        if 1 / SCALE_OFF < at_small < SCALE_OFF:
            words = (
                f"The motion takes {factor:.3g} times the force that the log's {name} gives, but {at_small:.3g} times "
                f"where {name} is small: not its scale, rather a limit or another bend in how it acts."
            )
            return Finding("warning", topic, words, figures)
        words = (
            f"The scale of input {name} is off by a factor of {factor:.3g}: the motion takes that many times the force "
            f"that the log's {name} gives. Check its unit and scale, whether it saturates, and the declared masses and "
            "friction levels."
        )
        return Finding("problem", topic, words, figures)
    if correlation < TELLING:
        words = f"The motion does not tell whether sign and scale of {name} are right (correlation {correlation:.2f})."
        return Finding("info", topic, words, figures)
    words = f"Sign and scale of {name} fit the motion (factor {factor:.3g}, correlation {correlation:.2f})."
    return Finding("info", topic, words, figures)


def _against(given: Array, parts: Mapping[str, Array]) -> tuple[list[str], dict[str, float]]:
    """The modelled forces against which an input's force runs, and the partial correlations of those that show.

    Args:
        given: (K') the input's force. parts: (K') modelled forces that it has to overcome, by name.
    """
    acting = {what: force for what, force in parts.items() if np.any(force)}
    seen = {}
    for what, force in acting.items():
        others = [other for name, other in acting.items() if name != what]
        _, correlation = partial(given, force, np.column_stack([*others, np.ones(len(given))]))
        if abs(correlation) > PART_SEEN:
            seen[what] = correlation
    return [what for what, correlation in seen.items() if correlation < 0], seen


def _flipped(name: str, correlation: float, against: list[str], seen: list[str]) -> str:
    """What is wrong with a sign, as far as the modelled forces that show in the log tell it."""
    fact = f"the force it gives runs against the force that the motion takes (correlation {correlation:.2f})"
    if against == ["gravity and springs"] and len(seen) > 1:
        right = " and ".join(what for what in seen if what not in against)
        return (
            f"The modelled gravity and springs run against the force that input {name} gives, while {right} agree with "
            f"it: the sign of gravity or of a spring in the spec seems wrong, or the zero of a position (half a turn "
            f"off, for a pendulum), and not the sign of {name}. Together {fact}."
        )
    if against and against == seen and ("inertia" in seen or "friction" in seen):
        return f"The sign of input {name} seems flipped, or that of the coordinate it drives: {fact}."
    which = f"only {' and '.join(seen)} can be seen in it" if seen else "no single modelled force can be seen in it"
    if against and against != seen:
        which = f"{' and '.join(against)} run against it and {' and '.join(s for s in seen if s not in against)} do not"
    return (
        f"The sign of input {name} seems flipped, or that of the coordinate it drives, or of a force in the spec: "
        f"{fact}. This log cannot tell which: {which}."
    )


def _blamed(outside: Outside, correlation: float, factor: float) -> bool:
    """Whether a coordinate outside the envelope is the likelier cause than the force compared with its motion."""
    if correlation > TELLING:
        return factor >= SCALE_OFF
    return outside.times >= FAR_OUTSIDE


def _undriven(forces: Forces, spec: Spec, outside: Outside | None) -> Iterator[Finding]:
    for i, c in enumerate(spec.coordinates):
        if np.any(forces.driven[:, :, i]):
            continue
        modelled, inertia = forces.rest[:, i], forces.inertia[:, i]
        norms = float(np.linalg.norm(modelled) * np.linalg.norm(inertia))
        if norms == 0:
            continue
        correlation = float(modelled @ inertia) / norms
        slope = float(modelled @ inertia) / float(modelled @ modelled)
        figures = {"factor": slope, "correlation": correlation}
        topic = f"force on {c.name}"
        if correlation < FLIPPED:
            words = f"The force modelled on {c.name} runs against its acceleration: a sign seems flipped."
            yield Finding("problem", topic, words, figures)
        elif outside is not None and outside.times >= FAR_OUTSIDE and not 1 / SCALE_OFF < slope < SCALE_OFF:
            words = f"The scale of {outside.coordinate} seems off: {outside.words}. Check its unit and scale."
            yield Finding("problem", f"scale of {outside.coordinate}", words, figures | {"times": outside.times})
        elif correlation > TELLING and not 1 / SCALE_OFF < slope < SCALE_OFF:
            words = f"The modelled force on {c.name} is off by a factor of {slope:.3g} against mass times acceleration."
            yield Finding("problem", topic, words, figures)
        else:
            words = f"The force modelled on {c.name} against mass times acceleration: correlation {correlation:.2f}."
            yield Finding("info", topic, words, figures)
