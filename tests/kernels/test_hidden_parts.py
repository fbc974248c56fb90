"""Hidden parts carried over time: against rotations of SciPy, joint by joint."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from doo3d.kernels import carry_hidden


def by_joints(joints, seen, least):
    """Turn each run of joints that were seen last in one frame, and are seen next in one, and lay all hidden ones along."""
    frames, count = seen.shape
    result = joints.copy()
    for frame in range(frames):
        along = np.diff(joints[frame], axis=0)
        lengths = np.linalg.norm(along, axis=1)
        is_carried = np.zeros(count - 1, dtype=bool)
        of_joints = []
        for k in range(count):
            shown = np.flatnonzero(seen[:, k])
            of_joints.append((max(shown[shown < frame], default=None), min(shown[shown > frame], default=None)))
        edges = [k for k in range(1, count) if of_joints[k] != of_joints[k - 1] or seen[frame, k] != seen[frame, k - 1]]
        for part in np.split(np.arange(count), edges):
            starts = [start for start in of_joints[part[0]] if start is not None]
            if seen[frame, part[0]] or not starts or not all((seen[start] & seen[frame]).any() for start in starts):
                continue
            low = part[0] - 1 if part[0] and seen[frame, part[0] - 1] else part[0]
            segments = np.arange(low, min(part[-1] + 1, count - 1))
            turned = [turn_of(joints, seen, start, frame, part, least).apply(np.diff(joints[start], axis=0)) for start in starts]
            share = (frame - starts[0]) / (starts[-1] - starts[0]) if len(starts) > 1 else 0.0
            along[segments] = (1 - share) * turned[0][segments] + share * turned[-1][segments]
            each = [np.linalg.norm(line[segments], axis=1) for line in turned]
            lengths[segments] = (1 - share) * each[0] + share * each[-1]
            is_carried[segments] = True
        along *= (lengths / np.linalg.norm(along, axis=1))[:, None]
        for part in np.split(np.arange(count), np.flatnonzero(np.diff(seen[frame])) + 1):
            if not seen[frame, part[0]] and len(part) < count and is_carried[max(part[0] - 1, 0) : part[-1] + 1].any():
                result[frame, part] = laid(joints[frame], along, part[0], part[-1] + 1)
    return result


def laid(joints, along, first, end):
    """Lay joints `first` to before `end` along segments, between those beside them."""
    count = len(joints)
    if first == 0:
        return joints[end] - np.cumsum(along[:end][::-1], axis=0)[::-1]
    if end == count:
        return joints[first - 1] + np.cumsum(along[first - 1 :], axis=0)
    line = joints[first - 1] + np.cumsum(along[first - 1 : end], axis=0)
    return (line + (joints[end] - line[-1]) * (np.arange(1, len(line) + 1) / len(line))[:, None])[:-1]


def turn_of(joints, seen, start, frame, part, least):
    """Return how the hidden joints of a part turned since frame `start`, as joints that both frames show, the nearest most."""
    known = np.flatnonzero(seen[start] & seen[frame])
    weights = 1 / (1 + (np.abs(known[:, None] - part).min(axis=1) / 2 / len(part)) ** 4)
    both = [each[known] - np.average(each[known], axis=0, weights=weights) for each in (joints[frame], joints[start])]
    pairs = (np.vstack((each, least * np.eye(3))) for each in both)
    return Rotation.align_vectors(*pairs, weights=[*weights, 1.0, 1.0, 1.0])[0]


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
