"""The description of a log, meta.yaml: names, units and scales of its columns, and how to filter them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, PrivateAttr, ValidationInfo

from codegen.base.errors import BadInput, Faults, Place
from codegen.base.input_files import read_text
from codegen.spec.expression import parse_expression
from codegen.spec.model import Spec
from codegen.spec.quantity import LARGEST_FACTOR, read_factor, read_quantity, split_quantity, with_any_unit
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_plain

DECIMALS = {"": "", "point": ".", "comma": ","}
ZERO_ORDER = ("zero-order", "zero order", "zoh")
"""Beginnings of ``input_hold`` for commands that are held from row to row."""
LINEAR = ("linear", "first-order", "first order", "foh")
"""Beginnings of ``input_hold`` for inputs that were measured, such as a current."""


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


def _share(value: object) -> float:
    text = str(value).strip()
    number = _number(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    if not 0 <= number < 1:
        raise ValueError("expected a share such as 1% or 0.01")
    return number


@dataclass(frozen=True)
class _Reading:
    """The context of the validators of quantities: the places of keys, and the faults of units found so far."""

    file: str
    places: Mapping[str, Place]
    faults: Faults = field(default_factory=Faults)

    def place(self, key: str) -> Place:
        return self.places.get(key, Place(self.file, None, key))


def _quantity(check: Callable[[object], float], unit: str, section: str = "") -> Any:
    """A validator of a number, or of a number with its unit such as 1 ms, which is converted to SI."""

    def read(value: object, info: ValidationInfo) -> float:
        parts = split_quantity(value) if isinstance(value, str) else None
        number = check(value if parts is None else parts[0])
        reading: Any = info.context
        if parts is not None:
            with reading.faults.noting():
                return float(read_quantity(str(value), unit, reading.place(f"{section}{info.field_name}")))
        return number

    return BeforeValidator(read)


class Lengths(tuple[float, ...]):
    """Numbers in SI. ``units``: the unit that each was written with; empty for none."""

    units: tuple[str, ...] = ()


def _lengths(value: object, info: ValidationInfo) -> Lengths:
    reading: Any = info.context
    read: list[tuple[Any, str]] = []
    for one in value if isinstance(value, list) else [value]:
        parts = split_quantity(one) if isinstance(one, str) else None
        number = _not_negative(one if parts is None else parts[0])
        read.append((number, ""))
        if parts is not None:
            with reading.faults.noting():
                read[-1] = with_any_unit(str(one), reading.place(str(info.field_name)))
    lengths = Lengths(float(number) for number, _ in read)
    lengths.units = tuple(unit for _, unit in read)
    return lengths


def _texts(value: object, expected: str = "a mapping of names to text") -> dict[str, str]:
    if isinstance(value, dict) and all(isinstance(v, (str, int, float)) for v in value.values()):
        return {k: str(v) for k, v in value.items()}
    raise ValueError(f"expected {expected}")


class Listed(dict[str, str]):
    """Columns that were given as a plain list of names."""


def _columns(value: object) -> dict[str, str]:
    if isinstance(value, list) and all(isinstance(v, str) for v in value):
        return Listed(zip(value, value, strict=True))
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
        return _positive(_value(value))
    except BadInput:
        raise ValueError("expected a positive number, or an expression such as 2*pi") from None


class Factors(dict[str, float]):
    """Symbol → factor in SI. ``units``: symbol → the unit that its factor was written with, if any."""

    units: Mapping[str, str] = {}


def _scales(value: object, info: ValidationInfo) -> Factors:
    if not isinstance(value, dict):
        raise ValueError("expected a mapping of names to factors")
    reading: Any = info.context
    factors, units = Factors(), {}
    for name, one in value.items():
        with reading.faults.noting():
            factors[str(name)], units[str(name)] = read_factor(one, reading.place(f"scale.{name}"))
    factors.units = {name: unit for name, unit in units.items() if unit}
    return factors


def _times(value: object, info: ValidationInfo) -> dict[str, float]:
    """Symbol → time in s, of either sign."""
    if not isinstance(value, dict):
        raise ValueError("expected a mapping of names to times such as {i: 2 ms}")
    reading: Any = info.context
    times = {}
    for name, one in value.items():
        parts = split_quantity(one) if isinstance(one, str) else None
        times[str(name)] = _number(one if parts is None else parts[0])
        if parts is not None:
            with reading.faults.noting():
                times[str(name)] = float(read_quantity(str(one), "s", reading.place(f"late.{name}")))
    return times


def _value(expression: str | float) -> float:
    """The value of an expression of numbers.

    Raises:
        BadInput: for a name, or what is no real number.
    """
    return float(parse_expression(expression, Place("")).symbolic({}))


Texts = Annotated[dict[str, str], BeforeValidator(lambda value: _texts(value))]
Names = Annotated[list[str], BeforeValidator(_names)]
Positive = Annotated[float | None, _quantity(_positive, "1/s")]


class BesideSection(BaseModel):
    """Another file of the log. ``time``: its time column; empty if its rows belong to those of the log by number."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    file: str
    time: Annotated[str, BeforeValidator(str)] = ""


class LongSection(BaseModel):
    """The columns of a long table with the name of a signal and its value."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    value: str


class EvaluationSection(BaseModel):
    """Filtering and cutting of the log for an evaluation.

    Attributes:
        trim_s: seconds to leave out at both ends.
        restart_s: seconds between restarts of a free-run simulation.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    filter: str = ""
    cutoff_hz: Annotated[float | None, _quantity(_positive, "1/s", "evaluation.")] = None
    trim_s: Annotated[float | None, _quantity(_not_negative, "s", "evaluation.")] = None
    restart_s: Annotated[float | None, _quantity(_positive, "s", "evaluation.")] = None


class LogDescription(BaseModel):
    """The keys of a description file; quantities in SI.

    Attributes:
        columns: ``t``, coordinate, velocity or input → the column's name or number in the log, or an expression.
        scale: ``t``, coordinate, velocity or input → factor from the column to SI, in addition to that of its unit.
        units: ``t``, coordinate, velocity or input → the column's unit.
        header: line of a text table's header counted from 1, 0 for none; None if not stated.
        decimal: the decimal separator of a text table; empty if not stated.
        records: the key of a JSON file that holds the rows; empty if not stated.
        beside: name → file in the log's folder, and its column of times.
        signed16, signed32: columns of signed numbers of so many bits, stored as if they were unsigned.
        unwrap: column → period of its numbers, by which they jump at an overflow.
        rows: column → number that it has in the rows of this log; the others are left out.
        long: columns of a table with a row for each value; None for a row for each time.
        late: symbol → by how much its values are logged late, in s; negative if they are early.
        hold: topics or columns whose value holds until the next one, where topics of several rates are joined.
        cutoff_hz: Hz; where it is absent that of ``evaluation``.
        missing: ``fill`` for isolated values that are not finite; ``join`` where each column was logged at times of its
            own, at which the others are empty.
        parameter_tolerance: relative uncertainty of the declared parameters.
        sample_rate_hz: nominal rate; ``sample_time`` takes precedence.
        input_hold, input_is: as written.
        encoder_step, position_noise_rms: one number a coordinate (a single one stands for all), m or rad; zero: none.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    columns: Annotated[Any, BeforeValidator(_columns)] = {}
    scale: Annotated[Any, BeforeValidator(_scales)] = Factors()
    units: Texts = {}
    header: Annotated[int | None, BeforeValidator(_header)] = None
    decimal: Annotated[Literal["", "point", "comma"], AfterValidator(lambda word: DECIMALS[word])] = ""
    records: str = ""
    beside: dict[str, Annotated[BesideSection, BeforeValidator(_beside)]] = {}
    signed16: Names = []
    signed32: Names = []
    unwrap: dict[str, Annotated[float, BeforeValidator(_period)]] = {}
    rows: dict[str, Annotated[float, BeforeValidator(_number)]] = {}
    long: LongSection | None = None
    late: Annotated[dict[str, float], BeforeValidator(_times)] = {}
    hold: Names = []
    cutoff_hz: Positive = None
    missing: Literal["refuse", "fill", "join"] = "refuse"
    parameter_tolerance: Annotated[float | None, BeforeValidator(_share)] = None
    sample_rate_hz: Positive = None
    sample_time: Annotated[float | None, _quantity(_positive, "s")] = None
    input_hold: str = ""
    input_is: str = ""
    velocity_columns: bool | None = None
    encoder_step: Annotated[Any, BeforeValidator(_lengths)] = None
    position_noise_rms: Annotated[Any, BeforeValidator(_lengths)] = None
    evaluation: EvaluationSection = EvaluationSection()
    _reading: _Reading = PrivateAttr(_Reading("", {}))

    @property
    def file(self) -> str:
        """Its name, empty where there is none."""
        return self._reading.file

    @property
    def places(self) -> Mapping[str, Place]:
        """Key → its file and line."""
        return self._reading.places

    @property
    def listed(self) -> bool:
        """Whether ``columns`` was a plain list of names."""
        return isinstance(self.columns, Listed)

    @property
    def signed(self) -> dict[str, int]:
        """Column → bits of its signed numbers."""
        return {**dict.fromkeys(self.signed16, 16), **dict.fromkeys(self.signed32, 32)}

    @property
    def measured_inputs(self) -> bool:
        """Whether a row's input was measured at its time, and is not a command held until the next row."""
        return self.input_hold.lower().startswith(LINEAR)

    def place(self, key: str) -> Place:
        """File and line of a key; the file alone if it has no line."""
        return self._reading.place(key)

    def stated_scale(self, symbol: str, spec: Spec) -> float:
        """The ``scale`` of a symbol here, or else in the spec; 1 where neither states one."""
        return float(self.scale.get(symbol, spec.log.scale.get(symbol, 1.0)))


EMPTY_DESCRIPTION = LogDescription()
"""The description of a log without one; made once, since every block of rows is a log."""


def read_description(path: str | Path) -> LogDescription:
    """Read a description file.

    Raises:
        BadInput: if it cannot be read, is not a YAML mapping, or holds an unknown key or an unusable value.
    """
    path = Path(path)
    document, places = load_plain(read_text(path, "what meta.yaml says of a log (YAML)"), str(path), "columns: {x: qm}")
    reading = _Reading(str(path), places)
    description = validate(LogDescription, document, places, str(path), reading)
    reading.faults.raise_noted()
    rate = 1 / description.sample_time if description.sample_time else description.sample_rate_hz
    cutoff = description.cutoff_hz or description.evaluation.cutoff_hz
    description = description.model_copy(update={"sample_rate_hz": rate, "cutoff_hz": cutoff})
    description._reading = reading
    return description
