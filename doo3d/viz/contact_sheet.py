"""A contact sheet: some frames of a capture beside each other, colour beside depth, clouds from above."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..types import Array, Bools, Cloud, Frame, Image
from .backdrop import backdrop_of
from .palette import CHAINS, LIGHT, Rgb

WIDTH = 1600  # px, of the sheet
_BOX = (384, 288)  # px, the largest that one picture becomes
_GAP, _CAPTION, _HEAD, _LINE = 12, 22, 20, 16  # px
_GROUND: Rgb = (24, 26, 32)
_EMPTY: Rgb = (0, 0, 0)  # no depth
_FAULT: Rgb = (255, 150, 130)
_FONT, _SIZE = cv2.FONT_HERSHEY_SIMPLEX, 0.42
_NEAR_FAR = (1, 99)  # percentiles of the depth that the colours span


@dataclass(frozen=True)
class Tile:
    """A frame made small, so that a sheet of many takes little memory.

    caption : above it. pictures : (h, w, 3) uint8 RGB each. depth : (h, w) float32 m, 0 = none; its colours are those of the
    whole sheet. fault : why there is nothing to show.
    """

    caption: str
    pictures: tuple[Array, ...] = ()
    depth: Array | None = None
    fault: str = ""


def tile(caption: str, data: Frame | Cloud | Image, mask: Bools | None = None) -> Tile:
    """A frame made small: its colour with the outline of the mask, and its depth; a cloud along the axis of its least spread."""
    if isinstance(data, Cloud):
        return Tile(caption, (_small(backdrop_of(replace(data, viewpoint=None)).image, cv2.INTER_AREA),))
    color = data.color
    pictures = () if color is None else (_outlined(_small(color, cv2.INTER_AREA), mask),)
    # nearest, for a mean of near and far is nowhere
    return Tile(caption, pictures, _small(data.depth, cv2.INTER_NEAREST) if isinstance(data, Frame) else None)


def sheet(title: str, tiles: Sequence[Tile]) -> Array:
    """(H, WIDTH, 3) uint8 RGB: the tiles in rows, and, where there is depth, what its colours mean."""
    measured = [seen.depth[seen.depth > 0] for seen in tiles if seen.depth is not None]
    known = np.concatenate(measured) if measured else np.zeros(0)
    near, far = np.percentile(known, _NEAR_FAR).tolist() if len(known) else (0.0, 0.0)
    drawn = [_drawn(seen, near, far) for seen in tiles]
    picture = np.full((_HEAD + 2 * _GAP, WIDTH, 3), _GROUND, np.uint8)
    _write(picture, title, _GAP, _GAP + _LINE, LIGHT)
    if len(known):
        _scale(picture, near, far)
    wide = max((one.shape[1] for one in drawn), default=WIDTH) + _GAP
    columns = max((WIDTH - _GAP) // wide, 1)
    rows = [_row(drawn[i : i + columns], wide) for i in range(0, len(drawn), columns)]
    return np.vstack([picture, *rows])


def _row(drawn: Sequence[Array], wide: int) -> Array:
    row = np.full((max(one.shape[0] for one in drawn) + _GAP, WIDTH, 3), _GROUND, np.uint8)
    for i, one in enumerate(drawn):
        left = _GAP + i * wide
        row[: one.shape[0], left : left + one.shape[1]] = one
    return row


def _drawn(seen: Tile, near: float, far: float) -> Array:
    """The caption above the pictures, side by side."""
    pictures = [*seen.pictures, *([] if seen.depth is None else [depth_colors(seen.depth, near, far)])]
    if seen.fault:
        blank = np.full((_BOX[1] // 2, _BOX[0], 3), (44, 30, 32), np.uint8)
        wide = int(_BOX[0] / cv2.getTextSize("n", _FONT, _SIZE, 1)[0][0])
        lines = textwrap.wrap(seen.fault, wide, break_long_words=True)
        for i, line in enumerate(lines[: blank.shape[0] // _LINE - 1]):
            _write(blank, line, 6, _LINE * (i + 1) + 4, _FAULT)
        pictures = [blank]
    height = max((one.shape[0] for one in pictures), default=0)
    wide = sum(one.shape[1] for one in pictures)
    drawn = np.full((_CAPTION + height, max(wide, _BOX[0]), 3), _GROUND, np.uint8)
    _write(drawn, seen.caption, 0, _LINE, LIGHT)
    left = 0
    for one in pictures:
        drawn[_CAPTION : _CAPTION + one.shape[0], left : left + one.shape[1]] = one
        left += one.shape[1]
    return drawn


def depth_colors(depth: Array, near: float, far: float) -> Array:
    """(H, W) m, 0 = none -> (H, W, 3) uint8 RGB: red is near, blue is far, black is none."""
    share = np.clip((far - depth) / max(far - near, 1e-6), 0, 1)
    colors = cv2.applyColorMap(np.rint(15 + 225 * share).astype(np.uint8), cv2.COLORMAP_TURBO)[:, :, ::-1].copy()
    colors[~(depth > 0)] = _EMPTY
    return np.asarray(colors)


def _scale(picture: Array, near: float, far: float) -> None:
    """The colours of the depth from near to far, at the right of the title."""
    bar = depth_colors(np.tile(np.linspace(near, far, 200, dtype=np.float32), (12, 1)), near, far)
    left, top = WIDTH - _GAP - 360, _GAP + 5
    picture[_GAP : _GAP + _HEAD, left - 8 :] = _GROUND
    _write(picture, f"{near:.3g} m", left, _GAP + _LINE, LIGHT)
    picture[top : top + 12, left + 70 : left + 270] = bar
    _write(picture, f"{far:.3g} m", left + 280, _GAP + _LINE, LIGHT)


def _small(image: Array, how: int) -> Array:
    height, width = image.shape[:2]
    share = min(_BOX[0] / width, _BOX[1] / height, 1.0)
    return np.asarray(cv2.resize(image, (max(1, round(width * share)), max(1, round(height * share))), interpolation=how))


def _outlined(picture: Array, mask: Bools | None) -> Array:
    if mask is None:
        return picture
    small = cv2.resize(mask.astype(np.uint8), picture.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(small, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return np.asarray(cv2.drawContours(picture.copy(), outlines, -1, CHAINS[2], 1))


def _write(picture: Array, text: str, left: int, base: int, color: Rgb) -> None:
    plain = text.encode("ascii", "replace").decode()  # OpenCV's font has no other letters
    cv2.putText(picture, plain, (left, base), _FONT, _SIZE, color, 1, cv2.LINE_AA)
