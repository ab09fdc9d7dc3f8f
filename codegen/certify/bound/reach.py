"""Bounds on linear combinations c'e of the errors by the invariant ellipsoid of a certificate's V = e'Pe.

The errors follow e[k+1] = Φe[k] + Σ_j b_j w_j, with disturbances |w_j| ≤ d_j, and V decreases: Φ'PΦ ≤ γ²P. Let

    M = P⁻¹ − ΦP⁻¹Φ'/γ,   a_j = √(b_j'M⁻¹b_j/(1 − γ)),   S = Σ_j d_j a_j.

M ≥ (1 − γ)P⁻¹ is positive definite, and the ellipsoid {e : e'Pe ≤ S²} is invariant (ellipsoid.py). a_j is at most
√(b_j'Pb_j)/(1 − γ), and far less where b_j is in a direction that decays fast. In the long run, with r = c'Φ^N for any
number of samples N,

    |c'e| ≤ Σ_{k<N} Σ_j |c'Φ^k b_j| d_j + S √(rP⁻¹r').

The sum alone is attained by some disturbances, and N is the first number for which the last term is below ``REST`` of
it. From a start with V ≤ V₀ the last term is √(V₀ rP⁻¹r') in place of S √(rP⁻¹r').
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.certify.bound.error_response import Response

REST, LONGEST = 1e-3, 10_000
"""Share of the sum below which the ellipsoid's term is to be, and largest number of samples that are summed; the
checker's is the same."""
ROUNDING = 1e-9
"""Relative allowance for rounding errors."""


@dataclass(frozen=True, eq=False)
class Reach:
    """What disturbances and a start can reach; all of it in floating point, rounded up.

    Attributes:
        step: Φ, m by m.
        p, inverse: P and P⁻¹, m by m.
        gamma: γ = √(1 − 2αh).
        entry: M⁻¹/(1 − γ).
    """

    step: Array
    p: Array
    inverse: Array
    gamma: float
    entry: Array

    def lengths(self, columns: Array) -> Array:
        """a = √(b'M⁻¹b/(1 − γ)) for each column b: with |w| ≤ 1 along b alone, e'Pe ≤ a² is invariant."""
        return np.asarray(np.sqrt(np.maximum(np.sum(columns * (self.entry @ columns), axis=0), 0.0)))

    def widths(self, rows: Array) -> Array:
        """√(rP⁻¹r') for each row r."""
        return np.asarray(np.sqrt(np.maximum(np.sum(rows * (rows @ self.inverse), axis=1), 0.0)))

    def sums(self, rows: Array, columns: Array, sizes: Sequence[Array]) -> tuple[Array, Array, int]:
        """(Σ_{k<N} |c'Φ^k b_j|, bound on the sum over all later k, N) for rows c' and columns b_j, rows by columns.

        N is the first number of samples for which the second is below ``REST`` of the first, both times d_j and summed
        over j, for every row and each d of ``sizes``; at most ``LONGEST``.
        """
        found, entering = np.zeros((len(rows), columns.shape[1])), self.lengths(columns)
        weights = [(np.asarray(d), float(entering @ d)) for d in sizes]
        samples = 0
        while samples < LONGEST:
            samples, found, rows = samples + 1, found + np.abs(rows @ columns), rows @ self.step
            widths = self.widths(rows)
            totals = [(found @ d, widths * most) for d, most in weights]
            if all((rest <= REST * total)[total > 0].all() for total, rest in totals):
                break
        return found * (1 + ROUNDING), np.outer(widths, entering) * (1 + ROUNDING), samples

    def later(self, row: Array, driven: Array, counts: Sequence[int], start: Array, level: float) -> list[float]:
        """For each number of samples k in ``counts``, a bound on |c'e| at all samples from k on.

        It is the smaller one of two: that by the ellipsoid V ≤ ``level``, k samples before; or the largest bound of the
        single samples up to the next number, and the bound from there on.

        Args:
            row: c'.
            driven: b_j d_j, m by number of disturbances.
            start: |error| of each component at the start.
            level: bound on V at the start, and at all later samples.
        """
        by_set, largest, total = list[float](), [0.0 for _ in counts], 0.0
        for k in range(counts[-1] + 1):
            if k in counts:
                by_set.append(total + float(self.widths(row[None])[0]) * level**0.5)
            if by_set:
                largest[len(by_set) - 1] = max(largest[len(by_set) - 1], total + float(np.abs(row) @ start))
            total += float(np.abs(row @ driven).sum())
            row = row @ self.step
        found = [by_set[-1]]
        for by_ellipsoid, by_samples in zip(by_set[-2::-1], largest[-2::-1], strict=True):
            found.insert(0, max(min(by_ellipsoid, max(by_samples, found[0])), found[0]))
        return [x * (1 + ROUNDING) for x in found]

    def level_of(self, start: Array, columns: Array, size: Array) -> float:
        """Bound on V at all samples after a start with these |errors|; their box is inside an ellipsoid of V.

        For m errors with |e_i| ≤ s_i, V ≤ m λ, with λ the largest eigenvalue of the matrix of s_i P_ij s_j.
        """
        box = float(np.linalg.eigvalsh(np.outer(start, start) * self.p).max()) * len(start)
        return max(box, float(self.lengths(columns) @ size) ** 2)


def reach_of(response: Response, content: Mapping[str, Any]) -> Reach:
    """The reach of a linear response, by the V of a certificate of its errors, ``content``."""
    p = np.array([[float(Fraction(x)) for x in row] for row in content["lyapunov_matrix"]])
    decrease = 1 - 2 * Fraction(content["decay_rate"]) * Fraction(content["sample_time"])
    gamma, step, inverse = float(decrease) ** 0.5, np.array(response.step, dtype=float), _scaled_inverse(p)
    entry = _scaled_inverse(inverse - step @ inverse @ step.T / gamma) / (1 - gamma)
    return Reach(step, p, inverse, gamma, entry)


def _scaled_inverse(matrix: Array) -> Array:
    """The inverse of a positive definite matrix, whose variables may have very different units."""
    scale = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix / np.outer(scale, scale)) / np.outer(scale, scale))
