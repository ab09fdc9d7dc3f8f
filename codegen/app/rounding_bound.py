"""Increase of the error bound by floating-point rounding, in newtons, in double and in single precision.

It holds for an observer with a domain: one coordinate, one contact. The rounding errors of a step, which starts from
the stored (already rounded) states, are disturbances of the next states and of the friction estimate. A rounding error
of v̂ = z + Γx is equivalent to an error 1/Γ times as large in x, because x occurs in v̂ only. Converting the measured
position to the precision of the code is a second error of x. The bound is for the step inside the domain.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

from codegen.analysis.analysis import Analysis
from codegen.certify.bound.bounds import DomainBound, ErrorBound
from codegen.certify.bound.error_bound import error_bounds, rounding_share
from codegen.certify.bound.friction_bounds import largest_in_envelope
from codegen.certify.certify import Certificate
from codegen.observers.equations import Observer
from codegen.observers.velocity import SAMPLE_TIME
from codegen.program import build_program
from codegen.program.lower import lower
from codegen.program.rounding import UNIT, Enclosed, Undecided, enclose
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

JUST_ABOVE = 1.001


@dataclass(frozen=True)
class Rounding:
    """Rounding errors in one precision, and their effect on the error bound.

    Attributes:
        position: largest rounding error of x and v̂, as an equivalent noise of x.
        states: name of a state → largest rounding error of its update in one step.
        output: largest rounding error of the friction estimate that the code returns.
        adds: upper bound of the increase of the error bound long after a reversal, in the unit of the friction.
        inside: the error bound in the domain, rounding included; None if there is none, as ``slip_speed`` is then below
            ``least_slip_speed``.
        least_slip_speed: the least ``slip_speed`` of the domain that has a bound, rounding included; None if none has.
    """

    position: float
    states: Mapping[str, float]
    output: float
    adds: float
    inside: float | None
    least_slip_speed: float | None


@numerical("what rounding adds")
def rounding_bounds(
    spec: Spec, analysis: Analysis, certificate: Certificate, bound: ErrorBound
) -> dict[str, Rounding] | str:
    """Precision → the ``Rounding`` that increases ``bound``; or the reason why there is no such bound."""
    observer = analysis.dynamics.observer
    system = observer.system
    if system.degrees_of_freedom > 1 or not isinstance(bound.domain, DomainBound) or bound.domain.inside is None:
        return "they are bounded only for an observer with a domain"
    if system.force.has(*system.positions):
        return "they are bounded only where the force does not depend on the position"
    needed = [s.name for s in (*system.positions, *system.velocities, *system.inputs)]
    missing = [name for name in needed if name not in spec.envelope]
    if missing:
        return f"the envelope has no range for {', '.join(missing)}"
    result = {}
    for precision in UNIT:
        try:
            position, states, output = _step_errors(spec, observer, bound.domain, precision)
        except Undecided as error:
            return f"no bound of them: {error}"
        more = (Fraction(position), [Fraction(e) for e in states.values()])
        with_it, share = error_bounds(spec, analysis, certificate, more), rounding_share(observer, certificate, more)
        if isinstance(with_it, str):  # the errors decay too slowly for these disturbances alone
            return f"no bound of them: {with_it}"
        assert share is not None  # ``bound`` has the same response
        after = with_it[0].domain
        inside, least = (after.inside, after.least_slip_speed) if isinstance(after, DomainBound) else (None, None)
        result[precision] = Rounding(
            position, states, output, share[0] + output, None if inside is None else inside + output, least
        )
    return result


def _step_errors(
    spec: Spec, observer: Observer, domain: DomainBound, precision: str
) -> tuple[float, dict[str, float], float]:
    """Largest rounding errors of x, of each state's update and of the friction estimate, over both slip directions."""
    from codegen.cancellation import with_cancellation  # with scipy.optimize, which few specs need

    assert observer.domain is not None
    program = replace(build_program(with_cancellation(spec, observer)), precision=precision)
    code = lower(program)
    system, u = observer.system, UNIT[precision]
    turn, names = float(observer.distribution[0]), [z.name for z in observer.states]
    needed = (*system.positions, *system.velocities, *system.inputs)
    x, v, *w = (float(largest_in_envelope(spec, s.name, 0)) for s in needed)  # one coordinate
    fastest = v + domain.velocity / abs(turn)
    level = float(observer.domain.level[1]) + domain.everywhere
    outputs, following = ({a.name: a.value for a in part} for part in (code.outputs, code.next_state))
    contact = system.contacts[0].name
    velocity, force = outputs[observer.equations[0].symbols[0].name], outputs[f"F_hat_{contact}"]
    by_position = observer.equations[0].expression[0].diff(system.positions[0])
    gain = float(by_position.subs(observer.values).subs(SAMPLE_TIME, observer.sample_time))
    slope = max(float(v) for k, v in observer.gains.items() if k.name.startswith("K_F"))
    sizes = (fastest + gain * x, level + slope * abs(turn) * fastest)
    ranges = {p.name: Enclosed(p.value, p.value, u * abs(p.value)) for p in program.parameters if p.value is not None}
    ranges |= {name: Enclosed(-size, size) for name, size in zip(names, sizes, strict=True)}
    ranges |= {system.positions[0].name: Enclosed(-x, x), "samples_held": Enclosed(0, 0)}
    ranges |= {s.name: Enclosed(-most, most, u * most) for s, most in zip(system.inputs, w, strict=True)}
    least = float(observer.domain.slip_speed) * JUST_ABOVE / abs(turn)
    read = enclose([velocity], ranges, {}, precision)[0].error
    worst, output = dict.fromkeys(names, 0.0), 0.0
    for way in (1.0, -1.0):
        low, high = (least, fastest) if way * turn > 0 else (-fastest, -least)
        ranges[f"direction_{contact}"] = Enclosed(way, way)
        roots = [*(following[name] for name in names), force]
        known = {outputs[f"a_hat_{contact}"]: (-level, level)}
        *states, estimate = enclose(roots, ranges, known, precision, {velocity: Enclosed(low, high)})
        worst = {name: max(worst[name], s.error) for name, s in zip(names, states, strict=True)}
        output = max(output, estimate.error)
    return u * x + read / gain, worst, output
