"""Ψ and the sampled matrix against the thesis' block formulas and against the observers themselves, differentiated.

Complex steps differentiate to rounding, and so does the project's symbolic derivation: what is left is the rounding
of some dozens of operations, a relative 1e-10 of the matrix' largest entry (2e-16 amplified by cond(M) < 1e3 and by
the division by h = 1e-3 in the sampled one).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.observers.by_hand import magnitude

from .cases import KINDS, Case, make_case, seeded
from .reference import STEP, Point

EVERYTHING: dict[str, Any] = {"full": True, "effects": True, "exponent": 2.0}
OPTIONS: dict[str, dict[str, Any]] = {
    "plain": {},
    "everything": EVERYTHING,
    "full_gains": {"full": True},
    "effects": {"effects": True},
}
ALL = [(n, k, v, o) for n in KINDS for k in KINDS[n] for v in ("measured", "estimated") for o in OPTIONS]


def is_fast(name: str, kind: str, velocity: str, option: str) -> bool:
    """The small version of the set: every kind and velocity, every option, every machine at least once."""
    if name == "one_mass":
        return option in ("plain", "everything")
    if name == "two_mass":
        return option == ("everything" if velocity == "estimated" else "plain") or (kind, option) == ("gcfo", "effects")
    if name == "arm":
        return velocity == "estimated" and option == ("everything" if kind == "gcfo" else "plain")
    return option == "plain" and velocity == "estimated" and kind != "gto"


CASES = [pytest.param(*c, marks=[] if is_fast(*c) else [pytest.mark.slow], id="-".join(c)) for c in ALL]


def close(found: Any, right: Any, share: float = 1e-10) -> None:
    np.testing.assert_allclose(found, right, rtol=0, atol=share * max(1.0, np.abs(right).max()))


def block_formula(case: Case, p: Point) -> Any:
    """Ψ of (4.19), (4.22), sections 4.6.1 and 4.6.2, and of (5.15) in the same way; g_v includes declared friction."""
    r, n = case.reference, len(p.x)
    u, inverse = r.hand.distribution(p.x), np.linalg.inv(r.hand.mass(p.x))
    slip = u.T @ p.v
    s = np.diag(np.sign(slip))
    d = np.diag(r.exponent * np.abs(slip) ** (r.exponent - 1))

    def everything_but_friction(v: Any) -> Any:
        return r.hand.total_force(p.x, v, p.w, r.effects) - u @ r.hand.known_friction(u.T @ v, r.effects)

    slope = r.jacobian(lambda dv: everything_but_friction(p.v + dv), n)
    onto = u @ s if r.levels else u if r.kind == "mgto" else np.eye(n)
    if not r.estimated:
        return -r.first @ d @ s @ u.T @ inverse @ u @ s if r.levels else r.second @ inverse @ onto
    lower = r.first @ d @ s @ u.T @ r.velocity if r.levels else -(r.first + r.second @ r.velocity)
    if r.levels:  # the thesis takes U as constant: (4.19), (4.32) lack the part of d(U'v)/dt that comes from dU/dt
        axes = [np.imag(r.hand.distribution(p.x + 1j * STEP * axis)) / STEP for axis in np.eye(n)]
        lower = lower + r.first @ d @ s @ np.array([turned.T @ p.v for turned in axes]).T
    return np.block([[-r.velocity + inverse @ slope, -inverse @ onto], [lower, np.zeros((len(lower), onto.shape[1]))]])


def check_psi(case: Case, p: Point) -> None:
    psi = case.numbers(case.dynamics.jacobian, p)
    close(psi, case.reference.jacobian(lambda e: case.reference.error_rate(e, p), case.size))
    close(psi, block_formula(case, p))


def reverses(case: Case, p: Point) -> bool:
    """Whether a slip changes sign within the sample; the sampled claim is between reversals."""
    r = case.reference
    later = p.v + case.h * r.acceleration(p.x, p.v, p.w, p.friction)
    now, then = r.hand.distribution(p.x).T @ p.v, r.hand.distribution(p.x + case.h * p.v).T @ later
    return bool((np.sign(now) != np.sign(then)).any())


def check_sampled(case: Case, p: Point, direction: Any) -> None:
    """e[k+1] = (I + hA) e[k]: by complex steps, and in real arithmetic to second order in e."""
    r, h, a = case.reference, case.h, case.numbers(case.dynamics.sampled, p)
    step = r.jacobian(lambda e: r.next_error(e, p, h), case.size)
    close(a, (step - np.eye(case.size)) / h, 1e-9)
    rest = r.next_error(np.zeros(case.size), p, h)

    def left_out(size: float) -> float:
        e = size * direction / np.linalg.norm(direction)
        return float(np.linalg.norm(r.next_error(e, p, h) - rest - e - h * a @ e))

    scale = 1 + float(np.abs(r.perturbed(np.zeros(case.size), p)).max())
    # a quarter, give or take third order; 1e-12 of the states' size is the rounding of a few hundred operations
    assert left_out(1e-4) <= 0.3 * left_out(2e-4) + 1e-12 * scale


@pytest.mark.parametrize(("name", "kind", "velocity", "option"), CASES)
def test_psi_and_the_sampled_matrix(name: str, kind: str, velocity: str, option: str) -> None:
    """Ψ is the thesis' block formula and the derivative of the error's rate; A that of one explicit Euler step."""
    generator = seeded(name, kind, velocity, option)
    case = make_case(name, kind, velocity, generator, **OPTIONS[option])
    sampled = 0
    for _ in range(40):
        p = case.point(generator)
        check_psi(case, p)
        if not reverses(case, p):
            check_sampled(case, p, generator.normal(size=case.size))
            sampled += 1
        if sampled == 4:
            break
    assert sampled == 4
    if name != "cart" and velocity == "estimated":
        for side in (1e-9, -1e-9):
            check_psi(case, case.point(generator, np.array([side] if name == "one_mass" else [side, -2 * side])))


def test_the_level_and_the_force_form_are_one_matrix_turned_by_the_slip_signs() -> None:
    generator = seeded("force form")
    case = make_case("two_mass", "gcfo", "estimated", generator, full=True)
    for _ in range(5):
        p = case.point(generator)
        s = np.sign(case.reference.hand.distribution(p.x).T @ p.v)
        turn = np.diag([1, 1, *s])
        in_levels = case.numbers(case.dynamics.jacobian, p)
        in_force = case.numbers(case.dynamics.in_force(case.dynamics.jacobian), p)
        close(in_force, turn @ in_levels @ turn)


def test_the_complex_step_of_the_reference_sees_a_kink_as_a_line() -> None:
    """The tool itself: |u| differentiates to the sign on either side."""
    for u in (1e-9, -1e-9, 2.0, -3.0):
        assert np.imag(magnitude(u + 1j * STEP)) / STEP == np.sign(u)
