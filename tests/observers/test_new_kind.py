"""A kind of observer that is not shipped, by the recipe of CONTRIBUTING.md: a CFO whose level leaks away at K_L â.

â = z − K_F |û|, dz/dt = K_F S U' M⁻¹ [g − F̂] − K_L â, so that de_a/dt = K_L (a − e_a) + K_F K_v s e_v on one mass.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import sympy

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.app.derived import Derived
from codegen.certify.outcome import Certificate
from codegen.mechanics.sparse import diagonal
from codegen.mechanics.system import Matrix, System
from codegen.observers import OBSERVERS, Observer, ObserverKind, observer_of, parts
from codegen.observers.equations import Equation
from codegen.observers.gains import read_gain
from codegen.observers.velocity import States, velocity_of
from codegen.spec import Spec, parse_spec
from codegen.spec.functions import Magnitude
from codegen.spec.model import symbol
from tests.expected_errors import refused

ONE = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text(encoding="utf-8")
LEAKY = ONE.replace("kind: cfo", "kind: leaky").replace("K_F: 10,", "K_F: 10, K_L: 3,")


def leaky_observer(spec: Spec, system: System) -> Observer:
    choice = spec.required_observer
    names, units = parts.contact_names(system), parts.contact_units(system)
    gain = read_gain(spec, choice, "K_F", names, names, sign=1)
    leak = read_gain(spec, choice, "K_L", names, names, sign=1)
    velocity = velocity_of(spec, choice, system)
    slip, sign = parts.slip_equations(system, velocity.symbols)
    state, level = parts.vector("z", names), parts.vector("a_hat", names)
    value = Matrix(state - gain.matrix * Matrix([Magnitude(u) for u in slip.symbols]))
    equations = [slip, sign, Equation("friction_level", level, value, units, "ours", state=state, output=True)]
    equations += parts.friction_equations(system, slip, parts.times(sign.symbols, level), "ours")
    equations.append(parts.acceleration_equation(system, velocity.symbols, equations[-1].symbols))
    slip_rate = parts.slip_rate(system, velocity.symbols, equations[-1].symbols)
    rates = Matrix(gain.matrix * diagonal(sign.symbols) * slip_rate - leak.matrix * level)
    errors = parts.errors_of("level", "a", "a_hat", names, units)
    signs = Matrix([symbol(f"s_{name}") for name in names])
    return velocity.observer(
        choice,
        equations,
        States(state, units, rates, Matrix(sympy.zeros(len(names), 1))),
        errors,
        system.distribution * parts.times(signs, Matrix([e.truth for e in errors])),
        (gain, leak),
        gain.units(units, [f"*s/{c.slip_unit}" for c in system.contacts]) | leak.units(["1/s"], [""]),
        level_errors=True,
        exact=False,
    )


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OBSERVERS, "leaky", ObserverKind(leaky_observer, ("K_F", "K_L", "K_v")))


def observer(text: str = LEAKY) -> Observer:
    return observer_of(parse_spec(text, Path("leaky.yaml")))


def test_its_psi_is_that_by_hand() -> None:
    k_f, k_l, k_v, m, s = (symbol(name) for name in ("K_F", "K_L", "K_v", "m", "s_rail"))
    right = sympy.Matrix([[-k_v, -s / m], [k_f * k_v * s, -k_l]])
    assert sympy.expand(sympy.Matrix(derive_error_dynamics(observer()).jacobian) - right) == sympy.zeros(2)
    assert {str(gain): unit for gain, unit in observer().gain_units.items()} == {
        "K_F": "N*s/m",
        "K_L": "1/s",
        "K_v": "1/s",
    }


def test_gains_and_options_of_other_kinds_are_refused_by_what_it_has() -> None:
    with refused("SPEC008 `K_f` K_F K_L K_v leaky"):
        observer(LEAKY.replace("K_F: 10,", "K_F: 10, K_f: 1,"))
    with refused("SPEC020 `exponent` leaky cfo gcfo"):
        observer(LEAKY.replace("  sample_time: 0.001", "  sample_time: 0.001\n  exponent: 2", 1))
    with refused("SPEC020 `laws` leaky dfo gdfo"):
        observer(
            LEAKY.replace("  sample_time: 0.001", "  sample_time: 0.001\n  laws: {rail: {law: dahl, a: 1, c: 1}}", 1)
        )


def test_a_kind_for_one_coordinate_names_its_general_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OBSERVERS, "leaky", replace(OBSERVERS["leaky"], general="gcfo"))
    two = (Path(__file__).parents[2] / "specs" / "two_mass.yaml").read_text(encoding="utf-8")
    with refused("SPEC022 leaky 2 gcfo"):
        observer(two.replace("kind: gcfo", "kind: leaky").replace("gains: {", "gains: {K_L: 1, "))
    assert observer().kind == "leaky"


def test_an_observer_that_gives_a_gain_no_unit_is_a_fault() -> None:
    """A default could be a wrong unit in the comments of the generated code."""
    spec = parse_spec(LEAKY, Path("leaky.yaml"))
    names = ["rail"]
    with pytest.raises(KeyError, match="K_L"):
        system = observer().system
        own = States(Matrix([]), (), Matrix([]), Matrix([]))
        leak = read_gain(spec, spec.required_observer, "K_L", names, names)
        velocity_of(spec, spec.required_observer, system).observer(
            spec.required_observer, observer().equations, own, (), Matrix([0]), (leak,), {}, level_errors=True
        )


def test_an_observer_that_moves_away_from_the_truth_must_say_so() -> None:
    """At e = 0 the level leaks at K_L a: V(e) does not decay to 0, whatever the eigenvalues of Ψ are."""
    with pytest.raises(ValueError, match=r"e_a_rail of a leaky changes at the rate .*K_L"):
        derive_error_dynamics(replace(observer(), exact=True))


def test_what_is_certified_of_it_says_that_its_error_does_not_vanish() -> None:
    found = Derived(parse_spec(LEAKY, Path("leaky.yaml"))).outcome
    assert isinstance(found, Certificate)
    assert any("e = 0 is not an equilibrium" in each for each in found.content["assumptions"])
    whole = Derived(parse_spec(ONE, Path("one.yaml"))).outcome
    assert not any("equilibrium" in each for each in whole.content["assumptions"])
