"""Chains of 4 to 1024 masses: against CasADi and a loop by hand; files, compilation and step."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from benchmarks.chain import K_F, K_V, LEVEL, chain_casadi, chain_rows, chain_spec
from benchmarks.compare import Candidate, compare
from benchmarks.limited import limited
from benchmarks.model import load
from benchmarks.peer import Missing, Peer, build
from benchmarks.plain_c import hand_peer, our_peer
from benchmarks.result import OURS, Goal, Row, Table, ratio

SIZES = (4, 16, 64, 256, 1024)
HAND, CASADI = "loop by hand", "CasADi, `cse`"
GENERATE_LIMIT, COMPILE_LIMIT = 40.0, 40.0
HEAD = ("masses", "spec → files, s", "compile, s", "instructions", "a mass", "÷ loop by hand", "÷ CasADi", "ns", "note")


def candidates(n: int, ours: Peer | Missing) -> list[Candidate]:
    def made() -> Peer:
        if isinstance(ours, Missing):
            raise ours
        return ours

    def by_hand() -> Peer:
        levels, gains, velocity = (", ".join([repr(v)] * n) for v in (LEVEL, K_F, K_V))
        numbers = {"N": str(n), "LEVELS": levels, "LEVEL_GAINS": gains, "VELOCITY_GAINS": velocity}
        return hand_peer("hand_chain", HAND, n + 1, 4 * n, **numbers)

    def casadi() -> Peer:
        return limited(chain_casadi, GENERATE_LIMIT, n, CASADI, COMPILE_LIMIT)[0]

    return [(HAND, by_hand), (OURS, made), (CASADI, casadi)]


def our_chain(n: int, folder: Path) -> Peer:
    """Our C of a chain, from its spec."""
    return our_peer(load(chain_spec(n, folder)), limit=COMPILE_LIMIT)


def measure(n: int, samples: int) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The entries of one size by name, and its line of the table."""
    ours: Peer | Missing
    generating = compiling = None
    with tempfile.TemporaryDirectory() as name:
        try:
            ours, generating = limited(our_chain, GENERATE_LIMIT, n, Path(name))
            compiling = build(ours, Path(name)).seconds
        except Missing as missing:
            ours = Missing(f"spec → files: {missing}" if generating is None else str(missing))
    entries = compare(candidates(n, ours), chain_rows(n, samples))
    found = {e.name: e for e in entries}
    own = found[OURS]
    notes = [f"{e.name}: {e.note}" for e in entries if e.note]
    cells = (
        str(n),
        _figure(generating, 2),
        _figure(compiling, 2),
        _figure(own.instructions, 0),
        _figure(own.instructions / n if own.instructions else None, 1),
        _figure(ratio(entries, HAND), 2),
        _figure(ratio(entries, CASADI), 2),
        _figure(own.times.median if own.times else None, 1),
        "; ".join(notes),
    )
    return {**found, "compile": compiling, "hand": ratio(entries, HAND)}, cells


def row() -> Row:
    sizes = [measure(n, 256 if n <= 64 else 32) for n in SIZES]
    complete = all(found["compile"] is not None for found, _ in sizes)
    worst = max((f["hand"] for f, _ in sizes if f["hand"]), default=None)
    slowest = max((f["compile"] for f, _ in sizes if f["compile"] is not None), default=None)
    loops = [f[HAND].instructions / n for n, (f, _) in zip(SIZES, sizes, strict=True) if f[HAND].instructions]
    missing = "" if complete else " (of the sizes that ended)"
    notes = [f"The loop by hand takes {min(loops):.0f} to {max(loops):.0f} instructions a mass."] if loops else []
    if not complete:
        notes.append("A size that did not end in its time misses the goal: `stiction` is not linear at any n.")
    return Row(
        "Chains of masses, GCFO with velocity observer, one step",
        "Springs between neighbours, friction of every mass to the ground. By hand: loops over arrays. CasADi: the same "
        f"step with vectors. Each part has a limit of {GENERATE_LIMIT:.0f} s.",
        goals=(
            Goal(f"at most 1.5 × the loop by hand{missing}", worst, 1.5),
            Goal(f"compiles in under 1 s at any n{missing}", slowest if complete else float("inf"), 1.0, unit="s", basis="seconds"),
        ),
        tables=(Table(HEAD, tuple(cells for _, cells in sizes)),),
        notes=tuple(notes),
    )


def _figure(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
