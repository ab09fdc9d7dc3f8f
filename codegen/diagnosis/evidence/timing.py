"""Timing of a log's inputs: by how much they act earlier than the time of their row.

Simulation assumes zero-order hold: w(t) = w[k] from t_k to t_{k+1}. A measured input is between two rows about the mean
of both values, which leads the held one by half a row. An input that is logged one row late leads by a row, and one
that the drive filters before it is logged by the lag of the filter. No effect of a machine acts before its input, but
compliance, presliding and damping fit the force residual of a lead, so it is corrected before effects are sought.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.residual_regression import KNOTS, LEAST_ROWS, since_reversal, splines
from codegen.diagnosis.fit.acceptance import LEAST_SIZE
from codegen.diagnosis.fit.linear import correlation, independent
from codegen.diagnosis.fit.measure import drive_force, inertia_along
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.starting_values import DENSE, resonances, resonant
from codegen.logs import Finding, Log
from codegen.logs.uniform import earlier
from codegen.mechanics.system import System

LEAST_LEAD, ABOUT_HALF, LARGEST_LEAD = 0.25, 0.75, 2.5
"""In rows: the least lead that is corrected, the greatest that counts as half a row, the greatest that is corrected."""
SHORTEST_LEAD = 0.15
"""Rows: the least lead that is corrected where it explains ``EXPLAINED``. The estimate of a held command, which has
none, is up to 0.1 rows off."""
LARGEST_IN_PLACE = 10.0
"""Rows: the greatest lead that is corrected in place of effects that add states, since free runs compare the two."""
USUAL = 0.5, 1.0
"""Leads in rows of a measurement and of an input that is logged a row late; taken where the estimate agrees."""
LEAST_MEAN_SIGN = 0.98
"""Least |low-pass of sgn v| of a used sample: near a reversal, sticking looks like a delay."""
SURE = 3.5
"""Least estimate of a lead in standard deviations."""
CERTAIN = 7.0
"""The same of an input that is stated as measured, for a lead above ``ABOUT_HALF`` that explains less than
``EXPLAINED``: it is expected to be late, and a missing force does not hide it."""
EXPLAINED = 0.5
"""Least share of the squared force residual, after regression on the other terms, that a lead above ``ABOUT_HALF`` or
below ``LEAST_LEAD`` explains. Of a force that the model lacks it explains a part only."""
LEAST_OWN_SHARE = 1e-4
"""Least share of the squared change by a lead that the other terms cannot represent; below it there is no estimate."""
SETTLED = 0.1
"""The estimate has converged when the input, shifted by it, still leads by at most so many rows."""
STEEP = np.geomspace(1e-3, 0.5, 10)
"""Speeds and distances in which friction changes at low speed and after a reversal, as shares of top speed and span."""
MOST_ROWS = 20_000
"""Rows of which a regression uses all; of more it uses at least so many, and ``DENSE`` in a period of the cutoff."""
MOST_ESTIMATES = 4
"""Largest number of these estimates; the residual is not linear in a long lead."""


@dataclass(frozen=True)
class Lead:
    """By how many rows an input acts earlier than a held command.

    Attributes:
        rows: the lead that is corrected: one of ``USUAL`` if the estimate agrees with it, else the estimate.
        explained: share of the squared force residual, after regression on the other terms.
        size: RMS of the force that the lead changes, over that of the drive force.
        estimate: by regression of the force residual.
        expected: whether the input is stated as measured, so that a filter of the drive may have made it late.
    """

    rows: float = 0.0
    deviation: float = 1.0
    explained: float = 0.0
    size: float = 0.0
    estimate: float = 0.0
    expected: bool = False

    def deviations_from(self, rows: float) -> float:
        """By how many standard deviations the estimate differs from so many rows."""
        return abs(self.estimate - rows) / self.deviation

    @property
    def matters(self) -> bool:
        """Whether its estimate is significant, it is in the range that is corrected, and its force is material."""
        return self.is_shown and self.rows <= LARGEST_LEAD

    @property
    def is_significant(self) -> bool:
        """Whether its estimate is significant, and the lead is as long as the least that is corrected."""
        least = SHORTEST_LEAD if self.explained >= EXPLAINED else LEAST_LEAD
        return self.estimate > SURE * self.deviation and self.rows >= least

    @property
    def is_shown(self) -> bool:
        """Whether its estimate is significant and its force is material; it may be too long to be corrected."""
        certain = self.expected and self.estimate > CERTAIN * self.deviation
        plausible = self.rows <= ABOUT_HALF or self.explained >= EXPLAINED or certain
        return self.is_significant and self.size >= LEAST_SIZE and plausible


def acting_earlier(log: Log, rows: Mapping[int, float]) -> Log:
    """The log with inputs corrected for their leads: index of an input → rows."""
    values = log.inputs.copy()
    for k, lead in rows.items():
        if k < values.shape[1]:
            values[:, k] = earlier(values[:, k], lead)
    return replace(log, inputs=values)


def input_leads(problem: Problem, log: Log) -> tuple[dict[int, float], tuple[Finding, ...]]:
    """The leads that are corrected (index of the input → rows), and the findings on them.

    Where held commands are stated nothing is corrected, and a lead of more than ``ABOUT_HALF`` rows is a finding; so is
    one above ``LARGEST_LEAD``, which is not corrected either. That an input was measured says how it runs between two
    rows, and not that no filter of the drive made it late, so its further lead is corrected. An input without a
    significant lead of its own is corrected by ``common_lead`` if its estimate agrees with it.
    """
    system, about = problem.system, log.description
    if system.actuators:
        return {}, ()
    stated = bool(about.input_hold) and not about.measured_inputs
    own = {
        k: replace(lead_of(problem, k), expected=about.measured_inputs)
        for k, w in enumerate(system.inputs)
        if w.name not in about.late
    }
    common = 0.0 if stated else common_lead(list(own.values()))
    leads, found, alike = dict[int, float](), list[Finding](), list[str]()
    for k, lead in own.items():
        w = system.inputs[k]
        if not lead.is_shown:
            if common and lead.deviations_from(common) <= SURE:
                leads[k] = common
                alike.append(w.name)
            continue
        if stated and lead.rows <= ABOUT_HALF:
            continue
        if lead.matters and not stated:
            leads[k] = lead.rows
        found.append(lead_finding(w.name, lead, log, stated))
    if alike:
        found.append(_finding("alike", "other inputs", log, {"lead": common}, names=alike))
    return leads, tuple(found)


def open_inputs(system: System, log: Log) -> list[int]:
    """The inputs that may lead: none where held commands are stated, and not those whose time is stated."""
    about = log.description
    if system.actuators or (about.input_hold and not about.measured_inputs):
        return []
    return [k for k, w in enumerate(system.inputs) if w.name not in about.late]


def lead_finding(
    w: str, lead: Lead, log: Log, stated: bool = False, most: float = LARGEST_LEAD, replaced: Sequence[str] = ()
) -> Finding:
    """The finding on the lead of an input.

    Args:
        stated: whether the description states held commands, so that it is not corrected.
        most: the greatest lead that is corrected, in rows.
        replaced: effects in whose place it is corrected, in words.
    """
    figures = {"lead": lead.rows, "deviation": lead.deviation, "explained": lead.explained}
    about_half = LEAST_LEAD <= lead.rows <= ABOUT_HALF
    given = {"rows": lead.rows, "about_half": about_half, "stated": stated, "most": most, "replaced": replaced}
    return _finding("lead", w, log, figures, w=w, **given)


def overcorrection_finding(w: str, kind: str, lead: float, delay: float, left: float, log: Log) -> Finding:
    """The finding on a lead that was estimated too large.

    Args:
        lead: that was corrected. delay: of the effect ``kind`` that free runs find then. left: the lead in its place;
            all in rows.
    """
    figures = {"lead": left, "before": lead, "delay": delay}
    return _finding("overcorrected", w, log, figures, w=w, kind=kind, lead=lead, delay=delay, left=left)


def _finding(say: str, what: str, log: Log, figures: Mapping[str, float], **given: Any) -> Finding:
    """A warning on the timing of ``what``; ``say``, ``given``: as of the template."""
    about = {"h": log.sample_time, "measured": log.description.measured_inputs}
    return Finding.worded("warning", f"timing of {what}", "timing", say, figures, **about, **given)


def common_lead(leads: Sequence[Lead]) -> float:
    """The lead in rows that the inputs of a log have in common; 0 for none.

    One device writes all inputs of a log, so they should have the same lead. An input may not show it, such as that of
    a joint with a large force that the model lacks. A lead is common if it is the only one that is significant for some
    input, and if Σ min(d², ``SURE``²) over the inputs is less for it than for a lead of 0, where d is the difference
    from an input's estimate in standard deviations.
    If two devices wrote the inputs, an uncertain one gets the lead of the other's. Leads that are not ``USUAL`` differ,
    so none of several is common.
    """
    shown = {lead.rows for lead in leads if lead.matters}
    if len(shown) != 1:
        return 0.0
    rows = shown.pop()
    early, held = (sum(min(lead.deviations_from(one), SURE) ** 2 for lead in leads) for one in (rows, 0.0))
    return rows if early < held else 0.0


def lead_of(problem: Problem, k: int) -> Lead:
    """The lead of input k, by the coordinate where its first estimate is most significant."""
    motion, system = problem.motion, problem.system
    before, explained = 0.0, 0.0
    at: int | None = None  # A coordinate that the input does not move has no estimate; 0 would exceed one below 0.
    for _ in range(MOST_ESTIMATES):
        commands = earlier(motion.commands[:, k], before)
        held, moved = motion.inputs.copy(), motion.inputs.copy()
        held[1:, k] = (commands[1:] + commands[:-1]) / 2
        moved[:, k] = held[:, k]
        moved[1:-1, k] += (commands[2:] - commands[:-2]) / 4
        # moved = held + (w[k+1] − w[k−1])/4, to first order the input with a further lead of half a row
        residual = inverse_dynamics_residual(system, replace(motion, inputs=held))
        change = inverse_dynamics_residual(system, replace(motion, inputs=moved)) - residual
        coordinates = range(residual.shape[1]) if at is None else [at]
        leads = {i: _lead_at(problem, i, residual[:, i], change[:, i], before) for i in coordinates}
        at = max(leads, key=lambda i: (leads[i] != Lead(), leads[i].rows / leads[i].deviation))
        one = leads[at]
        explained = explained or one.explained
        rows = before + one.rows
        if abs(one.rows) <= SETTLED or not ABOUT_HALF < rows <= LARGEST_LEAD:
            break
        before = rows
    usual = next((u for u in USUAL if abs(rows - u) <= SURE * one.deviation), rows)
    return Lead(usual, one.deviation, explained, 2 * abs(rows) * _force_share(problem, change), rows)


def _force_share(problem: Problem, change: Array) -> float:
    """RMS of a change of the force over that of the drive force, on the coordinate where this is largest."""
    motion, system = problem.motion, problem.system
    rest = replace(motion, inputs=0 * motion.inputs)
    drive = inverse_dynamics_residual(system, motion) - inverse_dynamics_residual(system, rest)
    power = [(forces**2 * problem.used).sum(axis=0) for forces in (change, drive)]
    return float(np.sqrt(np.max(power[0][power[1] > 0] / power[1][power[1] > 0], initial=0.0)))


def _lead_at(problem: Problem, i: int, residual: Array, change: Array, before: float) -> Lead:
    """The lead by one coordinate: its force residual, (N,), regressed on ``change``, that of half a row, and others.

    A load behind a spring looks in part like a lead. So where one is significant, with the rows ``before`` by which the
    input is shifted already, a resonance that explains the share ``EXPLAINED`` of what the lead leaves is a term too.
    """
    motion = problem.motion
    used = problem.used[:, i] & (np.abs(motion.low_pass(np.sign(motion.velocities[:, i]))) > LEAST_MEAN_SIGN)
    if used.sum() < LEAST_ROWS or not np.any(change[used]):
        return Lead()
    every = max(1, min(int(used.sum()) // MOST_ROWS, motion.step(DENSE)))
    used &= np.arange(len(used)) % every == 0
    rate = min(2 * motion.cutoff_hz * motion.sample_time * every, 1.0)
    x, v = motion.positions - motion.positions.mean(axis=0), motion.velocities
    others = np.column_stack(
        [
            motion.accelerations,
            v,
            np.sign(v),
            x,
            *_undeclared_forces(x[:, i], v[:, i], drive_force(problem.system, motion)[:, i]),
        ]
    )
    others = motion.low_pass(others)[used]
    others = others / np.maximum(np.linalg.norm(others, axis=0), 1e-300)
    pair = np.column_stack([-change, residual])[used]
    lead, left = _regressed(pair, others, rate)
    if abs(before + lead.rows) <= SURE * lead.deviation:
        return lead
    rest = np.zeros(len(used))
    rest[used] = left
    acceleration, inertia = motion.accelerations[:, i], float(np.mean(inertia_along(problem.system, motion, i)))
    for one in resonances(rest, acceleration, used, inertia, motion, 1):
        column = resonant(one.frequency, one.damping_ratio, acceleration, motion)[used]
        beside, other = _regressed(pair, np.column_stack([others, column / np.linalg.norm(column)]), rate)
        if other @ other < (1 - EXPLAINED) * (left @ left):
            return beside
    return lead


def _regressed(pair: Array, others: Array, rate: float) -> tuple[Lead, Array]:
    """The lead by a regression on other terms, and what is left.

    Args:
        pair: (M, 2) the change by a lead of half a row, with its sign reversed, and the residual.
        rate: independent values per row of a signal with the coarse filter's band.
    """
    apart = pair - others @ np.linalg.lstsq(others, pair, rcond=1e-10)[0]
    by_lead, left = apart.T
    square = float(by_lead @ by_lead)
    if square <= LEAST_OWN_SHARE * float(pair[:, 0] @ pair[:, 0]):
        return Lead(), left
    halves = float(by_lead @ left) / square
    rest = left - halves * by_lead
    count = max(1.0, independent(correlation(rest[:: max(1, round(1 / rate))])) * rate * len(rest))
    deviation = max(float(np.sqrt(float(rest @ rest) / count / square)), 1e-300)
    return Lead(halves / 2, deviation / 2, 1 - float(rest @ rest) / max(float(left @ left), 1e-300)), rest


def _undeclared_forces(x: Array, v: Array, drive: Array) -> tuple[Array, ...]:
    """Regressors (N, m) for forces that a model may lack at one coordinate.

    Smooth curves over speed and position, the latter also times sgn v; Stribeck curves sgn v exp(−|v|/v_s), presliding
    exp(−d/d_s) at the distance d from a reversal, and friction in proportion to the drive force.
    """
    sign, speed, distance = np.sign(v)[:, None], np.abs(v)[:, None], since_reversal(x, v)[:, None] ** 2
    place = splines(x, KNOTS)
    stribeck = sign * np.exp(-speed / (STEEP * max(float(np.quantile(speed, 0.95)), 1e-300)))
    presliding = sign * np.exp(-distance / (STEEP * max(float(np.ptp(x)), 1e-300)))
    return splines(v, KNOTS), place, place * sign, stribeck, presliding, sign * np.abs(drive)[:, None]
