"""Execution of a generated observer on rows of samples: compiled C, or the Python twin, with bit-identical results."""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from copy import deepcopy
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.compiler import cached_library, find_compiler, load_library
from codegen.base.text import render
from codegen.emit.package import emit_sources, make_header
from codegen.observers.equations import Observer
from codegen.program import Program, build_program
from codegen.replay.samples import Block
from codegen.spec.model import Spec
from codegen.spec.schema import CodeChoice

Faults = NDArray[np.intc]


class Engine(ABC):
    """A generated observer with the spec's parameters, and its state.

    Attributes:
        name: in words.
        outputs: names of its estimates, in their order.
        inputs: names of what it reads, in their order.
        holds: whether it holds its estimates at invalid samples, and sets the fault flag.
    """

    name: str

    def __init__(self, program: Program) -> None:
        self.holds = program.holds
        self.inputs = tuple(field.name for field in program.inputs)
        self.outputs = tuple(name for name, _, _ in program.outputs)

    @abstractmethod
    def start(self, row: Array) -> None:
        """Set the state from the first measurement, (inputs,)."""

    @abstractmethod
    def run(self, rows: Array) -> tuple[Array, Faults]:
        """Step over samples (N, inputs): estimates (N, outputs), fault flags (N,), 0 without fault handling."""

    @abstractmethod
    def trial_step(self, row: Array) -> Array:
        """The estimates (outputs,) of a step with the sample (1, inputs); the state is restored afterwards."""

    def take(self, block: Block) -> tuple[Array, Faults]:
        """``run`` over a block, after an initialisation from its first row if the block is ``fresh``."""
        if block.fresh:
            self.start(block.rows[0])
        return self.run(block.rows)


def engine_for(program: Program, files: Mapping[str, str]) -> Engine:
    """The compiled engine, or the Python twin if there is no C compiler.

    Args:
        files: name → text of generated/NAME/.

    Raises:
        BadInput: if the compiler refuses the code.
    """
    return CompiledEngine(program, files) if find_compiler() else TwinEngine(program, files)


def engine_of(spec: Spec, observer: Observer, code: CodeChoice) -> Engine:
    """The engine of an observer of a spec, whose code is generated for it alone.

    Args:
        code: precision and handling of invalid samples.

    Raises:
        BadInput: if the compiler refuses the code.
    """
    program = build_program(observer, code)
    return engine_for(program, emit_sources(program, make_header(spec.path.name, spec.sha256, spec.source)))


class CompiledEngine(Engine):
    """The generated C, compiled to a shared library and called by ctypes."""

    name = "compiled C"

    def __init__(self, program: Program, files: Mapping[str, str]) -> None:
        """Compile the C, or load the library that an earlier run has compiled.

        Args:
            files: name → text, of the C at least.

        Raises:
            BadInput: where there is no compiler, or it refuses the code.
        """
        super().__init__(program)
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
        first = np.ascontiguousarray(row, dtype=np.float64)
        self._start(self._place(), first.ctypes.data)

    def run(self, rows: Array) -> tuple[Array, Faults]:
        rows = np.ascontiguousarray(rows, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != len(self.inputs):
            raise ValueError(f"rows of {len(self.inputs)} inputs expected, got {rows.shape}")
        estimates, faults = np.empty((len(rows), len(self.outputs))), np.empty(len(rows), dtype=np.intc)
        self._run(self._place(), len(rows), rows.ctypes.data, estimates.ctypes.data, faults.ctypes.data)
        return estimates, faults

    def trial_step(self, row: Array) -> Array:
        before = self._memory.raw
        estimates: Array = self.run(row)[0][0]
        ctypes.memmove(self._memory, before, len(before))
        return estimates


class TwinEngine(Engine):
    """The generated Python module."""

    name = "the Python twin (no C compiler found)"

    def __init__(self, program: Program, files: Mapping[str, str]) -> None:
        super().__init__(program)
        self._twin, self._program = load_twin(files["__init__.py"], program.name), program
        self._parameters: Any = self._twin.Parameters()
        self._state: Any = None
        self._held: tuple[Any, ...] = ()

    def start(self, row: Array) -> None:
        self._state = self._twin.init(self._parameters, inputs_of(self._twin, self._program, row.tolist()))
        self._held = (self._twin.Outputs(),) if self.holds else ()

    def run(self, rows: Array) -> tuple[Array, Faults]:
        estimates, faults = np.empty((len(rows), len(self.outputs))), np.zeros(len(rows), dtype=np.intc)
        for k, row in enumerate(rows.tolist()):
            inputs = inputs_of(self._twin, self._program, row)
            made = self._twin.step(self._state, self._parameters, inputs, *self._held)
            estimates[k] = values_of(made, self._program, self.outputs)
            if self.holds:
                faults[k] = made.fault
        return estimates, faults

    def trial_step(self, row: Array) -> Array:
        before, held = self._state, self._held
        self._state, self._held = deepcopy(before), deepcopy(held)
        estimates: Array = self.run(row)[0][0]
        self._state, self._held = before, held
        return estimates


def load_twin(source: str, name: str) -> ModuleType:
    """A generated ``__init__.py``, loaded as a module from its text."""
    module = ModuleType(name)
    exec(compile(source, f"<the twin of {name}>", "exec", dont_inherit=True), module.__dict__)
    return module


def inputs_of(twin: ModuleType, program: Program, row: Sequence[float]) -> Any:
    """The twin's ``Inputs`` with the numbers of a row, in the Program's order."""
    made = twin.Inputs()
    fill(made, program, dict(zip((field.name for field in program.inputs), row, strict=True)))
    return made


def fill(record: Any, program: Program, values: Mapping[str, float]) -> None:
    """Set quantities of one of the twin's records by their names in the Program; some are array elements."""
    for name, value in values.items():
        place = program.arrays.get(name)
        if place is None:
            setattr(record, name, value)
        else:
            getattr(record, place.array)[place.at] = value


def values_of(record: Any, program: Program, names: Sequence[str]) -> list[float]:
    """Quantities of one of the twin's records by their names in the Program."""
    values = []
    for name in names:
        place = program.arrays.get(name)
        values.append(getattr(record, name) if place is None else getattr(record, place.array)[place.at])
    return values
