"""Whether noise and drift keep the errors of a kernel's proof below the bounds of a claim.

Standard library only: python3 ellipsoid.py FOLDER < ellipsoid.json, with proof.json and the C in the folder; uses
kernel.py, algebra.py, enclosure.py and files.py, which must be beside it.

THEOREM. Let all be as in the kernel's theorem of the proof, but for this: a position x is measured as x + noise, and x,
v and the rest of `truth` move in a sample by what is said there and a drift, |noise| and |drift| at most as the claim
says, and zero where it is silent; what is said is of the true positions or, if `forces` is "measured", with the
accelerations at the measured ones. Then e = sign * (truth + shift - estimate) moves by
e[k+1] = matrix e[k] + push w[k], w the noises and drifts; it tends to each of the claim's sets, whatever it is at
first, and stays in one in which it is; and |sum of c_i sign_i (truth_i - estimate_i)|, c and then the bound being a row
of the set, is from `samples` samples
later on at most that bound and what the noise of the same sample adds to it. The same holds of each of the bounds of a
row of `after`, so many samples after any in which each |truth_i - estimate_i| is at most that of its `start`. As the
kernel's: of the machine that is printed, in exact arithmetic, while no sign turns.

A set with "friction": "any" is of a proof without signs and conditions, and of a machine on which each truth that the
claim's `friction` names acts in a sample with any mean within the size there, on either side, in place of a constant
and its drift: whether contacts slide, stick, turn or chatter. The truth in its rows is then any number of that size.
"""

import json
import re
import runpy
import sys
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from math import isqrt, lcm
from operator import mul
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import frame, kernel
elif "kernel" not in globals():  # verify.py hands its own in
    frame = SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("frame.py"))))
    algebra = SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("algebra.py")), {"frame": frame}))
    kernel = SimpleNamespace(
        **runpy.run_path(str(Path(__file__).with_name("kernel.py")), {"algebra": algebra, "frame": frame})
    )

FIELDS, MORE = ("name", "noise", "drift", "shifts", "push", "sets"), ("forces", "friction")  # MORE may be absent
FORCES, FRICTION = MORE
KINDS = ("noise", "drift", FRICTION)
SET, LATER = ("matrix", "weights", "samples", "rows"), ("within", "after", FRICTION)  # LATER may be absent
DEPTH = {"samples": 0, "weights": 1, "within": 1, "row": 1, "start": 1, "matrix": 2, "rows": 2, "bounds": 2}  # of lists
GRID, LARGEST, MOST_SAMPLES, MOST_ROWS = 1 << 60, 84, 10_000, 1000
Polys = list[list[Any]]


@cache  # a claim repeats its numbers, the start at every bound
def number(text: Any) -> Fraction:
    found: Fraction = kernel.Text({}, {}).value(text).constant()
    return found


def moves(proof: dict[str, Any], claim: dict[str, Any], shown: dict[str, Any]) -> tuple[Polys, Polys, list[Any]]:
    """Matrix, push and sign * shift as polynomials, if the errors move so; ValueError if not.

    LEMMA A. What `step` makes of states and inputs is a function of them. So by the kernel's theorem the states after a
    sample are G (`states`) of an undisturbed machine that was where the position was measured, and of its estimates.
    Beside what is measured then they show the estimates of which G gives them; there are no two such (its lemma 10).
    """
    term, zero, velocity, errors = kernel.term, kernel.Poly(), proof["positions"], proof["errors"]
    truths, estimates, turned = ([e[part] for e in errors] for part in ("truth", "estimate", "sign"))
    kernel.demand(not shown["first order"] and "rest" not in proof, "the errors are not linear, or have a rest")
    kernel.demand({*claim["noise"]} <= {*velocity}, "noise of what is no position")
    kernel.demand({*claim["drift"]} <= {*velocity, *truths, *proof["acceleration"]}, "drift of what does not move")
    constant = {t for t, s in zip(truths, turned, strict=True) if not s} - {*velocity, *proof["acceleration"]}
    free = shown["whole"] and not proof["signs"] and {*claim.get(FRICTION, {})} <= constant
    kernel.demand(free or not claim.get(FRICTION), "any friction, beside a sign or a condition, or of no constant")
    noise, drift, friction = ({x: term(1, f"{kind}.{x}") for x in claim.get(kind, {})} for kind in KINDS)
    names = {x: p for x, p in shown["names"].items() if x not in estimates}
    h, fresh = (
        names["parameters.sample_time"],
        {x: term(1, f"later.{x}") for x in names if x.startswith(("inputs.", "state."))},
    )

    def read(names: dict[str, Any], texts: Any, noise: dict[str, Any] | None = None) -> list[Any]:
        text = kernel.Text(names | {f"noise.{x}": n for x, n in (noise or {}).items()}, shown["known"])
        values = {x: text.value(x) for x in dict.fromkeys(texts)}  # most are 0
        return [values[x] for x in texts]

    def later(at: dict[str, Any], drift: dict[str, Any], acting: dict[str, Any]) -> dict[str, Any]:
        rate = zip(proof["acceleration"], read(acting, proof["acceleration"].values()), strict=True)
        then = at | fresh | {x: at[x] + drift.get(x, zero) for x in truths}
        then |= {v: at[v] + h * a + drift.get(v, zero) for v, a in rate}
        mean = {"euler": at, "semi_implicit": then}[proof["step"]]
        return then | {x: at[x] + h * mean[v] + drift.get(x, zero) for x, v in velocity.items()}

    def shows(then: dict[str, Any], shift: list[Any], error: list[Any]) -> list[Any]:
        rows = zip(estimates, truths, turned, shift, error, strict=True)
        return read(then | {y: then[t] + d - names[s] * e for y, t, s, d, e in rows}, proof["states"].values())

    matrix, push = shown["matrix"], [read(names, row) for row in claim["push"]]
    error = [term(1, f"error.{x}") for x in truths]
    shift = [names[s] * d for s, d in zip(turned, read(names, claim["shifts"], noise), strict=True)]
    raw = [[e - d] for e, d in zip(error, shift, strict=True)]
    unmoved = later(names, {}, names)
    expected = shows(unmoved, [zero] * len(error), [e for (e,) in kernel.times(matrix, raw, zero)])
    true = names | {x: names[x] - n for x, n in noise.items()}
    acting = names if claim.get(FORCES) else true
    then = later(true, drift, acting | {x: acting[x] + force for x, force in friction.items()})
    new = {x: term(1, f"later.noise.{x}") for x in noise}
    then |= {x: then[x] + n for x, n in new.items()}
    wide = [[*a, *b] for a, b in zip(matrix, push, strict=True)]
    following = kernel.times(wide, [[x] for x in (*error, *noise.values(), *drift.values(), *friction.values())], zero)
    found = shows(then, read(then, claim["shifts"], new), [e for (e,) in following])
    wrong = [z for z, a, b in zip(proof["states"], found, expected, strict=True) if a != b]
    kernel.demand(not wrong, f"noise and drift do not enter so: {wrong[:3]}")
    return matrix, push, shift


def root(x: Fraction) -> Fraction:
    """Above the square root."""
    return Fraction(isqrt(int(x * GRID * GRID) + 1) + 1, GRID)


def whole(rows: Any) -> tuple[int, list[list[int]]]:
    """(n, n * rows), the least n > 0 with which they are whole numbers."""
    rows = [*rows]
    n = lcm(*(x.denominator for row in rows for x in row))
    return n, [[x.numerator * (n // x.denominator) for x in row] for row in rows]


def disturbing(push: Polys, most: list[Fraction]) -> list[list[Fraction]]:
    """The columns of push, with each disturbance at its size, one for each product of signs in it."""
    signs = {x for row in push for p in row for x in p.names()}
    kernel.demand(all(x.startswith("sign.") for x in signs), f"{sorted(signs)[:3]}: not signs alone")
    columns: list[list[Fraction]] = []
    for d, column in zip(most, zip(*push, strict=True), strict=True):
        columns += [[d * p.get(m, 0) for p in column] for m in sorted({m for p in column for m in p}) if d]
    return columns


class Bundles:
    """Many whole numbers in one.

    LEMMA C. The bundle of numbers x_k, all |x_k| < 2^(width - 1), is the sum of x_k 2^(width k). The sum of two bundles
    and the multiple of one are the bundles of sums and multiples, if these are as small. 2^(width - 1) + x_k are digits
    to the base 2^width: the first bit is 1 just if x_k >= 0, and what follows then is x_k; without the last s bits it
    is 2^(width - 1 - s) + x_k/2^s, rounded down. In 2^s + x_k, so written, no bit before the last s + 1 is 1 just if
    -2^s <= x_k < 2^s.
    """

    def __init__(self, width: int, count: int) -> None:
        self.width, self.ones = width, sum(1 << width * k for k in range(count))
        self.half = self.ones << width - 1

    def of(self, numbers: Sequence[int]) -> int:
        return sum(x << self.width * k for k, x in enumerate(numbers))

    def at(self, bundle: int, k: int) -> int:
        digit = (bundle + self.half) >> self.width * k & (1 << self.width) - 1
        return digit - (1 << self.width - 1)

    def sizes(self, bundle: int) -> int:
        """Of |x_k|: twice those above 0, less all."""
        digits = bundle + self.half
        up = digits >> self.width - 1 & self.ones
        return 2 * (digits & (up << self.width - 1) - up) - bundle

    def over(self, bundle: int, s: int) -> int:
        """Of x_k/2^s, rounded down."""
        return (bundle + self.half >> s & (self.ones << self.width - s) - self.ones) - (self.half >> s)

    def within(self, bundle: int, s: int) -> bool:
        """Whether -2^s <= x_k < 2^s."""
        return not bundle + (self.ones << s) & (self.ones << self.width) - (self.ones << s + 1)


def carried(counts: dict[tuple[Fraction, ...], set[int]], step: Any, columns: Any, Q: Any) -> Any:
    """c' and N, of the set of c' -> GRID times a row near c'Phi^N, and how far |c'e[k+N]| is at most above |row e[k]|.

    LEMMA D. For rows r_0 near c' and r_i+1 near r_i Phi, Phi being constant, c'e[k+N] is the sum of r_N e[k], of r_i
    push w[k+N-1-i] over i < N, and of what is left out of each r_i times an e, each of them in E(1), where |e_j| is at
    most Q_jj's root. Entries of r_i are here whole numbers up to 2^LARGEST, over GRID, of Phi and push over `by` and
    `unit`. For |m| < 2^s, m/by is taken as m R/2^s, R being 2^s/by, both rounded down: it is at most 2 off. So what is
    left out of an entry is at most 2/GRID. A product of signs is 1 or -1.

    Args:
        step: Phi, of numbers; columns: of push, with each disturbance at its size.
    """
    (by, across), (unit, entering), size = whole(zip(*step, strict=True)), whole(columns), len(step)
    s = LARGEST + max(sum(map(abs, column)) for column in [*across, *entering]).bit_length()
    R, most = (1 << s) // by, MOST_SAMPLES * (len(columns) + 1)
    bundles = Bundles(s + max(R, most).bit_length() + 1, len(counts))
    starts = [[int(x * GRID) for x in c] for c in counts]
    of_all = all(len(c) == size and max(map(abs, c)) < 1 << LARGEST for c in starts)
    kernel.demand(starts and of_all, "no row of every error")
    sparse = [[(i, a) for i, a in enumerate(column) if a] for column in [*across, *entering]]
    left_out = 2 * sum((root(Q[i][i]) for i in range(size)), Fraction(0)) / GRID
    rows, total, found = [bundles.of(entries) for entries in zip(*starts, strict=True)], 0, {}
    for n in range(max(map(max, counts.values())) + 1):
        kernel.demand(all(bundles.within(row, LARGEST) for row in rows), "a row is too large")
        for k, (c, asked_at) in enumerate(counts.items()):
            if n in asked_at:
                row = [bundles.at(entries, k) for entries in rows]
                found[c, n] = row, Fraction(bundles.at(total, k), unit * GRID) + (n + 1) * left_out
        moved = [sum([a * rows[i] for i, a in column]) for column in sparse]
        total += sum(map(bundles.sizes, moved[size:]))
        rows = [bundles.over(m * R, s) for m in moved[:size]]
    return found


def seen(shift: Any, most: dict[str, Fraction], proof: dict[str, Any]) -> Fraction:
    """What a polynomial in single disturbances, times signs, is at most."""
    size = Fraction(0)
    for monomial, a in shift.items():
        (disturbance,) = (x for x in monomial if x not in proof["signs"])
        size += abs(a) * most[disturbance]
    return size


def lists(x: Any, depth: int) -> bool:
    """Whether these are lists of lists of texts or whole numbers: what is read of an object are its keys alone."""
    return type(x) in (str, int) if depth == 0 else type(x) is list and all(lists(y, depth - 1) for y in x)


def asked(ball: dict[str, Any]) -> list[tuple[list[str], str, list[str] | None]]:
    """Of a set: its rows and those of `after`, with their samples, and where they begin (of the former anywhere)."""
    later: list[Any] = [([*a["row"], b], n, a["start"]) for a in ball.get("after", []) for n, b in a["bounds"]]
    return [(row, ball["samples"], None) for row in ball["rows"]] + later


@frame.limited()
def bounded(proof: dict[str, Any], claim: dict[str, Any], shown: dict[str, Any]) -> list[list[Fraction]]:
    """The bounds that the rows of each set (``asked``) have with the noise of the same sample, or ValueError."""
    fields = {*claim} - {*MORE} == {*FIELDS} and claim.get(FORCES, "measured") == "measured"
    kernel.demand(fields and claim["name"] == proof["name"], f"not just {FIELDS}, or of another machine")
    of_noise = [x for x in claim["noise"] for of in proof.get("shared", {}).values() if x in of]
    kernel.demand(not of_noise, "noise in a state that the machine has too")
    parts = [claim["sets"], *(ball.get("after", []) for ball in claim["sets"])]
    kernel.demand(lists(claim["shifts"], 1) and lists(claim["push"], 2) and {*map(type, parts)} == {list}, "no lists")
    matrix, push, shift = moves(proof, claim, shown)
    sizes = {f"{kind}.{x}": number(d) for kind in KINDS for x, d in claim.get(kind, {}).items()}
    kernel.demand(min([Fraction(0), *sizes.values()]) == 0, "noise, drift or friction below 0")
    step = [[x.constant() for x in row] for row in matrix]
    result = []
    for ball in claim["sets"]:
        # LEMMA F. In a set of any friction those truths are 0 without drift, and what acts is `friction`. So its rows
        # bound c_i (0 - estimate_i), and with c_i truth_i at most |c_i| times that size besides what is said.
        any_ = FRICTION in ball
        known = ball.get(FRICTION) == "any" and claim.get(FRICTION) and "after" not in ball
        kernel.demand(known or not any_, "friction")
        still = {f"{'drift' if any_ else FRICTION}.{x}" for x in claim.get(FRICTION, {})}
        most = {x: Fraction(0) if x in still else d for x, d in sizes.items()}
        kernel.demand({*ball, *LATER} == {*SET, *LATER}, "not just the fields of a set")
        parts = [ball, *ball.get("after", [])]
        kernel.demand(all({*a} == {"row", "start", "bounds"} for a in parts[1:]), "not just the fields of `after`")
        kernel.demand(all(lists(a[x], DEPTH[x]) for a in parts for x in a if x in DEPTH), "no lists")
        Q = [[number(x) for x in row] for row in ball["matrix"]]
        keep(Q, [*map(number, ball["weights"])], [*most.values()], step, push, proof, shown)
        found = reached(ball, Q, step, disturbing(push, [*most.values()]), shift, most, proof)
        own = [sizes.get(f"{FRICTION}.{e['truth']}", Fraction(0)) * any_ for e in proof["errors"]]
        more = (sum(abs(number(c)) * d for c, d in zip(row[:-1], own, strict=True)) for row, *_ in asked(ball))
        result.append([bound + x for bound, x in zip(found, more, strict=True)])
    return result


def keep(
    Q: Any, weights: list[Fraction], sizes: list[Fraction], step: Any, push: Polys, proof: Any, shown: Any
) -> None:
    """Whether the set E(1) of Q is kept, or ValueError.

    LEMMA B. E(r) be all e with (c'e)^2 <= r c'Qc for every c. If Q - Phi Q Phi'/f - sum t_j b_j b_j' is positive
    semidefinite, b_j the columns of push, 0 < f < 1, t_j > 0, f + sum d_j^2/t_j <= 1 (over d_j > 0 alone, where t_j = 0
    is for d_j = 0), then e in E(r), r >= 1, goes by
    |w_j| <= d_j into E(1 + f (r - 1)): |c'Phi e| + sum |c'b_j| d_j is by Cauchy's inequality at most the root of
    (c'Phi Q Phi'c/f + sum t_j (c'b_j)^2) (r f + sum d_j^2/t_j) <= c'Qc (r f + 1 - f). Hence r falls to 1, and E(1) is
    not left. If Q is definite every e is in some E(r). In E(1) |c'e| is at most the root of c'Qc.
    """
    f, *t = weights
    acting = [(d, x) for d, x in zip(sizes, t, strict=True) if d or x]
    kernel.demand(min([f, *(x for _, x in acting)]) > 0, "weights not above 0")
    kernel.demand(f < 1 and f + sum(d * d / x for d, x in acting) <= 1, "weights too small")
    (by, Q), (unit, step) = whole(Q), whole(step)
    symmetric = [*map(list, zip(*Q, strict=True))] == Q
    kernel.demand(symmetric, "a set's matrix is not symmetric")
    kernel.demand(kernel.positive(Q, definite=True), "a set's matrix is not positive definite")
    moved = kernel.times(kernel.times(step, Q, 0), zip(*step, strict=True), 0)
    kept, over = unit * unit * f.numerator, by * unit * unit * f.numerator
    weighted = [[kernel.term(x) * b for x, b in zip(t, row, strict=True)] for row in push]
    added = kernel.times(weighted, zip(*push, strict=True), kernel.Poly())
    gap = [[kernel.term(Fraction(kept * q - f.denominator * x, over)) - y for q, x, y in zip(*rows, strict=True)]
           for rows in zip(Q, moved, added, strict=True)]  # fmt: skip
    kernel.semidefinite(gap, shown["box"], proof["cover"], shown["known"])


def reached(
    ball: dict[str, Any], Q: Any, step: Any, columns: Any, shift: list[Any], most: dict[str, Fraction], proof: Any
) -> list[Fraction]:
    """The bounds of the rows of one set that is kept, with the noise of the same sample, or ValueError.

    LEMMA E. If |e_i| <= s_i for each of n errors, r >= 1 and r Q - n diag(s_i^2) is positive semidefinite (r and s are
    `within`), then e is in E(r), as (c'e)^2 <= n sum (c_i s_i)^2 by Cauchy's inequality, and stays there by lemma B: in
    lemma D, r Q is for Q.
    """
    r, *within = map(number, ball.get("within", ["1"]))
    limits = [len(Q) * s * s for s in within] or [Fraction(0)] * len(Q)
    larger = [[r * x for x in row] for row in Q]
    inside = [[x - (limit if i == j else 0) for j, x in enumerate(row)]
              for i, (row, limit) in enumerate(zip(larger, limits, strict=True))]  # fmt: skip
    kernel.demand(r >= 1 and kernel.positive(whole(inside)[1]), "`within` is not in the set: not positive semidefinite")
    counts: dict[tuple[Fraction, ...], set[int]] = {}
    lines = [(tuple(map(number, row)), count, begun) for row, count, begun in asked(ball)]
    for (*c, _), count, _ in lines:
        kernel.demand(re.fullmatch("0|[1-9][0-9]{0,6}", str(count)), f"{str(count)[:20]!r} is no number of samples")
        kernel.demand(int(count) <= MOST_SAMPLES, "so many samples")
        counts.setdefault(tuple(c), set()).add(int(count))
    kernel.demand(len(counts) <= MOST_ROWS, "so many rows")
    known: Any = {}
    for last in {max(n) for n in counts.values()}:
        known |= carried({c: n for c, n in counts.items() if max(n) == last}, step, columns, larger)
    bounds, (by, squares) = [], whole(Q)
    noise = [seen(p, most, proof) for p in shift]
    for (*c, bound), count, begun in lines:
        row, summed = known[tuple(c), int(count)]
        if begun is not None:  # e is the error with the noise of that sample
            start = [number(s) + x for s, x in zip(begun, noise, strict=True)]
            kernel.demand(all(0 <= s <= x for s, x in zip(start, within, strict=True)), "`start` is not `within`")
            parts, (sizes,) = whole([start])
            holds = (bound - summed) * parts * GRID >= sum(map(mul, map(abs, row), sizes))
        else:
            rest, square = bound - summed, sum(a * sum(map(mul, qs, row)) for a, qs in zip(row, squares, strict=True))
            holds = rest >= 0 and square <= rest * rest * by * GRID**2
        kernel.demand(holds, "what is reached is larger than its bound")
        direct = sum((kernel.term(a) * d for a, d in zip(c, shift, strict=True)), kernel.Poly())
        bounds.append(bound + seen(direct, most, proof))
    return bounds


def prove(proof: dict[str, Any], claim: dict[str, Any], files: dict[str, str]) -> list[list[Fraction]]:
    """The bounds of the rows of each set, if the kernel proves the proof of these files, and these of it."""
    return bounded(proof, claim, kernel.prove(proof, files))


def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    kernel.demand(len(dict(pairs)) == len(pairs), "a field appears twice")
    return dict(pairs)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    read, most = (runpy.run_path(str(Path(__file__).with_name(f"{of}.py")))[name]
                  for of, name in (("files", "read"), ("enclosure", "most")))  # fmt: skip
    try:
        given = json.loads(sys.stdin.read(10**7), object_pairs_hook=once)
        paths = [folder / name for name in ("proof.json", f"{given['name']}.c", f"{given['name']}.h")]
        proof, *sources = [read(path, 10**6).decode() for path in paths]
        files = dict(zip((path.name for path in paths[1:]), sources, strict=True))
        found = prove(json.loads(proof, object_pairs_hook=once), given, files)
        lines = [
            f"at most {most(bound)}{f' {samples} samples after the start' * (begun is not None)}: {' '.join(c)}"
            for ball, bounds in zip(given["sets"], found, strict=True)
            for ((*c, _), samples, begun), bound in zip(asked(ball), bounds, strict=True)
        ]
    except Exception as why:
        sys.exit(f"refused: {type(why).__name__} {str(why)[:200]}")
    print("\n".join(lines))
