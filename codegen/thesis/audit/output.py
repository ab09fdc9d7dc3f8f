"""Findings as JSON, as a table for a terminal, and as docs/audit.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from codegen.base.result import named
from codegen.base.text import render
from codegen.thesis.audit.claim import Finding, Verdict
from codegen.thesis.audit.formula import as_text

VERDICTS: tuple[Verdict, ...] = ("holds", "wrong", "insufficient", "unnecessary")


def audit_json(findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """An object for each claim."""
    return [
        {
            **named(f.claim.entry, "equation part given scan note"),
            **named(f, "kind verdict derived counterexample"),
            "chapter": f.claim.chapter,
            "printed": _printed(f),
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
            **row,
            "numbers": {k: v for k, v in (f.counterexample or {}).items() if v is not None},
            "evidence": f.evidence,
            "constant_U": f.claim.entry.constant_U,
        }
        for row, f in zip(audit_json(findings), findings, strict=True)
    ]
    definitions = sum(f.kind == "definition" for f in findings)
    return {"rows": rows, "counts": {v: counts[v] for v in VERDICTS}, "definitions": definitions}


def _printed(finding: Finding) -> str:
    printed = finding.claim.entry.printed
    conditions = finding.kind in ("hurwitz", "negative_definite", "inequality", "implies")
    return "; ".join(printed) if conditions and isinstance(printed, list) else as_text(printed)
