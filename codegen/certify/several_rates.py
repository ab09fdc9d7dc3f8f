"""One P for several families of matrices, each with a rate of its own; a rate below zero lets V grow so fast.

Large families are met by a few of their matrices at a time: those that a found P does not serve are added.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from codegen.certify.centre import Group, centred, climbed, slower_until
from codegen.certify.lmi import fall, feasible
from codegen.certify.lyapunov import balance, extreme

Array = NDArray[np.float64]
FIRST = 12
FEW = 64
ADDED = 6
ROUNDS = 25
NEAR = 2e-5
"""How near to the largest rate the centre of one family is brought (``climbed``): within 1 % of the proved limit."""
NEARER = (0.75, 0.5, 0.25)
MOST = 4096
"""Of more matrices than these the centre would take minutes: P is then where the solver stopped."""


def common_at(groups: Sequence[Group], h: float) -> Array | None:
    """P > 0 with A'P + PA + hA'PA ≤ −2αP for every A of each group, m by m, α in 1/s; None if none is found."""
    scale, rates = _scale(groups), [rate for _, rate in groups]
    scaled = [_in(scale, extreme(list(matrices)) if len(matrices) <= FEW else matrices) for matrices, _ in groups]
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


def middle_at(groups: Sequence[Group], h: float) -> Array | None:
    """As ``common_at``; of all such P the one in the middle, the same on every machine, up to ``MOST`` matrices."""
    p = common_at(groups, h)
    if p is None or sum(len(matrices) for matrices, _ in groups) > MOST:
        return p
    scale = _scale(groups)
    middle = centred(
        [(_in(scale, matrices), rate) for matrices, rate in groups], h, p * scale[None, :] * scale[:, None]
    )
    return p if middle is None else middle / scale[None, :] / scale[:, None]


def fastest(matrices: Sequence[Array], h: float, limit: float, near: float = NEAR) -> tuple[Array, float] | None:
    """(P, α) for one group with α near the largest possible, which is at most ``limit``; None if none is found.

    α is 0.1 % less than P shows, so that four digits can be written.
    """
    if len(matrices) > MOST:
        return _bisected(matrices, h, limit)
    first = slower_until(lambda alpha: common_at([(matrices, alpha)], h), limit)
    if first is None:
        return None
    for share in NEARER:  # the climb is slow where there are many matrices: it begins as near as a P is found
        alpha = first[1] + share * (limit - first[1])
        if (p := common_at([(matrices, alpha)], h)) is not None:
            first = p, alpha
            break
    scale = _scale([(matrices, 0.0)])
    stack, start = _in(scale, matrices), first[0] * scale[None, :] * scale[:, None]
    p, shown = climbed(start, first[1], stack, h, lambda p: float(shown_rates(p, stack, h).min()), near=near)
    return p / scale[None, :] / scale[:, None], shown * 0.999


def _bisected(matrices: Sequence[Array], h: float, limit: float, steps: int = 8) -> tuple[Array, float] | None:
    """As ``fastest``, by bisection alone."""
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


def _scale(groups: Sequence[Group]) -> Array:
    """In which the entries of all matrices are alike."""
    return balance([a for matrices, _ in groups for a in matrices])


def _in(scale: Array, matrices: Sequence[Array] | Array) -> Array:
    """Matrices A in these scales, N by m by m."""
    return np.asarray(np.array(matrices) * scale[None, None, :] / scale[None, :, None])
