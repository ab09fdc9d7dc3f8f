"""Parameters whose value in the C is another than the one of which the kernel proves something. Each was accepted."""

from __future__ import annotations

import json

import pytest

from codegen.checker import verify
from tests.checker.forged import sources

FIELD, VALUE = "    double m; /* kg", "        1.0, /* m */"
PREPARE = "    parameters->one_over_m = 1.0 / parameters->m;"
NOTHING = "(0.1 + 0.2 - 0.3)"  # in exact arithmetic; 5.6e-17 in doubles


def checked(c: list[tuple[str, str]], h: list[tuple[str, str]]) -> verify.Report:
    files = {x: y for x, y in sources("one_mass").items() if x != "ellipsoid.json"}
    for end, pairs in (("c", c), ("h", h)):
        text = files[f"one_mass.{end}"].decode()
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        files[f"one_mass.{end}"] = text.encode()
    return verify.check(files["proof.json"].decode(), sources=files)


@pytest.mark.parametrize("word", ["long", "const", "volatile"])
def test_a_field_that_c_does_not_declare_is_refused(word: str) -> None:
    """`double long;` is a type without a name: a compiler warns, and m gets the first value of the header."""
    of_none = [(FIELD, f"    double {word}; /* 1: none */\n{FIELD}"), (VALUE, f"        7.0, \\\n{VALUE}")]
    with pytest.raises(verify.Refused, match="no fields of doubles"):
        checked([], of_none)
    named = [(old, new.replace(f"{word};", f"{word}_;")) for old, new in of_none]
    assert checked([], named).whole


@pytest.mark.parametrize("header", ["50.0", "1.0"])
def test_a_mass_that_prepare_makes_of_rounding_errors_is_refused(header: str) -> None:
    """The C uses one_over_m, and the machine has m: exactly 1, 6.6 in doubles, in the header what one likes."""
    with pytest.raises(verify.Refused, match="terms of a sum cancel"):
        checked([(PREPARE, f"    parameters->m = 1e17 * {NOTHING} + 1.0;")], [(VALUE, f"        {header}, /* m */")])


def test_a_sample_time_that_prepare_makes_of_rounding_errors_is_refused() -> None:
    """The C has the number 0.001 in its place, and the report the header's 0.05 s."""
    number = ("parameters->sample_time *", "0.001 *")
    set_ = (PREPARE, f"    parameters->sample_time = 1e14 * {NOTHING} + 0.001;\n{PREPARE}")
    with pytest.raises(verify.Refused, match="terms of a sum cancel"):
        checked([number, set_], [("        0.001, /* sample_time */", "        0.05, /* sample_time */")])


def test_a_parameter_that_prepare_computes_may_be_in_the_machine() -> None:
    report = checked([(PREPARE, f"    parameters->m = 0.1 + 0.2 + 0.7;\n{PREPARE}")], [])
    assert report.whole and json.loads(sources("one_mass")["proof.json"])["mass_matrix"] == [["parameters.m"]]
