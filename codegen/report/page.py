"""The diagnosis report: a typed page from a diagnosis, rendered by one template."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from urllib.parse import quote

from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.results import Candidate, Diagnosis, ErrorFigures, FoundEffect
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of, unit_words
from codegen.mechanics.system import System
from codegen.report import wording
from codegen.report.evidence import LawEvidence, law_evidence
from codegen.report.pictures import COLOURS, Drawing, Panel, drawn, law_drawing, residual_drawings
from codegen.report.series import MOST_POINTS, CoordinateSeries, held_out_series
from codegen.report.wording import change, number, percent, prefixed, unit_text, with_unit
from codegen.spec.model import Spec

SEVERITIES = ("problem", "warning", "info")
MOST_PARAMETERS = 8
"""Most lines of one candidate in a table; a sum of harmonics has two parameters an order."""
Outcome = Literal["chosen", "carried", "rival", "later", "passed", "rejected"]
"""Outcome of a candidate. carried: in the augmented model, while others tie with it; rival: ties with that one; later:
rejected in this round, but named in the verdict."""


@dataclass(frozen=True)
class ErrorRow:
    """A row of the table of errors.

    Attributes:
        quantity: "training" is the relative error on the training log.
        coordinate, unit: empty for a share of the whole.
        shown: of the declared, refit and augmented model.
        change: augmented against declared, in %.
    """

    quantity: Literal["force", "relative", "position", "training"]
    coordinate: str
    unit: str
    shown: tuple[str, ...]
    change: str


@dataclass(frozen=True)
class EffectView:
    """An effect that was found, with its entry in the catalogue; ``meanings`` are those of its parameters."""

    found: FoundEffect
    equation: str
    signature: str
    meanings: Mapping[str, str]


@dataclass(frozen=True)
class CandidateRow:
    """A row of the table of one round's candidates.

    Attributes:
        parameters: name = value unit.
        bar: gain in %, 0 to 100, for the bar in the table.
    """

    candidate: Candidate
    parameters: tuple[str, ...]
    outcome: Outcome
    why_not: str
    bar: int


@dataclass(frozen=True)
class RoundView:
    """A round of candidates.

    Attributes:
        found_before: effects that were already in the model, in words.
        exchanged: whether these candidates replaced others, and were compared with the fit without those.
    """

    found_before: tuple[str, ...]
    rows: tuple[CandidateRow, ...]
    exchanged: bool = False


@dataclass(frozen=True)
class PictureView:
    """The pictures of the residual and the data of their caption.

    Attributes:
        coordinates: name of each, and its pictures.
        legend: (model, colour) in the order of drawing.
        same: whether the refit changes no value, so that only the declared model is drawn.
        thinned: largest number of samples drawn for a model; empty if all are drawn.
    """

    coordinates: tuple[tuple[str, tuple[Panel, ...]], ...]
    legend: tuple[tuple[str, str], ...]
    same: bool
    thinned: str


@dataclass(frozen=True)
class Page:
    """Content of the report: a diagnosis, and the data that the report adds.

    Attributes:
        leader: the effects of the augmented model, in words.
        findings: of the preflight: role of a log, its name, and (severity, words), worst first.
        difference: lines of the spec's diff, each "added", "removed", "hunk" or "same", and its text.
        files: that were written: label and address.
    """

    name: str
    source: str
    spec_file: str
    spec_hash: str
    version: str
    diagnosis: Diagnosis
    errors: tuple[ErrorRow, ...]
    published: tuple[tuple[str, str], ...]
    effects: tuple[EffectView, ...]
    laws: tuple[tuple[LawEvidence, tuple[Panel, ...]], ...]
    pictures: PictureView
    rounds: tuple[RoundView, ...]
    leader: str
    findings: tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]
    difference: tuple[tuple[str, str], ...]
    observer_declared: bool
    files: tuple[tuple[str, str], ...]


def render_report(spec: Spec, diagnosis: Diagnosis, models: Models, files: Mapping[str, str] | None = None) -> str:
    """The self-contained HTML report of a diagnosis; deterministic.

    Args:
        files: label → path relative to the report, of the other files written.
    """
    shown = _models_shown(diagnosis)
    evidence, series = law_evidence(diagnosis, models), held_out_series(models, shown)
    groups = [*(_law_drawings(e, models) for e in evidence), *(residual_drawings(c) for c in series)]
    panels = drawn(groups)
    page = Page(
        name=spec.name,
        source=spec.source,
        spec_file=spec.path.name,
        spec_hash=spec.sha256,
        version=VERSION,
        diagnosis=diagnosis,
        errors=_error_rows(diagnosis, models.declared),
        published=tuple(spec.log.published.items()),
        effects=tuple(_effect(e) for e in diagnosis.effects),
        laws=tuple(zip(evidence, panels[: len(evidence)], strict=True)),
        pictures=_pictures(shown, series, panels[len(evidence) :]),
        rounds=_rounds(diagnosis, models),
        leader=" and ".join(f"{e.kind} on {e.on}" for e in models.named),
        findings=_findings(diagnosis),
        difference=_difference(spec, models.spec_text),
        observer_declared=spec.observer is not None,
        files=tuple((label, quote(path)) for label, path in (files or {}).items()),
    )
    return rendered(page)


def rendered(page: Page) -> str:
    """The HTML of a page."""
    found = page.diagnosis
    added = found.verdict in ("effect", "ambiguous")
    return render("report/report.html.j2", page=page, found=found, added=added, words=wording)


def _error_rows(diagnosis: Diagnosis, system: System) -> tuple[ErrorRow, ...]:
    """Residual force and free-run position error by coordinate, and the relative force errors.

    Coordinates are not combined: the two sides of a gear are not comparable.
    """

    models = (diagnosis.declared, diagnosis.refit, diagnosis.augmented)

    def row(
        quantity: Literal["force", "position"], i: int, unit: str, read: Callable[[ErrorFigures], tuple[float, ...]]
    ) -> ErrorRow:
        values = [read(e)[i] for e in models]
        factor, shown_unit = prefixed(values, unit)
        shown = tuple(number(factor * v) for v in values)
        return ErrorRow(quantity, system.positions[i].name, unit_text(shown_unit), shown, change(values[0], values[2]))

    def whole(quantity: Literal["relative", "training"], values: Sequence[float]) -> ErrorRow:
        return ErrorRow(quantity, "", "", tuple(percent(v, 4) for v in values), change(values[0], values[2]))

    count = range(system.degrees_of_freedom)
    return (
        *(row("force", i, system.force_unit(i), lambda e: e.force_rms_rows) for i in count),
        whole("relative", [e.relative_force for e in models]),
        *(row("position", i, system.position_units[i], lambda e: e.free_run_rmse_rows) for i in count),
        whole("training", diagnosis.training),
    )


def _effect(found: FoundEffect) -> EffectView:
    effect = CATALOGUE[found.kind].with_parameters(list(found.parameters))
    return EffectView(found, effect.equation, effect.signature, {p.name: p.meaning for p in effect.parameters})


def _rounds(diagnosis: Diagnosis, models: Models) -> tuple[RoundView, ...]:
    """The candidates of every round with their evidence, and effects of the verdict that were in no round."""

    def rows(candidates: Sequence[Candidate]) -> tuple[CandidateRow, ...]:
        return tuple(_candidate_row(c, diagnosis, models) for c in diagnosis.in_order(candidates))

    views = [
        RoundView((), rows(diagnosis.candidates)),
        *(
            RoundView(tuple(f"{kind} on {on}" for kind, on in later.found_before), rows(later.candidates))
            for later in diagnosis.later_rounds
        ),
        RoundView((), rows(diagnosis.in_no_round), exchanged=True),
    ]
    return tuple(view for view in views if view.rows)


def _candidate_row(c: Candidate, diagnosis: Diagnosis, models: Models) -> CandidateRow:
    effect = CATALOGUE[c.kind].with_parameters(list(c.parameters))
    units = unit_words(effect, places_of(effect, models.declared).index(c.on), models.declared)
    parameters = [
        f"{name} = {with_unit(value, units[name], 3)}{' (at its limit)' if name in c.at_limit else ''}"
        for name, value in c.parameters.items()
    ]
    if len(parameters) > MOST_PARAMETERS:
        parameters[MOST_PARAMETERS - 1 :] = [f"and {len(parameters) - MOST_PARAMETERS + 1} more"]
    why_not = c.why_not or (diagnosis.not_named(c) if c in diagnosis.candidates else "")
    bar = round(100 * min(max(c.gain, 0.0), 1.0)) if c.gain == c.gain else 0
    return CandidateRow(c, tuple(parameters), _outcome(c, diagnosis, models), why_not.replace(" -", " −"), bar)


def _outcome(candidate: Candidate, diagnosis: Diagnosis, models: Models) -> Outcome:
    def is_one_of(effects: Sequence[FoundEffect]) -> bool:
        return any((candidate.kind, candidate.on) == (e.kind, e.on) for e in effects)

    if diagnosis.is_credited(candidate):
        return "chosen" if candidate.accepted else "later"
    if diagnosis.verdict == "ambiguous" and is_one_of(models.named):
        return "carried"
    if diagnosis.verdict == "ambiguous" and is_one_of(diagnosis.rivals):
        return "rival"
    return "passed" if candidate.accepted else "rejected"


def _models_shown(diagnosis: Diagnosis) -> list[str]:
    """The models in the pictures of the residual: no refit that changes no value."""
    same = all(declared == refit for declared, refit, _ in diagnosis.refitted.values())
    names = ["declared"] if same else ["declared", "refit"]
    return names + (["augmented"] if diagnosis.verdict in ("effect", "ambiguous") else [])


def _pictures(
    names: Sequence[str], series: Sequence[CoordinateSeries], panels: Sequence[tuple[Panel, ...]]
) -> PictureView:
    thinned = max(c.samples for c in series) > MOST_POINTS
    return PictureView(
        coordinates=tuple((c.name, own) for c, own in zip(series, panels, strict=True)),
        legend=tuple((name, COLOURS[name]) for name in names),
        same="refit" not in names,
        thinned=number(MOST_POINTS) if thinned else "",
    )


def _law_drawings(found: LawEvidence, models: Models) -> tuple[Drawing, ...]:
    unit, force = models.declared.position_units[found.coordinate], models.declared.force_unit(found.coordinate)
    units = {"speed": f"{unit}/s", "position": unit, "load": force, "acceleration": f"{unit}/s^2", "time": "s"}
    of = (units.get(found.variable, f"{force}/s"), force)
    name = f"{found.kind} on {found.on}"
    return tuple(
        law_drawing(p, found.variable, of, f"{name}, {p.direction}" if p.direction else name) for p in found.panels
    )


def _findings(diagnosis: Diagnosis) -> tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]:
    groups = []
    for role, lines in diagnosis.findings.items():
        found = sorted((_finding(line) for line in lines), key=lambda finding: SEVERITIES.index(finding[0]))
        groups.append((role, str(diagnosis.data.get(role, role)), tuple(found)))
    return tuple(groups)


def _finding(words: str) -> tuple[str, str]:
    severity, mark, rest = words.partition(": ")
    return (severity, rest) if mark and severity in SEVERITIES else ("info", words)


def _difference(spec: Spec, text: str) -> tuple[tuple[str, str], ...]:
    """The changed lines of the spec, each group under its line number."""
    lines = difflib.unified_diff(spec.text.splitlines(), text.splitlines(), lineterm="", n=0)
    kinds = {"+": "added", "-": "removed", "@": "hunk"}
    shown = []
    for line in list(lines)[2:]:
        kind = kinds.get(line[:1], "same")
        text = f"line {line.split()[1].lstrip('-').partition(',')[0]}" if kind == "hunk" else line
        shown.append((kind, text))
    return tuple(shown)
