"""The two-link arm: against CasADi and SymForce."""

from __future__ import annotations

from benchmarks.measure.compare import Candidate, compare
from benchmarks.model import Model, load
from benchmarks.peers.casadi_c import casadi_peer
from benchmarks.peers.plain_c import our_peer
from benchmarks.peers.symforce_cpp import symforce_peer
from benchmarks.result import OURS, Goal, Row, ratio, where_it_goes

CASADI = "CasADi, `cse`"
CASADI_LDL = "CasADi, `cse`, LDLᵀ written out"
SYMFORCE = "SymForce"


def candidates(model: Model) -> list[Candidate]:
    return [
        (OURS, lambda: our_peer(model)),
        (CASADI, lambda: casadi_peer(model, CASADI, cse=True)),
        (CASADI_LDL, lambda: casadi_peer(model, CASADI_LDL, "ldl", cse=True)),
        (SYMFORCE, lambda: symforce_peer(model, SYMFORCE)),
    ]


def row() -> Row:
    model = load("two_link_arm", travel=0.05, force=0.002)
    entries = compare(candidates(model), model.rows())
    peers = (CASADI, CASADI_LDL, SYMFORCE)
    best = min(entries[1:], key=lambda e: e.instructions or float("inf"))
    return Row(
        "two_link_arm",
        "Two-link arm, GCFO with velocity observer, one step",
        tuple(entries),
        (Goal("at most 0.7 × the better of CasADi and SymForce", ratio(entries, *peers), 0.7),),
        facts={"ours": where_it_goes(entries[0]), "theirs": where_it_goes(best)},
    )
