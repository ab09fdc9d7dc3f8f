"""Bounds on the estimation errors after a reversal, in whose samples the true and estimated slip may differ in sign.

Standard library only; ellipsoid.py runs it. It is a reachable-set computation: a polygon for the slip's and the level's
error and an interval for each other error, from sample to sample.

THEOREM. Assume what ellipsoid.py assumes, but for one contact, of which s is the sign, u the slip and a the level. From
a first sample to one that is `samples` later

- s is the sign of the estimated slip, and changes at most `turns` times; u may have another sign;
- the friction is at any moment s' a, s' the sign of u, and where u = 0 anything between -a and a; 0 <= a <= its size in
  `friction`; the machine moves by its mean over the sample, and s is in no other force;
- u changes by at most `change` in a sample, and in a part of a sample by at most that part of it.

If each |truth - estimate| is at most its entry of `before` at the first sample, it is at most that of `after` at the
last one.

LEMMA G. While s stays, the errors move by e[k+1] = matrix e[k] + push w[k] with -d for friction in w, where s (a - d)
is its mean: an identity (lemma A). Times s, that is matrix e + q d and noise and drift. Let y = p e be the slip's error
in this, and n the most that noise is in it.
1. d > 0 only if u has not the sign s for a share of the sample's time, and d is at most 2a times this share. The share
   is at most 1, and 1 - s u/change. As s u is not below y - n, it is at most 1 - (y - n)/change.
2. Where s turns after the sample, the states show other estimates: `states` are the same with s turned and
   `jump` s p(estimates) added to the level's. That is -jump t with t >= 0, since s p(estimates) is now below 0, and t
   is at most y[k+1] - s u[k+1] + n <= y[k+1] - y[k] + change + 2 n. Times the new s the errors are those before times
   -1; that of the level is what it was, plus jump t, and at most twice its noise.

LEMMA H. Let (y, z), z the level's error, be in a convex polygon, and each other error within a radius. A linear
function of (y, z, d) is the largest at a corner of the polygon, or of its part with y <= n or n <= y <= n + change, d
being 0 or the largest there; the others, noise and drift add their largest. So 16 directions give the next polygon,
and each other error the next radius. All is rounded up to multiples of 1/GRID (of the unit of y and z), but corners
down, and for these the weights' sum in 1/GRID is added.
"""

import re
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING or __package__:
    from codegen.checker import kernel

QUARTER = ((1, 0), (2, 1), (1, 1), (1, 2))
HALF = [*QUARTER, *((-b, a) for a, b in QUARTER)]
DIRECTIONS = [*HALF, *((-a, -b) for a, b in HALF)]
RIGHT, TOP, LEFT, BOTTOM = range(0, 16, 4)
GRID, MOST = 1 << 40, {"samples": 200, "turns": 20}
ZERO = Fraction(0)
Point = tuple[int, int, int]  # (x, y, w): the point (x, y)/w, w > 0
Shape = tuple[list[int], dict[int, int]]  # bounds in DIRECTIONS of (y, z) over their units, and the radii, times GRID


class Reversal(NamedTuple):
    """One entry of ``reversals`` in ellipsoid.json, with the friction that acts.

    Attributes:
        sign: s, the name of the sign. level: index of the level's error.
        samples: number of samples. turns: how often s changes at most.
        change: the most that the slip u changes by in a sample. jump: see lemma G.
        force: a, the largest friction level. column: of push, for the friction.
    """

    sign: str
    level: int
    samples: int
    turns: int
    change: Fraction
    jump: Fraction
    force: Fraction
    column: list[Any]


class Moves(NamedTuple):
    """The error dynamics with y, the error of the slip, in place of the first velocity error in it; z is the level's.

    Attributes:
        slip: p, error's index -> coefficient. places: indices of y and z.
        rows: of the matrix, for y and z. drive: 2a q, the effect of the friction on y and z.
        columns: of noise and drift times their sizes, for y and z.
        others: each other error's index -> (GRID times the most that noise, drift and friction change it by in a
            sample, magnitudes of its row of the matrix as (index, integer), denominator of these integers).
        units: bounds of y and z at the first sample, by which they are divided.
    """

    slip: dict[int, Fraction]
    rows: list[list[Fraction]]
    drive: list[Fraction]
    columns: list[list[Fraction]]
    places: tuple[int, int]
    others: dict[int, tuple[int, list[Any], int]]
    units: tuple[Fraction, Fraction]


def count(text: Any, most: int) -> int:
    kernel.demand(re.fullmatch("0|[1-9][0-9]{0,3}", str(text)) and int(text) <= most, "no number of samples or turns")
    return int(text)


def left(of: Reversal, before: list[Fraction], proof: Any, proven: Any, known: Any) -> list[Fraction]:
    """Bounds on each |truth - estimate| at the last sample, by lemmas G and H; ValueError if these do not apply.

    Args:
        before: bounds at the first sample.
        known: how the errors move (ellipsoid.Dynamics).
    """
    kernel.demand(of.change > 0 <= min(before), "a slip that does not change, or an error below 0")
    begun = [b + n for b, n in zip(before, known.noise, strict=True)]
    slip, friction = estimated_slip(of, proof, proven), [-Fraction(p.get((of.sign,), 0)) for p in of.column]
    same = all(p == kernel.term(-q, of.sign) for p, q in zip(of.column, friction, strict=True))
    kernel.demand(same, "friction does not act by its sign")
    size = range(len(begun))
    numbers = [[x.as_integer_ratio() for x in row] for row in ([slip.get(i, ZERO) for i in size], friction, begun)]
    for p in (known.mirror, size):  # by lemma I of ellipsoid.py the same reversal in the order of p leaves the same
        problem = *of[2:7], p[of.level], *(tuple([row[i] for i in p]) for row in numbers)
        if found := known.left.get(problem):
            return [found[i] for i in p]
    found = known.left[problem] = left_over(of, moves(of, slip, friction, begun, known), begun, known.noise)
    return found


def left_over(of: Reversal, m: Moves, begun: list[Fraction], noise: list[Fraction]) -> list[Fraction]:
    """The bounds by lemmas G and H, for errors that are at most ``begun``, noise included, at the first sample."""
    unseen = of_slip(m.slip, noise)
    weights, edges = weighed(of, m, unseen, noise[of.level]), [times_grid(x / m.units[0]) for x in (unseen, of.change)]
    box = [GRID * (abs(a) + abs(b)) for a, b in DIRECTIONS]
    shapes: dict[int, Shape] = {0: (box, {i: times_grid(begun[i]) for i in m.others})}  # by the number of turns so far
    for _ in range(of.samples):
        following: dict[int, Shape] = {}
        for turns, shape in shapes.items():
            for k, after in enumerate(moved(shape, m, weights, edges, 1 + (turns < of.turns))):
                following[turns + k] = wider(following.get(turns + k, after), after)
        shapes = following
    last, *more = shapes.values()
    for shape in more:
        last = wider(last, shape)
    most, first = reached(last, m), m.places[0]
    y, most[first] = most[first], 0
    most[first] = (y + of_slip(m.slip, most)) / abs(m.slip[first])
    return [Fraction(most[i], GRID) + n for i, n in enumerate(noise)]


def of_slip(slip: dict[int, Fraction], sizes: Any) -> Fraction:
    return sum((abs(a) * sizes[i] for i, a in slip.items()), ZERO)


def estimated_slip(of: Reversal, proof: dict[str, Any], proven: dict[str, Any]) -> dict[int, Fraction]:
    """The slip as a sum of velocities: index of a velocity's error -> its coefficient.

    ValueError if `jump` is not that of lemma G, or if the machine's force depends on the sign otherwise than by the
    friction.
    """
    errors, known = proof["errors"], dict[Any, Any]()
    names = proven["names"] | {x: kernel.term(1, x) for e in errors for x in (e["truth"], e["estimate"])}
    here = kernel.Text(names, known)
    p, truth, estimate = here.value(proof["signs"][of.sign]), *(errors[of.level][x] for x in ("truth", "estimate"))

    def other(formulas: dict[str, str], there: Any, *changed: str) -> list[str]:
        """The formulas that have another value there; one that names nothing of what is changed has the same."""
        with_these = {x: text for x, text in formulas.items() if any(name in text for name in changed)}
        return [x for x, text in with_these.items() if here.value(text) != there.value(text)]

    velocities = {e["estimate"]: i for i, e in enumerate(errors) if e["truth"] in proof["acceleration"]}
    known_slip = p and all(len(m) == 1 and m[0] in velocities and not errors[velocities[m[0]]]["sign"] for m in p)
    kernel.demand(known_slip, "the slip is no sum of estimated velocities")
    minus = kernel.term(-1, of.sign)
    there = kernel.Text(names | {of.sign: minus, estimate: names[estimate] + kernel.term(of.jump, of.sign) * p}, known)
    wrong = other(proof["states"], there, of.sign, estimate)
    kernel.demand(not wrong, f"where {of.sign} turns, {wrong[:3]} show other estimates than by `jump`")
    there = kernel.Text(names | {of.sign: minus, truth: kernel.term(-1, truth)}, known)
    wrong = other(proof["acceleration"], there, of.sign, truth)
    kernel.demand(not wrong, f"{of.sign} is in more than the friction of {wrong[:3]}")
    return {velocities[x]: Fraction(a) for (x,), a in p.items()}


def moves(
    of: Reversal, slip: dict[int, Fraction], friction: list[Fraction], begun: list[Fraction], known: Any
) -> Moves:
    first, places, step, pushed = min(slip), (min(slip), of.level), known.step, known.pushed

    def seen(column: list[Fraction]) -> list[Fraction]:
        return [sum((a * column[i] for i, a in slip.items() if column[i]), ZERO), column[of.level]]

    force = [2 * of.force * x for x in friction]
    drive, units = seen(force), (of_slip(slip, begun), begun[of.level])
    kernel.demand(drive[0] > 0, "friction does not act against the slip")
    kernel.demand(min(units) > 0, "no error before")
    rows = [*map(list, step)]
    rows[first] = [sum((a * step[i][j] for i, a in slip.items() if step[i][j]), ZERO) for j in range(len(step))]
    for row in (row for row in rows if row[first]):  # the first velocity is y less the others
        row[first] /= slip[first]
        for j, a in slip.items():
            row[j] -= row[first] * a if j != first else 0
    others = {}
    for i in {*range(len(rows))} - {*places}:
        used = [j for j, x in enumerate(rows[i]) if x]
        (row,), by = kernel.integers([[abs(rows[i][j]) for j in used]])
        others[i] = times_grid(pushed[i] + abs(force[i])), [*zip(used, row, strict=True)], by
    of_both = [*filter(any, map(seen, known.columns))]
    return Moves(slip, [rows[i] for i in places], drive, of_both, places, others, units)


def weighed(of: Reversal, m: Moves, unseen: Fraction, noise: Fraction) -> tuple[list[list[Any]], list[Any], int]:
    """For each direction of the polygon, the linear functions whose maximum is its next bound (lemma H).

    Returns:
        For each direction two lists, without and with a change of s. A function is (weights of (y, z, d), constant
        times GRID, place of the weights of the other errors). Then these weights, and the common denominator of all.
    """
    (first, level), (of_y, of_z) = m.places, m.units
    seen = [j for j in m.others if m.rows[0][j] or m.rows[1][j]]
    pushed = [[column[k] for column in m.columns] for k in (0, 1)]
    of_one = (
        [x / unit for x in (row[first] * of_y, row[level] * of_z, d, *(row[j] for j in seen), *pushes)]
        for row, d, pushes, unit in zip(m.rows, m.drive, pushed, m.units, strict=True)
    )
    y, z = of_one
    added = [of.jump * of_y / of_z * x for x in y]  # what `jump` times y adds to z
    numbers = [of.jump * of_y / of_z, 2 * noise / of_z, of.jump * (of.change + 2 * unseen) / of_z]
    (of_next, of_level, jumping, (now, doubled, lift)), by = kernel.integers([y, z, added, numbers])

    places: dict[tuple[int, ...], int] = {}  # many are the same, as of opposite directions

    def sum_of(row: list[int], number: int) -> Any:
        whole, rest, pushes = row[:3], tuple(map(abs, row[3 : 3 + len(seen)])), row[3 + len(seen) :]
        number += sum(map(abs, pushes))
        return whole, number * GRID + sum(map(abs, whole)), places.setdefault(rest, len(places))

    found = []
    for a, b in DIRECTIONS:
        stays, turns = ([k * p + b * q for p, q in zip(of_next, of_level, strict=True)] for k in (a, -a))
        largest = [p + b * q for p, q in zip(turns, jumping, strict=True)]
        largest[0] -= b * now
        more = abs(b) * doubled
        found.append([[sum_of(stays, 0)], [sum_of(turns, more), sum_of(largest, more + b * lift)]])
    return found, [[*zip(seen, rest, strict=True)] for rest in places], by


def moved(shape: Shape, m: Moves, weights: Any, edges: list[int], ways: int) -> list[Shape]:
    """The reachable sets one sample later: without a change of s and, if ``ways`` is 2, with one.

    Args:
        edges: n and `change` of lemma H, in units of y, times GRID.
    """
    kernel.demand(True, "")  # that there is time left
    corners, radii, (start, width), (directions, rests, by) = polygon(shape[0]), shape[1], edges, weights
    still = {(x // w, y // w) for x, y, w in corners}  # d is 0; where its weight is not above 0, these are all
    points = {(x // w, y // w, 0) for x, y, w in corners if x > start * w}  # else d may be GRID, which is more
    points |= {(x // w, y // w, GRID) for x, y, w in cut(corners, 1, 0, start)}
    between = cut(cut(corners, 1, 0, start + width), -1, 0, -start)
    points |= {(x // w, y // w, GRID * ((start + width) * w - x) // (width * w)) for x, y, w in between}

    @cache  # a direction with a change of s is the mirror image of one without
    def corner(a: int, b: int, c: int) -> int:
        return max([a * x + b * y + c * d for x, y, d in points] if c > 0 else [a * x + b * y for x, y in still])

    more = [dot(row, radii) for row in rests]

    def largest(sums: Any) -> int:
        most: int = -max([corner(*of) + number + more[place] for of, number, place in sums]) // by
        return -most

    every = reached(shape, m)
    later = {i: pushed - (-dot(row, every) // by) for i, (pushed, row, by) in m.others.items()}
    return [([largest(each[k]) for each in directions], later) for k in range(ways)]


def dot(row: list[tuple[int, int]], most: dict[int, int]) -> int:
    """The sum of weight times bound over (index, weight) of a row."""
    return sum([x * most[j] for j, x in row])


def reached(shape: Shape, m: Moves) -> dict[int, Any]:
    """Error's index -> the largest magnitude in the set, times GRID; y at the index of the first velocity."""
    (y, z), (bounds, radii) = m.units, shape
    most = above(y, max(bounds[RIGHT], bounds[LEFT])), above(z, max(bounds[TOP], bounds[BOTTOM]))
    return radii | dict(zip(m.places, most, strict=True))


def above(x: Fraction, times: int) -> int:
    """The product, rounded up."""
    return -(-x.numerator * times // x.denominator)


def times_grid(x: Fraction) -> int:
    return above(x, GRID)


def wider(one: Shape, other: Shape) -> Shape:
    """A set of the same form that contains both."""
    return [*map(max, one[0], other[0])], {i: max(x, other[1][i]) for i, x in one[1].items()}


def polygon(bounds: list[int]) -> list[Point]:
    """The corners of the polygon with these bounds in DIRECTIONS."""
    right, top, left, bottom = bounds[RIGHT], bounds[TOP], -bounds[LEFT], -bounds[BOTTOM]
    corners = [(right, bottom, 1), (right, top, 1), (left, top, 1), (left, bottom, 1)]
    for (a, b), most in zip(DIRECTIONS, bounds, strict=True):
        corners = cut(corners, a, b, most) if a and b else corners
    return corners


def cut(corners: list[Point], a: int, b: int, most: int) -> list[Point]:
    """The corners, in order, of the part a x + b y <= most of a convex polygon."""
    over, kept = [a * x + b * y - most * w for x, y, w in corners], []
    if max(over) <= 0:
        return corners
    before, there = corners[-1], over[-1]
    for corner, here in zip(corners, over, strict=True):
        if (here > 0) != (there > 0):  # on the line from there to here: of weights w that are above 0
            (x, y, w), (p, q, v), way = corner, before, 1 if there > 0 else -1
            kept.append((way * (there * x - here * p), way * (there * y - here * q), way * (there * w - here * v)))
        if here <= 0:
            kept.append(corner)
        before, there = corner, here
    return kept
