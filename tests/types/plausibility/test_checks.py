"""Checks for input that is plausible but wrong: each wrong value is found, with its factor or shift, and right ones are not."""

from __future__ import annotations

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from builders.paths import SAMPLES

from doo3d.inputs import open_capture
from doo3d.types import Camera, Chain, Cloud, Frame, Image
from doo3d.types.plausibility import frame_notes, topic_of
from doo3d.types.plausibility.cable import radius_notes
from doo3d.types.plausibility.camera import baseline_notes, camera_notes
from doo3d.types.plausibility.depth_unit import depth_samples, depth_step
from doo3d.types.plausibility.lengths import ChainLength, is_whole, length_notes
from doo3d.types.plausibility.registration import ColorShift, color_shift, registration_notes

CAPTURES = ("crossing", "helix", "occluder", "straight", "two_cables")
D435 = Camera(922.7, 922.7, 635.4, 363.0, 1280, 720)
AZURE_WIDE = Camera(252.0, 252.0, 256.0, 256.0, 512, 512)


def straight_chain(distance: float, radius: float, length: float) -> Chain:
    return Chain(np.linspace([-length / 2, 0, distance], [length / 2, 0, distance], 41), length / 40, radius)


@pytest.fixture(scope="module")
def frames() -> dict[str, Frame]:
    return {name: open_capture(SAMPLES / name).frames[0].load().data for name in CAPTURES}


@pytest.mark.parametrize("name", CAPTURES)
@pytest.mark.parametrize(
    ("scale", "words"),
    [
        (1.0, None),
        (5.0, "multiples of 5 mm.*a factor of 5 "),
        (10.0, "multiples of 10 mm.*a factor of 10 "),
        (1000.0, "multiples of 1000 mm.*a factor of 1000 "),
        (0.2, "steps of 0.2 mm.*5000 units per metre.*smaller by a factor of 5;"),
        (0.1, "steps of 0.1 mm.*10000 units per metre.*smaller by a factor of 10;"),
        (0.001, "too small.*a factor of about 1000: "),
    ],
)
def test_the_unit_of_depth(frames, name, scale, words):
    """With the cable found, and with nothing found."""
    frame = replace(frames[name], depth=frames[name].depth * np.float32(scale))
    for chains in ((straight_chain(0.7 * scale, 0.004 * scale, 1.0 * scale),), ()):
        notes = frame_notes(frame, chains)
        assert [topic_of(note) for note in notes] == ["depth unit"] * (words is not None)
        if words is not None:
            assert re.search(words, notes[0]), notes[0]


def test_the_step_between_depths():
    depth = np.arange(500, 1500, dtype=np.uint16).reshape(25, 40)
    for units, step in ((1000, 1.0), (200, 5.0), (100, 10.0), (5000, 0.2), (10000, 0.1)):
        assert depth_step(depth_samples((depth / units).astype(np.float32))) == pytest.approx(step)
    rng = np.random.default_rng(0)
    assert depth_step(depth_samples(rng.uniform(0.5, 1, (25, 40)))) is None  # no grid
    assert depth_step(depth_samples(np.full((25, 40), 0.7))) is None  # too few different values
    assert depth_step(depth_samples(np.zeros((25, 40)))) is None


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        (D435, None),
        (AZURE_WIDE, None),
        (Camera(530.0, 530.0, 640.0, 360.0, 1280, 720), None),  # ZED, 100 degrees
        (Camera(922.7, 922.7, 363.0, 635.4, 720, 1280), None),  # held upright
        (replace(D435, fx=400.0, fy=400.0), "400 px for an image 1280 px wide is a field of view of 116 degrees"),
        (replace(D435, fx=400.0), "400 px|factor of 2.31"),
        (replace(D435, fx=30000.0, fy=30000.0), "narrower"),
        (replace(D435, fx=615.0), "fx 615 and fy 923 px differ by a factor of 1.50"),
        (replace(D435, cx=157.0, cy=117.0), r"principal point \(157, 117\)"),
    ],
)
def test_cameras(camera, words):
    notes = camera_notes(camera)
    assert len(notes) == (words is not None)
    assert words is None or re.search(words, notes[0]), notes


def test_baselines():
    transform = np.eye(4)
    transform[0, 3] = 0.015
    assert baseline_notes(transform) == []
    transform[0, 3] = 15.0
    (note,) = baseline_notes(transform)
    assert "15 m" in note
    assert "millimetres" in note


@pytest.mark.parametrize(
    ("radius", "length", "distance", "words"),
    [
        (0.0006, 0.4, 0.4, None),  # a wire
        (0.0144, 1.5, 1.0, None),  # a hose
        (0.038, 50.0, None, None),  # an overhead wire, scanned
        (float("nan"), 1.0, 0.7, None),
        (0.0, 1.0, 0.7, None),  # unknown too: points exactly on a line
        (
            0.1,
            0.24,
            0.9,
            "100 mm, 0.9 m from the sensor, is thicker than any cable, as if lengths were 10 times too large",
        ),
        (4.0, 1000.0, None, "1000 times too large"),
        (0.022, 5.4, 3.5, "thick for a cable, as if lengths were 5 times too large"),
        (0.0004, 0.1, None, "thinner than any cable, as if lengths were 10 times too small"),
    ],
)
def test_radii(radius, length, distance, words):
    notes = radius_notes((straight_chain(1.0, radius, length),), distance)
    assert len(notes) == (words is not None)
    assert words is None or words in notes[0]


def test_clouds_and_images():
    assert frame_notes(Image(np.zeros((4, 4, 3), np.uint8)), ()) == ()
    cloud = Cloud(np.eye(3), viewpoint=np.zeros(3), coordinates="camera")
    assert frame_notes(cloud, (straight_chain(0.7, 0.004, 1.0),)) == ()
    assert [topic_of(note) for note in frame_notes(cloud, (straight_chain(0.05, 0.004, 0.1),))] == ["depth unit"]
    assert frame_notes(Cloud(np.eye(3)), (straight_chain(0.05, 0.004, 0.5),)) == ()  # nobody knows where the sensor was


@pytest.mark.parametrize("name", CAPTURES)
@pytest.mark.parametrize(("right", "down"), [(0, 0), (40, 0), (-40, 12), (0, -30)])
def test_shifted_color(frames, name, right, down):
    frame = frames[name]
    found = color_shift(replace(frame, color=np.roll(frame.color, (down, right), (0, 1))))
    assert found is not None
    if right == down == 0:
        assert found == ColorShift(0, 0, 1.0)
        assert registration_notes([found], 1280) == []
    else:
        assert np.hypot(found.right - right, found.down - down) < 4
        assert found.gain > 1.35


def wavy_wire(wider: int, hidden: int) -> Frame:
    """A wire of 9 px in front of a wall; its depth is wider by some px on each side, and missing for some px to its left."""
    line = np.zeros((720, 1280), np.uint8)
    along = np.linspace(0, 1, 300)
    cv2.polylines(line, [np.column_stack((200 + 900 * along, 360 + 150 * np.sin(5 * along))).astype(np.int32)], False, 1, 9)
    wide = cv2.dilate(line, np.ones((2 * wider + 1, 2 * wider + 1), np.uint8))
    shadow = cv2.dilate(wide, np.ones((1, hidden + 1), np.uint8), anchor=(0, 0)) if hidden else wide
    depth = np.where(wide > 0, 0.9, np.where(shadow > 0, 0, 1.4)).astype(np.float32)
    return Frame(np.where(line[..., None] > 0, (200, 40, 40), 120).astype(np.uint8), depth, Camera(920, 920, 640, 360, 1280, 720))


@pytest.mark.parametrize(("wider", "hidden"), [(0, 0), (6, 0), (8, 0), (10, 0), (6, 12), (10, 12)])
def test_depth_wider_than_the_object_is_no_shift(wider, hidden):
    assert color_shift(wavy_wire(wider, hidden)) == ColorShift(0, 0, 1.0)


@pytest.mark.parametrize(("right", "down"), [(24, 0), (0, 30), (-30, -20)])
def test_a_thin_wire_that_is_shifted(right, down):
    frame = wavy_wire(2, 0)
    found = color_shift(replace(frame, color=np.roll(frame.color, (down, right), (0, 1))))
    assert np.hypot(found.right - right, found.down - down) < 4


def test_what_says_nothing_about_registration(frames):
    frame = frames["crossing"]
    assert color_shift(replace(frame, color=None)) is None
    assert color_shift(replace(frame, color=np.full_like(frame.color, 90))) is None
    assert color_shift(replace(frame, depth=np.full_like(frame.depth, 0.7))) is None
    assert color_shift(replace(frame, depth=np.zeros_like(frame.depth))) is None
    tiny = Frame(np.zeros((2, 3, 3), np.uint8), np.ones((2, 3)), Camera(3, 3, 1, 1, 3, 2))
    assert color_shift(tiny) is None


def test_most_frames_have_to_agree():
    there, fits = ColorShift(40, 0, 3.0), ColorShift(0, 0, 1.0)
    (note,) = registration_notes([there, ColorShift(38, -1, 2.0), fits], 1280)
    assert "39 px to the right" in note
    assert "in 2 of 3 frames" in note
    assert registration_notes([there, fits], 1280) == []
    assert registration_notes([there, ColorShift(-40, 0, 3.0), ColorShift(0, 40, 3.0)], 1280) == []
    assert registration_notes([], 1280) == []


def test_lengths_through_a_capture():
    steady = [ChainLength(0, f"f{i}", 1.0 + 0.03 * (i % 3)) for i in range(9)]
    assert length_notes(steady, "m") == []
    broken = [ChainLength(1, f"f{i}", 0.5 if i in (4, 5) else 1.0) for i in range(9)]
    (note,) = length_notes([*steady, *broken], "m")
    assert note.startswith(
        "check the length: chain 1 is 0.50 m long in frame f4 and 1.00 m in frame f0 (median 1.00 m of 9 frames)"
    )
    assert length_notes(broken[3:6], "m") == []  # too few frames


def test_a_chain_that_leaves_the_view_may_change_its_length():
    frame = Frame(None, np.full((720, 1280), 0.7), D435)
    assert is_whole(straight_chain(0.7, 0.004, 0.5), frame)
    assert not is_whole(straight_chain(0.7, 0.004, 0.97), frame)
    hidden = straight_chain(0.7, 0.004, 0.5)
    assert not is_whole(replace(hidden, occluded=np.arange(40) < 20), frame)
    assert is_whole(straight_chain(0.7, 0.004, 5.0), None)


@pytest.mark.parametrize(
    ("factor", "unit"), [(4, "depth_scale=4000"), (5, "depth_scale=5000"), (8, "depth_scale=8000"), (10, "depth_scale=10000")]
)
def test_a_cable_in_the_units_of_another_camera(factor, unit):
    """Values of 0.25, 0.2, 0.125 and 0.1 mm that are read as millimetres: by the chain, and by the depth if none is found."""
    depth = factor * np.random.default_rng(0).uniform(0.55, 0.65, (120, 160))
    frame = Frame(None, np.rint(1000 * depth) / 1000, Camera(120.0, 120.0, 79.5, 59.5, 160, 120))
    (note,) = frame_notes(frame, (straight_chain(0.6 * factor, 0.004 * factor, 0.9 * factor),))
    assert note.startswith("check the radius")
    assert unit in note
    empty = frame_notes(frame, ())
    assert [unit in note for note in empty] == [True] * (0.6 * factor > 3.5)
