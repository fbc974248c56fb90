"""Everything that can be set: one frozen model per stage, presets, and how a file and overrides become a Config.

Lengths are metres in 3-D and pixels in 2-D; lengths that depend on the object are given in its radii or in
voxels, so that they hold for a thread as for a hose.
"""

from __future__ import annotations

from typing import Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, model_validator


class Section(BaseModel):
    """Base of all sections: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=True)


Hsv = tuple[int, int, int]


class HsvRange(Section):
    """One box in OpenCV's 8-bit HSV, both ends included; a low hue above the high one wraps round through red."""

    low: Hsv = Field(description="[hue 0..179, saturation 0..255, value 0..255]")
    high: Hsv = Field(description="[hue 0..179, saturation 0..255, value 0..255]")

    @model_validator(mode="after")
    def _inside(self) -> HsvRange:
        for name, triple in (("low", self.low), ("high", self.high)):
            for value, top, part in zip(triple, (179, 255, 255), ("hue", "saturation", "value"), strict=True):
                if not 0 <= value <= top:
                    raise ValueError(f"{name} {part} is {value}, expected 0 to {top} (OpenCV's 8-bit HSV)")
        for i, part in ((1, "saturation"), (2, "value")):
            if self.low[i] > self.high[i]:
                raise ValueError(f"low {part} {self.low[i]} is above high {part} {self.high[i]}")
        return self


class SegmentConfig(Section):
    """Which pixels or points are the object."""

    method: Literal["auto", "hsv", "mask", "plane", "background", "everything", "ridge"] = Field(
        "auto",
        description="How to tell the object. auto: the given mask; else hsv where ranges are set, background where a "
        "reference is; else plane where the scene holds a broad surface, everything where it does not, and ridge in 2-D.",
    )
    ranges: tuple[HsvRange, ...] = Field((), description="hsv: the boxes that are the object, joined.")
    reference: str | None = Field(
        None, description="background: path of the reference depth (16-bit PNG) or colour image, without the object."
    )
    reference_depth_scale: float = Field(1000.0, gt=0, description="background: units per metre of a reference depth image.")
    depth_difference: float = Field(
        0.004, gt=0, description="background: m nearer than the reference to count as object; a few times the depth noise."
    )
    color_difference: float = Field(
        30.0, gt=0, le=442, description="background: distance in 8-bit RGB from the reference to count as object."
    )
    plane_distance: float = Field(
        0.003, gt=0, description="plane: m off the plane to count as standing off it; above the depth noise, below the radius."
    )
    plane_iterations: int = Field(200, ge=10, le=100_000, description="plane: RANSAC draws.")
    ridge_filter: Literal["sato", "frangi"] = Field("sato", description="ridge: which of scikit-image's filters.")
    ridge_sigmas: tuple[float, ...] = Field(
        (2.0, 4.0, 6.0), min_length=1, description="ridge: px at the size of the filter, half-widths of the lines looked for."
    )
    ridge_pixels: int = Field(500_000, ge=1000, description="ridge: larger images are filtered at this many pixels.")
    max_width: float = Field(
        0.05,
        gt=0,
        description="m; what is wider than this on all sides is not the object (a table, a gripper). "
        "Not applied to masks that the caller gives, nor to everything.",
    )
    max_ratio: float = Field(
        2.5, gt=1, description="what is wider on all sides than this many times the usual width goes too; likewise."
    )
    min_depth: float = Field(0.02, gt=0, description="m; nearer readings are dropped, and an object nearer has a wrong unit.")
    max_depth: float = Field(20.0, gt=0, description="m; farther readings are dropped, and an object farther has a wrong unit.")
    window: int = Field(2, ge=1, le=10, description="pixels; half-width of the window in which depth readings are compared.")
    edge_tolerance: float = Field(0.003, gt=0, description="m per pixel of distance; readings that differ by more do not agree.")
    edge_noise: float = Field(
        3.0, ge=0, description="times the usual difference of readings side by side that edge_tolerance is at least."
    )
    edge_support: int = Field(
        7,
        ge=0,
        description="neighbours in the window that must agree with a depth reading, or half of those there are; "
        "fewer = a flying point, which goes.",
    )
    holes: int = Field(
        2,
        ge=0,
        description="pixels; the mask farther than this from a reading gets the depth between those round it; 0: none.",
    )
    cloud_window: float = Field(
        2.0,
        gt=0,
        le=10,
        description="point spacings; neighbours in a cloud are those in three cells of this size on either axis.",
    )
    cloud_support: float = Field(
        0.15, ge=0, lt=1, description="share of the usual number of neighbours that a point of a cloud must have, or it goes."
    )
    smooth: bool = Field(
        True, description="find the voxels from the mean of each reading and the neighbours that agree (not the axis)."
    )
    steady: float = Field(
        0.3,
        gt=0,
        description="radii; error of the smoothed depth at most: the window in which it is averaged grows with the noise.",
    )
    min_component: int = Field(
        30, ge=1, description="pixels; smaller connected pieces of the mask go, and smaller holes in it are closed."
    )

    @model_validator(mode="after")
    def _needs(self) -> SegmentConfig:
        if self.method == "hsv" and not self.ranges:
            raise ValueError("segment.method is hsv but segment.ranges is empty: give at least one {low: [h,s,v], high: [h,s,v]}")
        if self.method == "background" and self.reference is None:
            raise ValueError("segment.method is background but segment.reference is not set: give the image without the object")
        if self.min_depth >= self.max_depth:
            raise ValueError(f"segment.min_depth {self.min_depth} is not below segment.max_depth {self.max_depth}")
        return self


class VoxelizeConfig(Section):
    """Points to a sparse voxel grid."""

    size: float | None = Field(None, gt=0, description="m, edge of a voxel; null: chosen from point spacing and radius.")
    radius: float | None = Field(None, gt=0, description="m, the object's radius if it is known; null: from the seen width.")
    size_over_radius: float = Field(
        0.5, gt=0.05, le=2, description="voxel edge in radii, when chosen; finer keeps near strands apart, coarser bridges holes."
    )
    size_over_spacing: float = Field(1.6, ge=0.5, le=10, description="voxel edge in point spacings at least, when chosen.")
    core: float = Field(
        0.6,
        ge=0,
        lt=1,
        description="of a strand in a mask, the part at least this share of its half-width from the edge is used.",
    )
    rim: float = Field(0.0, ge=0, description="pixels; what is no more than this nearer to the edge than the middle is used too.")
    step: float = Field(
        0.0, ge=0, description="radii by which the depth steps down where a strand goes on beneath another; 0: not looked for."
    )
    close: int = Field(1, ge=0, le=5, description="voxels by which holes are closed (dilate, then erode).")
    max_voxels: int = Field(2_000_000, ge=100, description="occupied voxels at most; more are refused with the number.")
    min_component: int = Field(12, ge=1, description="voxels of half a radius; smaller 26-connected pieces go.")


class ThinConfig(Section):
    """Voxels to a curve skeleton."""

    method: Literal["directional"] = Field(
        "directional", description="six-direction sequential thinning of simple points, curve ends kept (Lee, Kashyap, Chu 1994)."
    )


class TraverseConfig(Section):
    """Skeleton to ordered paths."""

    method: Literal["graph", "contours"] = Field(
        "graph",
        description="graph: every branch once; contours: round both sides of each skeleton, the paper's way, in 2-D only.",
    )
    min_branch: float = Field(2.5, ge=0, description="radii; shorter branches with a free end are spurs and go.")
    min_loop: float = Field(
        12.0, ge=0, description="radii; loops of less perimeter are holes in the surface, not turns of the object, and collapse."
    )
    smooth: float = Field(1.0, ge=0, description="radii; half-width of the moving mean that takes the voxel steps out of a path.")
    min_bridge: float = Field(3.0, ge=0, description="radii; two forks nearer to each other than this are one crossing.")
    max_trim: float = Field(15.0, ge=0, description="radii cut at most from a path where it meets a junction.")
    trim: float = Field(1.0, ge=0, description="radii cut at least from a path where it meets a junction, whose pull bends it.")
    separation: float = Field(
        2.2, ge=0, description="radii between paths at a junction up to which both are cut, for their surfaces still touch."
    )


class FitConfig(Section):
    """Paths to chains of equal segments: the paper's traversal algorithm."""

    segment_length: float = Field(0.01, gt=0, description="l_s, m (px in 2-D).")
    max_turn: float = Field(60.0, gt=0, lt=180, description="degrees between segments; more ends the chain.")


class PruneConfig(Section):
    """Overlapping segments."""

    width: float | None = Field(None, gt=0, description="m (px in 2-D), width of the cuboids; null: width_over_voxel voxels.")
    width_over_voxel: float = Field(1.5, gt=0, le=10, description="width of the cuboids in voxels (pixels), when chosen.")


class MergeConfig(Section):
    """Which chain ends belong together: the paper's equations 1 to 5."""

    chains: int | None = Field(None, ge=1, description="the wanted number of chains; null: decide from the data.")
    distance_weight: float = Field(1.0, ge=0, description="w_e, per millimetre (per pixel in 2-D).")
    direction_weight: float = Field(100.0, ge=0, description="w_d, per radian.")
    curvature_weight: float = Field(100.0, ge=0, description="w_c, per radian.")
    free_space_weight: float = Field(
        20.0, ge=0, description="per millimetre of the gap that runs where the camera saw through; 0 = off."
    )
    unknown_weight: float = Field(
        2.0, ge=0, description="per millimetre of the gap of which nothing is known: no depth there, or a cloud without a camera."
    )
    open_weight: float = Field(
        0.0, ge=0, description="per end beyond which nothing hides what would go on there, and nothing does; 0 = off."
    )
    open_reach: float = Field(2.0, gt=0, description="radii beyond an end that are looked at for that.")
    own: dict[str, float] = Field({}, description="weights of costs of your own, by their names in doo3d.costs.OWN.")
    keep_bending: float = Field(
        0.7,
        ge=0,
        le=1,
        description="share of its curvature that an end is expected to keep on its way across a gap; 0: the paper.",
    )
    border: float = Field(
        8.0, ge=0, description="radii from the edge of the view within which an end leaves it; two such ends are not joined."
    )
    direction_length: float = Field(
        10.0, ge=0, description="radii of chain over which the direction of an end is taken; 0: its last segment, as the paper."
    )
    max_cost: float = Field(500.0, gt=0, description="a connection dearer than this is not made; .inf = any is.")
    patience: float = Field(
        3.0, ge=1, description="times max_cost that a connection may cost where fewer chains are wanted than are left otherwise."
    )
    remnant: float = Field(
        0.1, ge=0, le=1, description="share of the longest chain's length below which a chain is not joined at that cost."
    )
    max_gap: float = Field(0.25, gt=0, description="m (px in 2-D); ends farther apart are not joined.")
    min_length: float = Field(4.0, ge=0, description="radii; when the number is left to the data, shorter chains go.")
    strategy: Literal["greedy", "global"] = Field(
        "global",
        description="greedy: the paper's rule, the cheapest pair first; global: all connections together at the least cost.",
    )
    rings: bool = Field(False, description="the two ends of one chain may be joined, when nothing else is left to join.")


class FillConfig(Section):
    """Gaps to tangent arcs and lines."""

    radius: float | None = Field(None, gt=0, description="m (px in 2-D), turn radius where it is free; null: see max_deviation.")
    max_deviation: float = Field(
        20.0, gt=0, lt=90, description="degrees between the line and the straight way across at most, when the radius is chosen."
    )
    side: Literal["outside", "inside"] = Field(
        "outside", description="ends that both turn away: round the outside of the gap or through its inside."
    )


class RefineConfig(Section):
    """Surface to axis, radius, equal segments."""

    rounds: int = Field(2, ge=0, le=10, description="times the axis is estimated from the surface; 0: stay on the surface.")
    spacing: float = Field(0.4, gt=0, le=2, description="radii between the places where the axis is estimated.")
    pool: float = Field(1.0, ge=0, description="radii on either side that the estimate at a place is taken from.")
    smooth: float = Field(1.2, ge=0, description="radii; detail of the axis shorter than about 2 pi times this is smoothed.")
    depth_weight: float = Field(
        0.06,
        gt=0,
        le=1,
        description="weight of the depth, which a stereo camera knows worse and in waves, beside 1 for sideways.",
    )
    depth_noise: float = Field(
        0.15, gt=0, description="radii; a depth known worse than this weighs less, by the square of how much worse."
    )
    prior: float = Field(0.01, gt=0, le=1, description="weight of the filled path where nothing was seen, beside 1 where it was.")
    reach: float = Field(2.2, gt=0, description="radii round the path within which surface points belong to it.")
    extend: float = Field(6.0, ge=0, description="radii by which an end may be carried on to the last surface point.")
    stub: float = Field(
        8.0, ge=0, description="radii beyond a hidden end within which a bit of surface is taken for where it goes on; 0: none."
    )
    min_width: float = Field(
        0.0, ge=0, lt=1, description="share of the thickest chain's radius; thinner chains are lines of the background, and go."
    )
    occluded: Literal["carried", "mapped", "both"] = Field(
        "both",
        description="which segments are occluded: carried from the gaps of at least segment_length that merging closed; "
        "mapped: no surface point near; both: carried and confirmed by mapping.",
    )


class GrowConfig(Section):
    """Strands beyond the mask, by their colours in the image (2-D)."""

    reach: float = Field(
        0.0, ge=0, le=1000, description="radii that a strand is followed beyond the end of the mask, at most; 0: none."
    )
    rounds: int = Field(3, ge=1, le=10, description="times at most that ends are followed and the chains found anew.")
    hidden: float = Field(8.0, ge=0, description="radii of the way that may look different: another strand, a print, a glare.")
    noise: float = Field(6.0, gt=0, description="grey levels by which the colours of one strand differ at least.")
    max_difference: float = Field(
        2.5, gt=0, description="squared difference of the strand ahead to the strand so far, in variances of the latter."
    )
    min_contrast: float = Field(1.5, ge=0, description="by how much more, at least, the background on either side has to differ.")
    adapt: float = Field(0.2, ge=0, le=1, description="share of its colours that a strand takes over at a step of half a radius.")


class EvidenceConfig(Section):
    """What the camera says about a place."""

    margin: float = Field(
        0.004, gt=0, description="m; depth measured this much behind a place, at least, says that the camera saw through it."
    )
    margin_radii: float = Field(
        1.2, ge=0, description="radii; and this much: what lies on a table hides it, and is two radii thick."
    )
    through: bool = Field(
        False, description="where the object itself is seen behind a place, the camera saw through it, too; for tangles of tubes."
    )


class TracksConfig(Section):
    """Which chain is which from frame to frame."""

    lengths: float = Field(0.1, gt=0, description="lengths of a chain by which it may move from frame to frame, in the mean.")
    radii: float = Field(10.0, ge=0, description="radii; so far it may move in any case.")
    keep: int = Field(30, ge=0, description="frames for which a chain that is not found is remembered where it was.")


class FusionConfig(Section):
    """Many views of a thing at rest as one cloud (`--static`)."""

    voxel: float | None = Field(
        None, gt=0, description="m, edge of the voxels in which points are averaged; null: how far apart a frame's points are."
    )
    min_views: int = Field(
        2,
        ge=1,
        description="frames that must have seen something near a voxel if others saw through it; half of all where they are few.",
    )
    cell: float = Field(4.0, ge=1, description="voxels; what is as near as this is near.")
    max_sights: int = Field(24, ge=2, description="frames, evenly over all, whose masks tell where the axis is.")


class Config(Section):
    """The whole configuration, a section per stage."""

    mode: Literal["auto", "2d"] = Field(
        "auto", description="auto: 3-D; 2d: in the image, lengths in pixels, depth forgotten where there is any."
    )
    seed: int = Field(0, ge=0, description="of everything that draws random numbers.")
    segment: SegmentConfig = SegmentConfig()
    voxelize: VoxelizeConfig = VoxelizeConfig()
    thin: ThinConfig = ThinConfig()
    traverse: TraverseConfig = TraverseConfig()
    fit: FitConfig = FitConfig()
    prune: PruneConfig = PruneConfig()
    merge: MergeConfig = MergeConfig()
    fill: FillConfig = FillConfig()
    refine: RefineConfig = RefineConfig()
    grow: GrowConfig = GrowConfig()
    evidence: EvidenceConfig = EvidenceConfig()
    tracks: TracksConfig = TracksConfig()
    fusion: FusionConfig = FusionConfig()

    def to_yaml(self) -> str:
        """The effective configuration as YAML that load_config reads back to the same Config."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)
