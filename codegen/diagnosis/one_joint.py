"""The part of a fit that belongs to one joint of an arm that is run joint by joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.output_error import Fit, Starts

Array = NDArray[np.float64]


def rows_of(fit: Fit, joint: int) -> slice:
    """The rows of a joint among those of a fit."""
    joints = fit.runner.record.joints
    assert joints is not None
    return slice(joints.index(joint), None, len(joints))


def of_joint(fit: Fit, joint: int) -> Fit:
    """The fit restricted to the rows of one joint; its theta is unchanged."""
    rows, starts = rows_of(fit, joint), fit.starts
    return replace(
        fit,
        runner=replace(fit.runner, record=replace(fit.runner.record, joints=(joint,))),
        offsets=fit.offsets[rows],
        unprojected=fit.unprojected[rows],
        residual=fit.residual[rows],
        slopes=fit.slopes[:, rows],
        starts=Starts(starts.slopes[rows], starts.solver[rows], starts.width[rows]),
    )


def started_as(fit: Fit, other: Fit, joint: int) -> Fit:
    """The fit with the start states of one joint taken from another fit of that joint."""
    rows, own, new = rows_of(fit, joint), fit.starts, other.starts
    offsets, slopes, solver, width = (a.copy() for a in (fit.offsets, own.slopes, own.solver, own.width))
    offsets[rows], slopes[rows], solver[rows], width[rows] = other.offsets, new.slopes, new.solver, new.width
    return replace(fit, offsets=offsets, starts=Starts(slopes, solver, width))
