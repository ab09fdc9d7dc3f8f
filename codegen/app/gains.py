"""``stiction gains``: the stable gains of a spec's observer, their margins, and a suggestion with its certified bound.

With fast gains, the motion within a sample makes the bound larger than the friction itself; slower ones are suggested.
"""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from codegen.analysis.analysis import analyse
from codegen.analysis.feasibility.axes import GainAxis, unit_notes
from codegen.analysis.feasibility.failure import Failure
from codegen.analysis.feasibility.gains import Feasibility, GainSet, assess
from codegen.analysis.feasibility.noise import DEFAULT_STEP
from codegen.analysis.feasibility.region import SEARCHED, Margin
from codegen.analysis.feasibility.suggest import AS_FAST, GAIN_FACTOR, NOISE_SHARE, USEFUL, Suggestion, suggested_text
from codegen.app.derived import Derived, Source, derived_from
from codegen.base.border import verb
from codegen.base.files import refuse_foreign_json, refuse_target, remove, write_all
from codegen.base.own_files import FILES_SHA256, listed_in, refuse_edited_files, refuse_unlisted, text_sha256
from codegen.base.result import Result, json_text, named
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.bound.error_bound import error_bounds
from codegen.certify.bound.error_response import error_response
from codegen.certify.certify import certify
from codegen.certify.outcome import Certificate
from codegen.spec.free_gains import with_gains
from codegen.spec.numerics import require_finite

DIVISORS = (1, 2, 4, 8, 16, 32)
OWN = 0
"""In the place of a divisor: the spec's own gains."""


@dataclass(frozen=True)
class GainBound:
    """The certified bound at one set of gains.

    Attributes:
        divisor: by which the gains that the rule chose are divided; or ``OWN``.
        gains: axis → value.
        decay_rate: certified, 1/s.
        bound: on the friction error long after a reversal, of the contact for which it is the largest share.
    """

    divisor: int
    gains: Mapping[str, float]
    decay_rate: float
    bound: ErrorBound

    @property
    def share(self) -> float:
        """The bound over the friction."""
        return self.bound.steady / self.bound.friction if self.bound.friction else 0.0

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object."""
        return {
            **named(self, "gains_divided_by=divisor numbers=gains certified_rate=decay_rate"),
            "bound": {**named(self.bound, "of=name unit steady"), "share": self.share},
        }


def bounds_at(machine: Derived, axes: Sequence[GainAxis], suggestion: Suggestion) -> tuple[GainBound, ...]:
    """The bound at the gains that the rule chose; if it is not useful, also the first useful one, or the least; or ().

    Slower gains whose bound is still not below the friction are not among them: they cost speed for nothing.
    Bounds are known if the error dynamics are the same at every operating point and the envelope has the ranges.
    """
    if isinstance(error_response(machine.nominal.observer), str):
        return ()
    found: list[GainBound] = []
    for divisor in DIVISORS:
        one = bound_at(machine, axes, suggestion.over(divisor), divisor)
        if one is None:
            break
        found.append(one)
        if one.share <= USEFUL:
            break
    if not found:
        return ()
    best = min(found, key=lambda one: (one.share > USEFUL, one.share if one.share > USEFUL else one.divisor))
    return (found[0],) if best is found[0] or best.share >= 1 else (found[0], best)


def why_no_bound(report: Feasibility, bounds: Sequence[GainBound]) -> str:
    """Why no bound in newtons is known for an observer at any gains and envelope; empty if one is known."""
    found = "" if bounds else error_response(report.observer)
    return found if isinstance(found, str) else ""


def bound_at(
    machine: Derived, axes: Sequence[GainAxis], numbers: Mapping[str, float], divisor: int
) -> GainBound | None:
    """The bound at these numbers of the axes; None outside the range of a free gain, or if no bound is certified."""
    if any(axis.chosen is None and not axis.low <= numbers[axis.name] <= axis.high for axis in axes):
        return None
    entries = {at: weight * numbers[axis.name] for axis in axes for at, weight in axis.entries.items()}
    there = machine.with_spec(with_gains(machine.spec, entries))
    analysis = analyse(there.spec, there.observer, False)
    certificate = certify(there.spec, analysis, {}, "", further=False)
    if not isinstance(certificate, Certificate):
        return None
    bounds = error_bounds(there.spec, analysis, certificate)
    if isinstance(bounds, str):
        return None
    largest = max(bounds, key=lambda b: b.steady / b.friction if b.friction else 0.0)
    return GainBound(divisor, numbers, certificate.decay_rate, largest)


MAP, NUMBERS, SPEC = "gains.png", "gains.json", "spec.yaml"
FORMAT = "stiction-gains/1"
NEAR = 1e-3
"""Imaginary part up to which an eigenvalue on the unit circle is taken as real."""


@dataclass(frozen=True, repr=False)
class GainReport(Result):
    """The result of ``gains``, and its files.

    Attributes:
        bounds: certified at the gains that the rule chose, and at slower ones that are suggested if the first bound is
            too large to be useful; () if unknown.
    """

    template = "gains"
    feasibility: Feasibility
    files: tuple[Path, ...]
    bounds: tuple[GainBound, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        found = self.feasibility
        varied = {"varied": ", ".join(axis.name for axis in found.axes)}
        if found.suggested is None:
            return {**varied, "stable gains": "none in the range"}
        return {**varied, "suggested": ", ".join(f"{name} = {v:g}" for name, v in found.suggested.gains.items())}

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on free gains that are one number for gains in different units."""
        return unit_notes(self.feasibility.axes, self.feasibility.observer)

    @property
    def view(self) -> dict[str, Any]:
        report = self.feasibility
        return {
            "files": self.files,
            "notes": self.notes,
            "bounds": self.bounds,
            "no_bound": why_no_bound(report, self.bounds),
            "useful": USEFUL,
            "report": report,
            "sample_time": float(report.observer.sample_time),
            "axes": [_axis_words(report, axis) for axis in report.axes],
            "noise": list(zip(report.spec.positions, report.noise.rms, report.noise.sources, strict=True)),
            "default_step": DEFAULT_STEP,
            "noise_bound": NOISE_SHARE,
            "factor": GAIN_FACTOR,
            "as_fast": AS_FAST,
            "decibel": decibel,
            "limit_motion": limit_motion,
            "complex_text": lambda z: f"{z.real:.5g}" if z.imag == 0 else f"{z.real:.5g} ± {z.imag:.5g}i",
            "searched": SEARCHED,
        }

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object (docs/feasibility.md)."""
        return gains_json(self.feasibility, self.bounds)


@verb
def gains(source: Source, out: str | Path | None = None, over: Sequence[str] = ()) -> GainReport:
    """The gains of a spec's observer that are stable over its envelope, their margins, and suggested gains.

    Args:
        out: folder for gains.json, gains.png and, if gains are suggested, spec.yaml with them; None for none.
        over: the two gains of the map (``h`` is the sample time).

    Raises:
        BadInput: for a bad spec, gains that the observer does not have, or a folder that cannot be written or has files
            of these names that stiction did not write.
    """
    machine = derived_from(source)
    spec = machine.spec
    if out is not None:
        folder = Path(out)
        for name in (NUMBERS, MAP, SPEC):
            refuse_target(folder / name, {"the spec itself": spec.path})
        refuse_foreign_json(folder / NUMBERS, FORMAT)
        listed, written = listed_in(folder / NUMBERS, FORMAT), dict.fromkeys((MAP, SPEC))
        refuse_unlisted(folder, written, listed, NUMBERS)
        ways = "another folder by -o DIR, or the edited file moved away"
        refuse_edited_files(folder, written, listed, NUMBERS, ways)
    bounds: tuple[GainBound, ...] = ()

    def divisor(axes: Sequence[GainAxis], suggestion: Suggestion) -> int:
        nonlocal bounds
        bounds = bounds_at(machine, axes, suggestion)
        return bounds[-1].divisor if bounds else 1

    def bound_share(axes: Sequence[GainAxis], numbers: Mapping[str, float]) -> float | None:
        """The certified bound over the friction at the suggestion so far, or at the spec's own gains."""
        nonlocal bounds
        there = next((one for one in bounds if one.gains == numbers), None)
        if there is None and bounds and (there := bound_at(machine, axes, numbers, OWN)) is not None:
            bounds = (*bounds, there)
        return None if there is None else there.share

    report = assess(spec, machine.nominal.observer, over, divisor, bound_share)
    bounds = _bounds_of(report.suggestion, bounds)
    require_finite(spec, gains_json(report), "what the gains do")
    if out is None:
        return GainReport(report, (), bounds)
    from codegen.report.gain_map import gain_map_png  # imported here: matplotlib takes a second

    hashes: dict[str, str | None] = {MAP: None}
    files: dict[str, str | bytes] = {NUMBERS: "", MAP: gain_map_png(report)}
    if report.suggestion is not None:
        text = suggested_text(spec, report.axes, report.suggestion)
        files[SPEC], hashes[SPEC] = text, text_sha256(text)
    files[NUMBERS] = json_text({**gains_json(report, bounds), FILES_SHA256: hashes})
    stale = SPEC in listed_in(Path(out) / NUMBERS, FORMAT) and SPEC not in files
    write_all(Path(out), files, (NUMBERS,))
    if stale:  # gains that an earlier run suggested for another spec
        remove(Path(out) / SPEC)
    return GainReport(report, tuple(Path(out) / name for name in files), bounds)


def _bounds_of(suggestion: Suggestion | None, bounds: Sequence[GainBound]) -> tuple[GainBound, ...]:
    """The bounds at the suggested gains and before their division, if they were divided; at kept gains, only theirs."""
    if suggestion is None:
        return ()
    if suggestion.kept:
        return tuple(replace(one, divisor=1) for one in bounds if one.gains == suggestion.numbers)[:1]
    return tuple(one for one in bounds if one.divisor in (1, suggestion.divisor))


def gains_json(report: Feasibility, bounds: Sequence[GainBound] = ()) -> dict[str, Any]:
    """The JSON object of ``stiction gains --json``; None for a number that does not exist."""
    region, observer = report.region, report.observer
    return {
        "format": FORMAT,
        "spec": named(report.spec, "name sha256"),
        "observer": named(observer, "kind velocity"),
        "sample_time": float(observer.sample_time),
        "operating_points": {"looked_at": report.points, "deciding": report.deciding},
        "position_noise_rms": dict(zip(report.spec.positions, report.noise.rms, strict=True)),
        "position_noise_given": list(report.noise.given),
        "position_noise_from": dict(zip(report.spec.positions, report.noise.sources, strict=True)),
        "axes": [_axis_json(report, axis) for axis in report.axes],
        "notes": list(unit_notes(report.axes, observer)),
        "chosen": _set_json(report.chosen),
        "suggested": _set_json(report.suggested),
        "kept": report.suggestion.kept if report.suggestion else None,
        "suggested_divided_by": report.suggestion.divisor if report.suggestion else None,
        "error_bounds": [one.content for one in bounds],
        "no_error_bound": why_no_bound(report, bounds) or None,
        "rule": report.suggestion.rule if report.suggestion else None,
        "noise_bound": NOISE_SHARE,
        "gain_factor": GAIN_FACTOR,
        "gain_sets_tried": report.tried,
        "infeasible": _failure_json(report.infeasible),
        "outside": dict(report.outside) or None,
        "map": {
            "x": {"name": region.x.name, "unit": region.x.unit, "values": region.x_values.tolist()},
            "y": {"name": region.y.name, "unit": region.y.unit, "values": region.y_values.tolist()},
            "others": {s.name: float(v) for s, v in zip(region.base.symbols, region.base.gains[0], strict=True)},
            "spectral_radius": _finite(region.radius),
            "decay_rate": _finite(region.decay_rate),
            "spectral_abscissa": _finite(region.abscissa),
            "noise_share": _finite(report.noise_share),
            "boundary": {which: [list(map(list, line)) for line in lines] for which, lines in region.boundary.items()},
        },
    }


def limit_motion(z: complex, sample_time: float) -> tuple[str, float]:
    """Motion of an error with eigenvalue z, |z| = 1: "alternates", "stays", or "oscillates" and its frequency in Hz."""
    if abs(z.imag) < NEAR:
        return ("alternates" if z.real < 0 else "stays"), 0.0
    return "oscillates", abs(cmath.phase(z)) / (2 * math.pi * sample_time)


def _axis_words(report: Feasibility, axis: GainAxis) -> dict[str, Any]:
    """An axis for the text, with the sign of its gains; ``at_end``: whether the set chosen is close to an end of it."""
    sign = -1.0 if axis.negative else 1.0
    chosen = report.before_division
    return {
        "name": f"{axis.name} (factor)" if axis.factor else axis.name,
        "unit": "" if axis.unit == "1" else axis.unit,
        "range": _ordered(axis.low, axis.high, sign),
        "at_end": chosen is not None
        and any(math.isclose(chosen.numbers[axis.name], end, rel_tol=1 - AS_FAST) for end in (axis.low, axis.high)),
        "sampled": [_ordered(low, high, sign) for low, high in report.sampled[axis.name]],
        "continuous": [_ordered(low, high, sign) for low, high in report.continuous[axis.name]],
    }


def _ordered(low: float, high: float, sign: float) -> tuple[float, float]:
    return (low, high) if sign > 0 else (-high, -low)


def decibel(factor: float) -> float:
    """20 log₁₀ of a factor, dB."""
    return 20 * math.log10(factor)


def _axis_json(report: Feasibility, axis: GainAxis) -> dict[str, Any]:
    return {
        **named(axis, "name unit logarithmic chosen"),
        "gains": {s.name: weight for s, weight in axis.weights.items()},
        "range": [axis.low, axis.high],
        "stable_sampled": [list(pair) for pair in report.sampled[axis.name]],
        "stable_continuous": [list(pair) for pair in report.continuous[axis.name]],
    }


def _set_json(judged: GainSet | None) -> dict[str, Any] | None:
    if judged is None:
        return None
    return {
        **named(judged, "numbers gains stable decay_rate largest_sample_time noise_share noise_shares"),
        "spectral_radius": judged.radius,
        "spectral_abscissa": judged.abscissa,
        "friction_noise_rms": judged.noise,
        "margins": [_margin_json(m) for m in judged.margins],
        "failure": _failure_json(judged.failure),
    }


def _margin_json(margin: Margin) -> dict[str, Any]:
    def parts(z: complex | None) -> list[float] | None:
        return None if z is None else [z.real, z.imag]

    return {
        "of": margin.name,
        **named(margin, "up down"),
        "up_db": None if margin.up is None else decibel(margin.up),
        "eigenvalue_at_up": parts(margin.at_up),
        "down_db": None if margin.down is None else decibel(margin.down),
        "eigenvalue_at_down": parts(margin.at_down),
    }


def _failure_json(failure: Failure | None) -> dict[str, Any] | None:
    if failure is None:
        return None
    finite = cmath.isfinite(failure.eigenvalue)
    return {
        "of": failure.which,
        "gains": dict(failure.gains),
        "operating_point": dict(failure.point),
        "eigenvalue": [failure.eigenvalue.real, failure.eigenvalue.imag] if finite else None,
        "conditions": [{"name": c.label, "value": c.value} for c in failure.conditions],
        "largest_sample_time": failure.largest_sample_time,
    }


def _finite(values: Any) -> list[list[float | None]]:
    return [[float(v) if np.isfinite(v) else None for v in row] for row in values]
