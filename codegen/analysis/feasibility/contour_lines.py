"""Boundary line of a region on a grid of true and false nodes (marching squares)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Edge = tuple[int, int, int]
"""(direction, i, j): from node (i, j) to (i + 1, j) where the direction is 0, to (i, j + 1) where it is 1."""


def crossing_edges(inside: NDArray[np.bool_]) -> list[Edge]:
    """The grid edges that cross the boundary: one end inside, one outside."""
    found: list[Edge] = []
    for direction in (0, 1):
        differ = np.diff(inside, axis=direction)
        found += [(direction, int(i), int(j)) for i, j in np.argwhere(differ)]
    return found


def edge_ends(edges: list[Edge], inside: NDArray[np.bool_]) -> tuple[list[Any], list[Any]]:
    """For each edge its node inside and its node outside, (i, j)."""
    good, bad = [], []
    for direction, i, j in edges:
        ends = [(i, j), (i + 1 - direction, j + direction)]
        if not inside[i, j]:
            ends.reverse()
        good.append(ends[0])
        bad.append(ends[1])
    return good, bad


def polylines(edges: list[Edge], inside: NDArray[np.bool_]) -> list[list[Edge]]:
    """The crossings in order along the boundary; a closed line ends at its first crossing."""
    neighbours: dict[Edge, list[Edge]] = {e: [] for e in edges}
    for i in range(inside.shape[0] - 1):
        for j in range(inside.shape[1] - 1):
            sides: list[Edge] = [(1, i, j), (0, i, j), (1, i + 1, j), (0, i, j + 1)]  # left, low, right, high
            crossed = [e for e in sides if e in neighbours]
            for first, second in zip(crossed[::2], crossed[1::2], strict=True):
                neighbours[first].append(second)
                neighbours[second].append(first)
    lines: list[list[Edge]] = []
    left = dict.fromkeys(sorted(edges, key=lambda e: len(neighbours[e])))
    while left:
        line = [next(iter(left))]
        del left[line[0]]
        while following := [e for e in neighbours[line[-1]] if e in left]:
            line.append(following[0])
            del left[following[0]]
        if len(line) > 2 and line[0] in neighbours[line[-1]]:
            line.append(line[0])
        lines.append(line)
    return lines
