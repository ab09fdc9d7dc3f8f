"""Error bounds of a (G)CFO with a domain, inside and outside of it: with reversals, stick, noise, chatter of sgn v̂.

With u the slip, e_u = u − û less the noise that stands in û, and f = F − F̂ at the contact averaged over a sample,

    e_u[k+1] = φ e_u[k] − β f[k] + η[k],    0 <= φ < 1, β > 0, |η| <= H.

The level's error is at most D: the guard holds â within the level's range or learns with the right sign. Coulomb
friction is a monotone relation, so where e_u > ε (ε: what u moves in a sample, and the noise) −f <= D: either u > 0
throughout the sample and F = a, or û < 0 and F̂ = −â. Elsewhere |f| <= B, twice the largest level and D. Hence

    |e_u| <= E = max((βD + H)/(1 − φ), φε + βB + H)

at all samples once it holds. While the guard learns, slip and its estimate have one sign if its speed is above E + ε,
and the error obeys the certified matrix from a start of (E, range of the level) on: D is the largest of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from codegen.certify.bound.bounds import DomainBound
from codegen.certify.bound.disturbances import Sizes
from codegen.certify.bound.error_response import Response
from codegen.friction.law import DynamicLaw
from codegen.observers.equations import Domain, Observer

LONGEST = 200_000
ROUNDING = 1e-9
Peaks = dict[tuple[int, int, int], float]


def domain_bound(
    observer: Observer, response: Response, sizes: Sizes, steady: Sequence[float], peaks: Peaks
) -> DomainBound | str:
    """The bounds, or why there are none; for the slip and the level at the one contact of a guarded observer.

    Args:
        response: of the error, in force errors.
        sizes: cause → the disturbances' sizes.
        steady: bounds on (e_v, e_F) long after a start, direct noise included.
        peaks: what ``peaks`` gives.
    """
    domain, h = observer.domain, float(observer.sample_time)
    assert domain is not None
    turn = float(observer.system.distribution.subs(observer.values)[0])
    scale, step = abs(turn), np.array(response.step.tolist(), dtype=float)
    phi, beta = step[0, 0], -turn * step[0, 1]
    if not (0 <= phi < 1 and beta > 0):
        return "through reversals no bound is known: h K_v is above 1"
    contact = observer.system.contacts[0]
    if isinstance(contact.law, DynamicLaw):  # friction with a state is no monotone relation of slip
        return f"through reversals no bound is known for a law with a state, as {contact.law.name} at {contact.name}"
    if contact.extra_level != 0:  # it turns with the level, and is not within its range
        return f"through reversals no bound is known with a declared effect on the level of {contact.name}"
    noise, displacement, curve, acceleration = (
        float(sizes[cause][0]) for cause in ("noise", "displacement", "velocity", "acceleration")
    )
    rate = float(sum([*sizes["friction"], *sizes["rounding"][1:]], Fraction(0)))
    direct = [abs(float(e)) * noise for e in response.direct.col(0)]
    in_step = abs(float(response.noise[0, 0]) + step[0, 1] * float(response.direct[1, 0])) * noise
    rest = scale * (
        in_step
        + abs(float(response.displacement[0, 0])) * displacement
        + abs(float(response.velocity[0, 0])) * curve
        + float(sizes["rounding"][0])
        + abs(float(response.acceleration[0, 0])) * acceleration
    )
    low, high = (float(e) for e in domain.level)
    moved = scale * h * acceleration
    # |e_F| from a start of (1, 0) and (0, 1); then D = by_velocity E + known, and E by the two lines of the maximum.
    by_velocity = peaks[1, 0, 0] / scale
    known = peaks[1, 1, 0] * (high - low + direct[1]) + steady[1]
    known, slack = max(known, high - low), beta * rate + rest
    floor = phi * (moved + scale * direct[0]) + beta * 2 * high + slack
    slope, offset = np.array([beta / (1 - phi), beta]), np.array([slack / (1 - phi), floor])
    if (slope * by_velocity >= 1).any():
        return "through reversals no bound is known: K_F is too high compared with m K_v"
    error = float(((slope * known + offset) / (1 - slope * by_velocity)).max()) * (1 + ROUNDING)
    velocity, everywhere = error + scale * direct[0], by_velocity * error + known
    later = [
        peaks[i, 0, domain.samples] * error / scale + peaks[i, 1, domain.samples] * (high - low + direct[1]) + steady[i]
        for i in (0, 1)
    ]
    least = velocity + moved
    inside = later[1] * (1 + ROUNDING) if domain.slip_speed >= least else None
    return DomainBound(inside, everywhere, velocity, least, h * later[0] + displacement + 2 * noise)


def peaks(response: Response, domain: Domain, fall: float, reach: Any) -> Peaks:
    """(i, j, start) → sup over k >= start of |Φ^k|[i, j]: as computed, and by P from where that is smaller.

    Args:
        fall: γ; reach: |Φ^k|[i, j] <= reach[i, j] γ^k, as the certificate's P says.
    """
    step = np.array(response.step.tolist(), dtype=float)

    def largest(row: int, column: int, start: int) -> float:
        vector, found, rest = np.linalg.matrix_power(step, start)[:, column], 0.0, 0.0
        for k in range(start, start + LONGEST):
            found, rest = max(found, abs(float(vector[row]))), reach[row, column] * fall ** (k + 1)
            if rest <= found:
                break
            vector = step @ vector
        return max(found, rest) * (1 + ROUNDING)

    return {(i, j, start): largest(i, j, start) for i in (0, 1) for j in (0, 1) for start in {0, domain.samples}}
