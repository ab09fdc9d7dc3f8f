"""The diagnosis report: the variables of its template, from a diagnosis and its models."""

import difflib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal
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
View = dict[str, Any]
"""Variables of the template by name."""
Outcome = Literal["chosen", "carried", "rival", "later", "passed", "rejected"]
"""Outcome of a candidate. carried: in the augmented model, while others tie with it; rival: ties with that one; later:
rejected in this round, but named in the verdict."""


def render_report(spec: Spec, diagnosis: Diagnosis, models: Models, files: Mapping[str, str] | None = None) -> str:
    """The self-contained HTML report of a diagnosis; deterministic.

    ``files``: label → path relative to the report, of the other files written.
    """
    shown = _models_shown(diagnosis)
    evidence, series = law_evidence(diagnosis, models), held_out_series(models, shown)
    groups = [*(_law_drawings(e, models) for e in evidence), *(residual_drawings(c) for c in series)]
    panels = drawn(groups)
    page: View = {
        "name": spec.name,
        "source": spec.source,
        "spec_file": spec.path.name,
        "spec_hash": spec.sha256,
        "version": VERSION,
        "errors": _error_rows(diagnosis, models.declared),
        "published": list(spec.log.published.items()),
        "effects": [_effect(e) for e in diagnosis.effects],
        "laws": list(zip(evidence, panels[: len(evidence)], strict=True)),
        "pictures": _pictures(shown, series, panels[len(evidence) :]),
        "rounds": _rounds(diagnosis, models),
        "leader": " and ".join(f"{e.kind} on {e.on}" for e in models.named),  # the effects of the augmented model
        "findings": _findings(diagnosis),
        "difference": _difference(spec, models.spec_text),
        "observer_declared": spec.observer is not None,
        "files": [(label, quote(path)) for label, path in (files or {}).items()],
    }
    return rendered(page, diagnosis)


def rendered(page: View, diagnosis: Diagnosis) -> str:
    """The HTML of a diagnosis and the variables ``page``."""
    added = diagnosis.verdict in ("effect", "ambiguous")
    return render("report/report.html.j2", page=page, found=diagnosis, added=added, words=wording)


def _error_rows(diagnosis: Diagnosis, system: System) -> list[View]:
    """Residual force and free-run position error by coordinate, and the relative force errors; ``shown`` by model.

    Coordinates are not combined: the two sides of a gear are not comparable.
    """

    models = (diagnosis.declared, diagnosis.refit, diagnosis.augmented)

    def row(quantity: str, i: int, unit: str, read: Callable[[ErrorFigures], tuple[float, ...]]) -> View:
        values = [read(e)[i] for e in models]
        factor, shown_unit = prefixed(values, unit)
        shown = [number(factor * v) for v in values]
        about = {"quantity": quantity, "coordinate": system.positions[i].name, "unit": unit_text(shown_unit)}
        return {**about, "shown": shown, "change": change(values[0], values[2])}

    def whole(quantity: str, values: Sequence[float]) -> View:
        about = {"quantity": quantity, "coordinate": "", "unit": ""}
        return {**about, "shown": [percent(v, 4) for v in values], "change": change(values[0], values[2])}

    count = range(system.degrees_of_freedom)
    return [
        *(row("force", i, system.force_unit(i), lambda e: e.force_rms_rows) for i in count),
        whole("relative", [e.relative_force for e in models]),
        *(row("position", i, system.position_units[i], lambda e: e.free_run_rmse_rows) for i in count),
        whole("training", diagnosis.training),
    ]


def _effect(found: FoundEffect) -> View:
    """An effect that was found, with its entry in the catalogue."""
    effect = CATALOGUE[found.kind].with_parameters(list(found.parameters))
    meanings = {p.name: p.meaning for p in effect.parameters}
    return {"found": found, "equation": effect.equation, "signature": effect.signature, "meanings": meanings}


def _rounds(diagnosis: Diagnosis, models: Models) -> list[View]:
    """The candidates of every round with their evidence, and effects of the verdict that were in no round.

    Those last ones are ``exchanged``: they replaced others, and were compared with the fit without these.
    """

    def view(candidates: Sequence[Candidate], before: Sequence[tuple[str, str]] = (), exchanged: bool = False) -> View:
        rows = [_candidate_row(c, diagnosis, models) for c in diagnosis.in_order(candidates)]
        return {"found_before": [f"{kind} on {on}" for kind, on in before], "rows": rows, "exchanged": exchanged}

    later = [view(one.candidates, one.found_before) for one in diagnosis.later_rounds]
    views = [view(diagnosis.candidates), *later, view(diagnosis.in_no_round, exchanged=True)]
    return [one for one in views if one["rows"]]


def _candidate_row(c: Candidate, diagnosis: Diagnosis, models: Models) -> View:
    """A row of a round's table; ``bar`` is the gain in %, 0 to 100."""
    effect = CATALOGUE[c.kind].with_parameters(list(c.parameters))
    units = unit_words(effect, places_of(effect, models.declared).index(c.on), models.declared)
    parameters = [
        f"{name} = {with_unit(value, units[name], 3)}{' (at its limit)' if name in c.at_limit else ''}"
        for name, value in c.parameters.items()
    ]
    if len(parameters) > MOST_PARAMETERS:
        parameters[MOST_PARAMETERS - 1 :] = [f"and {len(parameters) - MOST_PARAMETERS + 1} more"]
    why_not = c.why_not or (diagnosis.not_named(c) if c in diagnosis.candidates else "")
    return {
        "candidate": c,
        "parameters": parameters,
        "outcome": _outcome(c, diagnosis, models),
        "why_not": why_not.replace(" -", " −"),
        "bar": round(100 * min(max(c.gain, 0.0), 1.0)) if c.gain == c.gain else 0,
    }


def _outcome(candidate: Candidate, diagnosis: Diagnosis, models: Models) -> Outcome:
    def is_one_of(effects: Sequence[FoundEffect]) -> bool:
        return any((candidate.kind, candidate.on) == (e.kind, e.on) for e in effects)

    if diagnosis.is_named(candidate):
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


def _pictures(names: Sequence[str], series: Sequence[CoordinateSeries], panels: Sequence[tuple[Panel, ...]]) -> View:
    """The pictures of the residual by coordinate, and the data of their legend and caption."""
    thinned = max(c.samples for c in series) > MOST_POINTS
    return {
        "coordinates": [(c.name, own) for c, own in zip(series, panels, strict=True)],
        "legend": [(name, COLOURS[name]) for name in names],
        "same": "refit" not in names,
        "thinned": number(MOST_POINTS) if thinned else "",
    }


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
