"""Where the background of a frame contradicts an object that is expected before it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from doo3d.track.background import VIEW_PIXELS, BackgroundView
from doo3d.types import Camera, Frame

CAMERA = Camera(500.0, 500.0, 320.0, 240.0, 640, 480)
TABLE, BOX, RADIUS = 0.8, 0.5, 0.004


def view():
    """A cable across the middle of a table, with a box to the left, and no depth to the right."""
    depth, mask = np.full((480, 640), TABLE, dtype=np.float32), np.zeros((480, 640), dtype=bool)
    depth[300:, :200], depth[300:, 440:] = BOX, 0.0
    mask[236:244] = True
    return BackgroundView.of(Frame(None, depth, CAMERA), mask)


def joint(u, v, z):
    return CAMERA.unproject(np.array([[u, v]], dtype=float), np.array([z]))[0]


PLACES = {
    "over the bare table": (320, 120, 0.7, True),
    "on the bare table": (320, 120, TABLE, True),
    "over the bare table, below": (320, 400, 0.7, True),
    "in the table": (320, 120, TABLE + 0.03, False),
    "on the object": (320, 240, TABLE, False),
    "beside the object": (320, 252, TABLE, False),
    "before the box": (100, 400, 0.45, True),
    "behind the box": (100, 400, 0.7, False),
    "beside the box": (205, 400, 0.7, False),
    "without depth": (540, 400, 0.7, False),
    "beside what is without depth": (436, 400, 0.7, False),
    "left of the image": (-20, 120, 0.7, False),
    "below the image": (320, 500, 0.7, False),
    "behind the camera": (320, 120, -0.7, False),
}


@pytest.mark.parametrize("place", PLACES)
def test_a_joint_before_a_background_in_full_view_is_contradicted(place):
    *where, expected = PLACES[place]
    for radius in (RADIUS, np.nan):
        assert view().contradicts(np.array([joint(*where)]), radius).tolist() == [expected]


def test_a_view_is_small_and_contradicts_as_before_when_it_was_written_and_read():
    made = view()
    read = BackgroundView.from_dict(json.loads(json.dumps(made.to_dict())))
    assert max(read.inverse.shape) <= VIEW_PIXELS
    joints = np.array([joint(*where) for *where, _ in PLACES.values()])
    assert read.contradicts(joints, RADIUS).tolist() == [expected for *_, expected in PLACES.values()]
    np.testing.assert_array_equal(read.inverse, made.inverse)


def test_without_a_mask_the_object_is_background():
    made = BackgroundView.of(Frame(None, np.full((480, 640), TABLE, dtype=np.float32), CAMERA), None)
    assert made.contradicts(np.array([joint(320, 240, TABLE)]), RADIUS).all()
