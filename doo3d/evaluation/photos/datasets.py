"""Read public photographs of cables with instance labels: mBEST's S1 to S3, and C1 to C3 of FASTDLO, RT-DLO and mBEST."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from ...errors import ConfigError, InputError
from ...types import Array, Bools, Ints
from ..benchmark.cases import Case

HSV_RANGES = (
    ((0, 20, 75), (20, 255, 255)),
    ((160, 20, 75), (180, 255, 255)),
    ((25, 20, 75), (50, 255, 255)),
    ((50, 20, 20), (120, 255, 255)),
)
"""Ranges in OpenCV's 8-bit HSV that select mBEST's cables on black cloth: pink (on both sides of hue 0), green, teal."""

CSET_SIZE = (640, 360)
"""Width and height of the C1 to C3 images in px; some label images lack a row or a column, and are resized."""

MIN_CABLE_PIXELS = 30
"""Least number of pixels of a cable in a label image; smaller regions and rarer colors are ignored."""

MIN_NETWORK_SCORE = 127
"""Threshold of the network's mask images, 0 to 255; higher values are the object."""

_IMAGES = ("images", "test_imgs")
_LABELS = ("labels", "gt_labels", "test_labels")
_MASKS = ("masks", "test_masks")


@dataclass(frozen=True)
class Photo:
    """One photograph with its labelled cables.

    Attributes
    ----------
    subset
        name of the part of the data set that the photograph belongs to, such as S1.
    name
        name of the photograph, such as img0.
    image
        (H, W, 3) uint8 RGB.
    labels
        (H, W) int: i from 1 at the pixels that show cable i, 0 for background. At a crossing, the pixels belong to the upper
        cable.
    mask
        (H, W) bool, the mask that the detection is given.
    """

    subset: str
    name: str
    image: Array
    labels: Ints
    mask: Bools

    @property
    def cables(self) -> int:
        """The number of labelled cables."""
        return int(self.labels.max(initial=0))


def mbest(folder: str | Path, masks: str = "labels", subsets: Sequence[str] | None = None) -> list[Case]:
    """List the photographs of mBEST's data set: the subsets S1, S2 and S3.

    Each subset is a folder in `folder`, or in `folder`/dataset as in the public repository. It holds images/ and the labels,
    either as 8-bit images in labels/ or as NumPy arrays in gt_labels/.

    Parameters
    ----------
    folder
        the data set, or one of its subsets.
    masks
        the mask that the detection is given: "labels" for all labelled pixels, "hsv" for the pixels of the cables' colors.
    subsets
        names of the subsets to list, such as S1; None for all.

    Returns
    -------
    A case for each photograph, of the family of its subset, by subset and number; `load` reads a Photo.

    Raises
    ------
    InputError : there are no photographs, a label is missing, or there is no subset of a given name.
    ConfigError : `masks` is neither "labels" nor "hsv".
    """
    folder = _check_masks(folder, masks, ("labels", "hsv"))

    folders = [child for root in (folder, folder / "dataset") for child in [root, *sorted(root.glob("S*"))] if _has_images(child)]
    files = [(child.name, image, _file_beside(image, child, _LABELS)) for child in folders for image in _image_files(child)]
    return _select(
        [Case(image.stem, subset, partial(_read_mbest, subset, image, label, masks)) for subset, image, label in files],
        folder,
        subsets,
    )


def _read_mbest(subset: str, image: Path, label: Path, masks: str) -> Photo:
    color, labels = _read_color(image), _read_labels(label)
    _check_size(image, color, label, labels)
    return Photo(subset, image.stem, color, labels, labels > 0 if masks == "labels" else hsv_mask(color))


def cset(folder: str | Path, masks: str = "labels", subsets: Sequence[str] | None = None) -> list[Case]:
    """List the photographs of the data set C1 to C3 of FASTDLO, RT-DLO and mBEST, resized to 640x360 px.

    `folder`, or `folder`/data as in the public repository, holds images/, labels/ (one color for each cable, on black) and
    masks/; the names test_imgs/, test_labels/ and test_masks/ are accepted, too. The name of a file begins with its subset, as in
    c1_0.

    Parameters
    ----------
    folder
        the data set.
    masks
        the mask that the detection is given: "labels" for all labelled pixels, "network" for the images in masks/.
    subsets
        names of the subsets to list, such as C1; None for all.

    Returns
    -------
    A case for each photograph, of the family of its subset, by subset and number; `load` reads a Photo.

    Raises
    ------
    InputError : there are no photographs, a label or mask is missing, or there is no subset of a given name.
    ConfigError : `masks` is neither "labels" nor "network".
    """
    folder = _check_masks(folder, masks, ("labels", "network"))

    refs = []
    for root in [root for root in (folder, folder / "data") if _has_images(root)]:
        for image in _image_files(root):
            subset, label = image.stem.partition("_")[0].upper(), _file_beside(image, root, _LABELS)
            mask = _file_beside(image, root, _MASKS) if masks == "network" else None
            refs.append(Case(image.stem, subset, partial(_read_cset, subset, image, label, mask)))
    return _select(refs, folder, subsets)


def _read_cset(subset: str, image: Path, label: Path, mask: Path | None) -> Photo:
    color = cv2.resize(_read_color(image), CSET_SIZE, interpolation=cv2.INTER_LINEAR)
    labels = _labels_of_colors(cv2.resize(decode_image(label), CSET_SIZE, interpolation=cv2.INTER_NEAREST))
    if mask is None:
        return Photo(subset, image.stem, color, labels, labels > 0)
    grey = cv2.resize(decode_image(mask, cv2.IMREAD_GRAYSCALE), CSET_SIZE, interpolation=cv2.INTER_LINEAR)
    return Photo(subset, image.stem, color, labels, np.asarray(grey > MIN_NETWORK_SCORE))


def hsv_mask(color: Array) -> Bools:
    """Return the mask of mBEST's cables, (H, W) bool, found by their colors (pink, green and teal on black cloth).

    Gaps and specks of a pixel or two are removed (morphological closing, then opening, with a square of 3x3 px).

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    """
    hsv = cv2.cvtColor(color, cv2.COLOR_RGB2HSV)
    mask = np.zeros(color.shape[:2], np.uint8)
    for low, high in HSV_RANGES:
        mask |= cv2.inRange(hsv, np.array(low), np.array(high))
    square = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.morphologyEx(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, square), cv2.MORPH_OPEN, square) > 0)


def _check_masks(folder: str | Path, masks: str, choices: tuple[str, ...]) -> Path:
    if masks not in choices:
        raise ConfigError(f"masks {masks}: there are {', '.join(choices)}", code="choice-unknown")
    return Path(folder)


def _select(refs: list[Case], folder: Path, subsets: Sequence[str] | None) -> list[Case]:
    """Return the photographs of the wanted subsets, in the order of their numbers."""
    if not refs:
        raise InputError(
            f"{folder}: no photographs here: expected images/ with labels/ beside it, see the help for the layout",
            code="photos-missing",
        )
    available = sorted({ref.family for ref in refs})
    for subset in subsets or ():
        if subset.upper() not in available:
            raise InputError(f"{folder}: has no subset {subset}, only {', '.join(available)}", code="subset-unknown")
    wanted = {subset.upper() for subset in subsets or available}
    selected = [ref for ref in refs if ref.family in wanted]
    return sorted(selected, key=lambda ref: (ref.family, [int(number) for number in re.findall(r"\d+", ref.name)], ref.name))


def _has_images(folder: Path) -> bool:
    return any((folder / name).is_dir() for name in _IMAGES)


def _image_files(folder: Path) -> list[Path]:
    """Return the images in the first existing folder with one of the accepted names."""
    images = next(folder / name for name in _IMAGES if (folder / name).is_dir())
    return sorted(path for path in images.iterdir() if path.suffix.lower() in (".jpg", ".jpeg", ".png"))


def _file_beside(image: Path, root: Path, kinds: tuple[str, ...]) -> Path:
    """Return the file with the image's name, from the first folder that has it."""
    for folder in (root / kind for kind in kinds):
        for suffix in (".png", ".npy"):
            if (path := folder / f"{image.stem}{suffix}").is_file():
                return path
    raise InputError(
        f"{image}: no {image.stem}.png or .npy beside it in {' or '.join(f'{kind}/' for kind in kinds)} of {root}",
        code="label-missing",
    )


def decode_image(path: Path, flags: int = cv2.IMREAD_UNCHANGED) -> Array:
    """Read an image as OpenCV returns it, (H, W) or (H, W, 3 or 4) BGR; flags : OpenCV's, for example to read it in gray."""
    data = np.fromfile(path, np.uint8)
    image = cv2.imdecode(data, flags) if data.size else None
    if image is None:
        raise InputError(f"{path}: is no image that OpenCV can read: copy it again", code="image-unreadable")
    return np.asarray(image)


def _read_color(path: Path) -> Array:
    return np.ascontiguousarray(decode_image(path, cv2.IMREAD_COLOR)[:, :, ::-1])


def _read_labels(path: Path) -> Ints:
    """Read the labels of a photograph: (H, W) uint8 numbers of cables without gaps, from an 8-bit image or a NumPy file."""
    labels = np.load(path, allow_pickle=False) if path.suffix == ".npy" else decode_image(path)
    if labels.ndim != 2 or not np.issubdtype(labels.dtype, np.integer):
        raise InputError(
            f"{path}: has shape {labels.shape} and type {labels.dtype}, expected (height, width) numbers of cables",
            code="label-shape",
        )
    return np.where(labels > 0, 1 + np.searchsorted(np.unique(labels[labels > 0]), labels), 0).astype(np.uint8)


def _labels_of_colors(colors: Array) -> Ints:
    """Convert a label image (H, W, 3 or 4) uint8 to numbers of cables (H, W) uint8; 0 for black and for rare colors."""
    if colors.ndim == 2:
        colors = np.repeat(colors[:, :, None], 3, axis=2)
    packed = colors[:, :, :3].astype(np.int64) @ (1, 1 << 8, 1 << 16)
    values, inverse, counts = np.unique(packed, return_inverse=True, return_counts=True)
    is_cable = (values > 0) & (counts >= MIN_CABLE_PIXELS)
    return np.where(is_cable, np.cumsum(is_cable), 0).astype(np.uint8)[inverse].reshape(packed.shape)


def _check_size(image: Path, color: Array, label: Path, labels: Ints) -> None:
    if color.shape[:2] != labels.shape:
        raise InputError(
            f"{label}: is {labels.shape[1]}x{labels.shape[0]}, {image} is {color.shape[1]}x{color.shape[0]}: they must be equal",
            code="label-size",
        )
