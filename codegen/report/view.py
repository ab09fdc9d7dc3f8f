"""Typed data of the report's template: numbers already formatted; prose is in the template."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from codegen.diagnosis.reliability import Reliability
from codegen.diagnosis.results import Nature, Verdict
from codegen.report.pictures import Panel


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
class RefittedRow:
    """A friction level or uncertain parameter in the three models; ``change`` is augmented against declared.

    Attributes:
        at_limit: whether it is at the end of its range.
    """

    name: str
    unit: str
    declared: str
    refit: str
    augmented: str
    change: str
    at_limit: bool = False


@dataclass(frozen=True)
class ParameterErrorRow:
    """A declared value that differs from the log's estimate, formatted.

    Attributes:
        force, free_run: change of the error by the estimate, and on how many held-out blocks it is smaller.
        alike: other parameters that explain the log as well.
    """

    name: str
    declared: str
    tolerance: str
    estimate: str
    interval: str
    away: str
    force: str
    free_run: str
    alike: tuple[str, ...]


@dataclass(frozen=True)
class CandidateRow:
    """A candidate of one round.

    Attributes:
        parameters: name = value unit.
        gain, t, blocks, free_run: formatted evidence; ``free_run`` is empty where there is none.
        outcome: "chosen", "carried" (in the augmented model while others tie), "rival" (ties with that one), "later"
            (rejected here, but in the verdict), "passed" or "rejected".
        why_not: in words, for "rejected".
        bar: gain in %, 0 to 100, for the bar in the table.
    """

    rank: int
    kind: str
    on: str
    also: tuple[str, ...]
    parameters: tuple[str, ...]
    gain: str
    t: str
    blocks: str
    free_run: str
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
class FindingView:
    """A finding of the preflight; ``severity`` is problem, warning or info."""

    severity: str
    words: str


@dataclass(frozen=True)
class FindingGroup:
    """Findings of one log, worst first."""

    role: str
    log: str
    findings: tuple[FindingView, ...]


@dataclass(frozen=True)
class DifferenceLine:
    """A line of the spec's diff; ``kind`` is added, removed, hunk or same."""

    kind: Literal["added", "removed", "hunk", "same"]
    text: str


@dataclass(frozen=True)
class CertificateSide:
    """The certificate of one spec: a decay rate in print, or the words of a refusal."""

    rate: str
    refusal: str


@dataclass(frozen=True)
class AgreementView:
    """Agreement of observer replay and inverse dynamics, formatted; ``level`` rates it."""

    correlation: str
    difference: str
    samples: str
    level: Literal["close", "fair", "poor"]


@dataclass(frozen=True)
class DataView:
    """The data of the figures, formatted."""

    train: str
    train_samples: str
    test: str
    held_out: str
    sample_time: str
    cutoff: str
    restart: str
    blocks: str
    segments: str


@dataclass(frozen=True)
class CoordinateView:
    """The pictures of one coordinate."""

    name: str
    panels: tuple[Panel, ...]


@dataclass(frozen=True)
class PictureView:
    """The pictures and the data of their caption.

    Attributes:
        legend: (model, colour) in the order of drawing.
        same: whether the refit changes no value, so that only the declared model is drawn.
        thinned: most samples drawn a model; empty where all are.
    """

    coordinates: tuple[CoordinateView, ...]
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
class RemainderRow:
    """The remainder of the written model on one coordinate, formatted.

    Attributes:
        share: of the drive force. predicted: by all variables together, as a share of the drive force.
        over: (variable, share of the mean square), the largest first.
    """

    coordinate: str
    rms: str
    share: str
    predicted: str
    nature: Nature
    over: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class FileLink:
    """A file that was written, as a link."""

    label: str
    address: str


@dataclass(frozen=True)
class PairView:
    """Two candidates that tie, formatted."""

    first: str
    other: str
    angle: str
    distance: str
    catalogue: str


@dataclass(frozen=True)
class MotionView:
    """A simulated extra motion, formatted."""

    name: str
    duration: str
    energy: str
    separation: str


@dataclass(frozen=True)
class ChangeView:
    """A change of the machine on the log's own path, formatted."""

    words: str
    separation: str
    input: str


@dataclass(frozen=True)
class SeparationView:
    """Experiments that discriminate tied candidates; ``motion`` and ``change`` are None where none does."""

    pairs: tuple[PairView, ...]
    motion: MotionView | None
    references: tuple[tuple[str, str], ...]
    tried: tuple[MotionView, ...]
    needed: str
    changes: tuple[ChangeView, ...]
    change: ChangeView | None


@dataclass(frozen=True)
class ProposedRow:
    """A sparse sum for one coordinate's residual: (weight, term), and the explained share, formatted."""

    coordinate: str
    unit: str
    terms: tuple[tuple[str, str], ...]
    share: str


@dataclass(frozen=True)
class Page:
    """The whole page, in its order."""

    name: str
    source: str
    spec_file: str
    spec_hash: str
    version: str
    verdict: Verdict
    sentence: str
    reliability: Reliability | None
    added: bool
    data: DataView
    errors: tuple[ErrorRow, ...]
    published: tuple[tuple[str, str], ...]
    effects: tuple[EffectView, ...]
    refitted: tuple[RefittedRow, ...]
    parameter_errors: tuple[ParameterErrorRow, ...]
    remarks: tuple[str, ...]
    laws: tuple[LawView, ...]
    remainder: tuple[RemainderRow, ...]
    material: str
    pictures: PictureView
    rounds: tuple[RoundView, ...]
    leader: str
    separation: SeparationView | None
    proposal: tuple[ProposedRow, ...]
    agreement: AgreementView | None
    findings: tuple[FindingGroup, ...]
    difference: tuple[DifferenceLine, ...]
    observer_declared: bool
    certificate: tuple[CertificateSide, CertificateSide] | None
    files: tuple[FileLink, ...]
