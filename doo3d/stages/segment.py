"""Keep what surely is the object: lose some of it rather than keep other things (paper, section III-A)."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ..cells import pack, spacing
from ..config import SegmentConfig
from ..errors import InputError
from ..holes import bridged
from ..kernels.depth import agreement, steadied
from ..kernels.thinning import neighbours
from ..segmenters import SEGMENTERS, method
from ..silhouette import bounding_box, mask_pixels, mask_radius, ridge_radius
from ..types import Array, Bools, Cloud, Floats, Foreground, Frame, Image, check_mask

FAR = 5.0
"""Times the usual difference of readings side by side by which a reading may differ from another and be averaged with it."""

ALIKE = 4
"""Neighbouring readings that err alike, so that only as many fewer are averaged: those of a stereo camera do over 2 px."""

LINES = "segment: no mask and no colours are given, so lines of any colour are the object, shadows too; see doo3d tune"

MOST = 20
"""px; half the widest window."""


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
    tolerance = max(config.edge_tolerance, config.edge_noise * error)
    support, among, depth = agreement(data.depth, found, v, u, config.window, tolerance)
    solid = support >= np.minimum(config.edge_support, among / 2)
    half = steady_half(error, found, data, config)
    if half > config.window:
        depth[solid] = steadied(data.depth, found, v[solid], u[solid], half, FAR * error)
    pixels = np.column_stack((u[solid], v[solid]))
    read, steady = data.depth[v[solid], u[solid]].astype(float), depth[solid]
    if way != "everything" and config.holes:
        silent = found & (data.depth <= 0)
        silent[v[solid], u[solid]] = True
        holes, between = bridged(silent, pixels, steady, config.holes, tolerance)
        pixels = np.concatenate((pixels, holes))
        order = np.lexsort((pixels[:, 0], pixels[:, 1]))
        pixels = pixels[order]
        read, steady = np.append(read, between)[order], np.append(steady, between)[order]
    return Foreground(
        points=data.camera.unproject(pixels, read),
        steady=data.camera.unproject(pixels, steady) if config.smooth else None,
        pixels=pixels,
        mask=found,
        depth=data.depth,
        color=data.color,
        camera=data.camera,
        viewpoint=np.zeros(3),
        notes=() if found.any() else (_nothing(way),),
    )


def roughness(depth: Array, mask: Bools) -> float:
    """How far readings beside each other in the mask (H, W) usually are apart, m: the median along the rows of depth (H, W) m.

    What stands out by a few times that is no noise; farther away, where a stereo camera reads worse, it is more.
    """
    if not mask.any():
        return 0.0
    box = bounding_box(mask)
    seen = np.where(mask[box], depth[box], 0)
    both = (seen[:, 1:] > 0) & (seen[:, :-1] > 0)
    return float(np.median(np.abs(np.diff(seen, axis=1)[both]))) if both.any() else 0.0


def steady_half(error: float, mask: Bools, frame: Frame, config: SegmentConfig) -> int:
    """Half the width, px, of the window over which depth must be averaged to be known within `steady` radii of the object.

    error : m, as of `roughness`. The window holds as much of a strand as its width lets it.
    """
    radius = mask_radius(mask, frame.depth, frame.camera.fx)
    seen = frame.depth[mask]
    if not (config.smooth and radius and error):
        return 0
    width = 2 * radius * frame.camera.fx / float(np.median(seen[seen > 0]))
    readings = ALIKE * (1.2 * error / (config.steady * radius)) ** 2
    return min(MOST, math.ceil(readings / width / 2))


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


def drop_wide(mask: Bools, scale: Array, config: SegmentConfig) -> Bools:
    """The mask (H, W) without what is wider on all sides than `max_width`, or than `max_ratio` times the usual width.

    scale : (H, W) m per pixel (1 in 2-D), 0 = unknown. The usual width is the median over the middle lines of the mask.
    """
    box = bounding_box(mask)
    part, scale = mask[box], scale[box]
    inside = cv2.distanceTransform(np.pad(part, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    usual = ridge_radius(inside, scale)
    limit = min(config.max_width / 2, config.max_ratio * usual) if usual else config.max_width / 2
    core = inside * scale > limit
    if not core.any():
        return mask
    reach = 1.5 * limit / float(np.median(scale[core]))
    result = np.zeros_like(mask)
    result[box] = part & (cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3) > reach)
    return result


def tidy(mask: Bools, least: int) -> Bools:
    """The mask (H, W) without 8-connected pieces, and without 4-connected holes, of fewer than `least` pixels.

    Their borders tell their size: a polygon through the centres of b pixels with the area a covers a + b / 2 + 1 pixels, and
    leaves a - b / 2 + 1 free inside it (Pick's theorem).
    """
    if least <= 1 or not mask.any():
        return mask
    box = bounding_box(mask)
    borders, tree = cv2.findContours(mask[box].view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    small = []
    for border, (_, _, _, outer) in zip(borders, tree[0], strict=True):
        if len(border) > 4 * least:
            continue
        free = 1 if outer < 0 else -1
        if cv2.contourArea(border) + free * len(border) / 2 + 1 < least:
            small.append((border, int(outer >= 0)))
    if not small:
        return mask
    result = mask.copy()
    image = result.view(np.uint8)[box]
    for border, value in small:
        cv2.drawContours(image, [border], 0, value, cv2.FILLED)
    return result


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
    support, mean = neighbourhood(kept, config.cloud_window)
    solid = support >= config.cloud_support * np.median(support) if len(kept) else np.zeros(0, dtype=bool)
    return Foreground(
        points=kept[solid],
        steady=mean[solid] if config.smooth else None,
        viewpoint=cloud.viewpoint,
        notes=() if len(kept) else (_nothing(way),),
        sights=cloud.sights,
    )


def neighbourhood(points: Floats, window: float) -> tuple[Floats, Floats]:
    """How many points of a cloud lie about each, and their mean.

    Neighbours are those in the same cell and the 26 round it, cells of `window` point spacings. Returns (N,) and (N, 3) m.
    """
    if not len(points):
        return np.zeros(0), points
    size = window * spacing(points)
    cells = pack(points, points.min(axis=0) - size, size, 1)
    if isinstance(cells, float):
        return np.ones(len(points)), points
    sums = cells.sums(np.column_stack((points, np.ones(len(points)))))
    sums = sums + np.vstack((sums, np.zeros(4)))[neighbours(cells.coords)].sum(axis=1)
    return sums[cells.cell, 3], sums[cells.cell, :3] / sums[cells.cell, 3:]


def lone(points: Floats) -> Bools:
    """Which of the points (N, 3) lie far outside the box of the rest, three times its size away from it."""
    low, high = np.percentile(points, [2, 98], axis=0) if len(points) else np.zeros((2, 3))
    margin = 3 * np.linalg.norm(high - low)
    return np.asarray(((points < low - margin) | (points > high + margin)).any(axis=1))
