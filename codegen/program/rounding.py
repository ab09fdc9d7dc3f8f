"""Running error analysis of a step: a bound on its rounding error, by interval arithmetic over the printed graph.

For every node: an interval of its exact value, and a bound on |computed − exact|. In the standard model of
floating-point arithmetic an operation is computed as result·(1 + δ) + η with |δ| ≤ u, u = 2⁻⁵³ or 2⁻²⁴, and |η| below
the least positive number, for underflow. The errors of the operands propagate through the operation. Parameters and
numbers are rounded too. The order of operations is the printed one, and compilers may not fuse them (FP_CONTRACT is
off).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.program.graph import Node, reachable

UNIT = {"double": 2.0**-53, "single": 2.0**-24}
"""Unit roundoff u."""
LEAST = {"double": 2.0**-1074, "single": 2.0**-149}
"""Least positive number."""
OUTWARDS = 1 + 2.0**-40
"""Factor on every error bound: it is itself computed in doubles, by a few operations of relative error 2⁻⁵³ each."""
SLACK = 2.0**-50
"""Widening of an interval at each end, for the same reason, as a share of its largest magnitude."""
SHORT = 2**20
"""Halves of whole numbers below this size are exact in single precision too, which has 24 bits."""


@dataclass(frozen=True)
class Enclosed:
    """An exact value between ``low`` and ``high``, and a bound ``error`` on |computed − exact|."""

    low: float
    high: float
    error: float = 0.0

    @property
    def size(self) -> float:
        """The largest magnitude of the exact value."""
        return max(abs(self.low), abs(self.high))

    def __neg__(self) -> Enclosed:
        return Enclosed(-self.high, -self.low, self.error)

    def within(self, low: float, high: float) -> Enclosed:
        """The intersection with a range that the exact value is known to have."""
        return Enclosed(max(self.low, low), min(self.high, high), self.error)


class Undecided(Exception):
    """The interval of a node contains both signs where one is needed, or a function has no enclosure here."""


def enclose(
    roots: list[Node],
    ranges: Mapping[str, Enclosed],
    known: Mapping[Node, tuple[float, float]],
    precision: str,
    given: Mapping[Node, Enclosed] | None = None,
) -> list[Enclosed]:
    """Intervals and rounding errors of the roots.

    Args:
        ranges: name → enclosure, of every symbol below the roots.
        known: node → range known for other reasons, such as a certified bound; its interval is intersected with it.
        given: node → enclosure that is used in place of the computed one, where its rounding is counted elsewhere.

    Raises:
        Undecided: if a sign is not determined, a divisor may be zero, or a function is other than abs and sign.
    """
    found: dict[Node, Enclosed] = {}
    for node in reachable(roots):
        if given and node in given:
            found[node] = given[node]
            continue
        value = _value(node, [found[a] for a in node.arguments], ranges, precision)
        found[node] = value.within(*known[node]) if node in known else value
    return [found[root] for root in roots]


def _value(node: Node, parts: list[Enclosed], ranges: Mapping[str, Enclosed], precision: str) -> Enclosed:
    """The enclosure of a node from those of its arguments, ``parts``."""
    match node.kind:
        case "number":
            is_exact = (2 * node.value).is_integer() and abs(node.value) < SHORT
            error = 0.0 if is_exact else UNIT[precision] * abs(node.value)
            return Enclosed(node.value - error, node.value + error, error)
        case "symbol":
            return ranges[node.name]
        case "negative":
            return -parts[0]
        case "sum":
            total, *rest = (part if sign > 0 else -part for sign, part in zip(node.signs, parts, strict=True))
            for part in rest:
                added = Enclosed(total.low + part.low, total.high + part.high, total.error + part.error)
                total = _rounded(added, precision)
            return total
        case "product":
            total = parts[0]
            for part in parts[1:]:
                ends = [a * b for a in (total.low, total.high) for b in (part.low, part.high)]
                # |(a + α)(b + β) − a b| ≤ |a| |β| + |b| |α| + |α| |β|
                error = total.size * part.error + part.size * total.error + total.error * part.error
                total = _rounded(Enclosed(min(ends), max(ends), error), precision)
            return total
        case "quotient":
            above, below = parts
            least_computed = min(abs(below.low), abs(below.high)) - below.error
            if below.low <= 0 <= below.high or least_computed <= 0:
                raise Undecided("a divisor that may be zero")
            ends = [a / b for a in (above.low, above.high) for b in (below.low, below.high)]
            # |(a + α)/(b + β) − a/b| = |α − (a/b) β| / |b + β|
            error = (above.error + max(map(abs, ends)) * below.error) / least_computed
            return _rounded(Enclosed(min(ends), max(ends), error), precision)
        case "call" if node.name == "abs":
            low = max(parts[0].low, -parts[0].high, 0.0)
            return Enclosed(low, parts[0].size, parts[0].error)
        case "call" if node.name == "sign":
            if parts[0].low > parts[0].error:
                return Enclosed(1.0, 1.0)
            if parts[0].high < -parts[0].error:
                return Enclosed(-1.0, -1.0)
            raise Undecided("a sign that may be either")
    raise Undecided(f"no enclosure of {node.name or node.kind}")


def _rounded(result: Enclosed, precision: str) -> Enclosed:
    """The enclosure of an operation's result, its own rounding added to the error from its operands."""
    error = (result.error + UNIT[precision] * (result.size + result.error) + LEAST[precision]) * OUTWARDS
    slack = SLACK * result.size
    return Enclosed(result.low - slack, result.high + slack, error)
