"""docs/certificates.md says what the committed files prove: each shipped spec has a certificate or a proved refusal."""

from __future__ import annotations

import json
import re
from fractions import Fraction
from pathlib import Path

import pytest

from codegen.checker import ellipsoid, errors, verify
from tests.slow_cases import slow_except

ROOT = Path(__file__).parents[2]
SPECS = sorted([*(ROOT / "specs").glob("*.yaml"), *(ROOT / "specs" / "thesis").glob("*.yaml")])
UNDECIDED: set[str] = set()
NAMES = [re.search(r"(?m)^name: (\w+)$", path.read_text(encoding="utf-8"))[1] for path in SPECS]
PAGE = (ROOT / "docs" / "certificates.md").read_text(encoding="utf-8")


def table(heading: str) -> dict[str, dict[str, str]]:
    """System → column → cell, of the table below a heading of the page."""
    lines = [line for line in PAGE.split(f"## {heading}\n")[1].split("\n## ")[0].splitlines() if line.startswith("| ")]
    head, *cells = ([cell.strip() for cell in line.split("|")[1:-1]] for line in lines)
    return {row[0]: dict(zip(head, row, strict=True)) for row in cells}


DECAY, BOUNDS = table("Decay"), table("Error bound")
NO_BOUND = dict.fromkeys(("error bound", "through stick", "worst"), "–")


LONG = ("chain", "one_mass_domain", "two_mass_gdfo")
"""Their proofs take a second and more to verify."""


@pytest.mark.parametrize("name", slow_except(NAMES, [name for name in NAMES if name not in LONG]))
def test_the_row_is_what_the_proofs_say(name: str) -> None:
    folder, row = ROOT / "generated" / name, DECAY[name]
    others = ("manifest.json", "ellipsoid.json")  # the second is checked with the proof beside it
    proofs = {p.name: p.read_text(encoding="utf-8") for p in folder.glob("*.json") if p.name not in others}
    for text in proofs.values():
        assert verify.check(text, folder).unbound == ()
    bounds, stated = friction_bounds(folder), BOUNDS.get(name, NO_BOUND)
    assert_newtons(stated["error bound"], bounds)
    # What the same disturbances reach:
    worst = [float(word) for word in re.split("[–, ]+", stated["worst"]) if word]
    assert all(0.8 * bound < w < 1.001 * bound for w, bound in zip(worst, in_cell(bounds), strict=True))
    through = [float(word) for word in re.split("[–, ]+", stated["through stick"]) if word]
    assert through == pytest.approx(friction_bounds(folder, any_friction=True), rel=1e-3)
    rates = {kind: float(Fraction(json.loads(text)["decay_rate"])) for kind, text in proofs.items()}
    if "certificate.json" in proofs:
        assert float(row["certified"]) == pytest.approx(rates["certificate.json"], rel=1e-3)
        if "limit.json" in proofs:
            assert float(row["refuted"]) == pytest.approx(rates["limit.json"], rel=1e-3)
            assert rates["certificate.json"] <= rates["limit.json"]
    elif "refusal.json" in proofs:
        assert row["certified"] == "**refused**, proved" and rates["refusal.json"] <= 1e-6
    else:
        assert name in UNDECIDED and row["certified"] == "not decided"


def friction_bounds(folder: Path, any_friction: bool = False) -> list[float]:
    """What ellipsoid.json bounds of each friction error in the long run."""
    if not (folder / "ellipsoid.json").exists():
        return []
    claim, proof = (json.loads((folder / f"{name}.json").read_text("utf-8")) for name in ("ellipsoid", "proof"))
    files = {p.name: p.read_text("utf-8") for p in folder.glob(f"{folder.name}.[ch]")}
    found = ellipsoid.bounded(proof, claim, errors.prove(proof, files))
    rows = [(row, float(b)) for ball, each in zip(claim["sets"], found, strict=True)
            if ("friction" in ball) == any_friction for row, b in zip(ball["rows"], each, strict=False)]  # fmt: skip
    velocities = [k for k, e in enumerate(proof["errors"]) if e["truth"] in proof["acceleration"]]
    return [bound for (*c, _), bound in rows if all(c[k] == "0" for k in velocities)]


def in_cell(proved: list[float]) -> list[float]:
    """The bounds, or the ends of their range where there are many, as a cell of the table has them."""
    return [min(proved), max(proved)] if len(proved) > 2 else proved


def assert_newtons(cell: str, proved: list[float]) -> None:
    """The bounds in the table's cell, or their range where there are many, are those of ellipsoid.json."""
    numbers = [float(word) for word in re.sub(r"\(.*?\)", "", cell).replace("–", " ").split() if word[0].isdigit()]
    assert numbers == pytest.approx(in_cell(proved), rel=1e-3)
