"""Where effects act on an arm that is simulated joint by joint, and fits compared at that joint alone.

Evidence taken over all joints would compare an effect at one joint with the unexplained forces of the others.
"""

from __future__ import annotations

from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part


def joint_of(search: Search, part: Part) -> int | None:
    """Index of the joint on which an effect acts, the first of two; None of a machine that is simulated as a whole."""
    return part.effect.coordinate(search.system, part.place) if search.rigid else None


def where_they_differ(search: Search, one: Fit, other: Fit) -> tuple[Fit, Fit]:
    """Two fits on the joint on which their effects differ; as they are where that is not one joint alone."""
    joint = joint_of_difference(search, one, other)
    return (one, other) if joint is None else (one.of_joint(joint), other.of_joint(joint))


def joint_of_difference(search: Search, one: Fit, other: Fit) -> int | None:
    """The joint on which the effects of two fits differ; None where that is not one joint alone."""
    if search.rigid is None:
        return None
    effects = [{(p.kind, p.on, p.names): p for p in fit.trial.parts} for fit in (one, other)]
    differing = [p for own, known in (effects, effects[::-1]) for key, p in own.items() if key not in known]
    joints = {joint_of(search, p) for p in differing}
    is_one = len(joints) == 1 and not any(p.effect.sits_on == "two coordinates" for p in differing)
    return joints.pop() if is_one else None
