"""Pictures of the effects as SVG: the force residual of each, in the style of the laws' pictures."""

from __future__ import annotations

from typing import Any

import numpy as np

from codegen.effects import Effect
from codegen.report.effect_examples import PARAMETERS, example_residual
from codegen.report.law_pictures import framed, rounded, svg_of
from codegen.report.style import CURVE

EVERY = 6
"""Every sixth sample is drawn."""


def effect_picture(effect: Effect) -> str:
    """The SVG of an effect's picture."""
    residual = example_residual(effect, PARAMETERS[effect.kind])
    angular = effect.needs == "a coordinate in rad"
    units = {
        "velocity": "velocity in rad/s" if angular else "velocity in m/s",
        "position": "position in rad" if angular else "position in m",
        "load": "drive force in N",
        "time": "time in s",
        "acceleration": "acceleration in m/s²",
        "input": "input in N",
        "input rate": "rate of the input in N/s",
    }
    label = "difference of two velocities in m/s" if effect.sits_on == "two coordinates" else units[effect.seen_over]

    def draw(axes: Any) -> None:
        x, y = rounded(residual.axis[::EVERY]), rounded(residual.force[::EVERY])
        axes.plot(x, y, color=CURVE, linewidth=1.0)
        room = 0.05 * float(np.nanmax(np.abs(y)))
        axes.set_ylim(min(0.0, float(np.nanmin(y))) - room, max(0.0, float(np.nanmax(y))) + room)
        framed(axes, label, "residual in N*m" if angular else "residual in N")

    return svg_of((draw,))
