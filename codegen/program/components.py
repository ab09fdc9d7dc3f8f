"""Strongly connected components of a directed graph, by Tarjan's algorithm without recursion."""

from __future__ import annotations

from collections.abc import Iterable


def strong_components(count: int, edges: Iterable[tuple[int, int]]) -> list[int]:
    """For each of the nodes 0 to ``count`` - 1 the label of its strongly connected component.

    SciPy has this too, but its import takes longer than the rest of ``stiction check``.

    Args:
        edges: (from, to).
    """
    following: list[list[int]] = [[] for _ in range(count)]
    for start, end in edges:
        following[start].append(end)
    order: dict[int, int] = {}
    lowest: dict[int, int] = {}
    label = [-1] * count
    open_nodes: list[int] = []
    for root in range(count):
        if root in order:
            continue
        path = [(root, iter(following[root]))]
        order[root] = lowest[root] = len(order)
        open_nodes.append(root)
        while path:
            node, rest = path[-1]
            for other in rest:
                if other not in order:
                    order[other] = lowest[other] = len(order)
                    open_nodes.append(other)
                    path.append((other, iter(following[other])))
                    break
                if label[other] < 0:
                    lowest[node] = min(lowest[node], order[other])
            else:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[node])
                while lowest[node] == order[node] and label[node] < 0:
                    label[open_nodes.pop()] = node
    return label
