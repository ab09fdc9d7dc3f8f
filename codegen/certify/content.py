"""What the JSON objects of a certificate and of a refutation have in common (docs/certificate_format.md)."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.analysis.analysis import Analysis
from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.certify.decimals import rounded, rounded_matrix, texts
from codegen.certify.family import Family
from codegen.certify.prefix import rational_text, to_prefix
from codegen.certify.reading import code_reading
from codegen.checker import verify
from codegen.friction import DynamicLaw
from codegen.spec.model import Spec

FORMAT = "stiction-certificate/1"
DIGITS = (4, 6, 9, 12)


def frame(
    spec: Spec,
    analysis: Analysis,
    family: Family,
    files: Mapping[str, str],
    command: str,
    places: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """What is known before anything is proved: subject, observer, error, and the family of matrices over its envelope.

    Args:
        files: name → SHA-256 of the generated sources.
        command: that writes it.
        places: where the twin among these shows its inputs and outputs; None where nothing is to be replayed.
    """
    observer = analysis.dynamics.observer
    return {
        "format": FORMAT,
        "tool": {"name": "stiction", "version": VERSION, "command": command},
        "subject": {"name": spec.name, "spec_sha256": spec.file_sha256, "files": dict(sorted(files.items()))},
        "observer": {"kind": observer.kind, "velocity": observer.velocity, "integration": observer.integration},
        "claim": "",
        "sample_time": rational_text(observer.sample_time),
        "error": [
            {"name": e.symbol.name, "meaning": _meaning(e, observer.level_errors), "unit": e.unit}
            for e in observer.errors
        ],
        "variables": {v.name: [rational_text(lo), rational_text(hi)] for v, (lo, hi) in family.variables.items()},
        "splits": {},
        "parameters": [{"name": s.name, "expression": to_prefix(e)} for s, e in family.parameters.items()],
        "matrix": [[to_prefix(e) for e in family.matrix.row(i)] for i in range(family.matrix.rows)],
        "lyapunov_matrix": [],
        "cover": [],
        "code": code_reading(observer, family, places or {}),
        "decay_rate": "0",
        "reversals": [],
        "along": [],
        "assumptions": [],
    }


def _meaning(error: Any, level_errors: bool) -> str:
    return f"sign of slip times ({error.meaning})" if level_errors and error.contact is not None else str(error.meaning)


@dataclass(frozen=True)
class Found:
    """A proposal of the solver: a common P for all cells.

    Attributes:
        alpha: 1/s.
        splits: variable → breakpoints, exact.
        matrices: P, m by m.
        cover: a tree of cuts on whose leaves the checker is to decide it (covered.py), and none where the cells are
            those of ``splits``.
    """

    alpha: float
    splits: Mapping[sympy.Symbol, list[Any]]
    matrices: list[NDArray[np.float64]]
    cover: Sequence[Any] = ()


def proved(
    base: Mapping[str, Any], analysis: Analysis, family: Family, found: Found, turning: bool = False
) -> tuple[dict[str, Any], verify.Report]:
    """The certificate with the fewest digits that the checker accepts.

    Raises:
        codegen.checker.verify.Refused: if it accepts none.
    """
    for digits in DIGITS[:-1]:
        content = _content(base, analysis, family, found, digits, turning)
        with suppress(verify.Refused):
            return content, verify.check(json.dumps(content))
    content = _content(base, analysis, family, found, DIGITS[-1], turning)
    return content, verify.check(json.dumps(content))


def proved_alike(
    parts: Sequence[tuple[Mapping[str, Any], Family, Found]],
    analysis: Analysis,
    finish: Callable[[int, dict[str, Any]], dict[str, Any]],
) -> list[dict[str, Any]]:
    """Certificates that the checker accepts all with the same digits: a proposal with a common P keeps it.

    Args:
        parts: what ``proved`` takes, each.
        finish: (which part, its certificate) → the certificate with what else is to stand in it.

    Raises:
        codegen.checker.verify.Refused: if it accepts them with no number of digits.
    """
    for digits in DIGITS:
        made = [_content(base, analysis, family, found, digits, False) for base, family, found in parts]
        contents = [finish(k, content) for k, content in enumerate(made)]
        try:
            for content in contents:
                verify.check(json.dumps(content))
        except verify.Refused:
            if digits == DIGITS[-1]:
                raise
            continue
        break
    return contents


def _content(
    base: Mapping[str, Any], analysis: Analysis, family: Family, found: Found, digits: int, turning: bool
) -> dict[str, Any]:
    observer = analysis.dynamics.observer
    h = observer.sample_time
    exact = [rounded_matrix(matrix, digits, np.sqrt(np.diag(matrix))) for matrix in found.matrices]
    rate, together = rounded(found.alpha - abs(found.alpha) * 10.0 ** (1 - digits), 4), [exact]
    fall = 1 / (1 + float(rate * h)) ** 2 if analysis.dynamics.implicit else 1 - 2 * float(rate * h)
    reversals = [_reversal(together, analysis, contact, fall) for contact in range(len(observer.signs))]
    words = {"observer": observer, "reversals": [r for r in reversals if r], "rate": float(rate), "period": float(h)}
    words |= {"turning": turning}
    words["stateful"] = [(c.name, c.law.name) for c in observer.system.contacts if isinstance(c.law, DynamicLaw)]
    words |= {"variables": {v.name: (float(lo), float(hi)) for v, (lo, hi) in family.variables.items()}}
    return {
        **base,
        "claim": " ".join(render("text/claim.j2", **words).split()),
        "splits": {v.name: [rational_text(b) for b in breaks] for v, breaks in found.splits.items()},
        "lyapunov_matrix": texts(exact[0]),
        "cover": [*found.cover],
        "decay_rate": rational_text(rate),
        "reversals": [r for r in reversals if r],
        "assumptions": [line.strip() for line in render("text/assumptions.j2", **words).splitlines() if line.strip()],
    }


def _reversal(
    matrices: Sequence[Sequence[list[list[Any]]]], analysis: Analysis, contact: int, fall: float
) -> dict[str, Any] | None:
    """How much V can grow when a contact's slip turns, and how many samples bring it down again.

    Args:
        matrices: the P at each place, any of which may follow any other of that place.
    """
    observer = analysis.dynamics.observer
    flips = [k for k, e in enumerate(observer.errors) if e.contact == contact]
    if not observer.level_errors or not flips:
        return None
    try:
        return turn_cost(matrices, observer.system.contacts[contact].name, flips, fall)
    except (np.linalg.LinAlgError, OverflowError):  # P is nearly singular: nothing is said of a reversal
        return None


def turn_cost(
    matrices: Sequence[Sequence[list[list[Any]]]], contact: str, flips: list[int], fall: float
) -> dict[str, Any]:
    """The entry of ``reversals``: what V grows by where these components change sign, and what makes it good again.

    Args:
        matrices: the P at each place, exact, any of which may follow any other of that place.
        fall: of V in a sample.
    """
    floats = [[np.array(matrix, dtype=float) for matrix in here] for here in matrices]
    turn = np.diag([-1.0 if k in flips else 1.0 for k in range(len(floats[0][0]))])
    pairs = [pair for here in floats for pair in product(here, repeat=2)]
    growth = max(1.0, *[float(np.linalg.eigvals(np.linalg.solve(p, turn @ q @ turn)).real.max()) for p, q in pairs])
    bound = rounded(growth * (1 + 1e-6) + 1e-6, 7) if growth > 1 + 1e-12 else sympy.Integer(1)
    dwell = math.ceil(math.log(float(bound)) / -math.log(fall) * (1 + 1e-9)) + int(bool(bound > 1))
    return {"contact": contact, "flips": flips, "growth": rational_text(bound), "dwell_samples": int(dwell)}
