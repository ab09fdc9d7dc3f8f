"""Every expression of a law: in CasADi as in SymPy, and homogeneous in the units that its parameters declare."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
import sympy

from codegen.friction import LAWS, DynamicLaw, MemoryLaw
from codegen.mechanics.casadi_form import to_casadi
from codegen.spec.functions import Magnitude
from codegen.spec.units import parse_unit, require_coherent
from tests.friction.samples import DYNAMIC, NUMERIC, U, bound, draw, dynamics, level, state_range

SCALES = {"F": 3.7, "q": 0.31, "s": 2.3}


def scale(template: str) -> float:
    """By how much a number in this unit changes when the units of force, slip and time do."""
    return eval(template.format(F="F", q="q").replace("^", "**"), {"__builtins__": {}}, SCALES)


def rescaled(name: str, p: dict[str, float]) -> dict[str, float]:
    return {q.name: p[q.name] * scale(q.unit) for q in LAWS[name].parameters}


@pytest.mark.parametrize("name", LAWS)
def test_casadi_and_sympy_agree(name: str) -> None:
    law, random = LAWS[name], np.random.default_rng(7)
    p = {q.name: sympy.Symbol(q.name, real=True) for q in law.parameters}
    z = tuple(sympy.Symbol(s.name, real=True) for s in getattr(law, "states", ()))
    expressions = [law.level(Magnitude(U), p)]
    if isinstance(law, DynamicLaw):
        expressions += [*law.rates(U, z, p), law.force(U, z, p)]
    arguments = [U, *z, *p.values()]
    entries = {s: casadi.SX.sym(s.name) for s in arguments}
    ours = casadi.Function("f", list(entries.values()), [casadi.SX(to_casadi(e, entries)) for e in expressions])
    theirs = sympy.lambdify(arguments, expressions, NUMERIC)
    for seed in range(30):
        numbers = [random.uniform(-3, 3), *random.uniform(0.1, 3, len(z)), *draw(name, seed).values()]
        values = ours(*numbers)
        values = values if isinstance(values, tuple) else (values,)
        np.testing.assert_allclose([float(v) for v in values], theirs(*numbers), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_levels_and_bounds_have_the_units_they_say(name: str) -> None:
    p = draw(name, 1)
    speeds = np.geomspace(1e-3, 10, 50)
    other = level(name, rescaled(name, p))(speeds * scale("{q}/s"))
    np.testing.assert_allclose(other, level(name, p)(speeds) * scale("{F}"), rtol=1e-9)
    if np.isfinite(bound(name, p)):
        assert bound(name, rescaled(name, p)) == pytest.approx(bound(name, p) * scale("{F}*s/{q}"))


@pytest.mark.parametrize("name", DYNAMIC)
def test_rates_forces_and_ranges_have_the_units_they_say(name: str) -> None:
    law, p = LAWS[name], draw(name, 2)
    assert isinstance(law, DynamicLaw)
    unit = scale(law.states[0].unit)
    (rate, force), (other_rate, other_force) = dynamics(name, p), dynamics(name, rescaled(name, p))
    for u, z in np.random.default_rng(3).uniform(0.1, 0.9, (30, 2)):
        there = u * scale("{q}/s"), z * unit
        assert other_rate(*there) == pytest.approx(rate(u, z) * unit / scale("s"), rel=1e-9)
        assert other_force(*there) == pytest.approx(force(u, z) * scale("{F}"), rel=1e-9)
    wide = state_range(name, rescaled(name, p), 9 * scale("{q}/s"))
    np.testing.assert_allclose(wide, np.multiply(state_range(name, p, 9.0), unit), rtol=1e-9)


@pytest.mark.parametrize("name", [n for n, law in LAWS.items() if isinstance(law, MemoryLaw)])
def test_responses_have_the_units_they_say(name: str) -> None:
    """Kato's γ is in s⁻ⁿ, which no template can say: it is scaled by hand."""
    law, p = LAWS[name], draw(name, 4)
    assert isinstance(law, MemoryLaw)
    q = rescaled(name, p)
    if name == "rising_static_kato":
        q["gamma"] = p["gamma"] * SCALES["s"] ** -p["n"]
    time = np.linspace(0, 3, 1500)
    u = np.where(np.abs(np.sin(3 * time)) < 0.4, 0.0, 0.1 * np.sin(3 * time))
    applied = 5 * np.cos(2 * time)
    there = law.response(time * SCALES["s"], u * scale("{q}/s"), q, applied * SCALES["F"])
    np.testing.assert_allclose(there, law.response(time, u, p, applied) * SCALES["F"], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize(("force", "slip"), [("N", "m"), ("N*m", "rad")])
def test_every_unit_is_si(name: str, force: str, slip: str) -> None:
    law = LAWS[name]
    for p in law.parameters:
        parse_unit(p.unit.format(F=force, q=slip), "here")
        require_coherent(p.unit.format(F=force, q=slip), "here", "SI units alone")


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_drives_nothing_says_why(name: str) -> None:
    law = LAWS[name]
    assert bool(law.why_not) == (law.drives == "")
    assert law.drives == ("" if isinstance(law, MemoryLaw) else law.drives)


@pytest.mark.parametrize("name", DYNAMIC)
def test_scale_is_a_factor_of_the_force_alone(name: str) -> None:
    law, p = LAWS[name], draw(name, 5)
    assert isinstance(law, DynamicLaw)
    if not law.scale:
        return
    (rate, force), (other_rate, other_force) = dynamics(name, p), dynamics(name, p | {law.scale: 3 * p[law.scale]})
    assert other_force(0.4, 0.3) == pytest.approx(3 * force(0.4, 0.3)) and other_rate(0.4, 0.3) == rate(0.4, 0.3)
