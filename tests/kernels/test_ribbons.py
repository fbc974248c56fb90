"""The score of a ribbon, against the same by loops."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import ribbon_scores

STRAIGHT = np.eye(2, 3)


def slow(image, widths, noise, length_widths, min_length):
    height, width = image.shape[:2]
    at = lambda row, column: image[min(max(row, 0), height - 1), min(max(column, 0), width - 1)].astype(float)  # noqa: E731
    best, which = np.zeros((height, width)), np.zeros((height, width), int)
    for index, px in enumerate(widths):
        half = max(min_length, int(np.floor(length_widths * px + 0.5))) // 2
        core, side = max(0, int(np.floor(0.35 * px))), max(2, int(np.floor(px / 4 + 0.5)))
        gap = int(np.floor(px / 2 + 1.5))
        for row in range(height):
            for column in range(width):
                window = lambda rows: np.array([[at(r, c) for c in range(column - half, column + half + 1)] for r in rows])  # noqa: B023, E731
                inside = window(range(row - core, row + core + 1))
                spread = inside.var(axis=1).sum(axis=1).mean()
                color = inside.mean(axis=(0, 1))
                sides = (window(range(row - gap - side + 1, row - gap + 1)), window(range(row + gap, row + gap + side)))
                value = min(((pixels - color) ** 2).sum(axis=2).mean() for pixels in sides) / (spread + noise)
                if value > best[row, column]:
                    best[row, column], which[row, column] = value, index
    return best, which


@pytest.mark.parametrize("shape", [(12, 17), (7, 150), (1, 9), (9, 1), (1, 1)])
def test_as_by_loops(shape):
    image = np.random.default_rng(0).normal(0, 10, (*shape, 3)).astype(np.float32)
    widths = np.array((2.0, 3.5, 6.0))
    score, which = ribbon_scores(image, widths, 4.0, 1.5, 5, STRAIGHT, shape)
    expected, index = slow(image, widths, 4.0, 1.5, 5)
    np.testing.assert_allclose(score, expected, rtol=1e-3, atol=1e-4)
    if min(shape) > 1:  # in a single row several widths see the same, and either is right
        assert (which == index).mean() > 0.99


def test_a_ribbon_of_its_width_scores_most():
    image = np.zeros((60, 80, 3), np.float32)
    image[26:35] = (40, 10, -20)
    score, which = ribbon_scores(image, np.array((3.0, 4.5, 6.5, 9.0, 12.5)), 9.0, 2.2, 13, STRAIGHT, (60, 80))
    assert score[30, 40] == pytest.approx(2100 / 9, rel=1e-3)
    assert score[10, 40] == 0
    assert which[30, 40] == 3


def test_only_the_pixels_of_the_image_that_was_turned_need_a_score():
    image = np.random.default_rng(0).normal(0, 10, (300, 300, 3)).astype(np.float32)
    widths = np.array((3.0, 9.0))
    back = cv2.invertAffineTransform(cv2.getRotationMatrix2D((60, 60), 40, 1) + np.array(((0, 0, 90), (0, 0, 90))))
    found = ribbon_scores(image, widths, 4.0, 1.5, 5, back, (120, 120))
    all_of_it = ribbon_scores(image, widths, 4.0, 1.5, 5, STRAIGHT, (300, 300))
    rows, columns = np.mgrid[:300, :300]
    x, y = (back[i, 0] * columns + back[i, 1] * rows + back[i, 2] for i in (0, 1))
    inside = (np.abs(x - 59.5) < 62) & (np.abs(y - 59.5) < 62)
    for some, every in zip(found, all_of_it, strict=True):
        np.testing.assert_array_equal(some[inside], every[inside])
    assert (found[0] == 0).mean() > 0.2


@pytest.mark.parametrize(
    ("image", "widths", "noise"),
    [((4, 4, 2), (3.0,), 1.0), ((0, 4, 3), (3.0,), 1.0), ((4, 4, 3), (), 1.0), ((4, 4, 3), (3.0,), 0.0)],
)
def test_what_does_not_fit_is_refused(image, widths, noise):
    with pytest.raises(ValueError, match=r"image|noise"):
        ribbon_scores(np.zeros(image, np.float32), np.array(widths), noise, 2.2, 13, STRAIGHT, (4, 4))
