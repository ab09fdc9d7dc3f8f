"""The declared parameters of one axis by mujoco.sysid: ``python mujoco_fit.py TASK.json LOG.npz``, prints JSON.

Runs in an environment of its own, with what requirements.txt beside it names, and imports nothing of the project. It
sees what the diagnosis sees: the declared structure, positions, commands, and low-passed states to start runs from.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

ARM = 0.01
GRAVITY = 9.81
STEP = 5e-4
"""s at most; the command is held over all steps of a sample, as the logs have it."""
FRICTION_S = 2e-3
"""Time in which friction stops a slow joint. By default it is 20 ms, in which a stuck axis creeps."""
LEAST = 1e-6
"""Inertia that is left at least of a body."""
MODEL = """
<mujoco>
  <option gravity="0 0 -{gravity}" timestep="{step}" integrator="implicitfast"/>
  <worldbody>
    <body name="axis">
      <joint name="q" type="{joint}" axis="{axis}" damping="{damping}"
             frictionloss="{level}" solreffriction="{stiff} 1"/>
      <inertial pos="{centre}" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
    </body>
  </worldbody>
  <actuator>
    <general name="u" joint="q" gainprm="{gain}" biastype="affine" biasprm="{bias} 0 0"/>
  </actuator>
  <sensor>
    <jointpos name="q_pos" joint="q"/>
  </sensor>
</mujoco>
"""


def spec_of(task: dict[str, Any]) -> mujoco.MjSpec:
    """The model: a mass on a slide; or a body on a hinge, with its centre ``ARM`` off it for the moment of gravity."""
    value = {name: one["value"] for name, one in task["quantities"].items()}
    sliding = task["joint"] == "slide"
    mass = value["inertia"] if sliding else mass_of(value["moment"])
    centre = {"none": "0 0 0", "hanging": f"0 0 -{ARM}", "level": f"{ARM} 0 0"}[task["gravity"]]
    text = MODEL.format(
        gravity=GRAVITY,
        step=repr(task["sample_time"] / steps_of(task)),
        joint=task["joint"],
        axis="1 0 0" if sliding else "0 -1 0",
        damping=repr(value["damping"]),
        level=repr(value["level"]),
        stiff=repr(FRICTION_S),
        centre=centre,
        mass=repr(mass),
        inertia=repr(1.0 if sliding else max(value["inertia"] - mass * ARM**2, LEAST)),
        gain=repr(task["gain"]),
        bias=repr(value["offset"]),
    )
    return mujoco.MjSpec.from_string(text)


def steps_of(task: dict[str, Any]) -> int:
    """Time steps in one sample."""
    return int(np.ceil(task["sample_time"] / STEP - 1e-9))


def mass_of(moment: float) -> float:
    """The mass of a body whose centre is ``ARM`` off the hinge, for a moment of gravity."""
    return max(moment / (GRAVITY * ARM), LEAST)


def moment_of(spec: mujoco.MjSpec, moment: float) -> None:
    """Set the moment of gravity; the inertia about the hinge stays."""
    body = spec.body("axis")
    about_hinge = body.inertia[0] + body.mass * ARM**2
    body.mass = mass_of(moment)
    body.inertia = [max(about_hinge - body.mass * ARM**2, LEAST)] * 3


def inertia_of(spec: mujoco.MjSpec, inertia: float, sliding: bool) -> None:
    """Set the inertia about the joint."""
    body = spec.body("axis")
    if sliding:
        body.mass = inertia
    else:
        body.inertia = [max(inertia - body.mass * ARM**2, LEAST)] * 3


def parameters_of(task: dict[str, Any]) -> sysid.ParameterDict:
    """The parameters that the task fits, with their bounds; the moment first, since the inertia depends on it."""
    sliding = task["joint"] == "slide"
    actions = {
        "moment": lambda s, p: moment_of(s, float(p.value[0])),
        "inertia": lambda s, p: inertia_of(s, float(p.value[0]), sliding),
        "damping": lambda s, p: s.joint("q").damping.__setitem__(0, float(p.value[0])),
        "level": lambda s, p: setattr(s.joint("q"), "frictionloss", float(p.value[0])),
        "offset": lambda s, p: s.actuator("u").biasprm.__setitem__(0, float(p.value[0])),
    }
    found = sysid.ParameterDict()
    for name, action in actions.items():
        one = task["quantities"][name]
        if one["bounds"]:
            low, high = one["bounds"]
            found.add(sysid.Parameter(name, one["value"], low, high, modifier=action))
    return found


def sequences_of(task: dict[str, Any], log: Any, spec: mujoco.MjSpec) -> list[sysid.ModelSequences]:
    """Runs over the log, each from its low-passed state."""
    model, steps, h = spec.compile(), steps_of(task), task["sample_time"]
    states, controls, sensors, names = [], [], [], []
    for k, start in enumerate(log["starts"]):
        stop = int(start) + task["length"]
        x, u = log["measured"][start:stop], np.repeat(log["command"][start:stop], steps)
        states.append(sysid.create_initial_state(model, log["position"][[start]], log["velocity"][[start]]))
        controls.append(sysid.TimeSeries.from_control_names(np.arange(len(u)) * h / steps, u[:, None], model))
        sensors.append(sysid.TimeSeries.from_names(np.arange(len(x)) * h, x[:, None], model))
        names.append(f"run_{k}")
    return [sysid.ModelSequences("axis", spec, names, states, controls, sensors)]


def plain_difference(
    params: Any, predicted: Any, measured: Any, model: Any, return_pred_all: bool, *, state: Any, **_: Any
) -> Any:
    """Predicted less measured position at the samples behind the start; the default would divide by each run's RMS."""
    steps = round((measured.times[1] - measured.times[0]) / model.opt.timestep)
    after = state[steps - 1 :: steps, 1][: len(measured.times) - 1]
    kept = sysid.TimeSeries(measured.times[1 : 1 + len(after)], measured.data[1 : 1 + len(after)])
    simulated = sysid.TimeSeries(kept.times, after[:, None])
    return after[:, None] - kept.data, simulated, kept


def main() -> None:
    task = json.loads(Path(sys.argv[1]).read_text())
    with np.load(sys.argv[2], allow_pickle=False) as file:
        log = {name: file[name] for name in file.files}
    spec = spec_of(task)
    residual = sysid.build_residual_fn(
        models_sequences=sequences_of(task, log, spec), modify_residual=plain_difference, n_threads=1
    )
    first = parameters_of(task)
    found, _ = sysid.optimize(first, residual, optimizer="mujoco", verbose=False, max_iters=50, x_scale="jac")
    values = {name: float(found[name].value[0]) for name, q in task["quantities"].items() if q["bounds"]}
    before, after = (
        float(np.sqrt(np.mean(np.concatenate([np.ravel(r) for r in residual(p.as_vector(), p)[0]]) ** 2)))
        for p in (parameters_of(task), found)
    )
    print(json.dumps({"values": values, "rms_before": before, "rms_after": after, "version": mujoco.__version__}))


if __name__ == "__main__":
    main()
