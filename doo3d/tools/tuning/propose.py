"""Propose a configuration from one frame and, optionally, from picked pixels on the object."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...config import Config, HsvRange, SegmentConfig
from ...errors import InputError
from ...geometry.radii import STEP_RADII
from ...scene.frame import SIZE_OVER_SPACING, VIEW_EDGE
from ...scene.frame_facts import FrameFacts
from ...segment import segment
from ...segment.methods import resolve_method
from ...types import Array, Bools, Cloud, Frame, Image
from ...types.display import counted
from .color_ranges import MAX_FALSE_SHARE, OTHER_METHODS, core, find_ranges, fit_ranges, full_size, reduced
from .hsv_range import completed_mask
from .strands import Strand, find_strands, lost_strands
from .thin_object import thin_components

SEGMENT_RADII = 2.5
"""Length of a segment in radii: short enough for the bends of a cable, long enough for a reliable direction."""

MIN_SEGMENT_SPACINGS = 6
"""Least length of a segment, in pixel spacings."""

ROUND_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Mantissas of round numbers."""

SIDE_BY_SIDE_RATIO = 1.7
"""Ratio of a mask's width to that of its narrow components above which it contains strands side by side."""

MIN_WIDTH_PX = 3.0
"""Width in px below which an object is not detected reliably."""

MIN_RECALL, MIN_PRECISION = 0.85, 0.85
"""Recall and precision of the segmentation below which the user gets advice."""

MAX_MISSING_DEPTH = 0.3
"""Fraction of the object without depth above which the user gets advice."""

MAX_WIDTH_MARGIN = 0.6
"""Ratio of the object's width to segment.max_width above which max_width is raised to twice the width."""

ONE_BY_ONE = "for color ranges of some strands only, select these: --pick X,Y, for each the pixel listed above"


@dataclass(frozen=True)
class Tuned:
    """A proposed configuration, and how well it segments the frame that it was made from.

    Attributes
    ----------
    config
        the proposed configuration, complete.
    mask
        (H, W) bool, the pixels that this configuration segments.
    object_mask
        (H, W) bool, the pixels of the thin object that tuning found; None if the frame has no color.
    recall
        fraction of the pixels of `object_mask` that are in `mask`, 0 to 1; None without `object_mask`.
    precision
        fraction of the pixels of `mask` that are in `object_mask`, 0 to 1; None without `object_mask`.
    width_px
        typical width of the segmented object, px.
    width_m
        typical width of the segmented object, m; None in the 2-D mode and for an image without depth.
    reasons
        dotted key of the config, such as "fit.segment_length" -> why it has its value.
    advice
        what the user could do to improve the result, one sentence each; may be empty.
    strands
        the strands that detection finds with the initial configuration, one sentence each: length, a pixel, and whether the color
        ranges find it; empty if the user picked the object, or nothing was found.
    """

    config: Config
    mask: Bools
    object_mask: Bools | None
    recall: float | None
    precision: float | None
    width_px: float
    width_m: float | None
    reasons: dict[str, str] = field(default_factory=dict)
    advice: tuple[str, ...] = ()
    strands: tuple[str, ...] = ()


def tune(
    data: Frame | Cloud | Image,
    config: Config,
    picks: Sequence[tuple[int, int]] = (),
    box: tuple[int, int, int, int] | None = None,
) -> Tuned:
    """Propose a configuration for one frame: segmentation, voxel size and segment length.

    With color, the strands that detection finds with `config` get color ranges (method "hsv"), if detection then finds all of
    them again and nothing else; if not, the method is kept. Without color, the method that suits the depth is chosen.
    Proposed lengths are in m for a frame, in px for an image.

    Parameters
    ----------
    data
        a frame with depth, or an image.
    config
        the initial configuration; values that are not tuned are kept. In the 2-D mode, the depth of a frame with color is
        ignored.
    picks
        (x, y) px of pixels on the object, one for each of its colors.
    box
        (x, y, w, h) px, a region that contains the object: upper left corner, width and height. Ignored if there are picks.
        Where detection finds nothing and there are no picks, the box or the whole image is searched for the most prominent thin,
        long object with a color of its own.

    Raises
    ------
    InputError
        a pick or the box is outside the image, or given for a frame without color; no thin object is found; no color range
        separates it from the background; or the data is a cloud.
    """
    if isinstance(data, Cloud):
        raise InputError(
            "tuning needs an image, and a cloud has none: give a frame with depth, or a photograph", code="mode-needs-image"
        )
    if isinstance(data, Frame) and config.mode == "2d" and data.color is not None:
        data = Image(data.color, data.name, data.timestamp)
    if data.color is None:
        if picks or box:
            raise InputError(
                "the frame has no color that a pick or a box could select: leave out --pick and --box", code="method-needs-color"
            )
        segmentation = config.segment.model_copy(update={"method": resolve_method(data, config.segment)})
        return _propose_lengths(
            data, config, segmentation, [], {"segment.method": "there is no color, and this method suits the depth"}
        )
    if not picks and box is None and (strands := find_strands(data, config)):
        return _tune_strands(data, data.color, config, strands)
    tuned = _propose_colors(data, config, *find_ranges(data.color, picks, box))
    if not picks and box is None and all(strand.is_doubtful for strand in find_strands(data, tuned.config)):
        raise InputError(
            f"detection finds no strand, and only doubtful ones in the color of the longest thin object: {OTHER_METHODS}",
            code="color-not-distinct",
        )
    return tuned


def _propose_colors(data: Frame | Image, config: Config, objects: list[Bools], ranges: tuple[HsvRange, ...]) -> Tuned:
    """Return the configuration that segments objects with masks (H, W) by color ranges."""
    colors = f"the colors of {len(objects)} objects" if len(objects) > 1 else "the color of the thin object"
    reasons = {
        "segment.method": "the object has a color of its own",
        "segment.ranges": f"{colors} from shadow to highlight, unless the background has them too",
    }
    segmentation = config.segment.model_copy(update={"method": "hsv", "ranges": ranges})
    return _propose_lengths(data, config, segmentation, objects, reasons)


def _tune_strands(data: Frame | Image, color: Array, config: Config, strands: list[Strand]) -> Tuned:
    """Return the configuration for the strands that detection finds with the initial one.

    The result has color ranges if detection with them finds every strand again and no further chains; otherwise the method is
    kept.
    """
    small, scale = reduced(color)
    thin = [core(strand.thin, small.shape[1::-1], scale) for strand in strands]
    completed = [replace(each, mask=completed_mask(small, each)) for each in thin]
    ranges, false = fit_ranges(small, completed)
    objects = [full_size(each.mask, color) for each in completed]
    try:
        tuned = _propose_colors(data, config, objects, tuple(dict.fromkeys(ranges)))
        again = find_strands(data, tuned.config)
        lost = lost_strands(strands, again)
    except InputError:  # nothing is left of the object with these ranges
        again, lost = [], strands
    listed = []
    for strand, share in zip(strands, false, strict=True):
        is_lost = any(strand is each for each in lost)
        elsewhere = f"; {share:.0%} of the pixels of its color lie elsewhere" if share > MAX_FALSE_SHARE else ""
        listed.append(f"{strand}: {'lost' if is_lost else 'found'} with color ranges{elsewhere}")
    if not lost and len(again) <= len(strands):
        return replace(tuned, strands=tuple(listed))
    fault = f"lose {counted(len(lost), 'strand')}" if lost else f"give {counted(len(again), 'chain')} in place"
    reasons = {"segment.method": f"kept, since color ranges {fault} of {len(strands)}"}
    kept = _propose_lengths(data, config, config.segment, [], reasons)
    if lost_strands(strands, find_strands(data, kept.config)):
        unchanged = dict.fromkeys(("fit.segment_length", "voxelize.size"), "kept, since other lengths lose strands")
        kept = replace(kept, config=config, reasons=reasons | unchanged)
    return replace(kept, strands=tuple(listed), advice=(*kept.advice, *([ONE_BY_ONE] if len(strands) > 1 else [])))


def _propose_lengths(
    data: Frame | Image, config: Config, segmentation: SegmentConfig, objects: list[Bools], reasons: dict[str, str]
) -> Tuned:
    """Return the configuration with the lengths derived from the width of the segmented object.

    Parameters
    ----------
    data
        the frame or image.
    config
        configuration whose other values are kept.
    segmentation
        the proposed section `segment`.
    objects
        masks (H, W) bool of the objects; empty without color.
    reasons
        dotted key -> reason, for the values proposed already; those of the lengths are added.
    """
    object_mask = np.logical_or.reduce(objects) if objects else None
    if object_mask is not None and isinstance(data, Frame):
        object_width = 2 * FrameFacts(object_mask, data.depth).radius(data.camera.fx)
        if object_width and object_width > MAX_WIDTH_MARGIN * segmentation.max_width:
            segmentation = segmentation.model_copy(update={"max_width": round(2 * object_width, 3)})
            reasons["segment.max_width"] = f"the object is {1000 * object_width:.0f} mm wide"
    scene = segment(data, segmentation, None, config.seed).scene
    if not scene.mask.any():
        raise InputError(f"segment: nothing is left of the object: {OTHER_METHODS}", code="object-missing")
    mask = scene.mask
    radius_px = FrameFacts(mask).radius()
    if isinstance(data, Frame):
        radius = FrameFacts(mask, data.depth).radius(data.camera.fx)
        unit, spacing = "m", float(np.median(scene.points[:, 2])) / data.camera.fx
    else:
        radius, unit, spacing = radius_px, "px", 1.0
    length = segment_length(radius, spacing)
    reasons["fit.segment_length"] = f"{length / radius:.1f} radii of an object {_length_text(2 * radius, unit)} wide"
    size, reasons["voxelize.size"] = _voxel_size(mask, radius, radius_px, spacing, unit)
    proposed = config.model_copy(
        update={
            "segment": segmentation,
            "fit": config.fit.model_copy(update={"segment_length": length}),
            "voxelize": config.voxelize.model_copy(update={"size": size}),
        }
    )
    recall = float(np.mean(mask[object_mask])) if object_mask is not None else None
    precision = float(np.mean(object_mask[mask])) if object_mask is not None else None
    width_px = 2 * radius_px
    advice = _advice(data, mask, width_px, recall, precision)
    width_m = 2 * radius if unit == "m" else None
    return Tuned(proposed, mask, object_mask, recall, precision, width_px, width_m, reasons, advice)


def segment_length(radius: float, spacing: float) -> float:
    """Return the proposed length of a segment: about 2.5 radii of the object, or about 6 pixel spacings if that is longer.

    The length is the nearest of the round numbers 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8 and 10 times a power of ten. Shorter segments
    would have no reliable direction.

    radius : radius of the object, m (px in 2-D). spacing : distance on the object between neighboring pixels, in the same unit.
    """
    wanted = max(SEGMENT_RADII * radius, MIN_SEGMENT_SPACINGS * spacing)
    power = 10.0 ** math.floor(math.log10(wanted))
    return float(f"{min((step * power for step in ROUND_STEPS), key=lambda step: abs(math.log(step / wanted))):.6g}")


def _length_text(length: float, unit: str) -> str:
    return f"{1000 * length:.1f} mm" if unit == "m" else f"{length:.1f} px"


def _voxel_size(mask: Bools, radius: float, radius_px: float, spacing: float, unit: str) -> tuple[float | None, str]:
    """Return the proposed edge of a voxel in m, and the reason; None if the default is suitable.

    Parameters
    ----------
    mask
        (H, W) bool.
    radius, radius_px
        radius of the object in `unit`, and in px.
    spacing
        distance on the object between neighboring pixels, in `unit`.
    unit
        "m" or "px".
    """
    if unit == "px":
        return None, "in 2-D the pixels are the grid"
    narrow_px = float(np.min([thin_components(mask).half_width or radius_px, radius_px]))
    in_radii = VIEW_EDGE * STEP_RADII
    by_radius, by_spacing = in_radii * radius, VIEW_EDGE * SIZE_OVER_SPACING * spacing
    if radius_px > SIDE_BY_SIDE_RATIO * narrow_px:
        size = round(max(by_radius * narrow_px / radius_px, by_spacing), 5)
        return size, "strands lie side by side in the mask, so the width of single strands decides"
    why = f"{in_radii:g} radii" if by_radius >= by_spacing else f"the pixel spacing is too coarse for {in_radii:g} radii"
    return None, f"detection chooses {_length_text(max(by_radius, by_spacing), unit)} in this frame: {why}"


def _advice(data: Frame | Image, mask: Bools, width_px: float, recall: float | None, precision: float | None) -> tuple[str, ...]:
    sentences = []
    if recall is not None and recall < MIN_RECALL:
        sentences.append("part of the object is missed (red in the picture): add one more --pick there")
    if precision is not None and precision < MIN_PRECISION:
        sentences.append("other things have its color too (yellow in the picture): exclude them with masks, or from the view")
    if width_px < MIN_WIDTH_PX:
        sentences.append(f"the object is only {width_px:.1f} px wide: move the camera closer, or use a higher resolution")
    if isinstance(data, Frame) and (missing := float(np.mean(data.depth[mask] <= 0))) > MAX_MISSING_DEPTH:
        sentences.append(f"{missing:.0%} of the object has no depth: its path there is interpolated; change light or distance")
    return tuple(sentences)
