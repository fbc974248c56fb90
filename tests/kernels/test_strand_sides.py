"""A strand and both of its sides, against the same with NumPy and OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import strand_sides

SHAPE, RADIUS = (80, 140), 0.004
CORE, SIDES = np.array((-0.4, 0.0, 0.4)), np.array((1.6, 2.2, 2.8, 3.4))
MARGIN, MIN_REACH, WINDOW, RISE, MAX_NOISE, PER_MEDIAN, LOW_SHARE = 2.0, 2.0, 16, 0.4, 1.0, 1.4826, 0.2  # as in the kernel


def scene(seed, rise=0.008, step=0.0, other=0):
    """A bend across an image; what lies beyond it may be higher or of another color."""
    random = np.random.default_rng(seed)
    x = np.linspace(-3, 143, 90)
    view = np.column_stack((x, 40 + 25 * np.sin(x / 25)))
    tangent = np.gradient(view, axis=0)
    across = (tangent / np.linalg.norm(tangent, axis=1)[:, None])[:, ::-1] * (-1, 1)
    reach = random.uniform(2.5, 3.5, len(view))
    mask = np.zeros(SHAPE, np.uint8)
    cv2.polylines(mask, [np.rint(view * 8).astype(np.int32)[:, None]], False, 1, 7, cv2.LINE_8, 3)
    above = np.arange(SHAPE[0])[:, None] < 40 + 25 * np.sin(np.arange(SHAPE[1]) / 25)
    depth = np.where(mask > 0, 0.8 - rise, 0.8 - step * above) + random.normal(0, 0.0005, SHAPE)
    depth[random.random(SHAPE) < 0.15] = 0
    color = np.where(mask[..., None] > 0, (180, 60, 50), 150 + np.array((other, 0, -other)) * above[..., None])
    color = np.clip(color + random.normal(0, 8, color.shape), 0, 255).astype(np.uint8)
    return view, across, reach, depth.astype(np.float32), color, mask > 0


def pixels(view, across, offsets):
    u, v = np.rint(view[:, None] + offsets[..., None] * across[:, None]).astype(int).transpose(2, 0, 1)
    inside = (u >= 0) & (v >= 0) & (u < SHAPE[1]) & (v < SHAPE[0])
    return np.where(inside, u, 0), np.where(inside, v, 0), inside


def slow_flat(view, across, reach, depth, mask):
    def middle(offsets, without):
        u, v, inside = pixels(view, across, offsets)
        some = inside & (depth[v, u] > 0) & ~(without & mask[v, u])
        return np.array(
            [np.percentile(d[s], 50, method="lower") if s.any() else np.nan for d, s in zip(depth[v, u], some, strict=True)]
        )

    beside = [middle(sign * (reach[:, None] * SIDES + MARGIN), True) for sign in (-1, 1)]
    rise = np.minimum(*beside).astype(float) - middle(reach[:, None] * CORE, False)
    rise = rise[np.isfinite(rise)]
    parts = np.array([np.median(part) for part in np.array_split(rise, max(1, len(rise) // int(WINDOW)))])
    noise = PER_MEDIAN * np.median(np.abs(parts - np.median(parts)))
    return max(0.0, 2 * (parts < RISE * RADIUS).mean() - 1) if noise < MAX_NOISE * RADIUS else 0.0


def slow_contrast(view, across, reach, color, mask):
    def mean(offsets, without):
        u, v, inside = pixels(view, across, offsets)
        some = inside & ~(without & mask[v, u])
        lab = cv2.cvtColor(color[v, u], cv2.COLOR_RGB2LAB).astype(float)
        return np.array([c[s].mean(axis=0) if s.any() else np.full(3, np.nan) for c, s in zip(lab, some, strict=True)])

    own, left, right = (
        mean(reach[:, None] * CORE, False),
        *(mean(s * (reach[:, None] * SIDES[:2] + MARGIN), True) for s in (-1, 1)),
    )
    contrast = np.minimum(np.linalg.norm(own - left, axis=1), np.linalg.norm(own - right, axis=1))
    return np.nanpercentile(contrast, 100 * LOW_SHARE, method="lower")


def found(view, across, reach, depth, color, mask):
    return strand_sides(view, across, reach, RADIUS, depth, color, mask, CORE, SIDES, SIDES[:2])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("rise", "step", "other"), [(0.008, 0.0, 0), (0.0, 0.0, 20), (0.0018, 0.0, 90), (0.008, 0.02, 150)])
def test_as_with_numpy(rise, step, other, seed):
    view, across, reach, depth, color, mask = scene(seed, rise, step, other)
    flat, contrast = found(view, across, reach, depth, color, mask)
    assert flat == pytest.approx(slow_flat(view, across, reach, depth, mask), abs=1e-9)
    assert contrast == pytest.approx(slow_contrast(view, across, reach, color, mask), abs=1e-9)


def test_a_mark_and_the_edge_of_a_step_are_flat():
    assert found(*scene(0))[0] == 0
    assert found(*scene(0, rise=0.0))[0] == 1
    assert found(*scene(0, step=0.02))[0] == 1


def test_the_more_similar_side_gives_the_contrast():
    assert found(*scene(0, other=30))[1] < found(*scene(0))[1] < found(*scene(0, other=-30))[1]


def test_without_depth_or_color_or_pixels_nothing_is_said():
    view, across, reach, depth, color, mask = scene(0, rise=0.0, other=100)
    flat, contrast = found(view, across, reach, depth, color, mask)
    assert found(view, across, reach, np.zeros((0, 0), np.float32), color, mask) == (0, contrast)
    assert found(view, across, reach, depth, np.zeros((0, 0, 3), np.uint8), mask) == (flat, np.inf)
    assert found(view + 500, across, reach, depth, color, mask) == (0, np.inf)
    assert found(view, across, reach / 3, depth, color, mask)[0] == 0
