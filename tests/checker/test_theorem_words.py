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
    with pytest.raises(Refused, match=r"in one_mass\.h is no unit|control characters"):
        checked(TEXT, {**SOURCES, "one_mass.h": header.encode()})


@pytest.mark.parametrize(
    "line",
    [
        "double v_hat; /* in m/s, the velocity estimate */ /* double v_hat; /* km/h: velocity */",
        "/* double v_hat; /* km/h: velocity */ double v_hat; /* in m/s, the velocity estimate */",
        "double v_hat; /* in m/s, the velocity estimate; double v_hat; /* km/h: velocity */",
        "/\\\n* double v_hat; /* km/h: velocity */ double v_hat; /* in m/s, the velocity estimate */",
    ],
)
def test_a_unit_of_a_field_within_a_comment_is_not_read(line: str) -> None:
    """It was printed with the error, in place of what stands behind the field."""
    own = "double v_hat; /* m/s: velocity estimate, (4.25) */"
    header = SOURCES["one_mass.h"].decode()
    assert header.count(own) == 1
    with pytest.raises(Refused, match=r"missing|two units"):
        checked(TEXT, {**SOURCES, "one_mass.h": header.replace(own, line).encode()})


def test_a_parameter_that_is_called_like_a_true_level_is_told_apart() -> None:
    """The declared level and the true one: a claim for any level must not be read into one for the declared level."""
    sources: dict[str, Any] = {name: text.replace(b"rail_a", b"a_rail") for name, text in SOURCES.items()}
    before, after = checked(TEXT, SOURCES).proved, checked(TEXT, sources).proved
    assert "machine: (m) v' = -a_rail*sign(rail) + w; x' = v; a_rail constant, with any value" in before
    assert "machine: (m) v' = -true.a_rail*sign(rail) + w; x' = v; true.a_rail constant, with any value" in after
    assert "parameters.a_rail = 50" in "\n".join(after) and "rail_a = 50" in "\n".join(before)


def test_a_state_that_must_be_zero_is_said_however_its_formula_is_written() -> None:
    """z_q doubles in every sample and moves z_v: the claim holds at z_q = 0 alone, and said "of every state"."""
    header = SOURCES["one_mass.h"].replace(b"    double z_rail;", b"    double z_q; /* 1: x */\n    double z_rail;", 1)
    keep = b"        state->z_v = z_v_next;\n"
    assert SOURCES["one_mass.c"].count(keep) == 1
    source = SOURCES["one_mass.c"].replace(keep, b"        state->z_q = z_q_next;\n" + keep)
    source = source.replace(b"z_v_next = state->z_v", b"z_v_next = 2.0 * state->z_q + state->z_v")
    source = source.replace(
        b"    const double check = z_v_next",
        b"    const double z_q_next = 2.0 * state->z_q;\n    const double check = z_q_next + z_v_next",
    )
    source = source.replace(b"inputs->w + state->z_v", b"inputs->w + state->z_q + state->z_v")
    sources = {"one_mass.h": header, "one_mass.c": source}
    content = json.loads(TEXT)
    content["states"]["state.z_q"] = "0*outputs.v_hat"
    report = checked(json.dumps(content), sources)
    assert not report.whole
    assert "only where the state state.z_q is 0*v_hat" in report.proved


def test_v_falls_but_for_a_rest() -> None:
    """Gravity that the machine has not: e = 0 does not stay, so V is not below what it was."""
    content = json.loads(TEXT) | {"rest": ["9.81*parameters.sample_time/parameters.m", "0"]}
    source = SOURCES["one_mass.c"].replace(b"inputs->w - F_hat_rail", b"inputs->w - 9.81 - F_hat_rail", 1)
    said = "\n".join(checked(json.dumps(content), SOURCES | {"one_mass.c": source}).proved)
    assert "the step multiplies V = e'Pe, without that addition, by at most" in said
    assert "if no sign has changed again, V is, without that addition, not above its value before" in said
    assert "that addition" not in "\n".join(checked(TEXT, SOURCES).proved)
