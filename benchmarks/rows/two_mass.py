"""Two masses, GCFO behind the velocity observer: against C by hand and CasADi."""

from __future__ import annotations

from benchmarks.measure.compare import Candidate, compare
from benchmarks.model import Model, load
from benchmarks.peers.casadi_c import casadi_peer
from benchmarks.peers.plain_c import hand_peer, our_peer
from benchmarks.result import OURS, Goal, Row, figure, ratio

HAND, HAND_HOLD = "by hand", "by hand, with fault hold"
PLAIN = "stiction, `--fault none`"
CASADI, CASADI_CSE, CASADI_BAKED = "CasADi", "CasADi, `cse`", "CasADi, `cse`, parameters as numbers"


def candidates(model: Model) -> list[Candidate]:
    return [
        (OURS, lambda: our_peer(model)),
        (PLAIN, lambda: our_peer(model, PLAIN, "none")),
        (HAND_HOLD, lambda: hand_peer("hand_two_mass", HAND_HOLD, 3, 8, HOLD="1")),
        (HAND, lambda: hand_peer("hand_two_mass", HAND, 3, 8)),
        (CASADI, lambda: casadi_peer(model, CASADI)),
        (CASADI_CSE, lambda: casadi_peer(model, CASADI_CSE, cse=True)),
        (CASADI_BAKED, lambda: casadi_peer(model, CASADI_BAKED, baked=True, cse=True)),
    ]


def row() -> Row:
    model = load("two_mass")
    entries = compare(candidates(model), model.rows())
    return Row(
        "two_mass",
        "Two masses, GCFO with velocity observer, one step",
        tuple(entries),
        (
            Goal("at most 1.1 × C by hand with the same check", ratio(entries, HAND_HOLD), 1.1),
            Goal("at most 0.6 × CasADi", ratio(entries, CASADI, CASADI_CSE), 0.6),
        ),
        facts={"unchecked": figure(ratio(entries, CASADI, CASADI_CSE, ours=PLAIN))},
    )
