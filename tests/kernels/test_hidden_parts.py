"""Hidden parts carried over time: against rotations of SciPy, joint by joint."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from doo3d.kernels import carry_hidden


def by_joints(joints, seen, least):
    """Carry each run of joints that were seen last in one frame, and are seen next in one; lay those that go on to an end."""
    frames, count = seen.shape
    result = joints.copy()
    for frame in range(frames):
        edges = np.flatnonzero(np.diff(seen[frame])) + 1
        for run in np.split(np.arange(count), edges):
            if seen[frame, run[0]]:
                continue
            is_between = run[0] > 0 and run[-1] + 1 < count
            along, is_carried = np.diff(joints[frame], axis=0), False
            for part, starts in parts_of(seen, frame, run):
                common = [start for start in starts if (seen[start] & seen[frame]).any()]
                if is_between and common:
                    moved = [moved_to(joints, seen, start, frame, part, least) for start in common]
                    result[frame, part] = mean(moved, common, frame)
                elif not is_between and starts and len(common) == len(starts):
                    low = part[0] - 1 if part[0] and seen[frame, part[0] - 1] else part[0]
                    segments = np.arange(low, min(part[-1] + 1, count - 1))
                    turns = [turn_of(joints, seen, start, frame, part, least)[0] for start in starts]
                    turned = [
                        turn.apply(np.diff(joints[start], axis=0)[segments]) for turn, start in zip(turns, starts, strict=True)
                    ]
                    lengths = mean([np.linalg.norm(line, axis=1) for line in turned], starts, frame)
                    directions = mean(turned, starts, frame)
                    along[segments] = directions * (lengths / np.linalg.norm(directions, axis=1))[:, None]
                    is_carried = True
            if is_carried:
                result[frame, run] = laid(joints[frame], along, run[0], run[-1] + 1)
    return result


def parts_of(seen, frame, run):
    """Yield the parts of a run of joints with the frames that showed them last and show them next, if there are such."""
    of_joints = []
    for k in run:
        shown = np.flatnonzero(seen[:, k])
        of_joints.append((max(shown[shown < frame], default=None), min(shown[shown > frame], default=None)))
    edges = [n for n in range(1, len(run)) if of_joints[n] != of_joints[n - 1]]
    for part in np.split(run, edges):
        yield part, [start for start in of_joints[part[0] - run[0]] if start is not None]


def mean(values, starts, frame):
    """Return the mean of the values from one or two frames, by how near these are in time."""
    share = (frame - starts[0]) / (starts[-1] - starts[0]) if len(starts) > 1 else 0.0
    return (1 - share) * values[0] + share * values[-1]


def moved_to(joints, seen, start, frame, part, least):
    """Return where a part was in frame `start`, moved since as the joints that both frames show, and by what these miss."""
    turn, known, (after, before) = turn_of(joints, seen, start, frame, part, least)
    moved = turn.apply(joints[start] - before) + after
    left = joints[frame, known] - moved[known]
    return moved[part] + np.column_stack([np.interp(part, known, column) for column in left.T])


def laid(joints, along, first, end):
    """Lay joints `first` to before `end`, which go on to one end, along segments from the joint beside them."""
    if first == 0:
        return joints[end] - np.cumsum(along[:end][::-1], axis=0)[::-1]
    return joints[first - 1] + np.cumsum(along[first - 1 :], axis=0)


def turn_of(joints, seen, start, frame, part, least):
    """Return how the joints that both frames show turned since frame `start`, the nearest most; these, and their middles."""
    known = np.flatnonzero(seen[start] & seen[frame])
    weights = 1 / (1 + (np.abs(known[:, None] - part).min(axis=1) / 2 / len(part)) ** 4)
    middles = [np.average(each[known], axis=0, weights=weights) for each in (joints[frame], joints[start])]
    both = (joints[frame, known] - middles[0], joints[start, known] - middles[1])
    pairs = (np.vstack((each, least * np.eye(3))) for each in both)
    return Rotation.align_vectors(*pairs, weights=[*weights, 1.0, 1.0, 1.0])[0], known, middles


@pytest.mark.parametrize("seed", range(30))
def test_against_rotations_of_scipy(seed):
    rng = np.random.default_rng(seed)
    frames, count = rng.integers(1, (8, 20))
    cable = np.cumsum(rng.normal(0.004, 0.008, (count, 3)), axis=0)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0.0, 0.2, (frames, 3)), axis=0)).as_matrix()
    joints = np.einsum("tij,kj->tki", turns, cable) + rng.normal(0.0, 0.002, (frames, count, 3))
    seen = np.ones((frames, count), dtype=bool)
    for row in seen:
        for first, length in rng.integers(0, count, (2, 2)):
            row[first : first + length] = False
    np.testing.assert_allclose(carry_hidden(joints, seen, 0.01), by_joints(joints, seen, 0.01), rtol=0, atol=1e-12)
