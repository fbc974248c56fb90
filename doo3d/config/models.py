"""The settings: one frozen model per stage, in two tiers.

Basic settings are those a user sets for a camera and an object. Expert settings are the weights of Keipour et al. (RA-L
2022), what presets need, and what unusual sensors need. Everything else is a named constant, with its unit and reason, in the
file of its stage.

Lengths are metres in 3-D and pixels in 2-D; lengths that depend on the object are given in its radii or in
voxels, so that they hold for a thread as for a hose.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import yaml
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.fields import FieldInfo

EXPERT = "expert"
"""The tier of a setting in its `json_schema_extra`; settings without one are basic."""


def expert(default: Any, description: str, **bounds: Any) -> Any:
    """Return a pydantic field marked as an expert setting, to be assigned in a model's class body.

    Parameters
    ----------
    default
        value of the setting if none is given.
    description
        help text of the setting.
    **bounds
        limits as pydantic's `Field` takes them: ge, gt, le, lt.
    """
    return Field(default, description=description, json_schema_extra={"tier": EXPERT}, **bounds)


def is_expert(field: FieldInfo) -> bool:
    """Tell whether a field is an expert setting (one made by `expert`), not a basic one."""
    extra = field.json_schema_extra
    return isinstance(extra, dict) and extra.get("tier") == EXPERT


class Section(BaseModel):
    """Base class of the configuration's sections: values cannot be changed, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=True)


Hsv = tuple[int, int, int]


class HsvRange(Section):
    """A range of colors in OpenCV's 8-bit HSV: all colors between two corners, which are included, in hue, saturation and value.

    If the hue of `low` is above that of `high`, the hues run from `low` through red (179, then 0) to `high`.
    """

    low: Hsv = Field(
        description="Lower corner of the box, included: [hue 0 to 179, saturation 0 to 255, value 0 to 255]. A hue above "
        "the upper corner's selects the hues through red."
    )
    high: Hsv = Field(description="Upper corner of the box, included: [hue 0 to 179, saturation 0 to 255, value 0 to 255].")

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
    """Settings of segmentation, which tells which pixels or points are the object."""

    method: Literal["auto", "hsv", "mask", "plane", "background", "everything", "ridge"] = Field(
        "auto",
        description="Method that tells the object from the rest. mask (the mask given), hsv (the colors in `ranges`), "
        "plane (whatever stands out of the dominant plane), background (whatever differs from `reference`), "
        "everything (all points), ridge (thin lines, 2-D only) or auto: the mask if one is given, else hsv if "
        "`ranges` are set, background if `reference` is set, ridge in 2-D, plane if most of the scene is a "
        "broad surface, everything otherwise. Set it if auto chooses wrongly.",
    )
    ranges: tuple[HsvRange, ...] = Field(
        (),
        description="Color ranges of the object, for the method hsv; a pixel in any of them is selected. Boxes {low, "
        "high} of hue 0 to 179, saturation 0 to 255 and value 0 to 255 (OpenCV's 8-bit HSV); a low hue above "
        "the high one selects the hues through red. Set it for an object with a color of its own: `doo3d "
        "tune` proposes ranges.",
    )
    reference: str | None = Field(
        None,
        description="Image of the scene without the object, for the method background. Path of a depth image (16-bit PNG) "
        "or a color image of the frames' size. Set it if the camera and the scene do not move.",
    )
    reference_depth_scale: float = expert(
        1000.0,
        "Unit of the reference if it is a depth image. Depth units per metre, over 0. Change it if the depth is not in mm.",
        gt=0,
    )
    depth_difference: float = expert(
        0.004,
        "Select pixels that are at least this much nearer than the reference depth image, for the method background. "
        "m, over 0. Set it to a few times the depth noise.",
        gt=0,
    )
    color_difference: float = expert(
        30.0,
        "Select pixels whose color is at least this far from the reference color image, for the method background. "
        "Distance in 8-bit RGB, over 0, at most 442. Raise it under flickering light.",
        gt=0,
        le=442,
    )
    plane_distance: float = Field(
        0.003,
        gt=0,
        description="Select points that stand out of the dominant plane, toward the camera, by at least this much, for "
        "the method plane. m, over 0. Keep it above the depth noise and below the object's radius.",
    )
    max_width: float = Field(
        0.05,
        gt=0,
        description="Remove regions wider than this in every direction, such as a gripper or a hand. Masks given by the "
        "caller and the method everything are not affected. m (px in 2-D), over 0. Raise it for objects "
        "thicker than this.",
    )
    max_width_ratio: float = expert(
        2.5,
        "Remove regions wider in every direction than this multiple of the mask's median width. Masks given by the "
        "caller and the method everything are not affected. Ratio, over 1. Raise it for objects of very different "
        "widths.",
        gt=1,
    )
    min_depth: float = Field(
        0.02,
        gt=0,
        description="Ignore depth readings nearer than this; if the median depth is nearer, the frame is refused, since "
        "its unit must be wrong. m, over 0. Lower it for macro lenses.",
    )
    max_depth: float = Field(
        20.0,
        gt=0,
        description="Ignore depth readings farther than this; if the median depth is farther, the frame is refused, since "
        "its unit must be wrong. m, over 0. Raise it outdoors.",
    )
    outlier_slope: float = expert(
        0.003,
        "Largest depth step between neighboring readings of one surface; readings that differ by more from most of "
        "their neighbors are removed. m per pixel of distance, over 0; the program itself raises it to 3 times the "
        "measured depth noise. Raise it if strands that run away from the camera lose parts.",
        gt=0,
    )
    min_component: int = expert(
        30,
        "Remove connected pieces of the mask smaller than this, and close holes smaller than this. Pixels, 1 or more. "
        "Lower it for thin wires far away in small images.",
        ge=1,
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
    """Settings of voxelizing, which turns the object's points into a sparse voxel grid."""

    radius: float | None = Field(
        None,
        gt=0,
        description="Radius of the object, if it is known. m (px in 2-D), over 0; null measures it. Set it if the "
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
        "0 or more; 0 turns it off. Set it to 1 for piles of stiff tubes.",
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

    segment_length: float = Field(
        0.01, gt=0, description="Length of every segment of a chain. m (px in 2-D), over 0. Lower it to follow tighter bends."
    )
    max_turn: float = Field(
        60.0,
        gt=0,
        lt=180,
        description="End a chain where two consecutive segments turn by more than this. Degrees, over 0, below 180. Lower "
        "it for stiff objects.",
    )


class PruneConfig(Section):
    """Settings of pruning: of two segments that overlap, the one in the shorter chain is removed."""

    width: float | None = expert(
        None,
        "Width of the cuboids around the segments that are tested for overlap. m (px in 2-D), over 0; null takes 1.5 "
        "voxels. Set it only to reproduce the results of Keipour et al. (RA-L 2022).",
        gt=0,
    )


class Bending(NamedTuple):
    """The three settings of the section `merge` about how the object bends, as one stiffness sets them.

    Attributes
    ----------
    direction_weight
        cost units per radian of the angle between the directions of two ends.
    curvature_weight
        cost units per radian of the angle by which an end must bend toward the other end.
    curvature_persistence
        fraction of its curvature that an end is expected to keep across a gap, 0 to 1.
    """

    direction_weight: float
    curvature_weight: float
    curvature_persistence: float


STIFFNESS: dict[str, Bending] = {
    "thread": Bending(25.0, 25.0, 0.2),
    "rope": Bending(50.0, 50.0, 0.5),
    "cable": Bending(100.0, 100.0, 0.7),
    "rod": Bending(200.0, 200.0, 0.9),
}
"""Weights per radian, and persistence. "cable" holds the weights of Keipour et al. (RA-L 2022).

docs/pages/accuracy.md scores each stiffness."""


class MergeConfig(Section):
    """Settings of merging, which connects chain ends by their cost (equations 1 to 5 of Keipour et al., RA-L 2022)."""

    chains: int | None = Field(
        None,
        ge=1,
        description="Number of chains to find. 1 or more; null decides from the data. Set it if you know the number of objects.",
    )
    stiffness: Literal["thread", "rope", "cable", "rod"] = Field(
        "cable",
        description="Stiffness of the object: how much a bend adds to the cost of a connection, and how much of its "
        "curvature an end keeps across a gap. thread, rope, cable or rod. Choose the nearest; "
        "direction_weight, curvature_weight and curvature_persistence take precedence where they are set.",
    )
    max_cost: float = Field(
        500.0,
        gt=0,
        description="Do not connect two ends at a higher cost; where `chains` forces further connections, each may cost 3 "
        "times as much. Cost units (1 per mm of gap, or px in 2-D, plus the other weights), over 0; .inf "
        "allows all. Lower it if parts are joined that do not belong together.",
    )
    max_gap: float = Field(
        0.25,
        gt=0,
        description="Do not connect two ends that are farther apart. m (px in 2-D), over 0. Raise it for wide occluders.",
    )
    min_length: float = Field(
        4.0,
        ge=0,
        description="Remove chains shorter than this, if `chains` is null. Radii, 0 or more. Raise it if clutter is found.",
    )
    allow_closed_chains: bool = Field(
        False,
        description="Allow the two ends of a chain to be connected to each other, which makes a ring, when nothing else "
        "is left to join. true or false. Set it for loops such as belts.",
    )
    strategy: Literal["greedy", "global"] = expert(
        "global",
        "How connections are chosen. greedy makes the cheapest connection first, as Keipour et al. (RA-L 2022) do; "
        "global makes all connections at the least total cost (maximum-weight matching). Change it only to reproduce "
        "their results.",
    )
    distance_weight: float = expert(
        1.0,
        "Cost of the distance between two ends (w_e of Keipour et al.). Per mm (per px in 2-D), 0 or more. Raise it "
        "if too distant ends are connected.",
        ge=0,
    )
    direction_weight: float | None = expert(
        None,
        "Cost of the angle between the directions of two ends (w_d of Keipour et al.). Per radian, 0 or more; null "
        "takes it from stiffness. Raise it if connections bend too sharply.",
        ge=0,
    )
    curvature_weight: float | None = expert(
        None,
        "Cost of the angle by which an end must bend toward the other end (w_c of Keipour et al.). Per radian, 0 or "
        "more; null takes it from stiffness. Raise it if ends side by side are connected.",
        ge=0,
    )
    curvature_persistence: float | None = expert(
        None,
        "Fraction of its curvature that an end is expected to keep across a gap. 0 to 1; 0 expects a straight "
        "continuation, as Keipour et al. do, and null takes it from stiffness. Raise it for springy objects.",
        ge=0,
        le=1,
    )
    free_space_weight: float = expert(
        20.0,
        "Cost of the part of a gap path that runs through free space (space the camera saw through). Per mm (per px "
        "in 2-D), 0 or more; 0 turns it off. Lower it if masks or depth have many holes.",
        ge=0,
    )
    unknown_weight: float = expert(
        2.0,
        "Cost of the part of a gap path that runs through places without depth, or, in a cloud without a camera, of "
        "the whole. Per mm (per px in 2-D), 0 or more. Lower it for sensors with large holes.",
        ge=0,
    )
    exposed_end_cost: float = expert(
        0.0,
        "Cost added for each connected end in plain view (no occluder ahead of it), since it is probably a real tip. "
        "Cost units, 0 or more; 0 turns it off. Raise it for piles of tubes.",
        ge=0,
    )
    gap_side: Literal["outside", "inside"] = expert(
        "outside",
        "Side on which the gap path joins two ends that point away from each other. outside leads it around the gap, "
        "inside through it. Change it for objects that fold back on themselves.",
    )
    tangent_window_radii: float = expert(
        10.0,
        "Length of chain over which the direction of an end is measured. Radii, 0 or more; 0 takes the last segment "
        "alone, as Keipour et al. do. Lower it for objects with tight bends.",
        ge=0,
    )
    custom_costs: dict[str, float] = expert(
        {},
        "Weights of cost terms of your own. Name in doo3d.stages.merge.costs.CUSTOM_COSTS -> weight, in cost units "
        "per unit of the term. Set it after adding a term there.",
    )

    @property
    def bending(self) -> Bending:
        """The weights and the persistence in effect: each as it is set, or else as `stiffness` sets it."""
        own = (self.direction_weight, self.curvature_weight, self.curvature_persistence)
        return Bending(*(given if value is None else value for value, given in zip(own, STIFFNESS[self.stiffness], strict=True)))


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
        "Remove chains thinner than this fraction of the thickest chain's radius, such as lines of the background. 0 "
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
        description="Use the color where two strands overlap, besides depth, to tell which one is on top. true or false. "
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


class VisibilityConfig(Section):
    """Settings of visibility, which tells from the depth image whether a place is seen, hidden or free space."""

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


class FusionConfig(Section):
    """Settings of fusion, which makes one cloud from many views of an object at rest (`doo3d detect --fuse-views`)."""

    min_views: int = expert(
        2,
        "Keep a place that fewer frames than this show only if the other views do not see through it. Frames, 1 or "
        "more; half of all frames if that is less. Raise it for noisy sensors.",
        ge=1,
    )


class Config(Section):
    """The whole configuration: a section per stage, and sections for what stages share.

    All fields have defaults; a Config without arguments is the preset "default". It cannot be changed after creation.
    """

    mode: Literal["auto", "2d"] = Field(
        "auto",
        description="Whether to work in space or in the image. auto works in 3-D; 2d in the image, without depth and with "
        "lengths in pixels. Choose a preset rather than set it: image and paper_2d set 2d.",
    )
    seed: int = Field(
        0,
        ge=0,
        description="Seed of all random numbers. Whole number, 0 or more. Change it only to see how much results depend "
        "on chance.",
    )
    segment: SegmentConfig = SegmentConfig()
    voxelize: VoxelizeConfig = VoxelizeConfig()
    traverse: TraverseConfig = TraverseConfig()
    fit: FitConfig = FitConfig()
    prune: PruneConfig = PruneConfig()
    merge: MergeConfig = MergeConfig()
    refine: RefineConfig = RefineConfig()
    crossings: CrossingsConfig = CrossingsConfig()
    extend_mask: ExtendMaskConfig = ExtendMaskConfig()
    visibility: VisibilityConfig = VisibilityConfig()
    tracking: TrackingConfig = TrackingConfig()
    fusion: FusionConfig = FusionConfig()

    def to_yaml(self) -> str:
        """Return all settings with their values as YAML text without comments; `load_config` reads it back to an equal Config."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)
