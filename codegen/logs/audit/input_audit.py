"""Preflight of the sign and scale of each input, and of the force on each coordinate on which none acts.

The least-squares factor between the force that the motion requires and the force of the input is near one if sign and
scale are right, also if friction is larger than inertia. If a coordinate exceeds the spec's envelope by ``SCALE_OFF``
or more, the finding is about that coordinate and not the input.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import log
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import Place
from codegen.logs.audit.force_balance import Forces, correlation, hat_functions, partial_correlation
from codegen.logs.log import Finding, Log, Severity
from codegen.spec.column_units import is_convertible
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree
from codegen.spec.units import si_factor

FLIPPED, MATCHED = -0.4, 0.6
"""Correlations of a force with the required force: its sign is wrong below the first, and right above the second."""
SCALE_OFF = 3.0
"""Factor on a force, either way, from which on its scale is wrong."""
FAR_OUTSIDE = 10.0
"""Ratio to the envelope from which on a coordinate's scale is wrong even if the forces do not show it."""
ACTING = 1e-3
"""Share of its largest force below which an input is zero except for what the low-pass leaves."""
KNOTS = 20
"""Number of knots of a piecewise linear function of the position."""
PART_SEEN = 0.2
"""Partial correlation of a modelled force with the input's force, from which on it shows in a log."""
PREFIXES = ("", "u", "m", "k", "M")
"""SI prefixes of the units that are tried."""
NEAR_UNIT = 1.5
"""Largest ratio of the found factor to a unit's at which the unit is proposed; else a parameter may be wrong."""


def audit_inputs(forces: Forces, spec: Spec, outside: Finding | None, log: Log) -> Iterator[Finding]:
    """Findings on the sign and scale of each input that changes, by least squares of the required force on all.

    ``outside``: the beginning of a finding on the coordinate furthest outside the envelope, with the ratio ``times``.
    """
    if not len(forces.driven):
        return
    by_motion = forces.inertia - forces.undriven  # (K, n) the force that the motion requires of the inputs
    size = np.sqrt(np.mean(by_motion**2, axis=0))
    weight = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
    rows = np.tile(np.any(forces.driven != 0, axis=(0, 1)), len(by_motion))  # coordinates that some input drives

    def stacked(force: Array) -> Array:
        """(K') a force, (K, n), on the driven coordinates one after another, each over the RMS that it requires."""
        return np.asarray((force * weight).reshape(-1)[rows])

    columns = (forces.driven * weight).reshape(len(spec.inputs), -1)[:, rows]
    acting = [j for j in range(len(spec.inputs)) if np.any(columns[j])]
    if not acting:
        return
    # Least squares: required = Σ factor_j · force of input j.
    required = stacked(by_motion)
    scales = np.linalg.norm(columns[acting], axis=1)
    factors = np.linalg.lstsq((columns[acting] / scales[:, None]).T, required, rcond=1e-8)[0] / scales
    unexplained = required - factors @ columns[acting]
    modelled = {"inertia": forces.inertia, "friction": forces.friction, "gravity and springs": -forces.static}
    parts = {what: stacked(force) for what, force in modelled.items()}
    for factor, j in zip(factors, acting, strict=True):
        name = spec.inputs[j].name
        if is_constant(log.inputs[:, j]):
            continue
        if name in log.raw_data.doubted:
            yield not_judged(name, f"the numbers of {name} are corrected")
            continue
        own = unexplained + factor * columns[j]  # the required force less that of the other inputs
        found = _finding_on(name, float(factor), own, columns[j], outside, parts, spec, log)
        own_problem = found.severity == "problem" and found.topic == f"sign and scale of {name}"
        if own_problem and factor > 0:
            losses = np.array([stacked(loss) for loss in _losses(forces, j)])
            found = _with_losses(name, own, columns[j], losses, found)
        if own_problem and factor < 0 and found.figures.get("against_gravity", 0.0) >= 0:
            curves = np.array([stacked(curve) for curve in _over_positions(forces, j)])
            found = _with_undeclared(name, own, columns[j], curves, found)
        if found.severity == "problem" and factor > 0 and _are_links_wrong(forces, spec, j, float(factor)):
            found = _finding("warning", found.topic, found.figures, "links", name=name, factor=factor)
        yield found


def _finding(severity: Severity, topic: str, figures: Mapping[str, float], say: str, **words: Any) -> Finding:
    """A finding in words of templates/text/input_audit.j2, as by ``Finding.worded``."""
    return Finding.worded(severity, topic, "input_audit", say, figures, **words)


def is_constant(values: Array) -> bool:
    """Whether an input, (K,), has one value throughout, so that a log shows neither its sign nor its scale."""
    low, high = float(values.min()), float(values.max())
    return high - low <= 1e-9 * max(abs(low), abs(high))


def _losses(forces: Forces, j: int) -> Iterator[Array]:
    """(K, n) velocity, and declared friction, of each coordinate that input j drives: losses, for a fit."""
    n = forces.inertia.shape[1]
    return _on_driven(forces, j, lambda i: np.column_stack([forces.motion[:, n + i], forces.friction[:, i]]))


def _with_losses(name: str, required: Array, applied: Array, losses: Array, found: Finding) -> Finding:
    """The finding on an input's scale as a warning if it is right with losses fitted too; else unchanged.

    A motor at a voltage has the damping k²/R of its back-EMF. Without it in the spec the motion takes a small part of
    the input's force; with a multiple of it, it takes a multiple. Its inertia shows the scale: of input and losses
    together the input's factor is then near one.

    Args:
        required, applied: (K') force that the motion requires, and that of the input.
        losses: (2d, K') speed, and declared friction, of each of d coordinates.
    """
    factor, partial = partial_correlation(required, applied, losses.T)
    if partial < MATCHED or not 1 / SCALE_OFF < factor < SCALE_OFF:
        return found
    figures, near = {**found.figures, "factor_beside_losses": factor}, 1 / NEAR_UNIT < factor < NEAR_UNIT
    whole = found.figures["factor"]
    return _finding("warning", found.topic, figures, "losses", name=name, whole=whole, factor=factor, near=near)


def _over_positions(forces: Forces, j: int) -> Iterator[Array]:
    """(K, n) piecewise linear functions of the position of each coordinate driven by input j."""
    return _on_driven(forces, j, lambda i: hat_functions(forces.motion[:, i], KNOTS))


def _on_driven(forces: Forces, j: int, terms: Callable[[int], Array]) -> Iterator[Array]:
    """(K, n) each of the ``terms``, (K, k), on each coordinate driven by input j."""
    for i in np.flatnonzero(np.any(forces.driven[j] != 0, axis=0)):
        for term in terms(int(i)).T:
            force = np.zeros_like(forces.inertia)
            force[:, i] = term
            yield force


def _with_undeclared(name: str, required: Array, applied: Array, curves: Array, found: Finding) -> Finding:
    """The finding on an input's sign as a warning if it is right with a force over the position fitted too.

    Else unchanged. Example: a motor holds a weight or a spring that the spec lacks, and moves slowly. Its force then
    opposes that one most of the time, and correlates negatively with the inertia force, although its sign is right.

    Args:
        required, applied: (K') force that the motion requires, and that of the input.
        curves: (k, K') those of ``_over_positions``.
    """
    factor, partial = partial_correlation(required, applied, curves.T)
    if partial < MATCHED or not 1 / SCALE_OFF < factor < SCALE_OFF:
        return found
    figures, fit = {**found.figures, "factor_beside_positions": factor}, found.figures["correlation"]
    return _finding("warning", found.topic, figures, "undeclared", name=name, fit=fit, factor=factor)


def _are_links_wrong(forces: Forces, spec: Spec, j: int, factor: float) -> bool:
    """Whether friction shows that the links of an arm have other masses, as with a load, and no wrong scale of input j.

    Of an input that is logged c times too large, friction is found c times too large as well, and ``factor`` is 1/c.
    Wrong masses leave the friction as declared. False where the links have no tolerance: their masses are not fitted.
    """
    if not isinstance(spec.form, KinematicTree) or spec.form.tolerance is None:
        return False
    moved = [i for i in range(len(spec.coordinates)) if np.any(forces.driven[j, :, i])]
    found = [forces.friction_factor(i) for i in moved]
    return all(seen > PART_SEEN and abs(log(level)) < abs(log(level * factor)) for level, seen in found)


def not_judged(name: str, before: str) -> Finding:
    """The finding on an input that cannot be judged; ``before``: what must be done for that, as a clause."""
    return _finding("info", f"sign and scale of {name}", {}, "not judged", name=name, before=before)


def _finding_on(
    name: str,
    factor: float,
    required: Array,
    applied: Array,
    outside: Finding | None,
    parts: Mapping[str, Array],
    spec: Spec,
    log: Log,
) -> Finding:
    """The finding on one input by the least-squares ``factor`` of its force to the force ``required``."""
    fit = correlation(required, applied)
    figures = {"factor": factor, "correlation": fit}
    topic = f"sign and scale of {name}"
    if fit < FLIPPED:
        seen = _shown_forces(applied, parts)
        figures |= {f"against_{what.split()[0]}": value for what, value in seen.items()}
        line = f"({log.scale_lines({name: -1.0}, spec)} in meta.yaml beside the log reverses {name}.)"
        opposed = [what for what, value in seen.items() if value < 0]
        return _finding(
            "problem", topic, figures, "sign", name=name, fit=fit, seen=list(seen), opposed=opposed, line=line
        )
    matched = fit > MATCHED
    if outside is not None and (factor >= SCALE_OFF if matched else outside.figures["times"] >= FAR_OUTSIDE):
        about = {"outside": outside.words, "factor": factor, "name": name}
        return _finding(outside.severity, outside.topic, {**figures, **outside.figures}, "outside", **about)
    if matched and not 1 / SCALE_OFF < factor < SCALE_OFF:
        return _wrong_scale(name, figures, required, applied, spec, log)
    return _finding("info", topic, figures, "not shown" if fit < MATCHED else "fits", name=name, factor=factor, fit=fit)


def _wrong_scale(
    name: str, figures: Mapping[str, float], required: Array, applied: Array, spec: Spec, log: Log
) -> Finding:
    """The finding on an input of which the motion takes another multiple than one; ``figures`` as of ``_finding_on``.

    The factor is computed again where the input is below the median of its size: a limit of the input does not act
    there, a wrong scale does.
    """
    topic, factor, size = f"sign and scale of {name}", figures["factor"], np.abs(applied)
    acting = size > ACTING * size.max()
    small = acting & (size <= np.median(size[acting]))
    at_small = float(required[small] @ applied[small]) / float(applied[small] @ applied[small])
    figures = {**figures, "factor_at_small_input": at_small}
    if 1 / SCALE_OFF < at_small < SCALE_OFF:
        return _finding("warning", topic, figures, "limit", name=name, factor=factor, at_small=at_small)
    remedy = _unit_or_scale(name, factor, spec, log)
    return _finding("problem", topic, figures, "scale", name=name, factor=factor, remedy=remedy)


def _shown_forces(applied: Array, parts: Mapping[str, Array]) -> dict[str, float]:
    """The partial correlations of an input's force with the modelled forces (name → (K')), of those that show in it."""
    acting = {what: force for what, force in parts.items() if np.any(force)}
    found = {}
    for what, force in acting.items():
        others = [other for name, other in acting.items() if name != what]
        found[what] = partial_correlation(applied, force, np.column_stack([*others, np.ones(len(applied))]))[1]
    return {what: correlation for what, correlation in found.items() if abs(correlation) > PART_SEEN}


def audit_undriven(forces: Forces, spec: Spec, outside: Finding | None) -> Iterator[Finding]:
    """Findings on the modelled force on each coordinate on which no input acts."""
    for i, c in enumerate(spec.coordinates):
        if np.any(forces.driven[:, :, i]):
            continue
        modelled, inertia = forces.undriven[:, i], forces.inertia[:, i]
        if not (np.any(modelled) and np.any(inertia)):
            continue
        fit, slope = correlation(modelled, inertia), float(modelled @ inertia) / float(modelled @ modelled)
        figures, off = {"factor": slope, "correlation": fit}, not 1 / SCALE_OFF < slope < SCALE_OFF
        topic, about = f"force on {c.name}", {"name": c.name, "factor": slope, "fit": fit}
        if fit < FLIPPED:
            yield _finding("problem", topic, figures, "undriven sign", **about)
        elif outside is not None and outside.figures["times"] >= FAR_OUTSIDE and off:
            figures |= outside.figures
            yield _finding(outside.severity, outside.topic, figures, "undriven outside", outside=outside.words)
        elif fit > MATCHED and off:
            yield _finding("problem", topic, figures, "undriven scale", **about)
        else:
            yield _finding("info", topic, figures, "undriven", **about)


def _unit_or_scale(name: str, factor: float, spec: Spec, log: Log) -> str:
    """The advice on a wrong scale: another SI prefix of the input's unit if one fits, else the line with the factor."""
    own = spec.units[name]
    usual = [] if own in ("", "1") else [prefix + own for prefix in PREFIXES]
    for unit, by in other_units(log.units.get(name, own), usual):
        if 1 / NEAR_UNIT < by / factor < NEAR_UNIT:
            return f"Is {name} in {unit}? (`units: {{{name}: {unit}}}` in meta.yaml beside the log)"
    return f"({log.scale_lines({name: factor}, spec)} in meta.yaml beside the log corrects a scale.)"


def other_units(unit: str, usual: Sequence[str]) -> list[tuple[str, float]]:
    """The units of the same kind among ``usual``, without ``unit``, with the factor on values read in ``unit``."""
    here = Place("")
    found = [other for other in usual if other != unit and is_convertible(other, unit)]
    return [(other, float(si_factor(other, here) / si_factor(unit, here))) for other in found]
