"""Stand-ins for fits, parts and candidates, for tests of single steps of the forward selection."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from codegen.diagnosis.results import AtPlace
from codegen.diagnosis.selection.ranking import Ranked
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import stage, system_of


class Placed(AtPlace, SimpleNamespace):
    """An effect at a place."""


class InRound(SimpleNamespace):
    """A candidate of a round."""

    part, grade = Ranked.part, Ranked.grade


def fit(*parts: str) -> Any:
    trial = SimpleNamespace(parts=parts)
    return SimpleNamespace(runner=SimpleNamespace(trial=trial), trial=trial, part=parts[-1] if parts else None)


def rival(*parts: str) -> Any:
    return InRound(found=SimpleNamespace(trial=SimpleNamespace(parts=parts)))


def ranked(kind: str, share: float, names: tuple[str, ...] = ()) -> Any:
    found = fit(part_named(kind, names))
    found.trial.system = system_of(stage())
    return InRound(found=found, evidence=SimpleNamespace(share=share), why_not="")


def part_named(kind: str, names: tuple[str, ...] = ()) -> Any:
    """A part; with the names of its kind's usual form, or these."""
    usual = tuple(p.name for p in CATALOGUE[kind].parameters) if kind in CATALOGUE else ()
    return Placed(kind=kind, on="x", place=0, names=names or usual)
