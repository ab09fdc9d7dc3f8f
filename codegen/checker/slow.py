"""The decay of a parameter-dependent V = e'P(θ)e, interval by interval of θ (docs/certificate_theory.md, theorem 3).

Standard library only; part of the checker (verify.py), which hands ``enclosure`` and ``forms`` in. Between the ends of
an interval P and the chord of A are affine, so the gap cP - F'P+F is a cubic there, and positive semidefinite where its
four Bernstein coefficients are. How far F may be from the chord is bounded, and taken off the gap.
"""

import math
from collections import namedtuple
from collections.abc import Collection
from fractions import Fraction
from itertools import chain, product
from operator import mul
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import enclosure, forms

FINE = 2**52  # steps F = I + hA and parameters are kept as whole numbers of 1/FINE
SHARES = ((1, 0), (2, 1), (1, 2), (0, 1))  # of P at both ends in its coefficients; the middle ones are threefold
MOST_SIGNS, MOST_CORNERS = 8, 50_000
Interval = tuple[Fraction, Fraction]
Rows = list[list[int]]
Chord = tuple[int, int, int]  # both ends of a line, and how far a parameter may be from it; in 1/FINE
# F at a corner of what does not follow: `common` F is the sum of (1, parameters that follow) times `parts`, by columns
# and entry by entry; speeds: the least and greatest mean velocity of the sample.
Corner = namedtuple("Corner", "parts common speeds")
# The data for one P: its number, the signs, pairs of corners at both ends of the velocity, the largest |parts|.
Signed = namedtuple("Signed", "which signs pairs bends")


class Following:
    """A certificate with ``slow``, once it has the form that is asked."""

    def __init__(self, top: dict[str, Any], axes: dict[str, list[Interval]]) -> None:
        entry, demand, n = top["slow"][0], enclosure.demand, len(top["error"])
        self.name, velocity, self.signs, stray = (entry[key] for key in ("variable", "velocity", "signs", "stray"))
        own = len({self.name, velocity} & (axes.keys() - {*self.signs})) == 2
        demand(own, f"slow: {self.name} or {velocity} is no variable of its own")
        self.h, self.cells = top["sample_time"], axes[self.name]
        self.ranges = {name: (cells[0][0], cells[-1][1]) for name, cells in axes.items()}
        pure = all(self.ranges.get(sign) == (Fraction(-1), Fraction(1)) for sign in self.signs)
        demand(
            pure and len({*self.signs}) == len(self.signs) <= MOST_SIGNS, "slow: signs are no variables from -1 to 1"
        )
        demand(top["splits"].keys() <= {self.name}, f"splits of another variable than {self.name}")
        counts, expected = [len(row) for row in entry["matrices"]], [len(self.cells) + 1] * (2 if self.signs else 1)
        demand(counts == expected, f"slow: {counts} matrices for {len(self.cells)} intervals of {self.name}")
        low, high = self.ranges[velocity]
        self.width = high - low
        demand(stray >= 0, "slow: stray is negative")
        self.speeds = {v: (low, high) if stray >= high - low else (v - stray, v + stray) for v in (low, high)}
        self.reach = self.h * max(abs(v) for ends in self.speeds.values() for v in ends)
        shortest = min(b - a for a, b in self.cells)
        demand(self.reach <= shortest, f"{self.name} may pass an interval of its own in one sample")
        flat, _ = forms.integers([row for P in chain(*entry["matrices"]) for row in P])
        whole = [flat[i : i + n] for i in range(0, len(flat), n)]
        self.nodes = [whole[: len(self.cells) + 1], whole[len(self.cells) + 1 :]]
        parsed = {p["name"]: enclosure.parse(p["expression"], axes, p["name"]) for p in top["parameters"]}
        raw = {p["name"]: p["expression"] for p in top["parameters"]}
        self.curves = {name: (raw[name], value) for name, (names, value) in parsed.items() if self.name in names}
        self.others = {name: value for name, (_, value) in parsed.items() if name not in self.curves}
        demand(all(parsed[name][0] == {self.name} for name in self.curves), f"a parameter of {self.name} and of others")
        self.rates = [name for name in self.others if velocity in parsed[name][0]]
        demand(all(raw[name] == velocity for name in self.rates), f"{velocity} within a parameter")
        breaks = [self.cells[0][0], *(b for _, b in self.cells)]
        self.values = [[value({self.name: (x, x)}) for _, value in self.curves.values()] for x in breaks]
        places = [[(entry, f"matrix[{i}][{j}]") for j, entry in enumerate(row)] for i, row in enumerate(top["matrix"])]
        self.A = [[enclosure.parse(entry, parsed, where, True)[1] for entry, where in row] for row in places]
        lone = all(degree(entry, self.curves) < 2 for row in top["matrix"] for entry in row)
        demand(lone, f"matrix: a product of two parameters of {self.name}")

    def chords(self, k: int) -> list[Chord]:
        """Of each parameter that follows on an interval: both ends of a line, and how far it may be from the line."""
        (a, b), found, known = self.cells[k], [], dict[str, Any]()
        for (raw, _), start, end in zip(self.curves.values(), *self.values[k : k + 2], strict=True):
            low, high = enclosure.jet(raw, self.name, (a, b), known)[2]
            low, high = (x * (b - a) ** 2 / 8 for x in (min(low, Fraction(0)), max(high, Fraction(0))))
            middle, off = (
                (low + high) / 2,
                (high - low) / 2 + max(y - x for x, y in (start, end)),
            )  # below by low to high
            at = [math.floor((x - middle) * FINE) for x, _ in (start, end)]
            found.append((at[0], at[1], math.ceil(off * FINE) + 1))
        return found

    def step(self, at: dict[str, Fraction]) -> list[list[Fraction]]:
        """F, by columns."""
        point, size = {name: (x, x) for name, x in at.items()}, range(len(self.A))
        return [[(i == j) + self.h * self.A[i][j](point)[0] for i in size] for j in size]

    def corner(self, at: dict[str, Fraction], speeds: Interval) -> Corner:
        none = at | dict.fromkeys(self.curves, Fraction(0))
        base = self.step(none)
        bends = [forms.minus(self.step(none | {name: Fraction(1)}), base) for name in self.curves]
        entries = [[*entry] for columns in zip(base, *bends, strict=True) for entry in zip(*columns, strict=True)]
        flat, common = forms.integers(entries)
        return Corner([flat[i : i + len(base)] for i in range(0, len(flat), len(base))], common, speeds)

    def signed(self) -> list[Signed]:
        """Every P with what it has to serve: signs that make the same parameters are taken once."""
        found = {}
        for values in product((Fraction(-1), Fraction(1)), repeat=len(self.signs)):
            signs = {name: (x, x) for name, x in zip(self.signs, values, strict=True)}
            box = {name: enclosure.widen(*value(self.ranges | signs)) for name, value in self.others.items()}
            which, free = int(math.prod(values) < 0), [name for name in box if name not in self.rates]
            count = len(self.cells) * math.prod(len({*box[name]}) for name in free)
            enclosure.demand(count <= MOST_CORNERS, f"{count} corners, more than {MOST_CORNERS}")
            points = [dict(zip(free, ends, strict=True)) for ends in product(*(sorted({*box[name]}) for name in free))]
            pairs = [
                [self.corner(at | dict.fromkeys(self.rates, v), ends) for v, ends in self.speeds.items()]
                for at in points
            ]
            every = [[[-(-abs(x) * FINE // c.common) for x in e[1:]] for e in chain(*c.parts)] for c in chain(*pairs)]
            found[which, *box.values()] = Signed(which, signs, pairs, forms.sizes(*every))
        return [*found.values()]

    def slopes(self, which: int, k: int) -> list[tuple[Rows, Fraction]]:
        """Of P on an interval and its neighbours, each once: how far it rises, and over what length."""
        found: list[tuple[Rows, Fraction]] = []
        for j in (k, k - 1, k + 1):
            if 0 <= j < len(self.cells):
                P, Q, length = *self.nodes[which][j : j + 2], self.cells[j][1] - self.cells[j][0]
                rise = forms.minus(Q, P)
                if not any(forms.scaled(length, r) == forms.scaled(other, rise) for r, other in found):
                    found.append((rise, length))
        return found

    def interval(self, k: int, s: Signed, chords: list[Chord], fall: Fraction) -> int:
        """How many coefficients of fall P - F'P+F are positive semidefinite on an interval: all, or refused."""
        P, Q = self.nodes[s.which][k : k + 2]
        starts, ends, offs = zip((FINE, FINE, 0), *chords, strict=True)
        pairs = [[(along(c, starts), along(c, ends), c.speeds) for c in pair] for pair in s.pairs]
        F = forms.sizes(*(X for pair in pairs for *both, _ in pair for X in both))
        turn = forms.sizes(*(forms.minus(X, Y) for p in pairs for X, Y in zip(p[0][:2], p[-1][:2], strict=True)))
        most = [sum(map(mul, offs[1:], bends)) // FINE + 2 for bends in s.bends]
        off = [most[i : i + len(P)] for i in range(0, len(most), len(P))]
        steps = [(X, Y, cubic(forms.squares(P, X, Y), forms.squares(Q, X, Y)), v) for p in pairs for X, Y, v in p]
        upper = [[*zip(u[i:], v[i:], strict=True)] for i, (u, v) in enumerate(zip(P, Q, strict=True))]
        now, count = [[[p * x + q * y for x, y in row] for row in upper] for p, q in SHARES], 0
        for rise, length in self.slopes(s.which, k):
            D = self.astray(forms.sizes(P, Q), forms.sizes(rise), length, F, off, turn)
            ratios = {v: [fall, Fraction(1), self.h * v / length] for v in chain(*self.speeds.values())}
            moves = {v: forms.integers([ratio]) for v, ratio in ratios.items()}
            for X, Y, later, speeds in steps:
                moved = cubic(*[forms.squares(rise, X, Y)] * 2)
                for ((a, b, c),), scale in (moves[v] for v in speeds):
                    a *= FINE**2
                    for (p, q), *parts in zip(SHARES, now, later, moved, strict=True):
                        rows = zip(*parts, strict=True)
                        gap = [[a * x - b * y - c * z for x, y, z in zip(*row, strict=True)] for row in rows]
                        for row, x in zip(gap, D, strict=True):
                            row[0] -= b * (p + q) * x
                        forms.upper_pivots(gap, scale * FINE**2, "")
                        count += 1
        return count

    def astray(self, P: Rows, rise: Rows, length: Fraction, F: Rows, off: Rows, turn: Rows) -> list[int]:
        """A diagonal above what F'P+F is more than on the chord, from the largest |entries| of all.

        off: of F beside its chord; turn: of F at one end of the velocity less that at the other. In the velocity w, F
        is affine and P+ as well, so F'P+F is below its chord by w^2/8 times its second derivative at most.
        """
        a, b = (self.reach / length).as_integer_ratio()
        P = [[p - -a * r // b for p, r in zip(*rows, strict=True)] for rows in zip(P, rise, strict=True)]
        a, b = (self.h * self.width / (4 * length)).as_integer_ratio()
        bent = [[a * x // b + 1 for x in row] for row in forms.inner(turn, forms.times(rise, F))]
        more = [[2 * x + y for x, y in zip(*columns, strict=True)] for columns in zip(F, off, strict=True)]
        pairs = (more, forms.scaled(4, off)), (turn, turn)
        twice = forms.added(*(forms.inner(X, forms.times(P, Y)) for X, Y in pairs))
        return forms.diagonal(forms.added(bent, [[x // 8 + 1 for x in row] for row in twice]), P)


def degree(raw: Any, names: Collection[str]) -> int:
    """How many of the names a product of an entry may hold."""
    if not isinstance(raw, list):
        return int(raw in names)
    each = [degree(item, names) for item in raw[1:]]
    return sum(each) if raw[0] == "*" else max(each)


def along(corner: Corner, values: tuple[int, ...]) -> Rows:
    """F for these values of (1, what follows), at most 1/FINE off."""
    return [[sum(map(mul, values, entry)) // corner.common for entry in column] for column in corner.parts]


def cubic(first: tuple[Rows, Rows, Rows], last: tuple[Rows, Rows, Rows]) -> list[Rows]:
    """Bernstein coefficients of F'PF, the middle ones threefold, from the squares with P at the two ends."""
    return [first[0], forms.added(last[0], first[1]), forms.added(first[2], last[1]), last[2]]


def fall(top: dict[str, Any], axes: dict[str, list[Interval]], factor: Fraction) -> str:
    """That V falls by the factor over every interval, whatever else varies: the fact, or refused."""
    whole = Following(top, axes)
    known, count = whole.signed(), 0
    for k, (a, b) in enumerate(whole.cells):
        chords = whole.chords(k)
        for s in known:
            try:
                count += whole.interval(k, s, chords, factor)
            except enclosure.Refused as why:
                at = {whole.name: (a, b)} | s.signs
                where = (f", {name} in [{enclosure.show(x)}, {enclosure.show(y)}]" for name, (x, y) in at.items())
                raise enclosure.Refused(f"V may not fall{''.join(where)}{why}") from None
    return f"{count} coefficients in {len(whole.cells)} intervals"
