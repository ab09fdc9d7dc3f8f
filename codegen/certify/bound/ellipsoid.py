"""The bounds of error_bound.py as a claim in rationals, ellipsoid.json, which checker/ellipsoid.py proves of the C.

Let e[k+1] = Φe[k] + Σ_j b_j w_j with |w_j| ≤ d_j. The ellipsoid {e : e'Q⁻¹e ≤ 1}, on which |c'e| ≤ √(c'Qc) for every
row c', is invariant if

    Q ≥ ΦQΦ'/f + Σ_j t_j b_j b_j'    and    f + Σ_j d_j²/t_j ≤ 1,    0 < f < 1, t_j > 0.

With γ, M, a_j and S of reach.py these hold for f = γ, t_j = d_j S/((1 − γ) a_j) and Q = P⁻¹ S², since
b_j b_j' ≤ b_j'M⁻¹b_j M by Cauchy's inequality and Q − ΦQΦ'/f = S²M. Nothing here is trusted.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.result import json_text
from codegen.base.significant import float_above
from codegen.certify.bound.bounds import ErrorBound, Reversal
from codegen.certify.bound.disturbances import EXACT, disturbances, dot
from codegen.certify.bound.error_bound import after_reversal
from codegen.certify.bound.error_response import Response
from codegen.certify.bound.reach import Reach, reach_of
from codegen.certify.certificate_text import fraction, rational_text, rounded_matrix, texts, upwards
from codegen.certify.content import with_reversals
from codegen.certify.kernel_form import Writer
from codegen.certify.outcome import Certificate
from codegen.checker import ellipsoid, kernel, theorem
from codegen.checker import verify as checker
from codegen.observers.equations import Observer
from codegen.spec.model import Spec

DIGITS, OF_MATRIX = 7, 12
"""Significant digits of the bounds, and of Q, f and t."""
START_DIGITS = 6
"""Significant digits of the errors at a start."""
NEAR = 1e-6
"""Relative margin for rounding errors."""
SPARE = 1e-2
"""Relative enlargement of Q, so that the inequality holds for the rounded Q too. Of a bound, the remainder of the sum
alone grows with Q."""
LEAST = 1e-6
"""Least a_j as a share of their weighted mean: a b_j that is nearly zero has no large t_j then."""


@dataclass(frozen=True)
class Disturbance:
    """A disturbance w_j with |w_j| ≤ d_j and its input vector b_j.

    Attributes:
        kind: noise, drift or friction, as in the claim's fields.
        of: place of the disturbed quantity in the proof.
        size: d_j.
        column: b_j without the factor ``sign``, length m.
        sign: the sign symbol that multiplies b_j in the proof; "" for 1.
    """

    kind: str
    of: str
    size: Fraction
    column: Sequence[Any]
    sign: str = ""

    def entry(self, row: int) -> str:
        """An entry of b_j as text, times ``sign``."""
        value = rational_text(self.column[row])
        return f"{value}*{self.sign}" if self.sign and value != "0" else value


def with_ellipsoid(
    certificate: Certificate, spec: Spec, observer: Observer, places: Mapping[str, str], shown: dict[str, Any]
) -> Certificate:
    """The certificate with bounds that the checker proves of the C; unchanged if there are none.

    Args:
        certificate: with the kernel's proof.
        places: as in kernel_form.proof_text.
        shown: what the kernel derives from that proof (``theorem.proved``).
    """
    response = certificate.response
    if isinstance(certificate.bounds, str) or response is None or certificate.kernel is None:
        return certificate
    above = [speed.above for speed in certificate.bounds[0].slip_speeds]
    sizes = disturbances(spec, observer, response, EXACT, above)
    if isinstance(sizes, str) or not any(map(any, sizes.values())):
        return certificate
    proof = json.loads(certificate.kernel)
    reach = reach_of(response, certificate.content)
    write, counts = Writer(observer, places), after_reversal(observer, certificate)
    claim = _Claim(observer, write, proof, shown, response, reach, sizes, certificate.bounds, counts).content()
    text = json_text(claim)
    try:
        found = theorem.ellipsoid_claim(proof, shown, text.encode())[1]
    except checker.Refused:
        return certificate
    h, bounds = float(observer.sample_time), []
    units = np.eye(len(proof["errors"]))[-len(certificate.bounds) :].tolist()
    turns: dict[int, Reversal] = {}
    reversals = claim.get(ellipsoid.REVERSALS, [])
    for entry in reversals:
        level = [e["sign"] for e in proof["errors"]].index(entry["sign"])
        left = float_above(Fraction(entry["after"][level]))
        turns[level] = Reversal(int(entry["samples"]), int(entry["turns"]), left)
    proved = [
        ([Fraction(c) for c in row[:-1]], (int(samples) * h, begun, float_above(x), ellipsoid.FRICTION in set_))
        for set_, each in zip(claim["sets"], found, strict=True)
        for (row, samples, begun, _), x in zip(ellipsoid.claimed_rows(set_), each, strict=True)
    ]
    speeds = []
    for c, speed in enumerate(certificate.bounds[0].slip_speeds):
        slip = [*map(fraction, observer.distribution.col(c)), *[0] * len(units)]
        speeds.append(replace(speed, error=min(x for row, (_, begun, x, any_) in proved if row == slip and not begun)))
    for b, unit in zip(certificate.bounds, units, strict=True):
        own = [bound for row, bound in proved if row == unit]
        after = tuple((time, x) for time, begun, x, _ in own if begun)
        after = after[:-1] or after  # without that ``BEYOND`` them
        steady, always = (min((x for _, begun, x, any_ in own if not begun and any_ == of), default=None)
                          for of in (False, True))  # fmt: skip
        assert steady is not None
        b = replace(b, proved=True, steady=steady, after=after, reversal=turns.get(unit.index(1.0)), always=always)
        bounds.append(replace(b, slip_speeds=tuple(speeds)))
    said = with_reversals(certificate.content, [entry["sign"].removeprefix("sign.") for entry in reversals])
    return replace(certificate, content=said, bounds=tuple(bounds), ellipsoid=text)


@dataclass(frozen=True)
class _Claim:
    """What a claim of invariant ellipsoids is made of.

    Attributes:
        shown: what the kernel derives from ``proof``.
        sizes: cause → the largest disturbance of each coordinate or friction (``disturbances``).
        bounds: of each friction error.
        counts: numbers of samples after a reversal from which on the claim has a bound.
    """

    observer: Observer
    write: Writer
    proof: dict[str, Any]
    shown: dict[str, Any]
    response: Response
    reach: Reach
    sizes: Mapping[str, Sequence[Fraction]]
    bounds: Sequence[ErrorBound]
    counts: Sequence[int]

    def content(self) -> dict[str, Any]:
        """The JSON object of ellipsoid.json (docs/certificate_format.md)."""
        observer, proof, bounds, response = self.observer, self.proof, self.bounds, self.response
        positions = [self.write(x) for x in observer.system.positions]
        n, friction = len(positions), self._any_friction()
        of = self._disturbances(positions, friction)
        m = len(response.step.col(0))
        rows = [[*column, *[0] * (m - n)] for column in observer.distribution.T.tolist()]
        errors = sympy.eye(m)[n:, :].tolist()
        size = np.array([float(d.size) for d in of])
        columns = np.array([[float(b) for b in d.column] for d in of]).T
        acting = size * [d.kind != ellipsoid.FRICTION for d in of]
        free = size * [not (d.kind == "drift" and d.of in friction) for d in of]
        # A set that holds for any friction: of trackers, whose proof has no signs.
        units = [] if proof["signs"] or not friction else sympy.eye(m).tolist()
        any_friction = [_set(self.reach, columns, free, units) | {ellipsoid.FRICTION: "any"}] if units else []
        noise = [float(dot(row, self.sizes["noise"])) for row in response.direct.tolist()]
        level_signs, truths = ([e[part] for e in proof["errors"]] for part in ("sign", "truth"))
        # The largest errors in this set, from which the bounds after a reversal start.
        whole = [Fraction(row[-1]) for ball in any_friction for row in ball["rows"]]
        worst = [
            upwards(float(most + friction.get(truth, 0)) + x, START_DIGITS)
            for most, truth, x in zip(whole, truths, noise, strict=bool(units))
        ]
        by_position = any(p.free_symbols & {*observer.system.positions} for p in response.nonaffine)

        def shift(row: Sequence[Any], sign: str) -> str:
            """Σ b · noise.x as text, times ``sign``: the direct feedthrough of noise to an error."""
            parts = [(b, x) for b, x, d in zip(row, positions, self.sizes["noise"], strict=True) if b and d]
            terms = ["*".join([f"({rational_text(b)})", *([sign] if sign else []), f"noise.{x}"]) for b, x in parts]
            return " + ".join(terms) or "0"

        steep = {
            " + ".join(v if a == 1 else f"({rational_text(a)})*{v}" for a, v in zip(row, truths, strict=True) if a): s
            for row, s in zip(rows, bounds[0].slip_speeds, strict=True)
            if s.above
        }
        claim: dict[str, Any] = {
            "name": proof["name"],
            **({ellipsoid.FORCES: "measured"} if by_position else {}),
            "noise": {d.of: str(d.size) for d in of if d.kind == "noise"},
            "drift": {d.of: str(d.size) for d in of if d.kind == "drift"},
            "shifts": [*map(shift, response.direct.tolist(), level_signs)],
            **({ellipsoid.FRICTION: {truth: str(most) for truth, most in friction.items()}} if friction else {}),
            "push": [[d.entry(i) for d in of] for i in range(m)],
            **({ellipsoid.ABOVE: {slip: str(s.above) for slip, s in steep.items()}} if steep else {}),
            "sets": [],
        }
        # The set of the long run: rows of the slip velocities and of the friction errors.
        ball = _set(self.reach, columns, acting, [*rows, *errors])
        # Errors right after a reversal: those for any friction, else assumed; of a (G)CFO as ``reversals`` proves them.
        starts = {b.name: worst or [upwards(s, START_DIGITS) for s in b.starts] for b in bounds}
        if friction and level_signs[-1]:
            known = [float(Fraction(row[-1])) for row in ball["rows"][len(rows) :]]
            most = [*bounds[0].starts[:n], *(x + y for x, y in zip(known, noise[n:], strict=True))]
            entries = self._reversals(claim, most)
            claim[ellipsoid.REVERSALS] = entries
            starts |= {b.name: [*map(Fraction, e["after"])] for b, e in zip(bounds, entries, strict=False)}
        claim["sets"] = [ball | self._decay(ball, starts, columns, acting, noise), *any_friction]
        return claim

    def _decay(
        self, ball: Mapping[str, Any], starts: Mapping[str, Any], columns: Array, size: Array, noise: Sequence[float]
    ) -> dict[str, Any]:
        """The fields within and after of a set: bounds on the friction errors from given times after a reversal on.

        Args:
            starts: name of a bound → |error| of each component right after the reversal: proved, or else assumed.
            columns, size: b_j and d_j.
            noise: bound on the direct feedthrough of noise to each error.
        """
        units = np.eye(len(noise))
        whole = {name: np.array([float(s) for s in start]) + noise for name, start in starts.items()}
        within = [upwards(w * (1 + NEAR), DIGITS) for w in np.max([*whole.values()], axis=0)]
        matrix = np.array([[float(Fraction(x)) for x in row] for row in ball["matrix"]])
        scale = np.array([float(s) for s in within])
        most = float(np.linalg.eigvalsh(np.outer(scale, scale) * np.linalg.inv(matrix)).max()) * len(scale)
        larger = upwards(max(1.001 * most, 1.0), 3)
        level = float(larger) * float(matrix[0, 0] / self.reach.inverse[0, 0])
        after, counts = [], self.counts
        for row, b in zip(units[-len(self.bounds) :], self.bounds, strict=True):
            start = whole[b.name]
            found = self.reach.later(row, columns * size, counts, start, level)
            stated = [
                [str(k), str(upwards(x * (1 + NEAR), DIGITS))]
                for k, x in zip(counts, found, strict=True)
                if x < row @ start or k in counts[-2:]  # a bound above that at the start adds nothing
            ]
            line = {"row": [str(int(x)) for x in row], "start": [str(x) for x in starts[b.name]]}
            after.append(line | {"bounds": stated})
        return {"within": [str(x) for x in (larger, *within)], "after": after}

    def _reversals(self, claim: dict[str, Any], most: Sequence[float]) -> list[dict[str, Any]]:
        """The entries of the field ``reversals``: for each contact, bounds on the errors after one reversal; or [].

        Before the reversal the errors are within ``most``. It takes the samples in which a slip that passes zero at the
        largest acceleration is smaller than the error of its estimate; the estimate changes its sign once in them.
        """
        proof, shown, slips = self.proof, self.shown, self.observer.distribution
        own = {e[part]: kernel.term(1, e[part]) for e in proof["errors"] for part in ("truth", "estimate")}
        text = kernel.Text(shown["names"] | own, {})
        estimates, entries = [e["estimate"] for e in proof["errors"]], list[dict[str, Any]]()
        before = [upwards(x * (1 + NEAR), START_DIGITS) for x in most]
        # Largest change of each slip in a sample, h Σ_i |U_ic| max |v_i'|, where h² max |v_i'|/2 is the displacement.
        # ``sizes["acceleration"]`` contains the error of the model's forces as well.
        double = [2 * x / fraction(self.observer.sample_time) for x in self.sizes["displacement"]]
        contacts = enumerate(self.observer.system.contacts)
        changes = {f"sign.{contact.name}": dot(slips.col(c), double) for c, contact in contacts}
        try:
            known = ellipsoid.dynamics(proof, claim, shown)
        except ValueError:
            return []
        for error in proof["errors"][len(self.observer.system.positions) :]:
            slip = text.value(proof["signs"][error["sign"]])
            state = next(p for z in proof["states"].values() if (error["estimate"],) in (p := text.value(z)))
            (x, *_), change = next(iter(slip)), changes[error["sign"]]
            reach = sum(abs(a) * before[estimates.index(y)] for (y,), a in slip.items())
            jump = 2 * Fraction(state.get(tuple(sorted((error["sign"], x))), 0)) / slip[x,] / state[error["estimate"],]
            if not change:
                return []
            entry = {"sign": error["sign"], "samples": str(2 * math.ceil(reach / change) + 1), "turns": "1"}
            entry |= {"change": str(change), "jump": str(jump), "before": [*map(str, before)]}
            try:
                left = ellipsoid.left_by(entry | {"after": entry["before"]}, proof, claim, shown, known)
            except ValueError:
                return []
            after = [str(upwards(float(b) * (1 + NEAR), START_DIGITS)) for b in left]
            entries.append(entry | {"after": after})
        return entries

    def _disturbances(self, positions: Sequence[str], friction: Mapping[str, Fraction]) -> list[Disturbance]:
        """The disturbances that are not zero, noise first; ``friction``: as of ``_any_friction``."""
        response, sizes, errors = self.response, self.sizes, self.observer.errors
        n, unit = len(positions), sympy.eye(len(errors))
        truths, signs = ([e[part] for e in self.proof["errors"]] for part in ("truth", "sign"))
        blocks = [
            ("noise", positions, sizes["noise"], response.noise),
            ("drift", positions, sizes["displacement"], response.displacement),
            ("drift", truths[:n], sizes["velocity"], response.velocity),
            ("drift", truths[n:], sizes["friction"], unit[:, n:]),
        ]
        if friction:
            slips, h = self.observer.distribution, self.observer.sample_time
            onto = [slips.col(e.contact) if e.coordinate is None else unit[:n, e.coordinate] for e in errors[n:]]
            driven = h * response.velocity * response.by_force * sympy.Matrix.hstack(*onto)
            blocks.append((ellipsoid.FRICTION, truths[n:], [*friction.values()], driven))
        turned = dict(zip(truths[n:], signs[n:], strict=True))
        return [
            Disturbance(kind, name, size, list(matrix.col(j)), turned.get(name, ""))
            for kind, names, each, matrix in blocks
            for j, (name, size) in enumerate(zip(names, each, strict=True))
            if size
        ]

    def _any_friction(self) -> dict[str, Fraction]:
        """Place of each true friction → bound on its magnitude, for claims that hold for any friction within these.

        {} if there can be no such claim: the kernel's proof has conditions, a friction has no bound or, for level
        errors, the level varies with the slip, so that reversals are not covered.
        """
        errors = self.proof["errors"][len(self.observer.system.positions) :]
        most = [b.largest for b in self.bounds if b.largest is not None]
        turns = [bool(e["sign"]) for e in errors]
        varies = any(self.sizes["friction"]) or any(speed.above for speed in self.bounds[0].slip_speeds)
        constant = not any(turns) or (all(turns) and not varies)
        conditions = not self.shown["whole"] or (self.proof["signs"] and not any(turns))
        if conditions or not constant or len(most) < len(self.bounds):
            return {}
        return {e["truth"]: upwards(x, DIGITS) for e, x in zip(errors, most, strict=True)}


def _set(reach: Reach, columns: Array, size: Array, rows: Sequence[Sequence[Any]]) -> dict[str, Any]:
    """An entry of ``sets``: the invariant ellipsoid, and for each row c' a bound on |c'e| in the long run."""
    lengths = reach.lengths(columns)
    lengths = np.maximum(lengths, LEAST * float(size @ lengths) / size.sum())
    share = upwards(reach.gamma, OF_MATRIX)
    f, whole = float(share), float(size @ lengths)
    best = size * whole / ((1 - f) * lengths) * (1 + 10.0 ** (1 - OF_MATRIX))
    weights = [upwards(w, OF_MATRIX) if w else Fraction(0) for w in best]
    matrix = reach.inverse * (whole**2 * (1 + SPARE))
    exact = rounded_matrix(matrix, OF_MATRIX, np.sqrt(np.diag(matrix)))
    floats = np.array(rows, dtype=float)
    summed, rest, samples = reach.sums(floats, columns, [size])
    bounds = (summed @ size + rest @ size * (1 + SPARE)) * (1 + NEAR)
    return {
        "matrix": texts(exact),
        "weights": [str(w) for w in (share, *weights)],
        "samples": str(samples),
        "rows": [
            [rational_text(x) for x in (*row, upwards(bound, DIGITS))] for row, bound in zip(rows, bounds, strict=True)
        ],
    }
