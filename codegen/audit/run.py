"""The audit: every claim judged; the table, the JSON and docs/audit.md from the findings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cache
from typing import Any

from codegen.audit.claim import Claim, read_claims
from codegen.audit.conditions import judge_conditions, judge_inequality
from codegen.audit.equality import judge_equality, prove_form
from codegen.audit.finding import Finding, Verdict
from codegen.audit.formula import as_text
from codegen.audit.world import World
from codegen.audit.worlds import WORLDS
from codegen.errors import BadInput, nearest_name
from codegen.text import render

VERDICTS: tuple[Verdict, ...] = ("holds", "wrong", "insufficient", "unnecessary")


def run_audit(claims: Sequence[Claim] | None = None) -> list[Finding]:
    """Judge all shipped claims, or the given ones."""
    return [judge(claim) for claim in (read_claims() if claims is None else claims)]


def judge(claim: Claim) -> Finding:
    """The verdict on one claim, from computation.

    Raises:
        BadInput: for a derivation that does not exist, or a printed form that cannot be read in its names.
    """
    if claim.test == "definition":
        return Finding(claim, "holds")
    name, _, quantity = claim.entry.against.partition(".")
    if name not in WORLDS:
        raise BadInput(claim.place, f"no derivation `{name}`", ", ".join(WORLDS), nearest_name(name, WORLDS))
    world = _world(name)
    if claim.test in ("inequality", "implies"):
        return judge_inequality(claim, world)
    derived = world.derived.get(quantity)
    if derived is None:
        found, known = f"`{name}` derives no `{quantity}`", ", ".join(world.derived)
        raise BadInput(claim.place, found, f"one of {known}", nearest_name(quantity, world.derived))
    if claim.test == "equal":
        return judge_equality(claim, world, derived)
    return judge_conditions(claim, world, derived)


@cache
def _world(name: str) -> World:
    world = WORLDS[name]()
    for derived in world.derived.values():
        if derived.form:
            prove_form(derived, world)
    return world


def audit_json(findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """One object a claim."""
    return [
        {
            "equation": f.claim.entry.equation,
            "part": f.claim.entry.part,
            "chapter": f.claim.chapter,
            "kind": f.kind,
            "verdict": f.verdict,
            "printed": _printed(f),
            "derived": f.derived,
            "counterexample": dict(f.counterexample) if f.counterexample is not None else None,
            "given": list(f.claim.entry.given),
            "scan": f.claim.entry.scan,
            "note": f.claim.entry.note,
        }
        for f in findings
    ]


def audit_summary(findings: Sequence[Finding]) -> str:
    """The table for a terminal."""
    return render("text/audit.txt.j2", **_view(findings))


def audit_document(findings: Sequence[Finding]) -> str:
    """docs/audit.md."""
    return render("text/audit.md.j2", **_view(findings))


def _view(findings: Sequence[Finding]) -> dict[str, Any]:
    counts = Counter(f.verdict for f in findings)
    rows = [
        {
            "equation": f.claim.entry.equation,
            "part": f.claim.entry.part,
            "chapter": f.claim.chapter,
            "kind": f.kind,
            "verdict": f.verdict,
            "printed": _printed(f),
            "derived": f.derived,
            "numbers": {k: v for k, v in (f.counterexample or {}).items() if v is not None},
            "evidence": f.evidence,
            "given": f.claim.entry.given,
            "constant_U": f.claim.entry.constant_U,
            "scan": f.claim.entry.scan,
            "note": f.claim.entry.note,
        }
        for f in findings
    ]
    definitions = sum(f.kind == "definition" for f in findings)
    return {"rows": rows, "counts": {v: counts[v] for v in VERDICTS}, "definitions": definitions}


def _printed(finding: Finding) -> str:
    printed = finding.claim.entry.printed
    conditions = finding.kind in ("hurwitz", "negative_definite", "inequality", "implies")
    return "; ".join(printed) if conditions and isinstance(printed, list) else as_text(printed)
