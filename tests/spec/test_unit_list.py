"""Units of data sheets: the factor of each against definitions written out here, and a certificate at each."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path

import mpmath
import pytest
import sympy

from codegen.app.derived import Derived
from codegen.base.errors import BadInput, Place
from codegen.certify.certify import Certificate
from codegen.spec import parse_spec
from codegen.spec import units as known_units
from codegen.spec.units import coherent_name, is_unit, si_factor, unit_name
from tests.expected_errors import matches
from tests.slow_cases import slow_except

LB, INCH, G = Fraction("0.45359237"), Fraction("0.0254"), Fraction("9.80665")  # kg, m, m/s^2: by definition
OZ, FOOT = LB / 16, 12 * INCH
LBF, OZF, KGF = LB * G, OZ * G, G
TURN = (Fraction(2), 1)  # 2 pi rad, as a factor and a power of pi
RPM, DEGREE = (Fraction(2, 60), 1), (Fraction(2, 360), 1)


def over(factor: Fraction, angle: tuple[Fraction, int]) -> tuple[Fraction, int]:
    """A factor by a factor with pi."""
    return factor / angle[0], -angle[1]


# unit as written → (its factor to SI without pi, the power of pi in it, the SI unit)
UNITS: dict[str, tuple[Fraction | tuple[Fraction, int], str]] = {
    "g": (Fraction(1, 1000), "kg"),
    "mg": (Fraction(1, 10**6), "kg"),
    "lb": (LB, "kg"),
    "lbm": (LB, "kg"),
    "oz": (OZ, "kg"),
    "slug": (LBF / FOOT, "kg"),
    "tonne": (Fraction(1000), "kg"),
    "g*cm^2": (Fraction(1, 10**7), "kg*m^2"),
    "g·cm²": (Fraction(1, 10**7), "kg*m^2"),
    "kg*cm^2": (Fraction(1, 10**4), "kg*m^2"),
    "kgcm2": (Fraction(1, 10**4), "kg*m^2"),
    "kg*mm^2": (Fraction(1, 10**6), "kg*m^2"),
    "oz*in^2": (OZ * INCH**2, "kg*m^2"),
    "oz·in²": (OZ * INCH**2, "kg*m^2"),
    "oz-in^2": (OZ * INCH**2, "kg*m^2"),
    "lb*in^2": (LB * INCH**2, "kg*m^2"),
    "lb*ft^2": (LB * FOOT**2, "kg*m^2"),
    "lbf*in*s^2": (LBF * INCH, "kg*m^2"),
    "ozf*in*s^2": (OZF * INCH, "kg*m^2"),
    "mm": (Fraction(1, 1000), "m"),
    "um": (Fraction(1, 10**6), "m"),
    "µm": (Fraction(1, 10**6), "m"),
    "inch": (INCH, "m"),
    "in": (INCH, "m"),
    "ft": (FOOT, "m"),
    "thou": (INCH / 1000, "m"),
    "mm/rev": (over(Fraction(1, 1000), TURN), "m/rad"),
    "deg": (DEGREE, "rad"),
    "arcmin": ((DEGREE[0] / 60, 1), "rad"),
    "arcsec": ((DEGREE[0] / 3600, 1), "rad"),
    "rev": (TURN, "rad"),
    "mrad": (Fraction(1, 1000), "rad"),
    "rpm": (RPM, "rad/s"),
    "deg/s": (DEGREE, "rad/s"),
    "°/s": (DEGREE, "rad/s"),
    "rev/min": (RPM, "rad/s"),
    "r/min": (RPM, "rad/s"),
    "mm-2": (Fraction(10**6), "m^-2"),
    "Hz": (Fraction(1), "Hz"),
    "kHz": (Fraction(1000), "1/s"),
    "ms": (Fraction(1, 1000), "s"),
    "min": (Fraction(60), "s"),
    "kN": (Fraction(1000), "N"),
    "lbf": (LBF, "N"),
    "ozf": (OZF, "N"),
    "kgf": (KGF, "N"),
    "mNm": (Fraction(1, 1000), "N*m"),
    "Ncm": (Fraction(1, 100), "N*m"),
    "kgf*cm": (KGF / 100, "N*m"),
    "ozf*in": (OZF * INCH, "N*m"),
    "lbf*in": (LBF * INCH, "N*m"),
    "lbf*ft": (LBF * FOOT, "N*m"),
    "mN*m/A": (Fraction(1, 1000), "N*m/A"),
    "mNm/A": (Fraction(1, 1000), "N*m/A"),
    "ozf*in/A": (OZF * INCH, "N*m/A"),
    "V/krpm": (over(Fraction(1, 1000), RPM), "V*s/rad"),
    "V*s/rad": (Fraction(1), "V*s/rad"),
    "mV/rpm": (over(Fraction(1, 1000), RPM), "V*s/rad"),
    "N*m/krpm": (over(Fraction(1, 1000), RPM), "N*m*s/rad"),
    "Nm/krpm": (over(Fraction(1, 1000), RPM), "N*m*s/rad"),
    "mNm/rpm": (over(Fraction(1, 1000), RPM), "N*m*s/rad"),
    "N/mm": (Fraction(1000), "N/m"),
    "N/um": (Fraction(10**6), "N/m"),
    "lbf/in": (LBF / INCH, "N/m"),
    "Nm/deg": (over(Fraction(1), DEGREE), "N*m/rad"),
    "Nm/arcmin": (over(Fraction(60), DEGREE), "N*m/rad"),
    "N*s/mm": (Fraction(1000), "N*s/m"),
    "mohm": (Fraction(1, 1000), "ohm"),
    "mH": (Fraction(1, 1000), "H"),
    "mA": (Fraction(1, 1000), "A"),
    "psi": (LBF / INCH**2, "Pa"),
    "bar": (Fraction(10**5), "Pa"),
}


def factor_of(unit: str) -> tuple[Fraction, int]:
    factor = UNITS[unit][0]
    return factor if isinstance(factor, tuple) else (factor, 0)


def rounded_once(unit: str, value: Fraction) -> float:
    """The double nearest to a value in SI, by a hundred digits."""
    with mpmath.workdps(100):
        factor, power = factor_of(unit)
        exact = value * factor
        return float(mpmath.mpf(exact.numerator) / exact.denominator * mpmath.pi**power)


@pytest.mark.parametrize("unit", UNITS)
def test_the_factor_of_a_unit_is_that_of_its_definition(unit: str) -> None:
    factor, power = factor_of(unit)
    found = si_factor(unit, Place("a.yaml"))
    if power == 0:
        assert Fraction(int(found.p), int(found.q)) == factor
    with mpmath.workdps(60):
        error = mpmath.mpf(int(found.p)) / int(found.q) / mpmath.pi**power * factor.denominator / factor.numerator - 1
        assert abs(error) < mpmath.mpf(10) ** -48
    assert coherent_name(unit, Place("a.yaml")) == UNITS[unit][1]


VALUES = ("33.5", "0.123456789", "7e-3", "1234567890.12345")


@pytest.mark.parametrize("unit", UNITS)
def test_a_value_is_rounded_once(unit: str) -> None:
    """The value in SI is the decimal that the nearest double prints, and nothing between was rounded."""
    declared = "\n  ".join(f"p{k}: {{value: {value}, unit: {unit}}}" for k, value in enumerate(VALUES))
    read = parse_spec(MACHINE.format(declared=declared, mass="m"), Path("a.yaml")).parameters
    found = {p.name: p.value for p in read}
    for k, value in enumerate(VALUES):
        exact = found[f"p{k}"]
        assert Fraction(int(exact.p), int(exact.q)) == Fraction(repr(rounded_once(unit, Fraction(value))))


MACHINE = """
name: slide
coordinates: {{x: {{velocity: v, unit: m}}}}
inputs: {{w: {{unit: N}}}}
parameters:
  m: {{value: 2, unit: kg}}
  {declared}
mass_matrix: [["{mass}"]]
force: [w]
friction: {{distribution: [[1]], contacts: [{{name: rail, a: 5, unit: N}}]}}
observer: {{kind: cfo, velocity: measured, gains: {{K_F: 10}}, sample_time: 0.001}}
envelope: {{v: [-5, 5]}}
"""


@pytest.mark.parametrize("unit", slow_except(list(UNITS), list(UNITS)[::5]))
def test_a_spec_with_this_unit_is_certified(unit: str) -> None:
    """The mass is scaled by a parameter in the unit over one in SI, so that the error's matrix has the value in it."""
    size = f"{33.5 / rounded_once(unit, Fraction(1)):.4g}"
    declared = f"p: {{value: {size}, unit: {unit}}}\n  q: {{value: 33.5, unit: {UNITS[unit][1]}}}"
    outcome = Derived(parse_spec(MACHINE.format(declared=declared, mass="m*p/q"), Path("slide.yaml"))).outcome
    assert isinstance(outcome, Certificate), outcome.reason


def test_the_rotor_of_a_data_sheet_is_certified() -> None:
    """33.5 g*cm^2: the float factor of pint, 1.0000000000000001e-07, made it 3.3500000000000003e-06 kg*m^2."""
    text = """
name: rotor
coordinates: {q: {velocity: om, unit: rad}}
inputs: {i: {unit: A}}
parameters:
  Jm: {value: 33.5, unit: g*cm^2}
  kt: {value: 25.9, unit: mN·m/A}
mass_matrix: [[Jm]]
force: [kt*i]
friction: {distribution: [[1]], contacts: [{name: bearing, a: 0.002, unit: Nm}]}
observer: {kind: cfo, velocity: estimated, gains: {K_F: 0.0003, K_v: 100}, sample_time: 0.001}
envelope: {om: [-500, 500]}
"""
    spec = parse_spec(text, Path("rotor.yaml"))
    assert spec.parameters[0].value == sympy.Rational("3.35e-6")
    machine = Derived(spec)
    files, outcome = machine.files, machine.outcome
    assert isinstance(outcome, Certificate), outcome.reason
    assert "Jm: float = 3.35e-06" in files["__init__.py"] and "N*m: " in files["__init__.py"]


def test_single_precision_keeps_the_certificate() -> None:
    """C and twin have the value's own digits and round it themselves: 33.5 oz are no number of seven digits in kg."""
    text = MACHINE.format(declared="p: {value: 33.5, unit: oz}", mass="m + p") + "code: {precision: single}\n"
    machine = Derived(parse_spec(text, Path("slide.yaml")))
    files, outcome = machine.files, machine.outcome
    assert isinstance(outcome, Certificate), outcome.reason
    value = repr(rounded_once("oz", Fraction("33.5")))
    assert f"p: float32 = float32({value})" in files["__init__.py"]
    assert f"{value}f, /* p */" in files["slide.h"]


@pytest.mark.parametrize("unit", ["degC", "°C", "degF", "dB"])
def test_a_unit_with_an_offset_is_refused(unit: str) -> None:
    with pytest.raises(BadInput):
        si_factor(unit, Place("a.yaml"))


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("Nm", "N*m"),
        ("kg·m²", "kg*m^2"),
        ("1/kgm^2", "1/(kg*m^2)"),
        ("rad/Nm", "rad/(N*m)"),
        ("N-m-s/rad", "N*m*s/rad"),
        ("m·s⁻¹", "m*s^-1"),
        ("Ω", "ohm"),
        ("m^0.5", "m^0.5"),
    ],
)
def test_a_unit_is_written_in_one_way(written: str, name: str) -> None:
    assert unit_name(written, Place("a.yaml")) == name


@pytest.mark.parametrize(
    ("written", "clear"),
    [
        *((unit, "kgf*cm") for unit in ("kg-cm", "kg–cm", "kgcm", "kg·cm", "kg*cm", "kg.cm", "cm-kg")),
        *((unit, "gf*cm") for unit in ("g-cm", "gcm", "g·cm")),
        *((unit, "kgf*m") for unit in ("kg-m", "kg‑m", "m-kg")),
    ],
)
def test_a_torque_in_kilograms_is_refused_with_the_unit_that_is_one(written: str, clear: str) -> None:
    with pytest.raises(BadInput) as told:
        si_factor(written, Place("a.yaml"))
    assert matches(told.value, f"SPEC013 `{written}` torque mass length")
    assert told.value.nearest == clear and coherent_name(clear, Place("a.yaml")) == "N*m"


@pytest.mark.parametrize(
    ("written", "factor", "name"),
    [
        ("kg*m", 1, "kg*m"),
        ("kgm", 1, "kg*m"),
        ("kg-m^2", 1, "kg*m^2"),
        ("kg–m²", 1, "kg*m^2"),
        ("kg-m2", 1, "kg*m^2"),
        ("kg-cm^2", sympy.Rational(1, 10**4), "kg*m^2"),
        ("g-cm²", sympy.Rational(1, 10**7), "kg*m^2"),
        ("kg-m/s^2", 1, "kg*m/s^2"),
        ("kg*cm/s²", sympy.Rational(1, 100), "N"),
        ("kgf-cm", sympy.Rational(980665, 10**7), "N*m"),
    ],
)
def test_what_no_torque_is_written_as_is_taken(written: str, factor: sympy.Rational, name: str) -> None:
    place = Place("a.yaml")
    assert (si_factor(written, place), coherent_name(written, place)) == (factor, name)


def test_a_root_is_taken_exactly() -> None:
    assert si_factor("cm^0.5", Place("a.yaml")) == sympy.Rational(1, 10)
    assert abs(si_factor("mm^(1/2)", Place("a.yaml")) ** 2 - sympy.Rational(1, 1000)) < sympy.Rational(1, 10**48)


@pytest.mark.parametrize("force", ["w - b*v/3", "w - 2/3*b*v", "w - b*v/7 - v*abs(v)*c/3"])
def test_a_fraction_in_an_expression_keeps_the_certificate(force: str) -> None:
    """A third is no decimal: code, matrix and proof all have the one that the code prints."""
    text = MACHINE.format(declared="b: {value: 2, unit: N*s/m}\n  c: {value: 1, unit: N*s^2/m^2}", mass="m")
    for old, new in (
        ("force: [w]", f"force: [{force}]"),
        ("velocity: measured, gains: {K_F: 10}", "velocity: estimated, gains: {K_F: 10, K_v: 100}"),
    ):
        assert old in text
        text = text.replace(old, new)
    machine = Derived(parse_spec(text, Path("slide.yaml")))
    files, outcome = machine.files, machine.outcome
    assert isinstance(outcome, Certificate), outcome.reason
    assert files["__init__.py"]


@pytest.mark.parametrize(("unit", "number"), [("kg*m^2*1e-3", "1e-3"), ("10^-3 kg", "10^-3"), ("N*m/1000", "1000")])
def test_a_number_in_a_unit_is_named(unit: str, number: str) -> None:
    with pytest.raises(BadInput, match=re.escape(f"without the number {number}, which belongs into the value")):
        unit_name(unit, Place("a.yaml"))


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("N/mmm", "N/mm"),
        ("mmm", "mm"),
        ("kN/mmm", "kN/mm"),
        ("radd/s", "rad/s"),
        ("kg*mmm^2", "kg*mm^2"),
        ("Newton", "newton"),
        ("foo", None),
    ],
)
def test_a_misspelt_factor_of_a_unit_is_answered_with_the_nearest(written: str, meant: str | None) -> None:
    """The list of whole units had N/m as the nearest of N/mmm: a factor of 1000."""
    with pytest.raises(BadInput) as told:
        si_factor(written, Place("a.yaml"))
    assert (told.value.nearest, told.value.code) == (meant, "SPEC013")
    assert meant is None or si_factor(meant, Place("a.yaml"))


@pytest.mark.parametrize(
    ("unit", "meant"),
    [
        ("lb-in/A", "lbf*in/A"),
        ("oz-in/A", "ozf*in/A"),
        ("kg-cm/A", "kgf*cm/A"),
        ("kgcm/V", "kgf*cm/V"),
        ("g*cm/A", "gf*cm/A"),
        ("kg-m/A", "kgf*m/A"),
        ("mm/U", "mm/rev"),
        ("“kg”", "kg"),
    ],
)
def test_the_suggested_unit_is_the_whole_of_it(unit: str, meant: str) -> None:
    with pytest.raises(BadInput) as told:
        si_factor(unit, Place("s.yaml"))
    assert told.value.nearest == meant
    assert si_factor(meant, Place("s.yaml")) > 0


@pytest.mark.parametrize("unit", ["N·m/min⁻¹", "Nm/min-1", "Nm/(1/min)", "V/min^-1", "mV/(min^-1)"])
def test_a_speed_in_turns_a_minute_below_the_line_is_refused_as_alone(unit: str) -> None:
    """Read as 1/min it would be a speed in radians, off by 2 pi."""
    with pytest.raises(BadInput) as told:
        si_factor(unit, Place("s.yaml"))
    assert "revolutions or radians" in told.value.found
    assert str(told.value.nearest).endswith("/rpm") and si_factor(str(told.value.nearest), Place("s.yaml")) > 0
    assert si_factor("m*min^-1", Place("s.yaml")) == sympy.Rational(1, 60)


@pytest.mark.parametrize("text", ["mN", "kg*cm^2", "N*mm/deg", "abc7", "kgf*cm/", "oz*inch", "degC", "1/0", "m^99", ""])
def test_whether_a_text_is_a_unit_is_told_without_a_suggestion(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The words of a log's names are asked: 800 columns abc_0, abc_1, ... took 3 s for suggestions that none reads."""
    try:
        si_factor(text, Place(""))
        read = True
    except BadInput:
        read = False
    monkeypatch.setattr(known_units, "nearest_name", None)
    is_unit.cache_clear()
    assert is_unit(text) == read


def test_a_share_in_percent_is_told_to_be_written_as_a_number() -> None:
    with pytest.raises(BadInput, match=re.escape("94 % is the value 0.94 in the unit 1")):
        unit_name("%", Place("spec.yaml"))
