"""The step on Pinocchio: C++ against the headers of the `pin` wheel, joints and inertias as its Python read them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.measure.build import MACHINE, Missing, Peer
from benchmarks.model import NUDGE, Model
from benchmarks.peers.eigen import eigen_include
from benchmarks.peers.plain_c import SOURCES
from benchmarks.text import render

FLAGS = (
    *("-std=c++17", "-O3", "-DNDEBUG", "-w"),
    *("-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS"),
    "-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",  # as its CMake files say: the algorithms come from its library
)
COMPILE_LIMIT = 400.0


@cache
def pinocchio() -> Any:
    """The module. Raises Missing where it is not installed."""
    try:
        import pinocchio as module
    except ImportError:
        raise Missing("not installed: `pip install pin`") from None
    return module


def prefix() -> Path:
    """The folder of the wheel with include and lib. Raises Missing where the wheel has no headers."""
    for folder in Path(pinocchio().__file__).parents:
        if (folder / "include" / "pinocchio" / "algorithm" / "crba.hpp").exists():
            return folder
    raise Missing("the wheel of Pinocchio has no headers")


def gain_rows(model: Model) -> list[list[float]]:
    """(K_1, K_2, K_v, damping) of each joint of a GTO whose K_1 is zero and whose other gains are diagonal."""
    value = {f.name: f.value or 0.0 for f in model.program.parameters}
    system = model.observer.system
    return [
        [
            value.get(f"K_1_{x}", 0.0),
            value.get(f"K_2_{x}", 0.0),
            value.get(f"K_v_{v}", 0.0),
            value.get(f"viscous_{x}_b", 0.0),
        ]
        for x, v in zip(map(str, system.positions), map(str, system.velocities), strict=True)
    ]


def joint_lines(robot: Path) -> list[dict[str, Any]]:
    """Joints in Pinocchio's order: kind, parent, placement, inertia."""
    model = pinocchio().buildModelFromUrdf(str(robot))
    found = []
    for k in range(1, model.njoints):
        placement, inertia = model.jointPlacements[k], model.inertias[k]
        found.append(
            {
                "kind": model.joints[k].shortname(),
                "parent": model.parents[k],
                "name": model.names[k],
                "rotation": [float(v) for v in placement.rotation.ravel()],
                "offset": [float(v) for v in placement.translation],
                "mass": float(inertia.mass),
                "lever": [float(v) for v in inertia.lever],
                "inertia": [float(v) for v in inertia.inertia.ravel()],
            }
        )
    return found


def pinocchio_peer(model: Model, robot: Path, title: str) -> Peer:
    """crba, nonLinearEffects and LDLT, with the observer around them.

    Raises Missing without the wheel or its headers.
    """
    place = prefix()
    joints = joint_lines(robot)
    n = len(joints)
    sample_time = float(model.observer.sample_time)
    head = render("robot.h.j2", joints=joints, gains=gain_rows(model), sample_time=sample_time, nudge=NUDGE)
    files = {"robot.h": head, "pinocchio.cpp": (SOURCES / "pinocchio.cpp").read_text(encoding="utf-8")}
    flags = (*FLAGS, *MACHINE, f"-I{place / 'include'}", f"-I{eigen_include()}", f"-DJOINTS={n}")
    libraries = (f"-L{place / 'lib'}", f"-Wl,-rpath,{place / 'lib'}", "-lpinocchio_default")
    return Peer(title, files, "pinocchio_step", 2 * n, 3 * n, "g++", flags, libraries, limit=COMPILE_LIMIT)
