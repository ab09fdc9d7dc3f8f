"""Verification of proof.json and ellipsoid.json by the kernel (kernel.py): what is proved of the machine and the C.

Standard library only; part of the checker (verify.py), which passes ``enclosure`` and ``kernel`` in. Every word about
the machine is made from the proof that the kernel accepted; the certificate's own words are not read.
"""

import json
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from functools import cached_property, reduce
from itertools import permutations
from operator import mul
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import decay, ellipsoid, enclosure, errors, files, forms, frame, held, kernel, rounding

PROOF, SETS = "proof.json", "ellipsoid.json"
# The form of a proof: an object with just these fields (files.py says how it is written).
FORM: dict[str, Any] = {"name": "", "step": "", "decay_rate": "", "force": [""], "domain": [""], "rest?": [""]}
FORM |= {x: {"": ""} for x in ("positions", "acceleration", "signs", "states", "along?", "shared?", "mean?")}
FORM |= {"mass_matrix": [[""]], "matrix": [[""]], "lyapunov_matrix": [[""]], "box": {"": [""]}, "witness?": {"": ""}}
FORM |= {"errors": [dict.fromkeys(("truth", "estimate", "sign"), "")], "cover": None}
FORM |= {"reversals": [dict.fromkeys(("sign", "growth", "dwell"), "")]}
SI = (
    "(?:m|kg|s|A|K|mol|cd|rad|sr|Hz|N|Pa|J|W|C|V|F|ohm|S|Wb|T|H|met(?:er|re)|kilogram|second|ampere|radian|newton|volt)"
)
FACTOR = rf"\(*{SI}(?:\^-?[0-9.]{{1,8}})?\)*"
UNIT = rf"(?=.{{1,40}}\Z)(?:1|(?:1/)?{FACTOR}(?:[*/]{FACTOR})*)"  # coherent: no number and no prefix makes it another
LONGEST_SUM, LONGEST_FLAG = 20, 1000  # terms of an output that is printed as a sum, and of one that signs make 0
# Values of a sign for which an output is 0 -> what holds where it is not.
WHERE = {(-1, 0): "> 0", (0, 1): "< 0", (1,): "<= 0", (-1,): ">= 0", (-1, 1): "= 0", (0,): "is not 0"}


def read(text: str | bytes) -> dict[str, Any] | None:
    """The proof, or None if the text is no JSON object with just a proof's fields. Refused if a field is repeated."""
    try:
        content = files.parsed(text)
    except (ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) and files.named(content, FORM) else None


def found_instead(raw: Any) -> str:
    """In a message: what a JSON value is that was found where a certificate is expected."""
    if not isinstance(raw, dict):
        return files.kind(raw)
    names = [*raw]
    if files.named(names, ellipsoid.FORM):
        return f"an {SETS}, and it is verified with the {PROOF} beside it"
    form = raw.get("format")
    if isinstance(form, str) and form:
        return f"an object of the format {json.dumps(form[:40])}"
    kind, proofs = "an object with the fields", {x.rstrip("?") for x in FORM}
    if len(proofs.intersection(names)) > len(FORM) // 2:
        kind = "a proof of the C, but for the fields"
        names = sorted({x for x in FORM if x[-1] != "?"} - {*names} | {*names} - proofs) or ["name"]
    shown = [json.dumps(name[:40]) for name in names[:4]] + [f"and {len(names) - 4} more"] * (len(names) > 4)
    return f"{kind} {', '.join(shown)}" if names else "an object without fields"


@frame.limited()
def proved(proof: dict[str, Any], sources: dict[str, bytes], turns: Collection[str] = ()) -> dict[str, Any]:
    """Verifies a proof completely against the sources, and returns what was proved; or raises enclosure.Refused.

    What was proved is a dict, called ``proven`` throughout the checker: that of errors.prove (matrix, error dynamics,
    names), and statements about outputs, samples with a fault and units.

    Args:
        turns: signs, besides those of the proof's reversals, for whose change of sign the certificate claims something.
    """
    files.conform(proof, FORM, PROOF)
    known = numbers(proof)
    with or_refused(f"the kernel does not prove {PROOF} of the C"):
        texts = {name: text.decode() for name, text in sources.items()}
        proven: dict[str, Any] = errors.prove(proof, texts) | {"numbers": known}
        require_machine(proof, proven)
        require_witness(proof, proven)
        require_recovery(proof, proven)
        proven["outputs"] = outputs_over_estimates(proof, proven)
        proven["other than 0"], proven["held"] = other_than_zero(proof, proven)
        proven["counted"], proven["restarts"] = counters(proven), held.restarts(proven) if proof["domain"] else {}
        proven["formulas"] = formulas(proof, proven) if proof["domain"] else {}
        rounding.require(proof, proven)
        held.require(proof, proven)
        require_continuity(proof, proven, sorted({*proof["signs"], *turns}))
        return proven | {"units": units(proof, proven["c"], texts[f"{proof['name']}.h"])}


def require_machine(proof: dict[str, Any], proven: dict[str, Any]) -> None:
    """Raises ValueError unless mass_matrix * acceleration = force, and the mass matrix is definite in the box.

    These expressions may contain no state of the code except those that are `shared`.
    """
    shared: dict[str, str] = proof.get("shared", {})
    own = {x: p for x, p in proven["names"].items() if not x.startswith(("outputs.", "state.")) or x in shared}
    text, known, before = kernel.Text(own, proven["known"]), proven["known"], len(decay.divisors(proven["known"]))
    require_shared_states(
        shared, proven, kernel.Text({x: p for x, p in own.items() if not x.startswith("true.")}, known)
    )
    rates = [[text.value(a)] for a in proof["acceleration"].values()]
    mass = [[text.value(x) for x in row] for row in proof["mass_matrix"]]
    rows = zip(forms.product(mass, rates, kernel.Poly()), map(text.value, proof["force"]), rates, strict=True)
    off = [kernel.cleared(pushed - force, known) for (pushed,), force, _ in rows]
    kernel.demand(not any(off), "mass * acceleration is not force")
    for A in (mass, *([[p]] for p in decay.divisors(known)[before:])):
        kernel.semidefinite(A, proven["box"], proof["cover"], known, kernel.LEAST)


def require_shared_states(shared: dict[str, str], proven: dict[str, Any], text: Any) -> None:
    """Raises ValueError unless every `shared` state is a memory of past inputs, a lag or a clock.

    That is: in each sample z becomes c z + r, where r depends on inputs and on the shared states listed before z, and
    |c| < 1; or c = 1 and r is a number. The C must compute the same expression that `shared` states. An observer of an
    axis that is left out of the errors is none of these, so it cannot be passed off as shared.
    A state that is neither an error nor shared must not be computed from such a state, itself included: nothing is
    claimed about it, and by feedback it could grow.
    """
    unexplained = {*proven["aside"]} - {*shared}
    feedback = {x for z in unexplained for x in proven["after"][z].names() if x in proven["aside"] or x[0] == "?"}
    kernel.demand(not feedback, f"{feedback} is fed back to a state without an error, and may grow")
    before: set[str] = {*proven["c"].inputs}
    for z, of in shared.items():
        kernel.demand(z in proven["aside"], f"{z} is no state without an error")
        p = proven["after"][z]
        kernel.demand(p == text.value(of), f"{z} has another equation in the C than in `shared`")
        own, rest = Fraction(p.get((z,), 0)), kernel.Poly({m: c for m, c in p.items() if m != (z,)})
        names = rest.names()
        for (_, argument), value in reversed(proven["known"].items()):  # names in the arguments of functions
            names |= argument.names() if value.names() & names else set()
        kind = {x for x in names if x[0] != "?" and not x.endswith(" t")} <= before
        kernel.demand(kind and (abs(own) < 1 or (own == 1 and not names)), f"{z} is no memory, lag or clock")
        before |= {z}


def require_witness(proof: dict[str, Any], proven: dict[str, Any]) -> None:
    """Raises ValueError unless `witness` is a point of domain and box: a claim about an empty set would say nothing.

    `witness` gives each input, truth, estimate and state without a formula a number, over the parameters. Every sign
    there must be 1 or -1, and the same for the estimates as for the truths. Without domain and box no such point is
    needed: a sign is then that of a polynomial that is not constant in free names. Refused is also a sum of which
    ``rounding`` says that what is left of its terms may be rounding: at a point sin(x)^2 + cos(x)^2 - 1 is what 50
    digits make of it, and so may be above 0.
    """
    if not (proof["domain"] or proven["box"]):
        return
    shows = {e["estimate"]: e["truth"] for e in proof["errors"]}
    given, free = proof.get("witness", {}), {*proven["c"].inputs, *shows, *shows.values(), *proven["aside"]}
    kernel.demand(given.keys() == free, f"a domain or a box, and `witness` is not of {sorted(free)}")
    own = kernel.Text({x: p for x, p in proven["names"].items() if x == "" or x.startswith("parameters.")}, {})
    at = rounding.at_point(own.names | {x: own.value(n) for x, n in given.items()}, proven)
    true = rounding.at_point(at.names | {y: at.names[t] for y, t in shows.items()}, proven)
    signs = {s: kernel.function("sgn", at.settled(of), {}) for s, of in proof["signs"].items()}
    turns = {s: kernel.function("sgn", true.settled(of), {}) for s, of in proof["signs"].items()}
    at.names |= signs
    within = all(signs.values()) and signs == turns and all(at.settled(x).constant() > 0 for x in proof["domain"])
    along = {t: at.names[s] for t, s in proven["along"].items()}
    for x, (low, high) in proven["box"].items():
        within = within and low <= (along.get(x, at.names[""]) * at.names[x]).constant() <= high
    kernel.demand(within, "`witness` is no point of domain and box with signs of 1 or -1")


def ranges(proof: dict[str, Any], proven: dict[str, Any]) -> dict[str, list[Fraction]]:
    """Variable -> a range such that the claim of `box` holds whenever the variable itself is in that range.

    A box may bound x times a sign. If it is [-b, b], x in [-b, b] is enough. If the sign is x's own, that product is
    |x|: for a box [0, b], x in [-b, b] is enough, and for [a, b] with a > 0, x in [a, b]. Other variables times a sign
    are left out.
    """
    own = {e["truth"]: e["estimate"] for e in proof["errors"]}
    found = {}
    for x, (low, high) in proven["box"].items():
        sign = proven["along"].get(x, "")
        magnitude = sign and proof["signs"][sign] == own[x]
        if sign and (low == -high or (low == 0 and magnitude)):
            found[x] = [-high, high]
        elif not sign or (low > 0 and magnitude):
            found[x] = [low, high]
    return found


def require_recovery(proof: dict[str, Any], proven: dict[str, Any]) -> None:
    """Raises ValueError unless each of `reversals` holds: growth V(e) >= V(Je), and growth * fall^dwell <= 1.

    J = diag(-1 for the errors of the sign that changes, else 1); fall is the factor of V in a sample. Refused are two
    entries of one sign: ``numbers`` has those of the last alone.
    """
    known, flips = proven["numbers"], [e["sign"] for e in proof["errors"]]
    kernel.demand(len(known["turns"]) == len(proof["reversals"]), "reversals: a sign appears twice")
    P = tuple(map(tuple, kernel.integers(known["P"])[0]))
    for turn in proof["reversals"]:
        sign, (growth, dwell) = turn["sign"], known["turns"][turn["sign"]]
        why = forms.turns(P, tuple(i for i, s in enumerate(flips) if s == sign), growth)
        kernel.demand(not why, f"V may grow by more at a reversal of {sign}: {why}")
        lasts = sign in proof["signs"] and dwell in range(10**5) and (proven["fall"] < 1 or dwell <= 1)
        good = lasts and enclosure.decayed(growth, proven["fall"], int(dwell)) <= 1
        kernel.demand(good, f"V has not recovered from a reversal of {sign} after the dwell time")


def require_continuity(proof: dict[str, Any], proven: dict[str, Any], turns: list[str]) -> None:
    """Raises ValueError unless every estimate is continuous where one of these signs changes.

    A state has one value at a reversal, and by `states` it determines the estimates for either sign s of p. Both are
    the same at p = 0 if D is a multiple of p in each formula s D + rest of a state that determines an error. With
    p = a x + q, a a number and q without x, that is D = 0 at x = -q/a.
    """
    own = {x: kernel.term(1, x) for e in proof["errors"] for x in (e["truth"], e["estimate"])}
    claim, one = kernel.Text(proven["names"] | own, {}), kernel.term(1)
    formulas = {z: claim.value(of) for z, of in proof["states"].items() if z in proven["moving"]}
    for s in turns:
        p = claim.value(proof["signs"][s])
        (x, a), *_ = [(m[0], c) for m, c in p.items() if len(m) == 1 and sum(m[0] in n for n in p) == 1] or [("", 1)]
        at = (p - kernel.term(a, x)) * kernel.term(-1 / Fraction(a))  # where there is no x, any D is refused
        within: set[str] = {s}  # s, and sines, quotients and magnitudes in which it occurs
        for (_, of), value in claim.known.items():
            within |= value.names() if within & of.names() else set()
        for z, formula in formulas.items():
            kernel.demand(not (within - {s}) & formula.names(), f"{s} occurs in a function in {z}")
            left = kernel.Poly()
            for m, c in formula.items():
                if s in m:
                    left += kernel.term(c, *(y for y in m if y not in (s, x))) * reduce(mul, [at] * m.count(x), one)
            kernel.demand(not left, f"the estimate by {z} is discontinuous at a reversal of {s}")


def outputs_over_estimates(proof: dict[str, Any], proven: dict[str, Any]) -> dict[str, Any]:
    """Output of the C that is no estimate, such as a friction force -> its polynomial q over estimates and inputs.

    Left out are outputs that are no such polynomial, that depend on a function or a state, or that are constant. In
    ``after`` the output is a polynomial p over truths and errors. With the errors set to zero p becomes a candidate for
    q; it is accepted if q with the estimates put in is p again.
    """
    names, shows, found = proven["names"], {e["truth"]: e["estimate"] for e in proof["errors"]}, {}
    back = {t: names[proven["along"][t]] * kernel.term(1, y) for t, y in shows.items()}
    back |= {f"error of {t}": kernel.Poly() for t in shows}
    free, estimates = {*proven["c"].inputs, *proof["signs"], *shows.values()}, {y: names[y] for y in shows.values()}
    for x in (x for x in proven["c"].outputs if x not in estimates and len(proven["after"].get(x, ())) <= LONGEST_SUM):
        p = proven["after"].get(x, kernel.Poly())
        q = rounding.substituted(p, back)
        if q.names() and q.names() <= free and rounding.substituted(q, estimates) == p:
            found[x] = q
    return found


def other_than_zero(proof: dict[str, Any], proven: dict[str, Any]) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Conditions under which outputs are not 0, and under which the step does not hold its estimates; any state.

    Returns:
        Another output of the C, such as in_domain, or a state whose formula holds no error, such as samples_slid -> the
        conditions that hold in each sample in which it is not 0. And, of a proof with a domain: words, such as that a
        state becomes an estimate, or between which numbers an estimate is -> conditions that hold in each sample in
        which they are not true.
    """
    estimates = {e["estimate"] for e in proof["errors"]}
    others = [z for z in proof["states"] if z not in proven["moving"]]
    others += [y for y in proven["c"].outputs if y not in estimates and y not in proven["outputs"]]
    if not others:
        return {}, {}
    cases, held = SignCases(proof, proven), dict[str, list[str]]()
    for y in sorted(estimates) if proof["domain"] else ():
        held |= {f"{z} becomes {y}": lines for z in proven["moving"] if (lines := cases.where_not_held(z, y))}
        ends, lines = cases.range_of(y)
        held |= {f"{y} is in [{', '.join(map(enclosure.exact, ends))}]": lines} if lines else {}
    return {y: lines for y in others if (lines := cases.where_not_zero(y))}, held


class SignCases:
    """The C's step from any state, and what it becomes where one of its signs has a given number: -1, 0 or 1.

    Where one of these numbers makes an output's polynomial 0, whatever all else in it is, and no rounding makes it
    another number, the output is 0. States are written by as many estimates if their formulas in `states` have no sign,
    and the step shows these estimates: every state is then of that form (lemma 10 of errors.py).

    Attributes:
        free: parameter, input or state -> its polynomial, of which nothing is known.
        used: the estimates by which states are written.
        after: name -> its polynomial after the step, over inputs, states and these estimates.
        signs: variable of a sign in the C -> the polynomial that it is the sign of.
    """

    def __init__(self, proof: dict[str, Any], proven: dict[str, Any]) -> None:
        self.c, self.rounded, estimates = proven["c"], proven["rounded"], {e["estimate"] for e in proof["errors"]}
        c = self.c
        free = {x: proven["names"][x] for x in c.values} | {x: kernel.term(1, x) for x in (*c.inputs, *c.states)}
        own = {y: kernel.term(1, y) for y in estimates}
        claim, plain = kernel.Text(free | own, {}), [z for z in proven["moving"] if "sign." not in proof["states"][z]]
        written = {z: p for z in plain if (p := claim.value(proof["states"][z])).names() <= {*free, *own}}
        used = estimates & set().union(*(p.names() for p in written.values()))
        for start in [free | written] * (len(used) == len(written)) + [free]:
            known = dict[Any, Any]()
            after = kernel.Text(start, known).run(c.step + c.commit, c.states + c.outputs)
            if all(after[y] == own[y] for y in used):
                break
        self.free, self.used, self.known, self.after = free, used, known, after
        self.signs = {min(value.names()): of for (function, of), value in known.items() if function == "sgn"}
        self._numbers, self._codes = dict[tuple[str, int], dict[str, Any]](), dict[tuple[str, int], Any]()

    def with_number(self, p: Any, sign: str, number: int) -> Any:
        """p for this number of a sign, and for the numbers that other signs then have, which are signs of it."""
        if (sign, number) not in self._numbers:
            values = {sign: kernel.term(number)}
            for x, of in self.signs.items():
                if x != sign and not (argument := rounding.substituted(of, values)).names():
                    values[x] = kernel.function("sgn", argument, {})
            self._numbers[sign, number] = values
        return rounding.substituted(p, self._numbers[sign, number])

    @cached_property
    def over_states(self) -> dict[str, Any]:
        """Estimate -> its polynomial over states, of the estimates that are polynomials."""
        c = self.c
        shows = kernel.Text(self.free, {}).run(c.step + c.commit, c.states + c.outputs)
        return {y: shows[y] for y in self.used if not any(x[0] == "?" for x in shows[y].names())}

    def code(self, sign: str, number: int) -> Any:
        """The C's step with bounds by lemma R for this number of a sign, or None where lemma R refuses it.

        Over states, since with estimates for them terms cancel.
        """
        if (sign, number) not in self._codes:
            values = self.known | {("sgn", self.signs[sign]): kernel.term(number)}
            values = {(f, rounding.substituted(q, self.over_states)): v for (f, q), v in values.items()}
            code, self._codes[sign, number] = rounding.Bounded(self.free, values, self.c.precision, self.rounded), None
            with suppress(ValueError):
                code.run(self.c.step + self.c.commit, self.c.states + self.c.outputs)
                self._codes[sign, number] = code
        return self._codes[sign, number]

    def exceptions(self, p: Any, holds: Callable[[str, int], Any], holds_in: Callable[[Any], Any]) -> list[str]:
        """Conditions of which each holds wherever a claim about p does not; [] where none can be stated.

        Args:
            holds: whether the claim is true of the polynomials for this number of a sign.
            holds_in: whether it is true of the C with its rounding (``code``).
        """
        names = p.names()
        few = {x: of for x, of in self.signs.items() if x in names and not of.names() <= self.signs.keys()}
        true = {x: tuple(n for n in (-1, 0, 1) if holds(x, n)) for x in (few if len(p) <= LONGEST_FLAG else ())}
        lines = [f"{readable(few[x], self.signs)} {WHERE[numbers]}" for x, numbers in true.items() if numbers in WHERE]
        said = lines and not any("?" in line for line in lines)
        codes = (self.code(x, n) for x, numbers in true.items() for n in numbers)
        return lines if said and all(code and holds_in(code) for code in codes) else []

    def where_not_zero(self, y: str) -> list[str]:
        """Conditions that hold in each sample in which y is not 0."""
        p = self.after.get(y, kernel.Poly())
        return self.exceptions(p, lambda x, n: not self.with_number(p, x, n), lambda code: not code.bounds[y][0])

    def where_not_held(self, z: str, y: str) -> list[str]:
        """Conditions that hold in each sample in which the state z does not become the estimate y."""
        p = self.after[z] - self.after[y]
        return self.exceptions(
            p, lambda x, n: not self.with_number(p, x, n), lambda code: code.is_exactly(z, code.names[y], y)
        )

    def range_of(self, y: str) -> tuple[tuple[Fraction, ...], list[str]]:
        """Two numbers (``limits``), or none, and conditions that hold wherever the estimate y is not between them."""
        p, signs = self.after[y], self.signs

        def ends(x: str, n: int) -> tuple[Fraction, ...]:
            others = {s: self.with_number(of, x, n) for s, of in signs.items() if s != x}
            return limits(self.with_number(p, x, n), others)

        of_p = sorted(p.names() & signs.keys()) if len(p) <= LONGEST_FLAG else []
        found = {e for x in of_p for n in (-1, 0, 1) if (e := ends(x, n))}
        (only,) = found if len(found) == 1 else ((),)
        return only, self.exceptions(p, lambda x, n: only and ends(x, n) == only, lambda code: code.is_accurate(y))


def limits(p: Any, signs: dict[str, Any]) -> tuple[Fraction, ...]:
    """Two numbers between which p is, or none. c + |u|/2 - |u - d|/2 with numbers c and d is within |d|/2 of c."""
    for s, r in permutations(sorted(p.names() & signs.keys()) if len(p) <= LONGEST_SUM else (), 2):
        apart = signs[s] - signs[r]
        magnitudes = kernel.term(1, s) * signs[s] - kernel.term(1, r) * signs[r]
        centre = p - kernel.term("1/2") * magnitudes
        if not apart.names() and not centre.names():
            return tuple(centre.constant() + way * abs(apart.constant()) / 2 for way in (-1, 1))
    return ()


def formulas(proof: dict[str, Any], proven: dict[str, Any]) -> dict[str, str]:
    """Estimate, or state that holds one -> its formula over states, inputs and other estimates, where it is short.

    In each sample with fault 0, from any state. An estimate that the C sets once, from one local that it sets once, is
    a name in what follows. Left out is what rounding may replace.
    """
    c, estimates = proven["c"], {e["estimate"] for e in proof["errors"]}
    times = Counter(x for x, _ in c.step + c.commit)
    shows = {text.strip(): y for y, text in c.commit if y in estimates and times[y] == 1}
    local = {x: y for x, y in shows.items() if times[x] == 1 and x not in c.states}  # a state is shown before its step
    code, found = rounding.from_any_state(proven), dict[str, Any]()
    with suppress(ValueError):
        for name, text in c.step + c.commit:
            code.run([(name, text)], c.states + c.outputs)
            of = local.get(name, name)
            if of in proven["moving"] or name in local:
                found.pop(of, None)
                found |= {of: code.names[name]} if code.is_accurate(name) else {}
            if name in local:
                code.names[name] = kernel.term(1, of)
                code.bounds[name] = code.names[name], 0
        signs, said = dict[str, Any](), {*c.inputs, *c.states, *estimates}
        for (function, of), value in code.known.items():  # a sign of what is said is said
            signs |= {min(value.names()): of} if function == "sgn" and of.names() <= {*said, *signs} else {}
        short = {x: p for x, p in found.items() if len(p) <= LONGEST_SUM and p.names() <= {*said, *signs}}
        return {x: readable(p, signs) for x, p in short.items()}
    return {}


def readable(p: Any, signs: dict[str, Any]) -> str:
    """A polynomial as a sum, with sign(...) in place of each of these signs."""
    text = enclosure.as_sum(p)
    return re.sub(r"\?\d+", lambda x: f"sign({readable(signs[x[0]], signs)})" if x[0] in signs else x[0], text)


def counters(proven: dict[str, Any]) -> dict[str, str]:
    """State that is no error and depends on itself alone, such as a count -> its value after a step with fault 0.

    The step starts from any state. Left out are states in whose formula a term cancels, since rounding may change them.
    """
    c, others = proven["c"], [z for z in proven["before"] if z not in proven["moving"]]
    code = rounding.from_any_state(proven)
    if others:
        with suppress(ValueError):
            code.run(c.step + c.commit, c.states + c.outputs)
    signs = {min(value.names()): of for (function, of), value in code.known.items() if function == "sgn"}
    found = {z: p for z in others if (p := code.names[z]) != kernel.term(1, z) and z in code.bounds}
    alone = {z: {z, *(s for s, of in signs.items() if of.names() <= {z})} for z in found}
    kept = [z for z, p in found.items() if z in p.names() <= alone[z] and code.bounds[z][0] == rounding.magnitudes(p)]
    return {z: readable(found[z], signs) for z in kept}


def ellipsoid_claim(
    proof: dict[str, Any], proven: dict[str, Any], text: bytes
) -> tuple[dict[str, Any], list[list[Fraction]]]:
    """The claim of an ellipsoid.json and, for each of its sets, the proved bounds of its rows.

    Raises enclosure.Refused if it is not proved of the C. ``proven``: what ``proved`` returned; ``text``: of the file.
    """
    with or_refused(f"{SETS} is not proved of the C"):
        claim = files.parsed(text)
        return claim, ellipsoid.bounded(proof, claim, proven)


@contextmanager
def or_refused(words: str) -> Iterator[None]:
    """Turns every exception raised within into Refused, with these words before its message.

    A malformed or hostile file can make Python raise any exception (division by zero, recursion, memory); none may pass
    for a proof. KeyboardInterrupt is not caught.
    """
    try:
        yield
    except Exception as why:
        said, known = str(why)[:200], type(why) in (ValueError, enclosure.Refused)
        fault = said if known else f"a part is missing or not as it must be ({said})"
        raise enclosure.Refused(f"{words}: {fault}") from None


def units(proof: dict[str, Any], c: Any, header: str) -> list[str]:
    """The unit that the comment behind its field in the header gives each estimate, or enclosure.Refused.

    Units have to be coherent, the sample time in seconds: then x' = v and the bounds hold without a factor between.
    Refused where a state, an input or an output has none. What looks like a field within a comment is none.
    """
    *parts, _ = re.split(r"/\*(.*?)\*/", header.replace("\\\n", ""), flags=re.DOTALL)  # C and comments in turn
    fields = [re.search(r"\b(?:double|float)\s+(\w+)(?:\[\d+\])?;\s*\Z", code) for code in parts[::2]]
    said = [re.match(r" (\S+): ", comment) for comment in parts[1::2]]
    both = [(k, x[1], unit[1]) for k, (x, unit) in enumerate(zip(fields, said, strict=True)) if x and unit]
    pairs = {(field, unit) for _, field, unit in both}
    shown = [re.split(r"[.[]", error["estimate"])[1] for error in proof["errors"]]
    seen = pairs | {*re.findall(r"(?:double|float) (\w+)(?:\[\d+\])?; /\* (\S+): ", header)}  # in comments too
    shows = {e["truth"]: e["estimate"] for e in proof["errors"]}
    moves = [[re.split(r"[.[]", name)[1] for name in (x, shows.get(v, v))] for x, v in proof["positions"].items()]
    compared = [*shown, "sample_time", *(field for pair in moves for field in pair)]
    count = Counter(field for field, _ in seen)
    twice = [field for field in compared if count[field] > 1]
    enclosure.demand(not twice, f"{twice[0]} in {proof['name']}.h has two units" if twice else "")
    measured = [*dict.fromkeys(x.split("[")[0] for x in (*c.states, *c.inputs, *c.outputs))]
    begun = next((k for k, code in enumerate(parts[::2]) if "}" in code), 0)  # a derived parameter has no unit
    named = [field for k, field, _ in both if k >= begun]
    every = named == [x.split(".")[1] for x in measured]
    enclosure.demand(every, f"{proof['name']}.h: the unit behind a state, an input or an output is missing")
    of = dict(pairs)
    found = [of[field] for field in shown]
    odd = [unit for _, unit in pairs if not re.fullmatch(UNIT, unit)]
    enclosure.demand(not odd, f"{odd[0][:40]!r} in {proof['name']}.h is no unit of SI without a factor" if odd else "")
    enclosure.demand(of["sample_time"] == "s", f"the sample time in {proof['name']}.h is not in s")
    for x, v in moves:
        enclosure.demand(of[v] == f"{of[x]}/s", f"the unit of {v} in {proof['name']}.h is not that of {x} per second")
    return found


def numbers(proof: dict[str, Any]) -> dict[str, Any]:
    """The proof's numbers that are compared and printed: rationals as the certificate writes them, or refused.

    The kernel takes expressions too, of any size.
    """
    try:
        return {
            "P": [[enclosure.rational(x, "P") for x in row] for row in proof["lyapunov_matrix"]],
            "rate": enclosure.rational(proof["decay_rate"], "decay_rate"),
            "turns": {
                turn["sign"]: (enclosure.rational(turn["growth"], "growth"), enclosure.rational(turn["dwell"], "dwell"))
                for turn in proof["reversals"]
            },
        }
    except (LookupError, TypeError) as why:
        raise enclosure.Refused(f"{PROOF} cannot be read ({type(why).__name__})") from None
