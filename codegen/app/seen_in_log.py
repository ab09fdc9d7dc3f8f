"""What a log shows of how a robot is run: its sample time, and how far and how fast each joint moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from codegen.base.errors import BadInput
from codegen.base.user_text import one_line
from codegen.logs.motion import measured_motion
from codegen.logs.readers import log_description, read_log
from codegen.spec.model import Spec

MARGIN = 1.2
"""Times the highest speed of a joint in the log is its range of velocity."""


@dataclass(frozen=True)
class Seen:
    """What the log shows.

    Attributes:
        period: s, the median step of its times; None where it could not be read.
        speeds: velocity → the highest speed, SI; positions: coordinate → lowest and highest. Of the joints in the log.
        measured: whether the speeds are those that were logged, and not slopes of filtered positions.
        remark: why nothing is known, or "".
    """

    period: float | None = None
    speeds: Mapping[str, float] = field(default_factory=dict)
    positions: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    measured: bool = False
    remark: str = ""


def seen_in_log(spec: Spec, path: Path) -> Seen:
    """Read the positions and velocities that the spec's ``log:`` names; inputs that the log lacks are not missed."""
    try:
        named = {*spec.log.columns, *log_description(path, None).columns}
        joints = tuple(c for c in spec.coordinates if c.name in named)
        if not joints:
            return Seen(remark="no joint's position was found in it")
        log = read_log(path, replace(spec, coordinates=joints, inputs=tuple(i for i in spec.inputs if i.name in named)))
    except BadInput as error:
        return Seen(remark=one_line(f"{error.found}; expected {error.expected}"))
    velocities = log.velocities if log.velocities is not None else measured_motion(log).velocities
    tops = np.abs(velocities).max(axis=0, initial=0.0).tolist()
    ends = zip(log.positions.min(axis=0).tolist(), log.positions.max(axis=0).tolist(), strict=True)
    return Seen(
        float(np.float64(log.sample_time)),
        {c.velocity: top for c, top in zip(joints, tops, strict=True) if top > 0},
        {c.name: pair for c, pair in zip(joints, ends, strict=True)},
        log.velocities is not None,
    )
