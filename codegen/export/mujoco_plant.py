"""MuJoCo as a plant of a simulated loop, with the exported model."""

from importlib.util import find_spec
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.export.mechanism import coordinate_of, mechanism_of
from codegen.export.mjcf import FrictionElement, MjcfModel, build_mjcf
from codegen.mechanics.system import System
from codegen.simulate.observed_loop import PlantMaker
from codegen.spec.model import Spec


def mujoco_plant(spec: Spec, system: System) -> tuple[PlantMaker, MjcfModel]:
    """A maker of plants with a spec's exported model, and the model.

    Raises BadInput if MuJoCo is not installed, or the machine cannot be exported.
    """
    if find_spec("mujoco") is None:
        expected = "`pip install 'stiction[mujoco]'`, or no --plant"
        raise BadInput("--plant", "MuJoCo is not installed", expected, code="TOOL003")
    model = build_mjcf(spec, mechanism_of(spec, system), [])
    contacts = [contact.name for contact in system.contacts]
    return lambda period, x, v: MujocoPlant(model, len(spec.positions), contacts, period, x, v), model


class MujocoPlant:
    """An exported model in MuJoCo, as a ``MovedPlant``.

    Attributes:
        state: (2 n,) positions and velocities of the system's coordinates.
        positions, velocities: (n,) views of ``state``.
        forces: (contacts,) λ of the model at the beginning of the last sample.
        data, model: objects of MuJoCo.
    """

    def __init__(self, exported: MjcfModel, n: int, contacts: list[str], period: float, x: Array, v: Array) -> None:
        import mujoco

        self._step = mujoco.mj_step
        self.model = mujoco.MjModel.from_xml_string(exported.text)
        self.data = mujoco.MjData(self.model)
        self._n, self._substeps = n, round(period / exported.timestep)
        # The first n joints are the coordinates in their order; a joint NAME_load starts at the position of joint NAME.
        joints = [self.model.joint(name) for name in exported.joints]
        self._positions = np.array([joint.qposadr[0] for joint in joints])
        self._velocities = np.array([joint.dofadr[0] for joint in joints])
        self._controls = np.array([self.model.actuator(name).id for name in exported.actuators], dtype=int)
        for k, name in enumerate(exported.joints):
            motor = k if k < n else exported.joints.index(name.removesuffix("_load"))
            self.data.qpos[self._positions[k]], self.data.qvel[self._velocities[k]] = x[motor], v[motor]
        self.state: Array = np.concatenate([x, v]).astype(float)
        self.positions, self.velocities = self.state[:n], self.state[n:]
        self.forces = np.zeros(len(contacts))
        self._frictions = [(contacts.index(f.contact), _Reading(f, exported, self.model)) for f in exported.frictions]

    def move(self, time: float, command: Array) -> None:
        """Move the state by one sample, with a command (m,) that is held from ``time``; MuJoCo keeps its own time."""
        data = self.data
        data.ctrl[self._controls] = command
        speeds = data.qvel[self._velocities].copy()
        for k in range(self._substeps):
            self._step(self.model, data)
            if k == 0:
                self.forces[:] = 0.0
                for contact, reading in self._frictions:
                    self.forces[contact] += reading.force(data, speeds)
        self.positions[:] = data.qpos[self._positions[: self._n]]
        self.velocities[:] = data.qvel[self._velocities[: self._n]]


class _Reading:
    """Reads the friction force of one contact from MuJoCo's data.

    It is the sum of a damper, computed here from the slip velocity, the constraint of MuJoCo's friction loss, and LuGre
    bristles, which are an actuator. Contacts in the same direction share one constraint, in proportion to their losses.
    """

    def __init__(self, friction: FrictionElement, exported: MjcfModel, model: Any) -> None:
        import mujoco

        self._friction, self._direction = friction, np.array(friction.direction)
        total = sum(f.loss for f in exported.frictions if f.direction == friction.direction)
        self._share = friction.loss / total if total else 0.0
        self._lugre = model.actuator(friction.lugre).id if friction.lugre else -1
        joint = coordinate_of(friction.direction)
        if joint is not None:
            self._kind = mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
            self._id = model.joint(exported.joints[joint]).dofadr[0]
        else:
            self._kind = mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON
            self._id = model.tendon(exported.tendons[friction.direction]).id

    def force(self, data: Any, speeds: Array) -> float:
        """λ, positive against a slip u > 0."""
        slip = float(self._direction @ speeds)
        total = float(np.sign(slip) * self._friction.sliding.terms.damped(abs(slip)))
        if self._share:
            rows = (data.efc_type == self._kind) & (data.efc_id == self._id)
            total -= self._share * float(data.efc_force[rows].sum())
        if self._lugre >= 0:
            total -= float(data.actuator_force[self._lugre])
        return total
