"""Whether the C begins at rest, and goes on after invalid samples with the estimates that it held.

Standard library only; part of the checker (verify.py), which hands ``kernel`` in. The kernel's theorem is about samples
with fault 0; here are the values that the functions of fault 1 (modes.py reads their form) give the states that show
errors. Let G be the proof's `states`: by the kernel's lemma 11 the states G(e, x) show the estimates e beside the
measured positions x, and there are no two such e. Then, as identities of polynomials:

- after `init` at x the states are G(e, x) with velocities of zero and all other estimates constant;
- `predict` makes G(e, x + h v) of G(e, x), v the velocities held: with the machine going on at these, the next sample
  shows what it would have shown without the invalid one;
- after `resume` at x they are G(e, x + h v), e the estimates held, which the next sample then shows.
"""

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import kernel


def require(proof: dict[str, Any], shown: dict[str, Any], begun: str, predicted: str, resumed: str) -> None:
    """Raises ValueError where these bodies of init, predict and resume give the states other values.

    Args:
        shown: of the proof, by kernel.prove.
    """
    names, known, estimates = shown["names"], shown["known"], {e["truth"]: e["estimate"] for e in proof["errors"]}
    divisors = len(kernel.Poly.divisors)
    errors, velocities = {f"error of {t}" for t in estimates}, proof["positions"].items()
    own = {z: kernel.term(1, f"{z} before") for z in proof["states"]}
    own |= {x: p for x, p in names.items() if x.startswith(("parameters.", "inputs.", "state."))}

    def G(at: dict[str, Any]) -> dict[str, Any]:
        text = kernel.Text(names | at, known)
        return {z: text.value(of) for z, of in proof["states"].items()}

    def after(body: str, at: dict[str, Any]) -> dict[str, Any]:
        code = kernel.Text(own | at, known, f"{proof['name']}_sign")
        code.run(re.sub(r"\(void\)\w+; ?", "", body), {x for x in own if x.startswith("state.")})
        return code.names

    def moved(by: dict[str, Any]) -> dict[str, Any]:
        return {x: names[x] + names["parameters.sample_time"] * by[estimates.get(v, v)] for x, v in velocities}

    now = G({})
    showing = [z for z, p in now.items() if errors & p.names()]
    levels = [f"level of {t}" for t in estimates if t not in proof["acceleration"]]
    rest = dict.fromkeys(estimates.values(), kernel.Poly())
    rest |= {y: kernel.term(1, f"level of {t}") for t, y in estimates.items() if t not in proof["acceleration"]}
    first, there = after(begun, {}), G(rest)
    used: list[str] = []
    for z in showing:  # one level alone, which no other state shows, or none
        of = [x for x in levels if x in there[z].names()]
        off = first[z] - there[z] + sum((kernel.term(1, x) for x in of), kernel.Poly())
        alone = (not of and not off) or (len(of) == 1 and of[0] not in used)
        kernel.demand(alone and not off.names(), f"init: {z} shows more than a constant")
        used += of
    held = names | {y: kernel.term(1, f"held {y}") for y in estimates.values()}
    for what, found, wanted in (
        ("predict", after(predicted, {y: held[y] for y in estimates.values()} | now), G(moved(held))),
        ("resume", after(resumed, {y: names[y] for y in estimates.values()}), G(moved(names))),
    ):
        wrong = [z for z in showing if found[z] != wanted[z]]
        kernel.demand(not wrong, f"{what}: {wrong[:3]} do not go on with what was held")
    kernel.demand(len(kernel.Poly.divisors) == divisors, "a division by what may be zero")
