"""Code and certificate of the augmented spec of a diagnosis, compared with those of the given spec."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from codegen.app.derived import Derived
from codegen.base.errors import BadInput
from codegen.diagnosis.results import CertificateChange
from codegen.spec import parse_spec
from codegen.spec.free_gains import free_gains_in_words

if TYPE_CHECKING:
    from codegen.certify.outcome import Certificate, Refusal

    Outcome = Certificate | Refusal | str
    """A certificate, its refusal, or why there is no code."""


class AugmentedCode(NamedTuple):
    """What a diagnosis writes of an observer; without an observer, nothing.

    Attributes:
        change: of the certificate by the augmented spec.
        files: path in the folder → text.
        stale: proofs of an earlier diagnosis that no longer hold.
    """

    change: CertificateChange | None = None
    files: Mapping[str, str] = {}
    stale: tuple[Path, ...] = ()


def refuse_code(machine: Derived, folder: Path, force: bool) -> None:
    """Raise BadInput for an observer without code, or, without ``force``, for code in the folder that was edited."""
    if machine.spec.observer is None:
        return
    # imported here: a third of a second, which a spec without observer does not need
    from codegen.app.check import refuse_ungenerable
    from codegen.app.generate import listed_files, refuse_edited

    refuse_ungenerable(machine.nominal)
    target = folder / "generated" / machine.spec.name
    if not force:
        refuse_edited(target, dict.fromkeys(listed_files(target)), "--force, which discards the edits")


def augmented_code(machine: Derived, augmented: str, folder: Path, begun: Callable[[], None]) -> AugmentedCode:
    """The code of an augmented spec, and what it changes of the certificate.

    Args:
        augmented: text of the spec.
        begun: called before a certificate is sought.

    Raises:
        BadInput: for a file in the folder that the code would replace and stiction did not write.
    """
    if free := free_gains_in_words(machine.spec):
        return AugmentedCode(CertificateChange(*2 * (f"no code was generated: {free}",)))
    if machine.spec.observer is None:
        return AugmentedCode()
    begun()
    from codegen.app.generate import refuse_hand_written, stale_proofs

    made = Derived(parse_spec(augmented, machine.spec.path.parent / "spec.yaml"))
    after = _outcome(made)
    before = after if made.spec.sha256 == machine.spec.sha256 else _outcome(machine)
    generated = {} if isinstance(after, str) else made.files
    place = f"generated/{made.spec.name}"
    refuse_hand_written(folder / place, generated)
    stale = stale_proofs(folder / place, generated) if generated else []
    files = {f"{place}/{name}": text for name, text in generated.items()}
    return AugmentedCode(certificate_change(before, after), files, tuple(stale))


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
