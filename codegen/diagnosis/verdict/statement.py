"""The verdict in words: a headline and labelled facts, each from its template in templates/text/statement/."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import floor, isfinite, log10, sqrt
from typing import Any

from codegen.base.text import render
from codegen.diagnosis.case import Case
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.measure import driving_force_name
from codegen.diagnosis.results import (
    TOPICS,
    Fact,
    FoundEffect,
    Remainder,
    Separation,
    Statement,
    Topic,
    worded,
    written_values,
)
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.verdict.against_regression import acts_on
from codegen.diagnosis.verdict.answer import Answer
from codegen.logs import Log
from codegen.logs.audit.scales import SCALE_OF_TIME
from codegen.mechanics.system import System

DOUBTFUL = ("jitter", "sample rate", SCALE_OF_TIME, "missing values", "repeated rows")
"""Preflight topics that can cause a residual by themselves."""
FAR_WORSE = 3.0
"""Least ratio of the relative force errors on test and training log at which both are stated."""
IN_HEADLINE = 3
"""Most parameters of a single effect in the headline."""


def statement(
    case: Case,
    answer: Answer,
    left: Sequence[Remainder],
    rivals: Sequence[FoundEffect],
    refitted: Mapping[str, tuple[float, float, float]],
    outcome: Outcome | None = None,
    experiment: Separation | None = None,
    records: int = 0,
    training: Sequence[float] = (),
) -> Statement:
    """The verdict in words, with figures of the coordinates on which the effects act, that of the first at length.

    Args:
        refitted: name → value in the declared, refit and augmented model.
        outcome: of the free-run fits; None for a diagnosis of ``records`` steady records by their means.
        training: relative force error on the training log as declared, refitted and augmented.
    """
    system, material, findings = case.problem.system, case.material, case.findings["train"]
    most = worst(left, material)
    first, *others = dict.fromkeys(acts_on(e, system) for e in answer.effects) or (0,)
    several = system.degrees_of_freedom > 1
    return stated(
        verdict=answer.verdict,
        effects=answer.effects,
        rivals=rivals,
        against=answer.against,
        stroke=answer.stroke,
        errors=answer.errors,
        remarks=answer.remarks,
        **_errors_on(first, answer, system),
        elsewhere=[_errors_on(i, answer, system) for i in others],
        training=training,
        held_out=_far_worse_held_out(case, answer, training),
        faults=[f.words for f in findings if f.severity == "problem"],
        misread=[f.words for f in findings if f.severity == "warning" and f.topic == SCALE_OF_TIME],
        doubts=[f.words for f in findings if f.severity == "warning" and f.topic in DOUBTFUL],
        records=records,
        refused=None if outcome is None or answer.against else best_refused(outcome),
        noise=0.0 if outcome is None else noise_ratio(outcome.base),
        far=0.0 if outcome is None else acceptance.share_far(outcome.base),
        left=left[most] if isfinite(left[most].share) else None,
        left_on=system.positions[most].name if several else "",
        over=main_variables(left[most], material),
        changes=changes_in_words(left[most], system, most, material, case.log),
        material=material,
        drive=driving_force_name(system),
        experiment=experiment,
        written=list(written_values(answer.verdict, refitted)),
        kept=bool(refitted) and all(refit == declared for declared, refit, _ in refitted.values()),
    )


def _far_worse_held_out(case: Case, answer: Answer, training: Sequence[float]) -> float:
    """Relative force error of the final model on the test log if it is material and ``FAR_WORSE``; else 0."""
    held_out = answer.figures[-1].relative_force
    if case.test_log is None or not training:
        return 0.0
    return held_out if held_out >= max(case.material, FAR_WORSE * training[-1]) else 0.0


def _errors_on(i: int, answer: Answer, system: System) -> dict[str, Any]:
    """The errors on a coordinate: of force where they have figures that fall with the effects, else of position."""
    by_force = not answer.augmented.transmissions and all(isfinite(f.force_rms_rows[i]) for f in answer.figures)
    by_force = by_force and answer.figures[2].force_rms_rows[i] <= answer.figures[1].force_rms_rows[i]
    declared, refit, augmented = (f.force_rms_rows[i] if by_force else f.free_run_rmse_rows[i] for f in answer.figures)
    return {
        "by_force": by_force,
        "declared": declared,
        "refit": refit,
        "augmented": augmented,
        "unit": system.force_unit(i) if by_force else system.position_units[i],
        "where": system.positions[i].name if system.degrees_of_freedom > 1 else "",
    }


def stated(**given: Any) -> Statement:
    """The statement from plain values; names as in the templates."""
    view = {
        "far_noise": acceptance.FAR,
        "near_noise": acceptance.NEAR_NOISE,
        "stroke": "",
        "misread": [],
        "held_out": 0.0,
        "elsewhere": [],
    } | given
    headline = render("text/statement/headline.j2", **view).strip()
    facts = [f for f in _facts(view) if f.words]
    return Statement(headline, tuple(sorted(facts, key=lambda fact: TOPICS.index(fact.topic))))


def _facts(view: Mapping[str, Any]) -> Iterator[Fact]:
    verdict, effects = view["verdict"], view["effects"]
    named = [*effects, *view["rivals"]] if verdict in ("effect", "ambiguous") else []
    for e in named:
        if len(named) > 1 or e.intervals or len(e.parameters) > IN_HEADLINE:
            yield _fact("values", "values", view, effect=e)
        if e.also:
            yield _fact("values", "twins", view, effect=e)
    yield _fact("evidence", "evidence", view)
    if verdict in ("unknown", "none") and (effects or view["refused"]):
        first, *others = view["against"] or [Fact("not accepted", "")]
        one = _fact("not accepted", "not_accepted", view, reason=first.words)
        yield replace(one, detail=f"{one.detail} {first.detail}".strip())
        yield from (_sentence(replace(f, words=f.words[0].upper() + f.words[1:])) for f in others)
    for error in view["errors"]:
        yield _fact("declared value", "declared_value", view, e=error)
    yield _fact("spec.yaml", "spec", view)
    yield from map(_sentence, view["remarks"])
    if verdict == "unfit":
        yield from (_sentence(Fact("log", words)) for words in view["faults"])
    elif view["left"]:
        yield _fact("unexplained", "unexplained", view)
        if view["left"].nature(view["material"]) == "structured":
            yield from (_sentence(Fact("unexplained", words[0].upper() + words[1:])) for words in view["changes"])
        if view["held_out"]:
            yield _fact("unexplained", "held_out", view)
    if verdict in ("effect", "ambiguous"):
        yield from (_sentence(Fact("log", f"The log itself may be the cause: {words}")) for words in view["misread"])
        if view["left"] and view["left"].nature(view["material"]) == "structured":
            others = [words for words in view["doubts"] if words not in view["misread"]]
            yield from (
                _sentence(Fact("log", f"What is left may come from the log itself: {words}")) for words in others
            )
    if verdict == "unknown":
        yield from (_sentence(Fact("log", f"the log itself may be the cause: {words}")) for words in view["doubts"])
    yield _fact("next", "next", view)


def _fact(topic: Topic, template: str, view: Mapping[str, Any], **more: Any) -> Fact:
    """The fact of a template."""
    words, detail = (
        render(f"text/statement/{template}.j2", part=part, **{**view, **more}) for part in ("words", "detail")
    )
    return _sentence(Fact(topic, " ".join(words.split()), " ".join(detail.split())))


def _sentence(fact: Fact) -> Fact:
    """A fact whose words end as a sentence."""
    ended = not fact.words or fact.words.endswith((".", "?", ".)"))
    return fact if ended else replace(fact, words=f"{fact.words}.")


SOME = 0.1
"""Share of the squared remainder; a variable that explains less is reported only if its force is material."""
MOST_CHANGES = 2
"""Most changes in time that a verdict names."""


def best_refused(outcome: Outcome) -> tuple[str, str, str] | None:
    """(kind and form, on, why not) of the refused candidate that explains most, ``LEAST_SHARE`` at least."""
    refused = [r for r in outcome.first if r.why_not and r.evidence.share >= acceptance.LEAST_SHARE]
    if not refused:
        return None
    most = max(refused, key=lambda r: r.evidence.share)
    part = most.found.part
    return f"{part.kind} with {part.form}" if part.form else part.kind, part.on, most.why_not


def main_variables(left: Remainder, material: float) -> list[tuple[str, float]]:
    """Variables that explain a large share of the squared remainder, or a material force; the best first.

    Without time where changes in time are material: ``changes_in_words`` describes these.
    """
    described = ("time",) if left.is_changing(material) else ()
    shares = [(name, share) for name, share in left.over.items() if name not in described]
    many = [(name, share) for name, share in shares if share >= SOME or left.share * sqrt(share) >= material]
    return sorted(many, key=lambda one: -one[1])


def changes_in_words(left: Remainder, system: System, i: int, material: float, log: Log | None = None) -> list[str]:
    """The ``MOST_CHANGES`` largest changes in time of a coordinate's force balance, each with its times."""
    if not left.is_changing(material):
        return []
    units = {"force": system.force_unit(i), "position": system.position_units[i]}
    words = []
    for change in left.changes[:MOST_CHANGES]:
        when = interval_in_words(change.start, change.stop, log)
        given = {"term": change.term, "size": abs(change.coefficient), "more": change.coefficient > 0, **units}
        words.append(worded("change", when=when, **given))
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
