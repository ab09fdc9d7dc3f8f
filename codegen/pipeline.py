"""The verbs as functions: each takes files, walks the line as far as it must, and returns a typed result."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from codegen.checker import verify as checker
from codegen.effects.declare import add_declared_effects
from codegen.emit.package import Header, emit_manifest, emit_readme, emit_sources, make_header
from codegen.errors import BadInput, Place
from codegen.files import sha256, write_all, write_atomically
from codegen.gain_report import GainReport, gains
from codegen.mechanics import System, build_system
from codegen.observers import Observer, build_observer
from codegen.program import Program, build_program
from codegen.simulate import simulate as simulate_plant
from codegen.simulate import write_log
from codegen.spec import Spec, parse_spec, read_spec
from codegen.spec.free_gains import at_middle, refuse_free_gains
from codegen.stability.analysis import Analysis, analyse
from codegen.stability.certify import Certificate, Refusal, read_certificate
from codegen.stability.certify import certify as certify_analysis
from codegen.text import render

if TYPE_CHECKING:
    from codegen.diagnosis.results import Diagnosis

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Model:
    """A spec with its system (declared effects included) and observer, if it has one; free gains at mid-range."""

    spec: Spec
    system: System
    observer: Observer | None


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


@dataclass(frozen=True)
class Diagnosed:
    """What ``diagnose`` found and where it is written."""

    diagnosis: Diagnosis
    folder: Path
    files: tuple[str, ...]


def check(path: str | Path) -> Model:
    """Read and validate a spec.

    Raises:
        BadInput: for anything in it that cannot be used.
    """
    return _model(read_spec(path))


def derive(path: str | Path) -> Analysis:
    """Ψ, its characteristic polynomial, the gain conditions and margins of a spec's observer.

    Raises:
        BadInput: for a bad spec, or one without an observer.
    """
    spec, observer = _observed(read_spec(path))
    return analyse(spec, observer)


def certify(path: str | Path) -> Certificate | Refusal:
    """The stability certificate of a spec's sampled observer, bound to its generated sources, or a refusal.

    Raises:
        BadInput: for a bad spec, or an envelope without a range that is needed.
    """
    return _generate(read_spec(path))[1]


def verify(path: str | Path, spec: Path | None = None) -> checker.Report:
    """Check a certificate by the independent checker, with the files that lie beside it.

    Raises:
        BadInput: if the file cannot be read.
        codegen.checker.verify.Refused: if the claim does not hold.
    """
    path = Path(path)
    try:
        return checker.check(read_certificate(path), path.parent, spec)
    except json.JSONDecodeError as error:
        raise BadInput(Place(str(path), error.lineno), error.msg, "a certificate (JSON)") from None


def generate(
    path: str | Path, folder: str | Path | None = None, check_only: bool = False, uncertified: bool = False
) -> Generated:
    """C, Python, certificate and README of a spec's observer.

    Args:
        folder: where to write; ``generated/NAME`` by default.
        check_only: write nothing; say what on disk is not current.
        uncertified: write the code even where no certificate can be given.

    Raises:
        BadInput: for a bad spec or a folder that cannot be written.
    """
    spec = read_spec(path)
    files, outcome = _generate(spec)
    target = Path(folder) if folder is not None else Path("generated") / spec.name
    if check_only:
        return Generated(target, files, outcome, _stale(target, files))
    if isinstance(outcome, Certificate) or uncertified:
        write_all(target, files)
        _make_importable(target, folder)
        if not isinstance(outcome, Certificate):
            _drop_old_certificate(target, spec)
    return Generated(target, files, outcome)


def simulate(path: str | Path, out: str | Path, progress: Callable[[float], None] | None = None) -> Path:
    """Write a log of the plant of a spec, with its declared effects, driven as its ``simulation:`` section says.

    Raises:
        BadInput: for a bad spec or one without ``simulation:``.
    """
    model = check(path)
    target = Path(out)
    write_log(target, model.spec, simulate_plant(model.spec, model.system, progress))
    return target


def diagnose(
    path: str | Path,
    log: str | Path,
    test: str | Path | None = None,
    out: str | Path | None = None,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> Diagnosed:
    """Find the effect that a model lacks, write the augmented spec and the report, and generate again.

    Args:
        log, test: measured logs; without ``test`` the last part of ``log`` is held out.
        out: folder for diagnosis.json, spec.yaml, report.html and generated/NAME; by default named after the log.
        description, columns: how the logs name their columns.

    Raises:
        BadInput: for a bad spec or log; nothing is written then.
    """
    # SciPy's signal tools and matplotlib cost two seconds that the other verbs need not pay.
    from codegen.diagnosis.diagnose import diagnose_log
    from codegen.diagnosis.results import CertificateChange
    from codegen.logs import read_log
    from codegen.report import render_report

    if test is not None and Path(test).resolve() == Path(log).resolve():
        raise BadInput(
            str(test), "the training log itself as --test", "another log, or none: the end of LOG is then held out"
        )
    model = check(path)
    refuse_free_gains(model.spec)
    train = read_log(log, model.spec, description=description, columns=columns)
    held_out = read_log(test, model.spec, description=description, columns=columns) if test is not None else None
    diagnosis, models = diagnose_log(model.spec, model.system, train, held_out, progress)
    folder = Path(out) if out is not None else Path(f"{Path(log).stem}_diagnosis")

    files: dict[str, str] = {"spec.yaml": models.spec_text}
    if model.observer is not None:
        augmented = parse_spec(models.spec_text, Path("spec.yaml"))
        before = _generate(model.spec)[1]
        generated, after = _generate(augmented)
        diagnosis = replace(diagnosis, certificate=CertificateChange(_rate(before), _rate(after)))
        files |= {f"generated/{augmented.name}/{name}": text for name, text in generated.items()}
    files["diagnosis.json"] = json.dumps(diagnosis.as_json(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    files["report.html"] = render_report(model.spec, diagnosis, models, {name: name for name in files})
    write_all(folder, files)
    return Diagnosed(diagnosis, folder, tuple(files))


def write_certificate(certificate: Certificate, path: str | Path) -> Path:
    """Write a certificate's JSON."""
    write_atomically(Path(path), certificate.text)
    return Path(path)


def _model(spec: Spec) -> Model:
    system = add_declared_effects(build_system(spec), spec)
    return Model(spec, system, build_observer(at_middle(spec), system) if spec.observer is not None else None)


def _observed(spec: Spec) -> tuple[Spec, Observer]:
    refuse_free_gains(spec)
    system = add_declared_effects(build_system(spec), spec)
    return spec, build_observer(spec, system)


def _generate(spec: Spec) -> tuple[dict[str, str], Certificate | Refusal]:
    """All files of generated/NAME, and the certificate or refusal."""
    _, observer = _observed(spec)
    program = build_program(observer)
    header = make_header(spec.path.name, spec.sha256, spec.source, spec.robot)
    files = emit_sources(program, header)
    hashes = {name: sha256(text) for name, text in files.items()}
    outcome = certify_analysis(spec, analyse(spec, observer), hashes, header.command)
    return _complete(files, outcome, program, header), outcome


def _complete(
    files: Mapping[str, str], outcome: Certificate | Refusal, program: Program, header: Header
) -> dict[str, str]:
    result = dict(files)
    if isinstance(outcome, Certificate):
        result["certificate.json"] = outcome.text
    result["README.md"] = emit_readme(
        program, header, outcome.content if isinstance(outcome, Certificate) else outcome.reason
    )
    result["manifest.json"] = emit_manifest(header, result)
    return result


def _make_importable(target: Path, folder: str | Path | None) -> None:
    """In the default place, let ``from generated import NAME`` find this folder and no other package of that name."""
    marker = target.parent / "__init__.py"
    if folder is None and not marker.exists():
        write_atomically(marker, render("text/generated_init.py.j2"))


def _drop_old_certificate(target: Path, spec: Spec) -> None:
    """Remove a certificate that an earlier run wrote for this machine: it does not speak about the new code."""
    old = target / "certificate.json"
    try:
        ours = json.loads(old.read_text(encoding="utf-8"))["subject"]["name"] == spec.name
    except (OSError, ValueError, KeyError, TypeError):
        return
    if ours:
        old.unlink()


def _stale(folder: Path, files: Mapping[str, str]) -> tuple[str, ...]:
    """Names of files on disk that differ from what would be written.

    A certificate that differs only in the digits a solver found is current if the checker accepts it for these sources.
    """
    on_disk = {name: _read_or_none(folder / name) for name in files}
    different = tuple(name for name, text in files.items() if on_disk[name] != text)
    if "certificate.json" not in files and (folder / "certificate.json").exists():
        different += ("certificate.json",)
    text = on_disk.get("certificate.json")
    if "certificate.json" not in different or not text:
        return different
    try:
        checker.check(text, folder)
    except (checker.Refused, json.JSONDecodeError):
        return different
    return tuple(name for name, expected in _with_solution(files, text).items() if on_disk[name] != expected)


def _with_solution(files: Mapping[str, str], certificate: str) -> dict[str, str]:
    """The files as another run of the solver would give them: from ``certificate`` only what a solver chooses."""
    ours, theirs = json.loads(files["certificate.json"]), json.loads(certificate)
    rate, other = (f"alpha = {float(Fraction(c['decay_rate'])):.6g} 1/s" for c in (ours, theirs))
    solved = {key: theirs[key] for key in ("splits", "lyapunov_matrix", "decay_rate", "reversals")}
    content = ours | solved | {"claim": ours["claim"].replace(rate, other)}
    result = {**files, "certificate.json": json.dumps(content, indent=1, ensure_ascii=False) + "\n"}
    result["README.md"] = files["README.md"].replace(rate, other)
    for name in ("certificate.json", "README.md"):
        result["manifest.json"] = result["manifest.json"].replace(sha256(files[name]), sha256(result[name]))
    return result


def _read_or_none(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None


def _rate(outcome: Certificate | Refusal) -> float | str:
    return outcome.decay_rate if isinstance(outcome, Certificate) else outcome.reason


__all__ = [
    "BadInput",
    "Diagnosed",
    "GainReport",
    "Generated",
    "Model",
    "certify",
    "check",
    "derive",
    "diagnose",
    "gains",
    "generate",
    "simulate",
    "verify",
    "write_certificate",
]
