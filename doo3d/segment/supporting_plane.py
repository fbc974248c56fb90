"""Find the plane that the object lies on or hangs above, such as a table."""

from __future__ import annotations

import numpy as np

from ..config import SegmentConfig
from ..geometry.noise import SAMPLES
from ..scene.frame import FrameScene
from ..scene.frame_facts import FrameFacts
from ..types import Cloud, Floats, Frame, Image, Plane
from .methods.plane import MIN_PLANE_SHARE, fit_plane
from .segmentation import Segmentation

MIN_READINGS = 50
"""Readings around the object without which no plane is looked for."""

SURROUNDINGS = 0.25
"""Margin of the box around the object, as a fraction of its longer side, in which the plane is looked for."""

PLANE_DIGITS = 12
"""Decimal places of the plane, whose height is in m. The 16th is that of the linear algebra of this processor."""


def find_supporting_plane(
    data: Frame | Cloud | Image, segmentation: Segmentation, config: SegmentConfig, seed: int
) -> Plane | None:
    """Return the plane around the object, whatever method segmented it.

    It is the plane that segmentation told the object from. Without one, a plane is fitted to the readings beside the object's
    mask, within the box around the mask; of a cloud without a mask to all points.

    Parameters
    ----------
    data
        the frame or cloud.
    segmentation
        the segmentation of the frame.
    config
        section `segment` of the settings: `plane_distance` and `max_depth`.
    seed
        seed of the random draws of RANSAC.

    Returns
    -------
    The plane in the coordinates of the data, m, its normal towards the sensor (towards the object if the sensor's place is
    unknown). None if there is no such plane, for an image, and if all data is the object.
    """
    scene = segmentation.scene
    if isinstance(data, Image) or segmentation.method == "everything" or not len(scene.points):
        return None
    inside: Floats = scene.points.mean(axis=0) if scene.viewpoint is None else scene.viewpoint
    if segmentation.plane is not None:
        normal, height = segmentation.plane.normal, segmentation.plane.height
    else:
        if not isinstance(scene, FrameScene) or isinstance(data, Cloud):
            assert isinstance(data, Cloud)
            points = np.ascontiguousarray(data.points[:: max(1, len(data.points) // SAMPLES)])
        else:
            points = _surrounding_points(data, scene.facts, config)
        if len(points) < MIN_READINGS:
            return None
        normal, height = fit_plane(points, config.plane_distance, seed)
        if np.mean(np.abs(points @ normal - height) < config.plane_distance) < MIN_PLANE_SHARE:
            return None
    sign = 1.0 if float(normal @ inside) >= height else -1.0
    return Plane(np.round(sign * normal, PLANE_DIGITS), round(sign * height, PLANE_DIGITS))


def _surrounding_points(frame: Frame, facts: FrameFacts, config: SegmentConfig) -> Floats:
    """Return about SAMPLES readings (N, 3) m beside the object's mask, from the box around it."""
    (top, bottom, left, right), mask = facts.box, facts.mask
    margin = int(SURROUNDINGS * (max(bottom - top, right - left) - 1)) + 1
    top, left = max(0, top - margin), max(0, left - margin)
    box = np.s_[top : bottom + margin, left : right + margin]
    stride = max(1, int(np.sqrt(frame.depth[box].size / SAMPLES)))
    depth = frame.depth[box][::stride, ::stride]
    v, u = np.nonzero((depth > 0) & (depth <= config.max_depth) & ~mask[box][::stride, ::stride])
    return frame.camera.unproject(np.column_stack((left + stride * u, top + stride * v)), depth[v, u])
