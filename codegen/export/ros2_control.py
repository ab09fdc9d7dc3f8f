"""Export of the generated C as a chainable controller of ros2_control that adds the cancelling input to an effort.

For each input w the controller has a reference r and commands r + ū, with ū of the spec's ``cancellation:`` section or
its defaults. The estimate is that of the same instant, from a step on a copy of the state: ū of a sample does not
depend on w of that sample.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codegen.base.text import render
from codegen.cancellation import cancelling_outputs
from codegen.cancellation.law import GAIN
from codegen.export.generated_observer import GeneratedObserver, with_manifest
from codegen.mechanics.system import System

FRICTION = "F_hat"
_LABEL = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*")


@dataclass(frozen=True)
class Port:
    """A field of the C structs, and the joint to which it belongs.

    Attributes:
        field: as written after the struct's name.
        joint: default name of the joint; for an estimate the name of the output.
        interface: of ros2_control, such as ``position``.
        unit: SI.
    """

    field: str
    joint: str
    interface: str
    unit: str


def ros2_package(
    observer: GeneratedObserver, system: System, header: list[str], labels: Mapping[str, str]
) -> dict[str, str]:
    """package.xml, CMakeLists.txt, the plugin's description, the class, NAME.h, NAME.c, a README and the manifest.

    ``labels``: coordinate → the joint's name in a robot file; used if it is a valid name in ROS.
    """
    labels = {name: label for name, label in labels.items() if _LABEL.fullmatch(label)}
    program, name = observer.program, observer.program.name
    words = observer.words(header) | {
        "package": f"stiction_{name}_controller",
        "space": f"stiction_{name}",
        "certified": observer.certified,
        "rate": f"{1 / observer.period:.6g}",
        "measured": _measured(observer, system, labels),
        "commands": [
            Port(program.reference(w.name), labels.get(joint, joint), "effort", unit)
            for w, joint, unit in zip(system.inputs, _driven(system), system.input_units, strict=True)
        ],
        "cancelling": [program.reference(output) for output in cancelling_outputs(system)],
        "gain": program.reference(GAIN),
        "default_gain": repr(next(p.value for p in program.parameters if p.name == GAIN)),
        "estimates": [
            Port(program.reference(output), re.sub(r"\W", "_", output), "", unit)
            for output, unit, _ in program.outputs
            if output.startswith(FRICTION)
        ],
    }
    base = "export/ros2_control"
    files = {
        "package.xml": render(f"{base}/package.xml.j2", **words),
        "CMakeLists.txt": render(f"{base}/CMakeLists.txt.j2", **words),
        "plugin.xml": render(f"{base}/plugin.xml.j2", **words),
        f"include/{words['package']}/friction_compensation.hpp": render(f"{base}/controller.hpp.h.j2", **words),
        "src/friction_compensation.cpp": render(f"{base}/controller.cpp.c.j2", **words),
        **observer.c("src/"),
        "README.md": render(f"{base}/README.md.j2", **words),
    }
    return with_manifest(files)


def _measured(observer: GeneratedObserver, system: System, labels: Mapping[str, str]) -> list[Port]:
    program = observer.program
    kinds: dict[str, tuple[str, str, str]] = {}
    for x, v, unit in zip(system.positions, system.velocities, system.position_units, strict=True):
        kinds |= {x.name: ("position", x.name, unit), v.name: ("velocity", x.name, f"{unit}/s")}
    found = [(f.name, *kinds[f.name]) for f in program.inputs if f.name in kinds]
    return [Port(program.reference(name), labels.get(q, q), kind, unit) for name, kind, q, unit in found]


def _driven(system: System) -> Sequence[str]:
    """The joint of each input: the only coordinate on which it acts, or else the input's name."""
    names = []
    for w in system.inputs:
        pushed = [x.name for x, row in zip(system.positions, system.force, strict=True) if w in row.free_symbols]
        names.append(pushed[0] if len(pushed) == 1 else w.name)
    return names if len(set(names)) == len(names) else [w.name for w in system.inputs]
