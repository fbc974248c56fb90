"""Arrays at the border of the native kernels: a wrong one is a TypeError or a ValueError, and never a crash."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from doo3d import kernels

POINTS = np.cumsum(np.full((6, 3), 0.01), axis=0)
COORDS = np.argwhere(np.ones((2, 2, 2))) + 1
TABLE = kernels.neighbor_table(COORDS)
PIXELS = (np.array([1]), np.array([1]))

# a call that works, by kernel
CALLS = {
    "agreeing_readings": (np.ones((3, 3), np.float32), np.ones((3, 3), bool), 0.1, 10.0, 1, 0.01, 3),
    "arc_line_arc": (np.eye(4, 3), 0.1, False),
    "arc_towards": (np.zeros(3), np.eye(3)[0], np.ones(3), 0.1, False),
    "arc_length": (POINTS,),
    "axis_depth": (np.zeros(2, int), np.zeros(2), np.ones(2), np.zeros(3, int), np.ones(3), 1, 0.8, 4.5),
    "bounding_box": (np.ones((3, 3), bool),),
    "blend_layer": (np.ones((3, 3, 3), np.uint8), np.ones((3, 3, 4), np.uint8)),
    "close_cells": (np.array([21, 23]), np.array([9, 3, 1]), 1),
    "color_bands": (
        np.zeros((3, 3, 3), np.uint8), np.zeros((1, 1, 3), np.float32), np.ones(3), np.ones((2, 2), bool), np.ones((3, 3), bool),
        np.array([3.5, 7.0, 0.2, 0.3, 0.5]),
    ),
    "connected_components": (TABLE,),
    "corner_radius": (np.eye(4, 3),),
    "count_near_planes": (POINTS, np.eye(3), np.zeros(3), 0.1),
    "cover_with_chords": (POINTS, 0.01),
    "crossing_numbers": (np.zeros((3, 3), np.uint8), *PIXELS),
    "depth_differences": (np.ones((3, 3), np.float32), np.ones((3, 3), bool)),
    "end_tangents": (POINTS, np.array([0, 6]), 0.1),
    "is_simple": (3,),
    "lateral_sums": (np.zeros((2, 2)), np.zeros(2), np.zeros(2, int), np.zeros((1, 2)), np.zeros((1, 2)), np.ones(1)),
    "lay_equal_chords": (POINTS, 0.01),
    "mask_parts": (np.ones((3, 3), bool), 4),
    "mask_pixels": (np.ones((3, 3), bool),),
    "equalize_lengths": (POINTS, 0.1, np.ones(len(POINTS)), 5, 1e-3),
    "first_clear": (POINTS, np.array([0, 3, 6]), np.array([3, 3]), np.array([3, 3]), 0.1),
    "match_by_blossoms": (np.zeros((2, 2)),),
    "medial_axis": (np.ones((3, 3), bool),),
    "moving_mean": (POINTS, 1),
    "nearest": (POINTS, POINTS, 0.1, False),
    "neighbor_table": (COORDS,),
    "neighborhood_spreads": (POINTS, POINTS[:2], 0.02),
    "occupied_cells": (POINTS, POINTS[:2], 0.02, np.zeros((2, 3)), np.tile(np.eye(2, 3).ravel(), (2, 1)), 0.01),
    "paint_strokes": (
        np.zeros((3, 3, 4), np.uint8), np.ones((2, 3)), np.array([1, 2]), np.ones((2, 4), np.uint8), np.zeros(2, bool),
    ),
    "points_near_line": (POINTS, np.zeros(3), np.eye(3)[0], 1.0, 1.0),
    "prune_spurs": (np.zeros((3, 3), np.uint8), *PIXELS, 1.0),
    "raised_pixels": (np.ones((3, 3), np.float32), np.zeros(3, np.float32), np.ones(3, np.float32), 1.5, 0.2, 0.4),
    "readings_in_mask": (np.ones((3, 3), np.float32), np.ones((3, 3), bool)),
    "ribbon_scores": (np.zeros((3, 3, 3), np.float32), np.ones(1), 1.0, 2.0, 3),
    "sample_bilinear": (np.zeros((3, 3, 1), np.uint8), np.zeros((1, 2))),
    "sample_gap": (np.ones((2, 11)), 0.1),
    "second_best_rise": (
        np.ones((2, 2)), np.array([1, 0]), 1.0, np.array([-1, -1]), np.zeros(2), np.array([[0, 1]]), False, 2,
    ),
    "section_offsets": (POINTS, np.zeros(6), np.zeros(6, int), POINTS, POINTS, POINTS, np.ones(6)),
    "solve_gap": (np.eye(4, 3), 0.0, 0.1, False),
    "steps": (POINTS, False),
    "thin_pixels": (COORDS[:4, 1:].copy(),),
    "thin_voxels": (TABLE,),
    "trace_branches": (TABLE,),
    "traverse_contour": (POINTS, 0.01, 0.5),
    "unit": (np.ones(3),),
    "unit_rows": (POINTS,),
    "whittaker_smooth": (POINTS, np.tile(np.eye(3), (6, 1, 1)), 1.0, 2),
    "window_sum": (np.ones(3), np.zeros(3, int), 1),
    "without_small_regions": (np.ones((3, 3), bool), 4),
}  # fmt: skip
ARRAYS = [(name, i) for name, call in CALLS.items() for i, value in enumerate(call) if isinstance(value, np.ndarray)]


def test_every_kernel_is_called():
    assert set(CALLS) == set(kernels.__all__)


@pytest.mark.parametrize("name", CALLS)
def test_the_call_works(name):
    getattr(kernels, name)(*CALLS[name])


@pytest.mark.parametrize(("name", "index"), ARRAYS)
@pytest.mark.parametrize("wrong", ["list", "type", "axes", "none"])
def test_another_type_or_number_of_axes_is_a_type_error(name, index, wrong):
    arguments = list(CALLS[name])
    array = arguments[index]
    other = np.complex128
    arguments[index] = {"list": array.tolist(), "type": array.astype(other), "axes": array[..., None], "none": None}[wrong]
    with pytest.raises(TypeError, match=name):
        getattr(kernels, name)(*arguments)


@pytest.mark.parametrize(("name", "index"), ARRAYS)
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_any_array_of_the_right_type_gives_a_result_or_an_error(name, index, data):
    """Other shapes, other values, none at all: what does not fit the other arguments is refused."""
    arguments = list(CALLS[name])
    array = arguments[index]
    elements = {"f": st.floats(-10, 10, width=32), "i": st.integers(-3, 9), "b": st.booleans(), "u": st.integers(0, 1)}[
        array.dtype.kind
    ]
    shape = npst.array_shapes(min_dims=array.ndim, max_dims=array.ndim, min_side=0, max_side=6)
    arguments[index] = data.draw(npst.arrays(array.dtype, shape, elements=elements))
    try:
        getattr(kernels, name)(*arguments)
    except (TypeError, ValueError):
        return


@pytest.mark.parametrize(("name", "index"), [pair for pair in ARRAYS if CALLS[pair[0]][pair[1]].ndim == 1])
def test_vectors_may_have_any_stride(name, index):
    arguments = list(CALLS[name])
    arguments[index] = np.repeat(arguments[index], 2)[::2]
    strided, plain = getattr(kernels, name)(*arguments), getattr(kernels, name)(*CALLS[name])
    one, other = (result if isinstance(result, tuple) else (result,) for result in (strided, plain))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)
