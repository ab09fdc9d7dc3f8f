"""Figures of docs/data_emps.md: closed loop and long open loop on the two EMPS records; skips where they are absent.

All parameters come from the training record alone, but for the last table, which shows how the two records differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.optimize import least_squares

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.models import with_effects, with_values
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.shooting import Record, Shooter
from codegen.diagnosis.signals import smooth_motion
from codegen.diagnosis.trial import Runner, Trial, part_of
from codegen.effects import CATALOGUE
from codegen.logs import Log, read_log
from codegen.mechanics import System, build_system
from codegen.simulate.plant import Plant
from codegen.spec import Spec, read_spec

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data" / "emps"
RECORDS = {"training": "DATA_EMPS.mat", "test": "DATA_EMPS_PULSES.mat"}
LIMIT_V, SUBSTEPS = 10.0, 4
LENGTHS_S = (0.5, 2.0, 6.0, 12.0, None)
"""Segments that a long fit goes through, each starting from the last; None is the whole record."""
STARTS: dict[str, dict[str, float]] = {
    "viscous_asymmetry": {"d_b": -35.0},
    "presliding": {"sigma": 1e6},
    "stribeck": {"delta": 3.0, "v_s": 0.02},
    "quadratic_drag": {"c": 1.0},
    "hardening_spring": {"k3": 1.0},
    "position_dependent_friction": {"amplitude": 0.5, "period": 0.25, "phase": 0.0},
}
BY_DIRECTION = ("viscous_asymmetry",)
STRUCTURES = (
    (),
    BY_DIRECTION,
    (*BY_DIRECTION, "stribeck"),
    (*BY_DIRECTION, "presliding"),
    (*BY_DIRECTION, "presliding", "quadratic_drag"),
    (*BY_DIRECTION, "presliding", "hardening_spring"),
    (*BY_DIRECTION, "presliding", "position_dependent_friction"),
)


def closed_loop(system: System, record: str) -> tuple[float, float]:
    """Errors of position and motor force in %, norm over norm, with the drive's own cascade around the model.

    The drive multiplies the error of speed by kv, and the error of position by kp to get its reference; it makes the
    speed from two neighbouring samples. The reference and the pulses, in volts, are the record's; nothing else is.
    """
    d = {name: np.ravel(v) for name, v in loadmat(DATA / RECORDS[record]).items() if not name.startswith("__")}
    pulses, (kp,), (kv,) = d.get("pulses_N", np.zeros_like(d["t"])), d["kp"], d["kv"]
    h = float(np.median(np.diff(d["t"])))
    plant = Plant(system, SUBSTEPS)
    state = plant.start(d["qm"][:1], np.zeros(1))[0]
    before, motion = state[0], np.empty((len(d["t"]), 2))
    for k, now in enumerate(d["t"]):
        x = state[0]
        u = float(np.clip(kv * (kp * (d["qg"][k] - x) - (x - before) / h) + pulses[k], -LIMIT_V, LIMIT_V))
        before, motion[k] = x, (x, u)
        drive = np.concatenate([[now, h / SUBSTEPS], np.full(SUBSTEPS, u)])
        state = plant.sample(state, drive)[0].full().ravel()
    measured = np.column_stack([d["qm"], d["vir"]])
    position, force = 100 * np.linalg.norm(measured - motion, axis=0) / np.linalg.norm(measured, axis=0)
    return float(position), float(force)


@dataclass(frozen=True, eq=False)
class Rig:
    """The spec and the records, and free runs over them.

    Attributes:
        logs: training and test.
    """

    spec: Spec
    system: System
    logs: dict[str, Log]

    def trial(self, kinds: tuple[str, ...]) -> Trial:
        """Level, mass, viscous coefficient, offset, and these effects."""
        by_name = {s.name: s for s in self.system.values}
        trial = Trial(self.system, (), tuple(by_name[n] for n in ("rail_a", "M", "Fv", "offset")))
        for kind in kinds:
            trial = trial.with_part(part_of(CATALOGUE[kind], 0, self.system))
        return trial

    def record(self, name: str, first: float = 0.0, last: float = 1.0, seconds: float | None = None) -> Record:
        """A share of a record in segments of so many seconds, or in one."""
        m = smooth_motion(self.logs[name])
        start, stop = round(first * len(m.time)), round(last * len(m.time))
        length = stop - start if seconds is None else round(seconds / m.sample_time)
        starts = np.arange(start, stop - length + 1, length, dtype=np.int32)
        one = np.ones(1)
        return Record(m.measured, m.positions, m.velocities, m.commands, m.sample_time, 0.0, one, starts, length)

    def error(self, trial: Trial, theta: Array, record: Record) -> Array:
        """(S, L) predicted less measured position, mm; 1 m where a run diverges."""
        runner = Runner(trial, Shooter([trial.changed], [trial.free]), 0, record, SUBSTEPS)
        predicted = runner.run(theta, np.zeros((len(record.start), 2)))[:, :, 0]
        measured = np.stack([record.measured[s : s + record.length, 0] for s in record.start])
        return np.asarray(1e3 * np.nan_to_num(predicted - measured, nan=1.0, posinf=1.0, neginf=1.0))

    def fit(self, trial: Trial, theta: Array, record: Record) -> Array:
        """Least squares of the position error over every tenth sample."""
        scale = np.maximum(np.abs(theta), 1e-3)
        runner = Runner(trial, Shooter([trial.changed], [trial.free]), 0, record, SUBSTEPS)
        measured = np.stack([record.measured[s : s + record.length, 0] for s in record.start])
        still = np.zeros((len(record.start), 2))

        def residual(z: Array) -> Array:
            error = runner.run(z * scale, still)[:, ::10, 0] - measured[:, ::10]
            return np.asarray(1e3 * np.nan_to_num(error, nan=1.0, posinf=1.0, neginf=1.0).ravel())

        return np.asarray(least_squares(residual, theta / scale, diff_step=1e-5, max_nfev=60).x * scale)

    def fitted(self, kinds: tuple[str, ...]) -> tuple[Trial, Array]:
        """To the training record, over longer and longer runs."""
        trial = self.trial(kinds)
        theta = trial.theta(np.array([float(self.system.values[s]) for s in trial.moved]), [STARTS[k] for k in kinds])
        for seconds in LENGTHS_S:
            theta = self.fit(trial, theta, self.record("training", seconds=seconds))
        return trial, theta

    def halves(self, trial: Trial, theta: Array) -> float:
        """RMS error in mm on each half of the training record, fitted to the other."""
        halves = [self.record("training", 0.0, 0.5), self.record("training", 0.5, 1.0)]
        errors = [self.error(trial, self.fit(trial, theta, a), b) for a, b in (halves, halves[::-1])]
        return rms(np.concatenate([e.ravel() for e in errors]))

    def model(self, trial: Trial, theta: Array) -> System:
        """The system with a fit's values."""
        moved, found = trial.split(theta)
        effects = [FoundEffect(p.kind, p.on, v, {}) for p, v in zip(trial.parts, found, strict=True)]
        return with_effects(with_values(self.system, named(trial, moved)), effects)


def named(trial: Trial, moved: Array) -> dict[str, float]:
    """Values of what every fit moves, by name."""
    return {s.name: float(v) for s, v in zip(trial.moved, moved, strict=True)}


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    if not DATA.is_dir():
        print(f"emps: {DATA} is not here; nothing to run")
        return
    spec = read_spec(ROOT / "specs" / "emps.yaml")
    system = build_system(spec)
    rig = Rig(spec, system, {name: read_log(DATA / file, spec) for name, file in RECORDS.items()})
    found = diagnose_log(spec, system, rig.logs["training"], rig.logs["test"])[1].augmented
    published = {"M": 95.154, "Fv": 203.5649, "rail_a": 20.38585, "offset": -0.24185}
    asymmetry = FoundEffect("viscous_asymmetry", "rail", {"d_b": -36.85875}, {})
    models = {
        "published, symmetric": system,
        "published, by direction": with_effects(with_values(system, published), [asymmetry]),
        "found by the diagnosis": found,
    }
    print("open loop over a whole record, mm: training, test, halves of the training record by each other")
    for kinds in STRUCTURES:
        trial, theta = rig.fitted(kinds)
        whole = {name: rms(rig.error(trial, theta, rig.record(name))) for name in RECORDS}
        print(f"  {len(theta)} {kinds}: {whole} halves {rig.halves(trial, theta):.2f}", flush=True)
        if kinds in (BY_DIRECTION, (*BY_DIRECTION, "presliding")):
            models[f"long free run, {' + '.join(kinds)}"] = rig.model(trial, theta)
            other = rig.fit(trial, theta, rig.record("test"))
            for name, values in (("training", theta), ("test", other)):
                errors = {r: round(rms(rig.error(trial, values, rig.record(r))), 2) for r in RECORDS}
                moved, effects = trial.split(values)
                print(f"    fitted to the {name} record: {errors} {named(trial, moved)} {effects}", flush=True)
    print("closed loop, %: position and force on the training record, on the test record")
    for name, model in models.items():
        print(f"  {name}: {[tuple(round(e, 4) for e in closed_loop(model, record)) for record in RECORDS]}", flush=True)


if __name__ == "__main__":
    main()
