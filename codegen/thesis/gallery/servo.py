"""Figures of chapters 2, 3 and 6: the position servo with friction, and cancellation of its estimate.

The friction of chapter 6 has hysteresis, by the reset integrator law, and three observers estimate it.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery import measures as m
from codegen.thesis.gallery.measures import Reading, ratio, rms
from codegen.thesis.gallery.runs import Gains, Runs, ideal_run, pid_run, servo_run, tuned_pid
from codegen.thesis.gallery.setting import Setting, with_observer

LETTERS = "abcd"
PRINTED_NOISE = 0.1
"""Position noise that the thesis prints, m."""
HALF_PERIOD = 1.0
"""s between jumps of the reference."""
TRANSIENT, SETTLED = 0.4, 0.7
"""s after a jump: end of the transient, and time from which on the mass should be at rest."""
NAMES = ("CFO", "TO", "DFO")
HOLD = 1e-3
"""s for which a value of the noise is held, so that observers of different sample times get the same noise."""
WINDOW = 0.01
RIG_SAMPLE_TIME = 0.01


def cancelled(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """Runs a, b, … of each spec's servo; none_a, … without cancellation; pid_a, … with one PID."""
    ideal = ideal_run(specs[0], setting)
    gains = pid or tuned_pid(specs[0], setting, ideal)
    loops, known = {"ideal": ideal}, dict[str, str]()
    for letter, spec in zip(LETTERS, specs, strict=False):
        loops[letter] = servo_run(spec, setting)
        same = known.setdefault(str(spec.contacts), letter)
        loops[f"none_{letter}"] = loops.get(f"none_{same}") or servo_run(spec, setting, cancel=None)
        loops[f"pid_{letter}"] = loops.get(f"pid_{same}") or pid_run(spec, setting, ideal, gains)
    return Runs(specs, setting, loops, gains)


def without_tachometer(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """The runs of ``cancelled``, and runs measured_a, … in which the observers use the measured velocity."""
    runs = cancelled(specs, setting, pid)
    loops = dict(runs.loops)
    for letter, spec in zip(LETTERS, specs, strict=False):
        choice = spec.required_observer
        gains = {k: v for k, v in choice.gains.items() if k != "K_v"}
        loops[f"measured_{letter}"] = servo_run(with_observer(spec, choice.kind, gains, velocity="measured"), setting)
    return replace(runs, loops=loops)


def uncancelled(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """Runs a, b, … of each spec's servo without an observer."""
    loops = {letter: servo_run(spec, setting, cancel=None) for letter, spec in zip(LETTERS, specs, strict=False)}
    return Runs(specs, setting, {"ideal": ideal_run(specs[0], setting), **loops})


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


def _errors(runs: Runs, names: str | Sequence[str]) -> list[float]:
    """RMS distance of runs from the ideal motion, m."""
    return [rms(m.position_error(runs[name], runs["ideal"])) for name in names]


def _unrest(run: LoopRun) -> float:
    """RMS of the position about its mean in each interval of rest, m."""
    still = m.since_reversal(run, HALF_PERIOD) > SETTLED
    x = run.true_positions[still, 0].reshape(-1, int(np.sum(still & (run.time < HALF_PERIOD))))
    return rms((x - x.mean(axis=1, keepdims=True)).ravel())


def _force_error(run: LoopRun) -> float:
    """RMS error of the friction estimate during sliding, N."""
    return rms(m.friction_error(run)[m.sliding(run) & m.after(run, 1.0)])


def hang_off_without(runs: Runs) -> Reading:
    run, ideal = runs["a"], runs["ideal"]
    still = m.since_reversal(run, HALF_PERIOD) > 0.95 * HALF_PERIOD
    left = float(np.max(np.abs(m.position_error(run, ideal)[still])))
    return Reading(left, (("hang-off", left),), "m")


def improves_with_k_F(runs: Runs) -> Reading:
    return m.falling(_errors(runs, "abc"), ("k_F = 1", "10", "100"), "m")


def mu_helps(runs: Runs) -> Reading:
    return m.falling([_force_error(runs[name]) for name in "bd"], ("μ = 1", "2"), "N")


def gain_shortens_transient(runs: Runs) -> Reading:
    moving = m.since_reversal(runs["b"], HALF_PERIOD) < TRANSIENT
    errors = [rms(m.position_error(runs[name], runs["ideal"])[moving]) for name in "bc"]
    return m.falling(errors, ("k_F = 10", "100"), "m")


def gain_costs_rest(runs: Runs) -> Reading:
    unrest = [_unrest(runs[name]) for name in "bc"]
    return Reading(unrest[1] - unrest[0], tuple(zip(("k_F = 10", "100"), unrest, strict=True)), "m")


def improves_with_k_2(runs: Runs) -> Reading:
    return m.falling(_errors(runs, "ab"), ("k₂ = −10", "−100"), "m")


def both_satisfy(runs: Runs) -> Reading:
    errors, without = _errors(runs, "cb"), _errors(runs, ["none_c", "none_b"])
    worst = max(ratio(*pair) for pair in zip(errors, without, strict=True))
    return Reading(worst, (("CFO", errors[0]), ("TO", errors[1]), ("not cancelled", without[0])), "m")


def cfo_shows_more_detail(runs: Runs) -> Reading:
    errors = [_force_error(runs["c"]), _force_error(runs["b"])]
    return Reading(ratio(errors[0], errors[1]), tuple(zip(("CFO", "TO"), errors, strict=True)), "N")


def better_than_pid(runs: Runs) -> Reading:
    """RMS distance from the ideal motion of the best observer over that of the PID."""
    observers = [name for name in (*LETTERS, *NAMES) if name in runs.loops]
    errors = dict(zip(observers, _errors(runs, observers), strict=True))
    best = min(errors, key=lambda name: errors[name])
    own, words = (f"pid_{best}", f"best observer ({best})") if best in LETTERS else ("pid", best)
    pid = _errors(runs, [own])[0]
    return Reading(ratio(errors[best], pid), ((words, errors[best]), ("PID", pid)), "m")


def _against(runs: Runs, others: str, words: tuple[str, str]) -> Reading:
    """Position errors of the servos a and b over those of the runs with the prefix ``others``, the larger ratio."""
    pairs = {name: _errors(runs, (name, f"{others}{name}")) for name in "ab"}
    parts = [p for name, (own, other) in pairs.items() for p in ((f"({name}) {words[0]}", own), (words[1], other))]
    return Reading(max(ratio(own, other) for own, other in pairs.values()), tuple(parts), "m")


cancels = partial(_against, others="none_", words=("cancelled", "not"))
velocity_observer_is_free = partial(_against, others="measured_", words=("estimated", "measured"))


def law_is_met(runs: Runs) -> Reading:
    parts = []
    for letter, spec in zip(LETTERS, runs.specs, strict=False):
        p = {name: float(value) for name, value in spec.contacts[0].parameters.items()}
        run = runs[letter]
        v, moving = run.true_velocities[:, 0], m.sliding(run)
        speed = np.abs(v)
        level = p["a"] if "a" in p else p["a1"] + p["a2"] * np.exp(-p["a3"] * speed) + p["a4"] * speed
        distance = (run.friction[:, 0] - level * np.sign(v))[moving]
        parts.append((f"({letter})", rms(distance) / rms(run.friction[moving, 0])))
    return Reading(max(value for _, value in parts), tuple(parts))


def dfo_is_best(runs: Runs) -> Reading:
    errors = [rms(m.friction_error(runs[name])[m.after(runs[name], 1.0)]) for name in NAMES]
    return Reading(ratio(errors[2], min(errors[:2])), tuple(zip(NAMES, errors, strict=True)), "N")


def _missed(runs: Runs, observer: str) -> Reading:
    """``missed_in_presliding`` of an observer."""
    missed, level = {}, runs.numbers["level"]
    for name in NAMES:
        truth, estimate = runs[name].friction[:, 0], runs[name].friction_estimate[:, 0]
        missed[name] = m.missed_in_presliding(truth, estimate, level, m.after(runs[name], 1.0))
    return Reading(missed[observer], tuple(missed.items()))


to_has_hysteresis = partial(_missed, observer="TO")
cfo_misses_hysteresis = partial(_missed, observer="CFO")


def cfo_is_noisiest(runs: Runs) -> Reading:
    noise = [m.ripple(runs[name].friction_estimate[m.after(runs[name], 1.0), 0], runs[name], WINDOW) for name in NAMES]
    return Reading(ratio(noise[0], max(noise[1:])), tuple(zip(NAMES, noise, strict=True)), "N")


def cfo_finds_level(runs: Runs) -> Reading:
    run, level = runs["CFO"], runs.numbers["level"]
    slides = (np.abs(run.friction[:, 0]) >= m.SLIDES * level) & m.after(run, 1.0)
    found = float(np.mean(np.abs(run.friction_estimate[slides, 0])))
    return Reading(abs(found / level - 1), (("mean estimate", found), ("level", level)), "N")


def dfo_runs_on_the_rig(runs: Runs) -> Reading:
    p = runs.specs[2].contacts[0].parameters
    longest = 2 / float(p["c"] * p["D1"])
    return Reading(longest, (("longest", longest), ("rig", RIG_SAMPLE_TIME)), "s")


def noise_passed(runs: Runs) -> Reading:
    """Response of the estimate to one sample of noise, gain · k_v · noise, over the RMS friction.

    It follows from F̂ = … + gain v̂ and v̂ = z + k_v x.
    """
    level = rms(runs["none_a"].friction[m.sliding(runs["none_a"]), 0])
    choice = runs.specs[0].required_observer
    gain = abs(float(choice.gains["K_2" if choice.kind == "to" else "K_F"]) * float(choice.gains["K_v"]))
    passed = gain * PRINTED_NOISE
    return Reading(passed / level, (("noise", passed), ("friction", level)), "N")


def draw_responses(figure: Any, runs: Runs) -> None:
    """Figure 2.3: response, its distance from the ideal, friction against velocity."""
    response, error, friction = figure.subplots(1, 3)
    run, ideal = runs["a"], runs["ideal"]
    d.line(response, ideal.time, ideal.true_positions[:, 0], d.IDEAL, "without friction", dashes=(0, (5, 2)))
    d.line(response, run.time, run.true_positions[:, 0], d.TRUE, "with friction, not cancelled")
    d.line(error, run.time, m.position_error(run, ideal), d.TRUE)
    _friction(friction, runs.specs[0], run)
    d.frame(response, d.TIME, "position in m", "(a)")
    d.frame(error, d.TIME, "distance in m", "(b)")
    d.frame(friction, "velocity in m/s", "friction in N", "(c)")
    d.legend(figure, response)


def draw_cancelled(figure: Any, runs: Runs) -> None:
    """Figures 2.4, 2.5, 3.3 and 3.4: a row for each observer, with the servo without cancellation and the PID."""
    # Specs of other figures are there for a comparison only; a source ends in the figure's number.
    figures = [spec.source.rpartition(",")[2] for spec in runs.specs]
    letters = [letter for letter, figure in zip(LETTERS, figures, strict=False) if figure[:-1] == figures[0][:-1]]
    grid = figure.subplots(len(letters), 3, squeeze=False, sharex="col")
    for row, letter, spec in zip(grid, letters, runs.specs, strict=False):
        response, error, friction = row
        run = runs[letter]
        draw_motions(response, error, runs, (f"none_{letter}", f"pid_{letter}", letter))
        d.dots(friction, run.true_velocities[:, 0], run.friction_estimate[:, 0], d.ESTIMATED)
        _friction(friction, spec, run)
        d.limit(friction, run.friction, 1.8)
        _frames(row, f"({letter}) {_gains(spec)}", last=letter == letters[-1])
    d.legend(figure, grid[0, 0], grid[0, 2])


def draw_observers(figure: Any, runs: Runs) -> None:
    """Figure 6.1: a row for each observer: response, distance from the ideal, friction against velocity."""
    grid = figure.subplots(3, 3, sharex="col")
    for row, name, letter in zip(grid, NAMES, "abc", strict=True):
        response, error, friction = row
        draw_motions(response, error, runs, ("none", "pid", name))
        run = runs[name]
        late = m.after(run, 1.0)
        d.dots(friction, run.true_velocities[late, 0], run.friction[late, 0], d.TRUE, "true friction")
        d.dots(friction, run.true_velocities[late, 0], run.friction_estimate[late, 0], d.ESTIMATED)
        friction.set_xlim(-1.5, 1.5)
        d.limit(friction, run.friction, 2)
        _frames(row, f"({letter}) {name}", last=name == NAMES[-1])
    d.legend(figure, grid[0, 0], grid[0, 2])


def _frames(row: Any, title: str, last: bool) -> None:
    """Labels of a row of response, distance and friction; those of the abscissae in the ``last`` row alone."""
    response, error, friction = row
    d.frame(response, d.TIME if last else "", "position in m", title)
    d.frame(error, d.TIME if last else "", "distance in m")
    d.frame(friction, "velocity in m/s" if last else "", "friction in N")


def draw_motions(response: Any, error: Any, runs: Runs, names: tuple[str, str, str]) -> None:
    """The ideal motion, the motions without cancellation, with PID and with cancellation, and their distances."""
    ideal = runs["ideal"]
    d.line(response, ideal.time, ideal.true_positions[:, 0], d.IDEAL, "without friction", dashes=(0, (5, 2)))
    labels = ("not cancelled", "PID", "estimated and cancelled")
    for name, colour, label, width in zip(
        names, (d.OTHER, d.THIRD_ONE, d.ESTIMATED), labels, (1.4, 1.4, 1.8), strict=True
    ):
        run = runs[name]
        d.line(response, run.time, run.true_positions[:, 0], colour, label, width)
        d.line(error, run.time, m.position_error(run, ideal), colour, width=width)


def draw_friction(figure: Any, runs: Runs) -> None:
    """Figure 3.2: friction against velocity in the motion."""
    panels = figure.subplots(1, 2)
    for axes, letter, spec, words in zip(panels, "ab", runs.specs, ("Coulomb", "“extended” Coulomb"), strict=True):
        run = runs[letter]
        d.dots(axes, run.true_velocities[:, 0], run.friction[:, 0], d.ESTIMATED, "in the motion")
        _friction(axes, spec, run)
        d.frame(axes, "velocity in m/s", "friction in N", f"({letter}) {words}")
    d.legend(figure, panels[0])


def _gains(spec: Spec) -> str:
    choice = spec.observer
    if choice is None:
        return ""
    words = [f"{name} = {value}" for name, value in choice.gains.items() if str(value) != "0"]
    mu = [f"μ = {choice.exponent}"] if choice.kind == "cfo" and choice.velocity == "measured" else []
    return f"{choice.kind.upper()}, " + ", ".join(words + mu).replace("-", "−").replace("K_", "k_")


def _friction(axes: Any, spec: Spec, run: LoopRun) -> None:
    """Draw the law of the spec's first contact over the velocities of a run."""
    speed = np.linspace(0, float(np.max(np.abs(run.true_velocities))), 100)
    level = m.friction_level(spec, 0, speed)
    both = np.concatenate([-speed[::-1], speed]), np.concatenate([-level[::-1], level])
    d.line(axes, *both, d.TRUE, "true friction", width=1.6)
