"""A force that repeats along the axis in several harmonics: a motor's cogging with slots, poles and eccentricity."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.periodic import PERIOD
from codegen.mechanics.system import System


class CoggingHarmonics(Effect):
    """e = Σ_k sin_k sin(2π k x/period) + cos_k cos(2π k x/period), over the orders k that the parameters name."""

    kind = "cogging_harmonics"
    sits_on = "coordinate"
    equation = "e = Σ_k sin_k·sin(2π k x/period) + cos_k·cos(2π k x/period)"
    signature = "a force periodic in position with several waves in a period, the same in both directions"
    seen_over = "position"
    refines = "cogging"
    confused_with = (
        Confusion("cogging", "a slow turn over several periods: one wave explains the force, or more are needed"),
        Confusion("encoder_eccentricity", "several speeds: the sensor's error scales with acceleration"),
    )

    def __init__(self, orders: Sequence[int] = (1, 2, 3)) -> None:
        self.orders = tuple(orders)
        waves = [
            EffectParameter(f"{wave}_{k}", "{F}", f"{word} of order {k}", neutral=0.0)
            for k in self.orders
            for wave, word in (("sin", "sine"), ("cos", "cosine"))
        ]
        self.parameters = (PERIOD, *waves)

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """With the orders of the parameters called sin_k and cos_k."""
        found = {
            int(k) for name in names for wave, _, k in [name.partition("_")] if wave in ("sin", "cos") and _is_order(k)
        }
        return self.of_orders(sorted(found)) if found else self

    def of_orders(self, orders: Sequence[int]) -> CoggingHarmonics:
        """The effect with other orders."""
        return type(self)(orders)

    def values(self, period: float, weights: Sequence[tuple[float, float]]) -> dict[str, float]:
        """The parameters of these weights, a sine's and a cosine's for each order."""
        waves = zip(self.orders, weights, strict=True)
        found = {f"{wave}_{k}": float(w) for k, pair in waves for wave, w in zip(("sin", "cos"), pair, strict=True)}
        return {PERIOD.name: period} | found

    def add(self, system: System, place: int, p: Symbols) -> System:
        turn = 2 * sympy.pi * system.positions[place] / p["period"]
        waves = [p[f"sin_{k}"] * sympy.sin(k * turn) + p[f"cos_{k}"] * sympy.cos(k * turn) for k in self.orders]
        return system.with_force(place, sympy.Add(*waves))


def _is_order(text: str) -> bool:
    return text.isdecimal() and text.isascii() and len(text) <= 4 and not text.startswith("0")
