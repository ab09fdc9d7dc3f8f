"""Claims, which are formulas that the thesis prints under an equation number; findings on them, as JSON and as a page.

Claims are data (``claims/``, a YAML file for each chapter). Each names the quantity of our own derivation
(``derivations/``) with which ``judge.py`` compares the printed formula.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from codegen.base.errors import Place
from codegen.base.input_files import read_text
from codegen.base.result import named
from codegen.base.text import render
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_plain
from codegen.thesis.audit.derivation import as_text

CLAIMS = Path(__file__).parent / "claims"
Test = Literal["equal", "hurwitz", "negative_definite", "inequality", "implies", "definition"]
"""Kind of a claim: the formula equals the derived quantity; the conditions are necessary and sufficient for a derived
matrix to be Hurwitz, or negative definite; the inequalities hold; they follow from those in ``given``. A definition is
compared with nothing."""


class ClaimEntry(BaseModel):
    """One entry of a claims file.

    Attributes:
        equation: the number, such as "6.22", or a section if there is none.
        part: which of several formulas under that number.
        printed: the formula; rows of a matrix as lists; conditions as a list of inequalities.
        against: ``NAME.quantity`` with NAME of ``DERIVATIONS``; NAME alone for inequalities; empty for definitions.
        test: how it is judged; with an empty ``against`` it is a definition.
        given: inequalities that the thesis or the meaning of the symbols implies.
        constant_U: whether the thesis prints the formula for a U that does not depend on x.
        scan: how an illegible part of the scan was read.
        note: a remark for the reader.
    """

    model_config = ConfigDict(extra="forbid", strict=True)
    equation: str
    part: str = ""
    printed: Any
    against: str = ""
    test: Test = "equal"
    given: list[str] = []
    constant_U: bool = False
    scan: str = ""
    note: str = ""


class ClaimsFile(BaseModel):
    """A chapter's claims."""

    model_config = ConfigDict(extra="forbid", strict=True)
    chapter: str
    claims: list[ClaimEntry]


@dataclass(frozen=True)
class Claim:
    """A claim with its chapter and its place in the file."""

    chapter: str
    entry: ClaimEntry
    place: Place

    @property
    def test(self) -> Test:
        return self.entry.test if self.entry.against else "definition"


def read_claims() -> list[Claim]:
    """All claims, chapter by chapter, in the order of the files.

    Raises BadInput for a file that is not a claims file.
    """
    found = []
    for path in sorted(CLAIMS.glob("*.yaml")):
        document, places = load_plain(read_text(path, "a claims file (YAML)"), path.name)
        read = validate(ClaimsFile, document, places, path.name)
        for index, entry in enumerate(read.claims):
            found.append(Claim(read.chapter, entry, places.get(f"claims[{index}]", Place(path.name))))
    return found


Verdict = Literal["holds", "wrong", "insufficient", "unnecessary"]
"""``insufficient``: conditions hold at an unstable point; ``unnecessary``: they fail at a stable one."""


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason.

    Attributes:
        derived: the correct formula; empty for a definition.
        counterexample: numbers by name, with ``eigenvalue``, the largest real part, or None.
        evidence: a remark, such as "holds where U is constant"; mostly empty.
    """

    claim: Claim
    verdict: Verdict
    derived: str = ""
    counterexample: Mapping[str, Any] | None = None
    evidence: str = ""

    @property
    def kind(self) -> str:
        """The test of the claim, as the JSON calls it."""
        return self.claim.test


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
