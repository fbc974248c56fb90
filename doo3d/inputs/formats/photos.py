"""Define the layout of photographs for the 2-D mode: an image or a folder of images, with optional masks."""

from pathlib import Path

import cv2
import numpy as np

from ...errors import InputError
from ..read_options import ReadOptions
from ..rig.calibration_files import find_pair_calibration
from ..support.image_folders import color_folder
from ..support.images import PHOTO_SUFFIXES, decode_image, first_size, is_image, scaled_range
from ..support.listing import first_folder, images_in, match_images, natural_key, role_of
from .image_folder import Files, Layout

_MASKS = ("mask", "masks")
_ALL_BITS = (0, 65535)  # range of 16-bit images that use it


def _photo_folder(folder: Path) -> Path:
    """Return the folder with the photographs: `folder` or one of its sub-folders."""
    if images_in(folder, PHOTO_SUFFIXES) and not (folder / "depth").is_dir():
        return folder
    named = first_folder(folder, "color", "images", "rgb") or color_folder(folder)
    return named if named.is_dir() else folder


def _photos_in(folder: Path) -> dict[str, Path]:
    """Return stem -> path of the photographs in a folder; depth images and masks beside color images are left out."""
    images = images_in(folder, PHOTO_SUFFIXES)
    roles = {stem: role_of(stem) for stem in images}
    alone = {"depth", "color"} <= set(roles.values())
    return {stem: file for stem, file in images.items() if not alone or roles[stem] == "color"}


def _photo_root(path: Path) -> Path:
    folder = path if path.is_dir() else path.parent
    return folder.parent if path != folder and folder.name in ("color", "images", "rgb") else folder


def _range_note(first: Path | None) -> list[str]:
    """Return a note if the first photograph uses only few of its 16 bits, so that photographs are scaled by their range."""
    if first is None or first.suffix.lower() not in (".png", ".tif", ".tiff"):
        return []
    try:
        image = decode_image(first, cv2.IMREAD_UNCHANGED)
    except InputError:  # loading it reports the error
        return []
    low, high = scaled_range(image) if image.dtype == np.uint16 else _ALL_BITS
    if (low, high) == _ALL_BITS:
        return []
    return [f"{first.name} has 16 bits and values from {low:.0f} to {high:.0f}: each such image is scaled by its range"]


def _list_photos(path: Path, options: ReadOptions, notes: list[str]) -> list[Files]:
    folder = first_folder(_photo_root(path), *_MASKS)
    masks = images_in(folder, PHOTO_SUFFIXES) if folder else {}
    notes += _range_note(path if not path.is_dir() else next(iter(_photos_in(_photo_folder(path)).values()), None))
    if not path.is_dir():
        return [Files(path.stem, color=path, masks=(masks[path.stem],) if path.stem in masks else ())]
    photos = _photos_in(_photo_folder(path))
    size = first_size(list(photos.values()))
    calibration = None if size is None else find_pair_calibration(path, size)
    if calibration is not None:
        notes.append(PAIR_NOTE.format(calibration))
    masks, frames = match_images(masks, photos), []
    for name in sorted({**photos, **masks}, key=natural_key):
        fault = None
        if name not in photos:
            fault = (f"{masks[name]}: is a mask without photograph: there is none called {name}", "color-missing")
        elif folder is not None and name not in masks:
            fault = (f"{folder}: has no mask {name} for {photos[name]}", "mask-missing")
        frames.append(Files(name, color=photos.get(name), masks=(masks[name],) if name in masks else (), fault=fault))
    return frames


PAIR_NOTE = "these are images of a stereo pair, side by side: for 3-D give --cameras {}"
"""Note for photographs next to the calibration of a stereo pair whose images have half their width."""

PHOTOS = Layout(
    "photos",
    "for the 2-D mode a photograph, or a folder of them, with mask/ (optional)",
    can_read=lambda path: bool(_photos_in(_photo_folder(path))) if path.is_dir() else is_image(path),
    frames=_list_photos,
    upright=lambda path: not (_photo_root(path) / "depth").is_dir(),
    options=frozenset(),
)
