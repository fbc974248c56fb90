"""Limits of announced sizes, checked before memory is taken."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from ..errors import InputError

DEFAULT_MAX_PIXELS = 1 << 27
"""Pixels of an image: more than any depth camera has, and than photographs of 100 megapixels; a frame of so many takes 4 GB."""

DEFAULT_MAX_POINTS = 16_000_000
"""Points of a cloud: with what its reader needs they take 2 GB."""


@dataclass(frozen=True)
class Limits:
    """The largest data that is read.

    Attributes
    ----------
    max_pixels
        pixels of an image, width times height.
    max_points
        points of a cloud, as its file announces them.
    """

    max_pixels: int = DEFAULT_MAX_PIXELS
    max_points: int = DEFAULT_MAX_POINTS


DEFAULT = Limits()
_current: ContextVar[Limits] = ContextVar("doo3d_limits", default=DEFAULT)


def current_limits() -> Limits:
    """Return the limits that hold here: those of the innermost `limited` block, or the defaults."""
    return _current.get()


@contextmanager
def limited(limits: Limits) -> Iterator[None]:
    """Let `limits` hold for everything that is read in a `with` block."""
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
