"""The diagnosis report: a typed page from a diagnosis, rendered by one template."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Literal
from urllib.parse import quote

from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.results import Agreement, Diagnosis
from codegen.report import wording
from codegen.report.evidence import LawEvidence, law_evidence
from codegen.report.pictures import COLOURS, law_picture, residual_panels
from codegen.report.series import MOST_POINTS, held_out_series
from codegen.report.tables import effect_views, error_rows, round_views, training_row
from codegen.report.view import LawView, Page, PictureView
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
    return rendered(page_view(spec, diagnosis, models, files or {}))


def rendered(page: Page) -> str:
    """The HTML of a page."""
    return render("report/report.html.j2", page=page, words=wording)


def page_view(spec: Spec, diagnosis: Diagnosis, models: Models, files: Mapping[str, str]) -> Page:
    """All values that the template prints."""
    system = models.declared
    names = [x.name for x in system.positions]
    forces = [system.force_unit(i) for i in range(system.degrees_of_freedom)]
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
        data=diagnosis.data,
        errors=(*error_rows(diagnosis, system), training_row(diagnosis)),
        published=tuple(spec.log.published.items()),
        effects=effect_views(diagnosis),
        refitted=diagnosis.refitted,
        units={s.name: unit for s, unit in system.units.items()},
        at_limit=diagnosis.at_limit,
        parameter_errors=diagnosis.parameter_errors,
        remarks=diagnosis.remarks,
        laws=tuple(_law(e, models) for e in law_evidence(diagnosis, models)),
        remainder=tuple(zip(names, forces, diagnosis.remainder, strict=True)),
        material=diagnosis.material,
        pictures=_pictures(diagnosis, models),
        rounds=round_views(diagnosis, models),
        leader=" and ".join(f"{e.kind} on {e.on}" for e in models.named),
        separation=diagnosis.separation,
        proposal=diagnosis.proposal,
        agreement=diagnosis.agreement,
        agreement_level=_level(diagnosis.agreement),
        findings=_findings(diagnosis),
        difference=_difference(spec, models.spec_text),
        observer_declared=spec.observer is not None,
        certificate=diagnosis.certificate,
        files=tuple((label, quote(path)) for label, path in files.items()),
    )


def _pictures(diagnosis: Diagnosis, models: Models) -> PictureView:
    same = all(declared == refit for declared, refit, _ in diagnosis.refitted.values())
    names = ["declared"] if same else ["declared", "refit"]
    names += ["augmented"] if diagnosis.verdict in ("effect", "ambiguous") else []
    series = held_out_series(models, names)
    thinned = max(c.samples for c in series.coordinates) > MOST_POINTS
    return PictureView(
        coordinates=tuple((c.name, residual_panels(series, c)) for c in series.coordinates),
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


def _level(agreement: Agreement | None) -> Literal["close", "fair", "poor"]:
    if (
        agreement is None
        or not agreement.correlation >= LEAST_CORRELATION
        or not agreement.relative_difference <= FAIR_DIFFERENCE
    ):
        return "poor"
    return "close" if agreement.relative_difference <= CLOSE_DIFFERENCE else "fair"


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
    before, after = spec.text.splitlines(), text.splitlines()
    lines = list(difflib.unified_diff(before, after, lineterm="", n=0))[2:]
    return tuple(_difference_line(line) for line in lines)


def _difference_line(line: str) -> tuple[str, str]:
    match line[:1]:
        case "+":
            return "added", line
        case "-":
            return "removed", line
        case "@":
            return "hunk", f"line {line.split()[1].lstrip('-').partition(',')[0]}"
        case _:
            return "same", line
