"""The shipped audit, each claim judged once for all tests of this folder, and claims with another printed form."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from codegen.thesis.audit.claim import Claim, Finding, read_claims
from codegen.thesis.audit.judge import judge

ROOT = Path(__file__).parents[3]
THESIS = ROOT.parent / "shared" / "thesis.txt"


@cache
def claims() -> list[Claim]:
    """The shipped claims: a second of CPU to read."""
    return read_claims()


@cache
def _judged() -> dict[int, Finding]:
    """Place of a claim in the list → the finding, once a test has asked for it."""
    return {}


def _finding(at: int) -> Finding:
    if at not in _judged():
        _judged()[at] = judge(claims()[at])
    return _judged()[at]


def findings() -> list[Finding]:
    """All of them: half a minute of CPU where no test has asked before."""
    return [_finding(at) for at in range(len(claims()))]


def of(equation: str, part: str = "") -> list[Finding]:
    """Findings of an equation's parts that begin so; without a part, of the equation itself."""
    return [_finding(at) for at, claim in enumerate(claims()) if _is(claim, equation, part)]


def reprinted(claim: Claim, printed: Any) -> Finding:
    """The verdict if the thesis had printed something else."""
    return judge(replace(claim, entry=claim.entry.model_copy(update={"printed": printed})))


def claim(equation: str, part: str = "") -> Claim:
    return next(c for c in claims() if _is(c, equation, part))


def _is(claim: Claim, equation: str, part: str) -> bool:
    entry = claim.entry
    return entry.equation == equation and (entry.part.startswith(part) if part else not entry.part)
