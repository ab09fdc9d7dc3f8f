"""Our own derivations, by subject. Adding one: a file with its builder, and a line here."""

from collections.abc import Callable

from codegen.thesis.audit.world import World
from codegen.thesis.audit.worlds import generalised, inputs, laws, many_errors, one_equations, one_errors, topology
from codegen.thesis.audit.worlds.arm import two_link_arm
from codegen.thesis.audit.worlds.many_equations import many_equations
from codegen.thesis.audit.worlds.shipped import shipped_one_mass, shipped_two_mass
from codegen.thesis.audit.worlds.single import single_equations, single_errors
from codegen.thesis.audit.worlds.two_mass import two_mass

WORLDS: dict[str, Callable[[], World]] = {
    "laws": laws.friction_laws,
    "piecewise": laws.piecewise_inverse,
    "one": one_equations.one_equations,
    "compensated": one_equations.compensated,
    "coulomb": one_errors.one_coulomb,
    "tracking": one_errors.one_tracking,
    "coulomb_estimated": one_errors.one_coulomb_estimated,
    "tracking_estimated": one_errors.one_tracking_estimated,
    "dynamic": one_errors.one_dynamic,
    "dynamic_estimated": one_errors.one_dynamic_estimated,
    "rig": one_equations.rig_equations,
    "many": many_equations,
    "many_static": many_errors.many_static,
    "many_static_estimated": many_errors.many_static_estimated,
    "many_dynamic": many_errors.many_dynamic,
    "many_dynamic_estimated": many_errors.many_dynamic_estimated,
    "single": single_equations,
    "single_errors": single_errors,
    "shipped_one_mass": shipped_one_mass,
    "shipped_two_mass": shipped_two_mass,
    "two_mass": two_mass,
    "arm": two_link_arm,
    "cancellation": inputs.cancellation,
    "two_mass_cancellation": inputs.two_mass_cancellation,
    "topology": topology.contacts_of_masses,
    "rotated": topology.rotated_coordinates,
    "directions": topology.directions,
    "extended": topology.extended_friction,
    "generalised": generalised.generalised_coordinates,
    "time_dependent": generalised.time_dependent_constraints,
}
