"""What was captured of an object, and the questions that the stages ask of it: one class for each kind of data.

Stages ask the scene, not which kind of data they have, and a scene that cannot know answers "unknown", as each method says; only
segmentation, which makes the scene, voxelization and tracking look at its class. Positions are in m, D = 3, in the optical frame
of the camera or the frame of the cloud; in an image in px, D = 2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..config import Config
from ..geometry.curves import Curves
from ..geometry.polyline import steps
from ..geometry.projection import Projection
from ..types import Array, Bools, Floats, Ints, Plane
from ..types.arrays import set_sealed
from .answers import NO_LINES, ColorSides, MaskLines
from .depth_support import NOT_MEASURED, DepthSupport
from .point_visibility import FREE_LIKE, PointVisibility

if TYPE_CHECKING:
    from typing_extensions import Self

    from ..kernels import CrossingStrands
    from .samples import Samples


@dataclass(frozen=True, eq=False)
class Scene(ABC):
    """The points of the object, with the image or the views that they come from, and what these say.

    Segmentation is conservative: it rather loses part of the object than keeps something else.

    Attributes
    ----------
    points
        (N, D) as measured: one per pixel of the object (with depth, where there is depth), or the points of a cloud.
    notes
        messages of the segmentation to the user, one sentence each.
    object_given
        whether the user said what the object is: by a mask, a color, a reference image, or by taking everything for it. False
        if strands were looked for by their shape alone.
    plane
        the plane around the object, such as a table; None where there is none.
    config
        the settings; the sections `voxelize` and `visibility` say how the scene is measured.
    voxel_factor
        factor of the edge of a voxel where it follows from the radius.
    """

    points: Floats
    notes: tuple[str, ...] = ()
    object_given: bool = True
    plane: Plane | None = None
    config: Config = field(default_factory=Config)
    voxel_factor: float = 1.0

    def __post_init__(self) -> None:
        if self.points.flags.writeable:  # those of a copy are sealed
            set_sealed(self, **{name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)})

    def with_settings(self, config: Config, voxel_factor: float = 1.0) -> Self:
        """Return the scene as measured with these settings."""
        return replace(self, config=config, voxel_factor=voxel_factor)

    def changed(self, **fields: Any) -> Self:
        """Return a copy with other fields; what was measured of the object stays as it is."""
        made = replace(self, **fields)
        vars(made).update({name: vars(self)[name] for name in ("radius", "spacing", "voxel", "parted") if name in vars(self)})
        return made

    @property
    def dim(self) -> int:
        """The number of coordinates: 3, in an image 2."""
        return int(self.points.shape[1])

    @property
    def each_layer(self) -> tuple[Self, ...]:
        """The scene once for each color of strand, with the pixels of that color alone; the scene itself where there is one."""
        return (self,)

    def layer_of(self, lines: Curves) -> Ints:
        """Return the layer that each of C lines lies in, (C,), an index of `each_layer`; lines : m (px in 2-D)."""
        return np.zeros(len(lines), dtype=np.int64)

    # -- how large things are -------------------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def radius(self) -> float:
        """The first estimate of the object's radius, m (px in 2-D), before there is a chain: as configured, or from its width."""

    @property
    @abstractmethod
    def voxel(self) -> float:
        """The edge of a voxel, m (1 px in 2-D)."""

    @property
    @abstractmethod
    def spacing(self) -> float:
        """The distance between neighboring surface points, m; of sparse points along the strands; 1 px in an image."""

    @property
    def point_gap(self) -> float:
        """The distance between neighboring surface points, m (px in 2-D), up to which there is no gap between them."""
        return self.voxel

    @property
    def gap_unit(self) -> float:
        """The factor by which gaps may be longer and cost less than the settings of merging say; 1 except for some clouds."""
        return 1.0

    @property
    def max_turn(self) -> float:
        """The angle in radians by which an object may turn across a gap, unless the number of chains is given: half a turn."""
        return np.pi

    @property
    def is_sparse(self) -> bool:
        """Whether the points lie one behind the other along the strands of a cloud, and show no surface."""
        return False

    @property
    def shows_surface(self) -> bool:
        """Whether the data are a cloud of points on surfaces, without camera views."""
        return False

    @property
    def ranks_by_confidence(self) -> bool:
        """Whether a wanted number of chains is chosen by confidence, not by length: the object is not given, and not branched."""
        return not self.object_given and not self.config.merge.branches

    def is_wide(self, radius: float) -> bool:
        """Return whether an object is wider than `segment.max_width`, where nobody said what the object is; radius : m."""
        return False

    @property
    def may_be_reinterpreted(self) -> bool:
        """Whether the evidence was weighed for choosing between interpretations: in frames in which the object is given."""
        return False

    # -- what the image says --------------------------------------------------------------------------------------------------

    @property
    def mask(self) -> Bools:
        """The pixels of the object, (H, W) bool, with a depth reading or without; (0, 0) for a cloud."""
        return np.zeros((0, 0), dtype=bool)

    def point_colors(self) -> Array:
        """Return the color of each point, (N, 3) uint8 RGB; (0, 3) where there is no color image."""
        return np.zeros((0, 3), dtype=np.uint8)

    def in_mask(self, pixels: Floats) -> Bools:
        """Return which pixels (..., 2) of the view are in the image and in the mask: (...) bool; all False for a cloud."""
        return np.zeros(pixels.shape[:-1], dtype=bool)

    def unclaimed(self, view: Curves, reach: Floats) -> Floats:
        """Return for each of C curves the share of the pixels of the mask that are near no curve, (C,); 0 for a cloud.

        view : samples of the curves in the view, px. reach : (S,) px, the radius at each sample.
        """
        return np.zeros(len(view))

    def share_side_by_side(self, points: Floats) -> float:
        """Return the share of N positions (N, D) at which strands of the mask run side by side, 0 to 1; 0 for a cloud."""
        return 0.0

    def strand_sides(self, view: Floats, across: Floats, reach: Floats, radius: float) -> ColorSides:
        """Return how a strand stands out from its sides, where the object is not given.

        Parameters
        ----------
        view, across, reach
            (S, 2) px, (S, 2) unit and (S,) px: samples along the strand in the view, the direction across, and the radius.
        radius
            m (px in 2-D), of the strand.
        """
        return ColorSides()

    def strand_lines(self, depth: float) -> tuple[MaskLines, tuple[str, ...]]:
        """Return the middle lines of the strands in a mask with depth, and notes; none elsewhere.

        depth : m, at which the radius of the object is taken.
        """
        return NO_LINES, ()

    # -- what the camera says of positions, paths and ends --------------------------------------------------------------------

    @property
    def sees_space(self) -> bool:
        """Whether an image or views say which space is empty."""
        return True

    @abstractmethod
    def classify(self, points: Floats) -> Ints:
        """Return the `PointVisibility` of each of N positions (N, D), (N,) int64; NO_DEPTH where it is unknown."""

    def exits_view(self, ends: Floats, directions: Floats, reach: float) -> Bools:
        """Return which chain ends would be outside the image if they went straight on by `reach`: cut off there, and not tips.

        Parameters
        ----------
        ends, directions
            (E, D) positions of E ends, and unit vectors that point out of the chains.
        reach
            m (px in 2-D), length by which the ends are extrapolated.
        """
        return np.asarray(self.classify(ends + reach * directions) == PointVisibility.OUTSIDE)

    def is_exposed(self, ends: Floats, directions: Floats, radius: float, reach: float) -> Bools:
        """Return which chain ends are in plain view, so that nothing can hide a continuation, (E,) bool.

        None are unless the scene is one frame with depth.

        An end is exposed if, on its straight continuation, a position in free space comes before any that an occluder hides.

        Parameters
        ----------
        ends, directions
            (E, D) positions of E ends, and unit vectors that point out of the chains.
        radius, reach
            m, radius of the object, and how far ahead of the end to look.
        """
        return np.zeros(len(ends), dtype=bool)

    def tips(self, ends: Floats, directions: Floats, radius: float) -> Floats:
        """Return the log-odds that ends are real tips and not hidden continuations, (E,) nat.

        They are minus infinity unless the scene is one frame with depth.

        ends, directions : (E, D) positions, and unit vectors that point out of the chains. radius : of the object, m.
        """
        return np.full(len(ends), -np.inf)

    def is_beside(self, points: Floats, clearance: float) -> Bools:
        """Return which positions (N, D) project beside the object's mask, with nothing in front of them, (N,); False if unknown.

        clearance : m, smallest distance of something in front of a position; a scene of several views takes its own.
        """
        return np.asarray(self.classify(points) == PointVisibility.FREE)

    def pixel_at(self, point: Floats) -> float:
        """Return the width that a pixel shows at the depth of a position (D,), m; 1 px in 2-D."""
        return 1.0

    def gap_lengths(self, paths: Sequence[Floats]) -> Floats:
        """Return how much of each polyline runs through free space, through unknown space, and over bare surface.

        A stretch outside the image counts as free: the path could turn back from there anywhere. A step counts by its midpoint.

        paths : K >= 1 polylines, each (P, D). Returns (K, 3) m (px in 2-D).
        """
        return self.lengths(np.concatenate(paths), np.cumsum([0, *map(len, paths)]))

    def lengths(self, points: Floats, bounds: Ints) -> Floats:
        """Return the length of K polylines in free space, in unknown space and over bare surface, (K, 3) m (px in 2-D).

        points : (N, D), the polylines one after the other. bounds : (K + 1,), where each begins.
        """
        owner = np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))
        classes = self.classify((points[1:] + points[:-1]) / 2)
        length = np.where(owner[1:] == owner[:-1], steps(points), 0.0)
        kinds = FREE_LIKE, [PointVisibility.NO_DEPTH], [PointVisibility.BARE]
        return np.column_stack([np.bincount(owner[1:], length * np.isin(classes, kind), len(bounds) - 1) for kind in kinds])

    def with_support(self, chains: Curves) -> Scene:
        """Return the scene with the surface beside chains measured, which distinguishes bare surface from holes in the mask.

        chains : the joints of chains. Where no single depth image shows that surface, the scene is the same.
        """
        return self

    def depth_support(self, chains: Curves, radius: Sequence[float]) -> DepthSupport:
        """Return how well depth readings support the segments of chains; NOT_MEASURED without a single depth image.

        chains : the joints of chains. radius : of each, m.
        """
        return NOT_MEASURED

    # -- where the axis is, and which strand is on top ------------------------------------------------------------------------

    @property
    @abstractmethod
    def view(self) -> Projection:
        """The view in which crossings and the shape of chains are judged: that of the sensor, as far as it is known."""

    def in_image(self, points: Floats) -> Floats:
        """Return where positions (N, D) are in the image, (N, 2) px; their first two coordinates where there is no image."""
        return points[:, :2]

    @property
    def viewpoint(self) -> Floats | None:
        """The position of the sensor in the frame of the points, (3,) m; None if it is unknown, and in an image."""
        return None

    def seen_from(self, sensor: Floats) -> Scene:
        """Return the scene with a position of the sensor, (3,) m, where it `lacks_viewpoint`; else the scene itself."""
        return self

    @property
    def lacks_viewpoint(self) -> bool:
        """Whether the position of the sensor is unknown, and the points may show it."""
        return False

    def ray_noise(self, depth: Floats) -> tuple[Floats, Floats]:
        """Return the pitch of points across rays, and the noise along them, at depths (N,) m: (N,) m each; 0 where unknown."""
        return 0.0 * depth, 0.0 * depth

    @abstractmethod
    def measure_axis(self, samples: Samples, iterations: int) -> Samples:
        """Return samples moved from the seen surface to the axis of the object, with the radius at each.

        samples : along all paths. iterations : how many times this is done; 0 leaves the samples as they are.
        """

    @abstractmethod
    def upper(self, strands: CrossingStrands, half_width: Floats) -> Floats:
        """Return the log-odds, (C,) nat, that the first of two strands is the upper one at each of C crossings; 0 for unknown.

        strands : the strands at the crossings, in the view. half_width : (C, 2), half of their widths there.
        """
