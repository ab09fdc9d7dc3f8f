"""Execution of a generated observer on rows of samples, as compiled C."""

import ctypes
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.compiler import cached_library, load_library
from codegen.base.text import render
from codegen.emit.package import emit_sources, make_header
from codegen.observers.equations import Observer
from codegen.program import Program, build_program
from codegen.replay.samples import Block
from codegen.spec.model import Spec
from codegen.spec.schema import CodeChoice

Faults = NDArray[np.intc]


class Engine:
    """A generated observer with the spec's parameters, and its state: the C in a shared library, called by ctypes.

    Attributes:
        outputs: names of its estimates, in their order.
        inputs: names of what it reads, in their order.
        holds: whether it holds its estimates at invalid samples, and sets the fault flag.
    """

    def __init__(self, program: Program, files: Mapping[str, str]) -> None:
        """Compile the C, or load the library that an earlier run has compiled.

        ``files``: name → text, of the C at least. Raises BadInput where there is no compiler, or it refuses the code.
        """
        self.holds = program.holds
        self.inputs = tuple(field.name for field in program.inputs)
        self.outputs = tuple(name for name, _, _ in program.outputs)
        name, header = program.name, files[f"{program.name}.h"]
        loop = f"{name}_replay.c"
        text = render("replay/replay.c.j2", program=program, real=program.real, fault=self.holds)
        sources = {f"{name}.h": header, f"{name}.c": files[f"{name}.c"], loop: text}
        library = load_library(cached_library(sources, (f"{name}.c", loop)))
        size = getattr(library, f"{name}_replay_size")
        size.restype, size.argtypes = ctypes.c_size_t, []
        self._start, self._run = getattr(library, f"{name}_replay_start"), getattr(library, f"{name}_replay_run")
        pointer = ctypes.c_void_p
        self._start.restype, self._start.argtypes = None, [pointer, pointer]
        self._run.restype, self._run.argtypes = None, [pointer, ctypes.c_size_t, pointer, pointer, pointer]
        self._memory = ctypes.create_string_buffer(size() + 64)

    def _place(self) -> int:
        """Address of the observer's memory within its buffer, aligned to 64 bytes."""
        return -(-ctypes.addressof(self._memory) // 64) * 64

    def start(self, row: Array) -> None:
        """Set the state from the first measurement, (inputs,)."""
        first = np.ascontiguousarray(row, dtype=np.float64)
        self._start(self._place(), first.ctypes.data)

    def run(self, rows: Array) -> tuple[Array, Faults]:
        """Step over samples (N, inputs): estimates (N, outputs), fault flags (N,), 0 without fault handling."""
        rows = np.ascontiguousarray(rows, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != len(self.inputs):
            raise ValueError(f"rows of {len(self.inputs)} inputs expected, got {rows.shape}")
        estimates, faults = np.empty((len(rows), len(self.outputs))), np.empty(len(rows), dtype=np.intc)
        self._run(self._place(), len(rows), rows.ctypes.data, estimates.ctypes.data, faults.ctypes.data)
        return estimates, faults

    def trial_step(self, row: Array) -> Array:
        """The estimates (outputs,) of a step with the sample (1, inputs); the state is restored afterwards."""
        before = self._memory.raw
        estimates: Array = self.run(row)[0][0]
        ctypes.memmove(self._memory, before, len(before))
        return estimates

    def take(self, block: Block) -> tuple[Array, Faults]:
        """``run`` over a block, after an initialisation from its first row if the block is ``fresh``."""
        if block.fresh:
            self.start(block.rows[0])
        return self.run(block.rows)


def engine_of(spec: Spec, observer: Observer, code: CodeChoice) -> Engine:
    """The engine of an observer of a spec, whose code is generated for it alone.

    ``code``: precision and handling of invalid samples. Raises BadInput where there is no compiler, or it refuses the
    code.
    """
    program = build_program(observer, code)
    return Engine(program, emit_sources(program, make_header(spec.path.name, spec.sha256, spec.source)))
