"""A certificate as a proof for the kernel (checker/kernel.py): untrusted, as all that is written for it.

What a certificate says of a matrix is said there of the C: which states show which estimates, in which machine.
Covered are levels of Coulomb friction and tracked forces with a common P, and the sliding of a DFO with one contact.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.mechanics import System
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

SLOWER = (Fraction(1), Fraction(999, 1000), Fraction(99, 100), Fraction(9, 10))
"""Shares of the rate of sliding.json that are tried: a cell in place of its cells may lose some."""
FUNCTIONS = {sympy.cos: "cos", sympy.sin: "sin", Magnitude: "fabs", Sgn: "sgn"}
"""Those that are the same in machine and code, where they are of what is measured."""


class NotCovered(Exception):
    """The kernel has no words for this certificate; the message says for what."""


def proof_text(
    observer: Observer, places: Mapping[str, str], content: Mapping[str, Any], precision: str = "double"
) -> str:
    """The proof as JSON.

    Args:
        places: parameter, state, input or output of the observer's code → its place there, such as outputs.v_hat[3].
        precision: of the code, to whose digits it prints a multiple of π.
        content: the certificate's JSON object.

    Raises:
        NotCovered: for what the kernel cannot say.
    """
    system, write = observer.system, Writer(observer, places, precision)
    if content["along"]:
        raise NotCovered("a refutation")
    if observer.integration not in ("euler", "semi_implicit"):
        raise NotCovered(f"the step {observer.integration}")
    if len(content["error"]) != len(observer.errors):
        raise NotCovered("a proof by structure")
    if system.sensor_errors or any(a.lag is not None or a.delay != 0 for a in system.actuators.values()):
        raise NotCovered("a delay or lag of an input, or a sensor that reads wrong")
    effective = {w: a.static(w) for w, a in system.actuators.items()}
    force = (system.modelled_force - observer.true_friction).xreplace(effective)
    acceleration = _inverse(system) * force
    at = {name: write(symbol(name)) for name in content["variables"]}
    signs = [
        observer.signs[e.contact] if e.contact is not None and observer.level_errors else None for e in observer.errors
    ]
    made = {
        "positions": {write(x): write(v) for x, v in zip(system.positions, system.velocities, strict=True)},
        "mass_matrix": [[write(x) for x in system.mass_matrix.row(i)] for i in range(system.mass_matrix.rows)],
        "force": [write(f) for f in force],
        "acceleration": {write(v): write(a) for v, a in zip(system.velocities, acceleration, strict=True)},
        "signs": {write(s): write(u) for s, u in zip(observer.signs, write.slips, strict=True)},
        "domain": _domain(observer, write),
        **_errors(observer, write, signs, content, at),
        "box": {at[name]: ends for name, ends in content["variables"].items() if at[name].startswith("true.")},
        **_found(content, at),
    }
    made["states"] |= _held(observer, write)
    made["signs"] = {s: of for s, of in made["signs"].items() if s in json.dumps(made | {"signs": {}})}
    return _text({"name": content["subject"]["name"], "step": observer.integration, **made, **_witness(made, places)})


def with_solution(proof: str, content: Mapping[str, Any]) -> str:
    """The proof with P, rate and reversals of another certificate of the same matrix."""
    made = json.loads(proof)
    return _text(made | _found(content, {x.split(".")[1]: x for x in (*made["positions"], *made["box"])}))


def sliding_proofs(observer: Observer, places: Mapping[str, str], content: Mapping[str, Any]) -> Iterator[str]:
    """Proofs of a DFO's sliding as JSON, the fastest first, for the kernel to accept one.

    With σ the sign of the friction state f, the errors are σ(v − v̂), σ(f − f̂) and a − â, and the matrix is one for both
    signs, over σf, σv, a and the input. The level that the step leaves is off by h² K_a u' f' a sample even where all
    estimates are right: that is the proof's `rest`.

    Args:
        places: as of ``proof_text``.
        content: of sliding.json.

    Raises:
        NotCovered: for what the kernel cannot say.
    """
    system, write, s = observer.system, Writer(observer, places), observer.signs[0]
    if len(system.positions) != 1 or list(system.slip_velocity) != list(system.velocities) or len(system.inputs) != 1:
        raise NotCovered("a DFO of more than one coordinate, contact or input, or with a slip that is no velocity")
    if observer.integration != "euler" or observer.velocity != "estimated":
        raise NotCovered("a DFO with another step than euler, or whose velocity is measured")
    v, f, a = (error.truth for error in observer.errors)
    name, ends = system.contacts[0].name, {x: [Fraction(e) for e in pair] for x, pair in content["variables"].items()}
    state, slip, rate = (ends[f"{x}_along"] for x in (f.name, f"slip_{name}", f"slip_{name}_dot"))
    v_hat, f_hat, _ = estimates_of(observer)
    (equation,) = (e for e in observer.equations if e.law and e.law[0].label.startswith("xi"))
    law, domain = _in_signs(equation.expression[0], s, {system.contacts[0].slip: slip, f_hat: state})
    pushed = (system.force - observer.true_friction)[0]
    acceleration = pushed / system.mass_matrix[0]
    xi = law.xreplace({system.contacts[0].slip: v, v_hat: v, f_hat: f})
    at = {f.name: s * f, f"slip_{name}": s * v, f"slip_{name}_dot": s * acceleration}
    along = {f"{x}_along": f"({write(e)})" for x, e in at.items()} | {a.name: write(a)}
    mass = Fraction(str(system.mass_matrix.subs(system.values)[0]))
    most = mass * rate[1] - max(map(abs, ends[a.name])) * state[1]  # at which the acceleration stays in its range
    if most <= 0:
        raise NotCovered("accelerations that the friction alone exceeds")
    box = {v: slip, f: state, a: ends[a.name], system.inputs[0]: [-most, most]}
    h, K_a = symbol("h"), symbol("K_a")
    made = {
        "name": content["subject"]["name"],
        "step": observer.integration,
        "positions": {write(system.positions[0]): write(v)},
        "mass_matrix": [[write(system.mass_matrix[0]), "0"], ["0", "1"]],
        "force": [write(pushed), write(xi)],
        "acceleration": {write(v): write(acceleration), write(f): write(xi)},
        "signs": {write(s): write(f_hat)},
        "domain": [write(x) for x in domain],
        **_errors(observer, write, [s, s, None], content, along),
        "rest": ["0", "0", f"-{write(h * h * K_a)}*({write(acceleration)})*({write(xi)})"],
        "box": {write(x): [str(end) for end in pair] for x, pair in box.items()},
        "cover": "",
        "reversals": [],
        "lyapunov_matrix": content["lyapunov_matrix"],
    }
    made |= _witness(made, places)
    for share in SLOWER:
        yield _text(made | {"decay_rate": str(share * Fraction(content["decay_rate"]))})


def _text(proof: Mapping[str, Any]) -> str:
    return json.dumps(proof, indent=1) + "\n"


def _errors(
    observer: Observer, write: Writer, signs: list[Any], content: Mapping[str, Any], at: Mapping[str, str]
) -> dict[str, Any]:
    """The errors, what the states are where the estimates are known, and the matrix I + hA.

    Args:
        signs: of each error, or None.
        at: a variable of the certificate → what it is in the code.
    """
    h, size = content["sample_time"], range(len(content["matrix"]))
    parameters = {p["name"]: infix(p["expression"], at) for p in content["parameters"]}
    return {
        "errors": [
            {"truth": write(e.truth), "estimate": write(y), "sign": "" if sign is None else write(sign)}
            for e, y, sign in zip(observer.errors, estimates_of(observer), signs, strict=True)
        ],
        "states": {write(z): write(text) for z, text in _states(observer).items()},
        "matrix": [[_step_entry(i == j, h, content["matrix"][i][j], parameters) for j in size] for i in size],
    }


def _witness(made: Mapping[str, Any], places: Mapping[str, str]) -> dict[str, Any]:
    """A point of domain and box, where there are such: estimates as the truth, and no two velocities are the same."""
    if not (made["domain"] or made["box"]):
        return {}
    free = [e["truth"] for e in made["errors"]] + [x for x in places.values() if x.startswith("inputs.")]
    unit = "*parameters.slip_speed" if "parameters.slip_speed" in places.values() else ""
    point = {x: "0" if x in made["positions"] else f"{k + 2}{unit}" for k, x in enumerate(free)}
    for k, (x, ends) in enumerate(made["box"].items(), len(free) + 1):  # above the middle
        low, high = map(Fraction, ends)
        point[x] = str(low + (high - low) * Fraction(k, 2 * len(free) + 1))
    point |= {e["estimate"]: point[e["truth"]] for e in made["errors"]}
    return {"witness": point | {z: "0" for z in places.values() if z.startswith("state.") and z not in made["states"]}}


def _named(tree: Any, at: Mapping[str, str]) -> Any:
    """A cover with the variables' places in the code: "theta2 t", of an angle, is "inputs.theta2 t"."""
    if tree == "":
        return tree
    name, *of = tree[0].split(" ")
    return [" ".join([at[name], *of]), tree[1], *(_named(part, at) for part in tree[2:])]


def _found(content: Mapping[str, Any], at: Mapping[str, str]) -> dict[str, Any]:
    """What the solver found.

    Args:
        at: a variable of the certificate → its place in the code.
    """
    reversals = [
        {"sign": f"sign.{r['contact']}", "growth": r["growth"], "dwell": str(r["dwell_samples"])}
        for r in content["reversals"]
    ]
    return {
        "cover": _named(content["cover"][0], at) if content["cover"] else "",
        "lyapunov_matrix": content["lyapunov_matrix"],
        "decay_rate": content["decay_rate"],
        "reversals": reversals,
    }


def _inverse(system: System) -> sympy.Matrix:
    """M⁻¹, in numbers where it would be long in symbols."""
    mass = system.mass_matrix
    if mass.free_symbols & {*system.positions}:
        return mass.adjugate() / mass.det(method="berkowitz")
    return mass.inv() if mass.rows <= 3 or mass.is_diagonal() else mass.subs(system.values).inv()


def _step_entry(diagonal: bool, h: str, entry: Any, parameters: Mapping[str, str]) -> str:
    """An entry of I + hA."""
    if isinstance(entry, str) and entry not in parameters:
        return str(diagonal + Fraction(h) * Fraction(entry))
    return f"{int(diagonal)} + {h}*{infix(entry, parameters)}"


def infix(entry: Any, names: Mapping[str, str]) -> str:
    """A prefix expression of a certificate (docs/certificate_format.md) as one of the kernel's."""
    if isinstance(entry, str):
        return names.get(entry) or f"({entry})"
    word, *parts = entry
    texts = [infix(part, names) for part in parts]
    if word in ("+", "*"):
        return f"({f' {word} '.join(texts)})"
    if word == "neg":
        return f"(-{texts[0]})"
    if word == "/":
        return f"({texts[0]}/{texts[1]})"
    if word == "^":
        return f"({'*'.join([texts[0]] * int(parts[1]) or ['1'])})"
    if word in ("cos", "sin"):
        return f"{word}({texts[0]})"
    raise NotCovered(f"a matrix with {word}")


class Writer:
    """SymPy → the kernel's expressions over parameters.X, state.X, inputs.X, outputs.X, true.X and sign.X.

    Attributes:
        slips: the estimated slip velocities over the estimates.
    """

    def __init__(self, observer: Observer, places: Mapping[str, str], precision: str = "double") -> None:
        system, self._precision = observer.system, precision
        self._positions = {*system.positions}
        shown = observer.equations[0].symbols if observer.velocity == "estimated" else system.velocities
        velocity = dict(zip(system.velocities, shown, strict=True))
        self.slips = [u.xreplace(velocity) for u in system.slip_velocity]
        symbols = [sympy.Symbol(f"slip_{c.name}") for c in system.contacts]
        self._slips = {s.name: u for s, u in zip(symbols, self.slips, strict=True)}
        self._signs = dict(zip(self._slips, observer.signs, strict=True))
        self._signs |= {str(u): s for u, s in zip(system.slip_velocity, observer.signs, strict=True)}  # the machine's
        self._places = dict(places) | {e.truth.name: f"true.{e.truth.name}" for e in observer.errors}
        self._places |= {s.name: f"sign.{c.name}" for s, c in zip(observer.signs, system.contacts, strict=True)}

    def __call__(self, e: Any) -> str:
        """The expression; slips by their estimates, and in place of signs and magnitudes the signs of the slips."""
        e = sympy.sympify(e)
        e = e.replace(Sgn, lambda u: self._signs.get(str(u), Sgn(u)))
        e = e.replace(Magnitude, lambda u: self._signs[str(u)] * u if str(u) in self._signs else Magnitude(u))
        e = e.xreplace({s: self._slips[s.name] for s in e.free_symbols if s.name in self._slips})
        return self._sum(e.replace(self._of_angles, sympy.expand_trig))  # the code knows those of single angles

    def _of_angles(self, e: Any) -> bool:
        """Whether it is a sine or cosine of a sum of coordinates."""
        return e.func in (sympy.cos, sympy.sin) and e.args[0].is_Add and e.free_symbols <= self._positions

    def _sum(self, e: Any) -> str:
        written = ""
        for term in e.as_ordered_terms():
            minus = term.could_extract_minus_sign()
            product = self._product(-term if minus else term)
            written += (" - " if minus else " + ") + product if written else ("-" if minus else "") + product
        return written

    def _product(self, e: Any) -> str:
        above, below = sympy.fraction(e)
        factors = sympy.Mul.make_args(above)
        if any(f.is_NumberSymbol for f in factors):  # the code has one decimal in place of all its numbers
            number = float(sympy.Mul(*(f for f in factors if f.is_number)))
            digits = str(np.float32(number)) if self._precision == "single" else repr(number)
            text = "*".join([digits, *(self._factor(f) for f in factors if not f.is_number)])
        else:
            text = "*".join(self._factor(f) for f in factors)
        return "/".join([text, *(self._divisor(f) for f in sympy.Mul.make_args(below) if f != 1)])

    def _divisor(self, e: Any) -> str:
        """A factor behind a stroke: the product that a power is written as is one number there."""
        return f"({self._factor(e)})" if e.is_Pow else self._factor(e)

    def _factor(self, e: Any) -> str:
        if e.is_Integer and e >= 0:
            return str(e)
        if e.is_Symbol:
            name = "sample_time" if e.name == "h" else e.name
            if name not in self._places:
                raise NotCovered(f"the quantity {name}")
            return str(self._places[name])
        if e.is_Pow and e.exp.is_Integer and e.exp > 0:
            return "*".join([self._factor(e.base)] * int(e.exp))
        if e.func in FUNCTIONS:
            return f"{FUNCTIONS[e.func]}({self._sum(e.args[0])})"
        if e.is_Add or e.is_Mul or e.is_Number:
            return f"({self._sum(e)})"
        raise NotCovered(f"the number {e}" if e.is_NumberSymbol else f"the function {e.func}")


def estimates_of(observer: Observer) -> list[Any]:
    """The symbols of the estimates, in the order of the errors."""
    return [s for equation in observer.equations if equation.state is not None for s in equation.symbols]


def _states(observer: Observer) -> dict[Any, Any]:
    """State → what it is where the estimates are known: estimate = state + rest, so state = estimate − rest."""
    states = {}
    for equation in observer.equations:
        if equation.state is not None:
            for z, y, value in zip(equation.state, equation.symbols, equation.expression, strict=True):
                states[z] = y - (value - z)
    return states


def _domain(observer: Observer, write: Writer) -> list[str]:
    """What is positive in the domain of a guarded level, its count being full."""
    if observer.domain is None:
        return []
    (u,), (s,), (x,) = write.slips, observer.signs, observer.system.positions
    domain = [f"{write(s * u)} - parameters.slip_speed"]
    if observer.domain.innovation is not None:
        domain.append(f"parameters.largest_innovation - fabs({write(x)} - state.{x.name}_predicted)")
    return domain


def _held(observer: Observer, write: Writer) -> dict[str, str]:
    """The guard's own states in its domain."""
    if observer.domain is None:
        return {}
    (contact,), (s,) = observer.system.contacts, observer.signs
    return {f"state.direction_{contact.name}": write(s), "state.samples_slid": "parameters.settle_samples"}


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
