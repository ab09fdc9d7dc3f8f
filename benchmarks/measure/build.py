"""A peer: sources of a step with the loop around it, compiled with the driver into one program."""

from __future__ import annotations

import resource
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

DRIVER = Path(__file__).with_name("driver.c")
MACHINE = ("-march=x86-64-v2",)
"""No AVX: what a count is then depends on neither the machine nor valgrind's idea of it."""
C_FLAGS = ("-std=gnu99", "-O2", "-ffp-contract=off", *MACHINE)


class Missing(Exception):
    """A peer that cannot be built or run here, in words for the page."""


class Unbuilt(Missing):
    """The peer is here, and its compiler refuses it or takes too long: a note on the page, and a failure in a test."""


@dataclass(frozen=True)
class Peer:
    """One way to compute the step.

    Attributes:
        name: for the page.
        files: name → text; every .c and .cpp is compiled.
        step: the symbol of the step, whose instructions are counted with all that it calls.
        width, outputs: how many numbers a row of inputs and of outputs has.
        flags, libraries: of the compiler and the linker, in addition to the common ones.
        limit: seconds that the compiler may take.
    """

    name: str
    files: Mapping[str, str]
    step: str
    width: int
    outputs: int
    compiler: str = "gcc"
    flags: tuple[str, ...] = C_FLAGS
    libraries: tuple[str, ...] = ()
    limit: float = 60.0


@dataclass(frozen=True)
class Built:
    """A compiled peer.

    Attributes:
        program: the executable, in a folder of its own.
        seconds: of the processor that the compiler took for the peer's own sources.
    """

    peer: Peer
    program: Path
    seconds: float


def build(peer: Peer, folder: Path) -> Built:
    """Compile a peer in a folder of its own.

    Raises:
        Missing: if there is no compiler.
        Unbuilt: if it refuses, or takes too long.
    """
    if shutil.which(peer.compiler) is None:
        raise Missing(f"no {peer.compiler} here")
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in peer.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    units = [name for name in peer.files if name.endswith((".c", ".cpp"))]
    start = _children()
    for unit in units:
        run_compiler([peer.compiler, *peer.flags, "-c", unit, "-o", f"{unit}.o"], folder, peer.limit)
    seconds = _children() - start
    sizes = [f"-DWIDTH={peer.width}", f"-DOUTPUTS={peer.outputs}"]
    run_compiler(["gcc", *C_FLAGS, *sizes, "-c", str(DRIVER), "-o", "driver.o"], folder, peer.limit)
    objects = [f"{unit}.o" for unit in units]
    run_compiler([peer.compiler, *objects, "driver.o", "-o", "peer", *peer.libraries, "-lm"], folder, peer.limit)
    return Built(peer, folder / "peer", seconds)


def outputs_of(built: Built, rows: Path) -> np.ndarray:
    """The outputs of a peer in one pass over the rows, (samples, outputs)."""
    done = subprocess.run([built.program, "check", rows], capture_output=True, check=True, timeout=300)
    return np.frombuffer(done.stdout).reshape(-1, built.peer.outputs)


def difference(ours: np.ndarray, theirs: np.ndarray) -> float:
    """The largest difference of any output, relative to its largest value; infinite for other shapes or NaN."""
    if ours.shape != theirs.shape or not (np.isfinite(ours).all() and np.isfinite(theirs).all()):
        return float("inf")
    scale = np.abs(ours).max(axis=0)
    return float((np.abs(ours - theirs).max(axis=0) / np.where(scale > 0, scale, 1.0)).max())


def run_compiler(command: list[str], folder: Path, limit: float) -> None:
    """Run a command in a folder. Raises Unbuilt if it refuses or takes more than ``limit`` seconds."""
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        raise Unbuilt(f"the compiler was stopped after {limit:.0f} s") from None
    if done.returncode:
        raise Unbuilt(f"it does not compile here: {' '.join(done.stderr.split())[:200]}")


def _children() -> float:
    """Seconds of the processor that ended programs took."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
