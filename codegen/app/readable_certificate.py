"""What ``certify`` found, as the words of its text templates and as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from codegen.app.certify import Certified
from codegen.base.text import render
from codegen.certify.outcome import Certificate, Refusal
from codegen.certify.region_proofs import Regions


def certified_text(found: Certified, target: Path | None) -> str:
    """What ``stiction certify`` prints; ``target`` is where the certificate was written."""
    more = {"bounds": found.bounds, "sample_times": found.sample_times}
    if isinstance(found.outcome, Refusal):
        return render("text/refused.txt.j2", refusal=found.outcome, **more)
    return render("text/certified.txt.j2", certificate=found.outcome, target=target, rounding=found.rounding, **more)


def certified_json(found: Certified) -> dict[str, Any]:
    """What ``stiction certify --json`` prints; a sample time without limit is null."""
    outcome = found.outcome
    return {
        "format": "stiction-certification/1",
        "certified": isinstance(outcome, Certificate),
        **(_certificate(outcome, found) if isinstance(outcome, Certificate) else _refusal(outcome)),
        "sample_times": {step: h if math.isfinite(h) else None for step, h in found.sample_times.items()},
    }


def _certificate(certificate: Certificate, found: Certified) -> dict[str, Any]:
    bounds = found.bounds
    return {
        "decay_rate": certificate.decay_rate,
        "spectral_rate": certificate.spectral_rate,
        "refuted_rate": certificate.refuted_rate,
        "turning_rate": certificate.turning_rate,
        "facts": list(certificate.facts),
        "error_bounds": bounds
        if isinstance(bounds, str)
        else [
            {"name": b.name, "unit": b.unit, "steady": b.steady, "slip_speed": b.slip_speed, "of_code": b.of_code}
            for b in bounds
        ],
        "certificate": certificate.content,
        "kernel_proof": None if certificate.kernel is None else json.loads(certificate.kernel),
        "not_by_kernel": certificate.not_by_kernel or None,
    }


def _refusal(refusal: Refusal) -> dict[str, Any]:
    return {
        "reason": refusal.reason,
        "counterexample": refusal.counterexample,
        "proved": refusal.proved,
        "spectral_radius": refusal.spectral_radius,
        "failing": list(refusal.failing),
        "largest_sample_time": refusal.largest_sample_time,
        "proposals": None if refusal.proposals is None else asdict(refusal.proposals),
        "refutation": refusal.proof,
        "regions": None if refusal.regions is None else _regions(refusal.regions),
        "kernel_proof": None if refusal.kernel is None else json.loads(refusal.kernel),
        "not_by_kernel": refusal.not_by_kernel or None,
    }


def _regions(regions: Regions) -> dict[str, Any]:
    return {
        "rates": regions.rates,
        "reversal_growth": regions.reversal,
        "must_grow": regions.must_grow,
        "not_found": list(regions.missing),
        "not_issued": dict(regions.withheld),
        "proofs": regions.proofs,
    }
