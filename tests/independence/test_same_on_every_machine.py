"""Same spec, same bytes, whatever the processor: the kernels of BLAS and the loops of NumPy are chosen at start."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest

from codegen.base.exact_numbers import eigenvalues, first_largest, geometric, power_of_ten, sine_cosine, square_root

ROOT = Path(__file__).parents[2]
SPECS = sorted([*ROOT.glob("specs/*.yaml"), *ROOT.glob("specs/thesis/*.yaml")])
LOOPS = "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V3 X86_V4"
MACHINES = {
    "this one": {},
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "Nehalem, plain loops": {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": LOOPS},
    "Zen, plain libm": {"OPENBLAS_CORETYPE": "Zen", "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"},
}
SEARCHED = {
    "two_mass_gdfo": ("proof.json", "sliding.json", "passing.json", "recovery.json"),
    "one_mass_dfo": ("proof.json", "sliding.json"),
}
"""Claims whose P is the one at which a solver stopped: another machine may find another, which must hold as well
(docs/architecture.md, the same bytes on every machine). Their README and manifest quote them."""
SCRIPT = """
import json, sys, tempfile
from pathlib import Path
import stiction
from codegen.base.errors import BadInput
from codegen.app.derive import analysis_json
result = {}
searched = json.loads(sys.argv[2])
for name in sys.argv[3:]:
    try:
        result[name] = {"derive": analysis_json(stiction.derive(name))}
    except BadInput as error:
        result[name] = {"derive": str(error)}
    if sys.argv[1] == "all":
        with tempfile.TemporaryDirectory() as folder:
            stiction.generate(name, folder, uncertified=True)
            result[name] |= {str(f.relative_to(folder)): f.read_text() for f in Path(folder).rglob("*") if f.is_file()}
            for claim in searched.get(Path(name).stem, ()):
                found = stiction.verify(Path(folder, claim)).summary  # ends in an error where one is refused
                result[name]["verified " + claim] = [found["machine"], found["of"]]
print(json.dumps(result))
"""


def made_on(machine: str, what: str, specs: list[Path]) -> dict[str, dict[str, object]]:
    command = [
        sys.executable,
        "-c",
        SCRIPT,
        what,
        json.dumps(SEARCHED),
        *[str(spec.relative_to(ROOT)) for spec in specs],
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"} | MACHINES[machine]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, dict[str, object]] = json.loads(done.stdout.splitlines()[-1])
    return found


def free(spec: str) -> tuple[str, ...]:
    """The files of a spec that may be others on another machine."""
    claims = SEARCHED.get(Path(spec).stem, ())
    return (*claims, "README.md", "manifest.json") if claims else ()


def assert_same(what: str, specs: list[Path], machines: list[str]) -> None:
    first, *others = machines
    expected = made_on(first, what, specs)
    for machine in others:
        found = made_on(machine, what, specs)
        differ = [
            f"{s}: {key}"
            for s in expected
            for key in expected[s].keys() | found[s].keys()
            if expected[s].get(key) != found[s].get(key) and key not in free(s)
        ]
        assert not differ, f"{machine} makes other {', '.join(differ)}"


@pytest.mark.slow
def test_the_arm_is_derived_alike_on_old_and_new_processors() -> None:
    """Its constants come from products of rotations and inertias, its figures from eigenvalues of fourteenth order."""
    chosen = [s for s in SPECS if s.stem in ("seven_joint_arm", "chain", "two_mass_gdfo")]
    assert_same("derive", chosen, ["Haswell", "Nehalem, plain loops"])


def test_the_constants_of_the_arm_in_generated_code_are_alike() -> None:
    """From the file to the constants of the C, without the certificate, which takes long."""
    script = (
        "from codegen.mechanics.base_parameters import regrouped; from codegen.spec import read_spec;"
        "print([[float(x).hex() for r in (b.frame, b.moments) for v in r for x in v]"
        " for b in regrouped(read_spec('specs/seven_joint_arm.yaml').form).bodies])"
    )
    said = set()
    for machine in MACHINES.values():
        environment = os.environ | {"PYTHONPATH": str(ROOT)} | machine
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, env=environment)
        assert done.returncode == 0, done.stderr
        said.add(done.stdout)
    assert len(said) == 1


@pytest.mark.slow
@pytest.mark.parametrize("machine", [m for m in MACHINES if m != "this one"])
def test_everything_generated_and_derived_is_alike(machine: str) -> None:
    assert_same("all", SPECS, ["this one", machine])


def test_of_equal_radii_the_first_is_chosen_whatever_the_last_bits() -> None:
    """Also where ten digits of two equal numbers are others: 0.98765432105 lies in the middle between two."""
    dice = np.random.default_rng(3)
    for tie in (0.98765432105, 1.0000000005, 0.3, 123456789.05):
        values = np.full(9, tie * (1 - 1e-6))
        values[[2, 5, 8]] = tie
        for _ in range(200):
            assert first_largest(values * (1 + 4e-16 * dice.uniform(-1, 1, 9))) == 2


def test_sines_and_roots_against_mpmath() -> None:
    dice = np.random.default_rng(5)
    with mpmath.workdps(60):
        for angle in dice.uniform(-7, 7, 30):
            exact = Fraction(float(angle))
            sine, cosine = sine_cosine(exact)
            assert abs(mpmath.mpf(sine.numerator) / sine.denominator - mpmath.sin(mpmath.mpf(float(angle)))) < 1e-39
            assert abs(float(sine**2 + cosine**2 - 1)) < 1e-38
        for value in (Fraction(2), Fraction(1, 3 * 10**20), Fraction(10**30 + 1, 7)):
            root = square_root(value)
            assert abs(root * root / value - 1) < Fraction(1, 10**38)
    assert square_root(Fraction(9, 4)) == Fraction(3, 2)


def test_a_right_angle_in_sixteen_digits_turns_exactly() -> None:
    assert sine_cosine(Fraction("1.5707963267948966")) == (1, 0)
    assert sine_cosine(Fraction("-3.141592653589793")) == (0, -1)
    sine, cosine = sine_cosine(Fraction("1.5708"))  # a file's five digits are what the file says
    assert 0 > cosine > Fraction(-1, 10**5) and sine < 1


def test_powers_are_rounded_correctly() -> None:
    assert [power_of_ten(float(k)) for k in range(-300, 301)] == [float(f"1e{k}") for k in range(-300, 301)]
    assert geometric(1e-4, 1.0, 5).tolist() == [1e-4, 1e-3, 1e-2, 1e-1, 1.0]


def test_eigenvalues_against_lapack() -> None:
    dice = np.random.default_rng(2)
    for order in range(1, 8):
        matrix = dice.normal(size=(order, order))
        found, expected = (np.sort_complex(v) for v in (eigenvalues(matrix), np.linalg.eigvals(matrix)))
        assert np.abs(found - expected).max() < 1e-12


def test_a_double_eigenvalue_is_exact() -> None:
    """LAPACK gives that of a Jordan block of order 3 to five digits."""
    turn = np.array([[2.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 3.0]])
    inverse = np.array([[2.0, -3.0, 1.0], [-3.0, 6.0, -2.0], [1.0, -2.0, 1.0]])  # of determinant 1
    block = np.array([[-10.0, 1.0, 0.0], [0.0, -10.0, 1.0], [0.0, 0.0, -10.0]])
    assert np.array_equal(turn @ inverse, np.eye(3))
    found = eigenvalues(turn @ block @ inverse)
    assert np.abs(found + 10).max() < 1e-8 and np.abs(np.linalg.eigvals(turn @ block @ inverse) + 10).max() > 1e-7
