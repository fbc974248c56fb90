"""Select the pixels or points of the object (Keipour et al., RA-L 2022, section III-A)."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..config import SegmentConfig
from ..errors import InputError
from ..scene.cloud import CloudScene
from ..scene.cloud_facts import CloudFacts
from ..scene.frame import FrameScene
from ..scene.frame_facts import FrameFacts
from ..scene.fused import FusedScene
from ..scene.image import ImageScene
from ..scene.masked import NO_COLOR
from ..scene.scene import Scene
from ..types import Array, Bools, Cloud, CloudSampling, Floats, Frame, Image, check_mask
from .checks import check_depth, check_distance, check_extent, check_size, median_depth
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
"""Methods that look for strands by their shape; the user specifies the object for all others."""

AUTO_NOTES = {
    "network": "segment: method network (auto), since no mask or color is given; doo3d tune shows whether colors do better",
    "strands": "segment: method strands (auto), since no mask or color is given; doo3d tune shows whether colors do better",
    "plane": "segment: method plane (auto), since most of it is a broad surface; if all of it is the object, set "
    "segment.method=everything",
    "everything": "segment: method everything (auto): there is no broad surface, so all of it is taken for objects",
}
"""Notes on the method that `auto` took where nobody said what the object is: advice for a frame whose result is doubtful."""


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
    config selects nothing, there are no points and `scene.notes` say what to change.

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
    by_auto = config.method == "auto" and not made.scene.object_given
    choice = AUTO_NOTES[made.method] if by_auto else made.choice
    return replace(made, scene=replace(made.scene, plane=plane), choice=choice)


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
    known = base.scene
    scene = replace(extended.scene, object_given=known.object_given, plane=known.plane)
    if isinstance(scene, ImageScene) and isinstance(known, ImageScene):
        scene = replace(scene, is_clean=known.is_clean, probability=known.probability)
    return replace(extended, scene=scene, method=EXTENDED, choice=base.choice, base=base.base or base)


def _segment(data: Frame | Cloud | Image, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    if isinstance(data, Cloud):
        return _segment_cloud(data, config, mask, seed)
    if isinstance(data, Image):
        return _segment_image(data, config, mask, seed)
    return _segment_frame(data, config, mask, seed)


class _FrameMask(NamedTuple):
    """The mask of a frame, and the numbers of pixels for its record: before wide regions went, removed in them, and repaired."""

    facts: FrameFacts
    split: SplitMask
    solid: FrameFacts
    pixels: int
    removed_wide: int
    repaired: int


def _segment_frame(frame: Frame, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    median = median_depth(frame)
    if mask is None:
        check_distance(median, frame, frame.depth.size, "frame", config)
    if median and median <= config.max_depth < frame.depth.max():  # saturated values, or a far background
        frame = replace(frame, depth=np.where(frame.depth > config.max_depth, 0, frame.depth))
    method, made = _select(frame, config, mask, seed, frame.depth.shape)
    object_given = _object_given(method, config)
    facts, split, solid, pixels, removed_wide, repaired = _mask_in_frame(frame, config, method, made.mask, object_given)
    readings, slope, outliers = filter_readings(facts, config)
    measured, smoothed = len(readings.pixels), 0
    if method != "everything":
        radius = facts.radius(frame.camera.fx)
        readings, smoothed = filter_along_strands(readings, facts, radius, frame, config.strand_smoothing_radii)
        readings = inpaint_readings(readings, facts, slope)
    color = NO_COLOR if frame.color is None else frame.color
    scene = FrameScene(
        points=frame.camera.unproject(readings.pixels, readings.depth),
        filtered=frame.camera.unproject(readings.pixels, readings.filtered),
        pixels=readings.pixels,
        facts=facts,
        side_by_side=split.side_by_side,
        colors=split.colors,
        layers=split.layers,
        color=color,
        camera=frame.camera,
        notes=_notes(method, made.note, pixels > 0, color.size > 0),
        object_given=object_given,
        is_clean=object_given or made.is_certain or method == "network",
    )
    return replace(
        _record(scene, method, solid, removed_wide, split),
        without_depth=pixels - split.removed - measured - outliers,
        outliers=outliers,
        inpainted=len(readings.pixels) - measured,
        repaired=repaired,
        smoothed=smoothed,
        plane=made.plane,
    )


def _mask_in_frame(frame: Frame, config: SegmentConfig, method: str, given: Bools, object_given: bool) -> _FrameMask:
    """Return the mask of a frame, repaired by color, without small and wide regions and plugs, and split between strands.

    given : (H, W) bool, the mask that the method or the caller selected.
    """
    selected = given
    if method != "everything":
        check_size(int(np.count_nonzero(given)))
    if frame.color is not None and method not in ("everything", "plane"):
        selected = repair_mask(given, frame.color, method in ("network", "strands"))
    solid = FrameFacts(selected, frame.depth, config.min_component)
    facts = solid if method in (MASK, "everything") else remove_wide_regions(solid, config, frame.camera.fx)
    pixels, removed_wide = facts.count, solid.count - facts.count
    if frame.color is not None and not object_given and not removed_wide:  # what is left of a gripper is no plug
        facts = remove_plugs(facts, frame.color)
    if pixels:
        check_depth(frame, facts, pixels, config)
    split = SplitMask(facts.mask, 0)
    if method != "everything":
        holes = selected if solid.filled else None
        split = split_strands(facts, holes, frame.color, frame.depth, config.equal_widths, config.hues)
        facts = facts if split.mask is facts.mask else FrameFacts(split.mask, frame.depth)
    repaired = 0 if selected is given else int(np.count_nonzero(selected != given))
    return _FrameMask(facts, split, solid, pixels, removed_wide, repaired)


def _segment_image(image: Image, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    shape = image.color.shape[:2]
    drawn = object_in_mask_image(image.color)
    if drawn is not None and mask is None and config.method == "auto" and resolve_method(image, config) in ("network", "strands"):
        mask = drawn
    method, made = _select(image, config, mask, seed, shape)
    selected = made.mask
    object_given = _object_given(method, config)
    # an image of the mask tells nothing that the mask does not
    color = NO_COLOR if drawn is not None and np.array_equal(drawn, selected) else image.color
    if selected.all():
        raise InputError("the mask covers the whole image: no pixel of it says background", code="mask-full")
    check_size(int(np.count_nonzero(selected)))
    solid = FrameFacts(selected, min_pixels=config.min_component)
    facts = narrow = remove_wide_regions(solid, config) if mask is None else solid
    if not object_given:
        facts = remove_plugs(facts, image.color)
    holes = selected if solid.filled else None
    split = split_strands(facts, holes, color if color.size else None, None, config.equal_widths, config.hues)
    facts = facts if split.mask is facts.mask else FrameFacts(split.mask)
    pixels = facts.pixels
    scene = ImageScene(
        points=pixels.astype(float),
        pixels=pixels,
        facts=facts,
        side_by_side=split.side_by_side,
        colors=split.colors,
        layers=split.layers,
        color=color,
        probability=made.probability,
        notes=_notes(method, made.note, len(pixels) > 0, True),
        object_given=object_given,
    )
    return _record(scene, method, solid, solid.count - narrow.count, split)


def _segment_cloud(cloud: Cloud, config: SegmentConfig, mask: Array | None, seed: int) -> Segmentation:
    spread = np.quantile(cloud.points, SPREAD, axis=0) if len(cloud.points) else np.zeros((len(SPREAD), 3))
    check_extent(spread, len(cloud.points), config, bool(cloud.views))
    method, made = _select(cloud, config, mask, seed, (len(cloud.points),))
    object_given = cloud.segmented or _object_given(method, config)
    chosen, limits = draw_points(cloud.points if made.mask.all() else cloud.points[made.mask], seed)
    facts, points, means = filter_points(chosen, spread if chosen is cloud.points else None)
    outliers = len(chosen) - len(points)
    sampling = CloudSampling(facts.spacing if len(points) else 0.0)
    bridges: Floats = np.zeros((0, 3))
    sparse = None if cloud.views else find_sparse_strands(points)
    if sparse is not None:
        outliers += int(np.count_nonzero(~sparse.kept))
        if len(points) > MAX_SPARSE_POINTS:
            limits += (
                f"segment: of {len(points)} points along thin strands {MAX_SPARSE_POINTS} at most are used, to bound time",
            )
        points, means, bridges, sampling = points[sparse.kept], sparse.centered, sparse.bridges, sparse.sampling
    scene = CloudScene(
        points=points,
        filtered=means,
        bridges=bridges,
        sampling=sampling,
        facts=facts if sparse is None else CloudFacts(points[:0]),
        sensor=cloud.viewpoint,
        notes=_notes(method, made.note, bool(len(chosen)), False),
        object_given=object_given,
    )
    scene = FusedScene.of(scene, cloud.views) if cloud.views else scene
    return Segmentation(scene, method, len(chosen), outliers=outliers, limits=limits, plane=made.plane)


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


def _object_given(method: str, config: SegmentConfig) -> bool:
    """Return whether somebody said what the object is, by a mask or the settings; if not, strands were looked for by shape."""
    return method not in BY_SHAPE and not (method == "everything" and config.method == "auto")


def _record(scene: Scene, method: str, solid: FrameFacts, removed_wide: int, split: SplitMask) -> Segmentation:
    counts = solid.selected, solid.removed, removed_wide
    return Segmentation(scene, method, *counts, closed_holes=solid.filled, split=split.removed)


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
