"""Set-valued Coulomb friction over one time step: the mean contact forces, by projected Gauss–Seidel."""

from __future__ import annotations

from typing import Any

import casadi

SWEEPS = 6
_TINY = 1e-300


def contact_forces(slip: Any, free: Any, mobility: Any, levels: tuple[Any, Any], step: Any, start: Any) -> Any:
    """Mean contact forces q over a step, so that each lies in its set-valued law.

    The slip velocities move as u' = free − mobility q. Each q_c is ±level while its contact slides and whatever in
    [−level(−), level(+)] holds it while it sticks. Moreau's scheme puts the law at the end of the step only; here a
    contact that comes to rest inside the step changes over at that instant, which turns an error of order step in
    velocity at every reversal into one of order step². Contacts that share a body are solved in turns (projected
    Gauss–Seidel); a lone contact is exact at once.

    Args:
        slip: u at the start, contacts by 1.
        free: slip acceleration without contact forces, contacts by 1.
        mobility: U' M⁻¹ U, contacts by contacts.
        levels: level for u > 0 and for u < 0, each contacts by 1, not negative.
        step: h, seconds.
        start: the guess for q, contacts by 1, such as the step before.

    Returns:
        q, contacts by 1, positive opposes u > 0.

    Source: Moreau 1988, Unilateral contact and dry friction in finite freedom dynamics; Acary & Brogliato 2008,
    Numerical methods for nonsmooth dynamical systems, chapters 10 and 13.
    """
    count = slip.shape[0]
    q = [start[c] for c in range(count)]
    coupled = any(not mobility[c, d].is_zero() for c in range(count) for d in range(count) if c != d)
    for _ in range(SWEEPS if coupled else 1):
        for c in range(count):
            alone = free[c]
            for d in range(count):
                if d != c and not mobility[c, d].is_zero():
                    alone = alone - mobility[c, d] * q[d]
            q[c] = _lone_contact(slip[c], alone, mobility[c, c], levels[0][c], levels[1][c], step)
    return casadi.vertcat(*q)


def _lone_contact(slip: Any, free: Any, mobility: Any, forward: Any, backward: Any, step: Any) -> Any:
    """Exact mean force of one contact under a constant ``free``: slide to rest, then stick or turn round."""
    onward = slip >= 0
    sliding = casadi.if_else(onward, forward, -backward)
    braking = casadi.if_else(onward, 1, -1) * (mobility * sliding - free)
    speed = casadi.fabs(slip)
    share = speed / casadi.fmax(casadi.fmax(braking * step, speed), _TINY)
    after = casadi.fmin(casadi.fmax(free / mobility, -backward), forward)
    return share * sliding + (1 - share) * after
