"""The bound of the rounding of a step holds of the compiled C, and refuses a certificate that rounding makes false."""

from __future__ import annotations

import ctypes
import json
import math
import random
import re
from fractions import Fraction
from math import prod
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.checker import errors, frame, held, kernel, rounding, theorem, verify
from tests.checker.forged import GENERATED, certificate, replace_once
from tests.checker.test_single_precision import checked, single
from tests.compiled.toolchain import compiled
from tests.slow_cases import slow_except

SHIM = """
#include "NAME.c"
#include <string.h>
void run(const REAL *given, REAL *states, REAL *estimates) {
    const NAME_parameters p = UPPER_PARAMETERS;
    NAME_state s; NAME_inputs x; NAME_outputs y;
    memcpy(&x, given, sizeof x);
    memcpy(&s, states, STATES * sizeof(REAL));
    s.mode = UPPER_RUNNING; s.invalid_samples = 0; y.fault = 1;
    NAME_step(&s, &p, &x, &y);
    memcpy(states, &s, STATES * sizeof(REAL));
    memcpy(estimates, &y, OUTPUTS * sizeof(REAL));
}
"""
UNIT = {"float": Fraction(1, 2**24), "double": Fraction(1, 2**53)}


def of(name: str, real: str) -> dict[str, str]:
    shipped = {f"{name}.{x}": (GENERATED / name / f"{name}.{x}").read_text("utf-8") for x in "ch"}
    return dict(single(name)) if real == "float" else shipped


def named(x: str, text: str) -> bool:
    return re.search(rf"{re.escape(x)}(?![\w\[])", text) is not None


def at(p: Any, point: dict[str, Fraction]) -> Fraction:
    return sum((c * prod(point[x] for x in m) for m, c in p.items()), Fraction(0))


WAVES = (
    "sin(inputs.t)",
    "cos(inputs.t)",
    "sin(inputs.p + 2.0*inputs.t)",
    "cos(inputs.w*inputs.t)",
    "sin(cos(inputs.p))",
)


def test_a_size_is_not_below_that_of_any_product_of_sines_and_not_that_of_their_angles() -> None:
    """A t of an angle counts as at most 1, whatever the angle and the power: a sine is then at most 2, a cosine 3.

    An input of the name t is none.
    """
    dice, precision = random.Random(67), frame.PRECISIONS["float"]
    usual = precision.usual
    for _ in range(100):
        terms = [
            (dice.randint(1, 9), dice.choices(WAVES, k=dice.randint(1, 5)), dice.choices("ptw", k=dice.randint(0, 2)))
            for _ in range(dice.randint(1, 3))
        ]
        text = " - ".join("*".join([f"{c}.0", *waves, *(f"inputs.{x}" for x in plain)]) for c, waves, plain in terms)
        code = rounding.Bounded({f"inputs.{x}": kernel.term(1, f"inputs.{x}") for x in "ptw"}, {}, precision)
        p = code.value(text)
        sizes = held.largest(p, dict.fromkeys(rounding.bounded_by_one(code.known), 1), usual), code.most(p)
        for _ in range(50):
            inputs = SimpleNamespace(**{x: dice.choice((-1, 1)) * usual * dice.random() ** 9 for x in "ptw"})
            value = abs(eval(text, {"sin": math.sin, "cos": math.cos, "inputs": inputs}))
            assert value <= min(sizes), text
        assert max(sizes) <= sum(c * 3 ** len(waves) * usual ** len(plain) for c, waves, plain in terms), text


def test_replaced_names_have_the_values_of_what_replaces_them() -> None:
    """At random points, also where terms cancel: no coefficient is 0, as of every polynomial of the kernel."""
    dice = random.Random(5)

    def drawn(names: str) -> Any:
        terms = (kernel.term(dice.randint(-2, 2), *sorted(dice.choices(names, k=dice.randint(0, 3)))) for _ in range(6))
        return sum(terms, kernel.Poly())

    for _ in range(200):
        p, values = drawn("abxy"), {"x": drawn("ab"), "y": dice.choice([drawn("abx"), kernel.term(1), kernel.Poly()])}
        point = {name: Fraction(dice.randint(-9, 9), 7) for name in "abxy"}
        found = rounding.substituted(p, values)
        assert at(found, point) == at(p, point | {x: at(q, point) for x, q in values.items()})
        assert all(found.values()) and "y" not in found.names()


MACHINES = ["one_mass", "rig_to", "emps", "belt_axis", "two_mass", "two_mass_gto", "chain"]
COMPILED = [(name, real) for name in MACHINES for real in UNIT]


@pytest.mark.parametrize(  # one by both, each other one by one: the lines are the same, and each is compiled for it
    ("name", "real"), slow_except(COMPILED, [*COMPILED[:3], *COMPILED[5:14:4], *COMPILED[6:14:4]], several=True)
)
def test_no_step_of_the_compiled_c_is_off_by_more(name: str, real: str, tmp_path: Path) -> None:
    """At random states and inputs of many sizes, half of them such that a velocity estimate nearly vanishes."""
    proof, files = certificate(name, "proof.json"), of(name, real)
    shown = errors.prove(proof, files) | {"numbers": theorem.numbers(proof)}
    c, code = shown["c"], rounding.step(proof, shown)
    shim = SHIM.replace("NAME", name).replace("UPPER", name.upper()).replace("REAL", real)
    shim = shim.replace("STATES", str(len(c.states))).replace("OUTPUTS", str(len(c.outputs)))
    for file, text in {**files, "shim.c": shim}.items():
        (tmp_path / file).write_text(text, "utf-8")
    (tmp_path / "shim.so").write_bytes(compiled(["gcc", "-std=c99", "-O2", "-fPIC", "-shared"], tmp_path, "shim.c"))
    run, number = ctypes.CDLL(str(tmp_path / "shim.so")).run, ctypes.c_float if real == "float" else ctypes.c_double
    draw, unit, compared, largest = random.Random(name + real), UNIT[real], 0, Fraction(0)
    estimates = {e["estimate"]: code.names[e["estimate"]] for e in proof["errors"]}
    slips = {x: p for x, p in estimates.items() if any(named(x, of) for of in proof["signs"].values())}
    for k in range(40 if name == "chain" else 400):
        given = (number * len(c.inputs))(*(draw.gauss(0, 10.0 ** draw.randint(-3, 3)) for _ in c.inputs))
        states = (number * len(c.states))(*(draw.gauss(0, 10.0 ** draw.randint(-3, 3)) for _ in c.states))
        point = dict(zip(c.inputs, map(Fraction, given), strict=True)) | dict.fromkeys(c.states, Fraction(0))
        for p in slips.values() if k % 2 else ():
            (z,) = p.names() & {*c.states}
            states[c.states.index(z)] = -float(at(p, point)) * (1 + draw.choice((-99, 99)) * float(unit))
        point |= dict(zip(c.states, map(Fraction, states), strict=True))

        def most(x: str, size: dict[str, Fraction]) -> Fraction:
            bound, n = code.bounds[x]
            return n * unit / (1 - n * unit) * at(bound, size)

        size = {x: abs(v) for x, v in point.items()}
        text = {x: (at(p, point), most(x, size)) for x, p in slips.items()}
        signs = {}
        for s, slip in proof["signs"].items():
            used = [x for x in slips if named(x, slip)]
            value = eval(re.sub(r"outputs\.[\w\[\]]+", lambda m: f"text[{m[0]!r}][0]", slip), {}, {"text": text})
            signs[s] = Fraction((value > 0) - (value < 0)) if abs(value) > 2 * sum(text[x][1] for x in used) else None
        if None in signs.values():  # the sign of the code may be another one than in exact arithmetic
            continue
        found, compared = (number * len(c.outputs))(), compared + 1
        run(given, states, found)
        point, size = point | signs, size | {s: abs(v) for s, v in signs.items()}
        for x, value in [*zip(c.states, states, strict=True), *zip(c.outputs, found, strict=True)]:
            off = abs(Fraction(value) - at(code.names[x], point))
            assert off <= most(x, size), (x, k)
            largest = max(largest, off / most(x, size) if off else largest)
    assert compared > (10 if name == "chain" else 250)
    assert largest > Fraction(1, 50)  # and the bound is no idle one


GAIN = "parameters->sample_time * (v_dot_hat -"
LARGE = (
    "parameters->sample_time * (parameters->large * inputs->w - {0} * inputs->w - parameters->one_over_m * F_hat_rail -"
)


@pytest.mark.parametrize(
    ("real", "large", "value"),
    [("float", "1e6", "1000001.45"), ("float", "3e3", "3001.001"), ("double", "1e12", "1000000000001.0008")],
)
def test_an_input_gain_that_rounding_changes_is_refused(real: str, large: str, value: str) -> None:
    """By 45 % in single precision: the header's `large` is 1/m + 1e6 to within its rounding, and 1e6 w is taken off."""
    files, f = of("one_mass", real), "f" * (real == "float")
    derived = re.search(r" 0\.01\d*f? /\* h_K_F", files["one_mass.h"])
    assert derived is not None
    pairs = {
        "one_mass.c": [
            (
                "    parameters->h_K_F",
                f"    parameters->large = 1.0{f} / parameters->m + {large}{f};\n    parameters->h_K_F",
            ),
            (GAIN, LARGE.format(f"{large}{f}")),
        ],
        "one_mass.h": [
            (f"    {real} h_K_F;", f"    {real} large;\n    {real} h_K_F;"),
            (derived[0], f" {value}{f},{derived[0]}"),
        ],
    }
    replace_once(files, pairs)
    with pytest.raises(
        verify.Refused, match=re.escape("state.z_v: terms of a sum cancel, and what is left is its rounding error")
    ):
        checked("one_mass", files)


@pytest.mark.parametrize(("real", "offset"), [("float", "1e8"), ("double", "1e17")])
def test_a_state_with_a_large_number_added_is_refused(real: str, offset: str) -> None:
    """The velocity estimate is then a multiple of 8 m/s, since the state is."""
    files, proof, number = of("one_mass", real), certificate("one_mass", "proof.json"), offset + "f" * (real == "float")
    text = files["one_mass.c"]
    for old, new in (
        ("v_hat = state->z_v +", f"v_hat = (state->z_v - {number}) +"),
        ("state->z_v = -(parameters->K_v * inputs->x);", f"state->z_v = {number} - parameters->K_v * inputs->x;"),
        ("state->z_v = outputs->v_hat - ", f"state->z_v = {number} + outputs->v_hat - "),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    proof["states"]["state.z_v"] += f" + {offset}"
    sources = {"one_mass.c": text.encode(), "one_mass.h": files["one_mass.h"].encode()}
    with pytest.raises(verify.Refused, match="a state holds more than estimates"):
        verify.check(json.dumps(proof), sources=sources)


def test_an_estimate_that_rounds_more_than_the_states_is_refused() -> None:
    files = of("one_mass", "float")
    shown = "outputs->v_hat = v_hat"
    assert files["one_mass.c"].count(shown) == 1
    files["one_mass.c"] = files["one_mass.c"].replace(shown, f"{shown} + 1e6f * inputs->x - 1e6f * inputs->x")
    with pytest.raises(verify.Refused, match="v_hat: terms of a sum cancel, and what is left is its rounding error"):
        checked("one_mass", files)


@pytest.mark.parametrize(
    ("real", "rate", "holds"), [("float", "1/20", True), ("float", "1/1000", False), ("double", "1/1000", True)]
)
def test_a_decay_below_the_rounding_of_the_states_is_refused(real: str, rate: str, holds: bool) -> None:
    """V is claimed to fall by 1e-4 or 2e-6 of itself in a sample; a float rounds by 6e-8, some 30 times a step."""
    proof = certificate("one_mass", "proof.json") | {"decay_rate": rate, "reversals": []}
    sources = {file: text.encode() for file, text in of("one_mass", real).items()}
    if holds:
        assert verify.check(json.dumps(proof), sources=sources).proved
    else:
        with pytest.raises(verify.Refused, match="V may grow by rounding"):
            verify.check(json.dumps(proof), sources=sources)


def test_the_sign_of_a_sum_that_rounding_changes_is_refused() -> None:
    """The code's sign was that of v_hat + 0.019 w: `large` less its formula is within the rounding of 4e4."""
    files = of("one_mass", "float")
    derived = re.search(r" 0\.01\d*f /\* h_K_F", files["one_mass.h"])
    assert derived is not None
    pairs = {
        "one_mass.c": [
            ("    parameters->h_K_F =", "    parameters->large = 40000.3f;\n    parameters->h_K_F ="),
            ("sign(v_hat)", "sign(v_hat + (parameters->large * inputs->w - 40000.3f * inputs->w))"),
        ],
        "one_mass.h": [
            ("    float h_K_F;", "    float large;\n    float h_K_F;"),
            (derived[0], f" 40000.319f,{derived[0]}"),
        ],
    }
    replace_once(files, pairs)
    with pytest.raises(verify.Refused, match="terms of a sum cancel, and what is left is its rounding error"):
        checked("one_mass", files)


W9 = " * ".join(["inputs->w"] * 9)
NOTHING = {
    "a quotient by itself": (
        "4e15",
        "4000000000000000.0",
        "parameters->large * inputs->w * (2.0 + sin(inputs->x)) / (2.0 + sin(inputs->x)) - 4e15 * inputs->w",
    ),
    "cos^2 + sin^2 - 1": (
        "0.0",
        "1.0",
        "parameters->large * inputs->w"
        " + 1e17 * inputs->w * (sin(inputs->x) * sin(inputs->x) + cos(inputs->x) * cos(inputs->x) - 1.0)",
    ),
    "a high power": ("0.0", "1.0000000000000008", f"inputs->w + (parameters->large * {W9} - {W9})"),
}


@pytest.mark.parametrize("kind", NOTHING)
def test_terms_that_are_nothing_in_exact_arithmetic_do_not_hide_their_rounding(kind: str) -> None:
    """The input gain was 0, or off by 10, or 800 m/s^2 were added at 100 N: the status was 0."""
    files, (large, value, gain) = of("one_mass", "double"), NOTHING[kind]
    pairs = {
        "one_mass.c": [
            ("    parameters->h_K_F", f"    parameters->large = 1.0 / parameters->m + {large};\n    parameters->h_K_F"),
            (GAIN, f"parameters->sample_time * ({gain} - parameters->one_over_m * F_hat_rail -"),
        ],
        "one_mass.h": [
            ("    double h_K_F;", "    double large;\n    double h_K_F;"),
            (" 0.01 /* h_K_F", f" {value}, 0.01 /* h_K_F"),
        ],
    }
    replace_once(files, pairs)
    with pytest.raises(
        verify.Refused, match=re.escape("state.z_v: terms of a sum cancel, and what is left is its rounding error")
    ):
        checked("one_mass", files)
