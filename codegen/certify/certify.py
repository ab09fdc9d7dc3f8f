"""Certification of a sampled observer: a common quadratic Lyapunov function in exact numbers, or a refusal.

P is found in floating point, rounded to rationals, and issued only if the independent checker accepts it. A refusal has
its reason and, if one is known, a counterexample.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from codegen.analysis.analysis import Analysis
from codegen.analysis.operating_points import refuse_missing_ranges
from codegen.base.text import render
from codegen.certify.content import Found, Frame, frame, proved
from codegen.certify.cover import by_cover
from codegen.certify.enclosure import Cells, enclose_family
from codegen.certify.family import Family, NotEnclosable, build_family
from codegen.certify.levels import SHARES, about_declared
from codegen.certify.lyapunov import common_lyapunov, least_growth_at_reversals, short_recovery, short_step
from codegen.certify.outcome import Certificate, Proposal, Proposals, Refusal
from codegen.certify.refute import refute, slowest_point
from codegen.certify.region_proofs import Regions, find_regions
from codegen.certify.size_limit import beyond_checker
from codegen.certify.structure import by_structure, without_formula
from codegen.checker import verify
from codegen.mechanics.computed import ComputedEntry
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

__all__ = ["Certificate", "Proposal", "Proposals", "Refusal", "certify", "spectral_rate"]

SLOWER = (1.0, 0.999, 0.99, 0.97, 0.9)
"""Shares of the rate of a proposal that are tried: the rounded P may certify slightly less than P in floating point."""
ENOUGH = 0.9
"""Share of the spectral rate from which a common P is good enough that no P with a cover is searched for."""
MANY, AS_GOOD = 1000, 0.99
"""Number of vertices from which a P with a cover is preferred, and share of the rate that it must have then: a check of
more takes up to seconds, and a cover often has a single cell."""
MOST_TURNING, MOST_ERRORS = 32, 8
"""Largest numbers of matrices and of errors for which one V for all signs of the slips is searched for."""


@numerical("the certificate of these gains over the envelope")
def certify(
    spec: Spec,
    analysis: Analysis,
    files: Mapping[str, str],
    command: str,
    further: bool = True,
    all_angles: bool = False,
) -> Certificate | Refusal:
    """Certify the sampled observer of a spec over its envelope: find P with V = e'Pe decreasing in every sample.

    If the envelope gives no range for the true friction level of a DFO, the level is taken over a range about the
    declared one, the widest for which a V is found (``levels``), else at the declared level alone.

    Args:
        analysis: its error dynamics and their values at sampled operating points.
        files: name → SHA-256 of the generated sources that the certificate is bound to.
        command: the command line, which the certificate records.
        further: whether to search also for one V for all signs of the slips and, after a refusal, for regions.
        all_angles: whether V must decrease at all angles, also beyond the envelope, as the kernel's proof needs.

    Raises:
        BadInput: if the envelope lacks a range for a variable of the error matrix.
    """
    refuse_missing_ranges(spec, analysis.points)
    if beyond := beyond_checker(analysis.dynamics.observer):
        return _undecided(analysis, beyond, narrower=False)
    stated = partial(frame, spec, files, command)
    found = _certified(analysis, stated, further, all_angles)
    if isinstance(found, Certificate) and analysis.dynamics.observer.declared_levels:
        for share in SHARES:
            wider = _certified(about_declared(analysis, share), stated, further, all_angles)
            if isinstance(wider, Certificate):
                return wider
    return found


def _certified(analysis: Analysis, stated: Frame, further: bool, all_angles: bool) -> Certificate | Refusal:
    """Certify at the levels of ``analysis``: by structure, by one V over the envelope, or by regions."""

    def by_parts() -> Regions | None:
        return find_regions(analysis, stated) if further else None

    try:
        family = build_family(analysis.dynamics, analysis.points.ranges)
        base = stated(analysis, family)
    except (NotEnclosable, TypeError) as error:
        if not analysis.stable:
            return _unstable(analysis, None, by_parts())
        if (structured := by_structure(analysis, stated)) is None:
            refusal = _inexpressible(analysis, error)
            computed = analysis.dynamics.observer.system.mass_matrix.has(ComputedEntry)
            return replace(refusal, reason=f"{refusal.reason}; {without_formula(analysis)}") if computed else refusal
        content, report = structured
        rate = float(Fraction(content["decay_rate"]))
        return Certificate(content, rate, spectral_rate(analysis), report.facts, by_structure=True)
    slowest = slowest_point(analysis, family)
    limit = refute(analysis, slowest, base) if slowest is not None else None
    if not analysis.stable:
        return _unstable(analysis, limit, by_parts())
    spectral = min([spectral_rate(analysis), *([] if slowest is None else [slowest.rate])])
    try:
        cells = enclose_family(family)
        proposal = common_lyapunov(cells.matrices, analysis.dynamics.period)
        common = None if proposal is None else Found(family, *proposal, cells.splits, matrices=cells.matrices)
    except NotEnclosable as error:
        return replace(_inexpressible(analysis, error), regions=by_parts())
    except verify.Refused as error:
        return replace(_undecided(analysis, str(error)), regions=by_parts())
    why = "no quadratic Lyapunov function was found that decreases at every operating point of the envelope"
    found_first = _proposals(analysis, family, cells, common, spectral, all_angles)
    for candidate, share in ((each, share) for each in found_first for share in SLOWER):
        try:
            ((content, report),) = proved([(base, replace(candidate, rate=share * candidate.rate))], analysis)
        except verify.Refused as error:
            why = f"a Lyapunov function was found, and the checker refuses it once its numbers are rounded ({error})"
            continue
        found = Certificate(
            content,
            float(Fraction(content["decay_rate"])),
            spectral,
            report.facts,
            limit,
            best_rate=candidate.best_rate,
            functions=tuple(str(e) for s, e in candidate.family.bounded.items() if s in candidate.family.variables),
        )
        return _with_all_signs(found, base, analysis, family, cells) if further else found
    return replace(_undecided(analysis, why), regions=by_parts())


def _proposals(
    analysis: Analysis, family: Family, cells: Cells, common: Found | None, spectral: float, all_angles: bool
) -> Iterator[Found]:
    """Candidates for P, the preferred one first: with a cover, with short dwell times at reversals, then ``common``.

    Args:
        spectral: the spectral rate, 1/s.
        all_angles: whether only those are wanted that hold at all angles.
    """
    observer, h = analysis.dynamics.observer, analysis.dynamics.period
    long = len(cells.matrices) > MANY
    if h and (all_angles or common is None or common.rate < ENOUGH * spectral or long):
        over = by_cover(family, observer.sample_time)
        if over is not None and (all_angles or common is None or common.rate * (AS_GOOD if long else 1) < over.rate):
            yield over
    if common is None or all_angles:
        return
    matrices = cells.matrices
    if len(matrices) == 1 and observer.level_errors:  # V grows at a reversal: prefer the P with the shortest dwell time
        contacts = range(len(observer.signs))
        flips = ([k for k, e in enumerate(observer.errors) if e.contact == c] for c in contacts)
        turned = [each for each in flips if each]
        step = h or short_step(matrices[0])
        fastest = least_growth_at_reversals(matrices[0], step, turned)
        slower = short_recovery(matrices[0], step, turned, common.p if fastest is None else fastest)
        if slower is not None:
            yield replace(common, p=slower[0], rate=slower[1], best_rate=SLOWER[1] * common.rate)
        if fastest is not None:
            yield replace(common, p=fastest)
    yield common


def _with_all_signs(
    found: Certificate, base: Mapping[str, Any], analysis: Analysis, family: Family, cells: Cells
) -> Certificate:
    """The certificate with one V for both signs of every slip added, if one is found.

    A reversal of contact c changes A to J_c A J_c, J_c diagonal with −1 at the errors of c. If V = e'Pe decreases for
    all signs, so does V with the mean of J P J over all products J of the J_c. This mean has no entry between errors
    of two contacts, or of a contact and a velocity: it is enough to search for a P of this pattern. The sample in
    which a slip changes its sign is not covered.
    """
    observer, h = analysis.dynamics.observer, analysis.dynamics.period
    contacts = [e.contact for e in observer.errors]
    kept = np.array([[a == b for b in contacts] for a in contacts])
    few = len(kept) <= MOST_ERRORS and len(cells.matrices) <= MOST_TURNING
    if not observer.level_errors or kept.all() or not few:
        return found
    if (common := common_lyapunov(cells.matrices, h, kept)) is not None:
        with suppress(verify.Refused):
            part = base, Found(family, *common, cells.splits, matrices=cells.matrices)
            return replace(found, turning=proved([part], analysis, turning=True)[0][0])
    return found


def spectral_rate(analysis: Analysis) -> float:
    """Spectral rate, 1/s: the largest α that any P could certify at the worst sampled operating point.

    (1 − ρ²)/(2h) with ρ the spectral radius of I + hA there; for the implicit step min −Re λ, λ eigenvalues of A.
    """
    radius, h = analysis.spectral_radius, float(analysis.dynamics.observer.sample_time)
    if analysis.dynamics.implicit:
        return analysis.implicit_rate
    return (1 - radius**2) / (2 * h)


def _inexpressible(analysis: Analysis, error: Exception) -> Refusal:
    """The refusal of error dynamics that the certificate format cannot express."""
    known = isinstance(error, NotEnclosable)  # else a TypeError of ``to_prefix``, which names a function or power
    why = str(error) if known else f"the error dynamics contain {error}, which a certificate cannot state"
    return _undecided(analysis, why, narrower=False)


def _unstable(analysis: Analysis, proof: Mapping[str, Any] | None, regions: Regions | None) -> Refusal:
    """The refusal of an unstable observer, with the refutation that the checker accepts, if there is one."""
    fails = [c for c in (*analysis.routh, *analysis.jury) if not c.holds]
    failing = tuple(  # a condition on both Psi and the step is listed once
        dict.fromkeys(f"{c.expression} > 0" if c.readable else f"{c.label} > 0" for c in fails)
    )
    declared = {s.name for s in analysis.dynamics.observer.system.values}
    names = {s.name for c in fails if c.readable for s in c.expression.free_symbols} - declared
    coefficients = sorted(name for name in names if re.fullmatch(r"c\d+", name))
    short = bool(coefficients) or not all(c.readable for c in fails)
    view = {"analysis": analysis, "failing": failing, "regions": regions, "coefficients": coefficients, "short": short}
    return Refusal(
        reason=render("text/refused_unstable.j2", **view).strip(),
        counterexample=None if proof is None else {name: ends[0] for name, ends in proof["variables"].items()},
        spectral_radius=analysis.spectral_radius,
        failing=failing,
        largest_sample_time=analysis.largest_sample_time,
        proof=proof,
        regions=regions,
    )


def _undecided(analysis: Analysis, why: str, narrower: bool = True) -> Refusal:
    """The refusal of an observer neither certified nor shown unstable; ``narrower``: a narrower envelope might help."""
    reason = render("text/refused_undecided.j2", why=why, analysis=analysis, narrower=narrower).strip()
    return Refusal(reason, None, analysis.spectral_radius, (), analysis.largest_sample_time)
