"""``stiction certify``: a certificate of the sampled observer, or a refusal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from codegen.analysis.analysis import analyse
from codegen.app.generate import generated_files
from codegen.app.rounding_bound import Rounding, rounding_bounds
from codegen.base.border import verb
from codegen.base.errors import BadInput
from codegen.base.files import refuse_target, write_atomically
from codegen.certify.bound.error_bound import ErrorBound
from codegen.certify.certify import Certificate, Refusal
from codegen.certify.remedies.proposals import propose
from codegen.certify.remedies.sample_times import ANY, largest_sample_times
from codegen.effects.declare import add_declared_effects
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import Spec, read_spec
from codegen.spec.printed import decimal_of


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

    @property
    def certificate(self) -> Certificate | None:
        """The certificate, or None where it was refused."""
        return self.outcome if isinstance(self.outcome, Certificate) else None


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
def write_certificate(certificate: Certificate, path: str | Path) -> Path:
    """Write a certificate's JSON."""
    write_atomically(Path(path), certificate.text)
    return Path(path)
