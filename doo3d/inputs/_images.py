"""Image files through OpenCV, which gives None or half an image where it should complain: here it is said."""

from __future__ import annotations

import zlib
from pathlib import Path

import cv2
import numpy as np

from ..errors import InputError
from ..types import Array, Bools
from ._quiet import listening

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".bmp")
_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8\xff"


def read_depth(path: Path, scale: float) -> Array:
    """(H, W) float32 m, 0 or NaN = none, from a 16-bit image of `scale` units per metre or a 32-bit float one in metres.

    Raises
    ------
    InputError : not there, cut off, damaged, or neither of the two.
    """
    image = _decode(path, cv2.IMREAD_UNCHANGED)
    if image.ndim != 2:
        raise InputError(f"{path}: has {image.shape[2]} channels, expected one of depth: is it a picture of the depth?")
    if image.dtype == np.uint16:
        return np.asarray(image / np.float32(scale), dtype=np.float32)
    if image.dtype in (np.float32, np.float64):
        return np.asarray(image, dtype=np.float32)
    raise InputError(
        f"{path}: is an {image.dtype.itemsize * 8}-bit {image.dtype} image, expected 16-bit depth (PNG) "
        "or 32-bit float metres (TIFF): is it a preview of the depth?"
    )


def read_color(path: Path) -> Array:
    """(H, W, 3) uint8 RGB, as stored: a rotation noted in the file is not applied, depth would not follow it.

    Raises
    ------
    InputError : not there, cut off or damaged.
    """
    image = _decode(path, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    return np.ascontiguousarray(image[:, :, ::-1])


def read_mask(path: Path) -> Bools:
    """(H, W) bool, true where any channel but the transparency is above zero.

    Raises
    ------
    InputError : not there, cut off, damaged, or a JPEG, which smears values above zero round the object.
    """
    if path.suffix.lower() in (".jpg", ".jpeg"):
        raise InputError(f"{path}: a mask as JPEG has smeared edges: save it as PNG")
    image = _decode(path, cv2.IMREAD_UNCHANGED)
    if image.ndim == 3:
        image = image[:, :, : 3 if image.shape[2] > 2 else 1].max(axis=2)
    return np.asarray(image > 0)


def _decode(path: Path, flags: int) -> Array:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    _check_whole(path, data)
    image, refused = None, ""
    with listening() as said:
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
        except cv2.error as error:
            refused = error.err
    if "premature end" in said.text.lower():
        raise InputError(f"{path}: is cut off: copy it again from where it was recorded")
    if image is None:
        why = refused or said.text.rpartition("\n")[2]
        raise InputError(f"{path}: cannot be read as an image" + (f" ({why})" if why else ""))
    return np.asarray(image)


def _check_whole(path: Path, data: bytes) -> None:
    if not data:
        raise InputError(f"{path}: is empty")
    if data.startswith(_PNG):
        fault = _png_fault(data)
    elif data.startswith(_JPEG):
        # some recorders pad the file to whole blocks
        fault = None if data.rstrip(b"\0").endswith(b"\xff\xd9") else "cut off"
    elif _PNG.startswith(data[:8]) or _JPEG.startswith(data[:3]):
        fault = "cut off"
    else:
        fault = None
    if fault:
        raise InputError(f"{path}: is {fault}: copy it again from where it was recorded")


def _png_fault(data: bytes) -> str | None:
    """What is wrong with the chunks of a PNG, by their lengths and checksums; None when nothing is."""
    at = len(_PNG)
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        end = at + 12 + length
        if end > len(data):
            return "cut off"
        if zlib.crc32(data[at + 4 : end - 4]) != int.from_bytes(data[end - 4 : end], "big"):
            return "damaged (a checksum does not fit)"
        if data[at + 4 : at + 8] == b"IEND":
            return None
        at = end
    return "cut off"
