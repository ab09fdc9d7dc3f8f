"""Names of a log's columns: usual words in them, and proposals of columns for variables that a log does not name.

A column is proposed by its name, its unit, usual names of a quantity, numbers in the names, or since no other is left.
A proposal is only shown in a message; no column is read because of it.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codegen.base.errors import Place, nearest_name
from codegen.base.user_text import brief, foreign_letter
from codegen.spec.column_units import may_be_unit, stated_unit, unit_behind
from codegen.spec.model import Spec
from codegen.spec.units import is_unit, same_dimension, si_factor

QUANTITIES: Mapping[str, frozenset[str]] = {
    "time": frozenset({"time", "t", "stamp", "timestamp"}),
    "position": frozenset({"position", "positions", "pos", "lage"}),
    "length": frozenset({"x", "displacement", "way", "stroke", "weg"}),
    "angle": frozenset({"q", "qpos", "angle", "theta", "phi", "winkel"}),
    "velocity": frozenset({"velocity", "velocities", "vel", "qd", "dq", "qvel", "speed", "v"}),
    "force": frozenset({"force", "thrust", "w", "kraft"}),
    "torque": frozenset({"torque", "torques", "trq", "tau", "moment", "drehmoment"}),
    "effort": frozenset({"effort", "efforts"}),
    "current": frozenset({"current", "currents", "cur", "amps", "iq", "i", "strom"}),
    "voltage": frozenset({"voltage", "volts", "volt", "u", "spannung"}),
}
"""Quantity → usual words of columns of it. A position may be a length or an angle, an effort a force or a torque."""
_OF_UNIT = {
    "s": ("time",),
    "m": ("position", "length"),
    "rad": ("position", "angle"),
    "A": ("current",),
    "V": ("voltage",),
    "N": ("force",),
    "N*m": ("torque", "effort"),
}
"""Unit of a variable → the quantities that its columns are usually called by."""
COMMANDED = frozenset(
    {
        *("command", "commands", "cmd", "desired", "target", "reference", "ref"),
        *("setpoint", "goal", "action", "soll", "sollwert"),
    }
)
"""Words of a column's name that say that it holds a command, and no measured position."""
SUPPLY = frozenset({"supply", "bus", "vbus", "battery", "batt", "vin", "dc", "mains", "input"})
"""Words of a column's name that say that its voltage or current is that of the drive's supply."""
NO_SIGNAL = frozenset({"error", "err", "deviation", "limit", "enable", "enabled"})
"""Words of a column's name that say that it holds no measured quantity."""
COUNTED = frozenset({"sample", "samples", "index", "idx", "row", "line", "nr", "no", "number", "n", "k", "count", "id"})
"""Words of the name of a column of row numbers, which is no time."""
COUNTS = frozenset({"counts", "count", "cnts", "cnt", "ticks", "tick", "increments", "incs", "inc", "pulses", "lsb"})
"""Words of a column's name that say that it holds the raw counts of a sensor."""


def words_for(*quantities: str) -> frozenset[str]:
    """Usual words of columns of any of these quantities."""
    return frozenset().union(*(QUANTITIES[quantity] for quantity in quantities))


@dataclass(frozen=True)
class Proposed:
    """A proposed column for a variable, the unit to be stated in meta.yaml (empty for none), and why, in words."""

    symbol: str
    column: str
    unit: str
    why: str


def proposed_columns(symbols: Sequence[str], units: Mapping[str, str], spec: Spec) -> tuple[Proposed, ...]:
    """A column for each variable for which exactly one of the unused columns is likely, and this for no other variable.

    Args:
        symbols: the variables without a column.
        units: unused column → the unit that the file states, empty for none.
    """
    left, proposed = dict(units), dict[str, Proposed]()
    rules = (("by its name", _by_name), ("by its unit", _by_unit), ("by a usual name", _by_usual_name))
    for why, like in rules:
        for symbol in symbols:
            if symbol in proposed:
                continue
            found = [name for name in left if like(symbol, name, left, spec)]
            rivals = [s for s in symbols if s not in proposed and like is not _by_name]
            if len(found) == 1 and not any(like(s, found[0], left, spec) for s in rivals if s != symbol):
                proposed[symbol] = _proposed(symbol, found[0], left.pop(found[0]), why, spec)
    for group in _alike([symbol for symbol in symbols if symbol not in proposed], spec):
        names = _numbered(group, left, spec)
        for symbol, name in zip(group, names, strict=False):
            proposed[symbol] = _proposed(symbol, name, left.pop(name), "by usual names and numbers", spec)
    rest = [symbol for symbol in symbols if symbol not in proposed]
    if len(rest) == 1 and len(left) == 1:
        ((name, unit),) = left.items()
        known = _unit(name, unit)
        likely = not is_counter(name) and not _is_another(rest[0], name, spec)
        if likely and (known == "" or _fits(known, spec.units[rest[0]])):
            proposed[rest[0]] = _proposed(rest[0], name, unit, "since no other column is left", spec)
    elif rest in _alike(rest, spec) and len(left) == len(rest):
        names = _in_order(list(left)) if len({re.sub(r"\d+", "#", name) for name in left}) == 1 else []
        stated = {_unit(name, left[name]) for name in names} - {""}
        if all(_fits(unit, spec.units[rest[0]]) for unit in stated):
            for symbol, name in zip(rest, names, strict=False):
                proposed[symbol] = _proposed(symbol, name, left[name], "since no other columns are left", spec)
    return tuple(proposed[symbol] for symbol in symbols if symbol in proposed)


def _in_order(names: list[str]) -> list[str]:
    """Names in the order of the numbers in them."""
    return sorted(names, key=lambda name: [int(n) for n in re.findall(r"\d+", name)])


def _alike(symbols: Sequence[str], spec: Spec) -> list[list[str]]:
    """Groups of two or more symbols of the same kind (position, velocity, input) and unit, in the spec's order."""
    kinds = (spec.positions, spec.velocities, [i.name for i in spec.inputs])
    units = {symbol: spec.units[symbol] for symbol in symbols}
    groups = [[s for s in kind if units.get(s) == unit] for kind in kinds for unit in dict.fromkeys(units.values())]
    return [group for group in groups if len(group) > 1]


def _numbered(group: Sequence[str], left: Mapping[str, str], spec: Spec) -> list[str]:
    """A column for each symbol of a group, by usual names that differ only in a number, such as ``q.1`` and ``q.2``.

    Returns:
        [] where there is no such set of columns, or more than one.
    """
    usual, sets = _usual(group[0], spec), dict[str, list[str]]()
    for name in left:
        words = words_of(re.sub(r"\d+", " ", name))
        if re.search(r"\d", name) and usual.intersection(words) and not _is_another(group[0], name, spec):
            sets.setdefault(re.sub(r"\d+", "#", name), []).append(name)
    whole = [names for names in sets.values() if len(names) == len(group)]
    return _in_order(whole[0]) if len(whole) == 1 else []


def lines_of(proposed: Sequence[Proposed], others: Mapping[str, str]) -> str:
    """The lines of meta.yaml that assign the proposed columns; ``others``: placeholders for the other variables."""
    columns = {one.symbol: written_column(one.column) for one in proposed} | dict(others)
    lines = [f"`columns: {_flow(columns)}`"]
    units = {one.symbol: one.unit for one in proposed if one.unit}
    return " and ".join([*lines, f"`units: {_flow(units)}`"] if units else lines)


def reasons(proposed: Sequence[Proposed]) -> str:
    """The proposed columns with the reason for each, grouped by reason; a letter that only looks right is named."""
    by_reason: dict[str, list[str]] = {}
    for one in proposed:
        letter = foreign_letter(one.column) if len(_plain(one.column)) == len(one.symbol) else ""
        by_reason.setdefault(one.why, []).append(f"`{brief(one.column)}`{letter}")
    return "; ".join(f"{', '.join(names)} {why}" for why, names in by_reason.items())


def _by_name(symbol: str, name: str, left: Mapping[str, str], spec: Spec) -> bool:
    plain = _plain(name)
    return plain.lower() == symbol.lower() or nearest_name(symbol, [plain]) is not None


def _by_unit(symbol: str, name: str, left: Mapping[str, str], spec: Spec) -> bool:
    unit = _unit(name, left[name])
    return unit != "" and _fits(unit, spec.units[symbol]) and not _is_another(symbol, name, spec)


def _by_usual_name(symbol: str, name: str, left: Mapping[str, str], spec: Spec) -> bool:
    return bool(_usual(symbol, spec) & _words(name)) and not _is_another(symbol, name, spec)


def _usual(symbol: str, spec: Spec) -> frozenset[str]:
    """Usual words of columns of a variable, by its unit."""
    return words_for(*_OF_UNIT.get(spec.units[symbol], ()))


def _is_another(symbol: str, name: str, spec: Spec) -> bool:
    """Whether by its name the column holds something else than the variable.

    That is a command for a position, the current of the drive's supply for an input, another quantity for the time.
    """
    words = _words(name)
    if symbol == "t":
        others = words_for(*(set(QUANTITIES) - {"time"}))
        return any(len(word) > 1 for word in words & others)
    if symbol in spec.positions:
        return not words.isdisjoint(COMMANDED | NO_SIGNAL)
    return not words.isdisjoint(NO_SIGNAL | (SUPPLY if spec.units[symbol] in ("V", "A") else frozenset()))


def is_counter(name: str) -> bool:
    """Whether a column holds row numbers, by its name: ``Sample``, ``row_nr``, ``Index``."""
    return bool(_words(name)) and _words(name) <= COUNTED


def is_in_counts(name: str) -> bool:
    """Whether a column holds raw counts of a sensor, by its name: ``pos_counts``, ``Enc.Ticks``, ``q [cnt]``."""
    return not is_counter(name) and bool(COUNTS & set(words_of(name)))


def scale_of_counts(symbol: str, spec: Spec) -> str:
    """The line of meta.yaml, or of the spec's ``log:``, that converts counts to SI, with an example of their size."""
    own = spec.units[symbol]
    if own.startswith("rad"):
        return f"`scale: {{{symbol}: 2*pi/4096}}` of an encoder with 4096 counts a turn"
    size, with_unit = ("10 um", "10 um") if own == "m" else ("0.001", f"0.001 {own}")
    return f"`scale: {{{symbol}: {size}}}` of counts of {with_unit}"


def words_of(name: str) -> list[str]:
    """Lower-case words and numbers, with camelCase split."""
    split = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    return [word for word in re.split(r"[^a-z0-9]+", split.lower()) if word]


def _words(name: str) -> set[str]:
    return set(words_of(_plain(name)))


def _plain(name: str) -> str:
    """A column's name without a unit in it."""
    bare = stated_unit(name)[0]
    behind = _behind(bare)
    return bare[: -len(behind) - 1] if behind else bare


def _unit(name: str, stated: str) -> str:
    return stated or stated_unit(name)[1] or _behind(name)


def _behind(name: str) -> str:
    """The part of a name after its last _, if it is a unit; else empty."""
    front, _, last = name.rpartition("_")
    return last if front and not last.isdigit() and may_be_unit(last) else ""


def _fits(unit: str, own: str) -> bool:
    return is_unit(unit) and same_dimension(unit, own, Place(""))


def _proposed(symbol: str, name: str, stated: str, why: str, spec: Spec) -> Proposed:
    unit, own = _unit(name, stated), spec.units[symbol]
    read = stated or stated_unit(name)[1] or unit_behind(symbol, name)
    if unit and not read and _fits(unit, own):
        unread = si_factor(unit, Place("")) != si_factor(own, Place(""))
        return Proposed(symbol, name, unit if unread else "", why)
    return Proposed(symbol, name, "", why)


def written_column(name: str) -> str:
    """A column's name as meta.yaml needs it: in quotes, unless it is a plain word."""
    return name if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) else json.dumps(name, ensure_ascii=False)


def _flow(entries: Mapping[str, str]) -> str:
    return f"{{{', '.join(f'{key}: {value}' for key, value in entries.items())}}}"
