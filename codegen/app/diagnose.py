"""``stiction diagnose``: the effects that a model lacks, identified from a measured log."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from codegen.app.derived import Source, derived_from
from codegen.app.diagnosis_folder import DIAGNOSIS_FILES, ResultFolder, log_sha256
from codegen.base.border import verb
from codegen.base.errors import BadInput, Place
from codegen.base.files import refuse_target
from codegen.base.input_files import identity
from codegen.base.progress import begin, never_falling
from codegen.base.result import Result
from codegen.base.text import render
from codegen.diagnosis.case import Findings
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import MATERIAL, Diagnosis, FoundEffect, Verdict
from codegen.logs import Allowance, read_logs
from codegen.logs.arrays import Given, as_files
from codegen.spec.quantity import read_part

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
    def tied(self) -> tuple[FoundEffect, ...]:
        """With the verdict ``ambiguous``: the effects that the log cannot tell apart, the best first."""
        return self.diagnosis.tied

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
    log: Given | Sequence[Given],
    test: Given | Sequence[Given] | None = None,
    out: str | Path | None = None,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    progress: Progress | None = None,
    propose: bool = False,
    material: str | float | None = None,
    on_findings: Callable[[Findings], None] = lambda found: None,
    force: bool = False,
) -> Diagnosed:
    """Find the effects that a model lacks; write the augmented spec, the report and the code generated from it.

    Args:
        log, test: measured logs, each a file, arrays by the names of columns (a mapping or a DataFrame), or several
            of these from one experiment; without ``test`` the last part of ``log`` is held out.
        out: folder for DIAGNOSIS_FILES and generated/NAME; by default named after the first log.
        description, columns: how the logs name their columns.
        progress: called with a step and the share of the work that is done, 0 to 1, which never decreases.
        propose: whether PySINDy proposes terms for an unknown residual.
        material: share of the RMS drive force from which on a residual matters, 0.02 or "2 %"; 2 % by default.
        on_findings: called with the findings of the preflight on each log, before the fits.
        force: whether the folder's results are replaced even if they are of another log, or a file or the generated
            code was edited.

    Raises:
        BadInput: for a bad spec, log or share, or a folder with files that stiction did not write or, without
            ``force``, of another log or edited since; then nothing is written.
    """
    progress = never_falling(progress) if progress is not None else None
    matters = MATERIAL if material is None else read_part(str(material), Place("--material"))
    with as_files(log=log, test=test) as (logs, tests):
        if not logs:
            raise BadInput("diagnose(): `log`", "an empty list", "one log or more", code="CALL001")
        training = {identity(log) for log in logs}
        for file in tests:
            if identity(file) in training:
                expected = "another log, or none: the end of LOG is then held out"
                raise BadInput(str(file), "the training log itself as --test", expected, code="LOG014")
        folder = Path(out) if out is not None else Path(f"{logs[0].stem}_diagnosis")
        read_files = {"the spec itself": Path(source)} | {f"the log {file}": file for file in (*logs, *tests)}
        for name in DIAGNOSIS_FILES:
            refuse_target(folder / name, read_files)
        machine = derived_from(source)
        results = ResultFolder(machine, folder, force)
        results.refuse_foreign_files()
        begin("reading the logs")
        read = partial(read_logs, spec=machine.spec, description=description, columns=columns, allowance=Allowance())
        train, sha256 = read(logs), [log_sha256(one) for one in logs]
        results.refuse_earlier_results(sha256)
        held_out = read(tests) if tests else None

        def tell_and_load(found: Findings) -> None:
            """Report the findings, and load the report's libraries while the compiler works on the first models."""
            on_findings(found)
            from codegen.report.style import load_libraries

            load_libraries()

        found = diagnose_log(machine.spec, machine.system, train, held_out, progress, propose, matters, tell_and_load)
        begin("report")
        diagnosis, files = results.write(*found, sha256, progress)
        notes = {"train": train.notes} | ({} if held_out is None else {"test": held_out.notes})
        return Diagnosed(diagnosis, folder, files, notes, tuple(sha256))


def findings_text(found: Findings) -> str:
    """The findings of the preflight as text."""
    return render("text/preflight.j2", findings=found)
