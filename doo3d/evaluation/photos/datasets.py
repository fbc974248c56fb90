"""Public photographs of cables with instance labels: mBEST's S1 to S3 and the C1 to C3 of FASTDLO, RT-DLO and mBEST."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ...errors import ConfigError, InputError
from ...types import Array, Bools, Ints

# what parts the coloured cables from the black cloth, in OpenCV's 8-bit HSV: pink on both sides of hue 0, green, teal
HSV_RANGES = (
    ((0, 20, 75), (20, 255, 255)),
    ((160, 20, 75), (180, 255, 255)),
    ((25, 20, 75), (50, 255, 255)),
    ((50, 20, 20), (120, 255, 255)),
)
CSET_SIZE = (640, 360)  # px, width and height: some of the labels are a row or a column short
SPECK = 30  # px: what a label image has fewer of, of a colour or in one piece, is no cable
NETWORK_OBJECT = 127  # of 255: what is above is object for the network
_IMAGES = ("images", "test_imgs")
_LABELS = ("labels", "gt_labels", "test_labels")
_MASKS = ("masks", "test_masks")


@dataclass(frozen=True)
class Photo:
    """One photograph and its truth.

    subset, name : such as S1 and img0. image : (H, W, 3) uint8 RGB. mask : (H, W) bool, what the detection is given.
    labels : (H, W) int, 0 background, i the pixels that show cable i; at a crossing those of the upper one.
    """

    subset: str
    name: str
    image: Array
    labels: Ints
    mask: Bools

    @property
    def cables(self) -> int:
        """How many there are."""
        return int(self.labels.max(initial=0))


@dataclass(frozen=True)
class PhotoRef:
    """A photograph on disk, read by `load`."""

    subset: str
    name: str
    load: Callable[[], Photo]


def mbest(folder: str | Path, masks: str = "labels", subsets: Sequence[str] | None = None) -> list[PhotoRef]:
    """The photographs below S1, S2, S3 in `folder`, or in dataset/ of the public repository's checkout.

    Each of the three holds images/ and, as 8-bit images labels/ or as NumPy arrays gt_labels/. The masks: labels, their
    foreground; hsv, the colour of the cables.

    Raises
    ------
    InputError : there are none, or a label is missing. ConfigError : there are no such masks.
    """
    folder = _checked(folder, masks, ("labels", "hsv"))

    def loader(subset: str, image: Path, label: Path) -> Callable[[], Photo]:
        def load() -> Photo:
            color, labels = _color(image), _numbers(label)
            _same_size(image, color, label, labels)
            return Photo(subset, image.stem, color, labels, labels > 0 if masks == "labels" else hsv_mask(color))

        return load

    places = [place for root in (folder, folder / "dataset") for place in [root, *sorted(root.glob("S*"))] if _has(place)]
    pairs = [(place.name, image, _beside(image, place, _LABELS)) for place in places for image in _pictures(place)]
    return _chosen(
        [PhotoRef(subset, image.stem, loader(subset, image, label)) for subset, image, label in pairs], folder, subsets
    )


def cset(folder: str | Path, masks: str = "labels", subsets: Sequence[str] | None = None) -> list[PhotoRef]:
    """The photographs in `folder`, or in data/ of the public repository's checkout, at 640x360; the subset is in the name.

    It holds images/, labels/ (a colour per cable on black) and masks/, which the repository calls test_imgs/ and so on.
    The masks given: labels, their foreground; network, what is in masks/.

    Raises
    ------
    InputError : there are none, or a label or mask is missing. ConfigError : there are no such masks.
    """
    folder = _checked(folder, masks, ("labels", "network"))

    def loader(subset: str, image: Path, label: Path, mask: Path | None) -> Callable[[], Photo]:
        def load() -> Photo:
            color = cv2.resize(_color(image), CSET_SIZE, interpolation=cv2.INTER_LINEAR)
            labels = _color_numbers(cv2.resize(_decoded(label), CSET_SIZE, interpolation=cv2.INTER_NEAREST))
            if mask is None:
                return Photo(subset, image.stem, color, labels, labels > 0)
            grey = cv2.resize(_decoded(mask, cv2.IMREAD_GRAYSCALE), CSET_SIZE, interpolation=cv2.INTER_LINEAR)
            return Photo(subset, image.stem, color, labels, np.asarray(grey > NETWORK_OBJECT))

        return load

    entries = []
    for place in [root for root in (folder, folder / "data") if _has(root)]:
        for image in _pictures(place):
            subset, label = image.stem.partition("_")[0].upper(), _beside(image, place, _LABELS)
            mask = _beside(image, place, _MASKS) if masks == "network" else None
            entries.append(PhotoRef(subset, image.stem, loader(subset, image, label, mask)))
    return _chosen(entries, folder, subsets)


def hsv_mask(color: Array) -> Bools:
    """(H, W, 3) uint8 RGB -> (H, W) bool: mBEST's cables by their colour, closed and opened with 3x3."""
    hsv = cv2.cvtColor(color, cv2.COLOR_RGB2HSV)
    seen = np.zeros(color.shape[:2], np.uint8)
    for low, high in HSV_RANGES:
        seen |= cv2.inRange(hsv, np.array(low), np.array(high))
    square = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.morphologyEx(cv2.morphologyEx(seen, cv2.MORPH_CLOSE, square), cv2.MORPH_OPEN, square) > 0)


def _checked(folder: str | Path, masks: str, known: tuple[str, ...]) -> Path:
    if masks not in known:
        raise ConfigError(f"masks {masks}: there are {', '.join(known)}", code="choice-unknown")
    return Path(folder)


def _chosen(entries: list[PhotoRef], folder: Path, subsets: Sequence[str] | None) -> list[PhotoRef]:
    """Those of the subsets wanted, in the order of their numbers."""
    if not entries:
        raise InputError(
            f"{folder}: no photographs here: expected images/ with labels/ beside it, see the help for the layout",
            code="photos-missing",
        )
    there = sorted({entry.subset for entry in entries})
    for subset in subsets or ():
        if subset.upper() not in there:
            raise InputError(f"{folder}: has no subset {subset}, only {', '.join(there)}", code="subset-unknown")
    wanted = {subset.upper() for subset in subsets or there}
    numbered = [entry for entry in entries if entry.subset in wanted]
    return sorted(
        numbered, key=lambda entry: (entry.subset, [int(number) for number in re.findall(r"\d+", entry.name)], entry.name)
    )


def _has(place: Path) -> bool:
    return any((place / name).is_dir() for name in _IMAGES)


def _pictures(place: Path) -> list[Path]:
    """The images in the first folder of that kind."""
    folder = next(place / name for name in _IMAGES if (place / name).is_dir())
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in (".jpg", ".jpeg", ".png"))


def _beside(image: Path, place: Path, kinds: tuple[str, ...]) -> Path:
    """The file of the image's name in the first folder of the kind that is there."""
    for folder in (place / kind for kind in kinds):
        for suffix in (".png", ".npy"):
            if (path := folder / f"{image.stem}{suffix}").is_file():
                return path
    raise InputError(
        f"{image}: no {image.stem}.png or .npy beside it in {' or '.join(f'{kind}/' for kind in kinds)} of {place}",
        code="label-missing",
    )


def _decoded(path: Path, flags: int = cv2.IMREAD_UNCHANGED) -> Array:
    image = cv2.imdecode(np.fromfile(path, np.uint8), flags)
    if image is None:
        raise InputError(f"{path}: is no image that OpenCV can read: copy it again", code="image-unreadable")
    return np.asarray(image)


def _color(path: Path) -> Array:
    return np.ascontiguousarray(_decoded(path, cv2.IMREAD_COLOR)[:, :, ::-1])


def _numbers(path: Path) -> Ints:
    """(H, W) uint8, from an 8-bit image or a NumPy file that hold the numbers."""
    labels = np.load(path, allow_pickle=False) if path.suffix == ".npy" else _decoded(path)
    if labels.ndim != 2 or not np.issubdtype(labels.dtype, np.integer):
        raise InputError(
            f"{path}: has shape {labels.shape} and type {labels.dtype}, expected (height, width) numbers of cables",
            code="label-shape",
        )
    return np.where(labels > 0, 1 + np.searchsorted(np.unique(labels[labels > 0]), labels), 0).astype(np.uint8)


def _color_numbers(colors: Array) -> Ints:
    """(H, W) uint8 numbers of the colours of (H, W, 3 or 4) uint8; black and colours of a few pixels are 0."""
    if colors.ndim == 2:
        colors = np.repeat(colors[:, :, None], 3, axis=2)
    packed = colors[:, :, :3].astype(np.int64) @ (1, 1 << 8, 1 << 16)
    values, where, counts = np.unique(packed, return_inverse=True, return_counts=True)
    cable = (values > 0) & (counts >= SPECK)
    return np.where(cable, np.cumsum(cable), 0).astype(np.uint8)[where].reshape(packed.shape)


def _same_size(image: Path, color: Array, label: Path, labels: Ints) -> None:
    if color.shape[:2] != labels.shape:
        raise InputError(
            f"{label}: is {labels.shape[1]}x{labels.shape[0]}, {image} is {color.shape[1]}x{color.shape[0]}", code="label-size"
        )
