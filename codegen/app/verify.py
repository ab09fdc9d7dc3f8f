"""``stiction verify``: a certificate or a proof of the C, checked by the independent checker."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codegen.base.border import verb
from codegen.base.errors import BadInput, Place
from codegen.base.input_files import is_there, read_text
from codegen.base.result import Shown
from codegen.checker import verify as checker

if TYPE_CHECKING:
    from codegen.app.derived import Derived

CERTIFICATE = "a certificate (JSON)"
FORMAT = "stiction-verification/1"
REFUSED = 3
WORDS = {0: "verified", checker.DOMAIN: "verified_under_conditions", checker.NO_CODE: "not_bound", REFUSED: "refused"}
"""Exit status of ``verify`` → the word for it in its JSON."""
NAMES = (checker.CERTIFICATE, checker.PROOF, checker.SETS)
"""Claims about the code that ``generate`` writes where it can."""

BELOW = (f"*/{checker.CERTIFICATE}", f"generated/*/{checker.CERTIFICATE}")
"""Certificates below a folder that has none: of ``generated``, and of a diagnosis."""


@dataclass(frozen=True, repr=False)
class Verified(Shown):
    """The report of the checker."""

    report: checker.Report

    @property
    def summary(self) -> Mapping[str, object]:
        proved = "; ".join(map(str.strip, checker.in_short(self.report))) or "nothing"
        return {"machine": self.report.name, "status": WORDS[checker.status(self.report)], "proved of the C": proved}

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object that ``stiction verify --json`` prints."""
        return _outcome(checker.status(self.report)) | self.report._asdict()


def _outcome(status: int) -> dict[str, Any]:
    """The fields with which the JSON of every outcome begins; ``verified`` is true only of what is proved of the C."""
    return {"format": FORMAT, "status": WORDS[status], "verified": status in (0, checker.DOMAIN)}


def certificate_in(path: str | Path) -> Path:
    """The certificate of a path: the file itself, or certificate.json in a folder of generated code.

    Raises BadInput for a folder without a certificate, or a proof that is not in its folder of generated code; it says
    why, as far as the folder's manifest.json does, and which command makes it.
    """
    given = Path(path)
    path = given / checker.CERTIFICATE if is_there(given) and given.is_dir() else given
    of_generated = path != given or (path.name in NAMES and is_there(path.parent / "manifest.json"))
    if of_generated and not is_there(path):
        below = [one for pattern in BELOW for one in sorted(path.parent.glob(pattern))]
        if below:
            expected = "a certificate, or the folder of generated code that has one"
            raise BadInput(str(path.parent), f"no {path.name}", expected, str(below[0].parent), code="FILE001")
        found, expected = checker.absent(path.parent, path.name)
        raise BadInput(str(path.parent), found, f"one: {expected}", code="FILE001")
    return path


@verb
def verify(certificate: str | Path, spec: str | Path | None = None) -> Verified:
    """Check a certificate or a proof by the independent checker, with the files in the same folder.

    Args:
        certificate: the file, or the folder with a certificate.json.

    Raises:
        BadInput: if the file cannot be read.
        codegen.checker.verify.Refused: if the claim does not hold.
    """
    path, spec = certificate_in(certificate), None if spec is None else Path(spec)
    try:
        return Verified(checker.check(read_text(path, CERTIFICATE, checker.MAX_TEXT), path.parent, spec))
    except json.JSONDecodeError as error:
        raise _no_json(path, error) from None
    except OSError as error:  # a file in its folder, or the spec
        found = f"unreadable ({error.strerror})"
        expected = "a file that the certificate names"
        raise BadInput(str(error.filename or path), found, expected, code="FILE001") from None
    except ValueError as error:
        raise BadInput(str(path), f"no certificate ({error})", CERTIFICATE, code="CALL003") from None


def readable(path: str | Path, spec: str | Path | None = None) -> None:
    """Raise BadInput for an unreadable spec, or a certificate that is unreadable, too large or not JSON."""
    if spec is not None:
        read_text(Path(spec), "a spec file (YAML)")
    text = read_text(Path(path), CERTIFICATE, checker.MAX_TEXT)
    try:
        json.loads(text)
    except json.JSONDecodeError as error:
        raise _no_json(Path(path), error) from None
    except (ValueError, RecursionError):
        pass  # the checker reports these


def _no_json(path: Path, error: json.JSONDecodeError) -> BadInput:
    spec = path.suffix.lower() in (".yaml", ".yml")
    hint = f"; this is a spec: `stiction generate {path.name}` writes its certificate" if spec else ""
    return BadInput(Place(str(path), error.lineno), "text that is not JSON", f"{CERTIFICATE}{hint}", code="CALL003")


def print_verification(path: str | Path, spec: str | Path | None = None, details: bool = False) -> int:
    """Print what the checker says of a certificate or a proof, and return its exit status.

    Args:
        details: whether what the claim rests on, all proved statements and all assumptions are printed too.

    Raises BadInput as ``readable``; the checker says that too, but knows no codes of errors.
    """
    readable(path, spec)
    return checker.main([str(path), *(["--spec", str(spec)] if spec is not None else [])], details)


@verb
def verification_json(certificate: str | Path, spec: str | Path | None = None) -> tuple[dict[str, Any], int]:
    """The JSON object of ``stiction verify --json``, and the command's exit status.

    Raises BadInput if the file cannot be read.
    """
    try:
        found = verify(certificate, spec)
    except checker.Refused as error:
        return _outcome(REFUSED) | {"refused": str(error)}, REFUSED
    return found.content, checker.status(found.report)


def verify_machine(machine: Derived) -> Verified:
    """Check the certificate that ``generate`` would write for a machine, together with its other files.

    Raises:
        BadInput: for a machine without a certificate.
        codegen.checker.verify.Refused: if the claim does not hold.
    """
    from codegen.certify.outcome import Refusal

    if isinstance(machine.outcome, Refusal):
        found = f"no certificate ({machine.outcome.reason})"
        raise BadInput(machine.spec.place("name"), found, "a certified machine", code="CALL003")
    sources = {name: text.encode() for name, text in machine.files.items()}
    return Verified(checker.check(machine.outcome.text, None, machine.spec.path, sources))
