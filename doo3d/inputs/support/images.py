"""Image files through OpenCV, which gives None or half an image where it should complain: here it is said."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

import cv2
import numpy as np

from ...errors import InputError
from ...types import Array, Bools
from .native_output import capture_native_output

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".bmp")
PHOTO_SUFFIXES = (*SUFFIXES, ".webp", ".avif", ".jp2", ".gif", ".heic", ".heif")
_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8\xff"
_STARTS = re.compile(  # PNG, JPEG, TIFF, BMP, GIF, WebP, EXR, JPEG 2000, AVIF, HEIC
    rb"\x89PNG\r\n\x1a\n|\xff\xd8\xff|II[*+]\0|MM\0[*+]|BM|GIF8|RIFF....WEBP|v/1\x01|\0\0\0\x0cjP  |"
    rb"....ftyp(?:avi[fs]|he[iv][cx]|mif1)",
    re.DOTALL,
)
_HEIC = re.compile(rb"....ftyp(?:he[iv][cx]|mif1)", re.DOTALL)
_MARKER = re.compile(rb"\xff[^\x00\x01\xd0-\xd7\xff]")  # of a JPEG, among its compressed data
_COLOR = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH  # grey or BGR, transparency dropped, as many bits as there are


def read_depth(path: Path, scale: float) -> Array:
    """(H, W) float32 m, 0 or NaN = none, from a 16-bit image of `scale` units per metre or a 32-bit float one in metres.

    Raises
    ------
    InputError : not there, cut off, damaged, or neither of the two.
    """
    image = _decode(path, cv2.IMREAD_UNCHANGED)
    if image.ndim != 2:
        raise InputError(
            f"{path}: has {image.shape[2]} channels, expected one of depth: is it a picture of the depth?", code="depth-shape"
        )
    if image.dtype == np.uint16:
        return np.asarray(image / np.float32(scale), dtype=np.float32)
    if image.dtype in (np.float32, np.float64):
        return np.asarray(image, dtype=np.float32)
    raise InputError(
        f"{path}: is an {image.dtype.itemsize * 8}-bit {image.dtype} image, expected 16-bit depth (PNG) "
        "or 32-bit float metres (TIFF): is it a preview of the depth?",
        code="depth-type",
    )


def is_image(path: Path) -> bool:
    """Whether a file starts as images do, or failing that is called so."""
    with path.open("rb") as file:
        return _STARTS.match(file.read(32)) is not None or path.suffix.lower() in PHOTO_SUFFIXES


def read_color(path: Path, upright: bool = False, data: bytes | None = None) -> Array:
    """(H, W, 3) uint8 RGB; transparency and colour profile left aside, 16 bits scaled to 8, floats 0 to 1 to 0 to 255.

    upright : turned as the file's EXIF says; else as stored, for depth would not follow a turn.
    data : what the file holds, where it is not one of its own; `path` is then its name in errors.

    Raises
    ------
    InputError : not there, cut off or damaged, or neither 8 nor 16 bits nor floats from 0 to 1.
    """
    image = _eight_bits(path, _decode(path, _COLOR if upright else _COLOR | cv2.IMREAD_IGNORE_ORIENTATION, data))
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB))


def read_mask(path: Path, shape: tuple[int, ...], upright: bool = False) -> Bools:
    """(H, W) bool of the given shape, true where any channel but the transparency is above zero; `upright` as in `read_color`.

    Raises
    ------
    InputError : not there, cut off, damaged, of another size, or a JPEG, which smears values above zero round the object.
    """
    if path.suffix.lower() in (".jpg", ".jpeg"):
        raise InputError(f"{path}: a mask as JPEG has smeared edges: save it as PNG", code="mask-format")
    image = _decode(path, _COLOR if upright else _COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    mask = np.asarray((image if image.ndim == 2 else image.max(axis=2)) > 0)
    if mask.shape != shape:
        turned = ", turned as its EXIF may say" if upright and mask.shape == shape[::-1] else ""
        raise InputError(
            f"{path}: the mask is {mask.shape[1]}x{mask.shape[0]} but the image is {shape[1]}x{shape[0]}{turned}: "
            "give the mask the size of the image",
            code="mask-shape",
        )
    return mask


def _eight_bits(path: Path, image: Array) -> Array:
    if image.dtype == np.uint8:
        return image
    if image.dtype == np.uint16:
        return np.asarray(cv2.convertScaleAbs(image, alpha=255 / 65535))
    if np.issubdtype(image.dtype, np.floating) and ((image >= 0) & (image <= 1)).all():
        return np.asarray(cv2.convertScaleAbs(image, alpha=255.0))
    raise InputError(
        f"{path}: is a {image.dtype} image, expected 8 or 16 bits without sign, or floats from 0 to 1", code="color-type"
    )


def _decode(path: Path, flags: int, data: bytes | None = None) -> Array:
    try:
        data = path.read_bytes() if data is None else data
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror or error})",
            code="file-missing" if isinstance(error, FileNotFoundError) else "file-unreadable",
        ) from None
    _check_whole(path, data)
    image, refused = None, ""
    with capture_native_output() as said:
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
        except cv2.error as error:
            refused = error.err
    if "premature end" in said.text.lower():
        raise InputError(f"{path}: is cut off: copy it again from where it was recorded", code="file-damaged")
    if image is None:
        if _HEIC.match(data):
            raise InputError(
                f"{path}: is a HEIC photo, which cannot be read here: save it as JPEG or PNG", code="encoding-unsupported"
            )
        why = refused or said.text.rpartition("\n")[2]
        raise InputError(f"{path}: cannot be read as an image" + (f" ({why})" if why else ""), code="image-unreadable")
    return np.asarray(image)


def _check_whole(path: Path, data: bytes) -> None:
    if not data:
        raise InputError(f"{path}: is empty", code="file-empty")
    if data.startswith(_PNG):
        fault = _png_fault(data)
    elif data.startswith(_JPEG):
        fault = None if _jpeg_ends(data) else "cut off"
    elif _PNG.startswith(data[:8]) or _JPEG.startswith(data[:3]):
        fault = "cut off"
    else:
        fault = None
    if fault:
        raise InputError(f"{path}: is {fault}: copy it again from where it was recorded", code="file-damaged")


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


def _jpeg_ends(data: bytes) -> bool:
    """Whether a JPEG has its end marker; what phones append behind it (a film, a second picture) does not matter."""
    at = 2
    while (found := _MARKER.search(data, at)) is not None:
        at = found.end()
        if data[at - 1] == 0xD9:
            return True
        at += int.from_bytes(data[at : at + 2], "big")  # past the marker's own data, a thumbnail with its end marker say
    return False
