"""Convert ROS messages to images and clouds: sensor_msgs/Image, CompressedImage, PointCloud2."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ...errors import InputError
from ...guard.limits import check_pixels, check_points
from ...types import Array
from ..support.arrays import to_metres
from ..support.images import decode_image
from .rvl import decode_rvl, rvl_size

DEPTH = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}
_TO_RGB: dict[str, tuple[int, int | None]] = {  # channels, OpenCV's conversion
    "rgb8": (3, None),
    **dict.fromkeys(("8UC3", "bgr8"), (3, cv2.COLOR_BGR2RGB)),
    "rgba8": (4, cv2.COLOR_RGBA2RGB),
    **dict.fromkeys(("bgra8", "8UC4"), (4, cv2.COLOR_BGRA2RGB)),
    **dict.fromkeys(("mono8", "8UC1"), (1, cv2.COLOR_GRAY2RGB)),
    # ROS names a Bayer pattern by its first two pixels of the first row and of the second, OpenCV by the diagonal one in
    "bayer_rggb8": (1, cv2.COLOR_BayerRGGB2RGB),
    "bayer_bggr8": (1, cv2.COLOR_BayerBGGR2RGB),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGBRG2RGB),
    "bayer_grbg8": (1, cv2.COLOR_BayerGRBG2RGB),
    **dict.fromkeys(("yuv422", "uyvy"), (2, cv2.COLOR_YUV2RGB_UYVY)),
    **dict.fromkeys(("yuv422_yuy2", "yuyv"), (2, cv2.COLOR_YUV2RGB_YUY2)),
}
_TRANSPORT, _PNG16 = "compressedDepth", "compressed 16-bit PNG"
_GREY = ("mono8", "8UC1")
_DEPTH_HEADER = struct.Struct("<iff")  # before the image in compressedDepth: compression format, two parameters
_FIELDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}  # sensor_msgs/PointField


def encoding_of(message: Any) -> str:
    """Return the encoding of an image message (sensor_msgs Image or CompressedImage).

    For an Image it is the message's field `encoding`, such as "16UC1" or "rgb8". For a CompressedImage it is one of three:
    "compressedDepth" (of ROS's compressed_depth_image_transport), "compressed 16-bit PNG", and "compressed" for everything else,
    such as JPEG.
    """
    if hasattr(message, "encoding"):
        return str(message.encoding)
    if _TRANSPORT in message.format:
        return _TRANSPORT
    head = bytes(message.data[:26])  # of a PNG: bits per channel, and 0 for gray, are the last two of these
    return _PNG16 if head.startswith(b"\x89PNG") and head[24:] == b"\x10\0" else "compressed"


def is_depth(encoding: str) -> bool:
    """Return whether an encoding, as from `encoding_of`, is one of depth images.

    True for 16UC1, mono16 and 32FC1 (of an Image), and for "compressedDepth" and "compressed 16-bit PNG" (of a CompressedImage).
    """
    return encoding in DEPTH or encoding in (_TRANSPORT, _PNG16)


def is_color(encoding: str) -> bool:
    """Return whether an encoding, as from `encoding_of`, is one of color or gray images that can be read.

    True for 8-bit RGB, BGR, gray, Bayer and YUV 4:2:2 encodings (of an Image), and for "compressed" (of a CompressedImage).
    """
    return encoding in _TO_RGB or encoding.lower() in _TO_RGB or encoding == "compressed"


def is_gray(encoding: str) -> bool:
    """Return whether an encoding is one of gray images, "mono8" or "8UC1"; false for compressed images."""
    return encoding in _GREY


def size_of(message: Any) -> tuple[int, int]:
    """Return (width, height) of an image message in px; a compressed image is decompressed for it.

    Raises
    ------
    InputError : a compressed image is damaged or cut off.
    """
    if hasattr(message, "encoding"):
        return int(message.width), int(message.height)
    is_transport = encoding_of(message) == _TRANSPORT
    data = _after_header(message)[1] if is_transport else bytes(message.data)
    if is_transport and _is_rvl(message):
        return rvl_size(data)
    image = _decompress(data)
    return int(image.shape[1]), int(image.shape[0])


def depth_of(message: Any, scale: float) -> Array:
    """Return the depth in an image message, (H, W) float32 m along the optical axis; 0 or NaN = none.

    If the pixels are 16-bit integers, `scale` is their number of units per metre; ROS prescribes 1000 (millimetres, REP 118). If
    they are floats, they are in metres and `scale` is ignored.

    Raises
    ------
    InputError : the image is no depth image, or incomplete.
    """
    encoding = encoding_of(message)
    if encoding in (_PNG16, "compressed"):
        image = _decompress(bytes(message.data))
    elif encoding == _TRANSPORT:
        image = _compressed_depth(message)
    else:
        image = _rows(message, 1, DEPTH.get(encoding))[:, :, 0]
    if image.ndim != 2 or image.dtype == np.uint8:
        sentence = f"a depth image is of {image.dtype} and shape {image.shape}: is it a colored preview of the depth?"
        raise InputError(sentence, code="depth-type")
    return to_metres(image, scale)


def _compressed_depth(message: Any) -> Array:
    """Decode compressed_depth_image_transport: 16UC1 as stored, 32FC1 as a / (value - b) with a, b of the header; 0 = none."""
    (_, a, b), data = _after_header(message)
    image = decode_rvl(data) if _is_rvl(message) else _decompress(data)
    if not message.format.startswith("32FC1") or image.dtype != np.uint16 or image.ndim != 2:
        return image
    with np.errstate(divide="ignore"):
        return np.where(image > 0, np.float32(a) / (image.astype(np.float32) - np.float32(b)), 0).astype(np.float32)


def _after_header(message: Any) -> tuple[tuple[int, float, float], bytes]:
    """Return the header of compressed_depth_image_transport and the image after it, a PNG or RVL."""
    data = bytes(message.data)
    if len(data) < _DEPTH_HEADER.size:
        raise InputError("a compressed depth image is cut off", code="message-damaged")
    if not _is_rvl(message) and not data.startswith(b"\x89PNG", _DEPTH_HEADER.size):
        sentence = f"a compressed depth image ({message.format}) is neither PNG nor RVL, other compressions cannot be read"
        raise InputError(sentence, code="encoding-unsupported")
    return _DEPTH_HEADER.unpack_from(data), data[_DEPTH_HEADER.size :]


def _is_rvl(message: Any) -> bool:
    return "rvl" in message.format.lower()


def color_of(message: Any) -> Array:
    """Return the color of an image message, (H, W, 3) uint8 RGB; a gray image gets three equal channels.

    Raises
    ------
    InputError : the encoding is unknown, or the image is incomplete.
    """
    encoding = encoding_of(message)
    if encoding == "compressed":
        image = _decompress(bytes(message.data))
        if image.dtype != np.uint8:
            raise InputError(f"a compressed color image is of {image.dtype}, expected 8 bits", code="color-type")
        conversion = {2: cv2.COLOR_GRAY2RGB}.get(image.ndim, cv2.COLOR_BGR2RGB)
        return np.asarray(cv2.cvtColor(image[:, :, :3] if image.ndim == 3 else image, conversion))
    layout = _TO_RGB.get(encoding) or _TO_RGB.get(encoding.lower())
    if layout is None:
        sentence = f"color images of encoding {encoding!r} cannot be read; known are {', '.join(_TO_RGB)}"
        raise InputError(sentence, code="encoding-unsupported")
    channels, to_rgb = layout
    image = _rows(message, channels, np.uint8)
    image = image if channels > 1 else image[:, :, 0]
    try:
        return image if to_rgb is None else np.asarray(cv2.cvtColor(np.ascontiguousarray(image), to_rgb))
    except cv2.error as error:
        sentence = f"an image of {message.width}x{message.height} does not fit the encoding {encoding} ({error.err})"
        raise InputError(sentence, code="color-shape") from None


def _rows(message: Any, channels: int, dtype: Any) -> Array:
    """Return the pixels of an Image, (H, W, channels), without the padding of its rows."""
    if dtype is None:
        sentence = f"depth images of encoding {message.encoding!r} cannot be read; known are {', '.join(DEPTH)}"
        raise InputError(sentence, code="encoding-unsupported")
    kind = np.dtype(dtype).newbyteorder(">" if message.is_bigendian else "<")
    height, width, step = message.height, message.width, message.step
    check_pixels(width, height, "an image")
    used = width * channels * kind.itemsize
    data = np.asarray(message.data, dtype=np.uint8)
    if not height or not width or step < used or data.size < step * (height - 1) + used:
        held = f"an image of {width}x{height} and encoding {message.encoding} has {data.size} bytes, rows of {step}"
        raise InputError(f"{held}: it is incomplete", code="message-damaged")
    rows = np.ascontiguousarray(np.lib.stride_tricks.as_strided(data, (height, used), (step, 1)))
    return np.asarray(rows.view(kind).astype(dtype).reshape(height, width, channels))


def _decompress(data: bytes) -> Array:
    try:
        return decode_image(Path("a compressed image"), cv2.IMREAD_UNCHANGED, data)
    except InputError as error:
        if error.code == "size-too-large":
            raise
        raise InputError("a compressed image is damaged or cut off", code="message-damaged") from None


def cloud_of(message: Any) -> tuple[Array, Array | None]:
    """Return the points and colors of a PointCloud2 message; points that are not finite are left out.

    Returns
    -------
    (points, colors): the N points left, (N, 3) float64 m, in the coordinate frame that the message's header names, and their
    colors, (N, 3) uint8 RGB, or None if the message has no colors.

    Raises
    ------
    InputError : the cloud has no x, y, z, or fewer bytes than declared.
    """
    order = ">" if message.is_bigendian else "<"
    fields = {each.name: (order + _FIELDS[each.datatype], each.offset) for each in message.fields if each.datatype in _FIELDS}
    if not {"x", "y", "z"} <= set(fields):
        raise InputError(f"a cloud has the fields {', '.join(fields) or 'none'}, expected x, y and z", code="points-missing")
    height, width, step = message.height, message.width, message.point_step
    data, row = np.asarray(message.data, dtype=np.uint8), message.row_step or step * width
    if not width or not height:
        return np.zeros((0, 3)), None
    is_short = any(offset + np.dtype(kind).itemsize > step for kind, offset in fields.values())
    if is_short or row < step * width or data.size < row * (height - 1) + step * width:
        sentence = f"a cloud of {width}x{height} points of {step} bytes has {data.size} bytes: it is incomplete"
        raise InputError(sentence, code="message-damaged")
    check_points(width * height, "a cloud")
    names = [name for name in ("x", "y", "z", "rgb", "rgba") if name in fields]
    names += [name for name in ("r", "g", "b") if name in fields and fields[name][0][1:] == "u1"]
    formats, offsets = zip(*(fields[name] for name in names), strict=True)
    layout = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": step})
    rows = np.lib.stride_tricks.as_strided(data, (height, step * width), (row, 1))
    cells = np.frombuffer(rows.tobytes(), layout)
    with np.errstate(invalid="ignore"):  # signalling NaN
        points = np.stack([cells[axis].astype(float) for axis in "xyz"], axis=1)
    finite = np.isfinite(points).all(axis=1)
    colors = _colors(cells, order)
    return points[finite], None if colors is None else colors[finite]


def _colors(cells: Array, order: str) -> Array | None:
    """Return (N, 3) uint8 from fields r, g, b, or from 0x00RRGGBB in four bytes, which PCL declares as a float; or None."""
    names = cells.dtype.names or ()
    packed = next((name for name in ("rgb", "rgba") if name in names), None)
    if packed is None or cells[packed].dtype.itemsize != 4:
        return np.stack([cells[c] for c in "rgb"], axis=1) if {"r", "g", "b"} <= set(names) else None
    value = np.ascontiguousarray(cells[packed]).view(order + "u4")
    return np.stack([value >> 16 & 255, value >> 8 & 255, value & 255], axis=1).astype(np.uint8)
