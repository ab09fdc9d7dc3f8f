"""Test for candidates that only attenuate the noise of the logged inputs (errors in variables).

The effect's change of the prediction is simulated again with inputs that do not have that noise, which serve as
instrumental variables. Source: the method of instrumental variables, as in Söderström and Stoica, System
Identification, 1989, chapter 8.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.residual import Problem, evaluate_forces, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.signals import Motion
from codegen.mechanics.system import Matrix, System

LEAST_KEPT = 0.25
"""Least share of what effects explain that they must also explain with inputs without noise. On a simulated axis, with
noise of 70 % of the drive force's RMS, attenuated noise kept 19 % at most, and true effects 40 % and more; where these
kept less, their parameters were wrong by half and more."""
LEAST_BY_NOISE = 0.5
"""Least share of what effects explain that the noise of inputs explains, if they only attenuate it; by definition at
least 1, apart from the error of ŵ. On simulated axes attenuated noise had 0.9 and more. True saturations that act most
of the time, which keep little since ŵ is the input that acts, had 0.15 at most."""


def only_attenuates_noise(search: Search, before: Fit, after: Fit) -> str:
    """Objection if free runs gain since the noise of the logged inputs moves a model with the effect less; else empty.

    Args:
        before, after: fits on the same segments, without and with the effect.
    """
    if not is_attenuated_noise(search.problem, before, after):
        return ""
    return "explains little with inputs without noise: it attenuates the noise of the logged inputs"


def is_attenuated_noise(problem: Problem, before: Fit, after: Fit) -> bool:
    """Whether free runs of a model with more effects are better mainly since it attenuates the noise of inputs.

    The noise of a logged input moves the model, and whatever damps that motion reduces the error: a lag, a larger
    inertia, more friction. The effect's change of the prediction is then correlated with the error through the noise
    (errors in variables). So, as with instrumental variables, the same change is simulated with inputs without it,

        ŵ = w − B⁺ r,   B = ∂g/∂w,

    r the low-passed force residual of a model. With ŵ that model follows the measured motion, so ŵ has the noise of
    that motion alone, which is independent of the noise of w.

    With e the error without the effects, d their change of the prediction and d̂ that change with inputs without noise,
    both less what start states explain, the shares of Σ e² that they explain are compared:

        sgn(e·d̂) (e·d̂)²/(d̂·d̂)  <  κ sgn(e·d) (e·d)²/(d·d),   κ = ``LEAST_KEPT``

    Neither side depends on the size of the effects, which noise biases. Each segment has the weight 1/(1 + (e² + d²)/K)
    of the score test. Two ŵ are tried, and the better one counts: those with which the model without the effects
    follows the measured motion, and those with which the model with them does.

    What attenuation removes is caused by the noise. So inputs without it must explain as much without the effects
    (κ = ``LEAST_BY_NOISE``): the low-passed ones, or those with which the model with the effects follows the motion.
    Here segments have the weight d²/(e² + d²) too, with the d of the logged inputs: where the effects change little,
    inputs with which a model follows the motion explain whatever else is missing.
    """
    if not before.model.inputs:
        return False
    record = before.runner.record
    change = _change(before, after, record)
    explained = _explained(before, change)
    if explained <= 0:  # free runs are no better, and no noise makes them so
        return False
    clean = (record.with_inputs(inputs) for inputs in _without_noise(problem, before, after))
    if any(_explained(before, _change(before, after, one)) >= LEAST_KEPT * explained for one in clean):
        return False
    acting, motion = _acting(before, change), problem.motion
    explained = _explained(before, change, acting)
    smooth = np.asarray(motion.low_pass(motion.commands)), inputs_that_move(problem, after.model, motion)
    by_noise = (_explained(before, _change_by_inputs(before, record.with_inputs(one)), acting) for one in smooth)
    return any(one >= LEAST_BY_NOISE * explained for one in by_noise)


def _change(before: Fit, after: Fit, record: Record) -> Array:
    """(S, K n) change of the prediction by effects, with a record's inputs, after regression on the start states."""
    without, with_it = (before.residual_of(replace(f.runner, record=record), f.theta) for f in (before, after))
    return before.starts.project(without - with_it, slope=True)


def _change_by_inputs(fit: Fit, record: Record) -> Array:
    """(S, K n) change of the prediction of a fit by a record's inputs, after regression on the start states."""
    own, other = (fit.residual_of(replace(fit.runner, record=one), fit.theta) for one in (fit.runner.record, record))
    return fit.starts.project(own - other, slope=True)


def _mean_square(values: Array) -> Array:
    """(S,) mean square in each segment."""
    return np.asarray((values**2).mean(axis=1))


def _acting(before: Fit, change: Array) -> Array:
    """(S,) d²/(e² + d²) of each segment; 0 where both are 0."""
    own = _mean_square(change)
    both = own + _mean_square(before.residual)
    return np.divide(own, both, out=np.zeros_like(own), where=both > 0)


def _explained(before: Fit, change: Array, acting: Array | float = 1.0) -> float:
    """Weighted Σ e² that a change of the prediction explains, negative if it points away from the error.

    ``acting``: a factor on the weight of each segment, (S,).
    """
    error = before.residual
    weighted = change * (acting / (1 + _mean_square(error) + _mean_square(change)))[:, None]
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
    if (by_inputs == by_inputs[:1]).all():  # one pseudo-inverse: of each sample they take longer than all the rest
        inverses = np.linalg.pinv(by_inputs[:1]).repeat(len(by_inputs), axis=0)
    else:
        inverses = np.linalg.pinv(by_inputs)
    excess = np.einsum("kmn,kn->km", inverses, force)
    excess[:-1] = (excess[:-1] + excess[1:]) / 2  # the mean over the time for which a row is held
    return np.asarray(motion.low_pass(motion.commands) - excess)
