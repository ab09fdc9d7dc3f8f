"""A figure as the gallery makes it: how it is run, drawn and measured, and in which settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec
from codegen.thesis.gallery.measures import Reading
from codegen.thesis.gallery.runs import Gains
from codegen.thesis.gallery.setting import Setting

AS_DRAWN = Setting("as drawn")


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


Measure = Callable[[Runs], Reading]
"""A number of a statement."""


def measured(*measures: Measure) -> dict[str, Measure]:
    """Measures by the names of their functions, as the claims call them."""
    return {measure.__name__: measure for measure in measures}


@dataclass(frozen=True)
class Plot:
    """How one figure is made.

    Attributes:
        run: specs, a setting and the PID's gains, if it is tuned already → runs.
        draw: puts the runs as drawn on a matplotlib figure.
        rows: of panels, for the height.
        measures: name → number of a statement.
        settings: beside ``AS_DRAWN``, in which the statements are checked again.
        cost: how long it takes, roughly, beside the others.
        pid_of: the figure whose tuned PID this one has too, since machine, servo and sensors are the same.
    """

    run: Callable[[Sequence[Spec], Setting, Gains | None], Runs]
    draw: Callable[[Any, Runs], None]
    rows: float
    measures: Mapping[str, Measure] = field(default_factory=dict)
    settings: Sequence[Setting] = ()
    cost: float = 1.0
    pid_of: str | None = None
