"""Forgeries that were accepted once: names of functions, signs of the input, numbers out of range, memory of before."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path
from typing import Any

import pytest

import stiction
from codegen.app.derived import Derived
from codegen.checker import frame, verify
from codegen.spec import parse_spec
from tests.checker.forged import GENERATED, certificate, sources
from tests.checker.test_kernel import spec_path
from tests.checker.test_single_precision import single
from tests.checker.test_without_guard import bare

LAW, SINGLE = "state->z_v + parameters->K_v * inputs->x;", "const float v_hat = "
SHOWN = f"const double v_hat = {LAW}"


def guarded() -> dict[str, str]:
    return {name: text.decode() for name, text in sources("one_mass").items() if name.endswith((".c", ".h"))}


def prove(files: dict[str, str], **fields: Any) -> verify.Report:
    proof = json.dumps(certificate("one_mass", "proof.json") | fields)
    return verify.check(proof, sources={name: text.encode() for name, text in files.items()})


def refused(files: dict[str, str], why: str, *changes: tuple[str, str, str], **fields: Any) -> None:
    for end, old, new in changes:
        file = f"one_mass.{end}"
        assert old in files[file], old
        files = files | {file: files[file].replace(old, new, 1)}
    with pytest.raises(verify.Refused, match=re.escape(why)):
        prove(files, **fields)


def test_a_field_that_is_called_as_the_sign_function() -> None:
    """`parameters->one_mass_sign` was read as `parameters.sgn`, another field."""
    fields = ("h", "    double m;", "    double sgn;\n    double one_mass_sign;\n    double m;")
    values = ("h", "        1.0, /* m */", "        1.0, 0.0, 1.0, /* m */")
    law = ("c", LAW, f"parameters->one_mass_sign * ({LAW[:-1]});")
    refused(guarded(), "a field is called as a function", fields, values, law)


@pytest.mark.parametrize("kind", ["double sgn = 1.0;", "double one_mass_sign = 0.0;", "double sgn[2];"])
@pytest.mark.parametrize("loop", [True, False])
def test_a_local_that_is_called_as_the_sign_function(kind: str, loop: bool) -> None:
    body = f"for (int i = 0; i < 1; i++) {{ {kind} }}" if loop else kind
    why = "cannot be read" if loop and "[" in kind else "function" if "[" not in kind else "an array is called"
    refused(guarded(), why, ("c", SHOWN, f"{body} {SHOWN}"))


@pytest.mark.parametrize("sign", ["outputs.v_hat - true.v", "outputs.v_hat - true.v + 1e-30*inputs.w"])
def test_a_sign_of_an_error_is_refused(sign: str) -> None:
    """In the machine the first is a sign of 0, which is never 1 or -1: the theorem then says nothing, with status 0."""
    signs = certificate("one_mass", "proof.json")["signs"] | {"sign.w": sign}
    with pytest.raises(verify.Refused, match="nothing that is known"):
        prove(guarded(), signs=signs)


@pytest.mark.parametrize("sign", ["inputs.w", "inputs.w - 53", "inputs.x*inputs.w"])
def test_a_sign_that_the_machine_does_not_have(sign: str) -> None:
    signs = certificate("one_mass", "proof.json")["signs"] | {"sign.w": sign}
    with pytest.raises(verify.Refused, match="no sign of a slip"):
        prove(guarded(), signs=signs)


ZEROS = {
    "factors that vanish": ("c", LAW, f"1e-30f * 1e-30f * 1e+30f * 1e+30f * ({LAW[:-1]});", "too large or small"),
    "a number without the letter f": ("c", SINGLE, f"float s = 1e-50; {SINGLE} 1e+25f * 1e+25f * s *", "float"),
    "factors that overflow": ("c", LAW, f"1e+30f * 1e+30f * 1e-30f * 1e-30f * ({LAW[:-1]});", "too large or small"),
    "a power of the input": ("c", LAW, f"{LAW[:-1]} + {'inputs->w * ' * 20} 0.0f;", "too large or small"),
}  # fmt: skip


@pytest.mark.parametrize("kind", ZEROS)
def test_numbers_that_floats_do_not_hold(kind: str) -> None:
    """v̂ would be 0, infinite or no number, though in exact arithmetic it is right."""
    end, old, new, why = ZEROS[kind]
    refused(dict(single("one_mass")), why, (end, old, new))


def test_a_value_of_the_header_that_floats_do_not_hold() -> None:
    fields = ("h", "    float m;", "    float unit;\n    float m;")
    values = ("h", "        1.0f, /* m */", "        1e-50, 1.0f, /* m */")
    refused(dict(single("one_mass")), "no float", fields, values)


def test_a_power_that_overflows_in_doubles() -> None:
    refused(dict(bare("one_mass")), "too large or small", ("c", LAW, f"{LAW[:-1]} + {'inputs->w * ' * 60} 0.0;"))


@pytest.mark.parametrize("files", [bare, None], ids=["bare", "guarded"])
def test_a_start_that_depends_on_what_the_memory_held(files: Any) -> None:
    start = "state->z_v = -(parameters->K_v * inputs->x);"
    made = dict(bare("one_mass")) if files else guarded()
    for held in ("0.0 * state->z_v", "(state->z_v - state->z_v)", "0.0 * state->z_rail"):
        refused(made, "is nothing that is known", ("c", start, f"state->z_v = {held} - (parameters->K_v * inputs->x);"))


def test_parameters_that_move_with_each_call_of_prepare() -> None:
    line = "    parameters->one_over_m ="
    made = ("c", line, f"    parameters->K_F = parameters->K_F * 1.0000000000000001;\n{line}")
    refused(guarded(), "is nothing that is known", made)


def test_hostile_files_end_in_time() -> None:
    arrays = "".join(f"double a{k}[999]; " for k in range(16_000))
    terms = " + ".join(f"inputs->a{k}[i]" for k in range(3000))
    sums = f"const double given = 0.0; for (int i = 0; i < 9999; i++) {{ given += {terms}; }}"
    added = "const double given = fabs(inputs->x) + fabs(inputs->w);"
    for change in (("c", SHOWN, arrays + SHOWN), ("c", added, sums)):
        begun = time.process_time()
        refused(guarded(), "too", change)
        assert time.process_time() - begun < 5


def test_the_inequalities_of_a_certificate_have_a_time_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """32 errors with a dense matrix at thousands of vertices took minutes."""
    monkeypatch.setattr(frame, "OF_ALGEBRA", 0.0)
    with pytest.raises(verify.Refused, match="more work than the limit"):
        verify.check(json.dumps(certificate("one_mass")), sources=sources("one_mass"))


def test_a_slip_of_other_factors_is_bound_to_its_code() -> None:
    """The sign of 17/10 v2 is that of v2; and rows of fractions once ended `certify` with a traceback."""
    text = spec_path("two_mass").read_text("utf-8")
    assert "[[1, 0], [-1, 1]]" in text
    text = text.replace("[[1, 0], [-1, 1]]", "[[0.5, 0], [-0.3, 1.7]]")
    machine = Derived(parse_spec(text, Path("two_mass.yaml")))
    files = {name: of.encode() for name, of in machine.files.items()}
    assert verify.status(verify.check(files["certificate.json"].decode(), sources=files)) == 0


NAMES = {"a machine k, with gains K_F and K_v": ("one_mass", "k"), "a parameter check": ("m: {", "check: {")}


@pytest.mark.parametrize("why", NAMES)
def test_names_that_the_code_has_for_something_else_do_not_refuse(why: str, tmp_path: Path) -> None:
    """K_ is the beginning of the macros of a machine k too; `check` is a local variable of the step."""
    text = (GENERATED.parent / "specs" / "one_mass.yaml").read_text("utf-8")
    old, new = NAMES[why]
    text = text.replace(old, new).replace("[m]", "[check]" if "check" in new else "[m]")
    (spec := tmp_path / "names.yaml").write_text(text)
    files = {x: of.encode() for x, of in stiction.load(spec).files.items()}
    assert verify.check(files["certificate.json"].decode(), sources=files).whole


@pytest.mark.parametrize("word", ["ONE_MASS_HOLDING", "ONE_MASS_RUNNING", "ONE_MASS_COLD", "STICTION_ONE_MASS_H"])
def test_a_local_with_the_name_of_a_mode_or_macro_is_refused(word: str) -> None:
    """It would hide the mode with which the step compares, or be no name once the C is preprocessed."""
    local = ("c", SHOWN, f"const double {word} = 1.0;\n    {SHOWN}")
    refused(guarded(), "holds more than statements", local)
    refused(guarded(), "holds more than statements", ("c", SHOWN, SHOWN.replace(LAW, f"0.0 * {word} + {LAW}")))
