"""The verbs as functions: each takes files, walks the line as far as it must, and returns a typed result."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from codegen.border import verb
from codegen.cancel_report import CancelReport, cancel
from codegen.checker import newtons
from codegen.checker import verify as checker
from codegen.effects.declare import add_declared_effects
from codegen.errors import BadInput, Place, nearest_name
from codegen.files import refuse_foreign, refuse_target, write_all, write_atomically
from codegen.fmu import GeneratedFmu, generate_fmu
from codegen.gain_report import GainReport, gains
from codegen.generation import Generated, Overrides, generate, generated_files, refuse_hand_written, refuse_ungenerable
from codegen.input_files import identity, read_text
from codegen.log_replay import Replayed, replay
from codegen.mechanics import System, build_system
from codegen.observers import Observer, build_observer, observer_of
from codegen.rounding_bound import Rounding, rounding_bounds
from codegen.simulate import METHODS, Simulated, write_simulated
from codegen.simulate import simulate as simulate_plant
from codegen.simulate.closed_loop import refuse_unrunnable
from codegen.smt_lib import smt_text
from codegen.spec import Spec, parse_spec, read_spec
from codegen.spec.free_gains import at_middle, refuse_free_gains
from codegen.spec.printed import decimal_of
from codegen.spec.robot_file import LARGEST as LARGEST_URDF
from codegen.spec.share import read_part
from codegen.stability.analysis import Analysis, analyse
from codegen.stability.bound.error_bound import ErrorBound
from codegen.stability.certificate.certify import Certificate, Refusal, read_certificate
from codegen.stability.remedies.proposals import propose
from codegen.stability.remedies.sample_times import ANY, largest_sample_times

if TYPE_CHECKING:
    from codegen.diagnosis.results import Diagnosis

Progress = Callable[[str, float], None]
DIAGNOSIS_FILES = ("diagnosis.json", "spec.yaml", "report.html", "excitation.csv")


@dataclass(frozen=True)
class Model:
    """A spec with its system (declared effects included) and observer, if it has one; free gains at mid-range."""

    spec: Spec
    system: System
    observer: Observer | None


@dataclass(frozen=True)
class Diagnosed:
    """What ``diagnose`` found and where it is written."""

    diagnosis: Diagnosis
    folder: Path
    files: tuple[str, ...]


@verb
def check(path: str | Path) -> Model:
    """Read and validate a spec: what the other verbs would refuse of it, all but its proof, is refused here.

    Raises:
        BadInput: for anything in it that cannot be used.
    """
    model = _model(read_spec(path))
    if model.observer is not None:
        refuse_ungenerable(at_middle(model.spec), model.observer)
    refuse_unrunnable(model.spec, model.system, model.observer)
    return model


@verb
def derive(path: str | Path) -> Analysis:
    """Ψ, its characteristic polynomial, the gain conditions and margins of a spec's observer.

    Raises:
        BadInput: for a bad spec, or one without an observer.
    """
    spec = read_spec(path)
    return analyse(spec, observer_of(spec))


@dataclass(frozen=True)
class Certified:
    """What ``certify`` found beside the certificate or refusal.

    Attributes:
        bounds: on each friction error, or the words why there are none.
        sample_times: integration → the largest sample time that was certified, s.
        rounding: precision → what rounding adds to the bounds, or the words why that is not known.
    """

    outcome: Certificate | Refusal
    bounds: tuple[ErrorBound, ...] | str
    sample_times: Mapping[str, float]
    rounding: Mapping[str, Rounding] | str = "no error bound"


@verb
def certify_in_full(path: str | Path, out: str | Path | None = None) -> Certified:
    """The certificate or refusal, the bound on the error in the unit of the force, and the largest sample times.

    Args:
        out: where the certificate is to be written afterwards.

    Raises:
        BadInput: as ``certify``, and for a file that is not to be written.
    """
    if out is not None:
        refuse_target(Path(out), {"the spec itself": Path(path)}, (".json",))
    spec = read_spec(path)
    outcome = generated_files(spec)[1]
    system = add_declared_effects(build_system(spec), spec)
    bounds = outcome.bounds if isinstance(outcome, Certificate) else "no certificate"
    rounding: Mapping[str, Rounding] | str = "no error bound"
    if isinstance(outcome, Refusal):
        outcome = replace(outcome, proposals=propose(spec, system, _gate))
    elif not isinstance(bounds, str):
        rounding = rounding_bounds(spec, analyse(spec, build_observer(spec, system)), outcome, bounds[0])
    times = largest_sample_times(spec, system, outcome)
    if isinstance(outcome, Refusal) and outcome.unbound:
        times = {step: h for step, h in times.items() if h == 0 or _passes(spec, step, h)}
    return Certified(outcome, bounds, times, rounding)


@verb
def certify(path: str | Path) -> Certificate | Refusal:
    """The stability certificate of a spec's sampled observer, bound to its generated sources, or a refusal.

    A refusal proposes a sample time and gains that are certified, as far as such were found.

    Raises:
        BadInput: for a bad spec, or an envelope without a range that is needed.
    """
    spec = read_spec(path)
    outcome = generated_files(spec)[1]
    if isinstance(outcome, Certificate):
        return outcome
    return replace(outcome, proposals=propose(spec, add_declared_effects(build_system(spec), spec), _gate))


def _gate(spec: Spec) -> Certificate | Refusal:
    """What a run on this spec says: whatever is proposed in its place passed it."""
    return generated_files(spec)[1]


def _passes(spec: Spec, integration: str, h: float) -> bool:
    """Whether a spec is certified at another integration and sample time; ``h`` may be inf."""
    assert spec.observer is not None
    exact = decimal_of(h if math.isfinite(h) else ANY)
    other = replace(spec, observer=replace(spec.observer, integration=integration, sample_time=exact, domain=None))
    with suppress(BadInput):
        return isinstance(_gate(other), Certificate)
    return False


@verb
def verify(path: str | Path, spec: Path | None = None) -> checker.Report:
    """Check a certificate or a bound by the independent checker, with the files that lie beside it.

    Raises:
        BadInput: if the file cannot be read.
        codegen.checker.verify.Refused: if the claim does not hold.
    """
    path = Path(path)
    try:
        return newtons.check(read_certificate(path), path.parent, spec)
    except newtons.Refused as error:
        raise checker.Refused(str(error)) from None
    except json.JSONDecodeError as error:
        raise BadInput(Place(str(path), error.lineno), error.msg, "a certificate (JSON)") from None
    except OSError as error:  # of a file beside it, or of the spec
        found = f"unreadable ({error.strerror})"
        raise BadInput(str(error.filename or path), found, "a file that the certificate names") from None
    except ValueError as error:
        raise BadInput(str(path), f"no certificate ({error})", "a certificate (JSON)") from None


@verb
def write_smt(certificate: str | Path, out: str | Path) -> Path:
    """Write what the checker finds in a certificate as SMT-LIB 2, negated, for another solver to find ``unsat``.

    Raises:
        BadInput: for a bound, if a dwell is too long for it, or for a file that is not to be written.
    """
    target = Path(out)
    refuse_target(target, {"the certificate itself": Path(certificate)}, (".smt2",))
    text = read_certificate(Path(certificate))
    try:
        checker.parsed(text)
    except (checker.Refused, ValueError, RecursionError) as error:
        raise BadInput(str(certificate), f"no certificate ({error})", "a stability certificate") from None
    write_atomically(target, smt_text(json.loads(text)))
    return target


@verb
def simulate(
    path: str | Path,
    out: str | Path,
    progress: Callable[[float], None] | None = None,
    method: str = "steps",
) -> Simulated:
    """Write a log of the plant of a spec, with its declared effects, driven as its ``simulation:`` section says.

    Args:
        method: of the plant: ``steps``, or ``events`` for the slow reference.

    Raises:
        BadInput: for a bad spec or one without ``simulation:``, another method, or a file that is not to be written.
    """
    chosen = next((known for known in METHODS if known == method), None)
    if chosen is None:
        raise BadInput("--method", f"`{method}`", " or ".join(METHODS), nearest_name(method, METHODS))
    target = Path(out)
    refuse_target(target, {"the spec itself": Path(path)}, (".csv", ".txt"))
    model = _model(read_spec(path))
    return write_simulated(target, model.spec, simulate_plant(model.spec, model.system, progress, method=chosen))


@verb
def diagnose(
    path: str | Path,
    log: str | Path | Sequence[str | Path],
    test: str | Path | Sequence[str | Path] | None = None,
    out: str | Path | None = None,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    progress: Progress | None = None,
    propose: bool = False,
    material: str | float | None = None,
) -> Diagnosed:
    """Find the effect that a model lacks, write the augmented spec and the report, and generate again.

    Args:
        log, test: measured logs, each one file or the several of one experiment; without ``test`` the last part of
            ``log`` is held out.
        out: folder for DIAGNOSIS_FILES and generated/NAME; by default named after the first log.
        description, columns: how the logs name their columns. propose: terms for an unknown residual, by PySINDy.
        material: share of the RMS of the drive force from which on what is left matters, 0.02 or "2 %"; 2 % by default.

    Raises:
        BadInput: for a bad spec, log or share, or a folder where we would replace what is not ours; then nothing is
            written.
    """
    # SciPy's signal tools and matplotlib cost two seconds that the other verbs need not pay.
    from codegen.diagnosis.diagnose import diagnose_log
    from codegen.diagnosis.results import MATERIAL, CertificateChange
    from codegen.logs import Allowance, read_logs
    from codegen.report import render_report

    matters = MATERIAL if material is None else read_part(str(material), Place("--material"))
    logs, tests = _files(log), _files(test)
    for file in tests:
        if identity(file) in {identity(other) for other in logs}:
            expected = "another log, or none: the end of LOG is then held out"
            raise BadInput(str(file), "the training log itself as --test", expected)
    folder = Path(out) if out is not None else Path(f"{Path(logs[0]).stem}_diagnosis")
    read = {"the spec itself": Path(path)} | {f"the log {file}": Path(file) for file in (*logs, *tests)}
    for name in DIAGNOSIS_FILES:
        refuse_target(folder / name, read)
    refuse_foreign(folder, "spec.yaml", ("diagnosis.json",))
    model = _model(read_spec(path))
    refuse_free_gains(model.spec)
    if model.observer is not None:
        refuse_ungenerable(model.spec, model.observer)
    allowance = Allowance()
    train = read_logs(logs, model.spec, description=description, columns=columns, allowance=allowance)
    held_out = None
    if tests:
        held_out = read_logs(tests, model.spec, description=description, columns=columns, allowance=allowance)
    diagnosis, models = diagnose_log(model.spec, model.system, train, held_out, progress, propose, matters)
    files: dict[str, str] = {"spec.yaml": models.spec_text}
    if model.observer is not None:
        augmented = parse_spec(models.spec_text, model.spec.path.parent / "spec.yaml")
        before = generated_files(model.spec)[1]
        generated, after = generated_files(augmented)
        refuse_hand_written(folder / "generated" / augmented.name, generated)
        diagnosis = replace(diagnosis, certificate=CertificateChange(_rate(before), _rate(after)))
        files |= {f"generated/{augmented.name}/{name}": text for name, text in generated.items()}
    if model.spec.robot is not None and not {"..", "/"} & {*Path(model.spec.robot[0]).parts}:
        name = model.spec.robot[0]
        files[name] = read_text(model.spec.path.parent / name, "a robot description (URDF)", LARGEST_URDF)
    if models.excitation is not None:
        files["excitation.csv"] = models.excitation
    files["diagnosis.json"] = json.dumps(diagnosis.as_json(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    files["report.html"] = render_report(model.spec, diagnosis, models, {name: name for name in files})
    write_all(folder, files, ("diagnosis.json", "manifest.json"))
    return Diagnosed(diagnosis, folder, tuple(files))


@verb
def write_certificate(certificate: Certificate, path: str | Path) -> Path:
    """Write a certificate's JSON."""
    write_atomically(Path(path), certificate.text)
    return Path(path)


def _model(spec: Spec) -> Model:
    system = add_declared_effects(build_system(spec), spec)
    return Model(spec, system, build_observer(at_middle(spec), system) if spec.observer is not None else None)


def _files(given: str | Path | Sequence[str | Path] | None) -> Sequence[str | Path]:
    if given is None:
        return ()
    return (given,) if isinstance(given, (str, Path)) else tuple(given)


def _rate(outcome: Certificate | Refusal) -> float | str:
    return outcome.decay_rate if isinstance(outcome, Certificate) else outcome.reason


__all__ = [
    "BadInput",
    "CancelReport",
    "Certified",
    "Diagnosed",
    "GainReport",
    "Generated",
    "GeneratedFmu",
    "Model",
    "Overrides",
    "Replayed",
    "Simulated",
    "cancel",
    "certify",
    "certify_in_full",
    "check",
    "derive",
    "diagnose",
    "gains",
    "generate",
    "generate_fmu",
    "replay",
    "simulate",
    "verify",
    "write_certificate",
    "write_smt",
]
