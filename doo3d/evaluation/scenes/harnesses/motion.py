"""Build scenes of a branched cable from motion capture."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ....errors import InputError, unread_code
from ....types import Array, Floats
from ..model import Scene, Tree, Truth
from ..stacking import spline_axis
from ..studio import cable_color, make_studio
from .build import Size

MOTION_TRUNK, MOTION_BRANCHES, MOTION_RADIUS = tuple(range(13)), ((4, 13, 14, 15, 16), (8, 17, 18, 19)), 0.005
"""Measured cable: markers along the trunk; for each branch, the trunk marker where it leaves and its own markers; radius in m."""


MIN_MARKER_STEP = 0.02
"""Least distance in m between successive markers; nearer ones are left out, since the spline would oscillate between them."""


def load_array(path: str | Path) -> Array:
    """Read the array of an .npy file; raise InputError if the file cannot be read."""
    try:
        return np.asarray(np.load(path, allow_pickle=False))
    except (OSError, ValueError) as error:
        code = unread_code(error) if isinstance(error, OSError) else "truth-invalid"
        raise InputError(f"{path}: no motion capture can be read ({error})", code=code) from None


def read_markers(path: str | Path) -> Floats:
    """Read the marker positions of a measured branched cable, (T, 20, 3) m, from an .npy file.

    Raises
    ------
    InputError : the file cannot be read or holds something else.
    """
    frames = load_array(path)
    if frames.ndim != 3 or frames.shape[1:] != (20, 3):
        raise InputError(f"{path}: has shape {frames.shape}, expected (T, 20, 3) positions of markers", code="truth-invalid")
    return np.asarray(frames)


def motion_tree(path: str | Path, rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a measured branched cable: a random frame of a motion capture, seen by a random camera.

    Parameters
    ----------
    path
        an .npy file (T, 20, 3) of marker positions in m: 13 along the trunk, 4 and 3 along two branches, which leave the trunk
        at its markers 4 and 8.
    rng
        the random number generator to draw from.
    size
        (width, height) px of the image.

    Returns
    -------
    The scene in the camera's optical frame, without a table; None if the cable would touch itself.

    Raises
    ------
    InputError : the file cannot be read or holds something else.
    """
    frames = read_markers(path)
    markers = np.asarray(frames[int(rng.integers(len(frames)))], dtype=float)
    curves = [markers[list(MOTION_TRUNK)], *(markers[list(branch)] for branch in MOTION_BRANCHES)]
    center = (markers.max(axis=0) + markers.min(axis=0)) / 2
    _, _, principal = np.linalg.svd(markers - center, full_matrices=False)
    turn = Rotation.from_euler("xyz", rng.uniform(-1, 1, 3) * (0.5, 0.5, 0.3)).as_matrix() @ principal
    drawn = make_studio(rng, size, (0.8, 1.0), 0.0)
    placed = [(curve - center) @ turn.T for curve in curves]
    if (studio := drawn.backed_off(placed)) is None:
        return None
    axes = []
    for k, stops in enumerate(((0, 4, 8, 12), (0, 4), (0, 3))):
        moved = np.concatenate(([True], np.linalg.norm(np.diff(placed[k], axis=0), axis=1) > MIN_MARKER_STEP))
        moved[list(stops)] = True
        axis = spline_axis(placed[k][moved])
        at = [int(np.linalg.norm(axis - placed[k][stop], axis=1).argmin()) for stop in stops]
        axes += [axis[low : high + 1] for low, high in itertools.pairwise(at)]
    nodes = np.array([axes[0][0], axes[1][0], axes[2][0], axes[2][-1], axes[3][-1], axes[4][-1]])
    joined = ((0, 1), (1, 2), (2, 3), (1, 4), (2, 5))
    color = cable_color(rng)
    cables = tuple(Truth(studio.to_camera(axis), MOTION_RADIUS, color=color) for axis in axes)
    tree = Tree(studio.to_camera(nodes), tuple((k, *pair) for k, pair in enumerate(joined)))
    return replace(studio.scene(cables), table=None, trees=(tree,))
