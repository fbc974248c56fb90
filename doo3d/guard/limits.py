"""Limit the sizes that files announce; they are checked before memory is allocated."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from ..errors import InputError

DEFAULT_MAX_PIXELS = 1 << 27
"""Greatest number of pixels of an image, above those of depth cameras and 100-megapixel photographs; such a frame takes 4 GB."""

DEFAULT_MAX_POINTS = 16_000_000
"""Greatest number of points of a cloud; with the memory of its reader, they take 2 GB."""


@dataclass(frozen=True)
class Limits:
    """The greatest sizes of data that are read.

    Attributes
    ----------
    max_pixels
        greatest number of pixels of an image, width times height.
    max_points
        greatest number of points of a cloud, as announced by its file.
    """

    max_pixels: int = DEFAULT_MAX_PIXELS
    max_points: int = DEFAULT_MAX_POINTS


DEFAULT = Limits()
_current: ContextVar[Limits] = ContextVar("doo3d_limits", default=DEFAULT)


def current_limits() -> Limits:
    """Return the limits in effect: those of the innermost `limited` block, or the defaults."""
    return _current.get()


@contextmanager
def limited(limits: Limits) -> Iterator[None]:
    """Apply `limits` to everything that is read in a `with` block."""
    token = _current.set(limits)
    try:
        yield
    finally:
        _current.reset(token)


def check_pixels(width: int, height: int, where: str) -> None:
    """Raise InputError if an image announces more pixels than allowed; `where` is the file, named in the error."""
    _check(width * height, _current.get().max_pixels, f"{where}: announces {width}x{height} pixels", "max_pixels")


def check_points(count: int, where: str) -> None:
    """Raise InputError if a cloud announces more points than allowed; `where` is the file, named in the error."""
    _check(count, _current.get().max_points, f"{where}: announces {count} points", "max_points")


def _check(count: int, limit: int, sentence: str, setting: str) -> None:
    if count > limit:
        raise InputError(
            f"{sentence}, and input.{setting} allows {limit}: the file is damaged, or raise the limit with "
            f"--set input.{setting}={count}",
            code="size-too-large",
        )
