"""Which strand is on top: by depth, by color, from wherever the camera stood; and how sure that is."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, depth_of, frame_of, line, surface
from builders.scenes import cloud_scene, config_of, frame_scene, image_scene

import doo3d
from doo3d.chains.refine import decide_viewpoint
from doo3d.geometry.equal_segments import equal_ring
from doo3d.judge.crossings import find_crossings
from doo3d.kernels import lay_equal_chords
from doo3d.scene.masked import NO_COLOR
from doo3d.types import Chain, Path

RADIUS, STEP = 0.005, 0.01
LOW = line([-0.12, 0.003, 0.5], [0.12, 0.003, 0.5])


def even(axis, length=STEP, radius=RADIUS):
    return Chain(lay_equal_chords(axis, length)[0], length, radius)


def over(angle=1.2, height=2 * RADIUS, middle=(0.01, 0.003)):
    """A line that crosses LOW at an angle, nearer to the camera by `height` there and less towards its ends."""
    t = np.linspace(-0.09, 0.09, 400)
    z = 0.5 - height * np.exp(-((t / 0.04) ** 2))
    return np.column_stack((middle[0] + t * np.cos(angle), middle[1] + t * np.sin(angle), z))


def seen(*axes, depth=True):
    """What a camera saw of cables, without color."""
    frame, mask = frame_of(*axes, radius=RADIUS)
    return frame_scene(frame if depth else replace(frame, depth=np.zeros_like(frame.depth)), mask)


@pytest.mark.parametrize("angle", [0.5, 1.2, 1.57, 2.6])
@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("turned", [False, True])
def test_the_nearer_is_the_upper(angle, order, turned):
    axes = [over(angle)[:: -1 if turned else 1], LOW][::order]
    chains = [even(axis) for axis in axes]
    (found,) = find_crossings(chains, seen(*axes))
    upper = 0 if order == 1 else 1
    assert (found.upper.chain, found.lower.chain) == (upper, 1 - upper)
    assert found.confidence > 0.99
    np.testing.assert_allclose(found.point, [0.01, 0.003, 0.49], atol=0.0008)
    for place in (found.upper, found.lower):
        a, b = CAMERA.project(chains[place.chain].joints[place.segment : place.segment + 2])
        there = CAMERA.project(found.point[None])[0]
        assert (there - a) @ (b - a) > 0
        assert (there - b) @ (a - b) > 0


@pytest.mark.parametrize("raised", [0, 1])
def test_the_depth_image_decides_where_the_chains_do_not(raised):
    """Both chains in one plane; only the surface tells which of them passes over the other."""
    axes = [over(height=2 * RADIUS if raised == 0 else -2 * RADIUS), LOW]
    level = [even(over(height=0.0)), even(LOW)]
    (found,) = find_crossings(level, seen(*axes))
    assert found.upper.chain == raised
    assert found.confidence > 0.9


def test_chains_decide_where_there_is_no_depth_and_are_less_sure():
    axes = [over(), LOW]
    chains = [even(axis) for axis in axes]
    (blind,) = find_crossings(chains, seen(*axes, depth=False))
    (sighted,) = find_crossings(chains, seen(*axes))
    assert blind.upper.chain == 0
    assert 0 < blind.confidence < sighted.confidence


def test_where_chains_and_surface_contradict_each_other_the_surface_counts_and_it_is_less_sure():
    axes = [over(), LOW]
    right, wrong = [even(axis) for axis in axes], [even(over(height=-2 * RADIUS)), even(LOW)]
    one, other = (find_crossings(chains, seen(*axes))[0] for chains in (right, wrong))
    assert one.upper.chain == other.upper.chain == 0
    assert other.confidence < one.confidence - 1e-4


def test_a_chain_that_crosses_itself_and_a_ring():
    t = np.linspace(-1.25, 1.25, 2000)
    loop = np.column_stack((0.15 * (t**3 - 0.8 * t), 0.12 * t**2 - 0.06, 0.5 - 0.006 * t))
    (found,) = find_crossings([even(loop)], seen(loop))
    assert found.upper.segment > found.lower.segment
    assert found.confidence > 0.99
    t = np.linspace(0, 2 * np.pi, 2000)
    eight = np.column_stack((0.1 * np.sin(t), 0.06 * np.sin(2 * t), 0.5 - 0.01 * np.cos(t)))
    joints = equal_ring(eight[:-1], STEP)
    (found,) = find_crossings([Chain(joints, STEP, RADIUS, closed=True)], seen(eight))
    count = len(joints) - 1
    assert min(found.upper.segment, count - found.upper.segment) < 3
    assert abs(found.lower.segment - count / 2) < 3


def test_no_chains_and_no_crossings():
    assert find_crossings([], seen(LOW)) == ()
    assert find_crossings([even(LOW)], seen(LOW)) == ()


TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


@pytest.mark.parametrize("order", [1, -1])
def test_a_cloud_from_its_viewpoint(order):
    """In any frame: what is upper depends on where the sensor stood only."""
    axes = [over(), LOW][::order]
    points = np.concatenate([surface(axis, RADIUS, np.zeros(3)) for axis in axes])
    for sensor, upper in ((np.zeros(3), 0), (np.array([0, 0, 1.0]), 1)):
        chains = [even(axis @ TURN.T + 1) for axis in axes]
        (found,) = find_crossings(chains, cloud_scene(points @ TURN.T + 1, TURN @ sensor + 1))
        assert found.upper.chain == (upper if order == 1 else 1 - upper)
        assert found.confidence > 0.9


@pytest.mark.parametrize("order", [1, -1])
def test_a_cloud_without_a_viewpoint(order):
    """Half shells that face the origin were seen from there; whole tubes are looked at from above, along z."""
    axes = [over(), LOW][::order]
    near = 0 if order == 1 else 1
    chains = [even(axis) for axis in axes]
    half = cloud_scene(np.concatenate([surface(axis, RADIUS, np.zeros(3)) for axis in axes]), radius=RADIUS)
    scene = decide_viewpoint([Path(axis) for axis in axes], half, STEP)
    assert find_crossings(chains, scene)[0].upper.chain == near
    whole = cloud_scene(np.concatenate([surface(axis, RADIUS) for axis in axes]), radius=RADIUS)
    (found,) = find_crossings(chains, decide_viewpoint([Path(axis) for axis in axes], whole, STEP))
    assert found.upper.chain == 1 - near
    assert found.confidence > 0.9


def ribbons(first, second, radius=9.0, shaded=True, colors=((200, 60, 40), (200, 60, 40))):
    """An image of two straight cables, the second drawn over the first: light along the middle, dark at the sides."""
    v, u = np.mgrid[0:200, 0:260].astype(float)
    image, mask = np.full((200, 260, 3), 90.0), np.zeros((200, 260), dtype=bool)
    for (a, b), color in zip((first, second), colors, strict=True):
        way = (b - a) / np.linalg.norm(b - a)
        aside = np.abs((u - a[0]) * way[1] - (v - a[1]) * way[0]) / radius
        on = aside < 1
        light = np.sqrt(np.maximum(1 - aside**2, 0)) if shaded else np.ones_like(aside)
        image[on] = (0.4 + 0.6 * light[on, None]) * np.array(color)
        mask |= on
    return image_scene(mask, image.astype(np.uint8))


def flat(angle):
    way = np.array([np.cos(angle), np.sin(angle)])
    return np.array([130, 100]) + np.array([[-90.0], [90]]) * way


@pytest.mark.parametrize("angles", [(0.1, 1.5), (0.4, -0.5), (2.0, 0.9)])
@pytest.mark.parametrize("upper", [0, 1])
def test_in_an_image_the_strand_goes_on_whose_sides_do(angles, upper):
    """Both of one color: only light and dark across a strand tell."""
    lines = [flat(angle) for angle in angles]
    chains = [even(line(*ends), 5.0, 9.0) for ends in lines]
    (found,) = find_crossings(chains, ribbons(lines[1 - upper], lines[upper]))
    assert found.upper.chain == upper
    assert found.confidence > 0.9
    np.testing.assert_allclose(found.point, [130, 100], atol=0.5)


@pytest.mark.parametrize("upper", [0, 1])
def test_in_an_image_the_strand_goes_on_whose_color_does(upper):
    lines = [flat(0.2), flat(1.4)]
    chains = [even(line(*ends), 5.0, 9.0) for ends in lines]
    image = ribbons(lines[1 - upper], lines[upper], shaded=False, colors=((60, 60, 200), (60, 170, 60)))
    assert find_crossings(chains, image)[0].upper.chain == upper
    (blind,) = find_crossings(chains, image.with_settings(config_of(crossings__use_color=False)))
    assert (blind.upper.chain, blind.confidence) == (0, 0.0)


def test_in_an_image_that_does_not_tell_nothing_is_sure():
    lines = [flat(0.2), flat(1.4)]
    chains = [even(line(*ends), 5.0, 9.0) for ends in lines]
    image = ribbons(*lines, shaded=False)
    (found,) = find_crossings(chains, image)
    assert (found.upper.chain, found.confidence) == (0, 0.0)
    assert find_crossings(chains, replace(image, color=NO_COLOR))[0].confidence == 0.0


def test_in_the_detection_and_in_its_document():
    axes = [over(), LOW]
    depth, which = depth_of(axes, [RADIUS] * 2, table=0.52)
    color = np.array([[120, 120, 120], [200, 40, 40], [200, 40, 40]], np.uint8)[which + 1]
    frame = doo3d.Frame(color, depth.astype(np.float32), CAMERA)
    config = doo3d.load_config("default", {"merge.chains": 2})
    detection = doo3d.detect(frame, config, mask=which >= 0)
    (found,) = detection.crossings
    upper, lower = (detection.chains[place.chain] for place in (found.upper, found.lower))
    assert upper.length < lower.length
    np.testing.assert_allclose(found.point, [0.01, 0.003, 0.49], atol=0.001)
    plain = detection.to_dict()["crossings"]
    assert json.loads(json.dumps(plain)) == plain
    assert plain == [
        {
            "upper": {"chain": found.upper.chain, "segment": found.upper.segment},
            "lower": {"chain": found.lower.chain, "segment": found.lower.segment},
            "point": found.point.tolist(),
            "confidence": found.confidence,
        }
    ]
    again = doo3d.detect(frame, config, mask=which >= 0).to_dict()["crossings"]
    assert json.dumps(again) == json.dumps(plain)
