"""The proof that no V is non-increasing over a refused DFO's envelope, where that is so.

Let x be a level's error, and A₁x = A₂x = 0 at two operating points of zero friction: nothing is learnt of the level. If
V = e'Pe with P > 0 rises at neither, P − Φ'PΦ ≥ 0 vanishes along x, so A₁'Px = A₂'Px = 0. But where x = A₁y₁ + A₂y₂
for some y₁ and y₂, this gives x'Px = 0, against P > 0.
"""

from __future__ import annotations

import sympy

from codegen.certify.along_friction import AlongFriction
from codegen.mechanics.system import Matrix

SHARES = (sympy.Rational(1, 2), sympy.Rational(-1, 2))


def none_without_growth(along: AlongFriction) -> bool:
    """Whether no V falls or stays at two points of zero friction, in exact numbers; the slips there are opposite."""
    if any(axis.least_state != 0 for axis in along.axes):
        return False
    first, second = (_at_zero(along, share) for share in SHARES)
    both = first.row_join(second)
    rank = both.rank()
    for k, error in enumerate(along.dynamics.observer.errors):
        x = sympy.eye(first.rows)[:, k]
        held = first * x == second * x == sympy.zeros(first.rows, 1)
        if error.of == "level" and held and both.row_join(x).rank() == rank:
            return True
    return False


def _at_zero(along: AlongFriction, share: sympy.Rational) -> Matrix:
    """A at zero friction, steady slips of a share of the largest."""
    point = {v: sympy.Integer(0) for axis in along.axes for v in axis.symbols}
    point |= {axis.slip: share * axis.largest_slip for axis in along.axes}
    point |= {level: (low + high) / 2 for level, (low, high) in along.levels.items()}
    family = along.family({v: (x, x) for v, x in point.items()})
    return Matrix(family.matrix.subs({s: e.subs(point) for s, e in family.parameters.items()}))
