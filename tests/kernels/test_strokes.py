"""Strokes on a transparent layer, and the layer over an image, against plain references."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from doo3d import kernels

SIZE = (23, 31)  # rows, columns
COORDINATES = st.floats(-12, 40)
STROKES = st.lists(
    st.tuples(
        st.lists(st.tuples(COORDINATES, COORDINATES, st.floats(0, 9)), min_size=1, max_size=4),
        st.tuples(*[st.integers(0, 255)] * 4),
        st.booleans(),
    ),
    max_size=4,
)


def reference(layer, strokes):
    """Each pixel of the layer against each part of each stroke."""
    rows, columns = np.indices(layer.shape[:2])
    pixels = np.stack((columns, rows), axis=-1).astype(float)
    for points, color, blunt in strokes:
        nodes = np.array(points, dtype=float)
        parts = list(pairwise(nodes)) or [(nodes[0], nodes[0])]
        covered = np.zeros(layer.shape[:2])
        for i, (a, b) in enumerate(parts):
            step = b[:2] - a[:2]
            along = (pixels - a[:2]) @ step / (step @ step) if step @ step > 0 else np.zeros(layer.shape[:2])
            at = np.clip(along, 0, 1)
            distance = np.linalg.norm(pixels - a[:2] - at[..., None] * step, axis=-1)
            part = a[2] + (b[2] - a[2]) * at + 0.5 - distance
            if blunt and len(nodes) > 1:
                length = np.linalg.norm(step)
                part = np.minimum(part, 0.5 + along * length) if i == 0 else part
                part = np.minimum(part, 0.5 + (1 - along) * length) if i == len(parts) - 1 else part
            covered = np.maximum(covered, part)
        level = np.clip(covered, 0, 1)[..., None]
        layer = np.rint(layer * (1 - level) + np.array(color) * level)
    return layer


def painted(strokes, layer=None):
    layer = np.zeros((*SIZE, 4), np.uint8) if layer is None else layer
    points = np.array([point for stroke in strokes for point in stroke[0]], dtype=float).reshape(-1, 3)
    stops = np.cumsum([len(stroke[0]) for stroke in strokes]).astype(np.int64)
    colors = np.array([stroke[1] for stroke in strokes], np.uint8).reshape(-1, 4)
    kernels.paint_strokes(layer, points, stops, colors, np.array([stroke[2] for stroke in strokes], bool))
    return layer


@given(STROKES)
@settings(max_examples=150, deadline=None)
def test_a_pixel_has_the_color_of_the_strokes_as_far_as_they_cover_it(strokes):
    expected = reference(np.zeros((*SIZE, 4)), strokes)
    assert np.abs(painted(strokes) - expected).max() <= 1 + len(strokes)  # levels of 255, rounded for each stroke


def test_parts_that_overlap_are_blended_once():
    folded = [([(5, 10, 3), (20, 10, 3), (5, 11, 3)], (100, 0, 0, 128), False)]
    assert painted(folded)[10, 10].tolist() == [100, 0, 0, 128]


def test_a_stroke_that_reaches_far_beyond_the_layer_is_drawn_where_it_crosses_it():
    layer = painted([([(-1e9, 11, 2), (1e9, 11, 2)], (9, 9, 9, 255), False)])
    assert (layer[10:13, :, 3] == 255).all()
    assert not layer[:8].any()
    assert not layer[15:].any()


def test_a_stroke_without_color_cuts_a_hole():
    disc = ([(15, 11, 8)], (200, 0, 0, 255), False)
    layer = painted([disc, ([(15, 11, 3)], (0, 0, 0, 0), False)])
    assert not layer[11, 15].any()
    assert layer[11, 20].tolist() == [200, 0, 0, 255]


def test_a_layer_lies_over_a_picture_as_far_as_it_is_opaque():
    rng = np.random.default_rng(0)
    picture, opacity = rng.integers(0, 256, (*SIZE, 3)).astype(np.uint8), rng.integers(0, 256, (*SIZE, 1))
    opacity[:9] = 0
    color = rng.integers(0, 256, (*SIZE, 3)) * opacity // 255
    layer = np.concatenate((color, opacity), axis=2).astype(np.uint8)
    expected = np.minimum(color + picture * (255 - opacity) / 255, 255)
    before = picture.copy()
    kernels.blend_layer(picture, layer)
    assert np.abs(picture - expected).max() <= 0.51
    np.testing.assert_array_equal(picture[:9], before[:9])
