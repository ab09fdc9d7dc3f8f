"""The errors of a (G)CFO while some of its contacts stick and their estimated slips chatter about zero.

A slip that chatters is zero on average, u_S = û_S = 0, by a friction estimate that takes the mean that keeps it there.
So e_v = Z ξ with Z a basis of the velocities with U_S' v = 0, the errors at S drop out, and what is left of
de/dt = Ae, A = (Φ − I)/h, is

    dξ/dt = (Z'MZ)⁻¹ Z'M (A_vv Z ξ + A_vL e_L),    de_L/dt = A_Lv Z ξ + A_LL e_L

for the contacts L that slide. Where this matrix has an eigenvalue above zero, their errors do not converge while S
sticks, whatever the certificate between reversals says. It is the equivalent motion on a switching surface (Utkin), to
first order in h, in floating point: no claim of the certificate rests on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from codegen.certify.bound.error_response import Response
from codegen.observers.equations import Observer

MOST = 6
"""Up to so many contacts every set of them is looked at; of more, each contact alone."""


@dataclass(frozen=True)
class Sticking:
    """What is left of the errors while some contacts stick.

    Attributes:
        contacts: names of those that stick, sorted by place.
        rate: of the slowest error of the others, 1/s; below zero it grows.
    """

    contacts: tuple[str, ...]
    rate: float


def slowest_while_sticking(observer: Observer, response: Response) -> Sticking | None:
    """The set of sticking contacts beside which another's error falls slowest; None without such a set, or levels."""
    system, h = observer.system, float(observer.sample_time)
    step, inverse = (np.array(m.tolist(), dtype=float) for m in (response.step, -response.by_force))
    slips = np.array(system.distribution.subs(observer.values).tolist(), dtype=float)
    n, count = slips.shape
    if not observer.level_errors or len(step) != n + count:
        return None
    change, mass = (step - np.eye(len(step))) / h, np.linalg.inv(inverse)
    found = []
    for size in range(1, count) if count <= MOST else (1,):
        for stuck in combinations(range(count), size):
            _, sizes, rows = np.linalg.svd(slips[:, list(stuck)].T)
            basis = rows[np.count_nonzero(sizes > 1e-9 * sizes[0]) :].T
            slide = [c for c in range(count) if np.abs(slips[:, c] @ basis).max(initial=0) > 1e-9]
            if not slide or any(c not in stuck and c not in slide for c in range(count)):
                continue  # another contact sticks with them
            onto = np.linalg.solve(basis.T @ mass @ basis, basis.T @ mass)
            levels = [n + c for c in slide]
            left = np.block(
                [
                    [onto @ change[:n, :n] @ basis, onto @ change[:n, levels]],
                    [change[levels, :n] @ basis, change[np.ix_(levels, levels)]],
                ]
            )
            names = tuple(system.contacts[c].name for c in stuck)
            found.append(Sticking(names, -float(np.linalg.eigvals(left).real.max())))
    return min(found, key=lambda s: s.rate, default=None)
