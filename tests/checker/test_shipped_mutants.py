"""The proofs that are shipped, with numbers, operators and names changed: what the checker still accepts is still true.

The judge is floating point: steps at corners and random points of the envelope, eigenvalues instead of pivots; of a
refutation, the spectral radius at its point.
"""

from __future__ import annotations

import itertools
import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.certify.region_proofs import REGION_PROOFS

from .test_verify import Cert, accepted, largest, lyapunov, mutants, number, value

GENERATED = Path(__file__).parents[2] / "generated"
WHOLE = ("certificate.json", "limit.json", "refusal.json")
PROOFS = sorted(p for p in GENERATED.glob("*/*.json") if p.name in (*WHOLE, *REGION_PROOFS))
LARGE = {"chain": 20, "two_link_arm": 100, "two_mass_gdfo": 20, "one_mass_dfo_implicit": 250}
TOTAL = 10_000
ROUNDING = 1e-7


def true(cert: Cert) -> bool:
    """Whether no sample contradicts the claim."""
    h, alpha = number(cert["sample_time"]), number(cert["decay_rate"])
    implicit = cert["observer"]["integration"] == "implicit"
    fall = 1 / (1 + alpha * h) ** 2 if implicit else 1 - 2 * alpha * h
    if min(h, fall) <= 0 or (implicit and alpha <= 0):  # an explicit step may be claimed to let V grow by a factor
        return False
    steps = [np.linalg.inv(np.eye(len(a)) - h * a) if implicit else np.eye(len(a)) + h * a for a in matrices(cert)]
    if cert["along"]:
        return all(np.abs(np.linalg.eigvals(phi)).max() ** 2 >= fall * (1 - ROUNDING) for phi in steps)
    p = lyapunov(cert)
    scale = np.sqrt(np.abs(np.diag(p)))
    if not np.array_equal(p, p.T) or np.linalg.eigvalsh(p / np.outer(scale, scale)).min() <= 0:
        return False
    if not all(made_good(entry, p, fall) for entry in cert["reversals"]):
        return False
    return all(largest(phi.T @ p @ phi, p) <= fall + ROUNDING for phi in steps)


def made_good(entry: dict[str, Any], p: Any, fall: float) -> bool:
    growth = number(entry["growth"])
    turn = np.diag([-1.0 if i in entry["flips"] else 1.0 for i in range(len(p))])
    enough = growth >= largest(turn @ p @ turn, p) * (1 - ROUNDING)
    return enough and growth * fall ** entry["dwell_samples"] <= 1 + ROUNDING


def operating_points(cert: Cert) -> list[dict[str, float]]:
    """Corners, the centre and random points of the envelope."""
    dice = random.Random(0)
    ends = [[number(x) for x in pair] for pair in cert["variables"].values()]
    points = [*itertools.islice(itertools.product(*ends), 64), [sum(pair) / 2 for pair in ends]]
    points += [[dice.uniform(*pair) for pair in ends] for _ in range(40 if ends else 0)]
    return [dict(zip(cert["variables"], point, strict=True)) for point in points]


def matrices(cert: Cert) -> list[Any]:
    """A at each of the operating points."""
    found = []
    for at in operating_points(cert):
        theta = {entry["name"]: value(entry["expression"], at) for entry in cert["parameters"]}
        found.append(np.array([[value(x, theta) for x in row] for row in cert["matrix"]]))
    return found


def judged(path: Path, count: int) -> tuple[int, int]:
    """(accepted, refused) of so many mutants."""
    cert, dice = json.loads(path.read_text("utf-8")), random.Random(str(path.relative_to(GENERATED)))
    assert accepted(cert) and true(cert)
    verdicts = [0, 0]
    for mutant in mutants(cert, dice, count, numbers_only=False):
        verdict = accepted(mutant)
        verdicts[not verdict] += 1
        assert not verdict or true(mutant), mutant
    return verdicts[0], verdicts[1]


def identity(path: Path) -> str:
    return f"{path.parent.name}-{path.stem}"


QUICK = [p for p in PROOFS if p.parent.name in ("one_mass", "rig_dfob") and p.name in (*WHOLE, "weak.json")]


@pytest.mark.parametrize("path", QUICK, ids=identity)
def test_accepted_mutants_of_what_is_shipped_are_true(path: Path) -> None:
    _, refused = judged(path, 80)
    assert refused >= 15


@pytest.mark.slow
def test_ten_thousand_mutants_of_what_is_shipped() -> None:
    small = [p for p in PROOFS if p.parent.name not in LARGE]
    count = -(-(TOTAL - sum(LARGE.get(p.parent.name, 0) for p in PROOFS)) // len(small))
    counts = {identity(p): judged(p, LARGE.get(p.parent.name, count)) for p in PROOFS}
    kept, refused = (sum(c[k] for c in counts.values()) for k in (0, 1))
    print(f"{kept} accepted, all of them true; {refused} refused", counts)
    assert kept + refused >= TOTAL and min(kept, refused) > TOTAL / 10
