"""What the camera says about a position in space."""

from enum import IntEnum


class PointVisibility(IntEnum):
    """What the depth image says about a position in space, compared with the reading at the pixel where the position projects to.

    - OUTSIDE: the position projects outside the image.
    - NO_DEPTH: its pixel has no reading and is outside the object's mask; or nothing is known.
    - MASKED: its pixel has no reading, but is in the object's mask.
    - SURFACE: the reading is of the object, at about the depth of the position.
    - HIDDEN: something in front of the position hides it, or a surface at about its depth that stands out as the object does.
    - FREE: the reading is farther than the position, so that the camera saw through it.
    - BARE: the reading is of the bare surface that the object lies on, where the surface beside the object is known.
    """

    OUTSIDE = 0
    """The position is not in the image."""
    NO_DEPTH = 1
    """Its pixel has no reading and is outside the object's mask; or nothing is known about it."""
    MASKED = 2
    """Its pixel has no reading, but is in the object's mask."""
    SURFACE = 3
    """Its pixel is in the object's mask, with a reading at about the same depth (or behind it, if that is not free)."""
    HIDDEN = 4
    """The reading is nearer, so that something is in front of the position; or about as far, at a hole in the mask."""
    FREE = 5
    """The reading is farther, so that the camera saw through the position. A reading of the object itself counts only if
    `own_object_counts_as_free` is set."""
    BARE = 6
    """Its pixel shows the bare surface that the object lies on, so that no object is there."""


FREE_LIKE = [PointVisibility.FREE, PointVisibility.OUTSIDE]
"""Where a path would have been seen, or leaves the image."""

OPEN = [*FREE_LIKE, PointVisibility.BARE]
"""The same, or over bare surface: where the camera would have seen an object."""
