"""A strand followed in an image, against a plain reference that blurs the whole image."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from doo3d.kernels import follow_strand

STEP, MIN_EXTENSION, NOISE = 0.5, 2.0, 6.0
STRAND, BACKGROUND, SHIFTS = np.linspace(-0.7, 0.7, 5), np.array([-2.2, -1.7, 1.7, 2.2]), np.array([-1.0, 0.0, 1.0])
TURNS, LOOKAHEAD_STEPS, PROFILE, DIRECTION, MAX_HIDDEN = np.linspace(-1, 1, 7) * STEP / 2, 4, 10.0, 4.0, 8.0  # as in the kernel
MAX_DISTANCE, MIN_CONTRAST, ADAPTATION, CONTRAST, TURN = 2.5, 1.5, STEP / PROFILE, 0.5, 0.36


def scene(seed, shape=(120, 160)):
    """A bent strand on a plain table, maybe under another one; the mask shows it up to column 60."""
    random = np.random.default_rng(seed)
    image = np.full((*shape, 3), random.integers(0, 256, 3), np.uint8)
    u = np.arange(160.0)
    v = 60 + random.uniform(-25, 25) * np.sin(u / random.uniform(20, 60) + random.uniform(0, 6))
    line = np.column_stack((u, v))
    radius = random.uniform(2, 7)
    cv2.polylines(image, [np.rint(line).astype(np.int32)], False, random.integers(0, 256, 3).tolist(), round(2 * radius))
    across = int(random.integers(90, 200))
    cv2.line(image, (across, 0), (across - 20, 119), random.integers(0, 256, 3).tolist(), int(random.integers(1, 12)))
    image = np.clip(image + random.normal(0, 6, image.shape), 0, 255).astype(np.uint8)
    mask = np.zeros(shape, bool)
    mask[:, :60] = (image[:, :60] != image[0, 0]).any(axis=2)
    mask[:, int(random.integers(100, 200)) :] = True
    return image, mask, line[: 60 : int(random.integers(2, 9))].copy(), radius


def followed(image, mask, joints, radius, max_length):
    image = cv2.GaussianBlur(image, (3, 3), 0)
    tail = last(joints, PROFILE * radius)
    direction = tail[-1] - last(tail, DIRECTION * radius)[0]
    angle, position = float(np.arctan2(direction[1], direction[0])), tail[-1]
    colors, variance = profile(image, tail, radius)
    path, length = [position], 0.0
    while length < max_length * radius:
        step = find_step(image, position, angle, radius, colors, variance, range(1, 2))
        if step is None:
            step = find_step(image, position, angle, radius, colors, variance, range(2, int(MAX_HIDDEN / STEP) + 2))
        if step is None:
            break
        colors = colors + ADAPTATION * (step[3] - colors)
        position, angle, length = step[0], angle + step[1], length + step[2]
        path.append(position)
        inside = (position >= 0).all() and (position <= np.array(mask.shape[::-1]) - 1).all()
        if not inside or (length > MIN_EXTENSION * radius and mask[tuple(np.rint(position[::-1]).astype(int))]):
            break
    return np.array(path)


def find_step(image, position, angle, radius, colors, variance, steps):
    angles = angle + TURNS[:, None, None]
    forward = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    lateral = np.stack((-forward[..., 1], forward[..., 0]), axis=-1)
    count = len(steps)
    distances = STEP * radius * np.arange(steps.start, steps.start + count - 1 + LOOKAHEAD_STEPS)[:, None]
    positions = position + forward * distances + lateral * SHIFTS[:, None, None]
    strand = read(image, positions[..., None, :] + lateral[..., None, :] * radius * STRAND[:, None])
    beside = read(image, positions[..., None, :] + lateral[..., None, :] * radius * BACKGROUND[:, None])
    distance = ahead(color_distance(strand - colors, variance).mean(axis=-1))
    background = color_distance(beside[..., None, :] - colors, variance).min(axis=-1)
    contrast = ahead(background.reshape(*background.shape[:-1], 2, -1).mean(axis=-1), axis=-2).min(axis=-1)
    cost = distance - CONTRAST * np.minimum(contrast, MAX_DISTANCE + MIN_CONTRAST)
    cost += (TURN * (TURNS / TURNS[-1]) ** 2)[:, None, None]
    best, each = cost.reshape(-1, count).argmin(axis=0), np.arange(count)
    best_distance, best_contrast = distance.reshape(-1, count)[best, each], contrast.reshape(-1, count)[best, each]
    seen = np.flatnonzero((best_distance <= MAX_DISTANCE) & (best_contrast >= best_distance + MIN_CONTRAST))
    if not len(seen):
        return None
    turn, shift = np.unravel_index(best[seen[0]], cost.shape[:2])
    return positions[turn, shift, seen[0]], TURNS[turn], distances[seen[0], 0], strand[turn, shift, seen[0]]


def ahead(values, axis=-1):
    return np.lib.stride_tricks.sliding_window_view(values, LOOKAHEAD_STEPS, axis=axis).mean(axis=-1)


def last(joints, length):
    return joints[-max(1, int(np.ceil(length / np.linalg.norm(joints[-1] - joints[-2])))) - 1 :]


def profile(image, joints, radius):
    segments = np.diff(joints, axis=0)
    size = float(np.linalg.norm(segments[0]))
    lengths = np.arange(0, max(len(segments) * size - radius, 1.0), 1.0)
    index = np.minimum((lengths / size).astype(int), len(segments) - 1)
    forward = segments[index] / size
    positions = joints[index] + forward * (lengths - index * size)[:, None]
    lateral = np.column_stack((-forward[:, 1], forward[:, 0]))
    colors = read(image, positions[:, None] + lateral[:, None] * radius * STRAND[:, None])
    return colors.mean(axis=0), colors.var(axis=0).mean(axis=0) + NOISE**2


def read(image, positions):
    u, v = np.rint(positions[..., 0]).astype(int), np.rint(positions[..., 1]).astype(int)
    return image[v.clip(0, image.shape[0] - 1), u.clip(0, image.shape[1] - 1)].astype(float)


def color_distance(difference, variance):
    return (difference**2 / variance).mean(axis=-1)


def natively(image, mask, joints, radius, max_length):
    return follow_strand(image, mask, joints, radius, max_length, step=STEP, min_extension=MIN_EXTENSION, noise=NOISE)


@given(st.integers(0, 2**32 - 1))
def test_paths_as_by_the_reference(seed):
    image, mask, joints, radius = scene(seed)
    for line in (joints, np.ascontiguousarray(joints[::-1])):
        np.testing.assert_allclose(
            natively(image, mask, line, radius, 30.0), followed(image, mask, line, radius, 30.0), atol=1e-9
        )


def test_a_strand_is_followed_to_the_border():
    image = np.full((40, 120, 3), 200, np.uint8)
    image[17:24] = 30
    joints = np.column_stack((np.arange(5.0, 50, 5), np.full(9, 20.0)))
    path = natively(image, np.zeros((40, 120), bool), joints, 3.5, 100.0)
    np.testing.assert_array_equal(path[0], (45, 20))
    assert path[-1, 0] > 117
    np.testing.assert_allclose(path[:, 1], 20, atol=1.1)


@pytest.mark.parametrize(("joints", "radius"), [([[1, 1], [1, 1]], 3.0), ([[1, 1], [np.nan, 2]], 3.0), ([[1, 1], [5, 1]], 0.0)])
def test_strands_without_direction_or_radius_are_refused(joints, radius):
    with pytest.raises(ValueError, match=r"place|finite|positive"):
        natively(np.zeros((9, 9, 3), np.uint8), np.zeros((9, 9), bool), np.array(joints, float), radius, 5.0)
