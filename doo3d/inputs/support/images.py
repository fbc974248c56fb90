"""Read image files with OpenCV; damage that OpenCV does not report (None or half an image) raises an error."""

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from ...errors import InputError
from ...guard.guarding import check_not_pointer, check_regular, guarded, read_bytes, read_head
from ...guard.image_size import MAX_SEGMENTS, announced_size, file_size, read_encoded
from ...guard.image_size import Size as Size
from ...guard.isolation import isolated
from ...guard.limits import check_pixels, current_limits
from ...types import Array, Bools
from ...types.arrays import fit_mask
from .arrays import SATURATED, array_header, read_color_array, read_depth_array, read_exr, to_metres
from .camera_files import read_camera_file
from .native_output import capture_native_output

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".bmp")
DEPTH_SUFFIXES = (*SUFFIXES, ".npy", ".raw")  # beside images: arrays that numpy.save wrote, depth of RealSense's Viewer
PHOTO_SUFFIXES = (*SUFFIXES, ".webp", ".avif", ".jp2", ".gif", ".heic", ".heif")
_PNG = b"\x89PNG\r\n\x1a\n"
_EXR = b"v/1\x01"
_JPEG = b"\xff\xd8\xff"
_SIGNATURES = re.compile(  # PNG, JPEG, TIFF, BMP, GIF, WebP, EXR, JPEG 2000, AVIF, HEIC
    rb"\x89PNG\r\n\x1a\n|\xff\xd8\xff|II[*+]\0|MM\0[*+]|BM|GIF8|RIFF....WEBP|v/1\x01|\0\0\0\x0cjP  |"
    rb"....ftyp(?:avi[fs]|he[iv][cx]|mif1)",
    re.DOTALL,
)
_HEIC = re.compile(rb"....ftyp(?:he[iv][cx]|mif1)", re.DOTALL)
_ANY_SIZE = re.compile(  # AVIF and JPEG 2000, whose data may unpack to more than the header says
    rb"....ftyp|\0\0\0\x0cjP  |\xffO\xffQ", re.DOTALL
)
_BASE_BYTES, _DECODED_BYTES = 1 << 28, 32  # that a decoder of those may take: at all, and for each pixel announced
_JPEG_MARKER = re.compile(rb"\xff[^\x00\x01\xd0-\xd7\xff]")  # among a JPEG's compressed data
_MAX_TRIED = 5  # images whose headers are read for their size; no more are damaged
_FEW_BITS = 1 << 14  # values below: cameras of 12 and 14 bits, and microscopes, stored in 16
_DARKEST = 0.01  # percent of the pixels that may be darker or brighter than the range: hot pixels
_COLOR = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH  # gray or BGR without alpha, at the bit depth of the file


def read_depth(path: Path, scale: float, array_scale: float | None = None) -> Array:
    """Read a depth image as metres along the optical axis, (H, W) float32; 0 or NaN = no measurement.

    If the pixels are 16-bit integers, `scale` is their number of units per metre, such as 1000 for millimetres. If they are
    floats, they have `array_scale` units per metre; None: metres. A NumPy array (.npy) may have integers of any size.

    Raises
    ------
    InputError : the file is missing or damaged, has several channels, or another type.
    """
    if path.suffix.lower() == ".npy":
        return read_depth_array(path, scale, array_scale or 1.0)
    if path.suffix.lower() == ".raw":
        return to_metres(_read_raw(path), scale)
    if path.suffix.lower() == ".exr":
        return to_metres(_read_exr(path), scale, array_scale or 1.0)
    image = decode_image(path, cv2.IMREAD_UNCHANGED)
    if image.ndim != 2:
        sentence = f"{path}: has {image.shape[2]} channels, expected one of depth: is it a colored preview of the depth?"
        raise InputError(sentence, code="depth-shape")
    if image.dtype not in (np.uint16, np.float32, np.float64):
        kind = f"an {image.dtype.itemsize * 8}-bit {image.dtype} image"
        expected = "16-bit depth (PNG) or 32-bit float metres (TIFF)"
        raise InputError(f"{path}: is {kind}, expected {expected}: is it a preview of the depth?", code="depth-type")
    return to_metres(image, scale, array_scale or 1.0)


def _read_exr(path: Path) -> Array:
    """Read the depth of an EXR image, decoded in the process for native readers after a check of its size."""
    check_regular(path)
    with guarded(path):
        head = read_head(path, 64)
    check_not_pointer(path, head)
    size = file_size(path)
    if not head.startswith(_EXR) or size is None:
        raise InputError(f"{path}: is no EXR image, or damaged", code="file-damaged")
    check_pixels(*size, str(path))
    return isolated(read_exr, path, where=str(path))


def raw_size_file(path: Path) -> Path:
    """Return the path of the metadata file of a RealSense Viewer snapshot, which has size and intrinsics of the raw depth."""
    return path.with_name(f"{path.stem}_metadata.csv")


def _raw_size(path: Path) -> Size:
    size = read_camera_file(raw_size_file(path))[0].size
    if size is None:
        raise InputError(f"{raw_size_file(path)}: has no Resolution x and Resolution y", code="intrinsics-missing")
    return size


def _read_raw(path: Path) -> Array:
    """Read the raw 16-bit depth (H, W) of a RealSense Viewer snapshot."""
    width, height = _raw_size(path)
    check_pixels(width, height, str(path))
    expected = 2 * width * height
    with guarded(path):
        data = read_bytes(path, expected)
    if len(data) != expected:
        sentence = f"{path}: has {len(data)} bytes, but 16-bit depth of {width}x{height} has {expected}: is it cut off?"
        raise InputError(sentence, code="file-damaged")
    return np.frombuffer(data, "<u2").reshape(height, width)


def image_size(path: Path) -> Size | None:
    """Read (width, height) px from the header of an image or an array (.npy); None if it cannot be read.

    The result is also None for a pipe, which may be endless.
    """
    if not path.is_file():
        return None
    try:
        if path.suffix.lower() == ".npy":
            shape = array_header(path)[0]
            return shape[1], shape[0]
        if path.suffix.lower() == ".raw":
            return _raw_size(path)
        return file_size(path)
    except (OSError, ValueError, IndexError, InputError):
        return None


def first_size(files: Sequence[Path]) -> Size | None:
    """Return (width, height) px of the first image whose header can be read; None if there is none.

    An image with more pixels than allowed counts as damaged; it is only used if all images are.
    """
    sizes = [size for size in map(image_size, files[:_MAX_TRIED]) if size is not None]
    return next((size for size in sizes if size[0] * size[1] <= current_limits().max_pixels), next(iter(sizes), None))


def is_image(path: Path) -> bool:
    """Return whether a file has the first bytes or the suffix of an image format (PNG, JPEG, ...); the file must exist."""
    return _SIGNATURES.match(read_head(path, 32)) is not None or path.suffix.lower() in PHOTO_SUFFIXES


def read_color(path: Path, upright: bool = False, data: bytes | None = None) -> Array:
    """Read a color image as (H, W, 3) uint8 RGB; a gray image gets three equal channels.

    Alpha and color profile are ignored. 16-bit values are scaled to 8 bits; floats from 0 to 1 are scaled to 0 to 255.

    Parameters
    ----------
    path
        the file; with `data`, only the name used in errors.
    upright
        whether to rotate the image by its EXIF orientation. If false, pixels stay as stored, to match a depth image beside it.
    data
        the encoded image, such as a member of an archive; None to read it from `path`.

    Raises
    ------
    InputError : the file is missing or damaged, or its values are neither 8 nor 16 bits nor floats from 0 to 1.
    """
    if data is None and path.suffix.lower() == ".npy":
        return read_color_array(path)
    image = _eight_bits(path, decode_image(path, _COLOR if upright else _COLOR | cv2.IMREAD_IGNORE_ORIENTATION, data))
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB))


def read_mask(path: Path, shape: tuple[int, ...], upright: bool = False) -> Bools:
    """Read a mask image as (H, W) bool: true (the object) where any channel but alpha is above zero.

    A mask whose size is wrong by one pixel is returned unchanged: FrameData crops or pads it, with a note.

    Parameters
    ----------
    path
        the file.
    shape
        (H, W) that the mask must have.
    upright
        whether to rotate the mask by its EXIF orientation. If false, pixels stay as stored.

    Raises
    ------
    InputError : the file is missing, damaged, of another size, or a JPEG, whose compression smears values round the object.
    """
    if path.suffix.lower() in (".jpg", ".jpeg"):
        sentence = f"{path}: is a JPEG, whose compression smears the edges of a mask: save the mask as PNG"
        raise InputError(sentence, code="mask-format")
    image = decode_image(path, _COLOR if upright else _COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    mask = np.asarray((image if image.ndim == 2 else image.max(axis=2)) > 0)
    if fit_mask(mask, shape)[0].shape != shape:
        rotated = ", rotated by its EXIF orientation" if upright and mask.shape == shape[::-1] else ""
        sizes = f"the mask is {mask.shape[1]}x{mask.shape[0]} but the image is {shape[1]}x{shape[0]}{rotated}"
        raise InputError(f"{path}: {sizes}: give the mask the size of the image", code="mask-shape")
    return mask


def scaled_range(image: Array) -> tuple[float, float]:
    """Return the values of a 16-bit image that become 0 and 255: the range of its type, or its own if it uses few bits."""
    low, high = np.percentile(image, (_DARKEST, 100 - _DARKEST)).tolist()
    return (low, high) if high < _FEW_BITS else (0, SATURATED)


def _eight_bits(path: Path, image: Array) -> Array:
    if image.dtype == np.uint8:
        return image
    if image.dtype == np.uint16:
        low, high = scaled_range(image)
        scale = 255 / max(high - low, 1)
        return np.asarray(cv2.convertScaleAbs(np.clip(image, int(low), int(high)), alpha=scale, beta=-low * scale))
    if np.issubdtype(image.dtype, np.floating) and ((image >= 0) & (image <= 1)).all():
        return np.asarray(cv2.convertScaleAbs(image, alpha=255.0))
    expected = "unsigned 8 or 16 bits, or floats from 0 to 1"
    raise InputError(f"{path}: is a {image.dtype} image, expected {expected}", code="color-type")


def decode_image(path: Path, flags: int, data: bytes | None = None) -> Array:
    """Decode an image with OpenCV's flags, from a file or from `data`; `path` is then only the name in errors.

    Raises
    ------
    InputError : the file is missing or damaged, is not an image, or announces too many pixels.
    """
    if data is None:
        data = read_encoded(path)
    if not data:
        raise InputError(f"{path}: is empty", code="file-empty")
    check_not_pointer(path, data[:64])
    damaged = InputError(f"{path}: is cut off or damaged: copy it again from where it was recorded", code="file-damaged")
    if data.startswith(_JPEG) and not _jpeg_ends(data):
        raise damaged
    size, image, text = announced_size(data), None, ""
    if size is not None:
        check_pixels(*size, str(path))
        memory = _BASE_BYTES + _DECODED_BYTES * size[0] * size[1]
        decode = partial(isolated, _decode, where=str(path), memory=memory) if _ANY_SIZE.match(data) else _decode
        image, text = decode(data, flags)
    if "premature end" in text.lower() or (image is None and (_PNG.startswith(data[:8]) or _JPEG.startswith(data[:3]))):
        raise damaged
    if image is None:
        if data.startswith(_EXR):
            sentence = f"{path}: is an EXR image, of which only depth is read: save color and masks as PNG"
            raise InputError(sentence, code="encoding-unsupported")
        if _HEIC.match(data):
            sentence = f"{path}: is a HEIC photo, which cannot be decoded: save it as JPEG or PNG"
            raise InputError(sentence, code="encoding-unsupported")
        reason = text.rpartition("\n")[2]
        raise InputError(f"{path}: cannot be read as an image" + (f" ({reason})" if reason else ""), code="image-unreadable")
    return np.asarray(image)


def _decode(data: bytes, flags: int) -> tuple[Array | None, str]:
    """Decode an image with OpenCV; return it, None on failure, and the messages of OpenCV and its libraries."""
    image, exception = None, ""
    with capture_native_output() as native:
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
        except cv2.error as error:
            exception = error.err
    return image, "\n".join(filter(None, (native.text, exception)))


def _jpeg_ends(data: bytes) -> bool:
    """Return whether a JPEG has its end marker; data that phones append (a video, a second image) is ignored."""
    at = 2
    for _ in range(MAX_SEGMENTS):
        if (marker := _JPEG_MARKER.search(data, at)) is None:
            return False
        at = marker.end()
        if data[at - 1] == 0xD9:
            return True
        at += int.from_bytes(data[at : at + 2], "big")  # skip the segment, which may hold a thumbnail with an end marker
    return False
