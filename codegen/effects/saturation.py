"""An actuator that gives no more than its limit."""

from __future__ import annotations

from collections.abc import Sequence

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives
from codegen.effects.start import limits, roundings
from codegen.mechanics.system import System

LIMIT = EffectParameter("limit", "{w}", "greatest effective input", low=0.0, start=limits)
ROUNDING = EffectParameter(
    "rounding", "1", "0 for a sharp corner at the limit, towards 1 for a gradual approach", low=0.0, high=1.0,
    start=roundings,
)  # fmt: skip


class Saturation(Effect):
    """w_eff = clip(w, −limit, limit), or with ``rounding`` r the smooth curve

    w_eff = (√((w + l)² + r²·limit²) − √((w − l)² + r²·limit²))·limit/(2 l), l = limit·√(1 − r²).

    Its slope is 1 at w = 0 and it tends to ±limit: a magnetic circuit that saturates, an amplifier's soft limit. Within
    1.5 limits, a hyperbolic tangent is such a curve to 0.3 % of what is missing.
    """

    kind = "saturation"
    sits_on = "input"
    equation = "w_eff = clip(w, −limit, limit), its corners rounded where rounding is given"
    signature = "a force that is missing at large commands and at no others"
    seen_over = "input"
    confused_with = (
        Confusion("input_gain", "a small and a large amplitude of one motion"),
        Confusion("quadratic_drag", "a large command at low speed"),
    )
    needs = "an input that acts on the machine"

    def __init__(self, rounded: bool = False) -> None:
        self.parameters = (LIMIT, ROUNDING) if rounded else (LIMIT,)

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """With rounding where it is given."""
        return type(self)(rounded=ROUNDING.name in names)

    @property
    def forms(self) -> tuple[Effect, ...]:
        """The sharp corner first."""
        return (self, type(self)(rounded=True))

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_stage(place, "saturation", *(p[q.name] for q in self.parameters))

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place)
