"""An actuator that does not answer to small commands."""

from __future__ import annotations

from collections.abc import Sequence

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives
from codegen.effects.start import dead_widths, thresholds
from codegen.mechanics.system import System

WIDTH = EffectParameter("width", "{w}", "half width of the dead zone", low=0.0, start=dead_widths)
THRESHOLD = EffectParameter(
    "threshold", "{w}", "greatest input that has no effect, in place of a width; a larger one acts whole",
    low=0.0, start=thresholds,
)  # fmt: skip


class DeadZone(Effect):
    """w_eff = sgn(w) max(|w| − width, 0), or with ``threshold`` in place of ``width`` w_eff = w where |w| > threshold,
    else 0: a drive that ignores small commands.
    """

    kind = "dead_zone"
    sits_on = "input"
    equation = "w_eff = sgn(w)·max(|w| − width, 0); with a threshold, w where |w| > threshold and 0 elsewhere"
    signature = "a force that is missing: all of it at small commands, a constant share at large ones"
    seen_over = "input"
    confused_with = (
        Confusion("input_gain", "two amplitudes of one motion"),
        Confusion("coulomb friction", "a force in one direction that is not reversed while the motion is"),
    )
    needs = "an input that acts on the machine"

    def __init__(self, jumps: bool = False) -> None:
        self.parameters = (THRESHOLD,) if jumps else (WIDTH,)
        self.rough = jumps  # each sample passes a threshold whole or not at all

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """With a threshold where it is given."""
        return type(self)(jumps=THRESHOLD.name in names)

    @property
    def forms(self) -> tuple[Effect, ...]:
        """The continuous curve first."""
        return (type(self)(), type(self)(jumps=True))

    def add(self, system: System, place: int, p: Symbols) -> System:
        if THRESHOLD.name in p:
            return system.with_stage(place, "threshold", p[THRESHOLD.name])
        return system.with_stage(place, "dead_zone", p[WIDTH.name])

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place)
