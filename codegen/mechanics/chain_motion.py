"""Kinematic tree → M(x) and g = w − h(x, v) as SymPy matrices of computed entries."""

from __future__ import annotations

from collections.abc import Sequence

import casadi

from codegen.mechanics.base_parameters import regrouped
from codegen.mechanics.computed import computed_matrix
from codegen.mechanics.kinematic_chain import bias_force, mass_matrix, points_of
from codegen.mechanics.link_parameters import LinkParameter, base_values, masses_of
from codegen.mechanics.system import Matrix
from codegen.spec.kinematics import KinematicTree
from codegen.spec.model import Spec, symbol


def chain_motion(spec: Spec, tree: KinematicTree, free: Sequence[LinkParameter] = ()) -> tuple[Matrix, Matrix]:
    """M(x), n by n, and the force, n by 1: the spec's (the joints' inputs) less the bias force.

    Args:
        free: base parameters that stay symbols; the others are the numbers of the robot file, or the spec's own.
    """
    positions = {symbol(name): casadi.SX.sym(name) for name in spec.positions}
    velocities = {symbol(name): casadi.SX.sym(name) for name in spec.velocities}
    open_ones = {symbol(p.name): casadi.SX.sym(p.name) for p in free}
    x, v = (casadi.vertcat(*names.values()) for names in (positions, velocities))
    whole, tree = tree, regrouped(tree)
    if free or whole.base_parameters:
        values = {name: casadi.SX(float(value)) for name, value in base_values(spec, whole).items()}
        masses = masses_of(tree, values | {s.name: value for s, value in open_ones.items()})
    else:
        masses = [points_of(body) for body in tree.bodies]
    wide = len(tree.bodies) > 9
    mass = computed_matrix(
        lambda i, j: f"M{i + 1}_{j + 1}" if wide else f"M{i + 1}{j + 1}",
        mass_matrix(tree, x, masses),
        positions | open_ones,
        symmetric=True,
    )
    bias = computed_matrix(lambda i, _: f"h{i + 1}", bias_force(tree, x, v, masses), positions | velocities | open_ones)
    return mass, Matrix(Matrix(spec.force) - bias)
