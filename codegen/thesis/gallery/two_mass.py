"""Figures of sections 4.7, 5.4 and 7.7: two masses, two observers of their friction, and its cancellation.

In 4.7 and 7.7, run ``a`` is the observer of the model, a GCFO or GDFO; ``b`` the GTO with the gains as printed; ``low``
the GTO with a tenth of them. In figure 5.1 the input on the lower mass cancels the friction on the ground.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.cancellation import cancelling_outputs, with_cancellation
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.replay.engine import engine_of
from codegen.simulate.controller import declared_controller
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.observed_loop import Cancellation, SampledLoop
from codegen.spec.model import Spec
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.measures import SLIDES, Reading, after, missed_in_presliding, overshoot, ratio, rms
from codegen.thesis.gallery.runs import Gains, Runs, closed_loop, sample_count, watch
from codegen.thesis.gallery.setting import Setting, from_zero, with_observer, without_friction

TRANSIENT = 2.0
"""s from which on an estimate counts as settled."""
PRINTED_NOISE = 0.1
"""Amplitude of the noise that the thesis prints, m."""
HOLD = 1e-3
"""s for which a value of the noise is held, unless a setting states it."""
FORCES = ("F₁", "F₁ + F₂")


def watched(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """The machine with the observers of the specs as ``a`` and ``b``, and ``b`` with a tenth of K_2 as ``low``."""
    choice = specs[-1].observer
    observers = dict(zip("ab", specs, strict=False))
    if choice is not None and choice.kind == "gto":
        gains = {**choice.gains, "K_2": [value / 10 for value in _diagonal(choice.gains["K_2"])]}
        observers["low"] = with_observer(specs[-1], "gto", gains)
    held = replace(setting, hold=setting.hold or HOLD)
    return Runs(specs, setting, watch(specs[0], held, observers))


def _diagonal(gain: Any) -> list[float]:
    return [float(value) for value in gain]


def contact_forces(run: LoopRun) -> tuple[Array, Array]:
    """True and estimated F₁ between the masses and F₁ + F₂ on the ground, (N, 2) each."""
    return np.cumsum(run.friction, axis=1), np.cumsum(run.friction_estimate, axis=1)


def _errors(run: LoopRun, start: float = TRANSIENT) -> list[float]:
    """RMS error of each force, N."""
    truth, estimate = contact_forces(run)
    late = after(run, start)
    return [rms((truth - estimate)[late, k]) for k in range(2)]


def _compared(one: LoopRun, other: LoopRun, label: str, names: Sequence[str]) -> Reading:
    """RMS errors of a run's estimates over those of another run, the larger of both forces."""
    pairs = list(zip(_errors(one), _errors(other), strict=True))
    labels = [label.format(who=who, force=force) for force in FORCES for who in names]
    parts = zip(labels, [e for pair in pairs for e in pair], strict=True)
    return Reading(max(ratio(*pair) for pair in pairs), tuple(parts), "N")


def model_is_better(runs: Runs) -> Reading:
    names = [spec.required_observer.kind.upper() for spec in runs.specs]
    return _compared(runs["a"], runs["b"], "{who} {force}", names)


def needs_gain(runs: Runs) -> Reading:
    return _compared(runs["b"], runs["low"], "{force} {who}", ("as printed", "a tenth"))


def _worst(values: Sequence[float]) -> Reading:
    """The larger of the numbers of both forces."""
    return Reading(max(values), tuple(zip(FORCES, values, strict=True)))


def overshoots(runs: Runs) -> Reading:
    early = ~after(runs["b"], TRANSIENT)
    truth, estimate = (force[early] for force in contact_forces(runs["b"]))
    return _worst([overshoot(estimate[:, k], truth[:, k]) for k in range(2)])


def excellent_in_noise(runs: Runs) -> Reading:
    truth, _ = contact_forces(runs["a"])
    late = after(runs["a"], TRANSIENT)
    return _worst([ratio(e, rms(truth[late, k])) for k, e in enumerate(_errors(runs["a"]))])


def noise_passed(runs: Runs) -> Reading:
    choice = runs.specs[1].required_observer
    # Of F̂ = z + K_2 v̂ and v̂ = z_v + K_v x.
    passed = abs(_diagonal(choice.gains["K_2"])[1] * _diagonal(choice.gains["K_v"])[1]) * PRINTED_NOISE
    level = rms(contact_forces(runs["b"])[0][after(runs["b"], TRANSIENT), 1])
    return Reading(passed / level, (("noise", passed), ("friction", level)), "N")


def _missed(run: LoopRun) -> list[float]:
    """``missed_in_presliding`` of each force."""
    truth, estimate = contact_forces(run)
    late, levels = after(run, TRANSIENT / 2), np.max(np.abs(truth), axis=0)
    return [missed_in_presliding(truth[:, k], estimate[:, k], levels[k], late) for k in range(2)]


def gto_misses_hysteresis(runs: Runs) -> Reading:
    missed = _missed(runs["low"])
    return Reading(min(missed), tuple(zip(FORCES, missed, strict=True)))


def gto_has_hysteresis(runs: Runs) -> Reading:
    return _worst(_missed(runs["b"]))


def gdfo_has_hysteresis(runs: Runs) -> Reading:
    return _worst(_missed(runs["a"]))


def gto_finds_levels(runs: Runs) -> Reading:
    truth, estimate = contact_forces(runs["b"])
    late, levels = after(runs["b"], TRANSIENT / 2), np.max(np.abs(truth), axis=0)
    off = []
    for k in range(2):
        slides = (np.abs(truth[:, k]) >= SLIDES * levels[k]) & late
        off.append(abs(float(np.mean(estimate[slides, k] * np.sign(truth[slides, k]))) / levels[k] - 1))
    return _worst(off)


def motion(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """The open-loop motion of the machine, as run ``motion``."""
    return Runs(specs, setting, watch(specs[0], setting, {}))


def draw_motion(figure: Any, runs: Runs) -> None:
    """Figures 4.3 and 7.1: input and responses."""
    top, bottom = figure.subplots(2, 1, sharex=True)
    run = runs["motion"]
    d.line(top, run.time, run.inputs[:, 0], d.TRUE)
    for k, colour, label in ((0, d.ESTIMATED, "upper mass, x₁"), (1, d.OTHER, "lower mass, x₂")):
        d.line(bottom, run.time, run.true_positions[:, k], colour, label, 2.0)
    d.frame(top, "", "input in N")
    d.frame(bottom, d.TIME, "position in m")
    d.legend(figure, bottom)


def draw_watched(figure: Any, runs: Runs) -> None:
    """Figures 4.4, 4.5 and 7.2: a row for each observer, a column for each force."""
    grid = figure.subplots(2, 2, sharex=True)
    for row, letter, spec in zip(grid, "ab", runs.specs, strict=True):
        run = runs[letter]
        truth, estimate = contact_forces(run)
        for k, axes in enumerate(row):
            d.line(axes, run.time, estimate[:, k], d.ESTIMATED, "estimated", 1.0)
            d.line(axes, run.time, truth[:, k], d.TRUE, "true", 1.6)
            d.limit(axes, truth[:, k], 2.6)
            kind = spec.required_observer.kind.upper()
            where = "between the masses" if k == 0 else "on the ground"
            d.frame(axes, d.TIME if letter == "b" else "", f"{FORCES[k]} in N", f"({letter}) {kind}, {where}")
    d.legend(figure, grid[0, 0])


PUSHED = (np.array([0.0, 0.0]), np.array([0.0, 1.0]))
"""Positions in m and velocities in m/s of a start in motion, since the thesis does not state the start."""


def with_and_without(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """Runs ``cancelled``, ``none`` and ``ideal`` from rest, and ``pushed_cancelled``, … after a push.

    The ideal machine has the friction between the masses, which the input cannot cancel, as in section 5.4.
    """
    spec = setting.applied(specs[0])
    free = replace(spec, contacts=(spec.contacts[0], without_friction(spec).contacts[1]))
    made = from_zero(spec)
    system = build_system(made)
    observer = engine_of(made, with_cancellation(made, build_observer(made, system)), made.code)
    cancellation = Cancellation(outputs=cancelling_outputs(system))
    quiet = Setting(setting.name, noise=0.0)
    loops = {}
    for prefix, start in (("", None), ("pushed_", PUSHED)):
        loops[f"{prefix}ideal"] = _run(free, quiet, start=start)
        loops[f"{prefix}none"] = _run(spec, setting, start=start)
        loops[f"{prefix}cancelled"] = _run(spec, setting, observer, cancellation, start)
    return Runs(specs, setting, loops)


def _run(spec: Spec, setting: Setting, observer: Any = None, cancellation: Any = None, start: Any = None) -> LoopRun:
    controller = declared_controller(spec, spec.required_simulation, sample_count(spec))
    seed = spec.required_simulation.seed + setting.seed
    loop = SampledLoop(controller, observer, cancellation, setting.sensors(spec, False), seed)
    return closed_loop(spec, loop, start=start)


def _closeness(runs: Runs, prefix: str) -> Reading:
    """RMS distance from the ideal motion with cancellation, over that without."""
    ideal = runs[f"{prefix}ideal"].true_positions
    left, without = (rms((runs[prefix + name].true_positions - ideal).ravel()) for name in ("cancelled", "none"))
    return Reading(ratio(left, without), (("cancelled", left), ("not", without)), "m")


closer_to_ideal = partial(_closeness, prefix="")
closer_when_pushed = partial(_closeness, prefix="pushed_")


def draw_cancelled(figure: Any, runs: Runs) -> None:
    """Figure 5.1: responses without and with cancellation, and the distance from the ideal: at rest and pushed."""
    grid = figure.subplots(2, 3, sharex=True)
    for row, prefix, words in zip(grid, ("", "pushed_"), ("from rest", "pushed, 1 m/s"), strict=True):
        ideal = runs[f"{prefix}ideal"]
        for axes, name, letter in zip(row[:2], ("none", "cancelled"), "ab", strict=True):
            run = runs[f"{prefix}{name}"]
            d.line(axes, ideal.time, ideal.true_positions[:, 1], d.IDEAL, "ideal, lower mass", dashes=(0, (5, 2)))
            d.line(axes, run.time, run.true_positions[:, 0], d.OTHER, "upper mass", 1.4)
            d.line(axes, run.time, run.true_positions[:, 1], d.ESTIMATED, "lower mass")
            how = "not cancelled" if name == "none" else "cancelled"
            d.frame(axes, d.TIME if prefix else "", "position in m", f"({letter}) {how}, {words}")
        for name, colour, label in (("none", d.THIRD_ONE, "#1: (a)"), ("cancelled", d.TRUE, "#2: (b)")):
            run = runs[f"{prefix}{name}"]
            d.line(row[2], run.time, (run.true_positions - ideal.true_positions)[:, 1], colour, label)
        d.frame(row[2], d.TIME if prefix else "", "distance in m", "(c) lower mass")
    d.legend(figure, grid[0, 0], grid[0, 2])
