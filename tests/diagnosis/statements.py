"""Verdicts in words from plain values, without a diagnosis."""

from __future__ import annotations

from typing import Any

from codegen.diagnosis.results import Remainder, Statement
from codegen.diagnosis.verdict.statement import main_variables, stated


def statement_of(verdict: str, left: Remainder | None = None, **given: Any) -> Statement:
    """The statement of a verdict where nothing else is known; ``left`` is on its only coordinate."""
    plain: dict[str, Any] = dict.fromkeys(
        ("effects", "rivals", "against", "errors", "remarks", "faults", "doubts", "changes", "written"), ()
    )
    plain |= {
        "by_force": True,
        "declared": 2.0,
        "refit": 2.0,
        "augmented": 1.0,
        "training": (),
        "unit": "N",
        "where": "",
    }
    plain |= {"records": 0, "refused": None, "noise": 5.2, "far": 0.9, "material": 0.02, "experiment": None}
    plain |= {"left": left, "left_on": "", "over": [], "kept": False, "drive": "drive force"} | given
    if left is not None:
        plain["over"] = main_variables(left, plain["material"])
    return stated(verdict=verdict, **plain)
