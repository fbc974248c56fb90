"""Encode the chains, the cloud and the picture of a frame as short texts, for the page of the report."""

from __future__ import annotations

import base64
from typing import Any

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ...inputs import FrameData
from ...types import Array, Bools, Chain, Cloud, Detection, Floats, Frame
from ..palette import chain_color

THUMBNAIL_WIDTHS = (720, 560, 440, 340, 260, 200, 150, 110)  # px, tried in turn
THUMBNAIL_QUALITY = 72  # of WebP
MIN_BYTES_PER_PIXEL = 0.04  # of a thumbnail at this quality: larger widths need not be tried
MAX_LEVEL = 32767  # of 16-bit numbers
MAX_READ_POINTS, MAX_TESTED_POINTS = 300_000, 60_000  # of a frame, and of the box around its chains
SURROUNDINGS_MARGIN = 0.2  # of the diagonal of the chains' box
OBJECT_RADII = 1.3  # radii from the axis within which a point is on the object


def base64_text(data: bytes | Array) -> str:
    """Return bytes as base64 text; for an array, the bytes of its values in C order."""
    return base64.b64encode(data if isinstance(data, bytes) else np.ascontiguousarray(data).tobytes()).decode("ascii")


def pack_points(points: Floats) -> dict[str, Any]:
    """Return N points, (N, D), in a compact form: 16-bit integers in base64, with the center and the step to restore them.

    Returns
    -------
    dict
        "center": D floats; "step": float; "levels": base64 of (N, D) little-endian int16. A point is center + step * level, to
        within half a step, where the step is the greatest extent of the points divided by 65534. "levels" is empty without
        points.
    """
    if not len(points):
        return {"center": [0.0] * points.shape[1], "step": 1.0, "levels": ""}
    low, high = points.min(axis=0), points.max(axis=0)
    center = (low + high) / 2
    step = max(float((high - low).max()) / 2 / MAX_LEVEL, 1e-9)
    return {
        "center": [float(f"{value:.7g}") for value in center],
        "step": step,
        "levels": base64_text(np.clip(np.rint((points - center) / step), -MAX_LEVEL, MAX_LEVEL).astype("<i2")),
    }


def pack_chain(index: int, chain: Chain) -> dict[str, Any]:
    """Return one chain as a dict for the page of the report.

    Parameters
    ----------
    index
        index of the chain in the detection; gives the color if the chain has no id.
    chain
        the chain.

    Returns
    -------
    dict
        "joints" and "radii" in the form of `pack_points` (radii None if any is unknown), "occluded" and "filled" (the
        depth was filled in) each as a text such as "0110" with a digit for each segment, "color" as "#rrggbb", the same as in the
        pictures, and "id", "closed", "length", "radius", "confidence" of the chain.
    """
    number = index if chain.id is None else chain.id
    radii = chain.radii[:, None]
    return {
        "id": chain.id,
        "color": "#{:02x}{:02x}{:02x}".format(*chain_color(number)),
        "joints": pack_points(chain.joints),
        "radii": pack_points(radii) if np.isfinite(radii).all() else None,
        "occluded": "".join("01"[int(each)] for each in chain.occluded),
        "filled": "".join("01"[int(each)] for each in chain.depth_filled),
        "closed": chain.closed,
        "length": chain.length,
        "radius": chain.radius,
        "confidence": chain.confidence,
    }


def pack_cloud(frame: FrameData, detection: Detection, max_points: int) -> dict[str, Any] | None:
    """Return a random sample of a frame's points, on the object and around it, as a dict for the page of the report.

    The sample is the same each time for the same frame.

    Parameters
    ----------
    frame
        the frame of the capture, with its camera-to-world pose if the chains are in world coordinates.
    detection
        the chains found in the frame.
    max_points
        number of points at most: half of them within 1.3 radii of a chain, half elsewhere in the box around the chains.

    Returns
    -------
    dict or None
        "center", "step" and "levels": the points, those on the object first, in the form of `pack_points`; "on_object": the
        number of points on the object; "rgb": base64 of one uint16 for each point (5 bits of red, 6 of green, 5 of blue);
        "has_color": False if the points have no color and are all gray; "viewpoint": that of a cloud, if known. None for an
        image, and for chains in world coordinates if the pose of the frame is unknown.
    """
    rng = np.random.default_rng(0)  # the same results give the same page
    pose = _pose_of(frame, detection)
    sample = None if pose is None else _sample_points(frame, pose, rng)
    if pose is None or sample is None:
        return None
    points, colors = sample
    near = np.flatnonzero(_near_chains(points, detection))
    near = np.sort(rng.choice(near, min(len(near), MAX_TESTED_POINTS), replace=False))
    on_object = _on_object(points[near], detection)
    parts = (near[on_object], near[~on_object])
    chosen = [np.sort(rng.choice(part, min(len(part), max_points // 2), replace=False)) for part in parts]
    both = np.concatenate(chosen)
    rgb = np.full((len(both), 3), 128, np.uint8) if colors is None else colors[both]
    viewpoint = frame.data.viewpoint if isinstance(frame.data, Cloud) else None
    optional = {} if viewpoint is None else {"viewpoint": _moved(viewpoint, pose).tolist()}
    return {
        **pack_points(points[both]),
        **optional,
        "on_object": len(chosen[0]),
        "rgb": base64_text(_rgb565(rgb)),
        "has_color": colors is not None,
    }


def pack_picture(picture: Array, max_bytes: int) -> tuple[str, int, int]:
    """Return a thumbnail of a picture as WebP in base64, as large as `max_bytes` allows, up to 720 px wide.

    Parameters
    ----------
    picture
        (H, W, 3) uint8 BGR.
    max_bytes
        greatest size of the WebP in bytes, before base64; the smallest thumbnail, 110 px wide, may exceed it.

    Returns
    -------
    tuple of (str, int, int)
        the base64 text, and the width and height of the original picture, px.

    Raises
    ------
    RuntimeError
        OpenCV cannot encode the picture.
    """
    height, width = picture.shape[:2]
    encoded = b""
    for thumbnail_width in THUMBNAIL_WIDTHS:
        scale = min(thumbnail_width / width, 1.0)
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        if size[0] * size[1] * MIN_BYTES_PER_PIXEL > max_bytes and thumbnail_width != THUMBNAIL_WIDTHS[-1]:
            continue
        success, data = cv2.imencode(
            ".webp", cv2.resize(picture, size, interpolation=cv2.INTER_AREA), [cv2.IMWRITE_WEBP_QUALITY, THUMBNAIL_QUALITY]
        )
        if not success:
            raise RuntimeError("OpenCV could not encode the picture")
        encoded = data.tobytes()
        if len(encoded) <= max_bytes:
            break
    return base64_text(encoded), width, height


def _pose_of(frame: FrameData, detection: Detection) -> Floats | None:
    """Return the (4, 4) pose of the frame's data in the coordinates of the chains; None if it is unknown."""
    if detection.pose is not None or detection.coordinates != "world":
        return np.eye(4) if detection.pose is None else detection.pose
    return frame.pose


def _moved(points: Floats, pose: Floats) -> Floats:
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def _sample_points(frame: FrameData, pose: Floats, rng: np.random.Generator) -> tuple[Floats, Array | None] | None:
    """Return points in the coordinates of the chains, (N, 3) m, with their colors, (N, 3) uint8 RGB; None for an image."""
    data = frame.data
    if isinstance(data, Frame):
        v, u = np.nonzero(data.depth)
        chosen = _random_choice(rng, len(v))
        v, u = v[chosen], u[chosen]
        points = data.camera.unproject(np.column_stack((u, v)), data.depth[v, u])
        colors = None if data.color is None else data.color[v, u]
    elif isinstance(data, Cloud):
        chosen = _random_choice(rng, len(data.points))
        points, colors = data.points[chosen], None if data.colors is None else data.colors[chosen]
    else:
        return None
    return _moved(points, pose), colors


def _random_choice(rng: np.random.Generator, count: int) -> Bools:
    """Choose about MAX_READ_POINTS of `count` points, or all: (count,) bool."""
    return np.asarray(rng.random(count) < MAX_READ_POINTS / count) if count > MAX_READ_POINTS else np.ones(count, dtype=bool)


def _near_chains(points: Floats, detection: Detection) -> Bools:
    """Choose the points in the box of the chains with a margin; without chains, in the box of 96 % of the points."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    joints = np.concatenate([chain.joints for chain in detection.chains]) if detection.chains else None
    low, high = np.percentile(points, (2, 98), axis=0) if joints is None else (joints.min(axis=0), joints.max(axis=0))
    margin = SURROUNDINGS_MARGIN * float(np.linalg.norm(high - low))
    return np.asarray(((points >= low - margin) & (points <= high + margin)).all(axis=1))


def _on_object(points: Floats, detection: Detection) -> Bools:
    """Choose the points within OBJECT_RADII radii of a chain."""
    on_object = np.zeros(len(points), dtype=bool)
    for chain in detection.chains:
        radius = chain.radius if np.isfinite(chain.radius) else chain.segment_length / 2
        samples = chain.nodes(4 * len(chain.joints))
        on_object |= np.isfinite(cKDTree(samples).query(points, distance_upper_bound=OBJECT_RADII * radius)[0])
    return on_object


def _rgb565(colors: Array) -> Array:
    """Pack colors (N, 3) uint8 into (N,) uint16: five, six and five bits."""
    red, green, blue = (colors[:, i].astype("<u2") for i in range(3))
    return np.asarray((red >> 3) << 11 | (green >> 2) << 5 | blue >> 3, dtype="<u2")
