"""The drive's own cascade around each model: ``python -m benchmarks.emps.closed_loop``.

Prints the table of docs/data_emps.md: position and force errors on both records, all parameters from the training one.
"""

from __future__ import annotations

import numpy as np
from scipy.io import loadmat

from benchmarks.emps.choice import candidates
from benchmarks.emps.models import BY_DIRECTION, Model
from benchmarks.emps.records import DATA, RECORDS, ROOT, read
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.trial import with_effects, with_values
from codegen.diagnosis.results import FoundEffect
from codegen.logs import read_log
from codegen.mechanics import System, build_system
from codegen.simulate.plant import Plant
from codegen.spec import read_spec

LIMIT_V, SUBSTEPS = 10.0, 4


def closed_loop(system: System, record: str) -> tuple[float, float]:
    """Errors of position and motor force in %, norm over norm, with the drive's own cascade around the model.

    The drive multiplies the error of speed by kv, and the error of position by kp to get its reference; it makes the
    speed from two neighbouring samples. The reference and the pulses, in volts, are the record's; nothing else is.
    """
    d = {name: np.ravel(v) for name, v in loadmat(DATA / RECORDS[record]).items() if not name.startswith("__")}
    pulses, (kp,), (kv,) = d.get("pulses_N", np.zeros_like(d["t"])), d["kp"], d["kv"]
    h = float(np.median(np.diff(d["t"])))
    plant = Plant(system, SUBSTEPS)
    state = plant.start(d["qm"][:1], np.zeros(1))
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


def main() -> None:
    if not DATA.is_dir():
        print(f"emps: {DATA} is not here; nothing to run")
        return
    spec = read_spec(ROOT / "specs" / "emps.yaml")
    system = build_system(spec)
    logs = {name: read_log(DATA / file, spec) for name, file in RECORDS.items()}
    found = diagnose_log(spec, system, logs["training"], logs["test"])[1].augmented
    published = {"M": 95.154, "Fv": 203.5649, "rail_a": 20.38585, "offset": -0.24185}
    asymmetry = FoundEffect("viscous_asymmetry", "rail", {"d_b": -36.85875}, {})
    models = {
        "published, symmetric": system,
        "published, by direction": with_effects(with_values(system, published), [asymmetry]),
        "found by the diagnosis": found,
    }
    for kinds in (BY_DIRECTION, (*BY_DIRECTION, "presliding")):
        model = Model(system, kinds)
        whole = candidates(model, read(spec, "training"), (0.5, 2.0, 6.0, 12.0, None))[-1]
        models[f"{model.words}, from long free runs"] = model.built(np.array(whole.theta))
    print("closed loop, %: position and force on the training record, on the test record")
    for name, model_system in models.items():
        errors = [tuple(round(e, 4) for e in closed_loop(model_system, record)) for record in RECORDS]
        print(f"  {name}: {errors}", flush=True)


if __name__ == "__main__":
    main()
