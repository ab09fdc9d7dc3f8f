"""Every effect against its equation in effects.md, written by hand: sign, place, starts; and what is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.optimize import brentq

from codegen.base.errors import BadInput
from codegen.effects import CATALOGUE, Effect, EffectParameter
from codegen.effects.declare import add_declared_effects, effect_symbols, places_of, unit_words
from codegen.effects.effect import Symbols
from codegen.effects.on_coordinate import Spring
from codegen.effects.register import separating_experiment
from codegen.effects.start import Covered
from codegen.mechanics import System, build_system
from codegen.mechanics.system import TIME
from codegen.spec import parse_spec
from tests.diagnosis.stage import stage, system_of
from tests.machines import TEXTS, bare_machine
from tests.slow_cases import slow_except

NOT_LINEAR = {
    "dead_zone",
    "saturation",
    "presliding",
    "compliance",
    "backlash",
}  # no weight of theirs enters the equation linearly
NUMPY = [{"Sgn": np.sign, "Magnitude": np.abs}, "numpy"]

# What each effect adds to g − M a − U λ, of x, v, a of the coordinate; for contacts what it adds to λ, of the slip
# velocity u, the slip position s, the drive force L and the time t.
CONTACT = {
    "viscous": lambda u, s, L, t, b, v_s=None, b_inf=0: (
        b * u if v_s is None else b * np.sign(u) * v_s * np.log1p(abs(u) / v_s) + b_inf * u
    ),
    "coulomb_asymmetry": lambda u, s, L, t, d: d,
    "viscous_asymmetry": lambda u, s, L, t, d_b: d_b * abs(u),
    "stribeck": lambda u, s, L, t, delta, v_s, exponent=2, d_delta=0: (
        (np.sign(u) * delta + d_delta) * np.exp(-(abs(u / v_s) ** exponent))
    ),
    "position_dependent_friction": lambda u, s, L, t, amplitude, period, phase, amplitude_2=0, phase_2=0: (
        np.sign(u)
        * (amplitude * np.sin(2 * pi * s / period + phase) + amplitude_2 * np.sin(4 * pi * s / period + phase_2))
    ),
    "load_dependent_friction": lambda u, s, L, t, mu: np.sign(u) * mu * abs(L),
    "drive_backdrive_friction": lambda u, s, L, t, mu_drive, mu_back: (
        np.sign(u) * (mu_drive if L * u > 0 else mu_back) * abs(L)
    ),
    "friction_drift": lambda u, s, L, t, delta, T: np.sign(u) * delta * np.exp(-t / T),
}
# What the inputs exert on the coordinates.


def rounded_limit(w: float, limit: float, rounding: float) -> float:
    """By the distances of the point (w, rounding·limit) from the two corners."""
    steep = np.sqrt(1 - rounding**2)
    corner, width = limit * steep, limit * rounding
    return float((np.hypot(w + corner, width) - np.hypot(w - corner, width)) / (2 * steep))


INPUT = {
    "input_gain": lambda w, gain: gain * w,
    # Behind a threshold the effective input stays in the equation (test_actuator_forms says what it is).
    "dead_zone": lambda w, width=0, threshold=0: np.sign(w) * max(abs(w) - width, 0),
    "saturation": lambda w, limit, rounding=0: rounded_limit(w, limit, rounding),
}
DRIVE = {
    "one_mass": lambda w: [w],
    "two_mass": lambda w: [0, w],
    "arm": lambda w1, w2: [w1, w2],
    "cart": lambda w: [0, w],
}
COORDINATE = {
    "offset": lambda x, v, a, f0: f0,
    "quadratic_drag": lambda x, v, a, c: -c * v * abs(v),
    "spring": lambda x, v, a, k: -k * x,
    "cogging": lambda x, v, a, amplitude, period, phase: amplitude * np.sin(2 * pi * x / period + phase),
    "inertia_error": lambda x, v, a, delta: -delta * a,
    "gravity_imbalance": lambda x, v, a, G, phase: -G * np.sin(x + phase),
    "hardening_spring": lambda x, v, a, k3: -k3 * x**3,
    "cogging_harmonics": lambda x, v, a, period, **waves: sum(
        waves[f"sin_{k}"] * np.sin(2 * pi * k * x / period) + waves[f"cos_{k}"] * np.cos(2 * pi * k * x / period)
        for k in (1, 2, 3)
    ),
}
# These act over time or on a reading, not on the equation of one instant; see test_motion.
WITHOUT_FORCE = {"input_delay", "actuator_lag", "presliding", "compliance", "backlash", "encoder_eccentricity"}


def parameters(effect: Effect, generator: np.random.Generator) -> dict[str, float]:
    """Random values inside the admissible range, of both signs where that is allowed."""
    return {
        p.name: float(
            generator.uniform(max(0.1, p.low or 0), min(p.high or 2, 2))
            * (1 if p.low is not None else generator.choice([-1, 1]))
        )
        for p in effect.parameters
    }


def motion(system: System, generator: np.random.Generator) -> dict[Any, float]:
    moving = (*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME)
    return {s: float(v) for s, v in system.values.items()} | {s: float(generator.normal()) for s in moving}


def change(effect: Effect, system: System, place: int, p: Symbols) -> sympy.Matrix:
    """Change of g − M a − U λ by an effect, n by 1."""
    return sympy.Matrix(effect.add(system, place, p).equation_error - system.equation_error)


def numbers(expression: Any, values: dict[Any, float]) -> Any:
    used = sorted(expression.free_symbols, key=str)
    return np.array(sympy.lambdify(used, expression, NUMPY)(*[values[s] for s in used]), dtype=float).ravel()


def load_on_gear(
    system: System, place: int, share: float, drive: float, column: np.ndarray, at: dict[Any, float]
) -> float:
    """What the friction of a loaded gear adds: the root λ of λ = sgn(u)·(a + share·|D − λ|), less a·sgn(u)."""
    rest = at | dict.fromkeys(system.inputs, 0.0)
    ways = (rest | dict(zip(system.velocities, way * column / (column @ column), strict=True)) for way in (1, -1))
    there, back = (column @ numbers(sympy.Matrix(system.force), one) for one in ways)  # centrifugal forces cancel
    slip = float(column @ np.array([at[v] for v in system.velocities]))
    motor = drive + float(there - back) / 2 / float(column @ column) * slip
    contact, sign = system.contacts[place], np.sign(slip)
    level = float(numbers(sympy.Matrix([contact.law_level]), at | {contact.slip: slip})[0])
    reach = (abs(motor) + level) / (1 - share)
    root = brentq(lambda friction: friction - sign * (level + share * abs(motor - friction)), -reach, reach, xtol=1e-14)
    return float(root) - sign * level


def by_hand(kind: str, system: System, place: int, p: dict[str, float], at: dict[Any, float]) -> Any:
    u = np.array(sympy.Matrix(system.distribution).subs(at).evalf(), dtype=float)
    result = np.zeros(system.degrees_of_freedom)
    if kind in CONTACT:
        x, v, w = (np.array([at[s] for s in of]) for of in (system.positions, system.velocities, system.inputs))
        column = u[:, place]
        load = column @ DRIVE[system.name](*w) / (column @ column)
        if "mu_load" in p:
            return -column * load_on_gear(system, place, p["mu_load"], load, column, at)
        return -column * CONTACT[kind](column @ v, column @ x, load, at[TIME], **p)
    if kind == "coupling":
        (v1, v2) = (at[s] for s in system.velocities)
        return np.array([-p["c"] * (v1 - v2), p["c"] * (v1 - v2)])
    if kind in COORDINATE:
        symbols = (system.positions, system.velocities, system.accelerations)
        result[place] = COORDINATE[kind](*[at[s[place]] for s in symbols], **p)
        return result
    w = system.inputs[place]
    slope = np.array(sympy.Matrix(system.force.diff(w)).subs(at).evalf(), dtype=float).ravel()
    return slope * (INPUT[kind](at[w], **p) - at[w])


@cache
def cases() -> list[tuple[str, str, int]]:
    found = []
    for name in TEXTS:
        system = bare_machine(name)
        found += [(k, name, i) for k, e in CATALOGUE.items() for i in range(len(places_of(e, system)))]
    fitting = [c for c in found if CATALOGUE[c[0]].applies(bare_machine(c[1]), c[2])]
    return [c for c in fitting if c[0] not in WITHOUT_FORCE]


def test_no_kind_is_left_out() -> None:
    assert set(CATALOGUE) == {*CONTACT, *COORDINATE, *WITHOUT_FORCE, *INPUT, "coupling"}


ENDS = [[case for case in cases() if case[0] == kind] for kind in CATALOGUE]
"""Of each kind its cases; in `make test` the first, on the simplest machine, and the last, on an arm or a cart."""


@pytest.mark.parametrize(
    ("kind", "name", "place"), slow_except(cases(), [case for of in ENDS for case in (of[:1] + of[-1:])], several=True)
)
def test_change_is_the_equation(kind: str, name: str, place: int) -> None:
    """Of every form of the effect."""
    system = bare_machine(name)
    generator = np.random.default_rng(list(f"{kind}{name}{place}".encode()))
    for effect in CATALOGUE[kind].forms:
        symbols = effect_symbols(effect, places_of(effect, system)[place], system)
        added = change(effect, system, place, symbols)
        for _ in range(10):
            p, at = parameters(effect, generator), motion(system, generator)
            values = at | {symbols[q]: v for q, v in p.items()}
            right = by_hand(kind, system, place, p, at)
            np.testing.assert_allclose(numbers(added, values), right, rtol=1e-11, atol=1e-12)
            assert effect.admissible(system, place, p) or effect.demands


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize(("slip", "drive"), [(0.05, 9.0), (0.05, -9.0), (-0.05, 9.0), (-0.05, -9.0)])
def test_the_load_of_a_gear_is_what_the_effects_listed_before_it_leave(slip: float, drive: float, before: bool) -> None:
    """Stribeck friction before it is on the motor's side; after it, it takes nothing from the load."""
    share, delta, speed, system = 0.4, 3.0, 0.1, bare_machine("one_mass")
    contact = system.contacts[0].name
    peak, load = CATALOGUE["stribeck"], CATALOGUE["load_dependent_friction"].with_parameters(["mu_load"])
    of_peak, of_load = (effect_symbols(effect, contact, system) for effect in (peak, load))
    values = {of_peak["delta"]: delta, of_peak["v_s"]: speed, of_load["mu_load"]: share}
    changed = system
    for effect, symbols in ((peak, of_peak), (load, of_load))[:: 1 if before else -1]:
        changed = effect.add(changed, 0, symbols)
    at = {s: float(v) for s, v in system.values.items()} | dict.fromkeys((*system.positions, TIME), 0.0)
    at |= {system.velocities[0]: slip, system.inputs[0]: drive, system.accelerations[0]: 0.0} | values
    level, damping = (next(float(v) for s, v in system.values.items() if s.name == name) for name in ("rail_a", "b"))
    motor = drive - damping * slip
    friction = motor - float(numbers(sympy.Matrix(changed.equation_error), at)[0])
    hump, sign = delta * np.exp(-((slip / speed) ** 2)), np.sign(slip)
    inside, added = (level + hump, 0.0) if before else (level, sign * hump)
    root = brentq(lambda f: f - sign * (inside + share * abs(motor - f)), -500, 500, xtol=1e-13)
    assert friction == pytest.approx(root + added, rel=1e-10)


@pytest.mark.parametrize("kind", [k for k in CATALOGUE if k not in NOT_LINEAR])
def test_neutral_values_do_nothing(kind: str) -> None:
    effect, system = CATALOGUE[kind], bare_machine("arm")
    symbols = effect_symbols(effect, places_of(effect, system)[0], system)
    added = change(effect, system, 0, symbols)
    neutral = {symbols[p.name]: sympy.Rational(str(p.neutral)) for p in effect.parameters if p.neutral is not None}
    assert added.subs(neutral).applyfunc(sympy.simplify) == sympy.zeros(2, 1)


COVERED = Covered(
    force=6.0, span=1.6, top_speed=0.4, top_input=8.0, peak_input=12.0, inertia=2.0, level=3.0, noise=1e-6,
    sample_time=0.001, duration=20.0, cutoff_hz=20.0, periods=lambda: [0.3, 0.05],
)  # fmt: skip


@pytest.mark.parametrize("kind", CATALOGUE)
def test_a_fit_starts_from_admissible_values_of_every_shape(kind: str) -> None:
    effect = CATALOGUE[kind]
    starts = effect.starts(COVERED)
    assert 1 <= len(starts) <= (300 if effect.rough else 60)  # a rough loss has many basins
    for start in starts:
        assert set(start) == {q.name for q in effect.shapes}
        for q in effect.shapes:
            value = start[q.name]
            assert (q.low is None or value > q.low) and (q.high is None or value < q.high)


def test_starts_are_of_the_log_s_size() -> None:
    def values(kind: str, name: str) -> list[float]:
        return [start[name] for start in CATALOGUE[kind].starts(COVERED)]

    speeds = values("stribeck", "v_s")
    assert min(speeds) == pytest.approx(0.004) and max(speeds) == pytest.approx(0.32)
    assert values("cogging", "period") == [0.3, 0.05]
    assert values("saturation", "limit") == pytest.approx([4, 6, 7.2, 8, 9, 10, 11])
    # A level of 3 N is reached within 30 % to 0.01 % of 0.8 m.
    assert max(values("presliding", "sigma")) == pytest.approx(3 / 0.8e-4)
    assert min(values("presliding", "sigma")) == pytest.approx(3 / 0.24)
    # Motor 1.4 kg and load 0.6 kg on either side of the spring swing at 0.15 to 6 times the cutoff.
    softest = min(
        CATALOGUE["compliance"].starts(COVERED), key=lambda s: s["k"] if s["load_fraction"] == 0.3 else np.inf
    )
    assert np.sqrt(softest["k"] * (1 / 1.4 + 1 / 0.6)) == pytest.approx(2 * pi * 3)


def test_a_backlash_starts_from_the_compliance_that_was_found() -> None:
    found = {"k": 1234.0, "c": 5.0, "load_fraction": 0.4}
    starts = CATALOGUE["backlash"].starts(replace(COVERED, coupling=found))
    assert starts[0] | found == starts[0] and not any(s["k"] == 1234 for s in CATALOGUE["backlash"].starts(COVERED))


def test_a_shape_without_a_start_is_tried_at_shares_of_the_force() -> None:
    class Wall(Spring):
        kind = "wall"
        parameters = (EffectParameter("k", "{F}/{q}", "", neutral=0.0), EffectParameter("r", "{q}^2/s", ""))

    # 0.8 m covered either way, and half a span takes 2 s at the top speed.
    assert [s["r"] for s in Wall().starts(COVERED)] == pytest.approx([0.1 * 0.8**2 / 2, 0.5 * 0.8**2 / 2])


def test_a_viscous_curve_does_not_fall_with_speed_without_limit() -> None:
    """It may take off what the model declares, and no more; where that is no constant there is no such limit."""
    effect = CATALOGUE["viscous"].with_parameters(["b", "v_s", "b_inf"])
    curve = {"b": 9.0, "v_s": 0.2}
    damped = system_of(stage())  # 6 N s/m
    assert effect.admissible(damped, 0, curve | {"b_inf": -5.9})
    assert not effect.admissible(damped, 0, curve | {"b_inf": -6.1})
    text = (
        stage().text.replace("[w - b*v]", "[w - b*v*(1 + x/l)]").replace("  b: {", "  l: {value: 1, unit: m}\n  b: {")
    )
    assert effect.admissible(system_of(parse_spec(text, Path("stage.yaml"))), 0, curve | {"b_inf": -6.1})


def test_an_inertia_stays_positive() -> None:
    system, effect = bare_machine("one_mass"), CATALOGUE["inertia_error"]  # m = 1.7
    assert effect.admissible(system, 0, {"delta": -1.69})
    assert not effect.admissible(system, 0, {"delta": -1.71})


UNITS = {  # of effects.md, on the arm's elbow: F is N*m, q is rad
    "viscous": {"b": "N*m*s/rad"},
    "stribeck": {"delta": "N*m", "v_s": "rad/s"},
    "quadratic_drag": {"c": "N*m*s^2/rad^2"},
    "cogging": {"amplitude": "N*m", "period": "rad", "phase": "rad"},
    "inertia_error": {"delta": "N*m*s^2/rad"},
    "spring": {"k": "N*m/rad"},
    "input_gain": {"gain": "1"},
    "input_delay": {"T": "s"},
    "position_dependent_friction": {"amplitude": "N*m", "period": "rad", "phase": "rad"},
    "load_dependent_friction": {"mu": "1"},
    "friction_drift": {"delta": "N*m", "T": "s"},
    "gravity_imbalance": {"G": "N*m", "phase": "rad"},
    "hardening_spring": {"k3": "N*m/rad^3"},
}


@pytest.mark.parametrize("kind", UNITS)
def test_units(kind: str) -> None:
    assert unit_words(CATALOGUE[kind], 1, bare_machine("arm")) == UNITS[kind]


def declared(effects: str, name: str = "two_mass") -> System:
    spec = parse_spec(TEXTS[name] + f"effects: [{effects}]\n", Path("machine.yaml"))
    return add_declared_effects(build_system(spec), spec)


def test_unit_of_a_coupling() -> None:
    assert unit_words(CATALOGUE["coupling"], 0, bare_machine("arm")) == {"c": "N*m*s/rad"}


@pytest.mark.parametrize("kind", CATALOGUE)
def test_what_is_confused_is_told_apart_by_something(kind: str) -> None:
    effect = CATALOGUE[kind]
    assert effect.confused_with and all(c.separated_by for c in effect.confused_with)
    assert kind not in {c.other for c in effect.confused_with}
    assert effect.refines in {"", *CATALOGUE}


def test_the_experiment_that_tells_two_effects_apart_is_found_from_either() -> None:
    """Backlash names the delay, the delay does not name backlash; a spring and cogging do not name each other."""
    said = {c.other: c.separated_by for c in CATALOGUE["backlash"].confused_with}["input_delay"]
    assert "backlash" not in {c.other for c in CATALOGUE["input_delay"].confused_with}
    assert separating_experiment("backlash", "input_delay") == said
    assert separating_experiment("input_delay", "backlash") == said
    assert separating_experiment("spring", "cogging") == ""


def test_harmonics_are_those_that_the_parameters_name() -> None:
    waves = "period: 0.3, sin_2: 1.5, cos_2: -0.5, sin_7: 0.25, cos_7: 2"
    system = declared(f"{{kind: cogging_harmonics, on: x1, parameters: {{{waves}}}}}")
    at = motion(system, np.random.default_rng(5))
    plain = bare_machine("two_mass")
    turn = 2 * pi * at[plain.positions[0]] / 0.3
    force = 1.5 * np.sin(2 * turn) - 0.5 * np.cos(2 * turn) + 0.25 * np.sin(7 * turn) + 2 * np.cos(7 * turn)
    found = numbers(system.equation_error, at) - numbers(plain.equation_error, at)
    np.testing.assert_allclose(found, [force, 0], rtol=1e-11, atol=1e-11)


def test_a_pair_is_named_in_either_order() -> None:
    one, other = (declared(f"{{kind: coupling, on: {on}, parameters: {{c: 2}}}}") for on in ("[x1, x2]", "[x2, x1]"))
    assert one.equation_error == other.equation_error


def test_two_of_a_kind_on_one_place_add_up() -> None:
    one = "{kind: viscous, on: ground, parameters: {b: %s}}"
    twice, once = declared(f"{one % 2}, {one % 3}"), declared(one % 5)
    found, right = (numbers(s.equation_error, motion(s, np.random.default_rng(0))) for s in (twice, once))
    np.testing.assert_allclose(found, right, rtol=1e-12)


REFUSED = {
    "unknown kind": ("{kind: viscos, on: ground, parameters: {b: 1}}", "unknown effect `viscos`", "viscous"),
    "unknown place": ("{kind: viscous, on: grund, parameters: {b: 1}}", "viscous on `grund`", "ground"),
    "coordinate for a contact": ("{kind: viscous, on: x1, parameters: {b: 1}}", "viscous on `x1`", None),
    "contact for a coordinate": ("{kind: spring, on: ground, parameters: {k: 1}}", "spring on `ground`", None),
    "input for a contact": ("{kind: viscous, on: w, parameters: {b: 1}}", "viscous on `w`", None),
    "one place for two": ("{kind: coupling, on: x1, parameters: {c: 1}}", "coupling on `x1`", None),
    "twice the same place": ("{kind: coupling, on: [x1, x1], parameters: {c: 1}}", "coupling on `x1, x1`", None),
    "not an angle": ("{kind: gravity_imbalance, on: x1, parameters: {G: 1, phase: 0}}", "gravity_imbalance on", None),
    "sensor too steep": (
        "{kind: encoder_eccentricity, on: x1, parameters: {amplitude: 0.1, period: 1, phase: 0}}",
        "amplitude = 0.1, period = 1",
        None,
    ),
    "more than the load": (
        "{kind: compliance, on: x1, parameters: {k: 1, c: 1, load_fraction: 1}}",
        "load_fraction = 1",
        None,
    ),
    "half a harmonic": (
        "{kind: cogging_harmonics, on: x1, parameters: {period: 1, sin_4: 1}}",
        "`cos_4` is missing",
        None,
    ),
    "two places": ("{kind: viscous, on: [ground, between], parameters: {b: 1}}", "`ground, between`", None),
    "no place": ("{kind: viscous, on: [], parameters: {b: 1}}", "viscous on ``", None),
    "missing parameter": ("{kind: stribeck, on: ground, parameters: {delta: 1}}", "`v_s` is missing", None),
    "unknown parameter": ("{kind: viscous, on: ground, parameters: {b: 1, bb: 2}}", "unknown parameter `bb`", "b"),
    "out of range": ("{kind: stribeck, on: ground, parameters: {delta: 1, v_s: 0}}", "v_s = 0", None),
    "negative delay": ("{kind: input_delay, on: w, parameters: {T: -1}}", "T = -1", None),
    "not a number": ("{kind: viscous, on: ground, parameters: {b: .nan}}", "the number nan", None),
    "inertia below zero": ("{kind: inertia_error, on: x1, parameters: {delta: -11}}", "delta = -11", None),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    effect, found, nearest = REFUSED[case]
    with pytest.raises(BadInput) as told:
        declared(effect)
    assert found in told.value.found
    assert told.value.nearest == nearest or nearest is None
    assert str(told.value).startswith("machine.yaml:")


def test_a_backlash_is_started_near_any_gap() -> None:
    """A free run tells of a gap only within about a quarter of its own; four couplings have a start that near."""
    gaps = [start["gap"] for start in CATALOGUE["backlash"].starts(COVERED)]
    for gap in np.geomspace(1e-5, 0.15, 60):
        assert sum(gap / 1.25 <= other <= 1.25 * gap for other in gaps) >= 4


@pytest.mark.parametrize("kind", ["compliance", "backlash"])
def test_a_load_of_less_than_a_fiftieth_of_the_inertia_is_no_load(kind: str) -> None:
    """A fit of 0.65 % at a resonance of 5.9 Hz stood for a force that was periodic in time."""
    values = {"k": 729.0, "c": 0.66, "gap": 1e-3}
    assert "0.65 %" in CATALOGUE[kind].unseen({**values, "load_fraction": 0.0065}, 1e-6)
    assert CATALOGUE[kind].unseen({**values, "load_fraction": 0.03}, 1e-6) == ""
