"""Generated C, compiled and loaded, beside its Python twin: both take and give plain rows of doubles."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import ModuleType

import numpy as np

from codegen.effects.declare import add_declared_effects
from codegen.emit.package import emit_sources, make_header
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.program import Program, build_program
from codegen.spec.reader import parse_spec
from tests.twin import load_twin

from .toolchain import compiled

WHOLE = {"fault": ctypes.c_int, "mode": ctypes.c_int, "invalid_samples": ctypes.c_ubyte}
"""Fields that are no number of the spec's precision."""
FLAGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror")


def program_of(text: str) -> Program:
    spec = parse_spec(text, Path("machine.yaml"))
    system = add_declared_effects(build_system(spec), spec)
    return build_program(build_observer(spec, system))


def sources_of(program: Program, source: str = "") -> dict[str, str]:
    return emit_sources(program, make_header("machine.yaml", "0" * 64, source))


def compile_shared(folder: Path, file: str, *more: str) -> Path:
    """The library of a C file; the same text with the same flags is compiled once."""
    text = b"".join((folder / file).read_bytes() for file in (file, *sorted(p.name for p in folder.glob("*.h"))))
    target = folder / f"{sha256(text).hexdigest()[:16]}{''.join(more)}.so"
    if target.exists():
        return target
    target.write_bytes(compiled(["gcc", *FLAGS, *(more or ("-O2",)), "-fPIC", "-shared"], folder, file))
    return target


class Built:
    """A program in both languages.

    ``*_run`` take (N, inputs) and give (N, outputs) and (N, states), the states as they are after each step.
    """

    def __init__(self, folder: Path, text: str, precision: str = "double") -> None:
        self.folder, self.program = folder, replace(program_of(text), precision=precision)
        self.files = sources_of(self.program, parse_spec(text, Path("machine.yaml")).source)
        for name, content in self.files.items():
            (folder / name).write_text(content, encoding="utf-8")
        self.twin: ModuleType = load_twin(self.files["__init__.py"], f"twin_{self.program.name}")
        self.parameters = self.twin.Parameters()

    def c_run(self, rows: np.ndarray, *flags: str) -> tuple[np.ndarray, np.ndarray]:
        name = self.program.name
        library = ctypes.CDLL(str(compile_shared(self.folder, f"{name}.c", *flags)))
        init, step = getattr(library, f"{name}_init"), getattr(library, f"{name}_step")
        init.restype = step.restype = None
        constants, inputs, state, outputs = (struct() for struct in self.structs)
        for field, _ in constants._fields_:
            setattr(constants, field, getattr(self.parameters, field))
        found, states = [], []
        self.faults: list[int] = []
        places = [ctypes.byref(x) for x in (state, constants, inputs, outputs)]
        for k, row in enumerate(rows.tolist()):
            for (field, _), value in zip(inputs._fields_, row, strict=True):
                setattr(inputs, field, value)
            if k == 0:
                init(*places[:3])
            step(*places)
            self.faults += [k] if outputs.fault else []
            found.append([getattr(outputs, field) for field, _ in outputs._fields_])
            states.append([getattr(state, field) for field, _ in state._fields_])
        outputs, state = np.array(found, dtype=float), np.array(states, dtype=float)
        return outputs[:, : len(self.program.outputs)], state[:, : len(self.program.states)]

    @property
    def structs(self) -> list[type[ctypes.Structure]]:
        """parameters, inputs, state and outputs as C lays them out."""
        real = ctypes.c_float if self.program.precision == "single" else ctypes.c_double
        made = []
        for part in ("Parameters", "Inputs", "State", "Outputs"):
            names = getattr(self.twin, part).__slots__
            fields = [(name, WHOLE.get(name, real)) for name in names]
            made.append(type(part, (ctypes.Structure,), {"_fields_": fields}))
        return made

    def python_run(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        twin, names = self.twin, [name for name, _, _ in self.program.outputs]
        fields = [f.name for f in self.program.states]
        found, states = [], []
        state, outputs = twin.init(self.parameters, twin.Inputs(*rows[0].tolist())), twin.Outputs()
        for row in rows.tolist():
            outputs = twin.step(state, self.parameters, twin.Inputs(*row), outputs)
            found.append([float(getattr(outputs, n)) for n in names])
            states.append([float(getattr(state, n)) for n in fields])
        return np.array(found), np.array(states)


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
