"""Two masses, GCFO behind the velocity observer: against C by hand and CasADi."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.casadi_peer import casadi_peer
from benchmarks.compare import Candidate, compare
from benchmarks.model import Model, load
from benchmarks.plain_c import hand_peer, our_peer
from benchmarks.result import OURS, Goal, Row, ratio, where_it_goes

HAND, HAND_HOLD = "by hand", "by hand, with fault hold"
PLAIN = "stiction, `--fault none`"
CASADI = ("CasADi", "CasADi, `cse`", "CasADi, `cse`, parameters as numbers")


def candidates(model: Model) -> list[Candidate]:
    def by_hand(title: str, **numbers: str) -> Candidate:
        return title, lambda: hand_peer("hand_two_mass", title, 3, 8, **numbers)

    return [
        (OURS, lambda: our_peer(model)),
        (PLAIN, lambda: replace(our_peer(model, "none"), name=PLAIN)),
        by_hand(HAND_HOLD, HOLD="1"),
        by_hand(HAND),
        (CASADI[0], lambda: casadi_peer(model, CASADI[0])),
        (CASADI[1], lambda: casadi_peer(model, CASADI[1], cse=True)),
        (CASADI[2], lambda: casadi_peer(model, CASADI[2], baked=True, cse=True)),
    ]


def row() -> Row:
    model = load("two_mass")
    entries = compare(candidates(model), model.rows())
    return Row(
        "Two masses, GCFO with velocity observer, one step",
        "By hand: the best C that we could write for this one machine, with and without the same handling of faults. "
        "CasADi: the same equations as one SX function; also with its common subexpressions eliminated, and with the "
        "parameters folded in as numbers.",
        tuple(entries),
        (
            Goal("at most 1.1 × C by hand", ratio(entries, HAND_HOLD), 1.1),
            Goal("at most 0.6 × CasADi", ratio(entries, *CASADI[:2]), 0.6),
        ),
        (where_it_goes(entries[0]), where_it_goes(entries[2])),
    )
