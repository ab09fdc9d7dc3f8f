"""The generated C behind rows of reals: what the C drivers of harness/ need to know, and a loaded library."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .interface import Interface
from .toolchain import GCC, NO_CONTRACTION, STRICT, Compiler, Workshop

HARNESS = Path(__file__).with_name("harness")
HOST_FLAGS = (*STRICT, "-fPIC", NO_CONTRACTION)


def fields_header(face: Interface, header: str) -> str:
    """fields.h: the observer's names under common ones, and its structs as rows; arrays element by element."""
    name = face.name
    initialiser = re.search(r"#define (\w+_PARAMETERS)\b", header)
    assert initialiser is not None
    prepare = f"{name}_prepare(p)" if face.prepares else "((void)(p))"
    lines = [
        f'#include "{name}.h"',
        f"typedef {face.real} real;",
        *(f"typedef {name}_{part} observer_{part};" for part in ("parameters", "state", "inputs", "outputs")),
        f"#define OBSERVER_PARAMETERS {initialiser[1]}",
        f"#define observer_init {name}_init",
        f"#define observer_step {name}_step",
        f"#define observer_prepare(p) {prepare}",
    ]
    lines += [f"#define {part.upper()} {len(face.elements(part))}" for part in ("inputs", "outputs")]
    lines += [f"#define STATES {len(face.elements('state'))}"]
    lines += ["static inline void take_inputs(observer_inputs *to, const real *row)", "{"]
    lines += [f"    to->{e} = row[{k}];" for k, e in enumerate(face.elements("inputs"))] + ["}"]
    for part in ("outputs", "state"):
        lines += [f"static inline void give_{part}(const observer_{part} *from, real *row)", "{"]
        lines += [f"    row[{k}] = (real)from->{e};" for k, e in enumerate(face.elements(part))] + ["}"]
    return "\n".join(lines) + "\n"


def driver_files(files: Mapping[str, str], face: Interface, *drivers: Path) -> dict[str, str]:
    """The header, fields.h and the named drivers, to compile beside the observer."""
    header = files[f"{face.name}.h"]
    texts = {path.name: path.read_text(encoding="utf-8") for path in drivers}
    return {f"{face.name}.h": header, "fields.h": fields_header(face, header), **texts}


class Loaded:
    """A build of the observer in this process: ``start`` inits it, ``run`` steps it on from where it is."""

    def __init__(self, library: Path, face: Interface) -> None:
        self._library, self._face = ctypes.CDLL(str(library)), face
        self.dtype = np.dtype(np.float64 if face.real == "double" else np.float32)
        self._library.driver_start.restype = self._library.driver_run.restype = None

    def start(self, row: np.ndarray) -> None:
        row = np.ascontiguousarray(row, dtype=self.dtype)
        self._library.driver_start(row.ctypes.data_as(ctypes.c_void_p))

    def run(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Outputs and states after each step, a row each."""
        rows = np.ascontiguousarray(rows, dtype=self.dtype)
        outputs, states = (
            np.zeros((len(rows), len(self._face.elements(part))), self.dtype) for part in ("outputs", "state")
        )
        places = [a.ctypes.data_as(ctypes.c_void_p) for a in (rows, outputs, states)]
        self._library.driver_run(ctypes.c_long(len(rows)), *places)
        return outputs, states


def load(
    workshop: Workshop, files: Mapping[str, str], face: Interface, compiler: Compiler, *flags: str, name: str = ""
) -> Loaded:
    """Compile the observer with these flags and load it; the driver around it is always gcc's.

    Args:
        name: the observer's C file, where it is not NAME.c.
    """
    beside = driver_files(files, face, HARNESS / "library.c")
    driver = workshop.object(beside, "library.c", GCC, *HOST_FLAGS, "-O1")
    observer = workshop.object(files, name or f"{face.name}.c", compiler, *HOST_FLAGS, *flags)
    return Loaded(workshop.link(f"{face.name}.so", GCC, "-shared", driver, observer, "-lm"), face)
