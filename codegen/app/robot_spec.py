"""A new spec for a robot file: a URDF, or a MuJoCo model converted to one. A log of the robot gives its ranges."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_DOWN, ROUND_UP
from pathlib import Path
from typing import Any

import numpy as np

from codegen.app.derived import Derived
from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_text
from codegen.base.significant import rounded_to
from codegen.base.temporary import private_folder
from codegen.base.text import render
from codegen.base.user_text import one_line
from codegen.logs.joint_columns import Guess, guess_columns
from codegen.logs.motion import measured_motion
from codegen.logs.readers import log_description, log_names, read_log
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
        content = {"file": json.dumps(file.name), **_template_variables(robot, bodies, guess, log, seen)}
        below = None if euler_below is None else _time(float(rounded_to(euler_below, 2, ROUND_DOWN)))
        return render("text/new_robot_spec.j2", name=name, tracker_gains=tracker_gains, euler_below=below, **content)

    seen, placeholder = _Observed(), ["-1"] * len(bodies)  # gains until the inertia is known
    try:
        spec = parse_spec(rendered(seen, placeholder), target)
        if log is not None:
            seen = _observed_in_log(spec, log)
            spec = parse_spec(rendered(seen, placeholder), target)
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


def _template_variables(
    robot: RobotModel, bodies: Sequence[MovingBody], guess: Guess, log: Path | None, seen: _Observed
) -> Mapping[str, Any]:
    """The variables of the template ``text/new_robot_spec.j2``.

    Args:
        guess: columns of the log.
        seen: sample time and ranges in the log; empty without a log.
    """
    ranges, assumed = _position_ranges(robot, bodies, seen)
    gain = DEFAULT_GAIN if seen.period is None else min(DEFAULT_GAIN, GAIN_STEPS / seen.period)
    return {
        "gravity": list(robot.gravity) if robot.gravity != STANDARD_GRAVITY else None,
        "joints": bodies,
        "ranges": ranges,
        "assumed": assumed,
        "speeds": _speeds(bodies, seen),
        "margin": MARGIN,
        "measured": seen.measured,
        "period": None if seen.period is None else _time(seen.period),
        "unread": seen.remark,
        "gain": f"{gain:.3g}",
        "effects": _effects(robot),
        "remarks": robot.remarks,
        "log": log is not None,
        "columns": {symbol: json.dumps(column) for symbol, column in guess.columns.items()},
        "unmatched": guess.remarks,
    }


def _position_ranges(
    robot: RobotModel, bodies: Sequence[MovingBody], seen: _Observed
) -> tuple[dict[str, list[float]], list[str]]:
    """Joint → range of its position, rad or m; and the joints whose range is assumed.

    The range is that of the limits in the robot file, or an assumed one without these, widened to what the log covers.
    """
    of_mujoco = {joint.joint: joint for joint in robot.joints}
    ranges: dict[str, list[float]] = {}
    assumed = []
    for body in bodies:
        limits = of_mujoco[body.joint].limits if body.joint in of_mujoco else body.limits
        if body.joint not in of_mujoco and limits is not None and max(map(abs, limits)) > MOST_TRAVEL:
            limits = None
        ranges[body.joint] = (
            [float(f"{x:.6g}") for x in limits] if limits else [-3.1, 3.1] if body.kind == "revolute" else [-1, 1]
        )
        if limits is None and body.joint not in seen.positions:
            assumed.append(body.joint)
    for joint, ends in seen.positions.items():
        ranges[joint] = [_rounded_up(min(ranges[joint][0], ends[0])), _rounded_up(max(ranges[joint][1], ends[1]))]
    return ranges, assumed


def _speeds(bodies: Sequence[MovingBody], seen: _Observed) -> dict[str, tuple[float, str]]:
    """Joint → (bound on its speed, rad/s or m/s; the largest speed in the log, with its unit) where it was seen."""
    return {
        body.joint: (
            _rounded_up(MARGIN * seen.speeds[f"v_{body.joint}"]),
            f"{seen.speeds[f'v_{body.joint}']:.4g} {'rad' if body.kind == 'revolute' else 'm'}/s",
        )
        for body in bodies
        if f"v_{body.joint}" in seen.speeds
    }


def _effects(robot: RobotModel) -> list[tuple[str, str, str]]:
    """(kind, joint, ``parameter: value``) of what a URDF cannot state: reflected inertias and springs of the joints."""
    return [
        (kind, joint.joint, f"{name}: {value:.12g}")
        for joint in robot.joints
        for kind, name, value in (
            ("inertia_error", "delta", joint.armature),
            ("spring", "k", joint.stiffness),
            ("offset", "f0", joint.stiffness * joint.rest),
        )
        if value
    ]


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
