"""Check the poses of views by their depth, and name a convention that fits."""

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import InputError
from ..types import CameraView, Floats
from ..types.pose import in_frame_of

SAMPLED_POINTS = 2000
"""Number of depth readings of a view that are compared with the next view. At least a tenth of this number, over all views,
must project to measured pixels."""

DEPTH_TOLERANCE = 0.03
"""Largest relative difference between two depth readings of one surface: noise of sensors, drift of poses, slopes."""

MIN_AGREEMENT, CLEAR_AGREEMENT = 0.4, 0.7
"""Fraction of the points not behind the depth of another view that are on its surface: below the first the views contradict
each other, from the second on they agree. With correct poses it is over 0.99 on a table seen from all sides, with others at
most 0.4."""

_OPENGL = np.diag((1, -1, -1, 1))


def _in_metres(pose: Floats) -> Floats:
    """Return a pose with its translation converted from mm to m."""
    return np.vstack((pose[:3] / (1, 1, 1, 1000), pose[3:]))


CONVENTIONS: dict[str, Callable[[Floats], Floats]] = {
    "world to camera (invert them)": np.linalg.inv,
    "of cameras that look along -z with y up, as in OpenGL (multiply them by diag(1, -1, -1, 1) from the right)": lambda pose: (
        pose @ _OPENGL
    ),
    "world to camera with y up, as view matrices of OpenGL": lambda pose: np.linalg.inv(pose) @ _OPENGL,
    "in millimetres (divide their translations by 1000)": _in_metres,
}
"""Wrong conventions of poses, and the conversion of each to camera to world in metres."""


def check_views_agree(views: Sequence[CameraView]) -> None:
    """Raise an InputError if views of an object at rest contradict each other.

    Readings of each view are moved into the next one by their poses: readings in front of its depth contradict it, since that
    view saw through them.

    Raises
    ------
    InputError : the views contradict each other (code poses-contradict); the message names the convention with
    which they agree.
    """
    agreement = _agreement_share(views, [view.pose for view in views])
    if agreement is not None and agreement >= CLEAR_AGREEMENT:
        return
    found = {
        name: _agreement_share(views, [convert(view.pose) for view in views]) or 0.0 for name, convert in CONVENTIONS.items()
    }
    best = max(found, key=found.__getitem__)
    if found[best] >= max(CLEAR_AGREEMENT, 2 * (agreement or 0.0)):
        remedy = f"they agree if the poses are {best}"
    elif agreement is not None and agreement < MIN_AGREEMENT:
        remedy = (
            "neither inverted, nor with the axes of OpenGL, nor in millimetres do they agree: check the poses and their order"
        )
    else:
        return  # little overlap, or noisy depth
    raise InputError(
        f"the views contradict each other by their poses, taken as camera to world in metres: {remedy}", code="poses-contradict"
    )


def _agreement_share(views: Sequence[CameraView], poses: Sequence[Floats]) -> float | None:
    """Return the fraction of the readings in the next view that are on its surface.

    Readings behind the surface, or without depth there, do not count. None if too few are left.
    """
    on = free = 0
    for first, second, pose, other in zip(views, views[1:], poses, poses[1:], strict=False):
        v, u = np.nonzero(first.depth)
        step = max(1, len(v) // SAMPLED_POINTS)
        v, u = v[::step], u[::step]
        points = first.camera.unproject(np.column_stack((u, v)), first.depth[v, u])
        points = in_frame_of(np.linalg.inv(other) @ pose, points)
        points = points[points[:, 2] > 0]
        pixels = np.rint(second.camera.project(points)) if len(points) else np.zeros((0, 2))
        inside = ((pixels >= 0) & (pixels < second.depth.shape[::-1])).all(axis=1)
        depth, (u, v) = points[inside, 2], pixels[inside].astype(int).T
        measured = second.depth[v, u]
        depth, measured = depth[measured > 0], measured[measured > 0]
        on += int(np.count_nonzero(np.abs(depth - measured) <= DEPTH_TOLERANCE * measured))
        free += int(np.count_nonzero(depth < (1 - DEPTH_TOLERANCE) * measured))
    return on / (on + free) if on + free >= SAMPLED_POINTS / 10 else None
