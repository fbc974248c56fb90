"""Draw training images of thin deformable objects, with their truth."""

import cv2
import numpy as np

from ..types import Array
from .backgrounds import background
from .curves import LAYOUTS, SHARES
from .distractors import box, connector, finger, groove, out_of_focus, patch, profile, small_parts, tools
from .noise import Rng, color, octaves
from .strands import Canvas, Light, Strand, paint, random_light, random_strand

MIN_RADIUS_PX, MAX_RADIUS_PX = 1.2, 30.0
EMPTY_SHARE = 0.08
"""Fraction of the images without an object."""


def draw(seed: int, index: int, size: int = 320, held_out: bool = False) -> tuple[Array, Array]:
    """Draw an image with its truth; the same numbers draw the same image.

    Parameters
    ----------
    seed
        seed of the set of images.
    index
        number of the image in the set.
    size
        width and height, px.
    held_out
        True draws the kinds of backgrounds and looks that the training never uses.

    Returns
    -------
    image
        (size, size, 3) uint8 RGB.
    truth
        (size, size, 2) uint8: coverage of the pixel by an object, 0 to 255; position across the strand, 255 on the centerline
        to 0 at its border.
    """
    rng = np.random.default_rng([seed, index, int(held_out)])
    light = random_light(rng)
    canvas = Canvas(np.ascontiguousarray(background(rng, size, held_out), np.float32))
    is_far = rng.random() < 0.22
    if is_far:
        out_of_focus(rng, canvas, light, held_out)
    elif rng.random() < 0.3:
        for _ in range(int(rng.integers(1, 4))):
            profile(rng, canvas)
    if rng.random() < (0.1 if is_far else 0.5):
        small_parts(rng, canvas, light)
    if not is_far and rng.random() < 0.15:
        for _ in range(int(rng.integers(1, 4))):
            canvas.image[:] = groove(rng, canvas.image, rng.random(2) * size)
    if rng.random() < (0.1 if is_far else 0.3):
        tools(rng, canvas, light, int(rng.integers(1, 4)))
    if rng.random() > EMPTY_SHARE:
        _objects(rng, canvas, light, held_out)
    _occluders(rng, canvas, light)
    image = seen_by_camera(rng, canvas.image)
    truth = np.stack([canvas.mask, canvas.centre], axis=-1)
    return image, np.round(truth * 255).astype(np.uint8)


def _objects(rng: Rng, canvas: Canvas, light: Light, held_out: bool) -> None:
    size = canvas.mask.shape[0]
    strands: list[Strand] = []
    ends = []
    common = float(np.exp(np.clip(rng.normal(np.log(4.5), 0.65), np.log(MIN_RADIUS_PX), np.log(MAX_RADIUS_PX))))
    for _ in range(int(rng.choice([1, 2, 3], p=[0.7, 0.22, 0.08]))):
        radius = float(np.clip(common * np.exp(rng.normal(0, 0.25)), MIN_RADIUS_PX, MAX_RADIUS_PX))
        layout = list(LAYOUTS)[int(rng.choice(len(LAYOUTS), p=SHARES))]
        curves = LAYOUTS[layout](rng, size, radius)
        shared = _object_color(rng, canvas)
        alike = rng.random() < 0.3
        for curve in curves:
            base = shared if alike else _object_color(rng, canvas)
            own = radius if alike or rng.random() < 0.6 else radius * np.exp(rng.normal(0, 0.25))
            strands.append(random_strand(rng, curve, float(np.clip(own, MIN_RADIUS_PX, MAX_RADIUS_PX)), light, base, held_out))
        if layout == "fan" or rng.random() < 0.35:
            start = np.array([curve[0] for curve in curves]) if layout == "fan" else curves[0][:1]
            ahead = curves[0][3] - curves[0][0]
            width = float(np.ptp(start @ np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead))) + 2 * radius * rng.uniform(
                1.3, 3
            )
            ends.append((start.mean(0), float(np.arctan2(ahead[1], ahead[0])), width))
    _cast_shadow(rng, canvas, strands, light)
    paint(rng, canvas, strands)
    for place, heading, width in ends:
        connector(rng, canvas, place, heading, width)


def _object_color(rng: Rng, canvas: Canvas) -> Array:
    """Draw a random color, sometimes one that differs little from the background."""
    if rng.random() > 0.12:
        return color(rng)
    row, column = rng.integers(0, canvas.mask.shape[0], 2)
    return np.asarray(np.clip(canvas.image[row, column] * rng.uniform(0.6, 1.5) + rng.normal(0, 0.05, 3), 0, 1), np.float32)


def _cast_shadow(rng: Rng, canvas: Canvas, strands: list[Strand], light: Light) -> None:
    if rng.random() < 0.3:
        return
    shadow = np.zeros(canvas.mask.shape, np.float32)
    height = rng.uniform(0.3, 1) * np.exp(rng.uniform(0, 2.2))
    reach = -light.direction[:2] * height
    for strand in strands:  # beside each other, the shadow of one fills the gap to the next
        shift = reach * strand.radii.mean() * rng.uniform(0.7, 1.3) + rng.normal(0, 1, 2)
        line = np.round((strand.curve[::4] + shift) * 16).astype(np.int32)
        cv2.polylines(shadow, [line], False, 1.0, max(1, round(2 * strand.radii.mean())), cv2.LINE_AA, 4)
    soft = float(np.clip(height * rng.uniform(0.1, 0.8), 0.6, 15))
    shadow = cv2.GaussianBlur(shadow, (0, 0), soft)
    canvas.image *= 1 - np.float32(rng.uniform(0.1, 0.75)) * shadow[..., None]


def _occluders(rng: Rng, canvas: Canvas, light: Light) -> None:
    size = canvas.mask.shape[0]
    covered = np.argwhere(canvas.mask > 0.5)
    while rng.random() < 0.22:
        place = (
            covered[int(rng.integers(len(covered)))][::-1].astype(float)
            if len(covered) and rng.random() < 0.7
            else rng.random(2) * size
        )
        kind = rng.random()
        if kind < 0.4:
            paint(rng, canvas, [finger(rng, size, light, place + rng.normal(0, 6, 2)) for _ in range(int(rng.integers(1, 4)))])
        elif kind < 0.75:
            extent = np.exp(rng.uniform(np.log(6), np.log(110), 2))
            patch(rng, canvas, box(rng, place, rng.random() * 3.14, extent), color(rng))
        else:
            tools(rng, canvas, light, 1)


def seen_by_camera(rng: Rng, image: Array) -> Array:
    """Add the effects of a camera to an image (S, S, 3) uint8: uneven light, blur, colors, noise, compression."""
    size = image.shape[0]
    image = np.clip(image, 0, 1.3)
    if rng.random() < 0.6:
        image = image * (1 + np.float32(rng.uniform(0.1, 0.8)) * (octaves(rng, size, size)[..., None] - np.float32(0.6)))
    if rng.random() < 0.25:
        edge = (octaves(rng, size, size / 2, 0.3) > rng.uniform(0.3, 0.7)).astype(np.float32)
        edge = cv2.GaussianBlur(edge, (0, 0), float(rng.uniform(0.7, 8)))
        image = image * (1 - np.float32(rng.uniform(0.1, 0.6)) * edge[..., None])
    kind = rng.random()
    if kind < 0.55:
        image = cv2.GaussianBlur(image, (0, 0), float(rng.uniform(0.3, 0.9)))
    elif kind < 0.72:
        image = cv2.GaussianBlur(image, (0, 0), float(rng.uniform(0.9, 2)))
    elif kind < 0.8:
        length = int(rng.integers(3, 8))
        kernel = np.zeros((length, length), np.float32)
        cv2.line(kernel, (0, int(rng.integers(length))), (length - 1, int(rng.integers(length))), 1.0)
        kernel = kernel.T if rng.random() < 0.5 else kernel
        image = cv2.filter2D(image, -1, kernel / kernel.sum())
    if rng.random() < 0.15:
        small = int(size * rng.uniform(0.45, 0.9))
        image = cv2.resize(
            cv2.resize(image, (small, small), interpolation=cv2.INTER_AREA), (size, size), interpolation=cv2.INTER_LINEAR
        )
    image = np.clip(image * rng.uniform(0.85, 1.15, 3).astype(np.float32) * np.float32(np.exp(rng.normal(0, 0.2))), 0, 1)
    image = image ** np.float32(np.exp(rng.normal(0, 0.2)))
    if rng.random() < 0.25:
        gray = image.mean(axis=2, keepdims=True)
        image = gray + (image - gray) * np.float32(rng.uniform(0, 1.6))
    if rng.random() < 0.7:
        spread = np.float32(rng.exponential(0.02))
        image = image + rng.standard_normal(image.shape, dtype=np.float32) * spread * np.sqrt(np.clip(image, 0.05, 1))
    pixels = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    if rng.random() < 0.6:
        _, stream = cv2.imencode(".jpg", pixels[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(35, 96))])
        pixels = np.asarray(cv2.imdecode(stream, cv2.IMREAD_COLOR))[..., ::-1]
    return np.ascontiguousarray(pixels)
