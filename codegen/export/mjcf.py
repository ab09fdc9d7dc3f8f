"""Export as an MJCF model for MuJoCo 3.7 or later.

MuJoCo's joints and fixed tendons have polynomial springs and dampers, and a ``frictionloss``: Coulomb friction as a
constraint, set-valued up to a small creep. A ``dcmotor`` with ``input="none"`` is a passive force on a joint or tendon:
cogging amplitude·sin(poles·θ + phase), and LuGre friction. Actuators have gain, limits, delay and lag.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import ceil, pi
from typing import Any

import numpy as np

from codegen.base.text import render
from codegen.export.bodies import Link, links_of, number, numbers
from codegen.export.exporter import CORNER, Exporter, Held, Remark
from codegen.export.friction_fit import FrictionFit, fit_friction
from codegen.export.mechanism import HIGHEST, Direction, Drive, Line, LineFriction, Mechanism, coordinate_of
from codegen.mechanics.kinematic_chain import mass_matrix, points_of
from codegen.simulate.plant import MOST_SUBSTEPS, substeps_of
from codegen.spec.model import Spec

Tendon = tuple[str, list[tuple[str, str]], list[tuple[str, str]]]
"""Name, attributes, coefficients by joint."""
LONGEST_STEP = 1e-4
"""Longest time step, s."""
IMPEDANCE = 0.9999
"""Impedance d of MuJoCo's friction constraint; the creep of a contact at rest is proportional to 1 − d."""
STIFF = 0.2
"""ω h of the bristles that replace a set-valued law, with ω their frequency and h the time step; their σ1 is zero."""
LATE = 1e-3
"""Largest σ1·h of LuGre friction, as a share of the line's inertia. MuJoCo computes σ1 z' with the velocity of a step
and the deflection of the step before, which acts like an inertia of up to σ1·h near the Stribeck velocity."""


@dataclass
class Body:
    """A link with the XML attributes of its joint, and its child bodies."""

    link: Link
    joint: dict[str, str] = field(default_factory=dict)
    children: list[Body] = field(default_factory=list)


@dataclass(frozen=True)
class Element:
    """An actuator element (friction, periodic force or drive) on a joint or tendon: XML tag and attributes in order."""

    tag: str
    attributes: dict[str, str]


@dataclass(frozen=True)
class FrictionElement:
    """The elements of the model that are the friction of one contact, to read its force in a simulation.

    Attributes:
        contact, direction: name of the contact, and direction of its line.
        sliding: the exported terms.
        lugre: name of the actuator that has a part of it, or "".
        loss: the contact's share of the line's ``frictionloss``.
    """

    contact: str
    direction: Direction
    sliding: FrictionFit
    lugre: str
    loss: float


@dataclass(frozen=True)
class MjcfModel:
    """An MJCF model, with the names of its elements.

    Attributes:
        timestep: s.
        joints, actuators: names, in the order of coordinates and inputs.
        tendons: direction of a line → its tendon.
    """

    text: str
    timestep: float
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    tendons: Mapping[Direction, str]
    frictions: tuple[FrictionElement, ...]
    remarks: tuple[Remark, ...]


def build_mjcf(spec: Spec, mechanism: Mechanism, header: list[str]) -> MjcfModel:
    """The MJCF model of a mechanism, with the lines of the header in a comment at its top."""
    return MjcfWriter(spec, mechanism).model(header)


class MjcfWriter(Exporter):
    """Builder of the elements of one MJCF model, or of those that are added to a user's own model.

    Args:
        timestep: of the user's model, s; chosen for the machine by default.
        labels: coordinate → the joint's name in the user's model.
    """

    def __init__(
        self, spec: Spec, mechanism: Mechanism, timestep: float | None = None, labels: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(spec, mechanism)
        self._tendon_of: dict[Direction, dict[str, str]] = {}
        self.actuators: list[Element] = []
        self.frictions: list[FrictionElement] = []
        self._mobility = _mobility(mechanism)
        self.timestep = timestep or self._timestep()
        self.names = [(labels or {}).get(link.name, link.name) for link in links_of(self.mechanism)]

    def add_to(self, springs: Mapping[str, float]) -> dict[str, dict[str, str]]:
        """Attributes of each coordinate's joint; passive ``actuators``, ``tendons`` and remarks are added on the way.

        The inputs are actuators of the user's model. ``springs``: coordinate → constant force of the joint's spring
        there, stiffness · rest position.
        """
        coordinates = [link.name for link in links_of(self.mechanism)]
        joints: dict[str, dict[str, str]] = {name: {} for name in coordinates}
        self._armatures(list(joints.values()))
        lines = []
        for line in self.mechanism.lines:
            joint = coordinate_of(line.direction)
            held = springs.get(coordinates[joint], 0.0) if joint is not None and any(line.stiffness) else 0.0
            same = abs(line.constant - held) <= 1e-9 * max(abs(line.constant), abs(held))
            lines.append(replace(line, constant=0.0 if same else line.constant - held))
        self._lines(lines, list(joints.values()))
        for drive in self.mechanism.drives:
            own = [float(abs(c)) for c in drive.direction if c]
            if own != [1.0] or drive.limit is not None or drive.delay or drive.lag is not None or drive.dead_zone:
                how = "its gain, limit, delay, lag and dead zone: the actuators of the file stay as they are"
                self.remark(f"input {self.system.inputs[drive.index]}", "dropped", how)
        for x in self.system.sensor_errors:
            self.remark(f"sensor of {x}", "dropped", "its error: the sensors of the file stay as they are")
        return joints

    def _armatures(self, attributes: list[dict[str, str]]) -> None:
        for name, inertia, own in zip(self.names, self.mechanism.inertias, attributes, strict=True):
            if self.mechanism.tree is not None and inertia:
                own["armature"] = number(inertia)
                self.remark(f"inertia of {name}", "exact", f"armature {own['armature']}")

    def _lines(self, lines: Sequence[Line], attributes: list[dict[str, str]]) -> None:
        for k, line in enumerate(lines):
            joint = coordinate_of(line.direction)
            target = {"joint": self.names[joint]} if joint is not None else {"tendon": self._tendon(line.direction)}
            own = attributes[joint] if joint is not None else self._tendon_of[line.direction]
            self._line(line, target, own, f"line{k + 1}.")

    @property
    def tendons(self) -> tuple[Tendon, ...]:
        """The tendons for lines that are no single joint."""
        found = []
        for direction, own in self._tendon_of.items():
            coefficients = [(name, number(c)) for name, c in zip(self.names, direction, strict=True) if c]
            found.append((own["name"], list(own.items())[1:], coefficients))
        return tuple(found)

    def model(self, header: list[str]) -> MjcfModel:
        """The whole model."""
        bodies = [Body(link) for link in links_of(self.mechanism)]
        attributes = [body.joint for body in bodies]
        self._armatures(attributes)
        for drive in self.mechanism.drives:
            self._drive(drive)
        self._lines(self.mechanism.lines, attributes)
        for x, error in self.system.sensor_errors.items():
            unit = self.system.position_units[self.system.positions.index(x)]
            size = float(np.abs(self.region.sampled(error.subs(self.system.values))).max())
            how = f"MuJoCo's sensors read the true position; the declared error is up to {size:.4g} {unit}"
            self.remark(f"sensor of {x}", "dropped", how)
        roots: list[Body] = []
        for body in bodies:
            (roots if body.link.parent < 0 else bodies[body.link.parent].children).append(body)
        gravity = self.mechanism.tree.gravity if self.mechanism.tree is not None else (Fraction(0),) * 3
        text = render(
            "export/model.mjcf.xml.j2",
            header=[*header, *(r.text for r in self.remarks), *self.assumptions],
            name=self.spec.name,
            timestep=number(self.timestep),
            gravity=numbers([float(g) for g in gravity]),
            solref=f"{number(2 * self.timestep)} 1",
            solimp=f"{IMPEDANCE} {IMPEDANCE} 0.001",
            roots=roots,
            tendons=self.tendons,
            actuators=self.actuators,
            coordinates=self.names,
            n=numbers,
        )
        inputs = tuple(w.name for w in self.system.inputs)
        named = {direction: tendon["name"] for direction, tendon in self._tendon_of.items()}
        joints, frictions = tuple(self.names), tuple(self.frictions)
        return MjcfModel(text, self.timestep, joints, inputs, named, frictions, tuple(self.remarks))

    @property
    def assumptions(self) -> tuple[str, ...]:
        """A line on the assumed ranges over which errors were computed; none without errors or assumed ranges."""
        if not self.region.assumed or all(r.worst is None for r in self.remarks):
            return ()
        return (f"errors are over the envelope; ranges that it lacks are assumed: {', '.join(self.region.assumed)}",)

    def _timestep(self) -> float:
        """The time step: the sample time over a whole number, as short as laws with states and ``LATE`` require."""
        simulation, observer = self.spec.simulation, self.spec.observer
        period = simulation.sample_time if simulation else float(observer.sample_time) if observer else 1e-3
        substeps = ceil(period / LONGEST_STEP - 1e-9)
        if self.mechanism.tree is None:
            substeps = max(substeps, substeps_of(self.system, period, np.zeros(len(self.system.positions))))
        for line in self.mechanism.lines:
            for friction in line.frictions:
                if friction.bristles is not None:
                    late = friction.bristles[1] * self._mobility(line.direction) * period / LATE
                    substeps = max(substeps, ceil(late))
        return period / min(substeps, MOST_SUBSTEPS)

    def _tendon(self, direction: Direction) -> str:
        return self._tendon_of.setdefault(direction, {"name": f"along{len(self._tendon_of) + 1}"})["name"]

    def _line(self, line: Line, target: dict[str, str], attributes: dict[str, str], name: str) -> None:
        words, unit = self.line_name(line.direction), self.unit(line.direction)
        if any(line.stiffness):
            attributes["stiffness"] = polynomial(line.stiffness)
            if "joint" not in target and not line.gap:
                attributes["springlength"] = "0"
            how = f"stiffness {attributes['stiffness']}"
            if line.gap:
                attributes["springlength"] = numbers([-line.gap / 2, line.gap / 2])
                how += f", none within {attributes['springlength']}; the damper acts within the play too, and may pull"
            self.remark(f"spring along {words}", "nearest" if line.gap else "exact", how)
        damping = list(line.damping)
        if any(line.damping):
            self.remark(f"damping along {words}", "exact", f"damping {polynomial(line.damping)}")
        if line.constant:
            self._passive(target, {"cogging": numbers([line.constant, 0, pi / 2])}, f"{name}constant")
            how = f"{line.constant:.6g} {unit} by a dcmotor's cogging of 0 poles"
            self.remark(f"constant force along {words}", "exact", how)
        for k, wave in enumerate(line.waves):
            cogging = numbers([wave.amplitude / wave.rate, 1, wave.phase])
            self._passive(target, {"cogging": cogging}, f"{name}wave{k + 1}", wave.rate)
            how = f"{wave.amplitude:.6g} {unit} with the period {2 * pi / wave.rate:.6g} by a dcmotor's cogging"
            self.remark(f"periodic force along {words}", "exact", how)
        loss = 0.0
        for friction in line.frictions:
            loss += self._friction(friction, line.direction, target, damping, f"{name}{friction.contact}")
        if any(damping):
            attributes["damping"] = polynomial(damping)
        if loss > 0:
            attributes["frictionloss"] = number(loss)
            # Under a force equal to its level f it creeps with v: b v = R f of MuJoCo's constraint, where
            # R = (1 − d)/d · A with A = c'M⁻¹c, b = 2/(d·timeconst) and timeconst = 2·timestep.
            creep = float((1 - IMPEDANCE) * self._mobility(line.direction) * loss * self.timestep)
            speed = f"{creep:.2g} {self.system.position_units[line.direction.index(max(line.direction))]}/s"
            how = f"frictionloss {number(loss)}, a constraint: at rest it creeps, by up to {speed}"
            self.remark(f"Coulomb friction along {words}", "nearest", how)

    def _friction(
        self, friction: LineFriction, line: Direction, target: dict[str, str], damping: list[float], name: str
    ) -> float:
        """Add the friction of one contact, and return its part of the line's ``frictionloss``."""
        speeds, unit = self.region.speeds(line), self.unit(line)
        fit = fit_friction(friction.level, speeds, HIGHEST, True)
        terms, lugre, loss = fit.terms, "", 0.0
        where = f"contact {friction.contact} ({friction.law})"
        for j, d in enumerate(terms.damping):
            damping[j] += d
        parts = [f"damping {polynomial(terms.damping)}"] if any(terms.damping) else []
        held: Any = "exact" if fit.exact else "nearest"
        if friction.bristles is not None or terms.rise:
            stiffest = float(f"{(STIFF / self.timestep) ** 2 / self._mobility(line):.3g}")  # that the time step allows
            stiffness, micro = friction.bristles or (stiffest, 0.0)
            lugre = name
            speed = terms.stribeck if terms.rise else max(float(speeds[-1]), 1e-3)
            given = [stiffness, micro, terms.level, terms.level + terms.rise, speed]
            self._passive(target, {"lugre": numbers(given)}, name)
            parts.append(f"LuGre friction {numbers(given)} of a dcmotor")
            if friction.bristles is None:
                held = "nearest"
                yields = (terms.level + terms.rise) / stiffness
                parts.append(f"at rest it deflects by up to {yields:.3g}, and the declared law not at all")
        elif terms.level:
            loss = terms.level
            parts.append(f"{number(loss)} in frictionloss")
        if friction.has_states and friction.bristles is None:
            held = "nearest"
            parts.append("steady sliding alone: the law's states before it slides are not represented")
        if friction.at_rest is not None:
            held = "nearest"
            parts.append(f"the level at rest, {friction.at_rest:.6g} {unit}, is not represented")
        self.frictions.append(FrictionElement(friction.contact, line, fit, lugre, loss))
        how = ", ".join(parts) or "none"
        self.remarks.append(Remark(where, held, how, *fit.force_errors(unit)))
        return loss

    def _passive(self, target: dict[str, str], what: dict[str, str], name: str, gear: float = 1.0) -> None:
        passive = {"input": "none", "motorconst": "0", "resistance": "1"}
        geared = {"gear": number(gear)} if gear != 1 else {}
        self.actuators.append(Element("dcmotor", {"name": name, **target, **geared, **passive, **what}))

    def _drive(self, drive: Drive) -> None:
        w, unit = self.system.inputs[drive.index], self.system.input_units[drive.index]
        moved = [i for i, c in enumerate(drive.direction) if c]
        where = f"input {w.name}"
        attributes: dict[str, str] = {"name": w.name}
        if len(moved) == 1:
            attributes["joint"], gain = self.system.positions[moved[0]].name, drive.direction[moved[0]]
        elif moved:
            attributes["tendon"], gain = self._tendon(drive.direction), 1.0
        else:
            self.remark(where, "exact", "it moves no coordinate")
            attributes["joint"], gain = self.system.positions[0].name, 0.0
        attributes["gear"] = number(gain)
        parts = ["a force along a tendon"]
        if len(moved) == 1:
            parts = [f"{attributes['gear']} {self.unit(drive.direction)} per {unit}"]
        if drive.limit is not None:
            attributes["ctrlrange"] = numbers([-drive.limit, drive.limit])
            parts.append(f"limited to {drive.limit:.6g} {unit}" + (CORNER if drive.rounded else ""))
        held: Held = "nearest" if drive.rounded else "exact"
        if drive.delay:
            steps = drive.delay / self.timestep
            attributes["delay"], attributes["nsample"] = number(drive.delay), str(max(ceil(steps - 1e-9), 1))
            parts.append(f"delayed by {drive.delay:.6g} s, in steps of {number(self.timestep)} s")
            held = held if abs(steps - round(steps)) < 1e-6 else "nearest"
        if drive.lag is not None:
            total = drive.order * drive.lag
            attributes |= {"dyntype": "filterexact", "dynprm": number(total), "actearly": "true"}
            equal = f" in place of {drive.order} of {drive.lag:.6g} s" if drive.order > 1 else ""
            parts.append(f"behind a lag of {total:.6g} s{equal}")
            held = "nearest" if equal else held
        self.actuators.append(Element("general", attributes))
        self.remark(where, held, ", ".join(parts))
        if drive.dead_zone:
            how = f"a dead zone of {drive.dead_zone:.6g} {unit} of command: no actuator of MuJoCo has one"
            lost = np.array([drive.dead_zone * max(map(abs, drive.direction))])
            self.remark(where, "dropped", how, lost, self.unit(drive.direction))


def polynomial(values: Sequence[float]) -> str:
    """The coefficients up to the last nonzero one, in MuJoCo's form."""
    last = max((k for k, v in enumerate(values) if v), default=0)
    return numbers(values[: last + 1])


def _mobility(mechanism: Mechanism) -> Any:
    """Function direction c → c'M⁻¹c, with all joints at zero."""
    n = len(mechanism.system.positions)
    mass = np.diag(mechanism.inertias)
    if mechanism.tree is not None:
        import casadi

        at = mass_matrix(mechanism.tree, casadi.SX.zeros(n), list(map(points_of, mechanism.tree.bodies)))
        mass = mass + np.asarray(casadi.evalf(casadi.densify(at)).full())
    inverse = np.linalg.inv(mass)
    return lambda direction: float(np.array(direction) @ inverse @ np.array(direction))
