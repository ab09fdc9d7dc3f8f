"""Cogging and position-dependent friction as a table over a turn, as motor firmware takes it.

A row k stands for the position k·turn/counts. Its force is what has to be added to the command to cancel what repeats
with the position whatever the direction; its level is the friction that is added while the axis moves forwards, and
subtracted backwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from codegen.base.errors import BadInput, nearest_name
from codegen.base.text import render
from codegen.base.user_text import UserText
from codegen.export.mechanism import Mechanism, Wave, unit_direction, wave_of
from codegen.export.remarks import Remark
from codegen.spec.model import Spec

Array = NDArray[np.float64]
WHOLE = 1e-6
"""A wave fits into the turn a whole number of times where the number is this near to one."""
MOST_COUNTS = 2**22
ODRIVE_COUNTS = 3600
"""Of ``cogging_map`` in ODrive's firmware 0.5 (Firmware/MotorControl/controller.hpp), over one turn of the motor."""


@dataclass(frozen=True)
class ForceMap:
    """The periodic forces of one coordinate.

    Attributes:
        turn: the length of the table: 2π rad, or on a length the longest period.
        forces: that act whatever the direction; levels: that oppose the motion.
        unit: of both; position_unit.
    """

    coordinate: str
    turn: float
    forces: tuple[Wave, ...]
    levels: tuple[Wave, ...]
    unit: str
    position_unit: str
    remarks: tuple[Remark, ...]

    def compensation(self, position: Array) -> Array:
        """What cancels the forces."""
        return -_sum(self.forces, position)

    def level(self, position: Array) -> Array:
        return _sum(self.levels, position)


def force_map(spec: Spec, mechanism: Mechanism, on: str | None) -> ForceMap:
    """The map of one coordinate.

    Args:
        on: the coordinate; None where only one has such a force.

    Raises:
        BadInput: where no coordinate has one, several have and none is named, or a name is none of them.
    """
    system = mechanism.system
    found: dict[str, tuple[list[Wave], list[Wave]]] = {}
    for i, x in enumerate(system.positions):
        line = mechanism.joint_line(i)
        levels = []
        for leftover in mechanism.leftovers:
            if leftover.friction and leftover.direction == unit_direction(i, len(system.positions)):
                factor, shape = leftover.force.as_independent(x)
                wave = wave_of(float(factor), shape, x) if not factor.free_symbols else None
                levels += [wave] if wave is not None else []
        if levels or (line is not None and line.waves):
            found[x.name] = list(line.waves) if line is not None else [], levels
    if not found:
        place = spec.place("effects")
        expected = "an effect such as cogging, for a map of it"
        raise BadInput(place, "no force that repeats with the position", expected, code="SPEC036")
    if on is None and len(found) > 1:
        expected = f"one of {', '.join(found)}: each has a map of its own"
        raise BadInput("--on", "no coordinate", expected, code="CALL001")
    name = next(iter(found)) if on is None else on
    if name not in found:
        raise BadInput("--on", f"`{name}`", f"one of {', '.join(found)}", nearest_name(name, found), code="CALL001")
    return _map(name, *found[name], mechanism)


def _map(name: str, forces: list[Wave], levels: list[Wave], mechanism: Mechanism) -> ForceMap:
    index = [x.name for x in mechanism.system.positions].index(name)
    position_unit, unit = mechanism.system.position_units[index], mechanism.system.force_unit(index)
    turn = 2 * pi if position_unit == "rad" else max(2 * pi / wave.rate for wave in (*forces, *levels))
    remarks, kept = [], []
    for waves, word in ((forces, "force"), (levels, "friction level")):
        own = [wave for wave in waves if abs(wave.rate * turn / (2 * pi) - round(wave.rate * turn / (2 * pi))) < WHOLE]
        kept.append(tuple(own))
        for wave in waves:
            times = wave.rate * turn / (2 * pi)
            how = f"{wave.amplitude:.6g} {unit}, {times:.6g} waves over {turn:.6g} {position_unit}"
            if wave in own:
                remarks.append(Remark(f"{word} on {name}", "exact", how))
            else:
                size = abs(wave.amplitude)
                how += ": no whole number, so that a table over it cannot repeat it"
                remarks.append(Remark(f"{word} on {name}", "dropped", how, size, size / np.sqrt(2), unit))
    return ForceMap(name, turn, kept[0], kept[1], unit, position_unit, tuple(remarks))


def csv_map(table: ForceMap, counts: int, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """``count,position,force,level``, to be read with linear interpolation between counts, the last to the first.

    Raises:
        BadInput: for a number of counts out of range.
    """
    if not 4 <= counts <= MOST_COUNTS:
        raise BadInput("--counts", f"{counts}", f"4 to {MOST_COUNTS} counts a turn", code="CALL001")
    at = np.arange(counts) * table.turn / counts
    rows = list(zip(range(counts), at, table.compensation(at), table.level(at), strict=True))
    middle = at + table.turn / counts / 2
    ends = np.concatenate([at, at[:1]])
    errors = [(exact(ends)[1:] + exact(ends)[:-1]) / 2 - exact(middle) for exact in (table.compensation, table.level)]
    remark = _interpolation(table, "linear interpolation between counts", np.concatenate(errors))
    remarks = (*table.remarks, remark)
    text = render(
        "export/force_map.csv.j2", header=[*header, *(r.text for r in remarks)], table=table, rows=rows, counts=counts
    )
    return text, remarks


def odrive_map(table: ForceMap, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """A C header with the 3600 torques of ODrive's firmware 0.5.

    The firmware takes entry ⌊3600·position in turns⌋ and adds it to the torque, without interpolation, so an entry is
    the mean of what it stands for. ODrive documents no file and its protocol no way to write the map: the table is
    compiled into the firmware.

    Raises:
        BadInput: for a coordinate that is no angle or a force that is no torque.
    """
    if table.position_unit != "rad" or table.unit != "N*m":
        found = f"{table.coordinate} in {table.position_unit} with forces in {table.unit}"
        expected = "an angle of the motor with torques in N*m; csv-map holds any other"
        raise BadInput("--to", found, expected, code="SPEC036")
    edges = np.arange(ODRIVE_COUNTS + 1) * 2 * pi / ODRIVE_COUNTS
    primitive = sum(
        (w.amplitude / w.rate * np.cos(w.rate * edges + w.phase) for w in table.forces), np.zeros_like(edges)
    )
    entries = np.diff(primitive) / (2 * pi / ODRIVE_COUNTS)
    fine = (edges[:-1, None] + np.linspace(0, 1, 9) * 2 * pi / ODRIVE_COUNTS).ravel()
    remarks = [
        *table.remarks,
        _interpolation(table, "no interpolation between entries", np.repeat(entries, 9) - table.compensation(fine)),
    ]
    if table.levels:
        size = table.level(fine)
        how = "a level that changes sign with the direction: the map has none"
        worst, rms = float(np.abs(size).max()), float(np.sqrt(np.mean(size**2)))
        remarks.append(Remark(f"friction level on {table.coordinate}", "dropped", how, worst, rms, table.unit))
    lines = [UserText(line) for line in (*header, *(r.text for r in remarks))]
    values = [f"{value:.9e}f" for value in entries]
    rows = [values[k : k + 6] for k in range(0, len(values), 6)]
    return render("export/odrive_map.h.j2", header=lines, rows=rows, count=ODRIVE_COUNTS), tuple(remarks)


def _interpolation(table: ForceMap, how: str, errors: Array) -> Remark:
    worst, rms = float(np.abs(errors).max()), float(np.sqrt(np.mean(errors**2)))
    return Remark(f"map of {table.coordinate}", "nearest", how, worst, rms, table.unit)


def _sum(waves: tuple[Wave, ...], position: Array) -> Array:
    total = np.zeros_like(position)
    for wave in waves:
        total = total + wave.amplitude * np.sin(wave.rate * position + wave.phase)
    return total
