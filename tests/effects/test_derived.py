"""Each effect in Ψ, against CasADi's differentiation, and before the checker: certified, or refused with a reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from independence.derived import Derived, random_point
from independence.true_plant import TruePlant

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.certify.certify import Certificate, Refusal
from codegen.effects import CATALOGUE
from codegen.effects.declare import add_declared_effects, places_of
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec
from tests.certify.certified import outcome
from tests.machines import TEXTS, bare_machine
from tests.slow_cases import slow_except

PARAMETERS = {"T": 0.02, "tau": 0.004, "gain": 1.1, "period": 0.7, "load_fraction": 0.4, "amplitude": 0.02, "v_s": 0.3}
OBSERVERS = {
    ("arm", "gcfo"): "{kind: gcfo, velocity: estimated, gains: {K_F: [0.05, 0.01], K_v: [60, 60]}, sample_time: 0.001}",
    ("arm", "gto"): "{kind: gto, velocity: measured, gains: {K_2: [-0.05, -0.01]}, sample_time: 0.001}",
    ("two_mass", "gcfo"): "{kind: gcfo, velocity: estimated, gains: {K_F: [500, 700], K_v: 10}, sample_time: 0.001}",
    ("two_mass", "gto"): "{kind: gto, velocity: measured, gains: {K_2: [-100, -500]}, sample_time: 0.001}",
}
ENVELOPES = {
    "arm": "{th1: [-1, 1], th2: [-1, 1], om1: [-1, 1], om2: [-1, 1], u1: [-1, 1], u2: [-1, 1]}",
    "two_mass": "{x1: [-1, 1], x2: [-1, 1], v1: [-2, 2], v2: [-2, 2], w: [-9, 9]}",
}


def declared(kind: str, machine: str) -> str:
    """One effect at the last place where it applies; "" if there is none."""
    effect, system = CATALOGUE[kind], bare_machine(machine)
    places = [on for i, on in enumerate(places_of(effect, system)) if effect.applies(system, i)]
    if not places:
        return ""
    values = ", ".join(f"{p.name}: {PARAMETERS.get(p.name, 0.01)}" for p in effect.parameters)
    return f"[{{kind: {kind}, on: [{places[-1]}], parameters: {{{values}}}}}]"


PLACED = [(k, m, o) for k in CATALOGUE for m, o in OBSERVERS if declared(k, m)]
ON = [(k, "two_mass" if declared(k, "two_mass") else "arm") for k in CATALOGUE]
QUICK = [(k, m, ("gcfo", "gto")[i % 2]) for i, (k, m) in enumerate(ON)]
"""Each kind once, on the two masses where it has a place there, with the observers by turns."""
CASES = slow_except(PLACED, QUICK, several=True)


def test_each_kind_has_a_place() -> None:
    assert {k for k, _, _ in PLACED} == set(CATALOGUE)


@pytest.mark.parametrize(("kind", "machine", "observer"), CASES)
def test_psi_as_casadi_differentiates_it(kind: str, machine: str, observer: str) -> None:
    text = f"observer: {OBSERVERS[machine, observer]}\nenvelope: {ENVELOPES[machine]}\n"
    spec = parse_spec(TEXTS[machine] + text + f"effects: {declared(kind, machine)}\n", Path("machine.yaml"))
    built = build_observer(spec, add_declared_effects(build_system(spec), spec))
    derived, plant = Derived(spec, derive_error_dynamics(built)), TruePlant(spec, built)
    random = np.random.default_rng(list(f"{kind}{machine}{observer}".encode()))
    for _ in range(3):
        p = random_point(spec, built, random)
        now, later, _ = plant.slips(p, 0.001)
        (psi, sampled), (right, step) = derived.matrices(p, plant, 0.001), plant.matrices(p, 0.001)
        assert np.abs(psi - right).max() < 1e-9 * np.abs(right).max()
        if (np.sign(now) == np.sign(later)).all():
            assert np.abs(sampled - step).max() < 1e-9 * np.abs(step).max()


@pytest.mark.parametrize("kind", CATALOGUE)
def test_certified_or_refused_with_a_reason(kind: str) -> None:
    """On the two masses every effect of moderate size leaves the observer certifiable; ``certify`` asks the checker."""
    machine = "two_mass" if declared(kind, "two_mass") else "arm"
    found = outcome(machine, OBSERVERS[machine, "gto"], ENVELOPES[machine], declared(kind, machine))
    if machine == "arm":
        assert isinstance(found, Certificate) or (isinstance(found, Refusal) and len(found.reason) > 20)
        return
    assert isinstance(found, Certificate), found
    rigid = any("taken as rigid" in line for line in found.content["assumptions"])
    assert rigid == (kind in ("compliance", "backlash"))
