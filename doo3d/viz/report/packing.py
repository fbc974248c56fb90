"""What the page holds of a frame: chains, cloud and picture as short texts."""

from __future__ import annotations

import base64
from typing import Any

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ...inputs import FrameData
from ...types import Array, Bools, Chain, Cloud, Detection, Floats, Frame
from ..palette import chain_color

_WIDTHS = (720, 560, 440, 340, 260, 200, 150, 110)  # px, of thumbnails
_QUALITY = 72
_DENSEST = 0.04  # bytes per pixel: fewer are not to be expected at this quality
_LEVELS = 32767  # of 16-bit numbers, above zero
_READ, _LOOKED_AT = 300_000, 60_000  # points of a frame, and of what is round the chains, that are looked at
_AROUND = 0.2  # of the diagonal of the chains' box: how far the surroundings reach
_NEAR = 1.3  # radii from the axis: points of the object


def text(data: bytes | Array) -> str:
    """Base64."""
    return base64.b64encode(data if isinstance(data, bytes) else np.ascontiguousarray(data).tobytes()).decode("ascii")


def packed(points: Floats) -> dict[str, Any]:
    """(N, D) float -> {"at": (D,), "step": float, "xyz": base64 of (N, D) int16}, with points = at + step * xyz."""
    if not len(points):
        return {"at": [0.0] * points.shape[1], "step": 1.0, "xyz": ""}
    low, high = points.min(axis=0), points.max(axis=0)
    at = (low + high) / 2
    step = max(float((high - low).max()) / 2 / _LEVELS, 1e-9)
    return {
        "at": [float(f"{value:.7g}") for value in at],
        "step": step,
        "xyz": text(np.clip(np.rint((points - at) / step), -_LEVELS, _LEVELS).astype("<i2")),
    }


def pack_chain(index: int, chain: Chain) -> dict[str, Any]:
    """Joints, radii (16 bit) and what is occluded ("0110"), with the colour that the pictures give the chain."""
    number = index if chain.id is None else chain.id
    radii = chain.radii[:, None]
    return {
        "id": chain.id,
        "color": "#{:02x}{:02x}{:02x}".format(*chain_color(number)),
        "joints": packed(chain.joints),
        "radii": packed(radii) if np.isfinite(radii).all() else None,
        "occluded": "".join("01"[int(each)] for each in chain.occluded),
        "closed": chain.closed,
        "length": chain.length,
        "radius": chain.radius,
        "confidence": chain.confidence,
    }


def pack_cloud(shot: FrameData, detection: Detection, count: int) -> dict[str, Any] | None:
    """Some points of the object and of what is round it; None where the frame has none that fit the chains.

    Parameters
    ----------
    shot : of the frame that `detection` was made from. count : how many points at most, half of them the object's.
    """
    rng = np.random.default_rng(0)  # the same page from the same results
    seen = _points(shot, detection.coordinates, rng)
    if seen is None:
        return None
    points, colors = seen
    inside = np.flatnonzero(_round_about(points, detection))
    inside = np.sort(rng.choice(inside, min(len(inside), _LOOKED_AT), replace=False))
    own = _of_object(points[inside], detection)
    chosen = [np.sort(rng.choice(some, min(len(some), count // 2), replace=False)) for some in (inside[own], inside[~own])]
    both = np.concatenate(chosen)
    shades = np.full((len(both), 3), 128, np.uint8) if colors is None else colors[both]
    stood = shot.data.viewpoint if isinstance(shot.data, Cloud) else None
    known = {} if stood is None else {"viewpoint": stood.tolist()}
    return {**packed(points[both]), **known, "own": len(chosen[0]), "rgb": text(_rgb565(shades)), "colored": colors is not None}


def pack_picture(picture: Array, most: int) -> tuple[str, int, int]:
    """(H, W, 3) uint8 BGR -> WebP of at most about `most` bytes, in base64, with the width and height of the original."""
    height, width = picture.shape[:2]
    encoded = b""
    for wide in _WIDTHS:
        scale = min(wide / width, 1.0)
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        if size[0] * size[1] * _DENSEST > most and wide != _WIDTHS[-1]:
            continue
        good, data = cv2.imencode(
            ".webp", cv2.resize(picture, size, interpolation=cv2.INTER_AREA), [cv2.IMWRITE_WEBP_QUALITY, _QUALITY]
        )
        if not good:
            raise RuntimeError("OpenCV could not encode the picture")
        encoded = data.tobytes()
        if len(encoded) <= most:
            break
    return text(encoded), width, height


def _points(shot: FrameData, coordinates: str, rng: np.random.Generator) -> tuple[Floats, Array | None] | None:
    """Points of a shot in the frame of the chains, (N, 3) m, with their colours, (N, 3) uint8 RGB."""
    data = shot.data
    if isinstance(data, Frame):
        v, u = np.nonzero(data.depth)
        kept = _some(rng, len(v))
        v, u = v[kept], u[kept]
        points = data.camera.unproject(np.column_stack((u, v)), data.depth[v, u])
        colors = None if data.color is None else data.color[v, u]
    elif isinstance(data, Cloud):
        kept = _some(rng, len(data.points))
        points, colors = data.points[kept], None if data.colors is None else data.colors[kept]
    else:
        return None
    if coordinates == "world":
        if shot.pose is None:
            return None
        points = points @ shot.pose[:3, :3].T + shot.pose[:3, 3]
    return points, colors


def _some(rng: np.random.Generator, count: int) -> Bools:
    """(count,) bool: which of so many points are looked at; all of them, or about `_READ`."""
    return np.asarray(rng.random(count) < _READ / count) if count > _READ else np.ones(count, dtype=bool)


def _round_about(points: Floats, detection: Detection) -> Bools:
    """Which points lie in the box of the chains, and somewhat beyond; without chains, in that of most points."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    known = np.concatenate([chain.joints for chain in detection.chains]) if detection.chains else None
    low, high = np.percentile(points, (2, 98), axis=0) if known is None else (known.min(axis=0), known.max(axis=0))
    margin = _AROUND * float(np.linalg.norm(high - low))
    return np.asarray(((points >= low - margin) & (points <= high + margin)).all(axis=1))


def _of_object(points: Floats, detection: Detection) -> Bools:
    """Which points lie on a chain."""
    own = np.zeros(len(points), dtype=bool)
    for chain in detection.chains:
        radius = chain.radius if np.isfinite(chain.radius) else chain.segment_length / 2
        dense = chain.nodes(4 * len(chain.joints))
        own |= np.isfinite(cKDTree(dense).query(points, distance_upper_bound=_NEAR * radius)[0])
    return own


def _rgb565(colors: Array) -> Array:
    """(N, 3) uint8 -> (N,) uint16: five, six and five bits."""
    red, green, blue = (colors[:, i].astype("<u2") for i in range(3))
    return np.asarray((red >> 3) << 11 | (green >> 2) << 5 | blue >> 3, dtype="<u2")
