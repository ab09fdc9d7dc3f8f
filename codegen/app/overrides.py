"""What a command asks of the generated code beside the spec: precision, fault policy, targets."""

from __future__ import annotations

from dataclasses import dataclass, replace

from codegen.base.errors import refuse_unknown
from codegen.emit import ALWAYS, PRINTERS
from codegen.program.model import FAULTS, PRECISIONS
from codegen.spec import Spec
from codegen.spec.model import CodeChoice


@dataclass(frozen=True)
class Overrides:
    """What the command asks for beside the spec; None and () where the spec and the default hold."""

    precision: str | None = None
    fault: str | None = None
    targets: tuple[str, ...] = ()

    @property
    def printers(self) -> tuple[str, ...]:
        """The names in PRINTERS that are asked for, in its order."""
        return tuple(PRINTERS) if "all" in self.targets else self.targets or ALWAYS

    def applied(self, spec: Spec) -> Spec:
        """The spec with the command's choices.

        Raises BadInput for a precision, a fault policy or a target that there is not.
        """
        for option, value, known in (("--precision", self.precision, PRECISIONS), ("--fault", self.fault, FAULTS)):
            if value is not None:
                refuse_unknown(value, known, option, "", " or ".join(known), code="CALL001")
        targets = (*PRINTERS, "all")
        expected = f"one of {', '.join(targets)}, or fmu alone"
        for target in self.targets:
            refuse_unknown(target, targets, "--target", "", expected, code="CALL001")
        return replace(spec, code=CodeChoice(self.precision or spec.code.precision, self.fault or spec.code.fault))

    @property
    def options(self) -> str:
        """As in the command, a space before each."""
        given = [("--precision", self.precision), ("--fault", self.fault), *(("--target", t) for t in self.targets)]
        return "".join(f" {option} {value}" for option, value in given if value is not None)
