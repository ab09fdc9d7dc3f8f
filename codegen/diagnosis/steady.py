"""Diagnosis of records at one steady speed each by their means: least squares, forward selection, the answer.

    r_k = g(v_k, w_k) − U λ(v_k, w_k),  k = 1 … R records,

with v and w the means of speed and input over the record. Most of a model's residual within such a record is ripple
over a turn, whose mean vanishes. So each record is one observation. Tolerances are the prior; effects are tested by the
F test and by leave-one-out prediction (PRESS, Allen 1974), and held-out records may refuse them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import f as fisher
from scipy.stats import t as student

from codegen.base.arrays import Array
from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.adoption import AWAY
from codegen.diagnosis.evidence.coverage import Survey, survey
from codegen.diagnosis.evidence.estimate import CONFIDENCE, effect_of
from codegen.diagnosis.evidence.reservations import may_be_absent
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.linear import fitted, inverse, rms
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import Part, Trial, in_unit, model_of, part_of
from codegen.diagnosis.results import Candidate, ErrorFigures, Fact, FoundEffect, Interval, Remainder, Round
from codegen.diagnosis.verdict.admission import Measured, Reference, admitted, merged
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.table import TABLE_SIZE
from codegen.effects.register import candidates, is_own, twins_of
from codegen.logs import Log
from codegen.logs.formats.source import listing
from codegen.logs.motion import MOSTLY, measured_motion, steady_segments
from codegen.mechanics.casadi_form import in_place, to_casadi
from codegen.mechanics.system import TIME, Matrix, System

WEIGHED = 3
"""Iterations of the weight of the prior, by the residual of the fit before."""
TRIES, STEP = 100, 1e-5
"""Most evaluations of a fit, and the step of its slopes over the size of each parameter."""
STARTS = 3
"""Starting values of a candidate that are fitted."""
TIE_NATS = float(-np.log(acceptance.TIE_LEVEL))
"""Nats of log-likelihood by which a fit must be better for two effects to be distinguished."""
LEAST_RUNS = 8
"""Least number of records."""
SETTLING = 0.1
"""Share of each record that is left out at its start."""


@dataclass(frozen=True, eq=False)
class Means:
    """Means of R steady records: speeds (R, n) and inputs (R, m), SI; ``left_out``: names of the other records."""

    speeds: Array
    inputs: Array
    left_out: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.speeds)

    def of(self, chosen: NDArray[np.bool_]) -> Means:
        return replace(self, speeds=self.speeds[chosen], inputs=self.inputs[chosen])


def means_of(log: Log) -> Means | None:
    """The means of the steady records of an experiment; None if they are few, or hold less than ``MOSTLY`` of its rows.

    A start, a stop or a reversal among many steady records is left out: free runs and force residual of all samples
    show ripple over a turn and not its mean.
    """
    if len(log.records) < LEAST_RUNS:
        return None
    steady = _steady_records(log)
    kept = [one for one, is_steady in zip(log.records, steady, strict=True) if is_steady]
    if len(kept) < LEAST_RUNS or sum(one.size for one in kept) < MOSTLY * sum(one.size for one in log.records):
        return None
    speeds, inputs = [], []
    for one in kept:
        first = round(SETTLING * one.size)
        way = one.positions[-1] - one.positions[first]
        speeds.append(way / (one.time[-1] - one.time[first]))
        inputs.append(one.inputs[first:].mean(axis=0))
    left_out = (one.path.name for one, is_steady in zip(log.records, steady, strict=True) if not is_steady)
    return Means(np.array(speeds), np.array(inputs), tuple(left_out))


def _steady_records(log: Log) -> NDArray[np.bool_]:
    """(records,) whether every coordinate runs at one speed, in all segments of a record."""
    motion = measured_motion(log)
    segments = steady_segments(log, motion.velocities, motion.usable)
    steady = np.ones(len(log.records), dtype=bool)
    np.logical_and.at(steady, _record_of(log), segments)
    return steady


def _record_of(log: Log) -> NDArray[np.intp]:
    """(segments,) index of the record to which each belongs."""
    return np.searchsorted([stop for _, stop in log.joints], [start for start, _ in log.segments], side="right")


def with_mean_inputs(motion: Motion, log: Log) -> Motion:
    """The motion of steady records with the mean input of each record throughout it, for free runs.

    The input of a record balances ripple over a turn, a force that the model lacks. Between two restarts a free run
    integrates it: a light rotor stops and starts, by an amount that says nothing of the friction at the mean speed. By
    the mean input the run settles at the speed at which the model's friction is the mean force. Records that are not
    steady keep their inputs.
    """
    commands, steady = motion.commands.copy(), _steady_records(log)
    for (start, stop), record in zip(log.segments, _record_of(log), strict=True):
        if steady[record]:
            commands[start:stop] = commands[start + round(SETTLING * (stop - start)) : stop].mean(axis=0)
    return replace(motion, commands=commands)


def is_static(system: System) -> bool:
    """Whether the mean force is a function of mean speeds and inputs: no dependence on position, time or history."""
    away = {*system.positions, TIME}
    moving = any(chain.has_memory for chain in system.actuators.values()) or bool(system.sensor_errors)
    bristles = any(c.law.bristle_stiffness(c.law_parameters) != 0 for c in system.contacts)
    return not moving and not bristles and hidden_states(system) == 0 and not away & system.equation_error.free_symbols


def mean_forces(system: System, means: Means) -> tuple[Array, Array]:
    """(R, n) force residual, and force of the inputs, of a system at mean speeds."""
    return forces_of(system, (), means)(np.zeros(0))


def forces_of(system: System, symbols: Sequence[sympy.Symbol], means: Means) -> Callable[[Array], tuple[Array, Array]]:
    """The function ``mean_forces`` of the values of these symbols."""
    n, m, count = system.degrees_of_freedom, len(system.inputs), len(means)
    point, parameters = casadi.SX.sym("point", n + m), casadi.SX.sym("parameters", len(symbols))
    names = {s: casadi.SX(float(v)) for s, v in system.values.items()}
    names |= {s: parameters[k] for k, s in enumerate(symbols)}
    names |= dict.fromkeys([*system.positions, *system.accelerations, TIME], casadi.SX(0.0))
    names |= {s: point[k] for k, s in enumerate((*system.velocities, *system.inputs))}
    outputs = [casadi.densify(to_casadi(term, names)) for term in (system.equation_error, system.drive_force)]
    function = casadi.Function("means", [point, parameters], outputs).map(count)
    at, numbers = np.hstack([means.speeds, means.inputs]), np.zeros((count, len(symbols)))
    residual, drive = np.zeros((count, n)), np.zeros((count, n))
    given = [at, numbers] if symbols else [at]  # CasADi takes no empty memory
    buffer, evaluate = in_place(function, given, [residual, drive])

    def forces(values: Array, _kept: Any = buffer) -> tuple[Array, Array]:
        numbers[:] = values
        evaluate()
        return residual.copy(), drive.copy()

    return forces


def figures_of(system: System, means: Means, measured: ErrorFigures) -> ErrorFigures:
    """Force errors of the means in place of the measured ones; free-run errors as measured."""
    residual, drive = mean_forces(system, means)
    rows = tuple(float(v) for v in np.sqrt(np.mean(residual**2, axis=0)))
    relative = float(np.linalg.norm(residual) / max(float(np.linalg.norm(drive)), 1e-300))
    return replace(measured, force_rms=rms(residual), force_rms_rows=rows, relative_force=relative, free_run_parts=())


def by_force_alone(figures: ErrorFigures) -> ErrorFigures:
    """The errors of steady records with which models are compared: those of the mean force, free runs as not measured.

    A free run by a mean input moves off by r/F'(v), with r the residual force and F' the slope of friction over speed.
    It shows the same residual, weighted by the slope; where friction falls with speed it grows without limit from any
    residual, which says that the motion is unstable and not which model is right.
    """
    return replace(figures, free_run_rmse_rows=(float("nan"),) * len(figures.free_run_rmse_rows))


def remainders_of(system: System, means: Means) -> tuple[Remainder, ...]:
    """The remainder of a model on the means; its structured share is what linear interpolation over speed predicts."""
    residual, drive = mean_forces(system, means)
    found = []
    for i in range(residual.shape[1]):
        speed, r = means.speeds[:, i], residual[:, i]
        before = after = 0.0
        for way in (-1, 1):
            chosen = np.flatnonzero(way * speed > 0)
            order = chosen[np.argsort(speed[chosen])]
            for k in range(1, len(order) - 1):
                low, here, high = order[k - 1 : k + 2]
                predicted = np.interp(speed[here], speed[[low, high]], r[[low, high]])
                before, after = before + r[here] ** 2, after + (r[here] - predicted) ** 2
        share = max(0.0, 1 - after / before) if before > 0 else 0.0
        left, driven = rms(r), rms(drive[:, i])
        found.append(Remainder(left, left / driven if driven > 0 else float("inf"), share, {"speed": share}))
    return tuple(found)


def is_seen(trial: Trial) -> bool:
    """Whether records at steady speed can show the last part of a trial, which is no force of the input.

    At an imposed speed the input follows friction, so any function of it would explain friction.
    """
    changed, before = trial.changed, replace(trial, parts=trial.parts[:-1]).changed
    if not is_static(changed):
        return False
    still = dict.fromkeys(changed.accelerations, 0)
    change = Matrix(changed.equation_error - before.equation_error).subs(still).free_symbols
    return bool(set(trial.parts[-1].symbols) & change) and not set(changed.inputs) & change


@dataclass(frozen=True, eq=False)
class SteadyFit:
    """Least squares of one trial on the means.

    Attributes:
        prior_precision: (p,) times the squared scale of the residual, as in the normal matrix.
    """

    trial: Trial
    theta: Array
    residual: Array
    slopes: Array
    prior_precision: Array

    @property
    def squares(self) -> float:
        return float(self.residual @ self.residual)

    @property
    def part(self) -> Part:
        return self.trial.parts[-1]

    @cached_property
    def parameters(self) -> list[dict[str, float]]:
        return self.trial.split(self.theta)[1]

    @cached_property
    def model(self) -> System:
        return model_of(self.trial, self.theta)

    @property
    def nats(self) -> float:
        """−log-likelihood with unknown scale, plus one nat a parameter (Akaike)."""
        return 0.5 * len(self.residual) * float(np.log(max(self.squares, 1e-300))) + len(self.theta)

    @cached_property
    def _inverse(self) -> Array:
        return inverse(self.slopes.T @ self.slopes + np.diag(self.prior_precision))

    @cached_property
    def left_out(self) -> Array:
        """(R n,) leave-one-out residual of each mean, by its leverage."""
        leverage = np.einsum("ri,ij,rj->r", self.slopes, self._inverse, self.slopes)
        return np.asarray(self.residual / np.maximum(1 - leverage, 0.02))

    def intervals(self) -> list[dict[str, Interval]]:
        free = max(len(self.residual) - len(self.theta), 1)
        deviation = np.sqrt(np.maximum(np.diag(self._inverse), 0.0) * self.squares / free)
        half = float(student.ppf(0.5 + CONFIDENCE / 2, free)) * deviation
        low, high = (self.trial.split(self.theta + sign * half)[1] for sign in (-1, 1))
        pairs = zip(low, high, strict=True)
        return [{name: (min(a[name], b[name]), max(a[name], b[name])) for name in a} for a, b in pairs]


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate of one round: its fit, and its row in the table, with the records as blocks."""

    fit: SteadyFit
    row: Candidate


@dataclass(frozen=True, eq=False)
class SteadySearch:
    """Fits on the means of steady records.

    Attributes:
        problem: of the declared system on the log's motion.
        held: whether a tolerance holds a parameter near its declared value.
    """

    problem: Problem
    means: Means
    noise: Array
    held: bool = True

    @property
    def system(self) -> System:
        return self.problem.system

    @cached_property
    def drive(self) -> Array:
        """(R n,) force of the inputs."""
        return mean_forces(self.system, self.means)[1].ravel()

    def refit(self) -> SteadyFit:
        return self.fit(Trial(self.system, (), self.problem.refitted_symbols), [self.problem.declared])

    def fit(self, trial: Trial, starts: Sequence[Array]) -> SteadyFit:
        """The best fit from several starting values."""
        error = _residual_of(trial, self.means)
        return min((self._fit_from(trial, error, theta) for theta in starts), key=lambda one: one.squares)

    def _fit_from(self, trial: Trial, error: Callable[[Array], Array], theta: Array) -> SteadyFit:
        none = np.zeros(len(theta) - len(self.problem.refitted_symbols))
        prior = np.append(self.held * self.problem.prior_precision, none)
        centre = np.append(self.problem.declared, none)
        least = 1e-12 * max(float(np.abs(self.drive).max()), 1e-300)
        scale = max(rms(error(theta)), least)
        size = np.where(theta != 0, np.abs(theta), np.where(prior > 0, 1 / np.sqrt(np.maximum(prior, 1e-300)), 1.0))
        for _ in range(WEIGHED):

            def both(scaled: Array, scale: float = scale) -> Array:
                at = size * scaled
                return np.concatenate([error(at) / scale, np.sqrt(prior) * (at - centre)])

            theta = size * least_squares(both, theta / size, max_nfev=TRIES).x
            residual = error(theta)
            scale = max(float(np.sqrt(residual @ residual / max(len(residual) - len(theta), 1))), least)
        steps = STEP * size
        slopes = [(error(theta + d) - error(theta - d)) / (2 * h) for d, h in zip(np.diag(steps), steps, strict=True)]
        return SteadyFit(trial, theta, residual, np.stack(slopes, axis=1), prior * scale**2)

    def ranked_candidates(self, base: SteadyFit) -> list[Tried]:
        """Every effect that such records can show, in addition to those of a fit: accepted ones first, best first."""
        trial, taken = base.trial, {p.key for p in base.trial.parts}
        trials = [
            trial.with_part(part_of(form, place, self.system))
            for effect, place in candidates(trial.changed)
            if not effect.refines
            for form in effect.forms
        ]
        trials = [t for t in trials if (t.parts[-1].kind, t.parts[-1].on) not in taken and is_seen(t)]
        count = len({(t.parts[-1].kind, t.parts[-1].on) for t in trials})
        tried = [one for t in trials if (one := self._tried(t, base, count)) is not None]
        kept = [one for one in tried if not any(_is_simpler_form(other, one) for other in tried)]
        return sorted(kept, key=lambda a: (not a.row.accepted, a.fit.squares))

    def ties(self, ranked: Sequence[Tried], base: SteadyFit) -> list[Tried]:
        """Accepted candidates that are no worse than the best, its twins left out.

        They are those that the records cannot tell from the best; then those that are better than it by ``TIE_NATS``
        where no tolerance holds a parameter. A parameter that is several tolerances off leaves a force that another
        law takes up, and the law that acts needs the parameter's own value to fit.
        """
        best, *others = ranked
        known = {best.row.key, *best.row.also}
        alike = [a for a in others if a.row.accepted and a.row.key not in known]
        tied = [a for a in alike if a.fit.nats < best.fit.nats + TIE_NATS]
        if not self.problem.prior_precision.any():
            return tied
        known |= {a.row.key for a in tied}
        free = replace(self, held=False)
        others = free.ranked_candidates(free.fit(base.trial, [base.theta]))
        least = min((a.fit.nats for a in others if a.row.key == best.row.key), default=np.inf) - TIE_NATS
        return tied + [a for a in others if a.row.accepted and a.row.key not in known and a.fit.nats < least]

    def values_away(self, tried: Sequence[Tried]) -> tuple[Fact, ...]:
        """The value that each fit moves furthest from the declared one, if by more than ``AWAY`` tolerances."""
        count, facts = len(self.problem.refitted_symbols), []
        for one in tried if count else ():
            away = np.abs(one.fit.theta[:count] - self.problem.declared) * np.sqrt(self.problem.prior_precision)
            k = int(np.argmax(away))
            if away[k] > AWAY:
                symbol, declared = self.problem.refitted_symbols[k], self.problem.declared[k]
                given = {"value": one.fit.theta[k], "unit": in_unit(self.system, symbol), "away": away[k]}
                given |= {"name": symbol.name, "declared": declared}
                facts.append(Fact.worded("note", "away", named=one.row.title, **given))
        return tuple(facts)

    def _tried(self, trial: Trial, base: SteadyFit, count: int) -> Tried | None:
        """A candidate in addition to a fit; None without a starting value.

        Args:
            count: of the candidates, by which its p-value is multiplied (Bonferroni).
        """
        starts = self._starts(trial, base)
        if not starts:
            return None
        fit = self.fit(trial, starts)
        before, after = base.left_out**2, fit.left_out**2
        gains = before - after
        forces = [mean_forces(one.model, self.means)[0].ravel() for one in (fit, base)]
        size = float(np.linalg.norm(forces[0] - forces[1]) / max(float(np.linalg.norm(self.drive)), 1e-300))
        part = fit.part
        row = Candidate(
            kind=part.kind,
            on=part.on,
            parameters=fit.parameters[-1],
            gain=1 - float(after.sum()) / max(float(before.sum()), 1e-300),
            t=float(gains.sum() / max(float(np.sqrt((gains**2).sum())), 1e-300)),
            blocks_won=int((gains > 0).sum()),
            blocks=len(fit.residual),
            free_run=None,
            accepted=False,
            why_not="",
            also=tuple(twins_of(part.effect, self.system, part.place)),
            force=float(np.sqrt(fit.squares / max(base.squares, 1e-300))),
            size=size,
            own=is_own(part.kind),
            p=min(1.0, count * _chance(fit, base)),
            form=part.form,
        )
        why_not = self._why_not(fit, row, acceptance.FURTHER if base.trial.parts else acceptance.LEAST_SHARE)
        return Tried(fit, replace(row, accepted=not why_not, why_not=why_not))

    def _why_not(self, fit: SteadyFit, row: Candidate, least: float) -> str:
        """The first test that a candidate fails, in words."""
        part = fit.part
        if row.gain < least:
            return f"removes {in_percent(row.gain)} of the squared residual of left-out records"
        if not part.effect.admissible(self.system, part.place, row.parameters):
            return "fits only with unphysical values"
        if row.size < acceptance.LEAST_SIZE:
            return f"is too small to matter: {in_percent(row.size)} of the drive force"
        absent = may_be_absent(part.effect, fit.intervals()[-1])
        if absent:
            return f"may be absent: the 95 % interval of {', '.join(absent)} contains the value without it"
        return "" if row.p <= acceptance.ALPHA else f"may be chance: p = {row.p:.2g} over all candidates"

    def _starts(self, trial: Trial, base: SteadyFit) -> list[Array]:
        """The best starting values over the shapes of the last part, its weights by one linear step."""
        part, error, starts = trial.parts[-1], _residual_of(trial, self.means), []
        levels = [float(v) for v in base.trial.split(base.theta)[0]]
        covered = replace(
            self._survey.covered(part, levels, self.noise),
            force=max(float(np.std(self.drive)), 1e-300),
            top_speed=max(float(np.abs(self.means.speeds).max()), 1e-300),
        )
        for shape in part.effect.starts(covered):
            values = dict(shape)
            if part.effect.scaling:
                probes = part.effect.probes(shape, covered)
                columns = [
                    (error(np.append(base.theta, part.inward(probe))) - base.residual) / size for probe, size in probes
                ]
                slopes = np.column_stack([base.slopes, *columns])
                step = -fitted(slopes, base.residual)
                values = part.effect.weighted(shape, step[len(base.theta) :].tolist())
            inner = part.inward(values)
            if np.isfinite(inner).all():
                starts.append(np.append(base.theta, inner))
        return sorted(starts, key=lambda theta: float(np.sum(error(theta) ** 2)))[:STARTS]

    @cached_property
    def _survey(self) -> Survey:
        return survey(self.system, self.problem.motion)


def _chance(fit: SteadyFit, base: SteadyFit) -> float:
    """p of the F test of a fit against one with fewer parameters; 1 where the fit has no residual to compare with."""
    more, freedom = len(fit.theta) - len(base.theta), len(fit.residual) - len(fit.theta)
    if freedom <= 0 or fit.squares <= 0:
        return 1.0
    ratio = max(base.squares - fit.squares, 0.0) / more / (fit.squares / freedom)
    return float(fisher.sf(ratio, more, freedom))


def _is_simpler_form(other: Tried, one: Tried) -> bool:
    """Whether another candidate, no worse in the tests, is the same effect with fewer parameters and fits as well."""
    a, b = other.fit.part, one.fit.part
    simpler = a.key == b.key and len(a.names) < len(b.names)
    return simpler and other.row.accepted >= one.row.accepted and other.fit.nats <= one.fit.nats + TIE_NATS


def _residual_of(trial: Trial, means: Means) -> Callable[[Array], Array]:
    """theta → (R n) force residual."""
    forces = forces_of(trial.changed, trial.symbols, means)
    return lambda theta: forces(trial.numbers(theta))[0].ravel()


MOST_EFFECTS = 3


@dataclass(frozen=True, eq=False)
class SteadyOutcome:
    """Forward selection on the means: the refit, the fits with one effect more each, and rivals of the first one."""

    base: SteadyFit
    fits: tuple[SteadyFit, ...]
    rounds: tuple[Round, ...]
    rivals: tuple[Tried, ...]


def select_effects(search: SteadySearch) -> SteadyOutcome:
    """Forward selection: effects one after the other, while one is accepted."""
    base = current = search.refit()
    fits: list[SteadyFit] = []
    rounds: list[Round] = []
    rivals: tuple[Tried, ...] = ()
    for turn in range(MOST_EFFECTS):
        ranked = search.ranked_candidates(current)
        before = tuple(p.key for p in current.trial.parts)
        rounds.append(Round(before, tuple(one.row for one in ranked[:TABLE_SIZE])))
        if not ranked or not ranked[0].row.accepted:
            break
        current = ranked[0].fit
        fits.append(current)
        if not turn and (rivals := tuple(search.ties(ranked, base))):
            break  # what is missing besides would be another effect for each of those that tie
    return SteadyOutcome(base, tuple(fits), tuple(rounds), rivals)


def answer_of(search: SteadySearch, measured: Measured, judged: Measured) -> tuple[Answer, SteadyOutcome]:
    """The answer on steady records; held-out records may refuse the refit and each effect.

    Args:
        measured: gives all errors of a model on held-out records, which the answer states.
        judged: gives those of these errors by which models are compared.
    """
    system, found = search.system, select_effects(search)
    declared, residual = judged(system), mean_forces(system, search.means)[0].ravel()
    options = [("declared values", system)]
    if float(found.base.left_out @ found.base.left_out) < float(residual @ residual):
        options.insert(0, ("refitted values", found.base.model))
    chosen = admitted(options, judged, Reference(declared))
    refit = system if chosen.option is None else chosen.option[1]
    errors = measured(system), measured(refit)
    left_out = search.means.left_out
    given = {"left_out": listing(left_out), "one": len(left_out) == 1}
    remarks = (Fact.worded("note", "records", count=len(search.means), **given), *chosen.remarks)
    answer = Answer("none", (), refit, refit, (*errors, errors[1]), remarks=remarks)
    if not found.fits:
        return answer, found
    named, against = _not_refused(found.fits, judged, declared, judged(refit))
    if named is None:
        return answer.unknown(effects_of(found.fits[0], refit), against), found
    if against:
        further = found.fits[len(named.trial.parts)].part
        words = f"{further.title}, a further effect: {against[0].words}"
        remarks = (*remarks, Fact("not accepted", words))
    answer = replace(
        answer,
        verdict="ambiguous" if found.rivals else "effect",
        effects=effects_of(named, refit),
        augmented=named.model,
        figures=(*errors, measured(named.model)),
        remarks=(*remarks, *search.values_away(found.rivals)),
    )
    return answer, found


def _not_refused(
    fits: Sequence[SteadyFit], judged: Measured, declared: ErrorFigures, refit: ErrorFigures
) -> tuple[SteadyFit | None, tuple[Fact, ...]]:
    """The last of successive fits before one that held-out records refuse, and why they refuse that one."""
    named, before = None, refit
    for fit in fits:
        chosen = admitted([("refitted values", fit.model)], judged, Reference(declared, before))
        if chosen.option is None:
            return named, merged(chosen.refusals)
        named, before = fit, chosen.figures
    return named, ()


def effects_of(fit: SteadyFit, system: System) -> tuple[FoundEffect, ...]:
    """The parts of a fit as effects, with their intervals."""
    found = zip(fit.trial.parts, fit.parameters, fit.intervals(), strict=True)
    return tuple(effect_of(part, values, system, spans) for part, values, spans in found)
