"""``stiction init``: a spec to start from, new, copied from another, or made for a robot file."""

import re
from pathlib import Path

from codegen.app.robot_spec import ENDINGS, robot_files
from codegen.base.border import verb
from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.files import refuse_target, write_all
from codegen.base.input_files import is_there, read_text
from codegen.base.resources import resource_folder
from codegen.base.text import render
from codegen.spec import parse_spec
from codegen.spec.reserved import is_identifier
from codegen.spec.urdf import LARGEST, identifier

SPEC_ENDINGS = (".yaml", ".yml")
_NAME_LINE = re.compile(r"^name:[ \t]*[^#\n]*?(?=[ \t]*(?:#|$))", re.MULTILINE)


def shipped_specs() -> dict[str, Path]:
    """The specs that come with the tool, by path below ``specs/`` without its ending: ``thesis/rig_to``."""
    folder = resource_folder("specs")
    found = {path.relative_to(folder).with_suffix("").as_posix(): path for path in sorted(folder.rglob("*.yaml"))}
    return {name: path for name, path in found.items() if _NAME_LINE.search(path.read_text())}


@verb
def init(
    name: str, source: str | Path | None = None, out: str | Path = ".", log: str | Path | None = None
) -> tuple[Path, ...]:
    """Write NAME.yaml, a commented spec that ``check`` accepts.

    Args:
        name: of the machine and of the file; or a robot file, by whose name the machine is called.
        source: a spec, a shipped one by its name (``specs/two_mass.yaml`` or ``two_mass``), a robot description (URDF)
            or a MuJoCo model (MJCF, .xml); None for a new machine of one mass.
        out: folder to write to.
        log: of a robot; its columns are named in the spec if their names are recognised.

    Returns:
        The files: the spec, and the robot file that it names, if it was not there yet.

    Raises:
        BadInput: for an invalid name, an unusable source, or a file that exists already.
    """
    if source is None and Path(name).suffix.lower() in ENDINGS:
        name, source = identifier(Path(name).stem), name
    if not is_identifier(name):
        stem = Path(name).stem if Path(name).suffix.lower() in SPEC_ENDINGS else name
        near = re.sub(r"\W", "_", stem, flags=re.ASCII)
        expected = "letters a to z, digits and _, starting with a letter, such as my_axis; NAME.yaml is written"
        raise BadInput("NAME", f"`{name}`", expected, near if is_identifier(near) else None, code="SPEC009")
    target = Path(out) / f"{name}.yaml"
    refuse_target(target)
    if is_there(target):
        raise BadInput(str(target), "the file exists already", "another name, or another folder", code="FILE004")
    robot = source is not None and Path(source).suffix.lower() in ENDINGS
    if log is not None and not robot:
        expected = f"a robot file ending in {' or '.join(ENDINGS)}"
        raise BadInput("--log", "a log without a robot file", expected, code="CALL002")
    if source is None:
        files = {target.name: render("text/new_spec.j2", name=name)}
        parse_spec(files[target.name], target)
    elif robot:
        files = robot_files(name, Path(source), None if log is None else Path(log))
    else:
        files = _of_spec(name, _found(source))
    for robot_file in (Path(out) / file for file in [*files] if file != target.name):
        if is_there(robot_file):
            if read_text(robot_file, "a robot description (URDF)", LARGEST) != files[robot_file.name]:
                found = "a different robot file of that name exists"
                raise BadInput(str(robot_file), found, "another folder", code="FILE004")
            del files[robot_file.name]
    write_all(Path(out), files)
    return tuple(Path(out) / file for file in files)


def _found(source: str | Path) -> Path:
    """The file of a spec: an existing file, or a shipped spec."""
    if is_there(Path(source)):
        return Path(source)
    shipped = shipped_specs()
    asked = str(source).removeprefix("specs/").removesuffix(".yaml")
    if asked not in shipped:
        listed = [known for known in shipped if "/" not in known]
        expected = f"a file that is there, or a shipped spec: {', '.join(listed)}, or one of thesis/ and gallery/"
        raise BadInput("--from", f"`{source}`, no such file", expected, nearest_name(asked, shipped), code="FILE001")
    return shipped[asked]


def _of_spec(name: str, path: Path) -> dict[str, str]:
    """A copy of a spec under another name, with its robot file."""
    text = _NAME_LINE.sub(f"name: {name}", read_text(path, "a spec file (YAML)"), count=1)
    spec = parse_spec(text, path)
    if spec.name != name:
        found = f"no line `name: {spec.name}` that can be replaced"
        raise BadInput(Place(str(path)), found, "a line `name: …`", code="SPEC003")
    files = {f"{name}.yaml": text}
    if spec.robot is not None:
        robot = path.parent / spec.robot[0]
        if robot.name != spec.robot[0]:
            found, expected = f"`{spec.robot[0]}`, in another folder", "a robot file in the folder of the spec"
            raise BadInput(spec.place("urdf"), found, expected, code="FILE001")
        if robot.name in files:
            found = f"`{robot.name}`, which the new spec would be called too"
            raise BadInput(spec.place("urdf"), found, "another NAME", code="FILE004")
        files[robot.name] = read_text(robot, "a robot description (URDF)", LARGEST)
    return files
