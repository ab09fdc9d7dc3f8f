"""Reduction of a machine to joints with viscous damping and Coulomb friction, for URDF, SDF and USD."""

from dataclasses import dataclass

import sympy

from codegen.export.exporter import CORNER, Exporter, Held, Remark
from codegen.export.friction_fit import fit_friction
from codegen.export.mechanism import Direction, Drive, Line, Mechanism, unit_direction
from codegen.spec.model import Spec


@dataclass(frozen=True)
class JointTerms:
    """Dynamics of a joint: friction force damping·v + friction·sgn(v), spring force −stiffness (x − reference).

    Attributes:
        effort: largest force of its drive; None if no saturation is declared.
        armature: inertia of a rotor at the joint, kg m² or kg.
    """

    name: str
    damping: float
    friction: float
    stiffness: float = 0.0
    reference: float = 0.0
    effort: float | None = None
    armature: float = 0.0


def joint_terms(
    spec: Spec, mechanism: Mechanism, target: str, springs: bool, armatures: bool = False
) -> tuple[tuple[JointTerms, ...], tuple[Remark, ...]]:
    """The terms of each joint, and remarks on how they represent the machine.

    Args:
        target: name of the format, for the remarks.
        springs: whether its joints have linear springs.
        armatures: whether its joints have inertias of their own.
    """
    reduction = _Reduction(spec, mechanism, target, springs, armatures)
    joints = tuple(reduction.joint(i) for i in range(len(mechanism.system.positions)))
    reduction.remark_on_others()
    return joints, tuple(reduction.remarks)


class _Reduction(Exporter):
    """The reduction of one machine; ``joint`` for each coordinate, then ``remark_on_others``."""

    def __init__(self, spec: Spec, mechanism: Mechanism, target: str, springs: bool, armatures: bool) -> None:
        super().__init__(spec, mechanism)
        self.target, self.springs, self.armatures = target, springs, armatures

    def joint(self, index: int) -> JointTerms:
        """The terms of one joint; remarks are added on the way."""
        x = self.system.positions[index]
        direction = unit_direction(index, len(self.system.positions))
        line = self.mechanism.joint_line(index) or Line(direction)
        level, unit = line.level, self.unit(direction)
        fit = fit_friction(level, self.region.speeds(direction), 1, False)
        terms = fit.terms
        if level != 0:
            held: Held = "exact" if fit.exact else "nearest"
            how = f"damping {terms.damping[0]:.6g}, friction {terms.level:.6g}"
            if not fit.exact:
                how += f" by least squares over the envelope's speeds{self.assumed(level, direction)}"
            for f in line.frictions:
                if f.at_rest is not None:
                    held, how = "nearest", f"{how}; the level at rest, {f.at_rest:.6g} {unit}, is not represented"
            if any(f.has_states for f in line.frictions):
                held, how = "nearest", f"{how}; the law's states before it slides are not represented"
            self.remarks.append(Remark(f"friction on {x}", held, how, *fit.force_errors(unit)))
        stiffness = line.stiffness[0] if self.springs else 0.0
        reference = line.constant / stiffness if stiffness else 0.0
        if stiffness:
            self.remark(f"spring on {x}", "exact", f"{stiffness:.6g}, at rest at {reference:.6g}")
        self._remark_on_forces(line, direction, stiffness, reference)
        armature = self._armature(index)
        return JointTerms(x.name, terms.damping[0], terms.level, stiffness, reference, self._effort(index), armature)

    def _armature(self, index: int) -> float:
        """The inertia that is added to the bodies of a robot file; 0, with a remark, if the target has no armature."""
        where, inertia = f"inertia of {self.system.positions[index]}", self.mechanism.inertias[index]
        if self.mechanism.tree is None or not inertia:
            return 0.0
        if self.armatures and inertia > 0:
            self.remark(where, "exact", f"armature {inertia:.6g}")
            return inertia
        why = "takes no negative one" if self.armatures else "has no armature"
        self.remark(where, "dropped", f"{inertia:.6g} of inertia at the joint: {self.target} {why}")
        return 0.0

    def _remark_on_forces(self, line: Line, direction: tuple[float, ...], stiffness: float, reference: float) -> None:
        """Add remarks on constant and position-dependent forces that the target does not have."""
        index = direction.index(1.0)
        x = self.system.positions[index]
        force = sympy.Float(line.constant) - line.spring(x)
        force += sympy.Add(*[w.amplitude * sympy.sin(w.rate * x + w.phase) for w in line.waves])
        force = sympy.expand(force + stiffness * (x - reference))
        if (any(line.stiffness) or line.waves or line.constant) and force != 0:
            parts = [
                *(["a constant force"] if line.constant and not stiffness else []),
                *(["a spring"] if any(line.stiffness[1 if stiffness else 0 :]) else []),
                *([f"a force that depends on the position, periodic in {x}"] if line.waves else []),
            ]
            how = f"{', '.join(parts)}: {self.target} has none"
            rotary = self.system.position_units[index] == "rad"
            if self.mechanism.tree is None and rotary and any(abs(wave.rate) == 1 for wave in line.waves):
                how += "; where it is a weight, give mass and centre of mass in the link's inertial, with gravity on"
            self._remark_dropped(f"force on {x}", how, force, direction)

    def remark_on_others(self) -> None:
        """Add remarks on lines between coordinates, drives and sensors."""
        for line in self.mechanism.lines:
            if sum(map(bool, line.direction)) > 1:
                words, names = self.line_name(line.direction), zip(line.direction, self.system.positions, strict=True)
                if line.level != 0:
                    how = f"{self.target} has friction on joints only"
                    self._remark_dropped(f"friction along {words}", how, line.level, line.direction)
                if any(line.stiffness):
                    force = line.spring(sympy.Add(*[sympy.Float(c) * x for c, x in names if c]))
                    how = f"{self.target} has none between joints"
                    self._remark_dropped(f"spring along {words}", how, force, line.direction)
        for drive in self.mechanism.drives:
            self._remark_on_drive(drive)
        for x in self.system.sensor_errors:
            self.remark(f"sensor of {x}", "dropped", f"its error: {self.target} has no joint sensors")

    def _remark_on_drive(self, drive: Drive) -> None:
        """Add remarks on an input: its gain, delay, lag, dead zone and limit."""
        w, unit = self.system.inputs[drive.index], self.system.input_units[drive.index]
        where = f"input {w}"
        moved = [c for c in drive.direction if c]
        if moved != [1.0]:
            made = [
                f"{c:.6g} {self.system.force_unit(i)} on {x.name}"
                for i, (c, x) in enumerate(zip(drive.direction, self.system.positions, strict=True))
                if c
            ]
            how = f"its gain: 1 {unit} makes {' and '.join(made) or 'no force'}, and a joint takes a force"
            self.remark(where, "dropped", how)
        for name, value in (("a delay", drive.delay), *[("a lag", drive.lag)] * drive.order):
            if value:
                self.remark(where, "dropped", f"{name} of {value:.6g} s: {self.target} has none")
        if drive.dead_zone:
            lost = sympy.Float(drive.dead_zone * max(map(abs, drive.direction)))
            how = f"a dead zone of {drive.dead_zone:.6g} {unit} of command"
            self._remark_dropped(where, how, lost, drive.direction)
        if drive.limit is not None and len(moved) == 1:
            held: Held = "nearest" if drive.rounded else "exact"
            words = f"limited by the effort {drive.limit * abs(moved[0]):.6g}{CORNER if drive.rounded else ''}"
            self.remark(where, held, words)
        elif drive.limit is not None:
            self.remark(where, "dropped", f"its limit of {drive.limit:.6g} {unit}")

    def _effort(self, index: int) -> float | None:
        """The effort limit of a joint, if a single input moves it and that is limited; else None."""
        drives = [d for d in self.mechanism.drives if d.direction[index]]
        if len(drives) != 1 or drives[0].limit is None or sum(map(bool, drives[0].direction)) != 1:
            return None
        return drives[0].limit * abs(drives[0].direction[index])

    def _remark_dropped(self, where: str, how: str, force: sympy.Expr, direction: Direction) -> None:
        """Add the remark that a force is not represented, with its size over the envelope."""
        errors = self.region.sampled(force, direction)
        self.remark(where, "dropped", how + self.assumed(force, direction), errors, self.unit(direction))
