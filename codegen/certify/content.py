"""Content of a certificate as a JSON object, which a refutation shares (docs/certificate_format.md)."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.analysis.analysis import Analysis
from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.certify.centre import least_rate
from codegen.certify.certificate_text import rational_text, rounded, rounded_matrix, texts, to_prefix
from codegen.certify.family import Family
from codegen.checker import verify
from codegen.spec.model import Spec

FORMAT = "stiction-certificate/1"
"""Name and version of the format."""
DIGITS = (4, 6, 9, 12)
"""Numbers of significant digits of P that are tried in turn, until the checker accepts."""
FLOAT_ERROR = 1e-3
"""Relative error up to which a rate computed in floating point may be wrong."""
Frame = Callable[[Analysis, Family], dict[str, Any]]
"""(analysis, family) → fields of a certificate that do not depend on the proof: ``frame`` of one spec and its files."""


def frame(spec: Spec, files: Mapping[str, str], command: str, analysis: Analysis, family: Family) -> dict[str, Any]:
    """The fields of a certificate that do not depend on the proof: subject, observer, errors, family over the envelope.

    The fields of the proof (claim, P, rate, reversals and so on) are present and empty. ``files``: name → SHA-256 of
    the generated sources.
    """
    observer = analysis.dynamics.observer
    signed = {e for e in observer.errors if observer.level_errors and e.contact is not None}  # certified as forces
    meanings = [f"sign of slip times ({e.meaning})" if e in signed else e.meaning for e in observer.errors]
    named = zip(observer.errors, meanings, strict=True)
    return {
        "format": FORMAT,
        "tool": {"name": "stiction", "version": VERSION, "command": command},
        "subject": {"name": spec.name, "spec_sha256": spec.file_sha256, "files": dict(sorted(files.items()))},
        "observer": {"kind": observer.kind, "velocity": observer.velocity, "integration": observer.integration},
        "claim": "",
        "sample_time": rational_text(observer.sample_time),
        "error": [{"name": e.symbol.name, "meaning": meaning, "unit": e.unit} for e, meaning in named],
        "variables": {v.name: [rational_text(lo), rational_text(hi)] for v, (lo, hi) in family.variables.items()},
        "splits": {},
        **as_prefix(family),
        "lyapunov_matrix": [],
        "cover": [],
        "decay_rate": "0",
        "reversals": [],
        "along": [],
        "assumptions": [],
    }


def as_prefix(family: Family) -> dict[str, Any]:
    """The fields of a family's matrix and of its parameters."""
    return {
        "parameters": [{"name": s.name, "expression": to_prefix(e)} for s, e in family.parameters.items()],
        "matrix": [[to_prefix(e) for e in family.matrix.row(i)] for i in range(family.matrix.rows)],
    }


@dataclass(frozen=True)
class Found:
    """A proposal: a Lyapunov matrix P with its decay rate for a family of error matrices, found in floating point.

    Attributes:
        family: the error matrices over ranges of their variables.
        p: P, m by m.
        rate: α, 1/s; if negative, V may grow.
        splits: variable → breakpoints of the cells, exact.
        cover: one binary tree of cuts, on whose leaves the checker verifies the decay (decay.py); empty if the cells
            are those of ``splits``.
        kind: region of a DFO's envelope: sliding, presliding, weak, passing or recovery; "" for the whole envelope.
        best_rate: α of another P, 1/s, if this P is chosen for shorter dwell times at reversals; else None.
        matrices: some matrices A of the family, N by m by m, for which P was found; or None.
    """

    family: Family
    p: NDArray[np.float64]
    rate: float
    splits: Mapping[sympy.Symbol, list[Any]] = field(default_factory=dict)
    cover: Sequence[Any] = ()
    kind: str = ""
    best_rate: float | None = None
    matrices: NDArray[np.float64] | None = None

    def rounded(self, digits: int) -> tuple[list[list[Any]], Any]:
        """(P rounded to so many significant digits, the rate rounded down as much), exact."""
        p = rounded_matrix(self.p, digits, np.sqrt(np.diag(self.p)))
        return p, rounded(self.rate - abs(self.rate) * 10.0 ** (1 - digits), 4)

    def survives(self, digits: int, h: float) -> bool:
        """Whether P, rounded to so many digits, still has the rate at ``matrices``; if not, the checker would refuse.

        The test takes milliseconds where the checker takes seconds.
        """
        if self.matrices is None:
            return True
        p, rate = self.rounded(digits)
        try:
            found = least_rate(np.array(p, dtype=float), self.matrices, h)
            return found >= float(rate) - FLOAT_ERROR * abs(float(rate))
        except np.linalg.LinAlgError:  # not positive definite
            return False


def proved(
    parts: Sequence[tuple[Mapping[str, Any], Found]],
    analysis: Analysis,
    finish: Callable[[Found, dict[str, Any]], dict[str, Any]] = lambda _, content: content,
    turning: bool = False,
) -> list[tuple[dict[str, Any], verify.Report]]:
    """Certificates that the checker accepts, with its reports; P is rounded to the fewest digits that serve all parts.

    Since the number of digits is the same, parts with one P in floating point have one P in exact numbers.

    Args:
        parts: pairs of the fields that do not depend on the proof (``frame``) and the proposal.
        finish: (proposal, certificate) → the certificate with further entries.
        turning: whether the claim is one V for all signs of the slips.

    Raises:
        codegen.checker.verify.Refused: if the checker refuses them for every number in ``DIGITS``.
    """

    def attempt(digits: int) -> list[tuple[dict[str, Any], verify.Report]]:
        made = [(found, _content(base, found, analysis, digits, turning)) for base, found in parts]
        contents = [finish(*each) for each in made]
        return [(content, verify.check(json.dumps(content))) for content in contents]

    for digits in DIGITS[:-1]:
        if all(found.survives(digits, analysis.dynamics.period) for _, found in parts):
            with suppress(verify.Refused):
                return attempt(digits)
    return attempt(DIGITS[-1])


def _content(base: Mapping[str, Any], found: Found, analysis: Analysis, digits: int, turning: bool) -> dict[str, Any]:
    """A certificate for a proposal, with P and the rate rounded."""
    observer, h = analysis.dynamics.observer, analysis.dynamics.observer.sample_time
    exact, rate = found.rounded(digits)
    share = float(rate * h)
    decay = 2 * math.log1p(share) if analysis.dynamics.implicit else -math.log1p(-2 * share)
    reversals = []
    for contact in range(len(observer.signs)) if observer.level_errors else ():
        if flips := [k for k, e in enumerate(observer.errors) if e.contact == contact]:
            with suppress(np.linalg.LinAlgError, OverflowError):  # P is nearly singular: no entry for this reversal
                reversals.append(reversal_entry(exact, observer.system.contacts[contact].name, flips, decay))
    words = {"observer": observer, "reversals": reversals, "rate": float(rate), "period": float(h), "turning": turning}
    words["bounded"] = ()  # ellipsoid.json, made from this certificate, adds the contacts (with_reversals)
    words["stateful"] = [(c.name, c.law.name) for c in observer.system.contacts if c.law.states]
    words["variables"] = {v.name: (float(lo), float(hi)) for v, (lo, hi) in found.family.variables.items()}
    words["functions"] = {s.name: e for s, e in found.family.bounded.items()}
    return {
        **base,
        "claim": one_line("text/claim.j2", **words),
        "splits": {v.name: [rational_text(b) for b in breaks] for v, breaks in found.splits.items()},
        "lyapunov_matrix": texts(exact),
        "cover": [*found.cover],
        "decay_rate": rational_text(rate),
        "reversals": reversals,
        "assumptions": lines("text/assumptions.j2", **words),
    }


def with_reversals(content: Mapping[str, Any], contacts: Sequence[str]) -> dict[str, Any]:
    """The certificate with these contacts in its assumption on reversals, which ellipsoid.json covers."""
    before, after = (one_line("text/reversal_sample.j2", bounded=each) for each in ((), contacts))
    return {**content, "assumptions": [after if line == before else line for line in content["assumptions"]]}


def one_line(template: str, **words: Any) -> str:
    """The text of a template with white space and line breaks replaced by single spaces."""
    return " ".join(render(template, **words).split())


def lines(template: str, **words: Any) -> list[str]:
    """The lines of a template's text that are not empty."""
    return [line.strip() for line in render(template, **words).splitlines() if line.strip()]


def reversal_entry(exact: list[list[Any]], contact: str, flips: list[int], decay: float) -> dict[str, Any]:
    """An entry of ``reversals``: the growth g of V = e'Pe at a reversal, and the dwell time after it.

    At the reversal e becomes Je, J = diag(±1), with −1 at the indices ``flips``. g is the least number with J'PJ ≤ gP,
    rounded up; the dwell time is log(g)/decay samples, rounded up, after which V is at most its value before.

    Args:
        exact: P, exact.
        decay: −log of the factor by which V is multiplied in a sample.

    Raises:
        numpy.linalg.LinAlgError: if P is singular.
        OverflowError: if the dwell time is infinite.
    """
    p = np.array(exact, dtype=float)
    j = np.diag([-1.0 if k in flips else 1.0 for k in range(len(p))])
    # Not by a Cholesky factor: P, rounded to few digits, may be indefinite, which the checker then refuses.
    growth = max(1.0, float(np.linalg.eigvals(np.linalg.solve(p, j @ p @ j)).real.max()))
    bound = rounded(growth * (1 + 1e-6) + 1e-6, 7) if growth > 1 + 1e-12 else sympy.Integer(1)
    dwell = math.ceil(math.log(float(bound)) / decay * (1 + 1e-9))
    return {"contact": contact, "flips": flips, "growth": rational_text(bound), "dwell_samples": int(dwell)}
