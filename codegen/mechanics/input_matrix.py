"""B of g(x, v, w) = g₀(x, v) + B(x, v) w, where the inputs enter so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from codegen.mechanics.compact import compact

LONGEST = 200


@dataclass(frozen=True)
class NonlinearInput:
    """Why there is no B.

    Attributes:
        coordinate: the first on which the force is not linear in the inputs.
        input: the input whose effect there varies with the inputs.
        slope: ∂g/∂w of that input on that coordinate; it holds an input.
    """

    coordinate: str
    input: str
    slope: sympy.Expr

    @property
    def reason(self) -> str:
        """As what a ``BadInput`` may say was found."""
        return f"the force on {self.coordinate} is not linear in {self.input}: its slope is {self.slope}"


def input_matrix(
    force: Any, positions: Sequence[sympy.Symbol], inputs: Sequence[sympy.Symbol]
) -> sympy.ImmutableMatrix | NonlinearInput:
    """B = ∂g/∂w, coordinates by inputs, or the first entry that shows that g is not linear (affine) in w.

    Args:
        force: g(x, v, w), n by 1.
        positions: names of the rows.
        inputs: w, in order.
    """
    slopes = sympy.zeros(len(positions), len(inputs))
    for i, position in enumerate(positions):
        for j, entry in enumerate(inputs):
            slope = force[i].diff(entry)
            if slope.has(*inputs):
                slope = compact(slope)
            if slope.has(*inputs) and sympy.count_ops(slope) <= LONGEST:
                slope = sympy.cancel(slope)  # a quotient in which w falls out
            # a step in w has no slope, and ``sgn`` says that its own is zero
            steps = [f for f in force[i].atoms(sympy.Function) if f.has(entry)]
            if slope.has(*inputs) or steps:
                return NonlinearInput(position.name, entry.name, slope)
            slopes[i, j] = slope
    return sympy.ImmutableMatrix(slopes)
