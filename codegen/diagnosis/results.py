"""Typed results of a diagnosis; ``as_json`` is diagnosis.json."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import inf, isfinite, isnan, sqrt
from typing import Any, Literal, get_args

from codegen.base.result import Shown, named, plain
from codegen.base.text import render
from codegen.diagnosis.reliability import Reliability
from codegen.effects.declare import written_place

Interval = tuple[float, float]
Verdict = Literal["effect", "none", "ambiguous", "unknown", "unfit"]
"""``unfit``: by the preflight, log and spec do not fit together, so no effect is tested."""

MATERIAL = 0.02
"""Share of the RMS drive force below which structure is only reported as a remainder, not called ``unknown``."""
LEAST_CORRELATION = 0.95
"""Correlation of two friction estimates below which their agreement is ``poor``."""
CLOSE_DIFFERENCE, FAIR_DIFFERENCE = 0.1, 0.25
"""Largest relative differences of two friction estimates that count as ``close`` and ``fair``."""
Nature = Literal["not judged", "immaterial", "noise", "structured"]
"""Nature of a remainder: of too few samples, too small to matter, predicted by neither motion nor time, or by these."""
Term = Literal["force", "friction level", "inertia", "viscous friction"]
"""A term of the force balance whose coefficient may change in time."""
Topic = Literal[
    "log", "values", "evidence", "not accepted", "declared value", "spec.yaml", "note", "unexplained", "next"
]
"""Topic of a fact of a verdict, which is also its label."""
TOPICS: tuple[Topic, ...] = get_args(Topic)
"""All topics, in the order in which facts are shown."""


def worded(say: str, **given: Any) -> str:
    """The words ``say`` of templates/text/facts.j2, of which ``given`` are the arguments."""
    return render("text/facts.j2", say=say, **given).strip()


@dataclass(frozen=True)
class Fact:
    """One labelled sentence of a verdict of about thirty words; ``detail``: conditions and figures."""

    topic: Topic
    words: str
    detail: str = ""

    @classmethod
    def worded(cls, topic: Topic, say: str, **given: Any) -> Fact:
        """The fact of which ``worded`` gives the words and, after an empty line, the detail."""
        words, _, detail = worded(say, **given).partition("\n\n")
        return cls(topic, words, detail)


@dataclass(frozen=True)
class Statement:
    """A verdict in words: a headline with the missing effects, and labelled facts in the order of ``TOPICS``."""

    headline: str
    facts: tuple[Fact, ...] = ()

    @property
    def text(self) -> str:
        """Headline and facts as plain text, one per line."""
        return "\n".join([self.headline, *(f"{f.topic}: {f.words} {f.detail}".rstrip() for f in self.facts)])

    def of(self, topic: Topic) -> tuple[str, ...]:
        """The words of the facts on a topic."""
        return tuple(f.words for f in self.facts if f.topic == topic)


class AtPlace:
    """An effect at a place, in any of its forms."""

    kind: str
    on: str

    @property
    def key(self) -> tuple[str, str]:
        """(kind, on), by which effects are compared."""
        return self.kind, self.on

    @property
    def title(self) -> str:
        """The effect and its place in words."""
        return f"{self.kind} on {self.on}"


def titles(effects: Iterable[AtPlace]) -> str:
    """Effects with their places in words."""
    return " and ".join(one.title for one in effects)


@dataclass(frozen=True, repr=False)
class FoundEffect(AtPlace, Shown):
    """An effect that the log shows and the spec lacks, its parameters in SI.

    Attributes:
        also: (kind, on) of twins, which are effects with the same motion after a refit of friction levels.
        at_limit: parameters at a bound or at the largest step of the fit, whose values are no estimates.
    """

    kind: str
    on: str
    parameters: Mapping[str, float]
    units: Mapping[str, str]
    also: tuple[tuple[str, str], ...] = ()
    intervals: Mapping[str, Interval] = field(default_factory=dict)
    at_limit: tuple[str, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        units = {name: "" if (unit := self.units.get(name, "1")) == "1" else f" {unit}" for name in self.parameters}
        values = {name: f"{value:.4g}{units[name]}" for name, value in self.parameters.items()}
        return {"kind": self.kind, "on": self.on, **values}


@dataclass(frozen=True)
class ParameterError:
    """A declared value that differs from the log's estimate by more than its tolerance explains.

    Attributes:
        tolerance: relative; NaN if the declared value is zero.
        estimate: with the tolerance as prior.
        interval: 95 %, the hull of those with and without the tolerance as prior, which biases the estimate.
        away: deviation from the declared value in tolerances.
        alike: other parameters that could change in its place; fixed together with it in the comparison.
        force, free_run: cross-validated errors over those with the declared value and all else refitted.
        blocks_by_force, blocks_by_free_run: number of the ``blocks`` held-out blocks on which the estimate is better.
    """

    name: str
    unit: str
    declared: float
    tolerance: float
    estimate: float
    interval: Interval
    away: float
    alike: tuple[str, ...]
    force: float
    free_run: float
    blocks_by_force: int
    blocks_by_free_run: int
    blocks: int


@dataclass(frozen=True)
class Candidate(AtPlace):
    """One effect at one place, with its evidence in one round.

    Attributes:
        gain: share of the refit's squared free-run residual that it removes, geometric mean over held-out segments.
        t: sum of the segments' gains over the root of the sum of their squares.
        blocks_won, blocks: on how many held-out blocks of segments it is better than the refit.
        free_run: median free-run error of a segment over the refit's. force: the same of the residual; None if not
            known.
        size: force, or change of the motion, over that of the whole drive force.
        why_not: the test that it fails, or why it was not tried, in words.
        p: nominal probability of such gains without an effect, for any candidate of the round.
        form: the parameters in addition to those of the effect's simplest form.
    """

    kind: str
    on: str
    parameters: Mapping[str, float]
    gain: float
    t: float
    blocks_won: int
    blocks: int
    free_run: float | None
    accepted: bool
    why_not: str
    also: tuple[tuple[str, str], ...]
    force: float | None = None
    size: float = 0.0
    own: bool = False
    at_limit: tuple[str, ...] = ()
    p: float = 1.0
    form: str = ""


@dataclass(frozen=True)
class Round:
    """A round after the first: candidates, best first, each in addition to the effects (kind, on) found before."""

    found_before: tuple[tuple[str, str], ...]
    candidates: tuple[Candidate, ...]


@dataclass(frozen=True)
class ErrorFigures:
    """The error of one model on held-out data.

    Attributes:
        force_rms: RMS of the low-passed force residual over all coordinates, without conversion of units.
        relative_force: residual over drive force, both low-passed, in the norm √mean(r' M⁻¹ r).
        free_run_rmse: RMS position error of a free-run simulation with restarts; inf if it diverges.
        force_rms_rows, free_run_rmse_rows: of each coordinate.
        free_run_parts: (parts, n) mean squared position errors in consecutive parts of the data; empty if unknown.
    """

    force_rms: float
    force_rms_rows: tuple[float, ...]
    relative_force: float
    free_run_rmse: float
    free_run_rmse_rows: tuple[float, ...]
    free_run_parts: tuple[tuple[float, ...], ...] = ()

    def on(self, coordinates: Sequence[int]) -> ErrorFigures:
        """The errors of some coordinates, in this order; those over all coordinates are unchanged."""
        parts = tuple(tuple(part[i] for i in coordinates) for part in self.free_run_parts)
        force, run = (tuple(rows[i] for i in coordinates) for rows in (self.force_rms_rows, self.free_run_rmse_rows))
        return replace(self, force_rms_rows=force, free_run_rmse_rows=run, free_run_parts=parts)


@dataclass(frozen=True)
class Change:
    """An interval of the log, in s, in which a term of the force balance has another coefficient than in the rest.

    Attributes:
        coefficient: of the term in the residual g − M a − U λ, inside less outside: a force towards −, in the force
            unit; a friction level; a viscous friction; an inertia, relative to the model's.
    """

    term: Term
    start: float
    stop: float
    coefficient: float


@dataclass(frozen=True)
class Remainder:
    """The force residual that a model leaves on one coordinate.

    Attributes:
        rms: low-passed, in the coordinate's force unit.
        share: the same over the RMS drive force.
        structured: share of its square that a regression on all variables, or on one, explains on held-out parts.
        over: variable → share that it alone explains there beyond a constant's, which is reported as ``constant``.
        changes: intervals of time in which the force balance differs, the main one first; they may overlap.
        changed: share of its square that these explain, beyond what the motion predicts.
    """

    rms: float
    share: float
    structured: float
    over: Mapping[str, float] = field(default_factory=dict)
    changes: tuple[Change, ...] = ()
    changed: float = 0.0

    @property
    def material(self) -> float:
        """RMS of the explained part over the RMS drive force."""
        return self.share * sqrt(max(self.structured, 0.0))

    @property
    def exceeds_drive(self) -> bool:
        """Whether it is at least as large as the drive force, which a model without any force but the drive leaves."""
        return self.share >= 1

    def nature(self, limit: float) -> Nature:
        """Its nature, where a force below the share ``limit`` of the drive force is immaterial."""
        if isnan(self.share):  # too few samples
            return "not judged"
        if self.share < limit:
            return "immaterial"
        return "structured" if self.material >= limit else "noise"

    def is_mostly_in_time(self, limit: float) -> bool:
        """Whether changes in time explain most of it: no term of position, speed or force can."""
        return self.is_changing(limit) and self.changed > max(
            [0.5, *(share for name, share in self.over.items() if name != "time")]
        )

    def is_changing(self, limit: float) -> bool:
        """Whether the changes in time amount to at least this share of the drive force."""
        return bool(self.changes) and self.share * sqrt(self.changed) >= limit


@dataclass(frozen=True)
class TiedPair:
    """Two candidates, (kind, on) each, that the log does not distinguish.

    Attributes:
        angle_deg: between the parts of the refit's residual that the two explain on this log; 0: the same motion.
        distance_on_this_log: by which the first fits better, in standard deviations of the noise; negative if the other
            fits better, and the force residual or later rounds prefer the first.
        catalogue: experiment of the catalogue that distinguishes the two; may be empty.
    """

    first: tuple[str, str]
    other: tuple[str, str]
    angle_deg: float
    distance_on_this_log: float
    catalogue: str

    @property
    def better(self) -> tuple[str, str]:
        """The one that fits this log better."""
        return self.first if self.distance_on_this_log >= 0 else self.other


@dataclass(frozen=True)
class MotionTried:
    """A simulated extra motion: duration, energy ∫|w|² dt, and smallest separation, in noise, over the pairs."""

    name: str
    duration_s: float
    energy: float
    separation: float


@dataclass(frozen=True)
class Separation:
    """Discriminating experiments for candidates that tie: the best one with each rival.

    Attributes:
        tried: motions, in order.
        chosen: the cheapest that separates by ``needed``; None if none does.
        references: of the chosen motion, coordinate → expression of t.
    """

    pairs: tuple[TiedPair, ...]
    tried: tuple[MotionTried, ...]
    chosen: MotionTried | None
    references: Mapping[str, str]
    needed: float

    def as_json(self) -> dict[str, Any]:
        """The object of diagnosis.json, which ``plain`` converts."""
        return {
            "pairs": [
                asdict(a) | dict(zip(("first", "other"), _places((a.first, a.other)), strict=True)) for a in self.pairs
            ],
            "separation_needed": self.needed,
            "motion": None if self.chosen is None else asdict(self.chosen) | {"reference": dict(self.references)},
            "tried": self.tried,
        }


@dataclass(frozen=True)
class ProposedTerms:
    """A sparse sum of terms, expression → weight in SI, and the share of the squared held-out residual it removes."""

    coordinate: str
    unit: str
    terms: Mapping[str, float]
    held_out_share: float


@dataclass(frozen=True)
class Agreement:
    """Agreement of the friction estimates by the generated tracking observer and by zero-phase inverse dynamics.

    Correlation, the second filtered by the observer's own dynamics, and RMS of the difference over RMS of the friction.
    """

    correlation: float
    relative_difference: float
    samples: int

    @property
    def level(self) -> str:
        """``close``, ``fair`` or ``poor``."""
        if not self.correlation >= LEAST_CORRELATION:
            return "poor"
        if self.relative_difference <= CLOSE_DIFFERENCE:
            return "close"
        return "fair" if self.relative_difference <= FAIR_DIFFERENCE else "poor"

    @property
    def judgement(self) -> str:
        """The level in a sentence."""
        return {
            "close": "The two agree closely.",
            "fair": "The two agree in shape, less in detail.",
            "poor": "They agree poorly: noise, a coarse encoder or a sample time too long for the observer may be the "
            "reason. Read the figures on the residual with care.",
        }[self.level]


@dataclass(frozen=True)
class CertificateChange:
    """The certificate before and after: decay rates in 1/s, or the words of a refusal; and proofs lost: (file, why)."""

    before: float | str
    after: float | str
    lost: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
    """The complete result of a diagnosis.

    Attributes:
        candidates: of the first round, best first.
        refitted: friction level, or toleranced parameter → its value in the declared, refit and augmented model.
        at_limit: names of those at a limit (a friction level at zero).
        training: relative force error of these models on the training log, for comparison with published fits.
        in_no_round: effects of the verdict that were a candidate in no round, each compared with the fit without it.
        rivals: of the first effect, which the log does not distinguish from it; with the verdict ``ambiguous``.
        tied: the first effect and its rivals, with the verdict ``ambiguous``.
        separation: discriminating experiments for candidates that tie, alone or in addition to an effect.
        remainder: force residual of the written model on the training log, for each coordinate.
        material: share of the RMS drive force from which on a force matters.
    """

    verdict: Verdict
    statement: Statement
    effects: tuple[FoundEffect, ...]
    candidates: tuple[Candidate, ...]
    declared: ErrorFigures
    refit: ErrorFigures
    augmented: ErrorFigures
    training: tuple[float, float, float]
    refitted: Mapping[str, tuple[float, float, float]]
    data: Mapping[str, Any]
    findings: Mapping[str, tuple[str, ...]]
    agreement: Agreement | None = None
    certificate: CertificateChange | None = None
    later_rounds: tuple[Round, ...] = ()
    in_no_round: tuple[Candidate, ...] = ()
    rivals: tuple[FoundEffect, ...] = ()
    tied: tuple[FoundEffect, ...] = ()
    separation: Separation | None = None
    proposal: tuple[ProposedTerms, ...] | None = None
    parameter_errors: tuple[ParameterError, ...] = ()
    at_limit: tuple[str, ...] = ()
    remainder: tuple[Remainder, ...] = ()
    material: float = MATERIAL
    reliability: Reliability | None = None
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def sentence(self) -> str:
        """The verdict in words, as plain text."""
        return self.statement.text

    @property
    def summary(self) -> Mapping[str, object]:
        effects = ", ".join(e.title for e in self.effects) or "none"
        models = {"declared": self.declared, "augmented": self.augmented}
        errors = {f"relative force error {name}": model.relative_force for name, model in models.items()}
        return {"verdict": self.verdict, "effects": effects, **errors}

    @property
    def is_refit_as_declared(self) -> bool:
        """Whether values were refitted and none differs from the declared one."""
        return bool(self.refitted) and all(refit == declared for declared, refit, _ in self.refitted.values())

    @property
    def written(self) -> dict[str, tuple[float, float]]:
        """Value that the augmented spec changes → (declared, written)."""
        return written_values(self.verdict, self.refitted)

    def is_named(self, candidate: Candidate) -> bool:
        """Whether the verdict names this effect at this place; not for a refused form if another form of it passes."""
        place = candidate.key
        other_form = any(c.accepted and c.key == place for c in self.candidates)
        named = self.verdict == "effect" and place in [e.key for e in self.effects]
        return named and (candidate.accepted or not other_form)

    def is_tied(self, candidate: Candidate) -> bool:
        """Whether the verdict is ambiguous between this effect and others; it may be one that alone may be chance."""
        tied = [one.key for one in (*self.candidates[:1], *self.rivals)]
        return self.verdict == "ambiguous" and candidate.key in tied

    def in_order(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """A round's candidates as they are shown: named, tied, passed, refused; the last two by what they explain."""

        def place(c: Candidate) -> tuple[int, float]:
            explained = c.gain if isfinite(c.gain) else -inf
            if self.is_named(c):
                return 0, 0.0
            return (1, 0.0) if self.is_tied(c) else (2, -explained) if c.accepted else (3, -explained)

        return sorted(candidates, key=place)

    def in_table(self, most: int) -> list[tuple[Candidate, str]]:
        """The rows of a short table, with how an effect that the first round did not name passed ("" for the others).

        Named effects come first, those that later rounds found behind the others; then up to ``most`` candidates of the
        first round in all, and the user's own ones.
        """
        ranked = self.in_order(self.candidates)
        shown = ranked[:most] + [c for c in ranked[most:] if c.own]
        named = [c for c in shown if self.is_named(c)]
        there = {c.key for c in named}
        later: list[tuple[Candidate, str]] = []
        for effect in self.effects if self.verdict == "effect" else ():
            place = effect.key
            if place not in there and (found := self._found_later(place)):
                later.append(found)
        return [*((c, "") for c in named), *later, *((c, "") for c in shown if c not in named)]

    def _found_later(self, place: tuple[str, str]) -> tuple[Candidate, str] | None:
        """The candidate of a named effect in the round that it passed, and how; None where the table has none."""
        for later in self.later_rounds:
            for c in later.candidates:
                if c.key == place and c.accepted:
                    return c, f"in addition to {' and '.join(f'{kind} on {on}' for kind, on in later.found_before)}"
        replaced = (c for c in self.in_no_round if c.key == place and c.accepted)
        return next(((c, "in place of another effect") for c in replaced), None)

    def not_named(self, candidate: Candidate) -> str:
        """Why a candidate of the first round that passes every test is not in the verdict; empty for another one."""
        place = candidate.key
        in_verdict = [e.key for e in self.effects]
        if not candidate.accepted or self.verdict == "unfit":
            return ""
        if place in in_verdict:
            form = self.effects[in_verdict.index(place)].parameters
            return "" if form.keys() == candidate.parameters.keys() else f"the form with {', '.join(form)} is named"
        if self.verdict == "effect" and any(place in e.also for e in self.effects):
            return f"the same motion as {next(e.title for e in self.effects if place in e.also)}"
        if self.verdict == "ambiguous":
            return (
                "this log cannot tell it from the others that fit alike"
                if self.is_tied(candidate)
                else "explains less than those that fit alike"
            )
        if self.verdict != "effect":
            return "see the verdict"
        best = next((c for c in self.candidates if c.key in in_verdict), None)
        words = " and ".join(f"{kind} on {on}" for kind, on in in_verdict)
        own = f"{candidate.gain:.3f}"
        if best is not None and f"{best.gain:.3f}" == own:
            first = f"explains no more than {best.title}, which ranks before it"
        elif best is not None and best.gain >= candidate.gain:
            first = f"explains less than {best.title}"
        else:
            first = f"explains more, but the residual force or the later rounds prefer {words}"
        again = [c for r in self.later_rounds for c in r.candidates if c.key == place]
        if not again:
            return f"{first}; not tested together with it"
        return f"{first}; together with it: {again[0].why_not or 'passes, but adds too little'}"

    def as_json(self) -> dict[str, Any]:
        """Plain objects for diagnosis.json; infinities become null."""
        models = ("declared", "refit", "augmented")
        errors = (self.declared, self.refit, self.augmented)
        content = {
            "format": "stiction-diagnosis/1",
            "verdict": self.verdict,
            "headline": self.statement.headline,
            "facts": self.statement.facts,
            "sentence": self.sentence,
            "reliability": None if self.reliability is None else self.reliability.as_json(),
            "effects": [_effect(e) for e in self.effects],
            "rivals": [_effect(e) for e in self.rivals],
            "tied": [_effect(e) for e in self.tied],
            "candidates": [_row(c) for c in self.candidates],
            "later_rounds": [
                {"beside": _places(r.found_before), "candidates": [_row(c) for c in r.candidates]}
                for r in self.later_rounds
            ],
            "in_no_round": [_row(c) for c in self.in_no_round],
            "error": {name: _errors(one) for name, one in zip(models, errors, strict=True)},
            "relative_force_error_on_training": dict(zip(models, self.training, strict=True)),
            "values": {
                name: {
                    "unit": self.units.get(name, "1"),
                    **dict(zip(models, values, strict=True)),
                    "at_limit": name in self.at_limit,
                }
                for name, values in self.refitted.items()
            },
            "parameter_errors": [_parameter_error(e) for e in self.parameter_errors],
            "data": self.data,
            "residual_agreement": self.agreement,
            "material": self.material,
            "remainder": [
                {
                    "is": r.nature(self.material),
                    "residual_force_rms": r.rms,
                    "share_of_drive_force": r.share,
                    "predicted_share_of_drive_force": r.material,
                    "explained_by_all_variables": r.structured,
                    "explained_over": r.over,
                    "changes_in_time": r.changes,
                }
                for r in self.remainder
            ],
            "preflight": self.findings,
            "certificate": None
            if self.certificate is None
            else {**asdict(self.certificate), "lost": dict(self.certificate.lost)},
            "separation": None if self.separation is None else self.separation.as_json(),
            "proposal": None
            if self.proposal is None
            else {
                "is": "a proposal by sparse regression, not a finding; it is in no spec and in no code",
                "coordinates": self.proposal,
            },
        }
        result: dict[str, Any] = plain(content)
        return result


def written_values(
    verdict: Verdict, refitted: Mapping[str, tuple[float, float, float]]
) -> dict[str, tuple[float, float]]:
    """``Diagnosis.written`` of a verdict and its ``refitted`` values."""
    column = 0 if verdict == "unfit" else 2 if verdict == "effect" else 1
    pairs = {name: (values[0], values[column]) for name, values in refitted.items()}
    return {name: (a, b) for name, (a, b) in pairs.items() if f"{a:.6g}" != f"{b:.6g}"}


def _errors(e: ErrorFigures) -> dict[str, Any]:
    return {
        "residual_force_rms": e.force_rms,
        "residual_force_rms_by_coordinate": e.force_rms_rows,
        "relative_force_error": e.relative_force,
        "free_run_position_rmse": e.free_run_rmse,
        "free_run_position_rmse_by_coordinate": e.free_run_rmse_rows,
    }


def _effect(e: FoundEffect) -> dict[str, Any]:
    return {
        "kind": e.kind,
        "on": written_place(e.on),
        **named(e, "parameters intervals units at_limit"),
        "also": _places(e.also),
    }


def _row(c: Candidate) -> dict[str, Any]:
    return {
        "kind": c.kind,
        "on": written_place(c.on),
        **named(c, "form parameters at_limit"),
        "also": _places(c.also),
        "own": c.own,
        "evidence": {
            "held_out_gain": c.gain,
            **named(c, "t p blocks_won blocks"),
            "free_run_ratio": c.free_run,
            "force_ratio": c.force,
            **named(c, "size accepted why_not"),
        },
    }


def _parameter_error(e: ParameterError) -> dict[str, Any]:
    return {
        **named(e, "name unit declared tolerance estimate interval"),
        "tolerances_away": e.away,
        "alike": e.alike,
        "evidence": {
            "force_ratio": e.force,
            "free_run_ratio": e.free_run,
            "blocks_better_by_force": e.blocks_by_force,
            "blocks_better_by_free_run": e.blocks_by_free_run,
            "blocks": e.blocks,
        },
    }


def _places(effects: Sequence[tuple[str, str]]) -> list[dict[str, Any]]:
    return [{"kind": kind, "on": written_place(on)} for kind, on in effects]
