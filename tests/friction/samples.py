"""Random parameters of every law, and its expressions as functions of numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy

from codegen.friction import LAWS, DynamicLaw
from codegen.spec.functions import Magnitude, Sgn

NUMERIC = [{"abs": np.abs, "sgn": np.sign, "Magnitude": np.abs, "Sgn": np.sign}, "numpy"]
DYNAMIC = [name for name, law in LAWS.items() if isinstance(law, DynamicLaw)]
SPEED = sympy.Symbol("s", positive=True)
U = sympy.Symbol("u", real=True)

SPANS = {
    "alpha_1": (-2.0, 2.0),
    "a1": (0.5, 3.0),
    "a2": (0.5, 3.0),
    "D1": (500.0, 2000.0),
    "D2": (1e-3, 1e-2),
    "c": (5.0, 50.0),
    "sigma_0": (1e2, 1e3),
    "sigma_1": (1.0, 10.0),
    "n": (1.2, 3.0),
    "i": (1.0, 2.5),
    "tau": (0.02, 0.2),
    "tau_L": (0.001, 0.01),
    "D_v": (0.001, 0.01),
    "k_t": (100.0, 1000.0),
    "delta_s": (0.001, 0.01),
}
POLYNOMIAL = {"a1": (-3.0, 3.0), "a2": (-3.0, 3.0), "a3": (-3.0, 3.0)}


def draw(name: str, seed: int) -> dict[str, float]:
    """Admissible parameters of a law."""
    random = np.random.default_rng([seed, *name.encode()])
    spans = SPANS | (POLYNOMIAL if name == "polynomial" else {})
    values = {p.name: float(random.uniform(*spans.get(p.name, (0.2, 4.0)))) for p in LAWS[name].parameters}
    return values | ({"N": 20.0} if "N" in values else {})


def numbers(p: dict[str, float]) -> dict[str, Any]:
    return {k: sympy.Float(v) for k, v in p.items()}


def level(name: str, p: dict[str, float]) -> Callable[[Any], Any]:
    """The level over an array of speeds."""
    function = sympy.lambdify(U, LAWS[name].level(Magnitude(U), numbers(p)), NUMERIC)
    return lambda s: function(np.asarray(s, dtype=float)) + np.zeros(np.shape(s))


def slope(name: str, p: dict[str, float]) -> Callable[[Any], Any]:
    """SymPy's derivative of the level over an array of positive speeds."""
    expression = LAWS[name].level(SPEED, numbers(p)).diff(SPEED)
    function = sympy.lambdify(SPEED, expression.replace(Sgn, sympy.sign).doit(), [{"sign": np.sign}, *NUMERIC])
    return lambda s: function(np.asarray(s, dtype=float)) + np.zeros(np.shape(s))


def bound(name: str, p: dict[str, float]) -> float:
    return float(LAWS[name].slope_bound(numbers(p)))


def dynamics(name: str, p: dict[str, float]) -> tuple[Callable[..., float], Callable[..., float]]:
    """rates(u, z) and force(u, z) of a law with one state."""
    law = LAWS[name]
    assert isinstance(law, DynamicLaw) and len(law.states) == 1
    z = sympy.Symbol("z", real=True)
    rate = sympy.lambdify((U, z), law.rates(U, (z,), numbers(p))[0], NUMERIC)
    force = sympy.lambdify((U, z), law.force(U, (z,), numbers(p)), NUMERIC)
    return rate, force


def state_range(name: str, p: dict[str, float], top: float) -> tuple[float, float]:
    ((low, high),) = LAWS[name].state_range(sympy.Float(top), numbers(p))
    return float(low), float(high)
