"""Define array types, make arrays read-only, and check masks.

Letters used in shapes everywhere: H, W image height and width; N points (or segments of a chain, whose joints are N + 1); M
voxels; K skeleton voxels; P points of a path; S samples or segments; D the dimension, 2 or 3. Three-dimensional data is float64
metres in the camera's optical frame (x right, y down, z forward), or in the frame of the cloud that was given; two-dimensional
data is pixels (x right, y down).
"""

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


MAX_MASK_DIFFERENCE_PX = 1
"""Greatest difference in px between the sides of a mask and of its image, from networks that round the size when they scale."""


def fit_mask(mask: Array, shape: tuple[int, ...]) -> tuple[Array, str]:
    """Crop or pad a mask of almost the size of its image at the right and bottom edges.

    Parameters
    ----------
    mask
        any array; it is changed only if its size differs from `shape` by at most MAX_MASK_DIFFERENCE_PX per side.
    shape
        (H, W) of the image.

    Returns
    -------
    mask : of size `shape` if it was almost of that size, otherwise unchanged. Padded pixels are False.
    note : a sentence for the user about the change; empty if unchanged.
    """
    if mask.ndim != 2 or len(shape) != 2 or mask.shape == shape:
        return mask, ""
    if max(abs(size - wanted) for size, wanted in zip(mask.shape, shape, strict=True)) > MAX_MASK_DIFFERENCE_PX:
        return mask, ""
    fitted = np.zeros(shape, mask.dtype)
    kept = mask[: shape[0], : shape[1]]
    fitted[: kept.shape[0], : kept.shape[1]] = kept
    sizes = f"the mask is {mask.shape[1]}x{mask.shape[0]} px and the image {shape[1]}x{shape[0]}"
    return fitted, f"{sizes}: the mask is cropped or padded at its right and bottom edges"


def check_mask(mask: Array, shape: tuple[int, ...]) -> Bools:
    """Check the shape and type of a mask, and return it as a new bool array, cropped or padded if a pixel off.

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
    mask = fit_mask(mask, shape)[0]
    if mask.shape != shape:
        raise InputError(
            f"mask has shape {mask.shape}, the frame is {shape} : give the mask the size of the data", code="mask-shape"
        )
    if mask.dtype != bool and not np.issubdtype(mask.dtype, np.integer):
        raise InputError(f"mask has type {mask.dtype}, expected bool or integers (non-zero = object)", code="mask-type")
    return mask.astype(bool, order="C")
