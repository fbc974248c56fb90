"""Sample the points of a frame around its chains, for figures and reports."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..inputs import FrameData
from ..types import Array, Bools, Cloud, Detection, Floats, Frame
from ..types.pose import in_frame_of

MAX_READ_POINTS, MAX_TESTED_POINTS = 150_000, 40_000  # of a frame, and of the box around its chains
SURROUNDINGS_MARGIN = 0.2  # of the diagonal of the chains' box
OBJECT_RADII = 1.3  # radii from the axis within which a point is on the object


@dataclass(frozen=True)
class Surroundings:
    """A random sample of a frame's points, on the object and around it.

    Attributes
    ----------
    points
        (N, 3) m, in the coordinates of the chains; those on the object first.
    colors
        (N, 3) uint8 RGB; None if the points have no color.
    on_object
        number of points on the object: within 1.3 radii of a chain.
    viewpoint
        (3,) m, position of the sensor of a cloud, in the coordinates of the chains; None if unknown, and for a frame.
    """

    points: Floats
    colors: Array | None
    on_object: int
    viewpoint: Floats | None


def sample_surroundings(frame: FrameData, detection: Detection, max_points: int) -> Surroundings | None:
    """Return a random sample of a frame's points around its chains, the same each time for the same frame.

    Parameters
    ----------
    frame
        the frame of the capture, with its camera-to-world pose if the chains are in world coordinates.
    detection
        the chains found in the frame.
    max_points
        number of points at most: half of them within 1.3 radii of a chain, half elsewhere in the box around the chains.

    Returns
    -------
    None for an image, and for chains in world coordinates if the pose of the frame is unknown.
    """
    rng = np.random.default_rng(0)
    pose = _pose_of(frame, detection)
    sample = None if pose is None else _sample_points(frame, pose, rng)
    if pose is None or sample is None:
        return None
    points, colors = sample
    near = np.flatnonzero(_near_chains(points, detection))
    near = np.sort(rng.choice(near, min(len(near), MAX_TESTED_POINTS), replace=False))
    on_object = _on_object(points[near], detection)
    parts = (near[on_object], near[~on_object])
    chosen = [np.sort(rng.choice(part, min(len(part), max_points // 2), replace=False)) for part in parts]
    both = np.concatenate(chosen)
    viewpoint = frame.data.viewpoint if isinstance(frame.data, Cloud) else None
    return Surroundings(
        points[both],
        None if colors is None else colors[both],
        len(chosen[0]),
        None if viewpoint is None else _moved(viewpoint, pose),
    )


def _pose_of(frame: FrameData, detection: Detection) -> Floats | None:
    """Return the (4, 4) pose of the frame's data in the coordinates of the chains; None if it is unknown."""
    if detection.pose is not None or detection.coordinates != "world":
        return np.eye(4) if detection.pose is None else detection.pose
    return frame.pose


def _moved(points: Floats, pose: Floats) -> Floats:
    if np.array_equal(pose, np.eye(4)):
        return points
    return in_frame_of(pose, points)


def _sample_points(frame: FrameData, pose: Floats, rng: np.random.Generator) -> tuple[Floats, Array | None] | None:
    """Return points in the coordinates of the chains, (N, 3) m, with their colors, (N, 3) uint8 RGB; None for an image."""
    data = frame.data
    if isinstance(data, Frame):
        step = max(1, round(data.depth.size / MAX_READ_POINTS))  # pixels along the rows
        first = int(rng.integers(step))
        v, u = np.divmod(first + step * np.flatnonzero(data.depth.ravel()[first::step]), data.depth.shape[1])
        points = data.camera.unproject(np.column_stack((u, v)), data.depth[v, u])
        colors = None if data.color is None else data.color[v, u]
    elif isinstance(data, Cloud):
        chosen = _random_choice(rng, len(data.points))
        points, colors = data.points[chosen], None if data.colors is None else data.colors[chosen]
    else:
        return None
    return _moved(points, pose), colors


def _random_choice(rng: np.random.Generator, count: int) -> Bools:
    """Choose about MAX_READ_POINTS of `count` points at random, or all if there are fewer: (count,) bool."""
    return np.asarray(rng.random(count) < MAX_READ_POINTS / count) if count > MAX_READ_POINTS else np.ones(count, dtype=bool)


def _near_chains(points: Floats, detection: Detection) -> Bools:
    """Choose the points in the box around the chains with a margin; without chains, in the box of 96 % of the points."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    chains = (*detection.chains, *detection.doubtful)
    joints = np.concatenate([chain.joints for chain in chains]) if chains else None
    low, high = np.percentile(points, (2, 98), axis=0) if joints is None else (joints.min(axis=0), joints.max(axis=0))
    margin = SURROUNDINGS_MARGIN * float(np.linalg.norm(high - low))
    return np.asarray(((points >= low - margin) & (points <= high + margin)).all(axis=1))


def _on_object(points: Floats, detection: Detection) -> Bools:
    """Choose the points within OBJECT_RADII radii of a chain."""
    on_object = np.zeros(len(points), dtype=bool)
    for chain in (*detection.chains, *detection.doubtful):
        radius = chain.radius if np.isfinite(chain.radius) else chain.segment_length / 2
        samples = chain.nodes(4 * len(chain.joints))
        on_object |= np.isfinite(cKDTree(samples).query(points, distance_upper_bound=OBJECT_RADII * radius)[0])
    return on_object
