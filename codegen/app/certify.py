"""``stiction certify``: a certificate of the sampled observer, or a refusal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from codegen.app.derived import Source, derived_from
from codegen.app.rounding_bound import Rounding, rounding_bounds
from codegen.base.border import verb
from codegen.base.files import refuse_target, write_atomically
from codegen.base.shown import Shown
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.outcome import Certificate, Refusal
from codegen.certify.remedies.proposals import propose
from codegen.certify.remedies.sample_times import largest_sample_times


@dataclass(frozen=True, repr=False)
class Certified(Shown):
    """What ``certify`` found beside the certificate or refusal.

    Attributes:
        outcome: the certificate, or the refusal with what would be certified in its place.
        bounds: on each friction error, or the words why there are none.
        sample_times: integration → the largest sample time that was certified, s.
        rounding: precision → what rounding adds to the bounds, or the words why that is not known.
    """

    outcome: Certificate | Refusal
    bounds: tuple[ErrorBound, ...] | str
    sample_times: Mapping[str, float]
    rounding: Mapping[str, Rounding] | str = "no error bound"

    @property
    def certificate(self) -> Certificate | None:
        """The certificate, or None where it was refused."""
        return self.outcome if isinstance(self.outcome, Certificate) else None

    @property
    def summary(self) -> Mapping[str, object]:
        bounds = () if isinstance(self.bounds, str) else self.bounds
        limits = {f"|{b.name}| at most": f"{b.steady:.4g} {b.unit}" for b in bounds}
        times = {f"largest sample time, {step}": f"{h:g} s" for step, h in self.sample_times.items()}
        return {**self.outcome.summary, **limits, **times}


@verb
def certify(source: Source, out: str | Path | None = None) -> Certified:
    """The certificate or refusal, the bound on the error in the unit of the force, and the largest sample times.

    The certificate is bound to the generated sources. A refusal proposes a sample time and gains that are certified, as
    far as such were found.

    Args:
        out: where the certificate is to be written afterwards.

    Raises:
        BadInput: for a bad spec, an envelope without a range that is needed, or a file that is not to be written.
    """
    if out is not None:
        refuse_target(Path(out), {"the spec itself": Path(source)}, (".json",))
    machine = derived_from(source)
    outcome = machine.outcome
    if isinstance(outcome, Certificate):
        bounds = outcome.bounds
        rounding: Mapping[str, Rounding] | str = "no error bound"
        if not isinstance(bounds, str):
            rounding = rounding_bounds(machine.spec, machine.analysis, outcome, bounds[0])
        times = largest_sample_times(machine.spec, machine.analysis, outcome)
        return Certified(outcome, bounds, times, rounding)
    outcome = replace(outcome, proposals=propose(machine.spec, machine.analysis, machine.with_spec))
    times = largest_sample_times(machine.spec, machine.analysis, outcome)
    return Certified(outcome, "no certificate", times)


@verb
def write_certificate(certificate: Certificate, path: str | Path) -> Path:
    """Write a certificate's JSON."""
    write_atomically(Path(path), certificate.text)
    return Path(path)
