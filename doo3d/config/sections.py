"""Define the settings of the stages with few settings, of tracking, fusion, input and output."""

from typing import Literal

from pydantic import Field

from ..guard.limits import DEFAULT_MAX_PIXELS, DEFAULT_MAX_POINTS, Limits
from .section import Section, expert

SEGMENT_LENGTH_PX = 10.0
"""Default of `fit.segment_length` in 2-D, px of the working picture, as in Keipour et al. (RA-L 2022), section III-D."""


class VoxelizeConfig(Section):
    """Settings of voxelizing, which turns the object's points into a sparse voxel grid."""

    radius: float | None = Field(
        None,
        ge=1e-4,  # a tenth of a millimetre: voxels of thinner objects are finer than any depth, and take memory without bound
        description="Radius of the object, if it is known. m (px in 2-D), 0.0001 or more; null measures it. Set it if the "
        "measured one is wrong.",
    )
    size: float | None = expert(
        None,
        "Edge of a voxel. m, over 0; null chooses it from the radius and the point spacing. Lower it if neighboring "
        "strands merge.",
        gt=0,
    )
    core_fraction: float = expert(
        0.6,
        "Use only the core of each strand's mask: pixels at least this fraction of the half-width away from the edge. "
        "0 to below 1; 0 uses the whole mask. Raise it if strands side by side merge.",
        ge=0,
        lt=1,
    )
    core_margin_px: float = expert(
        0.0,
        "Widen the core of thin strands: also use pixels that are at most this much nearer to the edge than the "
        "middle of the strand is. Pixels, 0 or more. Raise it if thin strands break.",
        ge=0,
    )
    split_at_depth_step: float = expert(
        0.0,
        "Split strands where the depth steps down by at least this much, as where one passes beneath another. Radii, "
        "0 or more; 0 turns it off. Set it to 0.5 for piles of stiff tubes.",
        ge=0,
    )


class TraverseConfig(Section):
    """Settings of traversal, which turns the skeleton into ordered paths along the object."""

    method: Literal["graph", "contours"] = expert(
        "graph",
        "How paths are read off the skeleton. graph follows every branch once; contours follows both sides of each "
        "skeleton, as Keipour et al. (RA-L 2022) do, in 2-D only. Change it only to reproduce their results.",
    )
    min_branch: float = Field(
        2.5,
        ge=0,
        description="Remove skeleton branches with a free end that are shorter than this: spurs of the thinning. Radii, 0 "
        "or more. Raise it for hairy ropes.",
    )


class FitConfig(Section):
    """Settings of fitting, which lays chains of equal segments along the paths (Algorithm 2 of Keipour et al., RA-L 2022)."""

    segment_length: float | None = Field(
        0.01,
        gt=0,
        description="Length of every segment of a chain. m (px in 2-D), over 0; null, in 2-D only, takes 10 px, or as many times "
        "more as the photograph is reduced by (`segment.working_width`). Lower it to follow tighter bends.",
    )
    max_turn: float = Field(
        60.0,
        gt=0,
        lt=180,
        description="End a chain where two consecutive segments turn by more than this. Degrees, over 0, below 180. Lower "
        "it for stiff objects.",
    )

    @property
    def length(self) -> float:
        """The length of a segment in effect, m (px of the working picture in 2-D)."""
        return SEGMENT_LENGTH_PX if self.segment_length is None else self.segment_length


MAX_CUBOID_WIDTH = 100
"""Greatest width of a cuboid, m (px in 2-D): over ten times the 9 px of the paper, and more than any scene in metres. The number
of tested pairs, and with it time and memory, grows with the width until every segment is near every other."""


class PruneConfig(Section):
    """Settings of pruning: of two segments that overlap, the one in the shorter chain is removed."""

    width: float | None = expert(
        None,
        "Width of the cuboids around the segments that are tested for overlap. m (px in 2-D), over 0, at most 100; null "
        "takes 1.5 voxels. Set it only to reproduce the results of Keipour et al. (RA-L 2022).",
        gt=0,
        le=MAX_CUBOID_WIDTH,
    )


class RefineConfig(Section):
    """Settings of refining, which estimates axis and radius from the visible surface and lays equal segments along the axis."""

    iterations: int = expert(
        2,
        "Number of times the axis is estimated from the surface. 0 to 10; 0 leaves the chain on the surface. Lower it "
        "to save time.",
        ge=0,
        le=10,
    )
    min_radius_ratio: float = expert(
        0.0,
        "Remove chains thinner than this fraction of a longer chain's radius, such as lines of the background. 0 "
        "to below 1; 0 turns it off. Lower it for objects of different widths.",
        ge=0,
        lt=1,
    )
    occluded: Literal["from_gaps", "from_depth", "both"] = expert(
        "both",
        "Which segments are marked occluded. from_gaps: those in gaps of at least segment_length that merging closed; "
        "from_depth: those without a surface point near; both: those in such gaps that have no surface point near. "
        "Set it to from_gaps to reproduce the results of Keipour et al. (RA-L 2022).",
    )


class CrossingsConfig(Section):
    """Settings of crossings: where strands cross in the view, and which one is on top."""

    use_color: bool = Field(
        True,
        description="Use the color where two strands overlap, besides depth, to decide which one is on top. true or false. "
        "Turn it off for printed or striped objects whose colors repeat.",
    )


class ExtendMaskConfig(Section):
    """Settings of extending the mask, which follows strands beyond its end by their colors in the image (2-D only)."""

    max_length: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Follow a strand by its color up to this far beyond the end of the mask. Radii, 0 to 1000; 0 turns it "
        "off. Lower it if chains run on into the background.",
    )


class OutputConfig(Section):
    """Settings of the output: which of the chains found are given."""

    min_confidence: float = Field(
        0.2,
        ge=0,
        le=1,
        description="Leave objects whose confidence is below this out of the chains, where neither the object (by a mask, a "
        "color) nor the number of chains is given. Long ones, and the best of a frame without chains, are doubtful. Probability, "
        "0 to 1; 0 gives all. Raise it if clutter comes out as chains.",
    )


class VisibilityConfig(Section):
    """Settings of visibility, which decides from the depth image whether a place is seen, hidden or free."""

    margin: float = expert(
        0.004,
        "Count a place as free space (seen through by the camera) if the depth reading lies at least this much behind "
        "it. m, over 0. Raise it for sensors with more depth noise.",
        gt=0,
    )
    own_object_counts_as_free: bool = expert(
        False,
        "Count a place as free space also if the surface seen behind it is the object itself. true or false. Set it "
        "for piles of tubes.",
    )


class TrackingConfig(Section):
    """Settings of tracking, which keeps the id and the direction of each chain from frame to frame."""

    max_motion_lengths: float = expert(
        0.1,
        "Largest mean motion of a chain from one frame to the next. Multiples of the chain's length, over 0; 10 radii "
        "are always allowed. Raise it for fast motion or few frames per second.",
        gt=0,
    )


class SequenceConfig(Section):
    """Settings of `doo3d detect --sequence`, which finds objects in all frames of a capture together."""

    length: float | None = Field(
        None,
        description="Length of every object without junctions, m, over 0; null: measure it in the frames in which an object is "
        "seen whole.",
        gt=0,
    )
    max_gap: float = Field(
        0.5,
        description="Longest time for which an object of which nothing is seen is filled in from before and after. Seconds, "
        "0 or more; frames without times count as 30 a second.",
        ge=0,
    )


class InputConfig(Section):
    """Limits of what is read from files, checked on the size that a file announces, before memory is taken for it."""

    max_pixels: int = expert(
        DEFAULT_MAX_PIXELS,
        "Refuse an image that announces more pixels (width times height). px, 1 or more. Raise it for larger photographs; a "
        "pixel takes up to 30 bytes of memory.",
        ge=1,
    )
    max_points: int = expert(
        DEFAULT_MAX_POINTS,
        "Refuse a cloud that announces more points. Points, 1 or more. Raise it for larger scans; a point takes up to 100 "
        "bytes of memory.",
        ge=1,
    )

    def limits(self) -> Limits:
        """Return the settings as Limits, for the readers."""
        return Limits(self.max_pixels, self.max_points)


class FusionConfig(Section):
    """Settings of fusion, which makes one cloud from many views of an object at rest (`doo3d detect --fuse-views`)."""

    min_views: int = expert(
        2,
        "Keep a place that fewer frames than this show only if the other views do not see through it. Frames, 1 or "
        "more; half of all frames if that is less. Raise it for noisy sensors.",
        ge=1,
    )
