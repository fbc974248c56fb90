"""Check that depth is metric and along the optical axis, by the flatness of surfaces and the height of a cable on them.

Renderers may also give distances along the rays, their depth buffer, or depth scaled to the range from 0 to 1; stereo programs
may give disparity. Each of these deforms the scene in its own way, by which it is recognized.
"""

import numpy as np

from .. import Camera, Chain, Floats, Frame, Plane

SAMPLES = (24, 32)
"""Numbers of rows and columns of the sampled readings that a plane is fitted to."""

MIN_SAMPLES = 200
"""Least number of valid readings for a fit."""

PLANE_QUANTILE = 0.6
"""Fraction of the readings that are assumed to be on the largest surface, a table or a wall."""

FIT_ITERATIONS = 4

INLIER_RESIDUALS = 2.5
"""Greatest residual of a reading that is used in the next iteration of the fit, in residuals at PLANE_QUANTILE."""

MIN_BENT_RESIDUAL = 0.005
"""Residual, as a fraction of the depth, from which on a surface is not flat; stereo cameras have at most about half, 0.003."""

MAX_FLAT_RESIDUAL_RATIO = 0.25
"""Ratio of the residual of distances to that of depths, below which the values must be distances. It is about 1 in frames of
stereo and structured-light cameras, and below 1e-4 for distances from a renderer."""

MIN_RELIEF_READINGS = 5
"""Least number of readings along a chain for its height to be known."""

BUFFER_RELIEF = (0.35, 0.7)
"""Median and 90th percentile of a cable's height divided by its width, below which depth from 0 to 1 is a depth buffer. A cable
on a table has 1, in a buffer 0.01 to 0.3; cables in a bundle, where the plane runs between them, have at least 0.39."""

DISPARITY_RELIEF = (-1.5, -0.7)
"""Range of the median height divided by the width in which values are disparities: the cable is in a trench as deep as its width,
since the derivative of f b / z multiplies a height h by the same factor as the width w, with opposite sign."""

NORMALIZED_RANGE = (0.02, 1e-6)
"""Normalized image, from 0 to 1: greatest least depth, and greatest distance of the greatest depth from 1. No depth camera
measures from 2 cm."""

KINDS = {
    "buffer": "a renderer's depth buffer, z = near far / (far - value (far - near))",
    "normalized": "depth normalized to the range from 0 to 1, z = near + value (far - near)",
}
REMEDY = "convert the values to metres along the optical axis"


def distance_notes(frame: Frame) -> list[str]:
    """Return a sentence if surfaces are curved when values are taken as depth, but flat as distances along the rays."""
    rows, columns = (max(1, size // count) for size, count in zip(frame.depth.shape, SAMPLES, strict=True))
    v, u = np.mgrid[rows // 2 : frame.depth.shape[0] : rows, columns // 2 : frame.depth.shape[1] : columns]
    depth = frame.depth[v, u].astype(float)
    read = depth > 0
    if np.count_nonzero(read) < MIN_SAMPLES:
        return []
    rays = _rays(frame.camera, u[read], v[read])
    points = rays * depth[read][:, None]
    bent = _plane_residual(points)
    if bent < MIN_BENT_RESIDUAL:
        return []
    flat = _plane_residual(points / np.linalg.norm(rays, axis=1)[:, None])
    if flat > MAX_FLAT_RESIDUAL_RATIO * bent:
        return []
    return [
        f"check the depth: the broadest surface is bent by {bent:.1%} of its depth, and flat to {flat:.1%} if the values are "
        "distances along the rays, as renderers give them: divide each value by the length of its pixel's ray, "
        "sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2)"
    ]


def relief_notes(frame: Frame, chain: Chain | None, plane: Plane | None, is_metric: bool) -> list[str]:
    """Return a sentence if a chain is much flatter than wide, or behind the surface around it, so that depth is not metric.

    Parameters
    ----------
    frame
        the frame.
    chain
        the longest chain, in the camera's coordinates; None without chains.
    plane
        the plane around the object, m, its normal towards the camera; None if unknown.
    is_metric
        whether all depths are multiples of a step, as from a camera's driver, which writes whole units.
    """
    largest = 0.0 if is_metric else float(frame.depth.max())
    if abs(largest - 1) < NORMALIZED_RANGE[1] and frame.depth[frame.depth > 0].min() < NORMALIZED_RANGE[0]:
        return [f"check the depth: the values range from 0 to exactly 1, as of {KINDS['normalized']}: {REMEDY}"]
    relief = None if chain is None or plane is None else _relief(frame, chain, plane)
    if relief is None:
        return []
    median, high = np.percentile(relief, (50, 90)).tolist()
    if DISPARITY_RELIEF[0] < median < DISPARITY_RELIEF[1] and high < DISPARITY_RELIEF[1] / 2:
        return [
            "check the depth: the longest chain lies as far behind the surface around it as it is wide, as in disparities: "
            "convert the values to depth, focal length (px) times baseline (m) / disparity (px)"
        ]
    if 0 < largest <= 1 and 0 < median < BUFFER_RELIEF[0] and high < BUFFER_RELIEF[1]:
        return [
            f"check the depth: all values are below 1, and the longest chain is {median:.2g} times as high as it is wide, as in "
            f"{KINDS['buffer']}: {REMEDY}"
        ]
    return []


def _rays(camera: Camera, u: Floats, v: Floats) -> Floats:
    """Return the points (N, 3) at depth 1 that are seen at pixels."""
    return np.column_stack(((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(len(u))))


def _plane_residual(points: Floats) -> float:
    """Return the residual at PLANE_QUANTILE of a plane fitted to most points (N, 3) m, as a fraction of the depth.

    The plane n p = 1 is linear in the inverse depth; the fit is repeated with the points near it.
    """
    used, rank = points, int(PLANE_QUANTILE * len(points))
    for _ in range(FIT_ITERATIONS):
        plane = np.linalg.lstsq(used.T @ used, used.sum(axis=0), rcond=None)[0]
        residuals = np.abs(points @ plane - 1)
        middle = float(np.partition(residuals, rank)[rank])
        used = points[residuals <= INLIER_RESIDUALS * middle]
    return middle


def _relief(frame: Frame, chain: Chain, plane: Plane) -> Floats | None:
    """Return the height of the readings at a chain's joints above a plane, in widths of the chain; None if too few readings."""
    pixels = np.rint(frame.camera.project(chain.joints))
    inside = ((pixels >= 0) & (pixels < (frame.camera.width, frame.camera.height))).all(axis=1)
    u, v = pixels[inside].astype(int).T
    depth = frame.depth[v, u].astype(float)
    points = _rays(frame.camera, u, v)[depth > 0] * depth[depth > 0][:, None]
    if len(points) < MIN_RELIEF_READINGS or not 0 < chain.radius < np.inf:
        return None
    return np.asarray(points @ plane.normal - plane.height) / (2 * chain.radius)
