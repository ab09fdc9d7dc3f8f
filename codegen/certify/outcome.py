"""Results of certifying: a certificate with further proofs, or a refusal with what would be certified."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from codegen.base.shown import Shown, json_text
from codegen.certify import REGION_PROOFS
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.bound.error_response import Response
from codegen.certify.region_proofs import Regions
from codegen.certify.sticking import Sticking

PROOFS = ("certificate.json", "limit.json", "refusal.json", "turning.json", *REGION_PROOFS)


@dataclass(frozen=True, repr=False)
class Certificate(Shown):
    """A certificate that the checker has accepted.

    Attributes:
        content: the JSON object (docs/certificate_format.md).
        decay_rate: α, 1/s; V decreases by 1 − 2αh in each sample, by 1/(1 + αh)² where the step is implicit.
        spectral_rate: the largest rate that any P could show at the worst operating point.
        limit: the refutation of every faster rate, which the checker has accepted too; None if none was found.
        turning: a certificate with one V for all signs of the slips, not for samples with a reversal; or None.
        no_turning: whether there is proved to be none.
        best_rate: α that another V shows, 1/s, where this one is chosen for short dwell times at reversals; else None.
        by_structure: whether it is about one mode of a machine whose extremes are estimates, not proven bounds.
        bounds: on each friction error, or the words why there are none.
        response: how the errors move under what their matrix leaves out, where there are bounds.
        sticking: of a (G)CFO, the sticking contacts for which the other errors decay slowest; or None.
        kernel: the proof that the kernel has accepted for the C (proof.json), or None.
        not_by_kernel: why there is none.
        ellipsoid: what follows of it for noise and drift, as the checker has accepted it (ellipsoid.json), or None.
    """

    content: Mapping[str, Any]
    decay_rate: float
    spectral_rate: float
    facts: tuple[str, ...]
    limit: Mapping[str, Any] | None = None
    turning: Mapping[str, Any] | None = None
    no_turning: bool = False
    best_rate: float | None = None
    by_structure: bool = False
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
    def turning_rate(self) -> float | None:
        """α of ``turning``, 1/s."""
        return None if self.turning is None else float(Fraction(self.turning["decay_rate"]))

    @property
    def refuted_rate(self) -> float | None:
        """The rate above which every certificate is refuted, 1/s."""
        return None if self.limit is None else float(Fraction(self.limit["decay_rate"]))

    @property
    def text(self) -> str:
        return json_text(self.content)

    @property
    def proofs(self) -> dict[str, str]:
        """certificate.json; limit.json, the refutation of every faster rate, and turning.json, if any."""
        further = {"limit.json": self.limit, "turning.json": self.turning}
        return {"certificate.json": self.text} | {name: json_text(c) for name, c in further.items() if c is not None}


@dataclass(frozen=True)
class Proposal:
    """A sample time and gains that were certified in place of a refused spec's.

    Attributes:
        line: what to write in the spec's observer section.
        sample_time: s.
        gains: as in that section: scalars, lists or rows.
        decay_rate: α of the certificate, 1/s.
    """

    line: str
    sample_time: float
    gains: Mapping[str, Any]
    decay_rate: float


@dataclass(frozen=True)
class Proposals:
    """What to change in a refused spec: each certified by itself, and None where nothing was found.

    Attributes:
        sample_time: the largest that was certified, with the spec's gains.
        gains: the nearest that were certified, with the spec's sample time.
        skipped: why nothing was looked for; empty where it was.
        measured: the spec's own gains with measured velocity and no K_v, where M(x) is known by structure alone.
    """

    sample_time: Proposal | None
    gains: Proposal | None
    skipped: str = ""
    measured: Proposal | None = None


@dataclass(frozen=True, repr=False)
class Refusal(Shown):
    """Why no certificate is given.

    Attributes:
        counterexample: an exact operating point at which the sampled error is unstable; None if none is known.
        spectral_radius: of I + hA there, or the largest over the envelope.
        failing: the gain conditions that fail, as text.
        largest_sample_time: of explicit Euler at these gains, s; 0 where no sample time helps.
        proved: whether the counterexample is checked in exact numbers.
        proof: the refutation as the checker accepts it, or None.
        proposals: what would be certified; None where that was not asked for.
        regions: what is certified of parts of the envelope, and through them; None where there are no such.
        kernel: the proof of sliding.json's decay that the kernel has accepted for the C (proof.json), or None.
        not_by_kernel: why there is none.
    """

    reason: str
    counterexample: Mapping[str, str] | None
    spectral_radius: float
    failing: tuple[str, ...]
    largest_sample_time: float
    proved: bool
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
        """refusal.json, if there is a proof, and those of regions."""
        refusal = {} if self.proof is None else {"refusal.json": self.proof}
        regions = {} if self.regions is None else self.regions.proofs
        return {name: json_text(content) for name, content in {**refusal, **regions}.items()}
