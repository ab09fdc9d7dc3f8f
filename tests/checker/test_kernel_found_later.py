"""C and proofs that were accepted in a later attack although C means something else, or that took minutes to read."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import errors, frame, verify

HERE = Path(__file__).parents[2] / "generated" / "one_mass"
RATE = "parameters->one_over_m * (inputs->w - F_hat_rail)"
CHECK = "const double check = z_v_next + z_rail_next;"
GUARD = "fabs(check) <= 1e+150 && state"
SIGN = """static inline double one_mass_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

"""
FAULT = "    outputs->fault = 1;\n"
HANDLER = "    const one_mass_parameters *parameters, const one_mass_inputs *inputs, one_mass_outputs *outputs)\n{\n"


def shipped() -> tuple[dict[str, Any], dict[str, str]]:
    proof = json.loads((HERE / "proof.json").read_text("utf-8"))
    return proof, {path.name: path.read_text("utf-8") for path in HERE.glob("one_mass.[ch]")}


def refused_by_verify(proof: dict[str, Any], files: dict[str, str]) -> None:
    with pytest.raises(verify.Refused):
        verify.check(json.dumps(proof), None, None, {name: text.encode() for name, text in files.items()})


# why, the text before and after, whether kernel.py alone refuses it too
C_TEXTS = {
    "a root of a negative number: no sample has fault 0": (RATE, f"{RATE} + 0.0 * sqrt(-1.0)", True),
    "a root of what is negative for every estimate": (RATE, f"{RATE} + 0.0 * sqrt(-1.0 - v_hat * v_hat)", True),
    "a root in a start": ("_rail = parameters->rail_a;", "_rail = parameters->rail_a + 0.0 * sqrt(-1.0);", False),
    "a root in a derived parameter": ("parameters->h_K_F = ", "parameters->h_K_F = 0.0 * sqrt(-1.0) + ", True),
    "a limit that C cuts to 1": (GUARD, GUARD.replace("1e+150", "18446744073709551617"), True),
    "a limit in octal digits": (GUARD, GUARD.replace("1e+150", "010000000000000"), True),
    "a sign that is defined elsewhere": (SIGN, "", True),
    "a fault that is told to another": (
        FAULT, f"    static one_mass_outputs other;\n    outputs = &other;\n{FAULT}", True),
    "a fault that is told to another, in brackets": (
        FAULT, f"    static one_mass_outputs other;\n    (outputs) = &other;\n{FAULT}", True),
    "a fault that is told to a local": (
        HANDLER, HANDLER.replace("*outputs", "*told") + "    one_mass_outputs there, *outputs = &there;\n", True),
    "a fault above 10 by a high power": (
        CHECK, f"{CHECK[:-1]} + {' * '.join(['v_hat'] * 148)};", True),
    "a fault above 1000 by a large coefficient": (
        CHECK, f"{CHECK[:-1]} + 1e70 * 1e70 * v_hat * v_hat * v_hat;", False),
    "a fault of slips above 0.35 by an exponential": (
        CHECK, f"const double burst = exp(1000.0 * v_hat); {CHECK[:-1]} + burst;", False),
    "a check that is set anew": (CHECK, f"{CHECK[6:]} check = inputs->x + inputs->w;", False),
    "a check that is nothing": (CHECK, f"{CHECK[6:]} check = 0.0 * check + inputs->w;", False),
    "a check from which is subtracted what it holds": (CHECK, f"{CHECK[6:]} check += -z_v_next + inputs->w;", False),
}  # fmt: skip


@pytest.mark.parametrize("case", C_TEXTS)
def test_c_that_means_something_else_is_refused(case: str) -> None:
    old, new, alone = C_TEXTS[case]
    proof, files = shipped()
    assert files["one_mass.c"].count(old) == 1, case
    files["one_mass.c"] = files["one_mass.c"].replace(old, new)
    if alone:
        with pytest.raises(ValueError):
            errors.prove(proof, files)
    refused_by_verify(proof, files)


TEXTS_FOR_LISTS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "matrix": lambda p: p.update(matrix=[p["matrix"][0], "11"]),
    "box": lambda p: p.update(box={"true.v": "19"}),
    "domain": lambda p: p.update(domain="5"),
    "rest": lambda p: p.update(rest="00"),
}


@pytest.mark.parametrize("field", TEXTS_FOR_LISTS)
def test_a_text_is_no_list_of_its_characters(field: str) -> None:
    """ "11" was read as the row 1, 1, and printed as 11."""
    proof, files = shipped()
    TEXTS_FOR_LISTS[field](proof)
    with pytest.raises(verify.Refused, match=r"expected is a list|expected is an object"):
        verify.by_kernel_alone(proof, {name: text.encode() for name, text in files.items()})


@pytest.mark.parametrize("rest", [None, True, 1, "00", {"0": "0"}, [None]], ids=repr)
def test_a_rest_that_is_no_list_of_texts_is_refused_beside_a_certificate(rest: Any) -> None:
    """A rest that is null or true ended in a traceback: it was read before the form of the proof was."""
    sources = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    sources["proof.json"] = json.dumps(json.loads(sources["proof.json"]) | {"rest": rest}).encode()
    with pytest.raises(verify.Refused, match=r"rest.*: expected is a"):
        verify.check(sources["certificate.json"].decode(), None, None, sources)


def halves(depth: int, low: Fraction = Fraction(-1), high: Fraction = Fraction(1)) -> Any:
    middle = (low + high) / 2
    if not depth:
        return ""
    return ["sign.rail", str(middle), halves(depth - 1, low, middle), halves(depth - 1, middle, high)]


LONG: dict[str, Callable[[dict[str, Any], dict[str, str]], Any]] = {
    # Each took a set of all of them: 55 s for these, 100 times that for as many as the limit allowed.
    "ten thousand signs": lambda p, f: p["signs"].update({f"sign.q{k}": "inputs.x" for k in range(10_000)}),
    # A leaf of a constant matrix cost no step of the limit: 20 s.
    "sixty thousand cells": lambda p, f: p.update(cover=halves(16)),
    "a million fields": lambda p, f: f.update({"one_mass.h": f["one_mass.h"].replace(
        "double w;", "double w; " + "".join(f"double a{k}[999]; " for k in range(1000)))}),
}  # fmt: skip


@pytest.mark.parametrize("kind", LONG)
def test_no_proof_takes_minutes(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each ends soon behind a limit of 0.3 s, or before it."""
    monkeypatch.setattr(frame, "SECONDS", 0.3)
    proof, files = shipped()
    LONG[kind](proof, files)
    begun = time.process_time()
    try:
        errors.prove(proof, files)
    except ValueError as why:
        assert re.search("more work than the limit|too many fields|no sign of a slip", str(why))
    assert time.process_time() - begun < 5


@pytest.mark.parametrize("empty", ["", {}], ids=repr)
def test_reversals_that_are_no_list_are_not_read_as_none(empty: Any) -> None:
    proof, files = shipped()
    assert proof["reversals"]
    refused_by_verify(proof | {"reversals": empty}, files)
    sources = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    certificate = json.loads(sources["certificate.json"]) | {"reversals": empty}
    with pytest.raises(verify.Refused, match="reversals"):
        verify.check(json.dumps(certificate), None, None, sources)


@pytest.mark.parametrize("where", ["sets", "after"])
def test_bounds_that_are_no_list_are_not_read_as_none(where: str) -> None:
    sources = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    claim = json.loads(sources["ellipsoid.json"])
    (claim if where == "sets" else claim["sets"][0])[where] = ""
    sources["ellipsoid.json"] = json.dumps(claim).encode()
    with pytest.raises(verify.Refused, match=r"ellipsoid\.json"):
        verify.check(sources["proof.json"].decode(), None, None, sources)


def test_bounds_beside_a_certificate_of_another_v_are_said_not_to_count() -> None:
    """V and 2 V fall alike, and the bounds rest on that of the proof: they are neither checked nor shown."""
    sources = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    certificate = json.loads(sources["certificate.json"])

    def told(certificate: dict[str, Any]) -> tuple[bool, bool]:
        report = verify.check(json.dumps(certificate), None, None, sources)
        return any("long run" in line for line in report.proved), any("ellipsoid.json:" in gap for gap in report.open)

    assert told(certificate) == (True, False)
    doubled = [[str(2 * Fraction(x)) for x in row] for row in certificate["lyapunov_matrix"]]
    assert told(certificate | {"lyapunov_matrix": doubled}) == (False, True)
    del sources["ellipsoid.json"]
    assert told(certificate | {"lyapunov_matrix": doubled}) == (False, False)


def test_the_sign_function_is_sought_in_what_the_compiler_sees() -> None:
    """Its name spliced from two lines: then any other file may define it."""
    proof, files = shipped()
    text = files["one_mass.c"].replace(SIGN, "")
    files["one_mass.c"] = text.replace("one_mass_sign", "one_mass_\\\nsign")
    refused_by_verify(proof, files)


def test_the_check_holds_what_the_states_become() -> None:
    proof, files = shipped()
    pairs = ("double z_v_next", "double other"), (CHECK, f"const double z_v_next = 0.0; {CHECK}")
    for old, new in (*pairs, ("state->z_v = z_v_next;", "state->z_v = other;")):
        files["one_mass.c"] = files["one_mass.c"].replace(old, new)
    refused_by_verify(proof, files)


@pytest.mark.parametrize("again", ["", "        check = z_rail_next;\n"])
def test_a_check_that_is_always_too_large_is_refused(again: str) -> None:
    """One state 1e150-fold: from 1 m/s on every sample is a fault. A second `check` was the one that was measured."""
    proof, files = shipped()
    large, c = "1e75 * (1e75 * (", files["one_mass.c"].replace("const double check = z_v", "double check = z_v")
    for old, new in (
        ("state->z_v = -(parameters->K_v * inputs->x);", f"state->z_v = -({large}parameters->K_v * inputs->x)));"),
        ("parameters->sample_time * parameters->K_v * outputs->v_hat;",
         f"{large}parameters->sample_time * parameters->K_v * outputs->v_hat));"),
        ("outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat);",
         f"{large}outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat)));"),
        ("v_hat = state->z_v +", "v_hat = 1e-75 * (1e-75 * state->z_v) +"),
        ("parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);",
         f"{large}parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat)));"),
        ("        outputs->v_hat = v_hat;\n", f"{again}        outputs->v_hat = v_hat;\n"),
    ):  # fmt: skip
        assert old in c
        c = c.replace(old, new)
    proof["states"]["state.z_v"] = f"1e75*(1e75*({proof['states']['state.z_v']}))"
    errors.prove(proof, files | {"one_mass.c": c})
    with pytest.raises(verify.Refused, match="`check` is set again" if again else "above its limit"):
        verify.by_kernel_alone(proof, {name: text.encode() for name, text in (files | {"one_mass.c": c}).items()})


def test_no_reversal_is_stated_twice() -> None:
    """Of two entries for one sign only the last was verified: a false one before it was accepted with status 0."""
    proof, files = shipped()
    with_false = [{"sign": "sign.rail", "growth": "1", "dwell": "0"}, *proof["reversals"]]
    for claimed in (with_false, proof["reversals"] * 2):
        refused_by_verify(proof | {"reversals": claimed}, files)


def test_a_decimal_that_is_rounded_is_not_enlarged() -> None:
    """1e14 times what the decimal of 1/m differs from it by is 0.05 in each sample, and was proved to be 0."""
    proof, files = shipped()
    files["one_mass.h"] = files["one_mass.h"].replace("1.0, /* one_over_m */", "1.0000000000000005, /* one_over_m */")
    errors.prove(proof, files)
    begin = "    const double z_v_next ="
    assert begin in files["one_mass.c"]
    more = f"{begin} 1e14 * (parameters->one_over_m - 1.0 / parameters->m) * v_hat +"
    refused_by_verify(proof, files | {"one_mass.c": files["one_mass.c"].replace(begin, more)})
