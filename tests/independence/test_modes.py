"""Conditions by modes against eigenvalues: what the inertia theorem claims, and the forms for which it claims nothing.

The theorem is tested on matrices of up to six coordinates made here; ``find_modes`` on specs of two to six. Draws with
an eigenvalue within 1e-9 of the axis, relative to the largest, are left out: NumPy decides those by rounding.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.analysis.analysis import Analysis, analyse
from codegen.mechanics import build_system
from codegen.observers import build_observer, observer_of
from codegen.spec import parse_spec
from tests.expected_errors import refused
from tests.slow_cases import slow_except

SPECS = Path(__file__).parents[2] / "specs"
EDGE = 1e-9
# Four dense contacts: half a minute for polynomials that the modes make unnecessary.
DENSE = pytest.param("gcfo", 4, marks=pytest.mark.slow)


def positive_definite(n: int, random: np.random.Generator) -> Any:
    root = random.normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


def orthogonal(n: int, random: np.random.Generator) -> Any:
    return np.linalg.qr(random.normal(size=(n, n)))[0]


def signed(n: int, random: np.random.Generator) -> Any:
    """Diagonal gains over four decades, all positive in half of the draws."""
    return 10 ** random.uniform(-2, 2, n) * (1 if random.random() < 0.5 else random.choice([-1, 1], n))


def check_inertia(n: int, full: bool, random: np.random.Generator) -> bool | None:
    """K_v > 0 and G > 0 just where Ψ is Hurwitz; None at the edge.

    ``full``: G symmetric and K_v commuting with M, both with every entry filled, and D = 1; else G and D diagonal and
    K_v = k_v I.
    """
    p = int(random.integers(1, n + 1))
    inverse, onto = np.linalg.inv(positive_definite(n, random)), random.normal(size=(n, p))
    gain = signed(p, random)
    if full:
        turn, axes = orthogonal(p, random), orthogonal(n, random)
        of_velocity = signed(n, random)
        inverse = axes @ np.diag(1 / random.uniform(0.1, 10, n)) @ axes.T
        into, k_v = turn @ np.diag(gain) @ turn.T @ onto.T, axes @ np.diag(of_velocity) @ axes.T
    else:
        of_velocity = np.full(n, signed(1, random)[0])
        into, k_v = np.diag(gain * 10 ** random.uniform(-2, 2, p)) @ onto.T, np.diag(of_velocity)
    psi = np.block([[-k_v, -inverse @ onto], [into @ k_v, np.zeros((p, p))]])
    measured = -into @ inverse @ onto
    for matrix, claim in ((psi, (gain > 0).all() and (of_velocity > 0).all()), (measured, (gain > 0).all())):
        real = np.linalg.eigvals(matrix).real
        if np.abs(real).min() < EDGE * np.linalg.norm(matrix):
            return None
        assert bool(claim) == bool((real < 0).all())
    return bool((gain > 0).all() and (of_velocity > 0).all())


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("n", range(1, 7))
def test_signs_of_gains_are_necessary_and_sufficient(n: int, full: bool) -> None:
    random = np.random.default_rng([n, full])
    found = [check_inertia(n, full, random) for _ in range(200)]
    assert found.count(None) < 40
    assert min(found.count(True), found.count(False)) > 20


@pytest.mark.slow
@pytest.mark.parametrize("full", [False, True])
def test_signs_of_gains_on_ten_thousand_draws(full: bool) -> None:
    random = np.random.default_rng(int(full))
    found = [check_inertia(int(random.integers(1, 7)), full, random) for _ in range(10_000)]
    assert found.count(None) < 2000


def chain(n: int, kind: str, velocity: str, random: np.random.Generator, **changes: str) -> str:
    """A spec of n masses with a full mass matrix and U of full rank; ``changes`` replace what a section says."""
    mass, onto = np.round(positive_definite(n, random), 3), np.round(random.normal(size=(n, n)) + 2 * np.eye(n), 3)
    size = round(random.uniform(1, 9), 3)
    gain = f"K_F: {size}" if kind == "gcfo" else f"K_2: {-size}"
    said = {
        "mass": str(mass.tolist()),
        "force": str([f"w - k*x{i} + k*r*x{(i + 1) % n}**2" for i in range(n)]),
        "distribution": str(onto.tolist()),
        "gains": f"{{{gain}" + (f", K_v: {round(random.uniform(5, 90), 3)}}}" if velocity == "estimated" else "}"),
        "exponent": "1",
    } | changes
    coordinates = ", ".join(f"x{i}: {{velocity: v{i}, unit: m}}" for i in range(n))
    contacts = "".join(f"    - {{name: c{i}, law: coulomb, a: 2, unit: N}}\n" for i in range(n))
    ranges = ", ".join([f"x{i}: [-0.4, 0.4], v{i}: [0.5, 2]" for i in range(n)])
    return f"""name: chain
coordinates: {{{coordinates}}}
inputs: {{w: {{unit: N}}}}
parameters: {{r: {{value: 1, unit: 1/m}}, b: {{value: 0.4, unit: N*s/m}}, k: {{value: 3, unit: N/m}}}}
mass_matrix: {said["mass"]}
force: {said["force"]}
friction:
  distribution: {said["distribution"]}
  contacts:
{contacts}observer: {{kind: {kind}, velocity: {velocity}, gains: {said["gains"]}, exponent: {said["exponent"]},
  sample_time: 0.0001}}
envelope: {{{ranges}}}
"""


def analysed(text: str) -> Analysis:
    spec = parse_spec(text, Path("chain.yaml"))
    return analyse(spec, observer_of(spec))


@pytest.mark.parametrize("velocity", ["measured", "estimated"])
@pytest.mark.parametrize(("kind", "n"), [("gcfo", 2), DENSE, ("gto", 3), ("gto", 6)])
def test_modes_of_a_spec_and_their_sample_time(kind: str, n: int, velocity: str) -> None:
    """The conditions hold, Ψ is Hurwitz, and the closed form of the sample time is that of the eigenvalues."""
    found = analysed(chain(n, kind, velocity, np.random.default_rng([n, len(kind), len(velocity)])))
    assert found.modes is not None
    assert all(c.holds for c in found.modes.conditions) and found.spectral_abscissa < 0
    assert found.modes.sample_time == pytest.approx(found.largest_sample_time, rel=1e-6)
    assert all(c.holds for c in found.jury) == (found.spectral_radius < 1)


@pytest.mark.parametrize(("k_v", "steep"), [(200.0, False), (4.0, True)])
def test_the_sample_time_of_slow_and_of_oscillating_modes(k_v: float, steep: bool) -> None:
    """4λ > k_v gives 1/λ, and 4λ < k_v gives 4/(k_v + √(k_v² − 4 k_v λ)); M = 1, U = 1, so λ is the gain."""
    gains = f"{{K_2: [-9, -5], K_v: {k_v}}}"
    text = chain(2, "gto", "estimated", np.random.default_rng(0), gains=gains, mass="[[1, 0], [0, 1]]")
    found = analysed(text)
    assert found.modes is not None
    right = 1 / 9 if steep else 4 / (k_v + np.sqrt(k_v**2 - 4 * k_v * 5))
    assert found.modes.sample_time == pytest.approx(right, rel=1e-12)
    assert found.largest_sample_time == pytest.approx(right, rel=1e-9)


SLOWEST = "K_F full and h steeper than s"
NONE = {
    "K_v does not commute with M": ("gto", {"gains": "{K_2: [-3, -4], K_v: [5, 50]}"}),
    "K_v full": ("gto", {"gains": "{K_2: [-3, -4], K_v: [[5, 1], [1, 6]]}"}),
    "U turns with x": ("gcfo", {"distribution": '[[1, "r*x0"], [0, 1]]'}),
    "g depends on v": ("gcfo", {"force": '["w - b*v0", w]'}),
    "g depends on v in a tracker": ("gto", {"force": '["w - b*v0", w]'}),
    "K_F is not symmetric": ("gcfo", {"gains": "{K_F: [[3, 1], [0.5, 4]], K_v: 9}"}),
    SLOWEST: ("gcfo", {"gains": "{K_F: [[3, 1], [1, 4]], K_v: 9}", "exponent": "2"}),
    "K_1 is not zero": ("gto", {"gains": "{K_1: 2, K_2: -3, K_v: 9}"}),
}


@pytest.mark.parametrize("case", slow_except(list(NONE), [c for c in NONE if c not in (SLOWEST, "U turns with x")]))
def test_no_modes_where_the_theorem_says_nothing(case: str) -> None:
    kind, changes = NONE[case]
    assert analysed(chain(2, kind, "estimated", np.random.default_rng(3), **changes)).modes is None


@pytest.mark.parametrize("dependent", ["[[1, 2], [2, 4]]", "[[1, 1], [1, 1.0000000000001]]"])
def test_contacts_that_slide_dependently_are_refused_before(dependent: str) -> None:
    """There is never a claim that the gains' signs suffice."""
    text = chain(2, "gcfo", "measured", np.random.default_rng(3), distribution=dependent)
    with refused("SPEC019 gcfo 2 1"):
        analysed(text)


def test_a_full_symmetric_level_gain_has_modes() -> None:
    """In force errors the gain is S K_F S, of the same inertia; the printed conditions are K_F's leading minors."""
    text = (SPECS / "two_mass.yaml").read_text().replace("K_F: [500, 700]", "K_F: [[500, 90], [90, 700]]")
    spec = parse_spec(text, Path("full.yaml"))
    analysis = analyse(spec, build_observer(spec, build_system(spec)))
    assert analysis.modes is not None
    assert [c.value for c in analysis.modes.conditions if c.label.startswith("K_F")] == [500, 500 * 700 - 90 * 90]
    assert analysis.modes.sample_time == pytest.approx(analysis.largest_sample_time)
