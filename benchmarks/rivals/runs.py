"""Held-out errors of one log by every rival, measured with one ruler and kept."""

from __future__ import annotations

import json
import math
import os
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from benchmarks.practice.fresh import environment_with, run_tool
from benchmarks.practice.runs import code_version
from benchmarks.rivals.axis import axis_of
from benchmarks.rivals.logs import Pair
from codegen.base.files import write_atomically
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.measure import measure
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.verdict.proposal import propose_terms
from codegen.mechanics import System

HERE = Path(__file__).parent
RUN_S = 1.0
"""Of the runs that mujoco.sysid fits."""


@dataclass(frozen=True)
class Answer:
    """The result of mujoco.sysid on a training log.

    Attributes:
        values: parameters of the spec. at_bound: those that end at a bound.
        before, after: RMSE of its runs, declared and fitted, SI.
        seconds: of processor time. version: of MuJoCo.
    """

    values: dict[str, float]
    at_bound: tuple[str, ...]
    before: float
    after: float
    seconds: float
    version: str


@dataclass(frozen=True)
class Errors:
    """The errors of one model on the test log.

    Attributes:
        force: residual force over drive force. position: RMSE of free runs, SI; None where the model has no free run.
    """

    force: float
    position: float | None


@dataclass(frozen=True)
class Compared:
    """All models on one log.

    Attributes:
        verdict, named: of the diagnosis. code: version of what made it.
        answer: of mujoco.sysid. terms: of PySINDy's sum.
    """

    declared: Errors
    mujoco: Errors
    refit: Errors
    pysindy: Errors
    augmented: Errors
    verdict: str
    named: tuple[str, ...]
    answer: Answer
    terms: tuple[str, ...]
    code: str


ADAPTER: TypeAdapter[Compared] = TypeAdapter(Compared)


def is_kept(pair: Pair, out: Path) -> bool:
    """Whether a log was compared already."""
    return _kept(pair, out).exists()


def compared(pair: Pair, out: Path, again: bool) -> Compared:
    """Every rival on one log; what is there already is read, unless ``again``."""
    kept = _kept(pair, out)
    if again or not kept.exists():
        write_atomically(kept, json.dumps(asdict(_compare(pair, out)), indent=1))
    return ADAPTER.validate_json(kept.read_bytes())


def _compare(pair: Pair, out: Path) -> Compared:
    spec, system, log, test = pair.read()
    said, models = diagnose_log(spec, system, log, test)
    judge, window = models.test, models.window
    answer = mujoco_answer(system, spec.name, models.train.motion, out)
    found = measure(with_values(system, answer.values), judge.motion, judge.used, window)
    sums = propose_terms(models.refit, models.train, judge, window)[0]
    left = 1.0 if math.isnan(sums.held_out_share) else 1 - sums.held_out_share
    declared, own, augmented = (
        Errors(e.relative_force, e.free_run_rmse) for e in (said.declared, said.refit, said.augmented)
    )
    return Compared(
        declared=declared,
        mujoco=Errors(found.relative_force, found.free_run_rmse),
        refit=own,
        pysindy=Errors(own.force * math.sqrt(max(left, 0.0)), None),
        augmented=augmented,
        verdict=said.verdict,
        named=tuple(e.kind for e in said.effects),
        answer=answer,
        terms=tuple(sums.terms),
        code=code_version(),
    )


def _kept(pair: Pair, out: Path) -> Path:
    return out / pair.title.replace("/", "_") / "compared.json"


def mujoco_answer(system: System, name: str, motion: Motion, out: Path) -> Answer:
    """Parameters of the spec as mujoco.sysid fits them to runs of ``RUN_S`` over a training log.

    Args:
        name: of the spec. out: folder below which MuJoCo's environment is made.

    Raises:
        Unavailable: where MuJoCo cannot be had, or fails.
    """
    axis = axis_of(system, name)
    assert axis is not None  # as the sample has it
    python = environment_with(HERE / "requirements.txt", out / "mujoco_environment")
    length = round(RUN_S / motion.sample_time)
    starts = np.arange(length, len(motion.time) - 2 * length, length)
    clean = [s for s in starts if motion.usable[s : s + length].all()]
    task = axis.task(system) | {"sample_time": motion.sample_time, "length": length}
    columns = {"measured": motion.measured, "position": motion.positions, "velocity": motion.velocities}
    with tempfile.TemporaryDirectory() as folder:
        task_file, log_file = Path(folder) / "task.json", Path(folder) / "log.npz"
        task_file.write_text(json.dumps(task))
        arrays = {word: values[:, 0] for word, values in columns.items()}
        np.savez(log_file, **arrays, command=motion.commands[:, 0], starts=np.array(clean, dtype=int))
        before = os.times()
        said = run_tool(
            [str(python), str(HERE / "mujoco_fit.py"), str(task_file), str(log_file)], "mujoco.sysid failed"
        )
        after = os.times()
    told = json.loads(said.splitlines()[-1])
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    return Answer(
        values=axis.refitted(told["values"]),
        at_bound=axis.at_bound(system, told["values"]),
        before=told["rms_before"],
        after=told["rms_after"],
        seconds=round(seconds, 1),
        version=told["version"],
    )
