"""A bound on the friction errors as ``bound.json``, with all that the checker needs to compute it anew."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from decimal import ROUND_CEILING, Context, Decimal
from typing import Any

import sympy

from codegen.analysis.analysis import Analysis
from codegen.base.text import render
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.bound.disturbances import sliding
from codegen.certify.bound.error_bound import error_bounds, refuse_empty_domain
from codegen.certify.bound.error_response import Response, error_response
from codegen.certify.decimals import texts
from codegen.certify.outcome import Certificate, json_text
from codegen.certify.prefix import rational_text
from codegen.checker import newtons
from codegen.friction.law import DynamicLaw
from codegen.observers.equations import Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

FORMAT = "stiction-bound/1"
DIGITS = 6
MARGIN = Decimal("1.00002")  # the checker sums until less than half of that is left


@numerical("the bound on the error")
def with_bounds(spec: Spec, analysis: Analysis, certificate: Certificate, sources: dict[str, bytes]) -> Certificate:
    """The certificate with the bounds on the friction errors, as far as the checker accepts their proof.

    Raises:
        BadInput: for a domain in which there is no bound.
    """
    observer = analysis.dynamics.observer
    response = error_response(observer)
    bounds = error_bounds(spec, analysis, certificate, response=response)
    refuse_empty_domain(spec, observer, bounds)
    if isinstance(bounds, str) or isinstance(response, str):
        return replace(certificate, bounds=bounds)
    proof = bound_proof(spec, observer, certificate, response, bounds)
    try:
        newtons.proved(newtons.parsed(json_text(proof)), sources | {"certificate.json": certificate.text.encode()})
    except newtons.Refused as error:
        return replace(certificate, bounds=f"what was found does not stand up to exact arithmetic ({error})")
    return replace(certificate, bounds=bounds, bound=proof)


def bound_proof(
    spec: Spec, observer: Observer, certificate: Certificate, response: Response, bounds: tuple[ErrorBound, ...]
) -> dict[str, Any]:
    """The JSON object of ``bound.json`` (docs/certificate_format.md): bounds that the checker can prove, rounded up."""
    system, h = observer.system, float(observer.sample_time)
    slips = system.distribution.subs(observer.values)
    pairs = list(zip(system.positions, system.velocities, strict=True))
    words = {"observer": observer, "laws": [c.law.name for c in system.contacts]}
    words["states"] = any(isinstance(c.law, DynamicLaw) for c in system.contacts)
    return {
        "format": FORMAT,
        "tool": certificate.content["tool"],
        "subject": {"name": certificate.content["subject"]["name"]},
        "certificate": {"file": "certificate.json", "sha256": hashlib.sha256(certificate.text.encode()).hexdigest()},
        "claim": " ".join(render("text/bound_claim.j2", **words).split()),
        "envelope": _ranges(spec, pairs),
        "coordinates": [{"position": x.name, "velocity": v.name} for x, v in pairs],
        "contacts": [
            {
                "name": contact.name,
                "slip": texts([list(slips.col(c))])[0],
                "slope": str(slides.slope),
                "level": str(slides.level),
            }
            for c, contact in enumerate(system.contacts)
            if (slides := sliding(observer, contact)) is not None
        ],
        "direct": texts(response.direct.tolist()),
        "by_position": texts(response.by_position.tolist()),
        "acceleration": texts(response.acceleration.tolist()),
        "slip_speed": above(max(b.slip_speed for b in bounds)),
        "bounds": [
            {
                "error": b.name,
                "unit": b.unit,
                "steady": above(b.steady),
                "after": [{"samples": round(t / h), "bound": above(value)} for t, value in b.after[1:]],
            }
            for b in bounds
        ],
        "assumptions": [
            line.strip() for line in render("text/bound_assumptions.j2", **words).splitlines() if line.strip()
        ],
    }


def above(value: float) -> str:
    """A short rational that is a little more."""
    return _text(Context(prec=DIGITS, rounding=ROUND_CEILING).plus(Decimal(value) * MARGIN))


def _text(value: Any) -> str:
    return rational_text(sympy.Rational(str(value)))


def _ranges(spec: Spec, pairs: list[Any]) -> dict[str, list[str]]:
    """What the envelope says of noise, speed and acceleration; noise of which it is silent is none."""
    known: Mapping[str, tuple[Any, Any]] = {f"{x.name}_noise": (0, 0) for x, _ in pairs} | dict(spec.envelope)
    names = [name for x, v in pairs for name in (f"{x.name}_noise", v.name, f"{v.name}_dot") if name in known]
    return {name: [_text(end) for end in known[name]] for name in names}
