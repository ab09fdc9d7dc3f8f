"""The proved statements in words, each made from the proof that the kernel accepted (theorem.py).

Standard library only; part of the checker (verify.py), which passes ``theorem`` and ``enclosure`` in. The certificate's
own words are not read.
"""

import json
import re
from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import ellipsoid, enclosure, frame, kernel, rounding, theorem

KINDS = "(?:parameters|inputs|outputs|state|true)"
START = "initialisation sets the velocity estimates to 0, and all others to constants, whatever is measured; "
HELD = START + "after invalid samples the held estimates continue, if each call gets the same outputs"
BARE = START + "an invalid sample is used like any other"
ASSUMED = "error bounds, assuming "
OWN = ("V", "e", "P", "sign", "sin", "cos", "exp", "abs", "fabs")  # names that the words below use without a kind
PROOF, SETS = theorem.PROOF, theorem.SETS
STEP, LONG_RUN = "the step multiplies V = e'Pe", "is in the long run at most"
SIZES = "that noise and drift stay within the bounds assumed (generate and certify take them from the envelope)"
UNREAD = f"{SETS}: its bounds are not used, which need a {PROOF} of the C beside it, with the V of the certificate"
WITHIN, SIZED = "noise, change of force or speed within a sample", "noise and drift beyond the bounds assumed below"


def proved_statements(proof: dict[str, Any], proven: dict[str, Any], sources: dict[str, bytes]) -> list[str]:
    """All proved statements, as lines, also those of an ellipsoid.json among the sources; Refused if that fails."""
    more = reached(proof, proven, sources[SETS]) if SETS in sources else []
    return [*words(proof, proven, bool(more)), *more]


def reached(proof: dict[str, Any], proven: dict[str, Any], text: bytes) -> list[str]:
    """The error bounds that ellipsoid.json proves, as lines; enclosure.Refused if they are not shown."""
    claim, found = theorem.ellipsoid_claim(proof, proven, text)
    most, least, number = enclosure.most, enclosure.least, ellipsoid.number
    plain = partial(without_kinds, twice=ambiguous(proof, proven))
    errors = [lag(e, plain) for e in proof["errors"]]
    at = " (accelerations at the measured positions)" * bool(claim.get(ellipsoid.FORCES))
    fast = [f", |{plain(u)}| is always above {most(number(x))}" for u, x in claim.get(ellipsoid.ABOVE, {}).items()]
    lines = [f"{ASSUMED}{disturbed(claim, plain, at)}, and that no slip reverses{''.join(fast)}, except where said:"]

    def each(of: list[str], shown: Callable[[Fraction], str] = least) -> str:
        return ", ".join(f"|{e}| <= {shown(number(x))}" for e, x in zip(errors, of, strict=True))

    within = [f"|{plain(x)}| <= {least(number(d))}" for x, d in claim.get(ellipsoid.FRICTION, {}).items()]
    whatever = f", for any friction, through stick and reversals, whose mean over each sample has {', '.join(within)}"
    of_machine = {e["estimate"]: e["truth"] for e in proof["errors"]}

    def true(slip: str) -> str:
        return plain(re.sub(rounding.NAME, lambda name: of_machine.get(name[0], name[0]), slip))

    slips = slip_rows(proof, proven)
    for ball, bounds in zip(claim["sets"], found, strict=True):
        known, any_ = iter(bounds), whatever * (ellipsoid.FRICTION in ball)
        for *c, _ in ball["rows"]:
            lines.append(f"  {combined(c, errors, proven)} {LONG_RUN} {(bound := most(next(known)))}{any_}")
            for slip in slips.get(tuple(map(number, c)), []):
                lines.append(f"  so {plain(slip)} has the sign of {true(slip)} where |{true(slip)}| is above {bound}")
        for after in ball.get("after", []):
            later = ", ".join(f"{most(next(known))} from sample {n} on" for n, _ in after["bounds"])
            error = combined(after["row"], errors, proven)
            lines.append(f"  {error} is at most {later}, counted from any sample with {each(after['start'])}")
    for turn in claim.get(ellipsoid.REVERSALS, []):
        s, change = turn["sign"], least(number(turn["change"]))
        truth = next(e["truth"] for e in proof["errors"] if e["sign"] == s)
        slip, times = proof["signs"][s], "once" if turn["turns"] == "1" else f"{turn['turns']} times"
        size = least(number(claim[ellipsoid.FRICTION][truth]))
        lines.append(
            f"  a reversal of {plain(s)} leaves at most {each(turn['after'], most)}, {turn['samples']} samples after a"
            f" sample with {each(turn['before'])}, if in between: {plain(s)}, then the sign of {plain(slip)} in the"
            f" code alone, changes at most {times}; {true(slip)} has any sign and moves by at most {change} in a sample"
            f" (by its share of that in a part of a sample); and friction is {plain(truth)},"
            f" 0 <= {plain(truth)} <= {size},"
            f" with the sign of {true(slip)} at any moment, or less where {true(slip)} is 0"
        )
    return lines


def slip_rows(proof: dict[str, Any], proven: dict[str, Any]) -> dict[tuple[Fraction, ...], list[str]]:
    """Row c of the errors -> the slips of the signs that are c times the estimates, none of which has a sign itself.

    |c'(truth - estimate)| is then the error of such a slip. If it is at most E, and the true slip faster than E, then
    both have the same sign.
    """
    own = {e["estimate"]: kernel.term(1, e["estimate"]) for e in proof["errors"]}
    text, found = kernel.Text(proven["names"] | own, {}), dict[tuple[Fraction, ...], list[str]]()
    for slip in dict.fromkeys(proof["signs"].values()):
        p = text.value(slip)
        row = tuple(Fraction(p.get((e["estimate"],), 0)) for e in proof["errors"])
        of = [e["estimate"] for e in proof["errors"] if not e["sign"]]
        if p and all(len(m) == 1 and m[0] in of for m in p):
            found.setdefault(row, []).append(slip)
    return found


def combined(row: list[str], errors: list[str], proven: dict[str, Any]) -> str:
    """|A sum of errors|, and its unit."""
    entries = zip(map(ellipsoid.number, row), errors, proven["units"], strict=True)
    used = [entry for entry in entries if entry[0]]
    factors = {Fraction(1): "", Fraction(-1): "-"}
    terms = [of if x == 1 else f"{factors.get(x, f'{enclosure.exact(x)}*')}({of})" for x, of, _ in used]
    parts = " + ".join(terms).replace("+ -", "- ")
    return f"|{parts}|{f' [{used[0][2]}]' if len({unit for *_, unit in used}) == 1 else ''}"


def disturbed(claim: dict[str, Any], plain: Callable[[str], str], at: str = "") -> str:
    """The assumed bounds of noise and drift of an accepted claim of ellipsoid.json."""
    least, number = enclosure.least, ellipsoid.number
    noise = [f"{plain(x)} is measured to within {least(number(d))}" for x, d in claim["noise"].items()]
    drift = [f"{least(number(d))} in {plain(x)}" for x, d in claim["drift"].items()]
    moving = f"that in each sample the motion deviates from that of the machine above{at} by at most {', '.join(drift)}"
    exact = f"that all else is exact{'' if drift else f' and moves as the machine above{at}'}"
    return ", ".join([*([f"that {', '.join(noise)} (in SI)"] if noise else []), *([moving] if drift else []), exact])


def uncompared(lines: list[str], sources: dict[str, bytes]) -> list[str]:
    """What is not checked of ellipsoid.json: the sizes of noise and drift, or all of it if no line uses it."""
    used = any(line.startswith(ASSUMED) for line in lines)
    return [SIZES] * used + [UNREAD] * (SETS in sources and not used)


def words(proof: dict[str, Any], proven: dict[str, Any], sized: bool = False, fall: bool = True) -> list[str]:
    """The proved statements, as lines.

    Args:
        sized: whether bounds under noise and drift follow these lines.
        fall: whether to state the decay of the proof's V; else the error dynamics alone.
    """
    exact, c, plain = enclosure.exact, f"{proof['name']}.c", partial(without_kinds, twice=ambiguous(proof, proven))
    h, free = exact(proven["c"].values["parameters.sample_time"]), constants(proof, plain)
    turns = ", ".join(plain(s) for s in proof["signs"])
    errors = [f"{lag(e, plain)} [{unit}]" for e, unit in zip(proof["errors"], proven["units"], strict=True)]
    left_over = [
        f"in addition, {lag(e, plain)} changes by {plain(r)} in each step, whatever the errors; what this does to V is"
        " not bounded"
        for e, r in zip(proof["errors"], proof.get("rest", []), strict=False)
        if r != "0"
    ]
    left_out = ", ".join(plain(z) for z in proven["aside"] if z not in proof.get("shared", {}))
    besides = f" except {left_out}, for which nothing is claimed" if left_out else ""
    if proof.get("shared"):
        besides += f" except {', '.join(map(plain, proof['shared']))}, which the machine has too"
    first = ", to first order in them" if proven["first order"] else ""
    stays = f", while {turns} {'does' if len(proof['signs']) == 1 else 'do'} not change" if turns else ""
    values = ", ".join(f"{plain(p)} = {exact(x)}" for p, x in proven["c"].values.items())
    guarded = proven["c"].sums is not None

    def becomes(x: str) -> str:
        return f"{plain(x)} {'becomes' if x in proof['states'] else 'is'}"

    where = {f"{becomes(x)} 0": of for x, of in proven.get("other than 0", {}).items()}
    where |= {plain(text): of for text, of in proven.get("held", {}).items()}
    formulas, used = proven.get("formulas", {}) | proven.get("counted", {}), "in each sample with fault 0"
    return [
        *motion(proof, plain, h),
        *conditions(proof, proven, plain),
        f"errors: {', '.join(errors)}; they account for every state of {c}{besides}",
        f"one step of {c} ({h} s) multiplies the vector of errors by the matrix of {PROOF}{first}: for every state, all"
        f" inputs and every {free}{stays}",
        *left_over,
        *(f"in each sample {plain(x)} = {plain(enclosure.as_sum(p))}" for x, p in proven.get("outputs", {}).items()),
        *(f"{used} {text} except where {' and '.join(map(plain, of))}" for text, of in where.items()),
        *(f"{used} {becomes(x)} {plain(of)}" for x, of in formulas.items()),
        *(
            f"in the first sample with fault 0, and in the first after others, {plain(z)} is {enclosure.exact(number)}"
            for z, number in proven.get("restarts", {}).items()
        ),
        *(falling(proof, proven, plain) if fall else ()),
        f"with the values of {proof['name']}.h: {values}",
        *(() if proof["domain"] else (HELD if guarded else BARE,)),
        *((of_faults(proven["c"]),) if guarded else ()),
        f"in exact arithmetic; not covered: {', '.join(gaps(proof, proven, plain, sized))}",
    ]


def constants(proof: dict[str, Any], plain: Callable[[str], str]) -> str:
    """The true quantities that the machine holds constant, such as friction levels."""
    return ", ".join(plain(x) for x in sorted({e["truth"] for e in proof["errors"]} - {*proof["acceleration"]}))


def motion(proof: dict[str, Any], plain: Callable[[str], str], h: str) -> list[str]:
    """The equations of the machine and what it does in a sample of h seconds, as lines."""
    pushed = [
        f"{left(row, proof, plain)} = {plain(f)}" for row, f in zip(proof["mass_matrix"], proof["force"], strict=True)
    ]
    pushed += [f"{plain(x)}' = {plain(v)}" for x, v in proof["positions"].items()]
    places = [*map(plain, proof["positions"])]
    at_start = [*map(plain, proof["acceleration"])] + places * (proof["step"] == "euler")
    slopes = ", ".join(f"{x}'" for x in at_start)
    return [
        f"machine: {'; '.join(pushed)}; {constants(proof, plain)} constant, with any value",
        f"in a sample the change of {', '.join(at_start)} is {h} s times {slopes} at its start",
        *(
            f"in a sample the change of {x} is {h} s times {x}' at its end"
            for x in places
            if proof["step"] == "semi_implicit"
        ),
        *(
            f"in a sample {plain(x)} moves by {h} s times ({plain(v)} + ({plain(q)})*{h} s*{plain(v)}')"
            for x, v in proof["positions"].items()
            if (q := proof.get("mean", {}).get(x))  # in the order of the positions, whatever that of `mean`
        ),
    ]


def conditions(proof: dict[str, Any], proven: dict[str, Any], plain: Callable[[str], str]) -> list[str]:
    """The conditions under which the proof holds, as lines."""
    exact, begun = enclosure.exact, dict(proven["c"].init)
    along = {t: f"{plain(s)}*" for t, s in proven["along"].items() if s}
    return [
        *(f"{plain(s)} is 1 or -1, the sign of {plain(u)} in machine and code" for s, u in proof["signs"].items()),
        *(f"only where {plain(x)} > 0" for x in proof["domain"]),
        *(
            f"only where the machine's {plain(z)} is that of the code: at its start {plain(begun[z])}, in a sample it"
            f" becomes {plain(of)}"
            for z, of in proof.get("shared", {}).items()
        ),
        *(
            f"only where {along.get(x, '')}{plain(x)} is in [{exact(low)}, {exact(high)}]"
            for x, (low, high) in proven["box"].items()
        ),
        *(
            f"only where the state {z} is {plain(proof['states'][z])}"
            for z in proof["states"]
            if z not in proven["moving"]
        ),
    ]


def gaps(proof: dict[str, Any], proven: dict[str, Any], plain: Callable[[str], str], sized: bool) -> list[str]:
    """What the proof does not cover; ``sized`` as in ``words``."""
    c, estimates = proven["c"], {e["estimate"] for e in proof["errors"]}
    of_floats = " (of single precision)" * (c.precision != frame.PRECISIONS["double"])
    faults = "inputs that are no numbers" if c.sums is None else "samples with a fault"
    others = ", ".join(plain(x) for x in c.outputs if x not in proven.get("outputs", {}) and x not in estimates)
    beyond = SIZED if sized else WITHIN
    return [f"rounding{of_floats}", faults, beyond, *([f"other outputs ({others})"] * bool(others))]


def of_faults(c: Any) -> str:
    """Which samples the code does not use, as frame.py reads and proves it."""
    size, magnitudes = f"{float(c.precision.limit):g}", "' magnitudes" * ("fabs(" in c.sums[0])
    limit = f"[-{size}, {size}]"
    return (
        "a sample is used, with fault 0, if the sum of the next states (`check` in the C, with any further terms) is in"
        f" {limit}, even if a next state is not and cancels in the sum; after {c.most} or more invalid samples in a"
        " row, and before a first valid one (that of init counts), no sample is used; of those that are not used, with"
        f" fault 1, a sample is invalid if the sum of its inputs{magnitudes} is not in {limit} either, and a valid one"
        " sets the states"
    )


def falling(proof: dict[str, Any], proven: dict[str, Any], plain: Callable[[str], str]) -> list[str]:
    """The proved decay of V, and its growth at each reversal, as lines."""
    known, alone = proven["numbers"], ", without that addition," * any(r != "0" for r in proof.get("rest", []))
    factor = enclosure.most(proven["fall"])
    first = ", to first order in the errors," * proven["first order"]
    limits = f"{first}{alone}".replace(",,", ",")
    rate = f"(decay rate {enclosure.least(known['rate'])} 1/s)"
    return [f"{STEP}{limits} by at most {factor} {rate}"] + [
        f"when {plain(sign)} alone changes, V grows by at most the factor {enclosure.most(growth)}; {dwell} samples"
        f" later, if no sign has changed again, V is{limits} not above its value before; besides, the step in which"
        f" {plain(proof['signs'][sign])} passes 0 may move the estimates, which this factor does not include"
        for sign, (growth, dwell) in known["turns"].items()
    ]


def ambiguous(proof: dict[str, Any], proven: dict[str, Any]) -> set[str]:
    """Names that two quantities share, such as a parameter and a true level; they are printed with their kinds.

    So is a quantity with a name that these words use of their own (OWN). All fields of the C count, printed or not.
    Of a contact with the name of a quantity, sign(NAME) could be the sign of either: sign.NAME is the contact's then.
    """
    begun, c = [of for z, of in proven["c"].init if z in proof.get("shared", {})], proven["c"]  # `begun` is printed too
    fields = (x.split("[")[0] for x in (*c.values, *c.states, *c.inputs, *c.outputs))
    full = {*re.findall(rf"\b{KINDS}\.\w+", json.dumps([proof, begun])), *fields}
    bare = Counter((*(x.split(".")[1] for x in full), *OWN))
    return {x for x, count in bare.items() if count > 1} | {s for s in proof["signs"] if s.split(".")[1] in bare}


def without_kinds(expression: str, twice: set[str]) -> str:
    """Names without their kinds, where that leaves no doubt; the sign of a contact's slip as sign(contact)."""
    text = re.sub(r"\bsign\.(\w+)", lambda found: found[0] if found[0] in twice else f"sign({found[1]})", expression)
    return re.sub(rf"\b{KINDS}\.(\w+)", lambda found: found[0] if found[1] in twice else found[1], text)


def left(row: list[str], proof: dict[str, Any], plain: Callable[[str], str]) -> str:
    """A row of mass matrix times acceleration, in words."""
    rates = [f"{plain(v)}'" for v in proof["acceleration"]]
    return " + ".join(f"({plain(m)}) {v}" for m, v in zip(row, rates, strict=True) if m != "0")


def lag(entry: dict[str, str], plain: Callable[[str], str]) -> str:
    """An error in words: sign*(truth - estimate)."""
    difference = f"{plain(entry['truth'])} - {plain(entry['estimate'])}"
    return f"{plain(entry['sign'])}*({difference})" if entry["sign"] else difference
