"""The sliding of a DFO as a proof for the kernel (checker/kernel.py): untrusted, as all that is written for it.

What sliding.json says of a matrix is said there of the C. With σ the sign of the friction state f, the errors are
σ(v − v̂), σ(f − f̂) and a − â, and the matrix is one for both signs, over σf, σv, a and the input. The level that the
step leaves is off by h² K_a u' f' a sample even where all estimates are right: that is the proof's `rest`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import product
from typing import Any

import sympy

from codegen.certify.kernel_form import NotCovered, Writer, estimates_of, infix, states_of, step_entry
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

SLOWER = (Fraction(1), Fraction(999, 1000), Fraction(99, 100), Fraction(9, 10))
"""Shares of the rate of sliding.json that are tried: a cell in place of its cells may lose some."""


def sliding_proofs(observer: Observer, places: Mapping[str, str], content: Mapping[str, Any]) -> Iterator[str]:
    """Proofs as JSON, the fastest first, for the kernel to accept one.

    Args:
        places: parameter, state, input or output of the observer's code → its place there.
        content: of sliding.json.

    Raises:
        NotCovered: for what the kernel cannot say.
    """
    made = _proof(observer, places, content)
    for share in SLOWER:
        yield json.dumps(made | {"decay_rate": str(share * Fraction(content["decay_rate"]))}, indent=1) + "\n"


def _proof(observer: Observer, places: Mapping[str, str], content: Mapping[str, Any]) -> dict[str, Any]:
    system, write, s = observer.system, Writer(observer, places), observer.signs[0]
    if len(system.positions) != 1 or list(system.slip_velocity) != list(system.velocities) or len(system.inputs) != 1:
        raise NotCovered("a DFO of more than one coordinate, contact or input, or with a slip that is no velocity")
    if observer.integration != "euler" or observer.velocity != "estimated":
        raise NotCovered("a DFO with another step than euler, or whose velocity is measured")
    v, f, a = (error.truth for error in observer.errors)
    name, ends = system.contacts[0].name, {x: [Fraction(e) for e in pair] for x, pair in content["variables"].items()}
    state, slip, rate = (ends[f"{x}_along"] for x in (f.name, f"slip_{name}", f"slip_{name}_dot"))
    v_hat, f_hat, _ = estimates = estimates_of(observer)
    law, domain = _in_signs(_rate(observer), s, {system.contacts[0].slip: slip, f_hat: state})
    pushed = (system.force - observer.true_friction)[0]
    acceleration = pushed / system.mass_matrix[0]
    xi = law.xreplace({system.contacts[0].slip: v, v_hat: v, f_hat: f})
    at = {f.name: s * f, f"slip_{name}": s * v, f"slip_{name}_dot": s * acceleration}
    written = {f"{x}_along": f"({write(e)})" for x, e in at.items()} | {a.name: write(a)}
    thetas: dict[str, str] = {}
    for entry in content["parameters"]:
        thetas[entry["name"]] = infix(entry["expression"], written)
    mass = Fraction(str(system.mass_matrix.subs(system.values)[0]))
    most = mass * rate[1] - max(map(abs, ends[a.name])) * state[1]  # at which the acceleration stays in its range
    if most <= 0:
        raise NotCovered("accelerations that the friction alone exceeds")
    box = {v: slip, f: state, a: ends[a.name], system.inputs[0]: [-most, most]}
    h, K_a, size = sympy.Symbol("h", real=True), symbol("K_a"), range(len(estimates))
    return {
        "name": content["subject"]["name"],
        "step": observer.integration,
        "positions": {write(system.positions[0]): write(v)},
        "mass_matrix": [[write(system.mass_matrix[0]), "0"], ["0", "1"]],
        "force": [write(pushed), write(xi)],
        "acceleration": {write(v): write(acceleration), write(f): write(xi)},
        "signs": {write(s): write(f_hat)},
        "domain": [write(x) for x in domain],
        "errors": [
            {"truth": write(e.truth), "estimate": write(y), "sign": "" if e.truth == a else write(s)}
            for e, y in zip(observer.errors, estimates, strict=True)
        ],
        "states": {write(z): write(text) for z, text in states_of(observer).items()},
        "matrix": [
            [step_entry(i == j, content["sample_time"], content["matrix"][i][j], thetas) for j in size] for i in size
        ],
        "rest": ["0", "0", f"-{write(h * h * K_a)}*({write(acceleration)})*({write(xi)})"],
        "box": {write(x): [str(end) for end in pair] for x, pair in box.items()},
        "cover": "",
        "reversals": [],
        "lyapunov_matrix": content["lyapunov_matrix"],
    }


def _rate(observer: Observer) -> Any:
    """ξ₁(û, f̂) of the one contact."""
    (law,) = (e for e in observer.equations if e.law and e.law[0].label.startswith("xi"))
    return law.expression[0]


def _in_signs(law: Any, s: sympy.Symbol, along: Mapping[Any, Any]) -> tuple[Any, list[Any]]:
    """The law with a sign for each |x| and sgn x, and what is positive where x has that sign: s x, −s x, x or −x.

    Args:
        along: what x is linear in → the range of s times it.
    """
    found: dict[Any, Any] = {}
    for x in sorted({atom.args[0] for atom in law.atoms(Magnitude, Sgn)}, key=str):
        at = {side: [x.subs({u: side * end for u, end in zip(along, ends, strict=True)})
                     for ends in product(*along.values())] for side in (1, -1)}  # fmt: skip
        seen = [({sympy.sign(value) for value in values}, side) for side, values in at.items()]
        if any(len(signs) != 1 or 0 in signs for signs, _ in seen):
            raise NotCovered(f"the sign of {x}, which changes in the region")
        first, second = (next(iter(signs)) for signs, _ in seen)
        found[x] = first if first == second else first * s
    law = law.replace(Magnitude, lambda x: found[x] * x).replace(Sgn, lambda x: found[x])
    return law, [sign * x for x, sign in found.items()]
