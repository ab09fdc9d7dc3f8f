"""Kinematic tree → M(x) and g = w − h(x, v) as SymPy matrices of computed entries."""

from __future__ import annotations

import casadi

from codegen.mechanics.base_parameters import regrouped
from codegen.mechanics.computed import computed_matrix
from codegen.mechanics.kinematic_chain import bias_force, mass_matrix
from codegen.mechanics.system import Matrix
from codegen.spec.kinematics import KinematicTree
from codegen.spec.model import Spec, symbol


def chain_motion(spec: Spec, tree: KinematicTree) -> tuple[Matrix, Matrix]:
    """M(x), n by n, and the force, n by 1: the spec's (the joints' inputs) less the bias force."""
    positions = {symbol(name): casadi.SX.sym(name) for name in spec.positions}
    velocities = {symbol(name): casadi.SX.sym(name) for name in spec.velocities}
    x, v = (casadi.vertcat(*names.values()) for names in (positions, velocities))
    tree = regrouped(tree)
    wide = len(tree.bodies) > 9
    mass = computed_matrix(
        lambda i, j: f"M{i + 1}_{j + 1}" if wide else f"M{i + 1}{j + 1}",
        mass_matrix(tree, x),
        positions,
        symmetric=True,
    )
    bias = computed_matrix(lambda i, _: f"h{i + 1}", bias_force(tree, x, v), positions | velocities)
    return mass, Matrix(Matrix(spec.force) - bias)
