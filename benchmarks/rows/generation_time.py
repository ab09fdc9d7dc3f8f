"""Spec → files of the arm of seven joints: against CasADi and SymForce, each in a fresh process, compilation not counted."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.casadi_peer import casadi_source, step_of
from benchmarks.limited import limited
from benchmarks.model import load
from benchmarks.peer import Missing
from benchmarks.result import OURS, Goal, Row, Table
from benchmarks.symforce_peer import symforce_header
from codegen.generation import generated_files
from codegen.resources import resource_folder
from codegen.spec import read_spec

SPEC = "seven_joint_arm"
LIMIT = 90.0
REPEAT = 3


def everything() -> int:
    """All that ``stiction generate`` writes: C, Python, README, and the attempt at a certificate."""
    files, _ = generated_files(read_spec(resource_folder("specs") / f"{SPEC}.yaml"))
    return sum(len(text) for text in files.values())


def sources() -> int:
    """C and Python alone."""
    return sum(len(text) for text in load(SPEC).files().values())


def casadi() -> int:
    """From the same observer to CasADi's C."""
    return len(casadi_source(step_of(load(SPEC), "ldl").function(cse=True)))


def symforce() -> int:
    """From the same observer to SymForce's C++."""
    return len(symforce_header(step_of(load(SPEC), "ldl")))


def head() -> int:
    """What each of the two peers takes from us: the spec read, and the observer with its M and h."""
    load(SPEC).program  # noqa: B018
    return 0


WORK: tuple[tuple[str, Callable[[], int]], ...] = (
    (f"{OURS}, sources", sources),
    (f"{OURS}, all files with the attempt at a certificate", everything),
    ("CasADi, `cse`", casadi),
    ("SymForce", symforce),
    ("of these, reading the spec and building observer and program", head),
)


def row() -> Row:
    lines, seconds = [], {}
    for title, work in WORK:
        try:
            runs = [limited(work, LIMIT) for _ in range(REPEAT if work is not symforce else 1)]
            seconds[title] = sorted(spent for _, spent in runs)[len(runs) // 2]
            lines.append((title, f"{seconds[title]:.2f}", f"{min(s for _, s in runs):.2f}", f"{runs[0][0] / 1000:.0f}"))
        except Missing as missing:
            lines.append((title, str(missing), "", ""))
    return Row(
        "Spec → files, arm of seven joints",
        "In a fresh process, after its imports. CasADi and SymForce are handed the observer that we derive.",
        goals=(Goal("C and Python in under 1 s", seconds.get(WORK[0][0]), 1.0, unit="s", basis="seconds"),),
        tables=(Table(("what", "median, s", "least, s", "kB"), tuple(lines)),),
    )
