"""Error bounds of a (G)CFO with a domain, at every sample: with reversals, stick, noise and chatter of sgn v̂.

Let u be the slip, e_u = u − û without the noise contained in û, and f = F − F̂ the friction error at the contact,
averaged over a sample:

    e_u[k+1] = φ e_u[k] − β f[k] + η[k],    0 ≤ φ < 1, β > 0, |η| ≤ H.

1. The level error is at most D, because the observer holds â in the level's range or updates it with the right sign.
2. Let ε bound the change of u in a sample plus the noise. If e_u > ε, then u > 0 throughout the sample and F = a, or
   û < 0 and F̂ = −â. In both cases −f ≤ D, because Coulomb friction is monotone in the slip. If e_u < −ε, then f ≤ D.
3. If |e_u| ≤ ε, then |f| ≤ B = 2 a_max + D.

Hence, at all samples after one at which it holds,

    |e_u| ≤ E = max((βD + H)/(1 − φ), φε + βB + H).

4. While the level is updated at slip speeds above E + ε, slip and estimate have the same sign. The error then obeys the
   certified matrix, from a start within E and the level's range; D is the largest level error from there, linear in E.
   Both equations are solved for E and D.
5. At the start and after invalid samples e_u may be anything, and û may have the wrong sign. The code holds â in the
   level's range for R samples then. Steps 2 and 3 hold with D₀ = a_max − a_min in place of D and B₀ = 2 a_max + D₀,
   whatever the sign of û. So

    |e_u| − E₀ contracts by φ in each of these samples,  E₀ = max((βD₀ + H)/(1 − φ), φε + βB₀ + H)

   Since E₀ < E, an error of E₀ + (E − E₀)/φ^R is within E after R samples, before the level is updated.
"""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from codegen.certify.bound.bounds import DomainBound
from codegen.certify.bound.disturbances import Sizes
from codegen.certify.bound.error_response import Response
from codegen.friction.law import DynamicLaw
from codegen.observers.equations import Observer

ROUNDING = 1e-9
"""Relative allowance for rounding errors."""
Peaks = dict[tuple[int, int, int], float]
"""(i, j, k₀) → sup over k ≥ k₀ of |(Φ^k)_ij|."""


def domain_bound(
    observer: Observer, response: Response, sizes: Sizes, steady: Sequence[float], peaks: Peaks
) -> DomainBound | str:
    """The bounds for the one contact of an observer with a domain, or why there are none.

    Args:
        response: linear response of (e_v, e_F) to disturbances.
        sizes: bounds on the disturbances.
        steady: bounds on (|e_v|, |e_F|) in the long run, direct feedthrough of noise included.
        peaks: for k₀ = 0 and for the number of samples of slip after which the domain begins.
    """
    domain, h = observer.domain, float(observer.sample_time)
    assert domain is not None
    gear = float(observer.distribution[0])  # U: slip over velocity
    scale, step = abs(gear), np.array(response.step, dtype=float)
    phi, beta = step[0, 0], -gear * step[0, 1]
    if not (0 <= phi < 1 and beta > 0):
        return "through reversals no bound is known: h K_v is above 1; lower K_v or shorten the sample time"
    contact = observer.system.contacts[0]
    if isinstance(contact.law, DynamicLaw):  # its friction is not monotone in the slip
        return f"through reversals no bound is known for a law with a state, as {contact.law.name} at {contact.name}"
    if contact.extra_level != 0:  # the domain's range is that of the level alone
        return f"through reversals no bound is known with a declared effect on the level of {contact.name}"
    noise, displacement, velocity_change, acceleration = (
        float(sizes[cause][0]) for cause in ("noise", "displacement", "velocity", "acceleration")
    )
    rate = float(sum([*sizes["friction"], *sizes["rounding"][1:]], Fraction(0)))
    direct = [abs(float(e)) * noise for e in response.direct.col(0)]
    in_step = abs(float(response.noise[0, 0]) + step[0, 1] * float(response.direct[1, 0])) * noise
    by_motion = scale * (
        in_step
        + abs(float(response.displacement[0, 0])) * displacement
        + abs(float(response.velocity[0, 0])) * velocity_change
        + float(sizes["rounding"][0])
        + abs(float(response.acceleration[0, 0])) * acceleration
    )
    low, high = (float(e) for e in domain.level)
    slip_change = scale * h * acceleration
    # D = by_velocity E + by_level; with it E = max over both lines of slope D + offset.
    by_velocity = peaks[1, 0, 0] / scale
    by_level = max(peaks[1, 1, 0] * (high - low + direct[1]) + steady[1], high - low)
    eta = beta * rate + by_motion  # H
    near_zero = phi * (slip_change + scale * direct[0]) + beta * 2 * high + eta
    slope, offset = np.array([beta / (1 - phi), beta]), np.array([eta / (1 - phi), near_zero])
    if (slope * by_velocity >= 1).any():
        return "through reversals no bound is known: K_F is too high compared with m K_v"
    error = float(((slope * by_level + offset) / (1 - slope * by_velocity)).max()) * (1 + ROUNDING)
    held = float((slope * (high - low) + np.array([eta / (1 - phi), near_zero])).max()) * (1 + ROUNDING)
    if held >= error:
        return "through reversals no bound is known: the level has no effect on the velocity"
    start = held + (error - held) / max(phi, ROUNDING) ** domain.restart
    velocity, everywhere = error + scale * direct[0], by_velocity * error + by_level
    later = [
        peaks[i, 0, domain.samples] * error / scale + peaks[i, 1, domain.samples] * (high - low + direct[1]) + steady[i]
        for i in (0, 1)
    ]
    least = velocity + slip_change
    inside = later[1] * (1 + ROUNDING) if domain.slip_speed >= least else None
    innovation = h * later[0] + displacement + 2 * noise
    start = float(start * (1 - ROUNDING) - scale * direct[0])
    return DomainBound(inside, everywhere, velocity, start, domain.restart, least, innovation)
