"""Spec → files of the arm of seven joints: against CasADi and SymForce, each in a fresh process; nothing compiled."""

from __future__ import annotations

import statistics
from collections.abc import Callable

from benchmarks.measure.build import Missing
from benchmarks.measure.limited import limited
from benchmarks.model import load
from benchmarks.peers.casadi_c import casadi_source, step_of
from benchmarks.peers.symforce_cpp import symforce_header
from benchmarks.result import OURS, Goal, Row, Table, figure
from codegen.app.derived import Derived
from codegen.base.resources import resource_folder
from codegen.spec import read_spec

SPEC = "seven_joint_arm"
LIMIT = 90.0
REPEAT = 3
SOURCES, ALL = f"{OURS}, C and Python", f"{OURS}, all files with the attempt at a certificate"


def everything() -> int:
    """All that ``stiction generate`` writes: C, Python, README, and the attempt at a certificate."""
    files = Derived(read_spec(resource_folder("specs") / f"{SPEC}.yaml")).files
    return sum(len(text) for text in files.values())


def sources() -> int:
    """Generate C and Python only."""
    return sum(len(text) for text in load(SPEC).files().values())


def casadi() -> int:
    """Generate CasADi's C from the same observer."""
    return len(casadi_source(step_of(load(SPEC), "ldl").function(cse=True)))


def symforce() -> int:
    """Generate SymForce's C++ from the same observer."""
    return len(symforce_header(step_of(load(SPEC), "ldl")))


def shared() -> int:
    """The work that both peers share with us: read the spec, and build the observer with its M and h."""
    return len(load(SPEC).program.outputs)


WORK: tuple[tuple[str, Callable[[], int]], ...] = (
    (SOURCES, sources),
    (ALL, everything),
    ("CasADi, `cse`", casadi),
    ("SymForce", symforce),
    ("in each of these: spec read, observer and program built", shared),
)


def row() -> Row:
    lines: list[tuple[str, ...]] = []
    seconds: dict[str, float] = {}
    for title, work in WORK:
        try:
            runs = [limited(work, LIMIT) for _ in range(REPEAT)]
        except Missing as missing:
            lines.append((title, "–", "–", "–", str(missing)))
            continue
        spent = [s for _, s in runs]
        seconds[title] = statistics.median(spent)
        size = "–" if work is shared else figure(runs[0][0] / 1000, 0)
        lines.append((title, figure(seconds[title]), figure(min(spent)), size, ""))
    return Row(
        "generation_time",
        "Spec → files, our own arm of seven joints",
        goals=(
            Goal("C and Python in under 1 s", seconds.get(SOURCES), 1.0, unit=" s", basis="seconds"),
            Goal("with the attempt at a certificate, in under 1 s", seconds.get(ALL), 1.0, unit=" s", basis="seconds"),
        ),
        tables=(Table(("what", "median, s", "least, s", "kB", "note"), tuple(lines)),),
    )
