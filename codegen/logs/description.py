"""A log's description: a small YAML that says how the columns are called, scaled and to be filtered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict

from codegen.errors import Place, nearest_name
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_mapping, plain, read_text

LARGEST_FACTOR = 1e30


@dataclass(frozen=True)
class LogDescription:
    """What a description file says.

    Attributes:
        file: its name, empty where there is none.
        columns: ``t``, coordinate, velocity or input → the column's name in the log.
        listed: whether ``columns`` was a plain list of names.
        scale: ``t``, coordinate, velocity or input → factor from the column to SI.
        cutoff_hz: Hz, from ``cutoff_hz`` or else ``evaluation.cutoff_hz``.
        tolerance: relative uncertainty of the declared parameters.
        fill_missing: whether isolated values that are not finite may be filled in (``missing: fill``); else refused.
        sample_rate_hz: nominal rate.
        input_hold, input_is: as written.
        encoder_step, position_noise: one number a coordinate (a single one stands for all), m or rad; zero for none.
        trim_s: seconds to leave out at both ends of an evaluation.
        restart_s: seconds between restarts of a free-run simulation.
        unknown: words on keys that nothing reads.
        places: where each key stands.
    """

    file: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    listed: bool = False
    scale: Mapping[str, float] = field(default_factory=dict)
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
    unknown: tuple[str, ...] = ()
    places: Mapping[str, Place] = field(default_factory=dict)

    def place(self, key: str) -> Place:
        """Where a key stands; the file alone if it has no line."""
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


def _positive(value: object) -> float:
    number = _number(value)
    if not number > 1 / LARGEST_FACTOR:
        raise ValueError("expected a positive number")
    return number


def _not_negative(value: object) -> float:
    number = _number(value)
    if number < 0:
        raise ValueError("expected zero or a positive number")
    return number


def _factor(value: object) -> float:
    number = _number(value)
    if not abs(number) >= 1 / LARGEST_FACTOR:
        raise ValueError("expected a factor other than zero")
    return number


def _share(value: object) -> float:
    text = str(value).strip()
    number = _number(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    if not 0 <= number < 1:
        raise ValueError("expected a share such as 1% or 0.01")
    return number


def _numbers(value: object) -> list[float]:
    return [_not_negative(v) for v in (value if isinstance(value, list) else [value])]


def _columns(value: object) -> list[str] | dict[str, str]:
    if isinstance(value, list) and all(isinstance(v, str) for v in value):
        return value
    if isinstance(value, dict) and all(isinstance(v, (str, int, float)) for v in value.values()):
        return {k: str(v) for k, v in value.items()}
    raise ValueError("expected a list of column names, or a mapping such as {t: time, x: position}")


Positive = Annotated[float | None, BeforeValidator(_positive)]
NotNegative = Annotated[float | None, BeforeValidator(_not_negative)]
Numbers = Annotated[list[float] | None, BeforeValidator(_numbers)]


class EvaluationSection(BaseModel):
    """How an evaluation filters and cuts; unknown keys are told in the log's notes."""

    model_config = ConfigDict(extra="allow", frozen=True)

    filter: str = ""
    cutoff_hz: Positive = None
    trim_s: NotNegative = None
    restart_s: Positive = None


class DescriptionDocument(BaseModel):
    """The file's shape; unknown keys are told in the log's notes."""

    model_config = ConfigDict(extra="allow", frozen=True)

    columns: Annotated[Any, BeforeValidator(_columns)] = {}
    scale: dict[str, Annotated[float, BeforeValidator(_factor)]] = {}
    cutoff_hz: Positive = None
    missing: Literal["refuse", "fill"] = "refuse"
    parameter_tolerance: Annotated[float | None, BeforeValidator(_share)] = None
    sample_rate_hz: Positive = None
    input_hold: str = ""
    input_is: str = ""
    velocity_columns: bool | None = None
    encoder_step: Numbers = None
    position_noise_rms: Numbers = None
    evaluation: EvaluationSection = EvaluationSection()


def read_description(path: str | Path) -> LogDescription:
    """Read a description file.

    Raises:
        BadInput: if it cannot be read, is not a YAML mapping, or a known key holds what cannot be used.
    """
    path = Path(path)
    document, places = load_mapping(read_text(path, "a log description (YAML)"), str(path), "columns: {x: qm}")
    d = validate(DescriptionDocument, plain(document), places, str(path))
    listed = isinstance(d.columns, list)
    return LogDescription(
        file=str(path),
        columns={name: name for name in d.columns} if listed else d.columns,
        listed=listed,
        scale=d.scale,
        cutoff_hz=d.cutoff_hz or d.evaluation.cutoff_hz,
        tolerance=d.parameter_tolerance,
        fill_missing=d.missing == "fill",
        sample_rate_hz=d.sample_rate_hz,
        input_hold=d.input_hold,
        input_is=d.input_is,
        velocity_columns=d.velocity_columns,
        encoder_step=tuple(d.encoder_step) if d.encoder_step else None,
        position_noise=tuple(d.position_noise_rms) if d.position_noise_rms else None,
        trim_s=d.evaluation.trim_s,
        restart_s=d.evaluation.restart_s,
        unknown=(*_unknown(d, path.name, ""), *_unknown(d.evaluation, path.name, "evaluation.")),
        places=places,
    )


def _unknown(section: BaseModel, file: str, prefix: str) -> list[str]:
    known = sorted(type(section).model_fields)
    words = []
    for key in section.model_extra or {}:
        nearest = nearest_name(key, known)
        hint = f" (did you mean `{prefix}{nearest}`?)" if nearest else ""
        words.append(f"{file}: nothing reads the key `{prefix}{key}`{hint}")
    return words
