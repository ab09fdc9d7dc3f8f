"""The practice logs in ../shared/practice, with the truth of each."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PRACTICE = ROOT.parent / "shared" / "practice"
TIERS = ("standard", "hard")


@dataclass(frozen=True)
class Case:
    """One log with its truth; ``folder``: with spec.yaml, train.csv, test.csv and truth.json."""

    tier: str
    folder: Path

    @property
    def name(self) -> str:
        return self.folder.name

    @property
    def title(self) -> str:
        return f"{self.tier}/{self.name}"

    @cached_property
    def truth(self) -> dict[str, Any]:
        read: dict[str, Any] = json.loads((self.folder / "truth.json").read_text())
        return read

    @property
    def group(self) -> str:
        return str(self.truth["group"])

    @property
    def accepted(self) -> list[set[str]]:
        """The kinds that are right for each true effect: its own and its exact twins'."""
        pairs = zip(self.truth["effects"], self.truth["equivalents"], strict=True)
        return [{effect["kind"], *(twin["kind"] for twin in twins)} for effect, twins in pairs]

    @property
    def standard_form(self) -> bool:
        """Whether every true effect has the equation of the catalogue."""
        return all("form" not in effect for effect in self.truth["effects"])


def cases_in(tier: str, folder: Path) -> list[Case]:
    """Every case of a tier that lies in a folder, in order."""
    return [Case(tier, p.parent) for p in sorted(folder.glob("case_*/truth.json"))]


def cases(tiers: Sequence[str] = TIERS, only: Sequence[str] = ()) -> list[Case]:
    """Every case of these tiers; or those whose name, or tier/name, is among ``only``."""
    found = [case for tier in tiers for case in cases_in(tier, PRACTICE / tier)]
    return [case for case in found if not only or {case.name, case.title} & set(only)]
