"""Whether the poses of views agree with what the views show, and if not, which convention would."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import InputError
from ..types import CameraView, Floats
from ..types.pose import in_frame_of

SAMPLED_POINTS = 2000
"""Readings of a view that are compared with the next view, in whose measured pixels a tenth as many of all views must lie."""

DEPTH_TOLERANCE = 0.03
"""Share of the depth by which two readings of one surface may differ: noise of sensors, drift of poses, slopes."""

MIN_AGREEMENT, CLEAR_AGREEMENT = 0.4, 0.7
"""Share of the points not behind what another view measured that lie on it: below the first the views contradict each other, from
the second on they agree. With the right poses it is over 0.99 on a table seen from all sides, with others 0.4 at the most."""

_OPENGL = np.diag((1, -1, -1, 1))


def _in_metres(pose: Floats) -> Floats:
    """Return a pose whose translation is in mm with one in m."""
    return np.vstack((pose[:3] / (1, 1, 1, 1000), pose[3:]))


CONVENTIONS: dict[str, Callable[[Floats], Floats]] = {
    "world to camera (invert them)": np.linalg.inv,
    "of cameras that look along -z with y up, as in OpenGL (multiply them by diag(1, -1, -1, 1) from the right)": lambda pose: (
        pose @ _OPENGL
    ),
    "world to camera with y up, as view matrices of OpenGL": lambda pose: np.linalg.inv(pose) @ _OPENGL,
    "in millimetres (divide their translations by 1000)": _in_metres,
}
"""What poses can be if not camera to world in metres, and how they are made to be."""


def check_views_agree(views: Sequence[CameraView]) -> None:
    """Raise an InputError if the views of an object at rest contradict each other by their poses.

    Readings of each view are moved into the next one: where they lie in front of what that view measured, it saw through them.

    Raises
    ------
    InputError : they do (code poses-contradict); the message names the convention of poses by which they agree.
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
        return  # hardly overlapping, or noisy
    raise InputError(
        f"the views contradict each other by their poses, taken as camera to world in metres: {remedy}", code="poses-contradict"
    )


def _agreement_share(views: Sequence[CameraView], poses: Sequence[Floats]) -> float | None:
    """Return the share of the readings not behind what the next view measured that lie on it; None if too few can be compared."""
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
