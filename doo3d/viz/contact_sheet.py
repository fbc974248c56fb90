"""Draw a contact sheet: frames of a capture side by side, each with color and depth, or a picture of its cloud."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..types import Array, Bools, Cloud, Frame, Image
from .backdrop import backdrop_of
from .palette import CHAINS, LIGHT, Rgb

WIDTH = 1600  # px, of the sheet
_MAX_SIZE = (384, 288)  # (width, height) px of a picture
_GAP, _CAPTION_HEIGHT, _TITLE_HEIGHT, _LINE_HEIGHT = 12, 22, 20, 16  # px
_BACKGROUND: Rgb = (24, 26, 32)
_NO_DEPTH: Rgb = (0, 0, 0)
_ERROR_BACKGROUND: Rgb = (44, 30, 32)
_ERROR_TEXT: Rgb = (255, 150, 130)
_FONT, _FONT_SCALE = cv2.FONT_HERSHEY_SIMPLEX, 0.42
_DEPTH_PERCENTILES = (1, 99)  # span of the colors of depth


@dataclass(frozen=True)
class Tile:
    """One frame on a contact sheet, scaled down so that a sheet of many frames takes little memory.

    Attributes
    ----------
    caption
        text above the pictures.
    pictures
        (h, w, 3) uint8 RGB each, drawn side by side.
    depth
        (h, w) float32 m, 0 = none, drawn beside the pictures with one color scale for the whole sheet; None without depth.
    error
        why the frame cannot be shown, drawn instead of the pictures; empty if the frame can be shown.
    """

    caption: str
    pictures: tuple[Array, ...] = ()
    depth: Array | None = None
    error: str = ""


def make_tile(caption: str, data: Frame | Cloud | Image, mask: Bools | None = None) -> Tile:
    """Return one frame as a tile of a contact sheet, with each picture scaled down to at most 384 x 288 px.

    A frame is shown by its color and its depth, an image by its color, a cloud by a picture along the axis in which its points
    spread least.

    Parameters
    ----------
    caption
        text above the pictures.
    data
        the frame, image or cloud.
    mask
        (H, W) bool, outlined on the color; None for no outline. Ignored for a cloud.
    """
    if isinstance(data, Cloud):
        return Tile(caption, (scaled_down(backdrop_of(replace(data, viewpoint=None)).image, cv2.INTER_AREA),))
    color = data.color
    pictures = () if color is None else (_outlined(scaled_down(color, cv2.INTER_AREA), mask),)
    # nearest: the mean of a near and a far depth is the depth of neither
    return Tile(caption, pictures, scaled_down(data.depth, cv2.INTER_NEAREST) if isinstance(data, Frame) else None)


def draw_sheet(title: str, tiles: Sequence[Tile]) -> Array:
    """Draw a contact sheet: a title, then the tiles in rows.

    If any tile has a depth, the color scale of depth is drawn at the right of the title. It spans the 1st to the 99th percentile
    of the depths of all tiles.

    Parameters
    ----------
    title
        one line of text.
    tiles
        the tiles, drawn row by row.

    Returns
    -------
    (H, 1600, 3) uint8 RGB
        as high as the tiles need.
    """
    measured = [tile.depth[tile.depth > 0] for tile in tiles if tile.depth is not None]
    depths = np.concatenate(measured) if measured else np.zeros(0)
    near, far = np.percentile(depths, _DEPTH_PERCENTILES).tolist() if len(depths) else (0.0, 0.0)
    drawn = [_draw_tile(tile, near, far) for tile in tiles]
    picture = np.full((_TITLE_HEIGHT + 2 * _GAP, WIDTH, 3), _BACKGROUND, np.uint8)
    _write(picture, title, _GAP, _GAP + _LINE_HEIGHT, LIGHT)
    if len(depths):
        _draw_scale(picture, near, far)
    tile_width = max((picture.shape[1] for picture in drawn), default=WIDTH) + _GAP
    columns = max((WIDTH - _GAP) // tile_width, 1)
    rows = [_row(drawn[i : i + columns], tile_width) for i in range(0, len(drawn), columns)]
    return np.vstack([picture, *rows])


def _row(drawn: Sequence[Array], tile_width: int) -> Array:
    row = np.full((max(picture.shape[0] for picture in drawn) + _GAP, WIDTH, 3), _BACKGROUND, np.uint8)
    for i, picture in enumerate(drawn):
        left = _GAP + i * tile_width
        row[: picture.shape[0], left : left + picture.shape[1]] = picture
    return row


def _draw_tile(tile: Tile, near: float, far: float) -> Array:
    """Draw the caption above the pictures, which are side by side."""
    pictures = [*tile.pictures, *([] if tile.depth is None else [depth_colors(tile.depth, near, far)])]
    if tile.error:
        blank = np.full((_MAX_SIZE[1] // 2, _MAX_SIZE[0], 3), _ERROR_BACKGROUND, np.uint8)
        columns = int(_MAX_SIZE[0] / cv2.getTextSize("n", _FONT, _FONT_SCALE, 1)[0][0])
        lines = textwrap.wrap(tile.error, columns, break_long_words=True)
        for i, line in enumerate(lines[: blank.shape[0] // _LINE_HEIGHT - 1]):
            _write(blank, line, 6, _LINE_HEIGHT * (i + 1) + 4, _ERROR_TEXT)
        pictures = [blank]
    height = max((picture.shape[0] for picture in pictures), default=0)
    tile_width = sum(picture.shape[1] for picture in pictures)
    drawn = np.full((_CAPTION_HEIGHT + height, max(tile_width, _MAX_SIZE[0]), 3), _BACKGROUND, np.uint8)
    _write(drawn, tile.caption, 0, _LINE_HEIGHT, LIGHT)
    left = 0
    for picture in pictures:
        drawn[_CAPTION_HEIGHT : _CAPTION_HEIGHT + picture.shape[0], left : left + picture.shape[1]] = picture
        left += picture.shape[1]
    return drawn


def depth_colors(depth: Array, near: float, far: float) -> Array:
    """Return a depth image in colors, (H, W, 3) uint8 RGB: red is near, blue is far, black is no depth.

    Parameters
    ----------
    depth
        (H, W) m, 0 = none.
    near, far
        depths in m at the two ends of the color scale; nearer and farther pixels get the color of that end.
    """
    share = np.clip((far - depth) / max(far - near, 1e-6), 0, 1)
    colors = cv2.applyColorMap(np.rint(15 + 225 * share).astype(np.uint8), cv2.COLORMAP_TURBO)[:, :, ::-1].copy()
    colors[~(depth > 0)] = _NO_DEPTH
    return np.asarray(colors)


def _draw_scale(picture: Array, near: float, far: float) -> None:
    """Draw the color scale of depth, from near to far, at the right of the title."""
    bar = depth_colors(np.tile(np.linspace(near, far, 200, dtype=np.float32), (12, 1)), near, far)
    left, top = WIDTH - _GAP - 360, _GAP + 5
    picture[_GAP : _GAP + _TITLE_HEIGHT, left - 8 :] = _BACKGROUND
    _write(picture, f"{near:.3g} m", left, _GAP + _LINE_HEIGHT, LIGHT)
    picture[top : top + 12, left + 70 : left + 270] = bar
    _write(picture, f"{far:.3g} m", left + 280, _GAP + _LINE_HEIGHT, LIGHT)


def scaled_down(image: Array, interpolation: int = cv2.INTER_AREA) -> Array:
    """Return an image (H, W) or (H, W, 3) scaled down to the size of a picture of a tile, at most 384 x 288 px."""
    height, width = image.shape[:2]
    scale = min(_MAX_SIZE[0] / width, _MAX_SIZE[1] / height, 1.0)
    return np.asarray(
        cv2.resize(image, (max(1, round(width * scale)), max(1, round(height * scale))), interpolation=interpolation)
    )


def _outlined(picture: Array, mask: Bools | None) -> Array:
    if mask is None:
        return picture
    small = cv2.resize(mask.astype(np.uint8), picture.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(small, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return np.asarray(cv2.drawContours(picture.copy(), outlines, -1, CHAINS[2], 1))


def _write(picture: Array, text: str, left: int, base: int, color: Rgb) -> None:
    ascii_text = text.encode("ascii", "replace").decode()  # OpenCV's font has only ASCII
    cv2.putText(picture, ascii_text, (left, base), _FONT, _FONT_SCALE, color, 1, cv2.LINE_AA)
