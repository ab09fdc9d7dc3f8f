"""``stiction diagnose``: the effects that a model lacks, identified from a measured log."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codegen.app.derived import Derived, Source, derived_from
from codegen.app.diagnosis_folder import (
    DIAGNOSIS_FILES,
    EXCITATION,
    RESULT,
    hashes_of,
    log_sha256,
    refuse_another_log,
    refuse_edited_file,
    refuse_not_ours,
    stale_excitation,
)
from codegen.base.border import verb
from codegen.base.errors import BadInput, Place
from codegen.base.files import refuse_target, remove, write_all
from codegen.base.input_files import identity, read_text
from codegen.base.own_files import FILES_SHA256
from codegen.base.progress import begin
from codegen.base.result import Result, json_text
from codegen.base.text import render
from codegen.diagnosis.case import Findings
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import MATERIAL, CertificateChange, Diagnosis, FoundEffect, Verdict
from codegen.logs import Allowance, read_logs
from codegen.spec import parse_spec
from codegen.spec.free_gains import free_gains_in_words
from codegen.spec.quantity import read_part
from codegen.spec.urdf import LARGEST as LARGEST_URDF

if TYPE_CHECKING:
    from codegen.certify.outcome import Certificate, Refusal
    from codegen.spec import Spec

Progress = Callable[[str, float], None]


@dataclass(frozen=True, repr=False)
class Diagnosed(Result):
    """The result of ``diagnose``, and its files.

    Attributes:
        notes: on how each log was read.
        log_sha256: of the files of the training log.
    """

    template = "diagnosed"
    diagnosis: Diagnosis
    folder: Path
    files: tuple[str, ...]
    notes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    log_sha256: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """``effect``, ``none``, ``ambiguous``, ``unknown`` or ``unfit``."""
        return self.diagnosis.verdict

    @property
    def effects(self) -> tuple[FoundEffect, ...]:
        """The effects that were found, with parameters in SI and their 95 % intervals."""
        return self.diagnosis.effects

    @property
    def summary(self) -> Mapping[str, object]:
        return {**self.diagnosis.summary, "folder": self.folder}

    @property
    def content(self) -> dict[str, Any]:
        written = {**self.diagnosis.as_json(), "log_sha256": list(self.log_sha256)}
        return {**written, "folder": str(self.folder), "files": list(self.files)}

    def text(self, **options: object) -> str:
        """The result in words.

        Options: ``preflight_shown``, whether the preflight is left out, since it was printed before; ``paths``, whether
        the files are listed.
        """
        return super().text(**{"preflight_shown": False, "paths": True, **options})


@verb
def diagnose(
    source: Source,
    log: str | Path | Sequence[str | Path],
    test: str | Path | Sequence[str | Path] | None = None,
    out: str | Path | None = None,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    progress: Progress | None = None,
    propose: bool = False,
    material: str | float | None = None,
    tell: Callable[[Findings], None] = lambda found: None,
    force: bool = False,
) -> Diagnosed:
    """Find the effects that a model lacks; write the augmented spec, the report and the code generated from it.

    Args:
        log, test: measured logs, each one file or the several of one experiment; without ``test`` the last part of
            ``log`` is held out.
        out: folder for DIAGNOSIS_FILES and generated/NAME; by default named after the first log.
        description, columns: how the logs name their columns.
        propose: whether PySINDy proposes terms for an unknown residual.
        material: share of the RMS drive force from which on a residual matters, 0.02 or "2 %"; 2 % by default.
        tell: called with the findings of the preflight on each log, before the fits.
        force: whether the folder's results are replaced even if they are of another log, or a file or the generated
            code was edited.

    Raises:
        BadInput: for a bad spec, log or share, or a folder with files that stiction did not write or, without
            ``force``, of another log or edited since; then nothing is written.
    """
    matters = MATERIAL if material is None else read_part(str(material), Place("--material"))
    logs, tests = _files(log), _files(test)
    for file in tests:
        if identity(file) in {identity(other) for other in logs}:
            expected = "another log, or none: the end of LOG is then held out"
            raise BadInput(str(file), "the training log itself as --test", expected, code="LOG014")
    folder = Path(out) if out is not None else Path(f"{Path(logs[0]).stem}_diagnosis")
    read = {"the spec itself": Path(source)} | {f"the log {file}": Path(file) for file in (*logs, *tests)}
    for name in DIAGNOSIS_FILES:
        refuse_target(folder / name, read)
    machine = derived_from(source)
    spec = machine.spec
    robot = _robot_files(spec)
    refuse_not_ours(folder, robot)
    if spec.observer is not None:
        _refuse_code(machine, folder, force)
    begin("reading the logs")
    allowance = Allowance()
    train = read_logs(logs, spec, description=description, columns=columns, allowance=allowance)
    sha256 = log_sha256(logs)
    if not force:
        refuse_another_log(folder, sha256)
        refuse_edited_file(folder)
    held_out = None
    if tests:
        held_out = read_logs(tests, spec, description=description, columns=columns, allowance=allowance)

    def tell_and_load(found: Findings) -> None:
        """Report the findings, and load the report's libraries while the compiler works on the first models."""
        tell(found)
        from codegen.report.style import load_libraries

        load_libraries()

    diagnosis, models = diagnose_log(spec, machine.system, train, held_out, progress, propose, matters, tell_and_load)
    begin("report")
    from codegen.report.page import render_report

    files: dict[str, str] = {**robot, "spec.yaml": models.spec_text}
    stale: list[Path] = []
    if free := free_gains_in_words(spec):
        diagnosis = replace(diagnosis, certificate=CertificateChange(*2 * (f"no code was generated: {free}",)))
    elif spec.observer is not None:
        if progress is not None:
            progress("certificates and code", 0.96)
        change, code, stale = _code(machine, models.spec_text, folder)
        diagnosis = replace(diagnosis, certificate=change)
        files |= code
    if models.excitation is not None:
        files[EXCITATION] = models.excitation
    report = render_report(spec, diagnosis, models, {name: name for name in (*files, RESULT)})
    hashes = hashes_of({**files, "report.html": report})
    files[RESULT] = json_text({**diagnosis.as_json(), "log_sha256": sha256, FILES_SHA256: hashes})
    files["report.html"] = report
    stale += stale_excitation(folder, files)
    write_all(folder, files, (RESULT, "manifest.json"))
    for old in stale:
        remove(old)
    notes = {"train": train.notes} | ({} if held_out is None else {"test": held_out.notes})
    return Diagnosed(diagnosis, folder, tuple(files), notes, tuple(sha256))


def _refuse_code(machine: Derived, folder: Path, force: bool) -> None:
    """Raise BadInput for an observer without code, or, without ``force``, for code in the folder that was edited."""
    # imported here: a third of a second, which a spec without observer does not need
    from codegen.app.check import refuse_ungenerable
    from codegen.app.generate import listed_files, refuse_edited

    refuse_ungenerable(machine.nominal)
    target = folder / "generated" / machine.spec.name
    if not force:
        refuse_edited(target, dict.fromkeys(listed_files(target)), "--force, which discards the edits")


def _code(machine: Derived, augmented: str, folder: Path) -> tuple[CertificateChange, dict[str, str], list[Path]]:
    """The change of the certificate by an augmented spec, its code (path in the folder → text), and stale proofs."""
    from codegen.app.generate import refuse_hand_written, stale_proofs

    made = Derived(parse_spec(augmented, machine.spec.path.parent / "spec.yaml"))
    after = _outcome(made)
    before = after if made.spec.sha256 == machine.spec.sha256 else _outcome(machine)
    generated = {} if isinstance(after, str) else made.files
    place = f"generated/{made.spec.name}"
    refuse_hand_written(folder / place, generated)
    stale = stale_proofs(folder / place, generated) if generated else []
    return certificate_change(before, after), {f"{place}/{name}": text for name, text in generated.items()}, stale


def _robot_files(spec: Spec) -> dict[str, str]:
    """Name → text of the spec's robot file, if it lies below the spec's folder; the augmented spec needs it too."""
    if spec.robot is None or {"..", "/"} & {*Path(spec.robot[0]).parts}:
        return {}
    name = spec.robot[0]
    return {name: read_text(spec.path.parent / name, "a robot description (URDF)", LARGEST_URDF)}


def findings_text(found: Findings) -> str:
    """The findings of the preflight as text."""
    return render("text/preflight.j2", findings=found)


def _files(given: str | Path | Sequence[str | Path] | None) -> Sequence[str | Path]:
    if given is None:
        return ()
    return (given,) if isinstance(given, (str, Path)) else tuple(given)


def _outcome(machine: Derived) -> Certificate | Refusal | str:
    """The certificate or its refusal; or why there is no code, which leaves the diagnosis valid."""
    try:
        return machine.outcome
    except BadInput as error:
        return f"no code was generated: {error.found}; expected {error.expected}"


def _rate(outcome: Certificate | Refusal | str) -> float | str:
    from codegen.certify.outcome import Certificate

    if isinstance(outcome, str):
        return outcome
    return outcome.decay_rate if isinstance(outcome, Certificate) else outcome.reason


def certificate_change(before: Certificate | Refusal | str, after: Certificate | Refusal | str) -> CertificateChange:
    """The certified rates before and after, or why there is no code; and the proofs that no longer exist."""
    lost = [(name, why) for name, why in _missing(after).items() if name not in _missing(before)]
    return CertificateChange(_rate(before), _rate(after), () if isinstance(after, str) else tuple(lost))


def _missing(outcome: Certificate | Refusal | str) -> Mapping[str, str]:
    """File of a proof of the C, or of its error bounds, that does not exist → why."""
    from codegen.certify.outcome import Certificate
    from codegen.checker.verify import PROOF, SETS

    return outcome.not_made if isinstance(outcome, Certificate) else dict.fromkeys((PROOF, SETS), "no certificate")
