"""Observer → certificate in exact numbers, or a refusal with its reason and a counterexample.

The proposal is made in floating point; what is handed out has passed the independent checker.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from typing import Any

from codegen.analysis.analysis import Analysis
from codegen.base.errors import BadInput
from codegen.base.text import render
from codegen.certify.content import Found, frame, proved
from codegen.certify.enclosure import Cells
from codegen.certify.exact import unstable_point
from codegen.certify.family import Family, NotEnclosable, build_family
from codegen.certify.levels import SHARES, about_declared, over_levels
from codegen.certify.outcome import PROOFS, Certificate, Proposal, Proposals, Refusal, json_text
from codegen.certify.refute import rational_points, refute, slowest_point
from codegen.certify.region_proofs import Regions, find_regions
from codegen.certify.search import proposals_for
from codegen.certify.size import beyond_checker
from codegen.certify.structure import by_structure
from codegen.certify.turning import none_through_turns, through_turns, turns
from codegen.checker import verify
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

__all__ = [
    "PROOFS",
    "Certificate",
    "Proposal",
    "Proposals",
    "Refusal",
    "certify",
    "json_text",
    "spectral_rate",
]

SLOWER = (0.999, 0.99, 0.97, 0.9)


@numerical("the certificate of these gains over the envelope")
def certify(
    spec: Spec,
    analysis: Analysis,
    files: Mapping[str, str],
    command: str,
    further: bool = True,
    places: Mapping[str, str] | None = None,
) -> Certificate | Refusal:
    """Certify the sampled observer of a spec over its envelope.

    A DFO that is certified at its declared levels, the envelope giving no range for them, is certified about them where
    a V is found for that (``levels``).

    Args:
        analysis: of the spec's observer.
        files: name → SHA-256 of the generated sources that the certificate is bound to.
        command: that writes it.
        further: whether to look for one function for all signs of the slips too, and after a refusal for regions.
        places: where the code has its inputs and outputs; None where the certificate need not say.

    Raises:
        BadInput: if the envelope lacks a range for something that Ψ depends on.
    """
    points = analysis.points
    if points.missing:
        names = [s.name for s in points.missing]
        ranges = " and ".join(f"`{name}: [low, high]`" for name in names)
        depends = "it" if len(names) == 1 else "them"
        raise BadInput(
            spec.place("envelope"),
            f"no range for {', '.join(names)}",
            f"{ranges}, since Ψ depends on {depends}",
            code="SPEC026",
        )
    if beyond := beyond_checker(analysis.dynamics.observer):
        return _undecided(analysis, beyond, narrower=False)
    found = _certified(spec, analysis, files, command, further, places)
    if isinstance(found, Certificate) and analysis.dynamics.observer.declared_levels:
        for share in SHARES:
            wider = over_levels(analysis, about_declared(analysis, share))
            if isinstance(over := _certified(spec, wider, files, command, further, places), Certificate):
                return over
    return found


def _certified(
    spec: Spec,
    analysis: Analysis,
    files: Mapping[str, str],
    command: str,
    further: bool,
    places: Mapping[str, str] | None,
) -> Certificate | Refusal:
    points = analysis.points
    base: dict[str, Any] | None = None
    try:
        family = build_family(analysis.dynamics, points.ranges)
        base = frame(spec, analysis, family, files, command, places)
    except (NotEnclosable, TypeError) as error:
        if analysis.stable:
            structured = by_structure(spec, analysis, files, command)
            return _no_words(analysis, error) if structured is None else _vouched(analysis, structured)

    def by_parts() -> Regions | None:
        return find_regions(spec, analysis, files, command) if further else None

    slowest = slowest_point(analysis, family) if base is not None else None
    limit = refute(analysis, slowest, base) if slowest is not None and base is not None else None
    if not analysis.stable or base is None:
        return _unstable(analysis, limit, by_parts())
    spectral = min([spectral_rate(analysis), *([] if slowest is None else [slowest.rate])])
    try:
        cells, proposals = proposals_for(analysis, family, spectral)
    except NotEnclosable as error:
        return replace(_no_words(analysis, error), regions=by_parts())
    except verify.Refused as error:
        return replace(_undecided(analysis, str(error)), regions=by_parts())
    why = "no quadratic Lyapunov function common to the whole envelope was found"
    for proposal in (slower for found in proposals for slower in _also_slower(found)):
        try:
            content, report = proved(base, analysis, family, proposal)
        except verify.Refused as error:
            why = f"the matrix that was found fails the check in exact arithmetic ({error})"
            continue
        found = Certificate(content, float(Fraction(content["decay_rate"])), spectral, report.facts)
        found = replace(found, limit=limit)
        return _with_turning(found, base, analysis, family, cells) if further else found
    return replace(_undecided(analysis, why), regions=by_parts())


def _also_slower(found: Found) -> Iterator[Found]:
    """A proposal, then its P at slower rates: rounding can spoil the last thousandth of what a P shows in floats."""
    yield found
    for share in SLOWER:
        yield replace(found, alpha=share * found.alpha)


def _with_turning(
    found: Certificate, base: Mapping[str, Any], analysis: Analysis, family: Family, cells: Cells
) -> Certificate:
    """The certificate with what is known of one V for all signs of the slips."""
    observer = analysis.dynamics.observer
    if not turns(observer):
        return found
    if any(none_through_turns(observer, exact) for _, exact in islice(rational_points(analysis, family), 1)):
        return replace(found, no_turning=True)
    serving = through_turns(observer, cells)
    if serving is not None:
        proposal = Found(serving[1], cells.splits, [serving[0]])
        with suppress(verify.Refused):
            return replace(found, turning=proved(base, analysis, family, proposal, turning=True)[0])
    return found


def _vouched(analysis: Analysis, content: Mapping[str, Any]) -> Certificate:
    facts = verify.check(json.dumps(content)).facts
    rate = float(Fraction(content["decay_rate"]))
    return Certificate(content, rate, spectral_rate(analysis), facts, by_structure=True)


def spectral_rate(analysis: Analysis) -> float:
    """The largest decay rate that any P could show, from the worst operating point alone, 1/s."""
    radius, h = analysis.spectral_radius, float(analysis.dynamics.observer.sample_time)
    if analysis.dynamics.implicit:
        return analysis.implicit_rate
    return (1 - radius**2) / (2 * h)


def _no_words(analysis: Analysis, error: Exception) -> Refusal:
    why = str(error) if isinstance(error, NotEnclosable) else f"a certificate cannot express {error}"
    return _undecided(analysis, why, narrower=False)


def _unstable(analysis: Analysis, proof: Mapping[str, Any] | None, regions: Regions | None) -> Refusal:
    point = unstable_point(analysis)
    failing = tuple(
        dict.fromkeys(  # one that Psi and the step share is said once
            f"{c.expression} > 0" if c.readable else f"{c.name} > 0"
            for c in (*analysis.routh, *analysis.jury)
            if not c.holds
        )
    )
    return Refusal(
        reason=render("text/refused_unstable.j2", analysis=analysis, failing=failing, regions=regions).strip(),
        counterexample=point,
        spectral_radius=analysis.spectral_radius,
        failing=failing,
        largest_sample_time=analysis.largest_sample_time,
        proved=point is not None,
        proof=proof,
        regions=regions,
    )


def _undecided(analysis: Analysis, why: str, narrower: bool = True) -> Refusal:
    """``narrower``: whether a narrower envelope might change it."""
    reason = render("text/refused_undecided.j2", why=why, analysis=analysis, narrower=narrower).strip()
    return Refusal(reason, None, analysis.spectral_radius, (), analysis.largest_sample_time, False)
