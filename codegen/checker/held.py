"""Verification of initialisation and of invalid samples: zero velocity at the start, held estimates afterwards.

Standard library only; part of the checker (verify.py), which hands ``frame``, ``kernel`` and ``rounding`` in. The
kernel's theorem is about valid samples. Here it is verified which values the functions of the C for other samples
(frame.py reads their form) give those states that the estimates depend on. Let G be the proof's `states`: by the
kernel's lemma 10 the states G(e, x) give the estimates e at the measured positions x, and no other e has these states.
Then, as identities of polynomials:

- after `init` at x the states are G(e, x) with velocities of zero and all other estimates constant;
- `predict` makes G(e, x + h v) of G(e, x), v the held velocities: if the machine goes on at these, the estimates of the
  next sample are what they would have been without the invalid one. Where one invalid sample already leads to HOLDING,
  `resume` follows `predict` before any step, and this is not needed;
- after `resume` at x they are G(e, x + h v), e the held estimates, which are then those of the next sample.
"""

from fractions import Fraction
from math import prod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import frame, kernel, rounding


def require(proof: dict[str, Any], proven: dict[str, Any]) -> None:
    """Raises ValueError where initialisation, held estimates or the detection of invalid samples are not as above.

    A proof with a `domain` claims nothing at the start, which is outside of it: then only the detection of invalid
    samples and ``finite`` are verified.

    Args:
        proven: what errors.prove returned for the proof.
    """
    c, known = proven["c"], proven["known"]
    frame.detects(c)
    free = {x: kernel.term(1, x) for x in (*c.values, *c.inputs, *c.states, *c.outputs)}
    begun = kernel.Text({x: p for x, p in free.items() if x not in c.states}, {}).run(c.init, c.states)  # of any state
    finite(proof, proven, begun)
    if proof["domain"]:
        return
    before, modes = [*known], Modes(proof, proven)
    require_constant_start(modes)
    require_held_estimates(modes)
    kernel.demand("1/" not in [name for name, _ in known.keys() - before], "a division by what may be zero")


def restarts(proven: dict[str, Any]) -> dict[str, Fraction]:
    """State -> the number that `init`, `predict` and `resume` all set it to, whatever the states before; of each such.

    So it has that number in the first sample, and in the first with fault 0 after others: these three functions alone
    are called in a sample with a fault, and `init` and `resume` behind `reset`, which sets the mode in which they are.
    Left out is what rounding may change by more than that of its terms: 88 + 1e8 + 0.1 - 1e8 - 0.1 is 88.000000009.
    """
    c, ends = proven["c"], [rounding.from_any_state(proven, outputs=True) for _ in range(3)]
    for text, program in zip(ends, (c.init, c.predict, c.resume), strict=True):
        text.run(program, c.states)
    numbers = {z: p for z in c.states if not (p := ends[0].names[z]).names()}
    return {z: p.constant() for z, p in numbers.items() if all(text.is_exactly(z, p) for text in ends)}


class Modes:
    """The states after a function of the C, and those that give certain estimates.

    Attributes:
        estimates: true variable -> its estimate.
    """

    def __init__(self, proof: dict[str, Any], proven: dict[str, Any]) -> None:
        self.proof, self.proven, self.names = proof, proven, proven["names"]
        self.estimates = {e["truth"]: e["estimate"] for e in proof["errors"]}
        self._own = {z: kernel.term(1, f"{z} before") for z in proof["states"]}
        self._own |= {x: p for x, p in self.names.items() if x.startswith(("parameters.", "inputs.", "state."))}

    def states(self, at: dict[str, Any]) -> dict[str, Any]:
        """G: the states that give the estimates (and positions) of ``at``."""
        text = kernel.Text(self.names | at, self.proven["known"])
        return {z: text.value(of) for z, of in self.proof["states"].items()}

    def after(self, program: Any, at: dict[str, Any]) -> dict[str, Any]:
        """The states after a function of the C, from the values of ``at``."""
        found: dict[str, Any] = kernel.Text(self._own | at, self.proven["known"]).run(program, self.proven["c"].states)
        return found

    def moved(self, by: dict[str, Any]) -> dict[str, Any]:
        """The positions x + h v, with the velocities v of ``by``."""
        h = self.names["parameters.sample_time"]
        pairs = self.proof["positions"].items()
        return {x: self.names[x] + h * by[self.estimates.get(v, v)] for x, v in pairs}


def require_constant_start(modes: Modes) -> None:
    """Raises ValueError unless `init` gives states with velocities of zero and other estimates that are constants.

    Each state may hold one of these constants ("level of ..."), and no two states the same.
    """
    levels = {t: f"level of {t}" for t in modes.estimates if t not in modes.proof["acceleration"]}
    at_rest = dict.fromkeys(modes.estimates.values(), kernel.Poly())
    at_rest |= {modes.estimates[t]: kernel.term(1, level) for t, level in levels.items()}
    first, there = modes.after(modes.proven["c"].init, {}), modes.states(at_rest)
    used: list[str] = []
    for z in modes.proven["moving"]:
        of = [level for level in levels.values() if level in there[z].names()]
        off = first[z] - there[z] + sum((kernel.term(1, level) for level in of), kernel.Poly())
        alone = (not of and not off) or (len(of) == 1 and of[0] not in used)
        kernel.demand(alone and not off.names(), f"init: {z} holds more than a constant")
        used += of


def require_held_estimates(modes: Modes) -> None:
    """Raises ValueError unless `predict` and `resume` give the states of the held estimates at x + h v.

    C that detects no invalid samples calls neither, and no step follows a `predict` that leads to HOLDING at once; they
    are computed all the same, since their divisions count. `resume` sets every state that the estimates depend on, from
    what was held and measured: a text that reads such a state is not the one demanded.
    """
    c, names, estimates = modes.proven["c"], modes.names, modes.estimates.values()
    held = names | {y: kernel.term(1, f"held {y}") for y in estimates}
    for what, found, at in (
        ("predict", modes.after(c.predict, {y: held[y] for y in estimates} | modes.proven["before"]), held),
        ("resume", modes.after(c.resume, {y: names[y] for y in estimates}), names),
    ):
        # A state without a formula may be in those of others, as the next step reads it: after the function.
        wanted = modes.states(modes.moved(at) | {z: found[z] for z in modes.proven["aside"]})
        wrong = [z for z in modes.proven["moving"] if found[z] != wanted[z]]
        needed = c.sums and (what == "resume" or c.most > 1)
        kernel.demand(not (wrong and needed), f"{what}: {wrong[:3]} do not go on with what was held")


def largest(p: Any, sizes: dict[str, Any], usual: int) -> Fraction:
    """The sum of the magnitudes of a polynomial's terms, names as large as in ``sizes`` or usual; signs and t are 1."""
    of = (abs(a) * prod(sizes.get(x, usual) for x in m if x[:5] != "sign." and x[-2:] != " t") for m, a in p.items())
    return sum(of, Fraction(0))


def size_of(z: str, ends: list[dict[str, Any]], sizes: dict[str, Any], usual: int) -> Fraction:
    """A bound of a state that shows no error, at these sizes of all others; or ValueError if it may grow.

    Where each function of the C makes c z + r of z, |c| < 1, |z| <= |r|/(1 - |c|) lasts from call to call; so it does
    where z stays as it is. In `predict`, the last, c may be 1: z grows by |r| in each of a usual number of samples.
    """
    found, more = Fraction(usual), Fraction(0)
    for end in ends:
        own = abs(Fraction(end[z].get((z,), 0)))
        rest = largest(kernel.Poly({m: a for m, a in end[z].items() if m != (z,)}), sizes, usual)
        kernel.demand(own < 1 or (own == 1 and (not rest or end is ends[-1])), f"{z} may grow")
        found = max(found, rest / (1 - own)) if own < 1 else found
        more = usual * rest if own == 1 else more
    return found + more


def finite(proof: dict[str, Any], proven: dict[str, Any], begun: dict[str, Any]) -> None:
    """Verifies that every argument of exp is at most 0, and that states shared with the machine stay equal to its own.

    Raises ValueError unless all of these hold:

    - The sum `check` of init, and that of step, is within its limit while inputs and estimates are of usual size, and
      quotients and other states as large as they then may be: else no sample would be used. Nor overflows a product
      with such a state.
    - Every argument of exp is -q - r. q is a positive semidefinite quadratic form in states, inputs and outputs (kernel
      lemma 2). r is a sum of clocks with coefficients >= 0. A clock is a state that every function of the C sets to a
      number >= 0 or increases by a number >= 0. So exp is at most 1. With a positive argument it could overflow, and
      the observer would report a fault in every sample from then on.
    - `init` sets each state of `shared` to the expression that verify prints for it, and that uses inputs and
      parameters alone: not what was in memory before, nor a local variable.
    - Each shared clock advances in an invalid sample as in a valid one, as the machine's does. For the other shared
      states, memories and lags, this is not needed: they decay.

    Args:
        begun: state -> the polynomial that `init` sets it to.
    """
    c, names, term = proven["c"], proven["names"], kernel.term
    start = kernel.Text({x: term(1, x) for x in (*c.values, *c.inputs)}, {})
    first = {z: start.value(of) for z, of in c.init if z in proof.get("shared", {})}
    unset = [z for z in proof.get("shared", {}) if z not in first or first[z] != begun[z]]
    kernel.demand(not unset, f"init: {unset}, which the machine has too, are not set to what is printed")
    values, known = {p: names[p] for p in c.values}, kernel.Text({}, {}).known
    free = values | {x: term(1, x) for x in (*c.inputs, *c.states, *c.outputs)}
    programs = (c.step + c.commit, c.init, c.reset, c.predict, c.resume)
    ends = [kernel.Text(free, known).run(program, c.states + c.outputs) for program in programs]
    clocks = {z for z in first if not (ends[0][z] - free[z]).names()}
    usual, others = c.precision.usual, [z for z in (*proof.get("shared", {}), *proven["aside"]) if z not in clocks]
    quotients = [rounding.Bounded({}, of, c.precision) for of in (known, proven["known"])]
    for of in quotients:  # reciprocal -> the largest that it is, by the least divisor that rounding.py lets pass
        of.ones()
    of_ends, of_step = (
        {x: p.constant() for x, p in of.largest.items()} | dict.fromkeys(rounding.bounded_by_one(of.known), 1)
        for of in quotients
    )
    ordered = [*ends[:3], ends[4], ends[3]]
    sizes = {z: largest(p, of_step, usual) for z, p in proven["before"].items()}
    for z in others:
        sizes[z] = size_of(z, ordered, sizes | of_ends, usual)
    grows = [z for z in others if size_of(z, ordered, sizes | of_ends, usual) > sizes[z]]  # by one that comes later
    kernel.demand(not grows, f"{grows[:3]} may grow")
    if large := {z: kernel.term(sizes[z]) for z in others if sizes[z] > usual}:
        for program in programs:  # rounding.py has asked for the same with these states as usual
            text = rounding.Bounded(free, {}, c.precision)
            text.largest.update(large)
            text.run(program, c.states + c.outputs)
    begins = sum((largest(ends[1][x], sizes | of_ends, usual) for x in (*c.inputs, *c.states)), Fraction(0))
    follows = largest(proven["after"].get("check", {}), sizes | of_step, usual)
    kernel.demand(not c.sums or max(begins, follows) <= c.precision.limit, "the sum `check` may be above its limit")
    wrong = [z for z in clocks for end in ends[3:] if c.sums and end[z] != ends[0][z]]
    kernel.demand(not wrong, f"{wrong} does not go on in an invalid sample as in a valid one")
    later = {z: [p for end in ends for p in (end[z], end[z] - free[z]) if not p.names()] for z in clocks}
    clocks = {
        z for z, numbers in later.items() if len(numbers) == len(ends) and min(p.constant() for p in numbers) >= 0
    }
    for name, p in known:
        if name == "exp" and p.names():
            above = [x for (x,), a in ((m, a) for m, a in p.items() if len(m) == 1) if x not in clocks or a > 0]
            form = kernel.Poly({m: -a for m, a in p.items() if len(m) == 2})
            size = sorted(form.names())
            half = [[form.get(tuple(sorted((x, y))), 0) * (1 + (x == y)) for y in size] for x in size]
            kernel.demand(not above and all(len(m) in (1, 2) for m in p), "exp of what may be above 0")
            kernel.semidefinite([[term(a) for a in row] for row in half], {}, "", {})
