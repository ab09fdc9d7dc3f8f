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
CONSTANT = (
    "belt_axis",
    "emps",
    "one_mass",
    "one_mass_domain",
    "rig",
    "rig_to",
    "two_mass",
    "two_mass_cancellation",
    "two_mass_gto",
)


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


def rational_source(name: str) -> str:
    """The committed twin with its decimals as fractions."""
    text = (GENERATED / name / "__init__.py").read_text(encoding="utf-8")
    source = re.sub(r"(?<![\w.])\d+\.\d+(e[-+]?\d+)?", lambda m: f'Fraction("{m.group()}")', text)
    return source.replace("import math\n", "import math\nfrom fractions import Fraction\n", 1)


class Motion:
    """Pairs of runs of a twin in rationals that see the same samples: how their difference moves in one."""

    def __init__(self, name: str, source: str) -> None:
        content = json.loads((GENERATED / name / "certificate.json").read_text(encoding="utf-8"))
        self.twin, self.dice = load_twin(source, name), random.Random(name)
        self.parameters, self.phi = exact(self.twin), certified_step(content)
        self.outputs = [_output(e["name"], self.twin.Outputs.__slots__) for e in content["error"]]
        modes = ("mode", "invalid_samples")
        self.states = [s for s in self.twin.State.__slots__ if s not in modes and not s.startswith("direction_")]
        self.fast = Fraction(getattr(self.parameters, "slip_speed", 0))
        self.levels = [n for n in self.outputs if n.startswith("a_hat")]

    def run(self, z: list[Fraction], rows: list[list[Fraction]]) -> list[tuple[list[int], Any]]:
        """(signs, estimates in force) after each sample."""
        twin, found = self.twin, []
        state = twin.State(**dict(zip(self.states, z, strict=True)))
        for row in rows:
            out = twin.step(state, self.parameters, twin.Inputs(**dict(zip(twin.Inputs.__slots__, row, strict=True))))
            signs = [1 if n not in self.levels else _sign_of(out, n) for n in self.outputs]
            values = [getattr(out, n) for n in self.outputs]
            assert all(isinstance(v, (int, Fraction)) for v in values), "a float is left"
            rational = [sympy.Rational(v.numerator, v.denominator) for v in values]
            found.append((signs, sympy.Matrix([s * v for s, v in zip(signs, rational, strict=True)])))
        return found

    def pairs(self, tries: int) -> list[tuple[Any, Any]]:
        """(difference, difference one sample later), where no slip turned, or, with a domain, was out of it.

        The first sample is not compared: a guard learns there with which sign the level was updated.
        """
        found = []
        for _ in range(tries):
            z = decimals(self.dice.uniform(-9, 9) for _ in self.states)
            rows = [decimals(self.dice.uniform(-0.01, 0.01) for _ in self.twin.Inputs.__slots__) for _ in range(3)]
            base = self.run(z, rows)
            moved = self.run([x + Fraction(self.dice.randrange(-9, 9), 10**4) for x in z], rows)
            runs = (*base, *moved)
            if all(signs == base[0][0] for signs, _ in runs) and all(abs(e[0]) > self.fast for _, e in runs):
                found.append((base[1][1] - moved[1][1], base[2][1] - moved[2][1]))
        return found


@pytest.mark.parametrize("name", CONSTANT)
def test_the_twin_in_rationals_moves_as_certified(name: str) -> None:
    motion = Motion(name, rational_source(name))
    pairs = motion.pairs(40)
    assert len(pairs) >= 8
    assert all(after == motion.phi * before for before, after in pairs)


def wrong_twins(name: str, count: int) -> tuple[int, int]:
    """(seen, harmless) of twins in which one operator or constant of ``step`` or ``prepare`` is changed.

    Seen: no error moves as certified, or nothing runs. Harmless: all do, here and at fresh points, so that the claim is
    still that of the code; what only drives the observer, an input's gain, is of that kind.
    """
    source, dice = rational_source(name), random.Random(name)
    parts = [(source.index("def prepare("), source.index("def init(")), (source.index("def step("), len(source))]
    parts[1] = (source.index("outputs = Outputs()", parts[1][0]), source.index("# one sum detects"))
    kinds = r" [-+*/] |(?<=[(= ])-(?=\w)|Fraction\([^)]*\)|\b(?:parameters|state|inputs)\.\w+(?! = )"
    spots = [m for m in re.finditer(kinds, source) if any(low < m.start() < high for low, high in parts)]
    seen = harmless = 0
    for _ in range(count):
        spot = dice.choice(spots)
        operators = [" - ", " + ", " * ", " / "]
        other = dice.choice([x for x in operators if x != spot.group()]) if spot.group() in operators else ""
        other = other or ("" if spot.group() == "-" else f"({spot.group()} * {dice.choice(['2', '-1', '0'])})")
        wrong = source[: spot.start()] + other + source[spot.end() :]
        try:
            motion = Motion(name, wrong)
            pairs = motion.pairs(20)
        except (ArithmeticError, AssertionError, AttributeError, NameError, SyntaxError, TypeError, ValueError):
            seen += 1
            continue
        if not pairs or any(after != motion.phi * before for before, after in pairs):
            seen += 1
            continue
        motion.dice.seed(1)
        assert all(after == motion.phi * before for before, after in motion.pairs(60)), wrong[spot.start() - 60 :][:120]
        harmless += 1
    return seen, harmless


def test_a_wrong_twin_does_not_move_as_certified() -> None:
    seen, harmless = wrong_twins("one_mass", 25)
    assert seen + harmless == 25 and seen > 8


@pytest.mark.slow
def test_a_thousand_wrong_twins() -> None:
    found = {name: wrong_twins(name, 250) for name in ("one_mass", "two_mass", "rig_to", "belt_axis")}
    print("seen, harmless:", found)
    assert sum(sum(f) for f in found.values()) == 1000 and all(f[0] > 80 for f in found.values())


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
