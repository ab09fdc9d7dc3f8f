"""The part of a fit that is one joint's, of an arm that is run joint by joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.output_error import Shot, Starts

Array = NDArray[np.float64]


def rows_of(shot: Shot, joint: int) -> slice:
    """Where the rows of a joint stand among those of a fit."""
    joints = shot.runner.record.joints
    assert joints is not None
    return slice(joints.index(joint), None, len(joints))


def of_joint(shot: Shot, joint: int) -> Shot:
    """The fit on the rows of one joint; its theta stays that of all."""
    rows, starts = rows_of(shot, joint), shot.starts
    return replace(
        shot,
        runner=replace(shot.runner, record=replace(shot.runner.record, joints=(joint,))),
        offsets=shot.offsets[rows],
        residual=shot.residual[rows],
        slopes=shot.slopes[:, rows],
        starts=Starts(starts.slopes[rows], starts.solver[rows], starts.width[rows]),
    )


def started_as(shot: Shot, other: Shot, joint: int) -> Shot:
    """The fit with the start states of one joint as another fit of that joint alone has them."""
    rows, own, new = rows_of(shot, joint), shot.starts, other.starts
    offsets, slopes, solver, width = (a.copy() for a in (shot.offsets, own.slopes, own.solver, own.width))
    offsets[rows], slopes[rows], solver[rows], width[rows] = other.offsets, new.slopes, new.solver, new.width
    return replace(shot, offsets=offsets, starts=Starts(slopes, solver, width))
