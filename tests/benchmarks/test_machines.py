"""The other simulator against closed forms, its drawn cases as specs that the package reads, and the outcomes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.machines.__main__ import Seed, page
from benchmarks.machines.cases import meta_text, spec_text
from benchmarks.machines.disturbances import effect
from benchmarks.machines.draw import draw, reference
from benchmarks.machines.families import BALL_SCREW, BELT_GANTRY, FAMILIES, SLIDER_CRANK, TWO_MASS, Family
from benchmarks.machines.outcome import ALARM, EXTRA, FOREIGN, MISSED, PART, RIGHT, WITH, WRONG, outcome_of, row_of
from benchmarks.machines.plant import Plant
from codegen.effects import CATALOGUE
from codegen.mechanics import build_system
from codegen.spec import read_spec
from tests.benchmarks.diagnoses import diagnosis
from tests.benchmarks.diagnoses import effect as said

GANTRY = {"m": 8.0, "J": 4e-4, "r": 0.02, "kt": 0.5}
MASS, FACTOR = 9.0, 25.0
"""m + J/r² and kt/r of it."""


def plant(*lacks, family: Family = BELT_GANTRY, values=GANTRY, levels=(10.0,), step: float = 1e-4, **state) -> Plant:
    return Plant(family, values, levels, list(lacks), step, **state)


def test_friction_stops_an_axis_where_the_closed_form_does_and_holds_it() -> None:
    one = plant(v=[0.5])
    one.advance([0.0], 1.0)
    assert one.v == [0.0]
    assert one.x[0] == pytest.approx(MASS * 0.5**2 / (2 * 10.0), rel=1e-3)
    where = one.x[0]
    one.advance([0.99 * 10.0 / FACTOR], 0.5)
    assert one.x[0] == where
    one.advance([20.0 / FACTOR], 0.5)
    assert one.x[0] - where == pytest.approx((20.0 - 10.0) / MASS * 0.5**2 / 2, rel=1e-6)


def test_viscous_friction_decays_as_an_exponential() -> None:
    one = plant(effect("viscous", 0, {"b": 30.0}, "Fx"), levels=(0.0,), v=[1.0])
    one.advance([0.0], 0.4)
    assert one.v[0] == pytest.approx(math.exp(-30.0 * 0.4 / MASS), rel=1e-6)


def test_a_spring_oscillates_and_coulomb_friction_takes_the_same_from_every_half_swing() -> None:
    k = 400.0
    one = plant(effect("spring", 0, {"k": k}, "x"), x=[0.3])
    half = math.pi * math.sqrt(MASS / k)
    one.advance([0.0], half)
    assert one.x[0] == pytest.approx(-(0.3 - 2 * 10.0 / k), rel=1e-3)


def test_a_load_behind_a_spring_has_the_resonance_of_two_masses() -> None:
    k, share = 5000.0, 0.4
    one = plant(effect("compliance", 0, {"k": k, "c": 0.0, "load_fraction": share}, "x"), levels=(0.0,), step=5e-5)
    one.load = [0.01, 0.0]
    period = 2 * math.pi / math.sqrt(k / (share * (1 - share) * MASS))
    one.advance([0.0], period / 2)
    assert one.x[0] - one.load[0] == pytest.approx(0.01, rel=1e-3)
    assert (1 - share) * one.x[0] + share * one.load[0] == pytest.approx(share * 0.01, rel=1e-9)


def test_a_load_behind_backlash_is_not_moved_inside_the_gap() -> None:
    p = {"k": 5000.0, "c": 5.0, "load_fraction": 0.5, "gap": 0.02}
    one = plant(effect("backlash", 0, p, "x"), levels=(0.0,), v=[0.1], step=5e-5)
    one.advance([0.0], 0.09)
    assert one.load == [0.0, 0.0]
    one.advance([0.0], 0.1)
    assert one.load[1] > 0


def test_dahl_friction_rises_over_the_way_as_an_exponential_to_the_level() -> None:
    sigma, level = 1e4, 10.0
    one = plant(effect("presliding", 0, {"sigma": sigma}, "Fx"), v=[0.1], step=5e-5)
    for _ in range(10):
        one.advance([20.0 / FACTOR], 1e-3)
        assert sigma * one.bristle[0] == pytest.approx(level * (1 - math.exp(-sigma * one.x[0] / level)), rel=1e-3)
    one.advance([20.0 / FACTOR], 0.1)
    assert sigma * one.bristle[0] == pytest.approx(level, rel=1e-3)


@pytest.mark.parametrize(
    "kind, p, acting",
    [
        ("input_gain", {"gain": 0.8}, 1.6),
        ("dead_zone", {"width": 0.5}, 1.5),
        ("saturation", {"limit": 1.2}, 1.2),
        ("actuator_lag", {"tau": 0.02}, 2.0 * (1 - 0.02 / 0.1 * (1 - math.exp(-0.1 / 0.02)))),
        ("input_delay", {"T": 0.03}, 2.0 * 0.7),
    ],
)
def test_the_chain_of_the_actuator_by_its_impulse(kind: str, p: dict[str, float], acting: float) -> None:
    one = plant(effect(kind, 0, p, "i"), levels=(0.0,))
    one.advance([2.0], 0.1)
    assert MASS * one.v[0] / (FACTOR * 0.1) == pytest.approx(acting, rel=2e-3)


def test_levels_differ_by_direction_load_and_place() -> None:
    one = plant(effect("coulomb_asymmetry", 0, {"d": -3.0}, "Fx"))
    assert (one.level(0, 0.0, 0.1, 0.0), one.level(0, 0.0, -0.1, 0.0)) == (7.0, 13.0)
    two = plant(
        effect("load_dependent_friction", 0, {"mu": 0.1}, "Fx"),
        effect("position_dependent_friction", 0, {"amplitude": 2.0, "period": 0.4, "phase": 0.0}, "Fx"),
        effect("stribeck", 0, {"delta": 5.0, "v_s": 0.1}, "Fx"),
    )
    assert two.level(0, 0.1, 0.1, -50.0) == pytest.approx(10 + 5 + 2 + 5 * math.exp(-1))


def test_a_crank_without_friction_keeps_its_energy() -> None:
    values = {"J": 0.02, "m": 2.0, "r": 0.08, "l": 0.25, "kt": 1.0}
    one = plant(family=SLIDER_CRANK, values=values, levels=(0.0,), v=[5.0])

    def energy() -> float:
        # The slider's speed from its position, by differences: r cos q + √(l² − r² sin² q).
        at = [0.08 * math.cos(q) + math.sqrt(0.25**2 - (0.08 * math.sin(q)) ** 2)
              for q in (one.x[0] - 1e-5, one.x[0] + 1e-5)]  # fmt: skip
        speed = (at[1] - at[0]) / 2e-5 * one.v[0]
        return 0.5 * 0.02 * one.v[0] ** 2 + 0.5 * 2.0 * speed**2

    start = energy()
    for _ in range(20):
        one.advance([0.0], 0.05)
        assert energy() == pytest.approx(start, rel=2e-4)


def test_a_screw_falls_by_its_weight_and_two_masses_keep_their_momentum() -> None:
    screw = {"m": 30.0, "mc": 10.0, "J": 2e-4, "lead": 0.01, "kt": 0.5}
    one = plant(family=BALL_SCREW, values=screw, levels=(0.0,))
    one.advance([0.0], 0.3)
    inertia = 40.0 + 2e-4 * (2 * math.pi / 0.01) ** 2
    assert one.v[0] == pytest.approx(-20.0 * 9.81 / inertia * 0.3, rel=1e-9)
    drive = {"J1": 0.003, "J2": 0.006, "k": 10.0, "kt": 0.4}
    coupled = effect("coupling", 0, {"c": 0.01}, ["q1", "q2"])
    two = plant(coupled, family=TWO_MASS, values=drive, levels=(0.0, 0.0), v=[4.0, 0.0])
    two.advance([0.0, 0.0], 3.0)
    assert two.v == pytest.approx([4.0 / 3, 4.0 / 3], rel=1e-3)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda f: f.name)
def test_spec_and_simulator_state_the_same_machine(family: Family, tmp_path: Path) -> None:
    """M, g and U of the written spec, at the true parameters and a random state, against the Python functions."""
    machine = draw(5, FAMILIES.index(family))
    file = tmp_path / "spec.yaml"
    file.write_text(spec_text(machine, "case"))
    system = build_system(read_spec(file))
    rng = np.random.default_rng(3)
    count = len(family.axes)
    x, v = rng.uniform(-1, 1, count), rng.uniform(-2, 2, count)
    currents = {a.driven: float(rng.uniform(-1, 1)) for a in family.axes if a.driven}
    at = {a.x: x[k] for k, a in enumerate(family.axes)} | {a.v: v[k] for k, a in enumerate(family.axes)} | currents
    at |= machine.declared | {"g": 9.81, "pi": math.pi}
    numbers = {s: at[str(s)] for s in system.mass_matrix.free_symbols | system.force.free_symbols}
    mass = np.array(system.mass_matrix.subs(numbers), dtype=float)
    assert mass == pytest.approx(np.diag(family.mass(machine.declared, x, math)), rel=1e-9)
    force = np.array(system.force.subs(numbers), dtype=float).ravel()
    driven = [f * currents.get(a.driven, 0.0) for f, a in zip(family.drive(machine.declared), family.axes, strict=True)]
    expected = np.array(family.force(machine.declared, x, v, math)) + driven
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert "input_hold" in meta_text(machine)


def test_a_case_is_a_function_of_seed_and_index_and_its_effects_are_of_the_catalogue() -> None:
    for index in range(40):
        one, two = draw(3, index), draw(3, index)
        assert (one.values, one.declared, one.recorder) == (two.values, two.declared, two.recorder)
        kinds = [d.kind for d in one.lacks()]
        assert kinds == [d.kind for d in two.lacks()]
        assert len(kinds) == {"none": 0, "single": 1, "double": 2, "foreign": 1}[one.group]
        assert all((d.kind in CATALOGUE) == (one.group != "foreign") for d in one.lacks())
        for d in one.lacks() if one.group != "foreign" else ():
            assert set(d.p) == {p.name for p in CATALOGUE[d.kind].parameters}


def test_references_stay_in_their_stroke_and_below_their_speed() -> None:
    for seed in range(5):
        x, v = reference(np.random.default_rng(seed), 15.0, 1e-3, 0.8, 0.5)
        assert np.abs(x).max() <= 0.8 / 2 * 1.05
        assert np.abs(v).max() <= 0.5 * 1.05
        assert x == pytest.approx(np.cumsum(v) * 1e-3)


def test_outcomes_by_group() -> None:
    single = {"group": "single", "foreign": "", "effects": [{"kind": "offset"}], "equivalents": [["coulomb_asymmetry"]]}
    offset, drag, twin = (
        said("offset", "x", f0=1.0),
        said("quadratic_drag", "x", c=1.0),
        said("coulomb_asymmetry", "F", d=1.0),
    )
    assert outcome_of(single, diagnosis("effect", offset)) == RIGHT
    assert outcome_of(single, diagnosis("effect", twin)) == RIGHT
    assert outcome_of(single, diagnosis("effect", drag)) == WRONG
    assert outcome_of(single, diagnosis("effect", offset, drag)) == EXTRA
    assert outcome_of(single, diagnosis("none")) == MISSED
    assert outcome_of(single, diagnosis("ambiguous", tied=("quadratic_drag", "offset"))) == WITH
    double = {
        **single,
        "group": "double",
        "effects": [{"kind": "offset"}, {"kind": "quadratic_drag"}],
        "equivalents": [[], []],
    }
    assert outcome_of(double, diagnosis("effect", offset)) == PART
    assert outcome_of(double, diagnosis("effect", offset, drag)) == RIGHT
    nothing = {**single, "group": "none", "effects": [], "equivalents": []}
    assert (outcome_of(nothing, diagnosis("none")), outcome_of(nothing, diagnosis("effect", drag))) == (RIGHT, ALARM)
    spots = {**nothing, "group": "foreign", "foreign": "bearing_spots"}
    place = said("position_dependent_friction", "F", amplitude=1.0)
    assert outcome_of(spots, diagnosis("effect", place)) == RIGHT
    assert outcome_of({**spots, "foreign": "gusts"}, diagnosis("effect", place)) == FOREIGN
    assert outcome_of({**spots, "foreign": "gusts"}, diagnosis("unknown")) == RIGHT


def test_the_page_has_every_row_and_says_which_seeds_were_seen() -> None:
    truth = {
        "group": "none", "family": "turntable", "foreign": "", "effects": [], "equivalents": [],
        "identifiable": False, "shown": {"share": 0.01, "left": 0.01, "t": 3.0},
    }  # fmt: skip
    row = row_of("case_0000", truth, diagnosis("none"), 1.0, "abc")
    text = page([Seed(7, True, (row,)), Seed(8, False, (row, row))])
    assert "Seeds held out: 7" in text and "Seeds seen: 8" in text
    assert (text.count("| 7 | case_0000 | turntable |"), text.count("| 8 | case_0000 | turntable |")) == (1, 2)
    assert "| no effect: false alarm | 0 of 1" in text
