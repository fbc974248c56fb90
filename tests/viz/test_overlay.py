"""The picture: what is drawn where, by its pixels."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

import doo3d
from doo3d.types import Camera, Chain, Cloud, Crossing, Detection, Frame, SegmentRef
from doo3d.types.display import doubt_text
from doo3d.viz import draw, palette
from doo3d.viz.backdrop import SIZE, backdrop_of, depth_picture
from doo3d.viz.overlay import caption_lines
from doo3d.viz.palette import chain_color
from doo3d.viz.report.packing import pack_chain

CAMERA = Camera(600, 600, 320, 240, 640, 480)


def frame(color: int | None = 128) -> Frame:
    picture = None if color is None else np.full((480, 640, 3), color, np.uint8)
    return Frame(picture, np.full((480, 640), 0.6, np.float32), CAMERA)


def straight(
    y: float = 0.0, z: float = 0.6, segments: int = 40, radius: float = 0.006, occluded=None, turn: bool = False
) -> Chain:
    """A chain of 10 mm segments through the middle of the view, level or (turned) upright."""
    t = (np.arange(segments + 1) - segments / 2) * 0.01
    joints = np.column_stack((np.zeros_like(t), t, np.full_like(t, z))) if turn else np.column_stack((t, t * 0 + y, t * 0 + z))
    return Chain(joints, 0.01, radius, occluded=np.zeros(0, bool) if occluded is None else occluded)


def changed(picture, before: int = 128):
    return (np.abs(picture.astype(int) - before) > 8).any(axis=2)


@pytest.mark.parametrize("size", [(640, 480), (1920, 1080), (320, 240)])
def test_size_type_and_the_given_image_untouched(size):
    width, height = size
    camera = Camera(width, width, width / 2, height / 2, width, height)
    color = np.full((height, width, 3), 128, np.uint8)
    picture = draw(Frame(color, np.full((height, width), 0.6, np.float32), camera), Detection((straight(),)))
    assert picture.shape == (height, width, 3)
    assert picture.dtype == np.uint8
    assert (color == 128).all()
    assert changed(picture).any()


def test_the_ribbon_is_as_wide_as_the_object():
    drawn = changed(draw(frame(), Detection((straight(radius=0.02),))))
    column = drawn[:, 320]  # 0.02 m of 600 px at 0.6 m: 20 px each side, and the edge
    assert 40 <= column.sum() <= 46
    assert abs(np.flatnonzero(column).mean() - 240) < 1


def test_the_center_line_has_the_chains_color():
    picture = draw(frame(), Detection((straight(),)))
    between_joints = picture[240, 325]
    assert np.abs(between_joints.astype(int) - chain_color(0)).max() < 40


@pytest.mark.parametrize("ground", [0, 255, 128])
def test_legible_on_any_ground(ground):
    picture = draw(frame(ground), Detection((straight(),)))
    patch = picture[230:251, 300:340].astype(int).mean(axis=2)
    assert patch.max() - patch.min() > 90


def test_occluded_segments_are_dashed():
    hidden = np.zeros(40, dtype=bool)
    hidden[15:25] = True
    picture = draw(frame(), Detection((straight(occluded=hidden),)))
    left_out = np.abs(picture[240].astype(int) - 128).max(axis=1) < 40  # the faint ribbon alone
    assert (np.diff(left_out[275:365].astype(int)) == 1).sum() >= 4
    assert not left_out[140:250].any()
    assert not left_out[390:500].any()


def test_segments_from_other_frames_are_white_between_the_dashes():
    hidden = np.zeros(40, dtype=bool)
    hidden[15:25] = True
    in_time = straight(occluded=hidden)
    in_time = replace(in_time, from_time=hidden & (np.arange(40) < 20))
    picture, occluded = (draw(frame(), Detection((chain,))) for chain in (in_time, straight(occluded=hidden)))
    white = picture[240, 275:365].min(axis=1) > 200
    assert 2 <= (np.diff(white[:40].astype(int)) == 1).sum() <= 5
    assert not white[50:].any()
    assert not (occluded[240, 280:360].min(axis=1) > 200).any()
    np.testing.assert_array_equal(picture[235:245, 140:240], occluded[235:245, 140:240])
    assert caption_lines(Detection((in_time,))) == ["0.400 m   r 6.0 mm   25% occluded   12% from other frames"]


def test_segments_with_filled_depth_are_dotted():
    filled = np.zeros(40, dtype=bool)
    filled[15:25] = True
    picture = draw(frame(), Detection((replace(straight(), depth_filled=filled),)))
    seen, occluded = draw(frame(), Detection((straight(),))), draw(frame(), Detection((straight(occluded=filled),)))
    for other in (seen, occluded):
        assert (np.abs(picture[240, 275:365].astype(int) - other[240, 275:365]).max(axis=1) > 40).sum() > 10
    np.testing.assert_array_equal(picture[235:245, 140:240], seen[235:245, 140:240])
    assert caption_lines(Detection((replace(straight(), depth_filled=filled),))) == ["0.400 m   r 6.0 mm   25% depth filled"]


def test_start_is_a_disc_and_end_a_ring():
    picture = draw(frame(), Detection((straight(),)))
    assert np.abs(picture[240, 120].astype(int) - chain_color(0)).max() < 12
    assert np.abs(picture[240, 520].astype(int) - 128).max() < 12


def test_a_closed_chain_has_no_end():
    turn = 2 * np.pi * np.arange(41) / 40
    ring = 0.1 * np.column_stack((np.cos(turn), np.sin(turn), turn * 0 + 6))
    step = float(np.linalg.norm(ring[1] - ring[0]))
    opened = draw(frame(), Detection((Chain(ring, step, 0.004),)))
    closed = draw(frame(), Detection((Chain(ring, step, 0.004, closed=True),)))
    assert not np.array_equal(opened, closed)
    assert np.abs(closed[240, 420].astype(int) - chain_color(0)).max() < 12


@pytest.mark.parametrize("above", [0, 1])
def test_of_two_that_cross_the_nearer_is_on_top(above):
    depths = [0.6, 0.6]
    depths[above] = 0.5
    level, upright = straight(z=depths[0], radius=0.01), straight(z=depths[1], radius=0.01, turn=True)
    picture = draw(frame(), Detection((level, upright)))
    middle = picture[236:245, 316:325].astype(int)
    near = [np.abs(middle - chain_color(i)).max(axis=2).min() for i in range(2)]
    assert near[above] < near[1 - above]


@pytest.mark.parametrize("above", [0, 1])
@pytest.mark.parametrize("confidence", [0.0, 0.8])
def test_the_upper_strand_as_detected_passes_over_like_a_bridge(above, confidence):
    """In 2-D, where nothing else tells; unsure ones have no white lines."""
    level = np.column_stack((np.arange(20.0, 181, 10), np.full(17, 75.0)))
    chains = (Chain(level, 10.0, 8.0), Chain(level[:, ::-1] + (25, 0), 10.0, 8.0))
    places = [SegmentRef(0, 7), SegmentRef(1, 5)]
    crossing = Crossing(places[above], places[1 - above], np.array([100.0, 75.0]), confidence)
    image = np.full((200, 200, 3), 128, np.uint8)
    picture = draw(image, Detection(chains, mode="2d", coordinates="image", crossings=(crossing,)))
    middle = picture[70:81, 95:106].astype(int)
    near = [np.abs(middle - chain_color(i)).max(axis=2).min() for i in range(2)]
    assert near[above] < 40 < near[1 - above]
    side = picture[70:74, 108:112] if above else picture[83:87, 93:97]  # a half-width and a line's from the middle
    assert (side.min(axis=2) > 200).any() == (confidence > 0)


def test_chains_outside_and_behind_the_camera_do_not_matter():
    behind = straight(z=-0.5)
    outside = straight(y=50.0)
    assert np.array_equal(draw(frame(), Detection((behind, outside)))[100:], draw(frame(), Detection((behind, behind)))[100:])


def test_no_chains_and_no_color():
    picture = draw(frame(None), Detection(()))
    assert picture.shape == (480, 640, 3)


def test_two_dimensional_chains_on_an_image():
    joints = np.column_stack((np.arange(20, 121, 10.0), np.full(11, 50.0)))
    image = np.full((100, 300, 3), 128, np.uint8)
    found = Detection((Chain(joints, 10.0, 5.0),), mode="2d", coordinates="image")
    picture = draw(image, found)
    assert np.abs(picture[50, 20].astype(int) - chain_color(0)).max() < 12
    assert caption_lines(found) == ["100 px   r 5.0 px"]
    assert np.abs(draw(frame(), found)[50, 20].astype(int) - chain_color(0)).max() < 12


def test_caption():
    hidden = np.zeros(40, dtype=bool)
    hidden[:5] = True
    assert caption_lines(Detection((straight(occluded=hidden), straight()))) == [
        "0.400 m   r 6.0 mm   12% occluded",
        "0.400 m   r 6.0 mm",
    ]


def test_a_doubtful_chain_is_thin_and_gray_and_the_caption_says_so():
    sure, unsure = (replace(straight(radius=0.02), confidence=value) for value in (0.5, 0.128))
    assert (sure.is_doubtful, unsure.is_doubtful) == (False, True)
    clear, doubtful = draw(frame(), Detection((sure,))), draw(frame(), Detection((unsure,)))
    assert changed(clear)[:, 320].sum() > 40
    assert 1 <= changed(doubtful)[:, 320].sum() <= 5
    assert np.ptp(doubtful[200:280, 125:515].astype(int), axis=2).max() <= 10  # gray; the dark rim is a little blue
    assert caption_lines(Detection((unsure,))) == ["0.400 m   r 20.0 mm   doubtful (confidence 0.12)"]
    hidden = replace(unsure, occluded=np.arange(40) < 10)
    assert caption_lines(Detection((hidden,))) == ["0.400 m   r 20.0 mm   25% occluded   doubtful (confidence 0.12)"]
    assert caption_lines(Detection((sure,))) == ["0.400 m   r 20.0 mm"]
    assert doubt_text(0.4999) == "doubtful (confidence 0.49)"


def test_what_is_doubtful_besides_the_chains_is_thin_and_gray_below_them_whatever_its_confidence():
    chain, doubted = straight(radius=0.02), replace(straight(radius=0.02, y=0.05), confidence=0.7)
    alone, both = Detection((), doubtful=(doubted,)), Detection((chain,), doubtful=(doubted,))
    drawn = draw(frame(), alone)
    assert 1 <= changed(drawn)[150:, 320].sum() <= 5
    row = 150 + int(changed(drawn)[150:, 320].argmax())
    assert np.ptp(drawn[row - 20 : row + 20, 125:515].astype(int), axis=2).max() <= 10
    assert caption_lines(alone) == ["0.400 m   r 20.0 mm   doubtful (confidence 0.70)"]
    assert caption_lines(both) == ["0.400 m   r 20.0 mm", "0.400 m   r 20.0 mm   doubtful (confidence 0.70)"]
    assert changed(draw(frame(), both))[:, 320].sum() > changed(draw(frame(), Detection((chain,))))[:, 320].sum()


def test_what_is_doubtful_is_in_notebook_and_figure():
    pytest.importorskip("plotly")
    detection = Detection((straight(),), doubtful=(replace(straight(y=0.1), confidence=0.12),))
    page = detection._repr_html_()
    assert "frame: 1 chain, 1 doubtful (0.40 m, 0.12), confidence 0.12" in page
    assert page.count("<tr>") == 3
    assert page.count("<circle") == 2
    assert {"chain 0", "doubtful (confidence 0.12)"} <= {trace.name for trace in detection.plot().data}
    assert "confidence" not in Detection(())._repr_html_()


def test_a_doubtful_chain_looks_alike_in_notebook_figure_and_report():
    pytest.importorskip("plotly")
    gray, detection = (
        "#{:02x}{:02x}{:02x}".format(*palette.DOUBTFUL),
        Detection((straight(), replace(straight(y=0.1), confidence=0.12))),
    )
    page = detection._repr_html_()
    assert f'stroke="{gray}"' in page
    assert "doubtful (confidence 0.12)" in page
    names = {trace.name for trace in detection.plot().data}
    assert {"chain 0", "chain 1, doubtful (confidence 0.12)"} <= names
    packed = [pack_chain(k, chain) for k, chain in enumerate(detection.chains)]
    assert ("doubt" in packed[0], packed[1]["doubt"], packed[1]["color"]) == (False, "doubtful (confidence 0.12)", gray)


def test_many_chains_and_a_small_image():
    chains = tuple(straight(y=0.01 * i) for i in range(20))
    assert draw(frame(), Detection(chains)).shape == (480, 640, 3)
    tiny = Camera(10, 10, 8, 6, 16, 12)
    assert draw(Frame(None, np.ones((12, 16), np.float32), tiny), Detection(chains)).shape == (12, 16, 3)


def test_colors_differ():
    colors = [chain_color(i) for i in range(24)]
    assert len(set(colors)) == 24


@pytest.mark.parametrize("viewpoint", [None, np.zeros(3), np.array([0.5, 0.2, -0.1])])
@pytest.mark.parametrize("colored", [True, False])
def test_a_cloud_is_shown_whole_with_its_chain_on_it(viewpoint, colored):
    rng = np.random.default_rng(0)
    chain = straight(z=0.6)
    points = chain.joints[rng.integers(0, 41, 4000)] + rng.normal(0, 0.003, (4000, 3))
    colors = np.full((4000, 3), 250, np.uint8) if colored else None
    cloud = Cloud(points, colors, viewpoint=viewpoint)
    backdrop = backdrop_of(cloud)
    at = backdrop.projection.project(points)
    assert backdrop.image.shape == (SIZE[1], SIZE[0], 3)
    assert ((at > 0) & (at < SIZE)).all(axis=1).mean() > 0.98
    assert np.ptp(at[:, 0]) > 0.6 * SIZE[0]
    shown = draw(cloud, Detection((chain,), coordinates="cloud"))
    start, end = backdrop.projection.project(chain.joints[[0, -1]])
    assert np.abs(shown[round(start[1]), round(start[0])].astype(int) - chain_color(0)).max() < 12
    assert np.isfinite(end).all()


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((1, 3)), np.ones((50, 3)), np.outer(np.arange(9), (0, 0, 0.1))])
@pytest.mark.parametrize("viewpoint", [None, np.zeros(3)])
def test_clouds_without_spread(points, viewpoint):
    assert draw(Cloud(points, viewpoint=viewpoint), Detection(())).shape == (SIZE[1], SIZE[0], 3)


def test_depth_picture():
    depth = np.full((20, 20), 1.0, np.float32)
    depth[:10] = 0.5
    depth[0, 0] = 0
    picture = depth_picture(depth)
    assert picture[5, 5].sum() > picture[15, 5].sum() > picture[0, 0].sum()
    assert depth_picture(np.zeros((4, 4), np.float32)).shape == (4, 4, 3)


CONES_MISSING = {  # Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB
    "none": np.eye(3),
    "red": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]),
    "green": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]),
    "blue": np.array([[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]),
}


@pytest.mark.parametrize("missing", CONES_MISSING)
def test_any_two_chains_have_colors_that_the_color_blind_tell_apart(missing):
    rgb = np.array(palette.CHAINS) / 255
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ CONES_MISSING[missing].T, 0, 1)
    display = np.where(seen <= 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055).astype(np.float32)
    lab = cv2.cvtColor(display[None], cv2.COLOR_RGB2Lab)[0]
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=2) + 1e3 * np.eye(len(lab))
    assert apart.min() > 30


def test_chains_are_numbered_where_there_are_several():
    joints = np.column_stack((np.arange(9) * 20.0 + 200, np.full(9, 100.0)))
    chains = [doo3d.Chain(joints + np.array((0, 150 * k)), 20.0, 4.0, id=k) for k in range(2)]
    blank = np.full((400, 600, 3), 128, np.uint8)
    alone = doo3d.draw(blank, doo3d.Detection(tuple(chains[:1]), mode="2d", coordinates="image"))
    both = doo3d.draw(blank, doo3d.Detection(tuple(chains), mode="2d", coordinates="image"))
    beside = np.s_[76:92, 207:225]  # up and to the right of the first joint
    assert (alone[beside] == 128).all()
    assert both[beside].max() > 240
    assert both[beside].min() < 70


def test_points_without_color_are_gray_and_no_chain_is():
    cloud = doo3d.Cloud(np.random.default_rng(0).random((500, 3)) + np.array((0, 0, 1)), viewpoint=np.zeros(3))
    picture = doo3d.draw(cloud, doo3d.Detection((), coordinates="cloud"))[200:]
    assert np.ptp(picture.astype(int), axis=2).max() == 0
    assert min(np.ptp(palette.CHAINS, axis=1)) > 80
