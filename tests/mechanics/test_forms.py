"""Topology, constraints and Lagrangian against closed forms of the thesis and a second derivation in NumPy."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from codegen.mechanics import System
from tests.slow_cases import examples

from .forms import ARM_CONSTRAINTS, CART_CONSTRAINTS, SPECS, TWO_MASS_TOPOLOGY, read, swapped

S = {name: sympy.Symbol(name, real=True) for name in ["theta1", "theta2", "omega1", "omega2", "w1", "w2"]}
LAGRANGIAN = (SPECS / "two_link_arm.yaml").read_text()
ARMS = {"lagrangian": LAGRANGIAN, "constraints": swapped("two_link_arm", ARM_CONSTRAINTS)}


def printed_arm() -> tuple[Any, Any]:
    """(4.54), (4.55) and (4.56) as the thesis prints them: M and w − F_c − F_g."""
    p = {n: sympy.Symbol(n, real=True) for n in ["m1", "m2", "l1", "b1", "b2", "I1", "I2", "gravity"]}
    m1, m2, l1, b1, b2, i1, i2, g = p.values()
    t1, t2, o1, o2, w1, w2 = S.values()
    m12 = i2 + m2 * b2**2 + m2 * l1 * b2 * sympy.cos(t2)
    m11 = i1 + i2 + m1 * b1**2 + m2 * (l1**2 + b2**2) + 2 * m2 * l1 * b2 * sympy.cos(t2)
    mass = sympy.Matrix([[m11, m12], [m12, i2 + m2 * b2**2]])
    k = m2 * l1 * b2 * sympy.sin(t2)
    coriolis = sympy.Matrix([-k * (2 * o1 + o2) * o2, k * o1**2])
    fore = m2 * b2 * sympy.cos(t1 + t2)
    gravity = g * sympy.Matrix([(m1 * b1 + m2 * l1) * sympy.cos(t1) + fore, fore])
    return mass, sympy.Matrix([w1, w2]) - coriolis - gravity


@pytest.mark.parametrize("form", ARMS)
def test_the_arm_is_the_printed_one(form: str) -> None:
    system, (mass, force) = read(ARMS[form])[1], printed_arm()
    assert sympy.Matrix(system.mass_matrix - mass).applyfunc(sympy.expand) == sympy.zeros(2, 2)
    assert sympy.Matrix(system.force - force).applyfunc(sympy.expand) == sympy.zeros(2, 1)
    assert system.distribution == sympy.eye(2)  # the elbow slides by the fore arm's rate less the upper arm's


def test_the_two_masses_by_topology_are_those_of_the_spec() -> None:
    written = read((SPECS / "two_mass.yaml").read_text())[1]
    derived = read(swapped("two_mass", TWO_MASS_TOPOLOGY))[1]
    assert derived == written


DOCUMENTED = re.findall(r"```yaml\n(.*?)```", (SPECS.parent / "docs" / "specification.md").read_text("utf-8"), re.S)


@pytest.mark.parametrize("form", ["topology", "constraints", "lagrangian"])
def test_the_forms_of_the_documentation_are_the_shipped_machines(form: str) -> None:
    (block,) = [text for text in DOCUMENTED if text.startswith(f"{form}:") and ".." not in text]  # a range: the chain's
    name = "two_link_arm" if form == "constraints" else "two_mass"
    shipped, found = read((SPECS / f"{name}.yaml").read_text())[1], read(swapped(name, block))[1]
    assert sympy.expand(found.mass_matrix) == sympy.expand(shipped.mass_matrix)
    assert sympy.expand(found.force) == sympy.expand(shipped.force)
    assert found.distribution == shipped.distribution and found.contacts == shipped.contacts


def test_the_ranges_of_the_documentation_are_the_shipped_chain() -> None:
    (block,) = [text for text in DOCUMENTED if text.startswith("topology:") and ".." in text]
    assert block in (SPECS / "chain.yaml").read_text("utf-8")


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(1, 5), st.data())
def test_lemma_a_1(n: int, data: st.DataObject) -> None:
    """U A sgn(U'v) against the sum (A.7), force by force, for random masses, contacts and velocities."""
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)] + [(i, None) for i in range(n)]
    chosen = data.draw(st.lists(st.sampled_from(pairs), unique=True, min_size=1))
    turned = data.draw(st.lists(st.booleans(), min_size=len(chosen), max_size=len(chosen)))
    generator = np.random.default_rng(data.draw(st.integers(0, 999)))
    levels, v = generator.uniform(1, 9, len(chosen)), generator.normal(size=n)
    bodies = "".join(f"    b{i}: {{mass: {i + 1}, x: x{i}}}\n" for i in range(n))
    contacts = ""
    for k, (i, j) in enumerate(chosen):
        names = [f"b{i}", "ground" if j is None else f"b{j}"][:: -1 if turned[k] else 1]
        contacts += f"    - {{name: c{k}, bodies: [{', '.join(names)}], a: {levels[k]}, unit: N}}\n"
    coordinates = "".join(f"  x{i}: {{velocity: v{i}, unit: m}}\n" for i in range(n))
    text = f"name: masses\ncoordinates:\n{coordinates}topology:\n  bodies:\n{bodies}force: [{', '.join('0' * n)}]\n"
    system = read(text + f"friction:\n  contacts:\n{contacts}")[1]
    U = np.array(system.distribution, dtype=float)
    expected = np.zeros(n)
    for a, (i, j) in zip(levels, chosen, strict=True):
        expected[i] += a * np.sign(v[i] - (0 if j is None else v[j]))
        if j is not None:
            expected[j] += a * np.sign(v[j] - v[i])
    np.testing.assert_allclose(U @ (levels * np.sign(U.T @ v)), expected, atol=1e-13)  # sums of up to six forces of 9 N
    assert U.shape == (n, len(chosen))
    assert system.mass_matrix == sympy.diag(*range(1, n + 1))


PLANE = """\
name: plane
coordinates:
  px: {velocity: vx, unit: m}
  py: {velocity: vy, unit: m}
  turn: {velocity: om, unit: rad}
  sx: {velocity: ux, unit: m}
parameters:
  m: {value: 2, unit: kg}
  J: {value: 0.1, unit: kg*m^2}
  ms: {value: 5, unit: kg}
  r: {value: 0.2, unit: m}
topology:
  bodies:
    sled: {mass: ms, x: sx}
    wheel: {mass: m, inertia: J, x: px, y: py, angle: turn}
force: [0, 0, 0, 0]
friction:
  contacts:
    - {name: deck, bodies: [wheel, sled], a: 1, unit: N}
    - {name: wall, bodies: wheel, along: y, a: 1, unit: N}
    - {name: rim, bodies: wheel, along: {x: 1, angle: -r}, a: 1, unit: N}
    - {name: axle, bodies: wheel, along: angle, a: 1, unit: N*m}
"""


def test_several_directions_and_rotation() -> None:
    """(A.39) direction by direction, and a wheel's rim, whose slip is v_x − r ω."""
    system = read(PLANE)[1]
    m, J, ms, r, vx, vy, om, ux = sympy.symbols("m J ms r vx vy om ux", real=True)
    assert system.mass_matrix == sympy.diag(m, m, J, ms)
    assert list(system.slip_velocity) == [vx - ux, vy, vx - r * om, om]
    assert [c.slip_unit for c in system.contacts] == ["m", "m", "m", "rad"]


def in_other_coordinates(form: str, positions: list[str]) -> str:
    """A topology of two masses as constraints, with these positions in place of x1 and x2."""
    top, bottom = positions
    moved = form.replace("topology:", "constraints:").replace("x: x1", f"x: {top}").replace("x: x2", f"x: {bottom}")
    return swapped("two_mass", moved)


@pytest.mark.parametrize(
    ("rows", "mass"),
    [
        ("[[0.6, 0.8], [-0.8, 0.6]]", "unitary"),  # (A.37) as printed
        ("[[1, -1], [0, 1]]", [["m1", "m1"], ["m1", "m1 + m2"]]),  # relative position and base
        ("[[1, -m1/m2], [0, 2]]", None),
    ],
)
def test_a_change_of_coordinates(rows: str, mass: Any) -> None:
    """M = T⁻ᵀ M̄ T⁻¹ and U = T⁻ᵀ Ū by NumPy; T M̄ T' and T Ū where T is unitary."""
    exact = sympy.Matrix(sympy.sympify(rows, rational=True))
    v1, v2, m1, m2 = sympy.symbols("v1 v2 m1 m2", real=True)
    positions = [str(row) for row in exact.inv() * sympy.Matrix(sympy.symbols("x1 x2"))]
    system = read(in_other_coordinates(TWO_MASS_TOPOLOGY, positions))[1]
    T = np.array(exact.subs({"m1": 10, "m2": 50}), dtype=float)
    M, U = np.diag([10.0, 50.0]), np.array([[1, 0], [-1, 1]])
    back = np.linalg.inv(T)
    np.testing.assert_allclose(at(system.mass_matrix, system, [0, 0]), back.T @ M @ back, rtol=1e-14)
    np.testing.assert_allclose(at(system.distribution, system, [0, 0]), back.T @ U, rtol=1e-14, atol=1e-15)
    if mass == "unitary":
        np.testing.assert_allclose(at(system.mass_matrix, system, [0, 0]), T @ M @ T.T, rtol=1e-14)
    elif mass is not None:
        assert system.mass_matrix == sympy.Matrix([[m1, m1], [m1, m1 + m2]])
        assert list(system.slip_velocity) == [v1, v2]


def test_a_turned_plane() -> None:
    """A unitary T of a parameter (A.37): what slides along x̄ slides along both coordinates; M of one body stays."""
    form = TWO_MASS_TOPOLOGY.replace("    bottom: {mass: m2, x: x2}\n", "")
    form = form.replace("x: x1", "x: cos(eta)*x1 + sin(eta)*x2, y: -sin(eta)*x1 + cos(eta)*x2")
    form = form.replace("topology:", "constraints:").replace("[top, bottom]", "top, along: x")
    form = form.replace("[bottom, ground]", "top, along: y")
    text = swapped("two_mass", form).replace("parameters:\n", "parameters:\n  eta: {value: 25, unit: deg}\n")
    system = read(text)[1]
    eta, m1, v1, v2 = sympy.symbols("eta m1 v1 v2", real=True)
    cos, sin = sympy.cos(eta), sympy.sin(eta)
    assert system.mass_matrix == m1 * sympy.eye(2)
    assert list(system.slip_velocity) == [v1 * cos + v2 * sin, -v1 * sin + v2 * cos]


def at(matrix: Any, system: System, x: Any, v: Any = None, w: Any = 0.0) -> Any:
    """A matrix in numbers."""
    values = dict(system.values) | dict(zip(system.positions, x, strict=True))
    values |= dict(zip(system.velocities, x if v is None else v, strict=True)) | dict.fromkeys(system.inputs, w)
    return np.array(sympy.Matrix(matrix).subs(values).evalf(), dtype=float)


def hand_cart(x: Any) -> Any:
    """x(q) of the cart and its bob: cart x, bob x, y, angle."""
    s, q = x
    return np.array([s, s + 0.4 * np.sin(q), -0.4 * np.cos(q), q])


def complex_jacobian(f: Any, x: Any) -> Any:
    """By complex steps, exact to rounding."""
    return np.array([np.imag(f(np.array(x) + 1e-30j * e)) / 1e-30 for e in np.eye(len(x))]).T


@settings(max_examples=examples(30), deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=5, max_size=5))
def test_constraints_against_numpy(numbers: list[float]) -> None:
    """(A.58), (A.64)–(A.66) of the cart with its bob; dT/dt from differences of T along v (central, 1e-5: 1e-9)."""
    system = cart()
    x, v, w = np.array(numbers[:2]), np.array(numbers[2:4]), numbers[4]
    T = complex_jacobian(hand_cart, x)
    turning = (complex_jacobian(hand_cart, x + 1e-5 * v) - complex_jacobian(hand_cart, x - 1e-5 * v)) / 2e-5
    M = np.diag([3, 0.7, 0.7, 0.02])
    rate = T @ v
    on = np.array([w - 0.3 * rate[0], -0.3 * rate[1] * hand_cart(x)[1] / 0.4, -0.7 * 9.81, 0])
    np.testing.assert_allclose(at(system.mass_matrix, system, x), T.T @ M @ T, rtol=1e-12)
    found = at(system.force, system, x, v, w).ravel()
    np.testing.assert_allclose(found, T.T @ on - T.T @ M @ turning @ v, rtol=1e-7, atol=1e-8)
    slips = np.array([[1, 0, 0, 0], [0, 0, 1, 0]]).T
    np.testing.assert_allclose(at(system.distribution, system, x), T.T @ slips, rtol=1e-13, atol=1e-15)
    # Lemma A.2: the force in q is that of the bodies, brought to q
    levels, U = np.array([2, 0.5]), at(system.distribution, system, x)
    in_bodies = slips @ (levels * np.sign(slips.T @ rate))
    if np.abs(slips.T @ rate).min() > 1e-9:
        np.testing.assert_allclose(U @ (levels * np.sign(U.T @ v)), T.T @ in_bodies, rtol=1e-12, atol=1e-14)


@cache
def cart() -> System:
    return read(CART_CONSTRAINTS)[1]


def test_a_contact_on_a_length_is_in_newton_where_the_coordinate_is_an_angle() -> None:
    assert [c.slip_unit for c in cart().contacts] == ["m", "m"]
    assert cart().distribution.has(sympy.Symbol("q", real=True))


GYRO = """\
name: gyro
coordinates: {q: {velocity: qd, unit: rad}, s: {velocity: sd, unit: m}}
parameters:
  J: {value: 0.3, unit: kg*m^2}
  m: {value: 1.5, unit: kg}
  k: {value: 40, unit: N/m}
  c: {value: 2, unit: N*m}
  p: {value: 0.4, unit: N*s}
  spin: {value: 1.3, unit: 1/s}
lagrangian:
  kinetic: [(J + m*s**2)*qd**2/2, m*sd**2/2, p*s*qd*cos(q), m*s**2*spin**2*sin(q)**2/2]
  potential: [k*s**2/2, -c*cos(q)]
friction:
  distribution: [[1], [0]]
  contacts: [{name: hinge, a: 1, unit: N*m}]
envelope: {s: [-1, 1]}
"""


def energies(x: Any, v: Any) -> Any:
    """E and V of the gyro, by hand; complex arguments allowed."""
    q, s = x
    kinetic = (0.3 + 1.5 * s**2) * v[0] ** 2 / 2 + 0.75 * v[1] ** 2 + 0.4 * s * v[0] * np.cos(q)
    return kinetic + 0.75 * s**2 * 1.69 * np.sin(q) ** 2, 20 * s**2 - 2 * np.cos(q)


@settings(max_examples=examples(30), deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_lagrange_against_differences_of_the_energies(numbers: list[float]) -> None:
    """d/dt ∂L/∂v − ∂L/∂x = M a − g along x + v t + a t²/2, with terms linear in v and free of it; central, 1e-5."""
    system = free_gyro()
    x, v, a = (np.array(numbers[k : k + 2]) for k in (0, 2, 4))

    def momentum(t: float) -> Any:
        return complex_jacobian(lambda rate: [energies(x + v * t + a * t * t / 2, rate)[0]], v + a * t).ravel()

    slope = complex_jacobian(lambda where: [energies(where, v)[0] - energies(where, v)[1]], x).ravel()
    expected = (momentum(1e-5) - momentum(-1e-5)) / 2e-5 - slope
    found = at(system.mass_matrix, system, x) @ a - at(system.force, system, x, v).ravel()
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-8)


@cache
def free_gyro() -> System:
    return read(GYRO)[1]


def test_the_energy_of_the_undriven_frictionless_arm_is_kept() -> None:
    """Three seconds of free swinging, against E + V written by hand; 1e-9 is the integrator's tolerance."""
    system = read(LAGRANGIAN)[1]
    x, v = list(system.positions), list(system.velocities)
    quiet = {**system.values, **dict.fromkeys(system.inputs, 0)}
    rates = sympy.lambdify([x + v], [system.mass_matrix.subs(quiet), system.force.subs(quiet)], "numpy")

    def motion(t: float, y: Any) -> Any:
        mass, force = rates(y)
        return np.concatenate([y[2:], np.linalg.solve(mass, force).ravel()])

    def total(y: Any) -> float:
        t1, t2, o1, o2 = y
        c1 = 0.04 * np.array([-np.sin(t1), np.cos(t1)]) * o1
        c2 = 0.205 * np.array([-np.sin(t1), np.cos(t1)]) * o1
        c2 = c2 + 0.065 * np.array([-np.sin(t1 + t2), np.cos(t1 + t2)]) * (o1 + o2)
        kinetic = (0.7718 * c1 @ c1 + 0.2713 * c2 @ c2 + 0.00863 * o1**2 + 0.00132 * (o1 + o2) ** 2) / 2
        height = 0.7718 * 0.04 * np.sin(t1) + 0.2713 * (0.205 * np.sin(t1) + 0.065 * np.sin(t1 + t2))
        return float(kinetic + 9.8 * height)

    run = solve_ivp(motion, (0, 3), [0.3, 0.5, 0.0, 2.0], rtol=1e-11, atol=1e-12, method="DOP853")
    swing = [total(y) for y in run.y.T]
    assert np.ptp(run.y[0]) > 1  # it does swing
    assert max(swing) - min(swing) < 1e-9
