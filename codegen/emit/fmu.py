"""Functional mock-up unit (FMU) of an observer for co-simulation, FMI 3.0 and 2.0, from its Program and generated C.

Parameters, inputs and outputs of the Program become variables of the FMU. The same spec, compiler and platform give the
same bytes.
"""

from __future__ import annotations

import io
import platform
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from codegen.base.compiler import cached_library
from codegen.base.errors import BadInput, Place
from codegen.base.files import sha256
from codegen.base.resources import resource_folder
from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.program import Program
from codegen.spec.units import base_units

VERSIONS = ("3.0", "2.0")
LONGEST_HEAD = 4096
"""Bytes at the beginning of a model description in which its generator is named."""
EPOCH = (1980, 1, 1, 0, 0, 0)
"""Time stamp of every file in the zip: the earliest that the format has."""
DAMAGED_ZIP = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, RuntimeError, LookupError, struct.error)
"""Exceptions of ``zipfile`` on a damaged archive. A method of compression that it does not know is a RuntimeError."""
_HEADERS = {
    "2.0": ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    "3.0": ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}
_SYSTEMS = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("windows", ".dll")}
_MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
_OF_FMI2 = {"x86_64-linux": "linux64", "x86_64-darwin": "darwin64", "x86_64-windows": "win64"}


@dataclass(frozen=True)
class Fmu:
    """An FMU in memory.

    Attributes:
        members: path in the zip → content.
    """

    name: str
    members: Mapping[str, bytes]
    data: bytes


def emit_fmu(program: Program, files: Mapping[str, str], version: str = "3.0") -> Fmu:
    """Build the co-simulation FMU of an observer from its generated C, which it contains unchanged.

    Args:
        files: name → text of generated/NAME/: NAME.h, NAME.c, README.md and, where there is one, certificate.json.
        version: of FMI, ``3.0`` or ``2.0``.

    Raises:
        BadInput: for another version, a platform for which the version defines no binary folder, a missing C compiler,
            or a quantity with a reserved name (``time``, ``fault``).
    """
    if version not in VERSIONS:
        raise BadInput("--fmi", f"`{version}`", f"one of {', '.join(VERSIONS)}", code="CALL001")
    name, variables = program.name, variables_of(program)
    library = _library(name, version)
    wrapper = f"{name}_fmi{version[0]}.c"
    given: dict[str, Any] = {
        "program": program,
        "variables": variables,
        "units": {v.unit: _exponents(v.unit) for v in variables if v.unit},
        "period": next(v for v in variables if v.role == "constant").start,
        "real": program.real,
        "sources": (f"{name}.c", wrapper),
        "generator": f"stiction {VERSION}",
    }
    token = _token(program, files, version, variables)
    sources = {file: files[file] for file in (f"{name}.h", f"{name}.c")}
    sources[wrapper] = render(f"fmu/fmi{version[0]}.c.j2", token=token, **given)
    folder = resource_folder("templates") / "fmu" / "headers"
    sources |= {file: (folder / file).read_text(encoding="utf-8") for file in _HEADERS[version]}
    binary = cached_library(sources, given["sources"], ("-DFMI3_OVERRIDE_FUNCTION_PREFIX",))

    members: dict[str, str | bytes] = {f"sources/{file}": text for file, text in sources.items()}
    members["modelDescription.xml"] = render(f"fmu/model_description_{version[0]}.xml.j2", token=token, **given)
    if version == "3.0":
        members["sources/buildDescription.xml"] = render("fmu/build_description.xml.j2", **given)
    members[library] = binary
    members |= {f"documentation/{file}": files[file] for file in ("README.md", "certificate.json") if file in files}
    content = {path: text.encode() if isinstance(text, str) else text for path, text in members.items()}
    return Fmu(f"{name}.fmu", content, _zip(content))


def is_ours(data: bytes) -> bool:
    """Whether a file is an FMU whose description says that this tool made it."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive, archive.open("modelDescription.xml") as description:
            return b'generationTool="stiction ' in description.read(LONGEST_HEAD)
    except DAMAGED_ZIP:
        return False


def _library(name: str, version: str) -> str:
    """Path of this platform's binary within the zip."""
    system, ending = _SYSTEMS.get(platform.system(), ("", ""))
    machine = _MACHINES.get(platform.machine().lower(), "")
    folder: str | None = f"{machine}-{system}" if system and machine else None
    if version == "2.0":
        folder = _OF_FMI2.get(folder or "")
    if folder is None:
        found = f"the platform {platform.system()} on {platform.machine()}"
        raise BadInput("--target fmu", found, f"one that FMI {version} has a folder of binaries for", code="TOOL004")
    return f"binaries/{folder}/{name}{ending}"


def _token(program: Program, files: Mapping[str, str], version: str, variables: tuple[Variable, ...]) -> str:
    """The instantiation token: a hash of code and variables as a GUID, the same in description and binary."""
    code = [files[f"{program.name}.h"], files[f"{program.name}.c"]]
    digest = sha256("\0".join([VERSION, version, *code, repr(variables)]))
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"


def _zip(members: Mapping[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for path in sorted(members):
            entry = zipfile.ZipInfo(path, EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if path.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, members[path])
    return buffer.getvalue()


PERIOD = "sample_time"
TIME, FAULT = "time", "fault"
_SI = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}


@dataclass(frozen=True)
class Variable:
    """A scalar variable of an FMU.

    Attributes:
        name, unit, meaning: as in the Program; the unit is empty where it has none.
        role: ``time``, ``parameter``, ``constant``, ``input`` or ``output``.
        place: the C expression of the struct's field in the wrapper.
        integer: whether it is an int in C.
        start: its initial value, as text; None for an output.
    """

    reference: int
    name: str
    unit: str
    meaning: str
    role: str
    place: str
    integer: bool = False
    start: str | None = None


def variables_of(program: Program) -> tuple[Variable, ...]:
    """Time, parameters, inputs and outputs, numbered from 0 in this order.

    Raises BadInput for a quantity with a reserved name (``time``, ``fault``).
    """
    found = [Variable(0, TIME, "s", "time of the simulation", "time", "time")]

    def add(name: str, unit: str, meaning: str, role: str, struct: str, start: str | None = None) -> None:
        place = f"{struct}.{program.reference(name)}"
        unit = "" if unit == "1" else unit
        found.append(Variable(len(found), name, unit, meaning, role, place, start=start))

    for p in program.parameters:
        role = "constant" if p.name == PERIOD else "parameter"
        add(p.name, p.unit, p.meaning, role, "parameters", repr(float(p.value or 0.0)))
    for i in program.inputs:
        add(i.name, i.unit, i.meaning, "input", "inputs", "0.0")
    for name, unit, meaning in program.outputs:
        if name != FAULT:
            add(name, unit, meaning, "output", "outputs")
    if program.holds:
        meaning = "an input was not finite: the estimates are those of the sample before"
        found.append(Variable(len(found), FAULT, "", meaning, "output", f"outputs.{FAULT}", integer=True))
    taken = [variable.name for variable in found]
    for name in (TIME, FAULT):
        if taken.count(name) > 1:
            expected = "another name, since the FMU has a variable of this name already"
            raise BadInput(f"spec {program.name}", f"a quantity called `{name}`", expected, code="SPEC009")
    return tuple(found)


def _exponents(unit: str) -> list[tuple[str, int]]:
    """SI base unit → its integer exponent in a unit; empty for a unit that has no such form."""
    try:
        exponents = base_units(unit, Place(unit))
    except BadInput:
        return []
    powers = {_SI.get(base, ""): power for base, power in exponents.items()}
    if "" in powers or any(float(p) != int(p) for p in powers.values()):
        return []
    return [(base, int(powers[base])) for base in _SI.values() if powers.get(base)]
