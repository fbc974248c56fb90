"""Arrays at the border of the native kernels: a wrong one is a TypeError or a ValueError, and never a crash."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from doo3d import kernels

POINTS = np.cumsum(np.full((6, 3), 0.01), axis=0)
COORDS = np.argwhere(np.ones((2, 2, 2))) + 1
TABLE = kernels.neighbor_table(COORDS)
PIXELS = (np.array([1]), np.array([1]))

# a call that works, by kernel
CALLS = {
    "axes_in_mask": (
        POINTS, np.array([0, 2, 6]), np.array([True, False]), np.zeros(6, bool), np.ones(6), 1, np.ones((2, 2)), 1.0, POINTS,
        np.ones(4), np.ones((3, 3), np.float32), np.ones((3, 3), bool), np.ones(4), np.ones(2), 1,
    ),
    "axis_depth": (np.zeros(2, int), np.zeros(2), np.ones(2), np.zeros(3, int), np.ones(3), 1, 0.8, 4.5),
    "blend_layer": (np.ones((3, 3, 3), np.uint8), np.ones((3, 3, 4), np.uint8)),
    "bounding_box": (np.ones((3, 3), bool),),
    "connected_parts": (TABLE,),
    "color_bands": (
        np.zeros((3, 3, 3), np.uint8), np.zeros((1, 1, 3), np.float32), np.ones(3), np.ones((2, 2), bool), np.ones((3, 3), bool),
        10, 4, np.array([3.5, 7.0, 0.2, 0.3, 0.5]),
    ),
    "ColorOdds": (
        np.zeros((3, 3, 3), np.uint8), np.array([0, 1]), np.array([8]), np.array([0.5]), 0.03, 0.6, 1e-5,
    ),
    "CrossingStrands": (
        POINTS, np.array([0, 2, 6]), np.array([False, True]), np.array([[0, 1]]), np.array([[0, 1]]), np.full((1, 2), 0.5),
        np.ones(1), np.ones((1, 2)), np.ones((1, 2)), np.ones((1, 2)), np.ones(2), 1.2, 0.3,
    ),
    "crossing_numbers": (np.zeros((3, 3), np.uint8), *PIXELS),
    "depth_support": (
        POINTS, np.array([0, 6]), np.ones(1), np.ones((3, 3), np.float32), np.ones((3, 3), bool), np.ones(4), np.ones(4),
        np.ones(2), np.ones(2),
    ),
    "end_tangents": (POINTS, np.array([0, 6]), 0.1),
    "equal_segments": (POINTS, np.array([0, 2, 6]), np.array([True, False]), np.zeros(4), 0.01, 100),
    "equalize_lengths": (POINTS, 0.1, np.ones(len(POINTS)), 5, 1e-3),
    "fit_chains": (POINTS, np.array([0, 2, 6]), np.array([True, False]), 0.01, 0.5),
    "fit_circles": (np.zeros(6, int), POINTS[:, 0].copy(), np.ones(6), np.zeros(3, int), np.ones(3), 1, 8, 5.0),
    "fit_lines": (
        POINTS, POINTS[:2].copy(), np.ones((2, 3)), np.ones((2, 3), int), np.ones(2), np.ones(2), np.ones(2), 8, 0.1,
    ),
    "fit_plane": (POINTS, np.array([[0, 1, 2]]), 0.1, 3),
    "follow_ribbon": (
        np.ones((2, 5, 5), np.float32), np.zeros((2, 5, 5), np.uint8), np.zeros((5, 5, 3), np.float32),
        np.zeros((5, 5), np.uint8), np.zeros((5, 5), np.float32), np.ones(3), np.ones(1),
    ),
    "follow_strand": (
        np.zeros((9, 9, 3), np.uint8), np.zeros((9, 9), bool), np.array([[1.0, 4.0], [5.0, 4.0]]), 2.0, 3.0,
    ),
    "FrameFacts": (np.ones((3, 3), bool),),
    "gaps_along_lines": (
        POINTS[[0, 1, 4, 5]], np.eye(4, 3), POINTS, np.array([0, 2, 6]), np.zeros(2, bool), np.ones(4), 0.01,
        np.ones((3, 2)), np.array([0, 3]), 1.0,
    ),
    "half_shell_spread": (np.zeros(6, int), POINTS[:, 0].copy(), np.zeros(3, int), 1),
    "lay_equal_chords": (POINTS, 0.01),
    "mask_parts": (np.ones((3, 3), bool), 4, np.zeros(1, int)),
    "MaskEdge": (np.ones((3, 3), bool), 4.0, 24.0),
    "medial_axis": (np.ones((3, 3), bool),),
    "nearest": (POINTS, POINTS, 0.1),
    "neighbor_table": (COORDS,),
    "neighborhood_sums": (POINTS[np.argsort(POINTS[:, 0])], POINTS[:2], 0.02),
    "paint_strokes": (
        np.zeros((3, 3, 4), np.uint8), np.ones((2, 3)), np.array([1, 2]), np.ones((2, 4), np.uint8), np.zeros(2, bool),
    ),
    "prune_spurs": (np.zeros((3, 3), np.uint8), *PIXELS, 1.0),
    "raised_pixels": (np.ones((3, 3), np.float32), np.zeros(3, np.float32), np.ones(3, np.float32), 1.5, 0.2, 0.4),
    "ribbon_scores": (np.zeros((3, 3, 3), np.float32), 2, np.ones(1), 1.0, 2.0, 3),
    "sample_gap": (np.ones((2, 11)), 0.1),
    "section_axes": (POINTS, POINTS, np.zeros(3)),
    "section_offsets": (POINTS, np.zeros(6), np.zeros(6, int), POINTS, POINTS, POINTS, np.ones(6)),
    "silhouette": (
        POINTS, np.eye(6, 3), np.eye(6, 3), np.zeros(6, int), np.ones((2, 2)), 1.0, np.ones(4), np.ones(6), 1,
    ),
    "skeleton_paths": (
        TABLE, COORDS.astype(float, order="C"), 1, np.ones(3), np.ones(3), np.array([0.2, 0.4]), np.zeros((0, 0), np.float32),
        np.zeros(2), 1.8, 9,
    ),
    "smooth_depth_beside": (
        np.array([[3, 3], [4, 3]]), np.ones(2), np.ones(2), np.zeros((6, 6), bool), np.ones((6, 6), np.float32), 1.0,
    ),
    "smooth_strand_depth": (np.ones(9), np.ones(9, bool), np.ones(9), 0.004, 600.0, 1.7),
    "solve_gap": (np.eye(4, 3), 0.0, 0.1, False),
    "strand_cuts": (POINTS, np.arange(6) * 0.01, 0.05, POINTS, 0.01, 0.02, 25.0, 2.5, np.full(6, 13.0)),
    "strand_places": (
        POINTS, np.arange(6) * 0.01, np.eye(6, 3), np.array([0, 2, 6]), np.array([0.01, 0.03]), np.ones((2, 2)), POINTS, 0.1,
        0.05,
    ),
    "strand_sides": (
        np.full((3, 2), 3.0), np.tile([0.0, 1.0], (3, 1)), np.ones(3), 0.01, np.ones((6, 6), np.float32),
        np.ones((6, 6, 3), np.uint8), np.zeros((6, 6), bool), np.zeros(1), np.ones(2), np.ones(1),
    ),
    "surface_ahead": (POINTS, POINTS, np.array([0, 5]), np.eye(2, 3), np.ones(2), np.ones(2), np.ones(2), 2),
    "surface_beside": (
        POINTS, np.array([0, 2, 6]), np.ones(4), 0.01, np.ones(2), np.ones((3, 3), bool), np.ones((3, 3), np.float32), 6,
    ),
    "surface_log_odds": (
        POINTS, np.ones((6, 2), int), np.ones(6), 0.1, POINTS, np.ones(6), np.ones(6), np.ones(4), np.ones(5),
    ),
    "thin_pixels": (COORDS[:4, 1:].copy(),),
    "thin_voxels": (TABLE,),
    "trace_branches": (TABLE,),
    "valley_depth": (np.zeros((3, 3), np.float32), np.ones((3, 3), bool), 1.0, 2.0, 8),
    "visits": (),
    "whittaker_smooth": (POINTS, np.tile(np.eye(3), (6, 1, 1)), 1.0, 2),
    "window_sum": (np.ones(3), np.zeros(3, int), 1),
}  # fmt: skip
KEYWORDS = {
    "axes_in_mask": {
        "touching_radii": 2.2, "own_radii": 1.5, "sunk_radii": 3.0, "central_part": 0.8, "smoothing_radii": 1.2,
        "max_strength": 1e8, "least_weight": 1e-6, "ring_overlap": 40, "path_weight": 0.01, "depth_weight": 0.06,
        "gap_weight": 0.3, "radius_tolerance": 0.3, "noise_radii": 0.15, "deviations": 3.0,
    },
    "depth_support": {"surface_radii": 0.85, "lying_radii": 1.5, "deviations": 3.0},
    "strand_places": {"steps": 3, "length_error": 0.02, "shift_tolerances": 2.5, "max_tip_cost": 25.0},
    "smooth_strand_depth": {"deviations": 3.0, "noise_radii": 0.15, "max_in_front": 0.1, "max_slope": 8.0},
    "follow_strand": {"step": 0.5, "min_extension": 2.0, "noise": 6.0},
    "follow_ribbon": {
        "step": 2.0, "color_scale": 8.0, "max_color_cost": 6.0, "color_cost": 0.5, "max_score": 3.0, "same_turn": 0.4,
    },
}  # fmt: skip
CONSTANT = {"visits"}
"""Kernels that look at a fixed number of elements, which they need not count."""
ARRAYS = {name: [i for i, value in enumerate(call) if isinstance(value, np.ndarray)] for name, call in CALLS.items()}
ELEMENTS = {"f": st.floats(-10, 10, width=32), "i": st.integers(-3, 9), "b": st.booleans(), "u": st.integers(0, 1)}
with_arrays = pytest.mark.parametrize("name", [name for name, places in ARRAYS.items() if places])


def call(name, changed=None):
    """Call a kernel, with other values of some of its arguments: place -> value."""
    return getattr(kernels, name)(*(dict(enumerate(CALLS[name])) | (changed or {})).values(), **KEYWORDS.get(name, {}))


def test_every_kernel_is_called():
    assert set(CALLS) == {name for name in vars(kernels._native) if not name.startswith("_")}


@pytest.mark.parametrize("name", CALLS)
def test_every_call_works_and_counts_the_elements_that_the_kernel_looks_at(name):
    counts = []
    for _ in range(2):
        kernels.visits()
        call(name)
        counts.append(kernels.visits())
    assert counts[0] == counts[1]
    assert counts[0] > 0 or name in CONSTANT


@with_arrays
def test_another_type_or_number_of_axes_is_a_type_error(name):
    for index in ARRAYS[name]:
        array = CALLS[name][index]
        for wrong in (array.tolist(), array.astype(np.complex128), array[..., None], None):
            with pytest.raises(TypeError, match=name):
                call(name, {index: wrong})


@with_arrays
@given(data=st.data())
def test_any_array_of_the_right_type_gives_a_result_or_an_error(name, data):
    """Other shapes, other values, none at all: what does not fit the other arguments is refused."""
    index = data.draw(st.sampled_from(ARRAYS[name]))
    array = CALLS[name][index]
    shape = npst.array_shapes(min_dims=array.ndim, max_dims=array.ndim, min_side=0, max_side=6)
    with suppress(TypeError, ValueError):
        call(name, {index: data.draw(npst.arrays(array.dtype, shape, elements=ELEMENTS[array.dtype.kind]))})


@with_arrays
def test_vectors_may_have_any_stride(name):
    for index in ARRAYS[name]:
        array = CALLS[name][index]
        if array.ndim > 1 or isinstance(getattr(kernels, name), type):
            continue
        results = (call(name, {index: np.repeat(array, 2)[::2]}), call(name))
        one, other = (result if isinstance(result, tuple) else (result,) for result in results)
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)
