"""Test of an effect with inputs without noise, against attenuation of their noise (errors in variables).

In free runs the noise of a logged input moves the model, and whatever damps that motion reduces the error: a lag, a
larger inertia, more friction. The effect's change of the prediction is then correlated with the error through the
noise. The remedy is that of instrumental variables: the same change is simulated with inputs that do not have this
noise,

    ŵ = w − B⁺ r,   B = ∂g/∂w,

with r the low-passed force residual of a model. With ŵ that model follows the measured motion, so ŵ has the noise of
that motion alone, which is independent of the noise of w.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.fit.credit import is_far
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.residual import Problem, evaluate_forces, inverse_dynamics_residual
from codegen.diagnosis.fit.signals import Motion
from codegen.mechanics.system import Matrix, System

LEAST_KEPT, LEAST_NEAR_NOISE = 0.25, 0.1
"""Least share of what effects explain that they must also explain with inputs without noise; and the same where free
runs end near the noise of the motion. On a simulated axis, with noise of 70 % of the drive force's RMS, attenuated
noise kept 19 % at most, and true effects 40 % and more; where these kept less, their parameters were wrong by half and
more. Near the noise, a load behind a spring whose resonance is the frequency of a ripple kept 1 %, and true effects of
the practice logs 29 % and more: least a saturation, since ŵ does not exceed its limit. One at 0.75 of the largest
input of ``two_mass`` kept 19 %, so far from the noise it would be refused."""


def is_attenuated_noise(problem: Problem, before: Fit, after: Fit) -> bool:
    """Whether free runs of a model with more effects are better mainly since it attenuates the noise of inputs.

    With e the error without the effects, d their change of the prediction and d̂ that change with inputs without noise,
    both less what start states explain, the shares of Σ e² that they explain are compared:

        sgn(e·d̂) (e·d̂)²/(d̂·d̂)  <  κ sgn(e·d) (e·d)²/(d·d),   κ = ``LEAST_KEPT`` or ``LEAST_NEAR_NOISE``

    Neither side depends on the size of the effects, which noise biases. Each segment has the weight 1/(1 + (e² + d²)/K)
    of the score test. Two ŵ are tried, and the better one counts: those with which the model without the effects
    follows the measured motion, and those with which the model with them does.
    """
    if not before.model.inputs:
        return False
    least = LEAST_KEPT if is_far(after) else LEAST_NEAR_NOISE
    record = before.runner.record
    explained = _explained(before, _change(before, after, record))
    if explained <= 0:  # free runs are no better, and no noise makes them so
        return False
    clean = (record.with_inputs(inputs) for inputs in _without_noise(problem, before, after))
    kept = max(_explained(before, _change(before, after, one)) for one in clean)
    return kept < least * explained


def _change(before: Fit, after: Fit, record: Record) -> Array:
    """(S, K n) change of the prediction by effects, with a record's inputs, after regression on the start states."""
    without, with_it = (before.residual_of(replace(f.runner, record=record), f.theta) for f in (before, after))
    return before.starts.project(without - with_it, slope=True)


def _explained(before: Fit, change: Array) -> float:
    """Weighted Σ e² that a change of the prediction explains, negative if it points away from the error."""
    error = before.residual
    weighted = change / (1 + (error**2 + change**2).mean(axis=1))[:, None]
    along, size = float((weighted * error).sum()), float((weighted * change).sum())
    return along * abs(along) / size if size > 0 else 0.0


def _without_noise(problem: Problem, before: Fit, after: Fit) -> Iterator[Array]:
    """Inputs ŵ, (N, m): with the force residual of the first model, then from those with that of the second one."""
    motion = problem.motion
    for model in (before.model, after.model):
        commands = inputs_that_move(problem, model, motion)
        earlier = np.vstack([commands[:1], commands[:-1]])
        motion = replace(motion, commands=commands, inputs=(earlier + commands) / 2)
        yield commands


def inputs_that_move(problem: Problem, model: System, motion: Motion) -> Array:
    """(N, m) low-passed inputs, held from row to row, with which a model follows the measured motion.

    Where the force balance says nothing, as at standstill, they are the low-passed inputs of ``motion``.
    """
    columns = [Matrix(model.force.diff(w)) for w in model.inputs]
    by_inputs = evaluate_forces(model, columns, motion).transpose(1, 2, 0)
    force = np.where(problem.used, inverse_dynamics_residual(model, motion), 0.0)
    excess = np.einsum("kmn,kn->km", np.linalg.pinv(by_inputs), force)
    excess[:-1] = (excess[:-1] + excess[1:]) / 2  # the mean over the time for which a row is held
    return np.asarray(motion.low_pass(motion.commands) - excess)
