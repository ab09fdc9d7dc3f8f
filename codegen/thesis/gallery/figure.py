"""The runs of a figure: what it is drawn from and measured on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec
from codegen.thesis.gallery.runs import Gains
from codegen.thesis.gallery.setting import Setting


@dataclass(frozen=True)
class Runs:
    """What a figure is drawn from and measured on.

    Attributes:
        specs: of the figure, in the order of its claims entry.
        setting: what was taken of that which the text leaves open.
        loops: name → run.
        pid: gains of the tuned PID, where there is one; tuned once, as drawn.
        numbers: what else a measure needs.
    """

    specs: Sequence[Spec]
    setting: Setting
    loops: Mapping[str, LoopRun] = field(default_factory=dict)
    pid: Gains | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> LoopRun:
        return self.loops[name]
