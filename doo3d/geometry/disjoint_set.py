"""Group items that are joined in pairs, and add up values over groups."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..types import Floats, Ints


class DisjointSet:
    """A partition of N items into groups, as one array of labels.

    Attributes
    ----------
    group
        (N,) int, label of the group of each item. Labels are arbitrary; equal labels mean the same group.
    """

    def __init__(self, group: Sequence[int] | Ints) -> None:
        """Start with the labels of N items; `range(N)` puts each item in its own group."""
        self.group: Ints = np.array(group, dtype=np.int64)
        self._count = len(set(self.group.tolist()))

    def __len__(self) -> int:
        """Return the number of groups."""
        return self._count

    def members(self) -> list[list[int]]:
        """Return the ascending items of each group, in the order of their first items."""
        return [np.flatnonzero(self.group == number).tolist() for number in dict.fromkeys(self.group.tolist())]

    def join(self, first: int, second: int) -> bool:
        """Unite the groups of two items; return False if they are one group already."""
        kept, gone = self.group[first], self.group[second]
        if kept == gone:
            return False
        self.group[self.group == gone] = kept
        self._count -= 1
        return True


def joined_groups(pairs: Ints, count: int) -> Ints:
    """Return the group of each of `count` items, numbered from 0: (count,) int.

    pairs : (P, 2) int, the items that are joined.
    """
    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def group_sums(values: Floats, group: Ints, count: int) -> Floats:
    """Return the sums of the rows of values (N, D) in each group, (count, D).

    group : (N,) int, group of each row, below `count`.
    """
    return np.column_stack([np.bincount(group, weights=column, minlength=count) for column in values.T])
