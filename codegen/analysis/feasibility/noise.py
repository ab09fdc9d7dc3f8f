"""Noise of the friction estimate due to measurement noise: P = Φ P Φ' + B B' (discrete Lyapunov equation).

Φ and B are derivatives of the observer's equations by CasADi: one explicit step from noisy measurements of x and v,
then the estimates at the next sample without noise; or an implicit step of the states, z[k] = z[k−1] + h f(z[k], x[k]).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.analysis.feasibility.gain_dynamics import Settings
from codegen.base.arrays import Array, Flags
from codegen.mechanics.casadi_form import at_points, function_of, over_rows, symbol_values, to_casadi
from codegen.mechanics.solve import factorised
from codegen.observers import Observer
from codegen.observers.velocity import SAMPLE_TIME
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import Spec

POINTS = 12
"""Operating points at which the noise is computed."""
DOUBLINGS = 44
"""Most doublings of the number of terms in the sum for the covariance."""
DEFAULT_STEP = 1e-5
"""Encoder step, m or rad, if the spec gives neither a step nor a noise."""


@dataclass(frozen=True)
class PositionNoise:
    """White noise of the measured positions.

    Attributes:
        rms: for each coordinate, m or rad: √(step²/12 + noise²) of encoder step and position noise.
        sources: for each coordinate, the origin of the value: ``simulation``, ``envelope`` or ``assumed``.
        given: names of the coordinates with a value in the spec; the others have an encoder step of 1e-5.
    """

    rms: tuple[float, ...]
    sources: tuple[str, ...]
    given: tuple[str, ...]


def position_noise(spec: Spec) -> PositionNoise:
    """The noise of the spec's simulation section; else uniform in the envelope's ``x_noise``; else ``DEFAULT_STEP``."""
    rms, sources = [], []
    for x in spec.positions:
        step = spec.simulation.encoder_step.get(x, 0.0) if spec.simulation else 0.0
        noise = spec.simulation.position_noise.get(x, 0.0) if spec.simulation else 0.0
        low, high = spec.envelope.get(f"{x}_noise", (0, 0))
        if step or noise:
            sources.append("simulation")
        elif high > low:
            step = float(high - low)
            sources.append("envelope")
        else:
            step = DEFAULT_STEP
            sources.append("assumed")
        rms.append(float(np.hypot(step / np.sqrt(12), noise)))
    given = tuple(x for x, source in zip(spec.positions, sources, strict=True) if source != "assumed")
    return PositionNoise(tuple(rms), tuple(sources), given)


class NoiseModel:
    """Linear model of the sampled error with position noise n: e[k+1] = Φ e[k] + B n[k], F̂[k] − F[k] = C e[k] + D n[k].

    e is the deviation of the estimates from the truth without the direct effect D n[k]; with an implicit step, of the
    sample before. A measured velocity is assumed to be the difference of two noisy positions over h, so the noise of
    the previous sample is part of the state.

    Attributes:
        variables, points: symbols and values of the operating points, (points, variables).
        outputs, units: names and units of the friction estimates F̂: contact forces, or generalised forces for a (G)TO.
        levels: steady friction force at each point, (points, outputs).
    """

    def __init__(self, observer: Observer, spec: Spec, noise: PositionNoise) -> None:
        self.observer, self.noise = observer, noise
        names = {e.name: e for e in observer.equations}
        estimate = names.get("contact_friction", names["friction_force"])
        self.outputs = tuple(s.name for s in estimate.symbols)
        self.units = estimate.units
        self.variables, self.points = _points(observer, spec)
        point = {s: casadi.SX.sym(s.name) for s in self.variables}
        gains = {s: casadi.SX.sym(s.name) for s in observer.gains}
        h = casadi.SX.sym("h")
        known = symbol_values(observer.values) | point | gains
        matrices = _linearised(observer, known | {SAMPLE_TIME: h}, h, estimate.symbols)
        argument = casadi.vertcat(*point.values(), *gains.values(), h)
        self._shapes = [m.shape for m in matrices]
        flat = casadi.vertcat(*[casadi.vec(casadi.densify(m)) for m in matrices])
        self._function = casadi.Function("noise", [argument], [flat])
        self.levels = self._levels(by_contact="contact_friction" in names)

    def matrices(self, settings: Settings) -> tuple[Array, Array, Array, Array]:
        """Φ, B, C, D, each (gain sets, points, rows, columns), for noise of RMS 1 on each coordinate."""
        sets, count = len(settings), len(self.points)
        values = np.tile(self.points, (sets, 1))
        flat = over_rows(self._function, np.hstack([values, np.repeat(settings.columns, count, axis=0)]))
        parts, start = [], 0
        for rows, columns in self._shapes:
            block = flat[:, start : start + rows * columns].reshape(sets, count, columns, rows)
            parts.append(np.ascontiguousarray(block.swapaxes(2, 3)))
            start += rows * columns
        if self.observer.integration == "implicit":
            parts = _solved(*parts)
        step, by_position, by_velocity, output, direct_position, direct_velocity = parts
        if self.observer.velocity != "measured":
            return step, by_position, output, direct_position
        h = settings.sample_time[:, None, None, None]
        m, n = by_position.shape[2:]
        phi = np.zeros((sets, count, m + n, m + n))
        phi[:, :, :m, :m], phi[:, :, :m, m:] = step, -by_velocity
        noise_input = np.concatenate(
            [by_position + by_velocity / h, np.broadcast_to(np.eye(n), (sets, count, n, n)) / h], axis=2
        )
        output = np.concatenate([output, -direct_velocity], axis=3)
        return phi, noise_input, output, direct_position + direct_velocity / h

    def rms(self, settings: Settings) -> Array:
        """RMS noise of the friction estimates, (gain sets, points, outputs); infinite where Φ is not stable.

        P = Σ Φᵏ B B' Φ'ᵏ, by doubling the number of terms, vectorised over those gain sets and points whose sum has not
        converged.
        """
        phi, noise_input, output, direct = self.matrices(settings)
        scale = np.asarray(self.noise.rms)
        noise_input, direct = noise_input * scale, direct * scale
        with np.errstate(all="ignore"):
            covariance = self._summed(phi, noise_input @ noise_input.swapaxes(2, 3))
            total = output @ covariance @ output.swapaxes(2, 3) + direct @ direct.swapaxes(2, 3)
            found = np.sqrt(np.diagonal(total, axis1=2, axis2=3))
        return np.where(np.isfinite(found), found, np.inf)

    @staticmethod
    def _summed(phi: Array, added: Array) -> Array:
        """Σ Φᵏ A Φ'ᵏ for each matrix Φ and A, (sets, points, m, m), until Φᵏ is below 1e-12 or not finite."""
        covariance = added.reshape(-1, *added.shape[2:]).copy()
        open_, power, part = np.arange(len(covariance)), phi.reshape(covariance.shape), covariance
        for _ in range(DOUBLINGS):
            part = part + power @ part @ power.swapaxes(1, 2)
            covariance[open_] = part
            power = power @ power
            largest = np.abs(power).max(axis=(1, 2))
            finite = np.isfinite(largest)
            covariance[open_[~finite]] = np.nan
            rest = finite & (largest >= 1e-12)
            if not rest.any():
                break
            if not rest.all():
                open_, power, part = open_[rest], power[rest], part[rest]
        return covariance.reshape(added.shape)

    def share(self, settings: Settings, stable: Flags) -> Array:
        """The largest ratio of RMS noise to friction over points and outputs, (sets,); infinite unless ``stable``."""
        found = np.full(len(settings), np.inf)
        if stable.any():
            found[stable] = self.shares(self.rms(settings.rows(stable))).max(axis=-1)
        return found

    def shares(self, rms: Array) -> Array:
        """The largest ratio of RMS noise to friction over the points, for each output; 0 without friction."""
        with np.errstate(all="ignore"):
            ratio = np.where(self.levels > 0, rms / self.levels, 0.0)
        found: Array = ratio.max(axis=-2)
        return found

    def _levels(self, by_contact: bool) -> Array:
        """Steady friction levels at the points, or their sum of magnitudes on each coordinate; (points, outputs)."""
        system = self.observer.system
        slips = zip(system.contacts, system.slip_velocity, strict=True)
        levels = sympy.Matrix([c.law_level.subs(c.slip, u) for c, u in slips])
        if not by_contact:
            levels = system.distribution.applyfunc(Magnitude) * levels
        return np.abs(at_points(function_of(levels, self.variables, self.observer.values), self.points)[:, :, 0])


def _points(observer: Observer, spec: Spec) -> tuple[tuple[sympy.Symbol, ...], Array]:
    """Random operating points in the envelope; without a range there x = 0, w = 0 and |v| up to 1."""
    system = observer.system
    ranges = dict.fromkeys((*system.positions, *system.inputs), (0.0, 0.0)) | dict.fromkeys(
        system.velocities, (-1.0, 1.0)
    )
    ranges = {s: spec.envelope.get(s.name, r) for s, r in (ranges | dict(observer.truth_ranges)).items()}
    bounds = np.array([[float(low), float(high)] for low, high in ranges.values()])
    spread = np.random.default_rng(2).uniform(bounds[:, 0], bounds[:, 1], (POINTS, len(bounds)))
    return tuple(ranges), spread


def _linearised(observer: Observer, known: dict[sympy.Symbol, Any], h: Any, friction: Any) -> list[Any]:
    """The matrices of ``NoiseModel`` as SX: Φ, B for position and velocity noise, C, D for position and velocity noise.

    The signs of the slips are those at the point: near standstill friction may reverse a small inertia within a sample.
    With an implicit step: the arguments of ``_solved``. ``friction``: symbols of the friction estimate.
    """
    system = observer.system
    x, v = (casadi.vertcat(*[known[s] for s in part]) for part in (system.positions, system.velocities))
    truth = _truth(observer, known)
    e, x_noise, v_noise = (
        casadi.SX.sym("e", truth.numel()),
        casadi.SX.sym("n", x.numel()),
        casadi.SX.sym("u", x.numel()),
    )
    deviations = e, x_noise, v_noise

    slips = [u for e in observer.equations if e.name == "slip_velocity" for u in e.symbols]
    sign_of = dict(zip(slips, observer.signs, strict=False))

    def evaluate(
        state: Any, at_x: Any, at_v: Any, estimates: Any = None, signs: Sequence[Any] = ()
    ) -> tuple[dict[sympy.Symbol, Any], Any]:
        """Values of all symbols, and the estimates, from the measurements and either the states or the estimates.

        ``signs``: of the slips; by default those of the estimated slips.
        """
        values = dict(known)
        values |= zip(system.positions, casadi.vertsplit(at_x), strict=True)
        values |= zip(system.velocities, casadi.vertsplit(at_v), strict=True)
        if state is not None:
            values |= zip(observer.states, casadi.vertsplit(state), strict=True)
        values |= zip(observer.signs, signs, strict=False)
        found: list[Any] = []
        for equation in observer.equations:
            expression = equation.expression
            if signs:
                expression = expression.replace(Sgn, lambda u: sign_of.get(u, Sgn(u)))
                expression = expression.replace(Magnitude, lambda u: sign_of[u] * u if u in sign_of else Magnitude(u))
            if equation.state is not None and estimates is not None:
                given = casadi.vertsplit(estimates)[len(found) : len(found) + len(equation.symbols)]
                rest = to_casadi(sympy.Matrix(expression - equation.state), values)
                values |= zip(equation.state, [a - rest[k] for k, a in enumerate(given)], strict=True)
            result = to_casadi(expression, values)
            if equation.form == "mass_solve":
                result = factorised(to_casadi(system.mass_matrix, values)).solve(result)
            values |= zip(equation.symbols, casadi.vertsplit(casadi.densify(result)), strict=True)
            if equation.state is not None:
                found += [values[s] for s in equation.symbols]
        return values, casadi.vertcat(*found)

    implicit = observer.integration == "implicit"
    start, _ = evaluate(None, x, v, truth if implicit else truth + e)
    state = casadi.vertcat(*[start[s] for s in observer.states])
    signs = [casadi.sign(start[u]) for u in slips]
    noisy, noisy_estimates = evaluate(state + e if implicit else state, x + x_noise, v + v_noise, signs=signs)
    moved = h * to_casadi(observer.rates, noisy)
    output = casadi.vertcat(*[noisy[s] for s in friction])
    at_truth = list(deviations), [casadi.SX.zeros(d.shape) for d in deviations]
    if implicit:
        before = state - casadi.substitute([moved], *at_truth)[0]
        _, estimates_before = evaluate(before + e, x - h * v, v, signs=signs)
        slopes = [casadi.jacobian(result, by) for result in (moved, output) for by in deviations]
        slopes += [casadi.jacobian(estimates, e) for estimates in (noisy_estimates, estimates_before)]
    else:
        _, next_estimates = evaluate(state + moved, x + h * v, v, signs=signs)
        slopes = [casadi.jacobian(result, by) for result in (next_estimates, output) for by in deviations]
    return list(casadi.substitute(slopes, *at_truth))


def _solved(
    rate: Array,
    rate_x: Array,
    rate_v: Array,
    output: Array,
    direct_x: Array,
    direct_v: Array,
    now: Array,
    before: Array,
) -> list[Array]:
    """Φ, B, C and D of an implicit step, from derivatives by the states and by the noise of positions and velocities.

    z[k] = z[k−1] + h f(z[k], n[k]). ``rate…``: of h f. ``output``, ``direct…``: of the friction estimate. ``now``,
    ``before``: of the estimates at k and k − 1, by the states.
    """
    solve = np.linalg.inv(np.eye(rate.shape[-1]) - rate)
    from_estimates = solve @ np.linalg.inv(before)
    by_x, by_v = solve @ rate_x, solve @ rate_v
    direct = [direct_x + output @ by_x, direct_v + output @ by_v]
    return [now @ from_estimates, now @ by_x, now @ by_v, output @ from_estimates, *direct]


def _truth(observer: Observer, known: dict[sympy.Symbol, Any]) -> Any:
    """True values of the estimated quantities: from ``known``, or for friction the force or level of the law."""
    system = observer.system
    slips = to_casadi(system.slip_velocity, known)
    laws = [c.law_level.subs(c.slip, u) for c, u in zip(system.contacts, system.slip_velocity, strict=True)]
    levels = to_casadi(sympy.Matrix(laws), known)
    forces = casadi.sign(slips) * levels
    on_coordinates = to_casadi(system.distribution, known) @ forces
    values = []
    for error in observer.errors:
        if error.truth in known:
            values.append(known[error.truth])
        elif error.coordinate is not None:
            values.append(on_coordinates[error.coordinate])
        else:
            values.append((levels if observer.level_errors else forces)[error.contact])
    return casadi.vertcat(*values)
