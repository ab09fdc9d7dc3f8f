"""Our own derivations, by subject. To add one, write a file with its builder and a line here."""

from collections.abc import Callable
from functools import partial

from codegen.thesis.audit.derivation import Derivations
from codegen.thesis.audit.derivations import appendix_a, inputs, laws, machines, many, one

DERIVATIONS: dict[str, Callable[[], Derivations]] = {
    "laws": laws.friction_laws,
    "piecewise": laws.piecewise_inverse,
    "one": one.one_equations,
    "compensated": one.compensated,
    "coulomb": one.one_coulomb,
    "tracking": one.one_tracking,
    "coulomb_estimated": one.one_coulomb_estimated,
    "tracking_estimated": one.one_tracking_estimated,
    "dynamic": one.one_dynamic,
    "dynamic_estimated": one.one_dynamic_estimated,
    "rig": one.rig_equations,
    "many": many.many_equations,
    "many_static": many.many_static,
    "many_static_estimated": many.many_static_estimated,
    "many_dynamic": many.many_dynamic,
    "many_dynamic_estimated": many.many_dynamic_estimated,
    "single": one.single_equations,
    "single_errors": one.single_errors,
    "shipped_one_mass": machines.shipped_one_mass,
    "shipped_two_mass": machines.shipped_two_mass,
    "two_mass": machines.two_mass,
    "arm": machines.two_link_arm,
    "cancellation": inputs.cancellation,
    "two_mass_cancellation": inputs.two_mass_cancellation,
    "topology": appendix_a.contacts_of_masses,
    "rotated": appendix_a.rotated_coordinates,
    "directions": appendix_a.directions,
    "extended": appendix_a.extended_friction,
    "generalised": appendix_a.generalised_coordinates,
    "time_dependent": partial(appendix_a.generalised_coordinates, on_time=True),
}
