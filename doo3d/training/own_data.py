"""Read the user's training images: captures with masks, and runs whose results the user has accepted."""

from pathlib import Path

import cv2
import numpy as np

from ..errors import DooError, InputError
from ..inputs import FrameRef, open_capture
from ..outputs import MANIFEST
from ..outputs.run_reader import Results, open_results
from ..types import Array, Bools, Cloud, Detection, Frame, Image

MAX_SIDE_PX = 1280
"""Greatest side of an image in px; larger images are scaled down, as they are before the network segments them."""


def own_images(path: Path) -> list[Array]:
    """Read the images of a capture with masks, or of a run, with their truth.

    Parameters
    ----------
    path
        a capture with color images and masks, or a folder of results of `doo3d detect`, whose chains are used as the truth.

    Returns
    -------
    (H, W, 5) uint8 for each image: RGB, the object (255), and its centre, 255 on the centerline to 0 at the border of a strand.

    Raises
    ------
    InputError : the capture cannot be read, or no frame of it has a color image and a mask.
    """
    results = open_results(path) if (path / MANIFEST).is_file() else None
    found = []
    for frame in _frames(path, results):
        loaded = frame.load()
        if isinstance(loaded.data, Cloud) or loaded.data.color is None:
            continue
        color = np.ascontiguousarray(loaded.data.color)
        mask = loaded.mask if results is None else drawn_chains(results.detection(frame.name), color.shape, loaded.data)
        if mask is not None:
            found.append(_with_truth(color, mask))
    if not found:
        raise InputError(
            f"{path}: no frame has a color image and a mask: put images into images/ and masks of the same names into masks/",
            code="training-data",
        )
    return found


def _frames(path: Path, results: Results | None) -> list[FrameRef]:
    if results is None:
        return list(open_capture(path, images_only=True))
    try:
        frames = results.capture_frames(with_masks=False)
    except DooError as error:
        raise InputError(f"{path}: the capture of these results cannot be read now ({error})", code="training-data") from None
    return [frame for name, frame in frames.items() if name in results.frames]


def drawn_chains(detection: Detection, shape: tuple[int, ...], data: Frame | Image) -> Bools:
    """Return the pixels (H, W) of the seen segments of all chains.

    Parameters
    ----------
    detection
        the result of the frame.
    shape
        height and width, px.
    data
        the image or frame; the camera of a frame projects 3-D chains.
    """
    mask = np.zeros(shape[:2], np.uint8)
    for chain in detection.in_camera().chains:
        points, radii = chain.joints, chain.radii
        if isinstance(data, Frame):
            camera = data.camera
            radii = radii * camera.fx / points[:, 2]
            points = points[:, :2] / points[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
        widths = np.nan_to_num(2 * radii, nan=1.0)
        for start in np.flatnonzero(~chain.occluded):
            line = np.rint(points[start : start + 2] * 8).astype(np.int32)
            cv2.polylines(mask, [line], False, 1, max(1, round(float(widths[start : start + 2].mean()))), cv2.LINE_8, 3)
    return np.asarray(mask > 0)


def _with_truth(color: Array, mask: Bools) -> Array:
    shrink = min(1.0, MAX_SIDE_PX / max(mask.shape))
    size = round(mask.shape[1] * shrink), round(mask.shape[0] * shrink)
    image = cv2.resize(color, size, interpolation=cv2.INTER_AREA)
    cover = cv2.resize(mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_AREA)
    return np.concatenate([image, cover[..., None], centre_of(cover > 127)[..., None]], axis=-1)


def centre_of(mask: Bools) -> Array:
    """Return the centre image (H, W) uint8 of a mask: distance to the border, divided by the largest one nearby, times 255."""
    distance = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    width = max(3, 2 * int(np.percentile(distance[mask], 90)) + 1) if mask.any() else 3
    largest = cv2.dilate(distance, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width)))
    return np.asarray(np.round(255 * distance / np.maximum(largest, 1)), np.uint8)


def cropped(rng: np.random.Generator, image: Array, size: int) -> Array:
    """Crop an image with its truth to (size, size, 5), at a random place and scale."""
    height, width = image.shape[:2]
    shrink = np.exp(rng.uniform(np.log(0.4), np.log(1.3)))
    side = int(min(max(size / shrink, 16), height, width))
    x, y = int(rng.integers(width - side + 1)), int(rng.integers(height - side + 1))
    part = np.ascontiguousarray(image[y : y + side, x : x + side])
    kind = cv2.INTER_AREA if side > size else cv2.INTER_LINEAR
    # OpenCV averages areas of up to four channels
    return np.concatenate(
        [cv2.resize(part[..., channels], (size, size), interpolation=kind) for channels in (np.s_[:3], np.s_[3:])], axis=-1
    )
