"""Trace the contours around the skeletons of an image, as Keipour et al. (RA-L 2022) do."""

import cv2
import numpy as np

from ..errors import ConfigError
from ..kernels import crossing_numbers, prune_spurs
from ..types import Array, Ints, Path, Skeleton

TIP_REACH_PX, JUNCTION_REACH_PX = 1, 2
"""px in rows or columns between a contour and the tip, or the junction, that it starts at: it runs around the line, and a
contour inside a loop around the corner of a junction."""


def trace_contours(skeleton: Skeleton, min_branch: float) -> tuple[list[Path], int]:
    """Trace the contour around each piece of a 2-D skeleton, by Suzuki and Abe's border following.

    A contour runs one pixel beside the skeleton, from a tip along one side and back along the other. A contour inside a loop has
    no tip and starts at a junction. Spurs are removed first, since thinning leaves short lines into the corners of an end. The
    method is that of Keipour et al. (RA-L 2022).

    Parameters
    ----------
    skeleton
        2-D and not empty.
    min_branch
        px; shorter branches with a free end are spurs.

    Returns
    -------
    paths : one polyline per contour, points (u, v) in px. The last point repeats the first; `closed` is False.
    removed : number of skeleton pixels removed as spurs.

    Raises
    ------
    ConfigError : the skeleton is 3-D.
    """
    if skeleton.coords.shape[1] != 2:
        raise ConfigError("traverse.method is contours, which there are in 2-D only: use graph", code="config-mode")
    u, v = (skeleton.coords - skeleton.coords.min(axis=0) + 1).T
    image = np.zeros((v.max() + 2, u.max() + 2), dtype=np.uint8)
    image[v, u] = 1
    prune_spurs(image, v, u, min_branch)
    lines = crossing_numbers(image, v, u)
    tips, junctions = (np.column_stack((u, v))[kind] for kind in (lines == 1, lines > 2))
    contours, _ = cv2.findContours(cv2.dilate(image, np.ones((3, 3), np.uint8)), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    near = [_nearness(tips, TIP_REACH_PX, image.shape), _nearness(junctions, JUNCTION_REACH_PX, image.shape)]
    offset = skeleton.points[0] - (u[0], v[0])
    paths = []
    for contour in contours:
        column, row = contour[:, 0].T + JUNCTION_REACH_PX
        found = (each[row, column] for each in near)
        start = next((int(nearness.argmax()) for nearness in found if nearness.any()), 0)
        points = np.roll(contour[:, 0].astype(float), -start, axis=0)
        paths.append(Path(np.concatenate((points, points[:1])) + offset))
    return paths, len(u) - int(np.count_nonzero(image))


def _nearness(targets: Ints, reach: int, shape: tuple[int, ...]) -> Array:
    """Return an image, 0 farther than `reach` from each target (K, 2), (u, v), in rows or columns, and 1 more for each px nearer.

    It is larger than an image of the shape by JUNCTION_REACH_PX at each side. Only the places of targets are touched.
    """
    near = np.zeros((shape[0] + 2 * JUNCTION_REACH_PX, shape[1] + 2 * JUNCTION_REACH_PX), dtype=np.uint8)
    for distance in range(reach, -1, -1):
        step = np.arange(-distance, distance + 1) + JUNCTION_REACH_PX
        near[(targets[:, 1, None] + step)[:, :, None], (targets[:, 0, None] + step)[:, None]] = reach - distance + 1
    return near
