"""The facts of the mask of one frame and of the depth in it."""

from functools import cached_property

import numpy as np

from .. import kernels
from ..geometry.cells import neighbors_of
from ..geometry.curves import Curves
from ..geometry.mask import median_half_width
from ..geometry.noise import SAMPLES
from ..geometry.radii import TOUCHING_RADII
from ..types import Array, Bools, Ints
from ..types.arrays import sealed

NO_DEPTH: Array = np.zeros((0, 0), dtype=np.float32)


class FrameFacts(kernels.FrameFacts):
    """A mask without its small regions, and its box, pixels, medial axis, skeleton and depth.

    The mask is read once, into runs of pixels; all facts follow from these and cost what the object's pixels cost, whatever the
    size of the frame. Each is made when it is first asked for.

    Attributes
    ----------
    selected
        number of pixels of the given mask.
    removed
        number of pixels removed as small 8-connected components; the pixels of a component's holes count for its size.
    filled
        number of pixels added as small 4-connected holes.
    count
        number N of pixels of the mask, after these steps.
    """

    def __init__(self, mask: Bools, depth: Array = NO_DEPTH, min_pixels: int = 0) -> None:
        """Read a mask, remove its components of fewer than `min_pixels` pixels, then fill its holes of fewer.

        Parameters
        ----------
        mask
            (H, W) bool.
        depth
            (H, W) float32 m, 0 = no reading; (0, 0) in 2-D.
        min_pixels
            pixels of the smallest component, and hole, that stays; 0 leaves the mask as it is.

        Raises
        ------
        ValueError : mask and depth have different shapes.
        """
        super().__init__(mask, depth if depth.size else None, min_pixels)
        self._given = mask
        self.depth = depth
        self._radii: dict[float, float] = {}

    @cached_property
    def mask(self) -> Bools:
        """The mask (H, W) bool, read-only; the given array itself if nothing was removed or filled."""
        return sealed(self.image() if self.removed or self.filled else self._given)

    @cached_property
    def slices(self) -> tuple[slice, slice]:
        """The box of the mask: slices of rows and columns, such that `mask[slices]` is the part of the mask in the box."""
        top, bottom, left, right = self.box
        return slice(top, bottom), slice(left, right)

    @cached_property
    def pixels(self) -> Ints:
        """The pixels (N, 2) int64 (u, v) of the mask, sorted by u and then v."""
        return sealed(self.pixel_list())

    @cached_property
    def axis(self) -> tuple[Ints, Ints, Array]:
        """The medial axis: rows and columns (K,) int64 of its pixels, and their half-width (K,) float32 px."""
        rows, columns, distance = self.medial_axis()
        return rows, columns, distance - 0.5

    @cached_property
    def skeleton(self) -> tuple[Ints, Ints]:
        """The skeleton (Zhang-Suen): its pixels (S, 2) int64 (u, v), branch by branch, and the start of each branch (B + 1,)."""
        pixels = self.skeleton_pixels()
        _, order, bounds, _ = kernels.trace_branches(neighbors_of(pixels[:, ::-1] + 1))
        return pixels[order], bounds

    def strand_lines(self, radius: float) -> Curves:
        """Return smooth lines along the skeleton, px (u, v), from one place where strands meet, or free end, to the next.

        radius : px, of the object. Branches that end within the width of two strands are of ragged edges, loops so short are
        holes, and forks so near to each other are one place.
        """
        pixels = self.skeleton_pixels()
        points, bounds, closed, _, _ = kernels.skeleton_paths(
            neighbors_of(pixels[:, ::-1] + 1),
            pixels.astype(float),
            round(radius),
            np.full(3, 2 * TOUCHING_RADII * radius),
            np.zeros(3),
            np.zeros(2),
            np.zeros((0, 0), dtype=np.float32),
            np.zeros(2),
            0.0,
            len(pixels),
        )
        return Curves(points, bounds, closed)

    def radius(self, focal: float = 1.0) -> float:
        """Return the radius of the object: the median half-width along the medial axis, weighted by itself.

        The unit is m, each pixel at its own depth, or px without depth. The radius is 0 if no pixel of the axis has depth.

        focal : focal length in px; not used without depth.
        """
        if focal not in self._radii:
            rows, columns, half_width = self.axis
            if self.depth.size:
                scale = self.depth[rows, columns] / focal
                half_width = half_width[scale > 0] * scale[scale > 0]
            self._radii[focal] = median_half_width(half_width)
        return self._radii[focal]

    @cached_property
    def readings(self) -> int:
        """The number of pixels with a depth reading."""
        return self._summary[0]

    @cached_property
    def median_depth(self) -> float:
        """The median of the depth readings, m; 0 without any."""
        return self._summary[1]

    @cached_property
    def depth_noise(self) -> float:
        """The median absolute difference of horizontally neighboring readings, m; 0 without any."""
        return self._summary[2]

    @cached_property
    def inverse_depth_noise(self) -> float:
        """The standard deviation of the readings in inverse depth, 1/m, with that of their rounding; 0 if all in a row are equal.

        A stereo camera's errors are correlated over its window: differences between neighbors show a part of them.
        """
        return self.inverse_depth_deviation(SAMPLES)

    @cached_property
    def _summary(self) -> tuple[int, float, float]:
        return self.depth_summary()
