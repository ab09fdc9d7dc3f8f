"""``stiction generate``: the files of generated/NAME/ or an FMU, and whether those on disk are current."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from codegen.app.derived import Overrides, Source, derived_from
from codegen.base.border import verb
from codegen.base.errors import BadInput
from codegen.base.files import json_object, refuse_target, remove, sha256, write_all, write_atomically
from codegen.base.input_files import LARGEST_GENERATED, is_there, read_bytes, read_or_none
from codegen.base.own_files import differs, refuse_edited_files, refuse_unlisted, text_of
from codegen.base.result import Result, json_text, named
from codegen.base.text import render
from codegen.certify import REGION_PROOFS
from codegen.certify.kernel_form import with_solution
from codegen.certify.outcome import PROOFS, Certificate, Refusal
from codegen.checker import verify as checker
from codegen.emit.fmu import VERSIONS, emit_fmu, is_ours
from codegen.emit.header import is_edited, manifest_text
from codegen.emit.package import proof_lines

CHOSEN = ("splits", "lyapunov_matrix", "cover", "decay_rate", "reversals", "along")
"""Keys of a certificate whose values the solver chooses; another processor may give other digits."""
REGION = ("variables", "parameters", "matrix", "claim", "assumptions")
"""The same for a region's proof, in which the solver also chooses the size of the region."""
OF_SLIDING = ("lyapunov_matrix", "decay_rate", "box", "witness")
"""Keys of the kernel's proof that follow from the solver's choice in sliding.json."""
KERNEL_PROOF = checker.PROOF
OPTIONAL = (*PROOFS, KERNEL_PROOF, checker.SETS)
"""Files that not every observer has; those of an earlier run are removed if this run has none."""
MANIFEST = "manifest.json"
MARKS = ("Made by stiction ", "A complete program around ", '"name": "stiction"')
"""Words of which each file that ``generate`` writes has one at its beginning; a proof has the machine's name."""
HEAD = 1000
"""Characters at the beginning of a file in which they stand."""


@dataclass(frozen=True, repr=False, kw_only=True)
class Certifiable(Result):
    """A result of ``generate``: files, and their certificate or refusal.

    Attributes:
        spec: its file.
        check_only, uncertified: as they were asked for.
    """

    spec: Path
    check_only: bool = False
    uncertified: bool = False
    outcome: Certificate | Refusal

    @property
    def refused(self) -> bool:
        return isinstance(self.outcome, Refusal)

    @property
    def verdict(self) -> dict[str, Any]:
        """The outcome in JSON."""
        reason = self.outcome.reason if isinstance(self.outcome, Refusal) else None
        rate = self.outcome.decay_rate if isinstance(self.outcome, Certificate) else None
        return {"certified": not self.refused, "reason": reason, "decay_rate": rate}


@dataclass(frozen=True, repr=False)
class Generated(Certifiable):
    """The files of ``generate``.

    Attributes:
        files: name → text.
        stale: with ``check``, the files on disk that are missing or not current.
    """

    template = "generated"
    folder: Path
    files: Mapping[str, str]
    stale: tuple[str, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        stale = {"stale": ", ".join(self.stale)} if self.stale else {}
        return {"folder": self.folder, "files": len(self.files), **stale, **self.outcome.summary}

    @property
    def content(self) -> dict[str, Any]:
        return {"folder": str(self.folder), "files": list(self.files), "stale": self.stale, **self.verdict}


@dataclass(frozen=True, repr=False)
class GeneratedFmu(Certifiable):
    """The FMU of ``generate --target fmu``.

    Attributes:
        members: paths in the zip.
        outcome: the certificate, which is in the FMU's documentation, or the refusal.
        stale: with ``check_only``, whether the file on disk is missing or not current.
    """

    template = "generated_fmu"
    path: Path
    version: str
    members: tuple[str, ...]
    stale: bool = False

    @property
    def summary(self) -> Mapping[str, object]:
        return {"file": self.path, "FMI": self.version, "members": len(self.members), **self.outcome.summary}

    @property
    def content(self) -> dict[str, Any]:
        return {"file": str(self.path), **named(self, "fmi=version members stale"), **self.verdict}


@verb
def generate(
    source: Source,
    out: str | Path | None = None,
    check_only: bool = False,
    uncertified: bool = False,
    overrides: Overrides | None = None,
    force: bool = False,
) -> Generated:
    """Write C, Python, certificate and README of a spec's observer.

    Args:
        out: folder to write to; ``generated/NAME`` by default.
        check_only: write nothing; report the files on disk that are not current.
        uncertified: write the code even without a certificate.
        overrides: the command's own choices of precision, fault policy and targets.
        force: also replace generated files that were edited, and files that no manifest lists, if they say that
            stiction made them.

    Raises:
        BadInput: for a bad spec, or a folder that cannot be written or has files that were edited or that stiction did
            not write.
    """
    machine = derived_from(source).with_overrides(overrides)
    spec = machine.spec
    target = Path(out) if out is not None else Path("generated") / spec.name
    if not check_only:
        refuse_target(target / MANIFEST)
    files, outcome = machine.files, machine.outcome
    made = Generated(target, files, outcome=outcome, spec=spec.path, check_only=check_only, uncertified=uncertified)
    if check_only:
        return replace(made, stale=_stale(target, files))
    if isinstance(outcome, Certificate) or uncertified:
        _refuse_folder_of_another(target, spec.name)
        refuse_hand_written(target, files, spec.name, force)
        if not force:
            refuse_edited(target, {**dict.fromkeys(OPTIONAL), **files}, "--force, which discards the edits")
        stale = stale_proofs(target, files, spec.name if force else "")
        write_all(target, files, (MANIFEST,))
        package = target.parent / "__init__.py"
        if out is None and not is_there(package):  # so that `from generated import NAME` finds the default folder
            write_atomically(package, render("text/generated_init.py.j2"))
        for old in stale:
            remove(old)
    return made


@verb
def generate_fmu(
    source: Source,
    out: str | Path | None = None,
    version: str = VERSIONS[0],
    check_only: bool = False,
    uncertified: bool = False,
    overrides: Overrides | None = None,
    force: bool = False,
) -> GeneratedFmu:
    """Build the FMU of a spec's observer with the local C compiler.

    Args:
        out: folder for NAME.fmu; ``generated/NAME`` by default.
        version: of FMI, ``3.0`` or ``2.0``.
        check_only: write nothing; report whether the file on disk is current.
        uncertified: write it even without a certificate.
        overrides: the command's own choices of precision and fault policy.
        force: write it even if generated files in the folder were edited; it does not contain the edits.

    Raises:
        BadInput: for a bad spec, no C compiler, a folder that cannot be written or has edited files, or an FMU there
            that stiction did not write.
    """
    machine = derived_from(source).with_overrides(overrides)
    files, outcome = machine.files, machine.outcome
    fmu = emit_fmu(machine.program, dict(files), version)
    target = (Path(out) if out is not None else Path("generated") / machine.spec.name) / fmu.name
    members = tuple(sorted(fmu.members))
    if target.parent.suffix.lower() == ".fmu":
        expected = f"a folder, into which {target.name} is written"
        raise BadInput(str(target.parent), "the name of an FMU", expected, code="FILE005")
    if not check_only:
        refuse_target(target)
    asked = {"check_only": check_only, "uncertified": uncertified}
    made = GeneratedFmu(target, version, members, outcome=outcome, spec=machine.spec.path, **asked)
    if check_only:
        return replace(made, stale=_bytes_of(target) != fmu.data)
    if isinstance(outcome, Certificate) or uncertified:
        there = _bytes_of(target)
        if is_there(target) and (there is None or not is_ours(there)):
            expected = "another -o (nothing was replaced)"
            raise BadInput(str(target), "a file that stiction did not write", expected, code="FILE004")
        held = {file: text for file, text in files.items() if f"sources/{file}" in members}
        if not force:
            refuse_edited(target.parent, held, "--force, which builds the FMU without the edits")
        write_all(target.parent, {target.name: fmu.data})
    return made


def _bytes_of(path: Path) -> bytes | None:
    try:
        return read_bytes(path, "an FMU", LARGEST_GENERATED)
    except BadInput:
        return None


def _refuse_folder_of_another(target: Path, name: str) -> None:
    """Raise BadInput for a folder with the code of another machine, whose common files would be overwritten."""
    own = (f"{name}.h", f"{name}_lanes.h")
    header = next((file for file in listed_files(target) if file.endswith(".h") and file not in own), None)
    if header is not None:
        found = f"generated code of {header.removesuffix('.h')}"
        raise BadInput(str(target), found, f"another folder for {name}", code="FILE004")


def refuse_hand_written(target: Path, files: Mapping[str, str], name: str = "", force: bool = False) -> None:
    """Raise BadInput for files of these names with another text that no manifest of stiction lists.

    Args:
        name: of the machine, where the user may replace by force the files that say that stiction made them; else "".
        force: whether he does.
    """
    refuse_unlisted(
        target, files, listed_files(target), MANIFEST, lambda path: bool(name) and _says_ours(path, name), force
    )


def stale_proofs(target: Path, files: Mapping[str, str], name: str = "") -> list[Path]:
    """Proofs in the folder that an earlier run wrote about other code, and that these files do not replace.

    ``name``: of the machine, to count also files that no manifest lists if they say that stiction made them; else "".
    """
    listed = listed_files(target)
    absent = [target / file for file in OPTIONAL if file not in files]
    return [path for path in absent if path.name in listed or (name and _says_ours(path, name))]


def _says_ours(path: Path, name: str) -> bool:
    """Whether a file says at its beginning that stiction made it, or is a proof about the machine of this name."""
    head = (text_of(path) or "")[:HEAD]
    return any(mark in head for mark in (*MARKS, f'"name": "{name}"'))


def refuse_edited(target: Path, files: Mapping[str, str | None] | Mapping[str, str], otherwise: str = "") -> None:
    """Raise BadInput if a file that would be replaced or removed was edited after stiction wrote it.

    The manifest on disk has the SHA-256 of each file as written, so that files of older versions are no edits.

    Args:
        files: name → its new text, with which a file is not refused. None if the text is not known yet, or the file
            will be removed.
        otherwise: another way for the user, in words; "" for none.
    """
    listed = listed_files(target)
    changed = MANIFEST in files and MANIFEST in listed and differs(target / MANIFEST, files[MANIFEST])
    others = [MANIFEST] if changed and is_edited(text_of(target / MANIFEST) or "") else []
    ways = " or ".join(("the file as it was written, another folder", *([otherwise] if otherwise else ())))
    refuse_edited_files(target, files, listed, MANIFEST, ways, others)


def listed_files(folder: Path) -> dict[str, object]:
    """File → SHA-256 by stiction's manifest in a folder, and the manifest itself → None; {} without one."""
    manifest = json_object(folder / MANIFEST)
    tool, files = manifest.get("tool", {}), manifest.get("files", {})
    ours = isinstance(tool, dict) and tool.get("name") == "stiction" and isinstance(files, dict)
    return {**files, MANIFEST: None} if ours else {}


def _stale(folder: Path, files: Mapping[str, str]) -> tuple[str, ...]:
    """Names of the files on disk that are missing, surplus, or different from what would be written.

    A certificate that differs only in the solver's digits, as from another processor, is current if the checker accepts
    it for these sources.
    """
    on_disk = {name: read_or_none(folder / name) for name in files}
    different = tuple(name for name, text in files.items() if on_disk[name] != text)
    different += tuple(n for n in OPTIONAL if n not in files and is_there(folder / n))
    expected = dict(files)
    for name in PROOFS:
        text = on_disk.get(name)
        if name in different and text:
            try:
                checker.check(text, folder)
            except (checker.Refused, OSError, ValueError):
                return different
            expected = _with_solution(expected, name, text)
    expected = _with_sliding(expected, folder, on_disk.get(KERNEL_PROOF)) if "sliding.json" in different else expected
    surplus = tuple(name for name in different if name not in files)
    return tuple(name for name, content in expected.items() if on_disk[name] != content) + surplus


def _with_sliding(files: dict[str, str], folder: Path, proof: str | None) -> dict[str, str]:
    """The files with the solver's choices of the proof.json on disk, if the checker accepts it.

    For an observer whose proof.json follows from sliding.json.
    """
    if KERNEL_PROOF not in files or not proof:
        return files
    try:
        checker.check(proof, folder)
        theirs = json.loads(proof)
        made = json_text(json.loads(files[KERNEL_PROOF]) | {key: theirs[key] for key in OF_SLIDING})
    except (checker.Refused, OSError, ValueError, KeyError):
        return files
    return _with_manifest(files, {**files, KERNEL_PROOF: made})


def _with_solution(files: Mapping[str, str], name: str, proof: str) -> dict[str, str]:
    """The files with the solver's choices of ``proof``, the text on disk of the certificate or proof called ``name``.

    The claim, the README, the kernel's proof and the manifest repeat these choices and change with them.
    """
    ours, theirs = json.loads(files[name]), json.loads(proof)
    rate, other = (f"alpha = {float(Fraction(c.get('decay_rate', 0))):.6g} 1/s" for c in (ours, theirs))
    of_region = name in REGION_PROOFS
    chosen = (*CHOSEN, *(REGION if of_region else ()))
    content = ours | {"claim": ours["claim"].replace(rate, other)} | {key: theirs[key] for key in chosen if key in ours}
    result = {**files, name: json_text(content)}
    now = (proof_lines(name, files[name]), proof_lines(name, proof)) if of_region else (rate, other)
    result["README.md"] = files["README.md"].replace(*now)
    if name == PROOFS[0] and KERNEL_PROOF in files:
        result[KERNEL_PROOF] = with_solution(files[KERNEL_PROOF], content)
    return _with_manifest(files, result)


def _with_manifest(files: Mapping[str, str], changed: dict[str, str]) -> dict[str, str]:
    """The changed files with a manifest of their hashes."""
    manifest = json.loads(files[MANIFEST])
    hashes = {name: sha256(changed[name]) for name in manifest["files"]}
    return {**changed, MANIFEST: manifest_text(manifest | {"files": hashes})}
