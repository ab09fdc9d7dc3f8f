"""The equations of a machine's cancelling input in numbers, and random M, B and U."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import sympy

from codegen.cancellation import with_cancellation
from codegen.observers import build_observer
from tests.machines import read_machine


class Machine:
    """A machine with its cancelling equations, in numbers at any position."""

    def __init__(self, text: str) -> None:
        spec, self.system = read_machine(text)
        observer = build_observer(spec, self.system)
        self.whole = with_cancellation(spec, observer)
        self.equations = self.whole.equations[len(observer.equations) :]

    def input(self, forces: dict[str, float], at: dict[str, float] | None = None) -> np.ndarray:
        """ū by the equations that go into the generated code, A y = r solved by NumPy.

        Args:
            forces: estimate's symbol → value, such as F_hat_c1 or F_hat_on_x1.
            at: position → value.
        """
        known = {s.name: float(v) for s, v in self.whole.values.items()} | forces | (at or {})
        for equation in self.equations:
            values = _evaluated(equation.expression, known)
            if equation.matrix is not None:
                values = np.linalg.solve(_evaluated(equation.matrix, known), values)
            known |= {s.name: float(v) for s, v in zip(equation.symbols, values.ravel(), strict=True)}
        return np.array([known[f"u_cancel_{w.name}"] for w in self.system.inputs])


def cancelling_input(text: str, forces: dict[str, float]) -> np.ndarray:
    """ū of a machine that does not depend on the position."""
    return Machine(text).input(forces)


def _evaluated(matrix, known: dict[str, float]) -> np.ndarray:
    found = sympy.Matrix(matrix).subs({s: known[s.name] for s in matrix.free_symbols})
    return np.array(found.evalf(17).tolist(), dtype=float)


def random_matrix(generator, rows: int, columns: int, rank: int) -> np.ndarray:
    """Integer entries, of the given rank exactly."""
    while True:
        left = generator.integers(-3, 4, (rows, rank))
        right = generator.integers(-3, 4, (rank, columns))
        found = left @ right
        if np.linalg.matrix_rank(found) == rank:
            return found


def random_mass(generator, n: int) -> list[list[Fraction]]:
    """Symmetric positive definite, not diagonal, exact in decimals."""
    root = generator.integers(-2, 3, (n, n))
    return (root @ root.T + np.diag(generator.integers(1, 6, n))).tolist()
