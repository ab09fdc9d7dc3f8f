"""Proof that bounded noise and drift keep the estimation errors within stated bounds (invariant ellipsoids).

Standard library only; verify.py runs it, after theorem.py has compared the proof with its machine and with the C.

Names: an error is e = sign * (truth + shift - estimate), shift the direct effect of the noise of this sample on the
estimate. `push` is the matrix by which noise and drift act on the errors in a sample.

THEOREM. Assume what the kernel's theorem assumes of the proof, with these changes. Each position x is measured as
x + noise. In a sample x, v and every other `truth` change as the kernel's machine says, plus a drift. |noise| and
|drift| are at most the sizes that the claim states, and zero if it states none. The machine's accelerations are those
at the true positions or, if `forces` is "measured", at the measured ones. Let w[k] be all noises and drifts. Then

1. the errors obey e[k+1] = matrix e[k] + push w[k];
2. from any initial value, e tends to each set (ellipsoid) of the claim, and does not leave a set that it is in;
3. for each row (c, bound) of a set: `samples` samples after e came into the set, and ever after,
   |sum of c_i sign_i (truth_i - estimate_i)| is at most bound plus the direct effect of the noise of that sample;
4. for each row c of `after` and each of its bounds (n, bound): the same, n samples after any sample in which every
   |truth_i - estimate_i| is at most its entry in `start`, and ever after.

As in the kernel's theorem, this holds for the machine that is printed, in exact arithmetic, while no sign changes.
The bounds on the errors right after one sign has changed are in `reversals`, by the theorem of reversal.py.

`above` names slips, linear in true velocities, and for each a speed: the sizes are stated for motions in which no such
slip is ever slower (where a friction law may be steep). Above each speed the sign of the slip's estimate is proved.

A set with "friction": "any" needs a proof without signs and conditions. Each truth named in the claim's `friction` then
acts in each sample with any mean value up to the size stated there, in either direction, in place of a constant and its
drift: contacts may slide, stick, reverse or chatter. In the rows of this set that truth is any number up to that size.
"""

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import cache
from math import ceil, isqrt
from operator import add, mul
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING or __package__:
    from codegen.checker import files, forms, frame, kernel, reversal, rounding

FORCES, FRICTION, REVERSALS, ABOVE = "forces", "friction", "reversals", "above"
KINDS = ("noise", "drift", FRICTION)
AFTER, START = {"row": [""], "start": [""], "bounds": [[""]]}, {"before": [""], "after": [""]}
SET = {"matrix": [[""]], "weights": [""], "samples": "", "rows": [[""]], "within?": [""], "after?": [AFTER]}
TURN = {"sign": "", "samples": "", "turns": "", "change": "", "jump": ""} | START
FORM: dict[str, Any] = {"name": "", "forces?": "", "shifts": [""], "push": [[""]], "sets": [SET | {"friction?": ""}]}
FORM |= {"noise": {"": ""}, "drift": {"": ""}, "friction?": {"": ""}, "reversals?": [TURN]}  # as files.py says
FORM |= {"above?": {"": ""}}
GRID, LARGEST, EVERY, MOST_SAMPLES, MOST_ROWS = 1 << 48, 72, 128, 10_000, 1000
# GRID: rows are kept in multiples of 1/GRID. LARGEST: bits of such a multiple. EVERY: samples until their digits are
# made anew. The others limit what a claim may ask.
LEVELS = 5  # up to 2^LEVELS - 1 samples are shown at once
MOST_ENTRIES = 1 << 22  # of rows, at all samples that are asked for
Polys = list[list[Any]]
Row = tuple[Fraction, ...]


@cache  # a claim repeats its numbers, the start at every bound
def number(text: Any) -> Fraction:
    """The exact value of a constant expression."""
    found: Fraction = kernel.Text({}, {}).value(text).constant()
    return found


def error_dynamics(
    proof: dict[str, Any], claim: dict[str, Any], proven: dict[str, Any]
) -> tuple[Polys, Polys, list[Any]]:
    """Matrix, push and sign * shift as polynomials, if the errors obey part 1 of the theorem; ValueError if not.

    LEMMA A. The states after `step` depend only on the states and inputs before it. Compare the machine with an
    undisturbed one that is at the measured position, with the same states. By the kernel's theorem the next states are
    G(truth, estimates) of the undisturbed machine after the sample, G being `states`. With the next measurement, the
    same states are G of the disturbed machine and of its estimates, and by the kernel's lemma 10 there is only one
    such vector of estimates. So the next errors follow from equating both: an identity of polynomials.
    """
    term, zero, velocity, errors = kernel.term, kernel.Poly(), proof["positions"], proof["errors"]
    truths, estimates, turned = ([e[part] for e in errors] for part in ("truth", "estimate", "sign"))
    kernel.demand(not proven["first order"] and "rest" not in proof, "the errors are not linear, or have a rest")
    kernel.demand({*claim["noise"]} <= {*velocity}, "noise of a quantity that is not a position")
    kernel.demand(
        {*claim["drift"]} <= {*velocity, *truths, *proof["acceleration"]},
        "drift of a quantity that is not a truth or velocity",
    )
    levels = {t for t, s in zip(truths, turned, strict=True) if bool(s) == bool(proof["signs"])}
    levels -= {*velocity, *proof["acceleration"]}
    free = proven["whole"] and {*claim.get(FRICTION, {})} <= levels
    kernel.demand(free or not claim.get(FRICTION), "friction needs constant truths or levels, and no conditions")
    noise, drift, friction = ({x: term(1, f"{kind}.{x}") for x in claim.get(kind, {})} for kind in KINDS)
    names = {x: p for x, p in proven["names"].items() if x not in estimates}
    h, fresh = (
        names["parameters.sample_time"],
        {x: term(1, f"later.{x}") for x in names if x.startswith(("inputs.", "state."))},
    )

    def read(names: dict[str, Any], texts: Any, noise: dict[str, Any] | None = None) -> list[Any]:
        text = kernel.Text(names | {f"noise.{x}": n for x, n in (noise or {}).items()}, proven["known"])
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

    matrix, push = proven["matrix"], [read(names, row) for row in claim["push"]]
    error = [term(1, f"error.{x}") for x in truths]
    shift = [names[s] * d for s, d in zip(turned, read(names, claim["shifts"], noise), strict=True)]
    raw = [[e - d] for e, d in zip(error, shift, strict=True)]
    unmoved = later(names, {}, names)
    expected = shows(unmoved, [zero] * len(error), [e for (e,) in forms.product(matrix, raw, zero)])
    true = names | {x: names[x] - n for x, n in noise.items()}
    acting = names if claim.get(FORCES) else true
    then = later(true, drift, acting | {x: acting[x] + force for x, force in friction.items()})
    new = {x: term(1, f"later.noise.{x}") for x in noise}
    then |= {x: then[x] + n for x, n in new.items()}
    wide = [[*a, *b] for a, b in zip(matrix, push, strict=True)]
    following = forms.product(wide, [[x] for x in (*error, *noise.values(), *drift.values(), *friction.values())], zero)
    found = shows(then, read(then, claim["shifts"], new), [e for (e,) in following])
    wrong = [z for z, a, b in zip(proof["states"], found, expected, strict=True) if a != b]
    kernel.demand(not wrong, f"noise and drift do not act on the errors as claimed: {wrong[:3]}")
    return matrix, push, shift


def root_above(x: Fraction) -> Fraction:
    """A number above the square root, by at most a few steps of the grid."""
    return Fraction(isqrt(int(x * GRID * GRID) + 1) + 1, GRID)


def disturbance_columns(push: Polys, most: list[Fraction]) -> list[list[Fraction]]:
    """Columns of push times the size of their disturbance; one for each product of signs in the column's entries."""
    signs = {x for row in push for p in row for x in p.names()}
    kernel.demand(all(x.startswith("sign.") for x in signs), f"{sorted(signs)[:3]}: not signs alone")
    columns: list[list[Fraction]] = []
    for d, column in zip(most, zip(*push, strict=True), strict=True):
        products = sorted({m for p in column for m in p}) if d else []
        columns += [[d * p[m] if m in p else Fraction(0) for p in column] for m in products]
    return columns


class PackedIntegers:
    """Vectors of ``count`` integers, each packed into one long integer, so that one operation acts on all entries.

    LEMMA C. The entries x_k, |x_k| < 2^(width - 1), are packed as the sum of x_k 2^(width k). Sums and multiples of
    packed vectors are the packed sums and multiples, as long as these entries are below the same limit. Adding
    2^(width - 1) to every entry (`half`) makes them digits of `width` bits:
    - the highest bit of a digit is 1 exactly if x_k >= 0, and the bits below it are then x_k;
    - without its last s bits a digit is 2^(width - 1 - s) + x_k/2^s, rounded down;
    - with 2^t added in place of 2^(width - 1), the bits above the last t + 1 are all 0 exactly if -2^t <= x_k < 2^t.

    Args:
        width: bits of a digit.
        s, t: ``shifted`` divides by 2^s, and ``within`` compares with 2^t.
    """

    def __init__(self, width: int, count: int, s: int, t: int) -> None:
        self.width, self.s = width, s
        self.ones = sum(1 << width * k for k in range(count))
        self.half = self.ones << width - 1
        self.without, self.halved = (self.ones << width - s) - self.ones, self.half >> s
        self.limit, self.above = self.ones << t, (self.ones << width) - (self.ones << t + 1)

    def pack(self, numbers: Sequence[int]) -> int:
        return sum(x << self.width * k for k, x in enumerate(numbers))

    def unpack(self, bundle: int, places: Iterable[int]) -> list[int]:
        middle, digits = 1 << self.width - 1, bundle + self.half
        return [(digits >> self.width * k & 2 * middle - 1) - middle for k in places]

    def signs(self, bundles: Sequence[int]) -> list[int]:
        """For each vector an integer whose bit (k + 1) width − 1 is 1 exactly where x_k ≥ 0."""
        half = self.half
        return [bundle + half & half for bundle in bundles]

    def magnitudes(self, bundles: Sequence[int]) -> int:
        """The packed sum of the |x_k| of these vectors: twice that of the positive entries, minus that of all."""
        positive, half, top = 0, self.half, self.width - 1
        for bundle in bundles:
            digits = bundle + half
            up = digits & half
            positive += digits & up - (up >> top)
        return 2 * positive - sum(bundles)

    def shifted(self, bundles: Sequence[int]) -> list[int]:
        """The packed x_k/2^s of each vector, rounded down."""
        half, s, without, halved = self.half, self.s, self.without, self.halved
        return [(bundle + half >> s & without) - halved for bundle in bundles]

    def within(self, bundles: Sequence[int]) -> bool:
        """Whether -2^t <= x_k < 2^t for all k of all vectors."""
        limit, above = self.limit, self.above
        return not any(bundle + limit & above for bundle in bundles)


def propagated(
    rows: Sequence[Row], asked: Callable[[int], Collection[int]], last: int, step: Any, columns: Any, unit: int, Q: Any
) -> Iterator[tuple[int, dict[int, tuple[tuple[int, ...], int]]]]:
    """For N = 0, ..., last samples: N, and of the rows c' that are asked for a bound of |c'e[k+N]| - |row e[k]|.

    LEMMA D. Let r_0 be c' and r_i+1 be r_i Phi, all rounded to multiples of 1/GRID. Then c'e[k+N] is the sum of
    r_N e[k]; of r_i push w[k+N-1-i] over i < N; and of the rounding error of each r_i times the e of some sample. That
    e is in E(1), where |e_j| is at most the root of Q_jj. A product of signs in push is 1 or -1.
    Rounding: entries of GRID r_i are integers up to 2^t; Phi and push have the denominators `by` and `unit`. To r_i is
    added m/by, m = by r_i (Phi - 1): shorter numbers than those of by r_i Phi. For |m| < 2^s it is computed as m R/2^s
    with R = 2^s/by, both rounded down: the result is at most 2 off, and so is GRID r_i+1. The digits are as wide as the
    entries demand: they are made anew where one exceeds 2^t, and every EVERY samples.
    While the r_i of all rows times a column keep their signs, the sum of the magnitudes is the magnitude of the sum.

    Args:
        rows: the rows c'. asked: N -> the places of those that are asked for.
        step: Phi. columns, unit: integers, over this number they are the columns of push times the size of their
            disturbance. Q: the diagonal of the set's matrix.

    Yields:
        N, and place of c' -> (the row times GRID, the bound times unit * GRID, rounded up).
    """
    size, (across, by) = len(step), kernel.integers(zip(*step, strict=True))
    for i, column in enumerate(across):
        column[i] -= by  # of Phi - 1
    growth = max(sum(map(abs, column)) for column in across).bit_length()
    added = EVERY * sum(sum(map(abs, column)) for column in columns)
    starts = [[int(x * GRID) for x in c] for c in rows]
    of_all = all(len(c) == size and max(map(abs, c)) < 1 << LARGEST for c in starts)
    kernel.demand(starts and of_all, "no row of every error")
    terms = [(j, i, a) for j, column in enumerate([*across, *columns]) for i, a in enumerate(column) if a]
    left_out, every = ceil(2 * unit * sum(map(root_above, Q), Fraction(0))), range(len(starts))
    packed, total = PackedIntegers(LARGEST + 1, len(rows), 0, 0), 0
    bundles, sums, signs = [packed.pack(entries) for entries in zip(*starts, strict=True)], list[int](), list[int]()
    for n in range(last + 1):
        kernel.demand(True, "")  # that there is time left
        if n % EVERY == 0 or not packed.within(bundles):
            entries = [packed.unpack(bundle, every) for bundle in bundles]
            totals = packed.unpack(total + packed.magnitudes(sums), every)
            longest = max(abs(x) for row in entries for x in row).bit_length()
            kernel.demand(longest <= LARGEST, "a row is too large")
            t = longest + 2  # of most rows the entries fall, or rise slowly
            s = t + growth
            R = (1 << s) // by
            width = max(s + R.bit_length(), (max(totals) + (added << t)).bit_length()) + 1
            packed = PackedIntegers(width, len(rows), s, t)
            bundles, total = [*map(packed.pack, entries)], packed.pack(totals)
            sums, signs = [0] * len(columns), [packed.half] * len(columns)
        if places := asked(n):
            total, sums = total + packed.magnitudes(sums), [0] * len(columns)
            bounds = [x + (n + 1) * left_out for x in packed.unpack(total, places)]
            there = zip(*[packed.unpack(bundle, places) for bundle in bundles], strict=True)
            yield n, dict(zip(places, zip(there, bounds, strict=True), strict=True))
        moved = [0] * (size + len(columns))
        for j, i, a in terms:
            moved[j] += a * bundles[i]
        before, signs = signs, packed.signs(moved[size:])
        for j in (j for j, now in enumerate(signs) if now != before[j]):
            total, sums[j] = total + packed.magnitudes([sums[j]]), 0
        sums = [*map(add, sums, moved[size:])]
        bundles = [*map(add, bundles, packed.shifted([m * R for m in moved[:size]]))]


def largest(shift: Any, most: dict[str, Fraction], proof: dict[str, Any]) -> Fraction:
    """The largest value of a sum of disturbances times coefficients and signs."""
    size = Fraction(0)
    for monomial, a in shift.items():
        (disturbance,) = (x for x in monomial if x not in proof["signs"])
        size += abs(a) * most[disturbance]
    return size


def claimed_rows(set_: dict[str, Any]) -> list[tuple[list[str], str, list[str] | None, str | None]]:
    """Bounds of a set as tuples: (row c with its bound, number of samples from which on it holds, `start`, end).

    The rows of the set come first, with `start` and end None; then those of `after`. There end is the number of samples
    from which on the next, smaller bound holds, and None for the last.
    """
    rows: list[Any] = [(row, set_["samples"], None, None) for row in set_["rows"]]
    for a in set_.get("after", []):
        following = [*(n for n, _ in a["bounds"][1:]), None]
        rows += [([*a["row"], b], n, a["start"], end) for (n, b), end in zip(a["bounds"], following, strict=True)]
    return rows


@frame.limited()
def bounded(proof: dict[str, Any], claim: dict[str, Any], proven: dict[str, Any]) -> list[list[Fraction]]:
    """Verifies all claims of ellipsoid.json; ValueError if one is not shown.

    Args:
        proof, proven: proof.json, and what errors.prove returned for it. claim: ellipsoid.json.

    Returns:
        For each set the bounds of its ``claimed_rows``, each with the direct effect of the noise of that sample added.
    """
    files.conform(claim, FORM, "the claim")
    own = claim["name"] == proof["name"] and claim.get(FORCES, "measured") == "measured"
    kernel.demand(own, "of another machine, or of other forces")
    of_noise = [x for x in claim["noise"] for of in proof.get("shared", {}).values() if x in of]
    kernel.demand(not of_noise, "noise in a state that the machine has too")
    known = dynamics(proof, claim, proven)
    step, push, shift, sizes, *_ = known
    result = []
    for set_ in claim["sets"]:
        # LEMMA F. In a set with any friction these truths are taken to be 0 without drift, and `friction` acts as a
        # disturbance. So a row bounds the sum with 0 in place of such a truth_i; truth_i itself, which is at most its
        # size, adds at most |c_i| times that size.
        any_friction = FRICTION in set_
        may = set_.get(FRICTION) == "any" and claim.get(FRICTION) and "after" not in set_ and not proof["signs"]
        kernel.demand(may or not any_friction, "friction")
        still = {f"{'drift' if any_friction else FRICTION}.{x}" for x in claim.get(FRICTION, {})}
        most = {x: Fraction(0) if x in still else d for x, d in sizes.items()}
        falling = [[number(b) for _, b in a["bounds"]] for a in set_.get("after", [])]
        kernel.demand(all(b == sorted(b, reverse=True) for b in falling), "a later bound of `after` is larger")
        Q = [[number(x) for x in row] for row in set_["matrix"]]
        require_invariant(Q, [*map(number, set_["weights"])], [*most.values()], step, push, proof, proven)
        columns = disturbance_columns(push, [*most.values()]) if any_friction else known.columns
        order = [*range(len(Q))] if any_friction or square(Q, known.mirror) != Q else known.mirror
        found = require_bounds(set_, Q, step, columns, shift, most, proof, order)
        own = [sizes.get(f"{FRICTION}.{e['truth']}", Fraction(0)) * any_friction for e in proof["errors"]]
        rows = (zip(row[:-1], own, strict=True) for row, *_ in claimed_rows(set_))
        more = [sum(abs(number(c)) * d for c, d in row if d) for row in rows]
        result.append([bound + x for bound, x in zip(found, more, strict=True)])
    kernel.demand(result and all(result), "it states no bound")
    for slip, speed in claim.get(ABOVE, {}).items():
        text = rounding.Bounded(proven["names"], proven["known"], proven["c"].precision, proven["rounded"])
        p = text.value(slip)
        text.require_accurate(p, text.latest[0])  # what is printed is the text
        linear = {(e["truth"],) for e in proof["errors"] if not e["sign"]} & {(v,) for v in proof["acceleration"]}
        kernel.demand(p and {*p} <= linear, "`above` of what is no slip")
        row = [Fraction(p.get((e["truth"],), 0)) for e in proof["errors"]]
        ways = zip(claim["sets"], result, strict=True)
        of_slip = [b for set_, each in ways if FRICTION not in set_
                   for (*c, _), b in zip(set_["rows"], each, strict=False) if [*map(number, c)] == row]  # fmt: skip
        kernel.demand(min(of_slip, default=number(speed) + 1) <= number(speed), "`above` is below the slip's error")
    kernel.demand(not (claim.get(ABOVE) and claim.get(REVERSALS)), "`above` excludes reversals")
    for entry in claim.get(REVERSALS, []):
        left = left_by(entry, proof, claim, proven, known)
        within = zip(left, map(number, entry["after"]), strict=True)
        kernel.demand(all(a <= b for a, b in within), "a reversal leaves more than its `after`")
    return result


class Dynamics(NamedTuple):
    """How the errors move: e[k+1] = step e[k] + push w[k].

    Attributes:
        shift: sign * shift of each error, a sum of noises.
        sizes: disturbance -> the most that it is, in the order of the columns of push.
        columns: those of noise and drift, times their sizes.
        pushed: the most that noise and drift add to each error in a sample.
        noise: the largest part of noise in each error.
        mirror: p of lemma I.
        left: cache of ``reversal.left``.
    """

    step: list[list[Fraction]]
    push: Polys
    shift: list[Any]
    sizes: dict[str, Fraction]
    columns: list[list[Fraction]]
    pushed: list[Fraction]
    noise: list[Fraction]
    mirror: list[int]
    left: dict[Any, list[Fraction]]


def dynamics(proof: dict[str, Any], claim: dict[str, Any], proven: dict[str, Any]) -> Dynamics:
    """The error dynamics that ``error_dynamics`` proves, with the sizes of the disturbances that the claim states."""
    matrix, push, shift = error_dynamics(proof, claim, proven)
    sizes = {f"{kind}.{x}": number(d) for kind in KINDS for x, d in claim.get(kind, {}).items()}  # in the order of push
    kernel.demand(min([Fraction(0), *sizes.values()]) == 0, "noise, drift or friction below 0")
    most = [Fraction(0) if x.startswith(FRICTION) else d for x, d in sizes.items()]
    step = [[x.constant() for x in row] for row in matrix]
    columns = disturbance_columns(push, most)
    pushed = [sum((abs(c[i]) for c in columns if c[i]), Fraction(0)) for i in range(len(step))]
    noise = [largest(p, sizes, proof) for p in shift]
    return Dynamics(step, push, shift, sizes, columns, pushed, noise, mirror(proof, step, columns, noise), {})


def mirror(proof: dict[str, Any], step: Any, columns: Any, noise: list[Fraction]) -> list[int]:
    """The permutation p that reverses the velocity errors and, apart, the level errors; the identity if lemma I fails.

    LEMMA I. Let p be a permutation of the errors with p = p^-1, and let it leave unchanged the matrix, the noise in
    each error, and the columns of noise and drift up to their signs and order. Then p maps every possible sequence of
    errors to a possible one. So a bound of a row c from a start e, within a set that p leaves unchanged, is also one of
    the row p c from the start p e.
    """
    kinds = [e["truth"] in proof["acceleration"] for e in proof["errors"]]
    groups = [[i for i, kind in enumerate(kinds) if kind is way] for way in (True, False)]
    of = {i: j for group in groups for i, j in zip(group, reversed(group), strict=True)}
    p, (whole, _) = [of[i] for i in range(len(kinds))], kernel.integers(columns)

    def unsigned(columns: Any) -> list[Any]:
        return sorted(max(c, [-x for x in c]) for c in columns)

    same = square(step, p) == step and ordered(noise, p) == noise
    same = same and unsigned(ordered(c, p) for c in whole) == unsigned(whole)
    return p if same else [*range(len(p))]


def ordered(row: Any, p: list[int]) -> list[Any]:
    return [row[j] for j in p]


def square(A: Any, p: list[int]) -> list[list[Any]]:
    """A matrix in the order of p."""
    return [ordered(A[i], p) for i in p]


def left_by(
    entry: dict[str, Any], proof: dict[str, Any], claim: dict[str, Any], proven: dict[str, Any], known: Dynamics
) -> list[Fraction]:
    """Bounds on each |truth - estimate| after one entry of ``reversals``; ValueError if the entry is malformed."""
    step, push, shift, sizes, *_ = known
    kernel.demand({len(entry[x]) for x in ("before", "after")} == {len(step)}, "a reversal of some of the errors alone")
    own = [i for i, e in enumerate(proof["errors"]) if e["sign"] == entry["sign"] != ""]
    kernel.demand(len(own) == 1, "a reversal of no sign that one level has")
    friction = f"{FRICTION}.{proof['errors'][own[0]]['truth']}"
    kernel.demand(friction in sizes, "a reversal of friction without a size")
    others = {x for i, p in enumerate(shift) if i != own[0] for x in p.names()}
    kernel.demand(entry["sign"] not in others, "noise in another error has the sign of a reversal")
    samples, turns = (reversal.count(entry[x], most) for x, most in reversal.MOST.items())
    column = [row[[*sizes].index(friction)] for row in push]
    turn = reversal.Reversal(
        entry["sign"], own[0], samples, turns, number(entry["change"]), number(entry["jump"]), sizes[friction], column
    )
    return reversal.left(turn, [*map(number, entry["before"])], proof, proven, known)


def require_invariant(
    Q: Any, weights: list[Fraction], sizes: list[Fraction], step: Any, push: Polys, proof: Any, proven: Any
) -> None:
    """ValueError if the ellipsoid E(1) of Q is not shown to be invariant.

    LEMMA B. Let E(r) be the ellipsoid of all e with (c'e)^2 <= r c'Qc for every c. Let b_j be the columns of push, and
    0 < f < 1, t_j > 0 weights with f + sum d_j^2/t_j <= 1 (disturbances with d_j = 0 are left out, with t_j = 0). If
    Q - Phi Q Phi'/f - sum t_j b_j b_j' is positive semidefinite, every e in E(r), r >= 1, is mapped into
    E(1 + f (r - 1)) for all |w_j| <= d_j.
    Proof: by Cauchy's inequality |c'Phi e| + sum |c'b_j| d_j is at most the root of
    (c'Phi Q Phi'c/f + sum t_j (c'b_j)^2) (r f + sum d_j^2/t_j) <= c'Qc (r f + 1 - f).
    So r decreases to 1, and E(1) is invariant. If Q is definite, every e is in some E(r). In E(1) |c'e| is at most the
    root of c'Qc.
    """
    f, *t = weights
    acting = [(d, x) for d, x in zip(sizes, t, strict=True) if d or x]
    kernel.demand(min([f, *(x for _, x in acting)]) > 0, "weights not above 0")
    kernel.demand(f < 1 and f + sum(d * d / x for d, x in acting) <= 1, "weights too small")
    (Q, by), (step, unit) = kernel.integers(Q), kernel.integers(step)
    symmetric = [*map(list, zip(*Q, strict=True))] == Q
    kernel.demand(symmetric, "a set's matrix is not symmetric")
    kernel.demand(kernel.positive(tuple(map(tuple, Q)), True), "a set's matrix is not positive definite")
    moved = forms.product(forms.product(step, Q, 0), zip(*step, strict=True), 0)
    kept, over = unit * unit * f.numerator, by * unit * unit * f.numerator
    weighted = [[kernel.term(x * over) * b if b else b for x, b in zip(t, row, strict=True)] for row in push]
    added = forms.product(weighted, zip(*push, strict=True), kernel.Poly())
    whole = [[kernel.term(kept * q - f.denominator * x) for q, x in zip(*rows, strict=True)]
             for rows in zip(Q, moved, strict=True)]  # fmt: skip
    gap = [[p - y if y else p for p, y in zip(*rows, strict=True)] for rows in zip(whole, added, strict=True)]
    kernel.semidefinite(gap, proven["box"], proof["cover"], proven["known"])  # it is times `over`


def grown(start: list[Fraction], sparse: Any, by: int, more: list[int]) -> list[tuple[int, list[int]]]:
    """Pairs (m, bounds of each error for the first m samples after ``start``, times GRID, rounded up), m rising.

    A sample later |e_i| is at most the sum of |step_ij| |e_j| and of what the disturbances add.

    Args:
        sparse, by: for each error i the pairs (j, |step_ij| * by), integers that are not 0.
        more: the most that disturbances add to each error, times GRID, rounded up.
    """
    now = [ceil(x * GRID) for x in start]
    most, found = now, [(0, now)]
    for m in range(1, 2**LEVELS):
        now = [p - (-sum([a * now[j] for j, a in row]) // by) for row, p in zip(sparse, more, strict=True)]
        most = [*map(max, most, now)]
        if m & (m + 1) == 0:
            found.append((m, most))
    return found


class Line(NamedTuple):
    """A bound that is to be shown: |c'e| <= bound at each number of ``samples``, or from the first on if not ``ends``.

    Attributes:
        start: the errors' bounds at the start, None for any.
    """

    c: tuple[str, ...]
    bound: Fraction
    samples: range
    start: tuple[str, ...] | None
    ends: bool


def require_bounds(
    set_: dict[str, Any],
    Q: Any,
    step: Any,
    columns: Any,
    shift: list[Any],
    most: dict[str, Fraction],
    proof: Any,
    p: list[int],
) -> list[Fraction]:
    """The bounds of the rows of one invariant set, including the noise of the same sample; ValueError if not proved.

    LEMMA E. Let r >= 1 and r Q - n diag(s_i^2) be positive semidefinite for n errors (`within` is r, s_1, ..., s_n). If
    every |e_i[0]| <= s_i, then e[0] is in E(r), since (c'e)^2 <= n sum (c_i s_i)^2 by Cauchy's inequality, and e stays
    in it by lemma B. So lemma D holds with r Q in place of Q, and two ways show a bound of `after` from its n on: for
    every N >= n by lemma D from the sample N - n, which is in E(r); or by the s_i, sample by sample until the n of the
    next bound, which is not larger. In the m samples after the start the errors are within larger s_i (``grown``): what
    lemma D shows of these at a sample N holds at N, N + 1, ..., N + m, each time counted from a later sample.
    """
    r, *within = map(number, set_.get("within", ["1"]))
    (limits,), over = kernel.integers([[len(Q) * s * s for s in within] or [Fraction(0)] * len(Q)])
    squares, by = kernel.integers(Q)
    inside = (tuple(r.numerator * over * x - (r.denominator * by * limit if i == j else 0) for j, x in enumerate(row))
              for i, (row, limit) in enumerate(zip(squares, limits, strict=True)))  # fmt: skip
    within_set = r >= 1 and kernel.positive(tuple(inside))
    kernel.demand(within_set, "the box of `within` is not inside the set: not positive semidefinite")
    lines: list[Line] = []
    last: dict[tuple[str, ...], int] = {}  # row c -> the last sample at which it is asked for
    asked: set[int] = set()
    for row, count, start, end in claimed_rows(set_):
        for text in (count, end or "0"):
            good = re.fullmatch("0|[1-9][0-9]{0,6}", str(text))
            kernel.demand(good, f"{str(text)[:20]!r} is not a number of samples")
            kernel.demand(int(text) <= MOST_SAMPLES, "too many samples")
        *c, bound = row
        kernel.demand({len(c), len(start or c)} == {len(Q)}, "no row of every error")
        kernel.demand(any(map(number, c)), "a bound of 0 times every error")
        samples = range(int(count), int(end) if end else int(count) + 1)
        kernel.demand(samples, "the samples of `after` do not rise")
        lines.append(Line(tuple(c), number(bound), samples, None if start is None else tuple(start), bool(end)))
    apart: dict[Line, None] = {}  # by lemma I, one of two that p maps to each other is enough
    for line in lines:
        image = line._replace(c=tuple(ordered(line.c, p)), start=line.start and tuple(ordered(line.start, p)))
        apart |= {} if image in apart else {line: None}
    for line in apart:
        last[line.c] = max(last.get(line.c, 0), line.samples[-1])
        asked.update(line.samples)
        kernel.demand(len(last) * len(asked) * len(Q) <= MOST_ENTRIES, "too many rows at too many samples")
    kernel.demand(len(last) <= MOST_ROWS, "too many rows")
    noise = [largest(p, most, proof) for p in shift]
    entering, unit = kernel.integers(columns)
    whole_step, denominator = kernel.integers(step)
    sparse = [[(j, abs(a)) for j, a in enumerate(row) if a] for row in whole_step]
    more = [-(-sum(abs(c[i]) for c in entering) * GRID // unit) for i in range(len(Q))]
    starts: dict[Any, list[tuple[int, list[int]]]] = {}
    for begun in {line.start for line in apart if line.start is not None}:
        whole = [number(s) + x for s, x in zip(begun, noise, strict=True)]  # with the noise of that sample
        within_box = min(map(number, begun)) >= 0 and all(s <= x for s, x in zip(whole, within, strict=True))
        kernel.demand(within_box, "`start` is not inside the box of `within`")
        starts[begun] = grown(whole, sparse, denominator, more)
    for samples_ in sorted({*last.values()}):  # rows that are asked for equally long are carried together
        alike = [line for line in apart if last[line.c] == samples_]
        require_carried(alike, samples_, Q, r, step, entering, unit, starts)
    bounds = []
    for line in lines:
        weighted = zip(map(number, line.c), shift, strict=True)
        direct = sum((kernel.term(a) * d for a, d in weighted if a), kernel.Poly())
        bounds.append(line.bound + largest(direct, most, proof))
    return bounds


def require_carried(
    lines: list[Line], last: int, Q: Any, r: Fraction, step: Any, entering: Any, unit: int, starts: dict[Any, Any]
) -> None:
    """ValueError if one of these lines is not shown by lemmas D and E.

    Args:
        last: the last sample at which a row is asked for. starts: a line's start -> what ``grown`` says of it.
    """
    rows, (squares, by) = {c: k for k, c in enumerate({line.c: None for line in lines})}, kernel.integers(Q)
    due: dict[int, list[tuple[Line, int, int]]] = {}  # samples -> lines of which all is shown before, not there
    for line in lines:  # each with the place of its row, and the place in its start from which on it was shown last
        due.setdefault(line.samples.start, []).append((line, rows[line.c], 0))

    def rows_due(n: int) -> set[int]:
        return {row for _, row, _ in due.get(n, ())}

    larger = [r * row[i] for i, row in enumerate(Q)]
    of_rows = [tuple(map(number, c)) for c in rows]
    for n, moved in propagated(of_rows, rows_due, last, step, entering, unit, larger):
        for line, row, level in due.pop(n):
            (entries, summed), (a, b) = moved[row], line.bound.as_integer_ratio()
            scale = b * unit * GRID
            gap = a * unit * GRID - b * summed  # what the bound leaves to the row of e, times scale
            if n == line.samples.start:
                square = sum(x * sum(map(mul, q, entries)) for x, q in zip(entries, squares, strict=True))
                square *= 1 if line.start is None else r
                if gap >= 0 and square * scale**2 <= gap**2 * by * GRID**2:
                    continue
                kernel.demand(line.ends, "a bound of the claim is smaller than the proved one")
            magnitudes, sizes = [*map(abs, entries)], starts[line.start]
            most_, k = gap * GRID * GRID // scale, min(level + 1, len(sizes) - 1)
            while k >= 0 and sum(map(mul, magnitudes, sizes[k][1])) > most_:
                k -= 1
            kernel.demand(k >= 0, "a bound of the claim is smaller than the proved one")
            later = n + sizes[k][0] + 1
            if later in line.samples:
                due.setdefault(later, []).append((line, row, k))
