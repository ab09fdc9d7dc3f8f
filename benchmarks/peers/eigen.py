"""Eigen's headers, which SymForce's and Pinocchio's C++ need."""

from __future__ import annotations

import sysconfig
from pathlib import Path

from benchmarks.measure.build import Missing

PLACES = (
    Path(sysconfig.get_path("purelib")) / "cmeel.prefix" / "include" / "eigen3",
    Path(sysconfig.get_path("purelib")) / "casadi" / "include" / "eigen3",
    Path("/usr/include/eigen3"),
)


def eigen_include() -> Path:
    """Their folder: of the package cmeel-eigen, which Pinocchio's wheel is built with; or CasADi's; or the system's.

    Raises Missing where there are none.
    """
    for place in PLACES:
        if (place / "Eigen" / "Core").exists():
            return place
    raise Missing("Eigen's headers are not here: `pip install cmeel-eigen`")
