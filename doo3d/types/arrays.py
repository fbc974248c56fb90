"""Array aliases, read-only arrays, and the check of masks.

Letters used in shapes everywhere: H, W image height and width; N points (or segments of a chain, whose
joints are N + 1); M voxels; K skeleton voxels; P points of a path; S samples or segments; D the dimension, 2 or 3.
Three-dimensional data is float64 metres in the camera's optical frame (x right, y down, z forward), or in
the frame of the cloud that was given; two-dimensional data is pixels (x right, y down).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[Any]
Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.integer[Any]]
Bools = NDArray[np.bool_]


def sealed(array: Array) -> Array:
    """Return a read-only view of an array of any shape; it shares the data of the array, which itself stays writable."""
    view = array.view()
    view.flags.writeable = False
    return view


def set_sealed(instance: object, **values: Any) -> None:
    """Set attributes of a frozen dataclass instance; arrays are set as read-only views.

    instance : the instance. values : name of the attribute -> its value, as keyword arguments.
    """
    for name, value in values.items():
        object.__setattr__(instance, name, sealed(value) if isinstance(value, np.ndarray) else value)


def check_mask(mask: Array, shape: tuple[int, ...]) -> Bools:
    """Return a mask as a new bool array, after checking its shape and type.

    Parameters
    ----------
    mask
        bool, or integers where non-zero means object.
    shape
        the shape that the mask must have: (H, W) for an image, (N,) for a cloud of N points.

    Raises
    ------
    InputError : the mask has another shape, or its type is neither bool nor integer.
    """
    try:
        mask = np.asarray(mask)
    except ValueError as error:  # lists of different lengths
        raise InputError(f"mask is no array ({error})", code="mask-shape") from None
    if mask.shape != shape:
        raise InputError(
            f"mask has shape {mask.shape}, the frame is {shape} : give the mask the size of the data", code="mask-shape"
        )
    if mask.dtype != bool and not np.issubdtype(mask.dtype, np.integer):
        raise InputError(f"mask has type {mask.dtype}, expected bool or integers (non-zero = object)", code="mask-type")
    return mask.astype(bool, order="C")
