"""Machines of given M, B and U, random or written, and the equations of their cancelling input in numbers."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import sympy

from codegen.cancellation import with_cancellation
from codegen.effects.declare import add_declared_effects
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.spec.model import Spec
from codegen.spec.reader import parse_spec


def machine_text(M, B, U, cancellation="{}", kind=None, envelope="") -> str:
    """A spec of n coordinates x1…, r inputs w1…, p contacts c1…, all turning; entries are texts or numbers."""
    n, r, p = len(M), len(B[0]), len(U[0])
    kind = kind or ("mgto" if np.linalg.matrix_rank(_numbers(U)) == p else "gto")
    gains = f"{{K_1: {_rows(np.zeros((p, n)))}, K_2: {_rows(-np.ones((p, n)))}}}" if kind == "mgto" else "{K_2: -10}"
    force = [" + ".join(f"({B[i][j]})*w{j + 1}" for j in range(r)) for i in range(n)]
    lines = [
        "name: machine",
        "coordinates:",
        *(f"  x{i + 1}: {{velocity: v{i + 1}, unit: rad}}" for i in range(n)),
        "inputs:",
        *(f"  w{j + 1}: {{unit: N*m}}" for j in range(r)),
        "parameters: {I0: {value: 1, unit: kg*m^2}}",
        "mass_matrix:",
        *(f"  - [{', '.join(f'I0*({e})' for e in row)}]" for row in M),
        "force:",
        *(f"  - {f}" for f in force),
        "friction:",
        f"  distribution: [{', '.join('[' + ', '.join(str(e) for e in row) + ']' for row in U)}]",
        "  contacts:",
        *(f"    - {{name: c{k + 1}, law: coulomb, a: 1, unit: N*m}}" for k in range(p)),
        f"observer: {{kind: {kind}, velocity: measured, gains: {gains}, sample_time: 0.001}}",
        f"envelope: {{{envelope}}}",
        f"cancellation: {cancellation}",
    ]
    return "\n".join(lines) + "\n"


def read(text: str) -> Spec:
    return parse_spec(text, Path("machine.yaml"))


class Machine:
    """A machine with its cancelling equations, in numbers at any position."""

    def __init__(self, text: str) -> None:
        spec = read(text)
        self.system = add_declared_effects(build_system(spec), spec)
        observer = build_observer(spec, self.system)
        self.whole = with_cancellation(spec, observer)
        self.equations = self.whole.equations[len(observer.equations) :]

    def input(self, forces: dict[str, float], at: dict[str, float] | None = None) -> np.ndarray:
        """ū by the equations that go into the generated code, M a = r solved by NumPy.

        Args:
            forces: estimate's symbol → value, such as F_hat_c1 or F_hat_on_x1.
            at: position → value.
        """
        known = {s.name: float(v) for s, v in self.whole.values.items()} | forces | (at or {})
        for equation in self.equations:
            values = _evaluated(equation.expression, known)
            if equation.form == "mass_solve":
                values = np.linalg.solve(_evaluated(self.system.mass_matrix, known), values)
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


def _numbers(matrix) -> np.ndarray:
    return np.array([[complex(sympy.sympify(e).subs({"x1": 0.3, "x2": -0.4})).real for e in row] for row in matrix])


def _rows(matrix: np.ndarray) -> str:
    return str(matrix.astype(int).tolist())
