"""The score of a ribbon, against the same by loops."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import ribbon_scores


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
    scores, widest = ribbon_scores(image, 2, widths, 4.0, 1.5, 5)
    for score, which, turned in zip(scores, widest, (image, image.transpose(1, 0, 2)), strict=True):
        expected, index = (part if turned is image else part.T for part in slow(turned, widths, 4.0, 1.5, 5))
        np.testing.assert_allclose(score, expected, rtol=1e-3, atol=2e-4)
        if min(shape) > 1:  # in a single row several widths see the same, and either is right
            assert (which == index).mean() > 0.99


def test_a_direction_is_that_of_the_image_turned():
    image = cv2.GaussianBlur(np.random.default_rng(1).normal(0, 40, (21, 26, 3)).astype(np.float32), (0, 0), 1.5)
    widths = np.array((2.0, 4.0))
    turn = cv2.getRotationMatrix2D((12.5, 10), 45, 1)
    size = tuple(int(47 * np.sqrt(0.5) + 2) for _ in range(2))
    turn[:, 2] += (size[0] - 26) / 2, (size[1] - 21) / 2
    turned = cv2.warpAffine(image, turn, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    score = slow(turned, widths, 4.0, 1.5, 5)[0].astype(np.float32)
    expected = cv2.warpAffine(score, cv2.invertAffineTransform(turn), (26, 21), flags=cv2.INTER_LINEAR)
    np.testing.assert_allclose(ribbon_scores(image, 4, widths, 4.0, 1.5, 5)[0][1], expected, rtol=2e-3, atol=1e-3)


def test_a_ribbon_of_its_width_scores_most():
    image = np.zeros((60, 80, 3), np.float32)
    image[26:35] = (40, 10, -20)
    score, which = ribbon_scores(image, 2, np.array((3.0, 4.5, 6.5, 9.0, 12.5)), 9.0, 2.2, 13)
    assert score[0, 30, 40] == pytest.approx(2100 / 9, rel=1e-3)
    assert score[0, 10, 40] < 1e-5
    assert which[0, 30, 40] == 3
    assert score[1, 30, 40] < 1


@pytest.mark.parametrize(
    ("image", "directions", "widths", "noise"),
    [
        ((4, 4, 2), 1, (3.0,), 1.0),
        ((0, 4, 3), 1, (3.0,), 1.0),
        ((4, 4, 3), 1, (), 1.0),
        ((4, 4, 3), 1, (3.0,), 0.0),
        ((4, 4, 3), 0, (3.0,), 1.0),
    ],
)
def test_what_does_not_fit_is_refused(image, directions, widths, noise):
    with pytest.raises(ValueError, match=r"image|noise|directions"):
        ribbon_scores(np.zeros(image, np.float32), directions, np.array(widths), noise, 2.2, 13)
