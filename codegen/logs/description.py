"""A log's description: a small YAML that says how the columns are called, scaled and to be filtered."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_text
from codegen.spec.expression import parse_expression
from codegen.spec.quantity import read_quantity, split_quantity, with_any_unit
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_plain

LARGEST_FACTOR = 1e30
ZERO_ORDER = ("zero-order", "zero order", "zoh")
"""Beginnings of ``input_hold`` for commands that are held from row to row."""
LINEAR = ("linear", "first-order", "first order", "foh")
"""Beginnings of ``input_hold`` for inputs that were measured, such as a current."""


@dataclass(frozen=True)
class LogDescription:
    """What a description file says.

    Attributes:
        file: its name, empty where there is none.
        columns: ``t``, coordinate, velocity or input → the column's name or number in the log, or an expression.
        listed: whether ``columns`` was a plain list of names.
        scale: ``t``, coordinate, velocity or input → factor from the column to SI, beside that of its unit.
        units: ``t``, coordinate, velocity or input → the column's unit.
        header: line of a text table's header counted from 1, 0 for none; None where nobody said.
        decimal: the sign before the decimals of a text table; empty where nobody said.
        records: the key of a JSON file under which the rows stand; empty where nobody said.
        beside: name → file in the log's folder whose rows belong to those of the log.
        beside_time: name → column of that file with times of its own, of the clock of the log's.
        signed: column → bits of the signed numbers that it holds, stored as if they were unsigned.
        unwrap: column → amount after which its numbers start anew.
        rows: column → number that it has in the rows of this log; the others are left out.
        long: ``name`` and ``value`` → the column of a table with a row for each value; empty for a row for each time.
        hold: topics or columns whose value holds until the next one, where topics of several rates are joined.
        cutoff_hz: Hz, from ``cutoff_hz`` or else ``evaluation.cutoff_hz``.
        tolerance: relative uncertainty of the declared parameters.
        fill_missing: whether isolated values that are not finite may be filled in (``missing: fill``); else refused.
        join_missing: whether each column was logged at times of its own, at which the others are empty.
        sample_rate_hz: nominal rate.
        input_hold, input_is: as written.
        encoder_step, position_noise: one number a coordinate (a single one stands for all), m or rad; zero for none.
        written_units: ``encoder_step`` and ``position_noise_rms`` → the unit that each number was written with, empty
            where it has none.
        trim_s: seconds to leave out at both ends of an evaluation.
        restart_s: seconds between restarts of a free-run simulation.
        places: key → its file and line.
    """

    file: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    listed: bool = False
    scale: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    header: int | None = None
    decimal: str = ""
    records: str = ""
    beside: Mapping[str, str] = field(default_factory=dict)
    beside_time: Mapping[str, str] = field(default_factory=dict)
    signed: Mapping[str, int] = field(default_factory=dict)
    unwrap: Mapping[str, float] = field(default_factory=dict)
    rows: Mapping[str, float] = field(default_factory=dict)
    long: Mapping[str, str] = field(default_factory=dict)
    hold: tuple[str, ...] = ()
    cutoff_hz: float | None = None
    tolerance: float | None = None
    sample_rate_hz: float | None = None
    input_hold: str = ""
    input_is: str = ""
    velocity_columns: bool | None = None
    encoder_step: tuple[float, ...] | None = None
    position_noise: tuple[float, ...] | None = None
    trim_s: float | None = None
    restart_s: float | None = None
    fill_missing: bool = False
    join_missing: bool = False
    written_units: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)

    @property
    def measured_inputs(self) -> bool:
        """Whether a row's input was measured at its time, and is not a command held until the next row."""
        return self.input_hold.lower().startswith(LINEAR)

    def place(self, key: str) -> Place:
        """File and line of a key; the file alone if it has no line."""
        return self.places.get(key, Place(self.file, None, key))


def _number(value: object) -> float:
    if not isinstance(value, (str, int, float)) or isinstance(value, bool):
        raise ValueError("expected a number")
    try:
        number = float(value)
    except (ValueError, OverflowError):
        raise ValueError("expected a number") from None
    if not abs(number) <= LARGEST_FACTOR:
        raise ValueError("expected a finite number")
    return number


def _number_that(holds: Callable[[float], bool], expected: str) -> Callable[[object], float]:
    def checked(value: object) -> float:
        number = _number(value)
        if not holds(number):
            raise ValueError(f"expected {expected}")
        return number

    return checked


_positive = _number_that(lambda number: number > 1 / LARGEST_FACTOR, "a positive number")
_not_negative = _number_that(lambda number: number >= 0, "zero or a positive number")
_factor = _number_that(lambda number: abs(number) >= 1 / LARGEST_FACTOR, "a factor other than zero")


def _share(value: object) -> float:
    text = str(value).strip()
    number = _number(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    if not 0 <= number < 1:
        raise ValueError("expected a share such as 1% or 0.01")
    return number


def _with_unit(check: Callable[[object], float]) -> Callable[[object], str]:
    """A validator of a number, or of one with its unit such as 1 um, which is brought to SI later, with its place."""

    def checked(value: object) -> str:
        parts = split_quantity(value) if isinstance(value, str) else None
        number = check(value if parts is None else parts[0])
        return repr(number) if parts is None else f"{value}"

    return checked


def _quantities(value: object) -> list[str]:
    return [_with_unit(_not_negative)(v) for v in (value if isinstance(value, list) else [value])]


def _texts(value: object, expected: str = "a mapping of names to text") -> dict[str, str]:
    if isinstance(value, dict) and all(isinstance(v, (str, int, float)) for v in value.values()):
        return {k: str(v) for k, v in value.items()}
    raise ValueError(f"expected {expected}")


def _columns(value: object) -> list[str] | dict[str, str]:
    if isinstance(value, list) and all(isinstance(v, str) for v in value):
        return value
    return _texts(value, "a list of column names, or a mapping such as {t: time, x: position}")


def _header(value: object) -> int:
    if value == "none":
        return 0
    number = _number(value)
    if not (number >= 1 and number == int(number)):
        raise ValueError("expected the number of a line, counted from 1, or `none`")
    return int(number)


def _names(value: object) -> list[str]:
    given = value if isinstance(value, list) else [value]
    if not all(isinstance(v, (str, int)) and not isinstance(v, bool) for v in given):
        raise ValueError("expected the name of a column, or a list of them")
    return [str(v) for v in given]


def _beside(value: object) -> object:
    return {"file": value} if isinstance(value, str) else value


def _period(value: object) -> float:
    """A positive number, or an expression of numbers such as ``2*pi``."""
    if not isinstance(value, (str, int, float)) or isinstance(value, bool):
        raise ValueError("expected a positive number, or an expression such as 2*pi")
    try:
        return _positive(float(parse_expression(value, Place("")).symbolic({})))
    except BadInput:
        raise ValueError("expected a positive number, or an expression such as 2*pi") from None


Texts = Annotated[dict[str, str], BeforeValidator(lambda value: _texts(value))]
Names = Annotated[list[str], BeforeValidator(_names)]
Positive = Annotated[str | None, BeforeValidator(_with_unit(_positive))]
NotNegative = Annotated[str | None, BeforeValidator(_with_unit(_not_negative))]
Quantities = Annotated[list[str] | None, BeforeValidator(_quantities)]


class BesideSection(BaseModel):
    """A file beside the log, and its column of times; none for rows that belong to those of the log by number."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    file: str
    time: Annotated[str, BeforeValidator(str)] = ""


class LongSection(BaseModel):
    """The columns of a long table with the name of a signal and its value."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    value: str


class EvaluationSection(BaseModel):
    """How an evaluation filters and cuts."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    filter: str = ""
    cutoff_hz: Positive = None
    trim_s: NotNegative = None
    restart_s: Positive = None


class DescriptionDocument(BaseModel):
    """The file's shape."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    columns: Annotated[Any, BeforeValidator(_columns)] = {}
    scale: dict[str, Annotated[float, BeforeValidator(_factor)]] = {}
    units: Texts = {}
    header: Annotated[int | None, BeforeValidator(_header)] = None
    decimal: Literal["", "point", "comma"] = ""
    records: str = ""
    beside: dict[str, Annotated[BesideSection, BeforeValidator(_beside)]] = {}
    signed16: Names = []
    signed32: Names = []
    unwrap: dict[str, Annotated[float, BeforeValidator(_period)]] = {}
    rows: dict[str, Annotated[float, BeforeValidator(_number)]] = {}
    long: LongSection | None = None
    hold: Names = []
    cutoff_hz: Positive = None
    missing: Literal["refuse", "fill", "join"] = "refuse"
    parameter_tolerance: Annotated[float | None, BeforeValidator(_share)] = None
    sample_rate_hz: Positive = None
    sample_time: Positive = None
    input_hold: str = ""
    input_is: str = ""
    velocity_columns: bool | None = None
    encoder_step: Quantities = None
    position_noise_rms: Quantities = None
    evaluation: EvaluationSection = EvaluationSection()


def read_description(path: str | Path) -> LogDescription:
    """Read a description file.

    Raises:
        BadInput: if it cannot be read, is not a YAML mapping, holds an unknown key, or one with what cannot be used.
    """
    path = Path(path)
    document, places = load_plain(read_text(path, "a log description (YAML)"), str(path), "columns: {x: qm}")
    d = validate(DescriptionDocument, document, places, str(path))
    listed = isinstance(d.columns, list)

    def place(key: str) -> Place:
        return places.get(key, Place(str(path), None, key))

    def in_si(text: str | None, unit: str, key: str) -> float | None:
        return None if text is None else float(read_quantity(text, unit, place(key)))

    written = {"encoder_step": d.encoder_step, "position_noise_rms": d.position_noise_rms}
    lengths = {key: [with_any_unit(text, place(key)) for text in texts] for key, texts in written.items() if texts}
    values = {key: tuple(float(value) for value, _ in read) for key, read in lengths.items()}
    cutoff = in_si(d.cutoff_hz, "1/s", "cutoff_hz") or in_si(d.evaluation.cutoff_hz, "1/s", "evaluation.cutoff_hz")
    rate, period = in_si(d.sample_rate_hz, "1/s", "sample_rate_hz"), in_si(d.sample_time, "s", "sample_time")
    return LogDescription(
        file=str(path),
        columns={name: name for name in d.columns} if listed else d.columns,
        listed=listed,
        scale=d.scale,
        units=d.units,
        header=d.header,
        decimal={"": "", "point": ".", "comma": ","}[d.decimal],
        records=d.records,
        beside={name: beside.file for name, beside in d.beside.items()},
        beside_time={name: beside.time for name, beside in d.beside.items() if beside.time},
        signed={**dict.fromkeys(d.signed16, 16), **dict.fromkeys(d.signed32, 32)},
        unwrap=d.unwrap,
        rows=d.rows,
        long=d.long.model_dump() if d.long else {},
        hold=tuple(d.hold),
        cutoff_hz=cutoff,
        tolerance=d.parameter_tolerance,
        fill_missing=d.missing == "fill",
        join_missing=d.missing == "join",
        sample_rate_hz=1 / period if period else rate,
        input_hold=d.input_hold,
        input_is=d.input_is,
        velocity_columns=d.velocity_columns,
        encoder_step=values.get("encoder_step"),
        position_noise=values.get("position_noise_rms"),
        written_units={key: tuple(unit for _, unit in read) for key, read in lengths.items()},
        trim_s=in_si(d.evaluation.trim_s, "s", "evaluation.trim_s"),
        restart_s=in_si(d.evaluation.restart_s, "s", "evaluation.restart_s"),
        places=places,
    )
