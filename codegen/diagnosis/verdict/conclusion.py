"""Results of a diagnosis from the outcome of forward selection: verdict, named effects, candidates, what is left."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from math import floor, isfinite, log10, sqrt

from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.estimate import effect_of
from codegen.diagnosis.evidence.force_evidence import ForceGain, force_evidence, force_gain
from codegen.diagnosis.evidence.score_test import nested_evidence_of
from codegen.diagnosis.fit import credit
from codegen.diagnosis.fit.credit import noise_ratio
from codegen.diagnosis.fit.measure import force_errors
from codegen.diagnosis.fit.output_error import Fit, at_limit
from codegen.diagnosis.fit.residual import Problem, contacts_on, residual_without_levels
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import Candidate, FoundEffect, Remainder, Round, Verdict
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked, twins
from codegen.diagnosis.selection.significance import chance
from codegen.diagnosis.verdict.wrong_values import FAR_LESS
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of
from codegen.effects.places import pairs
from codegen.effects.register import is_own
from codegen.logs import Log
from codegen.mechanics.system import System

TABLE_SIZE = 12
"""Candidates in the table of a round."""
MOST = 0.5
"""Least share, of what a flexible regression on an effect's own variable explains, that the effect must remove."""
SOME = 0.1
"""Share of the squared remainder; a variable that explains less is reported only if its force is material."""
MOST_CHANGES = 2
"""Most changes in time that a verdict names."""


def best_refused(outcome: Outcome) -> tuple[str, str, str] | None:
    """(kind and form, on, why not) of the refused candidate that explains most, ``LEAST_SHARE`` at least."""
    refused = [r for r in outcome.first if r.why_not and r.evidence.share >= credit.LEAST_SHARE]
    if not refused:
        return None
    most = max(refused, key=lambda r: r.evidence.share)
    part = most.found.part
    return f"{part.kind} with {part.form}" if part.form else part.kind, part.on, most.why_not


def main_variables(left: Remainder, material: float) -> list[tuple[str, float]]:
    """Variables that explain a large share of the squared remainder, or a material force; the best first.

    Without time where changes in time are material: ``changes_in_words`` describes these.
    """
    told = ("time",) if left.is_changing(material) else ()
    shares = [(name, share) for name, share in left.over.items() if name not in told]
    many = [(name, share) for name, share in shares if share >= SOME or left.share * sqrt(share) >= material]
    return sorted(many, key=lambda one: -one[1])


def changes_in_words(left: Remainder, system: System, i: int, material: float, log: Log | None = None) -> list[str]:
    """The ``MOST_CHANGES`` largest changes in time of a coordinate's force balance, each with its times."""
    if not left.is_changing(material):
        return []
    force, speed = system.force_unit(i), f"{system.force_unit(i)}*s/{system.position_units[i]}"
    words = []
    for change in left.changes[:MOST_CHANGES]:
        size, more = f"{abs(change.coefficient):.3g}", change.coefficient > 0
        match change.term:
            case "force":
                what = f"a force of {'-' if more else '+'}{size} {force} acts that the model lacks"
            case "inertia":
                share = f"{in_percent(abs(change.coefficient))} of the declared one"
                what = f"the inertia is {'larger' if more else 'smaller'} by {share}"
            case "friction level":
                what = f"the friction level is {size} {force} {'higher' if more else 'lower'}"
            case _:
                what = f"the viscous friction is {size} {speed} {'larger' if more else 'smaller'}"
        compared = "" if change.term == "force" else " than in the rest"
        words.append(f"{interval_in_words(change.start, change.stop, log)} {what}{compared}")
    further = len(left.changes) - len(words)
    return [*words, *([f"and so on in {further} further interval{'s' * (further > 1)}"] if further else [])]


def interval_in_words(start: float, stop: float, log: Log | None) -> str:
    """An interval in words, by the time of the file in which it lies where the log has several."""
    if log is None or not log.records:
        return f"from {_at(start, stop - start)} s to {_at(stop, stop - start)} s"
    (one, first), (other, last) = log.in_record(start), log.in_record(stop, ends=True)
    begins, ends = (_at(t, stop - start) for t in (first, last))
    if one is other:
        return f"from {begins} s to {ends} s of {one.path.name}"
    return f"from {begins} s of {one.path.name} to {ends} s of {other.path.name}"


def _at(time: float, span: float) -> str:
    """A time of the log to a hundredth of a span, to four digits at least: a log may count from 1970."""
    digits = 3 + floor(log10(max(abs(time), span))) - floor(log10(span)) if span > 0 else 0
    return f"{time:.{min(max(4, digits), 15)}g}"


def worst(left: Sequence[Remainder], material: float) -> int:
    """Index of the coordinate with the most material structure left; where there is none, with the most force left."""

    def rank(k: int) -> tuple[bool, float]:
        one = left[k]
        structured = one.nature(material) == "structured"
        return structured, (one.material if structured else one.share if isfinite(one.share) else -1.0)

    return max(range(len(left)), key=rank)


def acts_on(effect: FoundEffect, system: System) -> int:
    """Index of the first coordinate in whose force balance an effect appears."""
    kind = CATALOGUE[effect.kind].with_parameters(list(effect.parameters))
    place = places_of(kind, system).index(effect.on)
    match kind.sits_on:
        case "contact":
            touched = [i for i in range(system.degrees_of_freedom) if place in contacts_on(system, i)]
        case "input":
            touched = [i for i, g in enumerate(system.force) if g.has(system.inputs[place])]
        case "two coordinates":
            touched = [pairs(system)[place][0]]
        case _:
            touched = [place]
    return touched[0] if touched else 0


def verdict_of(outcome: Outcome, faults: bool) -> Verdict:
    """The verdict by forward selection; ``unfit`` where log and spec do not fit together."""
    if faults:
        return "unfit"
    if not outcome.parts:
        return "unknown" if outcome.unexplained else "none"
    return "ambiguous" if outcome.rivals else "effect"


def is_small(left: Sequence[Remainder], material: float) -> bool:
    """Whether the part of the residual force that the motion predicts is below the material share on every coordinate.

    Coordinates that move too little to be judged are left out; where none is judged the answer is no.
    """
    judged = [r.material for r in left if isfinite(r.material)]
    return bool(judged) and max(judged) < material


def settled_by_free_runs(final: Fit, share: float, problem: Problem, refit: System, augmented: System) -> bool:
    """``free_runs_settle`` for effects that remove this share of the squared free-run residual."""
    return credit.free_runs_settle(final, share, _gain(problem, refit, augmented).left)


def _gain(problem: Problem, before: System, after: System) -> ForceGain:
    one, other = (residual_without_levels(problem, s) for s in (before, after))
    return force_gain(problem, one, other)


def force_agrees(final: Fit, problem: Problem, refit: System, augmented: System) -> bool:
    """Whether the force residual confirms effects that free runs credit: its square falls by ``LEAST_SHARE`` too.

    Not asked of backlash, since in the gap no log shows where the load is. At the noise of free runs it is mostly noise
    of the differentiation and must only not contradict; there a load behind a spring is not tested.
    """
    if any(t.gap != 0 for t in augmented.transmissions):
        return True
    near = noise_ratio(final) <= credit.NEAR_NOISE
    if near and augmented.transmissions:
        return True
    before, after = (force_errors(s, problem.motion, problem.used)[2] for s in (refit, augmented))
    if after**2 <= (1 - credit.LEAST_SHARE) * before**2:
        return True
    return near and _gain(problem, augmented, refit).p > credit.TIE_LEVEL


def against_regression(
    outcome: Outcome, problem: Problem, refit: System, augmented: System, named: Sequence[FoundEffect]
) -> str:
    """The objection of a nonparametric regression to effects, in words; empty if there is none.

    There are three objections. Backlash is exempt.

    - A smooth curve over the effects' own variables explains much more than they do (not tested near the noise of the
      free runs).
    - A spectral line, a vibration in time, explains more, and the effects explain little in addition. A controller
      reacts to a vibration, so a delayed input can cancel it down to a few times the noise. Near the noise the line
      must leave less than ``FAR_LESS`` of the square that the effects leave.
    - A slow change in time leaves less than ``FAR_LESS`` of the square that the effects leave, and they explain little
      in addition. What a true effect leaves is noise, which no such curve explains.
    """
    if any(t.gap != 0 for t in augmented.transmissions):
        return ""
    near = noise_ratio(outcome.final) <= credit.NEAR_NOISE
    acting = [acts_on(effect, problem.system) for effect in named]
    for one in force_evidence(problem, refit, augmented, [effect.kind for effect in named], acting):
        if not near and one.removed < MOST * one.own:
            return "a smooth curve over its own variable explains twice as much of the residual force as the law does"
        vibration, drift = f"a vibration of constant frequency, {one.line_hz:.3g} Hz,", "a slow change in time"
        for what, most, share, both in (
            (vibration, FAR_LESS if near else 1.0, one.line, one.with_line),
            (drift, FAR_LESS, one.time, one.with_time),
        ):
            if 1 - share < most * (1 - one.alone) and both - share < MOST * one.alone:
                return (
                    f"{what} explains {100 * share:.0f} % of the residual force. The law explains "
                    f"{in_percent(one.alone)}, and only {in_percent(max(0.0, both - share))} in addition to that"
                )
    return ""


def rivals_of(outcome: Outcome, tied: Sequence[Fit], system: System) -> tuple[FoundEffect, ...]:
    """The rivals of the first effect, with the values of the fits ``tied`` in its place where there are such fits."""
    first = [(fit.trial.parts[0], fit.values[1][0]) for fit in tied[1:]]
    others = [(r.found.part, r.found.parameters) for r in outcome.rivals[len(first) :]]
    return tuple(effect_of(part, values, system) for part, values in (*first, *others))


def candidates(outcome: Outcome, system: System, verdict: Verdict) -> tuple[Candidate, ...]:
    """The table of candidates, best first; always with a user's own effects."""
    ranked = _listed(outcome, outcome.first)
    kept = [r for k, r in enumerate(ranked) if k < TABLE_SIZE or is_own(r.found.part.kind)]
    tried = {(r.found.part.kind, r.found.part.on) for r in ranked}
    return (*(_candidate(r) for r in kept), *_not_tried(system, tried, verdict))


def rounds(outcome: Outcome) -> tuple[Round, ...]:
    """The later rounds of forward selection, each with the effects found before it."""
    return tuple(
        Round(
            tuple((p.kind, p.on) for p in later.found_before),
            tuple(_candidate(r) for r in _listed(outcome, later.ranked)[:TABLE_SIZE]),
        )
        for later in outcome.later
    )


def _not_tried(system: System, tried: Collection[tuple[str, str]], verdict: Verdict) -> Iterator[Candidate]:
    """A user's own effects that were not fitted, with the reason."""
    for kind, effect in CATALOGUE.items():
        if not is_own(kind):
            continue
        for k, on in enumerate(places_of(effect, system)):
            if (kind, on) in tried:
                continue
            if verdict == "unfit":
                why = "not tried: the log is unfit for this spec"
            elif not effect.applies(system, k):
                why = f"does not apply here{f': {effect.needs}' if effect.needs else ''}"
            elif effect.refines:
                why = f"tried only where {effect.refines} is found, which it refines"
            elif any(p.start is not None for p in effect.parameters):
                why = "not tried: its starting values gave no run that can be fitted"
            else:
                why = "not tried: no run of it could be fitted"
            none = float("nan")
            yield Candidate(kind, on, {}, none, none, 0, 0, None, False, why, (), own=True, p=none)


def _listed(outcome: Outcome, ranked: Sequence[Ranked]) -> list[Ranked]:
    """A round with the finally named effects first, then their rivals, then the others in the round's order."""
    order = {(p.kind, p.on): k for k, p in enumerate([*outcome.parts, *(r.found.part for r in outcome.rivals)])}
    order |= {(CATALOGUE[p.kind].refines, p.on): k for k, p in enumerate(outcome.parts)}
    return sorted(ranked, key=lambda r: order.get((r.found.part.kind, r.found.part.on), len(order)))


def _candidate(r: Ranked) -> Candidate:
    part, limits = r.found.part, at_limit(r.found)[-1]
    row = _row(part, r.found.parameters, r.evidence, r.ratio, limits, r.p)
    return replace(row, also=tuple(twins(part, r.found)), size=r.size, accepted=not r.why_not, why_not=r.why_not)


def _row(
    part: Part, parameters: Mapping[str, float], e: credit.Evidence, free_run: float, limits: tuple[str, ...], p: float
) -> Candidate:
    return Candidate(
        kind=part.kind,
        on=part.on,
        parameters=parameters,
        gain=e.share,
        t=e.t,
        blocks_won=e.won,
        blocks=e.blocks,
        free_run=free_run,
        accepted=True,
        why_not="",
        also=(),
        size=float("nan"),
        own=is_own(part.kind),
        at_limit=limits,
        p=p,
        form=part.form,
    )


def in_no_round(search: Search, outcome: Outcome) -> tuple[Candidate, ...]:
    """Effects of the verdict that were a candidate in no round: that replaced another, or are a refined form of one.

    Each with the evidence, on held-out segments of the last fit, of all effects over those without it.
    """
    every = (outcome.first, *(later.ranked for later in outcome.later))
    shown = {(r.found.part.kind, r.found.part.on) for ranked in every for r in ranked}
    final, rows = outcome.final, []
    values, limits = final.values[1], at_limit(final)
    for k, part in enumerate(outcome.parts):
        if (part.kind, part.on) in shown:
            continue
        soft, without = search.with_noise_floor(search.without(final, k))
        whole = soft.fitted_again(final)
        e = nested_evidence_of(without, whole)
        ratio = noise_ratio(whole) / noise_ratio(without)
        row = _row(part, values[k], e, ratio, limits[k], chance(search, whole, e, 1))
        rows.append(replace(row, also=tuple(part.effect.twins(search.system, part.place))))
    return tuple(rows)
