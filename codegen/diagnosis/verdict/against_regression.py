"""The objection to effects of a nonparametric regression: what curves without a law explain of the force residual."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.residual_regression import (
    explained_over,
    peak_hz,
    remainder_columns,
    sliding,
)
from codegen.diagnosis.fit.acceptance import is_far
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.linear import regressed, rms
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem, without_levels
from codegen.diagnosis.results import Change, FoundEffect, worded
from codegen.diagnosis.verdict.wrong_values import FAR_LESS
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of
from codegen.mechanics.system import System

VARIABLES = {
    "velocity": "speed",
    "position": "position",
    "load": "load",
    "acceleration": "acceleration",
    "input": "load",
    "input rate": "input rate",
    "time": "time",
}
"""Variable on which an effect depends most → variable of the flexible regression."""
OF_THE_MOTION = 0.02
"""Share of the squared velocity at a line of the spectrum above which the machine is moved with this frequency."""
SLOW_MOTION = 0.5
"""Share of the squared velocity that a curve over time explains above which it may be a curve over the motion."""
MOST = 0.5
"""Least share, of what a flexible regression on an effect's own variable explains, that the effect must remove."""


@dataclass(frozen=True)
class OtherCause:
    """Shares of a squared force residual that effects explain, and something else, which ``what`` names.

    Attributes:
        alone: by the other. by_law: by the force of the effects. both: by the two together.
    """

    what: str
    alone: float
    by_law: float
    both: float

    @property
    def makes_needless(self) -> bool:
        """Whether the effects explain little in addition to the other."""
        return self.both - self.alone < MOST * self.by_law

    @property
    def words(self) -> str:
        """The objection to the effects."""
        more = max(0.0, self.both - self.alone)
        return worded("other cause", what=self.what, alone=self.alone, by_law=self.by_law, more=more)


@dataclass(frozen=True)
class ForceEvidence:
    """Shares of the squared force residual on one coordinate.

    Attributes:
        removed: that the augmented model removes of the refit's. own: that a flexible regression on the effects' own
            variables explains on held-out parts.
        vibration: the highest line of the residual's spectrum, on held-out parts, without a constant in proportion to
            that of the effects' force; zero if the motion has that line too.
        drift: a smooth curve over time, on held-out parts; zero if the motion is as slow.
    """

    removed: float
    own: float
    vibration: OtherCause
    drift: OtherCause


def force_evidence(
    problem: Problem, refit: System, augmented: System, kinds: Sequence[str], acting: Collection[int]
) -> list[ForceEvidence]:
    """The evidence for effects of these kinds, on each coordinate on which they act."""
    motion = problem.motion
    before, after = (residual_at_drive(s, motion) for s in (refit, augmented))
    own = {VARIABLES[CATALOGUE[kind].seen_over] for kind in kinds}
    found = []
    for i in sorted(set(acting)):
        used = sliding(refit, motion, problem.used, i)
        over = remainder_columns(refit, motion, before, used, i)
        r, left = (without_levels(refit, motion, used, y[:, i], i) for y in (before, after))
        removed = 1 - float(np.sum(left[used] ** 2) / max(float(np.sum(r[used] ** 2)), 1e-300))
        together = explained_over(r, used, [over(name) for name in sorted(own)])
        force, speed = (r - left)[:, None], motion.velocities[:, i]
        force = force / max(rms(force[used]), 1e-300)  # the ridge is that of columns near 1, in any unit
        by_law = explained_over(r, used, [force])
        shares = list[float]()
        for name, most in (("frequency", OF_THE_MOTION), ("time", SLOW_MOTION)):
            columns = over(name)
            moves = explained_over(speed, used, [columns]) > most
            shares += [0.0 if moves else explained_over(r, used, group) for group in ([columns], [columns, force])]
        line, with_line, time, with_time = shares
        # the constant of the regression over the line is not the vibration's, where the law's own force is constant
        own_constant = float(np.mean(force[used])) ** 2 * explained_over(r, used, [np.ones_like(force)])
        line = max(0.0, line - own_constant)
        hz = peak_hz(before[:, i], used, motion)
        vibration = OtherCause(f"a vibration of constant frequency, {hz:.3g} Hz,", line, by_law, with_line)
        drift = OtherCause("a slow change in time", time, by_law, with_time)
        found.append(ForceEvidence(removed, together, vibration, drift))
    return found


def along_intervals(changes: Sequence[Change], time: Array) -> list[Array]:
    """(N, 3) polynomials of degree 2 in time for each interval, since a push is not constant; zero outside of it."""
    found = list[Array]()
    for c in changes:
        inside = (time >= c.start) & (time < c.stop)
        along = (time - c.start) / (c.stop - c.start) - 0.5
        found.append(np.where(inside, along ** np.arange(3)[:, None], 0.0).T)
    return found


def fitted_share(r: Array, used: NDArray[np.bool_], columns: Sequence[Array]) -> float:
    """Share of a squared residual that these columns, (N, m) each, remove by least squares."""
    if not columns:
        return 0.0
    y = r[used]
    left = regressed(y, np.column_stack(columns)[used])[1]
    return 1 - float(left @ left) / max(float(y @ y), 1e-300)


def acts_on(effect: FoundEffect, system: System) -> int:
    """Index of the coordinate on which an effect acts most (``Effect.coordinate``)."""
    kind = CATALOGUE[effect.kind].with_parameters(list(effect.parameters))
    return kind.coordinate(system, places_of(kind, system).index(effect.on))


def against_regression(
    final: Fit, problem: Problem, refit: System, augmented: System, named: Sequence[FoundEffect]
) -> str:
    """The objection of a nonparametric regression to effects, in words; empty if there is none.

    There are three objections. Backlash is exempt.

    - A smooth curve over the effects' own variables explains much more than they do (not tested near the noise of the
      free runs).
    - A spectral line, a vibration in time, explains more, and the effects explain little in addition. A controller
      reacts to a vibration, so a delayed input can cancel it down to a few times the noise. Near the noise the line
      must leave less than ``FAR_LESS`` of the square that the effects leave.
    - A slow change in time leaves less than ``FAR_LESS`` of the square that the effects leave, and they explain little
      in addition. What a true effect leaves is noise, which no such curve explains.
    """
    if any(t.gap != 0 for t in augmented.transmissions):
        return ""
    near = not is_far(final)
    acting = [acts_on(effect, problem.system) for effect in named]
    for one in force_evidence(problem, refit, augmented, [effect.kind for effect in named], acting):
        if not near and one.removed < MOST * one.own:
            return "a smooth curve over its own variable explains twice as much of the residual force as the law does"
        for other, most in ((one.vibration, FAR_LESS if near else 1.0), (one.drift, FAR_LESS)):
            if 1 - other.alone < most * (1 - other.by_law) and other.makes_needless:
                return other.words
    return ""
