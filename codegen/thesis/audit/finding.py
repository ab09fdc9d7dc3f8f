"""The verdict of the audit on one claim of the thesis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from codegen.thesis.audit.claim import Claim

Verdict = Literal["holds", "wrong", "insufficient", "unnecessary"]


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason.

    Attributes:
        derived: the correct formula; empty for a definition.
        counterexample: numbers by name, with ``eigenvalue`` (real part; None where no eigenvalue is in question).
        evidence: what was computed, as a key of the template with its numbers.
    """

    claim: Claim
    verdict: Verdict
    derived: str = ""
    counterexample: Mapping[str, Any] | None = None
    evidence: str = ""

    @property
    def kind(self) -> str:
        return self.claim.test
