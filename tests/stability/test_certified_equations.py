"""The certified matrix is that of the code: the committed twin, run in rationals, moves its error by exactly I + hA.

No float is left: the twin's parameters are the decimals of the spec, ``prepare`` derives the rest, and signs are whole
numbers. Two runs that see the same samples and differ in their states differ by the error's own motion. And a C file
in which one operator or constant is changed no longer has the hash that the certificate states.
"""

from __future__ import annotations

import json
import random
import re
import tempfile
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
import sympy

from codegen.checker import verify
from codegen.replay.twin import load_twin

GENERATED = Path(__file__).parents[2] / "generated"
CONSTANT = ("belt_axis", "emps", "one_mass", "rig", "rig_to", "two_mass", "two_mass_cancellation", "two_mass_gto")


def certified_step(content: Any) -> Any:
    """I + hA of a certificate without parameters, in SymPy rationals."""

    def value(e: Any) -> Any:
        if isinstance(e, str):
            return sympy.Rational(e)
        values = [value(x) for x in e[1:]]
        one = {"neg": lambda: -values[0], "+": lambda: sum(values), "/": lambda: values[0] / values[1]}
        return one.get(e[0], lambda: sympy.prod(values))()

    assert content["parameters"] == []
    a = sympy.Matrix([[value(e) for e in row] for row in content["matrix"]])
    return sympy.eye(a.rows) + sympy.Rational(content["sample_time"]) * a


def exact(module: Any) -> Any:
    """The twin's parameters as the decimals that they stand for."""
    module._sign = lambda u: (u > 0) - (u < 0)
    module._quotient = lambda a, b: Fraction(a) / b
    parameters = module.Parameters()
    module.prepare(parameters)
    return parameters


def decimals(numbers: Any) -> list[Fraction]:
    return [Fraction(round(x, 3)).limit_denominator(1000) for x in numbers]


@pytest.mark.parametrize("name", CONSTANT)
def test_the_twin_in_rationals_moves_as_certified(name: str) -> None:
    text = (GENERATED / name / "__init__.py").read_text(encoding="utf-8")
    source = re.sub(r"(?<![\w.])\d+\.\d+(e[-+]?\d+)?", lambda m: f'Fraction("{m.group()}")', text)
    source = source.replace("import math\n", "import math\nfrom fractions import Fraction\n", 1)
    content = json.loads((GENERATED / name / "certificate.json").read_text(encoding="utf-8"))
    twin, dice = load_twin(source, name), random.Random(name)
    parameters, phi = exact(twin), certified_step(content)
    states, inputs, size = [n for n in twin.State.__slots__ if n != "waiting"], twin.Inputs.__slots__, phi.rows
    outputs = {e["name"]: _output(e["name"], twin.Outputs.__slots__) for e in content["error"]}
    levels = [n for n in outputs.values() if n.startswith("a_hat")]

    def run(z: list[Fraction], rows: list[list[Fraction]]) -> list[Any]:
        state, found = twin.State(**dict(zip(states, z, strict=True))), []
        for row in rows:
            out = twin.step(state, parameters, twin.Inputs(**dict(zip(inputs, row, strict=True))))
            force = [1 if n not in levels else _sign_of(out, n) for n in outputs.values()]
            values = [getattr(out, n) for n in outputs.values()]
            assert all(isinstance(v, (int, Fraction)) for v in values), "a float is left"
            found.append(
                (
                    force,
                    sympy.Matrix(
                        [s * sympy.Rational(v.numerator, v.denominator) for s, v in zip(force, values, strict=True)]
                    ),
                )
            )
        return found

    agreed = 0
    for _ in range(40):
        z = decimals(dice.uniform(-9, 9) for _ in states)
        rows = [decimals(dice.uniform(-0.01, 0.01) for _ in inputs) for _ in range(2)]
        base = run(z, rows)
        moved = run([x + Fraction(dice.randrange(-9, 9), 10**4) for x in z], rows)
        if base[0][0] != base[1][0] or any(base[k][0] != moved[k][0] for k in (0, 1)):
            continue  # a slip turned
        assert (base[1][1] - moved[1][1]) == phi * (base[0][1] - moved[0][1])
        agreed += 1
    assert agreed >= 8 and size == len(outputs)


def _output(error: str, names: Any) -> str:
    """e_v → v_hat, e_a_rail → a_hat_rail, e_F_x → tracked_x."""
    rest = error.removeprefix("e_")
    letter, _, place = rest.partition("_")
    found = [n for n in (f"{rest}_hat", f"{letter}_hat_{place}", f"tracked_{place}") if n in names]
    assert len(found) == 1, (error, names)
    return found[0]


def _sign_of(out: Any, level: str) -> int:
    """The slip's sign, from the force and the level that the twin gives."""
    force, a = getattr(out, level.replace("a_hat", "F_hat")), getattr(out, level)
    return 0 if a == 0 else int((force > 0) - (force < 0)) * int((a > 0) - (a < 0))


def c_mutants(name: str, count: int) -> None:
    dice, folder = random.Random(name), GENERATED / name
    text, certificate = (
        (folder / f"{name}.c").read_text(encoding="utf-8"),
        (folder / "certificate.json").read_text("utf-8"),
    )
    body = text.index("_step(")
    spots = [m for m in re.finditer(r" [-+*/] |\d+\.\d+|[<>]=?", text) if m.start() > body]

    with tempfile.TemporaryDirectory() as away:
        for file in folder.iterdir():
            if file.is_file():
                (Path(away) / file.name).write_bytes(file.read_bytes())
        assert verify.check(certificate, Path(away)).unbound == ()
        for _ in range(count):
            spot = dice.choice(spots)
            other = dice.choice(
                [x for x in (" - ", " + ", " * ", " / ", "0.5", "3.25", "<", ">=") if x != spot.group()]
            )
            (Path(away) / f"{name}.c").write_text(text[: spot.start()] + other + text[spot.end() :], encoding="utf-8")
            with pytest.raises(verify.Refused, match=f"{name}.c has the SHA-256"):
                verify.check(certificate, Path(away))


def test_mutants_of_the_c_are_refused() -> None:
    c_mutants("one_mass", 60)


@pytest.mark.slow
def test_a_thousand_mutants_of_the_c_are_refused() -> None:
    c_mutants("two_mass", 1000)
