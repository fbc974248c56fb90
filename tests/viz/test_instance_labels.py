"""Instance labels: which chain each pixel of the image belongs to."""

from dataclasses import replace

import cv2
import numpy as np
from builders.chains import CAMERA, along
from builders.errors import refuses
from builders.paths import SAMPLES
from builders.photos import HEIGHT, WIDTH, cross, labelled, painted, strand

import doo3d
from doo3d.types import Cloud, Crossing, Detection, SegmentRef, View

SHAPE = (HEIGHT, WIDTH)


def photo(chains, mask=None, crossings=(), layers=None, **values):
    mask = labelled(chains) > 0 if mask is None else mask
    view = View.of(mask, SHAPE, None, layers)
    return Detection(tuple(chains), "2d", "image", crossings=tuple(crossings), view=view, **values)


def over(upper, lower, at=(100.0, 75.0), confidence=1.0):
    return Crossing(SegmentRef(*upper), SegmentRef(*lower), np.array(at), confidence)


def test_at_a_crossing_the_upper_strand_has_the_pixels():
    below, above = cross()
    labels = photo([below, above], crossings=[over((1, 11), (0, 15))]).instance_labels()
    assert labels.dtype == np.uint16
    np.testing.assert_array_equal(labels, labelled([below, above]))
    turned = photo([above, below], crossings=[over((0, 11), (1, 15))]).instance_labels()
    np.testing.assert_array_equal(np.array([0, 2, 1])[labels], turned)


def test_of_three_strands_over_each_other_the_uppermost_is_on_top_in_any_order():
    chains = [strand((20, 75), (180, 75)), strand((100, 15), (100, 135)), strand((50, 25), (150, 125))]
    crossings = [over((1, 11), (0, 15)), over((2, 14), (1, 11)), over((2, 14), (0, 15))]
    for order in (crossings, crossings[::-1]):
        np.testing.assert_array_equal(photo(chains, crossings=order).instance_labels(), labelled(chains))


def test_pixels_far_from_any_chain_and_those_of_doubtful_ones_are_of_none():
    chains = [strand((20, 30), (180, 30)), strand((20, 60), (180, 60)), strand((20, 90), (180, 90))]
    wanted, mask = labelled(chains), labelled(chains) > 0
    mask[120:130] = True
    found = photo([replace(chain, confidence=c) for chain, c in zip(chains, (0.9, 0.1, 0.8), strict=True)], mask)
    np.testing.assert_array_equal(found.instance_labels(), wanted)
    left = found.confident(0.5)
    assert len(left.chains) == 2
    np.testing.assert_array_equal(left.instance_labels(), np.array([0, 1, 0, 2])[wanted])


def test_a_torn_mask_is_mended_along_what_is_seen_of_a_photographed_strand():
    chain = strand((20, 75), (180, 75), radius=6.0)
    torn = labelled([chain]) > 0
    torn[70:74, 60:80] = torn[68:83, 120:140] = False
    hidden = (np.arange(len(chain.occluded)) > 19) & (np.arange(len(chain.occluded)) < 25)
    labels = photo([replace(chain, occluded=hidden)], torn).instance_labels()
    assert labels[72, 70] == 1
    assert labels[75, 130] == 0
    assert photo([chain], torn).instance_labels()[75, 130] == 1


def test_a_pixel_of_a_known_color_belongs_to_the_chain_of_its_color():
    chains = [strand((20, 70), (180, 70)), strand((20, 78), (180, 78)), strand((20, 120), (180, 120))]
    layers = np.zeros(SHAPE, np.uint8)
    layers[60:76], layers[76:90] = 7, 9  # the border is 2 px below the middle
    labels = photo(chains, layers=layers).instance_labels()
    assert labels[75, 100] == 1
    assert photo(chains).instance_labels()[75, 100] == 2
    assert (labels[labelled(chains) == 3] == 3).all()
    layers[120] = 7  # its chain is far from there
    assert (photo(chains, layers=layers).instance_labels()[120, 25:175] == 3).all()
    below, above = cross()
    layers[:] = np.where(labelled([above, below]) == 1, 7, 9)  # the colors see the other one on top
    labels = photo([below, above], layers=layers, crossings=[over((1, 11), (0, 15))]).instance_labels()
    assert labels[75, 98] == 1


def test_chains_in_space_are_labelled_in_the_view_of_the_camera():
    near, far = along(np.array([[-0.1, 0.01, 0.5], [0.1, -0.01, 0.5]])), along(np.array([[0, -0.1, 0.6], [0, 0.15, 0.6]]))
    mask = np.zeros((480, 640), np.uint8)
    for chain in (far, near):
        points = np.rint(16 * CAMERA.project(chain.joints)).astype(np.int32)
        cv2.polylines(mask, [points], False, 1, round(2 * 600 * 0.004 / chain.joints[0, 2]), cv2.LINE_8, 4)
    crossing = Crossing(SegmentRef(0, 9), SegmentRef(1, 9), np.array((0.0, 0.0, 0.5)))
    found = Detection((near, far), crossings=(crossing,), view=View.of(mask > 0, mask.shape, CAMERA))
    labels = found.instance_labels()
    assert ((labels > 0) == (mask > 0)).all()
    assert (labels[np.hypot(*(np.indices(mask.shape) - np.array([[[239.5]], [[319.5]]]))) < 4] == 1).all()
    assert labels[380, 319] == 2
    base = np.array([[0, 0, 1, 0.3], [-1, 0, 0, 0], [0, -1, 0, 1.0], [0, 0, 0, 1]])
    np.testing.assert_array_equal(found.transformed(base).instance_labels(), labels)
    behind = replace(near, joints=near.joints - (0, 0, 1.0))
    assert (replace(found, chains=(behind, far), crossings=()).instance_labels() != 1).all()


def test_detect_keeps_the_view_and_large_photographs_have_labels_of_their_size():
    image = cv2.resize(painted(labelled(cross())), (2401, 1799), interpolation=cv2.INTER_NEAREST)
    truth = cv2.resize(labelled(cross()), (2401, 1799), interpolation=cv2.INTER_NEAREST)
    found = doo3d.detect(image, "image", truth > 0)
    labels = found.instance_labels()
    assert labels.shape == truth.shape
    assert found.view.scale > 1
    assert np.mean((labels > 0) == (truth > 0)) > 0.995
    assert found == replace(found, view=None)
    assert found.to_dict()["image"] == {"width": 2401, "height": 1799}


def test_without_an_image_there_is_an_error_that_says_so():
    line = np.column_stack((np.linspace(0, 0.3, 900), np.zeros(900), np.full(900, 0.5)))
    rng = np.random.default_rng(0)
    cloud = doo3d.detect(Cloud(line + rng.normal(0, 0.002, line.shape), segmented=True))
    with refuses("instances-missing", "a cloud has none"):
        cloud.instance_labels()
    found = photo(cross())
    with refuses("instances-missing", "instances=True"):
        replace(found, view=View.from_dict(found.view.to_dict())).instance_labels()


def test_the_view_of_a_frame_is_as_small_as_its_detection():
    loaded = doo3d.open_capture(SAMPLES / "crossing")[0].load()
    found = doo3d.detect(loaded.data, {"merge.chains": 1})
    assert len(found.view.to_dict(with_mask=True)["mask"]) < 10_000
    again = View.from_dict(found.view.to_dict(with_mask=True))
    np.testing.assert_array_equal(again.mask, found.view.mask)
    assert again.camera == loaded.data.camera


def test_visibility_in_words():
    chain = along(np.array([[-0.03, 0, 0.5], [0.031, 0, 0.5]]))
    flags = np.zeros((2, 6), dtype=bool)
    flags[0, 1:3] = flags[1, 4:] = True
    seen = Detection((replace(chain, occluded=flags[0], depth_filled=flags[1]),), view=View(640, 480, CAMERA))
    assert seen.visibility(0) == ("seen", "seen", "hidden", "seen", "seen", "no depth", "no depth")
    narrow = replace(seen, view=View(340, 480, CAMERA))
    assert narrow.visibility(0)[-2:] == ("outside the view",) * 2
    assert replace(seen, view=None).visibility(0) == seen.visibility(0)
    flat = strand((20, 75), (60, 75))
    hidden = np.ones(8, dtype=bool)
    assert set(Detection((replace(flat, occluded=hidden, depth_filled=hidden),), "2d", "image").visibility(0)) == {"hidden"}
    with refuses("value-out-of-bounds", "1 chains"):
        seen.visibility(1)


def test_a_ring_meets_itself_at_its_first_joint():
    turn = np.linspace(0, 2 * np.pi, 41)
    joints = np.column_stack((100 + 50 * np.cos(turn), 75 + 50 * np.sin(turn)))
    joints[-1] = joints[0]
    ring = doo3d.Chain(joints, float(np.linalg.norm(joints[1] - joints[0])), 4.0, closed=True, occluded=np.arange(40) > 38)
    assert photo([ring]).visibility(0)[::40] == ("seen", "seen")
    across = strand((110, 75), (190, 75))
    crossing = over((0, 0), (1, 7), (150.0, 75.0))
    labels = photo([replace(ring, occluded=np.zeros(40, dtype=bool)), across], crossings=[crossing]).instance_labels()
    assert (labels[68:82, 148:152] == 1).all()
