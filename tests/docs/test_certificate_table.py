"""docs/certificates.md says what the committed files prove: each shipped spec has a certificate or a proved refusal."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest
import yaml

from codegen.checker import verify

ROOT = Path(__file__).parents[2]
SPECS = sorted([*(ROOT / "specs").glob("*.yaml"), *(ROOT / "specs" / "thesis").glob("*.yaml")])
UNDECIDED: set[str] = set()
NAMES = [yaml.safe_load(path.read_text(encoding="utf-8"))["name"] for path in SPECS]
ROWS = {
    cells[1].strip(): [c.strip() for c in cells]
    for line in (ROOT / "docs" / "certificates.md").read_text(encoding="utf-8").splitlines()
    if len(cells := line.split("|")) > 10
}


@pytest.mark.parametrize("name", NAMES)
def test_the_row_is_what_the_proofs_say(name: str) -> None:
    folder, row = ROOT / "generated" / name, ROWS[name]
    proofs = {p.name: p.read_text(encoding="utf-8") for p in folder.glob("*.json") if p.name != "manifest.json"}
    for text in proofs.values():
        assert verify.check(text, folder).unbound == ()
    rates = {kind: float(Fraction(json.loads(text)["decay_rate"])) for kind, text in proofs.items()}
    if "certificate.json" in proofs:
        assert float(row[5]) == pytest.approx(rates["certificate.json"], rel=1e-3)
        if "limit.json" in proofs:
            assert float(row[7]) == pytest.approx(rates["limit.json"], rel=1e-3)
            assert rates["certificate.json"] <= rates["limit.json"]
    elif "refusal.json" in proofs:
        assert row[5] == "**refused**, proved" and rates["refusal.json"] <= 1e-6
    else:
        assert name in UNDECIDED and row[5] == "not decided"
