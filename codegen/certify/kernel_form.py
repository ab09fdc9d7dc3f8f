"""Conversion of a certificate to a proof for the kernel (checker/kernel.py), which relates the error matrix to the C.

A certificate is about the matrix A. The proof adds the equations of the machine, and the errors and states as
expressions in quantities of the generated code; from these the kernel derives A itself. Nothing here is trusted.

Covered are observers of Coulomb levels and trackers of forces, with a common P. For the sliding of a DFO see
sliding_form.py.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import sympy

from codegen.base.result import json_text
from codegen.mechanics import System
from codegen.mechanics.actuator import decayed
from codegen.mechanics.system import TIME
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

FUNCTIONS = {sympy.cos: "cos", sympy.exp: "exp", sympy.sin: "sin", Magnitude: "fabs", Sgn: "sgn"}
"""SymPy function → its name in the kernel. A function of measured quantities has the same value in machine and code."""


class NotCovered(Exception):
    """Error: the kernel's language cannot express a certificate; the message names what it lacks."""


def proof_text(observer: Observer, places: Mapping[str, str], content: Mapping[str, Any]) -> str:
    """The proof for the kernel, as JSON; its fields are those of docs/certificate_kernel.md, "proof.json".

    Args:
        places: parameter, state, input or output of the observer's code → its place there, such as outputs.v_hat[3].
        content: the certificate's JSON object.

    Raises:
        NotCovered: if the kernel cannot express the certificate.
    """
    _refuse_uncovered(observer, content)
    system, write = observer.system, Writer(observer, places)
    effective, shared = driven(observer)  # shared: states that machine and code have alike, such as those of a delay
    force = (system.modelled_force - observer.true_friction).xreplace(effective)
    acceleration = inverse(system) * force
    shared |= {TIME: TIME + symbol("h")} if force.has(TIME) else {}
    at = {name: write(symbol(name)) for name in content["variables"]}
    sign_of = {write(u): write(s) for u, s in zip(system.slip_velocity, observer.signs, strict=True)}
    at |= {f"|{u}|": f"{s}*{u}" for u, s in sign_of.items()}
    matrix = str(matrix_texts(content, at))
    bounded = _bounded(content, at)
    signed = {u: s for u, s in sign_of.items() if u.startswith("true.") and f"{s}*{u}" in matrix}
    signs = [
        observer.signs[e.contact] if e.contact is not None and observer.level_errors else None for e in observer.errors
    ]
    fields = {
        "positions": {write(x): write(v) for x, v in zip(system.positions, system.velocities, strict=True)},
        "mass_matrix": [[write(x) for x in system.mass_matrix.row(i)] for i in range(system.mass_matrix.rows)],
        "force": [write(f) for f in force],
        "acceleration": {write(v): write(a) for v, a in zip(system.velocities, acceleration, strict=True)},
        "signs": {write(s): write(u) for s, u in zip(observer.signs, write.slips, strict=True)},
        "domain": [],
        "shared": {write(z): write(e) for z, e in shared.items()},
        "mean": {write(x): write(q) for x, q in mean_velocity(observer).items()},
        **error_fields(observer, write, signs, content, at),
        "box": {at[name]: ends for name, ends in content["variables"].items() if at[name] in bounded},
        **_of_solver(content, at),
    }
    if observer.domain is not None:  # in which the level is updated
        (u,), (s,), (x,), (contact,) = write.slips, observer.signs, system.positions, system.contacts
        fields["domain"] = [f"{write(s * u)} - parameters.slip_speed"]
        if observer.domain.innovation is not None:
            innovation = f"fabs({write(x)} - state.{x.name}_predicted)"
            fields["domain"].append(f"parameters.largest_innovation - {innovation}")
        # Constant there: direction of slip, samples for which the level is still held, and samples since the last
        # reversal, the count of which is at its limit.
        counts = {"state.samples_held": "0", "state.samples_slid": "parameters.settle_samples"}
        fields["states"] |= {f"state.direction_{contact.name}": write(s), **counts}
    # Where the matrix has s u of a slip u, the box bounds s u = |u| in place of u: ``along`` says which sign that is.
    magnitudes = {}
    for u, (low, high) in ((u, fields["box"][u]) for u in signed if u in fields["box"]):
        if (even := Fraction(low) == -Fraction(high)) or Fraction(low) >= 0:
            magnitudes[u] = ["0" if even else low, high]
    if magnitudes:
        fields |= {"along": {u: signed[u] for u in magnitudes}, "box": fields["box"] | magnitudes}
    if not fields["cover"]:
        splits = [(at[x], cuts) for x, cuts in content["splits"].items() if at[x] in fields["box"]]
        fields["cover"] = _cells(splits, fields["box"])
    others = json.dumps(fields | {"signs": {}})
    fields["signs"] = {s: u for s, u in fields["signs"].items() if s in others}
    fields = {key: value for key, value in fields.items() if value or key not in ("shared", "mean")}
    return json_text(
        {"name": content["subject"]["name"], "step": observer.integration, **fields, **witness(fields, places)}
    )


def _refuse_uncovered(observer: Observer, content: Mapping[str, Any]) -> None:
    """Raise NotCovered for a kind of certificate, step or machine that the kernel has no form of proof for."""
    if content["along"]:
        raise NotCovered("a refutation")
    if observer.integration not in ("euler", "semi_implicit", "exponential"):
        raise NotCovered(f"the step is {observer.integration}, and the proof of the C covers explicit steps only")
    if len(content["error"]) != len(observer.errors):
        raise NotCovered(
            "this certificate is about one mode of the error, and has no matrix of all errors to find in the C"
        )
    if observer.system.sensor_errors:
        raise NotCovered("the code corrects a sensor error by iteration, which the proof of the C does not cover")


def with_solution(proof: str, content: Mapping[str, Any]) -> str:
    """The proof with P, cover, rate and reversals replaced by those of another certificate of the same matrix."""
    made = json.loads(proof)
    return json_text(made | _of_solver(content, {x.split(".")[1]: x for x in (*made["positions"], *made["box"])}))


def error_fields(
    observer: Observer, write: Writer, signs: list[Any], content: Mapping[str, Any], at: Mapping[str, str]
) -> dict[str, Any]:
    """The fields ``errors``, ``states`` (states as functions of the estimates) and ``matrix`` (I + hA) of a proof.

    Args:
        signs: the sign symbol that multiplies each error, or None.
        at: variable of the certificate → its expression in the code's quantities.
    """
    return {
        "errors": [
            {"truth": write(e.truth), "estimate": write(y), "sign": "" if sign is None else write(sign)}
            for e, (_, y, _), sign in zip(observer.errors, observer.estimates, signs, strict=True)
        ],
        "states": {write(z): write(y - (value - z)) for z, y, value in observer.estimates},
        "matrix": matrix_texts(content, at),
    }


def matrix_texts(content: Mapping[str, Any], at: Mapping[str, str]) -> list[list[str]]:
    """I + hA of a certificate as text, m rows of m entries; ``at`` as in ``error_fields``."""
    h, parameters = content["sample_time"], {p["name"]: infix(p["expression"], at) for p in content["parameters"]}

    def entry(diagonal: bool, rate: Any) -> str:
        if isinstance(rate, str) and rate not in parameters:
            return str(diagonal + Fraction(h) * Fraction(rate))
        return f"{int(diagonal)} + {h}*{infix(rate, parameters)}"

    return [[entry(i == j, rate) for j, rate in enumerate(row)] for i, row in enumerate(content["matrix"])]


def mean_velocity(observer: Observer) -> dict[Any, Any]:
    """Position x → weight q of the exponential step, whose errors stay zero if x[k+1] = x + h (v + q h v'); else empty.

    q = (1 − Φ)/(hΓ) for v̂ = z + Γ x and dz/dt = −Γ v̂ + Φ v̂' (``observers/velocity.py``). With a scalar K_v this is
    q = 1/(1 − exp(−hK_v)) − 1/(hK_v), between 1/2 and 1.
    """
    if observer.integration != "exponential":
        return {}
    h, estimate = symbol("h"), observer.equations[0]
    acceleration_symbols = next(e.symbols for e in observer.equations if e.form == "mass_solve")
    parts = zip(observer.system.positions, estimate.expression, observer.rates, acceleration_symbols, strict=False)
    return {x: (1 - rate.diff(a)) / (h * value.diff(x)) for x, value, rate, a in parts}


def driven(observer: Observer) -> tuple[dict[Any, Any], dict[Any, Any]]:
    """Actuator dynamics: (input → mean effective input over the next sample, state of a delay or lag → its next value).

    They are expressions in the symbols of those states, as in ``program/signals.py``.
    """
    system, h = observer.system, symbol("h")
    effective: dict[Any, Any] = {}
    moves: dict[Any, Any] = {}
    for w, chain in system.actuators.items():
        ratio = sympy.Rational(chain.delay.subs(system.values)) / observer.sample_time
        whole, share = int(sympy.floor(ratio)), float(ratio - sympy.floor(ratio))
        line = [w, *(symbol(f"{w}_past_{k}") for k in range(1, whole + bool(share) + 1))]
        moves |= dict(zip(line[1:], line, strict=False))
        mean = chain.static(line[whole])
        if share:
            parts = [sympy.Rational(repr(x)) for x in (1 - share, share)]
            mean = parts[0] * mean + parts[1] * chain.static(line[whole + 1])
        if chain.lag is not None:
            names = [f"{w}_lagged"] if chain.order == 1 else [f"{w}_lagged_{k + 1}" for k in range(chain.order)]
            lags, decay = [symbol(name) for name in names], sympy.exp(-h / chain.lag)
            errors = [lag - mean for lag in lags]
            left = decayed(errors, h / chain.lag, decay)
            moves |= {lag: mean + error for lag, error in zip(lags, left, strict=True)}
            mean += sum((e - after for e, after in zip(errors, left, strict=True)), sympy.S.Zero) * chain.lag / h
        effective[w] = mean
    return effective, moves


def _bounded(content: Mapping[str, Any], at: Mapping[str, str]) -> set[str]:
    """The variables, as places in the code, whose ranges the proof states: truths, and some measured quantities.

    A measured position has its range where A depends on it by more than sines and cosines, as with M = J + m r(x)².
    An angle that is in these alone is proved at every angle, without a condition.
    """

    def outside_of_waves(entry: Any) -> set[str]:
        if isinstance(entry, str):
            return {entry}
        word, *parts = entry
        return set() if word in ("cos", "sin") else set().union(*map(outside_of_waves, parts))

    entries = [*(x for row in content["matrix"] for x in row), *(p["expression"] for p in content["parameters"])]
    used = outside_of_waves(["+", *entries])
    places = {name: at[name] for name in content["variables"]}
    return {x for name, x in places.items() if x.startswith("true.") or (x.startswith("inputs.") and name in used)}


def _cells(splits: list[tuple[str, list[str]]], box: Mapping[str, list[str]]) -> Any:
    """The cells of a box as a balanced binary tree of cuts [variable, cut, tree below, tree above]; "" is a leaf."""
    if not splits:
        return ""
    (x, ends), *others = splits
    inner = [cut for cut in ends if Fraction(box[x][0]) < Fraction(cut) < Fraction(box[x][1])]

    def tree(cuts: list[str]) -> Any:
        if not cuts:
            return _cells(others, box)
        middle = len(cuts) // 2
        return [x, cuts[middle], tree(cuts[:middle]), tree(cuts[middle + 1 :])]

    return tree(inner)


def witness(fields: Mapping[str, Any], places: Mapping[str, str]) -> dict[str, Any]:
    """The field ``witness``: a point in domain and box, which shows that they are not empty; {} without domain and box.

    At this point the estimates equal the true values, and all velocities differ.

    Args:
        fields: the other fields of the proof.
        places: as in ``proof_text``.
    """
    if not (fields["domain"] or fields["box"]):
        return {}
    free = [e["truth"] for e in fields["errors"]] + [x for x in places.values() if x.startswith("inputs.")]
    unit = "*parameters.slip_speed" if "parameters.slip_speed" in places.values() else ""
    point = {x: "0" if x in fields["positions"] else f"{k + 2}{unit}" for k, x in enumerate(free)}
    for k, (x, ends) in enumerate(fields["box"].items(), len(free) + 1):  # above the middle
        low, high = map(Fraction, ends)
        point[x] = str(low + (high - low) * Fraction(k, 2 * len(free) + 1))
    point |= {e["estimate"]: point[e["truth"]] for e in fields["errors"]}
    return {
        "witness": point | {z: "0" for z in places.values() if z.startswith("state.") and z not in fields["states"]}
    }


def _named(tree: Any, at: Mapping[str, str]) -> Any:
    """A cover with the variables replaced by their places in the code: "theta2 t" becomes "inputs.theta2 t".

    "theta2 t" is the tangent variable of the angle theta2.
    """
    if tree == "":
        return tree
    name, *of = tree[0].split(" ")
    return [" ".join([at[name], *of]), tree[1], *(_named(part, at) for part in tree[2:])]


def _of_solver(content: Mapping[str, Any], at: Mapping[str, str]) -> dict[str, Any]:
    """The fields of a proof that the search for a certificate found; ``at``: variable → its place in the code."""
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


def inverse(system: System) -> sympy.Matrix:
    """M⁻¹; with numbers in place of the parameters if it is constant, full and of an order above 3."""
    mass = system.mass_matrix
    if mass.free_symbols & {*system.positions}:
        return mass.adjugate() / mass.det(method="berkowitz")
    return mass.inv() if mass.rows <= 3 or mass.is_diagonal() else mass.subs(system.values).inv()


def infix(entry: Any, names: Mapping[str, str]) -> str:
    """A prefix expression of a certificate (docs/certificate_format.md) as an infix expression of the kernel.

    Args:
        names: name in the certificate → its text in the kernel.

    Raises:
        NotCovered: for a function that the kernel does not have.
    """
    if isinstance(entry, str):
        return names.get(entry) or f"({entry})"
    word, *parts = entry
    texts = [infix(part, names) for part in parts]
    if word in ("+", "*", "/"):
        return f"({(word if word == '/' else f' {word} ').join(texts)})"
    if word == "neg":
        return f"(-{texts[0]})"
    if word == "^":
        return f"({'*'.join([texts[0]] * int(parts[1]) or ['1'])})"
    if word in ("cos", "exp", "sin"):
        return f"{word}({texts[0]})"
    if word == "abs":
        return names.get(f"|{texts[0]}|") or f"fabs({texts[0]})"
    raise NotCovered(f"the error matrix contains {word}, a function that the proof of the C does not have")


class Writer:
    """Printer of SymPy expressions in the kernel's syntax.

    Its quantities are parameters.X, state.X, inputs.X, outputs.X, true.X and sign.X.

    Attributes:
        slips: the estimated slip velocities, as expressions in the estimates.
    """

    def __init__(self, observer: Observer, places: Mapping[str, str]) -> None:
        system = observer.system
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
        """The text of an expression, with estimated slips for slips, s for sgn u and s u for |u|, s the sign symbol.

        Raises:
            NotCovered: for a quantity without a place in the code, or a function that the kernel does not have.
        """

        def of_sum(e: Any) -> bool:
            """Whether it is a sine or cosine of a sum of coordinates; the code has those of single angles only."""
            return e.func in (sympy.cos, sympy.sin) and e.args[0].is_Add and e.free_symbols <= self._positions

        e = sympy.sympify(e)
        e = e.replace(Sgn, lambda u: self._signs.get(str(u), Sgn(u)))
        e = e.replace(Magnitude, lambda u: self._signs[str(u)] * u if str(u) in self._signs else Magnitude(u))
        e = e.xreplace({s: self._slips[s.name] for s in e.free_symbols if s.name in self._slips})
        return self._sum(e.replace(of_sum, sympy.expand_trig))

    def _sum(self, e: Any) -> str:
        """The text of a sum."""
        written = ""
        for term in e.as_ordered_terms():
            minus = term.could_extract_minus_sign()
            product = self._product(-term if minus else term)
            written += (" - " if minus else " + ") + product if written else ("-" if minus else "") + product
        return written

    def _product(self, e: Any) -> str:
        """The text of a product or quotient."""
        above, below = sympy.fraction(e, exact=True)
        factors = sympy.Mul.make_args(above)
        if any(f.is_NumberSymbol for f in factors):  # the code has one decimal for the product of all numbers
            number = float(sympy.Mul(*(f for f in factors if f.is_number)))
            text = "*".join([repr(number), *(self._factor(f) for f in factors if not f.is_number)])
        else:
            text = "*".join(self._factor(f) for f in factors)
        divisors = [f for f in sympy.Mul.make_args(below) if f != 1]  # a power is written as a product
        return "/".join([text, *(f"({self._factor(f)})" if f.is_Pow else self._factor(f) for f in divisors)])

    def _factor(self, e: Any) -> str:
        """The text of a factor, in parentheses if it is a sum or a negative number."""
        if e.is_Integer and e >= 0:
            return str(e)
        if e.is_Symbol:
            name = "sample_time" if e.name == "h" else e.name
            if name not in self._places:
                after_step = f" ({name.removesuffix('_next')} after the step)" if name.endswith("_next") else ""
                what = f"{name}{after_step}"
                raise NotCovered(f"the model uses {what}, which is no input, output, state or parameter of the code")
            return str(self._places[name])
        if e.is_Pow and e.exp.is_Integer and e.exp > 0:
            return "*".join([self._factor(e.base)] * int(e.exp))
        if e.func in FUNCTIONS:
            return f"{FUNCTIONS[e.func]}({self._sum(e.args[0])})"
        if e.is_Add or e.is_Mul or e.is_Number:
            return f"({self._sum(e)})"
        what = f"the number {e}" if e.is_NumberSymbol else f"the function {e.func}"
        raise NotCovered(f"the model contains {what}, which the proof of the C does not have")
