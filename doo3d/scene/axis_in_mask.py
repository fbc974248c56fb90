"""The axis and the radius of the object in the mask of an image, and in the depth beside it."""

from dataclasses import replace
from typing import TypeAlias

import numpy as np

from .. import kernels
from ..geometry.noise import DEVIATIONS, NOISE_RADII
from ..geometry.polyline import LEAST_WEIGHT
from ..geometry.radii import OWN_RADII, TOUCHING_RADII
from ..types import Array, Bools, Camera, Floats, Plane
from .axis import DEPTH_WEIGHT, GAP_WEIGHT, MAX_STRENGTH, PATH_WEIGHT, RADIUS_TOLERANCE, RING_OVERLAP, SMOOTHING_RADII
from .axis_in_views import mask_sample
from .cross_sections import CENTRAL_PART, thinned
from .frame_facts import FrameFacts
from .samples import Samples
from .surface_beside import BESIDE_PX

MAX_SUNK_RADII = 3.0
"""Radii by which an axis may be measured too low over the plane beside it, and still lie on it: a stereo camera sees a cable on a
table at 0.65 to 0.85 of its height, a thin wire not at all. What is lower is beyond the table."""

_Image: TypeAlias = "tuple[Floats, Floats, Array, Bools, Floats]"
NO_DEPTH: _Image = (
    np.zeros((0, 2)),
    np.zeros(0),
    np.zeros((0, 0), dtype=np.float32),
    np.zeros((0, 0), dtype=bool),
    np.zeros(0),
)
"""Points, intrinsics, depth, mask and plane of an image without depth."""


def axis_in_mask(samples: Samples, facts: FrameFacts, iterations: int) -> Samples:
    """Move samples in an image to the middle between the sides of the mask, and take half its width as the radius.

    Each path is smoothed by a Whittaker smoother, weighted by how well the axis is known.

    samples : px. facts : of the mask. iterations : how many times this is done; 0 leaves the samples.
    """
    return _moved(samples, facts, NO_DEPTH, iterations)


def axis_in_mask_and_depth(
    samples: Samples, facts: FrameFacts, points: Floats, camera: Camera, plane: Plane | None, iterations: int
) -> Samples:
    """Move samples to the axis: the mask gives the lateral offset and the radius, the surface points give the depth.

    Axes measured lower than a radius over the plane are raised where the camera sees the plane beside the strand: not beyond the
    edge of a table, nor beside other things. Each path is smoothed by a Whittaker smoother, weighted by how well the axis is
    known in each direction.

    Parameters
    ----------
    samples
        samples along all paths, m in the camera's optical frame.
    facts
        the mask, and the depth of the frame.
    points
        (N, 3) m, the points of the seen surface.
    camera
        the intrinsics.
    plane
        the plane that the object lies on; None where there is none.
    iterations
        how many times this is done; 0 leaves the samples.
    """
    depth = np.ascontiguousarray(facts.depth, dtype=np.float32)
    height = np.zeros(0) if plane is None else np.append(plane.normal, plane.height)
    image = thinned(points), camera.intrinsics, depth, np.ascontiguousarray(facts.mask), height
    return _moved(samples, facts, image, iterations)


def _moved(samples: Samples, facts: FrameFacts, image: _Image, iterations: int) -> Samples:
    """Return samples moved to the axis; image : as NO_DEPTH."""
    curves, (points, intrinsics, depth, mask, plane) = samples.curves, image
    positions, radius, radii = kernels.axes_in_mask(
        curves.points,
        curves.bounds,
        curves.closed,
        samples.filled,
        samples.radius,
        samples.window_half,
        *mask_sample(facts),
        points,
        intrinsics,
        depth,
        mask,
        plane,
        BESIDE_PX,
        iterations,
        touching_radii=TOUCHING_RADII,
        own_radii=OWN_RADII,
        sunk_radii=MAX_SUNK_RADII,
        central_part=CENTRAL_PART,
        smoothing_radii=SMOOTHING_RADII,
        max_strength=MAX_STRENGTH,
        ring_overlap=RING_OVERLAP,
        path_weight=PATH_WEIGHT,
        depth_weight=DEPTH_WEIGHT,
        gap_weight=GAP_WEIGHT,
        least_weight=LEAST_WEIGHT,
        radius_tolerance=RADIUS_TOLERANCE,
        noise_radii=NOISE_RADII,
        deviations=DEVIATIONS,
    )
    return replace(samples, curves=curves.with_points(positions), radius=radius, radii=radii)
