"""A spec for a robot file, a URDF or a MuJoCo model converted to one, and the columns of a log of the robot."""

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_DOWN, ROUND_UP
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from codegen.app.derived import Derived
from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_text
from codegen.base.significant import rounded_to
from codegen.base.temporary import private_folder
from codegen.base.text import render
from codegen.base.user_text import one_line, shown
from codegen.logs.binding import time_columns, time_in_two
from codegen.logs.column_names import COMMANDED, is_in_counts, words_for, words_of
from codegen.logs.formats.series import TIME
from codegen.logs.formats.source import listing
from codegen.logs.motion import measured_motion
from codegen.logs.readers import log_description, log_names, read_log
from codegen.logs.term import identifier
from codegen.spec import parse_spec
from codegen.spec.mjcf import STANDARD_GRAVITY, RobotModel, read_mjcf
from codegen.spec.model import Spec
from codegen.spec.motion import MovingBody
from codegen.spec.urdf import LARGEST, read_kinematic_tree

ENDINGS = (".urdf", ".xml")
DEFAULT_GAIN = 100.0
"""K_v in 1/s of a new spec."""
MOST_TRAVEL = 1000.0
"""m or rad; larger limits of a joint in a robot file mean that it has none."""
MARGIN = 1.2
"""Range of a joint's velocity in a new spec over its highest speed in the log."""
GAIN_STEPS = 0.2
"""Largest K_v of a new spec times its sample time."""
OF_A_JOINT = {
    "position": words_for("position", "length", "angle"),
    "velocity": words_for("velocity"),
    "effort": words_for("effort", "force", "torque"),
    "current": words_for("current"),
}
"""What a robot's joint has → usual words of its columns."""


class Guess(NamedTuple):
    """Columns recognised by their names.

    Attributes:
        columns: symbol → column.
        remarks: on variables without a column, and on columns that were not taken.
    """

    columns: Mapping[str, str]
    remarks: tuple[str, ...]


def guess_columns(names: Sequence[str], joints: Mapping[str, str]) -> Guess:
    """Match columns by the joint's name and a word for position, velocity or effort.

    Of several columns, that of the topic with the most columns is taken. A quantity that no joint's name leads to is
    taken by number, in the order of the robot file, where the log has as many numbered columns of it as joints.

    Args:
        names: of the log's columns.
        joints: coordinate → the joint's own name.
    """
    by_use, commanded = _recognised(names, joints)
    numbered = {
        quantity: series
        for quantity in OF_A_JOINT
        if not any((quantity, joint) in by_use for joint in joints)
        and (series := _numbered(names, quantity, len(joints)))
    }
    is_named = any(re.fullmatch(r"(.*\.)?name\[\d+\]", name) for name in names)
    if not is_named:  # else the order of the columns is that of the list, which may not be the robot file's
        by_number = {(q, joint): [name] for q in numbered for joint, name in zip(joints, numbered[q], strict=True)}
        by_use = {**by_use, **by_number}
    topics = Counter(_topic(name) for each in by_use.values() for name in each)
    columns: dict[str, str] = {}
    remarks: list[str] = []
    time = TIME if TIME in names else next(iter([*time_columns(names), *time_in_two(names)]), None)
    if time is None:
        remarks.append("no column of time: `t: COLUMN`, or `sample_time` in meta.yaml beside the log")
    elif time != TIME:
        columns[TIME] = time
    for joint, label in joints.items():
        for quantity, symbol in (("position", joint), ("velocity", f"v_{joint}"), ("effort", f"w_{joint}")):
            found = [symbol] if symbol in names else by_use.get((quantity, joint), [])
            if found:
                found = sorted(found, key=lambda name: -topics[_topic(name)])
                columns[symbol], *others = found
                if others and topics[_topic(found[0])] == topics[_topic(found[1])]:
                    remarks.append(f"{symbol}: {_quoted(others, 40)} would do as well")
            elif quantity == "effort" and (current := by_use.get(("current", joint))):
                as_torque = f"as `{identifier(current[0])}*K`, K the torque it makes"
                remarks.append(f"{symbol}: {_quoted(current[:1], 80)} is a current; {as_torque}")
            else:
                remarks.append(f"{symbol}: no column of {quantity} with the name {shown(label)}")
    remarks += [
        f"{symbol}: {_quoted([name], 80)} holds counts by its name: say their size here, such as "
        f"`scale: {{{symbol}: 2*pi/4096}}` for 4096 counts a turn"
        for symbol, name in columns.items()
        if symbol != TIME and is_in_counts(name)
    ]
    if is_named:
        remarks += [
            f"{_quoted(series, 40)}: {quantity} by number; assign them in the order of the log's list of names"
            for quantity, series in numbered.items()
        ]
    elif used := [name for series in numbered.values() for name in series if name in columns.values()]:
        remarks.append(f"{_quoted(used, 40)}: by number; see that the joints of the log are in the robot file's order")
    without = [f"w_{joint}" for joint in joints if f"w_{joint}" not in columns]
    if commanded:
        remarks.append(f"{_quoted(commanded, 60)}: commanded, not measured; not taken")
    if commanded and without:
        law = f"{without[0]}: 25*({identifier(commanded[0])} - POSITION)"
        remarks.append(f"a commanded position is no torque: the servo's own law makes one of it, such as `{law}`")
    return Guess(columns, tuple(remarks))


def _recognised(
    names: Sequence[str], joints: Mapping[str, str]
) -> tuple[Mapping[tuple[str, str], Sequence[str]], Sequence[str]]:
    """Columns by (quantity, joint), in the order of the file, and the columns of commands."""
    by_use: dict[tuple[str, str], list[str]] = {}
    commanded: list[str] = []
    for name in names:
        words = words_of(name)
        joint = _joint(words, joints)
        rest = {word for word in words if joint is None or word not in words_of(joints[joint])}
        quantity = next((quantity for quantity, known in OF_A_JOINT.items() if known & rest), None)
        if COMMANDED & rest:
            commanded.append(name)
        elif joint is not None and quantity is not None:
            by_use.setdefault((quantity, joint), []).append(name)
    return by_use, commanded


def _numbered(names: Sequence[str], quantity: str, joints: int) -> list[str]:
    """Columns that differ in one number alone, from 0 or 1 up, as many as joints; [] for none or several such.

    A column is of the quantity if a word of its name is one for it, as in ``position[0]``, ``q1`` or ``tau_meas_1``.
    """
    series: dict[tuple[str, str], dict[int, str]] = {}
    for name in names:
        if digits := re.fullmatch(r"(.*?)(\d{1,3})(\D*)", name):
            before, number, after = digits.groups()
            words = set(words_of(f"{before}_{after}"))
            kind = next((kind for kind, known in OF_A_JOINT.items() if known & words), None)
            if kind == quantity and not COMMANDED & words:
                series.setdefault((before, after), {})[int(number)] = name
    complete = [each for each in series.values() if sorted(each) in (list(range(joints)), list(range(1, joints + 1)))]
    return [complete[0][k] for k in sorted(complete[0])] if len(complete) == 1 else []


def _quoted(names: Sequence[str], longest: int) -> str:
    """The first names, as messages quote them."""
    return listing([f"`{shown(name, longest)}`" for name in names], 4)


def _joint(words: Sequence[str], joints: Mapping[str, str]) -> str | None:
    """The joint whose name occurs in the words; of several, that with the longest name."""
    text = f" {' '.join(words)} "
    there = [joint for joint, label in joints.items() if words_of(label) and f" {' '.join(words_of(label))} " in text]
    return max(there, key=lambda joint: len(words_of(joints[joint])), default=None)


def _topic(name: str) -> str:
    return name.partition(".")[0]


@dataclass(frozen=True)
class _Observed:
    """Sample time, speeds and positions of the joints in a log.

    Attributes:
        period: s, the median step; None for a log that could not be read.
        speeds: velocity → the highest speed, SI.
        positions: coordinate → lowest and highest position, SI.
        measured: whether the speeds were logged; else they are derivatives of filtered positions.
        remark: why nothing is known, or "".
    """

    period: float | None = None
    speeds: Mapping[str, float] = field(default_factory=dict)
    positions: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    measured: bool = False
    remark: str = ""


def robot_files(name: str, path: Path, log: Path | None) -> dict[str, str]:
    """File name → text of the spec and of its robot file.

    Args:
        name: of the machine.
        path: a URDF or MJCF file.
        log: the log whose columns the spec names, or None.

    Raises:
        BadInput: for a robot file or a log that cannot be used.
    """
    text = read_text(path, "a robot description (URDF) or a MuJoCo model (MJCF)", LARGEST)
    if "<mujoco" not in text:
        return {f"{name}.yaml": _spec_text(name, RobotModel(text), path, path, log), path.name: text}
    robot = read_mjcf(path)
    with private_folder() as folder:
        file = folder / f"{name}.urdf"
        file.write_text(robot.urdf, encoding="utf-8")
        try:
            written = _spec_text(name, robot, path, file, log)
        except BadInput as error:
            if Path(error.place.file).parent != folder:
                raise
            raise error.at(Place(str(path), None, error.place.key)) from None
    return {f"{name}.yaml": written, file.name: robot.urdf}


def _spec_text(name: str, robot: RobotModel, path: Path, file: Path, log: Path | None) -> str:
    """The spec for a robot file in its folder, which is parsed as a check; its errors are reported for ``path``."""
    bodies = read_kinematic_tree(file, Place(str(file))).bodies
    target, joints = file.with_name(f"{name}.yaml"), {body.joint: body.label for body in bodies}
    guess = Guess({}, ()) if log is None else guess_columns(log_names(log), joints)

    def rendered(seen: _Observed, tracker_gains: Sequence[str], euler_below: float | None = None) -> str:
        content = {"file": json.dumps(file.name), **_content(robot, bodies, guess, log, seen)}
        below = None if euler_below is None else _time(float(rounded_to(euler_below, 2, ROUND_DOWN)))
        return render("text/new_robot_spec.j2", name=name, tracker_gains=tracker_gains, euler_below=below, **content)

    seen, first = _Observed(), ["-1"] * len(bodies)  # until the inertia is known
    try:
        spec = parse_spec(rendered(seen, first), target)
        if log is not None:
            seen = _observed_in_log(spec, log)
            spec = parse_spec(rendered(seen, first), target)
        gains = _tracker_gains(spec)
        written = rendered(seen, gains)
        analysis = Derived(parse_spec(written, target)).analysis
        if not analysis.stable:  # stiff damping: no gain helps, backward Euler is stable at any sample time
            written = rendered(seen, gains, analysis.largest_sample_time)
            parse_spec(written, target)
    except BadInput as error:
        if error.place.file != str(target):
            raise
        found = f"a robot of which no spec can be made: {error.found}"  # the spec is no file yet
        raise BadInput(str(path), found, error.expected, error.nearest, code=error.code) from None
    return written


def _tracker_gains(spec: Spec) -> list[str]:
    """K_2 of each joint, with which the fastest error mode is critically damped.

    With K_2 = −γ D, D the smallest effective inertias 1/(M⁻¹)ᵢᵢ in the envelope, and K_v = k for all joints, each
    eigenvalue λ of γ D M⁻¹ is a mode s² + k s + k λ (``Modes``), if terms with the velocity and damping are left out.
    γ makes the largest λ k/4; its mode then is s = −k/2, and the explicit step is stable for h k < 4.
    """
    machine = Derived(spec)
    n, gains = len(spec.coordinates), machine.observer.gains
    inverse = -machine.dynamics.continuous[:, :n, n:]  # M⁻¹ at points of the envelope
    inertias = 1 / np.diagonal(inverse, axis1=1, axis2=2).max(axis=0)
    root = np.sqrt(inertias)
    largest = np.linalg.eigvalsh(root[:, None] * inverse * root).max()
    velocity_gain = min(float(value) for symbol, value in gains.items() if symbol.name.startswith("K_v"))
    return [f"{-velocity_gain / 4 / largest * inertia:.2g}" for inertia in inertias.tolist()]


def _content(
    robot: RobotModel, bodies: Sequence[MovingBody], guess: Guess, log: Path | None, seen: _Observed
) -> Mapping[str, Any]:
    beyond = {joint.joint: joint for joint in robot.joints}
    ranges, assumed = {}, []
    for body in bodies:
        limits = beyond[body.joint].limits if body.joint in beyond else body.limits
        if body.joint not in beyond and limits is not None and max(map(abs, limits)) > MOST_TRAVEL:
            limits = None
        ranges[body.joint] = (
            [float(f"{x:.6g}") for x in limits] if limits else [-3.1, 3.1] if body.kind == "revolute" else [-1, 1]
        )
        if limits is None and body.joint not in seen.positions:
            assumed.append(body.joint)
    for joint, ends in seen.positions.items():
        ranges[joint] = [_rounded_up(min(ranges[joint][0], ends[0])), _rounded_up(max(ranges[joint][1], ends[1]))]
    speeds = {
        body.joint: (
            _rounded_up(MARGIN * seen.speeds[f"v_{body.joint}"]),
            f"{seen.speeds[f'v_{body.joint}']:.4g} {'rad' if body.kind == 'revolute' else 'm'}/s",
        )
        for body in bodies
        if f"v_{body.joint}" in seen.speeds
    }
    gain = DEFAULT_GAIN if seen.period is None else min(DEFAULT_GAIN, GAIN_STEPS / seen.period)
    return {
        "gravity": list(robot.gravity) if robot.gravity != STANDARD_GRAVITY else None,
        "joints": bodies,
        "ranges": ranges,
        "assumed": assumed,
        "speeds": speeds,
        "margin": MARGIN,
        "measured": seen.measured,
        "period": None if seen.period is None else _time(seen.period),
        "unread": seen.remark,
        "gain": f"{gain:.3g}",
        "effects": [
            (kind, joint.joint, f"{name}: {value:.12g}")
            for joint in robot.joints  # what a URDF cannot describe
            for kind, name, value in (
                ("inertia_error", "delta", joint.armature),
                ("spring", "k", joint.stiffness),
                ("offset", "f0", joint.stiffness * joint.rest),
            )
            if value
        ],
        "remarks": robot.remarks,
        "log": log is not None,
        "columns": {symbol: json.dumps(column) for symbol, column in guess.columns.items()},
        "unmatched": guess.remarks,
    }


def _observed_in_log(spec: Spec, path: Path) -> _Observed:
    """Read positions and velocities by the spec's ``log:``; joints and inputs that the log lacks are left out."""
    try:
        named = {*spec.log.columns, *log_description(path, None).columns}
        joints = tuple(c for c in spec.coordinates if c.name in named)
        if not joints:
            return _Observed(remark="no joint's position was found in it")
        log = read_log(path, replace(spec, coordinates=joints, inputs=tuple(i for i in spec.inputs if i.name in named)))
    except BadInput as error:
        return _Observed(remark=one_line(f"{error.found}; expected {error.expected}"))
    velocities = log.velocities if log.velocities is not None else measured_motion(log).velocities
    tops = np.abs(velocities).max(axis=0, initial=0.0).tolist()
    ends = zip(log.positions.min(axis=0).tolist(), log.positions.max(axis=0).tolist(), strict=True)
    return _Observed(
        float(np.float64(log.sample_time)),
        {c.velocity: top for c, top in zip(joints, tops, strict=True) if top > 0},
        {c.name: pair for c, pair in zip(joints, ends, strict=True)},
        log.velocities is not None,
    )


def _rounded_up(value: float) -> float:
    """Rounded to three digits, away from zero."""
    return float(rounded_to(value, 3, ROUND_UP))


def _time(seconds: float) -> str:
    return f"{1000 * seconds:.6g} ms" if seconds < 1 else f"{seconds:.6g} s"
