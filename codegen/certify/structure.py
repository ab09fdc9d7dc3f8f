"""A certificate by structure, for any M(x), where it has no expression: what one mode does is certified for all.

Measured velocity, a tracker: e[k+1] = (I − h G M⁻¹(x)) e[k], G = −K_2 symmetric and positive definite, so with
f = G^(−1/2) e and N = G^(1/2) M⁻¹ G^(1/2), which is symmetric, f[k+1] = (I − h N(x)) f[k] and V = e'G⁻¹e = |f|²
falls in a sample by (1 − hν)² at least for every eigenvalue ν of N, which are those of G M⁻¹, whatever x does from
sample to sample. One number ν in an interval is left to be certified. Estimated velocity: ``moving_mass``.
What is said of M(x) over the envelope is an assumption: it is seen at operating points and not proved.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.base.text import render
from codegen.certify.content import frame
from codegen.certify.decimals import rounded, rounded_matrix, texts
from codegen.certify.family import Family
from codegen.certify.moving_mass import COORDINATES, moving_mass
from codegen.certify.prefix import rational_text
from codegen.checker import verify
from codegen.mechanics.system import Matrix
from codegen.spec.model import Spec, symbol

MARGIN = 0.1
LESS = 1 - 1e-3
DIGITS = 6


def by_structure(spec: Spec, analysis: Analysis, files: Mapping[str, str], command: str) -> dict[str, Any] | None:
    """The certificate's content, which the checker has accepted; None where the observer is not of this structure.

    Args:
        files, command: as ``frame``.
    """
    content = _measured(spec, analysis, files, command) or _estimated(spec, analysis, files, command)
    if content is None:
        return None
    try:
        verify.check(json.dumps(content))
    except verify.Refused:
        return None
    return content


def _measured(spec: Spec, analysis: Analysis, files: Mapping[str, str], command: str) -> dict[str, Any] | None:
    observer, modes = analysis.dynamics.observer, analysis.modes
    form = observer.cascade
    if modes is None or form is None or observer.velocity != "measured" or observer.integration != "euler":
        return None
    if observer.level_errors or not form.weight.is_Identity or not modes.jury:
        return None
    h = float(observer.sample_time)
    low, high = modes.smallest * (1 - MARGIN), modes.largest * (1 + MARGIN)
    if not 0 < low <= high < 2 / h:
        return None
    nu = symbol("nu")
    ends = rounded(low, 4), rounded(high, 4)
    family = Family({nu: ends}, {symbol("mode"): nu}, Matrix([[-symbol("mode")]]))
    rate = rounded(LESS * min(float(end) * (1 - h * float(end) / 2) for end in ends), 4)
    words = {"observer": observer, "rate": float(rate), "period": h, "modes": modes, "ends": [float(e) for e in ends]}
    words |= {"points": len(analysis.points.values), "share": MARGIN}
    return {
        **_without_code(frame(spec, analysis, family, files, command)),
        **_said("structure", words),
        "error": [{"name": "f", "meaning": "a component of G^(-1/2) e, e the force errors, G = -K_2", "unit": "1"}],
        "lyapunov_matrix": [["1"]],
        "decay_rate": rational_text(sympy.Rational(rate)),
    }


def _estimated(spec: Spec, analysis: Analysis, files: Mapping[str, str], command: str) -> dict[str, Any] | None:
    found = moving_mass(analysis)
    if found is None:
        return None
    rate = rounded(found.alpha * LESS, 4)
    p = found.matrix / found.matrix[1, 1]
    exact = rounded_matrix(p, DIGITS, np.sqrt(np.diag(p)))
    words = {"found": found, "rate": float(rate), "period": float(analysis.dynamics.observer.sample_time)}
    words |= {"a": float(exact[0][0] / exact[1][1]), "ends": [float(e) for e in (found.splits[0], found.splits[-1])]}
    words |= {"variables": {s.name: [float(e) for e in ends] for s, ends in analysis.points.ranges.items()}}
    (sigma,) = found.family.variables
    return {
        **_without_code(frame(spec, analysis, found.family, files, command)),
        **_said("moving_mass", words),
        "error": [{"name": name, "meaning": meaning, "unit": "1"} for name, meaning in COORDINATES],
        "splits": {sigma.name: [str(s) for s in found.splits]},
        "lyapunov_matrix": texts(exact),
        "decay_rate": rational_text(sympy.Rational(rate)),
    }


def _without_code(content: dict[str, Any]) -> dict[str, Any]:
    """No output of the code shows a mode."""
    return {**content, "code": {"errors": [], "variables": {}, "motion": {}}}


def _said(name: str, words: Mapping[str, Any]) -> dict[str, Any]:
    lines = render(f"text/{name}_assumptions.j2", **words).splitlines()
    return {
        "claim": " ".join(render(f"text/{name}_claim.j2", **words).split()),
        "assumptions": [line.strip() for line in lines if line.strip()],
    }
