"""Certificates of a DFO for regions of an envelope that is refused because it contains zero friction or zero slip.

- sliding.json and presliding.json: V decreases in the region; sliding_limit.json refutes faster rates while sliding.
- weak.json: V over the whole envelope, which may grow at a proved rate.
- passing.json and recovery.json: one V that decreases while sliding and grows at a proved rate elsewhere. They give the
  growth of V at a reversal and the dwell time after it.
"""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.certify import REGION_PROOFS
from codegen.certify.along_friction import AlongFriction, along_friction, envelope_along
from codegen.certify.content import Found, Frame, lines, one_line, proved, reversal_entry
from codegen.certify.family import Family, NotEnclosable
from codegen.certify.levels import SHARES, about_declared
from codegen.certify.lyapunov import decay_rate_limit
from codegen.certify.refute import Slowest, refute
from codegen.certify.regions import RegionSearch
from codegen.checker import verify

PRESLIDING = "presliding.json"
"""Name of the proof file of presliding."""
FALLING = ("sliding.json", PRESLIDING)
"""Files of regions in which V decreases."""
ZERO = 1e-6
"""Spectral abscissa of Ψ, 1/s, up to which the error counts as not growing in continuous time."""


@dataclass(frozen=True)
class Regions:
    """The accepted proofs for regions of an envelope that is refused as a whole.

    Attributes:
        proofs: file → its content (docs/certificate_format.md).
        sample_time: s.
        passes_zero: whether the envelope contains a friction state of zero.
        whole: files whose region is the whole envelope.
        levels: (name, lowest, largest, unit) of the true friction levels.
    """

    proofs: Mapping[str, Mapping[str, Any]]
    sample_time: float
    passes_zero: bool = True
    whole: tuple[str, ...] = ()
    levels: tuple[tuple[str, Any, Any, str], ...] = ()

    @property
    def ranges(self) -> dict[str, dict[str, tuple[float, float]]]:
        """file → variable → (low, high)."""
        ends = {name: content["variables"].items() for name, content in self.proofs.items()}
        return {name: {v: (float(Fraction(a)), float(Fraction(b))) for v, (a, b) in of} for name, of in ends.items()}

    @property
    def rates(self) -> dict[str, float]:
        """file → rate α, 1/s: proved or, for ``sliding_limit.json``, refuted; if negative, V may grow."""
        return {name: float(Fraction(content["decay_rate"])) for name, content in self.proofs.items()}

    @property
    def reversal(self) -> dict[str, float]:
        """contact → growth of V in ``recovery.json`` when its friction changes sign."""
        turns = self.proofs.get("recovery.json", {"reversals": []})["reversals"]
        return {turn["contact"]: float(Fraction(turn["growth"])) for turn in turns}

    @property
    def words(self) -> dict[str, str]:
        """file → its claim, in one line."""
        return {name: one_line("text/region_line.j2", name=name, regions=self) for name in self.proofs}

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of regions without a certificate."""
        wanted = ("sliding", "presliding", "weak", *(("passing", "recovery") if self.passes_zero else ()))
        return tuple(name for name in wanted if f"{name}.json" not in self.proofs)

    def recovery_time(self, passage: float) -> float:
        """Dwell time after a reversal of all contacts, s: the duration of sliding until V is at its value before it.

        Args:
            passage: duration of the reversal, in which V may grow, s.
        """
        growth = float(np.log(list(self.reversal.values())).sum())
        h, up, down = self.sample_time, self.rates["passing.json"], self.rates["recovery.json"]
        risen = growth + passage / h * float(np.log1p(-2 * up * h))
        return risen / -float(np.log1p(-2 * down * h)) * h


def find_regions(analysis: Analysis, stated: Frame) -> Regions | None:
    """The proofs for regions of a refused DFO; None if it is refused for another reason or has no symmetric form.

    Without a range of the level in the envelope, the widest range about the declared level is used that has a proof.
    """
    observer = analysis.dynamics.observer
    if not observer.truth_ranges or analysis.spectral_abscissa > ZERO:
        return None
    for wide in [about_declared(analysis, share) for share in SHARES] if observer.declared_levels else [analysis]:
        along = along_friction(wide)
        if along is None:
            return None
        proofs = _Proofs(wide, along, stated)
        with suppress(NotEnclosable, TypeError, verify.Refused):
            proofs.add(RegionSearch(along).regions())
            if proofs.proofs:
                return proofs.regions()
    return None


@dataclass(frozen=True)
class _Proofs:
    """The proofs that the checker accepts at one range of levels: file → content."""

    analysis: Analysis
    along: AlongFriction
    stated: Frame
    proofs: dict[str, dict[str, Any]] = field(default_factory=dict)

    def add(self, found: list[Found]) -> None:
        """Add the proofs of these proposals, as far as the checker accepts them."""
        for region in found:
            if region.kind in ("sliding", "presliding", "weak"):
                self._prove({f"{region.kind}.json": region})
        # recovery.json first: it has the smaller box, so digits that are too few for it are found sooner.
        together = {f"{r.kind}.json": r for r in reversed(found) if r.kind in ("passing", "recovery")}
        if len(together) == 2 and self.passes_zero:
            self._prove(together)
        if "sliding.json" in self.proofs:
            self._limit(next(region.family for region in found if region.kind == "sliding"))

    @property
    def passes_zero(self) -> bool:
        """Whether the envelope has a friction state of zero."""
        return any(axis.least_state == 0 for axis in self.along.axes)

    def _holds_envelope(self, content: Mapping[str, Any]) -> bool:
        """Whether the ranges of a certificate contain the envelope."""
        asked = {v.name: ends for v, ends in (envelope_along(self.analysis) or {}).items()}
        names = {v.name for axis in self.along.axes for v in axis.symbols} & content["variables"].keys()
        ends = {name: [sympy.Rational(x) for x in content["variables"][name]] for name in names}
        return bool(asked) and all(
            name in asked and low <= asked[name][0] and asked[name][1] <= high for name, (low, high) in ends.items()
        )

    def regions(self) -> Regions:
        """The result."""
        ordered = {name: self.proofs[name] for name in REGION_PROOFS if name in self.proofs}
        return Regions(
            ordered,
            float(self.analysis.dynamics.observer.sample_time),
            self.passes_zero,
            tuple(name for name in FALLING if name in ordered and self._holds_envelope(ordered[name])),
            self.analysis.dynamics.observer.ranged_levels,
        )

    def _base(self, family: Family) -> dict[str, Any]:
        """The fields of a certificate that do not depend on the proof, in sign-symmetric coordinates."""
        content = self.stated(self.analysis, family)
        for error, own in zip(content["error"], self.analysis.dynamics.observer.errors, strict=True):
            if own.of == "level":
                error["meaning"] = f"sign of friction state times ({error['meaning']})"
        return content

    def _prove(self, named: Mapping[str, Found]) -> None:
        """Add certificates of proposals with the same P, if the checker accepts all of them; file → proposal."""

        def finish(region: Found, content: dict[str, Any]) -> dict[str, Any]:
            rate, h = float(Fraction(content["decay_rate"])), float(Fraction(content["sample_time"]))
            if region.kind == "recovery":
                errors = self.analysis.dynamics.observer.errors
                levels = [k for k, error in enumerate(errors) if error.of == "level"]  # in the order of the axes
                exact = [[sympy.Rational(x) for x in row] for row in content["lyapunov_matrix"]]
                content["reversals"] = [
                    reversal_entry(exact, axis.name, [level], -math.log1p(-2 * rate * h))
                    for axis, level in zip(self.along.axes, levels, strict=True)
                ]
            words = {"kind": region.kind, "rate": rate, "period": h, "axes": self.along.axes}
            words |= {"observer": self.analysis.dynamics.observer}
            words |= {key: content[key] for key in ("reversals", "variables")}
            said: dict[str, Any] = {"claim": one_line("text/region_claim.j2", **words)}
            said["assumptions"] = [*content["assumptions"], *lines("text/region_assumptions.j2", **words)]
            return content | said

        with suppress(verify.Refused):
            accepted = proved([(self._base(r.family), r) for r in named.values()], self.analysis, finish)
            self.proofs.update(zip(named, (content for content, _ in accepted), strict=True))

    def _limit(self, family: Family) -> None:
        """Add the refutation of every faster rate while sliding, at the slowest vertex of the region's box."""
        h = float(self.analysis.dynamics.observer.sample_time)
        corners = []
        for ends in product(*[sorted({*ends}) for ends in family.variables.values()]):
            point = dict(zip(family.variables, ends, strict=True))
            a = np.array(family.at(point), dtype=float)
            corners.append(Slowest(decay_rate_limit([a], h), {v.name: x for v, x in point.items()}, a))
        content = refute(self.analysis, min(corners, key=lambda corner: corner.rate), self._base(family))
        if content is not None:
            self.proofs["sliding_limit.json"] = content
