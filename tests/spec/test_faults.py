"""Every way to spoil a spec is told at its line; a good one is read with its values in SI."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import sympy

from codegen.base.errors import BadInput
from codegen.mechanics import build_system
from codegen.spec import parse_spec, read_spec
from tests.expected_errors import matches

from .faults import FAULTS, GOOD, UNITS

ROOT = Path(__file__).resolve().parents[2]
PRACTICE = ROOT.parent / "shared" / "practice"
needs_practice = pytest.mark.skipif(not PRACTICE.is_dir(), reason="../shared/practice is not here")


def refused(text: str) -> BadInput:
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(text, Path("slider.yaml")))
    return told.value


def line_of(text: str) -> set[int]:
    """Lines in which the spoilt text differs from the good one, and the line of the section that holds the first."""
    spoilt, good = text.splitlines(), GOOD.splitlines()
    first = next((k for k, (a, b) in enumerate(zip(spoilt, good, strict=False)) if a != b), 0)
    section = max((k for k in range(first) if spoilt[k][:1].isalpha()), default=0)
    return set(range(section + 1, first + 3))


def test_the_good_one_is_good() -> None:
    system = build_system(parse_spec(GOOD, Path("slider.yaml")))
    assert system.mass_matrix == sympy.diag(*sympy.symbols("mass J", real=True))


@pytest.mark.parametrize("fault", FAULTS)
def test_fault(fault: str) -> None:
    old, new, words, nearest = FAULTS[fault]
    assert old in GOOD
    told = refused(text := GOOD.replace(old, new, 1))
    assert matches(told, words)
    assert told.nearest == nearest or nearest is None
    if fault in ("missing name", "missing mass_matrix"):
        assert told.place.line is None  # what is absent at the top has no line
    else:
        assert told.place.line in line_of(text)


@pytest.mark.parametrize("fault", UNITS)
def test_units_that_do_not_fit(fault: str) -> None:
    old, new, words = UNITS[fault]
    assert old in GOOD
    told = refused(GOOD.replace(old, new, 1))
    assert matches(told, words)
    assert told.place.line is not None


# The right values are from the definitions: 1 rpm = 2π/60 rad/s, 1 in = 25.4 mm, 1 kgf = 9.80665 N.
SI = {
    "mm": (sympy.Rational(1, 1000), 0),
    "kN": (sympy.Integer(1000), 0),
    "g": (sympy.Rational(1, 1000), 0),
    "cm^2": (sympy.Rational(1, 10_000), 0),
    "N/mm": (sympy.Integer(1000), 0),
    "inch": (sympy.Rational(254, 10_000), 0),
    "kgf": (sympy.Rational(980665, 100_000), 0),
    "deg": (sympy.pi / 180, 1e-15),
    "rpm": (2 * sympy.pi / 60, 1e-15),
    "g*cm^2": (sympy.Rational(1, 10**7), 0),
    "min": (sympy.Integer(60), 0),
    "1": (sympy.Integer(1), 0),
}


@pytest.mark.parametrize("unit", SI)
def test_a_parameter_is_converted_to_si(unit: str) -> None:
    """To 1e-15 where the factor holds pi; a double's rounding of a decimal factor is 1e-15 too."""
    text = GOOD.replace("  tau:", f"  other: {{value: 2.5, unit: '{unit}'}}\n  tau:")
    found = next(p for p in parse_spec(text, Path("slider.yaml")).parameters if p.name == "other")
    assert found.declared == sympy.Rational(5, 2)
    assert float(found.value) == pytest.approx(2.5 * float(SI[unit][0]), rel=1e-15)


@pytest.mark.parametrize(
    ("mend", "row"),
    [
        ({"w - k*x": "w - k*x**2/x"}, "a quotient"),
        ({"w - k*x": "w - k*sqrt(x**2)*cos(q)"}, "a root of a square and a cosine of an angle"),
        ({"w - k*x": "w - mass*v*abs(v)/x"}, "v|v|"),
        ({"w - k*x": "w - mass*x**(3/2)*x**-(1/2)/tau**2"}, "broken exponents"),
        ({"w - k*x": "w - k*x*exp(-v*tau/x)"}, "an exponential of a pure number"),
    ],
)
def test_units_that_fit(mend: dict[str, str], row: str) -> None:
    text = GOOD
    for old, new in mend.items():
        text = text.replace(old, new)
    assert parse_spec(text, Path("slider.yaml")).force.rows == 2, row


@needs_practice
def test_every_practice_spec_is_read() -> None:
    paths = sorted(PRACTICE.glob("*/*/spec.yaml"))
    assert len(paths) > 50
    for path in paths:
        assert read_spec(path).coordinates


@pytest.mark.parametrize("path", sorted((ROOT / "specs").glob("*.yaml")), ids=lambda p: p.stem)
def test_every_shipped_spec_is_read(path: Path) -> None:
    spec: Any = read_spec(path)
    assert build_system(spec).name == path.stem
