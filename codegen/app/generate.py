"""``stiction generate`` as a function: all files of generated/NAME/, and whether those on disk are current."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from codegen.analysis.analysis import analyse
from codegen.app.generable import header_of
from codegen.base.border import verb
from codegen.base.errors import BadInput, nearest_name
from codegen.base.files import refuse_target, remove, sha256, write_all, write_atomically
from codegen.base.input_files import LARGEST_GENERATED, is_there, read_or_none, read_text
from codegen.base.text import render
from codegen.cancellation import with_cancellation
from codegen.certify.bound.bound_proof import with_bounds
from codegen.certify.certify import PROOFS, Certificate, Refusal, json_text, withdrawn
from codegen.certify.certify import certify as certify_analysis
from codegen.certify.kernel_form import NotCovered, proof_text, with_solution
from codegen.certify.region_files import REGION_PROOFS
from codegen.checker import newtons
from codegen.checker import verify as checker
from codegen.emit import ALWAYS, PRINTERS
from codegen.emit.package import Header, emit_manifest, emit_readme, emit_sources, proof_lines
from codegen.observers import Observer, observer_of
from codegen.program import Program, build_program
from codegen.program.model import FAULTS, PRECISIONS
from codegen.spec import Spec, read_spec
from codegen.spec.model import CodeChoice
from codegen.spec.numerics import numerical
from codegen.spec.places import placed

CHOSEN = ("splits", "lyapunov_matrix", "slow", "decay_rate", "reversals", "along")  # by the solver, in a certificate
KERNEL_PROOF = checker.PROOF
FOLLOWING = ("certificate", "slip_speed", "bounds")  # what of a bound the certificate's last digits change
REGION = ("variables", "parameters", "matrix", "claim", "assumptions")  # of a region's proof: how far it goes


@dataclass(frozen=True)
class Generated:
    """What ``generate`` made.

    Attributes:
        folder: where the files belong.
        files: name → text.
        outcome: the certificate, or why there is none.
        stale: with ``check``, the files on disk that are missing or not current.
    """

    folder: Path
    files: Mapping[str, str]
    outcome: Certificate | Refusal
    stale: tuple[str, ...] = ()

    @property
    def refused(self) -> bool:
        return isinstance(self.outcome, Refusal)


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

        Raises:
            BadInput: for a precision, a fault policy or a target that there is not.
        """
        for option, value, known in (("--precision", self.precision, PRECISIONS), ("--fault", self.fault, FAULTS)):
            if value is not None and value not in known:
                raise BadInput(option, f"`{value}`", " or ".join(known), nearest_name(value, known))
        for target in self.targets:
            if target not in (*PRINTERS, "all"):
                raise BadInput(
                    "--target",
                    f"`{target}`",
                    f"one of {', '.join((*PRINTERS, 'all'))}, or fmu alone",
                    nearest_name(target, PRINTERS),
                )
        return replace(spec, code=CodeChoice(self.precision or spec.code.precision, self.fault or spec.code.fault))

    @property
    def options(self) -> str:
        """As in the command, a space before each."""
        given = [("--precision", self.precision), ("--fault", self.fault), *(("--target", t) for t in self.targets)]
        return "".join(f" {option} {value}" for option, value in given if value is not None)


@verb
def generate(
    path: str | Path,
    folder: str | Path | None = None,
    check_only: bool = False,
    uncertified: bool = False,
    overrides: Overrides | None = None,
) -> Generated:
    """C, Python, certificate and README of a spec's observer.

    Args:
        folder: where to write; ``generated/NAME`` by default.
        check_only: write nothing; say what on disk is not current.
        uncertified: write the code even where no certificate can be given.
        overrides: the command's own choices of precision, fault policy and targets.

    Raises:
        BadInput: for a bad spec, or a folder that cannot be written or where files lie that we did not write.
    """
    spec = read_spec(path)
    target = Path(folder) if folder is not None else Path("generated") / spec.name
    if not check_only:
        refuse_target(target / "manifest.json")
    files, outcome = generated_files(spec, overrides)
    if check_only:
        return Generated(target, files, outcome, _stale(target, files))
    if isinstance(outcome, Certificate) or uncertified:
        _refuse_folder_of_another(target, spec.name)
        refuse_hand_written(target, files)
        write_all(target, files, ("manifest.json",))
        _make_importable(target, folder)
        _drop_old_proofs(target, spec, files)
    return Generated(target, files, outcome)


def generated_text(made: Generated, check_only: bool, uncertified: bool) -> str:
    """What was written or is not current, in words."""
    given = {"refused": made.refused, "check_only": check_only, "uncertified": uncertified}
    return render("text/generated.txt.j2", result=made, **given)


def generated_files(spec: Spec, overrides: Overrides | None = None) -> tuple[dict[str, str], Certificate | Refusal]:
    """All files of generated/NAME, and the certificate or refusal."""
    _, files, outcome = generated_program(spec, overrides)
    return files, outcome


def generated_program(
    spec: Spec, overrides: Overrides | None = None
) -> tuple[Program, dict[str, str], Certificate | Refusal]:
    """The program that the files are printed from, all files of generated/NAME, and the certificate or refusal.

    Raises:
        BadInput: for a bad spec, or one whose domain has no bound.
    """
    overrides = overrides or Overrides()
    spec = overrides.applied(spec)
    observer = observer_of(spec)
    program, header, files = _sources(spec, observer, overrides)
    hashes = {name: sha256(text) for name, text in files.items()}
    analysis = analyse(spec, observer)
    outcome = certify_analysis(spec, analysis, hashes, header.command.raw, places=_places(program))
    sources = {name: text.encode() for name, text in files.items()}
    try:
        for proof in outcome.proofs.values():
            checker.bound(checker.parsed(proof), sources, None)
    except checker.Refused as error:
        outcome = withdrawn(analysis, str(error))
    if isinstance(outcome, Certificate):
        outcome = with_bounds(spec, analysis, outcome, sources)
        outcome = _with_kernel_proof(outcome, observer, program, sources)
    return program, _complete(files, outcome, program, header), outcome


def _with_kernel_proof(
    certificate: Certificate, observer: Observer, program: Program, sources: Mapping[str, bytes]
) -> Certificate:
    """The certificate with the proof that the kernel accepts for these sources, or why there is none."""
    try:
        proof = proof_text(observer, program.places, certificate.content)
        content = checker.parsed(certificate.text)
        _, unproved, _ = checker.by_kernel(content, {**sources, KERNEL_PROOF: proof.encode()})
    except (NotCovered, checker.Refused) as error:
        return replace(certificate, not_by_kernel=str(error))
    return replace(certificate, kernel=None if unproved else proof, not_by_kernel=unproved)


def _places(program: Program) -> dict[str, str]:
    """Input or output → its place in the twin."""
    inputs = {f.name: f"inputs.{program.reference(f.name)}" for f in program.inputs}
    return inputs | {name: f"outputs.{program.reference(name)}" for name, _, _ in program.outputs}


@numerical("the generated step")
def _sources(spec: Spec, observer: Observer, overrides: Overrides) -> tuple[Program, Header, dict[str, str]]:
    with placed(spec):
        program = build_program(with_cancellation(spec, observer), spec.code)
        header = header_of(spec, overrides.options)
        return program, header, emit_sources(program, header, overrides.printers)


def _complete(
    files: Mapping[str, str], outcome: Certificate | Refusal, program: Program, header: Header
) -> dict[str, str]:
    result = dict(files)
    result |= outcome.proofs
    result["README.md"] = emit_readme(
        program,
        header,
        outcome.content if isinstance(outcome, Certificate) else outcome.reason,
        tuple(files),
        outcome.proofs,
    )
    if isinstance(outcome, Certificate) and outcome.kernel is not None:
        result[KERNEL_PROOF] = outcome.kernel
    result["manifest.json"] = emit_manifest(header, result)
    return result


def _refuse_folder_of_another(target: Path, name: str) -> None:
    """Raise BadInput where another machine's code was generated: half of its files would be overwritten."""
    own = (f"{name}.h", f"{name}_lanes.h")
    header = next((file for file in _listed(target) if file.endswith(".h") and file not in own), None)
    if header is not None:
        raise BadInput(str(target), f"the code of {header.removesuffix('.h')}", f"a folder of its own for {name}")


def refuse_hand_written(target: Path, files: Mapping[str, str]) -> None:
    """Raise BadInput where a file of these names lies in a folder, and no manifest of ours says that we wrote it."""
    listed = _listed(target)
    foreign = [name for name in files if name not in listed and is_there(target / name)]
    if foreign:
        found = f"{', '.join(foreign)}, listed in no manifest.json of stiction: written by another hand"
        raise BadInput(str(target), found, "a new folder, or one that stiction wrote; nothing was replaced")


def _listed(folder: Path) -> tuple[str, ...]:
    """The files that a manifest of ours in a folder lists, with itself; () without one."""
    try:
        manifest = json.loads(read_text(folder / "manifest.json", "a manifest", LARGEST_GENERATED))
        ours = manifest["tool"]["name"] == "stiction"
        return (*map(str, manifest["files"]), "manifest.json") if ours else ()
    except (BadInput, ValueError, KeyError, TypeError, RecursionError):
        return ()


def _make_importable(target: Path, folder: str | Path | None) -> None:
    """In the default place, let ``from generated import NAME`` find this folder and no other package of that name."""
    marker = target.parent / "__init__.py"
    if folder is None and not is_there(marker):
        write_atomically(marker, render("text/generated_init.py.j2"))


def _drop_old_proofs(target: Path, spec: Spec, kept: Mapping[str, str]) -> None:
    """Remove proofs that an earlier run wrote for this machine and this one does not: they speak of other code."""
    for old in (target / name for name in (*PROOFS, KERNEL_PROOF) if name not in kept):
        try:
            content = json.loads(read_text(old, "a certificate", LARGEST_GENERATED))
            ours = content.get("subject", content)["name"] == spec.name
        except (BadInput, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            continue
        if ours:
            remove(old)


def _stale(folder: Path, files: Mapping[str, str]) -> tuple[str, ...]:
    """Names of files on disk that differ from what would be written.

    A certificate that differs only in the digits a solver found is current if the checker accepts it for these sources.
    """
    on_disk = {name: read_or_none(folder / name) for name in files}
    different = tuple(name for name, text in files.items() if on_disk[name] != text)
    different += tuple(n for n in (*PROOFS, KERNEL_PROOF) if n not in files and is_there(folder / n))
    expected = dict(files)
    for name in PROOFS:
        text = on_disk.get(name)
        if name in different and text:
            try:
                newtons.check(text, folder)
            except (newtons.Refused, OSError, ValueError):
                return different
            expected = _with_solution(expected, name, text)
    surplus = tuple(name for name in different if name not in files)
    return tuple(name for name, content in expected.items() if on_disk[name] != content) + surplus


def _with_solution(files: Mapping[str, str], name: str, proof: str) -> dict[str, str]:
    """The files as another run of the solver would give them: from ``proof`` only what a solver chooses."""
    ours, theirs = json.loads(files[name]), json.loads(proof)
    rate, other = (f"alpha = {float(Fraction(c.get('decay_rate', 0))):.6g} 1/s" for c in (ours, theirs))
    chosen = (*CHOSEN, *FOLLOWING, *(REGION if name in REGION_PROOFS else ()))
    content = ours | {"claim": ours["claim"].replace(rate, other)} | {key: theirs[key] for key in chosen if key in ours}
    result = {**files, name: json_text(content)}
    said = proof_lines(name, files[name])
    now = (said, proof_lines(name, proof)) if said else (rate, other)
    result["README.md"] = files["README.md"].replace(*now)
    if name == PROOFS[0] and KERNEL_PROOF in files:
        result[KERNEL_PROOF] = with_solution(files[KERNEL_PROOF], content)
    for changed in {name, "README.md", KERNEL_PROOF} & files.keys():
        result["manifest.json"] = result["manifest.json"].replace(sha256(files[changed]), sha256(result[changed]))
    return result
