"""Groups of items that are joined two by two (union-find)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..types import Ints


class DisjointSet:
    """A partition of N items into groups, as one array of labels: all pairs of items can be compared at once.

    Attributes
    ----------
    group
        (N,) int, label of the group of each item. Labels are arbitrary; equal labels mean the same group.
    """

    def __init__(self, group: Sequence[int] | Ints) -> None:
        """Start with the labels of N items; `range(N)` puts each item in a group of its own."""
        self.group: Ints = np.array(group, dtype=np.int64)
        self._count = len(set(self.group.tolist()))

    def __len__(self) -> int:
        """Return the number of groups."""
        return self._count

    def members(self) -> list[list[int]]:
        """Return the ascending numbers of the items of each group, the groups in the order of their first items."""
        return [np.flatnonzero(self.group == number).tolist() for number in dict.fromkeys(self.group.tolist())]

    def join(self, first: int, second: int) -> bool:
        """Unite the groups of two items; return False if they are one group already."""
        kept, gone = self.group[first], self.group[second]
        if kept == gone:
            return False
        self.group[self.group == gone] = kept
        self._count -= 1
        return True
