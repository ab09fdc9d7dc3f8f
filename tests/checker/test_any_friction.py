"""Sets of ellipsoid.json for any friction: compiled trackers beside friction at its worst, and in stick–slip."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.certify.bound.friction_bounds import largest_friction
from codegen.certify.outcome import Certificate
from codegen.checker import ellipsoid, errors
from codegen.replay.engine import Engine
from codegen.simulate.closed_loop import simulate
from codegen.spec import parse_spec, read_spec
from tests.checker.test_kernel import GENERATED, numbers, seen, spec_path, texts
from tests.slow_cases import slow_except
from tests.twin import load_twin

TRACKERS = ["rig_to", "two_mass_gto"]


def content(name: str, file: str) -> Any:
    return json.loads((GENERATED / name / file).read_text("utf-8"))


def bounds_of_any(name: str) -> tuple[Any, list[float]]:
    """The claim, and its bound of each error with any friction, noise of the sample and the friction itself in it."""
    claim, proof = content(name, "ellipsoid.json"), content(name, "proof.json")
    pairs = zip(claim["sets"], ellipsoid.bounded(proof, claim, errors.prove(proof, texts(name))), strict=True)
    return claim, [float(x) for ball, found in pairs if "friction" in ball for x in found]


class Run:
    """The compiled C beside the proof's machine, whose friction is another at each sample; inputs are 0."""

    def __init__(self, name: str) -> None:
        self.proof, self.claim = content(name, "proof.json"), content(name, "ellipsoid.json")
        machine = Derived(read_spec(spec_path(name)))
        self.engine, program = Engine(machine.program, machine.sources), machine.program
        self.at = seen(load_twin(machine.sources["__init__.py"], name).Parameters(), "parameters")
        self.inputs = [f"inputs.{program.reference(f.name)}" for f in program.inputs]
        self.outputs = [f"outputs.{program.reference(n)}" for n, _, _ in program.outputs]
        self.limit = {
            (kind, of): float(Fraction(d))
            for kind in ("noise", "drift", "friction")
            for of, d in self.claim[kind].items()
            if not (kind == "drift" and of in self.claim["friction"])
        }

    def errors(self, shares: dict[tuple[str, str], Any], count: int) -> Any:
        """truth − estimate at each sample: of velocities, and of a friction of 0, that is −estimate; with ``shares`` of
        the largest disturbances."""
        proof, zero = self.proof, np.zeros(count)
        of = {key: np.broadcast_to(shares.get(key, 0.0), count) * d for key, d in self.limit.items()}
        positions, accelerations, h = proof["positions"], proof["acceleration"], self.at["parameters.sample_time"]
        at = self.at | dict.fromkeys([*self.inputs, *positions, *positions.values(), *self.claim["friction"]], 0.0)
        rows, truth = np.zeros((count, len(self.inputs))), np.zeros((count, len(proof["errors"])))
        for k in range(count):
            measured = {x: at[x] + of.get(("noise", x), zero)[k] for x in positions}
            rows[k] = [measured.get(x, 0.0) for x in self.inputs]
            truth[k, : len(positions)] = [at[v] for v in positions.values()]
            acting = at | {x: of["friction", x][k] for x in self.claim["friction"]}
            later = {
                v: at[v] + h * numbers(a, acting) + of.get(("drift", v), zero)[k] for v, a in accelerations.items()
            }
            moved = {x: at[x] + h * at[v] + of.get(("drift", x), zero)[k] for x, v in positions.items()}
            at |= later | moved
        self.engine.start(rows[0])
        shown, faults = self.engine.run(rows)
        assert not faults.any()
        return truth - shown[:, [self.outputs.index(e["estimate"]) for e in proof["errors"]]]


@pytest.mark.parametrize("name", TRACKERS)
def test_friction_at_its_worst_comes_near_the_bound_and_not_above(name: str) -> None:
    """All disturbances, friction among them, are the signs of the C's own impulse responses, reversed in time."""
    run, count, late = Run(name), {"rig_to": 500, "two_mass_gto": 1600}[name], 40
    claim, bounds = bounds_of_any(name)
    quiet, pulse = run.errors({}, count), np.eye(1, count, late)[0]
    answers = {key: (run.errors({key: pulse}, count) - quiet)[late:] for key in run.limit}
    for i, (bound, error) in enumerate(zip(bounds, run.proof["errors"], strict=True)):
        worst = {key: np.roll(np.pad(np.sign(a[::-1, i]), (0, late)), late) for key, a in answers.items()}
        reached = abs(run.errors(worst, count)[-1, i]) + float(Fraction(claim["friction"].get(error["truth"], "0")))
        assert 0.97 * bound < reached <= bound


def drop_columns(claim: Any) -> None:
    for row in claim["push"]:
        del row[-1]
    for ball in claim["sets"]:
        ball["weights"].pop()


def change(*path: Any) -> Callable[[Any], None]:
    def put(claim: Any) -> None:
        at = claim
        for step in path[:-2]:
            at = at[step]
        at[path[-2]] = path[-1]

    return put


FORGERIES: dict[str, tuple[Callable[[Any], None], str]] = {
    "a smaller bound": (change("sets", -1, "rows", 1, -1, "60"), "smaller than the proved one"),
    "more friction for the same bound": (change("friction", "true.F_theta", "31"), "too small"),
    "friction that does not push": (
        lambda c: [row.__setitem__(-1, "0") for row in c["push"]],
        "do not act on the errors as claimed",
    ),
    "friction without a column": (drop_columns, "."),
    "friction of a velocity": (change("friction", {"true.omega": "30"}), "needs constant truths"),
    "friction of an input": (change("friction", {"inputs.w": "30"}), "needs constant truths"),
    "friction below zero": (change("friction", "true.F_theta", "-30"), "below 0"),
    "a set of another friction": (change("sets", -1, "friction", "none"), "friction"),
    "a set of any friction, and none is said": (lambda c: c.pop("friction"), "."),
    "any friction in a set of a constant one": (change("sets", 0, "friction", "any"), "friction"),
    "any friction of nothing": (change("friction", {}), "."),
    "a start in a set of any friction": (lambda c: c["sets"][-1].update({"after": []}), "friction"),
    "no weight where friction acts": (change("sets", -1, "weights", -1, "0"), "not above 0"),
}


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_forged_claim_of_any_friction_is_refused(kind: str) -> None:
    (forge, reason), claim = FORGERIES[kind], content("rig_to", "ellipsoid.json")
    forge(claim)
    with pytest.raises(Exception, match=reason):
        proof = content("rig_to", "proof.json")
        ellipsoid.bounded(proof, claim, errors.prove(proof, texts("rig_to")))


@pytest.mark.parametrize("signs", [True, False])
def test_no_claim_of_any_friction_where_the_code_has_its_sign(signs: bool) -> None:
    """A level's error turns with its sign; and with that sign's name left in it, a tracker's proof is of less."""
    name = "one_mass" if signs else "rig_to"
    claim, proof = content(name, "ellipsoid.json"), content(name, "proof.json")
    claim["sets"][0]["friction"] = "any"
    claim["sets"][0].pop("after", None)
    proof["signs"] = proof["signs"] or {"sign.plates": "outputs.omega_hat"}
    with pytest.raises(ValueError, match=r"^friction$" if signs else "friction needs constant truths or levels"):
        ellipsoid.bounded(proof, claim, errors.prove(proof, texts(name)))


STICKING = """
simulation:
  duration: 3
  sample_time: 0.001
  observer: true
  inputs: {w: %s}
  encoder_step: {x1: 1e-5, x2: 1e-5}
"""
DRIVES = {
    "waves": "85*sin(2*pi*0.5*t) + 35*sin(2*pi*0.23*t)",
    "to and fro at 5 Hz, where the observer resonates": "400*sgn(sin(2*pi*5*t))",
}


@pytest.mark.parametrize("drive", slow_except([*DRIVES], [*DRIVES][1:]))  # the harder one
def test_stick_slip_of_two_contacts_stays_within_the_bounds(drive: str) -> None:
    """The shipped gains beside the simulated plant with Coulomb friction at both contacts, and the C in the loop."""
    text = Path(spec_path("two_mass_gto")).read_text("utf-8").replace("c: 100, D1: 1000, D2: 0.0001, ", "")
    text = text.replace("_dot: [-6, 6]", "_dot: [-60, 60]")
    spec = parse_spec(text.replace("reset_integrator", "coulomb") + STICKING % DRIVES[drive], Path("two_mass_gto.yaml"))
    machine = Derived(spec)
    assert isinstance(machine.outcome, Certificate) and not isinstance(machine.outcome.bounds, str)
    run = simulate(spec, machine.system)
    names = list(run.outputs)
    slips = run.true_velocities @ np.array([[1.0, -1.0], [0.0, 1.0]])
    stuck, turns = np.abs(slips) < 1e-9, np.diff(np.sign(slips), axis=0) != 0
    assert (stuck.mean(axis=0) > 0.01).any() or turns.sum() > 10
    assert not run.faults[1:].any()
    assert np.abs(np.diff(run.true_velocities, axis=0)).max() < 60 * 0.001
    for i, bound in enumerate(machine.outcome.bounds):
        error = np.abs(run.friction[:, i] - run.estimates[:, names.index(f"tracked_x{i + 1}")])
        assert bound.always is not None and error.max() <= bound.always
        assert error.max() > 0.05 * bound.always


@pytest.mark.slow
def test_sixteen_contacts_of_a_chain() -> None:
    """As a tracker with about the shipped gains: three times the level, whatever sticks, proved in one set."""
    text = spec_path("chain").read_text("utf-8").replace("kind: gcfo", "kind: gto")
    text = text.replace("gains: {K_F: 20, K_v: 20}", "gains: {K_1: 0, K_2: -20, K_v: 20}")
    outcome = Derived(parse_spec(text, Path("chain.yaml"))).outcome
    assert isinstance(outcome, Certificate) and not isinstance(outcome.bounds, str) and len(outcome.bounds) == 16
    for bound in outcome.bounds:
        assert bound.largest == 0.5 and bound.always is not None and 2 * 0.5 < bound.always < 3.2 * 0.5


LAWS = {
    "coulomb, a: 30": 30,
    "static_viscous, F_s: 40, F_c: 30, F_v: 1": 40,
    "static_viscous, F_s: 40, F_c: 30, F_v: 4": 30 + 4 * 5,
    "gaussian, F_s: 40, F_c: 30, F_v: 0, v_s: 0.1": 40,
    "tustin, F_s: 40, F_c: 30, F_v: 1, v_c: 0.1": 40 + 1 * 5,
    "extended_coulomb, a1: 30, a2: 10, a3: 20, a4: 1": 40 + 1 * 5,
    "dahl, a: 30, c: 100": 30,
    "lugre, F_s: 40, F_c: 30, sigma_0: 1e4, sigma_1: 10, sigma_2: 0, v_s: 0.1": -1,
}


RANGED = {
    "coulomb, a: 30": 32,
    "static_viscous, F_s: 40, F_c: 30, F_v: 2": 40,
    "static_viscous, F_s: 31, F_c: 30, F_v: 2": 32,
    "dahl, a: 30, c: 100": 32,
    "reset_integrator, a: 30, c: 100, D1: 1000, D2: 0.001": 32 * (1 + Fraction("4.999") / 1000),
    "lugre, F_s: 40, F_c: 30, sigma_0: 1e4, sigma_1: 10, sigma_2: 0, v_s: 0.1": None,
}


@pytest.mark.parametrize("law", RANGED)
def test_a_range_of_the_level_is_none_of_what_friction_is_beyond_it(law: str) -> None:
    """At rest up to the static level, by a state by more than the level, by LuGre's damping without bound."""
    text = spec_path("rig_to").read_text("utf-8").replace("coulomb, a: 30", law).replace("[-20, 20]", "[-5, 5]")
    machine = Derived(parse_spec(text.replace("envelope:", "envelope:\n  a_plates: [20, 32]"), Path("rig_to.yaml")))
    assert largest_friction(machine.spec, machine.observer) == [RANGED[law]]


@pytest.mark.parametrize("law", LAWS)
def test_the_largest_friction_of_a_law(law: str) -> None:
    """By hand: what it is at rest and, where it rises, at the fastest slip of the envelope; none of LuGre's damping."""
    text = spec_path("rig_to").read_text("utf-8").replace("coulomb, a: 30", law).replace("[-20, 20]", "[-5, 5]")
    machine, expected = Derived(parse_spec(text, Path("rig_to.yaml"))), LAWS[law]
    (found,) = largest_friction(machine.spec, machine.observer)
    assert found == (None if expected < 0 else expected)
