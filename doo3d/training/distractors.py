"""Draw objects that only look like strands: pens, tools, fingers, washers, connectors, cracks, profiles, blurred rooms."""

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np

from ..types import Array
from .backgrounds import FONTS, HELD_OUT, KINDS, LETTERS, Background, inked
from .curves import STEP_PX, parallels, resampled, wander
from .noise import Rng, color, octaves, palette
from .strands import Canvas, Light, Strand, braided_look, paint, plain_look, printed_look, random_strand, ribbed_look, with_finish
from .textures import grid


def rod(rng: Rng, size: int, light: Light) -> Strand:
    """Draw a straight rod with two ends, such as a pen or a tool's handle, at most twelve times as long as wide."""
    radius = float(np.exp(rng.uniform(np.log(3), np.log(28))))
    length = 2 * radius * rng.uniform(3, 12)
    angle = rng.random() * 6.28
    places = np.arange(0, length, STEP_PX)
    curve = rng.uniform(0, 1, 2) * size + places[:, None] * np.array([np.cos(angle), np.sin(angle)])
    taper = rng.uniform(0.02, 0.5)
    radii = radius * np.clip(0.15 + 0.85 * np.minimum(1, (1 - places / length) / taper), 0, 1)
    if rng.random() < 0.5:
        radii = np.where(places < rng.uniform(0.2, 0.7) * length, radii, radii * rng.uniform(0.2, 0.8))
    look = (plain_look, plain_look, printed_look, ribbed_look, braided_look)[int(rng.integers(5))](rng, color(rng))
    return Strand(
        curve, np.maximum(radii, 0.8), look, with_finish(rng, light), np.zeros(len(curve)), contact=0.4, is_object=False
    )


def pliers(rng: Rng, size: int, light: Light) -> list[Strand]:
    """Draw pliers, tongs or a gripper: two bent handles of one look, and two jaws that meet at a pivot."""
    radius = float(np.exp(rng.uniform(np.log(2.5), np.log(16))))
    length = 2 * radius * rng.uniform(4, 13)
    pivot, heading = rng.uniform(-0.1, 1.1, 2) * size, rng.random() * 6.28
    spread, bow, jaw = rng.uniform(0.02, 0.5), rng.normal(0.4, 0.4), rng.uniform(0.1, 0.45)
    look = (plain_look, plain_look, printed_look, ribbed_look)[int(rng.integers(4))](rng, color(rng))
    metal = plain_look(rng, color(rng) if rng.random() < 0.3 else np.full(3, rng.uniform(0.1, 0.9), np.float32))
    finish = with_finish(rng, light)
    found = []
    for side in (-1, 1):
        for start, reach, part in ((heading, length, look), (heading + np.pi, jaw * length, metal)):
            along = np.linspace(0, 1, max(4, int(reach / STEP_PX)))
            angle = start + side * (spread + bow * (0.4 - along) * (part is look))
            curve = pivot + np.cumsum(np.stack([np.cos(angle), np.sin(angle)], 1), 0) * STEP_PX
            taper = 1 - rng.uniform(0, 0.4) * along if part is look else 0.9 - 0.7 * along
            radii = np.maximum(radius * taper, 0.8)
            found.append(Strand(curve, radii, part, finish, np.zeros(len(curve)), contact=0.4, is_object=False))
    return found


def finger(rng: Rng, size: int, light: Light, center: Array) -> Strand:
    """Draw a finger with its end near `center` (2,) px."""
    radius = float(np.exp(rng.uniform(np.log(9), np.log(38))))
    skin = np.array([rng.uniform(0.35, 0.95), 0, 0])
    skin[1] = skin[0] * rng.uniform(0.6, 0.82)
    skin[2] = skin[1] * rng.uniform(0.65, 0.95)
    glove = rng.random() < 0.25
    length = 2 * radius * rng.uniform(2.5, 7)
    angle = rng.random() * 6.28 + np.linspace(0, rng.normal(0, 0.7), max(4, int(length / STEP_PX)))
    curve = center + np.cumsum(np.stack([np.cos(angle), np.sin(angle)], 1), 0) * STEP_PX
    radii = radius * np.sqrt(np.clip(np.linspace(0.35, 2.5, len(curve)), 0, 1))
    look = plain_look(rng, np.asarray(color(rng) if glove else skin, np.float32))
    return Strand(curve, radii, look, with_finish(rng, light), np.zeros(len(curve)), contact=0.5, is_object=False)


def patch(rng: Rng, canvas: Canvas, points: Array, shade: Array) -> None:
    """Fill an opaque convex polygon with an edge and a gradient; points : (K, 2) px. shade : its color."""
    size = canvas.mask.shape[0]
    x0, y0 = np.clip(np.floor(points.min(0)) - 2, 0, size).astype(int)
    x1, y1 = np.clip(np.ceil(points.max(0)) + 3, 0, size).astype(int)
    if x1 <= x0 or y1 <= y0:
        return
    part = np.s_[y0:y1, x0:x1]
    corners = np.round((points - [x0, y0]) * 16).astype(np.int32)
    cover = np.zeros((y1 - y0, x1 - x0), np.float32)
    cv2.fillConvexPoly(cover, corners, 1.0, cv2.LINE_AA, 4)
    across = np.linspace(0, 1, x1 - x0, dtype=np.float32)[None, :, None]
    down = np.linspace(0, 1, y1 - y0, dtype=np.float32)[:, None, None]
    ramp = 1 + np.float32(rng.uniform(-0.4, 0.4)) * across + np.float32(rng.uniform(-0.4, 0.4)) * down
    image = np.ascontiguousarray(canvas.image[part] * (1 - cover[..., None]) + cover[..., None] * (shade * ramp))
    cv2.polylines(image, [corners], True, (shade * np.float32(rng.uniform(0.3, 1.4))).tolist(), 1, cv2.LINE_AA, 4)
    canvas.image[part] = image
    canvas.mask[part] *= 1 - cover
    canvas.centre[part] *= 1 - cover


def box(rng: Rng, center: Array, angle: float, extent: Array) -> Array:
    """Draw the corners (4, 2) px of a slightly distorted rectangle."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * extent / 2 * rng.uniform(0.85, 1.1, (4, 2))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.asarray(corners @ turn.T + center)


def connector(rng: Rng, canvas: Canvas, place: Array, heading: float, width: float) -> None:
    """Draw a plug or a connector block at the end of strands, `width` px wide across the heading."""
    length = width * rng.uniform(0.5, 2.2)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    shade = color(rng)
    center = place - ahead * length * 0.45
    patch(rng, canvas, box(rng, center, heading, np.array([length, width])), shade)
    for _ in range(int(rng.integers(0, 9))):
        spot = center + ahead * length * rng.uniform(-0.4, 0.4) + np.array([-ahead[1], ahead[0]]) * width * rng.uniform(-0.4, 0.4)
        patch(
            rng,
            canvas,
            box(rng, spot, heading, np.maximum(width * rng.uniform(0.06, 0.25, 2), 1)),
            shade * np.float32(rng.uniform(0.1, 1.3)),
        )


def small_parts(rng: Rng, canvas: Canvas, light: Light) -> None:
    """Draw washers, screws, letters, edges and cracks on the background."""
    image = canvas.image
    size = image.shape[0]
    for _ in range(int(rng.integers(0, 7))):
        center = tuple(int(v) for v in rng.random(2) * size)
        radius = int(np.exp(rng.uniform(1.2, 3.6)))
        kind = rng.random()
        shade = color(rng).tolist()
        if kind < 0.3:
            cv2.circle(image, center, radius, shade, max(1, int(radius * rng.uniform(0.1, 0.5))), cv2.LINE_AA)
        elif kind < 0.5:
            cv2.circle(image, center, radius, shade, -1, cv2.LINE_AA)
            cv2.circle(image, center, max(1, radius // 2), (color(rng) * np.float32(0.3)).tolist(), -1, cv2.LINE_AA)
        elif kind < 0.7:
            word = "".join(rng.choice(list(LETTERS), int(rng.integers(1, 9))))
            ink = np.zeros((size, size), np.uint8)
            cv2.putText(ink, word, center, FONTS[int(rng.integers(4))], radius / 12, 255, max(1, radius // 7), cv2.LINE_AA)
            image[:] = inked(image, ink, color(rng))
        elif kind < 0.8:
            end = tuple(int(v) for v in rng.random(2) * size)
            cv2.line(image, center, end, shade, int(rng.integers(1, 3)), cv2.LINE_AA)
        else:
            _crack(rng, image, np.array(center, float))


def _crack(rng: Rng, image: Array, start: Array) -> None:
    """Draw a crack or a joint: a line of uneven width, darker or lighter than its surroundings, without a tube's shading."""
    size = image.shape[0]
    heading = np.cumsum(rng.normal(0, rng.choice([0.1, 0.6]), 60)) + rng.random() * 6.28
    line = start + np.cumsum(np.stack([np.cos(heading), np.sin(heading)], 1), 0) * rng.uniform(1, 8)
    width, part = np.exp(rng.uniform(0, 2.4)), np.float32(rng.choice([0.3, 0.6, 1.4]))
    for a, b in pairwise(line):
        row, column = np.clip(a[::-1].astype(int), 0, size - 1)
        shade = np.clip(image[row, column] * part, 0.02, 1).tolist()
        thickness = max(1, round(width * rng.uniform(0.5, 1.3)))
        cv2.line(image, tuple(int(v) for v in a), tuple(int(v) for v in b), shade, thickness, cv2.LINE_AA)


def groove(rng: Rng, image: Array, place: Array) -> Array:
    """Draw a groove across an image: a joint of a floor, with ragged borders and dirt inside."""
    size = image.shape[0]
    x, y = grid(size)
    angle = rng.random() * 6.28
    along = (x - place[0]) * np.cos(angle) + (y - place[1]) * np.sin(angle)
    across = (y - place[1]) * np.cos(angle) - (x - place[0]) * np.sin(angle) + along * along * rng.normal(0, 0.15) / size
    half = np.exp(rng.uniform(0.5, 2.5))
    ragged = (octaves(rng, size, rng.uniform(3, 20), 0.8) - 0.5) * half * rng.uniform(0.3, 2.5)
    cover = np.clip(half - np.abs(across + ragged) + 0.5, 0, 1)[..., None]
    dirt = palette(rng, octaves(rng, size, rng.uniform(2, 10), 0.9), 3) * np.float32(rng.uniform(0.2, 0.9))
    fill = dirt if rng.random() < 0.4 else image * dirt * np.float32(1.5)
    return np.asarray(image * (1 - cover) + cover * fill, np.float32)


def profile(rng: Rng, canvas: Canvas) -> None:
    """Draw a straight profile across the image, such as a machine's frame: flat faces, grooves and edges side by side."""
    size = canvas.mask.shape[0]
    x, y = grid(size)
    angle = rng.random() * 6.28 if rng.random() < 0.5 else rng.integers(4) * np.pi / 2 + rng.normal(0, 0.1)
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    half = np.exp(rng.uniform(np.log(5), np.log(70)))
    half = half * (1 + rng.normal(0, 0.25) * along / size)
    t = (across - rng.uniform(across.min(), across.max())) / np.maximum(half, 2)
    faces = int(rng.integers(2, 22))
    borders = np.sort(rng.uniform(-1, 1, faces - 1))
    shades = np.where(rng.random(faces) < 0.5, rng.uniform(0.5, 1.2), rng.uniform(0.1, 1.3, faces)).astype(np.float32)
    base = color(rng) if rng.random() < 0.4 else np.full(3, rng.uniform(0.2, 1), np.float32)
    face = base * shades[np.searchsorted(borders, t)][..., None] * (np.float32(0.8) + 0.4 * octaves(rng, size, size)[..., None])
    if rng.random() < 0.3:
        face = face * (np.float32(0.8) + 0.4 * octaves(rng, size, 4, 0.8)[..., None])
    inside = np.clip((1 - np.abs(t)) * half + 0.5, 0, 1) * (np.abs(along - along.mean()) < size * rng.uniform(0.2, 3))
    canvas.image[:] = canvas.image * (1 - inside[..., None]) + inside[..., None] * face


def out_of_focus(rng: Rng, canvas: Canvas, light: Light, held_out: bool = False) -> None:
    """Draw an out-of-focus room behind the objects: surfaces, tools and strands too blurred to be recognized."""
    size = canvas.mask.shape[0]
    for _ in range(int(rng.integers(0, 12))):
        extent = size * np.exp(rng.uniform(-3.2, -0.3, 2))
        patch(rng, canvas, box(rng, rng.random(2) * size, rng.normal(0, 0.3), extent), color(rng))
    for _ in range(int(rng.integers(0, 4))):
        _piece_of_surface(rng, canvas, HELD_OUT if held_out else KINDS)
    for _ in range(int(rng.integers(0, 4))):
        profile(rng, canvas)
    tools(rng, canvas, light, int(rng.integers(0, 6)))
    sigma = float(np.exp(rng.uniform(np.log(2.5), np.log(14))))
    strands = []
    for _ in range(int(rng.integers(0, 6))):
        radius, shade = sigma * rng.uniform(0.4, 1.6), color(rng)
        for curve in [wander(rng, size, radius)] if rng.random() < 0.7 else parallels(rng, size, radius):
            strands.append(replace(random_strand(rng, curve, radius, light, shade), is_object=False))
    paint(rng, canvas, strands)
    if rng.random() < 0.5:
        canvas.image[:] = cv2.GaussianBlur(canvas.image, (0, 0), sigma)
        return
    width = 2 * int(1.8 * sigma) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width)).astype(np.float32)
    lamps = canvas.image * (1 + np.float32(rng.uniform(0, 2)) * (canvas.image > 0.85))
    canvas.image[:] = np.clip(cv2.filter2D(lamps, -1, disc / disc.sum(), borderType=cv2.BORDER_REFLECT), 0, 1)


def _piece_of_surface(rng: Rng, canvas: Canvas, kinds: dict[str, Background]) -> None:
    """Draw a box with the texture of another background, such as a keyboard, a grille, a board or a heap of parts."""
    size = canvas.mask.shape[0]
    corners = box(rng, rng.random(2) * size, rng.normal(0, 0.5), size * np.exp(rng.uniform(-2, 0, 2)))
    cover = np.zeros((size, size), np.float32)
    cv2.fillConvexPoly(cover, np.round(corners * 16).astype(np.int32), 1.0, cv2.LINE_AA, 4)
    texture = list(kinds.values())[int(rng.integers(len(kinds)))](rng, size)
    canvas.image[:] = canvas.image * (1 - cover[..., None]) + cover[..., None] * texture


def tools(rng: Rng, canvas: Canvas, light: Light, count: int) -> None:
    """Paint `count` tools into the image: rods, pliers and rings."""
    size = canvas.mask.shape[0]
    found = [rod(rng, size, light) for _ in range(count)]
    if rng.random() < 0.3:
        found += pliers(rng, size, light)
    if rng.random() < 0.15:
        angle = np.linspace(0, 6.28, 90)
        ring = rng.random(2) * size + np.stack([np.cos(angle), rng.uniform(0.5, 1) * np.sin(angle)], 1) * rng.uniform(8, 40)
        ring = resampled(ring)
        radii = np.full(len(ring), rng.uniform(1.5, 5))
        found.append(
            Strand(ring, radii, plain_look(rng, color(rng)), with_finish(rng, light), np.zeros(len(ring)), is_object=False)
        )
    paint(rng, canvas, found)
