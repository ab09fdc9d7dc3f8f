"""``stiction generate --target fmu`` as a function: a spec's observer as a co-simulation FMU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codegen.app.derived import Source, derived_from
from codegen.app.generate import Certifiable
from codegen.app.overrides import Overrides
from codegen.base.border import verb
from codegen.base.errors import BadInput
from codegen.base.files import write_all
from codegen.base.input_files import LARGEST_GENERATED, read_bytes
from codegen.certify.outcome import Certificate, Refusal
from codegen.emit.fmu import VERSIONS, emit_fmu


@dataclass(frozen=True, repr=False)
class GeneratedFmu(Certifiable):
    """What ``generate --target fmu`` made.

    Attributes:
        path: of the FMU.
        version: of FMI.
        members: paths in the zip.
        outcome: the certificate, which lies in the FMU's documentation, or why there is none.
        stale: with ``check_only``, whether the file on disk is missing or not current.
    """

    template = "generated_fmu"
    path: Path
    version: str
    members: tuple[str, ...]
    outcome: Certificate | Refusal
    stale: bool = False

    @property
    def summary(self) -> Mapping[str, object]:
        return {"file": self.path, "FMI": self.version, "members": len(self.members), **self.outcome.summary}

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object that the command prints."""
        return {
            "file": str(self.path),
            "fmi": self.version,
            "members": list(self.members),
            "stale": self.stale,
            **self.verdict,
        }


def _on_disk(path: Path) -> bytes | None:
    try:
        return read_bytes(path, "an FMU", LARGEST_GENERATED)
    except BadInput:
        return None


@verb
def generate_fmu(
    source: Source,
    folder: str | Path | None = None,
    version: str = VERSIONS[0],
    check_only: bool = False,
    uncertified: bool = False,
    overrides: Overrides | None = None,
) -> GeneratedFmu:
    """Build the FMU of a spec's observer with the local C compiler.

    Args:
        folder: where NAME.fmu is written; ``generated/NAME`` by default.
        version: of FMI, ``3.0`` or ``2.0``.
        check_only: write nothing; say whether the file on disk is current.
        uncertified: write it even where no certificate can be given.
        overrides: the command's own choices of precision and fault policy.

    Raises:
        BadInput: for a bad spec, no C compiler, or a folder that cannot be written.
    """
    if version not in VERSIONS:
        raise BadInput("--fmi", f"`{version}`", f"one of {', '.join(VERSIONS)}", code="CALL001")
    machine = derived_from(source).with_overrides(overrides)
    files, outcome = machine.files, machine.outcome
    fmu = emit_fmu(machine.program, dict(files), version)
    target = (Path(folder) if folder is not None else Path("generated") / machine.spec.name) / fmu.name
    members = tuple(sorted(fmu.members))
    if check_only:
        stale = _on_disk(target) != fmu.data
        return GeneratedFmu(target, version, members, outcome, stale)
    if isinstance(outcome, Certificate) or uncertified:
        write_all(target.parent, {target.name: fmu.data})
    return GeneratedFmu(target, version, members, outcome)
