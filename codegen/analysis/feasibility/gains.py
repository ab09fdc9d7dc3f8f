"""Feasibility of gains: stability region over the whole envelope, gain margins, and suggested gains.

``analysis`` evaluates operating points at fixed gains; here gains vary too.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.analysis.feasibility.axes import GainAxis, chosen_axes, gain_axes, sample_time_axis
from codegen.analysis.feasibility.failure import Failure, explain_failure, largest_sample_time
from codegen.analysis.feasibility.gain_dynamics import GainDynamics, Settings
from codegen.analysis.feasibility.noise import NoiseModel, PositionNoise, position_noise
from codegen.analysis.feasibility.region import GainMap, Margin, intervals, map_region, margin
from codegen.analysis.feasibility.suggest import NothingStable, Suggestion, divided, own_or_found, suggest
from codegen.analysis.operating_points import operating_points
from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.observers import Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

Intervals = tuple[tuple[float, float], ...]
WIDER = 1e6
"""Factor, up and down, by which ranges are widened to look for stable gains where nothing within them is stable."""
SEED, SPREAD = 4, 60
"""Seed and number of random gain sets in the whole range, with which the deciding operating points are first found."""


@dataclass(frozen=True)
class GainSet:
    """Stability, noise and margins of one gain set.

    Attributes:
        numbers: axis name → value of the axis.
        gains: gain symbol → value.
        radius: spectral radius of the step, the largest over the operating points.
        decay_rate: −ln(radius)/h, 1/s; negative if unstable.
        abscissa: largest real part of Ψ's eigenvalues, 1/s.
        largest_sample_time: stability limit of explicit Euler, s; 0 if Ψ is unstable.
        noise: output → RMS of the friction estimate's noise at the worst operating point; None if unstable.
        noise_shares: output → the largest ratio of this RMS to the friction level; None if unstable.
        margins: of each axis, of all gains together and of the sample time; () if unstable.
        failure: cause of the instability of Ψ or of the step; None if both are stable.
    """

    numbers: Mapping[str, float]
    gains: Mapping[str, float]
    radius: float
    decay_rate: float
    abscissa: float
    largest_sample_time: float
    noise: Mapping[str, float] | None
    noise_shares: Mapping[str, float] | None
    margins: tuple[Margin, ...]
    failure: Failure | None

    @property
    def noise_share(self) -> float | None:
        """The largest of ``noise_shares``."""
        return None if self.noise_shares is None else max(self.noise_shares.values())

    @property
    def noisiest(self) -> str | None:
        """The output with the largest of ``noise_shares``."""
        return max(self.noise_shares, key=self.noise_shares.__getitem__) if self.noise_shares else None

    @property
    def stable(self) -> bool:
        """Whether the sampled error is stable at every operating point."""
        return self.failure is None or (self.failure.which == "continuous" and self.radius < 1)


@dataclass(frozen=True)
class Feasibility:
    """The feasibility report of a spec.

    Attributes:
        free: whether the spec leaves gains free; else its gains are varied around their values.
        points, deciding: number of sampled operating points, and of those at which some gain set was worst.
        noise: of the measured positions.
        units: friction output → unit.
        chosen: assessment of the spec's gains; None if some are free.
        suggestion, suggested: the suggested set and its assessment; None if nothing in the range is stable.
        before_division: the suggestion before all its numbers were divided by the ``divisor``; the suggestion itself if
            the spec's own gains are kept.
        infeasible: if nothing in the range is stable, the failure of the set whose error grows least.
        outside: axis name → value of a stable set outside the ranges, if nothing within them is stable; else empty.
        tried: number of gain sets evaluated.
        sampled, continuous: axis name → stable intervals of the step and of Ψ, with the other gains as suggested.
        region: stability region in the plane of two axes.
        noise_share: noise over friction level on its grid, infinite where unstable.
    """

    spec: Spec
    observer: Observer
    axes: tuple[GainAxis, ...]
    free: bool
    points: int
    deciding: int
    noise: PositionNoise
    units: Mapping[str, str]
    chosen: GainSet | None
    suggestion: Suggestion | None
    before_division: Suggestion | None
    suggested: GainSet | None
    infeasible: Failure | None
    outside: Mapping[str, float]
    tried: int
    sampled: Mapping[str, Intervals]
    continuous: Mapping[str, Intervals]
    region: GainMap
    noise_share: Array


@numerical("which gains are stable")
def assess(
    spec: Spec,
    observer: Observer,
    over: Sequence[str] = (),
    divisor: Callable[[Sequence[GainAxis], Suggestion], int] = lambda axes, suggestion: 1,
    bound_share: Callable[[Sequence[GainAxis], Mapping[str, float]], float | None] = lambda axes, numbers: None,
) -> Feasibility:
    """The feasibility report of a spec's observer.

    Args:
        observer: of the spec, with its free gains at mid-range.
        over: names of the two axes of the map; by default the first two gains, or the gain and the sample time.
        divisor: function (axes, suggestion) → number by which all suggested gains are divided, for a tighter certified
            bound on the error.
        bound_share: function (axes, axis name → value) → this bound over the friction; None if it is unknown.

    Raises:
        BadInput: if the observer cannot be built in the range, an axis is unknown, or the error dynamics are not finite
            somewhere in the envelope.
    """
    axes = gain_axes(spec, observer)
    pair = chosen_axes(over, axes, observer, spec)
    symbolic = derive_error_dynamics(observer)
    points = operating_points(symbolic, spec)
    dynamics = GainDynamics(symbolic, points)
    nominal = dynamics.settings()
    if not np.isfinite(dynamics.matrices("sampled", nominal)).all():
        found = "the error dynamics are not finite everywhere in it"
        raise BadInput(
            spec.place("envelope"),
            found,
            "a force and gains whose slopes are finite in the whole envelope",
            code="SPEC033",
        )
    noise = NoiseModel(observer, spec, position_noise(spec))
    dynamics.start(_spread(nominal, axes))
    free = any(axis.chosen is None for axis in axes)
    searched = suggest(dynamics, noise, nominal, axes)
    first = suggestion = searched if isinstance(searched, Suggestion) else None
    if first is not None and (by := divisor(axes, first)) != 1:
        suggestion = divided(dynamics, axes, first, by)
    if suggestion is not None and not free:
        suggestion = own_or_found(dynamics, noise, axes, nominal, suggestion, partial(bound_share, axes))
    base = searched.settings if suggestion is None else suggestion.settings
    failed = explain_failure(dynamics, base) if isinstance(searched, NothingStable) else None
    region = map_region(dynamics, base, *pair)
    return Feasibility(
        spec=spec,
        observer=observer,
        axes=axes,
        free=free,
        points=len(points.values),
        deciding=len(dynamics.active),
        noise=noise.noise,
        units=dict(zip(noise.outputs, noise.units, strict=True)),
        chosen=None if free else judge(dynamics, noise, nominal, axes),
        suggestion=suggestion,
        before_division=suggestion if suggestion is not None and suggestion.kept else first,
        suggested=judge(dynamics, noise, base, axes) if suggestion else None,
        infeasible=failed,
        outside=_outside(dynamics, noise, nominal, axes) if failed else {},
        tried=searched.tried,
        sampled={a.name: intervals(dynamics, "sampled", base, a) for a in axes},
        continuous={a.name: intervals(dynamics, "continuous", base, a) for a in axes},
        region=region,
        noise_share=noise.share(region.settings, region.radius.ravel() < 1).reshape(region.radius.shape),
    )


def _spread(nominal: Settings, axes: Sequence[GainAxis]) -> Settings:
    """``SPREAD`` random gain sets over the whole range of all axes, to find the deciding operating points."""
    shares = np.random.default_rng(SEED).uniform(0, 1, (SPREAD, len(axes)))
    spread = nominal
    for k, axis in enumerate(axes):
        spread = spread.along(axis, axis.at(shares[:, k]))
    return spread


def _outside(
    dynamics: GainDynamics, noise: NoiseModel, nominal: Settings, axes: Sequence[GainAxis]
) -> Mapping[str, float]:
    """The numbers of a stable gain set in ranges that are wider by ``WIDER``; empty if none is found."""
    wider = [replace(a, low=a.low / WIDER, high=a.high * WIDER) if a.logarithmic else a for a in axes]
    found = suggest(dynamics, noise, nominal, wider)
    return found.numbers if isinstance(found, Suggestion) else {}


def judge(dynamics: GainDynamics, noise: NoiseModel, settings: Settings, axes: Sequence[GainAxis]) -> GainSet:
    """Decay, noise and margins of one gain set, or its failure."""
    radius = float(dynamics.worst("sampled", settings, True)[0])
    h = float(settings.sample_time[0])
    failure = explain_failure(dynamics, settings)
    numbers = {a.name: float(settings.numbers(a)[0]) for a in axes}
    rms = noise.rms(settings)[0] if radius < 1 else None
    return GainSet(
        numbers=numbers,
        gains={s.name: float(v) for s, v in zip(settings.symbols, settings.gains[0], strict=True)},
        radius=radius,
        decay_rate=float(-np.log(max(radius, 1e-300)) / h),
        abscissa=float(dynamics.worst("continuous", settings, True)[0]),
        largest_sample_time=largest_sample_time(dynamics, settings),
        noise=None if rms is None else dict(zip(noise.outputs, rms.max(axis=0).tolist(), strict=True)),
        noise_shares=None if rms is None else dict(zip(noise.outputs, noise.shares(rms).tolist(), strict=True)),
        margins=_margins(dynamics, settings, axes, numbers) if radius < 1 else (),
        failure=failure,
    )


def _margins(
    dynamics: GainDynamics, settings: Settings, axes: Sequence[GainAxis], numbers: Mapping[str, float]
) -> tuple[Margin, ...]:
    """Margins of each axis alone, of all gains by one factor, and of the sample time."""

    def scaled(varied: Sequence[GainAxis], factors: Array) -> Settings:
        result = settings
        for axis in varied:
            result = result.along(axis, numbers[axis.name] * factors)
        return result

    period = sample_time_axis(dynamics.symbolic.observer)
    found = [margin(dynamics, a.name, partial(scaled, [a])) for a in axes]
    if len(axes) > 1:
        found.append(margin(dynamics, "all gains", partial(scaled, axes)))
    h = float(settings.sample_time[0])
    return (*found, margin(dynamics, "sample time", lambda f: settings.along(period, h * f)))
