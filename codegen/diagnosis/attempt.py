"""Every effect at every place beside what was found: screened on few segments, and the best fitted on all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.coverage import survey
from codegen.diagnosis.credit import NEAR_NOISE, level, noise_loss
from codegen.diagnosis.force_start import ForceStart
from codegen.diagnosis.models import with_values
from codegen.diagnosis.one_joint import of_joint, rows_of, started_as
from codegen.diagnosis.output_error import Shot, again, fit, raw_slopes, state_slopes
from codegen.diagnosis.screen import settled, starting_points
from codegen.diagnosis.search import ROUNDS, Search
from codegen.diagnosis.side_by_side import side_by_side
from codegen.diagnosis.trial import Part, Trial, part_of
from codegen.effects.family import candidates
from codegen.effects.register import is_own
from codegen.effects.start import Covered

Array = NDArray[np.float64]

SCREENED_SAMPLES = 9000
LEAST_SCREENED = 60
"""Segments: candidates are first tried on every so many of them, then the best on all."""
NEAR, SHORTEST = 30.0, 0.2
"""In noise: where the refit's error is larger, candidates are first tried on shorter segments, on which a free run
stays near the measured motion (error grows with the square of time)."""
LEAST_EXCESS = 0.05
"""Of the loss above noise that the worst joint of an arm has: joints with less wait for a later round."""
FIRST_ROUNDS = 4
PROMISING, BY_FORCE = 8, 4
"""Parts with a scale that are fitted on few segments: so many that gain most by one linear step of the free runs, and
so many that leave least of the force residual."""
AS_GOOD = 0.5
"""Share of the best start's gain from which on another start of the same part is followed too."""
FITTED = 6
POLISHES, MOVING = 4, 0.01
"""Fresh slopes of the segments' starts for each of those, at most so often, while the cost falls by such a share."""
JOINED = 2
"""Steps on all joints of an arm, once a part is fitted on its own."""

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Found:
    """A candidate with its fit; the part on trial is the last one."""

    trial: Trial
    shot: Shot

    @property
    def part(self) -> Part:
        return self.trial.parts[-1]

    @property
    def parameters(self) -> dict[str, float]:
        return self.trial.split(self.shot.theta)[1][-1]


def every_part(search: Search, taken: Sequence[Part]) -> list[Part]:
    """Effects at their places that the log can show, less those taken; richer forms of a kind are not tried alone."""
    known, changed = {(p.kind, p.on) for p in taken}, replace(search.nothing, parts=tuple(taken)).changed
    parts = [part_of(effect, place, search.system) for effect, place in candidates(changed) if not effect.refines]
    return [p for p in parts if (p.kind, p.on) not in known and (not p.effect.both_ways or search.turns[p.place])]


def attempt(search: Search, base: Shot, parts: Sequence[Part], tell: Progress) -> list[Found]:
    """Each part added to the base's trial and fitted; best first."""
    tried = Attempt(search, base, tuple(parts), tell)
    parts = tried.parts
    smooth = [k for k, part in enumerate(parts) if not part.effect.rough]
    screened = [s for s in side_by_side(tried.screened, tried.promising(smooth)) if s]
    gains = sorted(map(tried.gain, screened), reverse=True)
    tried.least_gain = max([0.0, *gains[FITTED - 1 : FITTED]])
    rough = [k for k in range(len(parts)) if k not in smooth]
    screened += [s for s in side_by_side(tried.screened, rough) if s]
    screened.sort(key=tried.gain, reverse=True)
    kept = [s for rank, s in enumerate(screened) if rank < FITTED or is_own(parts[s[0]].kind)]
    found = side_by_side(tried.fitted, kept)
    return sorted(found, key=lambda f: f.shot.cost)


@dataclass(eq=False)
class Attempt:
    """Parts tried beside one base.

    Attributes:
        starts: by index of the part, where they were looked for already.
        forced: by index of the part, where the force residual starts it, above the noise.
        left: by index of the part, what that start leaves of the force residual, squared.
        couplings: by coordinate, the spring between motor and load that was fitted there.
        few: by joint of an arm that is run joint by joint, else under None: what parts there are first tried beside.
        least_gain: by which a part with a rough loss must lower the cost at its start for its search to be worth it.
    """

    search: Search
    base: Shot
    parts: tuple[Part, ...]
    tell: Progress
    done: int = 0
    couplings: dict[int, dict[str, float]] = field(default_factory=dict)
    starts: dict[int, list[tuple[float, Array]]] = field(default_factory=dict)
    forced: dict[int, list[Array]] = field(default_factory=dict)
    left: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        joints = {self._joint(part) for part in self.parts}
        self.few = {joint: _Few(_screening(self.search, self.base, joint)) for joint in joints}
        self.parts = tuple(part for part in self.parts if self._is_worth_trying(part))
        self.trials = [self.base.runner.trial.with_part(part) for part in self.parts]
        self.runners = self.search.runners(self.trials)
        self.raw = raw_slopes(self.base)
        self.levels = [float(v) for v in self.base.runner.trial.split(self.base.theta)[0]]
        self.least_gain = 0.0
        names = [s.name for s in self.search.moved]
        refit = with_values(self.search.system, dict(zip(names, self.levels, strict=True)))
        self.survey = survey(refit, self.search.motion)
        if level(self.base) > NEAR_NOISE:
            self.forced = self._by_force()

    def promising(self, indices: Sequence[int]) -> list[int]:
        """Of these parts those to be fitted: the best by what one linear step from their best start gains.

        An effect that nothing scales starts from a coarse grid of values, which says too little: it is always fitted.
        """
        starts = dict(zip(indices, side_by_side(self._starts, indices), strict=True))
        self.starts |= starts
        gains = {k: self._few(k).shot.cost - starts[k][0][0] if starts[k] else -np.inf for k in indices}
        scaled = [k for k in indices if self.parts[k].effect.scaling and not is_own(self.parts[k].kind)]
        by_force = sorted((k for k in scaled if k in self.left), key=self.left.__getitem__)[:BY_FORCE]
        left_out = sorted(scaled, key=lambda k: -gains[k])[PROMISING:]
        chosen = [k for k in indices if k not in left_out or k in by_force]
        self.done += len(indices) - len(chosen)
        return chosen

    def _by_force(self) -> dict[int, list[Array]]:
        """One after the other: CasADi builds expressions in one thread."""
        start, found = ForceStart(self.search.problem, self.base), {}
        for k, part in enumerate(self.parts):
            covered = self.covered(part)
            stage = start.best(self.trials[k], covered)
            others = part.effect.suggested(covered)
            found[k] = [np.append(self.base.theta, part.inward(values)) for values in others]
            if stage is not None:
                self.left[k], theta = stage
                found[k].append(theta)
        return found

    def covered(self, part: Part) -> Covered:
        """What the log covers where a part sits."""
        return self.survey.covered(part, self.levels, self.search.record.noise, self.couplings.get(part.place))

    def _starts(self, k: int) -> list[tuple[float, Array]]:
        """(cost by one linear step, theta) of the best starts of part ``k`` on few segments."""
        few, part = self._few(k), self.parts[k]
        runner = replace(self.runners[k], record=few.shot.runner.record)
        return starting_points(runner, few.shot, few.raw, self.covered(part), 3 if len(part.names) > 2 else 2)

    def screened(self, k: int) -> tuple[int, Shot] | None:
        """Part ``k`` fitted on few segments from its best starts; None where none is worth it."""
        few = self._few(k)
        part, runner = self.parts[k], replace(self.runners[k], record=few.shot.runner.record)
        starts = self.starts[k] if k in self.starts else self._starts(k)
        if part.effect.rough:
            near = [theta for cost, theta in starts if cost < few.shot.cost - self.least_gain]
            starts = [settled(runner, few.shot, few.raw, theta) for theta in near]
        elif part.effect.scaling and starts:
            enough = few.shot.cost - AS_GOOD * max(few.shot.cost - starts[0][0], 0.0)
            starts = [starts[0], *(s for s in starts[1:] if s[0] < enough)]
        thetas = [*(theta for _, theta in starts), *self.forced.get(k, [])]
        fits = [self.search.fit_from(runner, theta, few.shot, FIRST_ROUNDS, few.raw) for theta in thetas]
        self._tell_one_more()
        if not fits:
            return None
        best = min(fits, key=lambda shot: shot.cost)
        coupling = part.effect.coupling(self.trials[k].split(best.theta)[1][-1])
        if coupling is not None:
            self.couplings[part.place] = coupling
        return k, best

    def fitted(self, screened: tuple[int, Shot]) -> Found:
        """The part on all segments, with fresh slopes of their starts while that helps."""
        k, start = screened
        joint = self._joint(self.parts[k])
        if joint is None:
            shot = self._polished(k, start.theta, self.base, self.raw)
        else:
            rows = rows_of(self.base, joint)
            alone = self._polished(k, start.theta, of_joint(self.base, joint), [slope[rows] for slope in self.raw])
            base = started_as(self.base, alone, joint)
            shot = self.search.fit_from(self.runners[k], alone.theta, base, JOINED, self.raw)
        self._tell_one_more()
        return Found(self.trials[k], shot)

    def _polished(self, k: int, theta: Array, base: Shot, raw: Sequence[Array]) -> Shot:
        """Part ``k`` fitted beside a base, with fresh slopes of the starts while that helps."""
        runner = replace(self.runners[k], record=base.runner.record)
        shot, before = self.search.fit_from(runner, theta, base, ROUNDS, raw), np.inf
        for _ in range(POLISHES):
            if shot.cost > (1 - MOVING) * before:
                break
            before = shot.cost
            shot = again(shot, ROUNDS, *self.search.sizes(self.trials[k], shot.theta))
        return shot

    def _is_worth_trying(self, part: Part) -> bool:
        """Whether the base leaves enough at the joint on which a part acts."""
        excess = {joint: few.shot.cost - noise_loss(few.shot) for joint, few in self.few.items()}
        return is_own(part.kind) or excess[self._joint(part)] >= LEAST_EXCESS * max(excess.values())

    def gain(self, screened: tuple[int, Shot]) -> float:
        """By how much a part lowers the cost of the segments that it was tried on."""
        k, shot = screened
        return self._few(k).shot.cost - shot.cost

    def _few(self, k: int) -> _Few:
        return self.few[self._joint(self.parts[k])]

    def _joint(self, part: Part) -> int | None:
        """On which a part acts, of an arm that is run joint by joint."""
        return part.effect.coordinate(self.search.system, part.place) if self.search.rigid else None

    def _tell_one_more(self) -> None:
        self.done += 1
        self.tell(min(1.0, self.done / (len(self.parts) + FITTED)))


class _Few:
    """The base on few segments, and the raw slopes of its parameters there."""

    def __init__(self, shot: Shot) -> None:
        self.shot, self.raw = shot, raw_slopes(shot)


def _screening(search: Search, base: Shot, joint: int | None) -> Shot:
    """The base on fewer and, where it is far from the data, shorter segments; of one joint alone where one is given."""
    left = base.by_segment
    if joint is not None and base.runner.record.joints is not None:
        left = left.reshape(-1, len(base.runner.record.joints))[:, base.runner.record.joints.index(joint)]
    level = float(np.sqrt(np.median(left) / base.residual.shape[1]))
    record = search.shorter(float(np.clip(np.sqrt(NEAR / max(level, NEAR)), SHORTEST, 1.0)))
    segments = len(record.start)
    every = max(1, min(segments * record.length // SCREENED_SAMPLES, segments // LEAST_SCREENED))
    few = replace(record, start=np.ascontiguousarray(record.start[::every]))
    few = few if joint is None else replace(few, joints=(joint,))
    runner, zero = replace(base.runner, record=few), few.at_rest
    size, reach = search.sizes(runner.trial, base.theta)
    starts = state_slopes(runner, base.theta, zero)
    prior = base.price, base.centre
    return fit(runner, base.theta, zero, starts, *prior, FIRST_ROUNDS, (), size, reach, base.tempering)
