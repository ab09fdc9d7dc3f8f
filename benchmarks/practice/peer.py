"""PySINDy as a peer: which kind of effect its sparse sum on the refit's force residual stands for."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from benchmarks.practice.cases import Case
from benchmarks.practice.runs import code_version
from codegen.base.files import write_atomically
from codegen.diagnosis.evidence.estimate import estimate
from codegen.diagnosis.fit.acceptance import LEAST_SHARE, LEAST_SIZE
from codegen.diagnosis.fit.measure import Drive
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.results import ProposedTerms
from codegen.diagnosis.verdict.proposal import OVER_ANGLE, OVER_POSITION, OVER_VELOCITY, propose_terms
from codegen.effects.declare import system_of
from codegen.logs import read_log
from codegen.mechanics.system import System
from codegen.spec import read_spec

Array = NDArray[np.float64]

CONSTANT = "1"
KIND_OF_POSITION = {
    "{}": ("spring",),
    "{}**3": ("hardening_spring",),
    "sin({})": ("gravity_imbalance",),
    "cos({})": ("gravity_imbalance",),
}
KIND_OF_VELOCITY = {"{}": ("viscous",), "abs({})": ("viscous_asymmetry",), "{}*abs({})": ("quadratic_drag",)}
KIND_OF_CONSTANT = ("offset", "coulomb_asymmetry")
LEVEL = "sgn({})"
"""The term of a coordinate's own velocity that is a friction level, which the refit may move; it is no effect."""
PAIR_SHARE = 0.5
"""A velocity with another one of at least this weight against it, on one coordinate, is a difference: coupling."""


@dataclass(frozen=True)
class Term:
    """A column of PySINDy's library: a pattern over a position or a velocity of coordinate ``of``."""

    pattern: str
    over: str
    of: int


@dataclass(frozen=True)
class Reading:
    """The term of a proposal that counts as its answer.

    Attributes:
        kinds: what it stands for; empty where nothing counts, or it stands for nothing of the catalogue.
        term: with its coordinate; empty where nothing counts.
        size: of its force over the drive force.
    """

    kinds: tuple[str, ...] = ()
    term: str = ""
    size: float = 0.0


@dataclass(frozen=True)
class Proposed:
    """The answers of PySINDy on one log.

    Attributes:
        alone: the term of its sums that alone takes most out of the residual. largest: the largest as it stands there.
        code: version of what made the residual.
    """

    alone: Reading
    largest: Reading
    code: str


def proposed(case: Case, out: Path, again: bool) -> Proposed:
    """PySINDy's answer for a case; what is there already is read, unless ``again``."""
    kept = out / case.tier / f"{case.name}.json"
    if again or not kept.exists():
        refit, train, test = refitted(case)
        sums = propose_terms(refit, train, test, slice(0, len(test.motion.time)))
        found = Proposed(*readings(refit, train, sums), code_version())
        write_atomically(kept, json.dumps(asdict(found), indent=1))
    return TypeAdapter(Proposed).validate_json(kept.read_bytes())


def refitted(case: Case) -> tuple[System, Problem, Problem]:
    """The declared structure refitted as a diagnosis does it, and the motions of both logs."""
    spec = read_spec(case.folder / "spec.yaml")
    system = system_of(spec)
    log, test = (read_log(case.folder / name, spec) for name in ("train.csv", "test.csv"))
    motion = smooth_motion(log)
    own = {spec.symbol(p.name): p.tolerance if p.tolerance is not None else log.tolerance for p in spec.parameters}
    problem = Problem(system, motion, {symbol: share for symbol, share in own.items() if share})
    base = search_on(problem, lambda share: record_of(motion, log, share)).refit()
    refit = with_values(system, {name: value for name, (value, _) in estimate(base).refitted.items()})
    return refit, problem, Problem(system, smooth_motion(test, motion.cutoff_hz), {})


def readings(refit: System, train: Problem, sums: Sequence[ProposedTerms]) -> tuple[Reading, Reading]:
    """The term of all sums that alone takes most out of the residual, and the largest; by the acceleration they make.

    A sum counts where it removes LEAST_SHARE of the squared held-out residual, a term where it is LEAST_SIZE of the
    drive force: the floors of the diagnosis.
    """
    drive, library = Drive(refit, train.motion), _library(refit)
    alone, largest = Reading(), Reading()
    for i, found in enumerate(sums):
        terms = {library[name]: weight for name, weight in found.terms.items()}
        if not found.held_out_share >= LEAST_SHARE:
            continue
        for (term, weight), name in zip(terms.items(), found.terms, strict=True):
            if (term.pattern, term.over, term.of) != (LEVEL, "velocity", i):
                column = _column(train, term)
                kinds, title = kinds_of(term, i, terms), f"{name} on {found.coordinate}"
                alone = _greater(alone, Reading(kinds, title, _size(drive, i, _projection(drive, train, i, column))))
                largest = _greater(largest, Reading(kinds, title, _size(drive, i, weight * column)))
    return alone, largest


def _greater(best: Reading, other: Reading) -> Reading:
    return other if other.size >= max(LEAST_SIZE, best.size) else best


def kinds_of(term: Term, coordinate: int, weights: Mapping[Term, float]) -> tuple[str, ...]:
    """The kinds of the catalogue that a term on a coordinate stands for, given the other terms of its sum."""
    if term.pattern == CONSTANT:
        return KIND_OF_CONSTANT
    if term.over == "velocity" and term.pattern == "{}":
        against = [w for other, w in weights.items() if (other.pattern, other.over) == ("{}", "velocity")]
        own = weights[term]
        if term.of != coordinate or any(w * own < 0 and abs(w) >= PAIR_SHARE * abs(own) for w in against):
            return ("coupling",)
    if term.of != coordinate:
        return ()
    return (KIND_OF_POSITION if term.over == "position" else KIND_OF_VELOCITY).get(term.pattern, ())


def terms_by_kind() -> dict[str, str]:
    """Kind → the terms that stand for it, as the page writes them."""
    found: dict[str, list[str]] = {"coupling": ["v, of the other coordinate too"]}
    for letter, table in (("x", KIND_OF_POSITION), ("v", KIND_OF_VELOCITY)):
        for pattern, kinds in table.items():
            for kind in kinds:
                found.setdefault(kind, []).append(pattern.replace("{}", letter))
    for kind in KIND_OF_CONSTANT:
        found[kind] = [CONSTANT]
    return {kind: ", ".join(terms) for kind, terms in found.items()}


def table(answers: Sequence[tuple[Case, Reading, bool | None]]) -> list[dict[str, Any]]:
    """Rows by kind: how often PySINDy's term stands for it, and how often our diagnosis names it (None if not run)."""
    by_kind: dict[str, list[tuple[bool, bool | None]]] = {}
    for case, answer, ours in answers:
        by_kind.setdefault(_kind(case), []).append((is_right(case, answer), ours))
    words = terms_by_kind()
    return [
        {
            "kind": kind,
            "cases": len(marks),
            "peer": sum(theirs for theirs, _ in marks),
            "ours": None if any(own is None for _, own in marks) else sum(bool(own) for _, own in marks),
            "terms": "no term" if kind == "none" else words.get(kind, "–"),
        }
        for kind, marks in sorted(by_kind.items())
    ]


def totals(answers: Sequence[tuple[Case, Reading, bool | None]], group: str) -> tuple[int, int, int | None]:
    """(logs, PySINDy right, ours right) of one group."""
    own = [(is_right(case, answer), ours) for case, answer, ours in answers if case.group == group]
    ours = None if any(mark is None for _, mark in own) else sum(bool(mark) for _, mark in own)
    return len(own), sum(theirs for theirs, _ in own), ours


def is_right(case: Case, answer: Reading) -> bool:
    """Whether the true kind, or an exact twin, is among those that the term stands for; for none: no term."""
    return bool({*answer.kinds} & case.accepted[0]) if case.truth["effects"] else not answer.term


def _kind(case: Case) -> str:
    return str(case.truth["effects"][0]["kind"]) if case.truth["effects"] else "none"


def _library(system: System) -> dict[str, Term]:
    """The names that ``propose_terms`` gives its columns."""
    named = {CONSTANT: Term(CONSTANT, "", -1)}
    for i, (x, v) in enumerate(zip(system.positions, system.velocities, strict=True)):
        for symbol, over, patterns in ((x, "position", OVER_POSITION | OVER_ANGLE), (v, "velocity", OVER_VELOCITY)):
            named |= {pattern.replace("{}", symbol.name): Term(pattern, over, i) for pattern in patterns}
    return named


def _column(train: Problem, term: Term) -> Array:
    """A term of weight one, (N,), low-passed as the residual is."""
    if term.pattern == CONSTANT:
        return np.ones(len(train.motion.time))
    functions: dict[str, Callable[[Array], Array]] = (
        OVER_VELOCITY if term.over == "velocity" else OVER_POSITION | OVER_ANGLE
    )
    values = train.motion.velocities if term.over == "velocity" else train.motion.positions
    return train.motion.low_pass(functions[term.pattern](values[:, term.of]))


def _projection(drive: Drive, train: Problem, coordinate: int, column: Array) -> Array:
    """The part of a coordinate's residual, (N,), that a column alone explains beyond the friction level."""
    rows = train.used[:, coordinate]
    level = _column(train, Term(LEVEL, "velocity", coordinate))
    column, residual = (_without(level, values, rows) for values in (column, drive.residual[:, coordinate]))
    return residual - _without(column, residual, rows)


def _without(level: Array, values: Array, rows: NDArray[np.bool_]) -> Array:
    power = float(level[rows] @ level[rows])
    return values - level * (float(level[rows] @ values[rows]) / power if power > 0 else 0.0)


def _size(drive: Drive, coordinate: int, force: Array) -> float:
    """The RMS of a force on one coordinate over that of the drive force."""
    forces = np.zeros((len(force), drive.system.degrees_of_freedom))
    forces[:, coordinate] = force
    return drive.share(forces)
