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

import numpy as np
import pytest
import sympy

from codegen.checker import verify
from tests.checker.test_verify import value
from tests.twin import load_twin

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
        modes = ("mode", "invalid_samples", "samples_held")  # no sample of a restart is left
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


def arm_moves(source: str, tries: int = 120) -> list[float]:
    """How far the arm's derivatives of a sample are from I + hA of the sample before, at random points, on doubles.

    The kernel proves the same of the C in exact arithmetic; this is by the twin, and by no algebra.
    """
    content = json.loads((GENERATED / "two_link_arm" / "certificate.json").read_text(encoding="utf-8"))
    module, dice, h = load_twin(source, "two_link_arm"), random.Random(3), float(Fraction(content["sample_time"]))
    parameters, states, found = module.Parameters(), ("z_omega1", "z_omega2", "z_shoulder", "z_elbow"), []
    module.prepare(parameters)
    inputs = [name for name in module.Inputs.__slots__ if name not in ("theta1", "theta2")]

    def run(z: Any, rows: Any) -> list[Any]:
        """(signs, velocities and levels as forces, position) after each of two samples, the machine as estimated."""
        state = module.State(**dict(zip(states, z, strict=True)))
        seen = []
        for row in rows:
            out = module.step(state, parameters, module.Inputs(**row), module.Outputs())
            signs = np.sign([out.omega1_hat, out.omega2_hat])
            levels = signs * [out.a_hat_shoulder, out.a_hat_elbow]
            seen.append((signs, np.array([out.omega1_hat, out.omega2_hat, *levels]), row["theta2"]))
        return seen

    for _ in range(tries):
        speed, at = [dice.uniform(-0.3, 0.3) for _ in range(2)], [dice.uniform(-3, 3) for _ in range(2)]
        drive = {name: dice.uniform(-5, 5) for name in inputs}
        rows = [{"theta1": at[0] + k * h * speed[0], "theta2": at[1] + k * h * speed[1]} | drive for k in range(2)]
        z = np.array([dice.uniform(-1, 1) for _ in states])
        first = run(z, rows)[0][1]
        z[:2] += speed - first[:2]  # a velocity is its state and what the position gives
        base, eps = run(z, rows), 1e-5
        if not (base[0][0] == base[1][0]).all() or min(abs(base[0][1][:2])) < 1e-3:
            continue
        ends = [[run(z + way * eps * unit, rows) for way in (1, -1)] for unit in np.eye(4)]
        J = [np.array([(up[k][1] - down[k][1]) / (2 * eps) for up, down in ends]).T for k in range(2)]
        signs, shown, theta2 = base[0]
        names = {"omega1": shown[0], "omega2": shown[1], "s_shoulder": signs[0], "s_elbow": signs[1], "theta2": theta2}
        theta = {p["name"]: value(p["expression"], names) for p in content["parameters"]}
        step = np.eye(4) + h * np.array([[value(entry, theta) for entry in row] for row in content["matrix"]])
        found.append(float(np.abs(J[1] - step @ J[0]).max()))
    return found


def test_the_arm_s_twin_moves_as_certified() -> None:
    source = (GENERATED / "two_link_arm" / "__init__.py").read_text(encoding="utf-8")
    off = arm_moves(source)
    assert len(off) > 30 and max(off) < 1e-8
    for old, new in (("+ parameters.m2_l1_b2 * cos_theta2", "- parameters.m2_l1_b2 * cos_theta2"),
                     ("* sin_theta2 * omega1_hat * omega1_hat", "* sin_theta2 * omega1_hat * omega2_hat")):  # fmt: skip
        assert old in source
        assert max(arm_moves(source.replace(old, new))) > 1e-5


def wrong_twins(name: str, count: int) -> tuple[int, int]:
    """(seen, harmless) of twins in which one operator or constant of ``step`` or ``prepare`` is changed.

    Seen: no error moves as certified, or nothing runs. Harmless: all do, here and at fresh points, so that the claim is
    still that of the code; what only drives the observer, an input's gain, is of that kind.
    """
    source, dice = rational_source(name), random.Random(name)
    parts = [(source.index("def prepare("), source.index("def init(")), (source.index("def step("), len(source))]
    parts[1] = (source.index("outputs = Outputs()", parts[1][0]), source.index("# this sum is"))
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
            with pytest.raises(verify.Refused, match=f"{name}.c differs from"):
                verify.check(certificate, Path(away))


def test_mutants_of_the_c_are_refused() -> None:
    c_mutants("one_mass", 60)


@pytest.mark.slow
def test_a_thousand_mutants_of_the_c_are_refused() -> None:
    c_mutants("two_mass", 1000)
