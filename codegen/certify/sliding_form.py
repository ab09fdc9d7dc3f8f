"""Conversion of the certificate of a DFO's sliding (sliding.json) to a proof for the kernel (checker/kernel.py).

Nothing here is trusted.
"""

from collections.abc import Iterator, Mapping
from decimal import ROUND_FLOOR
from fractions import Fraction
from typing import Any

import sympy

from codegen.base.result import json_text
from codegen.base.significant import rounded_to
from codegen.certify.family import range_of
from codegen.certify.kernel_form import NotCovered, Writer, error_fields, inverse, witness
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

SLOWER = (Fraction(1), Fraction(999, 1000), Fraction(99, 100), Fraction(9, 10))
"""Shares of the rate of sliding.json that are tried: the proof has one cell, whose enclosure may be less tight."""


def sliding_proofs(observer: Observer, places: Mapping[str, str], content: Mapping[str, Any]) -> Iterator[str]:
    """Candidate proofs of a DFO's sliding for the kernel, as JSON, the fastest decay first.

    With σ = sgn f for the friction state f of a contact, the errors are v − v̂, f − f̂ and σ(a − â), as in the
    certificate. The matrix is over σf, σu and a. Ranges of positions and inputs take the place of those of the
    accelerations, such that these stay in theirs (``_largest_sources``). Even with exact estimates the step changes the
    level error by the second-order term h² K_a u' f'; this is the field `rest` of the proof.

    Args:
        places: as in ``proof_text``.
        content: the JSON object of sliding.json.

    Raises:
        NotCovered: if the kernel cannot express the certificate.
    """
    system, write = observer.system, Writer(observer, places)
    if observer.integration != "euler" or observer.velocity != "estimated":
        raise NotCovered("of a DFO, the proof of the C covers the euler step with estimated velocity only")
    ends = {x: [sympy.Rational(e) for e in pair] for x, pair in content["variables"].items()}
    shown = {y: e.truth for (_, y, _), e in zip(observer.estimates, observer.errors, strict=True)}
    state = {e.contact: e.truth for e in observer.errors if e.of == "state"}
    level = {e.contact: e.truth for e in observer.errors if e.of == "level"}
    (rates,) = (e for e in observer.equations if e.law and e.law[0].label.startswith("xi"))
    hats = {truth: hat for hat, truth in shown.items()}
    true = shown | dict(zip((c.slip for c in system.contacts), system.slip_velocity, strict=True))
    forces = system.force - observer.true_friction
    acceleration = inverse(system) * forces
    at: dict[str, Any] = {}
    box: dict[Any, Any] = {}
    along: dict[Any, Any] = {}
    domain: list[Any] = []
    xi: list[Any] = []
    signs = [observer.signs[e.contact or 0] if e.of == "level" else None for e in observer.errors]
    for k, (contact, s) in enumerate(zip(system.contacts, observer.signs, strict=True)):
        f, u = state[k], system.slip_velocity[k]
        near = {contact.slip: ends[f"slip_{contact.name}_along"], hats[f]: ends[f"{f.name}_along"]}
        law, positive = _in_signs(rates.expression[k], s, near)
        xi.append(law.xreplace(true))
        domain += positive
        at |= {f.name: s * f, f"slip_{contact.name}": s * u}
        at[f"slip_{contact.name}_dot"] = s * (system.distribution.T.row(k) * acceleration)[0]
        along |= {f: s, level[k]: None}
        box |= {f: ends[f"{f.name}_along"], level[k]: ends[level[k].name]}
    for v, (s, pair) in _speeds(observer, ends).items():
        box[v] = pair
        along[v] = s
    moves = dict(zip(system.velocities, acceleration, strict=True)) | dict(zip(state.values(), xi, strict=True))
    for x, most in _largest_sources(observer, ends, acceleration, box).items():
        box[x] = [-most, most]
    words = {f"{x}_along": f"({write(e)})" for x, e in at.items()} | {a.name: write(a) for a in level.values()}
    size = range(len(moves))
    made = {
        "name": content["subject"]["name"],
        "step": observer.integration,
        "positions": {write(x): write(v) for x, v in zip(system.positions, system.velocities, strict=True)},
        "mass_matrix": [[write(x) for x in sympy.diag(system.mass_matrix, sympy.eye(len(xi))).row(i)] for i in size],
        "force": [write(x) for x in (*forces, *xi)],
        "acceleration": {write(x): write(e) for x, e in moves.items()},
        "signs": {write(s): write(hats[state[k]]) for k, s in enumerate(observer.signs)},
        "domain": [write(x) for x in domain],
        **error_fields(observer, write, signs, content, words),
        "along": {write(x): "" if s is None else write(s) for x, s in along.items()},
        "rest": [write(_second_order(e, observer, moves, true)) if e.of == "level" else "0" for e in observer.errors],
        "box": {write(x): [str(end) for end in pair] for x, pair in box.items()},
        "cover": "",
        "reversals": [],
        "lyapunov_matrix": content["lyapunov_matrix"],
    }
    made |= witness(made, places)
    for share in SLOWER:
        yield json_text(made | {"decay_rate": str(share * Fraction(content["decay_rate"]))})


def _speeds(observer: Observer, ends: Mapping[str, list[Any]]) -> dict[Any, tuple[Any, list[Any]]]:
    """Velocity v → (sign s or None, range of s v), such that every slip stays in its range.

    A velocity that is the slip of a contact has the range of that slip. What remains of the range of another slip is
    divided equally among its other velocities. NotCovered is raised if no positive range remains for a velocity.
    """
    system, found = observer.system, {}
    slips = list(zip(system.contacts, observer.signs, system.slip_velocity, strict=True))
    for contact, s, u in slips:
        if u in system.velocities:
            found[u] = (s, ends[f"slip_{contact.name}_along"])
    left: dict[Any, Any] = {}
    for contact, _, u in slips:
        low, high = ends[f"slip_{contact.name}_along"]
        free = [v for v in u.free_symbols if v in system.velocities and v not in found]
        taken = sum(abs(u.coeff(v)) * max(map(abs, found[v][1])) for v in u.free_symbols if v in found)
        for v in free:
            most = (min(-low, high) - taken) / (len(free) * abs(u.coeff(v)))
            left[v] = min(most, left.get(v, most))
    if any(most <= 0 for most in left.values()) or not {*system.velocities} <= {*found, *left}:
        raise NotCovered("the ranges of the slips in sliding.json leave no range for one of the velocities")
    return found | {v: (None, [-most, most]) for v, most in left.items()}


def _largest_sources(
    observer: Observer, ends: Mapping[str, list[Any]], acceleration: Any, box: Mapping[Any, list[Any]]
) -> dict[Any, Any]:
    """Position or input → bound on its magnitude, such that the acceleration of every slip stays in its range.

    The range that velocities and friction leave is divided equally among positions and inputs. NotCovered is raised if
    an acceleration is not linear in positions and inputs, or exceeds its range without them.
    """
    system, most = observer.system, dict[Any, Any]()
    free = [*system.positions, *system.inputs]
    for k, contact in enumerate(system.contacts):
        rate = sympy.expand((system.distribution.T.row(k) * acceleration)[0].subs(system.values))
        slopes = {y: rate.coeff(y) for y in free if rate.has(y)}
        rest = sympy.expand(rate - sum(y * c for y, c in slopes.items()))
        if rest.has(*free) or any(not c.is_number for c in slopes.values()) or not rest.free_symbols <= box.keys():
            raise NotCovered(
                "an acceleration is not linear in positions and inputs, so that no ranges of these follow from its own"
            )
        taken = sum(
            abs(c) * sympy.prod(max(map(abs, box[x])) ** n for x, n in zip(box, powers, strict=True))
            for powers, c in sympy.Poly(rest, *box).terms()
        )
        low, high = ends[f"slip_{contact.name}_dot_along"]
        if min(-low, high) <= taken:
            raise NotCovered("friction and damping alone can exceed the range of an acceleration in sliding.json")
        for y, c in slopes.items():
            share = (min(-low, high) - taken) / (len(slopes) * abs(c))
            most[y] = min(share, most.get(y, share))
    return {y: sympy.Rational(rounded_to(float(x), 3, ROUND_FLOOR)) for y, x in most.items()}


def _second_order(level: Any, observer: Observer, moves: Mapping[Any, Any], true: Mapping[Any, Any]) -> Any:
    """Change of a level's error in one step from exact estimates: the terms of second order in h of its update.

    Args:
        moves: velocity or friction state → its rate. true: estimate or slip → its true value.
    """
    (held,) = ((value - z).xreplace(true) for z, y, value in observer.estimates if true[y] == level.truth)
    rates, h = {x: sympy.Dummy() for x in moves}, symbol("h")
    later = held.xreplace({x: x + h * rate for x, rate in rates.items()})
    second = sympy.expand(later - held - h * sum(held.diff(x) * rate for x, rate in rates.items()))
    return -observer.signs[level.contact or 0] * second.xreplace({rate: moves[x] for x, rate in rates.items()})


def _in_signs(law: Any, s: sympy.Symbol, along: Mapping[Any, Any]) -> tuple[Any, list[Any]]:
    """(law with σ in place of sgn x and σx in place of |x|, list of the σx), with σ = s, −s, 1 or −1 in the region.

    ``along``: variable in which x is linear → range of s times it. NotCovered is raised if some x changes its sign.
    """
    found: dict[Any, Any] = {}
    for x in sorted({atom.args[0] for atom in law.atoms(Magnitude, Sgn)}, key=str):
        forward = range_of(x, along)
        backward = range_of(x, {u: (-low, -high) for u, (low, high) in along.items()})
        if any(low <= 0 <= high for low, high in (forward, backward)):
            raise NotCovered(
                f"{x} changes its sign in the region of sliding.json, and the friction law has a kink there"
            )
        sign = sympy.sign(forward[0])
        found[x] = sign if sign == sympy.sign(backward[0]) else sign * s
    law = law.replace(Magnitude, lambda x: found[x] * x).replace(Sgn, lambda x: found[x])
    return law, [sign * x for x, sign in found.items()]
