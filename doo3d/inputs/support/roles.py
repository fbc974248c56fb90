"""Roles of images (depth, color, mask) by the words in the names of files and folders, and by their content."""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Literal

from .arrays import array_header
from .images import DEPTH_SUFFIXES

Role = Literal["depth", "color", "mask"]
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_DEPTH = {"depth", "depths"}
_COLOR = {"color", "colors", "colour", "rgb", "bgr", "image", "images", "img", "imgs", "photo"}
_MASK = {"mask", "masks", "seg", "segmentation"}
_PREVIEW = {"preview", "colormap", "colorized", "colored", "vis", "viz", "visualization", "pseudo"}
_OTHER = {"aligned", "registered", "raw", "to"}  # as in aligned_depth_to_color; no part of the frame's name
_ROLE_WORDS = _DEPTH | _COLOR | _MASK | _OTHER
_PNG = b"\x89PNG\r\n\x1a\n"
_MIN_SIDE_PX = 16  # of an array that is an image


def words_of(name: str) -> list[str]:
    """Return the words in a name, in lower case: aligned_depth-02 and AlignedDepth02 have the words aligned and depth."""
    return [word.lower() for word in _WORD.findall(name)]


def role_of(name: str) -> Role | None:
    """Return the role that the words of a name give an image or a folder of images; None without such a word.

    A name with both depth and color in it is of depth (aligned_depth_to_color), a colored preview of depth has no role.
    """
    words = set(words_of(name))
    if words & _MASK:
        return "mask"
    if words & _DEPTH:
        return None if words & _PREVIEW else "depth"
    return "color" if words & _COLOR else None


def frame_key(stem: str) -> str:
    """Return the part of a file name that depth, color and mask of a frame share: 000 of 000_depth, frame_0 of frame_0.depth."""
    rest = _WORD.sub(lambda word: "" if word[0].lower() in _ROLE_WORDS else word[0], stem)
    return re.sub(r"([-_. ])[-_. ]+", r"\1", rest).strip("-_. ")


def is_depth_content(file: Path) -> bool:
    """Return whether a file begins like a depth image: a 16-bit PNG of one channel, or a 2-D array of numbers (.npy)."""
    if file.suffix.lower() == ".npy":
        return _is_depth_array(file)
    with file.open("rb") as opened:
        head = opened.read(26)
    return head.startswith(_PNG) and len(head) == 26 and head[24:26] == b"\x10\x00"


def may_be_depth(file: Path) -> bool:
    """Return whether a file whose name says depth can be a depth image: neither an 8-bit PNG nor a JPEG, which are previews."""
    suffix = file.suffix.lower()
    return suffix in DEPTH_SUFFIXES and suffix not in (".jpg", ".jpeg", ".bmp") and (suffix != ".png" or not _is_8_bit(file))


def _is_8_bit(file: Path) -> bool:
    with file.open("rb") as opened:
        head = opened.read(26)
    return head.startswith(_PNG) and len(head) == 26 and struct.unpack_from("B", head, 24)[0] <= 8


def _is_depth_array(file: Path) -> bool:
    try:
        shape, _, dtype = array_header(file)
    except (ValueError, EOFError, OSError):
        return False
    sides = shape[:2] if len(shape) == 2 or (len(shape) == 3 and shape[2] == 1) else (0,)
    return min(sides) >= _MIN_SIDE_PX and dtype.kind in "uif" and dtype.itemsize > 1
