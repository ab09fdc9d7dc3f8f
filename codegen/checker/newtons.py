"""Check a bound on the friction error (docs/certificate.md) with Python alone: python3 newtons.py BOUND [--spec SPEC].

With e the error, Phi = I + hA of the certificate, n the position noise, and what the first order leaves out,

    e'[k+1] = Phi e'[k] + N n[k] - D dx[k] + (dv[k], dF[k]) + B a[k],    e[k] = e'[k] - D n[k]:

dx = x[k+1] - x[k] - h v[k], dv = v[k+1] - v[k] - h a[k], dF the change of friction, a the acceleration. D is `direct`,
B is `acceleration`, G is `by_position`, and with K = (h, 0) - B the rest follows: where the estimates are right, they
move in a sample by K a, so that Phi = I + K (slopes of a in velocity and friction) - h D in columns of velocity, and
N = (I - Phi) D - K G. All is affine, so the bound is the sum of the absolute responses to the largest disturbances.
"""

import hashlib
import json
import runpy
import sys
from collections import namedtuple
from fractions import Fraction
from operator import mul
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import binding, files, responses, verify
else:
    verify = SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("verify.py"))))
    binding, files = verify.binding, verify.files
    responses = verify.beside("responses", verify=verify)
times, solved, identity = responses.times, responses.solved, responses.identity
demand, show, Refused, Matrix = verify.demand, verify.show, verify.Refused, responses.Matrix
FORMAT = "stiction-bound/1"
VALUES = "values, but of the levels shown: a constant added to a velocity, outputs that are not named here"
UNITS = "units: those of the bounds with the code's"
SCHEMA = json.loads("""{"format": "BOUND", "tool": {"name": "TEXT", "version": "TEXT", "command": "TEXT"},
    "subject": {"name": "LINE"}, "certificate": {"file": "FILE", "sha256": "HASH"}, "claim": "LINE",
    "assumptions": ["LINE"], "envelope": {"NAME": ["RATIONAL"]},
    "coordinates": [{"position": "NAME", "velocity": "NAME"}],
    "contacts": [{"name": "LINE", "slip": ["RATIONAL"], "slope": "RATIONAL", "level": "RATIONAL"}],
    "direct": [["RATIONAL"]], "by_position": [["RATIONAL"]], "acceleration": [["RATIONAL"]], "slip_speed": "RATIONAL",
    "bounds": [{"error": "LINE", "unit": "TEXT", "steady": "RATIONAL",
        "after": [{"samples": "WHOLE", "bound": "RATIONAL"}]}]}""")
# Columns of Phi, D, B, G, N, K and of the slopes of the acceleration in the errors: matrices over the rationals.
Model = namedtuple("Model", "h step direct acceleration by_position noise kick slopes")


def modelled(top: dict[str, Any], cert: dict[str, Any]) -> Model:
    """What is stated, with what follows from it, if all of it fits the certificate's matrix."""
    m, n, h = len(cert["error"]), len(top["coordinates"]), cert["sample_time"]
    way = cert["observer"]["integration"]
    demand(0 < n < m, "there is no friction error, or no velocity's")
    demand(way in ("euler", "semi_implicit") and not cert["slow"] and not cert["along"], "a certificate with no bound")
    demand(not cert["variables"] and not cert["parameters"], "the certificate's matrix is not one")
    A = [[verify.parse(entry, (), "matrix", True)[1]({})[0] for entry in row] for row in cert["matrix"]]
    step = [[Fraction(i == j) + h * a for j, a in enumerate(row)] for i, row in enumerate(A)]
    D, B, G = (top[name] for name in ("direct", "acceleration", "by_position"))
    for name, rows, size in (("direct", D, m), ("acceleration", B, m), ("by_position", G, n)):
        demand([len(row) for row in rows] == [n] * size, f"{name} is not {size} by {n}")
    # What a model's acceleration does in a step is said by the step's name: v + h a, or with the decay at its end.
    late = h * h if way == "semi_implicit" else 0
    demand(B[:n] == [[late * d for d in row] for row in D[:n]], f"acceleration is not that of the step {way}")
    kick = [[h * (i == j) - b for j, b in enumerate(row)] for i, row in enumerate(B)]
    # K times the slopes of the acceleration
    rest = [[x - (i == j) + (h * D[i][j] if j < n else 0) for j, x in enumerate(row)] for i, row in enumerate(step)]
    slopes = solved(kick[:n], rest[:n], "acceleration")
    demand(times(kick, slopes) == rest, "`matrix` does not keep an error of zero at zero with this `direct`")
    away, back = times(step, D), times(kick, G)
    noise = [[D[i][j] - away[i][j] - back[i][j] for j in range(n)] for i in range(m)]
    return Model(h, step, D, B, G, noise, kick, slopes)


def largest(top: dict[str, Any], name: str) -> Fraction:
    """What |name| is at most by the envelope as stated."""
    ends: list[Fraction] = top["envelope"].get(name, [])
    demand(len(ends) == 2 and ends[0] <= ends[1], f"envelope: no range [low, high] of {name}")
    return max(map(abs, ends))


def over(row: list[Fraction], sizes: list[Fraction]) -> Fraction:
    """The largest |row x| for |x| <= sizes."""
    return sum((abs(a) * s for a, s in zip(row, sizes, strict=True)), Fraction(0))


def of_errors(top: dict[str, Any], cert: dict[str, Any], at_contacts: list[Fraction]) -> list[Fraction]:
    """Sizes at the contacts -> those of each friction error: at its contact, or of all contacts on its coordinate."""
    n, names = len(top["coordinates"]), [f"e_a_{c['name']}" for c in top["contacts"]]
    errors = [entry["name"] for entry in cert["error"][n:]]
    if errors == names:
        return at_contacts
    demand(errors == [f"e_F_{c['position']}" for c in top["coordinates"]], "the friction errors are of no known kind")
    return [over([c["slip"][j] for c in top["contacts"]], at_contacts) for j in range(n)]


def disturbances(top: dict[str, Any], cert: dict[str, Any], model: Model) -> tuple[Any, list[str]]:
    """[(column, size)] of all disturbances, and the facts of where their sizes are from."""
    h, n, m = model.h, len(top["coordinates"]), len(model.step)
    x, v = ([c[key] for c in top["coordinates"]] for key in ("position", "velocity"))
    demand([f"e_{name}" for name in v] == [e["name"] for e in cert["error"][:n]], "coordinates: not the certificate's")
    demand(all(len(c["slip"]) == n for c in top["contacts"]), f"contacts: a slip is not of {n} velocities")
    demand(all(min(c["slope"], c["level"]) >= 0 for c in top["contacts"]), "contacts: a slope or level below 0")
    noise, rise = ([largest(top, f"{name}{end}") for name in names] for names, end in ((x, "_noise"), (v, "_dot")))
    speed = [largest(top, name) if any(map(any, model.by_position)) else Fraction(0) for name in v]
    rate = of_errors(top, cert, [c["slope"] * over(c["slip"], rise) for c in top["contacts"]])
    jerk = [
        over(place, speed) + over(row[:n], rise) + over(row[n:], rate)
        for place, row in zip(model.by_position, model.slopes, strict=True)
    ]
    unit = identity(m)
    parts = {
        "noise": (model.noise, noise, "NAME_noise of `envelope`"),
        "displacement in a sample": (model.direct, [h * h * a / 2 for a in rise], "h^2/2 NAME_dot"),
        "velocity in a sample": (
            [row[:n] for row in unit],
            [h * h * j / 2 for j in jerk],
            "h^2/2 what NAME, NAME_dot and `slope` do to it",
        ),
        "friction in a sample": ([row[n:] for row in unit], [h * r for r in rate], "h `slope` `slip` NAME_dot"),
        "acceleration": (model.acceleration, rise, "NAME_dot"),
    }
    return [
        (list(column), size)
        for block, sizes, _ in parts.values()
        for column, size in zip(zip(*block, strict=True), sizes, strict=True)
        if size and any(column)
    ], [
        f"{cause} at most {', '.join(map(show, sizes if len({*sizes}) > 1 else sizes[:1]))}: {origin}"
        for cause, (block, sizes, origin) in parts.items()
        if any(map(any, block))
    ]


def bounded(
    top: dict[str, Any], cert: dict[str, Any], model: Model, columns: Any, guard: Fraction, tied: bool
) -> list[str]:
    """The facts that no stated bound is below what the disturbances can do; in units where ``tied``, to the code's."""
    n, found = len(top["coordinates"]), responses.Responses(cert, model.step)
    noise = [largest(top, f"{c['position']}_noise") for c in top["coordinates"]]
    summed, longest = found.summed([[x * size for x in column] for column, size in columns])
    most = [over(row, noise) + s for row, s in zip(model.direct, summed, strict=True)]
    powers = found.powers({after["samples"] for b in top["bounds"] for after in b["after"]})
    slip = max((over(c["slip"], most[:n]) for c in top["contacts"]), default=Fraction(0)) + guard
    demand(top["slip_speed"] >= slip, f"slip_speed: {show(top['slip_speed'])}, less than {show(slip)}")
    jump = of_errors(top, cert, [2 * c["level"] for c in top["contacts"]])
    together = cert["error"][n]["name"].startswith("e_F_")  # a contact may then act on several of the errors
    facts = [f"truth and estimate slip with one sign above {show(slip)}, stated is {show(top['slip_speed'])}"]
    demand([b["error"] for b in top["bounds"]] == [e["name"] for e in cert["error"][n:]], "bounds: not of every error")
    for i, stated in enumerate(top["bounds"], n):
        name, unit, given = f"|{stated['error']}|", stated["unit"], stated["steady"]
        demand(unit == cert["error"][i]["unit"], f"{name}: the unit is {cert['error'][i]['unit']}")
        unit = f" {unit}" if tied and binding.PLAIN_UNIT.fullmatch(unit) else ""
        demand(given >= most[i], f"{name} may be {show(most[i])} in the long run, stated is {show(given)}")
        start = [b + (jump[j - n] if j == i or (together and j >= n) else 0) for j, b in enumerate(most)]
        for after in stated["after"]:
            k, later = after["samples"], after["bound"]
            left = most[i] + over([column[i] for column in powers[k]], start)
            demand(later >= left, f"{name} may be {show(left)} after {k} samples, stated is {show(later)}")
        falls = ", ".join(f"{show(a['bound'])} after {a['samples']}" for a in stated["after"])
        facts.append(f"{name} is at most {show(most[i])}{unit} by {longest} samples and P, stated is {show(given)}")
        facts += [f"  from a start of {show(start[i])} at most {falls} samples, as stated"] if falls else []
    return facts


def shown(raw: Any, records: Any) -> Fraction:
    """An expression of the certificate over places of the code."""
    return binding.value(raw, lambda text: binding.read(text, records)[0])


def bound_to(
    top: dict[str, Any], cert: dict[str, Any], model: Model, twin: Any
) -> tuple[list[str], list[str], Fraction]:
    """What the twin shows of all this, what it does not, and the slip speed below which a guard learns nothing."""
    code, n = cert["code"], len(top["coordinates"])
    slips = [(c, raw) for c, raw in zip(top["contacts"], code["errors"][n:], strict=False) if isinstance(raw, list)]
    if any(raw[1] != ["/", raw[1][1], ["abs", raw[1][1]]] for _, raw in slips):
        raise binding.Unlike("an error is not a friction level times the sign of its slip")
    pairs, turned = [], {(repr(raw), sign) for _, raw in slips for sign in (-1, 1)}
    for before, after in binding.alike({**cert, "bound": repr(sorted(top.items()))}, twin, nudge=True):
        pairs.append((before, after))
        turned -= {(repr(raw), shown(raw[1], before)) for _, raw in slips}
        if len(pairs) >= binding.ALIKE and not turned:  # every slip was seen in both directions
            break
    if turned:
        raise binding.Unknown("the twin was not seen at slips of both directions")
    where = {velocity: position for position, velocity in code["motion"].items()}
    if not {str(raw) for raw in code["errors"][:n]} <= where.keys():
        raise binding.Unknown("it does not say where the twin shows a position")
    places = [where[raw] for raw in code["errors"][:n]]
    for place, c in zip(places, top["coordinates"], strict=True):
        _, field, at = binding.place(place)
        if (field if at is None else f"{field}{at + 1}") != c["position"]:
            raise binding.Unlike(f"{place} is not {c['position']}")
    rest = []  # the acceleration by the inputs alone, which are the same at all points
    for before, after in pairs:
        (old, moved), (new, answer) = (
            zip(*(binding.estimate(raw, at) for raw in code["errors"]), strict=True) for at in (before, after)
        )
        way = [[binding.read(place, before)[1]] for place in places]
        if times(model.direct, way) != [[x] for x in moved] or times(model.noise, way) != [[-x] for x in answer]:
            raise binding.Unlike("`direct`, or `by_position`, is not how the twin answers to a measured position")
        change = [[b - a] for a, b in zip(old, new, strict=True)]
        pushed = solved(model.kick[:n], change[:n], "acceleration")
        if times(model.kick, pushed) != change:
            raise binding.Unlike("`acceleration`: the twin's friction moves otherwise where nothing is wrong")
        by_state = times(model.slopes, [[x] for x in old])
        by_place = times(model.by_position, [[binding.read(place, before)[0]] for place in places])
        rest.append([p - a - g for (p,), (a,), (g,) in zip(pushed, by_state, by_place, strict=True)])
        for c, raw in slips:
            if shown(raw[1][1], before) != sum(map(mul, c["slip"], old), Fraction(0)):
                raise binding.Unlike(f"the twin's slip at {c['name']} is another")
    if slips and any(alone != rest[0] for alone in rest):
        raise binding.Unlike("the level shown is not the one with which the twin turns its acceleration")
    left = [VALUES] if slips else [verify.VALUES, "`slip` of the contacts with the spec's"]
    parameters, plain = twin.record("Parameters"), "at points drawn at random"
    facts = [f"the twin answers so to every measured position, and keeps its friction estimates, {plain}"]
    facts += (
        [f"its acceleration takes every level in the value that is shown, for either sign, {plain}"] if slips else []
    )
    forces = {raw[2].replace(".a_hat_", ".F_hat_"): raw for _, raw in slips}
    same = [
        name
        for name, raw in forces.items()
        if all(binding.read(name, at)[0] == binding.estimate(raw, at)[0] for at, _ in pairs)
    ]
    facts += [f"{', '.join(same)}: the level times the sign of its slip, {plain}"] if same else []
    left += [f"{name}, which is not just the level times the sign of its slip" for name in forces if name not in same]
    return facts, left, parameters.get("slip_speed", (Fraction(0),))[0]


def proved(top: dict[str, Any], sources: dict[str, bytes]) -> tuple[list[str], list[str], bool]:
    """The facts, what is not compared, and whether the code is; the certificate in ``sources`` is taken to hold."""
    file, expected = top["certificate"]["file"], top["certificate"]["sha256"]
    content = sources.get(file, b"")
    found = hashlib.sha256(content).hexdigest()
    demand(found == expected, f"{file} has the SHA-256 {found}, not {expected}")
    cert = verify.parsed(content.decode())
    demand(top["subject"]["name"] == cert["subject"]["name"], "the certificate is about another machine")
    model = modelled(top, cert)
    columns, facts = disturbances(top, cert, model)
    code = sources.get(verify.TWIN, b"") if verify.TWIN in cert["subject"]["files"] else b""
    more: list[str] = []
    left, guard, tied = ["the laws of friction: `slope` and `level` with the spec's"], Fraction(0), False
    ranges = {"variables": top["envelope"], "code": {"variables": {}, "motion": {}}, "slow": [], "along": []}
    try:
        unranged = binding.envelope(ranges, twin := binding.Twin(code.decode()))
        left += unranged
        more, unshown, guard = bound_to(top, cert, model, twin)
        left, tied = left + unshown, all("_noise with" in gap for gap in unranged)  # noise may be none
    except binding.Unlike as why:
        raise Refused(str(why)) from None
    except binding.Unknown as why:
        left += [verify.VALUES, UNITS, f"that disturbances enter the code so: {why}"]
    except (ArithmeticError, AttributeError, LookupError, SyntaxError, TypeError, ValueError) as why:
        raise Refused(f"code, or the twin, cannot be read: {str(why)[:80]!r}") from None
    found_bounds = bounded(top, cert, model, columns, guard, tied)
    return [f"{file} has the SHA-256 stated", *facts, *found_bounds, *more], left, tied


def parsed(text: str) -> dict[str, Any]:
    """The bound, if it is written as its format demands."""
    try:
        return verify.parsed(text, SCHEMA, "bound")
    except RecursionError:
        raise Refused("nested too deeply") from None


def check(
    text: str, folder: Path | None = None, spec: Path | None = None, sources: dict[str, bytes] | None = None
) -> verify.Report:
    """Verify a bound with the certificate that it rests on; what is no bound, as ``verify.check``.

    Raises Refused; json.JSONDecodeError; OSError if a file to be compared cannot be read.
    """
    if f'"{FORMAT}"' not in text:
        return verify.check(text, folder, spec, sources)
    top = parsed(text)
    names = [top["certificate"]["file"], verify.TWIN]
    largest = {names[0]: verify.MAX_TEXT, verify.TWIN: files.MAX_FILE}
    here = {name: files.read(folder / name, largest[name]) for name in names if folder and (folder / name).exists()}
    here = here if sources is None else sources
    demand(names[0] in here, f"{names[0]}, on which the bound rests, is not here")
    try:
        report = verify.check(here[names[0]].decode(), folder, spec, sources)
    except (Refused, ValueError) as why:
        raise Refused(f"{names[0]}: {why}") from None
    facts, left, tied = proved(top, here)
    gaps = [gap for gap in report.open if gap != verify.VALUES]  # of values there is more, or the same, in ``left``
    gaps = [verify.ALWAYS[0] if gap == verify.BY_KERNEL else gap for gap in gaps]  # the kernel knows no disturbance
    more = {"facts": (*report.facts, *facts), "open": (*gaps, *left), "assumptions": top["assumptions"]}
    more["bound"] = report.bound and tied
    return report._replace(claim=top["claim"], **more)


def main(argv: list[str] | None = None) -> int:
    status: int = verify.main(argv, check)
    return status


if __name__ == "__main__":
    sys.exit(main())
