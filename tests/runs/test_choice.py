"""Chains chosen by points and a box: which are kept, with what belongs to them, and sentences about what cannot be."""

from dataclasses import replace

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, depth_of, frame_of, line
from builders.errors import refuses

import doo3d

# 9 px wide and half of that in the image; the last crosses above the others
UPPER, LOWER = line((-0.15, -0.05, 0.5), (0.15, -0.05, 0.5)), line((-0.15, 0.05, 0.5), (0.15, 0.05, 0.5))
ACROSS = line((0.05, -0.1, 0.47), (0.05, 0.1, 0.47))
AXES = {"upper": UPPER, "lower": LOWER, "across": ACROSS}
FRAME, MASK = frame_of(*AXES.values())
_, WHICH = depth_of(list(AXES.values()), [0.005] * 3)
X, Y = 200, (150, 330)  # a pixel on the left of the two, which are 180 px apart
CROSSING = 415.7


def found(detection):
    """The names of the chains of a detection, by their direction and height."""
    joints = [chain.joints for chain in detection.in_camera().chains]
    return {"across" if np.ptp(each[:, 1]) > 0.1 else "upper" if each[:, 1].mean() < 0 else "lower" for each in joints}


def chosen(**given):
    return doo3d.detect(FRAME, mask=MASK, **given)


@pytest.mark.parametrize(
    ("given", "names"),
    [
        ({"points": [(X, Y[0], True)]}, {"upper"}),
        ({"points": [(X, Y[0])]}, {"upper"}),
        ({"points": f"{X},{Y[0]}"}, {"upper"}),
        ({"points": np.array([(X, Y[0], 1), (X, Y[1], 1)])}, {"upper", "lower"}),  # a click for each cable
        ({"points": [(X, Y[0], True), (X + 100, Y[0], True)]}, {"upper"}),  # two for one
        ({"points": [(X, Y[0], False)]}, {"lower", "across"}),
        ({"points": f" -{X},{Y[0]}; -{X},{Y[1]}"}, {"across"}),
        ({"points": [(5, 5, False)]}, {"upper", "lower", "across"}),
        ({"points": [(X, Y[0], True), (X, Y[1], False)]}, {"upper"}),
        ({"points": [(CROSSING, 240, True)]}, {"across"}),
        ({"points": [(X, Y[0] - 11.5, True)]}, {"upper"}),  # beside it, by less than 3.2 px
        ({"box": (0, 100, 640, 200)}, {"upper"}),  # of the one across a third is inside
        ({"box": "640,400,400,-50"}, {"across"}),  # two corners in any order; of the others less than half is inside
        ({"points": [(X, Y[0], False)], "box": (0, 0, 640, 479)}, {"lower", "across"}),
        ({"points": [], "box": None}, {"upper", "lower", "across"}),
    ],
)
def test_the_chains_that_are_kept(given, names):
    assert found(chosen(**given)) == names


def test_what_belongs_to_a_chain_is_kept_with_it():
    everything = chosen()
    assert len(everything.crossings) == 2
    kept = chosen(points=[(X, Y[0], True), (CROSSING, 240, True)])
    (crossing,) = kept.crossings
    names = ["across" if np.ptp(chain.joints[:, 1]) > 0.1 else "upper" for chain in kept.chains]
    assert (names[crossing.upper.chain], names[crossing.lower.chain]) == ("across", "upper")
    labels = kept.instance_labels()
    for k, name in enumerate(names):
        shown = WHICH == list(AXES).index(name)
        assert np.mean((labels == k + 1)[shown]) > 0.95
    assert not labels[WHICH == 1].any() or np.mean(labels[WHICH == 1] > 0) < 0.01


def test_a_pose_does_not_move_the_pixels():
    moved = chosen(points=[(X, Y[0], True)], pose=[0.4, 0, 0.7, 1, 0, 0, 0])
    assert (found(moved), moved.coordinates) == ({"upper"}, "world")


def test_a_chain_that_is_pointed_at_is_shown_however_low_its_confidence_is():
    frame, _ = frame_of(*AXES.values(), table=0.56)
    config = {"segment.method": "plane", "output.min_confidence": 1.0}
    plain = doo3d.detect(frame, config)
    assert not plain.chains
    one = doo3d.detect(frame, config, points=[(X, Y[0], True)])
    assert (found(one), one.doubtful) == ({"upper"}, ())
    assert found(replace(plain, chains=plain.doubtful)) == {"across"}  # the most probable one
    without = doo3d.detect(frame, config, points=[(CROSSING, 240, False)])
    assert (without.chains, without.doubtful) == ((), ())


def test_a_branched_object_is_kept_whole():
    fork = [line((0, 0, 0.5), (0.1 * np.cos(a), 0.1 * np.sin(a), 0.5)) for a in np.radians((0, 120, 240))]
    frame, mask = frame_of(*fork, line((-0.15, -0.12, 0.45), (0.15, -0.12, 0.45)))
    plain = doo3d.detect(frame, "harness", mask)
    assert [len(item.chains) for item in plain.objects] == [1, 3]
    kept = doo3d.detect(frame, "harness", mask, points=[(420, 240, True)])
    assert (len(kept.chains), len(kept.junctions), [item.chains for item in kept.objects]) == (3, 1, [(0, 1, 2)])
    assert not doo3d.detect(frame, "harness", mask, points=[(420, 240, False)]).junctions


def test_photographs():
    color = np.full((*WHICH.shape, 3), 160, np.uint8)
    color[WHICH >= 0] = (200, 40, 40)
    kept = doo3d.detect(color, "image", mask=WHICH >= 0, points=[(X, Y[1], True)])
    assert [round(float(chain.joints[:, 1].mean())) for chain in kept.chains] == [Y[1]]


@pytest.mark.parametrize(
    ("given", "code", "parts"),
    [
        ({"points": [(X, 200, True)]}, "place-missed", ("points=200,200", "the nearest is 41 px away")),
        ({"points": [(X, Y[0], True), (5, 5, True)]}, "place-missed", ("5,5",)),
        ({"points": [(X, Y[0], True)], "box": (400, 0, 639, 479)}, "place-missed", (f"{X},{Y[0]}", "box")),
        ({"points": [(640, 5, True)]}, "place-outside", ("640,5", "640 x 480")),
        ({"points": "3,-1"}, "place-outside", ("3,-1",)),
        ({"box": (-9, -9, -2, 300)}, "place-outside", ("box -9,-9,-2,300",)),
        ({"points": "1,2;x,3"}, "place-invalid", ("'x,3'",)),
        ({"points": "1,2;"}, "place-invalid", ("''",)),
        ({"points": "-1,2,3"}, "place-invalid", ("'-1,2,3'",)),
        ({"points": "nan,3"}, "place-invalid", ("'nan,3'",)),
        ({"points": [(1, 2, -1)]}, "place-invalid", ("points[0]", "-1")),
        ({"points": [(1, 2), (3,)]}, "place-invalid", ("points[1]",)),
        ({"box": "1,2,3"}, "place-invalid", ("'1,2,3'",)),
        ({"box": (1, 2, 3)}, "place-invalid", ("box",)),
    ],
)
def test_what_cannot_be(given, code, parts):
    with refuses(code, *parts):
        chosen(**given)


def test_clouds_have_no_pixels():
    points = CAMERA.unproject(np.argwhere(MASK)[:, ::-1], FRAME.depth[MASK])
    with refuses("place-needs-image", "cloud"):
        doo3d.detect(doo3d.Cloud(points), points=[(X, Y[0], True)])


def test_an_empty_box_gives_no_chains_and_a_note():
    empty = chosen(box=(0, 0, 20, 20))
    assert empty.chains == ()
    assert "0,0,20,20" in empty.notes[-1]
