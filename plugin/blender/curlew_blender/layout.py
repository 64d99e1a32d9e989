# SPDX-License-Identifier: GPL-3.0-or-later
"""Places of nodes: columns from left to right, what is needed first on the left. Needs no Blender."""

from typing import Dict, List, Mapping, Sequence, Tuple

_COLUMN, _GAP = 260.0, 40.0


def columns(feeds: Mapping[str, Sequence[str]]) -> Dict[str, int]:
    """The column of each node, by those that it is fed by: as far to the right as what it feeds allows."""
    longest: Dict[str, int] = {}

    def depth(key: str) -> int:
        if key not in longest:
            longest[key] = 0  # whatever a circle gives
            longest[key] = max((depth(other) + 1 for other in feeds[key]), default=0)
        return longest[key]

    for key in feeds:
        depth(key)
    users: Dict[str, List[str]] = {key: [] for key in feeds}
    for key, others in feeds.items():
        for other in others:
            users[other].append(key)
    for key in sorted(feeds, key=lambda k: -longest[k]):  # pulled towards what they feed
        if users[key]:
            longest[key] = min(longest[user] for user in users[key]) - 1
    return longest


def placed(feeds: Mapping[str, Sequence[str]], heights: Mapping[str, float]) -> Dict[str, Tuple[float, float]]:
    """The upper left corner of each node. Nodes of a column stand below each other, in the order of what they are linked
    to."""
    column = columns(feeds)
    order = {key: float(k) for k, key in enumerate(feeds)}
    by_column: Dict[int, List[str]] = {}
    for key in feeds:
        by_column.setdefault(column[key], []).append(key)
    users: Dict[str, List[str]] = {key: [] for key in feeds}
    for key, others in feeds.items():
        for other in others:
            users[other].append(key)
    for _ in range(4):  # each to the middle of its neighbours
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
