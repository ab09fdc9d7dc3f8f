"""Whether a certificate speaks of the code beside it: the generated Python twin, replayed in rationals.

Standard library only; part of the checker (verify.py). Two samples in a row are replayed from a random state
(twin.py); the derivative of the estimates along a random direction must move as `matrix` says, exactly. The points
lie inside the envelope, and none who writes a certificate knows them: they are drawn anew at each run. Between
reversals a twin is one formula (subset.py), and where its signs turn must not depend on how fast a slip is: so what
holds at points of every size holds between reversals.
"""

import ast
import copy
import random
import re
import runpy
from collections.abc import Callable, Collection, Iterator, Mapping
from fractions import Fraction
from functools import reduce
from operator import sub
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import subset
    from codegen.checker import twin as reader
else:
    subset, reader = (
        SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name(name)))) for name in ("subset.py", "twin.py")
    )
Dual = reader.Dual
Twin = reader.Twin
Unknown = reader.Unknown
PLACE = re.compile(r"(inputs|outputs|parameters)\.(\w+)(?:\[(\d+)\])?")
ALIKE, TRIES = 3, 400
PATTERNS, AGAIN = 16, 8  # combinations of signs that are waited for; points, for each met and one, that bring no other
SLIPS = (Fraction(1), Fraction(1, 8), Fraction(1, 64))  # sizes of the velocities, times their range in the envelope
FORCES = (Fraction(1), Fraction(1, 10**2), Fraction(1, 10**4), Fraction(10), Fraction(1, 10**6))  # of all else
SPEEDS = (Fraction(1, 2**7), Fraction(1, 2**14), Fraction(1, 2**24), Fraction(2**7), Fraction(2**20))
SECRET = reader.SECRET
DICE = random.Random(f"{SECRET} sizes")
SIZES = tuple(
    s * Fraction(DICE.randrange(1000, 9999), 10**4) * Fraction(8) ** k for k in range(-5, 10) for s in (1, -1)
)
PLAIN_UNIT = re.compile(r"[A-Za-z0-9*/^ ().-]*")
MODE_FIELDS = ("mode", "invalid_samples")
MAX_POWER, MANY_BITS = 64, 10**6
HELD = re.compile(r"direction_\w+|samples_slid|\w+_predicted")  # states that are no estimate's


class Unlike(Exception):
    """The certificate is not about this code; the message says where they differ."""


def value(raw: Any, names: Callable[[str], Fraction]) -> Fraction:
    """An expression of the certificate."""
    if isinstance(raw, str):
        return Fraction(raw) if re.fullmatch(r"-?\d+(/\d+)?", raw) else names(raw)
    op, args = raw[0], [value(item, names) for item in raw[1:]]
    if op in ("+", "*"):
        total = args[0]
        for x in args[1:]:
            total = total + x if op == "+" else total * x
        return total
    if op == "^" and not (args[1] in range(MAX_POWER + 1) and bits(args[0]) * args[1] <= MANY_BITS):
        raise Unlike(f"a power whose exponent is not 0 to {MAX_POWER}, or of too large a number")
    if op in ("neg", "/", "^"):
        return -args[0] if op == "neg" else args[0] / args[1] if op == "/" else args[0] ** int(args[1])
    return reader.function(op, args[0])[0]


def bits(x: Fraction) -> int:
    return max(x.numerator.bit_length(), x.denominator.bit_length())


def place(text: str) -> tuple[str, str, int | None]:
    """(record, field, index or None) of inputs.x or outputs.v_hat[3]."""
    found = PLACE.fullmatch(text)
    if found is None:
        raise Unknown(f"{text} is no place in the twin")
    return found[1], found[2], None if found[3] is None else int(found[3])


def read(text: str, records: Mapping[str, Any]) -> Dual:
    record, name, at = place(text)
    if name not in records[record]:
        raise Unlike(f"the twin has no {text}")
    found: Dual = records[record][name] if at is None else records[record][name][at]
    return found


def estimate(raw: Any, records: Mapping[str, Any]) -> Dual:
    """An estimate, or ["*", a sign, an estimate]: signs do not change in what is compared."""
    if isinstance(raw, list) and raw[0] == "*":
        sign, (now, slope) = value(raw[1], lambda text: read(text, records)[0]), read(raw[2], records)
        return sign * now, sign * slope
    return read(raw, records)


def plain_name(text: str) -> str:
    """What a place shows, in the spec's names: outputs.v_hat[2] -> v3, outputs.a_hat_rail -> a_rail."""
    _, field, at = place(text)
    field = field.removesuffix("_hat")
    for shown, name in (("a_hat_", "a_"), ("f_hat_", "f_"), ("tracked_", "F_")):
        field = name + field.removeprefix(shown) if field.startswith(shown) else field
    return field if at is None else f"{field}{at + 1}"


def a_sign(raw: Any) -> bool:
    """Whether an expression is x/|x|."""
    return isinstance(raw, list) and len(raw) == 3 and raw[0] == "/" and raw[2] == ["abs", raw[1]]


def estimates(top: Mapping[str, Any], twin: Twin) -> list[str]:
    """The place of the estimate of each error.

    Raises:
        Unlike: where it is not that of an error of this name and unit, or appears twice.
    """
    found = []
    for error, raw in zip(top["error"], top["code"]["errors"], strict=True):
        turned = isinstance(raw, list) and len(raw) == 3 and raw[0] == "*" and a_sign(raw[1])
        text = raw[2] if turned else raw
        if not isinstance(text, str) or not text.startswith("outputs."):
            raise Unlike(f"code: {error['name']} is not the lag of an output, or of one times the sign of a slip")
        if f"e_{plain_name(text)}" != error["name"]:
            raise Unlike(f"code: {text} is not the estimate of which {error['name']} is the lag")
        unit = twin.unit(place(text)[1])
        if unit != error["unit"]:
            raise Unlike(f"{error['name']} is stated in {error['unit']}, and the code shows it in {unit}")
        found.append(text)
    if len({*found}) < len(found):
        raise Unlike("code: an output stands for two errors")
    return found


def is_velocity(text: str) -> bool:
    return place(text)[1].endswith("_hat")


def slots(state: Mapping[str, Any], names: Collection[str]) -> list[tuple[str, int | None]]:
    """Every number of these states, in order."""
    return [(n, k) for n in names for k in (range(len(state[n])) if isinstance(state[n], list) else [None])]


def held(record: Mapping[str, Any], at: tuple[str, int | None]) -> Dual:
    found: Dual = record[at[0]] if at[1] is None else record[at[0]][at[1]]
    return found


def scale(record: dict[str, Any], places: Collection[tuple[str, int | None]], size: Fraction) -> None:
    """Make values larger or smaller, or of the size where they are 0, and leave their derivatives."""
    for at in places:
        now, slope = held(record, at)
        put(record, at, (size * (now or 1), slope))


def put(record: dict[str, Any], at: tuple[str, int | None], new: Dual) -> None:
    name, index = at
    if index is None:
        record[name] = new
    else:
        record[name][index] = new


def drawn(dice: random.Random, ends: tuple[Fraction, Fraction] | None, size: Fraction) -> Fraction:
    """A number inside a range, of this size against its ends where zero is in it; without a range of up to 9 ``size``.

    None is below a tenth of the size: what is near zero turns in a sample, and of those points there are enough.
    """
    low, high = ends or (Fraction(-9), Fraction(9))
    share = Fraction(dice.randrange(1000, 9999), 10000)
    if low > 0 or high < 0:
        return low + (high - low) * share
    return dice.choice((low, high)) * share * (size if ends is None else min(size, Fraction(1)))


class Start:
    """State and inputs before the first of the samples that are replayed.

    Attributes:
        slots: the states, in the order of the errors.
        velocities: index of an error -> the estimate that is put to a number, of the velocities among them.
        ranged: place -> its range in the envelope, of positions and velocities.
    """

    def __init__(self, top: Mapping[str, Any], twin: Twin, parameters: dict[str, Any]) -> None:
        self.top, self.twin, self.parameters = top, twin, parameters
        self.places = estimates(top, twin)
        self.blank = twin.record("State")
        self.slots = slots(self.blank, [name for name in self.blank if name.startswith("z_")])
        if len(self.slots) != len(self.places):
            raise Unlike(f"the code has {len(self.slots)} states, and the certificate {len(self.places)} errors")
        guarded = "slip_speed" in parameters  # the observer then holds what says where its level is learnt
        self.others = [name for name in self.blank if not name.startswith("z_") and name not in MODE_FIELDS]
        self.others = [name for name in self.others if not (guarded and HELD.fullmatch(name))]
        self.velocities = {k: text for k, text in enumerate(self.places) if is_velocity(text)}
        ends = {name: (Fraction(low), Fraction(high)) for name, (low, high) in twin.envelope.items()}
        shown = {*self.velocities.values(), *(p for pair in top["code"]["motion"].items() for p in pair)}
        self.ranged = {text: ends[plain_name(text)] for text in sorted(shown) if plain_name(text) in ends}
        self.by_name = ends

    def draw(self, dice: random.Random, slip: Fraction, force: Fraction, nudge: bool) -> tuple[Any, Any]:
        """(state, inputs) with velocities of this size and all else of that; a random direction among the states."""
        state, inputs = self.twin.record("State"), self.twin.record("Inputs")
        moving = {place(text)[1:] for text in self.top["code"]["motion"].values() if text.startswith("inputs.")}
        steered = {place(text)[1:] for text in self.top["code"]["motion"]}
        fixed = random.Random(f"{SECRET} inputs")
        for name, value in inputs.items():
            for k in range(len(value)) if isinstance(value, list) else [None]:
                ends = self.by_name.get(name if k is None else f"{name}{k + 1}")
                if (name, k) in moving:
                    new = drawn(dice, ends, slip)
                elif (name, k) in steered:
                    new = drawn(dice, ends, force)
                else:
                    new = drawn(fixed if nudge else dice, ends, Fraction(1) if nudge else force)
                put(inputs, (name, k), (new, reader.ZERO))
        for slot in self.slots:
            slope = reader.ZERO if nudge else Fraction(dice.randrange(1, 9999) * dice.choice((-1, 1)))
            put(state, slot, (drawn(dice, None, force), slope))
        wanted = {k: drawn(dice, self.ranged.get(text), slip) for k, text in self.velocities.items()}
        self.steer(state, inputs, wanted)
        return state, inputs

    def sample(self, state: Any, inputs: Any) -> dict[str, Any]:
        """One step on the records themselves: {"inputs", "outputs"}."""
        outputs = self.twin.record("Outputs")
        self.twin.run("step", state=state, parameters=self.parameters, inputs=inputs, outputs=outputs)
        return {"inputs": inputs, "outputs": outputs}

    def steer(self, state: Any, inputs: Any, wanted: Mapping[int, Fraction]) -> None:
        """Set the states so that these estimates are shown."""
        now = self.sample(copy.deepcopy(state), inputs)
        for k, x in wanted.items():
            name, at = self.slots[k]
            value, slope = state[name] if at is None else state[name][at]
            put(state, self.slots[k], (value + x - read(self.places[k], now)[0], slope))

    def within(self, now: Mapping[str, Any]) -> bool:
        """Whether positions and velocities are inside the envelope."""
        return all(low <= read(text, now)[0] <= high for text, (low, high) in self.ranged.items())

    def require_cover(self, state: Any, inputs: Any) -> None:
        """Every state is seen in an error: a velocity moves by its own state alone, what else there is so besides.

        Raises:
            Unlike: where that is not so, for a state of which nothing is then claimed.
        """
        state = copy.deepcopy(state)
        dice = random.Random(f"{SECRET} cover")
        for k, (name, at) in enumerate(self.slots):
            value = state[name] if at is None else state[name][at]
            put(state, self.slots[k], (value[0], Fraction(dice.randrange(1, 9999)) * (k not in self.velocities)))
        moved = {slot: (state[slot[0]] if slot[1] is None else state[slot[0]][slot[1]])[1] for slot in self.slots}
        now = self.sample(state, inputs)
        for k, text in enumerate(self.places):
            if read(text, now)[1] != moved[self.slots[k]]:
                raise Unlike(f"the code's state {self.slots[k][0]} is not what {text} shows")
        for name, value in state.items():
            if name.startswith("direction_") and value not in [(Fraction(x), reader.ZERO) for x in (-1, 0, 1)]:
                raise Unlike(f"the code's state {name} is no direction")

    def require_inputs_alone(self, state: Any, inputs: Any) -> None:
        """What else the code keeps (time, a delayed or lagged input) does not see the estimates, and never grows.

        So it is the same in every run on the same inputs, or comes no further from it: the rows of the derivatives of
        these states after a sample, by these states before, have absolute sums of at most 1.

        Raises:
            Unlike: where that is not so, for a state of which nothing is then claimed.
        """
        places = slots(state, self.others)
        for size in SIZES if places else ():
            rows = dict.fromkeys(places, reader.ZERO)
            for moved in [None, *places]:
                again, other = copy.deepcopy((state, inputs))
                scale(other, slots(other, other), size)
                scale(again, places, size)
                for slot in [*self.slots, *places]:
                    now, slope = held(again, slot)
                    put(again, slot, (now, slope if moved is None else Fraction(slot == moved)))
                self.sample(again, other)
                for slot in places:
                    slope = held(again, slot)[1]
                    rows[slot] += abs(slope) if moved else 2 * (slope != 0)
            if growing := [name for (name, _), total in rows.items() if total > 1]:
                raise Unlike(f"the code's state {growing[0]} is covered by no error")

    def require_variables_alone(self, state: Any, inputs: Any) -> None:
        """How an error moves is the same whatever is no variable: inputs, positions and levels of any size.

        Raises:
            Unlike: where it is not, so that the code has another law for large ones or small ones.
        """
        if "slip_speed" in self.parameters:
            return  # the estimates of its levels are clamped
        first = copy.deepcopy(state)
        base = self.sample(first, inputs)
        seen = [self.variables(base), [held(first, slot)[1] for slot in self.slots]]
        kept = {place(text)[1:] for text in (*self.ranged, *self.top["code"]["motion"].values())}
        speeds = {k: read(text, base)[0] for k, text in self.velocities.items()}
        for size in SIZES:
            again, other = copy.deepcopy((state, inputs))
            scale(other, [slot for slot in slots(other, other) if slot not in kept], size)
            scale(again, [slot for k, slot in enumerate(self.slots) if k not in self.velocities], size)
            self.steer(again, other, speeds)
            now = self.sample(again, other)
            moved = [held(again, slot)[1] for slot in self.slots]
            if self.variables(now) == seen[0] and moved != seen[1]:
                raise Unlike("the twin moves its error otherwise where what is no variable is larger or smaller")

    def variables(self, now: Mapping[str, Any]) -> list[Fraction]:
        return [value(raw, lambda text: read(text, now)[0]) for raw in self.top["code"]["variables"].values()]

    def require_one_law(self, state: Any, inputs: Any) -> None:
        """No sign in the code turns where all velocities are made smaller or larger together.

        Raises:
            Unlike: where one does, so that the code has another law for slow slips than for fast ones.
        """
        if "slip_speed" in self.parameters:
            return  # the certificate is about what is faster
        base = self.sample(copy.deepcopy(state), inputs)
        signs, speeds = self.twin.signs, {k: read(text, base)[0] for k, text in self.velocities.items()}
        measured = [p for p in self.top["code"]["motion"].values() if p.startswith("inputs.")]
        for speed in SPEEDS:
            again, other = copy.deepcopy((state, inputs))
            for text in measured:
                put(other, place(text)[1:], (read(text, base)[0] * speed, reader.ZERO))
            for k, v in speeds.items():
                name, at = self.slots[k]
                value, slope = again[name] if at is None else again[name][at]
                put(again, self.slots[k], (value + (speed - 1) * v, slope))
            shown = self.sample(again, other)
            for k, v in speeds.items():
                if read(self.places[k], shown)[0] != speed * v:
                    raise Unlike(f"{self.places[k]} does not follow its state")
            if self.twin.signs != signs:
                raise Unlike("the twin has another law for slow slips than for fast ones")


def three_samples(start: Start, dice: random.Random, slip: Fraction, force: Fraction, nudge: bool) -> list[Any]:
    """Inputs, outputs and signs of three samples from a random state, the positions moving as their velocities say.

    The direction of the derivatives is one of the states, or with ``nudge`` of the positions of the second sample; what
    is no position among the inputs is then the same whenever this is called. Behind them the state before the first.
    """
    top, seen = start.top, []
    state, inputs = start.draw(dice, slip, force, nudge)
    first = copy.deepcopy((state, inputs))
    for k in range(3):
        now = start.sample(state, inputs)
        seen.append(({"inputs": copy.deepcopy(inputs), "outputs": now["outputs"]}, start.twin.signs))
        for position, velocity in top["code"]["motion"].items():
            slope = Fraction(dice.randrange(-99, 99)) if nudge and k == 0 else reader.ZERO
            new = read(position, now)[0] + top["sample_time"] * read(velocity, now)[0], slope
            put(inputs, place(position)[1:], new)
    return [*seen, first]


def moves_as_certified(top: Mapping[str, Any], before: Mapping[str, Any], after: Mapping[str, Any]) -> bool:
    """Whether the error of one sample is the certificate's matrix times that of the sample before."""
    code, h = top["code"], top["sample_time"]
    at = {v: value(e, lambda text: read(text, before)[0]) for v, e in code["variables"].items()}
    theta = {p["name"]: value(p["expression"], at.__getitem__) for p in top["parameters"]}
    A = [[value(entry, theta.__getitem__) for entry in row] for row in top["matrix"]]
    old, new = ([estimate(raw, records)[1] for raw in code["errors"]] for records in (before, after))
    implicit = top["observer"]["integration"] == "implicit"
    change = [h * sum(a * e for a, e in zip(row, new if implicit else old, strict=True)) for row in A]
    return any(old) and all(y == x + d for x, y, d in zip(old, new, change, strict=True))


def envelope(top: Mapping[str, Any], twin: Twin) -> list[str]:
    """The variables without a range in the twin's ENVELOPE; the others' a proof covers, and a point lies in them.

    Raises:
        Unlike: where that is not so.
    """
    given, left, shown = twin.envelope, [], top["code"]["variables"]
    for slow in top["slow"]:
        if twin.records and top["code"]["motion"].get(shown.get(slow["variable"])) != shown.get(slow["velocity"]):
            raise Unlike(f"slow: {slow['velocity']} is not what moves {slow['variable']} in `code`")
        velocity, strays = slow["velocity"], slow["stray"]
        width, rates = -reduce(sub, top["variables"].get(velocity, [0, 0])), given.get(f"{velocity}_dot")
        if rates is None and strays < width:
            left.append(f"how far {velocity} strays within a sample with the spec's accelerations")
        elif strays < min(width, top["sample_time"] * max(abs(Fraction(x)) for x in rates or ["0"]) / 2):
            raise Unlike(f"slow: with the code's {velocity}_dot, {velocity} may stray further")
    for name, (low, high) in ((name, stated) for name, stated in top["variables"].items() if len(stated) == 2):
        raw = shown.get(name)
        if name in given:
            ends = tuple(map(Fraction, given[name]))
            if raw is not None and not (isinstance(raw, str) and PLACE.fullmatch(raw) and plain_name(raw) == name):
                raise Unlike(f"code: {name} has the range of the code's own {name}, and is not shown as that")
        elif a_sign(raw):
            ends = Fraction(-1), Fraction(1)
        else:
            left.append(f"the range of {name} with the spec's")
            continue
        inside = ends[0] <= low and high <= ends[1]
        if not (inside if top["along"] else low <= ends[0] and ends[1] <= high):
            raise Unlike(f"{name}: the envelope of the code is [{ends[0]}, {ends[1]}], not [{low}, {high}]")
    return left


def alike(top: Mapping[str, Any], twin: Twin, nudge: bool = False) -> Iterator[tuple[Any, Any]]:
    """Two samples in a row of the same signs, at points drawn at random; the derivatives as in ``three_samples``.

    Raises:
        Unlike: where the twin has another sample time, or states and branches of which nothing is claimed.
        Unknown: where the twin or the certificate does not show the error, or no more such samples are found.
    """
    code = top["code"]
    if not twin.records:
        raise Unknown("there is no twin")
    try:
        subset.require_twin(ast.parse(twin.source))
    except subset.Foreign as why:
        raise Unlike(f"code, or the twin, cannot be read as one: {why}") from None
    if not code["errors"]:
        raise Unknown("the certificate does not say where the twin shows the error")
    if len(code["errors"]) != len(top["error"]):
        raise Unlike("the certificate does not say where the twin shows every error")
    if missing := sorted(top["variables"].keys() - code["variables"].keys()):
        raise Unknown(f"it does not say where the twin shows {missing[0]}")
    dice, parameters = random.Random(f"{SECRET} {twin.source}"), twin.record("Parameters")
    twin.run("prepare", parameters=parameters)
    if read("parameters.sample_time", {"parameters": parameters})[0] != top["sample_time"]:
        raise Unlike("the twin has another sample time")
    fast = parameters.get("slip_speed", (reader.ZERO,))[0]  # a guarded level is learnt above it alone
    start, found = Start(top, twin, parameters), 0
    for k in range(TRIES):
        # The size asked for of each point in turn; where its signs turn again and again, of any.
        slip = SLIPS[(found if k % 40 < 30 and not fast else k) % len(SLIPS)] * (1 if start.ranged or not nudge else 8)
        *seen, first = three_samples(start, dice, slip, FORCES[k % len(FORCES)], nudge)
        if not nudge and k == 0:
            start.require_one_law(*first)
        slow = fast and any(abs(read(code["errors"][0], now)[0]) <= fast for now, _ in seen)
        if slow or seen[1][1] != seen[2][1]:
            continue  # a sign turned; and the first sample is where a guard learns it
        if not nudge and not all(start.within(now) for now, _ in seen):
            continue
        if not nudge and not found:
            start.require_cover(*first)
            start.require_inputs_alone(*first)
            start.require_variables_alone(*first)
        found += 1
        twin.signs = seen[2][1]
        yield seen[1][0], seen[2][0]
    if found < ALIKE:
        raise Unknown("in no two samples in a row all signs stayed")


def replayed(top: Mapping[str, Any], twin: Twin) -> tuple[str, list[str]]:
    """The fact that the twin moves its error by the certificate's matrix, at points drawn at random; what is left out.

    A step is another formula for each combination of its signs, so points are drawn until no other has turned up.

    Raises:
        Unlike: where it does not.
        Unknown: where the twin or the certificate does not show it.
    """
    first_at: dict[tuple[Fraction, ...], int] = {}
    for k, (before, after) in enumerate(alike(top, twin)):
        if not moves_as_certified(top, before, after):
            raise Unlike("`matrix` is not how the twin moves its error")
        first_at.setdefault(tuple(twin.signs), k)
        quiet = k - max(first_at.values())
        if k >= ALIKE and (len(first_at) > PATTERNS or quiet >= AGAIN * (len(first_at) + 1)):
            break
    many = [f"how the error moves under all combinations of signs: {PATTERNS} were met"]
    fact = "replayed in rationals at points drawn at random, the twin moves its error by `matrix` for all signs met"
    return fact, many * (len(first_at) > PATTERNS)


def guarded(twin: Twin) -> list[str]:
    """What a guard of the level keeps from being compared, in words; nothing where there is none."""
    limit = twin.record("Parameters").get("slip_speed")
    kept = [name for name in twin.record("State") if HELD.fullmatch(name)]
    named = f", nor {', '.join(kept)}, by which it knows its domain" if kept else ""
    return (
        []
        if limit is None
        else [f"slips slower than slip_speed {float(limit[0]):g}, where a guard holds the level{named}"]
    )
