"""C in single precision: the kernel proves of it what it proves of the same C in doubles, and refuses a mixture."""

from __future__ import annotations

import random
import re
from functools import cache
from pathlib import Path

import pytest

import stiction
from codegen.checker import frame, verify
from tests.checker.forged import GENERATED, replace_once
from tests.slow_cases import slow_except
from tests.twin import load_twin

SPECS = Path(__file__).parents[2] / "specs"
STEP = "const float v_hat ="


@cache
def single(name: str) -> dict[str, str]:
    """The C and header in single precision of a shipped spec."""
    (path,) = (p for p in (SPECS / f"{name}.yaml", SPECS / "thesis" / f"{name}.yaml") if p.exists())
    texts = stiction.load(path).with_overrides(stiction.Overrides(precision="single")).sources
    return {file: texts[file] for file in (f"{name}.c", f"{name}.h")}


def checked(name: str, files: dict[str, str]) -> verify.Report:
    proof = (GENERATED / name / "proof.json").read_text("utf-8")
    return verify.check(proof, sources={file: text.encode() for file, text in files.items()})


SHIPPED = ["one_mass", "two_mass_gto", "one_mass_domain", "two_link_arm", "rig_dfoa"]


@pytest.mark.parametrize("name", slow_except(SHIPPED, ["two_mass_gto", "two_link_arm"]))  # the least and the most
def test_a_shipped_proof_is_one_of_the_c_in_single_precision_too(name: str) -> None:
    files = single(name)
    double = {file: (GENERATED / name / file).read_text("utf-8") for file in files}
    assert "double " not in "".join(files.values())
    of_single, of_double = checked(name, files), checked(name, double)
    assert of_single.whole == of_double.whole
    (covered,) = (line for line in of_single.proved if line.startswith("in exact arithmetic"))
    assert "rounding (of single precision)" in covered
    other = ("in exact arithmetic", "with the values")
    same, others = ([s for s in one.proved if not s.startswith(other)] for one in (of_double, of_single))
    assert [line.replace("1e+150]", "1e+18]").replace("-1e+150,", "-1e+18,") for line in same] == others, (
        "with its own limit of a sample"
    )


def test_a_number_of_more_digits_than_a_float_has_is_that_of_the_certificate(tmp_path: Path) -> None:
    """A mass of one pound was 0.45359236 in the C and 0.45359237 in the matrix: nothing was proved of the C."""
    text = (SPECS / "one_mass.yaml").read_text("utf-8")
    assert text.count("m: {value: 1, unit: kg}") == 1
    (spec := tmp_path / "pound.yaml").write_text(text.replace("{value: 1, unit: kg}", "{value: 1, unit: lb}"))
    files = stiction.load(spec).with_overrides(stiction.Overrides(precision="single")).files
    assert "0.45359237f, /* m */" in files["one_mass.h"]
    report = verify.check(files["certificate.json"], sources={x: text.encode() for x, text in files.items()})
    assert report.whole and not report.unproved


FORGED = {
    "another law": ("c", STEP, f"{STEP} 1e-3f +", "do not show"),
    "a number in double precision": ("c", STEP, f"{STEP} 0.5 * (double)0.0f +", "double and single"),
    "a number that is 0 as a float": ("c", STEP, f"{STEP} 1e-50f * 1e+25f * 1e+25f *", "no float"),
    "a number that is infinite as a float": ("c", STEP, f"{STEP} 1e+50f * 1e-25f * 1e-25f *", "no float"),
    "the limit of doubles": ("c", "<= 1e+18f && state", "<= 1e+150f && state", "form that is read"),
    "a field of doubles": ("h", "float z_rail;", "double z_rail;", "double and single"),
    "a header in doubles": ("h", "float", "double", "form that is read"),
    "a function of its own": ("c", "fabsf(v_hat)", "fabsff(v_hat)", "C calls fabsff"),
    "a whole number": ("c", STEP, f"{STEP} 1/2 * 2.0f *", "out of place"),
    "an f alone": ("c", STEP, f"{STEP} 1f *", "out of place"),
    "a name with the letter after it": (
        "c",
        STEP,
        f"float fabs = 2.0f; {STEP} fabsf *",
        "fabsf is nothing that is known",
    ),
}


@pytest.mark.parametrize("kind", FORGED)
def test_forgeries_are_refused(kind: str) -> None:
    end, old, new, why = FORGED[kind]
    files, file = dict(single("one_mass")), f"one_mass.{end}"
    assert old in files[file]
    files[file] = files[file].replace(old, new) if kind == "a header in doubles" else files[file].replace(old, new, 1)
    with pytest.raises(verify.Refused, match=re.escape(why)):
        checked("one_mass", files)


def test_derived_values_may_differ_by_the_rounding_of_floats_alone() -> None:
    files = dict(single("one_mass"))
    value = re.search(r"(0\.0100\d+)f /\* h_K_F", files["one_mass.h"])
    assert value is not None
    for factor, holds in ((1 + 2**-22, True), (1 + 2**-20, False)):
        files["one_mass.h"] = single("one_mass")["one_mass.h"].replace(value[1], f"{0.01 * factor:.12f}")
        if holds:
            assert checked("one_mass", files).proved
        else:
            with pytest.raises(verify.Refused, match="prepare gives others"):
                checked("one_mass", files)


@pytest.mark.parametrize(
    ("pad", "value", "refusal"),
    [
        ("4.4f", "0.010000001", ""),
        ("4.4f", "0.010004", ""),
        ("4.4f", "0.010005", "prepare gives others"),
        ("9900.3f", "0.010000001", "is its rounding"),
        ("9900.3f", "0.0193", "is its rounding"),
        ("9900.3f", "0.0201", "prepare gives others"),
    ],
)
def test_terms_that_cancel_do_not_let_a_derived_value_differ(pad: str, value: str, refusal: str) -> None:
    """Terms that cancel round by more than the value itself: h_K_F was accepted at twice its exact value."""
    text, formula = single("one_mass")["one_mass.h"], "parameters->sample_time * parameters->K_F;"
    padded = single("one_mass")["one_mass.c"].replace(formula, f"{formula[:-1]} + {pad} - {pad};")
    files = {"one_mass.c": padded, "one_mass.h": text.replace("0.010000001f /* h_K_F", f"{value}f /* h_K_F")}
    assert f"{value}f" in files["one_mass.h"] and padded != single("one_mass")["one_mass.c"]
    if not refusal:
        assert checked("one_mass", files).proved
    else:
        with pytest.raises(verify.Refused, match=refusal):
            checked("one_mass", files)


BALANCE = "    parameters->left = 9900.30f - 9900.30f;\n"


@pytest.mark.parametrize(("value", "real", "holds"), [("1e-12", "double", True), ("0.009", "float", False)])
def test_a_balance_of_which_rounding_is_left(value: str, real: str, holds: bool) -> None:
    """A load equal to its counterweight: with the rounding of doubles it is proved, with that of floats not."""
    files = (
        single("one_mass")
        if real == "float"
        else {f"one_mass.{x}": (GENERATED / "one_mass" / f"one_mass.{x}").read_text("utf-8") for x in "ch"}
    )
    f = "f" if real == "float" else ""
    pairs = {
        "one_mass.c": [("    parameters->h_K_F =", BALANCE.replace("0f", f"0{f}") + "    parameters->h_K_F ="),
                       ("parameters->h_K_F * sign", "(parameters->left + parameters->h_K_F) * sign")],
        "one_mass.h": [(f"    {real} h_K_F;", f"    {real} left;\n    {real} h_K_F;"),
                       (f"        0.01{'0000001' * bool(f)}{f} /*", f"        {value}{f}, 0.01{f} /*")],
    }  # fmt: skip
    changed = dict(files)
    for file, of in pairs.items():
        for old, new in of:
            assert old in changed[file], old
            changed[file] = changed[file].replace(old, new, 1)
    if holds:
        assert checked("one_mass", changed).whole
    else:
        with pytest.raises(verify.Refused, match="is its rounding"):
            checked("one_mass", changed)


@pytest.mark.parametrize(
    ("large", "value", "refusal"),
    [
        ("1e7", "1.0", ""),
        ("3e7", "1.0", "is its rounding"),
        ("3e8", "1.0", "is its rounding"),
        ("3e8", "1.0005", "prepare gives others"),
        ("3e15", "0.2", "is its rounding"),
        ("3e15", "-2.0", "is its rounding"),
        ("3e15", "1.0005", "is its rounding"),
        ("3e15", "1.0", "is its rounding"),
    ],
)
def test_large_terms_that_cancel_do_not_let_a_derived_constant_differ(large: str, value: str, refusal: str) -> None:
    """With 3e15 added and subtracted in `prepare`, an input gain of -2 in place of 1 counted as rounding."""
    files = {f"one_mass.{x}": (GENERATED / "one_mass" / f"one_mass.{x}").read_text("utf-8") for x in "ch"}
    derived = f"    parameters->gain = 1.0 / parameters->m + {large} - {large};\n"
    used = "(parameters->gain * inputs->w - parameters->one_over_m * F_hat_rail -"
    pairs = {
        "one_mass.c": [("    parameters->h_K_F =", f"{derived}    parameters->h_K_F ="), ("(v_dot_hat -", used)],
        "one_mass.h": [
            ("    double h_K_F;", "    double gain;\n    double h_K_F;"),
            ("        0.01 /*", f"        {value}, 0.01 /*"),
        ],
    }
    replace_once(files, pairs)
    if not refusal:
        assert checked("one_mass", files).whole
    else:
        with pytest.raises(verify.Refused, match=refusal):
            checked("one_mass", files)


def test_what_is_read_is_the_c_in_doubles_but_for_its_values() -> None:
    c, d = (frame.read("two_mass_gto", files) for files in (single("two_mass_gto"), {
        file: (GENERATED / "two_mass_gto" / file).read_text("utf-8") for file in ("two_mass_gto.c", "two_mass_gto.h")
    }))  # fmt: skip
    assert c.precision == frame.PRECISIONS["float"] and d.precision == frame.PRECISIONS["double"]
    assert c._replace(precision=d.precision, values={}) == d._replace(values={})
    assert all(abs(x - d.values[p]) <= abs(x) / 2**22 for p, x in c.values.items())


def test_a_sum_that_quantities_of_usual_size_take_beyond_the_limit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """`check` is compared with 1e18: were it beyond in every sample, the step would never run."""
    large = frame.PRECISIONS["float"]._replace(usual=10**18)
    monkeypatch.setitem(frame.PRECISIONS, "float", large)
    with pytest.raises(verify.Refused, match="above its limit"):
        checked("one_mass", single("one_mass"))


ARM = """
name: arm
coordinates: {q1: {velocity: w1, unit: rad}, q2: {velocity: w2, unit: rad}}
inputs: {t1: {unit: N*m}, t2: {unit: N*m}}
parameters:
  a1: {value: 1.9, unit: kg*m^2}
  a2: {value: 0.42, unit: kg*m^2}
  a3: {value: 0.31, unit: kg*m^2}
  g1: {value: 22, unit: N*m}
  g2: {value: 6, unit: N*m}
  g3: {value: 0.1, unit: N*m}
mass_matrix:
  - [a1 + 2*a3*cos(q2), a2 + a3*cos(q2)]
  - [a2 + a3*cos(q2), a2]
force:
  - t1 + a3*sin(q2)*(2*w1*w2 + w2**2) - g1*cos(q1) - g2*cos(q1 + q2)
  - t2 - a3*sin(q2)*w1**2 - g2*cos(q1 + q2) - g3*sin(q1)*cos(q1)*sin(q2)*cos(q2)*cos(q1 + q2)
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: j1, law: coulomb, a: 4, unit: N*m}
    - {name: j2, law: coulomb, a: 1.5, unit: N*m}
observer: {kind: gcfo, velocity: measured, gains: {K_F: 30}, sample_time: 2 ms}
envelope: {q1: [-3.2, 3.2], q2: [-2.5, 2.5], w1: [-2, 2], w2: [-3, 3]}
code: {precision: single}
"""


def test_a_sine_is_not_taken_to_be_as_large_as_its_angle(tmp_path: Path) -> None:
    """The t of lemma 7 counted as an angle of up to 1e3, so the sum `check` as above the limit of floats, 1e18."""
    (spec := tmp_path / "arm.yaml").write_text(ARM)
    files = stiction.load(spec).files
    report = verify.check(files["certificate.json"], sources={x: text.encode() for x, text in files.items()})
    assert report.whole and not report.unproved
    assert "every coefficient of 1 cell: V" in " ".join(report.facts)
    code, dice = load_twin(files["__init__.py"], "arm_in_floats"), random.Random(1)
    parameters, largest = code.Parameters(), 0.0
    for _ in range(2000):
        state = code.State(z_j1=dice.uniform(-1e3, 1e3), z_j2=dice.uniform(-1e3, 1e3))
        inputs = code.Inputs(*(dice.choice((-1e3, 1e3)) * dice.random() ** 0.1 for _ in code.Inputs.__slots__))
        assert code.step(state, parameters, inputs).fault == 0
        largest = max(largest, abs(state.z_j1), abs(state.z_j2))
    assert 1e5 < largest < 1e18
