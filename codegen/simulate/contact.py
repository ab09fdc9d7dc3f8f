"""Time stepping of set-valued friction (nonsmooth contact dynamics): the forces of all contacts over one step."""

from dataclasses import dataclass
from typing import Any

import casadi

from codegen.mechanics.solve import solve_by_elimination

SWEEPS = 6
"""Gauss–Seidel sweeps over the contacts of a step."""
NEWTON_STEPS = 6
"""Steps of the semismooth Newton method after the sweeps."""
_REGULARISATION = 1e-8
"""Added to the diagonal of Newton's matrix, which is singular if stuck contacts are linearly dependent."""
_NONLINEAR = 1e-11
"""Deviation of a law from its linear expansion, relative to all forces, above which it is not due to rounding."""
REST = 1e-9
"""Slip speed, in slip unit/s, below which a contact whose level jumps at standstill counts as at rest."""
_TINY = 1e-300


@dataclass(frozen=True)
class Levels:
    """Bounds of the set-valued friction forces, each contacts by 1 and not negative.

    Attributes:
        forward, backward: levels of sliding for u > 0 and u < 0.
        held: levels at rest (static friction), the same in both directions.
        jumps: for each contact, whether its levels at rest differ from those of sliding; empty if none do.
    """

    forward: Any
    backward: Any
    held: Any = None
    jumps: tuple[bool, ...] = ()


def contact_forces(slip: Any, free: Any, mobility: Any, levels: Levels, step: Any, start: Any) -> Any:
    """Mean contact forces q over a step that satisfy all set-valued laws, with u' = free − mobility q.

    q_c is ±level while contact c slides, and the force in [−level(−), level(+)] that keeps u_c = 0 while it sticks.
    Moreau's scheme applies the law at the end of the step only; here a contact that comes to rest within the step
    changes its mode at that instant, which reduces the velocity error at a reversal from order step to order step².

    A single contact is solved exactly. Coupled contacts are solved by sweeps of projected Gauss–Seidel, then by
    Newton's method on q = L(q), where L_c is the force of contact c by its own law for given forces of the others. L is
    piecewise linear at rest and piecewise smooth otherwise, so in the right mode the solution is exact to rounding. A
    step that reduces |q − L(q)| linearises all laws again. Otherwise only the first contact whose law is violated
    changes its mode (Murty's rule), which cannot cycle if U' M⁻¹ U is positive definite. The number of steps is fixed,
    so the iteration may end early: of random cases at rest from q = 0, all with 2 and 3 contacts converged, and of
    stacks of 4 bodies all but one in 500. The best q is returned, and the next step starts from it.

    If U' M⁻¹ U is positive definite, q is unique. If contacts are linearly dependent, only U q and the motion are
    unique, and q is a solution near ``start``.

    Args:
        slip: u at the start, contacts by 1.
        free: slip acceleration without contact forces, contacts by 1.
        mobility: U' M⁻¹ U, contacts by contacts.
        step: h, seconds.
        start: initial guess of q, contacts by 1, such as q of the step before.

    Returns:
        q, contacts by 1, positive opposes u > 0.

    Source: Moreau 1988, Unilateral contact and dry friction in finite freedom dynamics; Acary & Brogliato 2008,
    Numerical methods for nonsmooth dynamical systems, chapters 10 and 13; Murty 1974, Note on a Bard-type scheme for
    solving the complementarity problem.
    """
    q = sweep(slip, free, mobility, levels, step, start)
    if not coupled(mobility):
        return q
    for _ in range(SWEEPS - 1):
        q = sweep(slip, free, mobility, levels, step, q)
    others = mobility - casadi.diag(casadi.diag(mobility))
    alone = free - casadi.mtimes(others, q)
    value, slope = _law_responses(slip, alone, mobility, levels, step)
    best, least = q, casadi.norm_1(value - q)
    for _ in range(NEWTON_STEPS):
        matrix = (1 + _REGULARISATION) * casadi.SX.eye(slip.shape[0]) + casadi.mtimes(casadi.diag(slope), others)
        expanded = value + slope * (free - casadi.mtimes(others, q) - alone)
        q = q + solve_by_elimination(casadi.densify(matrix), expanded - q)
        there = free - casadi.mtimes(others, q)
        answer, steeper = _law_responses(slip, there, mobility, levels, step)
        missed = answer - value - slope * (there - alone)
        left = casadi.norm_1(answer - q)
        closer = left < least
        best, least = casadi.if_else(closer, q, best), casadi.fmin(left, least)
        taken = _relinearised(missed, answer, closer)
        value, slope, alone = (
            casadi.if_else(taken, new, old) for new, old in ((answer, value), (steeper, slope), (there, alone))
        )
    return best


def _relinearised(missed: Any, answer: Any, closer: Any) -> Any:
    """Contacts whose law is linearised again: all after a step that reduced |q − L(q)|, else the first violated one."""
    rows = []
    found = closer * 0
    size = _NONLINEAR * casadi.norm_1(answer)
    for c in range(answer.shape[0]):
        off = casadi.fabs(missed[c]) > size
        rows.append(casadi.logic_or(closer, casadi.logic_and(off, casadi.logic_not(found))))
        found = casadi.logic_or(found, off)
    return casadi.vertcat(*rows)


def _law_responses(slip: Any, alone: Any, mobility: Any, levels: Levels, step: Any) -> tuple[Any, Any]:
    """L and ∂L_c/∂(alone_c), contacts by 1; ``alone_c`` is the slip acceleration without the force of contact c."""
    count = slip.shape[0]
    pushed = casadi.SX.sym("pushed", count)
    answers = casadi.vertcat(
        *[_lone_contact(slip[c], pushed[c], mobility[c, c], levels, c, step) for c in range(count)]
    )
    slopes = casadi.jtimes(answers, pushed, casadi.SX.ones(count))
    found = casadi.substitute(casadi.vertcat(answers, slopes), pushed, alone)
    return found[:count], found[count:]


def sweep(slip: Any, free: Any, mobility: Any, levels: Levels, step: Any, start: Any) -> Any:
    """One Gauss–Seidel sweep through all contacts."""
    count = slip.shape[0]
    q = [start[c] for c in range(count)]
    for c in range(count):
        alone = free[c]
        for d in range(count):
            if d != c and not mobility[c, d].is_zero():
                alone = alone - mobility[c, d] * q[d]
        q[c] = _lone_contact(slip[c], alone, mobility[c, c], levels, c, step)
    return casadi.vertcat(*q)


def coupled(mobility: Any) -> bool:
    """Whether the force of one contact accelerates the slip of another."""
    rows, columns = mobility.shape
    return any(not mobility[c, d].is_zero() for c in range(rows) for d in range(columns) if c != d)


def _lone_contact(slip: Any, free: Any, mobility: Any, levels: Levels, c: int, step: Any) -> Any:
    """Exact mean force of one contact for a constant ``free``: sliding until rest, then sticking or sliding back."""
    forward, backward = levels.forward[c], levels.backward[c]
    onward = slip >= 0
    sliding = casadi.if_else(onward, forward, -backward)
    braking = casadi.if_else(onward, 1, -1) * (mobility * sliding - free)
    speed = casadi.fabs(slip)
    share = speed / casadi.fmax(casadi.fmax(braking * step, speed), _TINY)
    holding = free / mobility
    after = casadi.fmin(casadi.fmax(holding, -backward), forward)
    if levels.jumps and levels.jumps[c]:
        after = casadi.if_else(casadi.fabs(holding) <= levels.held[c], holding, after)
        share = casadi.if_else(speed <= REST, 0, share)
    return share * sliding + (1 - share) * after
