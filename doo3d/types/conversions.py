"""What the user may give as data, converted to what the mode of the settings needs."""

import os
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..errors import ArgumentError, InputError
from .arguments import array
from .arrays import Array, Floats, fit_mask
from .data import Cloud, Frame, Image


class LoadedFrame(Protocol):
    """The data of one frame of a capture, such as `doo3d.inputs.FrameData`."""

    @property
    def data(self) -> Frame | Cloud | Image: ...

    @property
    def base_pose(self) -> Floats | None: ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    @property
    def mask_for(self) -> Callable[[Any], Array | None]: ...


@runtime_checkable
class FrameReference(Protocol):
    """A frame of a capture that is read when `load` is called, such as `capture[0]`."""

    @property
    def name(self) -> str: ...

    @property
    def source(self) -> os.PathLike[str]: ...

    def load(self) -> LoadedFrame: ...


def as_mode_data(data: Frame | Cloud | Image | Array, mode: str) -> Frame | Cloud | Image:
    """Convert the data to the form that a mode needs: an Image in 2-D, a Frame or a Cloud in 3-D.

    Parameters
    ----------
    data
        a Frame, a Cloud, an Image, or an array (H, W, 3) uint8 RGB, which counts as an Image. In 2-D a Frame is reduced to its
        color image.
    mode
        "2d" or "3d".

    Raises
    ------
    InputError : the data and the mode do not fit: no color image in 2-D, no depth in 3-D, or another type.
    """
    if isinstance(data, np.ndarray):
        data = _as_image(data)
    if not isinstance(data, (Frame, Cloud, Image)):
        raise _wrong_type(data)
    if mode == "2d":
        if isinstance(data, Image):
            return data
        if isinstance(data, Cloud) or data.color is None:
            raise InputError(
                "the config is for images (mode: 2d), and this has no color image: use a 3-D config, such as default",
                code="mode-needs-image",
            )
        return Image(data.color, data.name, data.timestamp)
    if isinstance(data, Image):
        raise InputError(
            "an image has no depth: use a 2-D config, such as the presets image and paper_2d (-c image)", code="mode-needs-depth"
        )
    return data


def _as_image(array: Array) -> Image:
    """Return an array as an Image, unless its shape is that of points or of depth."""
    if array.ndim == 2 and array.shape[1] == 3 and np.issubdtype(array.dtype, np.number):
        raise ArgumentError(
            f"an array of shape {array.shape} looks like {len(array)} points: give doo3d.Cloud(points), in metres",
            code="data-type",
        )
    if array.ndim == 2 and array.dtype != np.uint8:
        raise ArgumentError(
            f"an array of shape {array.shape} and type {array.dtype} looks like depth: give "
            "doo3d.Frame(color, depth, camera), with depth in metres",
            code="data-type",
        )
    return Image(array)


def _wrong_type(data: object) -> ArgumentError:
    """Return the error for an argument that is no data, with the remedy where the type tells what was meant."""
    if isinstance(data, str | os.PathLike):
        remedy = f": read a frame of it first: doo3d.open_capture({os.fspath(data)!r})[0]"
    elif hasattr(data, "data") and hasattr(data, "mask_for"):
        remedy = ": give its data: loaded.data"
    elif hasattr(data, "frames"):
        remedy = ": give one frame of it: capture[0]"
    else:
        remedy = ", expected a doo3d.Frame, a doo3d.Cloud, a doo3d.Image or an array (H, W, 3) uint8 RGB"
    return ArgumentError(f"detect was given a {type(data).__name__}{remedy}", code="data-type")


def finite_rows(cloud: Cloud, mask: Array) -> Array:
    """Return the mask of a cloud without the rows of the points that were dropped, since they are not finite."""
    mask = array(mask, "mask", "mask-shape")
    return mask[cloud.finite] if mask.shape == cloud.finite.shape else mask


def mask_notes(data: Frame | Image, mask: Array | None) -> list[str]:
    """Return the note on a mask that was cropped or padded to the size of the image."""
    image = data.color if isinstance(data, Image) else data.depth
    return [] if mask is None else [note for note in fit_mask(np.asarray(mask), image.shape[:2])[1:] if note]
