"""Which column of the file is which symbol of the spec, by the first that says so, and its factor to SI."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from codegen.base.errors import BadInput, Place, nearest_name, refuse_unknown
from codegen.base.user_text import shown
from codegen.logs.description import LogDescription
from codegen.logs.log import Finding
from codegen.logs.proposed_columns import lines_of, proposed_columns, reasons
from codegen.logs.source import LogFile, listing
from codegen.logs.term import OPERATORS, Term, find_term, identifier
from codegen.spec.column_unit import is_brought, stated_unit, unit_behind, unit_of
from codegen.spec.model import Spec
from codegen.spec.units import describe, dimension, parse_unit, same_dimension, si_factor

_TIME = re.compile(r"t|(?i:time|timestamp|stamp|time_stamp|datetime|elapsed_time|zeit)")


@dataclass(frozen=True)
class Binding:
    """Symbols and the file's columns.

    Attributes:
        terms: ``t``, positions, velocities and inputs → column of the file, or expression of several; ``t`` is left out
            where the sample rate stands for it, positions in ``integrated``, and velocities where not all were logged.
        scale: symbol → factor to SI, 1 where nobody said.
        integrated: positions that no column gives, and that are the integral of their measured velocity.
        logged: whether every velocity was logged.
        notes: what was found on the way.
        findings: units that could not be used.
        brought: symbol → unit that nobody but the file or a column's name stated, and who did; its factor is applied.
    """

    terms: Mapping[str, Term]
    scale: Mapping[str, float]
    integrated: tuple[str, ...]
    logged: bool
    notes: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    brought: Mapping[str, str] = field(default_factory=dict)


def bind(source: LogFile, spec: Spec, description: LogDescription, explicit: Mapping[str, str] | None) -> Binding:
    """Find a column for every symbol: by explicit options, the description, the spec, or the symbol's own name, with a
    unit behind it or not; for ``t`` by any usual name of a time.

    Raises:
        BadInput: for an unknown symbol, a column that is missing, one that is taken twice, or a unit of another kind.
    """
    symbols = ("t", *spec.positions, *spec.velocities, *(i.name for i in spec.inputs))
    explicit = explicit or {}
    names, place = source.names, source.place
    notes = list(_unknown_symbols(symbols, spec, description, explicit))
    terms: dict[str, Term] = {}
    missing: dict[str, BadInput] = {}
    for symbol in symbols:
        text, origin = _choice(symbol, spec, description, explicit)
        where = origin if isinstance(origin, Place) else Place("column option" if origin else place.file)
        term = find_term(text, names, where)
        if term is not None:
            terms[symbol] = term
            continue
        by_name = origin is None or (description.listed and symbol not in explicit and symbol in description.columns)
        if symbol in spec.velocities and by_name:
            continue
        if symbol == "t" and origin is None and description.sample_rate_hz:
            notes.append(f"no column t: time counted at the description's {description.sample_rate_hz:g} Hz")
            continue
        _refuse_unread(text, source)
        likely = _likely(symbol, names) if origin is None else []
        if len(likely) == 1:
            terms[symbol] = Term(likely[0], (likely[0],))
            notes.append(f"column `{shown(likely[0])}` is {symbol}, by its name")
            continue
        if likely:
            found = (
                f"no column `{symbol}`, and {len(likely)} that may be it: {', '.join(f'`{shown(n)}`' for n in likely)}"
            )
            expected = f"`columns: {{{symbol}: NAME}}` in a log description, or `--column {symbol}=NAME`"
            raise BadInput(place, found, expected, code="LOG003")
        error = _absent(symbol, text, origin, names, place)
        if not by_name or (symbol not in spec.positions and origin is not None):
            raise error
        missing[symbol] = error
    _propose(missing, terms, source, spec)
    integrated = _integrated(missing, terms, spec, names, notes)
    logged = _drop_some_velocities(terms, spec, description, integrated, notes)
    _refuse_twice(terms, place)
    _refuse_positions_as_forces(terms, source, spec)
    findings: list[Finding] = []
    brought: dict[str, str] = {}
    scale = {s: _factor(s, terms.get(s), source, spec, description, notes, findings, brought) for s in symbols}
    if not scale["t"] > 0:
        where = description.place("scale.t") if "t" in description.scale else spec.place("log.scale.t")
        raise BadInput(where, f"factor {scale['t']:g}", "a positive factor for time", code="LOG013")
    return Binding(terms, scale, integrated, logged, tuple(notes), tuple(findings), brought)


def _choice(
    symbol: str, spec: Spec, description: LogDescription, explicit: Mapping[str, str]
) -> tuple[str, Place | str | None]:
    if symbol in explicit:
        return explicit[symbol], "the column option"
    if symbol in description.columns:
        return description.columns[symbol], description.place("columns" if description.listed else f"columns.{symbol}")
    if symbol in spec.log.columns:
        return spec.log.columns[symbol], spec.place(f"log.columns.{symbol}")
    return symbol, None


def time_columns(names: Sequence[str]) -> list[str]:
    """The columns whose name is that of a time: ``t``, ``Time``, ``time [s]``, ``timestamp``, ``t_ms``, …"""
    found = []
    for name in names:
        plain = stated_unit(name)[0].replace(" ", "_")
        unit = unit_behind("t", name)
        if _TIME.fullmatch(plain.removesuffix(f"_{unit}") if unit else plain):
            found.append(name)
    return found


def _likely(symbol: str, names: Sequence[str]) -> list[str]:
    """The columns that are the symbol by their names."""
    if symbol == "t":
        return time_columns(names)
    return [name for name in names if stated_unit(name)[0] == symbol]


def _refuse_unread(text: str, source: LogFile) -> None:
    """Say why a column cannot be had that is part of what the file has."""
    for whole, why in source.unread.items():
        if text == whole or text.startswith((f"{whole}.", f"{whole}[")):
            place = Place(source.place.file, None, shown(whole, 80))
            raise BadInput(place, f"no column `{shown(text, 80)}`: {why}", "one that can be read", code="LOG003")


def _absent(symbol: str, text: str, origin: Place | str | None, names: Sequence[str], place: Place) -> BadInput:
    said = f", which {origin} asks for as `{symbol}`" if origin else ""
    wanted = f"one of the columns {listing(names)} (or `columns: {{{symbol}: ...}}` in a log description)"
    if list(names) == [str(k + 1) for k in range(len(names))]:  # no header line
        said = said or ", and no header line"
        wanted = f"`columns: {{{symbol}: NUMBER}}` in a log description, NUMBER from 1 to {len(names)}"
    as_written = [name for name in names if name in text and name != identifier(name)]
    if as_written and OPERATORS & set(text):
        longest = max(as_written, key=len)
        wanted = f"an expression, in which `{shown(longest)}` is written `{identifier(longest)}`"
        return BadInput(place, f"no column `{shown(text)}`{said}", wanted, code="LOG003")
    if origin is None and symbol == "t":
        wanted += ", or `sample_time: SECONDS` there"
    return BadInput(place, f"no column `{shown(text)}`{said}", wanted, _nearest(text, names), code="LOG003")


def _unknown_symbols(
    symbols: Sequence[str], spec: Spec, description: LogDescription, explicit: Mapping[str, str]
) -> list[str]:
    expected = f"one of {', '.join(symbols)}, a name of {spec.name}"
    for symbol in explicit:
        refuse_unknown(symbol, symbols, "column option", "unknown name", expected, code="LOG013")
    sections = (("columns", description.columns), ("scale", description.scale), ("units", description.units))
    for section, keys in sections:
        if section == "columns" and description.listed:
            continue
        for symbol in keys:
            place = description.place(f"{section}.{symbol}")
            refuse_unknown(symbol, symbols, place, "unknown name", expected, code="LOG013")
    extra = [s for s in description.columns if s not in symbols]
    return [f"columns that {spec.name} does not use: {listing(extra)}"] if extra else []


def _propose(missing: Mapping[str, BadInput], terms: Mapping[str, Term], source: LogFile, spec: Spec) -> None:
    """Refuse the variables without a column, with the lines of a log description for those whose column can be told.

    A position whose velocity was logged is none of them where no column is left for it.
    """
    names = source.names
    if list(names) == [str(k + 1) for k in range(len(names))]:  # no header line
        names = ()
    used = {name for term in terms.values() for name in term.columns}
    units = {name: _stated(name, source) for name in names if name not in used}
    told = proposed_columns(list(missing), units, spec)
    velocity = {c.name: c.velocity for c in spec.coordinates}
    left = [name for name in source.names if name not in used and name not in (one.column for one in told)]
    found = {one.symbol for one in told}
    lacking = [s for s in missing if s in found or left or velocity.get(s) not in terms]
    if not lacking:
        return
    first = missing[lacking[0]]
    if not told:
        raise first
    symbols = "columns" if len(lacking) > 1 else "column"
    absent = f"no {symbols} {', '.join(f'`{s}`' for s in lacking)}"
    others = {s: "..." for s in lacking if s not in found}
    expected = (
        f"{lines_of(told, others)} in a meta.yaml beside the log ({reasons(told)}); it has {listing(source.names)}"
    )
    place = first.place
    raise BadInput(place, absent, expected, told[0].column if told[0].symbol == lacking[0] else None, code="LOG003")


def _integrated(
    missing: Mapping[str, BadInput], terms: Mapping[str, Term], spec: Spec, names: Sequence[str], notes: list[str]
) -> tuple[str, ...]:
    """The positions that their velocities stand for: those without a column, where none is left that could be one.

    Raises:
        BadInput: for a position without a column beside columns that nothing uses, or without a measured velocity.
    """
    used = {name for term in terms.values() for name in term.columns}
    left = [name for name in names if name not in used]
    for c in spec.coordinates:
        if c.name not in missing:
            continue
        if c.velocity not in terms or left:
            raise missing[c.name]
        notes.append(f"no column {c.name}: the position is the integral of the measured speed {c.velocity}, from zero")
    return tuple(c.name for c in spec.coordinates if c.name in missing)


def _drop_some_velocities(
    terms: dict[str, Term], spec: Spec, description: LogDescription, integrated: Sequence[str], notes: list[str]
) -> bool:
    logged = [v for v in spec.velocities if v in terms]
    if logged and len(logged) < len(spec.velocities):
        needed = {c.velocity for c in spec.coordinates if c.name in integrated}
        unused = [v for v in logged if v not in needed]
        if unused:
            notes.append(f"velocity of some coordinates only ({', '.join(unused)}): left unused")
        for v in unused:
            del terms[v]
    elif not logged and description.velocity_columns:
        notes.append("the description speaks of velocity columns, and there is none")
    return len(logged) == len(spec.velocities)


def _refuse_twice(terms: Mapping[str, Term], place: Place) -> None:
    owner: dict[str, str] = {}
    for symbol, term in terms.items():
        if term.expression is not None:
            continue
        name = term.columns[0]
        if name in owner:
            found = f"column `{shown(name)}` for both {owner[name]} and {symbol}"
            raise BadInput(place, found, "a column of its own for each", code="LOG004")
        owner[name] = symbol


def _refuse_positions_as_forces(terms: Mapping[str, Term], source: LogFile, spec: Spec) -> None:
    """Refuse a position that was asked for as an input in another unit; in an expression it is the author's."""
    asked = source.asked
    units = {c.unit for c in spec.coordinates}
    for i in spec.inputs:
        column = terms[i.name].columns[0]
        if terms[i.name].expression is None and column in asked and i.unit not in units:
            found = f"`{shown(column)}`, a position that was asked for, as the input {i.name} in {i.unit}"
            law = f"25*({identifier(column)} - {identifier(asked[column])})"
            expected = (
                f"a measured current or torque, or the servo's own law as an expression of columns, such as {law}"
            )
            raise BadInput(Place(source.place.file), found, expected, code="LOG012")


def _factor(
    symbol: str,
    term: Term | None,
    source: LogFile,
    spec: Spec,
    description: LogDescription,
    notes: list[str],
    findings: list[Finding],
    brought: dict[str, str],
) -> float:
    """From the column to SI: the unit that the description or else the file states, times the scale."""
    scale = float(description.scale.get(symbol, spec.log.scale.get(symbol, 1.0)))
    own = unit_of(symbol, spec)
    place = description.place(f"units.{symbol}")
    if symbol in description.units:
        unit = description.units[symbol]
        if not same_dimension(unit, own, place):
            kind = describe(dimension(parse_unit(unit, place)))
            expected = f"a unit of {symbol}, which is in {own}"
            raise BadInput(place, f"unit {unit}, of {kind}", expected, code="LOG012")
        return float(si_factor(unit, place)) * scale
    if term is None or symbol in description.scale or symbol in spec.log.scale:
        return scale
    if term.expression is not None:
        units = {unit for c in term.columns if (unit := _stated(c, source))} - {"-", "1", own}
        if units:
            words = f"{symbol} is computed from columns in {listing(sorted(units))}, and taken to be in {own}"
            notes.append(words)
            advice = f"Say `units: {{{symbol}: UNIT}}` or `scale: {{{symbol}: FACTOR}}` in a log description."
            findings.append(Finding("warning", f"unit of {symbol}", f"{words}. {advice}"))
        return scale
    name = term.columns[0]
    unit = _stated(name, source)
    behind = unit_behind(symbol, name)
    by_name = not unit and bool(behind)
    unit = unit or behind
    if unit in ("", "-", "1", own):
        return scale
    if is_brought(unit, own):
        factor = float(si_factor(unit, place))
        if factor != 1.0:
            brought[symbol] = f"in {unit}, as the {f'name of `{shown(name)}`' if by_name else 'file'} says"
            otherwise = f" (`units: {{{symbol}: {own}}}` in a log description where that is wrong)" if by_name else ""
            notes.append(f"{symbol} is {brought[symbol]}: brought to {own}{otherwise}")
        return factor * scale
    if by_name:
        return scale
    words = f"the file has {symbol} in `{shown(unit)}`, which is no unit of {own}: its numbers are taken as they stand"
    notes.append(f"{words} (`scale: {{{symbol}: ...}}` in a log description)")
    advice = f"Say `scale: {{{symbol}: FACTOR}}` in a log description, 1 if they are in {own}."
    findings.append(Finding("warning", f"unit of {symbol}", f"{words[0].upper()}{words[1:]}. {advice}"))
    return scale


def _stated(name: str, source: LogFile) -> str:
    """The unit of a column that the file states, or its name; an index or a joint in brackets is none."""
    by_file, by_name = source.units.get(name, ""), stated_unit(name)[1]
    return by_file or ("" if source.joints_in_brackets or by_name.isdigit() else by_name)


def _nearest(name: str, names: Sequence[str]) -> str | None:
    written = {identifier(n): n for n in names}
    nearest = nearest_name(name, names) or written.get(nearest_name(name, written) or "")
    return shown(nearest) if nearest else None
