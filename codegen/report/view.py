"""Typed data of the report's template: results of the diagnosis, and what the report adds to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from codegen.diagnosis.advice import Proposal, Separation
from codegen.diagnosis.reliability import Reliability
from codegen.diagnosis.results import Agreement, Candidate, CertificateChange, ParameterError, Remainder, Verdict
from codegen.report.pictures import Panel

Data = Mapping[str, Any]


@dataclass(frozen=True)
class ErrorRow:
    """One error figure of the three models.

    Attributes:
        quantity: "force", "relative", "position", or "training" for the relative error on the training log.
        coordinate: a coordinate's name, or empty for a share of the whole.
        unit: in print; empty for a share.
        declared, refit, augmented: in print, in ``unit``.
        change: augmented against declared, in %.
    """

    quantity: Literal["force", "relative", "position", "training"]
    coordinate: str
    unit: str
    declared: str
    refit: str
    augmented: str
    change: str


@dataclass(frozen=True)
class ParameterView:
    """A parameter of an effect: value with unit, meaning in the catalogue, and formatted 95 % interval.

    Attributes:
        at_limit: whether it is at the end of the fit's range.
    """

    name: str
    value: str
    interval: str
    meaning: str
    at_limit: bool = False


@dataclass(frozen=True)
class EffectView:
    """An effect that was found; ``also`` are twins in words, ``kind on place``."""

    kind: str
    on: str
    equation: str
    signature: str
    parameters: tuple[ParameterView, ...]
    also: tuple[str, ...]


@dataclass(frozen=True)
class CandidateRow:
    """A candidate of one round.

    Attributes:
        parameters: name = value unit.
        outcome: "chosen", "carried" (in the augmented model while others tie), "rival" (ties with that one), "later"
            (rejected here, but in the verdict), "passed" or "rejected".
        why_not: in words, for "rejected".
        bar: gain in %, 0 to 100, for the bar in the table.
    """

    candidate: Candidate
    parameters: tuple[str, ...]
    outcome: Literal["chosen", "carried", "rival", "later", "passed", "rejected"]
    why_not: str
    bar: int


@dataclass(frozen=True)
class RoundView:
    """A round of candidates.

    Attributes:
        found_before: effects that were in the model already, in words.
        exchanged: whether these replaced others, and were compared with the fit without them.
    """

    found_before: tuple[str, ...]
    rows: tuple[CandidateRow, ...]
    exchanged: bool = False


@dataclass(frozen=True)
class PictureView:
    """The pictures and the data of their caption.

    Attributes:
        coordinates: name of each, and its pictures.
        legend: (model, colour) in the order of drawing.
        same: whether the refit changes no value, so that only the declared model is drawn.
        thinned: most samples drawn a model; empty where all are.
    """

    coordinates: tuple[tuple[str, tuple[Panel, ...]], ...]
    legend: tuple[tuple[str, str], ...]
    same: bool
    cutoff: str
    thinned: str


@dataclass(frozen=True)
class LawView:
    """An effect compared with a smooth curve, formatted.

    Attributes:
        smooth, law: share of the mean square of the residual without the effect that the curve predicts on held-out
            parts, and that the effect explains.
        left: share of the residual with the effect that such a curve still predicts.
    """

    kind: str
    on: str
    variable: str
    smooth: str
    law: str
    left: str
    panels: tuple[Panel, ...]


@dataclass(frozen=True)
class Page:
    """The whole page, in its order.

    Attributes:
        data: of the figures, as in diagnosis.json.
        refitted: friction level, or parameter with a tolerance → its value in the declared, refit and augmented model;
            ``units`` and ``at_limit`` are of these.
        remainder: of the written model: coordinate, its force unit, and what is left there.
        agreement_level: "close", "fair" or "poor".
        findings: of the preflight: role of a log, its name, and (severity, words), worst first.
        difference: lines of the spec's diff, each "added", "removed", "hunk" or "same", and its text.
        files: that were written: label and address.
    """

    name: str
    source: str
    spec_file: str
    spec_hash: str
    version: str
    verdict: Verdict
    sentence: str
    reliability: Reliability | None
    added: bool
    data: Data
    errors: tuple[ErrorRow, ...]
    published: tuple[tuple[str, str], ...]
    effects: tuple[EffectView, ...]
    refitted: Mapping[str, tuple[float, float, float]]
    units: Mapping[str, str]
    at_limit: tuple[str, ...]
    parameter_errors: tuple[ParameterError, ...]
    remarks: tuple[str, ...]
    laws: tuple[LawView, ...]
    remainder: tuple[tuple[str, str, Remainder], ...]
    material: float
    pictures: PictureView
    rounds: tuple[RoundView, ...]
    leader: str
    separation: Separation | None
    proposal: Proposal | None
    agreement: Agreement | None
    agreement_level: Literal["close", "fair", "poor"]
    findings: tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]
    difference: tuple[tuple[str, str], ...]
    observer_declared: bool
    certificate: CertificateChange | None
    files: tuple[tuple[str, str], ...]
