"""Select the pixels or points of the object (Keipour et al., RA-L 2022, section III-A)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..config import SegmentConfig
from ..errors import InputError
from ..geometry.limits import MAX_CELLS
from ..geometry.mask import dilate
from ..geometry.noise import SAMPLES
from ..scene.frame_facts import FrameFacts
from ..types import Array, Cloud, CloudSampling, Floats, Foreground, Frame, Image, check_mask
from .depth_filter import filter_readings
from .depth_inpainting import inpaint_readings
from .mask_cleanup import remove_plugs, remove_wide_regions
from .mask_image import inversion_note, object_in_mask_image
from .mask_repair import repair_mask
from .methods import SEGMENTERS, resolve_method
from .methods.result import MethodResult
from .point_filter import SPREAD, draw_points, filter_points
from .segmentation import EXTENDED, MASK, Segmentation
from .sparse_strands import MAX_SPARSE_POINTS, find_sparse_strands
from .split_strands import SplitMask, split_strands
from .strand_filter import filter_along_strands
from .supporting_plane import find_supporting_plane

BY_SHAPE = ("network", "strands", "plane", "ridge")
"""Methods that look for strands by their shape; all others are told by the user what the object is."""

AUTO_NOTES = {
    "network": "segment: method network (auto), since no mask or color is given; doo3d tune shows whether colors do better",
    "strands": "segment: method strands (auto), since no mask or color is given; doo3d tune shows whether colors do better",
    "plane": "segment: method plane (auto), since most of it is a broad surface; if all of it is the object, set "
    "segment.method=everything",
    "everything": "segment: method everything (auto): there is no broad surface, so all of it is taken for objects",
}
"""Notes on the method that `auto` took where nobody said what the object is: advice for a frame whose result is doubtful."""

HOLE_MARGIN_PX = 16
"""Width of the border of an object whose readings tell why the object has none: stereo makes its holes up to 8 px too wide."""

MIN_DEPTH_SHARE_AROUND = 0.3
"""Of the pixels in that border; a hole that is 8 px too wide leaves a half."""

EXTENT_TOLERANCE = 10
"""Times by which the extent of a cloud may lie outside the range of depths: the object is not as long as it is far away."""


def segment(data: Frame | Cloud | Image, config: SegmentConfig, mask: Array | None = None, seed: int = 0) -> Segmentation:
    """Select the pixels or points of the object, and drop doubtful ones: rather lose part of the object than keep something else.

    The steps are the method of the config (or the mask given), removal of small and wide regions, removal of outliers, and
    averaging of the depth noise (Keipour et al., RA-L 2022, section III-A).

    Parameters
    ----------
    data
        the frame, cloud or image.
    config
        section `segment` of the settings.
    mask
        the caller's own segmentation, which replaces the method of the config: bool or integers, non-zero = object. (H, W) for a
        Frame or an Image, (N,) for a Cloud of N points. None uses the method of the config.
    seed
        seed of the random numbers that the method `plane` draws.

    Returns
    -------
    The points of the object, m (px in 2-D), with the mask, and how many pixels or points each step dropped. If the method of the
    config selects nothing, there are no points and `foreground.notes` says what to change.

    Raises
    ------
    InputError : the mask given is empty or of another size, or covers a whole image; no pixel of the object has depth; the depth
        lies outside `min_depth` to `max_depth` (wrong unit); a cloud has fewer than two different points; the method does not fit
        the data.
    MissingDependency : the method is `ridge` and scikit-image is not installed.
    """
    if config.method == MASK and mask is None and not (isinstance(data, Cloud) and data.segmented):
        raise InputError(
            "segment.method is mask but no mask is given: give one, or a capture with a mask/ folder", code="mask-missing"
        )
    made = _segment(data, config, mask, seed)
    plane = find_supporting_plane(data, made, config, seed)
    by_auto = config.method == "auto" and not made.foreground.is_told
    return replace(
        made, foreground=replace(made.foreground, plane=plane), choice=AUTO_NOTES[made.method] if by_auto else made.choice
    )


def segment_extended(data: Frame | Cloud | Image, config: SegmentConfig, mask: Array, base: Segmentation) -> Segmentation:
    """Segment a frame again, with a mask that `extend_mask` made from the mask of an earlier segmentation.

    Parameters
    ----------
    data
        the frame, cloud or image.
    config
        section `segment` of the settings.
    mask
        (H, W) bool, the extended mask; treated like a mask that the caller gives.
    base
        the earlier segmentation; it may itself come from this function.

    Returns
    -------
    The new segmentation. Its `method` is "extended", and its `base` is the first segmentation, whose mask was not extended.

    Raises
    ------
    InputError : the mask has another size; no pixel in the mask has depth; the depth lies outside `min_depth` to `max_depth`
        (wrong unit).
    """
    extended = _segment(data, config, mask, 0)
    known = base.foreground
    foreground = replace(
        extended.foreground, is_told=known.is_told, is_clean=known.is_clean, plane=known.plane, probability=known.probability
    )
    return replace(extended, foreground=foreground, method=EXTENDED, choice=base.choice, base=base.base or base)


def _segment(data: Frame | Cloud | Image, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    if isinstance(data, Cloud):
        return _segment_cloud(data, config, mask, seed)
    if isinstance(data, Image):
        return _segment_image(data, config, mask, seed)
    return _segment_frame(data, config, mask, seed)


def _segment_frame(frame: Frame, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    median = _median_depth(frame)
    if mask is None:
        _check_distance(median, frame, frame.depth.size, "frame", config)
    if median is not None and median <= config.max_depth < frame.depth.max():  # saturated values, or a far background
        frame = replace(frame, depth=np.where(frame.depth > config.max_depth, 0, frame.depth))
    method, made = _select(frame, config, mask, seed, frame.depth.shape)
    selected = given = made.mask
    is_told = _is_told(method, config)
    if method != "everything":
        _check_size(int(np.count_nonzero(selected)))
    if frame.color is not None and method not in ("everything", "plane"):
        selected = repair_mask(given, frame.color, method in ("network", "strands"))
    solid = FrameFacts(selected, frame.depth, config.min_component)
    facts = solid if method in (MASK, "everything") else remove_wide_regions(solid, config, frame.camera.fx)
    pixels, removed_wide = facts.count, solid.count - facts.count
    if frame.color is not None and not is_told and not removed_wide:  # what is left of a gripper is no plug
        facts = remove_plugs(facts, frame.color)
    if pixels:
        if not facts.readings and frame.depth.any():
            raise _without_depth(frame, facts.mask, pixels)
        _check_distance(facts.median_depth if facts.readings else None, frame, pixels, "object", config)
    split = SplitMask(facts.mask, 0, None)
    if method != "everything":
        holes, by_hue = selected if solid.filled else None, is_told and config.hues
        split = split_strands(facts, holes, frame.color, frame.depth, config.equal_widths, by_hue)
        facts = facts if split.mask is facts.mask else FrameFacts(split.mask, frame.depth)
    radius = facts.radius(frame.camera.fx)
    readings, slope, outliers = filter_readings(facts, config)
    measured = len(readings.pixels)
    smoothed = 0
    if method != "everything":
        readings, smoothed = filter_along_strands(readings, facts, radius, frame, config.strand_smoothing_radii)
        readings = inpaint_readings(readings, facts, slope)
    foreground = Foreground(
        points=frame.camera.unproject(readings.pixels, readings.depth),
        filtered=frame.camera.unproject(readings.pixels, readings.filtered),
        pixels=readings.pixels,
        mask=facts.mask,
        facts=facts,
        mask_radius=radius,
        side_by_side=split.side_by_side,
        colors=split.colors,
        depth=frame.depth,
        color=frame.color,
        camera=frame.camera,
        viewpoint=np.zeros(3),
        notes=_notes(method, made.note, pixels > 0, frame.color is not None),
        is_told=is_told,
        is_clean=is_told or made.is_certain or method == "network",
    )
    return replace(
        _record(foreground, method, solid, removed_wide, split),
        without_depth=pixels - split.removed - measured - outliers,
        outliers=outliers,
        inpainted=len(readings.pixels) - measured,
        repaired=0 if selected is given else int(np.count_nonzero(selected != given)),
        smoothed=smoothed,
        plane=made.plane,
    )


def _segment_image(image: Image, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    shape = image.color.shape[:2]
    drawn = object_in_mask_image(image.color)
    if drawn is not None and mask is None and config.method == "auto" and resolve_method(image, config) in ("network", "strands"):
        mask = drawn
    method, made = _select(image, config, mask, seed, shape)
    selected = made.mask
    is_told = _is_told(method, config)
    # an image of the mask tells nothing that the mask does not
    color = None if drawn is not None and np.array_equal(drawn, selected) else image.color
    if selected.all():
        raise InputError("the mask covers the whole image: no pixel of it says background", code="mask-full")
    _check_size(int(np.count_nonzero(selected)))
    solid = FrameFacts(selected, None, config.min_component)
    facts = narrow = remove_wide_regions(solid, config) if mask is None else solid
    if not is_told:
        facts = remove_plugs(facts, image.color)
    holes = selected if solid.filled else None
    split = split_strands(facts, holes, color, None, config.equal_widths, is_told and config.hues)
    facts = facts if split.mask is facts.mask else FrameFacts(split.mask)
    pixels = facts.pixels
    foreground = Foreground(
        points=pixels.astype(float),
        pixels=pixels,
        mask=facts.mask,
        facts=facts,
        side_by_side=split.side_by_side,
        colors=split.colors,
        color=color,
        probability=made.probability,
        notes=_notes(method, made.note, len(pixels) > 0, True),
        is_told=is_told,
    )
    return _record(foreground, method, solid, solid.count - narrow.count, split)


def _segment_cloud(cloud: Cloud, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    spread = np.quantile(cloud.points, SPREAD, axis=0) if len(cloud.points) else np.zeros((len(SPREAD), 3))
    _check_extent(spread, len(cloud.points), config, bool(cloud.views))
    method, made = _select(cloud, config, mask, seed, (len(cloud.points),))
    is_told = cloud.segmented or _is_told(method, config)
    chosen, limits = draw_points(cloud.points if made.mask.all() else cloud.points[made.mask], seed)
    facts, points, means = filter_points(chosen, spread if chosen is cloud.points else None)
    outliers = len(chosen) - len(points)
    sampling, bridges = CloudSampling(facts.spacing) if len(points) else None, None
    sparse = None if cloud.views else find_sparse_strands(points)
    if sparse is not None:
        outliers += int(np.count_nonzero(~sparse.kept))
        if len(points) > MAX_SPARSE_POINTS:
            limits += (
                f"segment: of {len(points)} points along thin strands {MAX_SPARSE_POINTS} at most are used, to bound time",
            )
        points, means, bridges, sampling = points[sparse.kept], sparse.centered, sparse.bridges, sparse.sampling
    foreground = Foreground(
        points=points,
        filtered=means,
        bridges=bridges,
        sampling=sampling,
        cloud_facts=facts if sparse is None and len(points) else None,
        viewpoint=cloud.viewpoint,
        notes=_notes(method, made.note, bool(len(chosen)), False),
        views=cloud.views,
        is_told=is_told,
    )
    return Segmentation(foreground, method, len(chosen), outliers=outliers, limits=limits, plane=made.plane)


def _select(
    data: Frame | Cloud | Image, config: SegmentConfig, mask: Array | None, seed: int, shape: tuple[int, ...]
) -> tuple[str, MethodResult]:
    """Return the method, and the mask of the given shape that the caller or the method gives, with what else the method knows."""
    if mask is not None:
        given = check_mask(mask, shape)
        if not given.any():
            element = "point" if isinstance(data, Cloud) else "pixel"
            raise InputError(f"the mask is empty: no {element} of it says object", code="mask-empty")
        return MASK, MethodResult(given, note=inversion_note(given))
    method = "everything" if isinstance(data, Cloud) and data.segmented else resolve_method(data, config)
    selected = SEGMENTERS.call(method, SEGMENTERS[method], data, config, seed)
    made = selected if isinstance(selected, MethodResult) else MethodResult(selected)
    return method, made if SEGMENTERS.is_built_in(method) else made._replace(mask=check_mask(made.mask, shape))


def _check_size(pixels: int) -> None:
    """Refuse a mask of so many pixels that the stages would take too much time and memory, before any of them."""
    if pixels > MAX_CELLS:
        raise InputError(f"the mask has {pixels} pixels, the limit is {MAX_CELLS}: scale the image down", code="voxels-too-many")


def _is_told(method: str, config: SegmentConfig) -> bool:
    """Tell whether somebody said what the object is, by a mask or the settings; if not, strands were looked for by shape."""
    return method not in BY_SHAPE and not (method == "everything" and config.method == "auto")


def _record(foreground: Foreground, method: str, solid: FrameFacts, removed_wide: int, split: SplitMask) -> Segmentation:
    counts = solid.selected, solid.removed, removed_wide
    return Segmentation(foreground, method, *counts, closed_holes=solid.filled, split=split.removed)


def _notes(method: str, note: str, found: bool, has_color: bool) -> tuple[str, ...]:
    """Return the notes for a frame: the method's own, and what to do if it selected nothing, for which tuning needs color."""
    own = (note,) if note else ()
    if found:
        return own
    by_color = ", or select the object by its color (doo3d tune)" if has_color else ""
    remedy = {
        "hsv": "widen segment.ranges" + (" (doo3d tune proposes ranges and shows what they select)" if has_color else ""),
        "background": "lower segment.depth_difference or segment.color_difference",
        "plane": f"lower segment.plane_distance{by_color}",
    }.get(method, f"give a mask{by_color}")
    return *own, f"segment ({method}): no object in this frame; {remedy}"


def _median_depth(frame: Frame) -> float | None:
    """Return the median of a grid of a frame's readings, m; None without readings."""
    step = max(1, int(np.sqrt(frame.depth.size / SAMPLES)))
    some = frame.depth[::step, ::step]
    readings = some[some > 0] if (some > 0).any() else frame.depth[frame.depth > 0]
    some = readings[:: max(1, readings.size // SAMPLES)]
    return float(np.median(some)) if len(some) else None


def _check_distance(median: float | None, frame: Frame, pixels: int, part: str, config: SegmentConfig) -> None:
    """Refuse a part of the frame of so many pixels without a median reading, m, and one whose median tells of a wrong unit."""
    if median is None:
        raise InputError(
            f"no depth at any of the {pixels} pixels of the {part}: is the depth aligned to the mask, and in metres?",
            code="depth-none",
        )
    if not config.min_depth <= median <= config.max_depth:
        raise InputError(
            f"the {part} is {median:.6g} m away, expected {config.min_depth:g} to {config.max_depth:g} m: "
            "check depth_scale (units per metre), or set segment.min_depth and segment.max_depth",
            code="depth-unit",
        )


def _without_depth(frame: Frame, mask: Array, pixels: int) -> InputError:
    """Return the error for an object without any reading: its material's, if the pixels around the object have readings."""
    around = dilate(mask, HOLE_MARGIN_PX) & ~mask
    share = float(np.mean(frame.depth[around] > 0)) if around.any() else 0.0
    sentence = f"no depth at any of the {pixels} pixels of the object"
    if share > MIN_DEPTH_SHARE_AROUND:
        sentence += (
            f", though {share:.0%} of those around it have depth: black and shiny materials return none. Detect it in the color "
            "image (-c image), or record it from another side or in other light"
        )
        return InputError(sentence, code="mask-without-depth")
    return InputError(f"{sentence}: is the depth aligned to the mask, and in metres?", code="mask-without-depth")


def _check_extent(spread: Floats, count: int, config: SegmentConfig, is_fused: bool) -> None:
    """Refuse a cloud of so many points without extent, or with one in the wrong unit, by its quantiles at SPREAD, (6, 3) m."""
    least, _, low, high, _, largest = spread
    if not (largest > least).any():
        raise InputError(
            f"the cloud has {count} points and no extent: an object needs points along its length",
            code="cloud-without-extent",
        )
    extent = float(np.linalg.norm(high - low))
    if not config.min_depth / EXTENT_TOLERANCE <= extent <= EXTENT_TOLERANCE * config.max_depth:
        setting = f"max_depth={np.ceil(extent / EXTENT_TOLERANCE):.0f}" if extent > 1 else f"min_depth={extent:.1g}"
        remedy = (
            "points are expected in metres: for millimetres give --input-option depth_scale=1000 (units per metre); if it is "
            f"that {'large' if extent > 1 else 'small'}, --set segment.{setting}"
        )
        if is_fused:
            remedy = "the poses are expected to be camera to world, with translations in metres: are they in millimetres?"
        part = "fused views are" if is_fused else "cloud is"
        raise InputError(f"the {part} {extent:.6g} m across: {remedy}", code="points-unit")
