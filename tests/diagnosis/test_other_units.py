"""A machine in other units has the same diagnosis: steps of differences follow the units of their parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.results import Diagnosis
from codegen.logs import Log, read_log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, among, log_of, stage, system_of
from tests.diagnosis.test_adoption import search_of

FORCE, LENGTH = 2.0**-20, 2.0**20
"""Powers of two, so that every number of the machine is exact in both units."""
SPRING = "[{kind: spring, on: x, parameters: {k: 4}}]"
FACTORS = {
    "spring": {"k": FORCE / LENGTH},
    "offset": {"f0": FORCE},
    "viscous": {"b": FORCE / LENGTH},
    "inertia_error": {"delta": FORCE / LENGTH},
    "hardening_spring": {"k3": FORCE / LENGTH**3},
    "quadratic_drag": {"c": FORCE / LENGTH**2},
}
"""Of the parameters of each candidate, in the other units."""


def in_units(force: float, length: float) -> Spec:
    """The stage, with a tolerance on its mass, in units in which forces and positions have these factors."""
    text = STAGE.format(effects="[]", level=4.0, reference=TRAIN, duration=14, noise=0.0).split("simulation:")[0]
    mass = force / length
    changes = {
        "value: 2, unit: kg": f"value: {2 * mass!r}, unit: kg, tolerance: 5%",
        "value: 6,": f"value: {6 * mass!r},",
        "a: 4.0,": f"a: {4 * force!r},",
    }
    for old, new in changes.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    return parse_spec(text, Path("stage.yaml"))


def logged_in(folder: Path, name: str, spec: Spec, force: float, length: float) -> Log:
    """A log of the stage with the spring, each column times the factor of its unit."""
    heading, *lines = (folder / name).read_text().splitlines()
    rows = np.array([[float(v) for v in line.split(",")] for line in lines])
    factors = {"x": length, "v": length, "w": force}
    rows *= [factors.get(column, 1.0) for column in heading.split(",")]
    path = folder / f"in_{force!r}_{name}"
    path.write_text("\n".join([heading, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n")
    return read_log(path, spec)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> list[Diagnosis]:
    folder = tmp_path_factory.mktemp("logs")
    log_of(stage(SPRING, 4.5, TRAIN, noise=2e-6), folder, "train.csv")
    log_of(stage(SPRING, 4.5, TEST, 10.0, noise=2e-6), folder, "test.csv")
    found = []
    for units in ((1.0, 1.0), (FORCE, LENGTH)):
        spec = in_units(*units)
        logs = [logged_in(folder, name, spec, *units) for name in ("train.csv", "test.csv")]
        with among(*FACTORS):
            found.append(diagnose_log(spec, system_of(spec), *logs)[0])
    return found


def test_verdict_and_numbers_are_the_same_in_other_units(both: list[Diagnosis]) -> None:
    """Of candidates that are hardly there, steps in SI units gave other numbers: an inertia of the other sign."""
    one, other = both
    assert one.verdict == other.verdict == "effect"
    assert [e.kind for e in one.effects] == [e.kind for e in other.effects] == ["spring"]
    beside = {c.kind: c for c in other.candidates}
    assert {c.kind for c in one.candidates} == beside.keys()
    assert beside.keys() >= {"spring", "viscous", "inertia_error", "hardening_spring"}
    for candidate in one.candidates:
        factors, there = FACTORS[candidate.kind], beside[candidate.kind]
        assert there.gain == pytest.approx(candidate.gain, abs=1e-6)
        for name, value in candidate.parameters.items():
            assert there.parameters[name] / factors[name] == pytest.approx(value, rel=1e-5), candidate.kind
    (effect,), (again,) = one.effects, other.effects
    low, high = again.intervals["k"]
    assert (low * LENGTH / FORCE, high * LENGTH / FORCE) == pytest.approx(effect.intervals["k"], rel=1e-6)
    for name, factor in (("rail_a", FORCE), ("m", FORCE / LENGTH)):
        assert np.array(other.refitted[name]) / factor == pytest.approx(one.refitted[name], rel=1e-6)


def test_a_level_at_zero_has_the_step_of_its_declared_value(tmp_path: Path) -> None:
    search: Search = search_of(stage(), log_of(stage(), tmp_path, "train.csv"))
    prior = search.prior(search.declared_trial, 0 * search.declared)
    assert prior.differenced == pytest.approx(1e-3 * search.declared)


def test_a_level_declared_as_zero_has_the_step_of_the_drive(tmp_path: Path) -> None:
    """No declared value, no tolerance and no start tell its size; the drive force does, in whatever unit."""
    log = log_of(stage(), tmp_path, "train.csv")
    search = search_of(stage(level=0.0), log)
    force = float(np.sqrt(np.mean(search.motion.inputs[search.motion.usable] ** 2)))
    prior = search.prior(search.declared_trial, 0 * search.declared)
    assert prior.differenced == pytest.approx([1e-3 * force], rel=0.2)
