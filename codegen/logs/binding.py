"""Assignment of a log's columns to the spec's variables, and the factor from each column to SI."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from shlex import quote

from codegen.base.errors import BadInput, Place, nearest_name, refuse_unknown
from codegen.base.user_text import brief
from codegen.logs.column_names import (
    Proposed,
    is_counter,
    is_in_counts,
    lines_of,
    proposed_columns,
    reasons,
    scale_of_counts,
)
from codegen.logs.description import LogDescription
from codegen.logs.formats.source import Columns, LogFile, listing
from codegen.logs.log import Finding, Severity
from codegen.logs.term import OPERATORS, Term, find_term, identifier
from codegen.spec.column_units import ALSO_WORDS, is_convertible, meant_unit, size_of_count, stated_unit, unit_behind
from codegen.spec.model import Spec
from codegen.spec.quantity import refuse_other_unit
from codegen.spec.units import (
    describe,
    dimension,
    has_two_meanings,
    is_rare_word,
    is_unit,
    parse_unit,
    same_dimension,
    si_factor,
)

NO_COLUMN = "none"
"""What a description says in place of a position's column where the log has the speed alone."""
MOST_COLUMNS = 10_000
"""Most columns of a log: the search for a name takes time for each of them."""
_TIME = re.compile(r"t|_*(?i:time|timestamp|stamp|time_stamp|datetime|elapsed_time|zeit)")
_ALSO_TIME = re.compile(
    r"(?i:elapsed|(?:sim|ros|rel|relative)_time|zeitstempel|uhrzeit|seconds|x_value)|millis|micros|ts"
)
"""Names of a time where no column has one of ``_TIME``: it may be the second column of times."""
_PARTS = {"nsecs?|nanosecs?|nanoseconds?": "1e-9", "usecs?|microsecs?|microseconds?": "1e-6"}
"""Names of the part of a time below a second, beside ``sec``, ``secs`` or ``seconds``, and its unit in s."""


_CLOCKS = {
    "100 ns since 1601 (FILETIME)": (1e-7, 11_644_473_600.0),
    "milliseconds since 1970": (1e-3, 0.0),
    "microseconds since 1970": (1e-6, 0.0),
    "nanoseconds since 1970": (1e-9, 0.0),
}
"""Clock → its unit in s, and its time in s at the start of 1970."""
_YEARS_2000_TO_2100 = (946_684_800.0, 4_102_444_800.0)


@dataclass(frozen=True)
class Binding:
    """The column, and its factor to SI, of each variable of the spec.

    Attributes:
        terms: ``t``, positions, velocities and inputs → column of the file, or expression of several. Left out are
            ``t`` where the sample rate replaces it, positions in ``integrated``, and velocities unless all were logged.
        scale: symbol → factor to SI; 1 by default.
        integrated: positions without a column, which are computed as the integral of their measured velocity.
        findings: units that could not be used, or may not be meant.
        unsized: symbols whose factor to SI is therefore not known.
        inferred_units, applied_units: as of ``RawData``.
    """

    terms: Mapping[str, Term]
    scale: Mapping[str, float]
    integrated: tuple[str, ...]
    logged: bool
    notes: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    unsized: frozenset[str] = frozenset()
    inferred_units: Mapping[str, str] = field(default_factory=dict)
    applied_units: Mapping[str, str] = field(default_factory=dict)


def bind(source: LogFile, spec: Spec, description: LogDescription, explicit: Mapping[str, str] | None) -> Binding:
    """Find a column for every variable of the spec.

    The first of these decides: an explicit option, the description, the spec, or the variable's own name, with or
    without a unit after it; for ``t`` any usual name of a time.
    """
    return _Search(source, spec, description, explicit or {}).binding()


def time_columns(names: Sequence[str]) -> list[str]:
    """The columns with a usual name of a time: ``t``, ``Time``, ``time [s]``, ``timestamp``, ``t_ms``, …"""
    plain = {}
    for name in names:
        bare = stated_unit(name)[0].replace(" ", "_")
        plain[name] = re.sub(f"_?{unit}$", "", bare, flags=re.IGNORECASE) if (unit := unit_behind("t", name)) else bare
    found = ([name for name in names if form.fullmatch(plain[name])] for form in (_TIME, _ALSO_TIME))
    return next((columns for columns in found if columns), [])


def time_in_two(names: Sequence[str]) -> list[str]:
    """The times in two columns, as in ROS: ``stamp_sec + 1e-9*stamp_nanosec``."""
    found = []
    for name in names:
        whole = re.fullmatch(r"(.*?)(?:secs?|seconds?)", name, re.IGNORECASE)
        for form, unit in _PARTS.items():
            part = re.compile(re.escape(whole[1]) + f"(?:{form})", re.IGNORECASE) if whole else None
            found += [f"{identifier(name)} + {unit}*{identifier(n)}" for n in names if part and part.fullmatch(n)]
    return found


def time_of(source: LogFile, description: LogDescription) -> str:
    """The time column of a log: as described, or else by its name; raises as ``column_of``."""
    text = description.columns.get("t") or next(iter(time_columns(source.names)), "t")
    return column_of(source, text, description.place("columns.t"))


def column_of(source: LogFile, text: str, place: Place) -> str:
    """The column that a text of a description names, or numbers from 1."""
    term = find_term(text, source.names, place)
    if term is None or term.expression is not None:
        expected = f"one of the columns {listing(source.names)} of {source.path.name}"
        raise BadInput(place, f"no column `{brief(text)}`", expected, nearest_name(text, source.names), code="LOG003")
    return term.columns[0]


class _Search:
    """The search for the columns of one file, with its intermediate results; see ``Binding``."""

    def __init__(self, source: LogFile, spec: Spec, description: LogDescription, explicit: Mapping[str, str]) -> None:
        self.source, self.spec, self.description, self.explicit = source, spec, description, explicit
        self.names, self.place = source.names, source.place
        if len(self.names) > MOST_COLUMNS:
            raise BadInput(self.place, f"{len(self.names)} columns", f"at most {MOST_COLUMNS}", code="LOG010")
        self.headless = list(self.names) == [str(k + 1) for k in range(len(self.names))]
        self.symbols = ("t", *spec.positions, *spec.velocities, *(i.name for i in spec.inputs))
        self.terms: dict[str, Term] = {}
        self.missing: list[str] = []
        self.unlogged: dict[str, BadInput] = {}
        self.notes: list[str] = []
        self.findings: list[Finding] = []
        self.unsized: set[str] = set()
        self.inferred_units: dict[str, str] = {}
        self.applied_units: dict[str, str] = {}

    def binding(self) -> Binding:
        self._refuse_unknown_symbols()
        for symbol in self.symbols:
            self._find(symbol)
        self._propose()
        integrated = self._integrated()
        logged = self._drop_some_velocities(integrated)
        self._refuse_twice()
        self._refuse_positions_as_forces()
        scale = {symbol: self._factor(symbol) for symbol in self.symbols}
        if not scale["t"] > 0:
            stated = "t" in self.description.scale
            where = self.description.place("scale.t") if stated else self.spec.place("log.scale.t")
            raise BadInput(where, f"factor {scale['t']:g}", "a positive factor for time", code="LOG013")
        doubts = tuple(self.findings), frozenset(self.unsized)
        units = self.inferred_units, self.applied_units
        return Binding(self.terms, scale, integrated, logged, tuple(self.notes), *doubts, *units)

    def _refuse_unknown_symbols(self) -> None:
        spec, description = self.spec, self.description
        expected = f"one of {', '.join(self.symbols)}, a name of {spec.name}"
        asked: list[tuple[str, Place | str]] = [(symbol, "--column") for symbol in self.explicit]
        for section in ("scale", "units", "late") if description.listed else ("columns", "scale", "units", "late"):
            asked += [(symbol, description.place(f"{section}.{symbol}")) for symbol in getattr(description, section)]
        for symbol, place in asked:
            meant = expected
            if place == "--column" and symbol in self.names and (name := self.explicit[symbol]) in self.symbols:
                meant = f"a name of {spec.name} first and its column behind it, `{name}={symbol}`"
            refuse_unknown(symbol, self.symbols, place, "unknown name", meant, code="LOG013")
        extra = [symbol for symbol in description.columns if symbol not in self.symbols]
        if extra:
            self.notes.append(f"columns that {spec.name} does not use: {listing(extra)}")

    def _choice(self, symbol: str) -> tuple[str, Place | str | None]:
        """The column that is configured for a symbol, and where; the symbol's own name and None if none is."""
        about = self.description
        if symbol in self.explicit:
            return self.explicit[symbol], "--column"
        if symbol in about.columns:
            return about.columns[symbol], about.place("columns" if about.listed else f"columns.{symbol}")
        if symbol in self.spec.log.columns:
            return self.spec.log.columns[symbol], self.spec.place(f"log.columns.{symbol}")
        return symbol, None

    def _find(self, symbol: str) -> None:
        """Find the column of a symbol. If there is none, note it in ``missing`` or ``unlogged``, or raise BadInput."""
        text, origin = self._choice(symbol)
        place = origin if isinstance(origin, Place) else Place("--column" if origin else self.place.file)
        if origin is not None and text == NO_COLUMN and symbol in self.spec.positions and text not in self.names:
            velocity = self._velocity_of(symbol)
            found = f"`{symbol}: {NO_COLUMN}`, and no column of its speed {velocity}"
            self.unlogged[symbol] = BadInput(place, found, f"a column of {symbol} or of {velocity}", code="LOG003")
            return
        term = find_term(text, self.names, place)
        if term is not None:
            self.terms[symbol] = term
            return
        listed = self.description.listed and symbol not in self.explicit and symbol in self.description.columns
        by_name = origin is None or listed
        if symbol in self.spec.velocities and by_name:
            with_unit = [name for name in self._likely(symbol) if self._is_of_unit(name, self.spec.units[symbol])]
            if len(with_unit) == 1:
                self._take(symbol, with_unit[0], place)
            return
        rate = self.description.sample_rate_hz
        if symbol == "t" and origin is None and rate:
            self.notes.append(f"no column t: time counted at the description's {rate:g} Hz")
            return
        for whole, why in self.source.unread.items():
            if text == whole or text.startswith((f"{whole}.", f"{whole}[")):
                there = Place(self.place.file, None, brief(whole, 80))
                raise BadInput(there, f"no column `{brief(text, 80)}`: {why}", "one that can be read", code="LOG003")
        likely = self._likely(symbol) if origin is None else []
        if len(likely) == 1:
            self._take(symbol, likely[0], place)
            return
        if likely:
            which = ", ".join(f"`{brief(n)}`" for n in likely)
            found = f"no column `{symbol}`, and {len(likely)} that may be it: {which}"
            expected = f"`columns: {{{symbol}: NAME}}` in meta.yaml beside the log, or `--column {symbol}=NAME`"
            raise BadInput(self.place, found, expected, code="LOG003")
        if origin is not None and not (by_name and symbol in self.spec.positions):
            raise self._absent(symbol, text, origin)
        self.missing.append(symbol)

    def _take(self, symbol: str, name: str, place: Place) -> None:
        """Assign a column to the symbol that its name means, with a note."""
        term = find_term(name, self.names, place)
        assert term is not None
        self.terms[symbol] = term
        what = "column " if term.expression is None else ""
        self.notes.append(f"{what}`{brief(name)}` is {symbol}, by its name")

    def _is_of_unit(self, name: str, unit: str) -> bool:
        """Whether a column states a unit that can be converted to this one."""
        return is_convertible(self._stated(name), unit)

    def _likely(self, symbol: str) -> list[str]:
        """The columns that the symbol's name may mean."""
        if symbol == "t":
            return time_columns(self.names) or time_in_two(self.names)
        return [name for name in self.names if stated_unit(name)[0] == symbol]

    def _absent(self, symbol: str, text: str, origin: Place | str) -> BadInput:
        """The error for a configured column that is not there."""
        expected = (
            f"one of the columns {listing(self.names)} (or `columns: {{{symbol}: ...}}` in meta.yaml beside the log"
            f"{'' if symbol in self.explicit else f', or `--column {symbol}=...`'})"
        )
        if isinstance(origin, Place) and origin.file != self.spec.place("log").file:
            expected += (
                "; where that file describes another log, `diagnose` and `replay` take this one's by `--description`"
            )
        if symbol in self.explicit:
            expected += "; the option is for every log of a command: where their columns differ, meta.yaml beside each"
        found = f"no column `{brief(text)}`, which {origin} asks for as `{symbol}`"
        as_written = [name for name in self.names if name in text and name != identifier(name)]
        if as_written and OPERATORS & set(text):
            longest = max(as_written, key=len)
            expected = f"an expression, in which `{brief(longest)}` is written `{identifier(longest)}`"
            return BadInput(self.place, found, expected, code="LOG003")
        written = {identifier(n): n for n in self.names}
        nearest = nearest_name(text, self.names) or written.get(nearest_name(text, written) or "")
        return BadInput(self.place, found, expected, brief(nearest) if nearest else None, code="LOG003")

    def _velocity_of(self, symbol: str) -> str | None:
        """The velocity of a position; None for another symbol."""
        return next((c.velocity for c in self.spec.coordinates if c.name == symbol), None)

    def _unused(self) -> list[str]:
        """The columns that no symbol takes."""
        used = {name for term in self.terms.values() for name in term.columns}
        return [name for name in self.names if name not in used]

    def _is_integral(self, symbol: str, unused: Collection[str]) -> bool:
        """Whether a symbol is a position with a logged speed that no unused column may hold, so that it is integrated.

        Each of these columns states a unit that is none of the position, and is not in counts.
        """
        velocity = self._velocity_of(symbol)
        if velocity not in self.terms:
            return False
        own = self.spec.units[symbol]
        units = {name: self._stated(name) for name in unused}
        return not any(
            unit in ("", "-", "1") or is_in_counts(name) or is_convertible(unit, own) for name, unit in units.items()
        )

    def _or_none(self, symbol: str) -> str:
        """What to write where the log has the speed of this position alone; empty for other symbols."""
        velocity = self._velocity_of(symbol)
        if velocity not in self.terms:
            return ""
        return f"; or `columns: {{{symbol}: {NO_COLUMN}}}` if the log has the speed {velocity} alone, to integrate it"

    def _likely_speeds(self, positions: Sequence[str], unused: Collection[str]) -> dict[str, Proposed]:
        """Position without a column → the one unused column whose unit is that of its speed."""
        found = {}
        for c in self.spec.coordinates:
            speeds = [n for n in self.names if n in unused and is_convertible(self._stated(n), f"{c.unit}/s")]
            if c.name in positions and c.velocity not in self.terms and len(speeds) == 1:
                found[c.name] = Proposed(c.velocity, speeds[0], "", "by its unit")
        return found

    def _propose(self) -> None:
        """Raise BadInput for the symbols without a column, with lines of meta.yaml that name the likely columns.

        A position whose velocity was logged is integrated where no column is left that may hold it.
        """
        units = {} if self.headless else {name: self._stated(name) for name in self._unused()}
        proposed = proposed_columns(self.missing, units, self.spec)
        found = {one.symbol: one.column for one in proposed}
        left = set(self._unused()) - set(found.values())
        lacking = [s for s in self.missing if s in found or not self._is_integral(s, left)]
        if not lacking:
            return
        counted = "t" in lacking and "t" not in found and bool(left) and all(map(is_counter, left))
        absent = f"no {'columns' if len(lacking) > 1 else 'column'} {', '.join(f'`{s}`' for s in lacking)}"
        blank = "NUMBER" if self.headless else "..."
        blanks = [s for s in lacking if s not in found and not (s == "t" and counted)]
        speeds = self._likely_speeds([s for s in blanks if s in self.spec.positions], left)
        others = {s: NO_COLUMN if s in speeds else blank for s in blanks}
        lines = lines_of((*proposed, *speeds.values()), others) if proposed or blanks else ""
        counts = [one for one in proposed if not one.unit and is_in_counts(one.column)]
        lines += "".join(f", and their size, such as {scale_of_counts(one.symbol, self.spec)}," for one in counts)
        if counted:
            lines += f"{' and ' if lines else ''}`sample_time: SECONDS`"
        elif "t" in lacking and "t" not in found:
            lines += " (or `sample_time: SECONDS` in place of t)"
        option = "" if counted or speeds else _options(proposed, lacking, blank)
        why = f" ({reasons((*proposed, *speeds.values()))})" if proposed or speeds else ""
        has = f"NUMBER from 1 to {len(self.names)}" if self.headless else f"it has {listing(self.names)}"
        if len(self.names) == 1:
            has += "; `beside: {tau: FILE}` has the columns of another file as `tau.NAME`"
        expected = f"{lines} in meta.yaml beside the log{option}{why}{self._or_none(lacking[0])}; {has}"
        error = BadInput(self.place, absent, expected, code="LOG003")
        if proposed and proposed[0].symbol == lacking[0]:
            error.nearest = proposed[0].column  # for --json; the message has it in its lines already
        raise error

    def _integrated(self) -> tuple[str, ...]:
        """The positions without a column, which are integrated from their velocities; each of ``missing`` can be."""
        found = []
        for c in self.spec.coordinates:
            if c.name in self.unlogged and c.velocity not in self.terms:
                raise self.unlogged[c.name]
            if c.name in self.unlogged or c.name in self.missing:
                words = f"the position is the integral of the measured speed {c.velocity}, from zero"
                self.notes.append(f"no column {c.name}: {words}")
                found.append(c.name)
        return tuple(found)

    def _drop_some_velocities(self, integrated: Sequence[str]) -> bool:
        """Whether every velocity was logged; if not, remove those that no position is integrated from."""
        velocities = self.spec.velocities
        logged = [v for v in velocities if v in self.terms]
        if logged and len(logged) < len(velocities):
            needed = {c.velocity for c in self.spec.coordinates if c.name in integrated}
            unused = [v for v in logged if v not in needed]
            if unused:
                self.notes.append(f"velocity of some coordinates only ({', '.join(unused)}): left unused")
            for v in unused:
                del self.terms[v]
        elif not logged and self.description.velocity_columns:
            self.notes.append("the description states velocity columns, and the log has none")
        return len(logged) == len(velocities)

    def _refuse_twice(self) -> None:
        """Raise BadInput for a column that two symbols take."""
        owner: dict[str, str] = {}
        for symbol, term in self.terms.items():
            if term.expression is not None:
                continue
            name = term.columns[0]
            if name in owner:
                found = f"column `{brief(name)}` for both {owner[name]} and {symbol}"
                raise BadInput(self.place, found, "a column of its own for each", code="LOG004")
            owner[name] = symbol

    def _refuse_positions_as_forces(self) -> None:
        """Raise BadInput for a commanded position as an input in another unit; an expression with it is accepted."""
        commands, units = self.source.commands, {c.unit for c in self.spec.coordinates}
        for i in self.spec.inputs:
            column = self.terms[i.name].columns[0]
            if self.terms[i.name].expression is None and column in commands and i.unit not in units:
                found = f"`{brief(column)}`, a commanded position, as the input {i.name} in {i.unit}"
                law = f"25*({identifier(column)} - {identifier(commands[column])})"
                measured = "a measured current or torque"
                expected = f"{measured}, or the servo's own law as an expression of columns, such as {law}"
                raise BadInput(Place(self.place.file), found, expected, code="LOG012")

    def _factor(self, symbol: str) -> float:
        """The factor from a symbol's column to SI: of the unit by the description or else the file, times the scale."""
        about, term = self.description, self.terms.get(symbol)
        scale, own = about.stated_scale(symbol, self.spec), self.spec.units[symbol]
        place = about.place(f"units.{symbol}")
        sized = about.scale[symbol].unit if symbol in about.scale else ""
        refuse_other_unit(sized, own, f"scale of {symbol}", about.place(f"scale.{symbol}"))
        if sized and symbol in about.units:
            found = f"unit {about.units[symbol]}, and also a scale in {sized}"
            raise BadInput(place, found, f"one of the two: `scale: {{{symbol}: …}}` alone", code="LOG012")
        if symbol in about.units:
            unit = about.units[symbol]
            if not same_dimension(unit, own, place):
                found = f"unit {unit}, of {describe(dimension(parse_unit(unit, place)))}"
                size = f"the size of one count in {own}" if "count" in unit.lower() else f"what one {unit} is in {own}"
                expected = f"a unit of {symbol}, which is in {own}; or in its place `scale: {{{symbol}: SIZE}}`, {size}"
                raise BadInput(place, found, expected, code="LOG012")
            return float(si_factor(unit, place)) * scale
        if term is None or symbol in about.scale or symbol in self.spec.log.scale:
            return scale
        if term.expression is not None:
            self._doubt_units_of(symbol, term)
            return scale
        return scale * self._factor_by_file(symbol, term.columns[0])

    def _factor_by_file(self, symbol: str, name: str) -> float:
        """The factor to SI of the unit that the file or a column's name states; 1 for none that can be used."""
        own, place = self.spec.units[symbol], self.description.place(f"units.{symbol}")
        by_file = self._stated(name)
        unit = by_file or unit_behind(symbol, name)
        if unit in ("", "-", "1", own):
            if unit != own and is_in_counts(name):
                words = f"column `{brief(name)}` of {symbol} holds counts by its name, and is taken to be in {own}"
                size = f"such as {scale_of_counts(symbol, self.spec)}, or `scale: {{{symbol}: 1}}` if they are in {own}"
                self._doubt(symbol, words, f"Say their size in meta.yaml beside the log, {size}.")
                self.unsized.add(symbol)
            return 1.0
        if is_convertible(unit, own):
            factor = float(si_factor(unit, place))
            if factor != 1.0:
                says = "file" if by_file else f"name of `{brief(name)}`"
                wrong = f" (`units: {{{symbol}: {own}}}` in meta.yaml beside the log where that is wrong)"
                self.inferred_units[symbol], self.applied_units[symbol] = f"in {unit}, as the {says} says", unit
                self.notes.append(
                    f"{symbol} is {self.inferred_units[symbol]}: converted to {own}{'' if by_file else wrong}"
                )
            if unit.lower() in ALSO_WORDS and name not in self.source.units and not name.endswith("]"):
                words = f"column `{brief(name)}` of {symbol} is taken to be in {unit}, and converted to {own}"
                choice = f"`units: {{{symbol}: {unit}}}` if it is, `units: {{{symbol}: {own}}}` if it is in {own}"
                self._doubt(symbol, words, f"Say {choice}, in meta.yaml beside the log.")
            return factor
        if by_file:
            advice = f"Say `scale: {{{symbol}: FACTOR}}` in meta.yaml beside the log, 1 if they are in {own}."
            if others := self._others_in(unit, symbol):
                advice = f"It is a unit of {others}: are the columns exchanged? {advice}"
            if meant := meant_unit(by_file, own):
                line = f"`units: {{{symbol}: {meant}}}` in meta.yaml beside the log"
                advice = f"Say {line} if that is meant, or `scale:`."
            if size := size_of_count(by_file, own):
                choice = f"`scale: {{{symbol}: {size}}}` if that is the size of a count"
                advice = f"Say {choice}, `scale: {{{symbol}: 1}}` if they are in {own}, in meta.yaml beside the log."
            if is_in_counts(f"x {by_file}"):
                advice = f"Say their size in meta.yaml beside the log, such as {scale_of_counts(symbol, self.spec)}."
            listed = bool(self.source.units.get(name))
            severity: Severity = "problem" if _has_size(by_file) and (listed or _is_meant(by_file)) else "warning"
            words = f"the file has {symbol} in `{brief(unit)}`, which is no unit that can be converted to {own}"
            words += ": its numbers are used unchanged" if severity == "warning" else ""
            self._doubt(symbol, words, advice, severity)
            self.unsized.add(symbol)
        elif others := self._others_in(unit, symbol):
            words = f"column `{brief(name)}` of {symbol} states `{brief(unit)}` in its name, a unit of {others}"
            self._doubt(symbol, words, f"Are the columns exchanged? {symbol} is in {own}.")
        return 1.0

    def _others_in(self, unit: str, symbol: str) -> str:
        """The other variables of the log, without time, that may be in a unit; "" for none."""
        return " and ".join(
            s for s in self.terms if s not in (symbol, "t") and is_convertible(unit, self.spec.units[s])
        )

    def _doubt_units_of(self, symbol: str, term: Term) -> None:
        """A warning on an expression whose columns state units, which are not applied."""
        own = self.spec.units[symbol]
        units = {unit for c in term.columns if (unit := self._stated(c))} - {"-", "1", own}
        if units:
            words = f"{symbol} is computed from columns in {listing(sorted(units))}, and taken to be in {own}"
            choice = f"`units: {{{symbol}: {own}}}` if it is, else its unit there, or `scale: {{{symbol}: FACTOR}}`"
            self._doubt(symbol, words, f"Say {choice}, in meta.yaml beside the log.")

    def _doubt(self, symbol: str, words: str, advice: str, severity: Severity = "warning") -> None:
        """Report a unit that is not stated clearly; a problem where the file states one of another dimension."""
        self.findings.append(Finding(severity, f"unit of {symbol}", f"{words[0].upper()}{words[1:]}. {advice}"))

    def _stated(self, name: str) -> str:
        """The unit of a column by the file, or else by its name; an index or a joint in brackets is no unit."""
        by_name = stated_unit(name)[1]
        joint = self.source.joints_in_brackets or by_name.isdigit()
        return self.source.units.get(name, "") or ("" if joint else by_name)


def _has_size(unit: str) -> bool:
    """Whether a unit says how large a number is, as V, deg and 1/min do; a count, a percentage, another word do not."""
    if has_two_meanings(unit):
        return True
    here = Place("")
    return is_unit(unit) and not (same_dimension(unit, "1", here) and si_factor(unit, here) == 1)


def _is_meant(unit: str) -> bool:
    """Whether a unit in a column's name is meant as one, as in ``x (V)``; in ``q (cal)`` it is a word for a signal."""
    if has_two_meanings(unit):
        return True
    return not is_rare_word(unit) and not same_dimension(unit, "s", Place(""))


def _options(proposed: Sequence[Proposed], lacking: Sequence[str], blank: str) -> str:
    """The proposals as options of a command, or the form of the option if not every variable has a proposal.

    Empty if a proposal needs a unit, which no option states.
    """
    if any(one.unit or not one.column.isprintable() for one in proposed):
        return ""
    if len(proposed) < len(lacking):
        return f", or `--column {lacking[0]}={blank}`{' for each' if len(lacking) > 1 else ''}"
    options = " ".join(f"--column {quote(f'{one.symbol}={one.column}')}" for one in proposed)
    return f", or `{options}`"


def since_epoch(binding: Binding, raw: Columns, description: LogDescription, spec: Spec) -> Binding:
    """The binding with the factor of time to seconds, if time is in ms, µs or ns since 1970 or in Windows' FILETIME.

    The clock is recognised by its value at the first sample, which must be a time between 2000 and 2100. A time in
    seconds is never that large. A unit or scale given for ``t`` takes precedence.
    """
    term = binding.terms.get("t")
    if term is None or term.expression is not None or binding.scale["t"] != 1.0 or not len(raw.values):
        return binding
    if {"t"} & {*description.units, *description.scale, *spec.log.scale}:
        return binding
    first = raw.values[0, raw.names.index(term.columns[0])]
    for clock, (step, before) in _CLOCKS.items():
        if _YEARS_2000_TO_2100[0] <= first * step - before <= _YEARS_2000_TO_2100[1]:
            words = f"in {clock}, by its size"
            return replace(
                binding,
                scale={**binding.scale, "t": step},
                notes=(*binding.notes, f"t is {words}: converted to s"),
                inferred_units={**binding.inferred_units, "t": words},
            )
    return binding
