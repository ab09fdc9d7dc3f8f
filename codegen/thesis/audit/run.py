"""The audit of the thesis: each claim is compared with our own derivation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

from codegen.base.errors import refuse_unknown
from codegen.thesis.audit.claim import Claim, read_claims
from codegen.thesis.audit.conditions import judge_conditions, judge_inequality
from codegen.thesis.audit.equality import judge_equality, prove_form
from codegen.thesis.audit.finding import Finding
from codegen.thesis.audit.world import World
from codegen.thesis.audit.worlds import WORLDS


def run_audit(claims: Sequence[Claim] | None = None, progress: Callable[[float], None] | None = None) -> list[Finding]:
    """Judge all shipped claims, or the given ones."""
    chosen = read_claims() if claims is None else claims
    findings = []
    for done, claim in enumerate(chosen, start=1):
        findings.append(judge(claim))
        if progress is not None:
            progress(done / len(chosen))
    return findings


def judge(claim: Claim) -> Finding:
    """The verdict on one claim, from computation.

    Raises:
        BadInput: for a derivation that does not exist, or a printed formula with unknown names.
    """
    if claim.test == "definition":
        return Finding(claim, "holds")
    name, _, quantity = claim.entry.against.partition(".")
    refuse_unknown(name, WORLDS, claim.place, "no derivation", ", ".join(WORLDS), code="CALL001")
    world = _world(name)
    if claim.test in ("inequality", "implies"):
        return judge_inequality(claim, world)
    refuse_unknown(quantity, world.derived, claim.place, f"`{name}` derives no", code="CALL001")
    derived = world.derived[quantity]
    if claim.test == "equal":
        return judge_equality(claim, world, derived)
    return judge_conditions(claim, world, derived)


@cache
def _world(name: str) -> World:
    world = WORLDS[name]()
    for derived in world.derived.values():
        if derived.form:
            prove_form(derived, world)
    return world
