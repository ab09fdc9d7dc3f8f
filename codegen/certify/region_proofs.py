"""What is true of a DFO whose envelope is refused for a zero of friction or slip: regions, each with its own proof.

Sliding and presliding have certificates of their own. Through zero a V may grow, by no more than is proved, and one
that falls while sliding serves there too: what a reversal costs follows from that one alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.base.text import render
from codegen.certify.along_friction import AlongFriction, along_friction, envelope_along
from codegen.certify.content import Found, frame, proved_alike, turn_cost
from codegen.certify.family import Family, NotEnclosable
from codegen.certify.levels import SHARES, about_declared, over_levels
from codegen.certify.lyapunov import decay_rate_limit
from codegen.certify.refute import SLACK, refuted_at
from codegen.certify.region_files import REGION_PROOFS
from codegen.certify.regions import Region, RegionSearch
from codegen.certify.rising import none_without_growth
from codegen.checker import verify
from codegen.spec.model import Spec

FALLING = ("sliding.json", "presliding.json", "presliding_back.json")
ZERO = 1e-6


@dataclass(frozen=True)
class Regions:
    """What the checker has accepted of an envelope that is refused as a whole.

    Attributes:
        proofs: file → its content (docs/certificate_format.md).
        ranges: file → variable → (low, high).
        rates: file → 1/s: proved or, of ``sliding_limit.json``, refuted; below zero V may grow.
        reversal: growth of V in ``recovery.json`` where a contact's friction passes zero, by contact.
        sample_time: s.
        must_grow: whether it is proved that no V is non-increasing (``rising``).
        passes_zero: whether the envelope has a friction state of zero.
        whole: files whose region holds the whole envelope.
        levels: (name, lowest, largest, unit) of the true friction levels, of the files but presliding.
        withheld: file that is not issued, since no V was found for a range of levels → the rate at the declared level
            alone, 1/s, where one was found for that.
        least_share: of the declared level, to both sides, the least range that was tried for those.
    """

    proofs: Mapping[str, Mapping[str, Any]]
    ranges: Mapping[str, Mapping[str, tuple[float, float]]]
    rates: Mapping[str, float]
    reversal: Mapping[str, float]
    sample_time: float
    must_grow: bool
    passes_zero: bool = True
    whole: tuple[str, ...] = ()
    levels: tuple[tuple[str, Any, Any, str], ...] = ()
    withheld: Mapping[str, float | None] = field(default_factory=dict)
    least_share: float = float(SHARES[-1])

    @property
    def words(self) -> dict[str, str]:
        """file → what it says, in a line."""
        return {name: " ".join(render("text/region_line.j2", name=name, regions=self).split()) for name in self.proofs}

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of regions that nothing was certified of."""
        wanted = ("sliding", "presliding", "weak", *(("passing", "recovery") if self.passes_zero else ()))
        return tuple(name for name in wanted if f"{name}.json" not in self.proofs)

    def made_good(self, passage: float) -> float:
        """How much sliding makes a reversal of every contact good, s, that was away from sliding for so long, s."""
        growth = float(np.log(list(self.reversal.values())).sum())
        h, up, down = self.sample_time, self.rates["passing.json"], self.rates["recovery.json"]
        risen = growth + passage / h * float(np.log1p(-2 * up * h))
        return risen / -float(np.log1p(-2 * down * h)) * h


def find_regions(spec: Spec, analysis: Analysis, files: Mapping[str, str], command: str) -> Regions | None:
    """The regions of a refused DFO, or None where its envelope is refused for another reason or has no such form.

    Args:
        files: name → SHA-256 of the generated sources.
        command: that writes them.
    """
    if not analysis.dynamics.observer.truth_ranges or analysis.spectral_abscissa > ZERO:
        return None
    declared = along_friction(analysis)
    if declared is None:
        return None
    ranges = (
        [about_declared(analysis, share) for share in SHARES] if analysis.dynamics.observer.declared_levels else [{}]
    )
    for k, levels in enumerate(ranges):
        maker = _Maker(spec, over_levels(analysis, levels), files, command)
        try:
            search = RegionSearch(maker.along)
            maker.all(search.regions())
        except (NotEnclosable, TypeError, verify.Refused):
            continue
        if maker.proofs:
            return _with_presliding(maker, search, declared, [over_levels(analysis, r) for r in ranges[k + 1 :]])
    return None


def _with_presliding(maker: _Maker, search: RegionSearch, declared: AlongFriction, narrower: list[Analysis]) -> Regions:
    """What was proved; presliding over narrower ranges of levels where it was not for the widest, or its absence."""
    if maker.presliding_whole or not narrower:
        return maker.regions()
    if FALLING[1] not in maker.proofs:  # what serves a range of levels serves a narrower one: the narrowest decides
        *wider, narrowest = (maker.at(analysis) for analysis in narrower)
        found = narrowest.presliding_by(search)
        if found:
            found = next((p for other in wider if FALLING[1] in (p := other.presliding_by(search))), found)
        maker.proofs |= found
    alone = dict(zip(FALLING[1:], (region.rate for region in search.presliding(declared)), strict=False))
    asked = [*alone, *(FALLING[2:] if FALLING[1] in maker.proofs else ())]
    return replace(maker.regions(), withheld={name: alone.get(name) for name in asked if name not in maker.proofs})


class _Maker:
    """Writes the proofs and keeps those that the checker accepts."""

    def __init__(
        self,
        spec: Spec,
        analysis: Analysis,
        files: Mapping[str, str],
        command: str,
        along: AlongFriction | None = None,
    ) -> None:
        along = along or along_friction(analysis)
        assert along is not None
        self.spec, self.analysis, self.along, self.files, self.command = spec, analysis, along, files, command
        self.proofs: dict[str, dict[str, Any]] = {}
        self.envelope = envelope_along(analysis)

    def at(self, analysis: Analysis) -> _Maker:
        """The same for other ranges of the same levels, without proofs."""
        along = self.along.over(analysis.dynamics.observer)
        return _Maker(self.spec, analysis, self.files, self.command, along)

    def presliding_by(self, search: RegionSearch) -> dict[str, dict[str, Any]]:
        """The proofs of presliding at these levels, beside the sliding that was found."""
        self.all(search.presliding(self.along))
        return self.proofs

    def all(self, found: list[Region]) -> None:
        """Prove what was found."""
        for region in found:
            if region.kind in ("sliding", "presliding", "weak"):
                self.alone(region)
        together = [region for region in found if region.kind in ("passing", "recovery")]
        if len(together) == 2 and self.passes_zero:
            self.together(together)
        self.limit(found)

    @property
    def passes_zero(self) -> bool:
        """Whether the envelope has a friction state of zero."""
        return any(axis.least_state == 0 for axis in self.along.axes)

    @property
    def presliding_whole(self) -> bool:
        """Whether it was proved for slips along the friction states and against them, together or apart."""
        axis = self.along.axes[0].slip.name
        ends = [
            Fraction(x) for name in FALLING[1:2] if name in self.proofs for x in self.proofs[name]["variables"][axis]
        ]
        return FALLING[2] in self.proofs or (bool(ends) and ends[0] < 0 < ends[1])

    def _holds_envelope(self, content: Mapping[str, Any]) -> bool:
        asked = {v.name: ends for v, ends in (self.envelope or {}).items()}
        ends = {v: pair for axis in self.along.axes for v in axis.symbols if (pair := content["variables"].get(v.name))}
        return bool(asked) and all(
            v.name in asked and sympy.Rational(low) <= asked[v.name][0] and asked[v.name][1] <= sympy.Rational(high)
            for v, (low, high) in ends.items()
        )

    def regions(self) -> Regions:
        ordered = {name: self.proofs[name] for name in REGION_PROOFS if name in self.proofs}
        turns = self.proofs.get("recovery.json", {"reversals": []})["reversals"]
        return Regions(
            ordered,
            {
                name: {v: (float(Fraction(lo)), float(Fraction(hi))) for v, (lo, hi) in c["variables"].items()}
                for name, c in ordered.items()
            },
            {name: float(Fraction(c["decay_rate"])) for name, c in ordered.items()},
            {turn["contact"]: float(Fraction(turn["growth"])) for turn in turns},
            float(self.analysis.dynamics.observer.sample_time),
            self.passes_zero and none_without_growth(self.along),
            self.passes_zero,
            tuple(name for name in FALLING if name in ordered and self._holds_envelope(ordered[name])),
            self.analysis.dynamics.observer.ranged_levels,
        )

    def base(self, family: Family) -> dict[str, Any]:
        """What ``frame`` gives, over the axes: nothing of it is read from the twin."""
        content = frame(self.spec, self.analysis, family, self.files, self.command)
        for error, own in zip(content["error"], self.analysis.dynamics.observer.errors, strict=True):
            if own.of == "level":
                error["meaning"] = f"sign of friction state times ({error['meaning']})"
        return content

    def alone(self, region: Region) -> None:
        name = f"{region.kind}.json"
        if name in self.proofs:
            name = f"{region.kind}_back.json"
        self._prove([(name, region)])

    def together(self, regions: list[Region]) -> None:
        self._prove([(f"{region.kind}.json", region) for region in regions])

    def _prove(self, named: list[tuple[str, Region]]) -> None:
        parts = [(self.base(r.family), r.family, Found(r.rate, r.splits, [r.p])) for _, r in named]

        def finish(k: int, content: dict[str, Any]) -> dict[str, Any]:
            kind = named[k][1].kind
            rate, h = float(Fraction(content["decay_rate"])), float(Fraction(content["sample_time"]))
            if kind == "recovery":
                content = content | {"reversals": self._turns(content, 1 - 2 * rate * h)}
            return content | self._words(kind, content, rate, h)

        with suppress(verify.Refused):
            contents = proved_alike(parts, self.analysis, finish)
            self.proofs |= {name: content for (name, _), content in zip(named, contents, strict=True)}

    def _turns(self, content: Mapping[str, Any], fall: float) -> list[dict[str, Any]]:
        names = [error["name"] for error in content["error"]]
        exact = [[sympy.Rational(x) for x in row] for row in content["lyapunov_matrix"]]
        contacts = [axis.name for axis in self.along.axes]
        return [turn_cost([[exact]], name, [names.index(f"e_a_{name}")], fall) for name in contacts]

    def _words(self, kind: str, content: Mapping[str, Any], rate: float, h: float) -> dict[str, Any]:
        words = {
            "kind": kind,
            "rate": rate,
            "period": h,
            "axes": self.along.axes,
            "observer": self.analysis.dynamics.observer,
        }
        words |= {"reversals": content["reversals"]}
        words |= {"variables": content["variables"]}
        more = render("text/region_assumptions.j2", **words).splitlines()
        return {
            "claim": " ".join(render("text/region_claim.j2", **words).split()),
            "assumptions": [*content["assumptions"], *[line.strip() for line in more if line.strip()]],
        }

    def limit(self, found: list[Region]) -> None:
        """The refutation of every faster rate while sliding, from the slowest corner of its box."""
        if "sliding.json" not in self.proofs:
            return
        family = next(region.family for region in found if region.kind == "sliding")
        h = float(self.analysis.dynamics.observer.sample_time)
        corners = []
        for ends in product(*[sorted({*ends}) for ends in family.variables.values()]):
            point = dict(zip(family.variables, ends, strict=True))
            exact = family.matrix.xreplace({s: e.xreplace(point) for s, e in family.parameters.items()})
            a = np.array(exact.tolist(), dtype=float)
            corners.append((decay_rate_limit([a], h), {v.name: x for v, x in point.items()}, a))
        limit, at, a = min(corners, key=lambda corner: corner[0])
        rates = [limit * (1 + slack) for slack in SLACK]
        content = refuted_at(self.analysis, self.base(family), at, a, rates)
        if content is not None:
            self.proofs["sliding_limit.json"] = content
