"""``stiction export``: the machine of a spec in the format of a simulator, a firmware or a controller."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from codegen.app.derived import Source, derived_from
from codegen.app.generate import refuse_edited, refuse_hand_written
from codegen.base.border import verb
from codegen.base.errors import BadInput, refuse_unknown
from codegen.base.files import refuse_target, write_all, write_atomically
from codegen.base.input_files import LARGEST_GENERATED, is_there, read_text
from codegen.base.result import Result, named
from codegen.base.user_text import file_text
from codegen.base.version import VERSION
from codegen.export.exporter import Remark
from codegen.export.targets import TARGETS, Choices
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree

MARK = "Written by stiction export"


@dataclass(frozen=True, repr=False)
class Exported(Result):
    """The files of ``export``.

    Attributes:
        files: names in a folder; () for a single file.
        remarks: how the machine is represented, with the force errors.
    """

    template = "exported"
    path: Path
    target: str
    files: tuple[str, ...]
    remarks: tuple[Remark, ...]

    @property
    def summary(self) -> Mapping[str, object]:
        lost = [r.where for r in self.remarks if r.held == "dropped"]
        return {"file": self.path, "format": self.target, "not represented": ", ".join(lost) or "nothing"}

    @property
    def content(self) -> dict[str, Any]:
        remarks = [asdict(r) for r in self.remarks]
        own = named(self, "target files")
        return {"format": "stiction-export/1", **own, "path": str(self.path), "remarks": remarks}


@verb
def export(
    source: Source,
    to: str,
    out: str | Path,
    on: str | None = None,
    counts: int | None = None,
    gear: float | None = None,
    into: str | Path | None = None,
) -> Exported:
    """Write the machine of a spec, with its friction laws and declared effects, in another format.

    Args:
        to: a name of ``TARGETS``.
        out: the file; for a format of several files the folder.
        on: the coordinate of a map; needed if several have a force that repeats with the position.
        counts: rows of a turn in a map; 3600 by default.
        gear: turns of the motor per turn of the joint, for a map over the motor's turn, as of ``odrive``.
        into: a MuJoCo model that is written with the spec's friction, else unchanged.

    Raises:
        BadInput: for a bad spec, an unknown format, a machine that the format cannot represent, or a file that
            stiction did not write.
    """
    expected = "`stiction generate --target fmu`" if to == "fmu" else None
    refuse_unknown(to, TARGETS, "--to", "", expected, code="CALL001")
    target, path = TARGETS[to], Path(out)
    machine = derived_from(source)
    spec = machine.spec
    sources = {"the spec itself": spec.path}
    if isinstance(spec.form, KinematicTree) and spec.form.path is not None:
        sources["the robot file that the spec names"] = spec.form.path
    if into is not None:
        if to != "mjcf":
            raise BadInput("--into", f"a file to take what was found, and --to {to}", "--to mjcf", code="CALL002")
        sources["the model that it is made of, which stays as it is"] = Path(into)
    _refuse_options_of_other_formats(to, on, counts, gear)
    if not target.endings:
        refuse_target(path / "manifest.json")
    else:
        refuse_target(path, sources, target.endings)
        if is_there(path) and MARK not in read_text(path, "a file that stiction wrote", LARGEST_GENERATED)[:4096]:
            found = "a file that stiction did not write"
            raise BadInput(str(path), found, "another name; nothing was replaced", code="FILE004")
    model = None if into is None else Path(into)
    choices = Choices(_header(spec, to), on, Choices.counts if counts is None else counts, gear, model)
    files, remarks = target.write(spec, machine.system, machine.generated_observer, choices)
    if not target.endings:
        refuse_hand_written(path, files)
        refuse_edited(path, files)
        write_all(path, files, ("manifest.json",))
        return Exported(path, to, tuple(files), remarks)
    write_atomically(path, files[""])
    return Exported(path, to, (), remarks)


def _refuse_options_of_other_formats(to: str, on: str | None, counts: int | None, gear: float | None) -> None:
    """Raise BadInput for an option that the format does not use."""
    maps = [name for name, known in TARGETS.items() if known.is_map]
    for option, given, what, used_by in (
        ("--gear", gear, "a ratio for a map over the motor's turn", maps),
        ("--on", on, "the coordinate of a map", maps),
        ("--counts", counts, "the number of rows of a map", ["csv-map"]),
    ):
        if given is not None and to not in used_by:
            expected = " or ".join(f"--to {name}" for name in used_by)
            raise BadInput(option, f"{what}, and --to {to}", expected, code="CALL002")


def _header(spec: Spec, to: str) -> list[str]:
    """Comment lines with the origin of a file; without a date, so that the same spec gives the same bytes."""
    file = file_text(spec.path.name)
    robot = [] if spec.robot is None else [f"robot file {file_text(spec.robot[0])}, SHA-256 {spec.robot[1]}"]
    return [f"{MARK} {VERSION} from {file}, format {to}", f"spec SHA-256 {spec.sha256}", *robot]
