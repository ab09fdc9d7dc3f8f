"""A spec → what every peer is made of: its observer, its program, our files, and inputs to run on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from codegen.base.resources import resource_folder
from codegen.emit import ALWAYS
from codegen.emit.package import emit_sources, make_header
from codegen.observers import Observer, observer_of
from codegen.program import Program, build_program
from codegen.spec import Spec, read_spec
from codegen.spec.schema import CodeChoice

SAMPLES = 512
NUDGE = 0.01
"""Added to state k, times k + 1: no velocity estimate begins at zero, where rounding alone would choose its sign."""


@dataclass(frozen=True)
class Model:
    """A spec and all that follows from it, made when first asked for.

    Attributes:
        travel, force: amplitudes of positions and of the other inputs that it is run on.
    """

    spec: Spec
    travel: float = 0.6
    force: float = 5.0

    @cached_property
    def observer(self) -> Observer:
        return observer_of(self.spec)

    @cached_property
    def program(self) -> Program:
        return build_program(self.observer)

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def output_names(self) -> tuple[str, ...]:
        return tuple(name for name, _, _ in self.program.outputs)

    def files(
        self, precision: str = "double", fault: str = "hold", targets: Sequence[str] = ALWAYS
    ) -> Mapping[str, str]:
        """Our C and Python, or what other targets give, by file name."""
        program = build_program(self.observer, CodeChoice(precision=precision, fault=fault))
        return emit_sources(program, make_header(self.spec.path.name, self.spec.sha256, ""), targets)

    def rows(self, samples: int = SAMPLES, shift: float = 1.0) -> np.ndarray:
        """Inputs, samples by width: sines that end where they begin, no two in step; from zero with no ``shift``."""
        turn = 2.0 * math.pi * np.arange(samples) / samples
        positions = len(self.observer.system.positions)
        columns = [
            (self.travel if k < positions else self.force) * np.sin((1 + k % 3) * turn + shift * (0.7 + 1.3 * k))
            for k in range(len(self.program.inputs))
        ]
        return np.column_stack(columns)


def load(path: str | Path, travel: float = 0.6, force: float = 5.0) -> Model:
    """The model of a spec: a path, or the name of a shipped one."""
    path = Path(path)
    return Model(read_spec(path if path.suffix else resource_folder("specs") / f"{path.name}.yaml"), travel, force)
