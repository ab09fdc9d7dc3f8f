"""Invariant ellipsoids of the error under bounded disturbances, as proposals for checker/ellipsoid.py.

Let e[k+1] = Φe[k] + Σ_j b_j w_j with |w_j| ≤ d_j. The ellipsoid {e : e'Q⁻¹e ≤ 1}, on which |c'e| ≤ √(c'Qc) for every
row c', is invariant if

    Q ≥ ΦQΦ'/f + Σ_j t_j b_j b_j'    and    f + Σ_j d_j²/t_j ≤ 1,    0 < f < 1, t_j > 0.

For one row c and a given f the least √(c'Qc) is, by Cauchy's inequality, Σ_j d_j √(b_j'Xb_j/(1 − f)), where
X = Φ'XΦ/f + cc' and t_j ∝ d_j/√(b_j'Xb_j). So only f is searched for. Nothing here is trusted.
"""

from __future__ import annotations

import json
import math
from bisect import bisect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import sympy
from scipy.linalg import solve_discrete_lyapunov

from codegen.base.arrays import Array
from codegen.base.significant import float_above
from codegen.certify.bound.bounds import ErrorBound, Reversal
from codegen.certify.bound.disturbances import disturbances, dot
from codegen.certify.bound.error_response import Response
from codegen.certify.certificate_text import fraction, rational_text, rounded, rounded_matrix, texts, upwards
from codegen.certify.content import with_reversals
from codegen.certify.kernel_form import Writer
from codegen.certify.outcome import Certificate
from codegen.checker import ellipsoid, kernel, theorem
from codegen.checker import verify as checker
from codegen.observers.equations import Observer
from codegen.spec.model import Spec

FEW = 8
"""Largest number of errors for which each row has its own ellipsoid; with more, all rows have one in common."""
SHARES = 64
"""Number of intervals of the grid for f, from ρ² to 1, ρ the spectral radius of Φ."""
DIGITS = 7
"""Significant digits of Q, t and the bounds."""
START_DIGITS = 6
"""Significant digits of the errors at a start."""
SUMMED, LONGEST = 3.0, 2000
"""Length of the explicit sum before the ellipsoid bounds the remainder: in time constants, and at most in samples."""
NEAR = 1e-6
"""Relative margin for rounding errors."""
SPARE = 1e-4
"""Relative enlargement of Q, so that the inequality holds for the rounded Q too."""


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
    sizes = disturbances(spec, observer, response)
    if isinstance(sizes, str) or not any(map(any, sizes.values())):
        return certificate
    proof = json.loads(certificate.kernel)
    claim = _Claim(observer, Writer(observer, places), proof, shown, response, sizes, certificate.bounds).content()
    text = json.dumps(claim, indent=1) + "\n"
    try:
        found = theorem.kept(proof, shown, text.encode())[1]
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
        of_slip = [x for row, (_, begun, x, any_) in proved if row == slip and not begun and not any_]
        speeds.append(replace(speed, error_of_code=min(of_slip, default=None)))
    for b, unit in zip(certificate.bounds, units, strict=True):
        own = [bound for row, bound in proved if row == unit]
        after = tuple((time, x) for time, begun, x, _ in own if begun)
        steady, always = (min((x for _, begun, x, any_ in own if not begun and any_ == of), default=None)
                          for of in (False, True))  # fmt: skip
        of_code = replace(b, of_code=steady, after_of_code=after, reversal=turns.get(unit.index(1.0)))
        bounds.append(replace(of_code, always=always, slip_speeds=tuple(speeds)))
    said = with_reversals(certificate.content, [entry["sign"].removeprefix("sign.") for entry in reversals])
    return replace(certificate, content=said, bounds=tuple(bounds), ellipsoid=text)


@dataclass(frozen=True)
class _Claim:
    """What a claim of invariant ellipsoids is made of.

    Attributes:
        write: printer of expressions in the code's quantities.
        proof: the kernel's proof.
        shown: what the kernel derives from it.
        response: linear response of the errors to disturbances.
        sizes: cause → the largest disturbance of each coordinate or friction (``disturbances``).
        bounds: of each friction error; they give the times after a reversal at which the claim has a bound.
    """

    observer: Observer
    write: Writer
    proof: dict[str, Any]
    shown: dict[str, Any]
    response: Response
    sizes: Mapping[str, Sequence[Fraction]]
    bounds: Sequence[ErrorBound]

    def content(self) -> dict[str, Any]:
        """The JSON object of ellipsoid.json (docs/certificate_format.md)."""
        observer, proof, bounds, response = self.observer, self.proof, self.bounds, self.response
        positions = [self.write(x) for x in observer.system.positions]
        n, friction = len(positions), self._any_friction()
        of = self._disturbances(positions, friction)
        step = np.array(response.step, dtype=float)
        rows = [[*column, *[0] * (len(step) - n)] for column in observer.distribution.T.tolist()]
        errors = sympy.eye(len(step))[n:, :].tolist()
        size = np.array([float(d.size) for d in of])
        columns = np.array([[float(b) for b in d.column] for d in of]).T
        acting = size * [d.kind != ellipsoid.FRICTION for d in of]
        free = size * [not (d.kind == "drift" and d.of in friction) for d in of]

        def grouped(asked: Group) -> list[Group]:
            """Each row alone, or all rows together if there are more than ``FEW`` errors."""
            return [[each] for each in asked] if len(step) <= FEW else [asked]

        # Sets that hold for any friction: of trackers, whose proof has no signs.
        units = [] if proof["signs"] or not friction else sympy.eye(len(step)).tolist()
        every = grouped([(row, None) for row in units]) if units else []
        any_friction_sets = [_set(step, columns, free, group) | {ellipsoid.FRICTION: "any"} for group in every]
        noise = [float(dot(row, self.sizes["noise"])) for row in response.direct.tolist()]
        level_signs, truths = ([e[part] for e in proof["errors"]] for part in ("sign", "truth"))
        # The largest errors in these sets, from which the bounds after a reversal start.
        whole = [fraction(row[-1]) for ball in any_friction_sets for row in ball["rows"]]
        worst = [
            upwards(float(most + friction.get(truth, 0)) + x, START_DIGITS)
            for most, truth, x in zip(whole, truths, noise, strict=bool(units))
        ]
        by_position = any(p.free_symbols & {*observer.system.positions} for p in response.nonaffine)
        claim: dict[str, Any] = {
            "name": proof["name"],
            **({ellipsoid.FORCES: "measured"} if by_position else {}),
            "noise": {d.of: str(d.size) for d in of if d.kind == "noise"},
            "drift": {d.of: str(d.size) for d in of if d.kind == "drift"},
            "shifts": [
                _shift([(b, x) for b, x, d in zip(row, positions, self.sizes["noise"], strict=True) if b and d], s)
                for row, s in zip(response.direct.tolist(), level_signs, strict=True)
            ],
            **({ellipsoid.FRICTION: {truth: str(most) for truth, most in friction.items()}} if friction else {}),
            "push": [[d.entry(i) for d in of] for i in range(len(step))],
            "sets": [],
        }
        # Sets of the long run: rows of the slip velocities and of the friction errors.
        groups = grouped([(row, None) for row in rows] + list(zip(errors, bounds, strict=True)))
        ellipsoids = [(group, _set(step, columns, acting, group)) for group in groups]
        # Errors right after a reversal: those for any friction, else assumed; of a (G)CFO as ``reversals`` proves them.
        starts = {b.name: worst or [upwards(s, START_DIGITS) for s in b.starts] for b in bounds}
        if friction and level_signs[-1]:
            known = {tuple(row): float(bound) for _, ball in ellipsoids for *row, bound in map(_numbers, ball["rows"])}
            most = [*bounds[0].starts[:n], *(known[tuple(row)] + x for row, x in zip(errors, noise[n:], strict=True))]
            entries = self._reversals(claim, most)
            claim[ellipsoid.REVERSALS] = entries
            starts |= {b.name: _numbers(entry["after"]) for b, entry in zip(bounds, entries, strict=False)}
        h = float(observer.sample_time)
        claim["sets"] = [
            *(_with_decay(ball, group, starts, step, columns * acting, noise, h) for group, ball in ellipsoids),
            *any_friction_sets,
        ]
        return claim

    def _reversals(self, claim: dict[str, Any], most: Sequence[float]) -> list[dict[str, Any]]:
        """The entries of the field ``reversals``: for each contact, bounds on the errors after one reversal of it.

        Before the reversal the errors are within ``most``. It takes the samples in which a slip that passes zero at the
        largest acceleration is smaller than the error of its estimate; the estimate changes its sign once in them.
        There are no entries if one of them cannot be computed.

        Args:
            most: bound on the magnitude of each error.
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
            entry |= {"change": str(change), "jump": str(jump), "before": [rational_text(b) for b in before]}
            try:
                left = ellipsoid.left_by(entry | {"after": entry["before"]}, proof, claim, shown, known)
            except ValueError:
                return []
            after = [rational_text(upwards(float(b) * (1 + NEAR), START_DIGITS)) for b in left]
            entries.append(entry | {"after": after})
        return entries

    def _disturbances(self, positions: Sequence[str], friction: Mapping[str, Fraction]) -> list[Disturbance]:
        """The disturbances that are not zero, noise first.

        Args:
            positions: places of the positions in the proof.
            friction: place of a true friction → bound on its magnitude, for the sets that hold for any friction; or {}.
        """
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
        constant = not any(turns) or (all(turns) and not any(self.sizes["friction"]))
        conditions = not self.shown["whole"] or (self.proof["signs"] and not any(turns))
        if conditions or not constant or len(most) < len(self.bounds):
            return {}
        return {e["truth"]: fraction(upwards(x, DIGITS)) for e, x in zip(errors, most, strict=True)}


def _numbers(texts_: Sequence[str]) -> list[Any]:
    """Exact numbers from text."""
    return [sympy.Rational(x) for x in texts_]


def _shift(parts: Sequence[tuple[Any, str]], sign: str) -> str:
    """Σ b · noise.x as text, times ``sign``: the direct feedthrough of noise to an error."""
    terms = [f"{'*'.join([f'({rational_text(b)})', *([sign] if sign else []), f'noise.{x}'])}" for b, x in parts]
    return " + ".join(terms) or "0"


Group = Sequence[tuple[Sequence[Any], ErrorBound | None]]
"""Pairs (row c, bound of the friction error that the row selects, or None) that have one ellipsoid in common."""


def _set(step: Array, columns: Array, size: Array, group: Group) -> dict[str, Any]:
    """An entry of ``sets``: an invariant ellipsoid, and for each row c a bound on |c'e| in the long run.

    |c'e| ≤ Σ_{i<N} Σ_j |c'Φ^i b_j| d_j + √(c'Φ^N Q Φ'^N c): a sum over N samples, and the ellipsoid for the remainder.
    Q minimises the second term for one row, or a compromise for several.

    Args:
        step: Φ, m by m.
        columns: b_j, m by number of disturbances.
        size: d_j.
    """
    rows = [row for row, _ in group]
    largest = float(np.abs(np.linalg.eigvals(step)).max())
    samples = min(math.ceil(SUMMED / (1 - largest)), LONGEST)
    last = np.linalg.matrix_power(step, samples)
    floats = [np.array([float(x) for x in row]) @ last for row in rows]
    shares = [rounded(largest**2 + (1 - largest**2) * k / SHARES, DIGITS) for k in range(1, SHARES)]

    def least(target: Array) -> tuple[float, Any]:
        """(Least worst case, the f of it).

        The worst case Σ_j d_j √(Σ_k (c'Φ^k b_j)² f^-k)/√(1 − f) has a convex logarithm in log f, term by term: so it
        falls up to its minimum and grows after it.
        """

        @cache
        def worst_case(k: int) -> float:
            f = float(shares[k])
            return float(size @ _amplitudes(step, f, columns, target)) / math.sqrt(1 - f)

        k = bisect(range(len(shares) - 1), False, key=lambda k: worst_case(k + 1) >= worst_case(k))
        return worst_case(k), shares[k]

    own = [least(np.outer(row, row))[0] for row in floats] if len(rows) > 1 else [1.0]
    target: Array = np.sum([np.outer(row, row) / b**2 for row, b in zip(floats, own, strict=True)], axis=0)
    _, share = least(target)
    f = float(share)
    gains = _amplitudes(step, f, columns, target)
    gains = np.maximum(gains, 1e-6 * float(size @ gains) / size.sum())
    best = size * float(size @ gains) / ((1 - f) * gains) * (1 + 10.0 ** (1 - DIGITS))
    weights = [upwards(w, DIGITS) if w else sympy.Integer(0) for w in best]
    driven = (columns * np.array([float(w) for w in weights])) @ columns.T
    matrix = solve_discrete_lyapunov(step / np.sqrt(f), driven)
    scale = np.diag(np.diag(matrix))
    more = solve_discrete_lyapunov(step / np.sqrt(f), scale)
    matrix = matrix + SPARE / float(np.max(np.diag(more) / np.diag(scale))) * more
    exact = rounded_matrix((matrix + matrix.T) / 2, DIGITS, np.sqrt(np.diag(matrix)))
    bounds = [_bound(np.array(row, dtype=float), step, columns * size, samples, exact) for row in rows]
    return {
        "matrix": texts(exact),
        "weights": [rational_text(w) for w in (share, *weights)],
        "samples": str(samples),
        "rows": [[rational_text(x) for x in (*row, bound)] for row, bound in zip(rows, bounds, strict=True)],
    }


def _with_decay(
    ball: dict[str, Any], group: Group, starts: Mapping[str, Any], step: Array, driven: Array, noise: Any, h: float
) -> dict[str, Any]:
    """The entry of ``sets`` with bounds on its rows from given times after a reversal on (fields within and after).

    Args:
        ball: the entry.
        starts: name of a bound → |error| of each component right after the reversal: proved, or else assumed.
        step: Φ, m by m.
        driven: b_j d_j, m by number of disturbances.
        noise: bound on the direct feedthrough of noise to each error.
        h: sample time, s.
    """
    after, within = [], np.zeros(len(step))
    for row, bound in ((row, bound) for row, bound in group if bound is not None):
        start = starts[bound.name]
        whole = np.array([float(s) for s in start]) + noise
        within = np.maximum(within, whole)
        after.append((row, start, whole, [round(time / h) for time, _ in bound.after[1:]]))
    if not after:
        return ball
    sizes = [upwards(w * (1 + NEAR), DIGITS) for w in within]
    scale = np.array([float(s) for s in sizes])
    matrix = np.array([[float(Fraction(x)) for x in row] for row in ball["matrix"]])
    most = float(np.linalg.eigvalsh(np.outer(scale, scale) * np.linalg.inv(matrix)).max()) * len(step)
    larger = upwards(max(1.001 * most, 1.0), 3)
    ball["within"] = [rational_text(x) for x in (larger, *sizes)]
    ball["after"] = []
    for row, start, whole, counts in after:
        floats = np.array(row, dtype=float)
        found = _bounds_from(floats, step, driven, counts, whole, float(larger) * matrix)
        line, start_texts = ([rational_text(x) for x in each] for each in (row, start))
        stated = [
            [str(k), rational_text(upwards(b * (1 + NEAR), DIGITS))]
            for k, b in zip(counts, found, strict=True)
            if b < np.abs(floats) @ whole or k == counts[-1]  # a bound above that at the start adds nothing
        ]
        ball["after"].append({"row": line, "start": start_texts, "bounds": stated})
    return ball


def _bounds_from(
    row: Array, step: Array, driven: Array, counts: Sequence[int], start: Array, matrix: Array
) -> list[float]:
    """For each number of samples k in ``counts``, a bound on |c'e| at all samples from k on.

    It is the smaller one of two: √(c'Qc) after k samples, by an ellipsoid Q that contains the start; or the largest
    bound of the single samples up to the next number, and the bound from there on. With m errors the first is larger
    than needed by up to √m.

    Args:
        row: c.
        driven: b_j d_j, m by number of disturbances.
        start: |error| of each component at the start.
        matrix: Q, m by m.
    """
    by_set, largest = list[float](), [0.0 for _ in counts]
    total, row = _driven_part(row, step, driven, counts[0])
    for k in range(counts[0], counts[-1] + 1):
        if k in counts:
            by_set.append(total + float(row @ matrix @ row) ** 0.5)
        bound_now = total + float(np.abs(row) @ start)
        largest[len(by_set) - 1] = max(largest[len(by_set) - 1], bound_now)
        more, row = _driven_part(row, step, driven, 1)
        total += more
    found = [by_set[-1]]
    for by_ellipsoid, by_samples in zip(by_set[-2::-1], largest[-2::-1], strict=True):
        by_samples = max(by_samples, found[0])
        found.insert(0, max(min(by_ellipsoid, by_samples), found[0]))
    return found


def _driven_part(row: Array, step: Array, driven: Array, samples: int) -> tuple[float, Array]:
    """(Σ_{i<N} Σ_j |c'Φ^i b_j| d_j, c'Φ^N) for N samples: effect of the disturbances on c'e, and the row after."""
    total = 0.0
    for _ in range(samples):
        total += float(np.abs(row @ driven).sum())
        row = row @ step
    return total, row


def _bound(row: Array, step: Array, columns: Array, samples: int, matrix: Any) -> Any:
    """The bound on |c'e| of ``_set``, rounded up: sum over N samples plus √(c'Φ^N Q Φ'^N c)."""
    total, row = _driven_part(row, step, columns, samples)
    remainder = float(row @ np.array(matrix, dtype=float) @ row) ** 0.5
    return upwards((total + remainder) * (1 + NEAR), DIGITS)


def _amplitudes(step: Array, f: float, columns: Array, target: Array) -> Array:
    """√(b_j'Xb_j) for each j, where X = Φ'XΦ/f + ``target``."""
    x = solve_discrete_lyapunov(step.T / np.sqrt(f), target)
    return np.asarray(np.sqrt(np.maximum(np.sum(columns * (x @ columns), axis=0), 0.0)))
