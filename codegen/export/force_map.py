"""Compensation table of cogging and position-dependent friction over one revolution, for motor firmware.

Row k is for the position k·turn/counts. Its ``force`` is added to the command and cancels forces that depend on the
position only; its ``level`` is friction, added in forward motion and subtracted in backward motion. The table contains
effects only: the forces of ``force:`` and weights belong to the machine's model. For a motor with a gear of ratio N
(revolutions of the motor per revolution of the joint) the position is N·q and the torque τ/N.
"""

from dataclasses import dataclass, replace
from math import isfinite, pi

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, refuse_unknown
from codegen.base.text import render
from codegen.base.user_text import UserText
from codegen.effects import CATALOGUE
from codegen.effects.declare import system_of
from codegen.export.exporter import Remark
from codegen.export.mechanism import Mechanism, Wave, coordinate_of, mechanism_of, wave_of
from codegen.spec.model import Spec

WHOLE = 1e-6
"""Largest deviation from a whole number of periods per turn that counts as rounding."""
NEARLY = 0.05
"""Largest deviation for which a fitted period is rounded to the whole number of periods per turn."""
MOST_COUNTS = 2**22
"""Largest number of counts per turn in a map."""
ODRIVE_COUNTS = 3600
"""Length of ``cogging_map`` in ODrive's firmware 0.5 (Firmware/MotorControl/controller.hpp), per turn of the motor."""


@dataclass(frozen=True)
class ForceMap:
    """The periodic forces of one coordinate.

    Attributes:
        turn: the range of the table: 2π rad of the motor, or for a length the longest period.
        forces: periodic forces that do not depend on the direction of motion.
        levels: periodic friction levels, which oppose the motion.
        unit, position_unit: of forces and levels, and of the position.
        gear: revolutions of the motor per revolution of the coordinate.
    """

    coordinate: str
    turn: float
    forces: tuple[Wave, ...]
    levels: tuple[Wave, ...]
    unit: str
    position_unit: str
    remarks: tuple[Remark, ...]
    gear: float = 1.0

    @property
    def place(self) -> str:
        """The position over which the table is given, in words."""
        return self.coordinate if self.gear == 1 else f"the motor's angle, {self.gear:.12g}*{self.coordinate}"

    def compensation(self, position: Array) -> Array:
        """The force that cancels ``forces`` at positions (N,)."""
        return -_sum(self.forces, position)

    def level(self, position: Array) -> Array:
        """The friction level at positions (N,)."""
        return _sum(self.levels, position)


def force_map(spec: Spec, mechanism: Mechanism, on: str | None, gear: float | None, turning: bool = False) -> ForceMap:
    """The map of one coordinate.

    Args:
        on: the coordinate; None if only one has such a force.
        gear: revolutions of the motor per revolution of the coordinate, negative for the opposite direction; None if
            not stated.
        turning: whether the coordinate must be an angle with a stated gear.

    Raises:
        BadInput: if no coordinate has a periodic force, several have and none is named, or the named one has none; if
            no force fits a whole number of times into the table; for a gear that is zero or not finite, or of a length;
            with ``turning``, for a length or without a gear.
    """
    if gear is not None and not (isfinite(gear) and gear != 0):
        expected = "turns of the motor a turn of the joint, such as 100, or -100 where it turns the other way"
        raise BadInput("--gear", f"{gear:g}", expected, code="CALL001")
    modelled = _modelled(spec)
    system = mechanism.system
    found: dict[str, tuple[list[Wave], list[Wave], list[Remark]]] = {}
    left_out: list[Remark] = []
    for i, x in enumerate(system.positions):
        weights = modelled.get(x.name, [])
        own = _less(_waves(mechanism, i), weights)
        levels = []
        for other in mechanism.other_forces:
            if other.friction and coordinate_of(other.direction) == i:
                factor, shape = other.force.as_independent(x)
                wave = wave_of(float(factor), shape, x) if not factor.free_symbols else None
                levels += [wave] if wave is not None else []
        rest = [_kept_out(wave, x.name, system.force_unit(i)) for wave in weights]
        left_out += rest
        if levels or own:
            found[x.name] = own, levels, rest
    if not found:
        but = " but a weight, or a term of `force:`" if left_out else ""
        expected = "an effect such as cogging, for a map of it"
        raise BadInput(spec.place("effects"), f"no force that repeats with the position{but}", expected, code="SPEC036")
    if on is None and len(found) > 1:
        expected = f"one of {', '.join(found)}: each has a map of its own"
        raise BadInput("--on", "no coordinate", expected, code="CALL001")
    name = next(iter(found)) if on is None else on
    refuse_unknown(name, found, "--on", "", code="CALL001")
    if turning:
        _refuse_length(name, mechanism)
        if gear is None:
            lacking = "no ratio, and the firmware's map is over the turn of the motor"
            expected = "turns of the motor a turn of the joint; 1 where it drives the joint directly"
            raise BadInput("--gear", lacking, expected, code="CALL001")
    gear = 1.0 if gear is None else gear
    table = _map(name, *found[name], mechanism, gear)
    if not (table.forces or table.levels):
        lost = next(r for r in table.remarks if r not in left_out)
        over = "the motor's angle" if gear != 1 else name
        expected = f"a force that repeats a whole number of times a turn of {over}"
        raise BadInput(spec.place("effects"), f"{lost.where}, {lost.how}", expected, code="SPEC036")
    return table


def _refuse_length(name: str, mechanism: Mechanism) -> None:
    """Raise BadInput for a coordinate that is no angle, or a force that is no torque."""
    index = mechanism.system.position_index(name)
    position_unit, unit = mechanism.system.position_units[index], mechanism.system.force_unit(index)
    if position_unit != "rad" or unit != "N*m":
        expected = (
            "an angle with torques in N*m, since the firmware's map is over a turn of the motor. `--to csv-map` writes "
            f"the table over {name}; or write the spec in the motor's angle"
        )
        raise BadInput("--to", f"{name} in {position_unit} with forces in {unit}", expected, code="SPEC036")


def _modelled(spec: Spec) -> dict[str, list[Wave]]:
    """Coordinate → its periodic forces that belong to the model: those of ``force:``, and weights among the effects."""
    declared = [(effect, {name: float(v) for name, v in effect.parameters.items()}) for effect in spec.effects]
    weights = tuple(effect for effect, values in declared if CATALOGUE[effect.kind].turned(values) != values)
    without = replace(spec, effects=weights)
    mechanism = mechanism_of(without, system_of(without))
    return {x.name: _waves(mechanism, i) for i, x in enumerate(mechanism.system.positions)}


def _waves(mechanism: Mechanism, index: int) -> list[Wave]:
    line = mechanism.joint_line(index)
    return [] if line is None else line.waves


def _less(waves: list[Wave], modelled: list[Wave]) -> list[Wave]:
    """The waves minus those of the model, by rate and phase; a wave may belong to the model in part."""
    left: dict[tuple[float, float], float] = {}
    for sign, some in ((1, waves), (-1, modelled)):
        for wave in some:
            at = (wave.rate, wave.phase)
            left[at] = left.get(at, 0.0) + sign * wave.amplitude
    largest = max((abs(wave.amplitude) for wave in waves), default=0.0)
    return [Wave(size, *at) for at, size in left.items() if abs(size) > WHOLE * largest]


def _kept_out(wave: Wave, name: str, unit: str) -> Remark:
    """The remark on a weight, or a term of `force:`, that is periodic in the position and not in the map."""
    size = abs(wave.amplitude)
    how = (
        f"{wave.amplitude:.6g} {unit}, once in {2 * pi / wave.rate:.6g} of {name}: a weight, or a term of "
        "`force:`; it belongs to the model, so a map of effects does not contain it"
    )
    return Remark(f"force on {name}", "dropped", how, size, size / np.sqrt(2), unit)


def _map(
    name: str, own: list[Wave], levels: list[Wave], left_out: list[Remark], mechanism: Mechanism, gear: float
) -> ForceMap:
    """The map of a coordinate, from its own waves and friction levels, over a revolution of the motor."""
    index = mechanism.system.position_index(name)
    position_unit, unit = mechanism.system.position_units[index], mechanism.system.force_unit(index)
    if gear != 1 and position_unit != "rad":
        expected = f"no --gear, since {name} is no angle: the table is over {name} itself"
        raise BadInput("--gear", f"{gear:g}, and {name} in {position_unit}", expected, code="CALL001")
    forces = [_geared(wave, gear, wave.amplitude / gear) for wave in own]
    levels = [_geared(wave, gear, wave.amplitude / abs(gear)) for wave in levels]
    turn = 2 * pi if position_unit == "rad" else max(2 * pi / wave.rate for wave in (*forces, *levels))
    remarks, kept = list(left_out), []
    for waves, word in ((forces, "force"), (levels, "friction level")):
        fitting = [_fitting(wave, turn, f"{word} on {name}", unit, position_unit) for wave in waves]
        kept.append(tuple(wave for wave, _ in fitting if wave is not None))
        remarks += [remark for _, remark in fitting]
    return ForceMap(name, turn, kept[0], kept[1], unit, position_unit, tuple(remarks), gear)


def _geared(wave: Wave, gear: float, amplitude: float) -> Wave:
    """A wave over the motor's angle."""
    rate = wave.rate / gear
    return Wave(amplitude, rate, wave.phase) if rate > 0 else Wave(-amplitude, -rate, -wave.phase)


def _fitting(wave: Wave, turn: float, where: str, unit: str, position_unit: str) -> tuple[Wave | None, Remark]:
    """The wave with a whole number of periods per turn, or None if it is too far from that; and a remark."""
    times = wave.rate * turn / (2 * pi)
    whole, size = round(times), abs(wave.amplitude)
    how = f"{wave.amplitude:.6g} {unit}, {times:.6g} waves over {turn:.6g} {position_unit}"
    if whole and abs(times - whole) < WHOLE:
        return wave, Remark(where, "exact", how)
    if whole and abs(times - whole) < NEARLY:
        taken = replace(wave, rate=2 * pi * whole / turn)
        worst = 2 * size * np.sin(pi * abs(times - whole))  # at the end of the first turn
        how += f": taken as {whole}, so that the table repeats; the error is over the first turn"
        return taken, Remark(where, "nearest", how, float(worst), float(worst / np.sqrt(6)), unit)
    how += ": no whole number, so that a table over it cannot repeat it"
    return None, Remark(where, "dropped", how, size, size / np.sqrt(2), unit)


def csv_map(table: ForceMap, counts: int, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The CSV ``count,position,force,level``, for periodic linear interpolation between counts.

    Raises BadInput for a number of counts out of range.
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
    lines = [*header, *(r.text for r in remarks)]
    return render("export/force_map.csv.j2", header=lines, table=table, rows=rows, counts=counts), remarks


def odrive_map(table: ForceMap, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """A C header with the 3600 torques of ODrive's firmware 0.5.

    The firmware adds entry ⌊3600·position in turns⌋ to the torque without interpolation, so an entry is the mean over
    its interval. ODrive documents neither a file for the map nor a protocol to write it: the table is compiled into the
    firmware. ``table``: of an angle, with torques in N*m: ``force_map`` with ``turning``.
    """
    edges = np.arange(ODRIVE_COUNTS + 1) * 2 * pi / ODRIVE_COUNTS
    waves = (w.amplitude / w.rate * np.cos(w.rate * edges + w.phase) for w in table.forces)
    primitive = sum(waves, np.zeros_like(edges))
    entries = np.diff(primitive) / (2 * pi / ODRIVE_COUNTS)
    fine = (edges[:-1, None] + np.linspace(0, 1, 9) * 2 * pi / ODRIVE_COUNTS).ravel()
    errors = np.repeat(entries, 9) - table.compensation(fine)
    remarks = [*table.remarks, _interpolation(table, "no interpolation between entries", errors)]
    if table.levels:
        size = table.level(fine)
        how = "a level that changes sign with the direction: the map has none"
        remarks.append(Remark.with_errors(f"friction level on {table.coordinate}", "dropped", how, size, table.unit))
    lines = [UserText(line) for line in (*header, *(r.text for r in remarks))]
    values = [f"{value:.9e}f" for value in entries]
    rows = [values[k : k + 6] for k in range(0, len(values), 6)]
    text = render("export/odrive_map.h.j2", header=lines, rows=rows, count=ODRIVE_COUNTS, place=table.place)
    return text, tuple(remarks)


def _interpolation(table: ForceMap, how: str, errors: Array) -> Remark:
    return Remark.with_errors(f"map of {table.coordinate}", "nearest", how, errors, table.unit)


def _sum(waves: tuple[Wave, ...], position: Array) -> Array:
    return sum((w.amplitude * np.sin(w.rate * position + w.phase) for w in waves), np.zeros_like(position))
