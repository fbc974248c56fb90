"""The data objects: shapes checked when made, read-only after, and what they compute."""

from __future__ import annotations

import json

import numpy as np
import pytest
from builders.errors import refuses
from hypothesis import given
from hypothesis import strategies as st

from doo3d import Camera, Chain, Cloud, Detection, Frame
from doo3d.types import check_mask

CAMERA = Camera(500, 510, 32, 24, 64, 48)
DEPTH = np.full((48, 64), 0.5, np.float32)


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"fx": 0}, "fx=0"),
        ({"fy": -1}, "fy=-1"),
        ({"cx": float("nan")}, "cx=nan"),
        ({"fx": float("inf")}, "fx=inf"),
        ({"width": 0}, "0x48"),
        ({"height": -3}, "64x-3"),
    ],
)
def test_a_camera_that_cannot_be(changes, part):
    values = {"fx": 500, "fy": 500, "cx": 32, "cy": 24, "width": 64, "height": 48} | changes
    with refuses("intrinsics-invalid", part):
        Camera(**values)


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.05, 5)), min_size=1, max_size=20))
def test_unproject_undoes_project(points):
    points = np.array(points)
    back = CAMERA.unproject(CAMERA.project(points), points[:, 2])
    assert np.abs(back - points).max() < 1e-9


def test_behind_the_camera_there_are_no_pixels():
    assert np.isnan(CAMERA.project(np.array([[0.1, 0.2, 0.0], [0.1, 0.2, -1.0]]))).all()


@pytest.mark.parametrize(
    ("changes", "code", "parts"),
    [
        ({"depth": np.zeros((48, 64, 1))}, "depth-shape", ("(48, 64, 1)",)),
        ({"depth": np.zeros((0, 0))}, "depth-shape", ("(0, 0)",)),
        ({"depth": np.zeros((48, 64), np.uint16)}, "depth-type", ("uint16", "depth_scale")),
        ({"depth": np.zeros((24, 32))}, "intrinsics-size", ("32x24", "64x48")),
        ({"color": np.zeros((48, 64), np.uint8)}, "color-shape", ("(48, 64)",)),
        ({"color": np.zeros((48, 64, 4), np.uint8)}, "color-shape", ("(48, 64, 4)",)),
        ({"color": np.zeros((48, 64, 3))}, "color-shape", ("float64", "uint8")),
        ({"color": np.zeros((24, 32, 3), np.uint8)}, "color-size", ("32x24", "64x48")),
    ],
)
def test_a_frame_that_does_not_fit(changes, code, parts):
    with refuses(code, *parts):
        Frame(**({"color": None, "depth": DEPTH, "camera": CAMERA} | changes))


def test_depth_that_is_none_becomes_zero_and_the_given_array_stays():
    depth = DEPTH.astype(float)
    depth[0, :5] = [np.nan, np.inf, -np.inf, -1, 0]
    frame = Frame(None, depth, CAMERA)
    assert frame.depth.dtype == np.float32
    assert (frame.depth[0, :5] == 0).all()
    assert frame.depth[1, 1] == 0.5
    assert np.isnan(depth[0, 0])


def test_arrays_are_read_only_but_not_the_callers():
    color = np.zeros((48, 64, 3), np.uint8)
    frame = Frame(color, DEPTH, CAMERA)
    for array in (frame.color, frame.depth):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1
    color[0, 0] = 1


@pytest.mark.parametrize(
    ("values", "code", "parts"),
    [
        ({"points": np.zeros((5, 2))}, "points-shape", ("(5, 2)",)),
        ({"points": np.zeros(3)}, "points-shape", ("(3,)",)),
        ({"points": np.array([["a"] * 3])}, "points-shape", ("<U1",)),
        ({"points": np.zeros((5, 3)), "colors": np.zeros((4, 3), np.uint8)}, "colors-shape", ("(4, 3)", "(5, 3)")),
        ({"points": np.zeros((5, 3)), "colors": np.zeros((5, 3))}, "colors-shape", ("float64",)),
        ({"points": np.zeros((5, 3)), "viewpoint": np.zeros(2)}, "viewpoint-invalid", ()),
        ({"points": np.zeros((5, 3)), "viewpoint": np.array([0, 0, np.nan])}, "viewpoint-invalid", ("nan",)),
    ],
)
def test_a_cloud_that_does_not_fit(values, code, parts):
    with refuses(code, *parts):
        Cloud(**values)


def test_points_that_are_not_finite_go_with_their_colors():
    points = np.arange(12.0).reshape(4, 3)
    points[1, 2] = np.nan
    points[3, 0] = np.inf
    cloud = Cloud(points, np.arange(12, dtype=np.uint8).reshape(4, 3))
    assert cloud.points.tolist() == [[0, 1, 2], [6, 7, 8]]
    assert cloud.colors.tolist() == [[0, 1, 2], [6, 7, 8]]


@pytest.mark.parametrize(
    ("mask", "code", "parts"),
    [
        (np.zeros((3, 3), bool), "mask-shape", ("(3, 3)", "(48, 64)")),
        (np.zeros((48, 64)), "mask-type", ("float64",)),
        (np.zeros((48, 64, 1), bool), "mask-shape", ("(48, 64, 1)",)),
    ],
)
def test_a_mask_that_does_not_fit(mask, code, parts):
    with refuses(code, *parts):
        check_mask(mask, (48, 64))


def test_a_mask_of_integers():
    mask = np.zeros((48, 64), np.uint8)
    mask[1, 2] = 255
    assert np.argwhere(check_mask(mask, (48, 64))).tolist() == [[1, 2]]


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_chain(dimension):
    joints = np.zeros((5, dimension))
    joints[:, 0] = np.arange(5) * 0.01
    chain = Chain(joints, 0.01, 0.004)
    assert chain.length == pytest.approx(0.04)
    assert chain.radii.tolist() == [0.004] * 5
    assert chain.occluded.tolist() == [False] * 4
    assert chain.depth == (("seen",) * 4 if dimension == 3 else ())
    assert ("depth" in chain.to_dict()) == (dimension == 3)
    assert not chain.closed
    assert chain.nodes(9)[:, 0] == pytest.approx(np.linspace(0, 0.04, 9))
    assert chain.nodes(2).tolist() == joints[[0, -1]].tolist()
    assert chain.nodes(40).shape == (40, dimension)
    for count in (1, 0, -1):
        with refuses("value-out-of-bounds", f"({count})"):
            chain.nodes(count)


@pytest.mark.parametrize(
    ("changes", "code", "parts"),
    [
        ({"joints": np.zeros((1, 3))}, "chain-shape", ("(1, 3)",)),
        ({"joints": np.zeros((3, 4))}, "chain-shape", ("(3, 4)",)),
        ({"joints": np.array([[0, 0, 0], [0.01, 0, 0], [0.03, 0, 0]])}, "chain-spacing", ("0.01", "0.02")),
        ({"radii": np.zeros(2)}, "chain-shape", ("radii", "(2,)")),
        ({"occluded": np.zeros(3, bool)}, "chain-shape", ("occluded", "(3,)")),
        ({"depth_filled": np.zeros(3, bool)}, "chain-shape", ("depth_filled", "(3,)")),
    ],
)
def test_a_chain_that_cannot_be(changes, code, parts):
    joints = np.array([[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0]])
    with refuses(code, *parts):
        Chain(**({"joints": joints, "segment_length": 0.01} | changes))


def test_depth_of_occluded_segments_counts_as_filled():
    joints = np.array([[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [0.03, 0, 0]])
    chain = Chain(joints, 0.01, occluded=np.array([True, False, False]), depth_filled=np.array([False, True, False]))
    assert chain.depth_filled.tolist() == [True, True, False]
    assert chain.to_dict()["depth"] == ["filled", "filled", "seen"]
    assert Chain(joints, 0.01, occluded=np.array([True, False, False])).depth == ("filled", "seen", "seen")


def test_a_detection_as_plain_data():
    chain = Chain(np.array([[0, 0, 1], [0.01, 0, 1.0]]), 0.01, 0.004, closed=False)
    plain = Detection((chain,), frame="7", timestamp=1.5, seconds={"fit": 0.1}, notes=("x",)).to_dict()
    assert json.loads(json.dumps(plain)) == plain
    assert plain["coordinates"] == "camera optical frame: x right, y down, z forward"
    assert plain["units"] == "m"
    assert plain["chains"][0]["joints"] == [[0, 0, 1], [0.01, 0, 1]]
    flat = Detection((Chain(np.array([[0, 0], [3, 4.0]]), 5.0, 2.0),), mode="2d", coordinates="image").to_dict()
    assert (flat["mode"], flat["units"]) == ("2d", "px")
