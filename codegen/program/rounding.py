"""Bound on the rounding error of a step of the generated code: interval arithmetic over the printed graph.

Every node has an interval of its exact value and a bound on the difference to the computed value. An operation adds u
times its result, u = 2⁻⁵³ or 2⁻²⁴, and the least positive number; parameters and numbers are rounded too. The order of
operations is the printed one, and compilers may not fuse them (FP_CONTRACT is off).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.program.graph import Node, reachable

UNIT = {"double": 2.0**-53, "single": 2.0**-24}
LEAST = {"double": 2.0**-1074, "single": 2.0**-149}
OUTWARDS = 1 + 2.0**-40


@dataclass(frozen=True)
class Enclosed:
    """A value between ``low`` and ``high``, computed to within ``error``."""

    low: float
    high: float
    error: float = 0.0

    @property
    def size(self) -> float:
        return max(abs(self.low), abs(self.high))

    def __neg__(self) -> Enclosed:
        return Enclosed(-self.high, -self.low, self.error)

    def within(self, low: float, high: float) -> Enclosed:
        return Enclosed(max(self.low, low), min(self.high, high), self.error)


class Undecided(Exception):
    """The sign of a node is not determined, or a function has no enclosure here."""


def enclose(
    roots: list[Node],
    ranges: Mapping[str, Enclosed],
    known: Mapping[Node, tuple[float, float]],
    precision: str,
    given: Mapping[Node, Enclosed] | None = None,
) -> list[Enclosed]:
    """Intervals and rounding errors of the roots.

    Args:
        ranges: of every symbol below the roots, by its name.
        known: ranges of nodes that are known to hold.
        given: nodes with a given enclosure; their own rounding is counted elsewhere.

    Raises:
        Undecided: where a sign is not determined, a divisor may be zero, or a function is other than abs and sign.
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
    match node.kind:
        case "number":
            short = (2 * node.value).is_integer() and abs(node.value) < 2**20
            error = 0.0 if short else UNIT[precision] * abs(node.value)
            return Enclosed(node.value - error, node.value + error, error)
        case "symbol":
            return ranges[node.name]
        case "negative":
            return -parts[0]
        case "sum":
            total, *rest = (part if sign > 0 else -part for sign, part in zip(node.signs, parts, strict=True))
            for part in rest:
                exact = Enclosed(total.low + part.low, total.high + part.high, total.error + part.error)
                total = _rounded(exact, precision)
            return total
        case "product":
            total = parts[0]
            for part in parts[1:]:
                ends = [a * b for a in (total.low, total.high) for b in (part.low, part.high)]
                error = total.size * part.error + part.size * total.error + total.error * part.error
                total = _rounded(Enclosed(min(ends), max(ends), error), precision)
            return total
        case "quotient":
            above, below = parts
            least = min(abs(below.low), abs(below.high)) - below.error
            if below.low <= 0 <= below.high or least <= 0:
                raise Undecided("a divisor that may be zero")
            ends = [a / b for a in (above.low, above.high) for b in (below.low, below.high)]
            error = (above.error + max(map(abs, ends)) * below.error) / least
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


def _rounded(exact: Enclosed, precision: str) -> Enclosed:
    error = (exact.error + UNIT[precision] * (exact.size + exact.error) + LEAST[precision]) * OUTWARDS
    slack = 2.0**-50 * exact.size
    return Enclosed(exact.low - slack, exact.high + slack, error)
