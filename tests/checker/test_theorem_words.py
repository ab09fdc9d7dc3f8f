"""What is printed of a kernel's proof misleads nobody: numbers, units, names without doubt."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import verify
from codegen.checker.verify import Refused

HERE = Path(__file__).parents[2] / "generated" / "one_mass"
SOURCES = {path.name: path.read_bytes() for path in HERE.glob("one_mass.[ch]")}
TEXT = (HERE / "proof.json").read_text("utf-8")
EXPRESSIONS = {"growth": "2735983/1000+0", "dwell": "300+52", "decay_rate": "279/25+0"}
HUGE = "1e999999999"
"""As a Fraction it has a billion digits."""


def checked(text: str, sources: dict[str, bytes]) -> verify.Report:
    return verify.check(text, None, None, sources)


@pytest.mark.parametrize("field", EXPRESSIONS)
@pytest.mark.parametrize("huge", [False, True])
def test_numbers_that_are_expressions_are_refused(field: str, huge: bool) -> None:
    """The kernel takes them; they were read as numbers afterwards, which failed or did not end."""
    content = json.loads(TEXT)
    holder = content if field in content else content["reversals"][0]
    holder[field] = HUGE if huge else EXPRESSIONS[field]
    with pytest.raises(Refused, match=f"{field}: .* is no 'RATIONAL'"):
        checked(json.dumps(content), SOURCES)


def test_a_huge_number_beside_a_certificate_is_not_read() -> None:
    content = json.loads(TEXT)
    content["lyapunov_matrix"][0][0] = HUGE
    certificate = json.loads((HERE / "certificate.json").read_text("utf-8"))
    sources = {name: (HERE / name).read_bytes() for name in certificate["subject"]["files"]}
    report = checked(json.dumps(certificate), {**sources, "proof.json": json.dumps(content).encode()})
    assert report.proved == () and "cannot be read" in report.unproved


@pytest.mark.parametrize("unit", ["N]\u2800of\u2800every\u2800state,\u2800F[m", "N\u202e", "N,m", "N" * 200])
def test_a_unit_that_is_a_sentence_is_refused(unit: str) -> None:
    header = SOURCES["one_mass.h"].decode().replace("double v_hat; /* m/s: ", f"double v_hat; /* {unit}: ")
    with pytest.raises(Refused, match=r"in one_mass\.h is no unit"):
        checked(TEXT, {**SOURCES, "one_mass.h": header.encode()})


def test_a_parameter_that_is_called_like_a_true_level_is_told_apart() -> None:
    """The declared level and the true one: a claim for any level must not be read into one for the declared level."""
    sources: dict[str, Any] = {name: text.replace(b"rail_a", b"a_rail") for name, text in SOURCES.items()}
    before, after = checked(TEXT, SOURCES).proved, checked(TEXT, sources).proved
    assert "machine: (m) v' = -a_rail*sign(rail) + w; x' = v; a_rail constant, whatever the value" in before
    assert "machine: (m) v' = -true.a_rail*sign(rail) + w; x' = v; true.a_rail constant, whatever the value" in after
    assert "parameters.a_rail = 50" in after[-2] and "rail_a = 50" in before[-2]
