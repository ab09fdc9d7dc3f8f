"""Cortex-M4F, single precision: bytes and instructions a step on qemu, by the image of the tests."""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.measure.build import difference
from benchmarks.model import Model, load
from benchmarks.peers.casadi_c import INTEGER, NAME, casadi_source, first_state, step_of, work_sizes
from benchmarks.result import OURS, Goal, Row, Table, figure
from benchmarks.text import render
from tests.compiled.cortex_m.image import FLAGS, Figures, build, emulate, figures, missing_tools
from tests.compiled.interface import Interface, read_interface
from tests.compiled.toolchain import ARM_M4F, Workshop, run

SAMPLES = 64
TOLERANCE = 1e-3
CASADI, CASADI_FLOAT = "CasADi, `casadi_real=float`", "CasADi, the same, `sinf` for `sin` by hand"
"""CasADi's C of floats calls libm's functions of doubles."""
KINDS = (
    ("loads", ("vldr", "vldm", "ldr", "vpop", "pop")),
    ("stores", ("vstr", "vstm", "str", "vpush", "push")),
    ("arithmetic", ("vadd", "vsub", "vmul", "vnmul", "vmla", "vmls", "vnml", "vneg", "vabs", "vdiv")),
)
"""Kind → how its instructions begin; the others are moves, comparisons and branches."""
SPECS = (("two_mass", 350, 90), ("seven_joint_arm", 10_000, 2_200))
HEAD = ("machine", "code", "level", "bytes", "libm bytes", "instructions, mean", "most", "difference", "note")


@dataclass(frozen=True)
class Case:
    """One piece of code at one level of optimisation.

    Attributes:
        off: the largest relative difference of its outputs from ours.
    """

    machine: str
    code: str
    level: str
    figures: Figures | None = None
    off: float | None = None
    note: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        found = self.figures
        numbers: tuple[str, ...] = ("–",) * 4
        if found is not None:
            counts = (found.step_bytes, found.library_bytes, found.mean_instructions, found.instructions)
            numbers = tuple(figure(float(count), 0) for count in counts)
        off = "–" if self.off is None else f"{self.off:.0e}"
        return self.machine, self.code, f"`{self.level}`", *numbers, off, self.note


def casadi_files(model: Model, header: str, row: np.ndarray, single_calls: bool) -> dict[str, str]:
    """Our header, and CasADi's step behind it; ``single_calls``: with sinf and cosf in place of sin and cos."""
    function = step_of(model, "ldl").function(cse=True)
    text = render(
        "casadi_as_observer.c.j2",
        name=model.name,
        step=NAME,
        real="float",
        integer=INTEGER,
        single_calls=single_calls,
        source=casadi_source(function, "float"),
        first=first_state(model, row.tolist(), 0.0),
        sizes=work_sizes(function),
    )
    return {f"{model.name}.h": header, f"{model.name}.c": text}


def cases(workshop: Workshop, name: str) -> list[Case]:
    """Ours and CasADi's, at -O2 and -Os."""
    model = load(name)
    rows = model.rows(SAMPLES, shift=0.0).astype(np.float32)
    ours = model.files("single")
    header = ours[f"{name}.h"]
    face = read_interface(name, header)
    reference = emulate(build(workshop, ours, face, rows, len(rows)), face)
    found = []
    for level in ("-O2", "-Os"):
        own = figures(workshop, ours, face, rows, (level,))
        found.append(Case(name, OURS, level, own, 0.0))
        for code in (CASADI, CASADI_FLOAT) if own.calls_libm else (CASADI,):
            theirs = casadi_files(model, header, rows[0], code == CASADI_FLOAT)
            found.append(casadi_case(workshop, Case(name, code, level), theirs, face, rows, reference))
    return found


def casadi_case(
    workshop: Workshop, case: Case, files: Mapping[str, str], face: Interface, rows: np.ndarray, reference: np.ndarray
) -> Case:
    """CasADi's code: its outputs compared with ours, and its instructions counted."""
    outputs = [k for k in range(reference.shape[1]) if k not in face.flags]
    image = build(workshop, files, face, rows, len(rows), (case.level,))
    off = difference(reference[:, outputs], emulate(image, face)[:, outputs])
    if off > TOLERANCE:
        return replace(case, off=off, note="computes something else")
    counted = figures(workshop, files, face, rows, (case.level,), step=NAME, caller=f"{face.name}_step")
    return replace(case, figures=counted, off=off)


def kinds_of(workshop: Workshop, name: str) -> dict[str, str]:
    """The number of instructions of each kind in the object file of our step at -O2."""
    unit = workshop.object(load(name).files("single"), f"{name}.c", ARM_M4F, *FLAGS, "-O2")
    listing = run("arm-none-eabi-objdump", "-d", "--no-show-raw-insn", f"--disassemble={name}_step", unit).stdout
    words = [line.split()[1] for line in listing.splitlines() if re.match(r"\s+[0-9a-f]+:\t[a-z]", line)]
    counts = Counter(next((kind for kind, heads in KINDS if word.startswith(heads)), "others") for word in words)
    return {"machine": name, **{kind: str(counts[kind]) for kind in (*(kind for kind, _ in KINDS), "others")}}


def unused_bytes(found: list[Case], name: str) -> str:
    """Bytes of our step at -O2 that are executed for invalid samples only."""
    own = next(c.figures for c in found if (c.machine, c.code, c.level) == (name, OURS, "-O2"))
    return "–" if own is None else str(own.unused_bytes)


def goals(found: list[Case]) -> list[Goal]:
    """Bytes and instructions of ours at -O2, which the Makefile fragment asks for."""
    made = []
    for name, most_bytes, most in SPECS:
        own = next((c.figures for c in found if (c.machine, c.code, c.level) == (name, OURS, "-O2")), None)
        size, steps = (None, None) if own is None else (float(own.step_bytes), float(own.instructions))
        made.append(Goal(f"{name}: at most {most_bytes} bytes", size, most_bytes, unit=" B", basis="code", digits=0))
        made.append(Goal(f"{name}: at most {most} instructions", steps, most, unit="", basis="the most", digits=0))
    return made


def row() -> Row:
    missing = missing_tools()
    found: list[Case] = []
    spent: list[dict[str, str]] = []
    if not missing:
        with tempfile.TemporaryDirectory(prefix="stiction-benchmark-") as folder:
            workshop = Workshop(Path(folder))
            found = [case for name, _, _ in SPECS for case in cases(workshop, name)]
            spent = [kinds_of(workshop, name) | {"unused": unused_bytes(found, name)} for name, _, _ in SPECS]
    return Row(
        "cortex_m",
        "Cortex-M4F, single precision: bytes and instructions a step",
        goals=tuple(goals(found)),
        tables=(Table(HEAD, tuple(case.cells for case in found)),),
        facts={"missing": missing, "spent": spent},
    )
