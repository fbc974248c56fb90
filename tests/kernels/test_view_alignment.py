"""The normal equations of the alignment of two views, against a plain computation pixel by pixel."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from doo3d.kernels import view_alignment

HEIGHT, WIDTH = 14, 18
INTRINSICS = np.array([20.0, 21.0, 8.5, 6.5])
LEAST, TO_DEVIATION, OUTLIER = np.array([1.0, 1e-3]), 1.4826, 2.0


@pytest.fixture
def views():
    rng = np.random.default_rng(3)
    gray, inverse = rng.uniform(50, 200, (2, HEIGHT, WIDTH)), rng.uniform(1, 2, (2, HEIGHT, WIDTH))
    gray[:, 3, 4:7] = np.nan
    inverse[0, 10, 2:5] = inverse[1, 2, 2:9] = np.nan
    first, second = ((g.astype(np.float32), i.astype(np.float32)) for g, i in zip(gray, inverse, strict=True))
    return (*first, *second)


def pose(turn=(0.05, -0.04, 0.1), shift=(0.02, -0.01, 0.03)):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), shift
    return result


def read(image, u, v):
    x, y = int(u), int(v)
    s, t = u - x, v - y
    (a, b), (c, d) = image[y : y + 2, x : x + 2].astype(float)
    return (1 - t) * (a + s * (b - a)) + t * (c + s * (d - c))


def residuals(views, row, column, at, light):
    """The differences of one pixel in brightness and inverse depth; None if the second view does not show it."""
    gray, inverse = (float(image[row, column]) for image in views[:2])
    fx, fy, cx, cy = INTRINSICS
    x, y, z = at[:3, :3] @ ((column - cx) / fx, (row - cy) / fy, 1.0) + at[:3, 3] * inverse
    u, v = fx * x / z + cx, fy * y / z + cy
    if np.isnan(gray + inverse) or z <= 0 or not (0 <= u < WIDTH - 1 and 0 <= v < HEIGHT - 1):
        return None
    seen = read(views[2], u, v)
    return None if np.isnan(seen) else np.array([seen - light[0] * gray - light[1], read(views[3], u, v) - inverse / z])


def slow(views, at, light, noise):
    pixels = [(row, column) for row in range(HEIGHT) for column in range(WIDTH)]
    shown = [pixel for pixel in pixels if residuals(views, *pixel, at, light) is not None]
    values = np.array([residuals(views, *pixel, at, light) for pixel in shown])
    medians = np.nanmedian(np.abs(values), axis=0)
    noise = np.where(noise > 0, noise, np.maximum(TO_DEVIATION * medians, LEAST))
    equations, losses, step = np.zeros((8, 9)), np.zeros(2), 1e-6
    for pixel, value in zip(shown, values, strict=True):
        slopes = np.zeros((2, 8))
        for k in range(8):
            sides = []
            for change in (step, -step):
                by = np.zeros(8)
                by[k] = change
                moved = pose(by[:3], by[3:6]) @ at
                sides.append(residuals(views, *pixel, moved, light + by[6:]))
            slopes[:, k] = (sides[0] - sides[1]) / (2 * step)
        for kind in np.flatnonzero(np.isfinite(value)):
            r = value[kind] / noise[kind]
            weight = 1 / (1 + r**2 / OUTLIER**2) ** 2 / noise[kind] ** 2
            equations += weight * np.outer(slopes[kind], np.append(slopes[kind], -value[kind]))
            losses[kind] += r**2 / 2 / (1 + r**2 / OUTLIER**2)
    known = int(np.isfinite(views[0] + views[1]).sum())
    agreeing = int((~(np.abs(values) > OUTLIER * noise)).all(axis=1).sum())
    return equations, np.array([*noise, *losses, known, len(shown), agreeing])


@pytest.mark.parametrize("noise", [(0.0, 0.0), (7.0, 0.2)])
def test_the_equations_are_those_of_the_plain_computation(views, noise):
    light, noise = np.array([0.9, 5.0]), np.array(noise)
    equations, summary = view_alignment(*views, INTRINSICS, pose(), light, noise, OUTLIER)
    expected, said = slow(views, pose(), light, noise)
    np.testing.assert_allclose(summary, said, rtol=1e-9)
    np.testing.assert_allclose(equations, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    np.testing.assert_array_equal(equations[:, :8], equations[:, :8].T)


def test_nothing_is_shared_with_a_view_beside(views):
    equations, summary = view_alignment(
        *views, INTRINSICS, pose(shift=(50.0, 0.0, 0.0)), np.array([1.0, 0.0]), np.zeros(2), OUTLIER
    )
    assert not equations.any()
    assert summary[5] == summary[6] == 0


def test_images_of_other_shapes_are_refused(views):
    with pytest.raises(ValueError, match="one shape"):
        view_alignment(views[0], views[1], views[2], views[3][:-1].copy(), INTRINSICS, pose(), np.ones(2), np.ones(2), OUTLIER)
