"""Registry of the targets of ``stiction export``. Adding one: a function, and a line in TARGETS."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from codegen.export.exporter import Remark
from codegen.export.force_map import csv_map, force_map, odrive_map
from codegen.export.generated_observer import GeneratedObserver, arduino_library, simulink_block
from codegen.export.mechanism import Mechanism, mechanism_of
from codegen.export.mjcf import build_mjcf
from codegen.export.mjcf_into import mjcf_into
from codegen.export.ros2_control import ros2_package
from codegen.export.structured_text import structured_text
from codegen.export.urdf import sdf_text, urdf_text
from codegen.export.usd import usd_text
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree


@dataclass(frozen=True)
class Choices:
    """Options of the command.

    Attributes:
        header: lines of a comment at the top.
        on: the coordinate of a map, or None.
        counts: number of rows of a map per turn.
        gear: revolutions of the motor per revolution of the joint, or None if not given.
        into: a model of the user's, into which friction is written, or None.
    """

    header: list[str]
    on: str | None = None
    counts: int = 3600
    gear: float | None = None
    into: Path | None = None


Written = tuple[Mapping[str, str], tuple[Remark, ...]]
"""Files, name → text, where the name of a single file is ""; and remarks on how they represent the machine."""
ObserverOf = Callable[[str, bool], GeneratedObserver]
"""(precision, whether with the cancelling input, also if the spec has none) → the generated observer."""
Write = Callable[[Spec, System, ObserverOf, Choices], Written]


@dataclass(frozen=True)
class Target:
    """A target of the export.

    Attributes:
        write: function (spec, system, observer_of, choices) → files and remarks.
        endings: of its file; () for a folder.
        is_map: whether it is a table over one turn, for which a gear can be given.
    """

    write: Write
    endings: tuple[str, ...]
    is_map: bool = False


def _of_mechanism(text_of: Callable[[Spec, Mechanism, Choices], tuple[str, tuple[Remark, ...]]]) -> Write:
    """A writer of a file with the machine's bodies, lines and elements."""

    def write(spec: Spec, system: System, _: ObserverOf, choices: Choices) -> Written:
        text, remarks = text_of(spec, mechanism_of(spec, system), choices)
        return {"": text}, remarks

    return write


def _headed(text_of: Callable[[Spec, Mechanism, list[str]], tuple[str, tuple[Remark, ...]]]) -> Write:
    """A writer of such a file in a format without options."""
    return _of_mechanism(lambda spec, mechanism, choices: text_of(spec, mechanism, choices.header))


def _of_code(files_of: Callable[[GeneratedObserver, list[str]], Mapping[str, str]], precision: str) -> Write:
    """A writer of the generated observer for another platform or language."""

    def write(spec: Spec, system: System, observer_of: ObserverOf, choices: Choices) -> Written:
        observer = observer_of(precision, False)
        return files_of(observer, choices.header), (_certified(observer),)

    return write


def _mjcf(spec: Spec, mechanism: Mechanism, choices: Choices) -> tuple[str, tuple[Remark, ...]]:
    if choices.into is not None:
        return mjcf_into(spec, mechanism, choices.into, choices.header)
    model = build_mjcf(spec, mechanism, choices.header)
    return model.text, model.remarks


def _map(spec: Spec, mechanism: Mechanism, choices: Choices, turning: bool) -> tuple[str, tuple[Remark, ...]]:
    """A map over a turn: of ODrive's firmware if ``turning``, else as CSV."""
    table = force_map(spec, mechanism, choices.on, choices.gear, turning)
    return odrive_map(table, choices.header) if turning else csv_map(table, choices.counts, choices.header)


def _ros2_control(spec: Spec, system: System, observer_of: ObserverOf, choices: Choices) -> Written:
    observer = observer_of("double", True)
    labels = {body.joint: body.label for body in spec.form.bodies} if isinstance(spec.form, KinematicTree) else {}
    return ros2_package(observer, system, choices.header, labels), (_certified(observer),)


def _certified(observer: GeneratedObserver) -> Remark:
    how = observer.claim if observer.certified else f"the code is not certified: {observer.claim}"
    return Remark("certificate", "exact" if observer.certified else "dropped", how)


TARGETS: dict[str, Target] = {
    "mjcf": Target(_of_mechanism(_mjcf), (".xml", ".mjcf")),
    "urdf": Target(_headed(urdf_text), (".urdf", ".xml")),
    "sdf": Target(_headed(sdf_text), (".sdf", ".xml")),
    "usd": Target(_headed(usd_text), (".usda",)),
    "csv-map": Target(_of_mechanism(partial(_map, turning=False)), (".csv",), is_map=True),
    "odrive": Target(_of_mechanism(partial(_map, turning=True)), (".h",), is_map=True),
    "arduino": Target(_of_code(arduino_library, "single"), ()),
    "ros2_control": Target(_ros2_control, ()),
    "structured-text": Target(_of_code(structured_text, "double"), (".st", ".scl")),
    "simulink": Target(_of_code(simulink_block, "double"), ()),
}
