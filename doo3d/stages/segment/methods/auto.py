"""The way that fits what the config and the data hold."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ....config import SegmentConfig
from ....geometry.sparse_grid import SAMPLE_POINTS, SAMPLE_SEEDS, cloud_spacing, sorted_unique
from ....types import Cloud, Floats, Frame, Image

SHARE = 0.5
"""A scene is broad when more than this share of it belongs to surfaces wider than `segment.max_width`."""

FILLED = 0.6
"""Of the disc round a point of a surface, the share that has to be occupied."""


def is_broad(data: Frame | Cloud, config: SegmentConfig) -> bool:
    """Whether most of the data lies on surfaces wider than any object may be, such as a table."""
    if isinstance(data, Frame):
        depth = np.ascontiguousarray(data.depth[::4, ::4])
        seen = cv2.morphologyEx((depth > 0).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        if not seen.any():
            return False
        inside = cv2.distanceTransform(np.pad(seen, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
        inside *= 4 / data.camera.fx * np.minimum(depth, config.max_depth)
        return bool(np.mean(inside[depth > 0] > config.max_width / 2) > SHARE)
    points = data.points[:: max(1, len(data.points) // SAMPLE_POINTS)]
    seeds = points[:: max(1, len(points) // SAMPLE_SEEDS)]
    grain = 2 * cloud_spacing(points)
    near = cKDTree(points).query_ball_point(seeds, config.max_width)
    filled = [_filled(points[index], grain) * grain**2 / (np.pi * config.max_width**2) for index in near if len(index) > 8]
    return bool(filled) and float(np.mean(np.array(filled) > FILLED)) > SHARE


def _filled(points: Floats, size: float) -> int:
    """How many cells of `size` points (N, 3) occupy in their own plane: strands side by side leave gaps, a surface none."""
    centered = points - points.mean(axis=0)
    flat = np.floor(centered @ np.linalg.eigh(centered.T @ centered)[1][:, 1:] / size).astype(np.int64)
    return len(sorted_unique(flat[:, 0] * 1_000_000 + flat[:, 1]))


def choose(data: Frame | Cloud | Image, config: SegmentConfig) -> str:
    """hsv where ranges are set, background where a reference is; else plane for a broad scene, everything for a thin one,
    ridge for an image.
    """
    if config.ranges:
        return "hsv"
    if config.reference is not None:
        return "background"
    if isinstance(data, Image):
        return "ridge"
    return "plane" if is_broad(data, config) else "everything"
