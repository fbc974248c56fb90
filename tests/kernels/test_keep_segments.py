"""The segments that pruning keeps, against a plain loop over the pairs and runs of the flags."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from doo3d.geometry.curves import Curves, runs
from doo3d.kernels import keep_segments


def slow_kept(owner, closed, pairs):
    size = np.bincount(owner)
    last = np.cumsum(size) - 1
    first = last - size + 1
    kept = np.ones(len(owner), dtype=bool)
    for i, j in pairs:
        a, b = owner[i], owner[j]
        is_joint = a == b and closed[a] and (i, j) == (first[a], last[a])
        if kept[i] and kept[j] and not is_joint:
            loser = j if size[b] <= size[a] else i
            kept[loser] = False
            size[owner[loser]] -= 1
    return kept


@given(seed=st.integers(0, 2**32 - 1), counts=st.lists(st.integers(2, 8), min_size=1, max_size=5), dim=st.sampled_from([2, 3]))
def test_segments_are_kept_as_by_a_plain_loop(seed, counts, dim):
    random = np.random.default_rng(seed)
    chains = Curves.of([random.normal(size=(count, dim)) for count in counts], random.random(len(counts)) < 0.5)
    segments = len(chains.segments)
    pairs = np.array([(i, j) for i in range(segments) for j in range(i + 1, segments) if random.random() < 0.3]).reshape(-1, 2)
    kept = slow_kept(chains.owner[chains.segments], chains.closed, map(tuple, pairs.tolist()))

    *found, removed = keep_segments(chains.points, chains.bounds, chains.closed, pairs.astype(int))

    lines, closed = [], []
    for line, own, is_ring in zip(chains, np.split(kept, chains.segment_bounds[1:-1]), chains.closed, strict=True):
        lines += [line[first : end + 1] for first, end in runs(own)]
        closed += [bool(is_ring and own.all())] * len(runs(own))
    left = Curves(*found)
    assert [line.tolist() for line in left] == [line.tolist() for line in lines]
    assert left.closed.tolist() == closed
    starts = chains.segments[~kept]
    np.testing.assert_array_equal(removed, np.stack((chains.points[starts], chains.points[starts + 1]), axis=1))
