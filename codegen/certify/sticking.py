"""Reduced error dynamics of a (G)CFO while a set S of contacts sticks and their estimated slips chatter about zero.

This is the sliding mode on the switching surface û_S = 0, by Utkin's equivalent control. On average u_S = û_S = 0, and
the mean friction estimate at S is the one that keeps û_S at zero. So the velocity errors are e_v = Z ξ, Z a basis of
the velocities with U_S' v = 0. The level errors at S do not enter. With A = (Φ − I)/h, the full dynamics de/dt = Ae are
reduced to

    dξ/dt = (Z'MZ)⁻¹ Z'M (A_vv Z ξ + A_vL e_L),    de_L/dt = A_Lv Z ξ + A_LL e_L

for the set L of contacts that slide. If this matrix has an eigenvalue with positive real part, the errors of L do not
converge while S sticks, even if a certificate holds between reversals. Computed in floating point to first order in h;
no claim of a certificate depends on it.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from codegen.certify.bound.error_response import Response
from codegen.observers.equations import Observer

MOST = 6
"""With up to this many contacts every set of sticking contacts is examined; with more, each contact alone."""


@dataclass(frozen=True)
class Sticking:
    """Decay of the other contacts' errors while some contacts stick.

    Attributes:
        contacts: names of those that stick, in the order of the spec.
        rate: decay rate of the slowest remaining error, 1/s; negative if it grows.
    """

    contacts: tuple[str, ...]
    rate: float


def slowest_while_sticking(observer: Observer, response: Response) -> Sticking | None:
    """The set of sticking contacts for which the remaining errors decay slowest.

    None if the observer does not estimate levels, or there is no such set in which another contact slides.
    """
    system, h = observer.system, float(observer.sample_time)
    step, inverse = (np.array(m, dtype=float) for m in (response.step, -response.by_force))
    slips = np.array(observer.distribution, dtype=float)
    n, count = slips.shape
    if not observer.level_errors or len(step) != n + count:
        return None
    change, mass = (step - np.eye(len(step))) / h, np.linalg.inv(inverse)
    found = []
    for size in range(1, count) if count <= MOST else (1,):
        for stuck in combinations(range(count), size):
            _, sizes, rows = np.linalg.svd(slips[:, list(stuck)].T)
            basis = rows[np.count_nonzero(sizes > 1e-9 * sizes[0]) :].T  # Z, the null space of U_S'
            slide = [c for c in range(count) if np.abs(slips[:, c] @ basis).max(initial=0) > 1e-9]
            if not slide or any(c not in stuck and c not in slide for c in range(count)):
                continue  # another contact cannot slide either: that is a larger set
            project = np.linalg.solve(basis.T @ mass @ basis, basis.T @ mass)
            levels = [n + c for c in slide]
            reduced = np.block(
                [
                    [project @ change[:n, :n] @ basis, project @ change[:n, levels]],
                    [change[levels, :n] @ basis, change[np.ix_(levels, levels)]],
                ]
            )
            names = tuple(system.contacts[c].name for c in stuck)
            found.append(Sticking(names, -float(np.linalg.eigvals(reduced).real.max())))
    return min(found, key=lambda s: s.rate, default=None)
