"""Whether a certificate claims what the proof.json beside it proves: the same errors, matrix and ranges.

Standard library only; part of the checker (verify.py). The certificate is given as ``verify.parsed`` reads it.
"""

from fractions import Fraction
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import decay, enclosure, files, frame, kernel, rounding, statements, theorem


@frame.limited()
def unlike(top: dict[str, Any], proof: dict[str, Any]) -> str:
    """Which fields of proof.json and certificate disagree, as words; "" if machine, step and errors agree.

    The matrix and the units are compared elsewhere (``same_matrix``, ``of_its_proof``).

    Args:
        top: the certificate, as verify.parsed returns it.
    """
    signs = [e["sign"] for e in proof["errors"]]
    same = {
        "the machine": top["subject"]["name"] == proof["name"],
        "the step": top["observer"]["integration"] == proof["step"],
        "the names of the errors": [e["name"] for e in top["error"]]
        == [f"e_{quantity(e['estimate'])}" for e in proof["errors"]],
        "what turns at a reversal": all(
            sorted(e["flips"]) == [i for i, s in enumerate(signs) if s == f"sign.{e['contact']}"]
            for e in top["reversals"]
        ),
    }
    return ", ".join(what for what, alike in same.items() if not alike)


def quantity(place: str) -> str:
    """The spec's name of what an output estimates: outputs.v_hat[2] -> v3, outputs.a_hat_rail -> a_rail."""
    field, _, at = place.removeprefix("outputs.").rstrip("]").partition("[")
    kinds = {"a_hat_": "a_", "f_hat_": "f_", "tracked_": "F_"}
    name = next((kinds[x] + field.removeprefix(x) for x in kinds if field.startswith(x)), field.removesuffix("_hat"))
    return f"{name}{int(at) + 1}" if at else name


def claims_fall(top: dict[str, Any], proof: dict[str, Any], proven: dict[str, Any]) -> bool:
    """Whether what a proof says of V, and of its reversals, is what the certificate does."""
    known = proven["numbers"]
    turns = {f"sign.{e['contact']}": (e["growth"], e["dwell_samples"]) for e in top["reversals"]}
    same = not top["along"] and top["lyapunov_matrix"] == known["P"] and top["decay_rate"] == known["rate"]
    return same and turns == known["turns"] and len(turns) == len(proof["reversals"])


@frame.limited()
def same_matrix(top: dict[str, Any], proof: dict[str, Any], proven: dict[str, Any]) -> bool:
    """Whether the certificate's I + hA, over all signs and its ranges, is the matrix that the kernel has accepted."""
    signs = {f"s_{s.removeprefix('sign.')}": s for s in proof["signs"]}
    within = theorem.ranges(proof, proven)
    free = {x.split(".")[1]: x for x in (*proof["positions"], *within)}
    if signs.keys() & free.keys():  # of a quantity that is called as a sign the range would be taken for a sign's
        return False
    names = {name: proven["names"][x] for name, x in (signs | free).items()}
    if not {*proof["box"]} <= {free.get(name) for name in top["variables"]}:  # of these the certificate asks nothing
        return False
    # A magnitude of a quantity with a sign of its own is that sign times it, in the machine too.
    true = kernel.Text(proven["names"] | {e["estimate"]: proven["names"][e["truth"]] for e in proof["errors"]}, {})
    own = {("sgn", true.value(of)): proven["names"][s] for s, of in proof["signs"].items()}
    text = kernel.Text(proven["names"], own | proven["known"])
    try:
        for name, ends in top["variables"].items():
            low, high = within.get(free.get(name, ""), [Fraction(e) for e in (ends[0], ends[-1])])
            turns = name not in signs or ({-1, 1} >= {*ends} if top["along"] else {-1, 1} <= {*ends})
            if name not in names or not turns or not low <= ends[0] <= ends[-1] <= high:
                return False
        if top["along"] and not met_by(top, proof, proven, signs | free):
            return False
        rows = decay.step(top, names, decay.polynomials(text.known, enclosed=True))
        # A V of its own falls in the certificate's ranges, and those printed are the proof's: they are the same, or
        # the variable occurs only in sines and cosines, for which a cover takes every angle.
        used = kernel.cleared(kernel.joined([*rows, [kernel.term(1)]]), text.known).names()
        for name, ends in top["variables"].items():
            x = free.get(name, "")  # what is in a range times a sign is with the other sign in the range turned round
            same = within.get(x) == [ends[0], ends[-1]] and (not proven["along"].get(x) or ends[0] == -ends[-1])
            all_round = top["cover"] and free.get(name) not in (*proof["box"], *used)
            if not (top["along"] or claims_fall(top, proof, proven) or name in signs or same or all_round):
                return False
        off = [[a - b for a, b in zip(*pair, strict=True)] for pair in zip(rows, proven["matrix"], strict=True)]
        return not kernel.cleared(kernel.joined(off), text.known)
    except (ArithmeticError, ValueError):  # one of them has more than polynomials and quotients, or divides by 0
        return False


def met_by(top: dict[str, Any], proof: dict[str, Any], proven: dict[str, Any], places: dict[str, str]) -> bool:
    """Whether some state of the machine has the signs, and satisfies the `domain`, of a refutation's operating point.

    Quantities that the point does not fix can have any value; so can a slip with one of them that is in no other slip.

    Args:
        places: variable of the certificate -> sign, position or truth of the proof.
    """
    at = {x: kernel.term(1, x) for x in (*proven["c"].inputs, *proven["aside"], *(e["truth"] for e in proof["errors"]))}
    at |= {x: p for x, p in proven["names"].items() if x == "" or x.startswith("parameters.")}
    at |= {s: kernel.term(1, s) for s in proof["signs"]}
    at |= {places[name]: kernel.term(ends[0]) for name, ends in top["variables"].items()}
    text = rounding.at_point(at | {e["estimate"]: at[e["truth"]] for e in proof["errors"]}, proven)
    stated = [s for s in proof["signs"] if not at[s].names()]
    slips = [at[s] * text.settled(proof["signs"][s]) for s in stated]
    constants = [p.constant() for p in map(text.settled, proof["domain"]) if not p.names()]
    if min(constants, default=1) <= 0 or any(p.constant() < 0 for p in slips if not p.names()):
        return False
    left = [p for p in slips if p.names()]

    def has_own_variable(p: Any) -> bool:
        """Whether a variable is a term of p and occurs in no other term of those left: it gives p any value."""
        return any((x,) in p and sum(x in m for q in left for m in q) == 1 for x in p.names())

    while left:
        free = next(filter(has_own_variable, left), None)
        if free is None:
            return False
        left.remove(free)
    return True


def bound(top: dict[str, Any], sources: dict[str, bytes]) -> tuple[list[str], str, bool]:
    """What the kernel proves of the C beside a certificate.

    Returns:
        The proved statements, as lines; the reason why there are none, or ""; whether they hold without conditions.
        They say that the errors of the C move by the certificate's matrix. What the proof says of V is included if its
        V, rate and reversals are those of the certificate.

    Raises enclosure.Refused as ``of_its_proof``.
    """
    proof, proven, why = of_its_proof(top, sources)
    if why:
        return [], why, False
    if not claims_fall(top, proof, proven):
        return statements.words(proof, proven, False, fall=False), "", proven["whole"]
    return statements.proved_statements(proof, proven, sources), "", proven["whole"]


def of_its_proof(top: dict[str, Any], sources: dict[str, bytes]) -> tuple[dict[str, Any], dict[str, Any], str]:
    """The proof.json of a certificate, what theorem.proved returned for it, and ""; or two empty ones and the reason.

    Raises enclosure.Refused if it is about the certificate's errors, and the kernel does not accept it.
    """
    if theorem.PROOF not in sources:
        return {}, {}, f"no {theorem.PROOF} is beside it"
    if {f"{top['subject']['name']}.{end}" for end in "ch"} - sources.keys():
        return {}, {}, "its C or its header is not here, or not among its files"
    not_its = f"{theorem.PROOF} is not its proof:"
    try:
        with theorem.or_refused(f"{not_its} it cannot be read"):
            proof = theorem.read(sources[theorem.PROOF])
            other = unlike(top, proof) if proof and theorem.numbers(proof) else ""
    except enclosure.Refused as why:  # the algebra of the certificate is valid without the proof
        return {}, {}, str(why)
    if proof is None:
        return {}, {}, f"{theorem.PROOF} is not the JSON of a proof, with just its fields"
    if other:
        return {}, {}, f"{not_its} {other}"
    files.conform(proof, theorem.FORM, theorem.PROOF)
    if any(rest != "0" for rest in proof.get("rest", [])):  # no matter whether the kernel accepts it
        return {}, {}, f"{not_its} its errors have terms besides those of the matrix (`rest`)"
    proven = theorem.proved(proof, sources, [f"sign.{e['contact']}" for e in top["reversals"]])
    alike = proven["c"].values["parameters.sample_time"] == top["sample_time"]
    enclosure.demand(alike, f"the sample time of {proof['name']}.h is another")
    if not same_matrix(top, proof, proven):
        return {}, {}, f"{not_its} the matrix, or the signs and ranges for which it holds"
    enclosure.demand([e["unit"] for e in top["error"]] == proven["units"], f"the units of {proof['name']}.h are others")
    return proof, proven, ""
