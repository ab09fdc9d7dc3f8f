"""Chains of 4 to 1024 masses: against CasADi and a loop by hand; files, compilation and step."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import casadi
import numpy as np

from benchmarks.measure.build import Missing, Peer, build
from benchmarks.measure.compare import Candidate, compare
from benchmarks.measure.limited import limited
from benchmarks.model import NUDGE, load
from benchmarks.peers.casadi_c import Step, compiled_step
from benchmarks.peers.plain_c import hand_peer, our_peer
from benchmarks.result import OURS, Goal, Row, Table, figure, ratio
from benchmarks.text import render

MASS, SPRING, LEVEL, K_F, K_V, SAMPLE_TIME = 1.0, 100.0, 0.5, 20.0, 20.0, 0.001


def chain_spec(n: int, folder: Path) -> Path:
    """The spec file of a chain."""
    target = folder / f"chain_{n}.yaml"
    words = {"mass": MASS, "spring": SPRING, "level": LEVEL, "K_F": K_F, "K_v": K_V, "sample_time": SAMPLE_TIME}
    target.write_text(render("chain.yaml.j2", n=n, **words), encoding="utf-8")
    return target


def chain_rows(n: int, samples: int) -> np.ndarray:
    """Positions and the one input, samples by n + 1."""
    turn = 2.0 * np.pi * np.arange(samples) / samples
    columns = [0.1 * np.sin((1 + k % 3) * turn + 0.7 + 1.3 * k) for k in range(n)]
    return np.column_stack([*columns, 5.0 * np.sin(turn)])


def chain_casadi(n: int, title: str, limit: float) -> Peer:
    """CasADi's C of the chain's step, written with vectors as its user would."""
    x, w = casadi.SX.sym("x", n), casadi.SX.sym("w")
    z_v, z = casadi.SX.sym("z_v", n), casadi.SX.sym("z", n)
    p = casadi.SX.sym("p", 6)
    mass, spring, level_gain, velocity_gain, h = p[0], p[1], p[3], p[4], p[5]
    v = z_v + velocity_gain * x
    sign = casadi.sign(v)
    level = z - level_gain * casadi.fabs(v)
    friction = level * sign
    stretch = casadi.diff(x) if n > 1 else casadi.SX(0, 1)
    pull = spring * stretch
    force = casadi.vertcat(pull, 0) - casadi.vertcat(0, pull) + casadi.vertcat(w, casadi.SX.zeros(n - 1))
    a = (force - friction) / mass
    following = casadi.vertcat(z_v + h * (a - velocity_gain * v), z + h * level_gain * sign * a)
    outputs = casadi.vertcat(v, level, friction, friction)
    step = Step(casadi.vertcat(z_v, z), casadi.vertcat(x, w), p, following, outputs, False)
    first = np.concatenate([-K_V * chain_rows(n, 2)[0][:n], np.full(n, LEVEL)]) + NUDGE * (1 + np.arange(2 * n))
    values = [MASS, SPRING, LEVEL, K_F, K_V, SAMPLE_TIME]
    return compiled_step(step, title, first.tolist(), values, limit, cse=True)


SIZES = (4, 16, 64, 256, 1024)
HAND, CASADI = "loop by hand", "CasADi, `cse`"
GENERATE_LIMIT, COMPILE_LIMIT = 90.0, 40.0
HEAD = (
    *("masses", "spec → files, s", "compile, s", "instructions", "a mass", "a mass, loop by hand"),
    *("÷ loop by hand", "÷ CasADi", "ns, median", "note"),
)


@dataclass(frozen=True)
class Size:
    """A chain of n masses; None for what did not end in its time.

    Attributes:
        generating, compiling: seconds, of ours.
        hand: ours ÷ the loop by hand, in instructions.
        casadi: ours ÷ CasADi.
    """

    n: int
    generating: float | None
    compiling: float | None
    instructions: float | None
    hand: float | None
    casadi: float | None
    nanoseconds: float | None
    loop: float | None
    note: str

    @property
    def cells(self) -> tuple[str, ...]:
        each = self.instructions / self.n if self.instructions else None
        loop = self.loop / self.n if self.loop else None
        numbers = ((self.generating, 2), (self.compiling, 2), (self.instructions, 0), (each, 1), (loop, 1))
        ratios = ((self.hand, 2), (self.casadi, 2), (self.nanoseconds, 1))
        return str(self.n), *(figure(value, digits) for value, digits in (*numbers, *ratios)), self.note


def candidates(n: int, ours: Peer | Missing) -> list[Candidate]:
    def made() -> Peer:
        if isinstance(ours, Missing):
            raise ours
        return ours

    def by_hand() -> Peer:
        levels, gains, velocity = (",".join([repr(v)] * n) for v in (LEVEL, K_F, K_V))
        macros = {"N": str(n), "LEVELS": levels, "LEVEL_GAINS": gains, "VELOCITY_GAINS": velocity}
        return hand_peer("hand_chain", HAND, n + 1, 4 * n, **macros)

    def casadi() -> Peer:
        return limited(chain_casadi, GENERATE_LIMIT, n, CASADI, COMPILE_LIMIT)[0]

    return [(HAND, by_hand), (OURS, made), (CASADI, casadi)]


def our_chain(n: int, folder: Path) -> Peer:
    """Our C of a chain, from its spec."""
    return our_peer(load(chain_spec(n, folder)), limit=COMPILE_LIMIT)


def measure(n: int, samples: int) -> Size:
    ours: Peer | Missing
    generating = compiling = None
    with tempfile.TemporaryDirectory() as name:
        try:
            ours, generating = limited(our_chain, GENERATE_LIMIT, n, Path(name))
            compiling = build(ours, Path(name)).seconds
        except Missing as missing:
            ours = Missing(f"spec → files: {missing}" if generating is None else str(missing))
    entries = compare(candidates(n, ours), chain_rows(n, samples))
    hand, own, _ = entries
    return Size(
        n,
        generating,
        compiling,
        own.instructions,
        ratio(entries, HAND),
        ratio(entries, CASADI),
        own.times.median if own.times else None,
        hand.instructions,
        "; ".join(f"{e.name}: {e.note}" for e in entries if e.note),
    )


def row() -> Row:
    sizes = [measure(n, 256 if n <= 64 else 32) for n in SIZES]
    missing = [str(s.n) for s in sizes if s.hand is None]
    ratios = [s.hand for s in sizes if s.hand is not None]
    compiled = [s.compiling for s in sizes if s.compiling is not None]
    worst = float("inf") if missing else max(ratios)
    slowest = float("inf") if len(compiled) < len(SIZES) else max(compiled)
    steps = [s.instructions / s.n for s in sizes[1:] if s.instructions]
    growth = float("inf") if missing else max(steps) / min(steps)
    return Row(
        "chain",
        "Chains of masses, GCFO with velocity observer, one step",
        goals=(
            Goal("at most 1.5 × the loop by hand, at every n", worst, 1.5),
            Goal("linear: instructions a mass, largest ÷ smallest from 16 masses on", growth, 1.1),
            Goal("compiles in under 1 s at any n", slowest, 1.0, unit=" s", basis="seconds"),
        ),
        tables=(Table(HEAD, tuple(size.cells for size in sizes)),),
        facts={"limit": f"{GENERATE_LIMIT:.0f}", "missing": missing},
    )
