from __future__ import annotations

import numpy as np

from doo3d.geometry.disjoint_set import DisjointSet


def test_items_joined_through_others_are_one_group():
    groups = DisjointSet(range(5))
    for pair in ((0, 1), (3, 4), (1, 4)):
        assert groups.join(*pair)
    assert len(groups) == 2
    assert len(set(groups.group[[0, 1, 3, 4]].tolist())) == 1
    assert groups.group[2] != groups.group[0]


def test_joining_one_group_with_itself_changes_nothing():
    groups = DisjointSet(range(3))
    groups.join(0, 1)
    assert not groups.join(1, 0)
    assert len(groups) == 2


def test_groups_that_are_given_are_kept_and_their_labels_not_written_to():
    given = np.array([7, 7, 2])
    groups = DisjointSet(given)
    assert len(groups) == 2
    assert groups.join(0, 2)
    assert len(groups) == 1
    assert given.tolist() == [7, 7, 2]
