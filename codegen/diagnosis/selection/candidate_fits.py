"""Fits of all candidate effects in a round of forward selection: first on few segments, then the best on all."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from codegen.base.arrays import Array
from codegen.base.parallel import in_processes
from codegen.base.progress import share_display
from codegen.diagnosis.evidence.coverage import survey
from codegen.diagnosis.fit.acceptance import FAR, near_noise, noise_loss, share_far
from codegen.diagnosis.fit.output_error import Fit, polish, shooting_fit
from codegen.diagnosis.fit.search import ROUNDS, Search, joint_of
from codegen.diagnosis.fit.starting_values import (
    MORE_TRIES,
    ForceStart,
    best_starts,
    simplex_search,
    starting_points,
)
from codegen.diagnosis.fit.trial import Part, Runner, part_of, with_values
from codegen.effects import CATALOGUE, Effect
from codegen.effects.nameless import effect_called
from codegen.effects.register import candidates, is_own
from codegen.effects.start import Covered

SCREENED_SAMPLES = 9000
LEAST_SCREENED = 60
"""Candidates are first fitted on about ``SCREENED_SAMPLES`` samples, and at least ``LEAST_SCREENED`` segments."""
RARE = 4
"""Segments in which the base is far above the noise are added to those at equal distances, at most about one for so
many; otherwise an effect that acts rarely, such as saturation, could be missed."""
NEAR, SHORTEST = 30.0, 0.2
"""Ratio of the refit's error to the noise above which candidates are first fitted on shorter segments, and the least
share of their length. The error of a free-run simulation grows with the square of time."""
COARSE = 25
"""Least time steps in a period of the cutoff on few segments, if the base is more than ``FAR`` times the noise from the
data: half of those of other free runs, and fewer rows of a dense log. The error is small compared with such a residual.
"""
LEAST_EXCESS = 0.05
"""Share of the worst joint's loss above the noise below which no effect on another joint is tried in a round of the
force residual, to save time; these effects count as hypotheses, since the log makes the choice. A round of free runs
has one joint; it tries nothing where that leaves no loss above the noise."""
FIRST_ROUNDS = 4
PROMISING, BY_FORCE = 8, 4
"""Numbers of scalable effects that are fitted on few segments: those with the largest gain by one linear step of the
free runs, and those with the least remaining force residual."""
AS_GOOD = 0.5
"""Share of the best gain on few segments from which on another start of the same effect is also fitted, and another
candidate where only the best one is of use."""
FITTED = 6
FITTED_BY_FORCE, CLEAR_BY_FORCE = 2, 0.5
"""Numbers of candidates that are fitted on all segments: those with the largest gain on few segments, and those that
explain most of the force residual, if at least the share ``CLEAR_BY_FORCE`` of its square."""
POLISHES, MOVING = 4, 0.01
"""Most new computations of the slopes by the start states, and least relative decrease of the cost by each."""
FORM_GAIN = 10.0
"""Nats by which a form with more parameters must fit better than a simpler one of the same effect, and a special form
better than the usual form of this effect or of another."""
AGAIN = 3
"""Gauss–Newton steps on few segments from each of the values from which a candidate is fitted again."""
FOLLOWED = 2
"""Number of starts of a load: those along the measured motion with the least remaining force residual."""
START_SHARE = 0.3
"""Least gain at the start of a candidate whose loss is not smooth, over the gain of the last fitted candidate."""
LEAST_GAIN = 10.0
"""Least improvement of the base in nats at which a candidate whose loss is not smooth is fitted again."""
JOINED = 2
"""Gauss–Newton steps on all joints of an arm after an effect was fitted on its own joint."""

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Screened:
    """A part, by its index, fitted on few segments: the decrease of the cost, and its values."""

    index: int
    gain: float
    theta: Array


def every_part(search: Search, taken: Sequence[Part]) -> list[Part]:
    """Effects at all places that the log can show, without those already taken and refined forms of a kind."""
    known, changed = {p.key for p in taken}, replace(search.declared_trial, parts=tuple(taken)).changed
    possible = [(form, place) for effect, place in candidates(changed) if not effect.refines for form in effect.forms]
    forms = [(form, place) for form, place in possible if form.is_tried(changed, place)]
    parts = [part_of(form, place, search.system) for form, place in forms]
    if search.rigid:
        parts = [p for p in parts if joint_of(search, p) in (search.record.joints or ())]
    return [p for p in parts if p.key not in known and (not p.effect.both_ways or search.reverses[p.place])]


def start_compiling(search: Search) -> None:
    """Start the C compiler on the declared model and on the models of the first round of selection.

    The latter are compiled while the declared model is refitted. For an arm that is simulated joint by joint they are
    not started, since the refit decides at which joints effects are tried.
    """
    trial = search.declared_trial
    search.runners([trial])
    if search.rigid is None:
        search.runners([trial.with_part(part) for part in every_part(search, ())])


def fit_candidates(
    search: Search,
    base: Fit,
    parts: Sequence[Part],
    present: Fit | None = None,
    leading: bool = False,
) -> list[Fit]:
    """Fits of the base's trial with each part added, each form of an effect separately; the best first.

    Args:
        present: a fit that a candidate must equal to be of use, as that with the effect which it may replace.
        leading: whether only the best one is of use. Candidates with less than the share ``AS_GOOD`` of the gain of
            ``present``, or of the best one, on few segments are then not fitted on all.
    """
    tried = CandidateFits(search, base, tuple(parts))
    tried.start_compiling()
    parts = tried.parts
    smooth = [k for k, part in enumerate(parts) if not part.effect.rough]
    screened = tried.screened(tried.promising(smooth))
    gains = sorted((s.gain for s in screened), reverse=True)
    tried.least_gain = START_SHARE * max([0.0, *gains[FITTED - 1 : FITTED]])
    screened += tried.screened([k for k in range(len(parts)) if k not in smooth])
    screened.sort(key=lambda s: s.gain, reverse=True)
    if screened and (leading or present is not None):
        best = screened[0].gain if present is None else max(screened[0].gain, tried.gain_of(present, screened[0].index))
        screened = [s for s in screened if s.gain >= AS_GOOD * best]
    by_force = tried.best_by_force([s.index for s in screened])
    kept = [s for n, s in enumerate(screened) if n < FITTED or s.index in by_force or is_own(parts[s.index].kind)]
    found = sorted(tried.fitted(kept), key=lambda f: f.cost)
    again, others = ([one for one in found if one.part.effect.rough is rough] for rough in (True, False))
    return sorted([*tried.restarted(again), *others], key=lambda f: f.cost)


def in_simplest_forms(found: Sequence[Fit]) -> list[Fit]:
    """The fits without forms of an effect if a simpler form of the same effect fits as well."""
    return [f for f in found if not any(other is not f and is_simpler_form(other, f) for other in found)]


def is_simpler_form(other: Fit, found: Fit) -> bool:
    """Whether a candidate is a simpler effect than another one, on the same coordinate or input, and fits as well.

    Simpler is the same effect with fewer parameters, its usual form with as many, or the effect that the other extends.
    """
    one, richer = other.part, found.part
    if one.on != richer.on or one.kind not in (richer.kind, richer.effect.extends):
        return False
    usual = one.kind == richer.kind and is_usual_form(one) and not is_usual_form(richer)
    simpler = len(one.names) < len(richer.names) or (usual and len(one.names) == len(richer.names))
    return simpler and other.cost <= found.cost + FORM_GAIN


def simpler_forms(part: Part) -> list[Effect]:
    """What is simpler than an effect, the simplest first: its simpler forms, and the effect that it extends."""
    usual, *special = effect_called(part.kind).forms
    simpler = [form for form in special if len(form.parameters) < len(part.names)]
    first = [] if is_usual_form(part) or len(usual.parameters) > len(part.names) else [usual]
    return [*first, *simpler, *([CATALOGUE[part.effect.extends]] if part.effect.extends else [])]


def is_usual_form(part: Part) -> bool:
    """Whether an effect has the first form of its kind."""
    return list(part.names) == [p.name for p in effect_called(part.kind).forms[0].parameters]


@dataclass(eq=False)
class CandidateFits:
    """Candidates added to one base fit.

    Attributes:
        starts_by_runs: index of a part → (cost after one linear step, starting point) by free runs on few segments.
        starts_by_force: index of a part → starting points from the force residual, used if the base is far above the
            noise, at least in some segments.
        unexplained_force: index of a part → share of the base's squared force residual that the best of its starts
            leaves.
        starts_along_motion: index of a part → starting points of which the states (of a load, for example) were
            simulated along the measured motion.
        couplings: coordinate → parameters of the spring between motor and load that was fitted there.
        base_on_few: joint → the base fitted on few segments; None → that of a machine that is simulated as a whole.
        least_gain: the cost of a part with a non-smooth loss must fall by this much at its start to be fitted.
    """

    search: Search
    base: Fit
    parts: tuple[Part, ...]
    done: int = 0
    couplings: dict[int, dict[str, float]] = field(default_factory=dict)
    starts_by_runs: dict[int, list[tuple[float, Array]]] = field(default_factory=dict)
    starts_by_force: dict[int, list[Array]] = field(default_factory=dict)
    unexplained_force: dict[int, float] = field(default_factory=dict)
    starts_along_motion: dict[int, list[Array]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        joints = {self._joint(part) for part in self.parts}
        self.base_on_few = {joint: _screening(self.search, self.base, joint) for joint in joints}
        self.parts = tuple(part for part in self.parts if self._is_worth_trying(part))
        self.trials = [self.base.trial.with_part(part) for part in self.parts]
        self.levels = [float(v) for v in self.base.values[0]]
        self.least_gain = 0.0
        names = [s.name for s in self.search.refitted_symbols]
        refit = with_values(self.search.system, dict(zip(names, self.levels, strict=True)))
        self.survey = survey(refit, self.search.motion, self.base.model)

    @cached_property
    def runners(self) -> list[Runner]:
        """Free-run simulators of the parts. They are compiled when first asked for, if not started before."""
        return self.search.runners(self.trials)

    def start_compiling(self) -> None:
        """Start the C compiler on the models of all parts; the search keeps what it compiles for ``runners``."""
        self.search.runners(self.trials)

    def promising(self, indices: Sequence[int]) -> list[int]:
        """Indices of the parts that are fitted: the best by the gain of one linear step from their best start.

        An effect without a scale has only a coarse grid of starts, so it is always fitted.
        """
        self._start_by_force()  # meanwhile the compiler may still work
        self._start_by_runs(indices)
        gains = {
            k: self._base_on_few(k).cost - min((cost for cost, _ in self.starts_by_runs[k]), default=np.inf)
            for k in indices
        }
        scaled = [k for k in indices if self.parts[k].effect.scaling and not is_own(self.parts[k].kind)]
        by_force = sorted((k for k in scaled if k in self.unexplained_force), key=self.unexplained_force.__getitem__)[
            :BY_FORCE
        ]
        left_out = sorted(scaled, key=lambda k: -gains[k])[PROMISING:]
        chosen = [k for k in indices if k not in left_out or k in by_force]
        self.done += len(indices) - len(chosen)
        return chosen

    def _start_by_force(self) -> None:
        """Compute starting points from the force residual; not in threads, since CasADi builds expressions."""
        if near_noise(self.base) and not share_far(self.base):
            return
        whole = self.search.rigid is None  # free runs of one joint do not have the states of the others
        start = ForceStart(
            self.search.problem, self.base, runners=dict(zip(self.parts, self.runners, strict=True)) if whole else {}
        )
        order = sorted(range(len(self.parts)), key=lambda k: self.trials[k].adds_states)  # these wait for the compiler
        found = self._shared_out(lambda k: self._by_force(start, k), order, threads=False)
        for k, (unexplained, by_force, along_motion) in zip(order, found, strict=True):
            self.starts_by_force[k], self.starts_along_motion[k] = by_force, along_motion
            if by_force or along_motion:
                self.unexplained_force[k] = unexplained

    def _by_force(self, start: ForceStart, k: int) -> tuple[float, list[Array], list[Array]]:
        """(share of the squared force residual that remains, starting points, those along the measured motion)."""
        part, trial = self.parts[k], self.trials[k]
        covered = self.covered(part)
        best = start.best(trial, covered)
        suggested = [np.append(self.base.theta, part.inward(values)) for values in part.effect.suggested(covered)]
        unexplained = min((share for share, _ in start.with_levels(trial, suggested)), default=np.inf)
        by_force = suggested
        if best is not None:
            unexplained, theta = best
            by_force = [*suggested, theta]
        grid = [np.append(self.base.theta, part.inward(values)) for values in part.effect.followed(covered)]
        along_motion = sorted(start.with_levels(trial, grid), key=lambda one: one[0])[:FOLLOWED]
        unexplained = min([unexplained, *(share for share, _ in along_motion)])
        return unexplained, by_force, [theta for share, theta in along_motion if share < 1]

    def best_by_force(self, indices: Sequence[int]) -> list[int]:
        """Indices of the parts that explain most of the force residual, the best form of each kind at a place.

        Only those that explain ``CLEAR_BY_FORCE`` of its square. On few segments, free runs may gain less by the
        missing force than by changes of their start states, as for an axis that rings or sticks.
        """
        best: dict[tuple[str, str], int] = {}
        for k in sorted((k for k in indices if k in self.unexplained_force), key=self.unexplained_force.__getitem__):
            if self.unexplained_force[k] < 1 - CLEAR_BY_FORCE:
                best.setdefault(self.parts[k].key, k)
        return list(best.values())[:FITTED_BY_FORCE]

    def _start_by_runs(self, indices: Sequence[int]) -> None:
        """Compute the best starting points of parts on few segments, (cost after one linear step, theta) each."""
        covered = {k: self.covered(self.parts[k]) for k in indices}
        self._compute_slopes(*(self._base_on_few(k) for k in indices))
        groups = [(k, some) for k in indices for some in self._groups(k, list(self.parts[k].effect.starts(covered[k])))]

        def start(one: tuple[int, Sequence[Mapping[str, float]]]) -> list[tuple[float, Array]]:
            k, shapes = one
            return starting_points(self._runner(k), self._base_on_few(k), covered[k], shapes)

        found = list(zip(groups, self._shared_out(start, groups), strict=True))
        for k in indices:
            count = len(self.parts[k].names)
            apart = count if self.parts[k].effect.rough else 0
            own = [p for (j, _), points in found if j == k for p in points]
            self.starts_by_runs[k] = best_starts(own, 3 if count > 2 else 2, apart)

    def _groups(self, k: int, shapes: Sequence[Mapping[str, float]]) -> list[Sequence[Mapping[str, float]]]:
        """Starting shapes of a part, in groups whose free runs begin together."""
        size = self.runners[k].at_once
        return [shapes[j : j + size] for j in range(0, len(shapes), size)]

    def covered(self, part: Part) -> Covered:
        """The range that the log covers at the place of a part."""
        return self.survey.covered(part, self.levels, self.search.record.noise, self.couplings.get(part.place))

    def screened(self, indices: Sequence[int]) -> list[Screened]:
        """Parts fitted on few segments, each from its best starting points; without those that have none."""
        self._start_by_runs([k for k in indices if k not in self.starts_by_runs])
        rough = [k for k in indices if self.parts[k].effect.rough]
        starts = self._searched(rough) | {k: self._near_the_best(k) for k in indices if k not in rough}
        tasks = [(k, theta, False) for k in indices for theta in starts[k]]
        loads = len(self.base.trial.changed.transmissions)
        adds = {k: len(self.trials[k].changed.transmissions) > loads for k in indices}
        tasks += [(k, theta, adds[k]) for k in indices for theta in self.starts_by_force.get(k, [])]
        tasks += [(k, theta, True) for k in indices for theta in self.starts_along_motion.get(k, [])]

        def fit(task: tuple[int, Array, bool]) -> tuple[float, Array]:
            k, theta, as_measured = task
            if as_measured:
                one = self._from_measured_states(self._runner(k), theta)
            else:
                one = self.search.fit_from(
                    self._runner(k), theta, self._base_on_few(k), FIRST_ROUNDS, final_slopes=False
                )
            return one.cost, one.theta

        fits = list(zip(tasks, self._shared_out(fit, tasks, len(indices)), strict=True))
        best = []
        for k in indices:
            own = [found for (j, *_), found in fits if j == k]
            if not own:
                continue
            cost, theta = min(own, key=lambda found: (self._is_unseen(k, found[1]), found[0]))
            best.append(Screened(k, self._base_on_few(k).cost - cost, theta))
            coupling = self.parts[k].effect.coupling(self.trials[k].split(theta)[1][-1])
            if coupling is not None:
                self.couplings[self.parts[k].place] = coupling
        return best

    def _is_unseen(self, k: int, theta: Array) -> bool:
        """Whether the log cannot show part ``k`` at these values, as a load that is too light."""
        part, record = self.parts[k], self.search.record
        noise = float(record.noise[part.effect.coordinate(self.search.system, part.place)])
        return bool(part.effect.unseen(self.trials[k].split(theta)[1][-1], noise))

    @staticmethod
    def _compute_slopes(*fits: Fit) -> None:
        """Slopes that every process needs are computed once, before there are several."""
        for fit in fits:
            _ = fit.raw_slopes

    def _near_the_best(self, k: int) -> list[Array]:
        """The starting points by free runs of a part with a smooth loss: the best, and those nearly as good."""
        starts, few = self.starts_by_runs[k], self._base_on_few(k)
        if self.parts[k].effect.scaling and starts:
            enough = few.cost - AS_GOOD * max(few.cost - starts[0][0], 0.0)
            starts = [starts[0], *(s for s in starts[1:] if s[0] < enough)]
        return [theta for _, theta in starts]

    def _searched(self, indices: Sequence[int]) -> dict[int, list[Array]]:
        """Index of a part with a non-smooth loss → the result of simplex searches from its best starting points."""
        near = [
            (k, theta)
            for k in indices
            for theta in [
                *(
                    theta
                    for cost, theta in self.starts_by_runs[k]
                    if cost < self._base_on_few(k).cost - self.least_gain
                ),
                *(self.starts_by_force.get(k, [])[-1:] if k in self.unexplained_force else []),
            ]
        ]
        found = self._shared_out(
            lambda one: simplex_search(self._runner(one[0]), self._base_on_few(one[0]), one[1]), near
        )
        best: dict[int, tuple[float, Array]] = {}
        for (k, _), one in zip(near, found, strict=True):
            best[k] = min(best.get(k, one), one, key=lambda pair: pair[0])

        def search_again(k: int) -> tuple[float, Array]:
            return simplex_search(self._runner(k), self._base_on_few(k), best[k][1], MORE_TRIES)

        again = dict(zip(best, self._shared_out(search_again, list(best)), strict=True))
        return {k: [min(best[k], again[k], key=lambda pair: pair[0])[1]] if k in best else [] for k in indices}

    def gain_of(self, fit: Fit, k: int) -> float:
        """The gain of a fit over the base on the few segments of part ``k``."""
        few = self._base_on_few(k)
        runner, prior = _as_of(few, fit.runner), self.search.prior(fit.trial, fit.theta)
        there = shooting_fit(runner, fit.theta, few.runner.record.at_rest, prior, 0, final_slopes=False)
        return few.cost - there.cost

    def fitted(self, screened: Sequence[Screened]) -> list[Fit]:
        """Screened parts fitted on all segments."""
        self._compute_slopes(self.base)
        return self._shared_out(lambda one: self._fitted(one.index, one.theta), screened, len(screened))

    def _fitted(self, k: int, theta: Array) -> Fit:
        """A part fitted on all segments, with new slopes by the start states while they reduce the cost."""
        joint = self._joint(self.parts[k])
        if joint is None:
            return self._polished(k, theta, self.base)
        rows = self.base.rows_of(joint)
        raw = [slope[rows] for slope in self.base.raw_slopes]
        alone = self._polished(k, theta, self.base.of_joint(joint), raw)
        base = self.base.started_as(alone, joint)
        return self.search.fit_from(self.runners[k], alone.theta, base, JOINED, self.base.raw_slopes)

    def restarted(self, found: Sequence[Fit]) -> list[Fit]:
        """Candidates with local minima everywhere, each from the best of other starting values if that is better."""
        return self._shared_out(self._restarted, found)

    def _restarted(self, found: Fit) -> Fit:
        k = self.parts.index(found.part)
        few, part, count = self._base_on_few(k), self.parts[k], len(self.base.theta)
        others = part.effect.restarts(found.parameters, self.covered(part))
        if not others or found.cost > self.base.cost - LEAST_GAIN:
            return found
        runner = self._runner(k)

        def again(values: Mapping[str, float]) -> Fit:
            theta = np.append(found.theta[:count], part.inward(values))
            fit = self.search.fit_from(runner, theta, few, 0, final_slopes=False)
            for _ in range(AGAIN):  # start states first, which were fitted without the effect
                fit = self._polish(fit, 1, final_slopes=False)
            return fit

        best = self._fitted(k, min(map(again, others), key=lambda fit: fit.cost).theta)
        best = best if best.cost < found.cost else found
        near = [np.append(best.theta[:count], part.inward(v)) for v in part.effect.neighbours(best.parameters)]
        fits = [self.search.fit_from(runner, theta, few, 0, final_slopes=False) for theta in near]
        if not fits:
            return best
        _, searched = simplex_search(runner, few, min(fits, key=lambda fit: fit.cost).theta, MORE_TRIES)
        return min(best, self._fitted(k, searched), key=lambda fit: fit.cost)

    def _polished(self, k: int, theta: Array, base: Fit, raw: Sequence[Array] | None = None) -> Fit:
        """Part ``k`` fitted in addition to a base, with new slopes by the start states while they reduce the cost.

        ``raw``: slopes of the base, if they are known.
        """
        fit, before = self.search.fit_from(_as_of(base, self.runners[k]), theta, base, ROUNDS, raw), np.inf
        for _ in range(POLISHES):
            if fit.cost > (1 - MOVING) * before:
                break
            before = fit.cost
            fit = self._polish(fit, ROUNDS)
        return fit

    def _from_measured_states(self, runner: Runner, theta: Array) -> Fit:
        """A fit with measured start states, since those fitted without a load are wrong with it."""
        prior = self.search.prior(runner.trial, theta, self.base.prior.tempering)
        first = shooting_fit(runner, theta, runner.record.at_rest, prior, FIRST_ROUNDS, final_slopes=False)
        return self._polish(first, FIRST_ROUNDS, final_slopes=False)

    def _polish(self, fit: Fit, rounds: int, final_slopes: bool = True) -> Fit:
        return polish(fit, rounds, self.search.prior(fit.trial, fit.theta, fit.prior.tempering), final_slopes)

    def _is_worth_trying(self, part: Part) -> bool:
        """Whether the base leaves enough loss above the noise at the joint on which a part acts."""
        excess = {joint: few.cost - noise_loss(few) for joint, few in self.base_on_few.items()}
        return is_own(part.kind) or excess[self._joint(part)] >= LEAST_EXCESS * max(excess.values())

    def _base_on_few(self, k: int) -> Fit:
        return self.base_on_few[self._joint(self.parts[k])]

    def _runner(self, k: int) -> Runner:
        """Free runs of a part on few segments."""
        return _as_of(self._base_on_few(k), self.runners[k])

    def _joint(self, part: Part) -> int | None:
        """The joint on which a part acts, for an arm that is run joint by joint; else None."""
        return joint_of(self.search, part)

    def _shared_out(
        self, work: Callable[[Item], Result], items: Sequence[Item], parts: int = 0, threads: bool = True
    ) -> list[Result]:
        """The results for all items, by several processes; ``parts``: their number in the progress."""
        whole = len(self.parts) + FITTED
        shared = [self.search, *self.trials, *self.parts, self.base, *self.base_on_few.values()]
        shared += [one.shooter for one in self.runners] + [
            one.runner.record for one in (self.base, *self.base_on_few.values())
        ]
        report = share_display()  # here, since a thread has a context of its own
        shared += [self.search.record, *(item for item in items if isinstance(item, Fit))]

        def begun(count: int) -> None:
            report(min(1.0, (self.done + parts * count / len(items)) / whole))

        found = in_processes(work, items, shared, begun, threads)
        self.done += parts
        return found


def _as_of(base: Fit, runner: Runner) -> Runner:
    """Free runs on the segments of a base fit, with its time steps."""
    return replace(runner, record=base.runner.record, substeps=base.runner.substeps)


def _screening(search: Search, base: Fit, joint: int | None) -> Fit:
    """The base on fewer and, if it is far from the data, shorter segments with coarser steps; of one joint if given."""
    misfit = base.by_segment
    if joint is not None:
        misfit = misfit[base.rows_of(joint)]
    ratio = float(np.sqrt(np.median(misfit) / base.residual.shape[1]))
    record = search.shorter(float(np.clip(np.sqrt(NEAR / max(ratio, NEAR)), SHORTEST, 1.0)))
    segments = len(record.start)
    every = max(1, min(segments * record.length // SCREENED_SAMPLES, segments // LEAST_SCREENED))
    chosen = np.arange(0, segments, every)
    if len(misfit) == segments:  # the base's own segments
        far = np.setdiff1d(np.flatnonzero(misfit > FAR**2 * base.residual.shape[1]), chosen)
        chosen = np.union1d(chosen, far[:: max(1, len(far) // max(1, len(chosen) // RARE))])
    few = replace(record, start=np.ascontiguousarray(record.start[chosen]))
    few = few if joint is None else replace(few, joints=(joint,))
    runner = replace(base.runner, record=few)
    if search.rigid is None and ratio > FAR:
        rows, substeps = few.steps(COARSE, search.motion.cutoff_hz)
        runner = replace(runner, record=few.thinned(rows) if rows > 1 else few, substeps=substeps)
    prior = search.prior(runner.trial, base.theta, base.prior.tempering)
    return shooting_fit(runner, base.theta, runner.record.at_rest, prior, FIRST_ROUNDS)
