"""A subclass of any shipped effect under another name, given by a file, is to a diagnosis what its parent is.

No stage may know an effect by its kind: what it must know is derived from the class.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import codegen.diagnosis
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.starting_values import best_starts, starting_points
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits, every_part
from codegen.diagnosis.selection.refusals import admissible, relative_size
from codegen.effects import CATALOGUE
from codegen.effects.declare import add_declared_effects, places_of
from codegen.effects.register import load_effects
from codegen.mechanics import System, build_system
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import log_of, stage, system_of
from tests.expected_errors import refused

SHIPPED = tuple(CATALOGUE)
HEIR = "own_"
JOINTS = """\
name: joints
coordinates:
  a: {{velocity: va, unit: rad}}
  b: {{velocity: vb, unit: rad}}
inputs: {{p: {{unit: N*m}}, q: {{unit: N*m}}}}
parameters: {{m: {{value: 2, unit: kg*m^2}}}}
mass_matrix: [[m, 0], [0, m]]
force: [p, q]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {{name: hub, law: coulomb, a: {level}, unit: N*m}}
    - {{name: elbow, law: coulomb, a: {level}, unit: N*m}}
effects: {effects}
simulation:
  duration: 8
  sample_time: 0.004
  reference: {{a: "0.4*sin(2.5*t) + 0.1*sin(7*t)", b: "0.3*sin(3.1*t)"}}
  position_gain: {{p: 900, q: 900}}
  velocity_gain: {{p: 30, q: 30}}
  encoder_step: {{a: 2e-6, b: 2e-6}}
"""


@pytest.fixture(autouse=True)
def catalogue_as_it_was() -> Iterator[None]:
    before = dict(CATALOGUE)
    yield
    CATALOGUE.clear()
    CATALOGUE.update(before)


def give_heirs(folder: Path, *kinds: str) -> None:
    """A file as a user would write it, with a bare subclass of each of these kinds."""
    lines = []
    for kind in kinds:
        parent = type(CATALOGUE[kind])
        name = parent.__qualname__
        lines += [f"from {parent.__module__} import {name}", f"class Own{name}({name}):", f"    kind = '{HEIR}{kind}'"]
    lines.append(f"EFFECTS = [{', '.join(f'Own{type(CATALOGUE[kind]).__qualname__}()' for kind in kinds)}]")
    path = folder / "heirs.py"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    load_effects(path)


def joints(effects: str = "[]", level: float = 4.0) -> Spec:
    return parse_spec(JOINTS.format(effects=effects, level=level), Path("joints.yaml"))


def test_no_kind_is_named_in_the_diagnosis() -> None:
    folder = Path(codegen.diagnosis.__file__).parent
    named = {
        (path.name, node.lineno, node.value)
        for path in folder.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in SHIPPED
    }
    assert not named


@dataclass(frozen=True)
class Bench:
    """Every kind at its first place, tried beside one refit."""

    system: System
    attempts: dict[str, CandidateFits]
    """By the start of the kinds' names: those shipped, and their heirs."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    before = dict(CATALOGUE)
    folder = tmp_path_factory.mktemp("joints")
    plant = joints("[{kind: cogging, on: a, parameters: {amplitude: 1, period: 0.3, phase: 0.4}}]", 4.4)
    log = log_of(plant, folder, "log.csv")
    system = build_system(joints())
    motion = smooth_motion(log)
    search = search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share))
    base = search.refit()
    shipped = [first_part(kind, system) for kind in SHIPPED]
    give_heirs(folder, *SHIPPED)
    heirs = [first_part(HEIR + kind, system) for kind in SHIPPED]
    tried = {start: CandidateFits(search, base, tuple(parts)) for start, parts in (("", shipped), (HEIR, heirs))}
    for attempt in tried.values():
        attempt.couplings[0] = {"k": 3000.0, "c": 4.0, "load_fraction": 0.4}
    CATALOGUE.clear()
    CATALOGUE.update(before)
    return Bench(system, tried)


def first_part(kind: str, system: System) -> Part:
    effect = CATALOGUE[kind]
    place = next(k for k in range(len(places_of(effect, system))) if effect.applies(system, k))
    return part_of(effect, place, system)


@pytest.mark.parametrize("kind", SHIPPED)
def test_an_heir_is_fitted_as_its_parent(kind: str, bench: Bench, tmp_path: Path) -> None:
    """The same starts, the same predictions, the same weight, the same values admitted."""
    give_heirs(tmp_path, *SHIPPED)
    found: dict[str, Any] = {}
    for start, attempt in bench.attempts.items():
        k = next(k for k, part in enumerate(attempt.parts) if part.kind == start + kind)
        part, few = attempt.parts[k], attempt._base_on_few(k)
        runner = replace(attempt.runners[k], record=few.runner.record)
        noise = attempt.search.record.noise
        covered = attempt.survey.covered(part, attempt.levels, noise, attempt.couplings.get(part.place))
        assert part.kind == start + kind
        shapes = part.effect.starts(covered)
        (cost, theta), *others = best_starts(starting_points(runner, few, covered, shapes), 3)
        run = runner.run(theta, few.offsets)
        moved = runner.run(theta + 0.01 * np.eye(len(theta))[-1], few.offsets)
        assert np.abs(moved - run).max() > 0, "nothing depends on the last parameter"
        fit = attempt.search.fit_from(runner, theta, few, 1)
        one, prior = fit, attempt.search.prior(attempt.trials[k], theta)
        found[start] = {
            "starts": [cost, *theta, *(v for pair in others for v in (pair[0], *pair[1]))],
            "run": run,
            "fit": fit.theta,
            "sizes": np.concatenate([prior.size, prior.reach]),
            "values": list(one.parameters.values()),
            "weight": relative_size(attempt.search, one, few),
            "judged": (admissible(attempt.search.system, one), one.trial.adds_states, part.effect.rough),
            "unseen": part.effect.unseen(one.parameters, 1.0),
        }
    assert found[""].pop("judged") == found[HEIR].pop("judged") and found[""].pop("unseen") == found[HEIR].pop("unseen")
    for name, value in found[""].items():  # the order of the terms in a sum follows the names of their symbols
        np.testing.assert_allclose(found[HEIR][name], value, rtol=1e-8, atol=1e-12, err_msg=name)


def test_heirs_are_tried_in_the_place_of_their_parents(bench: Bench, tmp_path: Path) -> None:
    search = bench.attempts[""].search
    before = [(p.kind, p.on) for p in every_part(search, ())]
    give_heirs(tmp_path, "input_delay", "backlash", "viscous")
    renamed = [(HEIR + kind if kind in ("input_delay", "backlash", "viscous") else kind, on) for kind, on in before]
    assert sorted((p.kind, p.on) for p in every_part(search, ())) == sorted(renamed)
    # What stands at a place takes it from every effect of that class, and a second load behind a spring from both.
    taken = [first_part(HEIR + "backlash", search.system)]
    left = {(p.kind, p.on) for p in every_part(search, taken)}
    assert not left & {(kind, "a") for kind in ("backlash", "compliance", HEIR + "backlash")}
    assert (HEIR + "viscous", "hub") in left


INERT = """
from codegen.effects.on_input import InputDelay
from codegen.effects import EffectParameter
class Lost(InputDelay):
    kind = "lost"
    parameters = (*InputDelay.parameters, EffectParameter("jitter", "s", "on which nothing depends", low=0.0))
EFFECTS = [Lost()]
"""


def test_a_parameter_on_which_nothing_depends_is_refused(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "lost.py"
    path.write_text(INERT, encoding="utf-8")
    load_effects(path)
    with refused("SPEC021 lost p `jitter`"):
        every_part(bench.attempts[""].search, ())
    spec = joints("[{kind: lost, on: p, parameters: {T: 0.01, jitter: 0.001}}]")
    with refused("SPEC021 `jitter` lost"):
        add_declared_effects(build_system(spec), spec)


VALUES = {
    "viscous": "b: 6",
    "quadratic_drag": "c: 12",
    "stribeck": "delta: 2, v_s: 0.05",
    "offset": "f0: 1.5",
    "coulomb_asymmetry": "d: 1",
    "position_dependent_friction": "amplitude: 1.5, period: 0.09, phase: 0.4",
    "load_dependent_friction": "mu: 0.2",
    "presliding": "sigma: 4000",
    "friction_drift": "delta: 2.5, T: 4",
    "cogging": "amplitude: 2, period: 0.07, phase: 0.4",
    "input_gain": "gain: 1.2",
    "input_delay": "T: 0.012",
    "actuator_lag": "tau: 0.02",
    "dead_zone": "width: 1",
    "saturation": "limit: 7",
    "compliance": "k: 4000, c: 4, load_fraction: 0.4",
    "backlash": "gap: 1e-3, k: 20000, c: 20, load_fraction: 0.4",
    "inertia_error": "delta: 0.6",
    "gravity_imbalance": "G: 3, phase: 0.5",
    "spring": "k: 40",
    "hardening_spring": "k3: 900",
    "coupling": "c: 8",
    "encoder_eccentricity": "amplitude: 4e-4, period: 0.08, phase: 0.3",
    "viscous_asymmetry": "d_b: 3",
    "cogging_harmonics": "period: 0.07, sin_1: 1.2, cos_1: -0.5, sin_3: 0.1, cos_3: 0.9",
    "drive_backdrive_friction": "mu_drive: 0.1, mu_back: 0.3",
}
ON = {"contact": "rail", "coordinate": "x", "axis": "x", "sensor": "x", "input": "w"}


def told(kind: str, folder: Path) -> dict[str, Any]:
    """What a diagnosis says of a log made with an effect of this kind, with heirs under the names of their parents."""
    effect = CATALOGUE[kind]
    alone = kind in ("gravity_imbalance", "coupling")
    on = "[a, b]" if kind == "coupling" else "a" if alone else ON[effect.sits_on]
    entry = f"[{{kind: {kind}, on: {on}, parameters: {{{VALUES[kind]}}}}}]"
    plant, spec = (joints(entry, 4.4), joints()) if alone else (stage(entry, 4.5), stage())
    found = diagnose_log(spec, system_of(spec), log_of(plant, folder, "log.csv"))[0].as_json()
    own = [c["kind"] for c in found["candidates"] if c["own"]]
    assert all(k.startswith(HEIR) for k in own)
    effects = [e | {"kind": e["kind"].removeprefix(HEIR)} for e in found["effects"]]
    return {
        "verdict": found["verdict"],
        "effects": effects,
        "values": found["values"],
        "error": found["error"],
        "named": [e["kind"] for e in found["effects"]],
    }


def as_its_parent(kind: str, folder: Path) -> None:
    parent = told(kind, folder)
    give_heirs(folder, kind)
    heir = told(kind, folder)
    named = [HEIR + k if k == kind else k for k in parent.pop("named")]
    assert heir.pop("named") == named and heir["verdict"] == parent["verdict"]
    for path, value in leaves(parent).items():
        same = leaves(heir)[path]
        assert same == (value if isinstance(value, str | None) else pytest.approx(value, rel=1e-4)), path


def leaves(tree: Any, path: str = "") -> dict[str, Any]:
    """What stands at the ends of nested dictionaries and lists, by its path."""
    if not isinstance(tree, dict | list):
        return {path: tree}
    branches = tree.items() if isinstance(tree, dict) else enumerate(tree)
    return {p: leaf for name, branch in branches for p, leaf in leaves(branch, f"{path}/{name}").items()}


@pytest.mark.slow
def test_a_late_input_under_another_name_is_found(tmp_path: Path) -> None:
    parent = told("input_delay", tmp_path)
    assert (parent["verdict"], parent["named"]) == ("effect", ["input_delay"])
    as_its_parent("input_delay", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", SHIPPED)
def test_the_diagnosis_of_an_heir_is_its_parent_s(kind: str, tmp_path: Path) -> None:
    as_its_parent(kind, tmp_path)
