"""Chapter 5 and Appendix B: the input that cancels the friction, by solving B ū = U F̄ for several sizes of B."""

from itertools import combinations
from typing import Any

import sympy

from codegen.thesis.audit.derivation import Derivations, column, full, named, real
from codegen.thesis.audit.derivations.machines import two_mass


def cancellation() -> Derivations:
    """(5.8)–(5.16), Appendix B: square, tall and wide B."""
    names: dict[str, Any] = {}
    derived: dict[str, Any] = {}
    F = column("F_bar", 2)

    square, U = full("B", 2, 2), full("U", 2, 2)
    derived["square"] = (_cleared(square.LUsolve(U * F)), "B_inv*U*F_bar")
    names |= {"B": square, "B_inv": square.inv(), "U": U, "F_bar": F}
    derived["cancelled"] = U * F  # B ū, so that M v̇ = g + B u

    tall, K_upper = full("Bt", 3, 2), full("K", 2, 3)
    K_lower = tall[:, 0].cross(tall[:, 1]).T  # K_lower B = 0
    K = sympy.Matrix.vstack(K_upper, K_lower)
    B_1 = K_upper * tall
    reach = full("Y", 2, 2)
    within = tall * reach  # a U whose forces the inputs can reach: U_2 = 0
    derived["tall"] = reach * F
    U_tall = full("Ut", 3, 2)
    partial = _cleared((K * tall)[:2, :].LUsolve((K * U_tall * F)[:2, :]))
    derived["partial"] = (partial, "B_1_inv*U_1_any*F_bar")
    names |= {"B_1_inv": B_1.inv(), "U_1": (K * within)[:2, :], "U_1_any": (K * U_tall)[:2, :]}
    # (5.12) for one input on two coordinates: the squares of the remaining and of the whole friction force.
    one, k, given = (sympy.Matrix(real(*pair)) for pair in (("B_1", "B_2"), ("k_1", "k_2"), ("f_1", "f_2")))
    left = one * k.dot(given) / k.dot(one) - given
    names |= {"left": left.dot(left), "friction": given.dot(given)}
    derived["reduced"] = sympy.Matrix.vstack((K * tall)[:2, :], sympy.zeros(1, 2))
    names["K_B"] = K * tall

    wide, force = full("Bw", 2, 3), column("F", 2)
    optimum = sympy.Matrix.vstack(
        sympy.Matrix.hstack(sympy.eye(3), wide.T), sympy.Matrix.hstack(wide, sympy.zeros(2, 2))
    )  # least ū'ū with B ū = F
    solution = optimum.adjugate() * sympy.Matrix.vstack(sympy.zeros(3, 1), force) / optimum.det(method="berkowitz")
    normal = wide.T * wide
    names |= {"B_wide": wide, "F": force, "BB_T_inv": (wide * wide.T).inv()}
    names["B_TB_inv"] = normal.adjugate() * (1 / sympy.expand(normal.det(method="berkowitz")))
    derived["wide"] = (solution[:3, :], "B_wide_T*BB_T_inv*F")

    right = full("R", 2, 2)
    solutions = [_appendix_b(wide, right, chosen) for chosen in combinations(range(3), 2)]
    derived["appendix_b"] = sympy.Matrix.hstack(right, right, right)
    names |= {"A": wide, **{f"X_{i + 1}": X for i, X in enumerate(solutions)}}
    b, c = real("b_1", "b_2"), real("c_1", "c_2")
    rank_one = sympy.Matrix(b) * sympy.Matrix([c])
    names |= named((*b, *c)) | {"det_D": sympy.expand(rank_one.det())}
    return Derivations(names, derived)


def _appendix_b(A: Any, B: Any, chosen: tuple[int, ...]) -> Any:
    """Steps 1–4 of Appendix B with the given columns of A."""
    solved = A[:, list(chosen)].inv() * B
    X = sympy.zeros(A.cols, B.cols)
    for row, column_of_A in enumerate(chosen):
        X[column_of_A, :] = solved[row, :]
    return X


def _cleared(matrix: Any) -> Any:
    return matrix.applyfunc(sympy.cancel)


def two_mass_cancellation() -> Derivations:
    """Section 5.4 by note 2: without the rows that no input drives, and the contacts that act there."""
    machine = two_mass()
    F = column("F_bar", 2)
    U, B = sympy.Matrix([[1, 0], [-1, 1]]), sympy.Matrix([machine.derived["force"].value.diff(machine.names["w"])])
    kept = [i for i in range(2) if any(B[i, :])]
    lost = {j for i in range(2) if i not in kept for j in range(2) if U[i, j] != 0}
    columns = [j for j in range(2) if j not in lost]
    B_bar, U_bar, F_n = B[kept, :], U[kept, columns], F[columns, :]
    derived = {
        "u_bar": B_bar.LUsolve(U_bar * F_n),
        "B": B,
        "reduced": sympy.Matrix.hstack(B_bar, U_bar, F_n),
        "totals": U * F,
    }
    return Derivations({}, derived | dict(machine.derived))
