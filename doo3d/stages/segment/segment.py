"""Keep what surely is the object: lose some of it rather than keep other things (paper, section III-A)."""

from __future__ import annotations

import numpy as np

from ...config import SegmentConfig
from ...errors import InputError
from ...geometry.mask import mask_pixels
from ...kernels.depth_filter import count_agreeing_neighbors, sigma_filter
from ...types import Array, Bools, Cloud, Foreground, Frame, Image, check_mask
from .depth_filter import FAR, roughness, steady_half
from .depth_inpainting import bridged
from .mask_cleanup import drop_wide, tidy
from .methods import SEGMENTERS, method
from .point_filter import lone, neighbourhood

LINES = "segment: no mask and no colours are given, so lines of any colour are the object, shadows too; see doo3d tune"


OUTLIER_WINDOW_PX = 2
"""px; half-width of the window in which a depth reading is compared with its neighbors: 5 x 5, less than a thin cable."""

OUTLIER_NOISE_FACTOR = 3.0
"""Times the measured depth noise that `outlier_slope` is at least: three deviations."""

OUTLIER_MIN_NEIGHBORS = 7
"""Neighbors of the 24 in the window that must agree with a reading, or half of those there are; fewer make a flying point."""

INPAINT_MIN_HOLE_PX = 2
"""px; the mask farther than this from a reading gets depth from the readings round it; smaller holes are the closing's."""

CLOUD_WINDOW = 2.0
"""Point spacings; edge of the cells of which 3 x 3 x 3 hold the neighbors of a point of a cloud."""

CLOUD_MIN_SUPPORT = 0.15
"""Fraction of the median number of neighbors that a point of a cloud must have, or it is a flying point."""


def segment(data: Frame | Cloud | Image, config: SegmentConfig, mask: Array | None = None, seed: int = 0) -> Foreground:
    """The points of the object.

    mask : the caller's own segmentation, (H, W) for a Frame or (N,) for a Cloud; goes before the method of the config.

    Raises
    ------
    InputError : the mask is empty or of another size; there is no depth in it; the depth is out of all proportion
        (wrong unit); a cloud with fewer than two different points; the method does not fit the data.
    """
    if config.method == "mask" and mask is None and not (isinstance(data, Cloud) and data.segmented):
        raise InputError(
            "segment.method is mask but there is none: give one, or a capture with a mask/ folder", code="mask-missing"
        )
    if isinstance(data, Cloud):
        return _segment_cloud(data, config, mask, seed)
    if isinstance(data, Image):
        return _segment_image(data, config, mask, seed)
    given = mask is not None
    if not given:
        _check_depth(data, config)
    way = "mask" if given else method(data, config)
    found = check_mask(mask, data.depth.shape) if mask is not None else SEGMENTERS[way](data, config, seed)
    if given and not found.any():
        raise InputError("the mask is empty: no pixel of it says object", code="mask-empty")
    found = tidy(found, config.min_component)
    if way not in ("mask", "everything") and found.any():
        found = drop_wide(found, data.depth / data.camera.fx, config)
    _check_depth(data, config, found)
    v, u = np.nonzero(found & (data.depth >= config.min_depth) & (data.depth <= config.max_depth))
    error = roughness(data.depth, found)
    tolerance = max(config.outlier_slope, OUTLIER_NOISE_FACTOR * error)
    support, among, depth = count_agreeing_neighbors(data.depth, found, v, u, OUTLIER_WINDOW_PX, tolerance)
    solid = support >= np.minimum(OUTLIER_MIN_NEIGHBORS, among / 2)
    half = steady_half(error, found, data, config)
    if half > OUTLIER_WINDOW_PX:
        depth[solid] = sigma_filter(data.depth, found, v[solid], u[solid], half, FAR * error)
    pixels = np.column_stack((u[solid], v[solid]))
    read, filtered = data.depth[v[solid], u[solid]].astype(float), depth[solid]
    if way != "everything":
        silent = found & (data.depth <= 0)
        silent[v[solid], u[solid]] = True
        holes, between = bridged(silent, pixels, filtered, INPAINT_MIN_HOLE_PX, tolerance)
        pixels = np.concatenate((pixels, holes))
        order = np.lexsort((pixels[:, 0], pixels[:, 1]))
        pixels = pixels[order]
        read, filtered = np.append(read, between)[order], np.append(filtered, between)[order]
    return Foreground(
        points=data.camera.unproject(pixels, read),
        filtered=data.camera.unproject(pixels, filtered),
        pixels=pixels,
        mask=found,
        depth=data.depth,
        color=data.color,
        camera=data.camera,
        viewpoint=np.zeros(3),
        notes=() if found.any() else (_nothing(way),),
    )


def _nothing(way: str) -> str:
    hint = {
        "hsv": "widen segment.ranges (doo3d tune proposes them and shows what they take)",
        "background": "lower segment.depth_difference or segment.color_difference",
        "plane": "lower segment.plane_distance, or tell the object by its colour (doo3d tune)",
    }.get(way, "give a mask, or tell the object by its colour (doo3d tune)")
    return f"segment ({way}): nothing in this frame is told from the rest; {hint}"


def _check_depth(data: Frame, config: SegmentConfig, mask: Bools | None = None) -> None:
    what, depth = ("frame", data.depth) if mask is None else ("object", data.depth[mask])
    if not depth.size:
        return
    seen = depth[depth > 0]
    if not seen.size:
        raise InputError(
            f"no depth at any of the {depth.size} pixels of the {what}: is the depth aligned to the mask, and in metres?",
            code="mask-without-depth" if data.depth.any() else "depth-none",
        )
    middle = float(np.median(seen[:: max(1, seen.size // 10_000)]))
    if not config.min_depth <= middle <= config.max_depth:
        raise InputError(
            f"the {what} is {middle:.6g} m away, expected {config.min_depth:g} to {config.max_depth:g} m: "
            "check depth_scale (units per metre), or set segment.min_depth and segment.max_depth",
            code="depth-unit",
        )


def _segment_image(image: Image, config: SegmentConfig, mask: Array | None, seed: int) -> Foreground:
    shape = image.color.shape[:2]
    way = "mask" if mask is not None else method(image, config)
    found = check_mask(mask, shape) if mask is not None else SEGMENTERS[way](image, config, seed)
    if mask is not None and not found.any():
        raise InputError("the mask is empty: no pixel of it says object", code="mask-empty")
    if found.all():
        raise InputError("the mask covers the whole image: no pixel of it says background", code="mask-full")
    found = tidy(found, config.min_component)
    if mask is None and config.method != "everything" and found.any():
        found = drop_wide(found, np.ones(shape), config)
    pixels = mask_pixels(found)
    return Foreground(
        points=pixels.astype(float),
        pixels=pixels,
        mask=found,
        color=image.color,
        notes=(_nothing(way),) if not found.any() else (LINES,) if way == "ridge" and config.method == "auto" else (),
    )


def _segment_cloud(cloud: Cloud, config: SegmentConfig, mask: Array | None, seed: int) -> Foreground:
    points = cloud.points
    if len(points) < 2 or not np.ptp(points, axis=0).any():
        raise InputError(
            f"the cloud has {len(points)} points and no extent: an object needs points along its length",
            code="cloud-without-extent",
        )
    extent = float(np.linalg.norm(np.subtract(*np.percentile(points, [95, 5], axis=0))))
    if not config.min_depth / 10 <= extent <= 10 * config.max_depth:
        raise InputError(
            f"the cloud is {extent:.6g} m across: points are expected in metres, check the unit (depth_scale of the recorder)",
            code="points-unit",
        )
    way = "mask" if mask is not None else "everything" if cloud.segmented else method(cloud, config)
    if mask is not None:
        found = check_mask(mask, (len(points),))
    else:
        found = SEGMENTERS[way](cloud, config, seed)
    if mask is not None and not found.any():
        raise InputError("the mask is empty: no point of it says object", code="mask-empty")
    kept = points[found]
    kept = kept[~lone(kept)]
    support, mean = neighbourhood(kept, CLOUD_WINDOW)
    solid = support >= CLOUD_MIN_SUPPORT * np.median(support) if len(kept) else np.zeros(0, dtype=bool)
    return Foreground(
        points=kept[solid],
        filtered=mean[solid],
        viewpoint=cloud.viewpoint,
        notes=() if len(kept) else (_nothing(way),),
        views=cloud.views,
    )
