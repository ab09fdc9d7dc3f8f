"""Whether a certificate speaks of the code beside it: the generated Python twin, replayed in rationals.

Standard library only; part of the checker (verify.py). Two samples in a row are replayed from a random state (twin.py);
the derivative of the estimates along a random direction must move as `matrix` says, exactly. The points are drawn from
the certificate's own text.
"""

import copy
import random
import re
import runpy
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import reduce
from itertools import islice
from operator import sub
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from codegen.checker import twin as reader
else:
    reader = SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("twin.py"))))
Dual = reader.Dual
Twin = reader.Twin
Unknown = reader.Unknown
PLACE = re.compile(r"(inputs|outputs|parameters)\.(\w+)(?:\[(\d+)\])?")
ALIKE, TRIES = 3, 400


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
    if op in ("neg", "/", "^"):
        return -args[0] if op == "neg" else args[0] / args[1] if op == "/" else args[0] ** int(args[1])
    return reader.function(op, args[0])[0]


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


def scatter(record: dict[str, Any], names: list[str], dice: random.Random, moved: bool) -> None:
    """Random numbers for these fields, and a random direction if the states are to be moved along it."""

    def drawn() -> Dual:
        size = Fraction(dice.choice((1, 1, 1, 10, 1000)))
        return Fraction(dice.randrange(-9000, 9000), 1000) / size, Fraction(dice.randrange(-99, 99)) * moved

    for name in names:
        record[name] = [drawn() for _ in record[name]] if isinstance(record[name], list) else drawn()


def three_samples(
    top: Mapping[str, Any], twin: Twin, parameters: dict[str, Any], dice: random.Random, nudge: bool
) -> list[Any]:
    """Inputs, outputs and signs of three samples from a random state, the positions moving as their velocities say.

    The direction of the derivatives is one of the states, or with ``nudge`` of the positions of the second sample; what
    is no position among the inputs is then the same whenever this is called.
    """
    state, inputs, seen = twin.record("State"), twin.record("Inputs"), []
    scatter(state, [name for name in state if name.startswith("z_")], dice, moved=not nudge)
    scatter(inputs, [*inputs], dice, moved=False)
    if nudge:
        positions = {place(position)[1] for position in top["code"]["motion"]}
        scatter(inputs, [name for name in inputs if name not in positions], random.Random(0), moved=False)
    for k in range(3):
        outputs = twin.record("Outputs")
        twin.run("step", state=state, parameters=parameters, inputs=inputs, outputs=outputs)
        now = {"inputs": inputs, "outputs": outputs}
        seen.append(({"inputs": copy.deepcopy(inputs), "outputs": outputs}, twin.signs))
        for position, velocity in top["code"]["motion"].items():
            slope = Fraction(dice.randrange(-99, 99)) if nudge and k == 0 else reader.ZERO
            new = read(position, now)[0] + top["sample_time"] * read(velocity, now)[0], slope
            _, name, at = place(position)
            if at is None:
                inputs[name] = new
            else:
                inputs[name][at] = new
    return seen


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
        elif isinstance(raw, list) and len(raw) == 3 and raw[0] == "/" and raw[2] == ["abs", raw[1]]:
            ends = Fraction(-1), Fraction(1)  # a sign
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
        Unlike: where the twin has another sample time.
        Unknown: where the twin or the certificate does not show the error, or no more such samples are found.
    """
    code = top["code"]
    if not twin.records:
        raise Unknown("there is no twin")
    if len(code["errors"]) != len(top["error"]):
        raise Unknown("the certificate does not say where the twin shows the error")
    if missing := sorted(top["variables"].keys() - code["variables"].keys()):
        raise Unknown(f"it does not say where the twin shows {missing[0]}")
    dice, parameters = random.Random(repr(sorted(top.items()))), twin.record("Parameters")
    twin.run("prepare", parameters=parameters)
    if read("parameters.sample_time", {"parameters": parameters})[0] != top["sample_time"]:
        raise Unlike("the twin has another sample time")
    fast = parameters.get("slip_speed", (reader.ZERO,))[0]  # a guarded level is learnt above it alone
    for _ in range(TRIES):
        seen = three_samples(top, twin, parameters, dice, nudge)
        slow = fast and any(abs(read(code["errors"][0], now)[0]) <= fast for now, _ in seen)
        if slow or seen[1][1] != seen[2][1]:
            continue  # a sign turned; and the first sample is where a guard learns it
        yield seen[1][0], seen[2][0]
    raise Unknown("in no two samples in a row all signs stayed")


def replayed(top: Mapping[str, Any], twin: Twin) -> str:
    """The fact that the twin moves its error by the certificate's matrix, at points drawn at random.

    Raises:
        Unlike: where it does not.
        Unknown: where the twin or the certificate does not show it.
    """
    if not all(moves_as_certified(top, before, after) for before, after in islice(alike(top, twin), ALIKE)):
        raise Unlike("`matrix` is not how the twin moves its error")
    return f"replayed in rationals at {ALIKE} points drawn at random, the twin moves its error by `matrix`"
