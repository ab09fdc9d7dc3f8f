"""A certificate as a proof for the kernel (checker/kernel.py): untrusted, as all that is written for it.

What a certificate says of a matrix is said there of the C: which states show which estimates, in which machine.
Covered are levels of Coulomb friction and tracked forces with constant M and Ψ and a common P.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import sympy

from codegen.mechanics import System
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol


class NotCovered(Exception):
    """The kernel has no words for this certificate; the message says for what."""


def proof_text(observer: Observer, places: Mapping[str, str], content: Mapping[str, Any]) -> str:
    """The proof as JSON.

    Args:
        places: parameter, state, input or output of the observer's code → its place there, such as outputs.v_hat[3].
        content: the certificate's JSON object.

    Raises:
        NotCovered: for what the kernel cannot say.
    """
    _refuse_uncovered(observer, content)
    return _text(_proof(observer, places, content))


def with_solution(proof: str, content: Mapping[str, Any]) -> str:
    """The proof with P, rate and reversals of another certificate of the same matrix."""
    made = json.loads(proof)
    return _text(made | _found(content, {x.split(".")[1]: x for x in (*made["positions"], *made["box"])}))


def _text(proof: Mapping[str, Any]) -> str:
    return json.dumps(proof, indent=1) + "\n"


def _refuse_uncovered(observer: Observer, content: Mapping[str, Any]) -> None:
    system = observer.system
    if content["along"]:
        raise NotCovered("a refutation")
    if observer.integration not in ("euler", "semi_implicit"):
        raise NotCovered(f"the step {observer.integration}")
    if len(content["error"]) != len(observer.errors):
        raise NotCovered("a proof by structure")
    if system.actuators or system.sensor_errors or system.transmissions:
        raise NotCovered("effects on inputs or sensors, or loads behind springs")


def _proof(observer: Observer, places: Mapping[str, str], content: Mapping[str, Any]) -> dict[str, Any]:
    system, write = observer.system, Writer(observer, places)
    force = system.modelled_force - observer.true_friction
    acceleration = _inverse(system) * force
    at = {name: write(symbol(name)) for name in content["variables"]}
    parameters = {p["name"]: infix(p["expression"], at) for p in content["parameters"]}
    h, size = content["sample_time"], range(len(content["matrix"]))
    turned = [observer.signs[e.contact] if e.contact is not None and observer.level_errors else None
              for e in observer.errors]  # fmt: skip
    return {
        "name": content["subject"]["name"],
        "step": observer.integration,
        "positions": {write(x): write(v) for x, v in zip(system.positions, system.velocities, strict=True)},
        "mass_matrix": [[write(x) for x in system.mass_matrix.row(i)] for i in range(system.mass_matrix.rows)],
        "force": [write(f) for f in force],
        "acceleration": {write(v): write(a) for v, a in zip(system.velocities, acceleration, strict=True)},
        "signs": {write(s): write(u) for s, u in zip(observer.signs, write.slips, strict=True)},
        "domain": _domain(observer, write),
        "errors": [
            {"truth": write(e.truth), "estimate": write(s), "sign": "" if sign is None else write(sign)}
            for e, s, sign in zip(observer.errors, estimates_of(observer), turned, strict=True)
        ],
        "states": {write(z): write(text) for z, text in states_of(observer).items()} | _held(observer, write),
        "matrix": [[step_entry(i == j, h, content["matrix"][i][j], parameters) for j in size] for i in size],
        "box": {at[name]: ends for name, ends in content["variables"].items() if at[name].startswith("true.")},
        **_found(content, at),
    }


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


def step_entry(diagonal: bool, h: str, entry: Any, parameters: Mapping[str, str]) -> str:
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

    def __init__(self, observer: Observer, places: Mapping[str, str]) -> None:
        system = observer.system
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
        e = e.replace(Sgn, self._sign).replace(Magnitude, lambda u: self._sign(u) * u)
        e = e.xreplace({s: self._slips[s.name] for s in e.free_symbols if s.name in self._slips})
        return self._sum(e.replace(_of_a_sum, sympy.expand_trig))  # the code knows those of single angles

    def _sign(self, u: Any) -> Any:
        """The symbol of a slip's sign."""
        if str(u) not in self._signs:
            raise NotCovered(f"the sign of {u}, which is no slip")
        return self._signs[str(u)]

    def _sum(self, e: Any) -> str:
        written = ""
        for term in e.as_ordered_terms():
            minus = term.could_extract_minus_sign()
            product = self._product(-term if minus else term)
            written += (" - " if minus else " + ") + product if written else ("-" if minus else "") + product
        return written

    def _product(self, e: Any) -> str:
        above, below = sympy.fraction(e)
        text = "*".join(self._factor(f) for f in sympy.Mul.make_args(above))
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
        if e.func in (sympy.cos, sympy.sin):
            return f"{e.func}({self._sum(e.args[0])})"
        if e.is_Add or e.is_Mul or e.is_Number:
            return f"({self._sum(e)})"
        where = "in the equations, as in a force that repeats with position"
        raise NotCovered(f"the number {e} {where}" if e.is_NumberSymbol else f"the function {e.func}")


def _of_a_sum(e: Any) -> bool:
    return e.func in (sympy.cos, sympy.sin) and not e.args[0].is_Symbol


def estimates_of(observer: Observer) -> list[Any]:
    return [s for equation in observer.equations if equation.state is not None for s in equation.symbols]


def states_of(observer: Observer) -> dict[Any, Any]:
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
