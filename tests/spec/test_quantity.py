"""A number with its unit, where the unit that it must have is known."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from codegen.base.errors import BadInput, Place
from codegen.effects.declare import system_of
from codegen.logs.description import read_description
from codegen.mechanics import build_system
from codegen.mechanics.system import System
from codegen.spec import Spec, parse_spec
from codegen.spec.quantity import read_share

ONE = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text()
LOG = "log: {scale: {t: %s, x: %s, v: %s}, cutoff_hz: %s}\n"


def spec(*pairs: tuple[str, str], behind: str = "") -> Spec:
    text = ONE
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return parse_spec(text + behind, Path("s.yaml"))


def test_a_time_in_milliseconds() -> None:
    plain, with_unit = (
        spec(),
        spec(("  sample_time: 0.001", "  sample_time: 1 ms"), ("duration: 12\n", "duration: 0.2 min\n")),
    )
    assert with_unit.observer == plain.observer and with_unit.simulation == plain.simulation


def test_scales_of_a_log() -> None:
    log = spec(behind=LOG % ("1 ms", "2 mm", "1 cm/s", "0.5 kHz")).log
    assert log == spec(behind=LOG % ("0.001", "0.002", "0.01", "500")).log


@pytest.mark.parametrize("given", ["2*pi/131072", "1e-3", "0.5 mm", "-1/3", "2 m"])
def test_a_scale_is_the_same_in_a_spec_and_beside_a_log(tmp_path: Path, given: str) -> None:
    """A spec took a number or a quantity, and meta.yaml a number or an expression."""
    (tmp_path / "meta.yaml").write_text(f"scale: {{x: {given}}}\n")
    there = spec(behind=f"log: {{scale: {{x: {given}}}}}\n").log.scale["x"]
    assert read_description(tmp_path / "meta.yaml").scale == {"x": there}
    exact = {"2*pi/131072": 2 * math.pi / 131072, "0.5 mm": 5e-4, "-1/3": -1 / 3, "2 m": 2.0}.get(given, 1e-3)
    assert there == pytest.approx(exact, rel=1e-15)


@pytest.mark.parametrize("given", ["0", "2*y", "1 qqq", "pi pi", "[1]", "true"])
def test_a_wrong_scale_is_told_alike(tmp_path: Path, given: str) -> None:
    (tmp_path / "meta.yaml").write_text(f"scale: {{x: {given}}}\n")
    with pytest.raises(BadInput) as beside:
        read_description(tmp_path / "meta.yaml")
    with pytest.raises(BadInput) as within:
        spec(behind=f"log: {{scale: {{x: {given}}}}}\n")
    assert within.value.place.key == "log.scale.x" and beside.value.place.key == "scale.x"
    if given not in ("[1]", "true"):  # of another type, which the spec's schema tells
        assert (within.value.found, within.value.expected) == (beside.value.found, beside.value.expected)


@pytest.mark.parametrize("given", ["1 mm", "1 ms/s", "foo", "ms", "1 2", "1_0 ms"])
def test_anything_else_is_told(given: str) -> None:
    with pytest.raises(BadInput) as told:
        spec(("  sample_time: 0.001", f"  sample_time: {given}"))
    assert told.value.place.key == "observer.sample_time" and given in told.value.found
    assert "alone" not in told.value.expected


def test_a_parameter_s_value_with_a_unit_is_told_where_the_unit_belongs() -> None:
    """ "A number alone, without its unit" left a newcomer to find the key `unit:`."""
    with pytest.raises(BadInput) as told:
        spec(("m: {value: 1, unit: kg}", "m: {value: 10 kg}"))
    assert told.value.place.key == "parameters.m.value"
    assert told.value.expected == "a number alone, and its unit beside it: {value: 10, unit: kg}"


def test_a_level_in_another_unit_has_it_beside_its_number() -> None:
    """The message on `a: 5, unit: kN` spoke of logs."""
    name = parse_spec(BARE, Path("s.yaml")).contacts[0].name
    with pytest.raises(BadInput) as told:
        parse_spec(BARE.replace("a: 50, unit: N}", "a: 50, unit: kN}"), Path("s.yaml"))
    assert "`a: 50 kN`" in told.value.expected and "scale" not in told.value.expected
    beside, plain = (
        parse_spec(BARE.replace("a: 50, unit: N}", f"a: {level}, unit: N}}"), Path("s.yaml"))
        for level in ("5 kN", "5000")
    )
    assert beside.contacts[0] == plain.contacts[0] and plain.contacts[0].name == name


def test_a_power_by_either_sign() -> None:
    length = ("parameters:\n", "parameters:\n  x0: {value: 1, unit: m}\n")
    product = spec(("  - w\n", "  - w - m*v*v/x0\n"), length)
    for power in ("v**2", "v^2", "v ^ 2"):
        assert spec(("  - w\n", f"  - w - m*{power}/x0\n"), length).force == product.force


BARE = ONE[: ONE.index("envelope:")].replace("effects: []", "#") + ONE[ONE.index("simulation:") :]
EFFECT = "effects:\n  - {kind: cogging, on: x, parameters: {amplitude: %s, period: %s, phase: %s}}\n"
ENVELOPE = "envelope:\n  x: [%s]\n  v: [%s]\n  v_dot: [%s]\n  x_noise: [%s]\n  a_%s: [%s]\n"


def test_ranges_and_effects() -> None:
    """Each with a unit of its own, against the same numbers in SI."""
    contact = parse_spec(BARE, Path("s.yaml")).contacts[0].name
    wide = [
        ("-10 mm, 1 cm", "-500 mm/s, 0.5", "-20, 2e4 mm/s^2", "-5 um, 5e-6 m", contact, "0, 12 N"),
        ("-0.01, 0.01", "-0.5, 0.5", "-20, 20", "-5e-6, 5e-6", contact, "0, 12"),
    ]
    force = [("2e3 mN", "1 cm", "90 deg"), ("2", "0.01", "1.5707963267948966")]
    given, plain = (
        parse_spec(BARE + ENVELOPE % ranges + EFFECT % values, Path("s.yaml"))
        for ranges, values in zip(wide, force, strict=True)
    )
    assert given.envelope == plain.envelope and given.effects == plain.effects
    assert system_of(given).values == system_of(plain).values


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (EFFECT % ("2 mm", "0.01", "0"), "effects[0].parameters.amplitude"),
        (EFFECT % ("2", "0.01 s", "0"), "effects[0].parameters.period"),
        ("envelope: {x: [-1 mm/s, 1]}\n", "envelope.x[0]"),
        ("envelope: {v: [-1, 1 m]}\n", "envelope.v[1]"),
        ("envelope: {v_dot: [-1, 1 m/s]}\n", "envelope.v_dot[1]"),
    ],
)
def test_another_dimension_is_told(text: str, key: str) -> None:
    with pytest.raises(BadInput) as told:
        system_of(parse_spec(BARE + text, Path("s.yaml")))
    assert (told.value.code, told.value.place.key) == ("SPEC014", key)


RAIL = "name: rail, law: coulomb, a: 50, unit: N"
LUGRE = "law: lugre, sigma_0: %s, sigma_1: %s, sigma_2: %s, v_s: %s, F_c: %s, F_s: %s, unit: N"
IN_SI = ("1e5", "300", "0.4", "0.001", "50", "80")
IN_OTHERS = ("100 kN/m", "0.3 kN*s/m", "0.4 N*s/m", "1 mm/s", "50 N", "0.08 kN")


def contact(numbers: tuple[str, ...]) -> System:
    return build_system(spec((RAIL, f"name: rail, {LUGRE % numbers}")))


def test_parameters_of_a_contact_with_units_of_their_own() -> None:
    assert contact(IN_OTHERS).values == contact(IN_SI).values
    for unit, wanted in (("0.001 m", "m/s"), ("1 mm/min^2", "m/s"), ("1 foo", "unit")):
        with pytest.raises(BadInput) as told:
            contact((*IN_SI[:3], unit, *IN_SI[4:]))
        assert told.value.place.key == "friction.contacts[0].v_s" and told.value.place.line
        assert wanted in str(told.value) and unit.split()[1] in str(told.value)


def test_parameters_of_an_assumed_law_with_units_of_their_own() -> None:
    law = "laws: {rail: {law: coulomb, a: %s}}\n  velocity: est"
    plain, with_unit = (spec(("velocity: est", law % a)).observer for a in ("50", "0.05 kN"))
    assert plain is not None and plain == with_unit


def test_the_unit_of_an_effect_is_told_in_backticks_alone() -> None:
    with pytest.raises(BadInput) as told:
        system_of(parse_spec(BARE + EFFECT % ("1 kg", "1 m", "0"), Path("s.yaml")))
    assert told.value.found.startswith("amplitude in `kg`, in "), told.value.found
    assert told.value.found.count("`") == 2


@pytest.mark.parametrize(
    ("name", "law"), [("stribeck", "gaussian"), ("Stribeck", "gaussian"), ("viscous", "static_viscous")]
)
def test_another_name_of_a_law_is_told_with_its_parameters(name: str, law: str) -> None:
    with pytest.raises(BadInput) as told:
        build_system(spec((RAIL, f"name: rail, law: {name}, F_c: 40, F_s: 50, v_s: 0.01, unit: N")))
    assert (told.value.code, told.value.nearest) == ("SPEC008", law)
    assert f"another name for `{law}`: its parameters are " in told.value.found


@pytest.mark.parametrize(("text", "share"), [("2%", 0.02), ("0.02", 0.02), ("200 %", 2.0), ("0", 0.0)])
def test_a_tolerance_is_a_share(text: str, share: float) -> None:
    assert read_share(text, Place("s.yaml")) == share


def test_a_share_with_a_unit_is_answered_with_what_it_is() -> None:
    """The answer was `not a number; expected a number`."""
    with pytest.raises(BadInput) as fault:
        read_share("5 N*m", Place("s.yaml"))
    assert "a share such as 1%" in fault.value.expected and "without a unit" in fault.value.expected


@pytest.mark.parametrize(
    ("value", "unit", "text", "size"), [(0, "rad", "0.2 deg", math.radians(0.2)), (6, "kg", "50 g", 0.05)]
)
def test_a_tolerance_of_a_parameter_may_have_a_unit(value: float, unit: str, text: str, size: float) -> None:
    """It was refused; a value of zero, such as an angle, could have no tolerance at all."""
    (parameter,) = (
        p
        for p in spec(
            ("parameters:\n", f"parameters:\n  tilt: {{value: {value}, unit: {unit}, tolerance: {text}}}\n")
        ).parameters
        if p.name == "tilt"
    )
    assert parameter.tolerance is None and parameter.deviation == pytest.approx(size, rel=1e-15)


@pytest.mark.parametrize(("text", "code"), [("5 N", "SPEC014"), ("-5 g", "SPEC007"), ("5 blorb", "SPEC013")])
def test_a_tolerance_in_a_wrong_unit_is_refused_with_its_line(text: str, code: str) -> None:
    with pytest.raises(BadInput) as told:
        spec(("parameters:\n", f"parameters:\n  load: {{value: 6, unit: kg, tolerance: {text}}}\n"))
    assert told.value.code == code and told.value.place.line


@pytest.mark.parametrize(("text", "meant"), [("2", "`2%`, or `200%`"), ("1", "`1%`, or `100%`"), ("10.5", "`10.5%`")])
def test_a_tolerance_that_may_be_meant_in_percent_is_refused(text: str, meant: str) -> None:
    """`tolerance: 2` was taken as 200 %, and nothing said so."""
    with pytest.raises(BadInput) as fault:
        read_share(text, Place("s.yaml"))
    assert meant in fault.value.expected and fault.value.code == "SPEC007"
