"""Loop formation and loop fusion, by list scheduling of the dependence graph.

Values of arrays that are the same computation at consecutive indices (isomorphic: equal except for the index) become a
loop, and loops over one range are fused. A loop goes upwards or downwards in its index, as its loop-carried dependences
require; one that would need both is written out. Dependences are between single values, so the order is also valid for
the unrolled code.
"""

from __future__ import annotations

import dataclasses
import heapq
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sympy.utilities.iterables import strongly_connected_components

from codegen.program.arrays import Element
from codegen.program.graph import Node

SHORTEST = 4
"""Fewest iterations of a loop; shorter ones are unrolled."""
EDGE = 3
"""Loops whose ranges differ by at most this at each end are fused over the common range; the rest is unrolled."""


@dataclass(eq=False)
class Value:
    """A named computed value.

    Attributes:
        place: its array element, if it has one.
        order: its number in a topological order of all values.
        key: equal for isomorphic computations.
        uses: values of the same function on which it depends.
        field: its struct, or empty.
        stored: whether it is stored in its array, not in a local.
        title, source, unit: for comments in the code.
    """

    node: Node
    name: str
    place: Element | None = None
    field: str = ""
    stored: bool = False
    title: str = ""
    source: str = ""
    unit: str = ""
    order: int = 0
    key: object = None
    uses: list[Value] = dataclasses.field(default_factory=list)

    @property
    def at(self) -> int:
        """Index in its array."""
        assert self.place is not None
        return self.place.at


@dataclass(eq=False)
class Run:
    """A loop over the indices [first, stop), or a single value.

    Attributes:
        members: a column of values for each array that the loop computes, in order of computation.
        forward, backward: whether an iteration depends on one of a lower index, or of a higher one.
        position: in the schedule; not set for a run that was fused into another.
    """

    members: list[list[Value]]
    first: int = 0
    stop: int = 0
    backward: bool = False
    forward: bool = False
    position: int = 0

    @property
    def loop(self) -> bool:
        return self.stop > self.first

    @property
    def values(self) -> Iterable[Value]:
        return (v for column in self.members for v in column)


def schedule(values: Sequence[Value], join: bool) -> list[Run]:
    """All values in runs, in a topological order of their dependences; ``join`` fuses loops over one range."""
    runs = _runs(values, join)
    runs = _without_cycles(runs)
    run_of = {v: run for run in runs for v in run.values}
    needs = {run: {run_of[u] for v in run.values for u in v.uses} - {run} for run in runs}
    followers: dict[Run, list[Run]] = {run: [] for run in runs}
    for run, needed in needs.items():
        for other in needed:
            followers[other].append(run)
    missing = {run: len(needed) for run, needed in needs.items()}  # how many of its needs are not scheduled yet
    # Single values before loops: a loop can be fused into an earlier one only if all it needs comes before that one.
    rank = {run: (run.loop, min(v.order for v in run.values), k) for k, run in enumerate(runs)}
    ready = [(rank[run], run) for run in runs if not missing[run]]
    heapq.heapify(ready)
    scheduled: list[Run] = []
    fused_into: dict[Run, Run] = {}  # itself where it was not fused
    while ready:
        _, run = heapq.heappop(ready)
        needed = {fused_into[other] for other in needs[run]}
        hosts = (r for r in reversed(scheduled) if join and r.loop)
        host = next((r for r in hosts if _fuses(r, run, needed, fused_into, run_of)), None)
        if host is None:
            run.position = len(scheduled)
            scheduled.append(run)
        else:
            host.members += run.members
        fused_into[run] = host or run
        for other in followers[run]:
            missing[other] -= 1
            if not missing[other]:
                heapq.heappush(ready, (rank[other], other))
    for run in scheduled:
        run.members.sort(key=lambda column: column[0].order)
    return scheduled


def _runs(values: Sequence[Value], join: bool) -> list[Run]:
    """Runs of each array, split where the computation changes and, for fusion, at the ends of a common range.

    Every other value is a run of its own: those in no array, in short loops, or outside the common range.
    """
    arrays: dict[str, list[Value]] = {}
    result = []
    for v in values:
        if v.place is None:
            result.append(Run([[v]]))
        else:
            arrays.setdefault(v.place.array, []).append(v)
    stretches: list[list[Value]] = []
    for members in arrays.values():
        members.sort(key=lambda v: v.at)
        run: list[Value] = []
        for v in members:
            if run and (v.at != run[-1].at + 1 or v.key != run[-1].key):
                stretches.append(run)
                run = []
            run.append(v)
        stretches.append(run)
    long = [s for s in stretches if len(s) >= SHORTEST]
    ranges = _common_ranges(long) if join else {id(s): (s[0].at, s[-1].at + 1) for s in long}
    for s in stretches:
        first, stop = ranges.get(id(s), (0, 0))
        inside = [v for v in s if first <= v.at < stop]
        result += [Run([[v]]) for v in s if not first <= v.at < stop]
        if inside:
            result.append(_loop([inside]))
    return result


def _common_ranges(stretches: list[list[Value]]) -> dict[int, tuple[int, int]]:
    """id(stretch) → its range of indices, reduced to the common range of stretches that differ by at most ``EDGE``.

    Greedy clustering: each stretch joins the first cluster of nearly its range, whose range becomes the intersection.
    """
    clusters: list[tuple[int, int, list[list[Value]]]] = []
    for s in sorted(stretches, key=lambda s: s[0].order):
        first, stop = s[0].at, s[-1].at + 1
        for k, (a, b, members) in enumerate(clusters):
            common = max(a, first), min(b, stop)
            if abs(a - first) <= EDGE and abs(b - stop) <= EDGE and common[1] - common[0] >= SHORTEST:
                clusters[k] = (*common, [*members, s])
                break
        else:
            clusters.append((first, stop, [s]))
    return {id(s): (first, stop) for first, stop, members in clusters for s in members}


def _loop(columns: list[list[Value]]) -> Run:
    """A loop of these columns, with its loop-carried dependences."""
    run = Run(columns, columns[0][0].at, columns[0][-1].at + 1)
    own = set(run.values)
    for v in own:
        for u in v.uses:
            if u in own:
                run.forward |= u.at < v.at
                run.backward |= u.at > v.at
    return run


def _without_cycles(runs: list[Run]) -> list[Run]:
    """The runs without cyclic dependences: mutually dependent ones fused into one loop if possible, else unrolled.

    Mutually dependent runs are a strongly connected component of the dependence graph, which has no topological order.
    """
    number_of = {v: k for k, run in enumerate(runs) for v in run.values}
    edges = {(k, number_of[u]) for k, run in enumerate(runs) for v in run.values for u in v.uses if number_of[u] != k}
    if not edges:
        return runs
    components = strongly_connected_components((range(len(runs)), edges))
    component_of = {k: n for n, component in enumerate(components) for k in component}
    groups: dict[int, list[Run]] = {}
    for k, run in enumerate(runs):
        groups.setdefault(component_of[k], []).append(run)
    result = []
    for group in groups.values():
        if len(group) > 1 and all(r.loop and (r.first, r.stop) == (group[0].first, group[0].stop) for r in group):
            group = [_loop([column for r in group for column in r.members])]
        no_order = len(group) > 1 or (group[0].forward and group[0].backward)
        result += [Run([[v]]) for r in group for v in r.values] if no_order else group
    return result


def _fuses(host: Run, run: Run, needed: set[Run], fused_into: dict[Run, Run], run_of: dict[Value, Run]) -> bool:
    """Whether ``run`` can be fused into the earlier loop ``host``; if so, ``host`` gets its dependences."""
    if (run.first, run.stop) != (host.first, host.stop) or not run.loop:
        return False
    if any(other is not host and other.position > host.position for other in needed):
        return False
    forward, backward = host.forward or run.forward, host.backward or run.backward
    for v in run.values:
        for u in v.uses:
            if fused_into.get(run_of[u]) is host and u.place is not None:
                forward |= u.at < v.at
                backward |= u.at > v.at
    if forward and backward:
        return False
    host.forward, host.backward = forward, backward
    return True
