"""Encode the chains, the cloud and the picture of a frame as short texts, for the page of the report."""

import base64
from typing import Any

import cv2
import numpy as np

from ...inputs import FrameData
from ...types import Array, Chain, Detection, Floats
from ..palette import ChainStyle, chain_style
from ..surroundings import sample_surroundings

THUMBNAIL_WIDTHS = (720, 560, 440, 340, 260, 200, 150, 110)  # px, tried in turn
THUMBNAIL_QUALITY = 72  # of WebP
MIN_BYTES_PER_PIXEL = 0.04  # of a thumbnail at this quality: larger widths need not be tried
MAX_LEVEL = 32767  # of 16-bit numbers


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


def pack_chain(index: int, chain: Chain, style: ChainStyle | None = None) -> dict[str, Any]:
    """Return one chain as a dict for the page of the report.

    Parameters
    ----------
    index
        index of the chain in the detection; gives the color if the chain has no id.
    chain
        the chain.
    style
        style of the chain; None derives it from number and confidence.

    Returns
    -------
    dict
        "joints", "radii" and "deviations" in the form of `pack_points` (radii None if any is unknown; no "deviations" if those
        are), "occluded" and "filled" (the depth was filled in) each as a text such as "0110" with a digit for each segment,
        "from_time" likewise for chains of which other frames filled in segments, "color" as "#rrggbb", the same as in the
        pictures, for doubtful chains "doubt" (words for the legend) and "width" (factor of widths), and "id", "closed",
        "length", "radius", "confidence" of the chain.
    """
    style = style or chain_style(chain, index if chain.id is None else chain.id)
    radii = chain.radii[:, None]
    return {
        "id": chain.id,
        "color": style.css,
        **({"doubt": style.doubt, "width": style.width} if style.doubt else {}),
        "joints": pack_points(chain.joints),
        "radii": pack_points(radii) if np.isfinite(radii).all() else None,
        **({} if chain.deviations is None else {"deviations": pack_points(chain.deviations)}),
        "occluded": "".join("01"[int(each)] for each in chain.occluded),
        "filled": "".join("01"[int(each)] for each in chain.depth_filled),
        **({"from_time": "".join("01"[int(each)] for each in chain.from_time)} if chain.from_time.any() else {}),
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
    sample = sample_surroundings(frame, detection, max_points)
    if sample is None:
        return None
    points, colors = sample.points, sample.colors
    rgb = np.full((len(points), 3), 128, np.uint8) if colors is None else colors
    optional = {} if sample.viewpoint is None else {"viewpoint": sample.viewpoint.tolist()}
    return {
        **pack_points(points),
        **optional,
        "on_object": sample.on_object,
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


def _rgb565(colors: Array) -> Array:
    """Pack colors (N, 3) uint8 into (N,) uint16: five, six and five bits."""
    red, green, blue = (colors[:, i].astype("<u2") for i in range(3))
    return np.asarray((red >> 3) << 11 | (green >> 2) << 5 | blue >> 3, dtype="<u2")
