"""Variables that the kernel makes for itself: no two share a name. Each of these passed, or hung, under attack."""

from __future__ import annotations

import json
import math
import re
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import errors, frame, kernel, verify
from codegen.checker.kernel import Poly, term

GENERATED = Path(__file__).parents[2] / "generated"


def test_signs_of_different_polynomials_are_different_variables() -> None:
    known: dict[Any, Any] = {}
    found = {}
    for entry in range(40):
        found[entry] = kernel.function("sgn", term(entry + 1, "x"), known)
        angle = kernel.function("cos", term(entry + 1, "x"), known)
        assert angle.names().isdisjoint(found[entry].names())
    assert len({name for value in found.values() for name in value.names()}) == len(found)
    assert kernel.function("fabs", term(7, "x"), known) == found[6] * term(7, "x")


@pytest.mark.parametrize("name", ["exp2", "expf", "tanh", "sqrt", "int", "one_mass_sign"])
def test_a_function_that_the_kernel_does_not_know_has_no_value(name: str) -> None:
    """exp2 and exp were once one variable, so that exp(omega) passed for exp2(theta)."""
    with pytest.raises(ValueError, match="calls"):
        kernel.Text({"x": term(1, "x")}, {}).value(f"{name}(x)")


def test_an_exponential_is_a_variable_of_its_own_and_of_its_argument() -> None:
    known: dict[Any, Any] = {}
    x, error = term(1, "x"), term(1, "error of true.v")
    found = [kernel.function("exp", term(k, "x"), known) for k in (1, 2, -1)]
    found += [kernel.function("cos", found[0], known), kernel.function("sgn", x, known)]
    assert len({min(p.names()) for p in found}) == len(found) and kernel.function("exp", x, known) == found[0]
    moved = kernel.function("exp", x + error, known)
    assert kernel.Poly({m: c for m, c in moved.items() if m.count("error of true.v") < 2}) == found[0] * (
        term(1) + error
    )
    assert abs(float(kernel.function("exp", term("-1/10"), known).constant()) - math.exp(-0.1)) < 1e-15


def test_the_share_of_an_exponential_is_no_tangent_of_an_angle() -> None:
    """A cosine of exp(x) is given by the tangent "?0 t"; the share of exp(x) of its bound has another name."""
    known: dict[Any, Any] = {}
    curve = kernel.function("exp", term(-1, "x"), known)
    angle = kernel.function("cos", curve, known)
    used = kernel.cleared(curve * angle, known, lambda q: None).names()
    assert {name for name in used if name.endswith(" t")} == {"?0 t", "?0 share t"}


def test_the_kernel_s_name_of_the_sign_is_no_function_of_c() -> None:
    with pytest.raises(ValueError, match="out of place"):
        frame.assignments("const double a = sgn(x);", "one_mass_sign")
    assert frame.assignments("const double a = one_mass_sign(x);", "one_mass_sign") == [("a", "sgn(x)")]


def tangent(p: Poly, known: dict[Any, Any]) -> set[str]:
    """The variable of lemma 7 by which a cosine is given: of its only divisor, 1 + t^2."""
    names = kernel.function("cos", p, known).names()
    (divisor,) = (of for (name, of), r in known.items() if name == "1/" and r.names() <= names)
    found: set[str] = divisor.names()
    return found


@pytest.mark.parametrize("x", "abcdefgh")  # the fault showed for half of the names, by the order of a set
def test_the_angle_of_a_product_is_not_that_of_a_name_spelt_alike(x: str) -> None:
    known: dict[Any, Any] = {}
    angles = [term(1, 3 * x), term(1, x) * term(1, 2 * x), term(1, x, x, x), term(2, 3 * x), term(1, 3 * x, 3 * x)]
    found = [tangent(p, known) for p in angles]
    assert found[0] == {f"{3 * x} t"} and len(set.union(*found)) == len(found)


def test_statements_that_are_not_plain_are_refused_in_one_reading() -> None:
    """With a comma behind 60 assignments the form was tried in 2^60 ways."""
    line = "state.z_plates = parameters.plates_a; "
    assert len(frame.assignments(60 * line, "sign")) == 60
    with pytest.raises(ValueError, match="no expression"):
        kernel.Text({"parameters.plates_a": term(1)}, {}).run(
            frame.assignments(60 * line + "state.z_plates = 1.0, 2.0;", "sign"), ["state.z_plates"]
        )


def test_many_cells_of_long_parameters_are_refused_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame, "OF_ALGEBRA", 1)
    top = json.loads((GENERATED / "one_mass" / "certificate.json").read_text("utf-8"))
    top["variables"] = {name: ["0", "100"] for name in "xy"}
    top["splits"] = {name: [str(k) for k in range(101)] for name in "xy"}
    top["parameters"] = [{"name": "p", "expression": ["exp", ["*", "1/4", ["+", "x", "y", *["1/7"] * 20]]]}]
    top["matrix"][0][0] = ["+", top["matrix"][0][0], ["*", "0", "p"]]
    begun = time.thread_time()
    with pytest.raises(verify.Refused, match="more work than the limit"):
        verify.check(json.dumps(top), sources={})
    assert time.thread_time() - begun < 4


def test_a_state_of_which_nothing_is_said_is_named_and_the_proof_is_not_of_the_whole_code() -> None:
    """A state that follows an estimate, in no error and in no formula."""
    texts = {f"rig.{end}": (GENERATED / "rig" / f"rig.{end}").read_text("utf-8") for end in "ch"}
    proof = verify.theorem.read((GENERATED / "rig" / "proof.json").read_text("utf-8"))
    assert proof is not None
    shown = errors.prove(proof, texts)
    assert shown["whole"] and shown["aside"] == []
    field, line = (
        re.search(r"    double z_\w+; .*\n", texts["rig.h"]),
        re.search(r" +state->z_\w+ = z_\w+_next;\n", texts["rig.c"]),
    )
    assert field and line
    texts["rig.h"] = texts["rig.h"].replace(field[0], field[0] + "    double z_x;\n", 1)
    texts["rig.c"] = texts["rig.c"].replace(line[0], line[0] + "        state->z_x = 1000.0 * omega_hat;\n", 1)
    shown = errors.prove(proof, texts)
    assert not shown["whole"] and shown["aside"] == ["state.z_x"]
    domain = GENERATED / "one_mass_domain"
    texts = {f"one_mass_domain.{end}": (domain / f"one_mass_domain.{end}").read_text("utf-8") for end in "ch"}
    proof = verify.theorem.read((domain / "proof.json").read_text("utf-8"))
    assert proof is not None
    shown = errors.prove(proof, texts)
    shown = verify.theorem.proved(proof, {name: text.encode() for name, text in texts.items()})
    assert shown["aside"] == ["state.x_predicted"] and not shown["whole"]
    said = verify.statements.words(proof, shown)
    assert any("except x_predicted, for which nothing is claimed" in line for line in said)


def test_a_sign_is_a_number_s_own_and_one_variable_for_one_polynomial() -> None:
    """What a proof says of the sign of -1 is not believed; x + y is y + x, and not x - y."""
    known: dict[Any, Any] = {("sgn", term(-1)): term(1)}
    assert kernel.function("fabs", term(-1), known) == term(1) and kernel.function("sgn", term(-1), known) == term(-1)
    x, y = term(1, "x"), term(1, "y")
    assert kernel.function("sgn", x + y, known) == kernel.function("sgn", y + x, known)
    assert kernel.function("sgn", x + y, known) != kernel.function("sgn", x - y, known)


@pytest.mark.parametrize("name", ["sign.rail", "sign.cos inputs.x", "inputs.x t"])
def test_only_signs_and_tangents_have_ranges_of_their_own(name: str) -> None:
    low = -1 if name.startswith("sign.") else 0
    p = term(1, name)
    kernel.semidefinite([[p - term(low)]], {}, "", {})
    kernel.semidefinite([[term(1) - p]], {}, "", {})
    for wrong in (p - term(low) - term(Fraction(1, 99)), term(Fraction(98, 99)) - p):
        with pytest.raises(ValueError, match="not positive semidefinite"):
            kernel.semidefinite([[wrong]], {}, "", {})
    with pytest.raises(ValueError, match="not cut between its ends"):
        kernel.semidefinite([[p]], {}, [name, "1", "", ""], {})
    with pytest.raises(ValueError, match="without a range"):
        kernel.semidefinite([[term(1, name.replace("sign.", "sign_").replace(" t", " u"))]], {}, "", {})


def test_the_tangent_of_half_a_sign_is_no_sign() -> None:
    """Its square was 1 by its name, which made the cosine of 1 and of -1 zero."""
    known: dict[Any, Any] = {}
    c, s = (kernel.function(name, term(1, "sign.rail"), known) for name in ("cos", "sin"))
    assert kernel.cleared(c, known) and kernel.cleared(s * s - term(1), known)
    assert not kernel.cleared(c * c + s * s - term(1), known)
    (t,) = tangent(term(1, "sign.rail"), known)
    assert term(1, t) * term(1, t) != term(1)


def test_the_angle_of_an_unknown_sign_is_not_that_of_a_sum() -> None:
    """Both were called ?3 where three divisors and three known values stood before."""
    for before in range(6):
        known: dict[Any, Any] = {}
        for k in range(before):
            kernel.function("cos", term(k + 2, "y"), known)
        for k in range(12):
            one = tangent(kernel.function("sgn", term(k + 1, "x"), known), known)
            assert all(one.isdisjoint(tangent(term(k + j + 2, "z"), known)) for j in range(6))
