"""The JSON object of a certificate or a refutation (docs/certificate.md), as far as both have it, and its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.spec.model import Spec
from codegen.stability.analysis import Analysis
from codegen.stability.family import Family
from codegen.stability.prefix import rational_text, to_prefix
from codegen.version import VERSION

FORMAT = "stiction-certificate/1"


def frame(spec: Spec, analysis: Analysis, family: Family, files: Mapping[str, str], command: str) -> dict[str, Any]:
    """What is known before anything is proved: subject, observer, error, and the family of matrices over its envelope.

    Args:
        files: name → SHA-256 of the generated sources.
        command: that writes it.
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
        "decay_rate": "0",
        "reversals": [],
        "along": [],
        "assumptions": [],
    }


def _meaning(error: Any, level_errors: bool) -> str:
    return f"sign of slip times ({error.meaning})" if level_errors and error.contact is not None else str(error.meaning)


def rounded(value: float, digits: int) -> Any:
    """A short exact decimal near a float."""
    return sympy.Rational(f"{value:.{digits}g}")


def rounded_matrix(matrix: NDArray[np.float64], digits: int, size: NDArray[np.float64]) -> list[list[Any]]:
    """A symmetric matrix with entry i, j to so many digits of size[i] size[j]: keeps a positive definite one so."""
    result: list[list[Any]] = [[sympy.Integer(0)] * len(matrix) for _ in matrix]
    for i in range(len(matrix)):
        for j in range(i + 1):
            quantum = 10.0 ** (math.floor(math.log10(size[i] * size[j])) + 1 - digits)
            entry = sympy.Rational(str(round(float(matrix[i, j]) / quantum))) * sympy.Rational(f"{quantum:.0e}")
            result[i][j] = result[j][i] = entry
    return result


def texts(rows: list[list[Any]]) -> list[list[str]]:
    """Exact numbers as the format writes them."""
    return [[rational_text(e) for e in row] for row in rows]
