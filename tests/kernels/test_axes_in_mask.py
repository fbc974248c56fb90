"""The axis and the radius of strands in a mask, against a plain computation in NumPy."""

import numpy as np
import pytest

from doo3d.geometry.curves import Curves
from doo3d.geometry.polyline import steps, whittaker_smooth
from doo3d.kernels import axes_in_mask, axis_depth, nearest, section_axes, section_offsets, silhouette, window_sum

CAMERA = np.array((300.0, 310.0, 79.5, 59.5))
HALF = 2
TOUCHING, NEAR, SUNK, CENTRAL, SMOOTHING, OVERLAP, DEVIATION = 2.2, 1.5, 3.0, 0.8, 1.2, 5, 1.4826
PATH, DEPTH, GAP, TOLERANCE, NOISE, OUTLIER = 0.01, 0.06, 0.3, 0.3, 0.05, 3 * DEVIATION
SETTINGS = {
    "touching_radii": TOUCHING, "own_radii": NEAR, "sunk_radii": SUNK, "central_part": CENTRAL, "smoothing_radii": SMOOTHING,
    "max_strength": 1e8, "least_weight": 1e-6, "ring_overlap": OVERLAP, "path_weight": PATH, "depth_weight": DEPTH,
    "gap_weight": GAP, "radius_tolerance": TOLERANCE, "noise_radii": NOISE, "deviations": 3.0,
}  # fmt: skip
BESIDE = np.array([2.0, 4.0, 6.0])
PLANE = np.array((0.0, 0.06, -np.sqrt(1 - 0.06**2), -0.508))


def project(points):
    return np.column_stack([CAMERA[d] * points[:, d] / points[:, 2] + CAMERA[2 + d] for d in (0, 1)])


def slow_raised(points, lateral, behind, target, radius, depth, mask):
    *normal, level = PLANE
    normal, result = np.array(normal), target.copy()
    for i, axis in enumerate(target):
        low, slope = axis @ normal - level, -(behind[i] @ normal)
        if not (-SUNK * radius[i] < low < radius[i] and slope > 0):
            continue
        heights = []
        for offset in np.concatenate((-1, 1) * (radius[i] + BESIDE * points[i, 2] / CAMERA[0])[:, None]):
            u, v = np.rint(project((points[i] + offset * lateral[i])[None])[0]).astype(int)
            if 0 <= u < depth.shape[1] and 0 <= v < depth.shape[0] and not mask[v, u] and depth[v, u] > 0:
                seen = np.array(((u - CAMERA[2]) / CAMERA[0], (v - CAMERA[3]) / CAMERA[1], 1.0)) * float(depth[v, u])
                heights.append(seen @ normal - level)
        if heights and abs(np.median(heights)) < NEAR * radius[i]:
            result[i] -= min((radius[i] - low) / slope, (1 + SUNK) * radius[i]) * behind[i]
    return result


def slow_depth(curves, moved, lateral, away, surface, filled, radius):
    distance, near = nearest(surface, moved, TOUCHING * radius.max())
    sections = section_offsets(surface, distance, near, moved, lateral, away, TOUCHING * radius)
    depth, count = axis_depth(*sections, curves.owner, radius, HALF, CENTRAL, OUTLIER)
    usual = np.median(count[count > 0])
    weight = np.minimum(1.0, count / usual) * (count > 0.1 * usual) * np.where(filled, GAP, 1.0) * DEPTH
    target = moved + np.where(weight > 0, depth, 0.0)[:, None] * away
    apart, relative = 2 * HALF + 1, []
    for first in range(len(target) - 2 * apart):
        three = np.array((first, first + apart, first + 2 * apart))
        if np.ptp(curves.owner[three]) == 0 and (weight[three] > 0).all() and not filled[three].any():
            change = np.array((1, -2, 1)) @ target[three] @ away[three[1]]
            relative.append(abs(change) / radius[three[1]])
    noise = DEVIATION * np.median(relative) / np.sqrt(6)
    return target, weight * min(1.0, NOISE / noise) ** 2


def slow_smoothed(curves, target, weight, radius):
    smooth = np.empty_like(target)
    for part, ring in zip(curves.parts, curves.closed, strict=True):
        strength = (SMOOTHING * radius[part.start] / np.median(steps(curves.points[part]))) ** 4
        size, overlap = part.stop - part.start, OVERLAP if ring else 0
        around = part.start + np.arange(-overlap, size + overlap) % size
        smooth[part] = whittaker_smooth(target[around], weight[around], strength)[overlap : overlap + size]
    return smooth


def slow_iteration(curves, filled, radius, pixels, share, surface, depth, mask):
    points, owner, planar = curves.points, curves.owner, curves.points.shape[1] == 2
    lateral, away = np.column_stack((-curves.tangents[:, 1], curves.tangents[:, 0])), np.zeros_like(points)
    if not planar:
        lateral, away = section_axes(points, curves.tangents, np.zeros(3))
    camera, reach = np.zeros(0) if planar else CAMERA, TOUCHING * radius
    offset, half_width = silhouette(points, curves.tangents, lateral, owner, pixels, share, camera, reach, HALF)
    radius = radius.copy()
    for part in curves.parts:
        usable = half_width[part][~filled[part] & (half_width[part] > 0)]
        radius[part] = np.median(usable) if len(usable) else radius[part]
    trust = np.exp(-(((half_width / radius - 1) / TOLERANCE) ** 2)) * (half_width > 0)
    good, radii = (trust > 0.5) & ~filled, radius.copy()
    count, total = (window_sum(np.where(good, values, 0.0), owner, 2 * HALF) for values in (1.0, half_width))
    for part in curves.parts:
        index = np.flatnonzero(count[part] > 0)
        if len(index):
            radii[part] = np.interp(np.arange(part.stop - part.start), index, (total[part] / np.maximum(count[part], 1))[index])
    target = points + np.where(trust > 0.1, offset, 0.0)[:, None] * lateral
    depth_weight = np.zeros(len(points))
    if not planar:
        target, depth_weight = slow_depth(curves, target, lateral, away, surface, filled, radius)
        target = slow_raised(points, lateral, away, target, radius, depth, mask)
    across = (trust * np.where(filled, GAP, 1.0))[:, None, None] * lateral[:, :, None] * lateral[:, None]
    weight = across + depth_weight[:, None, None] * away[:, :, None] * away[:, None] + PATH * np.eye(points.shape[1])
    return curves.with_points(slow_smoothed(curves, target, weight, radius)), radius, radii


def scene():
    """A line that the mask does not show in its last fifth, and a ring, both beside their places in the mask and in depth."""
    t, turn = np.linspace(-1, 1, 60), np.linspace(0, 2 * np.pi, 50, endpoint=False)
    lines = [
        np.column_stack((0.11 * t, 0.01 * np.sin(5 * t) - 0.05, 0.5 + 0.02 * t)),
        np.column_stack((0.05 * np.cos(turn), 0.04 * np.sin(turn) + 0.03, np.full(50, 0.5))),
    ]
    curves, rng = Curves.of(lines, [False, True]), np.random.default_rng(0)
    v, u = np.indices((120, 160))
    every = np.column_stack((u.ravel(), v.ravel())).astype(float)
    distance, near = nearest(every, project(curves.points) + np.array((1.0, -1.0)), np.inf)
    mask = (distance < 4.0) & (near != 7) & ~((near > 48) & (near < 60))
    z = np.where(mask, curves.points[near, 2] - 0.004, 0.507 + 0.06 * (every[:, 1] - 60) / 600) + rng.normal(0, 0.0008, len(mask))
    z[rng.random(len(z)) < 0.1] = 0
    z[(every[:, 0] > 130) & ~mask] += 0.2  # beyond the edge of the table
    seen = mask & (z > 0)
    rays = np.column_stack(((every - CAMERA[2:]) / CAMERA[:2], np.ones(len(every))))
    surface = (rays * z[:, None])[seen]
    return curves, every[mask], surface, z.reshape(120, 160).astype(np.float32), mask.reshape(120, 160)


@pytest.mark.parametrize("planar", [False, True])
def test_axes_and_radii_are_those_of_a_plain_computation(planar):
    curves, pixels, surface, depth, mask = scene()
    if planar:
        curves = curves.with_points(project(curves.points))
    size = len(curves.points)
    filled, radius = np.isin(np.arange(size), (20, 21, 22, 70)), np.full(size, 3.2 if planar else 0.0052)
    camera, plane = (np.zeros(0), np.zeros(0)) if planar else (CAMERA, PLANE)
    found = axes_in_mask(
        *(curves.points, curves.bounds, curves.closed, filled, radius, HALF, pixels, 1.1, surface, camera, depth, mask, plane),
        *(BESIDE, 2),
        **SETTINGS,
    )
    expected = curves, radius, radius
    for _ in range(2):
        expected = slow_iteration(expected[0], filled, expected[1], pixels, 1.1, surface, depth, mask)
    assert np.ptp(expected[2]) > 0.05 * expected[1][0]
    for values, reference in zip(found, (expected[0].points, *expected[1:]), strict=True):
        np.testing.assert_allclose(values, reference, rtol=0, atol=1e-9 * (300 if planar else 1))


def test_axes_are_raised_where_a_plane_is_seen_beside_them():
    curves, pixels, surface, depth, mask = scene()
    size = len(curves.points)
    given = curves.points, curves.bounds, curves.closed, np.zeros(size, bool), np.full(size, 0.0052), HALF, pixels, 1.0, surface
    raised, low = (
        axes_in_mask(*given, CAMERA, depth, mask, plane, BESIDE, 1, **SETTINGS)[0][:, 2] for plane in (PLANE, np.zeros(0))
    )
    assert (low - raised).max() > 0.001
    assert np.abs(low - raised).min() < 1e-4
