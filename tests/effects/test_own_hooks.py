"""A user's own effects in Ψ, the certificate and the generated code: what `add` changes is all they need."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from compiled.build import Built
from independence.derived import Derived, random_point
from independence.true_plant import TruePlant

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.certify.certify import Certificate
from codegen.effects import CATALOGUE
from codegen.effects.declare import add_declared_effects, places_of
from codegen.effects.register import load_effects
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec
from tests.certify.certified import outcome
from tests.machines import TEXTS, bare_machine

from .own_hooks import VALUES
from .test_derived import ENVELOPES, OBSERVERS

SMALL = {"wall": {"k": 0.01, "d": 0.01}, "payload": {"m": 0.1}, "stretched": {"s": 0.01}}
"""Where the values of the diagnosis would leave too little to certify."""


@pytest.fixture(autouse=True)
def own() -> Iterator[None]:
    before = dict(CATALOGUE)
    load_effects(Path(__file__).parent / "own_hooks.py")
    yield
    CATALOGUE.clear()
    CATALOGUE.update(before)


def entry(kind: str) -> str:
    effect, system = CATALOGUE[kind], bare_machine("two_mass")
    on = next(on for i, on in enumerate(places_of(effect, system)) if effect.applies(system, i))
    values = ", ".join(f"{name}: {value}" for name, value in SMALL.get(kind, VALUES[kind]).items())
    return f"[{{kind: {kind}, on: [{on}], parameters: {{{values}}}}}]"


@pytest.mark.parametrize("kind", VALUES)
def test_psi_as_casadi_differentiates_it(kind: str) -> None:
    text = f"observer: {OBSERVERS['two_mass', 'gcfo']}\nenvelope: {ENVELOPES['two_mass']}\neffects: {entry(kind)}\n"
    spec = parse_spec(TEXTS["two_mass"] + text, Path("machine.yaml"))
    built = build_observer(spec, add_declared_effects(build_system(spec), spec))
    derived, plant = Derived(spec, derive_error_dynamics(built)), TruePlant(spec, built)
    random = np.random.default_rng(list(kind.encode()))
    for _ in range(3):
        p = random_point(spec, built, random)
        (psi, _), (right, _) = derived.matrices(p, plant, 0.001), plant.matrices(p, 0.001)
        assert np.abs(psi - right).max() < 1e-9 * np.abs(right).max()


@pytest.mark.parametrize("kind", VALUES)
def test_certified(kind: str) -> None:
    found = outcome("two_mass", OBSERVERS["two_mass", "gto"], ENVELOPES["two_mass"], entry(kind))
    assert isinstance(found, Certificate), found


@pytest.mark.parametrize("kind", VALUES)
def test_the_code_has_it(kind: str, tmp_path: Path) -> None:
    """C and Python agree, and differ from the code without the effect but for a load that no observer sees."""
    rows = np.random.default_rng(3).normal(size=(200, 3)) * [0.02, 0.02, 15.0]
    rows[:, :2] = rows[:, :2].cumsum(axis=0) / 20

    def built(effects: str) -> Built:
        folder = tmp_path / str(len(effects))
        folder.mkdir()
        text = f"observer: {OBSERVERS['two_mass', 'gcfo']}\nenvelope: {ENVELOPES['two_mass']}\neffects: {effects}\n"
        return Built(folder, TEXTS["two_mass"] + text)

    code = built(entry(kind))
    (c, _), (python, _) = code.c_run(rows), code.python_run(rows)
    np.testing.assert_allclose(c, python, rtol=1e-9, atol=1e-9)
    seen = np.abs(c - built("[]").c_run(rows)[0]).max() > 1e-6
    assert seen == (kind not in ("soft", "creeping"))
