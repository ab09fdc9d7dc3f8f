"""``stiction certify``: the certificate of the sampled observer, or the refusal."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from decimal import ROUND_CEILING
from functools import partial
from pathlib import Path
from typing import Any

from codegen.analysis.analysis import Analysis
from codegen.app.derived import Source, derived_from
from codegen.app.rounding_bound import Rounding, rounding_bounds
from codegen.base.border import verb
from codegen.base.files import refuse_target, write_atomically
from codegen.base.progress import begin
from codegen.base.result import Result, named
from codegen.base.significant import rounded_to
from codegen.base.text import render
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.levels import levels_of
from codegen.certify.outcome import Certificate, Refusal
from codegen.certify.remedies.proposals import propose
from codegen.certify.remedies.sample_times import largest_sample_times
from codegen.observers.equations import Observer
from codegen.program.implicit_step import solved_by_one_step
from codegen.spec.model import Spec


@dataclass(frozen=True, repr=False)
class Certified(Result):
    """The result of ``certify``.

    Attributes:
        outcome: the certificate, or the refusal with proposals that would be certified.
        bounds: on each friction error, or the reason why there are none.
        sample_times: integration → the largest sample time that was certified, s.
        rounding: precision → the increase of the bounds by rounding, or the reason why it is not known.
        solved: whether the code of an implicit step solves its equations, so that its sample time holds for the code.
        region: variable → (low, high), in SI units: the envelope, and the true levels of a DFO that are certified.
        friction_gains: names of the gains that correct the friction estimate, as ``|K_2|`` where they are negative.
    """

    outcome: Certificate | Refusal
    bounds: tuple[ErrorBound, ...] | str
    sample_times: Mapping[str, float]
    rounding: Mapping[str, Rounding] | str = "no error bound"
    solved: bool = True
    region: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    friction_gains: tuple[str, ...] = ()

    @property
    def certificate(self) -> Certificate | None:
        """The certificate, or None with a refusal."""
        return self.outcome if isinstance(self.outcome, Certificate) else None

    @property
    def summary(self) -> Mapping[str, object]:
        bounds = () if isinstance(self.bounds, str) else self.bounds
        limits = {f"|{b.name}| at most": f"{rounded_to(b.steady, 4, ROUND_CEILING)} {b.unit}" for b in bounds}
        times = {
            f"largest sample time ({step})": f"{h:g} s" if math.isfinite(h) else "any"
            for step, h in self.sample_times.items()
        }
        return {**self.outcome.summary, **limits, **times}

    @property
    def content(self) -> dict[str, Any]:
        """As of ``Result``; a sample time without limit is null."""
        outcome = self.outcome
        return {
            "format": "stiction-certification/1",
            "certified": isinstance(outcome, Certificate),
            **(_certificate(outcome, self.bounds) if isinstance(outcome, Certificate) else _refusal(outcome)),
            "kernel_proof": None if outcome.kernel is None else json.loads(outcome.kernel),
            "not_by_kernel": outcome.not_by_kernel or None,
            "sample_times": {step: h if math.isfinite(h) else None for step, h in self.sample_times.items()},
        }

    @property
    def view(self) -> dict[str, Any]:
        more = named(self, "bounds sample_times solved region friction_gains")
        if isinstance(self.outcome, Refusal):
            return {"refusal": self.outcome, **more}
        meanings = {error["name"]: error["meaning"] for error in self.outcome.content["error"]}
        return {"certificate": self.outcome, "rounding": self.rounding, "meanings": meanings, **more}

    def text(self, **options: object) -> str:
        """The result in words.

        Args:
            options: ``details``: whether the claim, what was checked and all assumptions are printed too; ``target``:
                the file to which the certificate was written, or None.
        """
        template = "refused" if isinstance(self.outcome, Refusal) else "certified"
        return render(f"text/{template}.txt.j2", **self.view, **{"target": None, "details": False, **options})


@verb
def certify(source: Source, out: str | Path | None = None) -> Certified:
    """Certify the sampled observer: certificate or refusal, bounds on the error in newtons, and largest sample times.

    The certificate is bound to the generated sources. A refusal proposes a sample time and gains that are certified, if
    such are found.

    Args:
        out: a file for the certificate, .json; nothing is written with a refusal.

    Raises:
        BadInput: for a bad spec, an envelope without a needed range, or a file that cannot be written.
    """
    if out is not None:
        refuse_target(Path(out), {"the spec itself": Path(source)}, (".json",))
    machine = derived_from(source)
    spec, outcome, analysis = machine.spec, machine.outcome, machine.analysis
    if isinstance(outcome, Certificate):
        bounds = outcome.bounds
        begin("error bounds with rounding")
        rounding = None if isinstance(bounds, str) else rounding_bounds(spec, analysis, outcome, bounds[0])
        begin("largest sample times")
        times = largest_sample_times(spec, analysis, outcome)
        if out is not None:
            write_certificate(outcome, out)
        observer = levels_of(analysis, outcome.content).dynamics.observer
        levels = [(name, low, high) for name, low, high, _ in observer.ranged_levels]
        levels += [(name, value, value) for name, value, _ in observer.declared_levels]
        ranges = [(name, low, high) for name, (low, high) in spec.envelope.items()] + levels
        region = {name: (float(low), float(high)) for name, low, high in ranges}
        found = Certified(outcome, bounds, times, rounding or "no error bound", _solved(analysis, times), region)
        return replace(found, friction_gains=_friction_gains(spec, observer))
    begin("largest sample times")
    times = largest_sample_times(spec, analysis, outcome)
    in_region = outcome.regions is not None  # ``times`` are then those of the sliding region
    begin("gains and sample time that are certified")
    over_envelope = partial(largest_sample_times, spec, analysis) if in_region else lambda: times
    outcome = replace(outcome, proposals=propose(spec, analysis, machine.with_spec, over_envelope))
    return Certified(outcome, "no certificate", times, solved=_solved(analysis, times))


def _friction_gains(spec: Spec, observer: Observer) -> tuple[str, ...]:
    """Names of the gains other than K_v, as messages say which to raise."""
    declared = [name for name in (spec.observer.gains if spec.observer else ()) if name != "K_v"]
    negative = {symbol.name for symbol, value in observer.gains.items() if value < 0}
    return tuple(f"|{gain}|" if any(n.startswith(gain) for n in negative) else gain for gain in declared)


def _solved(analysis: Analysis, times: Mapping[str, float]) -> bool:
    return "implicit" not in times or solved_by_one_step(analysis.dynamics.observer)


@verb
def write_certificate(certificate: Certificate, out: str | Path) -> Path:
    """Write a certificate's JSON."""
    write_atomically(Path(out), certificate.text)
    return Path(out)


def _certificate(certificate: Certificate, bounds: tuple[ErrorBound, ...] | str) -> dict[str, Any]:
    speeds = [] if isinstance(bounds, str) else bounds[0].slip_speeds
    return {
        **named(certificate, "decay_rate spectral_rate refuted_rate turning_rate facts"),
        "sticking": None if certificate.sticking is None else asdict(certificate.sticking),
        "error_bounds": bounds if isinstance(bounds, str) else [named(b, "name unit steady proved") for b in bounds],
        "slip_speeds": [named(speed, "contact unit threshold") for speed in speeds],
        "certificate": certificate.content,
    }


def _refusal(refusal: Refusal) -> dict[str, Any]:
    regions = refusal.regions
    return {
        **named(refusal, "reason counterexample spectral_radius failing largest_sample_time"),
        "proposals": None if refusal.proposals is None else asdict(refusal.proposals),
        "refutation": refusal.proof,
        "regions": regions and named(regions, "rates reversal_growth=reversal not_found=missing proofs"),
    }
