"""Generated C, compiled and loaded, beside its Python twin: both take and give plain rows of doubles."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np

from codegen.diagnosis.replay import load_twin
from codegen.effects.declare import add_declared_effects
from codegen.emit.package import emit_sources, make_header
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.program import Program, build_program
from codegen.spec.reader import parse_spec

FLAGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror")


def program_of(text: str) -> Program:
    spec = parse_spec(text, Path("machine.yaml"))
    system = add_declared_effects(build_system(spec), spec)
    return build_program(build_observer(spec, system))


def sources_of(program: Program, source: str = "") -> dict[str, str]:
    return emit_sources(program, make_header("machine.yaml", "0" * 64, source))


def compile_shared(folder: Path, file: str, *more: str) -> Path:
    target = folder / f"{file}{''.join(more)}.so"
    command = ["gcc", *FLAGS, *(more or ("-O2",)), "-fPIC", "-shared", "-o", str(target), str(folder / file), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return target


class Built:
    """A program in both languages.

    ``*_run`` take (N, inputs) and give (N, outputs) and (N, states), the states as they are after each step.
    """

    def __init__(self, folder: Path, text: str) -> None:
        self.folder, self.program = folder, program_of(text)
        self.files = sources_of(self.program, parse_spec(text, Path("machine.yaml")).source)
        for name, content in self.files.items():
            (folder / name).write_text(content, encoding="utf-8")
        self.twin: ModuleType = load_twin(self.files["__init__.py"], f"twin_{self.program.name}")
        self.parameters = np.array([p.value for p in self.program.parameters])

    def c_run(self, rows: np.ndarray, *flags: str) -> tuple[np.ndarray, np.ndarray]:
        p, name = self.program, self.program.name
        library = ctypes.CDLL(str(compile_shared(self.folder, f"{name}.c", *flags)))
        init, step = getattr(library, f"{name}_init"), getattr(library, f"{name}_step")
        init.restype = step.restype = None
        outputs, states = np.zeros((len(rows), len(p.outputs))), np.zeros((len(rows), len(p.states)))
        state, rows = np.zeros(len(p.states)), np.ascontiguousarray(rows)
        constants, now = self.parameters.ctypes.data_as(ctypes.c_void_p), state.ctypes.data_as(ctypes.c_void_p)
        init(now, constants, rows[0].ctypes.data_as(ctypes.c_void_p))
        first, width = rows.ctypes.data, rows.strides[0]
        out, stride = outputs.ctypes.data, outputs.strides[0]
        for k in range(len(rows)):
            step(now, constants, ctypes.c_void_p(first + k * width), ctypes.c_void_p(out + k * stride))
            states[k] = state
        return outputs, states

    def python_run(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        names = [name for name, _, _ in self.program.outputs]
        fields = [f.name for f in self.program.states]
        parameters = self.twin.Parameters(*self.parameters.tolist())
        outputs, states = np.zeros((len(rows), len(names))), np.zeros((len(rows), len(fields)))
        state = self.twin.init(parameters, self.twin.Inputs(*rows[0].tolist()))
        for k, row in enumerate(rows.tolist()):
            out = self.twin.step(state, parameters, self.twin.Inputs(*row))
            outputs[k] = [getattr(out, n) for n in names]
            states[k] = [getattr(state, n) for n in fields]
        return outputs, states


def motion(program: Program, samples: int, seed: int = 1) -> np.ndarray:
    """Random inputs that move, stand still and chatter about zero: (samples, inputs)."""
    random = np.random.default_rng(seed)
    rows = np.zeros((samples, len(program.inputs)))
    part = max(1, samples // 4)
    for column, field in enumerate(program.inputs):
        walk = np.cumsum(random.normal(size=samples)) * (1e-3 if field.meaning == "measured position" else 1e-2)
        walk[part : 2 * part] = walk[part] + random.normal(size=part) * 1e-12
        walk[2 * part : 3 * part] = np.where(random.random(part) < 0.5, 0.0, random.normal(size=part) * 1e-9)
        scale = 1.0 if field.meaning != "input" else 30.0
        rows[:, column] = walk * scale
    return rows


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """NaN and the sign of zero count."""
    return a.shape == b.shape and a.dtype == b.dtype == np.float64 and a.tobytes() == b.tobytes()
