"""What is printed of a kernel's proof misleads nobody: numbers, units, names without doubt."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import verify
from codegen.checker.verify import Refused
from tests.twin import load_twin

HERE = Path(__file__).parents[2] / "generated" / "one_mass"
SOURCES = {path.name: path.read_bytes() for path in HERE.glob("one_mass.[ch]")}
TEXT = (HERE / "proof.json").read_text("utf-8")
EXPRESSIONS = {"growth": "3190351/1000000+0", "dwell": "50+4", "decay_rate": "213/20+0"}
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
    ("own", "by"),
    [
        ("double sample_time; /* s:", "double sample_time; /* ms:"),
        ("double sample_time; /* s:", "double sample_time; /* 1:"),
        ("double v_hat; /* m/s:", "double v_hat; /* mm/s:"),
        ("double a_hat_rail; /* N:", "double a_hat_rail; /* mN:"),
        ("double rail_a; /* N:", "double rail_a; /* kN:"),
        ("double x; /* m:", "double x; /* inch:"),
        ("double x; /* m:", "double x; /* m*1000:"),
        ("double x; /* m:", "double x; /* 1000m:"),
    ],
)
def test_units_are_coherent(own: str, by: str) -> None:
    """A bound of 1.788 N was printed as one of 1.788 mN, and a sample of a header in ms as one of 0.001 s."""
    header = SOURCES["one_mass.h"].decode()
    assert header.count(own) == 1
    with pytest.raises(Refused, match=r"no unit of SI|not in s"):
        checked(TEXT, {**SOURCES, "one_mass.h": header.replace(own, by).encode()})


@pytest.mark.parametrize(
    ("own", "by"),
    [
        ("double v_hat; /* m/s:", "double v_hat; /* kg:"),
        ("double v_hat; /* m/s:", "double v_hat; /* m/s^2:"),
        ("double x; /* m:", "double x; /* rad:"),
    ],
)
def test_a_velocity_has_the_unit_of_its_position_per_second(own: str, by: str) -> None:
    """An error of the velocity was printed in kg, with status 0."""
    header = SOURCES["one_mass.h"].decode()
    assert header.count(own) == 1
    with pytest.raises(Refused, match=r"the unit of v_hat in one_mass\.h is not that of x per second"):
        checked(TEXT, {**SOURCES, "one_mass.h": header.replace(own, by).encode()})


@pytest.mark.parametrize(
    ("own", "by"),
    [
        ("double x; /* m: measured position */", "double x; /* mm, measured position */"),
        ("double x; /* m: measured position */", "double\n    x; /* mm: measured position */"),
        ("double w; /* N: input */", "double w; /* input in kN */"),
        ("double w; /* N: input */", "double w;"),
        ("double z_v; /* m/s: observer state */", "double z_v; /* observer state in mm/s */"),
    ],
)
def test_each_quantity_has_its_unit_behind_it(own: str, by: str) -> None:
    """A position in mm and an input in kN were bound to a machine in m and N, with status 0."""
    header = SOURCES["one_mass.h"].decode()
    assert header.count(own) == 1
    with pytest.raises(Refused, match=r"unit behind a state|no unit of SI"):
        checked(TEXT, {**SOURCES, "one_mass.h": header.replace(own, by).encode()})


def test_a_position_that_a_parameter_bears_the_name_of_has_one_unit() -> None:
    """The unit of one of the two was compared with the velocity's: of which, the seed of Python's hashes decided."""
    header = SOURCES["one_mass.h"].decode()
    pairs = [
        ("double x; /* m:", "double x; /* rad:"),
        ("    double K_F;", "    double x; /* m: model parameter */\n    double K_F;"),
        ("        10.0, /* K_F */", "        1.0, /* x */ \\\n        10.0, /* K_F */"),
    ]
    for own, by in pairs:
        assert header.count(own) == 1
        header = header.replace(own, by)
    with pytest.raises(Refused, match=r"x in one_mass\.h has two units"):
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
    source = source.replace(
        b"fabs(inputs->w) + fabs(state->z_v)", b"fabs(inputs->w) + fabs(state->z_q) + fabs(state->z_v)"
    )
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


def test_the_step_in_which_a_sign_turns_is_not_said_to_be_bounded() -> None:
    """The machine that is printed; w turns its slip, and in that step V grows far beyond the factor of a reversal."""
    content, h = json.loads(TEXT), 0.001
    (p, q), (_, r) = ([float(Fraction(x)) for x in row] for row in content["lyapunov_matrix"])
    one_mass = load_twin((HERE / "__init__.py").read_text("utf-8"), "one_mass")
    code, outputs = one_mass.Parameters(), one_mass.Outputs()
    one_mass.prepare(code)
    state = one_mass.State(z_v=1.0, z_rail=50.0 + code.K_F * 1.0)
    x, v, level = 0.0, 1.0, 51.0
    seen = []
    for w in (-1e5, 0.0):
        one_mass.step(state, code, one_mass.Inputs(x=x, w=w), outputs)
        sign = 1.0 if v > 0 else -1.0
        assert sign * outputs.v_hat > 0
        e, d = v - outputs.v_hat, sign * (level - outputs.a_hat_rail)
        seen.append(p * e * e + 2 * q * e * d + r * d * d)
        x, v = x + h * v, v + h * (w - sign * level)
    assert seen[1] > 1000 * float(Fraction(content["reversals"][0]["growth"])) * seen[0]
    (line,) = [line for line in checked(TEXT, SOURCES).proved if "grows by at most the factor" in line]
    besides = "besides, the step in which v_hat passes 0 may move the estimates, which this factor does not include"
    assert line.endswith(f"; {besides}")


def test_of_linearised_errors_the_fall_is_to_first_order() -> None:
    """The second order of the arm's errors is in none of these factors."""
    folder = HERE.parent / "two_link_arm"
    sources = {path.name: path.read_bytes() for path in folder.glob("two_link_arm.[ch]")}
    said = checked((folder / "proof.json").read_text("utf-8"), sources).proved
    assert any(line.startswith("the step multiplies V = e'Pe, to first order in the errors, by") for line in said)
    turns = [line for line in said if "grows by at most the factor" in line]
    assert len(turns) == 2 and all("V is, to first order in the errors, not above" in line for line in turns)
    assert not [line for line in checked(TEXT, SOURCES).proved if "first order" in line]


def test_python_does_not_warn_of_a_proof(recwarn: pytest.WarningsRecorder) -> None:
    for text in ("1if 1 else 2", "1.5or 2", "1e5and 2", "2in 2", "3is 3", "0x1"):
        with pytest.raises(Refused, match=r"is no expression"):
            checked(json.dumps(json.loads(TEXT) | {"domain": [text]}), SOURCES)
    assert not recwarn.list


def test_what_compiles_the_c_is_said_to_be_unchecked() -> None:
    """-Dh_K_F=K_v in a CMakeLists.txt makes another observer of the same C."""
    assert any("macros of a command line (CMakeLists.txt" in x for x in checked(TEXT, SOURCES).open)


def test_the_machine_s_motion_in_a_sample_is_said() -> None:
    """Drift is what the motion deviates from it. "x' = v" alone is kept by a machine that no claim is about.

    Of constant acceleration a without friction x moves by h v + h h a/2 in a sample. Without drift in ellipsoid.json
    the error is said to be at most 1e-5 m/s; it tends to h a/2.
    """
    claim = json.loads((HERE / "ellipsoid.json").read_text("utf-8"))
    ball = {x: claim["sets"][0][x] for x in ("matrix", "weights")}
    ball |= {"rows": [["1", "0", "1/100000"]], "samples": "5000"}
    tiny = [[str(Fraction(x) / 10**12) for x in row] for row in ball["matrix"]]
    f, noise, *_ = ball["weights"]
    ball |= {"matrix": tiny, "weights": [f, str(Fraction(noise) / 10**12)]}
    claim = claim | {"noise": {"inputs.x": "5e-12"}, "drift": {}, "push": [row[:1] for row in claim["push"]]}
    claim = {x: of for x, of in claim.items() if x not in ("friction", "reversals")} | {"sets": [ball]}
    report = checked(TEXT, SOURCES | {"ellipsoid.json": json.dumps(claim).encode()})
    one_mass = load_twin((HERE / "__init__.py").read_text("utf-8"), "one_mass")
    code, outputs, h, a = one_mass.Parameters(), one_mass.Outputs(), 0.001, 210.0
    one_mass.prepare(code)
    state = one_mass.State(z_v=1.0, z_rail=50.0 + code.K_F * 1.0)
    for k in range(2000):
        t = k * h
        one_mass.step(state, code, one_mass.Inputs(x=t + a * t * t / 2, w=a + 50.0), outputs)
    assert abs(1.0 + a * 1999 * h - outputs.v_hat) > 0.1
    (line,) = [line for line in report.proved if "in the long run" in line]
    assert float(line.rsplit(" ", 1)[1]) < 1.1e-5
    assert "in a sample the change of v, x is 0.001 s times v', x' at its start" in report.proved


def test_the_motion_of_semi_implicit_is_another() -> None:
    folder = HERE.parent / "one_mass_cfo_semi_implicit"
    proof = (folder / "proof.json").read_text("utf-8")
    name = json.loads(proof)["name"]
    said = checked(proof, {path.name: path.read_bytes() for path in folder.glob(f"{name}.[ch]")}).proved
    lines = [line for line in said if line.startswith("in a sample")]
    change = "in a sample the change of"
    assert lines == [f"{change} v is 0.001 s times v' at its start", f"{change} x is 0.001 s times x' at its end"]


def test_two_signs_of_one_slip_turn_together() -> None:
    """The factor of a reversal is that of the errors of one sign; of two contacts with one slip, both turn."""
    (line,) = [line for line in checked(TEXT, SOURCES).proved if "grows by at most the factor" in line]
    assert line.startswith("when sign(rail) alone changes, V grows by at most the factor 3.190351; ")
