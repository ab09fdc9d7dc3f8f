"""Every figure's plot by its number."""

from codegen.thesis.gallery import arm, cancelling, hysteresis, laws, rig, servo, two_mass
from codegen.thesis.gallery.figure import Plot

PLOTS: dict[str, Plot] = {
    **laws.PLOTS,
    **servo.PLOTS,
    **two_mass.PLOTS,
    **arm.PLOTS,
    **cancelling.PLOTS,
    **hysteresis.PLOTS,
    **rig.PLOTS,
}
