"""The description of a log, meta.yaml: names, units and scales of its columns, and how to filter them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PrivateAttr

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_text
from codegen.base.user_text import brief
from codegen.spec.expression import exact_number
from codegen.spec.model import Spec
from codegen.spec.quantity import read_factor, read_quantity, read_share, with_any_unit
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_plain

DECIMALS = {"": "", "point": ".", "comma": ","}
ZERO_ORDER = ("zero-order", "zero order", "zoh")
"""Beginnings of ``input_hold`` for commands that are held from row to row."""
LINEAR = ("linear", "first-order", "first order", "foh")
"""Beginnings of ``input_hold`` for inputs that were measured, such as a current."""
ROUNDED = 0.05
"""Largest share by which a stated sample rate and sample time contradict each other by rounding: 4 ms for 240 Hz."""
Naming = Mapping[str, str] | None
"""Symbol → column, as a caller or the option ``--column`` names it; None for none."""
Read = Callable[[Any, Place], Any]
"""A value of the file and its place → the value in SI; raises BadInput."""


def _by(read: Read) -> Any:
    """A validator that reads a value. pydantic gathers the faults of all values, and ``validate`` places them."""

    def value_of(value: object) -> Any:
        try:
            return read(value, Place(""))
        except BadInput as fault:
            raise ValueError(fault) from None

    return BeforeValidator(value_of)


def _number(unit: str = "1", holds: Callable[[float], bool] = lambda number: True, expected: str = "a number") -> Read:
    """The reader of a number, or of a number with its unit such as 1 ms."""

    def read(value: Any, place: Place) -> float:
        text = str(value).strip()
        number = float(read_quantity(text, unit, place))
        if not holds(number):
            raise BadInput(place, f"`{brief(text)}`", expected, code="SPEC006")
        return number

    return read


def _positive(unit: str) -> Read:
    return _number(unit, lambda number: number > 0, "a positive number")


class Stated(float):
    """A number in SI. ``unit``: that with which it is written, empty for none."""

    unit: str

    def __new__(cls, number: float, unit: str = "") -> Stated:
        made = super().__new__(cls, number)
        made.unit = unit
        return made


def _lengths(value: Any, place: Place) -> tuple[Stated, ...]:
    read = [with_any_unit(str(one), place) for one in (value if isinstance(value, list) else [value])]
    lengths = tuple(Stated(float(number), unit) for number, unit in read)
    if min(lengths, default=0.0) < 0:
        raise BadInput(place, f"`{brief(str(value))}`", "zero or a positive number", code="SPEC006")
    return lengths


def _factor(value: Any, place: Place) -> Stated:
    return Stated(*read_factor(value, place))


class Listed(dict[str, str]):
    """Columns that were given as a plain list of names."""


def _columns(value: object) -> dict[str, str]:
    if isinstance(value, list) and all(isinstance(v, str) for v in value):
        return Listed(zip(value, value, strict=True))
    if isinstance(value, dict) and all(isinstance(v, (str, int, float)) for v in value.values()):
        return {k: str(v) for k, v in value.items()}
    raise ValueError("expected a list of column names, or a mapping such as {t: time, x: position}")


def _header(value: Any, place: Place) -> int:
    number = 0 if value == "none" else exact_number(str(value), place)
    if value != "none" and not (number >= 1 and number == int(number)):
        raise BadInput(place, f"`{value}`", "the number of a line, counted from 1, or `none`", code="SPEC006")
    return int(number)


def _period(value: Any, place: Place) -> float:
    """A positive number, or an expression of numbers such as ``2*pi``."""
    period, _ = read_factor(value, place)
    if period < 0:
        raise BadInput(place, f"`{value}`", "a positive number, or an expression such as 2*pi", code="SPEC006")
    return period


Names = Annotated[list[str], BeforeValidator(lambda value: value if isinstance(value, list) else [value])]
_KEYS = ConfigDict(extra="forbid", frozen=True, coerce_numbers_to_str=True)


class BesideSection(BaseModel):
    """Another file of the log. ``time``: its time column; empty if its rows belong to those of the log by number."""

    model_config = _KEYS

    file: str
    time: str = ""


class LongSection(BaseModel):
    """The columns of a long table with the name of a signal and its value."""

    model_config = _KEYS

    name: str
    value: str


class EvaluationSection(BaseModel):
    """Filtering of the log for an evaluation: start, trim at both ends, and time between restarts, in s."""

    model_config = _KEYS

    filter: str = ""
    cutoff_hz: Annotated[float | None, _by(_positive("1/s"))] = None
    trim_s: Annotated[float | None, _by(_number("s", lambda t: t >= 0, "zero or a positive time"))] = None
    restart_s: Annotated[float | None, _by(_positive("s"))] = None
    from_s: Annotated[float | None, _by(_number("s"))] = None


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
        sample_rate_hz: nominal rate; that of ``sample_time`` where a file states both, which differ by rounding.
        input_hold, input_is: as written.
        encoder_step, position_noise_rms: one number a coordinate (a single one for all), m or rad; zero: none.
    """

    model_config = _KEYS

    columns: Annotated[Any, BeforeValidator(_columns)] = {}
    scale: dict[str, Annotated[Any, _by(_factor)]] = Field(default={}, examples=["{x: 0.001}"])
    units: dict[str, str] = {}
    header: Annotated[int | None, _by(_header)] = None
    decimal: Annotated[Literal["", "point", "comma"], AfterValidator(lambda word: DECIMALS[word])] = ""
    records: str = ""
    beside: dict[
        str, Annotated[BesideSection, BeforeValidator(lambda v: {"file": v} if isinstance(v, str) else v)]
    ] = {}
    signed16: Names = []
    signed32: Names = []
    unwrap: dict[str, Annotated[float, _by(_period)]] = Field(default={}, examples=["{q: 2*pi}"])
    rows: dict[str, Annotated[float, _by(_number())]] = Field(default={}, examples=["{motor: 1}"])
    long: LongSection | None = None
    late: dict[str, Annotated[float, _by(_number("s"))]] = Field(default={}, examples=["{i: 2 ms}"])
    hold: Names = []
    cutoff_hz: Annotated[float | None, _by(_positive("1/s"))] = None
    missing: Literal["refuse", "fill", "join"] = "refuse"
    parameter_tolerance: Annotated[float | None, _by(lambda value, place: read_share(str(value), place))] = None
    sample_rate_hz: Annotated[float | None, _by(_positive("1/s"))] = None
    sample_time: Annotated[float | None, _by(_positive("s"))] = None
    input_hold: str = ""
    input_is: str = ""
    velocity_columns: bool | None = None
    encoder_step: Annotated[Any, _by(_lengths)] = None
    position_noise_rms: Annotated[Any, _by(_lengths)] = None
    evaluation: EvaluationSection = EvaluationSection()
    _file: str = PrivateAttr("")
    _places: Mapping[str, Place] = PrivateAttr({})

    @property
    def file(self) -> str:
        """Its name, empty where there is none."""
        return self._file

    @property
    def places(self) -> Mapping[str, Place]:
        """Key → its file and line."""
        return self._places

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
        return self.places.get(key, Place(self.file or "a description", None, key))

    def with_columns(self, spec: Spec, explicit: Naming) -> LogDescription:
        """The description by which a file is opened: also with the columns that the spec and the command name."""
        if self.listed:
            return self
        return self.model_copy(update={"columns": {**spec.log.columns, **self.columns, **(explicit or {})}})

    def stated_scale(self, symbol: str, spec: Spec) -> float:
        """The ``scale`` of a symbol here, or else in the spec; 1 where neither states one."""
        return float(self.scale.get(symbol, spec.log.scale.get(symbol, 1.0)))


EMPTY_DESCRIPTION = LogDescription()
"""The description of a log without one; made once, since every block of rows is a log."""


def read_description(path: str | Path) -> LogDescription:
    """Read a description file.

    Raises BadInput if it cannot be read, is not a YAML mapping, or holds an unknown key or an unusable value.
    """
    path = Path(path)
    document, places = load_plain(read_text(path, "what meta.yaml says of a log (YAML)"), str(path), "columns: {x: qm}")
    description = validate(LogDescription, document, places, str(path))
    rate, stated = 1 / description.sample_time if description.sample_time else None, description.sample_rate_hz
    if rate and stated and abs(stated / rate - 1) > ROUNDED:
        found = f"{stated:g} Hz, where `sample_time` says {rate:g} Hz"
        raise BadInput(places["sample_rate_hz"], found, "one of the two, or one rate", code="LOG013")
    rate = rate or stated
    cutoff = description.cutoff_hz or description.evaluation.cutoff_hz
    description = description.model_copy(update={"sample_rate_hz": rate, "cutoff_hz": cutoff})
    description._file, description._places = str(path), places
    return description
