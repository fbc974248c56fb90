"""Keeping what surely is the object, and what is said when it cannot be."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.drawn_masks import CAMERA, depth_of, frame_of, surface, wave
from builders.errors import refuses
from builders.paths import SAMPLES
from scipy.ndimage import binary_fill_holes, gaussian_filter, label
from scipy.spatial import cKDTree

from doo3d.config import HsvRange, SegmentConfig
from doo3d.stages.segment import depth_filter, depth_inpainting, segment, segment_extended
from doo3d.stages.segment.depth_filter import depth_noise
from doo3d.stages.segment.mask_cleanup import remove_small_components
from doo3d.stages.segment.point_filter import far_outliers
from doo3d.stages.segment.segment import RIDGE_NOTE
from doo3d.types import Cloud, Foreground, Frame, Image

RADIUS = 0.005
CONFIG = SegmentConfig()
DEPTH, WHICH = depth_of([wave()], [RADIUS])
SEEN = WHICH >= 0
BLUE = SegmentConfig(method="hsv", ranges=(HsvRange(low=(110, 100, 100), high=(130, 255, 255)),))


def foreground_of(data, config, mask=None) -> Foreground:
    return segment(data, config, mask).foreground


def frame(depth=DEPTH, color=None):
    return Frame(color, np.asarray(depth, dtype=np.float32), CAMERA)


def painted(mask):
    """A grey image in which the mask is blue."""
    color = np.full((480, 640, 3), 120, np.uint8)
    color[mask] = (0, 0, 250)
    return color


def test_points_lie_where_they_were_seen():
    found = foreground_of(frame(), CONFIG, SEEN)
    np.testing.assert_allclose(found.points[:, 2], DEPTH[found.pixels[:, 1], found.pixels[:, 0]], rtol=1e-6)
    np.testing.assert_allclose(CAMERA.project(found.points), found.pixels, atol=1e-4)
    away = cKDTree(wave()).query(found.points)[0]
    np.testing.assert_allclose(away, RADIUS, atol=0.0005)
    np.testing.assert_array_equal(found.mask, SEEN)
    assert SEEN[found.pixels[:, 1], found.pixels[:, 0]].all()
    assert len(found.points) > 0.9 * SEEN.sum()
    assert found.viewpoint.tolist() == [0, 0, 0]
    assert found.notes == ()


def test_filtered_points_have_less_noise():
    noise = 0.001 * np.random.default_rng(0).normal(size=DEPTH.shape)
    flat = np.where(SEEN, 0.5 + noise, 0)
    found = foreground_of(frame(flat), SegmentConfig(outlier_slope=0.01), SEEN)
    assert np.std(found.filtered[:, 2]) < 0.5 * np.std(found.points[:, 2])


@pytest.mark.parametrize("given", [True, False])
def test_flying_points_go(given):
    """Readings between the cable and what is behind it, along its edges."""
    random = np.random.default_rng(0)
    inner = np.zeros_like(SEEN)
    inner[1:-1, 1:-1] = SEEN[1:-1, 1:-1] & SEEN[:-2, 1:-1] & SEEN[2:, 1:-1] & SEEN[1:-1, :-2] & SEEN[1:-1, 2:]
    flying = SEEN & ~inner & (random.random(SEEN.shape) < 0.3)
    depth = np.where(flying, random.uniform(0.55, 0.9, DEPTH.shape), DEPTH)
    found = foreground_of(frame(depth), SegmentConfig(method="everything"), SEEN if given else None)
    assert cKDTree(wave()).query(found.points)[0].max() < 2 * RADIUS
    assert len(found.points) > 0.7 * SEEN.sum()


def test_noise_is_no_flying_point(monkeypatch):
    """Far away neighbours differ by more, and of a thin cable there are few: both keep their readings."""
    noisy = np.where(SEEN, DEPTH + 0.006 * np.random.default_rng(0).normal(size=DEPTH.shape), 0)
    assert len(foreground_of(frame(noisy), SegmentConfig(), SEEN).points) > 0.95 * SEEN.sum()
    with monkeypatch.context() as without_noise:
        without_noise.setattr(depth_filter, "OUTLIER_NOISE_FACTOR", 0)
        assert len(foreground_of(frame(noisy), SegmentConfig(), SEEN).points) < 0.8 * SEEN.sum()
    thin = np.zeros_like(SEEN)
    thin[240:242, 100:500] = True
    flat = np.where(thin & (np.random.default_rng(0).random(SEEN.shape) < 0.7), 0.5, 0)
    assert len(foreground_of(frame(flat), SegmentConfig(), thin).points) == (flat > 0).sum()


def test_the_noise_of_depth():
    depth = np.full((40, 60), 0.5)
    mask = np.zeros((40, 60), dtype=bool)
    assert depth_noise(depth, mask) == 0
    mask[10:20, 10:50] = True
    depth[:, ::2] += 0.004
    depth[12] = 0
    assert depth_noise(depth, mask) == pytest.approx(0.004)
    assert depth_noise(np.zeros_like(depth), mask) == 0


def test_holes_get_the_depth_of_the_readings_around_them(monkeypatch):
    """Of a cable that is read in patches only, each pixel has a point near its surface; not so without inpainting."""
    blotches = gaussian_filter(np.random.default_rng(0).normal(size=SEEN.shape), 4)
    patchy = frame(np.where(blotches > 0, DEPTH, 0))
    found = foreground_of(patchy, SegmentConfig(), SEEN)
    assert len(found.points) > 0.95 * SEEN.sum()
    assert cKDTree(wave()).query(found.points)[0].max() < 2 * RADIUS
    monkeypatch.setattr(depth_inpainting, "INPAINT_MIN_HOLE_PX", 1000)
    assert len(foreground_of(patchy, SegmentConfig(), SEEN).points) < 0.6 * SEEN.sum()


@pytest.mark.parametrize("given", [True, False])
def test_specks_go_and_pinholes_are_closed(given):
    random = np.random.default_rng(0)
    specks = (random.random(SEEN.shape) < 0.003) & ~SEEN
    specks[100:104, 100:104] = True
    holes = (random.random(SEEN.shape) < 0.02) & SEEN
    mask = (SEEN | specks) & ~holes
    found = foreground_of(frame(np.where(DEPTH > 0, DEPTH, 0.5), painted(mask)), BLUE, mask if given else None)
    assert not found.mask[100:104, 100:104].any()
    assert (found.mask & ~SEEN).sum() < 0.1 * specks.sum()
    assert (SEEN & ~found.mask).sum() < 0.3 * holes.sum()


def slow_removal(mask, least):
    """A piece is as large as it is with its holes filled."""
    pieces, count = label(mask, np.ones((3, 3)))
    sizes = np.array([0] + [binary_fill_holes(pieces == k).sum() for k in range(1, count + 1)])
    result = mask & (sizes[pieces] >= least)
    holes, _ = label(~np.pad(result, 1))
    small = np.bincount(holes.ravel())[holes] < least
    return result | (~np.pad(result, 1) & small)[1:-1, 1:-1]


@pytest.mark.parametrize("least", [1, 2, 5, 20])
@pytest.mark.parametrize("seed", range(5))
def test_small_components_and_holes_against_labels(seed, least):
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(60, 80)), 0.8)
    mask = noise > np.quantile(noise, 0.8 - 0.12 * seed)
    np.testing.assert_array_equal(remove_small_components(mask, least), slow_removal(mask, least))


def test_what_is_wide_on_all_sides_is_not_the_object():
    """A blue gripper beside a blue cable; but a mask that the caller gives is taken as it is."""
    mask = SEEN.copy()
    mask[300:420, 200:360] = True
    data = frame(np.where(mask & ~SEEN, 0.45, DEPTH), painted(mask))
    found = foreground_of(data, BLUE)
    assert not found.mask[305:415, 205:355].any()
    assert (found.mask & SEEN).sum() > 0.9 * SEEN.sum()
    assert foreground_of(data, BLUE, mask).mask[305:415, 205:355].all()
    everything = foreground_of(frame(np.where(mask & ~SEEN, 0.45, DEPTH)), SegmentConfig(method="everything"))
    assert everything.mask[305:415, 205:355].all()


def test_the_given_mask_goes_before_the_method():
    half = SEEN.copy()
    half[:, 320:] = False
    found = foreground_of(frame(color=painted(SEEN)), BLUE, half)
    assert not found.mask[:, 320:].any()
    assert found.mask.any()
    found = foreground_of(frame(), SegmentConfig(method="mask"), half.astype(np.uint8) * 255)
    np.testing.assert_array_equal(found.mask, half)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -1.0, 0.0])
def test_depth_that_is_none(bad):
    """Readings that are none leave holes, nothing else, and no warnings."""
    depth = DEPTH.copy()
    holes = np.random.default_rng(0).random(DEPTH.shape) < 0.2
    depth[holes] = bad
    found = foreground_of(frame(depth), CONFIG, SEEN)
    assert np.isfinite(found.points).all()
    assert not holes[found.pixels[:, 1], found.pixels[:, 0]].any()
    assert len(found.points) > 0.6 * SEEN.sum()


def test_depth_out_of_range_is_dropped():
    depth = DEPTH.copy()
    depth[:, :200] = np.where(SEEN[:, :200], 30.0, 0)
    found = foreground_of(frame(depth), CONFIG, SEEN)
    assert found.pixels[:, 0].min() >= 200
    assert foreground_of(frame(depth), SegmentConfig(max_depth=50), SEEN).pixels[:, 0].min() < 200


def test_an_empty_mask():
    with refuses("mask-empty"):
        foreground_of(frame(), CONFIG, np.zeros_like(SEEN))
    with refuses("mask-empty"):
        foreground_of(Cloud(surface(wave(), RADIUS)), CONFIG, np.zeros(len(surface(wave(), RADIUS)), bool))


@pytest.mark.parametrize("mask", [None, SEEN])
def test_no_depth(mask):
    with refuses("depth-none"):
        foreground_of(frame(0 * DEPTH), CONFIG, mask)


def test_no_depth_in_the_mask():
    with refuses("mask-without-depth"):
        foreground_of(frame(np.where(SEEN, 0, 0.6)), CONFIG, SEEN)


@pytest.mark.parametrize("mask", [None, SEEN])
@pytest.mark.parametrize("factor", [1000, 1e-3, 1e6, 1e-6])
def test_depth_in_the_wrong_unit(factor, mask):
    with refuses("depth-unit", "depth_scale"):
        foreground_of(frame(factor * DEPTH), CONFIG, mask)


@pytest.mark.parametrize("mask", [SEEN[:-1], SEEN.T, SEEN[..., None], SEEN.ravel()])
def test_a_mask_of_another_shape(mask):
    with refuses("mask-shape", str(mask.shape), "(480, 640)"):
        foreground_of(frame(), CONFIG, mask)


def test_a_mask_of_another_type():
    with refuses("mask-type", "float64"):
        foreground_of(frame(), CONFIG, SEEN.astype(float))


def test_no_mask_where_one_is_wanted():
    with refuses("mask-missing", "segment.method"):
        foreground_of(frame(), SegmentConfig(method="mask"))


def test_nothing_found_is_said_and_no_error():
    found = foreground_of(frame(color=painted(np.zeros_like(SEEN))), BLUE)
    assert found.points.shape == (0, 3)
    assert len(found.notes) == 1
    assert "segment.ranges" in found.notes[0]


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((1, 3)), np.ones((500, 3)), np.full((5, 3), np.nan)])
def test_clouds_without_extent(points):
    with refuses("cloud-without-extent"):
        foreground_of(Cloud(points), CONFIG)


@pytest.mark.parametrize("factor", [1e4, 1e-4])
def test_clouds_in_the_wrong_unit(factor):
    with refuses("points-unit", "depth_scale"):
        foreground_of(Cloud(factor * surface(wave(), RADIUS)), CONFIG)


def cloud(points, mask=None, **settings) -> Foreground:
    return foreground_of(Cloud(points), SegmentConfig(**({"method": "everything"} | settings)), mask)


def test_lone_outliers_of_a_cloud_go():
    points = surface(wave(), RADIUS)
    far = np.array([[30.0, 0, 0], [0, -25.0, 8], [3.0, 3.0, 3.0], [-9.0, 2.0, 1.0]])
    found = cloud(np.concatenate((points, far)))
    assert np.ptp(found.points, axis=0).max() < 0.4
    assert len(found.points) > 0.9 * len(points)


def test_far_outliers():
    points = surface(wave(), RADIUS)
    far = np.array([[30.0, 0, 0], [0, -25.0, 8], [3.0, 3.0, 3.0]])
    assert far_outliers(np.concatenate((points, far))).tolist() == [False] * len(points) + [True] * 3
    assert far_outliers(np.zeros((0, 3))).shape == (0,)


def test_a_cloud_with_a_mask():
    points = surface(wave(), RADIUS)
    found = cloud(points, points[:, 0] < 0)
    assert found.points[:, 0].max() < 0
    with refuses("mask-shape", "(5,)"):
        cloud(points, np.ones(5, bool))


def test_the_order_of_the_points_of_a_cloud_does_not_matter():
    points = surface(wave(), RADIUS, np.zeros(3))
    order = np.random.default_rng(0).permutation(len(points))
    one, other = cloud(points), cloud(points[order])
    assert {tuple(p) for p in one.points.tolist()} == {tuple(p) for p in other.points.tolist()}


def test_the_input_is_not_written_to():
    depth, mask = DEPTH.astype(np.float32), SEEN.copy()
    data = Frame(painted(SEEN), depth, CAMERA)
    foreground_of(data, BLUE)
    foreground_of(data, CONFIG, mask)
    np.testing.assert_array_equal(depth, DEPTH.astype(np.float32))
    np.testing.assert_array_equal(mask, SEEN)
    assert frame_of(wave(), radius=RADIUS)[1].sum() == SEEN.sum()


def test_lines_of_an_image_are_taken_with_a_word_of_warning():
    file = SAMPLES / "crossing" / "color" / "000000.jpg"
    image = Image(np.ascontiguousarray(cv2.imread(str(file))[:, :, ::-1]))
    found = foreground_of(image, SegmentConfig(max_width=np.inf, max_width_ratio=np.inf))
    assert found.notes == (RIDGE_NOTE,)
    assert foreground_of(image, SegmentConfig(method="ridge", max_width=np.inf, max_width_ratio=np.inf)).notes == ()
    assert foreground_of(image, SegmentConfig(), found.mask).notes == ()


def check_sums(record):
    """The counts of a record add up to the pixels of the mask and to the points."""
    foreground = record.foreground
    if foreground.mask is not None:
        pixels = record.selected - record.removed_small + record.closed_holes - record.removed_wide
        assert foreground.mask.sum() == pixels
        assert len(foreground.points) == pixels - record.without_depth - record.outliers + record.inpainted
    else:
        assert len(foreground.points) == record.selected - record.outliers


def test_the_record_of_a_frame():
    """Holes in the mask, a gripper, specks, patches without depth and flying points, each counted."""
    random = np.random.default_rng(0)
    gripper, specks = np.zeros_like(SEEN), np.zeros_like(SEEN)
    gripper[300:420, 200:360] = True
    specks[100:104, 100:104] = specks[20:23, 500:503] = True
    depth = np.where(gripper & ~SEEN, 0.45, np.where(specks, 0.5, DEPTH))
    depth[:, 300:320] = 0
    depth[SEEN & (random.random(SEEN.shape) < 0.02) & (np.arange(640) > 350)] = 0.9
    depth[SEEN & (random.random(SEEN.shape) < 0.02) & (np.arange(640) < 250)] = 0.01
    shown = SEEN | gripper | specks
    holes = SEEN & (random.random(SEEN.shape) < 0.02)
    record = segment(frame(depth, painted(shown & ~holes)), BLUE)
    assert (record.method, record.base) == ("hsv", None)
    assert record.selected == (shown & ~holes).sum()
    assert specks.sum() <= record.removed_small < specks.sum() + 50
    assert 0.9 * gripper.sum() < record.removed_wide < 1.1 * gripper.sum()
    assert 0 < record.closed_holes <= holes.sum()
    mask = record.foreground.mask
    assert record.without_depth == (mask & (depth < CONFIG.min_depth)).sum()
    assert 0.9 < record.inpainted / (mask & (depth <= 0)).sum() <= 1
    assert record.outliers >= 0.95 * (mask & (depth == 0.9)).sum() > 50
    check_sums(record)


def test_the_record_of_a_given_mask_an_image_and_a_cloud():
    record = segment(frame(), CONFIG, SEEN)
    assert (record.method, record.selected, record.removed_wide) == ("mask", SEEN.sum(), 0)
    check_sums(record)
    record = segment(Image(painted(SEEN)), BLUE)
    assert (record.method, record.without_depth, record.inpainted, record.outliers) == ("hsv", 0, 0, 0)
    check_sums(record)
    points = np.concatenate((surface(wave(), RADIUS), [[30.0, 0, 0], [0, -25.0, 8]]))
    record = segment(Cloud(points), CONFIG)
    assert (record.method, record.selected) == ("everything", len(points))
    assert 2 <= record.outliers < 0.1 * len(points)
    check_sums(record)
    assert segment(Cloud(points, segmented=True), SegmentConfig(method="mask")).method == "everything"


def test_an_extended_mask_is_not_the_callers():
    """It gives the points that a given mask would, and keeps the segmentation that it was extended from."""
    image, half = Image(painted(SEEN)), SEEN.copy()
    half[:, 320:] = False
    base = segment(Image(painted(half)), BLUE)
    once = segment_extended(image, BLUE, SEEN, base)
    twice = segment_extended(image, BLUE, SEEN, once)
    assert once.method == twice.method == "extended"
    assert once.base is twice.base is base
    assert base.method == "hsv"
    np.testing.assert_array_equal(once.foreground.points, segment(image, BLUE, SEEN).foreground.points)
    check_sums(once)
