"""The settings: one frozen model per stage, in two tiers.

Basic settings are those a user sets for a camera and an object; expert settings are the paper's weights, what presets need,
and what unusual sensors need. Everything else is a named constant, with its unit and reason, in the file of its stage.

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
    """Return a pydantic field of the expert tier."""
    return Field(default, description=description, json_schema_extra={"tier": EXPERT}, **bounds)


def is_expert(field: FieldInfo) -> bool:
    """Tell whether a field is of the expert tier."""
    extra = field.json_schema_extra
    return isinstance(extra, dict) and extra.get("tier") == EXPERT


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
    """Tell which pixels or points are the object."""

    method: Literal["auto", "hsv", "mask", "plane", "background", "everything", "ridge"] = Field(
        "auto",
        description="Method that tells the object from the rest. auto takes the given mask; else hsv where ranges are set, "
        "background where a reference is; else plane where the scene holds a broad surface, everything where it does not, and "
        "ridge in 2-D. Set it when auto takes the wrong one.",
    )
    ranges: tuple[HsvRange, ...] = Field(
        (), description="Color ranges of the object for hsv, joined. OpenCV's 8-bit HSV. `doo3d tune` proposes them."
    )
    reference: str | None = Field(
        None,
        description="Image of the scene without the object, for background. Path of a depth image (16-bit PNG) or a color image.",
    )
    reference_depth_scale: float = expert(
        1000.0, "Depth units of the reference depth image. Units per metre, over 0. Change it with the camera's units.", gt=0
    )
    depth_difference: float = expert(
        0.004,
        "Least distance in front of the reference that counts as object, for background. m, over 0. Set it to a few times "
        "the depth noise.",
        gt=0,
    )
    color_difference: float = expert(
        30.0,
        "Least color distance from the reference that counts as object, for background. 8-bit RGB, 0 to 442. Raise it under "
        "flickering light.",
        gt=0,
        le=442,
    )
    plane_distance: float = Field(
        0.003,
        gt=0,
        description="Least height above the supporting plane that counts as object, for plane. m, over 0. Keep it above "
        "the depth "
        "noise and below the object's radius.",
    )
    max_width: float = Field(
        0.05,
        gt=0,
        description="Remove regions that are wider than this in every direction, such as a table or a gripper. m, over "
        "0. Raise it "
        "for hoses thicker than this; masks that the caller gives and everything are not touched.",
    )
    max_width_ratio: float = expert(
        2.5,
        "Remove regions that are wider in every direction than this multiple of the median width. Ratio, over 1. Raise it for "
        "objects of very different widths; masks that the caller gives and everything are not touched.",
        gt=1,
    )
    min_depth: float = Field(
        0.02,
        gt=0,
        description="Ignore nearer readings; an object nearer than this has a wrong unit. m, over 0. Lower it for macro lenses.",
    )
    max_depth: float = Field(
        20.0,
        gt=0,
        description="Ignore farther readings; an object farther than this has a wrong unit. m, over 0. Raise it outdoors.",
    )
    outlier_slope: float = expert(
        0.003,
        "Largest depth step between neighboring readings of one surface. m per pixel of distance, over 0; raised to a "
        "multiple of "
        "the measured depth noise by itself. Raise it if strands that run away from the camera lose parts.",
        gt=0,
    )
    min_component: int = expert(
        30,
        "Remove smaller connected pieces of the mask, and close smaller holes in it. Pixels, 1 or more. Lower it for far, thin "
        "wires in small images.",
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
    """Turn points into a sparse voxel grid."""

    radius: float | None = Field(
        None,
        gt=0,
        description="Radius of the object if it is known. m (px in 2-D), over 0; null measures it. Set it if the "
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
        "Use only the part of a strand's mask that is at least this fraction of the half-width away from its edge. 0 to "
        "1; 0 uses "
        "all of it. Raise it if strands side by side merge.",
        ge=0,
        lt=1,
    )
    core_margin_px: float = expert(
        0.0,
        "Also use pixels that are at most this much nearer to the edge than the middle of the strand is. Pixels, 0 or "
        "more. Raise "
        "it if thin strands break.",
        ge=0,
    )
    split_at_depth_step: float = expert(
        0.0,
        "Split strands where the depth steps down by at least this much, as where one passes beneath another. Radii, 0 "
        "or more; "
        "0 turns it off. Set it to 1 for piles of stiff tubes.",
        ge=0,
    )


class TraverseConfig(Section):
    """Turn the skeleton into ordered paths."""

    method: Literal["graph", "contours"] = expert(
        "graph",
        "graph follows every branch of the skeleton once; contours follows both sides of each skeleton, as the paper does, in "
        "2-D only. Change it only to reproduce the paper.",
    )
    min_branch: float = Field(
        2.5,
        ge=0,
        description="Remove shorter branches that have a free end: spurs of the thinning. Radii, 0 or more. Raise it "
        "for hairy ropes.",
    )


class FitConfig(Section):
    """Lay chains of equal segments along the paths: the paper's traversal algorithm (Algorithm 2)."""

    segment_length: float = Field(
        0.01, gt=0, description="Length of every segment, l_s. m (px in 2-D), over 0. Shorter follows tighter bends."
    )
    max_turn: float = Field(
        60.0,
        gt=0,
        lt=180,
        description="End a chain at a turn sharper than this. Degrees between segments, 0 to 180. Lower it for stiff objects.",
    )


class PruneConfig(Section):
    """Remove segments that overlap with others."""

    width: float | None = expert(
        None,
        "Width of the cuboids that are tested for overlap. m (px in 2-D), over 0; null takes 1.5 voxels. Set it only to "
        "reproduce "
        "the paper.",
        gt=0,
    )


class Bending(NamedTuple):
    """How much bending counts against a connection, and how much of its curvature an end is expected to keep."""

    direction_weight: float
    curvature_weight: float
    curvature_persistence: float


STIFFNESS: dict[str, Bending] = {
    "thread": Bending(25.0, 25.0, 0.2),
    "rope": Bending(50.0, 50.0, 0.5),
    "cable": Bending(100.0, 100.0, 0.7),
    "rod": Bending(200.0, 200.0, 0.9),
}
"""Weights per radian, and persistence. "cable" holds the paper's weights; docs/pages/accuracy.md scores each of them."""


class MergeConfig(Section):
    """Decide which chain ends belong together: the paper's equations 1 to 5."""

    chains: int | None = Field(
        None, ge=1, description="Number of chains wanted. 1 or more; null decides from the data. Set it if you know the number."
    )
    stiffness: Literal["thread", "rope", "cable", "rod"] = Field(
        "cable",
        description="Stiffness of the object: how much a bend counts against a connection, and how far an end keeps its "
        "curvature. "
        "thread, rope, cable or rod. Choose the nearest; the three settings it stands for win where they are set.",
    )
    max_cost: float = Field(
        500.0,
        gt=0,
        description="Do not make connections that cost more. Cost units (1 per mm of gap, weights per radian), over 0; "
        ".inf allows all. "
        "Lower it if parts are joined that do not belong together.",
    )
    max_gap: float = Field(
        0.25, gt=0, description="Do not join ends farther apart. m (px in 2-D), over 0. Raise it for wide occluders."
    )
    min_length: float = Field(
        4.0,
        ge=0,
        description="Remove shorter chains when the number is decided from the data. Radii, 0 or more. Raise it if "
        "clutter is found.",
    )
    allow_closed_chains: bool = Field(
        False,
        description="Join the two ends of one chain to a ring when nothing else is left to join. Set it for loops such as belts.",
    )
    strategy: Literal["greedy", "global"] = expert(
        "global",
        "greedy makes the cheapest connection first, as the paper does; global makes all connections at the least total cost "
        "(maximum-weight matching). Change it only to reproduce the paper.",
    )
    distance_weight: float = expert(
        1.0, "Cost of distance, w_e. Per mm (per px in 2-D), 0 or more. Raise it if connections are too long.", ge=0
    )
    direction_weight: float | None = expert(
        None, "Cost of a change of direction, w_d. Per radian, 0 or more; null takes it from stiffness.", ge=0
    )
    curvature_weight: float | None = expert(
        None, "Cost of a change of curvature, w_c. Per radian, 0 or more; null takes it from stiffness.", ge=0
    )
    curvature_persistence: float | None = expert(
        None,
        "Fraction of its curvature that an end is expected to keep across a gap. 0 to 1; 0 is the paper's, null takes "
        "it from stiffness.",
        ge=0,
        le=1,
    )
    free_space_weight: float = expert(
        20.0,
        "Cost of a gap that runs through space the camera saw to be empty. Per mm (per px in 2-D), 0 or more; 0 turns "
        "it off. Lower "
        "it if masks or depth have many holes.",
        ge=0,
    )
    unknown_weight: float = expert(
        2.0,
        "Cost of a gap through places without depth, or in a cloud without a camera. Per mm (per px in 2-D), 0 or more. "
        "Lower it for "
        "sensors with large holes.",
        ge=0,
    )
    exposed_end_cost: float = expert(
        0.0,
        "Cost added for each end in plain view (no occluder ahead of it), since it is probably a real tip. Cost units, "
        "0 or more; 0 "
        "turns it off. Raise it for piles of tubes.",
        ge=0,
    )
    gap_side: Literal["outside", "inside"] = expert(
        "outside",
        "Where ends turn away from each other, lead the gap path round the outside of the gap or through its inside. "
        "Change it for objects that fold back on themselves.",
    )
    tangent_window_radii: float = expert(
        10.0,
        "Length of chain over which the direction of an end is measured. Radii, 0 or more; 0 takes the last segment "
        "alone, as the "
        "paper does. Lower it for objects with tight bends.",
        ge=0,
    )
    custom_costs: dict[str, float] = expert(
        {}, "Weights of cost terms of your own, by their names in doo3d.stages.merge.costs.CUSTOM_COSTS."
    )

    @property
    def bending(self) -> Bending:
        """The three settings of bending: as set, else as `stiffness` says."""
        own = (self.direction_weight, self.curvature_weight, self.curvature_persistence)
        return Bending(*(given if value is None else value for value, given in zip(own, STIFFNESS[self.stiffness], strict=True)))


class RefineConfig(Section):
    """Estimate the axis and the radius from the seen surface, and lay equal segments."""

    iterations: int = expert(
        2, "Times the axis is estimated from the surface. 0 to 10; 0 leaves the chain on the surface.", ge=0, le=10
    )
    min_radius_ratio: float = expert(
        0.0,
        "Remove chains thinner than this fraction of the thickest chain's radius: lines of the background. 0 to 1; 0 "
        "turns it off. "
        "Lower it for objects of different widths.",
        ge=0,
        lt=1,
    )
    occluded: Literal["from_gaps", "from_depth", "both"] = expert(
        "both",
        "Which segments are marked occluded. from_gaps: those in gaps of at least segment_length that merging closed; "
        "from_depth: "
        "those without a surface point near; both: those in gaps that the surface points confirm.",
    )


class CrossingsConfig(Section):
    """Tell where strands cross in the view, and which is on top."""

    use_color: bool = Field(
        True,
        description="Let the color in the overlap tell which strand is on top, beside depth. Turn it off for printed or "
        "striped "
        "objects whose colors repeat.",
    )


class ExtendMaskConfig(Section):
    """Follow strands beyond the mask by their colors in the image (2-D)."""

    max_length: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="Follow a strand up to this far beyond the end of the mask. Radii, 0 to 1000; 0 turns it off. Lower it if "
        "chains run on into the background.",
    )


class VisibilityConfig(Section):
    """Tell from the depth image whether a place is seen, hidden or free."""

    margin: float = expert(
        0.004,
        "Count a place as free space where the depth lies at least this much behind it. m, over 0. Raise it for sensors "
        "with more "
        "depth noise.",
        gt=0,
    )
    own_object_counts_as_free: bool = expert(
        False, "Count a place as free space also where the surface behind it is the object itself. Set it for piles of tubes."
    )


class TrackingConfig(Section):
    """Keep each chain's identity from frame to frame."""

    max_motion_lengths: float = expert(
        0.1,
        "Largest mean motion of a chain from one frame to the next. Chain lengths, over 0. Raise it for fast motion or "
        "few frames "
        "per second.",
        gt=0,
    )


class FusionConfig(Section):
    """Fuse many views of an object at rest into one cloud (`--fuse-views`)."""

    min_views: int = expert(
        2,
        "Frames that must show a place, where others see through it, to keep it. 1 or more; half of all frames where "
        "they are few. "
        "Raise it for noisy sensors.",
        ge=1,
    )


class Config(Section):
    """The whole configuration, a section per stage."""

    mode: Literal["auto", "2d"] = Field(
        "auto", description="auto works in 3-D; 2d in the image, with lengths in pixels and without depth. The presets set it."
    )
    seed: int = Field(0, ge=0, description="Seed of everything that draws random numbers. 0 or more.")
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
        """Return the effective configuration as YAML that load_config reads back to the same Config."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)
