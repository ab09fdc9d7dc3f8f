"""A certificate by structure, for any M(x): a tracker with measured velocity and e[k+1] = (I − h G M⁻¹(x)) e[k].

G = −K_2 is symmetric and positive definite, so with f = G^(−1/2) e and N = G^(1/2) M⁻¹ G^(1/2), which is symmetric,
f[k+1] = (I − h N(x)) f[k] and V = e'G⁻¹e = |f|² falls in a sample by (1 − hν)² at least for every eigenvalue ν of N,
which are those of G M⁻¹, whatever x does from sample to sample. One number ν in an interval is left to be certified.
That M(x) keeps ν there over the envelope is an assumption: it is seen at the operating points and not proved.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import sympy

from codegen.checker import verify
from codegen.mechanics.system import Matrix
from codegen.spec.model import Spec, symbol
from codegen.stability.analysis import Analysis
from codegen.stability.content import frame, rounded
from codegen.stability.family import Family
from codegen.stability.prefix import rational_text
from codegen.text import render

MARGIN = 0.1
LESS = 1 - 1e-3


def by_structure(spec: Spec, analysis: Analysis, files: Mapping[str, str], command: str) -> dict[str, Any] | None:
    """The certificate's content, which the checker has accepted; None where the observer is not of this structure.

    Args:
        files, command: as ``frame``.
    """
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
    lines = render("text/structure_assumptions.j2", **words).splitlines()
    content = {
        **frame(spec, analysis, family, files, command),
        "claim": " ".join(render("text/structure_claim.j2", **words).split()),
        "code": {"errors": [], "variables": {}, "motion": {}},
        "error": [{"name": "f", "meaning": "a component of G^(-1/2) e, e the force errors, G = -K_2", "unit": "1"}],
        "lyapunov_matrix": [["1"]],
        "decay_rate": rational_text(sympy.Rational(rate)),
        "assumptions": [line.strip() for line in lines if line.strip()],
    }
    try:
        verify.check(json.dumps(content))
    except verify.Refused:
        return None
    return content
