"""The theorem of proof.json: the claimed error dynamics of an observer, proved by the kernel of the text of its C code.

Standard library only; part of the checker (verify.py), which passes the other files in. Everything here is an
identity or an inequality of polynomials that the kernel decides.

THEOREM. Let the step of NAME.c run in exact arithmetic with the values of NAME_PARAMETERS, from any state and on any
inputs, in samples with fault 0. In code, machine and matrix alike let the exp, sine or cosine of a number be its
decimal of 50 digits (decimals.py), or an exp that of the parameter that `prepare` sets to it. (rounding.py refuses what
multiplies the difference by much.)
Let a machine move by v[k+1] = v[k] + h acceleration[k] and x[k+1] = x[k] + h v[k] ("semi_implicit": h v[k+1];
"exponential": h ((1 - q) v[k] + q v[k+1]) with a number q = `mean` of x in [0, 1]), the positions x and those v that
are inputs measured exactly, all else of it constant.
Assume further, at each sample:
- every sign is 1 or -1, the same in machine and code, and does not change from one sample to the next;
- every expression of `domain` is positive;
- a state whose formula in `states` contains no estimate has the value of that formula.
Let e = sign * (truth - estimate) be the errors. A state with a formula is determined by estimates and measurements, so
e describes all of these states. Then
- e[k+1] = matrix e[k] + rest, exactly, or to first order in e where the result says "first order";
- V(matrix e) <= (1 - 2 decay_rate h) V(e) with V = e'Pe, wherever the variables are in `box`. A variable of the box is
  a truth times the sign that `along` assigns to it, by default the sign of its error.
Nothing is claimed about states without a formula (`aside`). Those listed in `shared` are assumed to be states of the
machine too, with the same values (a clock, a delay line, a lag).
Trusted: this file, kernel.py, decimals.py, frame.py, which reads the C, rounding.py, which computes the parameters and
bounds how far the header's decimals, and the exp, sine or cosine of a number, may be from exact values, Python, and
that the machine is yours. Not covered: rounding, samples with a fault, and the sample in which a sign changes.
theorem.py verifies the further fields of a proof: `mass_matrix`, `force`, `reversals`, how `shared` states move, that
no state of `aside` can feed a growing value back, and, by an example point, that `domain` and `box` are not empty.
"""

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import forms, frame, kernel, rounding

demand, term, Text = frame.demand, kernel.term, kernel.Text
NOT_MOVED = "the matrix does not move the errors"


@frame.limited()
def prove(proof: dict[str, Any], files: dict[str, str]) -> dict[str, Any]:
    """Verifies the theorem above for a proof and its files (name: text); an exception of any class if it is not shown.

    Returns the polynomials that further checks use: of the C, the names, states before and after a sample, the matrix.
    """
    signs, errors, formulas, velocity = (proof[x] for x in ("signs", "errors", "states", "positions"))
    c = frame.read(proof["name"], files)
    values, known = rounding.parameters(c)  # as `prepare` computes them; the header's are these, rounded
    # Free are inputs, truth, signs, errors, and states without a formula. An estimate is truth less sign * error.
    truths, estimates, turned = ([e[part] for e in errors] for part in ("truth", "estimate", "sign"))
    hidden, aside = [f"error of {x}" for x in truths], [z for z in c.states if z not in formulas]
    along = dict(zip(truths, turned, strict=True)) | proof.get("along", {})
    named = all(re.fullmatch(rf"{of}\.\w+", x, re.A) for of, all_ in (("true", truths), ("sign", signs)) for x in all_)
    named = named and {*along} == {*truths} and {*turned, *along.values()} <= {"", *signs}
    demand(named and len({*truths}) == len({*estimates} & {*c.outputs}) == len(errors) <= 100, "not so named")
    names = values | {"": term(1)}
    names |= {x: term(1, x) for x in (*c.inputs, *truths, *signs, *aside)}
    # A sign is that of a polynomial with an estimate or a measured velocity, and without a truth: that of an error is
    # 0 in the machine. So there are points where it is 1 in machine and code.
    slips = {*estimates, *velocity.values()}
    visible = {x: p for x, p in names.items() if x not in (*truths, *signs, *aside)}
    visible |= {x: term(1, x) for x in estimates}
    sign_arguments = [Text(visible, {}).value(of).names() for of in signs.values()]
    of_slips = all(x & slips and visible.keys() >= x for x in sign_arguments)
    demand(of_slips, "no sign of a slip, or of one with a function of a position")
    names |= {t: names[s] * names[t] for t, s in along.items()}
    machine, error = Text(names, known), [term(1, e) for e in hidden]
    triples = [(y, t, names[s]) for y, t, s in zip(estimates, truths, turned, strict=True)]
    names |= {y: names[t] - s * e for (y, t, s), e in zip(triples, error, strict=True)}
    claim = Text(names, known)
    sign_definitions = [(names[s], claim.value(of)) for s, of in signs.items()]
    positive_products = [(names[s], names[s] * p) for s in ("", *signs) for p in map(claim.value, proof["domain"])]
    for s, p in sign_definitions + positive_products:  # s p > 0 tells that s is the sign of p
        known |= {("sgn", term(way) * p): term(way) * s for way in (-1, 1)}
    # LEMMA 10. From the states that formulas of n estimates give, the n of them that move with one, `step` shows these
    # same estimates: a map of R^n to R^n that is one-to-one, hence, being polynomial, onto (linear algebra where it is
    # affine, else Bialynicki-Birula and Rosenlicht 1962). So every state is met, and shows its estimates.
    before = {z: claim.value(of) for z, of in formulas.items()}
    moving = [z for z, p in before.items() if not p.names().isdisjoint(hidden)]
    with_errors = {*hidden}  # and the values of functions of these
    for (_, of), p in known.items():
        with_errors |= p.names() - {*signs} if of.names() & with_errors else set()
    demand({*before} <= {*c.states} and len(moving) == len(errors), "not an error for each state")
    polynomial = all(p.names() & with_errors <= {*hidden} for p in before.values())
    demand(polynomial, "a state is no polynomial of the estimates")
    code = Text({x: p for x, p in names.items() if x not in c.outputs} | before, known, c.precision)
    code.run(c.step, [])
    after = code.run(c.commit, c.states + c.outputs)
    demand(all(after[y] == names[y] for y in estimates), "the states do not show the estimates")
    # The machine a sample later, and the states that show the errors which the matrix gives: they are the code's.
    phi = [[machine.value(x) for x in row] for row in proof["matrix"]]
    rest = [*map(machine.value, proof.get("rest", ["0"] * len(errors)))]
    later = names | {z: after[z] for z in aside} | {x: term(1, f"{x} later") for x in c.inputs}
    later |= moved(proof, machine, {*truths}, {*c.inputs})
    next_errors = [e + r for (e,), r in zip(forms.product(phi, [[e] for e in error], kernel.Poly()), rest, strict=True)]
    expected = Text(later | {y: later[t] - s * e for (y, t, s), e in zip(triples, next_errors, strict=True)}, known)
    remainders = {z: kernel.cleared(after[z] - expected.value(of), known) for z, of in formulas.items()}
    # A term of more than one error is beyond the first order; where such are left, that is said.
    wrong = [z for z, p in remainders.items() for m in p if z not in moving or sum(x in hidden for x in m) < 2]
    demand(not wrong, f"{NOT_MOVED}: {wrong[:3]}")
    # V falls, by lemmas 4 to 6 of the kernel.
    box = {x: [machine.value(end).constant() for end in (low, high)] for x, (low, high) in proof["box"].items()}
    h = names["parameters.sample_time"].constant()
    fall = 1 - 2 * machine.value(proof["decay_rate"]).constant() * h
    demand({*box} <= {*c.inputs, *truths} and fall > 0 < h, "a box of no free variable, or V negative")
    entries = {x: machine.value(x).constant() for row in proof["lyapunov_matrix"] for x in row}  # most stand twice
    P = [[term(entries[x]) for x in row] for row in proof["lyapunov_matrix"]]
    for p in (p for name, p in [*known] if name == "1/"):
        kernel.semidefinite([[p]], box, proof["cover"], known, kernel.LEAST)
    kernel.contracts(phi, P, fall, box, proof["cover"], known)
    conditions = proof["domain"] or box or any(rest) or aside or len(moving) < len(formulas)
    result: dict[str, Any] = {"c": c, "names": names, "known": known, "aside": aside, "moving": moving}
    result |= {"before": before, "after": after, "later": expected.names}
    result |= {"matrix": phi, "first order": any(remainders.values())}
    result |= {"rounded": rounding.parameter_bounds(c, names, known)}
    return result | {"fall": fall, "box": box, "along": along, "whole": not conditions}


def moved(proof: dict[str, Any], machine: Any, truths: set[str], inputs: set[str]) -> dict[str, Any]:
    """Velocity, position or other state of the machine -> its polynomial a sample later; ValueError for another step.

    Args:
        machine: kernel.Text of the machine's quantities, with the functions that occurred so far.
    """
    names, velocity = machine.names, proof["positions"]
    rate, h = {v: machine.value(a) for v, a in proof["acceleration"].items()}, names["parameters.sample_time"]
    moves = {*velocity.values()} <= {*rate} <= truths | inputs and {*velocity} <= inputs - {*rate}
    demand(moves, "not a velocity for each position")
    later = {v: names[v] + h * rate[v] for v in rate}
    ends, mean = {"euler": "0", "semi_implicit": "1"}, proof.get("mean", {})
    demand(proof["step"] in (["exponential"] if mean else ends), "a step of another mean velocity")
    shares = {x: machine.value(q) for x, q in (mean or dict.fromkeys(velocity, ends.get(proof["step"], ""))).items()}
    demand({*shares} == {*velocity} and all(0 <= q.constant() <= 1 for q in shares.values()), "no mean velocity")
    return later | {x: names[x] + h * (names[v] + shares[x] * (later[v] - names[v])) for x, v in velocity.items()}
