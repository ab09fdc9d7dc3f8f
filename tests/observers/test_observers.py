"""The observers' equations, state by state, against the thesis' written by hand in NumPy; and what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.base.errors import BadInput
from codegen.mechanics import build_system
from codegen.observers import Observer, build_observer, observer_of
from codegen.spec import parse_spec
from tests.expected_errors import refused
from tests.machines import ONE_MASS, TWO_MASS, machine
from tests.observers.by_hand import BY_HAND
from tests.slow_cases import slow_except

from .cases import KINDS, seeded, write_observer

NUMPY = [{"Sgn": np.sign, "Magnitude": np.abs}, "numpy"]
ALL = [(name, kind, velocity) for name in KINDS for kind in KINDS[name] for velocity in ("measured", "estimated")]


def numeric(expression: Any, values: dict[Any, float]) -> Any:
    used = sorted(expression.free_symbols, key=str)
    return np.array(sympy.lambdify(used, expression, NUMPY)(*[values[s] for s in used]), dtype=float).ravel()


def run(observer: Observer, values: dict[Any, float], mass: Any) -> dict[str, Any]:
    """Walk the equations in order; ``values`` grows by what they define."""
    found = {}
    for equation in observer.equations:
        value = numeric(equation.expression, values)
        if equation.form == "mass_solve":
            value = np.linalg.solve(mass, value)
        values.update(zip(equation.symbols, value, strict=True))
        found[equation.name] = value
    return found


@pytest.mark.parametrize("everything", slow_except([False, True], [True]))
@pytest.mark.parametrize(("name", "kind", "velocity"), ALL)
def test_equations_are_the_thesis_observers(name: str, kind: str, velocity: str, everything: bool) -> None:
    generator = seeded("equations", name, kind, velocity, str(everything))
    options = {"full": True, "exponent": 2.0, "effects": True} if everything else {}
    section, reference = write_observer(name, kind, velocity, generator, **options)
    spec, system = machine(name, section, effects=everything)
    observer = build_observer(spec, system)
    hand, n = BY_HAND[name], system.degrees_of_freedom
    for _ in range(5):
        x, v, w = generator.normal(size=n), generator.normal(size=n), generator.normal(size=hand.inputs)
        state = generator.normal(size=len(observer.states))
        values = {s: float(value) for s, value in observer.values.items()}
        values |= dict(zip((*system.positions, *system.velocities, *system.inputs), (*x, *v, *w), strict=True))
        values |= dict(zip(observer.states, state, strict=True))
        found = run(observer, values, hand.mass(x))
        v_hat, friction = reference.estimates(x, v, state)
        # rounding only: a few hundred operations on numbers up to 1e4
        np.testing.assert_allclose(
            found["acceleration"], reference.acceleration(x, v_hat, w, friction), rtol=1e-9, atol=1e-9
        )
        np.testing.assert_allclose(
            found["friction_level" if reference.levels else "tracked_friction"], friction, rtol=1e-12, atol=1e-12
        )
        np.testing.assert_allclose(
            numeric(observer.rates, values), reference.rates(x, v, w, state), rtol=1e-9, atol=1e-8
        )


@pytest.mark.parametrize(("name", "kind", "velocity"), ALL)
def test_the_first_estimate_is_standstill_and_the_declared_level(name: str, kind: str, velocity: str) -> None:
    """Before anything is measured: v̂ = 0, â the spec's level, F̂ of the trackers zero."""
    generator = seeded("initial", name, kind, velocity)
    section, reference = write_observer(name, kind, velocity, generator)
    spec, system = machine(name, section)
    observer = build_observer(spec, system)
    x, v = generator.normal(size=system.degrees_of_freedom), generator.normal(size=system.degrees_of_freedom)
    values = {s: float(value) for s, value in observer.values.items()}
    values |= dict(zip((*system.positions, *system.velocities), (*x, *v), strict=True))
    v_hat, friction = reference.estimates(x, v, numeric(observer.initial, values))
    levels = [float(c.parameters["a"]) for c in spec.contacts]
    if velocity == "estimated":
        np.testing.assert_allclose(v_hat, 0, atol=1e-12)
    np.testing.assert_allclose(friction, levels if reference.levels else 0 * friction, atol=1e-12)


def observed(gains: str, kind: str = "gcfo", text: str = ONE_MASS, velocity: str = "estimated", more: str = "") -> str:
    return text + f"observer: {{kind: {kind}, velocity: {velocity}, gains: {gains}, sample_time: 0.001{more}}}\n"


REFUSED = {
    "unknown kind": (observed("{K_F: 1, K_v: 1}", "gcf"), "unknown observer `gcf`", "gcfo"),
    "single kind on two masses": (observed("{K_F: 1, K_v: 1}", "cfo", TWO_MASS), "cfo on 2 coordinates", "gcfo"),
    "missing gain": (observed("{K_F: 1}"), "gain `K_v` is missing", None),
    "unknown gain": (observed("{K_F: 1, K_v: 1, K_w: 1}"), "unknown gain `K_w`", "K_v"),
    "wrong length": (observed("{K_F: [1, 2, 3], K_v: 1}", text=TWO_MASS), "K_F of length 3", None),
    "wrong rows": (observed("{K_F: [[1, 2]], K_v: 1}", text=TWO_MASS), "K_F of 1 row of 2", None),
    "ragged rows": (
        observed("{K_F: [[1, 2], [3]], K_v: 1}", text=TWO_MASS),
        "row 2 has 1 entry",
        None,
    ),
    "negative K_F": (observed("{K_F: -1, K_v: 1}"), "K_F = -1", None),
    "zero K_v": (observed("{K_F: 1, K_v: 0}"), "K_v = 0", None),
    "positive K_2": (observed("{K_2: 1}", "to", velocity="measured"), "K_2 = 1", None),
    "infinite gain": (observed("{K_F: .inf, K_v: 1}"), "the number inf", None),
    "exponent zero": (observed("{K_F: 1, K_v: 1}", more=", exponent: 0"), "exponent 0", None),
    "exponent huge": (observed("{K_F: 1, K_v: 1}", more=", exponent: 64"), "exponent 64", None),
    "laws of a CFO": (
        observed("{K_F: 1, K_v: 1}", more=", laws: {rail: {law: dahl, a: 1, c: 9}}"),
        "`laws` with",
        None,
    ),
    "h of a GTO": (observed("{K_2: -1, K_v: 1}", "gto", more=", h: s"), "`h` with `kind: gto`", None),
    "exponent of a GTO": (
        observed("{K_2: -1, K_v: 1}", "gto", more=", exponent: 2"),
        "`exponent` with `kind: gto`",
        None,
    ),
    "no observer": (ONE_MASS, "no `observer:` section", None),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    text, found, nearest = REFUSED[case]
    spec = parse_spec(text, Path("machine.yaml"))
    with pytest.raises(BadInput) as told:
        build_observer(spec, build_system(spec))
    assert found in told.value.found
    assert told.value.nearest == nearest
    assert str(told.value).startswith("machine.yaml:")


def test_a_gain_with_another_number_of_entries_is_told_the_forms_that_it_has() -> None:
    """It was *a scalar, 1 diagonal entries or 1 by 1 rows*, also of a matrix that is not square and takes no scalar."""
    one_contact = TWO_MASS.replace("[[1, 0], [-1, 1]]", "[[1], [-1]]")
    one_contact = one_contact.replace("    - {name: ground, law: coulomb, a: 20, unit: N}\n", "")
    given = {
        "K_F": observed("{K_F: [1.5, 2.5], K_v: 1}"),
        "K_2": observed("{K_1: [[0, 0]], K_2: [1, 2, 3], K_v: 1}", "mgto", one_contact),
    }
    expected = {}
    for name, text in given.items():
        spec = parse_spec(text, Path("machine.yaml"))
        with pytest.raises(BadInput) as told:
            build_observer(spec, build_system(spec))
        assert f"observer.gains.{name}" in str(told.value)
        expected[name] = told.value.expected
    assert expected == {"K_F": "one number", "K_2": "1 by 2 rows, since the matrix is not square"}


TAKEN = "h K_F K_v v_dot v_hat z_v s_rail a_rail e_v slip_rail sign_rail a_hat_rail z_rail v_next W11 F_hat_rail"


@pytest.mark.parametrize("name", TAKEN.split())
def test_a_parameter_named_like_a_quantity_of_the_observer_is_refused(name: str) -> None:
    """Both would be one symbol: a spec with a damping called K_v once got a certificate for another machine."""
    text = observed("{K_F: 10, K_v: 100}").replace(" b:", f" {name}:").replace("b*v", f"{name}*v")
    spec = parse_spec(text, Path("machine.yaml"))
    with refused(f"SPEC009 `{name}`"):
        build_observer(spec, build_system(spec))


def test_a_contact_named_like_a_velocity_is_refused() -> None:
    """The states of the two would both be z_v."""
    spec = parse_spec(observed("{K_F: 10, K_v: 100}").replace("name: rail", "name: v"), Path("machine.yaml"))
    with refused("SPEC009 `z_v`"):
        build_observer(spec, build_system(spec))


@pytest.mark.parametrize("velocity", ["measured", "estimated"])
@pytest.mark.parametrize("kind", KINDS["one_mass"])
def test_an_ordinary_name_is_not_refused(kind: str, velocity: str) -> None:
    section, _ = write_observer("one_mass", kind, velocity, seeded(kind))
    spec, system = machine("one_mass", section)
    assert build_observer(spec, system).kind == kind


def test_two_contacts_at_one_slip_are_sent_to_an_observer_that_takes_them(tmp_path: Path) -> None:
    """A guide and a brake on one axis: the message on `cfo` named `gcfo`, which refuses them too."""
    contacts = "contacts: [{name: guide, a: 35, unit: N}, {name: brake, a: 20, unit: N}]"
    text = re.sub(
        r"distribution:.*\n  contacts:\n.*\n",
        f"distribution: [[1, 1]]\n  {contacts}\n",
        Path("specs/one_mass.yaml").read_text(),
    )
    with refused("SPEC022 1 2 one contact sum gto K_2") as told:
        observer_of(parse_spec(text, tmp_path / "one.yaml"))
    assert not told.value.nearest, "gto has other gains: it is no slip of the pen"
    tracked = re.sub("gains: .*", "gains: {K_2: -0.1, K_v: 100}", text.replace("kind: cfo", "kind: gto"))
    assert observer_of(parse_spec(tracked, tmp_path / "one.yaml")).kind == "gto"
