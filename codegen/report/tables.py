"""The tables of the report from a diagnosis and its models."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Literal

from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.results import Candidate, Diagnosis, ErrorFigures, FoundEffect
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of, unit_words
from codegen.mechanics.system import System
from codegen.report.view import CandidateRow, EffectView, ErrorRow, ParameterView, RoundView
from codegen.report.wording import change, estimated, joined, number, percent, prefixed, unit_text, with_unit

Quantity = Literal["force", "relative", "position"]
Outcome = Literal["chosen", "carried", "rival", "later", "passed", "rejected"]
MOST_PARAMETERS = 8
"""Most lines of one candidate in a table; a sum of harmonics has two parameters an order."""
Read = Callable[[int, ErrorFigures], float]


def error_rows(diagnosis: Diagnosis, system: System) -> tuple[ErrorRow, ...]:
    """Residual force and free-run position error by coordinate, and the relative force error.

    Coordinates are not combined: the two sides of a gear are not comparable.
    """
    forces = [system.force_unit(i) for i in range(system.degrees_of_freedom)]

    def rows(quantity: Quantity, units: Sequence[str], read: Read) -> list[ErrorRow]:
        names = [x.name for x in system.positions]
        each = enumerate(zip(names, units, strict=True))
        return [_error_row(diagnosis, quantity, name, unit, partial(read, i)) for i, (name, unit) in each]

    relative = _error_row(diagnosis, "relative", "", "", _relative)
    return (*rows("force", forces, _force), relative, *rows("position", system.position_units, _position))


def training_row(diagnosis: Diagnosis) -> ErrorRow:
    """The relative force error on the training log, which published fits report."""
    declared, refit, augmented = (percent(value, 4) for value in diagnosis.training)
    moved = change(diagnosis.training[0], diagnosis.training[2])
    return ErrorRow("training", "", "", declared, refit, augmented, moved)


def _force(coordinate: int, figures: ErrorFigures) -> float:
    return figures.force_rms_rows[coordinate]


def _relative(figures: ErrorFigures) -> float:
    return figures.relative_force


def _position(coordinate: int, figures: ErrorFigures) -> float:
    return figures.free_run_rmse_rows[coordinate]


def _error_row(
    diagnosis: Diagnosis, quantity: Quantity, coordinate: str, unit: str, read: Callable[[ErrorFigures], float]
) -> ErrorRow:
    declared, refit, augmented = (read(e) for e in (diagnosis.declared, diagnosis.refit, diagnosis.augmented))
    factor, shown_unit = prefixed([declared, refit, augmented], unit)

    def shown(value: float) -> str:
        return percent(value, 4) if quantity == "relative" else number(factor * value)

    return ErrorRow(
        quantity=quantity,
        coordinate=coordinate,
        unit=unit_text(shown_unit),
        declared=shown(declared),
        refit=shown(refit),
        augmented=shown(augmented),
        change=change(declared, augmented),
    )


def effect_views(diagnosis: Diagnosis) -> tuple[EffectView, ...]:
    """The effects found, with what the catalogue says about them."""
    views = []
    for found in diagnosis.effects:
        effect = CATALOGUE[found.kind].with_parameters(list(found.parameters))
        meaning = {p.name: p.meaning for p in effect.parameters}
        parameters = [
            ParameterView(k, *_estimate(found, k, v), meaning[k], k in found.at_limit)
            for k, v in found.parameters.items()
        ]
        also = tuple(f"{kind} on {on}" for kind, on in found.also)
        views.append(EffectView(found.kind, found.on, effect.equation, effect.signature, tuple(parameters), also))
    return tuple(views)


def _estimate(found: FoundEffect, name: str, value: float) -> tuple[str, str]:
    """Value with unit, and interval; none for a value at its limit, which is no estimate."""
    interval = () if name in found.at_limit else found.intervals.get(name, ())
    shown, words = estimated(value, interval)
    return joined(shown, found.units[name]), words


def round_views(diagnosis: Diagnosis, models: Models) -> tuple[RoundView, ...]:
    """The candidates of every round with their evidence, and effects of the verdict that were in no round."""
    views = [RoundView((), _candidate_rows(diagnosis.candidates, diagnosis, models))]
    for later in diagnosis.later_rounds:
        rows = _candidate_rows(later.candidates, diagnosis, models)
        views.append(RoundView(tuple(_words(place) for place in later.found_before), rows))
    if diagnosis.standing:
        views.append(RoundView((), _candidate_rows(diagnosis.standing, diagnosis, models), exchanged=True))
    return tuple(view for view in views if view.rows)


def _candidate_rows(candidates: Sequence[Candidate], diagnosis: Diagnosis, models: Models) -> tuple[CandidateRow, ...]:
    return tuple(
        CandidateRow(
            candidate=c,
            parameters=_parameters(c, models.declared),
            outcome=_outcome(c, diagnosis, models),
            why_not=(c.why_not or (diagnosis.not_named(c) if c in diagnosis.candidates else "")).replace(" -", " −"),
            bar=round(100 * min(max(c.gain, 0.0), 1.0)) if c.gain == c.gain else 0,
        )
        for c in candidates
    )


def _words(name: tuple[str, str]) -> str:
    return f"{name[0]} on {name[1]}"


def _parameters(candidate: Candidate, system: System) -> tuple[str, ...]:
    effect = CATALOGUE[candidate.kind].with_parameters(list(candidate.parameters))
    units = unit_words(effect, places_of(effect, system).index(candidate.on), system)
    words = [
        f"{name} = {with_unit(value, units[name], 3)}{' (at its limit)' if name in candidate.at_limit else ''}"
        for name, value in candidate.parameters.items()
    ]
    if len(words) > MOST_PARAMETERS:
        words[MOST_PARAMETERS - 1 :] = [f"and {len(words) - MOST_PARAMETERS + 1} more"]
    return tuple(words)


def _outcome(candidate: Candidate, diagnosis: Diagnosis, models: Models) -> Outcome:
    place = (candidate.kind, candidate.on)
    if diagnosis.verdict == "effect" and place in _places(diagnosis.effects):
        return "chosen" if candidate.accepted else "later"
    if diagnosis.verdict == "ambiguous" and place in _places(models.named):
        return "carried"
    if diagnosis.verdict == "ambiguous" and place in _places(diagnosis.rivals):
        return "rival"
    return "passed" if candidate.accepted else "rejected"


def _places(effects: Sequence[FoundEffect]) -> set[tuple[str, str]]:
    return {(e.kind, e.on) for e in effects}
