"""Numbers in print: the digits that an interval lets a value have."""

from __future__ import annotations

from dataclasses import replace

import pytest

from codegen.base.significant import in_percent, significant_digits, with_deserved_digits
from codegen.base.text import render
from codegen.diagnosis.results import ParameterError
from codegen.report.wording import estimated


@pytest.mark.parametrize(
    ("value", "interval", "shown"),
    [
        (-1.50031, (-1.5006, -1.49999), ("−1.50031", "−1.50060 to −1.49999")),
        (12345.0, (11000.0, 13700.0), ("1.23·10⁴", "1.10·10⁴ to 1.37·10⁴")),
        (0.833333, (-0.14, 1.8), ("0.83", "−0.14 to 1.80")),
        (100.4, (99.0, 101.0), ("100.4", "99.0 to 101.0")),
        (0.0412345, (0.04, 0.0424), ("0.0412", "0.0400 to 0.0424")),
        (3.0, (3.0, 3.0), ("3", "3 to 3")),
        (4.2, (), ("4.2", "")),
        (4.2, (float("-inf"), float("inf")), ("4.2", "not bounded")),
    ],
)
def test_two_digits_of_the_half_width(value: float, interval: tuple[float, ...], shown: tuple[str, str]) -> None:
    assert estimated(value, interval) == shown


def test_no_more_digits_than_asked_for() -> None:
    assert with_deserved_digits(3.39988123, (3.398, 3.402)) == "3.400"
    assert with_deserved_digits(28.0, (28.0, 28.0)) == "28"
    assert with_deserved_digits(130.0, (-6e3, 9e3)) == "1e+02"
    assert with_deserved_digits(28.123456, (float("nan"), float("nan"))) == "28.12"
    assert with_deserved_digits(0.0412345, (0.02, 0.06)) == "0.041"
    assert with_deserved_digits(0.0412345, ()) == "0.04123"
    assert significant_digits(1.0, (-1e6, 1e6)) == 1


def test_an_interval_whose_ends_print_alike_has_more_digits() -> None:
    """A `period = 0.01 m` without an interval read as if its error were unknown."""
    found = ParameterError("m", "kg", 25.0, 0.02, 28.001, (27.9978, 28.0042), 6.0, (), 0.2, 0.1, 8, 8, 8)

    def words(error: ParameterError, verdict: str = "none") -> str:
        return render("text/statement/declared_value.j2", part="words", e=error, verdict=verdict).strip()

    shown = "The log gives m = 28.0010 kg (95 %: 27.9978 to 28.0042); declared is 25 kg, 6 tolerances away."
    assert words(found) == shown
    assert words(found, "unknown") == f"{shown} What is missing may have moved it."
    wider = replace(found, interval=(27.9, 28.1))
    assert words(wider) == "The log gives m = 28.00 kg (95 %: 27.90 to 28.10); declared is 25 kg, 6 tolerances away."
    assert ". m1, m2, m3 may be the cause" in words(replace(found, alike=("m1", "m2", "m3")))
    many = words(replace(found, alike=tuple(f"m{k}" for k in range(14))))
    assert ". m0, m1, m2 and 11 more (" in many and "m3" not in many


@pytest.mark.parametrize(
    ("share", "words"),
    [(1.237, "124 %"), (-2.04, "-204 %"), (0.996, "100 %"), (0.987, "99 %"), (0.0123, "1.2 %"), (0.0, "0 %")],
)
def test_a_share_in_percent_has_no_exponent(share: float, words: str) -> None:
    assert in_percent(share) == words
