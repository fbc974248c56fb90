"""Tell for each segment of a chain whether depth readings support it, or whether its depth was interpolated."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import kernels
from ..geometry.curves import Curves
from ..geometry.noise import DEVIATIONS
from ..geometry.radii import OWN_RADII
from ..types import Array, Bools, Camera, Floats, Plane

POSITIONS = (np.arange(5) + 0.5) / 5
"""Fractions of a segment's length at which its readings are taken."""

LATERAL_RADII = np.linspace(-0.7, 0.7, 5)
"""Radii to the side of the axis at which readings are taken; nearer to the silhouette, readings mix with the background."""

SURFACE_RADII = 0.85
"""Radii by which the seen surface is nearer than the axis, mean over LATERAL_RADII: of sqrt(1 - x^2)."""

MIN_SUPPORT = 0.3
"""Share of a segment's samples that need a reading which agrees: a curve through fewer is an interpolation."""


class DepthSupport(NamedTuple):
    """How well the depth readings support N segments.

    Attributes
    ----------
    share
        (N,) share of a segment's samples with a reading of the object that agrees with the segment within the least tolerance.
    is_filled
        (N,) bool, True for a segment whose depth was interpolated, since too few readings agree with it.
    residual
        (N,) radii, median difference of a segment's readings from its surface, absolute; NaN with fewer than 3 readings.
    offset
        (N,) radii, by how much a segment's readings lie behind its surface, median; NaN with fewer than 3 readings. Unlike the
        other values, it does not excuse readings between the surface and the plane that the segment lies on.
    """

    share: Floats
    is_filled: Bools
    residual: Floats
    offset: Floats


NOT_MEASURED = DepthSupport(np.zeros(0), np.zeros(0, dtype=bool), np.zeros(0), np.zeros(0))
"""The support of an image and of a cloud, in which no readings of depth support a segment."""


def depth_support(
    chains: Curves, radius: Sequence[float], depth: Array, mask: Bools, camera: Camera, plane: Plane | None
) -> DepthSupport:
    """Return how well the depth readings support the segments of all chains.

    A segment is supported if enough pixels of the strip that it covers in the image are in the mask and have a reading, as the
    sensor gave it, that agrees with the segment's surface. So a strand below another one is not supported where they cross, nor
    is a strand where the sensor's depth is torn or missing and was interpolated. A stereo camera sees a strand that lies on a
    plane lower than it is: readings between its surface and the plane support it.

    Parameters
    ----------
    chains
        the joints of the chains, (N + 1, 3) m in the camera's optical frame for N segments.
    radius
        radius of each chain, m.
    depth, mask
        (H, W) m, 0 = no reading, and (H, W) bool.
    camera
        the intrinsics.
    plane
        the plane in the frame; None where there is none.
    """
    if not len(chains):
        return NOT_MEASURED
    supported, agreeing, residual, offset = kernels.depth_support(
        chains.points,
        chains.bounds,
        np.array(radius, dtype=float),
        np.ascontiguousarray(depth, dtype=np.float32),
        np.ascontiguousarray(mask),
        camera.intrinsics,
        np.zeros(0) if plane is None else np.append(plane.normal, plane.height),
        POSITIONS,
        LATERAL_RADII,
        surface_radii=SURFACE_RADII,
        lying_radii=OWN_RADII,
        deviations=DEVIATIONS,
    )
    return DepthSupport(supported, agreeing < MIN_SUPPORT, residual, offset)
