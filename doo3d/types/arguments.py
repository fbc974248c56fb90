"""Check arguments: each function returns the value in the type used by doo3d, or raises an error with a clear sentence."""

import math
import numbers as abstract
import operator
import os
from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..errors import ArgumentError, InputError
from ..guard.limits import current_limits
from .arrays import Array, Floats

T = TypeVar("T")

MAX_NAME_BYTES = 255
"""Greatest length in bytes of the name of a file or folder, on every usual file system."""

LIMIT_VALUES = 3 * 2**40
"""Number of values that no memory can hold; a larger array must be a broadcast one."""


def refused(value: object, what: str, expected: str) -> ArgumentError:
    """Return the error for an argument of the wrong type; what : name of the argument, expected : the accepted types."""
    return ArgumentError(f"{what} is a {type(value).__name__}, expected {expected}", code="argument-type")


def number(value: Any, what: str, code: str = "value-invalid") -> float:
    """Return a real number as a float, which may be infinite or NaN.

    Parameters
    ----------
    value
        a number of Python or NumPy, or an array of one number without axes.
    what
        name of the argument, for errors.
    code
        code of the error for a number that is too large.
    """
    if isinstance(value, float):  # as almost all are: what follows takes three times as long
        return float(value)
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, abstract.Real) or isinstance(value, np.timedelta64):
        raise refused(value, what, "a number")
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{what} is larger than a number can be", code=code) from None


def probability(value: Any, what: str) -> float:
    """Check a number from 0 to 1, and return it as a float."""
    checked = number(value, what)
    if not 0 <= checked <= 1:
        raise InputError(f"{what} is {checked:g}, expected 0 to 1", code="value-out-of-bounds")
    return checked


def whole(value: Any, what: str) -> int:
    """Check a whole number, and return it as an int; a float without a fraction is accepted."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, float | np.floating) and math.isfinite(value) and value == int(value):
        return int(value)
    try:
        if not isinstance(value, np.timedelta64):
            return operator.index(value)
    except TypeError:
        pass
    raise refused(value, what, "a whole number")


def text(value: Any, what: str) -> str:
    """Check a string, and return it."""
    if not isinstance(value, str):
        raise refused(value, what, "a text")
    return value


def flag(value: Any, what: str) -> bool:
    """Check a boolean, and return it as a bool."""
    if not isinstance(value, bool | np.bool_ | int):
        raise refused(value, what, "True or False")
    return bool(value)


def file_path(value: Any, what: str) -> Path:
    """Check a path, which need not exist, and return it as a Path."""
    if not isinstance(value, str | PathLike) or isinstance(value, bytes):
        raise refused(value, what, "a path")
    if "\0" in str(value):
        raise InputError(f"{what} {str(value)!r}: there is no such file, since no path holds a null byte", code="file-missing")
    path = Path(value)
    if any(len(os.fsencode(part)) > MAX_NAME_BYTES for part in path.parts):
        raise InputError(f"{what} is {str(path)[:60]}..., longer than the name of a file can be", code="file-missing")
    return path


def timestamp(value: Any) -> float | None:
    """Check the time of a frame in s, and return it as a float; None stays None."""
    if value is None:
        return None
    if isinstance(value, np.datetime64 | np.timedelta64):
        raise refused(value, "timestamp", "seconds as a number, such as value.astype('datetime64[ns]').astype(float) / 1e9")
    seconds = number(value, "timestamp", "times-invalid")
    if not math.isfinite(seconds):
        raise InputError(f"timestamp is {seconds}, expected seconds as a finite number, or None", code="times-invalid")
    return seconds


def each(values: Any, kind: type[T], what: str) -> tuple[T, ...]:
    """Check that all values are of one type, and return them as a tuple.

    values : an iterable. kind : the type. what : name of the argument, for errors.
    """
    if isinstance(values, str | bytes | np.ndarray) or not isinstance(values, Iterable):
        raise refused(values, what, f"a sequence of {kind.__name__}")
    found = tuple(values)
    for position, value in enumerate(found):
        if not isinstance(value, kind):
            raise refused(value, f"{what}[{position}]", f"a {kind.__name__}")
    return found


def array(value: Any, what: str, code: str) -> Array:
    """Convert an argument to an array of any type; an array is returned without a copy.

    what : name of the argument, for errors. code : code of the error if it cannot be converted.
    """
    try:
        found = np.asarray(value)
    except Exception as error:  # such as lists of different lengths
        raise InputError(f"{what} is no array of numbers ({error})", code=code) from None
    if found.size > LIMIT_VALUES:
        raise InputError(f"{what} has {found.size} values, more than any memory holds", code="size-too-large")
    return found


def numbers(value: Any, what: str, shape: tuple[int | None, ...], code: str = "array-shape") -> Floats:
    """Convert an argument to a float64 array of a given shape.

    Parameters
    ----------
    value
        an array, or lists of numbers.
    what
        name of the argument, for errors.
    shape
        its shape; None for any number of rows.
    code
        code of the error for another shape or type.
    """
    found = array(value, what, code)
    fits = found.ndim == len(shape) and all(wanted in (None, size) for wanted, size in zip(shape, found.shape, strict=True))
    if not fits or found.dtype.kind not in "biuf":
        wanted = ", ".join("N" if size is None else str(size) for size in shape)
        raise InputError(
            f"{what} has shape {found.shape} and type {found.dtype}, expected numbers of shape ({wanted})", code=code
        )
    check_count(found.shape[0], current_limits().max_points, what, "rows")
    return found.astype(float, copy=False)


def check_image_size(image: Array, what: str) -> None:
    """Check that an image has no more pixels than can be read from a file; image : (H, W) or (H, W, channels)."""
    check_count(int(np.prod(image.shape[:2], dtype=object)), current_limits().max_pixels, what, "pixels")


def check_count(count: int, limit: int, what: str, of: str) -> None:
    """Raise an InputError if `count` is above `limit`.

    what : name of the argument. of : noun of the counted items, such as "points".
    """
    if count > limit:
        raise InputError(f"{what} has {count} {of}, and at most {limit} are allowed", code="size-too-large")
