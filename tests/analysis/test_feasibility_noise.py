"""The noise of the friction estimate: against the generated code on a noisy run, and against code disturbed by hand."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.analysis.feasibility.gain_dynamics import GainDynamics, Settings
from codegen.analysis.feasibility.noise import NoiseModel, position_noise
from codegen.analysis.operating_points import operating_points
from codegen.effects.declare import add_declared_effects
from codegen.emit.package import emit_sources, make_header
from codegen.mechanics import System, build_system
from codegen.observers import Observer, build_observer
from codegen.program import build_program
from codegen.spec import Spec, parse_spec, read_spec
from tests.twin import load_twin

from .gain_specs import MASS, spec_of

SPECS = Path(__file__).parents[2] / "specs"
LEVEL, SPEED, H = 50.0, 2.0, 0.001


def parts(spec: Spec) -> tuple[System, Observer, NoiseModel, Settings]:
    system = add_declared_effects(build_system(spec), spec)
    observer = build_observer(spec, system)
    dynamics = derive_error_dynamics(observer)
    settings = GainDynamics(dynamics, operating_points(dynamics, spec)).settings()
    return system, observer, NoiseModel(observer, spec, position_noise(spec)), settings


def twin_of(spec: Spec, observer: Observer) -> ModuleType:
    source = emit_sources(build_program(observer), make_header("machine.yaml", "0" * 64, ""))["__init__.py"]
    return load_twin(source, f"noisy_{spec.name}_{observer.kind}_{observer.velocity}_{observer.integration}")


@pytest.mark.parametrize(
    ("kind", "velocity", "gains", "integration"),
    [
        ("cfo", "estimated", "{K_F: 400, K_v: 300}", "euler"),
        ("cfo", "measured", "{K_F: 700}", "euler"),
        ("to", "estimated", "{K_1: 30, K_2: -400, K_v: 300}", "euler"),
        ("to", "measured", "{K_2: -700}", "euler"),
        ("cfo", "estimated", "{K_F: 400, K_v: 3000}", "implicit"),  # an explicit step would be unstable
        ("cfo", "measured", "{K_F: 700}", "implicit"),
        ("to", "estimated", "{K_1: 30, K_2: -400, K_v: 300}", "implicit"),
    ],
)
def test_rms_is_that_of_the_generated_code_on_a_noisy_run(
    kind: str, velocity: str, gains: str, integration: str
) -> None:
    """Constant velocity, the input balances friction: what the estimate does is noise alone."""
    rms = 3e-6
    spec = spec_of(
        gains,
        kind,
        velocity,
        more=f"integration: {integration}",
        simulation=f"simulation: {{duration: 1, sample_time: 0.01, position_noise: {{x: {rms}}}}}",
    )
    _, observer, noise, settings = parts(spec)
    code = twin_of(spec, observer)
    measured = SPEED * H * np.arange(60_000) + rms * np.random.default_rng(11).standard_normal(60_000)
    speed = np.diff(measured, prepend=measured[0] - SPEED * H) / H
    parameters = code.Parameters()
    more = speed[:, None] if velocity == "measured" else np.empty((len(measured), 0))
    state = code.init(parameters, code.Inputs(measured[0], *more[0], LEVEL))
    output = noise.outputs[0]
    estimate = [
        getattr(code.step(state, parameters, code.Inputs(float(x), *map(float, v), LEVEL)), output)
        for x, v in zip(measured, more, strict=True)
    ]
    settled = np.array(estimate[5000:])
    predicted = noise.rms(settings)[0, 0, 0]
    assert settled.mean() == pytest.approx(LEVEL, rel=0.02)
    assert settled.std() == pytest.approx(predicted, rel=0.06)
    for point, (phi, by_noise, out, direct) in enumerate(zip(*(m[0] for m in noise.matrices(settings)), strict=True)):
        n, d = by_noise * noise.noise.rms, direct * noise.noise.rms
        exact = np.sqrt(np.diag(out @ solve_discrete_lyapunov(phi, n @ n.T) @ out.T + d @ d.T))
        np.testing.assert_allclose(noise.rms(settings)[0, point], exact, rtol=1e-6)
    assert noise.share(settings, np.array([True]))[0] == pytest.approx(predicted / LEVEL)


def test_rms_of_the_cfo_with_velocity_observer_by_hand() -> None:
    """In (v̂ − v, F̂ − F) before the sample's noise n: v̂ and F̂ are moved at once by k_v n and −k_F k_v n."""
    k_F, k_v, rms = 400.0, 300.0, 1e-5 / np.sqrt(12)
    spec = spec_of(f"{{K_F: {k_F}, K_v: {k_v}}}", velocity="estimated")
    _, _, noise, settings = parts(spec)
    assert noise.noise.rms == (pytest.approx(rms),)
    assert noise.noise.given == ()
    step = np.eye(2) + H * np.array([[-k_v, -1 / MASS], [k_F * k_v, 0]])
    now = np.array([[k_v], [-k_F * k_v]])
    # one sample later z has moved by h (−k_v v̂ − F̂/m) and −h k_F F̂/m, and F̂ follows z_v by −k_F
    rate = np.array([[-k_v, -1 / MASS], [0, -k_F / MASS]])
    later = H * np.array([[1, 0], [-k_F, 1]]) @ rate @ now
    covariance = solve_discrete_lyapunov(step, later @ later.T)
    by_hand = rms * np.sqrt((covariance + now @ now.T)[1, 1])
    assert noise.rms(settings)[0, 0, 0] == pytest.approx(by_hand, rel=1e-9)


TURNED = """
name: turned
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}, kap: {value: 5, unit: 1/m}}
mass_matrix: [[m]]
force: [w]
friction: {distribution: [[1 + kap*x]], contacts: [{name: rail, law: coulomb, a: 50, unit: N}]}
observer: {kind: gcfo, velocity: estimated, integration: implicit, gains: {K_F: 40, K_v: 300}, sample_time: 0.001}
envelope: {x: [-0.1, 0.1], v: [-5, 5]}
"""


def test_an_implicit_step_goes_from_the_estimates_at_the_position_before() -> None:
    """U depends on the position, and with it the states that show given estimates."""
    spec = parse_spec(TURNED, Path("turned.yaml"))
    _, observer, noise, settings = parts(spec)
    code, column = twin_of(spec, observer), {s.name: k for k, s in enumerate(noise.variables)}
    for point, phi in zip(noise.points[:6], noise.matrices(settings)[0][0], strict=False):
        x, v = (float(point[column[name]]) for name in "xv")

        def states(at: float, estimates: np.ndarray) -> np.ndarray:
            v_hat, a_hat = estimates
            return np.array([v_hat - 300 * at, a_hat + 40 * abs((1 + 5 * at) * v_hat)])

        def later(estimates: np.ndarray, x: float = x, v: float = v) -> np.ndarray:
            state = code.State(*states(x - H * v, estimates))
            out = code.step(state, code.Parameters(), code.Inputs(x, 0.0))
            return np.array([out.v_hat, out.a_hat_rail])

        start = true = np.array([v, 50.0])
        for _ in range(50):  # whence the estimates at x are true
            start = start + true - later(start)
        step = 1e-4 * abs(v)
        slopes = np.column_stack([(later(start + e) - later(start - e)) / (2 * step) for e in step * np.eye(2)])
        np.testing.assert_allclose(phi, slopes, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("name", ["two_mass", "two_link_arm"])
def test_noise_matrices_are_the_slopes_of_the_generated_code(name: str) -> None:
    """Disturb the measured positions of the shipped code at one sample; see F̂ then and the estimates one later."""
    spec = read_spec(SPECS / f"{name}.yaml")
    system, observer, noise, settings = parts(spec)
    code = twin_of(spec, observer)
    n = system.degrees_of_freedom
    gains = {s.name: float(v) for s, v in observer.gains.items()}
    friction_gain = np.zeros((n, n))
    velocity_gain = np.zeros((n, n))
    for k, matrix in enumerate((velocity_gain, friction_gain)):
        names = [[v.name for v in system.velocities], [c.name for c in system.contacts]][k]
        for i, a in enumerate(names):
            for j, b in enumerate(names):
                prefix = ("K_v", "K_F")[k]
                matrix[i, j] = gains.get(f"{prefix}_{a}_{b}", gains.get(f"{prefix}_{a}", 0.0) if i == j else 0.0)
    distribution = np.array(system.distribution, dtype=float)
    estimates = [f"{v}_hat" for v in system.velocities] + [f"a_hat_{c.name}" for c in system.contacts]
    column = {s.name: k for k, s in enumerate(noise.variables)}
    matrices = noise.matrices(settings)
    for k, point in enumerate(noise.points[:6]):
        x, v, w = (
            np.array([point[column[s.name]] for s in group])
            for group in (system.positions, system.velocities, system.inputs)
        )
        speed = np.abs(distribution.T @ v)
        levels = noise.levels[k]

        def run(moved: np.ndarray, x=x, v=v, w=w, speed=speed, levels=levels) -> tuple[np.ndarray, np.ndarray]:
            state = code.State(*(v - velocity_gain @ x), *(levels + friction_gain @ speed))
            out = code.step(state, code.Parameters(), code.Inputs(*(x + moved), *w))
            seen = np.array([getattr(out, o) for o in noise.outputs])
            later = code.step(state, code.Parameters(), code.Inputs(*(x + H * v), *w))
            return seen, np.array([getattr(later, e) for e in estimates])

        for j in range(n):
            moved = 1e-6 * np.eye(n)[j]
            (seen, later), (seen_before, before) = run(moved), run(-moved)
            driven, direct = matrices[1][0, k][:, j], matrices[3][0, k][:, j]
            np.testing.assert_allclose((later - before) / 2e-6, driven, rtol=1e-4, atol=1e-4 * np.abs(driven).max())
            np.testing.assert_allclose((seen - seen_before) / 2e-6, direct, rtol=1e-4, atol=1e-4 * np.abs(direct).max())


@pytest.mark.parametrize("name", ["one_mass", "two_mass", "belt_axis"])
def test_the_error_step_is_that_of_the_derived_error_dynamics(name: str) -> None:
    spec = read_spec(SPECS / f"{name}.yaml")
    _, observer, noise, settings = parts(spec)
    dynamics = derive_error_dynamics(observer)
    family = GainDynamics(dynamics, operating_points(dynamics, spec))
    step = noise.matrices(settings)[0][0, 0]
    expected = np.eye(len(step)) + H * family.matrices("sampled", settings)[0, 0]
    np.testing.assert_allclose(np.poly(step), np.poly(expected), rtol=1e-9, atol=1e-12)


def test_unstable_gains_have_no_noise_figure() -> None:
    _, _, noise, settings = parts(spec_of("{K_F: 6000}"))
    assert np.isinf(noise.share(settings, np.ones(len(settings), dtype=bool))).all()


def test_noise_of_the_envelope_where_the_simulation_gives_none() -> None:
    """Uniform in ±3 µm, by hand: the mean square of n over [−r, r] is r²/3."""
    r = 3e-6
    text = "{K_F: 400, K_v: 300}"
    spec = replace(spec_of(text, velocity="estimated"), envelope={"x_noise": (Fraction(-3, 10**6), Fraction(3, 10**6))})
    drawn = np.linspace(-r, r, 100_001)
    found = position_noise(spec)
    assert found.sources == ("envelope",)
    assert found.rms[0] == pytest.approx(np.sqrt(np.mean(drawn**2)), rel=1e-4)
    simulated = spec_of(
        text, velocity="estimated", simulation="simulation: {duration: 1, sample_time: 0.01, position_noise: {x: 2e-6}}"
    )
    found = position_noise(replace(simulated, envelope=spec.envelope))
    assert found.sources == ("simulation",)
    assert found.rms == (2e-6,)
    assert position_noise(spec_of(text, velocity="estimated")).sources == ("assumed",)
