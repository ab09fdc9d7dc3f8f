"""Export of the generated observer: the common base of its targets, the Arduino library and the Simulink block."""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from codegen.base.errors import BadInput
from codegen.base.files import sha256
from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.certify.outcome import Certificate, Refusal
from codegen.emit.header import manifest_text
from codegen.emit.writer import entries
from codegen.program import Program


@dataclass(frozen=True)
class GeneratedObserver:
    """The generated code of a spec's observer in one precision, with its certificate.

    Attributes:
        sources: file → text of the C and of the Python twin.
        certify: function that computes the certificate, or the reason why there is none. It is slow, so it is called
            only by targets that can represent the observer.
    """

    program: Program
    sources: Mapping[str, str]
    certify: Callable[[], Certificate | Refusal]

    @property
    def certified(self) -> bool:
        """Whether the observer has a certificate."""
        return isinstance(self.certify(), Certificate)

    @property
    def claim(self) -> str:
        """The certified rate in words, or the reason of the refusal."""
        outcome = self.certify()
        if isinstance(outcome, Refusal):
            return outcome.reason
        return f"Certified rate {outcome.decay_rate:.6g} 1/s over the envelope, by `stiction certify`."

    @property
    def period(self) -> float:
        """The observer's sample time, s."""
        return next(p.value for p in self.program.parameters if p.name == "sample_time" and p.value is not None)

    def words(self, header: list[str]) -> dict[str, Any]:
        """Variables that the templates of all targets use."""
        program = self.program
        return {
            "program": program,
            "name": program.name,
            "version": VERSION,
            "header": header,
            "inputs": entries(program, "inputs"),
            "outputs": entries(program, "outputs"),
            "claim": self.claim,
            "period": repr(self.period),
        }

    def c(self, folder: str = "") -> dict[str, str]:
        """NAME.h and NAME.c, with their path in a folder → text."""
        return {f"{folder}{file}": self.sources[file] for file in (f"{self.program.name}.h", f"{self.program.name}.c")}


def with_manifest(files: Mapping[str, str]) -> dict[str, str]:
    """The files, and a manifest with their hashes, by which a later run recognises files that it may overwrite."""
    hashes = {name: sha256(text) for name, text in sorted(files.items())}
    manifest = {"tool": {"name": "stiction", "version": VERSION}, "files": hashes}
    return {**files, "manifest.json": manifest_text(manifest)}


_ARDUINO_MACROS = re.compile(
    r"B[01]{1,8}|HIGH|LOW|(IN|OUT)PUT(_\w+)?|((HALF|TWO)_)?PI|DEG_TO_RAD|RAD_TO_DEG|EULER|SERIAL|DISPLAY|[LM]SBFIRST|CHANGE|"
    r"FALLING|RISING|DEFAULT|EXTERNAL|INTERNAL\w*|LED_BUILTIN\w*|F_CPU|AVR|ARDUINO\w*"
)
"""Names that Arduino.h, which the IDE puts before every sketch, or a board's compiler defines as numbers."""


def arduino_library(observer: GeneratedObserver, header: list[str]) -> dict[str, str]:
    """A library in single precision for the Arduino IDE and PlatformIO.

    library.properties, library.json, src/NAME.h, src/NAME.c, an example, a README and the manifest.

    Raises BadInput for a name that is a macro in a sketch.
    """
    name = observer.program.name
    for field in filter(_ARDUINO_MACROS.fullmatch, observer.program.places):
        found = f"the name `{field}`, which Arduino.h defines as a number"
        raise BadInput("--to", found, "another name in the spec", f"{field}_1", code="SPEC009")
    words = observer.words(header) | {"period": f"{round(observer.period * 1e6)}"}
    package = {
        "name": f"stiction_{name}",
        "version": VERSION,
        "description": f"Friction observer {observer.program.kind} of {name}, generated",
        "frameworks": "*",
        "platforms": "*",
        "headers": f"{name}.h",
        "build": {"flags": ["-ffp-contract=off"]},
    }
    files = {
        "library.properties": render("export/arduino/library.properties.j2", **words),
        "library.json": json.dumps(package, indent=2) + "\n",
        **observer.c("src/"),
        f"examples/{name}_serial/{name}_serial.ino": render("export/arduino/example.ino.c.j2", **words),
        "README.md": render("export/arduino/README.md.j2", **words),
    }
    return with_manifest(files)


def simulink_block(observer: GeneratedObserver, header: list[str]) -> dict[str, str]:
    """A level-2 C MEX S-function: NAME_sfun.c, NAME.h, NAME.c, the script that builds them, a README, the manifest."""
    name, words = observer.program.name, observer.words(header)
    files = {
        f"{name}_sfun.c": render("export/simulink/sfun.c.j2", **words),
        **observer.c(),
        f"build_{name}.m": render("export/simulink/build.m.j2", **words),
        "README.md": render("export/simulink/README.md.j2", **words),
    }
    return with_manifest(files)
