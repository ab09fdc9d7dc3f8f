"""The error bound against the generated C on exact motions: never exceeded, and nearly attained by the worst of them.

The motions are exact: constant acceleration within a sample, w = m a + F, positions summed in doubles. Measured
positions carry noise up to the stated bound. The estimates come from the compiled C.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from codegen.analysis.analysis import analyse
from codegen.app.certify import Certified
from codegen.app.derived import Derived
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.bound.error_bound import error_bounds
from codegen.certify.bound.error_response import error_response
from codegen.certify.bound.friction_bounds import sliding
from codegen.certify.certify import Certificate, certify
from codegen.certify.remedies.sample_times import largest_sample_times
from codegen.effects.declare import add_declared_effects
from codegen.emit.package import emit_sources, make_header
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.program import build_program
from codegen.replay.engine import Engine
from codegen.spec import Spec, parse_spec
from tests.slow_cases import slow_except

MASS, LEVEL, TOP, NOISE, H = 2.5, 30.0, 80.0, 4e-6, 0.001
TEXT = """
name: rail
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2.5, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts: [{name: rail, law: coulomb, a: 30, unit: N}]
envelope: {v_dot: [-80, 80], x_noise: [-4e-6, 4e-6], w: [-235, 235]}
"""
OBSERVERS = {
    "cfo": "{kind: cfo, velocity: estimated, gains: {K_F: 40, K_v: 90}, sample_time: 0.001, integration: %s}",
    "to": "{kind: to, velocity: estimated, gains: {K_1: 0, K_2: -40, K_v: 90}, sample_time: 0.001, integration: %s}",
}
CASES = [(kind, step) for kind in OBSERVERS for step in ("euler", "semi_implicit")]
SETTLE = 3000


def proved(spec: Spec) -> ErrorBound:
    """The bound, and what is proved of the C that is printed."""
    found = Derived(spec).outcome
    assert isinstance(found, Certificate), found.reason
    assert not isinstance(found.bounds, str), found.bounds
    return found.bounds[0]


@cache
class Bench:
    """The compiled observer of a kind, its bound, and the true error of its force estimate along motions."""

    def __init__(self, kind: str, step: str, text: str = TEXT) -> None:
        spec = parse_spec(text + f"observer: {OBSERVERS[kind] % step}\n", Path("rail.yaml"))
        observer = build_observer(spec, build_system(spec))
        self.spec, self.bound = spec, proved(spec)
        assert self.bound.proved
        self.slope = sliding(observer, observer.system.contacts[0])
        program = build_program(observer)
        self.engine = Engine(program, emit_sources(program, make_header("rail.yaml", "0" * 64, "")))
        names = [name for name, _, _ in program.outputs]
        self.force, self.speed = names.index("F_hat_on_x"), names.index("v_hat")

    def run(
        self,
        a: Any,
        noise: Any,
        v0: float = 40.0,
        mass: float = 0.0,
        input_gain: float = 0.0,
        sample_time: float = 0.0,
    ) -> tuple[Any, Any]:
        """|F − F̂| and |v − v̂| at every sample but those in which the start dies away, under which a = 0.

        By ``mass`` the observer's mass is larger than the machine's, by ``input_gain`` the inputs' effect is, and by
        ``sample_time`` the samples are longer.
        """
        v, found, _ = self.estimates(a, noise, v0, mass, input_gain, sample_time)
        return np.abs(LEVEL - found[SETTLE:, self.force]), np.abs(v - found[:, self.speed])[SETTLE:]

    def estimates(
        self,
        a: Any,
        noise: Any,
        v0: float,
        mass: float = 0.0,
        input_gain: float = 0.0,
        sample_time: float = 0.0,
        friction: Any = None,
    ) -> tuple[Any, Any, Any]:
        """Velocity, the code's outputs and the friction, LEVEL or that of the velocity at each sample."""
        a = np.concatenate([np.zeros(SETTLE), a])
        noise = np.concatenate([np.zeros(SETTLE), noise])
        h = H * (1 + sample_time)
        v = v0 + h * np.concatenate([[0.0], np.cumsum(a)[:-1]])
        x = np.concatenate([[0.0], np.cumsum(h * v + h * h * a / 2)[:-1]])
        assert (v > 1).all()
        force = np.full(len(v), LEVEL) if friction is None else friction(v)
        rows = np.column_stack([x + noise, (MASS / (1 + mass) * a + force) / (1 + input_gain)])
        self.engine.start(rows[0])
        found, _ = self.engine.run(rows)
        return v, found, force


def balanced(generator: np.random.Generator, samples: int) -> Any:
    """Accelerations of many kinds, mirrored in pairs of segments so that the speed stays where it is."""
    half, rows = 50, []
    for _ in range(samples // (2 * half)):
        kind = generator.integers(4)
        if kind == 0:
            a = generator.choice([-1.0, 1.0], half)
        elif kind == 1:
            a = generator.uniform(-1, 1, half)
        elif kind == 2:
            a = np.sign(np.sin(np.arange(half) * generator.uniform(0.02, 3) + generator.uniform(0, 6)))
        else:
            a = np.full(half, generator.choice([-1.0, 1.0]))
        rows += [a, -a]
    return TOP * np.concatenate(rows)


@pytest.mark.parametrize("step", ["euler", "semi_implicit"])
@pytest.mark.parametrize("kind", [*OBSERVERS, "gto"])
def test_the_response_is_that_of_the_compiled_code(kind: str, step: str) -> None:
    """Random noise, d_x, d_v and changes of friction, of a machine with a spring and a damper, sample by sample."""
    text = TEXT.replace("parameters: {", "parameters: {b: {value: 7, unit: N*s/m}, k: {value: 0.5, unit: N/m}, ")
    text = text.replace("force: [w]", "force: [w - b*v - k*x]")
    gains = OBSERVERS.get(kind, OBSERVERS["to"].replace("kind: to", "kind: gto").replace("K_1: 0", "K_1: -3"))
    spec = parse_spec(text + f"observer: {gains % step}\n", Path("rail.yaml"))
    observer = build_observer(spec, build_system(spec))
    response, program = error_response(observer), build_program(observer)
    assert not isinstance(response, str)
    draw, count = np.random.default_rng(2), 2000
    noise, d_x, d_v, d_f, more = draw.normal(size=(5, count)) * np.array([[1e-8], [1e-8], [1e-5], [0.1], [20.0]])
    w = LEVEL + 7 * 40 + more
    x, v, friction, a = np.zeros((4, count))
    v[0], friction[0] = 40.0, LEVEL
    for k in range(count - 1):
        a[k] = (w[k] - 7 * v[k] - 0.5 * x[k] - friction[k]) / MASS
        v[k + 1] = v[k] + H * a[k] + d_v[k]
        x[k + 1] = x[k] + H * v[k + (step == "semi_implicit")] + d_x[k]
        friction[k + 1] = friction[k] + d_f[k]
    engine = Engine(program, emit_sources(program, make_header("rail.yaml", "0" * 64, "")))
    rows, names = np.column_stack([x + noise, w]), [name for name, _, _ in program.outputs]
    engine.start(rows[0])
    found, _ = engine.run(rows)
    estimated = found[:, [names.index("v_hat"), names.index("F_hat_on_x")]]
    direct = np.array(response.direct, dtype=float)[:, 0]
    error = np.column_stack([v, friction]) - estimated + noise[:, None] * direct
    causes = {"noise": noise, "displacement": d_x, "velocity": d_v, "acceleration": a}
    moved = error @ np.array(response.step, dtype=float).T + np.column_stack([0 * d_f, d_f])
    moved += sum(c[:, None] * np.array(getattr(response, name), dtype=float)[:, 0] for name, c in causes.items())
    assert np.abs(moved[:-1] - error[1:])[1500:].max() < 1e-8 < 1e-3 * np.abs(error[1500:]).max()


@pytest.mark.parametrize(("kind", "step"), CASES)
def test_never_exceeded_in_random_runs(kind: str, step: str) -> None:
    bench, generator = Bench(kind, step), np.random.default_rng(1)
    a = balanced(generator, 200_000)
    noise = (
        NOISE
        * generator.choice([-1.0, 1.0], len(a))
        * np.where(generator.random(len(a)) < 0.5, 1, generator.random(len(a)))
    )
    force, speed = bench.run(a, noise)
    assert 0.2 * bench.bound.steady < force.max() <= bench.bound.steady
    (threshold,) = bench.bound.slip_speeds
    assert speed.max() <= threshold.threshold


@pytest.mark.parametrize(("kind", "step"), CASES)
def test_the_worst_motion_comes_within_a_tenth(kind: str, step: str) -> None:
    """The motion and noise that the C itself answers to most: signs of its own impulse responses, reversed in time."""
    bench, count = Bench(kind, step), 2000
    zero = np.zeros(count)

    def signed(a: Any, noise: Any) -> Any:
        full = np.concatenate([np.zeros(SETTLE), a])
        v = 40.0 + H * np.concatenate([[0.0], np.cumsum(full)[:-1]])
        x = np.concatenate([[0.0], np.cumsum(H * v + H * H * full / 2)[:-1]])
        rows = np.column_stack([x + np.concatenate([np.zeros(SETTLE), noise]), MASS * full + LEVEL])
        bench.engine.start(rows[0])
        return LEVEL - bench.engine.run(rows)[0][SETTLE:, bench.force]

    pulse = np.eye(1, count)[0]
    by_motion = signed(1.0 * pulse, zero) - signed(zero, zero)
    by_noise = signed(zero, 1e-3 * pulse) - signed(zero, zero)
    a = TOP * np.sign(by_motion[::-1])
    v = np.cumsum(a) * H
    force, _ = bench.run(a, NOISE * np.sign(by_noise[::-1]), v0=41.0 + max(0.0, -v.min()))
    assert force[-1] <= bench.bound.steady
    assert force[-1] > bench.bound.steady / 1.1


LEFT_OUT = {
    "compliance": ("x", "k: 2000, c: 0.5, load_fraction: 0.5", "x moves a load behind a spring"),
    "presliding": ("rail", "sigma: 20", "the law presliding at rail has a state"),
    "encoder_eccentricity": ("x", "amplitude: 0.001, period: 0.3, phase: 0", "the sensor of x reads wrong"),
}


@pytest.mark.parametrize("kind", LEFT_OUT)
@pytest.mark.parametrize("observer", OBSERVERS)
def test_no_bound_where_a_declared_effect_would_break_it(kind: str, observer: str) -> None:
    """A load that swings or a bristle that bends after a reversal: 10.6 and 2.9 N were seen for a bound of 1.79."""
    place, numbers, said = LEFT_OUT[kind]
    effects = f"effects: [{{kind: {kind}, on: {place}, parameters: {{{numbers}}}}}]\n"
    spec = parse_spec(TEXT + f"observer: {OBSERVERS[observer] % 'euler'}\n" + effects, Path("rail.yaml"))
    analysis = analyse(spec, build_observer(spec, add_declared_effects(build_system(spec), spec)))
    found = certify(spec, analysis, {}, "none")
    assert isinstance(found, Certificate)
    bounds = error_bounds(spec, analysis, found)
    assert isinstance(bounds, str) and said in bounds


@pytest.mark.parametrize("sign", slow_except([-1, 1], [-1]))
def test_friction_that_slides_after_its_own_state(sign: int) -> None:
    """A reset integrator's f follows the slip with a lag of 1 ms, exactly: x, v, f are linear where it slides."""
    law = "law: reset_integrator, a: 30, c: 100, D1: 10, D2: 0.01"
    text = TEXT.replace("law: coulomb, a: 30", law) + f"observer: {OBSERVERS['to'] % 'euler'}\n"
    spec = parse_spec(text, Path("rail.yaml"))
    observer = build_observer(spec, build_system(spec))
    bound = proved(spec)
    most = bound.steady
    assert bound.parts["friction"] > 0.5 * most  # 3 N s/m at 80 m/s^2
    program = build_program(observer)
    engine = Engine(program, emit_sources(program, make_header("rail.yaml", "0" * 64, "")))
    force = [name for name, _, _ in program.outputs].index("F_hat_on_x")
    drift, push = np.zeros((4, 4)), np.array([0, 1 / MASS, 0, 0])
    drift[0, 1], drift[1, 2], drift[2] = 1, -LEVEL / MASS, [0, 100, -1000, 100 * 10 * (1 - 0.001)]
    whole = expm(H * np.block([[drift, push[:, None]], [np.zeros((1, 5))]]))
    step, kick = whole[:4, :4], whole[:4, 4]
    generator = np.random.default_rng(3)
    motions = [np.zeros(SETTLE), balanced(generator, 30_000), *[TOP * np.ones(300), -TOP * np.ones(300)] * 3]
    state, rows, truth, fastest = np.array([0, 40.0, 1 + 39.99 / 10, 1]), [], [], 0.0
    for a in sign * 0.99 * np.concatenate(motions):
        w = MASS * a + LEVEL * state[2]
        fastest = max(fastest, *np.abs([w - LEVEL * f for f in (state[2], (step @ state + kick * w)[2])]))
        rows.append([state[0] + NOISE * generator.choice([-1, 1]), w])
        truth.append(LEVEL * state[2])
        state = step @ state + kick * w
        assert state[1] > 1
    assert fastest <= MASS * TOP  # the motion is one of the envelope
    engine.start(np.array(rows[0]))
    error = np.abs(np.array(truth) - engine.run(np.array(rows))[0][:, force])[SETTLE:]
    assert 0.5 * most < error.max() <= most


GAUSSIAN = {"F_c": 20.0, "F_s": 30.0, "v_s": 6.0, "F_v": 0.5}


def test_a_law_whose_slope_is_no_rational_number_has_a_bound() -> None:
    """The Gaussian Stribeck curve falls by √2 exp(−1/2) (F_s − F_c)/v_s − F_v at most; the C stays in the bound."""
    law = ", ".join(f"{name}: {value}" for name, value in GAUSSIAN.items())
    bench = Bench("cfo", "euler", TEXT.replace("law: coulomb, a: 30", f"law: gaussian, {law}"))
    f_c, f_s, v_s, f_v = GAUSSIAN.values()

    def level(v: Any) -> Any:
        return f_c + (f_s - f_c) * np.exp(-((v / v_s) ** 2)) + f_v * v

    speeds = np.linspace(0, 20, 20_001)  # no secant is steeper than the steepest slope
    steepest = np.abs(np.gradient(level(speeds), speeds)).max()
    assert bench.slope is not None
    slope = float(Fraction(str(bench.slope.slope)))
    assert steepest <= slope * (1 + 1e-11) and slope == pytest.approx(steepest, rel=1e-6)
    assert slope >= np.sqrt(2) * np.exp(-0.5) * (f_s - f_c) / v_s - f_v
    generator = np.random.default_rng(2)
    a = TOP * np.where(np.arange(40_000) % 200 < 100, 1, -1)  # velocity from 4 to 12 m/s
    noise = NOISE * generator.choice([-1.0, 1.0], len(a))
    _, found, force = bench.estimates(a, noise, 4.0, friction=level)
    error = np.abs(force - found[:, bench.force])[SETTLE:]
    assert 0.02 * bench.bound.steady < error.max() <= bench.bound.steady


PLACED = TEXT.replace("unit: kg}}", "unit: kg}, reach: {value: 1, unit: m}, drag: {value: 2, unit: kg/m}}")
TURNED = PLACED.replace("mass_matrix: [[m]]", "mass_matrix: [[m*(2 + sin(x/reach))]]").replace(
    "envelope: {", "envelope: {x: [-1, 1], v: [-1, 1], "
)
REASONS = {
    "implicit": (TEXT, "implicit", "estimated", "the step is implicit"),
    "exponential": (TEXT, "exponential", "estimated", "the step is exponential"),
    "measured": (TEXT, "euler", "measured", "the observer measures velocity"),
    "varying mass": (TURNED, "euler", "estimated", "the mass matrix depends on x, and the bound covers a constant one"),
    "no accelerations": (TEXT.replace("v_dot: [-80, 80], ", ""), "euler", "estimated", "has no range for v_dot"),
    "drag": (
        PLACED.replace("force: [w]", "force: [w - drag*v*v]").replace("envelope: {", "envelope: {v: [0.1, 1], "),
        "euler",
        "estimated",
        "the damping dg/dv is not constant, and the bound covers a constant one",
    ),
}


@pytest.mark.parametrize("case", REASONS)
def test_the_reason_for_no_bound_is_this_spec_s(case: str) -> None:
    text, step, velocity, said = REASONS[case]
    observer = OBSERVERS["cfo"] % step
    if velocity == "measured":
        observer = observer.replace("velocity: estimated", "velocity: measured").replace(", K_v: 90", "")
    spec = parse_spec(text + f"observer: {observer}\n", Path("rail.yaml"))
    analysis = analyse(spec, build_observer(spec, build_system(spec)))
    found = certify(spec, analysis, {}, "none", further=False)
    assert isinstance(found, Certificate), found.reason
    bounds = error_bounds(spec, analysis, found)
    assert isinstance(bounds, str) and said in bounds


def test_a_full_k_f_is_the_reason_for_no_bound() -> None:
    """It was said to be "the slope of the gain function h", which is constant."""
    path = Path(__file__).parents[2] / "specs" / "two_mass.yaml"
    spec = parse_spec(path.read_text("utf-8").replace("K_F: [500, 700]", "K_F: [[500, 20], [30, 700]]"), path)
    analysis = analyse(spec, build_observer(spec, build_system(spec)))
    found = certify(spec, analysis, {}, "none", further=False)
    assert isinstance(found, Certificate)
    bounds = error_bounds(spec, analysis, found)
    assert isinstance(bounds, str) and bounds.startswith("K_F couples contacts")


def test_a_bound_that_is_of_little_use_is_told_from_one_that_is() -> None:
    """Friction of 30 N is within 30 N of zero; ten times the acceleration makes the bound ten times as large."""
    bounds = {}
    for top in (80, 8000):
        text = TEXT.replace("[-80, 80]", f"[-{top}, {top}]") + f"observer: {OBSERVERS['cfo'] % 'euler'}\n"
        spec = parse_spec(text, Path("rail.yaml"))
        analysis = analyse(spec, build_observer(spec, build_system(spec)))
        found = certify(spec, analysis, {}, "none", further=False)
        assert isinstance(found, Certificate)
        given = error_bounds(spec, analysis, found)
        assert not isinstance(given, str)
        bounds[top] = given
        said = " ".join(Certified(found, given, {}).text().split())
        assert "inputs are held constant from sample to sample" in said
        assert ("of no use: friction itself is at most 30 N" in said) == (given[0].steady >= 30)
        (threshold,) = given[0].slip_speeds
        shown = float(said.split(f"have the same sign: {threshold.contact} ")[1].split()[0])
        assert threshold.threshold <= shown <= 1.01 * threshold.threshold
        assert given[0].parts[given[0].largest_part] == max(given[0].parts.values())
        loud = replace(given[0], parts={"noise": 31.0, "velocity": 1.0}, steady=32.0)
        said = " ".join(Certified(found, (loud,), {}).text().split())
        assert "largest part of the bound, noise, comes from the position noise: narrow NAME_noise" in said
    assert bounds[80][0].largest == bounds[8000][0].largest == 30
    assert bounds[80][0].steady < 30 < bounds[8000][0].steady


def test_an_error_that_decays_slowly_is_bounded_while_samples_suffice() -> None:
    """A time constant of 1400 samples: nine of them are more than the checker follows, and no bound was proved."""
    slow = OBSERVERS["cfo"].replace("K_F: 40, K_v: 90", "K_F: 10, K_v: 1.5") % "euler"
    bound = proved(parse_spec(TEXT + f"observer: {slow}\n", Path("rail.yaml")))
    assert bound.proved and bound.after and bound.worst < bound.steady < 1.01 * bound.worst
    spec = parse_spec(TEXT + f"observer: {slow.replace('0.001', '0.00001')}\n", Path("rail.yaml"))
    found = Derived(spec).outcome
    assert isinstance(found, Certificate)
    assert found.bounds == "the error has not decayed after 10000 samples, the most that are summed"


def test_the_bound_of_a_slow_estimate_is_near_the_worst() -> None:
    """Time constants of 2000 and 3000 samples. V decays as slowly as the slowest error, and the velocity's decays fast:
    with √(b'Pb)/(1 − γ) for what a disturbance adds to V, the first bound was 1.16 times the worst, and the second did
    not exist."""
    for samples, factor in ((2000, 1.03), (3000, 1.4)):
        slow = OBSERVERS["cfo"].replace("K_F: 40, K_v: 90", f"K_F: {2.5e5 / samples}, K_v: 400") % "euler"
        text = TEXT + f"observer: {slow.replace('0.001', '0.00001')}\n"
        bound = proved(parse_spec(text, Path("rail.yaml")))
        assert bound.proved and bound.worst < bound.steady < factor * bound.worst


def test_after_a_start_that_is_wrong() -> None:
    """The declared level is off by less than the bound's start: the error stays below the bound as time goes on."""
    bench = Bench("cfo", "euler")
    rows = np.column_stack([np.cumsum(np.full(2000, 3.0 * H)), np.full(2000, 65.0 * 1.0)])
    assert bench.bound.start == pytest.approx(2 * LEVEL + bench.bound.steady, rel=1e-6)
    falling = [value for _, value in bench.bound.after]
    assert falling[-1] < 1.1 * bench.bound.steady + 0.02 * bench.bound.start
    assert bench.bound.reversal is not None and len(bench.bound.after) > 3
    assert 10 < bench.bound.reversal.left < 15
    analysis = analyse(bench.spec, build_observer(bench.spec, build_system(bench.spec)))
    certificate = certify(bench.spec, analysis, {}, "none")
    assert isinstance(certificate, Certificate)
    assumed = error_bounds(bench.spec, analysis, certificate)[0]  # from ``start``, and not from what a reversal leaves
    assert not isinstance(assumed, str)
    for lower, stated in ((20.0, assumed.after), (0.95 * bench.bound.reversal.left, bench.bound.after)):
        bench.engine.start(rows[0])
        settled = bench.engine.run(rows)[0][-1, bench.force]
        assert settled == pytest.approx(65.0, abs=bench.bound.steady)
        # from here the true level is lower at once: the error starts there and falls
        rest = np.column_stack([rows[-1, 0] + np.cumsum(np.full(600, 3.0 * H)), np.full(600, 65.0 - lower)])
        error = np.abs(65.0 - lower - bench.engine.run(rest)[0][:, bench.force])
        for time, value in stated:
            assert error[min(599, round(time / H))] <= value


@pytest.mark.parametrize(("kind", "step"), CASES)
@pytest.mark.parametrize("sign", slow_except([-1, 1], [1]))
def test_a_model_that_is_off_by_a_percent(kind: str, step: str, sign: int) -> None:
    """The observer's mass, input gain and clock are right; the machine's are off by a percent."""
    bench, share, generator = Bench(kind, step), 0.01 * sign, np.random.default_rng(5)
    more = bench.bound.percent
    assert set(more) == {"mass", "input gain", "sample time"}
    assert more["mass"] == pytest.approx(0.01 * MASS * TOP, rel=0.3)  # what a percent of the mass takes to accelerate
    held = np.repeat([TOP, -TOP], 230)
    without = float(bench.run(held, 0 * held)[0][229])
    for cause, added in more.items():
        off = {cause.replace(" ", "_"): share}
        for a in (balanced(generator, 20_000), held):
            force = bench.run(a, NOISE * generator.choice([-1.0, 1.0], len(a)), **off)[0]
            assert force.max() <= bench.bound.steady + added
        error = float(bench.run(held, 0 * held, **off)[0][229])
        assert min(abs(x - added) for x in (error - without, without - error, error + without)) < 0.1 * added


def test_largest_sample_times_by_eigenvalues() -> None:
    """Euler and semi-implicit Euler against the spectral radius of their matrices, written by hand."""
    spec = parse_spec(TEXT + f"observer: {OBSERVERS['cfo'] % 'euler'}\n", Path("rail.yaml"))
    found = largest_sample_times(spec, analyse(spec, build_observer(spec, build_system(spec))))
    assert set(found) == {"euler", "semi_implicit", "implicit", "exponential"} and found["implicit"] == np.inf

    def radius(gain: float, weight: float, h: float) -> float:
        step = np.array([[1 - h * gain, -h * weight / MASS], [40 * h * gain, 1 - h * 40 * (1 - weight) / MASS]])
        return float(np.abs(np.linalg.eigvals(step)).max())

    ways = {
        "euler": lambda h: (90.0, 1.0),
        "semi_implicit": lambda h: (90 / (1 + 90 * h), 1 / (1 + 90 * h)),
        "exponential": lambda h: ((1 - np.exp(-90 * h)) / h, (1 - np.exp(-90 * h)) / (90 * h)),
    }
    for way, coefficients in ways.items():
        h = found[way]
        assert radius(*coefficients(h), h) < 1 < radius(*coefficients(1.03 * h), 1.03 * h)


def test_largest_sample_times_at_a_double_eigenvalue() -> None:
    """K_v = 4 K_F/m: Psi has the double eigenvalue -K_v/2, so Euler is stable below h = 4/K_v.

    The Lyapunov equation was singular at a rate that was tried, and `certify` ended with an error.
    """
    observer = "{kind: cfo, velocity: estimated, sample_time: 0.001, gains: {K_F: 1470, K_v: 168}}"
    text = TEXT.replace("value: 2.5, unit: kg", "value: 35, unit: kg") + f"observer: {observer}\n"
    spec = parse_spec(text, Path("rail.yaml"))
    found = largest_sample_times(spec, analyse(spec, build_observer(spec, build_system(spec))))
    assert set(found) == {"euler", "semi_implicit", "implicit", "exponential"}
    assert found["euler"] == pytest.approx(4 / 168, rel=0.02)


@pytest.mark.slow
def test_a_million_random_runs() -> None:
    """10⁶ runs of 100 samples each, one after the other in ten pieces."""
    bench, worst = Bench("cfo", "euler"), 0.0
    for seed in range(10):
        generator = np.random.default_rng(seed)
        a = balanced(generator, 10_000_000)
        force, _ = bench.run(a, NOISE * generator.choice([-1.0, 1.0], len(a)))
        worst = max(worst, float(force.max()))
    assert 0.3 * bench.bound.steady < worst <= bench.bound.steady
