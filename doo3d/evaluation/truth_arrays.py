"""Read a capture's truth as arrays, `truth.npz`, written by another renderer, and its further depth and masks."""

import json
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from ..errors import InputError
from ..types import Array, Bools, Camera, Frame
from .rendering.rays import RayCaster
from .scenes.model import Scene, Truth

FILE = "truth.npz"
RAGGED = "other/mask_ragged.png"
DEPTH_SCALE = 1000.0
"""Default scale of depth images, in units per metre, for camera files without one."""


@dataclass(frozen=True)
class TruthArrays:
    """The true cables of a capture, and the object that each pixel shows.

    Attributes
    ----------
    frames
        name of the frame -> its cables, m, in the camera's optical frame.
    labels
        (H, W) int: i at the pixels of cable i, from 1; None if unknown.
    """

    frames: dict[str, tuple[Truth, ...]]
    labels: Array | None


def read_truth_arrays(path: Path, names: Sequence[str]) -> TruthArrays:
    """Read a truth file of arrays (NPZ).

    The file of a single frame holds `axis_0`, `axis_1` and so on, (P, 3) m, with `radii` (m), and perhaps `closed` and `labels`.
    The file of a cable in motion holds `curves` (T, P, 3) m, for each of T frames, and `radius` (m).

    Parameters
    ----------
    path
        the file.
    names
        names of the capture's frames, in order.

    Raises
    ------
    InputError : the file is missing, has other content, or has another number of frames.
    """
    try:
        with np.load(path) as file:
            if "curves" in file:
                frames = [[Truth(axis, float(file["radius"]))] for axis in np.asarray(file["curves"], dtype=float)]
            else:
                radii = np.asarray(file["radii"], dtype=float)
                closed = np.asarray(file["closed"] if "closed" in file else np.zeros(len(radii)), dtype=bool)
                axes = [np.asarray(file[f"axis_{k}"], dtype=float) for k in range(len(radii))]
                frames = [[Truth(*cable) for cable in zip(axes, radii.tolist(), closed.tolist(), strict=True)]]
            labels = file["labels"] if "labels" in file else None
    except (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path}: expected axis_0, axis_1, ... and radii, or curves and radius ({error!r})", code="truth-invalid"
        ) from None
    axes = [cable.axis for cables in frames for cable in cables]
    if not all(axis.ndim == 2 and axis.shape[1] == 3 and len(axis) >= 2 and np.isfinite(axis).all() for axis in axes):
        raise InputError(f"{path}: an axis has another shape than (P, 3), P >= 2, or is not finite", code="truth-invalid")
    if len(frames) != len(names):
        raise InputError(f"{path}: has {len(frames)} frames, the capture {len(names)}", code="truth-invalid")
    return TruthArrays({name: tuple(cables) for name, cables in zip(names, frames, strict=True)}, labels)


def with_seen(truths: tuple[Truth, ...], camera: Camera, labels: Array | None, mask: Bools | None) -> tuple[Truth, ...]:
    """Return the cables with `seen`: axis points whose pixel shows the cable and that no cable occludes.

    Parameters
    ----------
    truths
        the cables, in the camera's optical frame.
    camera
        the intrinsics and the image size.
    labels
        (H, W) int, the cable that each pixel shows, from 1; None if unknown.
    mask
        (H, W) bool, the pixels of all cables, used without `labels`; None if unknown, too.
    """
    caster, result = RayCaster(Scene("", "", 0, camera, truths)), []
    for k, truth in enumerate(truths):
        seen = caster.seen_samples(truth)
        shown = mask if labels is None else labels == k + 1
        if shown is not None:
            pixels = np.clip(np.round(camera.project(truth.axis[seen])), 0, (camera.width - 1, camera.height - 1)).astype(int)
            seen[seen] = shown[pixels[:, 1], pixels[:, 0]]
        result.append(replace(truth, seen=seen))
    return tuple(result)


def with_depth(frame: Frame, folder: Path, file: str) -> Frame:
    """Return the frame with another depth image of its capture's folder, such as other/depth_simple.png.

    Raises
    ------
    InputError : there is no such image of this size.
    """
    camera = folder / "camera_intrinsic.json"
    scale = json.loads(camera.read_text()).get("depth_scale", DEPTH_SCALE) if camera.exists() else DEPTH_SCALE
    return replace(frame, depth=_image(folder / file, frame.depth.shape, "--sensor stereo") / float(scale))


def ragged_mask_of(folder: Path, shape: tuple[int, ...]) -> Bools | None:
    """Read the imperfect mask in a capture's folder, (H, W) bool; None if there is none."""
    return np.asarray(_image(folder / RAGGED, shape, "--mask given") > 0) if (folder / RAGGED).exists() else None


def _image(path: Path, shape: tuple[int, ...], instead: str) -> Array:
    """Read a single-channel image, (H, W); `instead` names the option to use without this image, for the error."""
    image = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_UNCHANGED) if path.exists() else None
    if image is None or image.shape != shape:
        found = "is missing or no image" if image is None else f"has shape {image.shape}, expected {shape}"
        raise InputError(f"{path}: {found}: use {instead}, or add the file", code="image-unreadable")
    return np.asarray(image)
