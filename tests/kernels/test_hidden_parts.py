"""Hidden parts carried over time: against rotations of SciPy, joint by joint."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from doo3d.kernels import carry_hidden


def by_joints(joints, seen, least, near):
    """Carry each run of joints that were seen last in one frame, and are seen next in one."""
    frames, count = seen.shape
    result = joints.copy()
    for frame in range(frames):
        of_joints = []
        for k in range(count):
            shown = np.flatnonzero(seen[:, k])
            of_joints.append((max(shown[shown < frame], default=None), min(shown[shown > frame], default=None)))
        edges = [k for k in range(1, count) if of_joints[k] != of_joints[k - 1] or seen[frame, k] != seen[frame, k - 1]]
        for part in np.split(np.arange(count), edges):
            starts = [start for start in of_joints[part[0]] if start is not None]
            if seen[frame, part[0]] or not starts or not all((seen[start] & seen[frame]).any() for start in starts):
                continue
            lines = [moved(joints, seen, start, frame, part, least, near) for start in starts]
            share = (frame - starts[0]) / (starts[-1] - starts[0]) if len(starts) > 1 else 0.0
            result[frame, part] = (1 - share) * lines[0] + share * lines[-1]
    return result


def moved(joints, seen, start, frame, part, least, near):
    """Return hidden joints of frame `start` moved and turned as the joints near them."""
    known = np.flatnonzero(seen[start] & seen[frame])
    away = np.maximum(part[0] - known, known - part[-1])
    chosen = known[np.argsort(away, kind="stable")[:near]]
    still = least * np.eye(3)
    pairs = (np.vstack((each[chosen] - each[chosen].mean(axis=0), still)) for each in (joints[frame], joints[start]))
    turn = Rotation.align_vectors(*pairs)[0]
    before, after = known[known < part[0]][-1:], known[known > part[-1]][:1]
    sides = [*before, *after]
    lines = [joints[frame, side] + turn.apply(joints[start, part] - joints[start, side]) for side in sides]
    share = ((part - sides[0]) / max(1, sides[-1] - sides[0]))[:, None]
    return (1 - share) * lines[0] + share * lines[-1]


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
    near = int(rng.integers(1, 12))
    np.testing.assert_allclose(carry_hidden(joints, seen, 0.01, near), by_joints(joints, seen, 0.01, near), rtol=0, atol=1e-12)
