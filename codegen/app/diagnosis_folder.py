"""The folder of a diagnosis: its files, the code of its spec, and checks that other files are not replaced."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from codegen.app.derived import Derived
from codegen.base.errors import BadInput
from codegen.base.files import json_of, refuse_foreign_json, remove, write_all
from codegen.base.input_files import read_text
from codegen.base.own_files import FILES_SHA256, listed_in, refuse_edited_files, refuse_unlisted, text_sha256
from codegen.base.result import json_text
from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.results import CertificateChange, Diagnosis
from codegen.spec import parse_spec
from codegen.spec.free_gains import free_gains_in_words
from codegen.spec.urdf import LARGEST as LARGEST_URDF

if TYPE_CHECKING:
    from codegen.certify.outcome import Certificate, Refusal

    Outcome = Certificate | Refusal | str
    """A certificate, its refusal, or why there is no code."""

RESULT = "diagnosis.json"
EXCITATION = "excitation.csv"
DIAGNOSIS_FILES = (RESULT, "spec.yaml", "report.html", EXCITATION)
IN_EACH = ("spec.yaml", "report.html")
"""Files that every version wrote with diagnosis.json, including versions that wrote no list of their files."""
FORMAT = "stiction-diagnosis/"


def certificate_change(before: Outcome, after: Outcome) -> CertificateChange:
    """The certified rates before and after, or why there is no code; and the proofs that no longer exist."""
    lost = [(name, why) for name, why in _missing(after).items() if name not in _missing(before)]
    return CertificateChange(_rate(before), _rate(after), () if isinstance(after, str) else tuple(lost))


def _outcome(machine: Derived) -> Outcome:
    """The certificate or its refusal; or why there is no code, which leaves the diagnosis valid."""
    try:
        return machine.outcome
    except BadInput as error:
        return f"no code was generated: {error.found}; expected {error.expected}"


def _rate(outcome: Outcome) -> float | str:
    """The certified decay rate, 1/s, or why there is none."""
    from codegen.certify.outcome import Certificate

    if isinstance(outcome, str):
        return outcome
    return outcome.decay_rate if isinstance(outcome, Certificate) else outcome.reason


def _missing(outcome: Outcome) -> Mapping[str, str]:
    """File of a proof of the C, or of its error bounds, that does not exist → why."""
    from codegen.certify.outcome import Certificate
    from codegen.checker.verify import PROOF, SETS

    return outcome.not_made if isinstance(outcome, Certificate) else dict.fromkeys((PROOF, SETS), "no certificate")


def log_sha256(log: Path) -> str:
    """SHA-256 of a log; of a folder, that of the names and bytes of its files.

    Raises BadInput for a file that can no longer be read.
    """
    try:
        if not log.is_dir():
            with log.open("rb") as stream:
                return hashlib.file_digest(stream, "sha256").hexdigest()
        files = sorted(file for file in log.rglob("*") if file.is_file())
        listed = (f"{file.relative_to(log).as_posix()} {log_sha256(file)}\n" for file in files)
        return hashlib.sha256("".join(listed).encode()).hexdigest()
    except OSError as error:
        raise BadInput(str(log), f"unreadable ({error.strerror})", "the log that was read", code="FILE001") from None


@dataclass(frozen=True)
class ResultFolder:
    """The folder into which the results are written.

    Attributes:
        machine: of the given spec.
        force: whether the diagnosis of another log, and files that were edited, are replaced.
    """

    machine: Derived
    folder: Path
    force: bool

    @cached_property
    def robot(self) -> dict[str, str]:
        """Name → text of the spec's robot file, if it lies below the spec's folder; the augmented spec needs it too."""
        spec = self.machine.spec
        if spec.robot is None or {"..", "/"} & {*Path(spec.robot[0]).parts}:
            return {}
        name = spec.robot[0]
        return {name: read_text(spec.path.parent / name, "a robot description (URDF)", LARGEST_URDF)}

    @property
    def _listed(self) -> Mapping[str, object]:
        """The files of an earlier diagnosis there → their hashes."""
        return listed_in(self.folder / RESULT, FORMAT)

    def refuse_foreign_files(self) -> None:
        """Raise BadInput for files that stiction did not write, edited code, and an observer without code."""
        refuse_foreign_json(self.folder / RESULT, FORMAT)
        written = dict.fromkeys(name for name in DIAGNOSIS_FILES if name != RESULT)
        earlier = json_of(self.folder / RESULT, FORMAT)
        ours = IN_EACH if earlier is not None and FILES_SHA256 not in earlier else ()
        named = {**written, **self.robot}
        refuse_unlisted(self.folder, named, self._listed, RESULT, lambda file: file.name in ours, self.force)
        if self.machine.spec.observer is None:
            return
        # imported here: a third of a second, which a spec without observer does not need
        from codegen.app.check import refuse_ungenerable
        from codegen.app.generate import listed_files, refuse_edited

        refuse_ungenerable(self.machine.nominal)
        target = self.folder / "generated" / self.machine.spec.name
        if not self.force:
            refuse_edited(target, dict.fromkeys(listed_files(target)), "--force, which discards the edits")

    def refuse_earlier_results(self, sha256: Sequence[str]) -> None:
        """Raise BadInput, without ``force``, for the diagnosis of logs with other hashes, and for an edited file."""
        content = json_of(self.folder / RESULT, FORMAT)
        if self.force or content is None:
            return
        if content.get("log_sha256") != list(sha256):
            data = content.get("data")
            named = data.get("train") if isinstance(data, dict) else None
            found = f"the diagnosis of another log{f', {named}' if isinstance(named, str) else ''}"
            expected = "another folder by -o DIR, or --force to replace it (nothing was replaced)"
            raise BadInput(str(self.folder), found, expected, code="FILE004")
        ways = "another folder by -o DIR, or --force to discard the edits"
        refuse_edited_files(self.folder, dict.fromkeys(self._listed), self._listed, RESULT, ways)

    def _code(
        self, augmented: str, begun: Callable[[], object]
    ) -> tuple[CertificateChange | None, Mapping[str, str], Sequence[Path]]:
        """The code of the augmented spec, and what it changes of the certificate; nothing without an observer.

        ``begun``: called before a certificate is sought.

        Returns:
            (change of the certificate, path in the folder → text, proofs of an earlier diagnosis that no longer hold).

        Raises:
            BadInput: for a file in the folder that the code would replace and stiction did not write.
        """
        machine = self.machine
        if free := free_gains_in_words(machine.spec):
            return CertificateChange(*2 * (f"no code was generated: {free}",)), {}, ()
        if machine.spec.observer is None:
            return None, {}, ()
        begun()
        from codegen.app.generate import refuse_hand_written, stale_proofs

        made = Derived(parse_spec(augmented, machine.spec.path.parent / "spec.yaml"))
        after = _outcome(made)
        before = after if made.spec.sha256 == machine.spec.sha256 else _outcome(machine)
        generated = {} if isinstance(after, str) else made.files
        place = f"generated/{made.spec.name}"
        refuse_hand_written(self.folder / place, generated)
        stale = stale_proofs(self.folder / place, generated) if generated else []
        files = {f"{place}/{name}": text for name, text in generated.items()}
        return certificate_change(before, after), files, stale

    def write(
        self, diagnosis: Diagnosis, models: Models, sha256: Sequence[str], progress: Callable[[str, float], None] | None
    ) -> tuple[Diagnosis, tuple[str, ...]]:
        """Write all results: the diagnosis with the change of the certificate, and the names of the files."""
        spec, folder = self.machine.spec, self.folder
        change, code, old_proofs = self._code(
            models.spec_text, lambda: progress and progress("certificates and code", 0.96)
        )
        diagnosis = replace(diagnosis, certificate=change)
        files: dict[str, str] = {**self.robot, "spec.yaml": models.spec_text, **code}
        if models.excitation is not None:
            files[EXCITATION] = models.excitation
        from codegen.report.page import render_report

        report = render_report(spec, diagnosis, models, {name: name for name in (*files, RESULT)})
        listed = {name: text for name, text in files.items() if name not in code}  # code has its own manifest
        hashes = {name: text_sha256(text) for name, text in {**listed, "report.html": report}.items()}
        files[RESULT] = json_text({**diagnosis.as_json(), "log_sha256": sha256, FILES_SHA256: hashes})
        files["report.html"] = report
        excitation = [folder / EXCITATION] if EXCITATION in self._listed and EXCITATION not in files else []
        stale = (*old_proofs, *excitation)  # of an earlier diagnosis
        write_all(folder, files, (RESULT, "manifest.json"))
        for old in stale:
            remove(old)
        return diagnosis, tuple(files)
