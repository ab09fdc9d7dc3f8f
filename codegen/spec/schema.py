"""Schema of a spec file (pydantic): its keys and the types of their values.

Names, units and expressions are checked afterwards, in ``reader``; here a value is text or a number.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, NonNegativeInt, WithJsonSchema

from codegen.spec.quantity import split_quantity


def _expression_like(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise ValueError("expected an expression or a number")
    return str(value)


def _number_like(value: object) -> object:
    """Numbers stay text, so that 0.1 is the rational 1/10 and not the nearest double."""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise ValueError("expected a number")
    try:
        float(value) if isinstance(value, str) else str(value)  # a whole number may be too large for a double
    except ValueError:
        raise ValueError(
            "expected a number alone, such as 350 or 3.5e-6, without a formula, unit or separators"
        ) from None
    return str(value)


def _quantity_like(value: object) -> object:
    """As ``_number_like``, or a number with a unit, which is checked later, when the required unit is known."""
    if isinstance(value, str) and split_quantity(value) is not None:
        return value
    try:
        return _number_like(value)
    except ValueError:
        raise ValueError("expected a number such as 3.5e-6, or one with its unit such as 1 ms") from None


def _value_beside_unit(value: object) -> object:
    """As ``_number_like``; for a value with its unit, the message says where the unit belongs."""
    parts = split_quantity(value) if isinstance(value, str) else None
    if parts is not None:
        raise ValueError("expected a number alone, and its unit beside it: {{value: {}, unit: {}}}".format(*parts))
    return _number_like(value)


def _list_of(count: int, expected: str) -> BeforeValidator:
    """A validator that refuses all but a list of so many values."""

    def checked(value: object) -> object:
        if not isinstance(value, list) or len(value) != count:
            raise ValueError(f"expected {expected}")
        return value

    return BeforeValidator(checked)


def _path_like(value: str) -> str:
    if not value.strip() or "\0" in value:
        raise ValueError("expected the path of a robot description, relative to the spec")
    return value


def _as_list(value: object) -> object:
    return value if isinstance(value, list) else [value]


_DIGITS = r"\s*[-+]?(\d+(_\d+)*\.?(\d+(_\d+)*)?|\.\d+(_\d+)*)([eE][-+]?\d+)?"
_NUMBER = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": rf"^{_DIGITS}\s*$"}]}
_QUANTITY = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": rf"^{_DIGITS}(\s*$|\s*([^\W\d_]|1/).*$)"}]}
_TEXT_OR_LIST = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
_EXPRESSION = {"type": ["string", "number"]}

Text = Annotated[str, BeforeValidator(_expression_like), WithJsonSchema(_EXPRESSION)]
Number = Annotated[str, BeforeValidator(_number_like), WithJsonSchema(_NUMBER)]
Quantity = Annotated[str, BeforeValidator(_quantity_like), WithJsonSchema(_QUANTITY)]
Unit = Annotated[
    str,
    BeforeValidator(lambda value: "1" if value == 1 and not isinstance(value, bool) else value),  # as YAML reads it
    WithJsonSchema({"anyOf": [{"type": "string"}, {"const": 1}]}),
]
_PAIR = _list_of(2, "a range [low, high], such as [-5, 5] or [0 mm, 40 mm]")
Range = Annotated[list[Number], Field(min_length=2, max_length=2), _PAIR]
QuantityRange = Annotated[list[Quantity], Field(min_length=2, max_length=2), _PAIR]
_TRIPLE = _list_of(3, "three numbers in m/s^2, such as [0, 0, -9.81]")
Vector = Annotated[list[Number], Field(min_length=3, max_length=3), _TRIPLE]
Names = Annotated[list[str], BeforeValidator(_as_list), WithJsonSchema(_TEXT_OR_LIST)]
Terms = Annotated[
    list[Text],
    BeforeValidator(_as_list),
    WithJsonSchema({"anyOf": [_EXPRESSION, {"type": "array", "items": _EXPRESSION}]}),
]
Direction = Annotated[
    dict[str, Text],
    BeforeValidator(lambda value: {value: "1"} if isinstance(value, str) else value),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "object", "additionalProperties": _EXPRESSION}]}),
]


DIALECT = "https://json-schema.org/draft/2020-12/schema"
OF_A_ROBOT = ("coordinates", "friction")
"""Sections that a robot file fills in."""


class Section(BaseModel):
    """A mapping of the file; a key that is not listed is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


class FreeSection(Section):
    """A free gain: ``{free: [low, high]}``."""

    free: Range


GainEntry = Number | FreeSection
Gain = GainEntry | list[GainEntry] | list[list[GainEntry]]


class CoordinateSection(Section):
    velocity: str
    unit: Unit = Field(examples=["m", "rad"])


class InputSection(Section):
    unit: Unit = Field(examples=["N", "N*m", "V"])


class ParameterSection(Section):
    value: Annotated[str, BeforeValidator(_value_beside_unit), WithJsonSchema(_NUMBER)]
    unit: Unit = "1"
    tolerance: Text | None = None


class ContactSection(BaseModel):
    """A contact; further keys are the parameters of its law."""

    model_config = ConfigDict(extra="allow", frozen=True, defer_build=True)

    name: str
    law: str = "coulomb"
    unit: Unit = Field(examples=["N", "N*m"])
    bodies: Names | None = None
    along: Direction | None = None


class FrictionSection(Section):
    distribution: list[list[Text]] | None = Field(default=None, examples=[[[1, 0], [0, 1]]])
    contacts: list[ContactSection]


class BodySection(Section):
    """A body; x, y, z and angle are coordinates in a topology, expressions over them under constraints."""

    mass: Text | None = None
    inertia: Text | None = None
    x: Text | None = None
    y: Text | None = None
    z: Text | None = None
    angle: Text | None = None


class TopologySection(Section):
    bodies: dict[str, BodySection]


class ConstraintsSection(Section):
    bodies: dict[str, BodySection]
    force: dict[str, dict[str, Text]] = {}
    equations: list[Text] = []


class LagrangianSection(Section):
    """Energies; a list is a sum, one entry a body or a spring."""

    kinetic: Terms
    potential: Terms = ["0"]


class LinkToleranceSection(Section):
    """Standard deviations of a robot file's figures, as shares: of masses, centres of mass, inertias and damping."""

    mass: Text | None = None
    centre_of_mass: Text | None = None
    inertia: Text | None = None
    damping: Text | None = None


class RobotSection(Section):
    """A robot description file, relative to the spec; ``gravity`` in the base's frame, m/s^2."""

    file: Annotated[str, AfterValidator(_path_like)]
    gravity: Vector = ["0", "0", "-9.81"]
    tolerance: LinkToleranceSection | None = None
    base_parameters: dict[str, Number] = {}


def _robot_section(value: Any) -> dict[Any, Any]:
    """The section as a mapping; ValueError for neither a text nor a mapping."""
    if isinstance(value, str):
        return {"file": value}
    if not isinstance(value, dict):
        raise ValueError("expected the path of a robot description, or a mapping with `file:`")
    return value


class RobotDocument(BaseModel):
    """The section ``urdf`` of a spec alone; a text is the file."""

    urdf: Annotated[RobotSection, BeforeValidator(_robot_section)]


class EffectSection(Section):
    kind: str
    on: Names
    parameters: dict[str, Quantity] = {}
    tolerance: Text | None = None


class AssumedLawSection(BaseModel):
    """The law that an observer assumes at a contact, with its parameters, if it is not the plant's."""

    model_config = ConfigDict(extra="allow", frozen=True, defer_build=True)

    law: str


class DomainSection(Section):
    """Region in which the estimate of a (G)CFO is certified through reversals: ``{slip_speed: 0.5, settle: 0.1}``."""

    slip_speed: Number
    settle: Quantity
    innovation: Number | None = None


class ObserverSection(Section):
    kind: str = Field(examples=["gcfo"])
    velocity: Literal["measured", "estimated"] = "measured"
    gains: dict[str, Gain] = Field(examples=[{"K_F": 10, "K_v": 100}])
    sample_time: Quantity
    integration: Literal["euler", "semi_implicit", "implicit", "exponential"] = "euler"
    exponent: Number = "1"
    h: Text | None = None
    laws: dict[str, AssumedLawSection] = {}
    domain: DomainSection | None = None


class SimulationSection(Section):
    """Simulation of the plant: inputs as functions of t, or a reference with feedback."""

    duration: Quantity
    sample_time: Quantity
    inputs: dict[str, Text] = {}
    reference: dict[str, Text] = Field(default={}, examples=[{"x": "0.1*sin(t)"}])
    position_gain: dict[str, Number] = Field(default={}, examples=[{"w": 400}])
    velocity_gain: dict[str, Number] = Field(default={}, examples=[{"w": 40}])
    input_limit: dict[str, Quantity] = Field(default={}, examples=[{"w": 20}])
    encoder_step: dict[str, Quantity] = Field(default={}, examples=[{"x": "10 um"}])
    position_noise: dict[str, Quantity] = {}
    seed: NonNegativeInt = 0
    integral_gain: dict[str, Number] = {}
    velocity_noise: dict[str, Quantity] = {}
    observer: bool = False
    cancel: Number | None = None
    cancel_delay: NonNegativeInt = 0


class LogSection(Section):
    """Names and scales of the columns of a log; more can be given in a ``meta.yaml`` in the log's folder."""

    columns: dict[str, str] = {}
    scale: dict[str, Text] = {}
    cutoff_hz: Quantity | None = None
    published: dict[str, Text] = {}


class CancellationSection(Section):
    """The friction that the inputs cancel, and the choice among several best inputs."""

    method: Literal["minimum_norm", "appendix_b"] = "minimum_norm"
    weight: Literal["mass_inverse", "acceleration", "identity"] = "mass_inverse"
    gain: Number = "1"
    contacts: Literal["all", "cancellable"] | list[str] = "all"
    damping: Number = "0"


class CodeChoice(Section):
    """Options of the generated code.

    Attributes:
        precision: ``double`` or ``single``.
        fault: handling of invalid samples: ``hold`` the last estimates and set the fault flag, or ``none``.
    """

    precision: Literal["double", "single"] = "double"
    fault: Literal["hold", "none"] = "hold"


class SpecDocument(Section):
    name: str
    source: str = ""
    coordinates: dict[str, CoordinateSection] = Field(examples=[{"x": {"velocity": "v", "unit": "m"}}])
    inputs: dict[str, InputSection] = Field(default={}, examples=[{"w": {"unit": "N"}}])
    parameters: dict[str, ParameterSection] = Field(default={}, examples=[{"m": {"value": 1, "unit": "kg"}}])
    mass_matrix: list[list[Text]] | None = Field(default=None, examples=[[["m1", 0], [0, "m2"]]])
    topology: TopologySection | None = None
    constraints: ConstraintsSection | None = None
    lagrangian: LagrangianSection | None = None
    urdf: str | RobotSection | None = None  # read by ``urdf_section`` before the rest
    force: list[Text] | None = Field(default=None, examples=[["w - k*x"]])
    friction: FrictionSection = Field(
        examples=[{"distribution": [[1]], "contacts": [{"name": "rail", "law": "coulomb", "a": 5, "unit": "N"}]}]
    )
    effects: list[EffectSection] = []
    observer: ObserverSection | None = None
    envelope: dict[str, QuantityRange] = Field(default={}, examples=[{"v": [-5, 5]}])
    simulation: SimulationSection | None = None
    log: LogSection | None = None
    code: CodeChoice = CodeChoice()
    cancellation: CancellationSection | None = None


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of a spec file, from the pydantic models.

    It covers keys and types of values; names, units and expressions are checked by ``stiction check`` only.
    """
    schema = SpecDocument.model_json_schema()
    required = [key for key in schema["required"] if key not in OF_A_ROBOT]
    robot = {"required": ["urdf"], "properties": {"urdf": {"not": {"type": "null"}}}}
    choice = {"if": robot, "else": {"required": list(OF_A_ROBOT)}}
    title = "A machine, its friction and its observer"
    return {"$schema": DIALECT, **schema, **choice, "title": title, "required": required}
