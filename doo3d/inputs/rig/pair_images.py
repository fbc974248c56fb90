"""Find and read the unrectified images of a stereo pair: side by side in one image, or in two folders."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...types import Array, Bools
from ...types.arrays import fit_mask
from ..support.images import PHOTO_SUFFIXES, Size, image_size, read_color, read_mask
from ..support.listing import frame_key, images_in, role_of

SIDES = ("left", "right")
_MASK_FOLDERS = ("mask", "masks")
_SHOWN = 3  # names of frames in an error


@dataclass(frozen=True)
class PairImages:
    """Both images of a pair at one time.

    Attributes
    ----------
    left, right
        (H, W, 3) uint8 RGB, as the cameras took them, not rectified.
    left_mask, right_mask
        (H, W) bool, true on the object; None if there is no mask.
    name
        name of the frame.
    """

    left: Array
    right: Array
    left_mask: Bools | None = None
    right_mask: Bools | None = None
    name: str = "pair"


@dataclass(frozen=True)
class CameraImages:
    """The images of one camera of a pair in files.

    Attributes
    ----------
    name
        name of the camera.
    half
        half of the image that belongs to the camera, "left" or "right"; None for the whole image.
    files
        name of the frame -> image.
    masks
        name of the frame -> masks, whose union is the object; frames without a mask are missing.
    """

    name: str
    half: str | None
    files: Mapping[str, Path]
    masks: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)

    def size(self) -> Size | None:
        """Return (width, height) px of the camera's first image; None if it cannot be read."""
        size = next((size for size in map(image_size, self.files.values()) if size is not None), None)
        return size if size is None or self.half is None else (size[0] // 2, size[1])

    def load(self, name: str) -> tuple[Array, Bools | None]:
        """Read the image (H, W, 3) and the mask (H, W) of a frame; None for the mask if there is none.

        Raises
        ------
        InputError : a file cannot be read, or a mask has the size neither of the image nor of both images side by side.
        """
        file = self.files[name]
        whole = read_color(file)
        if self.half is not None and whole.shape[1] % 2:
            sentence = f"{file}: is {whole.shape[1]} px wide, which is not two images side by side"
            raise InputError(sentence, code="image-shape")
        image = self._own(whole)
        masks = [self._mask(mask, image.shape[:2]) for mask in self.masks.get(name, ())]
        return image, np.any(masks, axis=0) if masks else None

    def of_frame(self, name: str) -> CameraImages:
        """Return the camera's images with one frame only, for a reference to that frame."""
        masks = {name: self.masks[name]} if name in self.masks else {}
        return CameraImages(self.name, self.half, {name: self.files[name]}, masks)

    def _own(self, whole: Array) -> Array:
        """Return the camera's part of an image."""
        middle = whole.shape[1] // 2
        return whole if self.half is None else whole[:, :middle] if self.half == SIDES[0] else whole[:, middle:]

    def _mask(self, file: Path, shape: tuple[int, ...]) -> Bools:
        size = (shape[0], 2 * shape[1]) if self.is_half(file) else shape
        mask = fit_mask(read_mask(file, size), size)[0]
        return self._own(mask) if self.is_half(file) else mask

    def is_half(self, mask: Path) -> bool:
        """Return whether a mask contains both cameras' views side by side, like the images."""
        return self.half is not None and image_size(mask) == image_size(next(iter(self.files.values())))


def find_images(path: Path, folder: Path | None, name: str, half: str | None) -> CameraImages:
    """Return the images of one camera.

    Parameters
    ----------
    path
        the capture: a folder, or an image of both cameras side by side.
    folder
        the camera's folder in it; None for the folder itself. If several cameras share a folder, the names of their images
        contain the name of the camera.
    name
        name of the camera.
    half
        half of each image that belongs to the camera, "left" or "right"; None for the whole image.

    Raises
    ------
    InputError : there are no images, or the file is not an image.
    """
    if path.is_file():
        if path.suffix.lower() not in PHOTO_SUFFIXES:
            sentence = "expected a folder of images, or an image of both views side by side: export the images of a recording"
            raise InputError(f"{path}: is no image: {sentence}", code="format-unknown")
        return CameraImages(name, half, {path.stem: path})
    place = path if folder is None else path / folder
    images = {stem: file for stem, file in images_in(place, PHOTO_SUFFIXES).items() if role_of(stem) != "mask"}
    own = images if half else {stem: file for stem, file in images.items() if _mentions(stem, name)} or images
    if not own:
        raise InputError(f"{place}: holds no images of the camera {name}", code="folder-empty")
    return CameraImages(name, half, own)


def paired(left: CameraImages, right: CameraImages) -> tuple[CameraImages, CameraImages]:
    """Pair the images of both cameras by file name, ignoring the cameras' names, or else by order; frames get common names.

    Raises
    ------
    InputError : the cameras have different numbers of images, or names that agree for some of them only.
    """
    first, second = ({_without(stem, side.name): file for stem, file in side.files.items()} for side in (left, right))
    if (len(first), len(second)) == (len(left.files), len(right.files)) and first.keys() & second.keys():
        if alone := sorted(first.keys() ^ second.keys()):
            shown = ", ".join(alone[:_SHOWN])
            raise _unpaired(left, right, f"{len(alone)} frames have an image of one camera only, such as {shown}")
    elif len(left.files) == len(right.files):
        first, second = dict(left.files), dict(zip(left.files, right.files.values(), strict=True))
    else:
        raise _unpaired(left, right, "and their names do not tell which belong together")
    ordered = {name: second[name] for name in first}
    return CameraImages(left.name, left.half, first), CameraImages(right.name, right.half, ordered)


def _unpaired(left: CameraImages, right: CameraImages, reason: str) -> InputError:
    counts = f"the camera {left.name} has {len(left.files)} images and the camera {right.name} {len(right.files)}"
    folder = next(iter(left.files.values())).parent
    return InputError(f"{folder}: {counts}, {reason}: give one image of each for every frame", code="frame-count")


def with_masks(
    pair: tuple[CameraImages, CameraImages], path: Path, folders: tuple[Path | None, Path | None], given: Path | None
) -> tuple[CameraImages, CameraImages]:
    """Return the images of both cameras with their masks, in files named like the images.

    A mask belongs to a camera if it is in a folder of that camera, or if its name contains the camera's. Any other mask belongs
    to both cameras if it has both views side by side, else to the left camera. Several masks of a frame (`000_left_mask_0`,
    `000_left_mask_1`) are parts of the object.

    Parameters
    ----------
    pair
        the images of the left and of the right camera.
    path
        the capture.
    folders
        the folders with either camera's masks in the capture, if the rig's file names them.
    given
        the mask or the folder of masks that the user gave, which replaces all others; None if there is none.

    Raises
    ------
    InputError : masks are given, or named in the rig file, and there is none for any frame.
    """
    root = path if path.is_dir() else path.parent
    if given is not None and not given.exists():
        raise InputError(f"{given} does not exist", code="file-missing")
    if given is not None and given.is_file() and len(pair[0].files) != 1:
        sentence = f"{given}: is one mask, but there are {len(pair[0].files)} frames: give a folder"
        raise InputError(sentence, code="frame-count")
    masked = []
    for images, other, folder in zip(pair, pair[::-1], folders, strict=True):
        masks: dict[str, tuple[Path, ...]] = {}
        if given is not None and given.is_file():
            masks = {name: (given,) for name in images.files if images is pair[0] or images.is_half(given)}
        elif folder is not None and given is None:
            masks = _named_like(images, images_in(root / folder, PHOTO_SUFFIXES))
            if not masks:
                sentence = f"{root / folder}: holds no mask for any frame of the camera {images.name}"
                raise InputError(sentence, code="mask-missing")
        else:
            for place in [given] if given is not None else _places(images, root):
                masks = masks or _masks_in(place, images, other, images is pair[0])
        masked.append(replace(images, masks=masks))
    if given is not None and not any(images.masks for images in masked):
        sentence = f"{given}: holds no mask for any of the {len(pair[0].files)} frames of {path}: name masks like frames"
        raise InputError(sentence, code="mask-missing")
    return masked[0], masked[1]


def _places(images: CameraImages, root: Path) -> list[Path]:
    """Return the default folders in which masks are searched."""
    beside = next(iter(images.files.values())).parent
    return [*(folder / name for folder in dict.fromkeys((beside, root)) for name in _MASK_FOLDERS), beside]


def _masks_in(place: Path, images: CameraImages, other: CameraImages, is_left: bool) -> dict[str, tuple[Path, ...]]:
    """Return name of each frame -> masks of a camera in a folder: those named after it, or after no camera."""
    if own := images_in(place / images.name, PHOTO_SUFFIXES):
        return _named_like(images, own)
    files, folders = images_in(place, PHOTO_SUFFIXES), [next(iter(each.files.values())).parent for each in (images, other)]
    if place == folders[0]:
        files = {stem: file for stem, file in files.items() if role_of(stem) == "mask"}
    if own := {stem: file for stem, file in files.items() if _mentions(stem, images.name)}:
        return _named_like(images, own)
    is_own_folder = folders[0] != folders[1] and folders[0] in (place, place.parent)
    of_none = {stem: file for stem, file in files.items() if not _mentions(stem, other.name)}
    usable = {stem: file for stem, file in of_none.items() if is_left or is_own_folder or images.is_half(file)}
    return _named_like(images, usable)


def _named_like(images: CameraImages, files: dict[str, Path]) -> dict[str, tuple[Path, ...]]:
    return {name: found for name in images.files if (found := _masks_of(name, files, images.name))}


def _masks_of(frame: str, files: dict[str, Path], camera: str) -> tuple[Path, ...]:
    wanted = frame_key(frame)
    keys = {stem: frame_key(_without(stem, camera)) for stem in files}
    if exact := tuple(files[stem] for stem, key in keys.items() if frame in (stem, _without(stem, camera)) or key == wanted):
        return exact
    return tuple(files[stem] for stem, key in keys.items() if re.fullmatch(rf"{re.escape(wanted)}[-_.]*\d+", key))


def _mentions(stem: str, name: str) -> bool:
    return _word(name).search(stem) is not None


def _without(stem: str, name: str) -> str:
    """Return a file name without the name of the camera, or unchanged if nothing else would be left."""
    rest = re.sub(r"([-_. ])[-_. ]+", r"\1", _word(name).sub("", stem)).strip("-_. ")
    return rest or stem


def _word(name: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![A-Za-z0-9]){re.escape(name)}(?![A-Za-z0-9])", re.IGNORECASE)
