"""One P for several families of matrices, each with a rate of its own; a rate below zero lets V grow so fast.

Large families are met by a few of their matrices at a time: those that a found P does not serve are added.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from codegen.stability.certificate.lmi import fall, feasible
from codegen.stability.certificate.lyapunov import balance, extreme

Array = NDArray[np.float64]
Group = tuple[Sequence[Array], float]
FIRST = 12
FEW = 64
ADDED = 6
ROUNDS = 25


def common_at(groups: Sequence[Group], h: float) -> Array | None:
    """P > 0 with A'P + PA + hA'PA ≤ −2αP for every A of each group, m by m, α in 1/s; None if none is found."""
    scale = balance([a for matrices, _ in groups for a in matrices])
    thinned = [extreme(matrices) if len(matrices) <= FEW else matrices for matrices, _ in groups]
    scaled = [np.array(matrices) * scale[None, None, :] / scale[None, :, None] for matrices in thinned]
    rates = [rate for _, rate in groups]
    largest = max(1.0, max(float(np.abs(stack).max()) for stack in scaled))
    used = [sorted({*np.linspace(0, len(stack) - 1, min(FIRST, len(stack))).astype(int)}) for stack in scaled]
    for _ in range(ROUNDS):
        conditions = [
            {0: fall(stack[k], h, rate) / largest}
            for stack, rate, chosen in zip(scaled, rates, used, strict=True)
            for k in chosen
        ]
        found = feasible(conditions, 1, len(scale))
        if found is None or np.linalg.eigvalsh(found[0])[0] <= 0:
            return None
        p, missing = found[0], False
        for stack, rate, chosen in zip(scaled, rates, used, strict=True):
            shown = shown_rates(p, stack, h)
            worst = [int(k) for k in np.argsort(shown)[:ADDED] if shown[k] < rate]
            missing |= bool(worst)
            if set(worst) & set(chosen):
                return None  # the solver does not reach what was asked of it
            chosen += worst
        if not missing:
            p = p / scale[None, :] / scale[:, None]
            return np.asarray((p + p.T) / 2)
    return None


def shown_rates(p: Array, stack: Array, h: float) -> Array:
    """The largest α that P > 0 shows of each matrix of a stack, N by m by m."""
    inverse = np.linalg.inv(np.linalg.cholesky(p))
    turned = stack.transpose(0, 2, 1)
    falls = -(turned @ p + p @ stack + h * turned @ p @ stack)
    return np.asarray(np.linalg.eigvalsh(inverse @ falls @ inverse.T)[:, 0] / 2)


def fastest(matrices: Sequence[Array], h: float, limit: float, steps: int = 8) -> tuple[Array, float] | None:
    """(P, α) for one group with α near the largest possible, which is at most ``limit``; None if none is found.

    α is 0.1 % less than P shows, so that four digits can be written.
    """
    low, high, best = 0.0, limit, None
    stack = np.array(matrices)
    alpha = limit * 0.98
    for _ in range(steps):
        p = common_at([(matrices, alpha)], h)
        if p is None:
            high = alpha
        else:
            low = max(alpha, float(shown_rates(p, stack, h).min()))
            best = p, low * 0.999
        alpha = (low + high) / 2
        if high - low < 2e-3 * limit:
            break
    return best
