"""Decode RVL, lossless depth images by A. D. Wilson, *Fast Lossless Depth Image Compression* (ACM ISS 2017).

An image is a run of zeros, a run of readings, and so on: the number of zeros, the number of readings, and for each reading its
difference d from the reading before, as 2 d or -2 d - 1. A number is written in nibbles of three bits, the lowest first, with
the fourth bit set if more follow. Nibbles fill 32-bit words from the highest bits.
"""

from __future__ import annotations

import struct

import numpy as np

from ...errors import InputError
from ...guard.limits import check_pixels
from ...types import Array

_SIZE = struct.Struct("<ii")  # before the words: width and height in px
_MAX_NIBBLES = 11  # of a number of 32 bits
_MAX_BYTES_PER_PIXEL = 4  # of an image of single readings: a nibble for each of two runs, and six for a difference of 17 bits


def rvl_size(data: bytes) -> tuple[int, int]:
    """Return (width, height) px of an RVL image, whose data follow ROS's compressedDepth header; InputError if cut off."""
    if len(data) < _SIZE.size:
        raise _damaged("it ends before its size")
    width, height = _SIZE.unpack_from(data)
    if min(width, height) < 1:
        raise _damaged(f"its size is {width}x{height}")
    check_pixels(width, height, "a depth image")
    return width, height


def decode_rvl(data: bytes) -> Array:
    """Decode an RVL image, whose data follow ROS's compressedDepth header: depth (H, W) uint16 as stored.

    Raises
    ------
    InputError : the image is cut off or damaged, or announces more pixels than are allowed.
    """
    width, height = rvl_size(data)
    count = width * height
    code = data[_SIZE.size : _SIZE.size + _MAX_BYTES_PER_PIXEL * count + 4]
    words = np.frombuffer(code[: len(code) // 4 * 4], "<u4").astype(">u4").view(np.uint8)
    nibbles = np.stack([words >> 4, words & 15], axis=1).ravel()
    numbers = _numbers(nibbles)
    zeros_before, readings, at, done = list[int](), list[slice](), 0, 0
    values = numbers.tolist()
    while done < count:
        if at + 1 >= len(values) or at + 2 + values[at + 1] > len(values):
            raise _damaged(f"it ends after {done} of {count} pixels")
        zeros_before.append(values[at])
        readings.append(slice(at + 2, at + 2 + values[at + 1]))
        done += values[at] + values[at + 1]
        at += 2 + values[at + 1]
    if done > count:
        raise _damaged(f"it has more than its {count} pixels")
    lengths = np.array([part.stop - part.start for part in readings])
    coded = np.concatenate([numbers[part] for part in readings])
    depth = np.cumsum(coded >> 1 ^ -(coded & 1)).astype(np.uint16)
    starts = np.cumsum(zeros_before) + np.cumsum(lengths) - lengths
    image = np.zeros(count, np.uint16)
    image[np.repeat(starts - (np.cumsum(lengths) - lengths), lengths) + np.arange(len(depth))] = depth
    return image.reshape(height, width)


def _numbers(nibbles: Array) -> Array:
    """Decode nibbles to the numbers (K,) int64 that they represent; an incomplete number at the end is left out."""
    last = np.flatnonzero(nibbles < 8)
    if not len(last):
        return np.zeros(0, np.int64)
    first = np.concatenate([[0], last[:-1] + 1])
    if (last - first >= _MAX_NIBBLES).any():
        raise _damaged("a number has more than 32 bits")
    nibbles = nibbles[: last[-1] + 1]
    place = np.arange(len(nibbles)) - np.repeat(first, last - first + 1)
    return np.add.reduceat((nibbles & 7).astype(np.int64) << 3 * place, first)


def _damaged(reason: str) -> InputError:
    return InputError(f"a depth image compressed with RVL is damaged: {reason}", code="message-damaged")
