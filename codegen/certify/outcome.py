"""Results of certification: a certificate with further proofs, or a refusal with remedies."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from codegen.base.result import Shown, json_text
from codegen.certify import REGION_PROOFS
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.bound.error_response import Response
from codegen.certify.region_proofs import Regions
from codegen.certify.sticking import Sticking
from codegen.checker.theorem import PROOF, SETS

PROOFS = ("certificate.json", "limit.json", "refusal.json", "turning.json", *REGION_PROOFS)
"""Names of all proof files that certification may write."""


@dataclass(frozen=True, repr=False)
class Certificate(Shown):
    """A certificate that the checker has accepted.

    Attributes:
        content: the JSON object (docs/certificate_format.md).
        decay_rate: α, 1/s; V decreases by 1 − 2αh in each sample, by 1/(1 + αh)² where the step is implicit.
        spectral_rate: the largest rate that any P could certify at the worst operating point, 1/s.
        facts: the statements of the checker's report.
        limit: the refutation of every faster rate, which the checker has accepted; None if none was found.
        turning: a certificate with one V for all signs of the slips, not for samples with a reversal; or None.
        best_rate: α of another V, 1/s, if this V is chosen for shorter dwell times at reversals; else None.
        by_structure: whether the certificate is for one mode and assumes extremes of the machine that are estimates.
        functions: the sgn and tanh in the error matrix, for which the certificate has variables in [−1, 1].
        bounds: on each friction error; or the reason why there are none.
        response: linear response of the errors to disturbances, if it is known.
        sticking: of a (G)CFO, the sticking contacts for which the other errors decay slowest; or None.
        kernel: the proof that the kernel has accepted for the C (proof.json), or None.
        not_by_kernel: why there is no such proof.
        ellipsoid: invariant ellipsoids under noise and drift that the checker has accepted (ellipsoid.json), or None.
    """

    content: Mapping[str, Any]
    decay_rate: float
    spectral_rate: float
    facts: tuple[str, ...]
    limit: Mapping[str, Any] | None = None
    turning: Mapping[str, Any] | None = None
    best_rate: float | None = None
    by_structure: bool = False
    functions: tuple[str, ...] = ()
    bounds: tuple[ErrorBound, ...] | str = "none was asked for"
    response: Response | None = field(default=None, repr=False)
    sticking: Sticking | None = None
    kernel: str | None = None
    not_by_kernel: str = "none was asked for"
    ellipsoid: str | None = None

    @property
    def summary(self) -> Mapping[str, object]:
        return {"decay rate": f"{self.decay_rate:.4g} 1/s", "spectral rate": f"{self.spectral_rate:.4g} 1/s"}

    @property
    def sample_time(self) -> float:
        """h of the certified step, s."""
        return float(Fraction(self.content["sample_time"]))

    @property
    def time_constant(self) -> float:
        """Time in which √V falls at least by the factor 1/e between reversals, s, by the proved factor of a sample."""
        share = self.decay_rate * self.sample_time
        implicit = self.content["observer"]["integration"] == "implicit"
        return self.sample_time / (math.log1p(share) if implicit else -math.log1p(-2 * share) / 2)

    @property
    def longest_reversal(self) -> Mapping[str, Any] | None:
        """``contact``, ``growth`` of V and dwell time in ``samples`` of the reversal with the longest one; or None."""
        longest = max(self.content["reversals"], key=lambda r: r["dwell_samples"], default=None)
        return longest and {
            "contact": longest["contact"],
            "growth": float(Fraction(longest["growth"])),
            "samples": longest["dwell_samples"],
        }

    @property
    def turning_rate(self) -> float | None:
        """α of ``turning``, 1/s."""
        return None if self.turning is None else float(Fraction(self.turning["decay_rate"]))

    @property
    def refuted_rate(self) -> float | None:
        """The rate above which every certificate is refuted, 1/s."""
        return None if self.limit is None else float(Fraction(self.limit["decay_rate"]))

    @property
    def text(self) -> str:
        """The text of certificate.json."""
        return json_text(self.content)

    @property
    def proofs(self) -> dict[str, str]:
        """Name of a proof file → its text: certificate.json and, if there are any, limit.json and turning.json."""
        further = {"limit.json": self.limit, "turning.json": self.turning}
        return {"certificate.json": self.text} | {name: json_text(c) for name, c in further.items() if c is not None}

    @property
    def not_made(self) -> dict[str, str]:
        """File of a proof of the C, or of its error bounds, that does not exist → why, as in ``certify``."""
        missing = {}
        if self.kernel is None:
            missing[PROOF] = f"not proved by the kernel ({self.not_by_kernel})"
        if self.ellipsoid is None:
            why = f"it rests on {PROOF}" if PROOF in missing else "the checker found no such set"
            missing[SETS] = self.bounds if isinstance(self.bounds, str) else why
        return missing


@dataclass(frozen=True)
class Proposal:
    """A certified remedy: a sample time and gains to replace those of a refused spec.

    Attributes:
        line: the text to write in the spec's observer section.
        sample_time: s.
        gains: name → scalar, list or list of rows, as in that section.
        decay_rate: α of the certificate, 1/s.
        of_little_use: in words, the bounds on friction errors that exceed the largest friction; empty for none.
        bounds: in words, all bounds on friction errors; empty for none.
    """

    line: str
    sample_time: float
    gains: Mapping[str, Any]
    decay_rate: float
    of_little_use: str = ""
    bounds: str = ""


@dataclass(frozen=True)
class Proposals:
    """Remedies for a refused spec, each certified by itself; None where none was found.

    Attributes:
        sample_time: the largest certified sample time, with the spec's gains.
        gains: the nearest certified gains, with the spec's sample time.
        skipped: why no search was made; empty if one was.
        measured: the spec's gains with measured velocity and no K_v, for observers certified by structure only.
        integration: another integration method, with the spec's gains and sample time.
        useful: with the spec's gains, the longest sample time tried, with its step, whose error bounds are below the
            friction; None without one, and where those of ``sample_time`` are below it.
    """

    sample_time: Proposal | None
    gains: Proposal | None
    skipped: str = ""
    measured: Proposal | None = None
    useful: Proposal | None = None
    integration: Proposal | None = None


@dataclass(frozen=True, repr=False)
class Refusal(Shown):
    """A refusal: no certificate was found, or the observer is unstable.

    Attributes:
        reason: text for the user.
        counterexample: variable → value at the operating point of ``proof``; None if there is none.
        spectral_radius: of I + hA there, or the largest over the envelope.
        failing: the gain conditions that fail, as text.
        largest_sample_time: of explicit Euler at these gains, s; 0 if it is unstable at every sample time.
        proof: a refutation that the checker accepts, or None.
        proposals: remedies; None if none were requested.
        regions: proofs for regions of the envelope; None if there are none.
        kernel: the proof of the decay in sliding.json that the kernel has accepted for the C (proof.json), or None.
        not_by_kernel: why there is no such proof.
    """

    reason: str
    counterexample: Mapping[str, str] | None
    spectral_radius: float
    failing: tuple[str, ...]
    largest_sample_time: float
    proof: Mapping[str, Any] | None = None
    proposals: Proposals | None = None
    regions: Regions | None = None
    kernel: str | None = None
    not_by_kernel: str = "none was asked for"

    @property
    def summary(self) -> Mapping[str, object]:
        return {"refused": self.reason, "spectral radius": self.spectral_radius}

    @property
    def proofs(self) -> dict[str, str]:
        """Name of a proof file → its text: refusal.json, if there is a proof, and those of regions."""
        refusal = {} if self.proof is None else {"refusal.json": self.proof}
        regions = {} if self.regions is None else self.regions.proofs
        return {name: json_text(content) for name, content in {**refusal, **regions}.items()}

    @property
    def not_made(self) -> dict[str, str]:
        """certificate.json → why there is none."""
        return {"certificate.json": self.reason}
