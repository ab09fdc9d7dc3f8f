"""The diagnosis report: a typed page from a diagnosis, rendered by one template."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Literal
from urllib.parse import quote

from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.results import Agreement, CertificateChange, Diagnosis
from codegen.report.evidence import LawEvidence, law_evidence
from codegen.report.pictures import COLOURS, law_picture, residual_panels
from codegen.report.series import MOST_POINTS, held_out_series
from codegen.report.tables import (
    effect_views,
    error_rows,
    parameter_error_rows,
    proposal_rows,
    refitted_rows,
    remainder_rows,
    round_views,
    separation_view,
    training_row,
)
from codegen.report.view import (
    AgreementView,
    CertificateSide,
    CoordinateView,
    DataView,
    DifferenceLine,
    FileLink,
    FindingGroup,
    FindingView,
    LawView,
    Page,
    PictureView,
)
from codegen.report.wording import number, percent
from codegen.spec.model import Spec

LEAST_CORRELATION = 0.95
CLOSE_DIFFERENCE, FAIR_DIFFERENCE = 0.1, 0.25
SEVERITIES = ("problem", "warning", "info")


def render_report(spec: Spec, diagnosis: Diagnosis, models: Models, files: Mapping[str, str] | None = None) -> str:
    """The self-contained HTML report of a diagnosis; deterministic.

    Args:
        spec: that was diagnosed.
        models: of ``diagnosis``.
        files: label → path relative to the report, of the other files written.
    """
    return render("report/report.html.j2", page=page_view(spec, diagnosis, models, files or {}))


def page_view(spec: Spec, diagnosis: Diagnosis, models: Models, files: Mapping[str, str]) -> Page:
    """All values that the template prints."""
    return Page(
        name=spec.name,
        source=spec.source,
        spec_file=spec.path.name,
        spec_hash=spec.sha256,
        version=VERSION,
        verdict=diagnosis.verdict,
        sentence=diagnosis.sentence,
        reliability=diagnosis.reliability,
        added=diagnosis.verdict in ("effect", "ambiguous"),
        data=_data(diagnosis),
        errors=(*error_rows(diagnosis, models.declared), training_row(diagnosis)),
        published=tuple(spec.log.published.items()),
        effects=effect_views(diagnosis),
        refitted=refitted_rows(diagnosis, models.declared),
        parameter_errors=parameter_error_rows(diagnosis),
        remarks=diagnosis.remarks,
        laws=tuple(_law(e, models) for e in law_evidence(diagnosis, models)),
        remainder=remainder_rows(diagnosis, models.declared),
        material=percent(diagnosis.material),
        pictures=_pictures(diagnosis, models),
        rounds=round_views(diagnosis, models),
        leader=" and ".join(f"{e.kind} on {e.on}" for e in models.named),
        separation=separation_view(diagnosis.separation),
        proposal=proposal_rows(diagnosis.proposal),
        agreement=_agreement(diagnosis.agreement),
        findings=_findings(diagnosis),
        difference=_difference(spec, models.spec_text),
        observer_declared=spec.observer is not None,
        certificate=_certificate(diagnosis.certificate),
        files=tuple(FileLink(label, quote(path)) for label, path in files.items()),
    )


def _pictures(diagnosis: Diagnosis, models: Models) -> PictureView:
    same = all(declared == refit for declared, refit, _ in diagnosis.refitted.values())
    names = ["declared"] if same else ["declared", "refit"]
    names += ["augmented"] if diagnosis.verdict in ("effect", "ambiguous") else []
    series = held_out_series(models, names)
    thinned = max(c.samples for c in series.coordinates) > MOST_POINTS
    return PictureView(
        coordinates=tuple(CoordinateView(c.name, residual_panels(series, c)) for c in series.coordinates),
        legend=tuple((name, COLOURS[name]) for name in names),
        same=same,
        cutoff=number(series.cutoff_hz),
        thinned=number(MOST_POINTS) if thinned else "",
    )


def _law(found: LawEvidence, models: Models) -> LawView:
    unit, force = models.declared.position_units[found.coordinate], models.declared.force_unit(found.coordinate)
    units = {"speed": f"{unit}/s", "position": unit, "load": force, "acceleration": f"{unit}/s^2", "time": "s"}
    of = (units.get(found.variable, f"{force}/s"), force)

    def picture(direction: str) -> str:
        return f"{found.kind} on {found.on}{f', {direction}' if direction else ''}"

    panels = tuple(law_picture(p, found.variable, of, picture(p.direction)) for p in found.panels)
    shares = (percent(found.smooth), percent(found.law), percent(found.left))
    return LawView(found.kind, found.on, found.variable, *shares, panels)


def _data(diagnosis: Diagnosis) -> DataView:
    data = diagnosis.data
    return DataView(
        train=str(data["train"]),
        train_samples=_count(data["train_samples"]),
        test=str(data["test"]),
        held_out=number(data["held_out_seconds"]),
        sample_time=number(1e3 * data["sample_time_s"]),
        cutoff=number(data["cutoff_hz"]),
        restart=number(data["restart_s"]),
        blocks=_count(data["blocks"]),
        segments=_count(data["segments"]),
    )


def _agreement(agreement: Agreement | None) -> AgreementView | None:
    if agreement is None:
        return None
    return AgreementView(
        correlation=number(agreement.correlation),
        difference=percent(agreement.relative_difference),
        samples=_count(agreement.samples),
        level=_level(agreement),
    )


def _level(agreement: Agreement) -> Literal["close", "fair", "poor"]:
    if not agreement.correlation >= LEAST_CORRELATION or not agreement.relative_difference <= FAIR_DIFFERENCE:
        return "poor"
    return "close" if agreement.relative_difference <= CLOSE_DIFFERENCE else "fair"


def _findings(diagnosis: Diagnosis) -> tuple[FindingGroup, ...]:
    groups = []
    for role, lines in diagnosis.findings.items():
        views = sorted((_finding(words) for words in lines), key=lambda view: SEVERITIES.index(view.severity))
        groups.append(FindingGroup(role, str(diagnosis.data.get(role, role)), tuple(views)))
    return tuple(groups)


def _finding(words: str) -> FindingView:
    severity, mark, rest = words.partition(": ")
    return FindingView(severity, rest) if mark and severity in SEVERITIES else FindingView("info", words)


def _difference(spec: Spec, text: str) -> tuple[DifferenceLine, ...]:
    """The changed lines of the spec, each group under its line number."""
    before, after = spec.text.splitlines(), text.splitlines()
    lines = list(difflib.unified_diff(before, after, lineterm="", n=0))[2:]
    return tuple(_difference_line(line) for line in lines)


def _difference_line(line: str) -> DifferenceLine:
    match line[:1]:
        case "+":
            return DifferenceLine("added", line)
        case "-":
            return DifferenceLine("removed", line)
        case "@":
            return DifferenceLine("hunk", f"line {line.split()[1].lstrip('-').partition(',')[0]}")
        case _:
            return DifferenceLine("same", line)


def _certificate(change: CertificateChange | None) -> tuple[CertificateSide, CertificateSide] | None:
    if change is None:
        return None
    return _side(change.before), _side(change.after)


def _side(outcome: float | str) -> CertificateSide:
    if isinstance(outcome, str):
        return CertificateSide("", outcome)
    return CertificateSide(number(outcome), "")


def _count(value: int) -> str:
    return f"{value:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
