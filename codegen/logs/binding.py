"""Which column of the file is which symbol of the spec, by the first that says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codegen.errors import BadInput, Place, nearest_name
from codegen.logs.description import LogDescription
from codegen.logs.source import listing, shown
from codegen.spec.model import Spec


@dataclass(frozen=True)
class Binding:
    """Symbols and the file's columns.

    Attributes:
        columns: ``t``, positions, velocities and inputs → column of the file; ``t`` is left out where the sample rate
            stands for it, and velocities where not all were logged.
        scale: symbol → factor to SI, 1 where nobody said.
        notes: what was found on the way.
    """

    columns: Mapping[str, str]
    scale: Mapping[str, float]
    notes: tuple[str, ...]


def bind(
    names: Sequence[str], place: Place, spec: Spec, description: LogDescription, explicit: Mapping[str, str] | None
) -> Binding:
    """Find a column for every symbol: by explicit options, the description, the spec, or the symbol's own name.

    Args:
        names: the file's columns, standing at ``place``.

    Raises:
        BadInput: for an unknown symbol, a column that is missing, or one that is taken twice.
    """
    symbols = ("t", *spec.positions, *spec.velocities, *(i.name for i in spec.inputs))
    explicit = explicit or {}
    notes = list(_unknown_symbols(symbols, spec, description, explicit))
    columns: dict[str, str] = {}
    for symbol in symbols:
        name, origin = _choice(symbol, spec, description, explicit)
        if name in names:
            columns[symbol] = name
            continue
        by_name = origin is None or (description.listed and symbol not in explicit and symbol in description.columns)
        if symbol in spec.velocities and by_name:
            continue
        if symbol == "t" and origin is None and description.sample_rate_hz:
            notes.append(f"no column t: time counted at the description's {description.sample_rate_hz:g} Hz")
            continue
        said = f", which {origin} asks for as `{symbol}`" if origin else ""
        wanted = f"one of the columns {listing(names)} (or `columns: {{{symbol}: ...}}` in a log description)"
        raise BadInput(place, f"no column `{shown(name)}`{said}", wanted, _nearest(name, names))
    _drop_some_velocities(columns, spec, description, notes)
    _refuse_twice(columns, place)
    scale = {s: float(description.scale.get(s, spec.log.scale.get(s, 1.0))) for s in symbols}
    if not scale["t"] > 0:
        where = description.place("scale.t") if "t" in description.scale else spec.place("log.scale.t")
        raise BadInput(where, f"factor {scale['t']:g}", "a positive factor for time")
    return Binding(columns, scale, tuple(notes))


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


def _unknown_symbols(
    symbols: Sequence[str], spec: Spec, description: LogDescription, explicit: Mapping[str, str]
) -> list[str]:
    expected = f"one of {', '.join(symbols)}, a name of {spec.name}"
    for symbol in explicit:
        if symbol not in symbols:
            raise BadInput(
                Place("column option"), f"unknown name `{shown(symbol)}`", expected, nearest_name(symbol, symbols)
            )
    for section, keys in (("columns", description.columns), ("scale", description.scale)):
        if section == "columns" and description.listed:
            continue
        for symbol in keys:
            if symbol not in symbols:
                place = description.place(f"{section}.{symbol}")
                raise BadInput(place, f"unknown name `{shown(symbol)}`", expected, nearest_name(symbol, symbols))
    extra = [s for s in description.columns if s not in symbols]
    return [f"columns that {spec.name} does not use: {listing(extra)}"] if extra else []


def _drop_some_velocities(columns: dict[str, str], spec: Spec, description: LogDescription, notes: list[str]) -> None:
    logged = [v for v in spec.velocities if v in columns]
    if logged and len(logged) < len(spec.velocities):
        notes.append(f"velocity of some coordinates only ({', '.join(logged)}): left unused")
        for v in logged:
            del columns[v]
    elif not logged and description.velocity_columns:
        notes.append("the description speaks of velocity columns, and there is none")


def _refuse_twice(columns: Mapping[str, str], place: Place) -> None:
    owner: dict[str, str] = {}
    for symbol, name in columns.items():
        if name in owner:
            raise BadInput(
                place, f"column `{shown(name)}` for both {owner[name]} and {symbol}", "a column of its own for each"
            )
        owner[name] = symbol


def _nearest(name: str, names: Sequence[str]) -> str | None:
    lowered = {n.lower(): n for n in names}
    nearest = nearest_name(name, names) or lowered.get(nearest_name(name.lower(), lowered) or "")
    return shown(nearest) if nearest else None
