"""A bare-metal image of one observer for qemu's mps2-an386, run and counted."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..driver import driver_files
from ..interface import Interface
from ..toolchain import ARM_M4F, NO_CONTRACTION, Workshop, run

HERE = Path(__file__).parent
QEMU = (
    *("qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-serial", "none", "-monitor", "none"),
    *("-chardev", "stdio,id=out", "-semihosting-config", "enable=on,target=native,chardev=out"),
)
TOOLS = ("arm-none-eabi-gcc", "arm-none-eabi-nm", "qemu-system-arm")
FLAGS = ("-std=c99", NO_CONTRACTION, "-ffunction-sections")
LIMIT = 300.0
_TRACE = re.compile(r"^Trace \d+: 0x[0-9a-f]+ \[[0-9a-f]+/([0-9a-f]+)/", re.MULTILINE)


@dataclass(frozen=True)
class Figures:
    """What a step costs on a Cortex-M4F.

    Attributes:
        step_bytes: of the step and what it calls in its own file, with the constants in the code.
        unused_bytes: of these, what only a sample that is not used comes to.
        library_bytes: of what the linker adds from the C library for it.
        instructions: executed from the step's first to its return, libm included, the most over the rows.
        mean_instructions: over the rows.
        calls_libm: whether libm is part of these counts.
    """

    step_bytes: int
    unused_bytes: int
    library_bytes: int
    instructions: int
    mean_instructions: float
    calls_libm: bool


def missing_tools() -> list[str]:
    """What of the toolchain is not here; ``make toolchains`` installs it."""
    return [tool for tool in TOOLS if shutil.which(tool) is None]


def build(
    workshop: Workshop,
    files: Mapping[str, str],
    face: Interface,
    rows: np.ndarray,
    episode: int,
    flags: tuple[str, ...] = ("-O2",),
    *,
    quiet: bool = False,
    own_trigonometry: bool = False,
) -> Path:
    """The image: startup, the observer and its rows.

    Args:
        rows: inputs, a row a step, in the observer's precision.
        episode: rows between two inits.
        flags: for the observer.
        quiet: print nothing.
        own_trigonometry: take sinf and cosf from trigonometry.c.
    """
    beside = driver_files(files, face, *HERE.glob("*.[ch]")) | {"rows.h": rows_header(rows, episode)}
    units = ["startup.c", "main.c"] + ["trigonometry.c"] * own_trigonometry
    loud = ("-DQUIET",) if quiet else ()
    objects = [workshop.object(beside, unit, ARM_M4F, *FLAGS, "-Os", *loud) for unit in units]
    objects.append(workshop.object(files, f"{face.name}.c", ARM_M4F, *FLAGS, *flags))
    script = ("-T", HERE / "mps2_an386.ld", "-nostartfiles", "-Wl,--gc-sections")
    return workshop.link(f"{face.name}.elf", ARM_M4F, *script, *objects, "-lm", "-lc", "-lgcc", "-lnosys")


def emulate(image: Path, face: Interface) -> np.ndarray:
    """Run an image; its outputs, a row a step.

    Raises:
        RuntimeError: if it does not end as it should.
    """
    done = _qemu(image)
    width = 8 if face.real == "double" else 4
    words = [[int(word, 16) for word in line.split()] for line in done.splitlines()]
    return np.array(words, dtype=f"u{width}").view(f"f{width}")


def figures(
    workshop: Workshop,
    files: Mapping[str, str],
    face: Interface,
    rows: np.ndarray,
    flags: tuple[str, ...] = ("-O2",),
    *,
    step: str = "",
    caller: str = "main",
) -> Figures:
    """Size of the step and the instructions that it executes, counted one by one in qemu's trace over ``rows``.

    Args:
        step, caller: the function to measure and who calls it, where NAME_step only leads to it.
    """
    step = step or f"{face.name}_step"
    image = build(workshop, files, face, rows, len(rows), flags, quiet=True)
    sizes = symbol_sizes(image)
    counts = list(count_calls(image, step, caller))
    if len(counts) != len(rows):
        raise RuntimeError(f"{len(counts)} steps in the trace of {len(rows)}")
    observer = workshop.object(files, f"{face.name}.c", ARM_M4F, *FLAGS, *flags)
    own = symbol_sizes(observer)
    harness = {"main", "reset", "fault", "vectors", "rows", "memcpy", "memset"}
    others = {name: size for name, size in sizes.items() if name not in harness and name not in own}
    setup = {f"{face.name}_init", f"{face.name}_prepare", caller}
    step_bytes = sum(size for name, size in own.items() if name in sizes and name not in setup)
    unused = sizes.get(f"{face.name}_handle_fault", 0)
    return Figures(step_bytes, unused, sum(others.values()), max(counts), float(np.mean(counts)), bool(others))


def count_calls(image: Path, function: str, caller: str) -> Iterator[int]:
    """For each call of a function, the instructions from its first to the return into the caller, callees included."""
    places = _places(image)
    (first, _), (begin, size) = places[function], places[caller]
    log = image.with_suffix(".trace")
    _qemu(image, "-singlestep", "-d", "exec,nochain", "-D", str(log))
    inside = 0
    with log.open(encoding="ascii", errors="replace") as lines:
        for line in lines:
            match = _TRACE.match(line)
            if match is None:
                continue
            at = int(match[1], 16)
            if inside and begin <= at < begin + size:
                yield inside
                inside = 0
            elif inside or at == first:
                inside += 1
    log.unlink()


def symbol_sizes(object_file: Path) -> dict[str, int]:
    """Function or constant → bytes."""
    return {name: size for name, (_, size) in _places(object_file).items()}


def rows_header(rows: np.ndarray, episode: int) -> str:
    """rows.h: the inputs as bit patterns."""
    bits = np.ascontiguousarray(rows).view(f"u{rows.itemsize}")
    lines = [f"    {{{', '.join(f'0x{word:x}u' for word in row)}}}," for row in bits.tolist()]
    head = f"#include <stdint.h>\n\n#define SAMPLES {len(rows)}\n#define EPISODE {episode}\n"
    kind = f"typedef uint{8 * rows.itemsize}_t row_bits;\nstatic const row_bits rows[SAMPLES][INPUTS] = {{\n"
    return head + kind + "\n".join(lines) + "\n};\n"


def _places(file: Path) -> dict[str, tuple[int, int]]:
    """Function or constant → (address, bytes)."""
    done = run("arm-none-eabi-nm", "-S", file)
    rows = [line.split() for line in done.stdout.splitlines()]
    return {r[3]: (int(r[0], 16), int(r[1], 16)) for r in rows if len(r) == 4 and r[2] in "TtRrWw"}


def _qemu(image: Path, *more: str) -> str:
    done = subprocess.run(
        [*QEMU, *more, "-kernel", str(image)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    if done.returncode != 0:
        raise RuntimeError(f"{image.name} ended with {done.returncode}: {done.stdout[-300:]}{done.stderr[-300:]}")
    return done.stdout
