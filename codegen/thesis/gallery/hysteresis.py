"""Figure 6.1: three observers on a servo whose friction has hysteresis, by the reset integrator law."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.measures import Reading, after, friction_error, position_error, ratio, ripple, rms
from codegen.thesis.gallery.runs import Gains, Runs, ideal_run, pid_run, servo_run, tuned_pid
from codegen.thesis.gallery.servo import draw_motions
from codegen.thesis.gallery.setting import Setting

NAMES = ("CFO", "TO", "DFO")
HOLD = 1e-3
"""s for which a value of the noise is held, so that observers of different sample times get the same noise."""
WINDOW = 0.01
FULL = 0.98
"""Share of the level above which the contact counts as sliding."""
RIG_SAMPLE_TIME = 0.01


def three_observers(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """The servo with each observer by its name; and ``ideal``, ``none`` and ``pid`` at the first spec's sample time."""
    held = replace(setting, hold=setting.hold or HOLD)
    quick = replace(held, step=None)
    ideal = ideal_run(specs[0], quick)
    gains = pid or tuned_pid(specs[0], quick, ideal)
    loops = {"ideal": ideal, "none": servo_run(specs[0], quick, cancel=None)}
    loops["pid"] = pid_run(specs[0], quick, ideal, gains)
    loops |= {name: servo_run(spec, held) for name, spec in zip(NAMES, specs, strict=True)}
    return Runs(specs, setting, loops, gains, {"level": float(specs[0].contacts[0].parameters["a"])})


def _hysteresis_missed(run: LoopRun, level: float) -> float:
    """RMS error in presliding over the RMS friction there: near 1 if the estimate has no hysteresis."""
    presliding = (np.abs(run.friction[:, 0]) < FULL * level) & after(run, 1.0)
    return ratio(rms(friction_error(run)[presliding]), rms(run.friction[presliding, 0]))


def dfo_is_best(runs: Runs) -> Reading:
    errors = [rms(friction_error(runs[name])[after(runs[name], 1.0)]) for name in NAMES]
    return Reading(ratio(errors[2], min(errors[:2])), tuple(zip(NAMES, errors, strict=True)), "N")


def _missed(runs: Runs, observer: str) -> Reading:
    """``_hysteresis_missed`` of an observer."""
    missed = {name: _hysteresis_missed(runs[name], runs.numbers["level"]) for name in NAMES}
    return Reading(missed[observer], tuple(missed.items()))


to_has_hysteresis = partial(_missed, observer="TO")
cfo_misses_hysteresis = partial(_missed, observer="CFO")


def cfo_is_noisiest(runs: Runs) -> Reading:
    noise = [ripple(runs[name].friction_estimate[after(runs[name], 1.0), 0], runs[name], WINDOW) for name in NAMES]
    return Reading(ratio(noise[0], max(noise[1:])), tuple(zip(NAMES, noise, strict=True)), "N")


def cfo_finds_level(runs: Runs) -> Reading:
    run, level = runs["CFO"], runs.numbers["level"]
    slides = (np.abs(run.friction[:, 0]) >= FULL * level) & after(run, 1.0)
    found = float(np.mean(np.abs(run.friction_estimate[slides, 0])))
    return Reading(abs(found / level - 1), (("mean estimate", found), ("level", level)), "N")


def better_than_pid(runs: Runs) -> Reading:
    errors = {name: rms(position_error(runs[name], runs["ideal"])) for name in (*NAMES, "pid")}
    best = min(NAMES, key=lambda name: errors[name])
    return Reading(ratio(errors[best], errors["pid"]), ((best, errors[best]), ("PID", errors["pid"])), "m")


def dfo_runs_on_the_rig(runs: Runs) -> Reading:
    p = runs.specs[2].contacts[0].parameters
    longest = 2 / float(p["c"] * p["D1"])
    return Reading(longest, (("longest", longest), ("rig", RIG_SAMPLE_TIME)), "s")


def draw(figure: Any, runs: Runs) -> None:
    """A row for each observer: response, distance from the ideal, friction against velocity."""
    grid = figure.subplots(3, 3, sharex="col")
    for row, name, letter in zip(grid, NAMES, "abc", strict=True):
        response, error, friction = row
        draw_motions(response, error, runs, ("none", "pid", name))
        run = runs[name]
        late = after(run, 1.0)
        d.dots(friction, run.true_velocities[late, 0], run.friction[late, 0], d.TRUE, "true friction")
        d.dots(friction, run.true_velocities[late, 0], run.friction_estimate[late, 0], d.ESTIMATED)
        friction.set_xlim(-1.5, 1.5)
        d.limit(friction, run.friction, 2)
        last = name == NAMES[-1]
        d.frame(response, d.TIME if last else "", "position in m", f"({letter}) {name}")
        d.frame(error, d.TIME if last else "", "distance in m")
        d.frame(friction, "velocity in m/s" if last else "", "friction in N")
    d.legend(figure, grid[0, 0], grid[0, 2])
