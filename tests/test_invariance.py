"""The whole pipeline under changes that leave the object as it is: a cloud moved, its points in another order, a frame mirrored.

The voxel grid lies along the axes of the data: a moved object is found again within a fraction of its radius, not byte for byte.
"""

from __future__ import annotations

import numpy as np
import pytest
from builders.paths import SAMPLES
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import doo3d
from doo3d.geometry.polyline import densify

CLOUDS = ("crossing.ply", "on_table.ply", "open.ply", "two_cables.npz")
FRAMES = ("crossing", "occluder", "straight", "two_cables")


def cloud(name: str) -> doo3d.Cloud:
    """A sample cloud, seen from the origin of its frame."""
    data = doo3d.open_capture(SAMPLES / "clouds" / name).frames[0].load().data
    return doo3d.Cloud(data.points, data.colors, np.zeros(3))


def farthest(chains, others) -> float:
    """The largest distance between the joints of two lists of chains and the lines of the others, in radii; pairs in order."""
    assert [len(chain.joints) for chain in chains] == [len(joints) for joints in others]
    gaps = []
    for chain, joints in zip(chains, others, strict=True):
        one, other = (densify(points, chain.segment_length / 20) for points in (chain.joints, joints))
        gaps += [cKDTree(one).query(joints)[0].max() / chain.radius, cKDTree(other).query(chain.joints)[0].max() / chain.radius]
    return max(gaps)


@pytest.mark.parametrize("name", CLOUDS)
def test_a_cloud_moved_as_a_whole_gives_the_chains_moved(name):
    given = cloud(name)
    turn, shift = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix(), np.array([0.3, -0.2, 0.1])
    still = doo3d.detect(given).chains
    moved = doo3d.detect(doo3d.Cloud(given.points @ turn.T + shift, given.colors, shift)).chains
    assert farthest(still, [(chain.joints - shift) @ turn for chain in moved]) < 0.25
    for one, other in zip(still, moved, strict=True):
        assert other.radius == pytest.approx(one.radius, rel=0.02)


@pytest.mark.parametrize("name", CLOUDS)
def test_the_order_of_points_does_not_matter(name):
    given = cloud(name)
    order = np.random.default_rng(0).permutation(len(given.points))
    colors = None if given.colors is None else given.colors[order]
    shuffled = doo3d.detect(doo3d.Cloud(given.points[order], colors, np.zeros(3))).chains
    assert farthest(doo3d.detect(given).chains, [chain.joints for chain in shuffled]) < 0.4


@pytest.mark.parametrize("name", FRAMES)
def test_a_mirrored_frame_gives_mirrored_chains(name):
    loaded = doo3d.open_capture(SAMPLES / name).frames[0].load()
    frame, camera = loaded.data, loaded.data.camera
    mirrored = doo3d.Camera(camera.fx, camera.fy, camera.width - 1 - camera.cx, camera.cy, camera.width, camera.height)
    color, depth = (np.ascontiguousarray(image[:, ::-1]) for image in (frame.color, frame.depth))
    chains = doo3d.detect(frame).chains
    others = doo3d.detect(doo3d.Frame(color, depth, mirrored)).chains
    assert farthest(chains, [chain.joints * (-1, 1, 1) for chain in others]) < 0.4
