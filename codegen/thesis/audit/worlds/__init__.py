"""Our own derivations, by subject. Adding one: a file with its builder, and a line here."""

from collections.abc import Callable

from codegen.thesis.audit.world import World
from codegen.thesis.audit.worlds.arm import two_link_arm
from codegen.thesis.audit.worlds.generalised import generalised_coordinates, time_dependent_constraints
from codegen.thesis.audit.worlds.inputs import cancellation, two_mass_cancellation
from codegen.thesis.audit.worlds.laws import friction_laws, piecewise_inverse
from codegen.thesis.audit.worlds.many_equations import many_equations
from codegen.thesis.audit.worlds.many_errors import (
    many_dynamic,
    many_dynamic_estimated,
    many_static,
    many_static_estimated,
)
from codegen.thesis.audit.worlds.one_dynamic import one_dynamic, one_dynamic_estimated
from codegen.thesis.audit.worlds.one_equations import compensated, one_equations, rig_equations
from codegen.thesis.audit.worlds.one_errors import (
    one_coulomb,
    one_coulomb_estimated,
    one_tracking,
    one_tracking_estimated,
)
from codegen.thesis.audit.worlds.shipped import shipped_one_mass, shipped_two_mass
from codegen.thesis.audit.worlds.single import single_equations, single_errors
from codegen.thesis.audit.worlds.topology import contacts_of_masses, directions, extended_friction, rotated_coordinates
from codegen.thesis.audit.worlds.two_mass import two_mass

WORLDS: dict[str, Callable[[], World]] = {
    "laws": friction_laws,
    "piecewise": piecewise_inverse,
    "one": one_equations,
    "compensated": compensated,
    "coulomb": one_coulomb,
    "tracking": one_tracking,
    "coulomb_estimated": one_coulomb_estimated,
    "tracking_estimated": one_tracking_estimated,
    "dynamic": one_dynamic,
    "dynamic_estimated": one_dynamic_estimated,
    "rig": rig_equations,
    "many": many_equations,
    "many_static": many_static,
    "many_static_estimated": many_static_estimated,
    "many_dynamic": many_dynamic,
    "many_dynamic_estimated": many_dynamic_estimated,
    "single": single_equations,
    "single_errors": single_errors,
    "shipped_one_mass": shipped_one_mass,
    "shipped_two_mass": shipped_two_mass,
    "two_mass": two_mass,
    "arm": two_link_arm,
    "cancellation": cancellation,
    "two_mass_cancellation": two_mass_cancellation,
    "topology": contacts_of_masses,
    "rotated": rotated_coordinates,
    "directions": directions,
    "extended": extended_friction,
    "generalised": generalised_coordinates,
    "time_dependent": time_dependent_constraints,
}

__all__ = ["WORLDS"]
