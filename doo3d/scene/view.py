"""The view in which the crossings and the shape of chains are judged: that of the sensor, as far as it is known."""

from __future__ import annotations

import numpy as np

from ..geometry.projection import Projection, axes_along
from ..types import Camera, Foreground

FROM_ABOVE = np.diag((1.0, 1.0, -1.0))
"""Axes of the view of a cloud without a viewpoint: x right, y down in the view, along -z."""

UNIT_CAMERA = Camera(1.0, 1.0, 0.0, 0.0, 1, 1)
"""Intrinsics of the view of a cloud with a viewpoint: positions are tangents of angles."""


def projection_of(foreground: Foreground) -> Projection:
    """Return the projection to the view in which the crossings of a foreground are looked for.

    - In 2-D: positions unchanged, px.
    - With a camera: its pinhole projection, positions in px.
    - A cloud with a viewpoint: perspective from there towards the middle of the points, positions as tangents (x / z, y / z).
    - A cloud without a viewpoint: parallel projection from above, against the z axis, positions in m.
    """
    if foreground.points.shape[1] == 2:
        return Projection.planar()
    if foreground.camera is not None:
        return Projection.of_camera(foreground.camera)
    viewpoint = foreground.viewpoint
    if viewpoint is None:
        return Projection.parallel(np.zeros(3), FROM_ABOVE)
    # np.mean over the first axis takes five times as long
    middle = np.einsum("nd->d", foreground.points) / len(foreground.points)
    return Projection.perspective(viewpoint, axes_along(middle - viewpoint), UNIT_CAMERA)
