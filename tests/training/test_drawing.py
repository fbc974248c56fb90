"""Images drawn to train on: repeatable, varied, and true."""

import numpy as np
import pytest

from doo3d.training.backgrounds import HELD_OUT, KINDS, background, warped
from doo3d.training.curves import LAYOUTS
from doo3d.training.distractors import box, patch
from doo3d.training.drawing import draw
from doo3d.training.strands import HELD_OUT_LOOKS, LOOKS, Canvas, Light, Strand, paint, plain_look, random_light, random_strand

SIZE = 96
LIGHT = Light(np.array([0.0, 0.0, 1.0]), 0.5, 0.0, 20.0)
RED, BLUE = np.array([1.0, 0, 0], np.float32), np.array([0, 0, 1.0], np.float32)


def canvas() -> Canvas:
    return Canvas(np.zeros((SIZE, SIZE, 3), np.float32))


def straight(row: float, color: np.ndarray, height: float, **options: object) -> Strand:
    curve = np.stack([np.arange(-5, SIZE + 5, 1.5), np.full(71, row)], 1)
    look = plain_look(np.random.default_rng(0), color)
    return Strand(curve, np.full(71, 6.0), look, LIGHT, np.full(71, height), **options)


def turned(strand: Strand) -> Strand:
    return Strand(strand.curve[:, ::-1].copy(), strand.radii, strand.look, strand.light, strand.height)


def test_the_same_numbers_draw_the_same_image():
    for index in (0, 5):
        for one, other in zip(draw(3, index, SIZE), draw(3, index, SIZE), strict=True):
            np.testing.assert_array_equal(one, other)
    assert not np.array_equal(draw(3, 0, SIZE)[0], draw(4, 0, SIZE)[0])
    assert not np.array_equal(draw(3, 0, SIZE)[0], draw(3, 0, SIZE, held_out=True)[0])


def test_images_differ_and_some_have_no_object():
    drawn = [draw(1, index, SIZE) for index in range(40)]
    assert all(image.shape == (SIZE, SIZE, 3) and truth.shape == (SIZE, SIZE, 2) for image, truth in drawn)
    shares = np.array([np.mean(truth[..., 0] > 127) for _, truth in drawn])
    assert 1 <= (shares == 0).sum() <= 12
    assert 0.02 < shares.mean() < 0.4
    assert np.std([image.mean() for image, _ in drawn]) > 20


def test_truth_is_one_on_the_centerline_and_zero_at_the_border():
    made = canvas()
    paint(np.random.default_rng(0), made, [straight(40, RED, 0)])
    column = made.centre[:, 50]
    assert column.argmax() == 40
    assert column[40] > 0.95
    assert column[46] < 0.1
    np.testing.assert_allclose(made.mask[:, 50].sum(), 12, atol=0.2)
    assert (made.centre[:, 8:-8].max(0) > 0.9).all()  # no seam where pieces of a strand meet


def test_the_higher_strand_is_seen_at_a_crossing():
    for heights, seen in (((0, 1), BLUE), ((1, 0), RED)):
        made = canvas()
        paint(np.random.default_rng(0), made, [straight(40, RED, heights[0]), turned(straight(60, BLUE, heights[1]))])
        np.testing.assert_allclose(made.image[40, 60] / made.image[40, 60].max(), seen, atol=0.05)
        assert made.mask[40, 60] == 1


def test_a_strand_is_brightest_toward_the_light():
    side = Light(np.array([0, -0.9, 0.44]), 0.1, 0.0, 20.0)
    strand = straight(40, RED, 0)
    made = canvas()
    paint(np.random.default_rng(0), made, [Strand(strand.curve, strand.radii, strand.look, side, strand.height)])
    assert made.image[36, 50, 0] > made.image[40, 50, 0] > made.image[44, 50, 0]


def test_an_occluder_takes_the_object_out_of_the_truth():
    made = canvas()
    paint(np.random.default_rng(0), made, [straight(40, RED, 0)])
    rng = np.random.default_rng(0)
    patch(rng, made, box(rng, np.array([50.0, 40.0]), 0.0, np.array([20.0, 30.0])), BLUE)
    assert made.mask[40, 50] == made.centre[40, 50] == 0
    assert made.mask[40, 20] == 1
    hidden = Strand(**{**turned(straight(20, BLUE, 2)).__dict__, "is_object": False})
    paint(rng, made, [hidden])
    assert made.mask[40, 20] == 0


@pytest.mark.parametrize("kind", [*KINDS, *HELD_OUT])
def test_every_background_is_an_image_with_variety(kind):
    make = {**KINDS, **HELD_OUT}[kind]
    images = [np.asarray(make(np.random.default_rng(seed), SIZE)) for seed in range(4)]
    assert all(image.shape == (SIZE, SIZE, 3) and np.isfinite(image).all() for image in images)
    assert np.std([image.mean() for image in images]) > 0.001
    assert warped(np.random.default_rng(0), images[0].astype(np.float32)).shape == (SIZE, SIZE, 3)
    assert not set(KINDS) & set(HELD_OUT)


def test_backgrounds_are_within_the_range_of_a_camera():
    for seed in range(12):
        image = background(np.random.default_rng(seed), SIZE)
        assert 0 <= image.min() <= image.max() <= 1


@pytest.mark.parametrize("layout", LAYOUTS)
def test_curves_have_equal_steps_and_bend_less_than_their_radius(layout):
    for seed in range(5):
        for curve in LAYOUTS[layout](np.random.default_rng(seed), 256, 3.0):
            steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
            assert np.median(steps) == pytest.approx(1.5, abs=0.1)
            assert steps.max() < 6


@pytest.mark.parametrize("look", [*LOOKS, *HELD_OUT_LOOKS])
def test_looks_color_every_place_of_a_strand(look):
    s, t = np.linspace(0, 40, 300), np.linspace(-1, 1, 300)
    colors = np.asarray(look(np.random.default_rng(2), RED)(s, t))
    assert colors.shape == (300, 3)
    assert np.isfinite(colors).all()


def test_strands_of_held_out_looks_are_painted():
    rng = np.random.default_rng(0)
    made = canvas()
    paint(rng, made, [random_strand(rng, straight(40, RED, 0).curve, 5.0, random_light(rng), RED, held_out=True)])
    assert made.mask.sum() > 500
