"""Gaps between chains along lines of the image, against a plain computation in NumPy."""

from itertools import pairwise

import numpy as np
import pytest

from doo3d.kernels import gaps_along_lines
from doo3d.types import Camera

CAMERA = Camera(fx=600.0, fy=600.0, cx=160.0, cy=120.0, width=320, height=240)
INTRINSICS = np.array((600.0, 600.0, 160.0, 120.0))
RADIUS, REACH = 0.005, 6.0


def slow_nearest(points, targets):
    distance = np.linalg.norm(points[:, None] - targets, axis=2)
    return np.where(distance.min(axis=1) <= REACH, distance.argmin(axis=1), -1)


def slow_along(line):
    return np.append(0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))


def faces(line, start, end):
    along = slow_along(line)
    if len(along) < 2 or along[-1] < REACH:
        return False
    far, back = np.flatnonzero(along >= REACH), np.flatnonzero(along[-1] - along >= REACH)
    first, last = far[0] - 1, back[-1] - 1
    return bool(last >= 0 and (line[first] - line[0]) @ start > 0 and (line[last] - line[-1]) @ end > 0)


def slow_gaps(points, tangents, chains, closed, lines):
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    places = np.concatenate(lines)
    seen = CAMERA.project(points)
    ahead = CAMERA.project(points + RADIUS * tangents) - seen
    at = slow_nearest(seen, places)
    dense, chain = [], []
    for c, joints in enumerate(chains):
        line = CAMERA.project(joints)
        along = slow_along(line)
        t = np.linspace(0, along[-1], 2 + int(2 * along[-1] / REACH))
        dense.append(np.column_stack([np.interp(t, along, x) for x in line.T]))
        chain += [c] * len(t)
    near = slow_nearest(places, np.concatenate(dense))
    covered = np.where(near < 0, -1, np.array(chain)[near])
    on = [e for e in np.argsort(at, kind="stable") if at[e] >= 0 and not closed[e // 2]]
    found = {}
    for a, b in pairwise(on):
        line = places[at[a] : at[b] + 1]
        if a // 2 == b // 2 or owner[at[a]] != owner[at[b]] or not faces(line, ahead[a], ahead[b]):
            continue
        if not np.isin(covered[at[a] : at[b] + 1], (-1, a // 2, b // 2)).all():
            continue
        share = slow_along(line) / slow_along(line)[-1]
        lifted = CAMERA.unproject(line, 1 / ((1 - share) / points[a, 2] + share / points[b, 2]))
        lifted[[0, -1]] = points[[a, b]]
        found[int(a), int(b)] = lifted
    return found


def scene(seed):
    """Return wavy lines in the image, and chains along stretches of them, each at its own depth."""
    rng = np.random.default_rng(seed)
    u = np.arange(20.0, 300.0)
    lines = [np.column_stack((u, v + 8 * np.sin(u / 30 + rng.random()))) for v in (60, 75, 160)]
    chains = []
    for line in lines:
        cuts = np.sort(rng.choice(280, 6, replace=False))
        for start, stop in cuts.reshape(-1, 2):
            part = line[start : max(stop, start + 4)]
            chains.append(CAMERA.unproject(part + rng.normal(0, 2), np.full(len(part), rng.uniform(0.5, 1.0))))
    ends = np.concatenate([chain[[0, -1]] for chain in chains])
    tangents = np.concatenate([(chain[0] - chain[1], chain[-1] - chain[-2]) for chain in chains])
    return ends, tangents / np.linalg.norm(tangents, axis=1)[:, None], chains, rng.random(len(chains)) < 0.1, lines


def bounds_of(lines):
    return np.cumsum([0, *map(len, lines)])


def test_gaps_are_those_of_a_plain_computation():
    total = 0
    for seed in range(30):
        points, tangents, chains, closed, lines = scene(seed)
        expected = slow_gaps(points, tangents, chains, closed, lines)
        pairs, found, bounds = gaps_along_lines(
            points, tangents, np.concatenate(chains), bounds_of(chains), closed, INTRINSICS, RADIUS,
            np.concatenate(lines), bounds_of(lines), REACH,
        )  # fmt: skip
        assert [tuple(pair) for pair in pairs.tolist()] == list(expected)
        for line, a, b in zip(expected.values(), bounds[:-1], bounds[1:], strict=True):
            np.testing.assert_allclose(found[a:b], line)
        total += len(expected)
    assert total > 20


def test_a_line_that_is_not_finite_is_refused():
    points, tangents, chains, closed, lines = scene(0)
    lines[0][3] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        gaps_along_lines(
            points, tangents, np.concatenate(chains), bounds_of(chains), closed, INTRINSICS, RADIUS,
            np.concatenate(lines), bounds_of(lines), REACH,
        )  # fmt: skip
