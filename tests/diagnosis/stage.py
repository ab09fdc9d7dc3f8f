"""A stage on a rail as a spec, with effects put in or left out, and its simulated log."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch
from zlib import compress, decompress

import pytest

from codegen.base.compiler import cached
from codegen.diagnosis.diagnose import Models, diagnose_log
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import Diagnosis
from codegen.diagnosis.selection import force_fits, forward_selection, parsimony
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.effects.declare import add_declared_effects
from codegen.effects.register import is_own
from codegen.logs import Log, read_log
from codegen.mechanics import System, build_system
from codegen.simulate import plant as stepper
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.simulate.plant import LONGEST_SUBSTEP
from codegen.spec import Spec, parse_spec
from tests.slow_cases import slow_except

STAGE = """\
# a stage
name: stage
coordinates:
  x: {{velocity: v, unit: m}}     # along the rail
inputs:
  w: {{unit: N}}
parameters:
  m: {{value: 2, unit: kg}}
  b: {{value: 6, unit: N*s/m}}
mass_matrix: [[m]]
force: [w - b*v]
friction:
  distribution: [[1]]
  contacts:
    - {{name: rail, law: coulomb, a: {level}, unit: N}}   # from the data sheet
effects: {effects} # what diagnosis adds
simulation:
  duration: {duration}
  sample_time: 0.002
  reference: {{x: "{reference}"}}
  position_gain: {{w: 900}}
  velocity_gain: {{w: 30}}
  encoder_step: {{x: 2e-6}}
  position_noise: {{x: {noise}}}
"""
CROSS = """\
name: cross
coordinates:
  x: {velocity: v, unit: m}
  y: {velocity: u, unit: m}
inputs:
  w: {unit: N}
  z: {unit: N}
parameters:
  m: {value: 2, unit: kg}
mass_matrix: [[m, 0], [0, m]]
force: [w, z]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 4, unit: N}
    - {name: beam, law: coulomb, a: 3, unit: N}
simulation:
  duration: 16
  sample_time: 0.002
  reference:
    x: "0.2*sin(2*pi*0.23*t) + 0.06*sin(2*pi*0.71*t)"
    y: "0.15*sin(2*pi*0.31*t + 1) + 0.07*sin(2*pi*0.57*t)"
  position_gain: {w: 900, z: 900}
  velocity_gain: {w: 30, z: 30}
  encoder_step: {x: 2e-6, y: 2e-6}
"""
"""Two axes without coupling."""
TRAIN = "0.2*sin(2*pi*0.4*t) + 0.06*sin(2*pi*1.1*t)"
RESTS = "0.1*tanh(8*sin(2*pi*0.31*t)) + 0.07*tanh(8*sin(2*pi*0.13*t + 1)) + 0.05*tanh(8*sin(2*pi*0.083*t + 2))"
"""Moves with rests."""
TEST = "0.15*sin(2*pi*0.55*t + 1) + 0.1*sin(2*pi*0.23*t)"


def stage(
    effects: str = "[]", level: float = 4.0, reference: str = TRAIN, duration: float = 14.0, noise: float = 0.0
) -> Spec:
    text = STAGE.format(effects=effects, level=level, reference=reference, duration=duration, noise=noise)
    return parse_spec(text, Path("stage.yaml"))


def system_of(spec: Spec) -> System:
    return add_declared_effects(build_system(spec), spec)


ROOT = Path(__file__).parents[2]
COARSE_S = 4e-4
"""Longest substep of a machine of several coordinates, in place of 0.1 ms: a third of the time, and positions that
differ by 2e-6 of the motion.
"""


def log_of(plant: Spec, folder: Path, name: str, fine: bool = False) -> Log:
    """What the plant of a spec would have logged; the same text is simulated once.

    It is kept between sessions, like compiled code, as long as nothing that simulates has changed.

    Args:
        fine: by steps as short as the product's, also with several coordinates.
    """
    longest = LONGEST_SUBSTEP if fine or len(plant.positions) == 1 else COARSE_S

    def made() -> bytes:
        with TemporaryDirectory() as scratch, patch.object(stepper, "LONGEST_SUBSTEP", longest):
            path = Path(scratch) / "log.csv"
            write_log(path, plant, simulate(plant, system_of(plant)))
            return compress(path.read_bytes(), 1)

    asked = (plant.sha256, str(longest))
    if asked not in _logged:
        own = any(is_own(effect.kind) for effect in plant.effects)  # by code that is not in the key
        _logged[asked] = decompress(made() if own else cached(["a test's log", *_what_simulates(), *asked], made))
    path = folder / name
    path.write_bytes(_logged[asked])
    return read_log(path, plant)


@cache
def _what_simulates() -> tuple[str, ...]:
    """Hash of all modules and templates but those that no simulation imports, and versions of the libraries."""
    after = ("app", "diagnosis", "export", "report", "thesis")
    files = [p for folder in ("codegen", "templates") for p in sorted((ROOT / folder).rglob("*.*"))]
    read = [p.read_bytes() for p in files if p.suffix != ".pyc" and p.relative_to(ROOT).parts[1] not in after]
    return (sha256(b"".join(read)).hexdigest(), sys.version, *map(version, ("casadi", "numpy", "sympy")))


_logged: dict[tuple[str, str], bytes] = {}
"""Hash of a spec and longest substep → its log."""


def diagnosed(
    effects: str,
    folder: Path,
    level: float = 4.5,
    reference: str = TRAIN,
    noise: float = 0.0,
    kinds: Sequence[str] = (),
) -> tuple[Diagnosis, Models]:
    """Diagnose logs of a plant with these effects and level, against a spec that says 4 and no effect; each once.

    Args:
        kinds: of the candidates; all by default.
    """
    train = log_of(stage(effects, level, reference, noise=noise), folder, "train.csv")
    test = log_of(stage(effects, level, TEST, 10.0, noise), folder, "test.csv")
    asked = (effects, level, reference, noise, *kinds)
    if asked not in _diagnosed:
        spec = stage()
        with among(*kinds):
            _diagnosed[asked] = diagnose_log(spec, system_of(spec), train, test)
    return _diagnosed[asked]


_diagnosed: dict[tuple[str | float, ...], tuple[Diagnosis, Models]] = {}
"""By what was asked for."""


@contextmanager
def among(*kinds: str) -> Iterator[None]:
    """Only effects of these kinds are candidates, or all without any: for tests of what is said, not of the choice."""

    def few(search: Search, taken: Sequence[Part]) -> list[Part]:
        return [part for part in every_part(search, taken) if not kinds or part.kind in kinds]

    with ExitStack() as patched:
        for asking in (forward_selection, parsimony, force_fits):
            patched.enter_context(patch.object(asking, "every_part", few))
        yield


def competing(*kinds: str) -> pytest.MarkDecorator:
    """The argument ``kinds`` of a test, for ``among``: these in `make test`, all in check-all."""
    return pytest.mark.parametrize(
        "kinds", slow_except([(), kinds], [kinds]), ids=lambda kinds: "few" if kinds else "all"
    )
