"""Photographs for the 2-D mode: a file, or a folder of them, with masks beside them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...types import Image
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.image_folders import color_folder
from ..support.images import PHOTO_SUFFIXES, is_image, read_color, read_mask
from ..support.listing import images_in, match_images, natural_key
from ..support.roles import role_of

PHOTO_FOLDERS, MASK_FOLDERS = ("color", "images", "rgb"), ("mask", "masks")  # photographs may lie in the folder itself


class PhotosCapture:
    """A photograph, or a folder of them in natural order of their names, opened as a capture for the 2-D mode.

    Masks are searched in the sub-folder `mask/` or `masks/`. A mask belongs to the photograph of the same file name except for
    the suffix; if no names agree and there are equally many, they are matched by order. In a folder with masks, a photograph
    without a mask raises InputError when it is loaded. A single photograph gets the mask of its name if there is one.
    """

    what: ClassVar[str] = "for the 2-D mode a photograph, or a folder of them, with mask/ (optional)"
    format = "photos"
    options: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        self.frames = _folder(path) if path.is_dir() else [_single(path)]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is an image, or a folder with images in it or in `color/`, `images/` or `rgb/`."""
        return bool(_photos_in(_photo_folder(path))) if path.is_dir() else is_image(path)


def _folder(path: Path) -> list[FrameRef]:
    photo_folder, masks = _photo_folder(path), _mask_folder(path)
    photos = _photos_in(photo_folder)
    given = match_images(images_in(masks, PHOTO_SUFFIXES), photos) if masks else {}
    return [
        FrameRef(
            name, photos.get(name, photo_folder), partial(_load, name, photos.get(name), given.get(name), masks, _upright(path))
        )
        for name in sorted({**photos, **given}, key=natural_key)
    ]


def _single(photo: Path) -> FrameRef:
    root = photo.parent.parent if photo.parent.name in PHOTO_FOLDERS else photo.parent
    masks = _mask_folder(root)
    mask = images_in(masks, PHOTO_SUFFIXES).get(photo.stem) if masks else None
    return FrameRef(photo.stem, photo, partial(_load, photo.stem, photo, mask, masks if mask else None, _upright(root)))


def _photo_folder(folder: Path) -> Path:
    """Return the folder with the photographs: `folder` or one of its sub-folders."""
    if images_in(folder, PHOTO_SUFFIXES) and not (folder / "depth").is_dir():
        return folder
    named = next((folder / name for name in PHOTO_FOLDERS if (folder / name).is_dir()), color_folder(folder))
    return named if named.is_dir() else folder


def _photos_in(folder: Path) -> dict[str, Path]:
    """Return the photographs in a folder, stem -> path; of color images beside depth images and masks, the color images alone."""
    images = images_in(folder, PHOTO_SUFFIXES)
    colors = {stem: file for stem, file in images.items() if role_of(stem) == "color"}
    return colors if colors and any(role_of(stem) == "depth" for stem in images) else images


def _mask_folder(root: Path) -> Path | None:
    return next((root / name for name in MASK_FOLDERS if (root / name).is_dir()), None)


def _upright(root: Path) -> bool:
    """Return whether to rotate photographs by EXIF: not those beside depth images, which have no EXIF orientation."""
    return not (root / "depth").is_dir()


def _load(name: str, photo: Path | None, mask: Path | None, masks: Path | None, upright: bool) -> FrameData:
    if photo is None:
        raise InputError(f"{mask}: is a mask without photograph: there is none called {name}", code="color-missing")
    if masks is not None and mask is None:
        raise InputError(f"{masks}: has no mask {name} for {photo}", code="mask-missing")
    image = Image(read_color(photo, upright), name)
    return FrameData(image, read_mask(mask, image.color.shape[:2], upright) if mask else None)
