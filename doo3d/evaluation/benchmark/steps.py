"""Define the steps of the method and how each is removed: by a setting, or by a replacement that does nothing."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.special import logit

from ...judge.evidence import WEIGHTS_GIVEN
from ...scene.masked import NO_NUMBERS
from ...types import Array
from .trials import BRANCHED


@dataclass(frozen=True)
class Ablation:
    """How one step of the method is removed.

    Attributes
    ----------
    settings
        dotted key of the config -> value, such as "merge.strategy" -> "greedy".
    places
        "module:NAME" in the source code -> its replacement: a function that does nothing, or another value of a constant.
    modules
        modules in `doo3d` that exist for this step alone; their lines and numbers are its cost.
    made_for
        kinds of data (keys of `trials.KINDS`) that the step was made for; they have a row of their own besides that of all data.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    places: Mapping[str, Any] = field(default_factory=dict)
    modules: tuple[str, ...] = ()
    made_for: tuple[str, ...] = ("frames", "stereo", "ragged")


def _first(value: Any, *_: Any) -> Any:
    """Return the first argument unchanged; it replaces functions that would change it."""
    return value


def _no_split(facts: Any, *_: Any) -> Any:
    from ...segment.split_strands import SplitMask

    return SplitMask(facts.mask, 0)


def _repaired_where_ragged(mask: Any, color: Any, *_: Any) -> Any:
    from ...segment.mask_repair import repair_mask

    return repair_mask(mask, color)


def _no_strand_filter(readings: Any, *_: Any) -> Any:
    return readings, 0


def _nothing_beside(value: Any, known: Any, surface: Any, *rest: Any, **limits: Any) -> Any:
    from ...kernels import smooth_strand_depth

    return smooth_strand_depth(value, known, surface[:0], *rest, **limits)


def _readings_alone(readings: Any, *rest: Any) -> Any:
    from ...segment.strand_filter import filter_along_strands

    filtered, count = filter_along_strands(readings, *rest)
    kept = np.isin(filtered.pixels @ (1, 1 << 32), readings.pixels @ (1, 1 << 32))  # both in row-major order
    return readings._replace(depth=filtered.depth[kept], filtered=filtered.filtered[kept]), count


def _all(_: Any, pixels: Any, *__: Any) -> Any:
    return np.ones(len(pixels), dtype=bool)


def _none(*_: Any, **__: Any) -> None:
    return None


def _no_layers(*_: Any) -> Array:
    return NO_NUMBERS


def _nothing(*_: Any, **__: Any) -> list[Any]:
    return []


class _NoSupport:
    beside = staticmethod(_none)


def _confidence_without(kind: str) -> Ablation:
    weights = {name: 0.0 if name == kind else weight for name, weight in WEIGHTS_GIVEN.items()}
    return Ablation(places={"doo3d.judge.evidence:WEIGHTS_GIVEN": weights}, made_for=("frames", "stereo", "ragged", "images"))


DEPTH = ("stereo", "ragged")
ABLATIONS: dict[str, Ablation] = {
    "mask repair": Ablation(
        places={"doo3d.segment.segment:repair_mask": _first}, modules=("segment.mask_repair",), made_for=("ragged", "untold")
    ),
    "masks made by depth repaired": Ablation(
        places={"doo3d.segment.segment:repair_mask": _repaired_where_ragged}, made_for=("untold",)
    ),
    "parts judged by a network": Ablation({"segment.method": "strands"}, modules=("segment.judged_parts",), made_for=("untold",)),
    "surface learned outside of bands": Ablation(
        places={"doo3d.segment.color_strands:relearn_background": _none}, made_for=("untold",)
    ),
    "colors vote in photographs": Ablation(
        places={"doo3d.segment.methods.network:_with_colors": lambda probability, _: logit(probability)},
        made_for=("photographs",),
    ),
    "split strands": Ablation(
        places={"doo3d.segment.segment:split_strands": _no_split},
        modules=tuple(f"segment.{name}" for name in ("split_strands", "valleys", "valley_lines", "wide_stretches")),
    ),
    "layers by color": Ablation(
        places={"doo3d.segment.split_strands:color_layers": _no_layers},
        modules=("segment.color_layers", "links.hidden_strands", "links.terms.layers"),
    ),
    "strand filter": Ablation(
        places={"doo3d.segment.segment:filter_along_strands": _no_strand_filter},
        modules=("segment.strand_filter",),
        made_for=DEPTH,
    ),
    "strand filter: drawn to the surface": Ablation(
        places={"doo3d.segment.strand_filter:_drawn_to_surface": _first}, made_for=DEPTH
    ),
    "strand filter: runs of readings": Ablation(places={"doo3d.segment.strand_filter:MAX_SLOPE": np.inf}, made_for=DEPTH),
    "strand filter: the background is recognized beside the strand": Ablation(
        places={"doo3d.segment.strand_filter:smooth_strand_depth": _nothing_beside}, made_for=DEPTH
    ),
    "strand filter: all pixels of a smoothed strand": Ablation(
        places={"doo3d.segment.segment:filter_along_strands": _readings_alone}, made_for=DEPTH
    ),
    "outliers of depth": Ablation(places={"doo3d.segment.depth_filter:OUTLIER_MIN_NEIGHBORS": 0}),
    "inpainting of depth": Ablation(
        places={"doo3d.segment.segment:inpaint_readings": _first}, modules=("segment.depth_inpainting",)
    ),
    "sparse strands": Ablation(
        places={"doo3d.segment.segment:find_sparse_strands": _none},
        modules=("segment.sparse_strands", "segment.point_lines"),
        made_for=("lines",),
    ),
    "voxels along the rays": Ablation(
        places={"doo3d.skeleton.voxelize:_along_rays": _first, "doo3d.skeleton.voxelize:_in_space": _first}, made_for=DEPTH
    ),
    "voxels of the core alone": Ablation({"voxelize.core_fraction": 0}),
    "voxels of middle lines between touching strands": Ablation(places={"doo3d.skeleton.core_pixels:middle_pixels": _all}),
    "cut at occluding edges": Ablation({"voxelize.split_at_depth_step": 0}),
    "spurs": Ablation({"traverse.min_branch": 0}),
    "small loops": Ablation(places={"doo3d.skeleton.traverse:MIN_LOOP_RADII": 0.0}),
    "forks of a crossing united": Ablation(places={"doo3d.skeleton.traverse:JUNCTION_MERGE_DISTANCE_RADII": 0.0}),
    "paths cut back at junctions": Ablation(places={"doo3d.skeleton.traverse:TOUCHING_RADII": 0.0}),
    "gaps along which the object is seen": Ablation(
        places={"doo3d.links.ends:depth_gaps": lambda *_: ({}, ())}, modules=("links.depth_gaps",), made_for=DEPTH
    ),
    "cost of bends": Ablation({"merge.direction_weight": 0, "merge.curvature_weight": 0}),
    "cost of free space": Ablation({"merge.free_space_weight": 0}),
    "all connections decided together": Ablation({"merge.strategy": "greedy"}),
    "bare surface": Ablation(
        places={"doo3d.scene.frame:Support": _NoSupport},
        modules=("scene.surface_beside",),
        made_for=("stereo", "ragged", "images"),
    ),
    "ends extended to the surface": Ablation(places={"doo3d.chains.refine:extend_to_surface": _first}),
    "second iteration of the axis": Ablation({"refine.iterations": 1}),
    "smoothing of the axis": Ablation(places={f"doo3d.scene.{name}:SMOOTHING_RADII": 0.0 for name in ("axis", "axis_in_mask")}),
    "depth weighs less than the mask": Ablation(places={"doo3d.scene.axis_in_mask:DEPTH_WEIGHT": 1.0}),
    "axis raised out of the plane": Ablation(places={"doo3d.scene.axis_in_mask:MAX_SUNK_RADII": 0.0}, made_for=DEPTH),
    "mask extended along strands": Ablation(
        {"extend_mask.max_length": 0}, modules=("segment.extend_mask",), made_for=("images",)
    ),
    "upper strand by depth": Ablation(
        places={"doo3d.scene.frame:depth_log_odds": lambda *_: 0.0, "doo3d.scene.cloud:cloud_log_odds": lambda *_: 0.0}
    ),
    "upper strand by color": Ablation(
        places={f"doo3d.scene.{kind}:color_log_odds": lambda *_: 0.0 for kind in ("frame", "image")}
    ),
    "other interpretations of uncertain frames": Ablation(
        places={"doo3d.judge.interpretations:OTHERS": ()}, modules=("judge.interpretations",), made_for=DEPTH
    ),
    "bodies": Ablation(
        places={"doo3d.links.branches.branches:body_contacts": _nothing}, modules=("links.branches.bodies",), made_for=BRANCHED
    ),
    "necks": Ablation(
        places={"doo3d.links.branches.attachments:NECK_COST": 0.0}, modules=("links.branches.necks",), made_for=BRANCHED
    ),
    "joins across gaps of a branched cloud": Ablation(
        places={"doo3d.links.branches.branches:gap_links": _nothing},
        modules=("links.branches.clouds",),
        made_for=("harness clouds",),
    ),
    **{f"confidence by {kind}": _confidence_without(kind) for kind in WEIGHTS_GIVEN if kind != "base"},
}
"""Name of a step -> how it is removed."""
