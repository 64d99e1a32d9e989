# SPDX-License-Identifier: GPL-3.0-or-later
"""Layout of nodes in columns from left to right, with dependencies on the left. Does not need Blender."""

from typing import Dict, List, Mapping, Sequence, Tuple

_COLUMN, _GAP = 260.0, 40.0


def columns(feeds: Mapping[str, Sequence[str]]) -> Dict[str, int]:
    """Returns the column of each node, given the nodes that feed it. A node is placed as far to the right as the nodes
    that it feeds allow."""
    longest: Dict[str, int] = {}

    def depth(key: str) -> int:
        if key not in longest:
            longest[key] = 0  # guards against cycles
            longest[key] = max((depth(other) + 1 for other in feeds[key]), default=0)
        return longest[key]

    for key in feeds:
        depth(key)
    users: Dict[str, List[str]] = {key: [] for key in feeds}
    for key, others in feeds.items():
        for other in others:
            users[other].append(key)
    for key in sorted(feeds, key=lambda k: -longest[k]):  # moves nodes towards those that they feed
        if users[key]:
            longest[key] = min(longest[user] for user in users[key]) - 1
    return longest


def placed(feeds: Mapping[str, Sequence[str]], heights: Mapping[str, float]) -> Dict[str, Tuple[float, float]]:
    """Returns the upper left corner of each node. The nodes of a column are stacked, in the order of the nodes that
    they are linked to."""
    column = columns(feeds)
    order = {key: float(k) for k, key in enumerate(feeds)}
    by_column: Dict[int, List[str]] = {}
    for key in feeds:
        by_column.setdefault(column[key], []).append(key)
    users: Dict[str, List[str]] = {key: [] for key in feeds}
    for key, others in feeds.items():
        for other in others:
            users[other].append(key)
    for _ in range(4):  # moves each node to the mean of its neighbours
        for linked in (users, feeds):
            for keys in by_column.values():
                middle = {k: sum(order[n] for n in linked[k]) / len(linked[k]) if linked[k] else order[k] for k in keys}
                ranks = sorted(order[k] for k in keys)
                for rank, key in zip(ranks, sorted(keys, key=lambda k: (middle[k], order[k]))):
                    order[key] = rank
    result: Dict[str, Tuple[float, float]] = {}
    for number, keys in by_column.items():
        keys.sort(key=lambda k: order[k])
        total = sum(heights[k] + _GAP for k in keys)
        y = total / 2
        for key in keys:
            result[key] = (number * _COLUMN, y)
            y -= heights[key] + _GAP
    return result
