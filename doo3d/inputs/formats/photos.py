"""Photographs for the 2-D mode: a file, or a folder of them, with masks beside them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...types import Image
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.images import PHOTO_SUFFIXES, is_image, read_color, read_mask
from ..support.listing import images_in, natural, paired

PICTURES, MASKS = ("color", "images", "rgb"), ("mask", "masks")  # sub-folders; pictures may lie in the folder itself


class PhotosCapture:
    """The photographs of a folder in the order of their names, numbers as numbers; or one alone.

    Masks belong to the photographs of the same stem; where none does, by order if there are equally many. In a folder
    with masks a photograph without one fails; one photograph alone takes the mask of its stem if there is one.
    """

    what: ClassVar[str] = "for the 2-D mode a photograph, or a folder of them, with mask/ (optional)"
    format = "photos"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        self.frames = _folder(path) if path.is_dir() else [_alone(path)]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Whether `path` is an image, or a folder with images in it or in its `color/`."""
        return bool(images_in(_place(path), PHOTO_SUFFIXES)) if path.is_dir() else is_image(path)


def _folder(path: Path) -> list[FrameRef]:
    place, masks = _place(path), _masks(path)
    photos = images_in(place, PHOTO_SUFFIXES)
    given = paired(images_in(masks, PHOTO_SUFFIXES), photos) if masks else {}
    return [
        FrameRef(name, photos.get(name, place), partial(_load, name, photos.get(name), given.get(name), masks, _upright(path)))
        for name in sorted({**photos, **given}, key=natural)
    ]


def _alone(photo: Path) -> FrameRef:
    root = photo.parent.parent if photo.parent.name in PICTURES else photo.parent
    masks = _masks(root)
    mask = images_in(masks, PHOTO_SUFFIXES).get(photo.stem) if masks else None
    return FrameRef(photo.stem, photo, partial(_load, photo.stem, photo, mask, masks if mask else None, _upright(root)))


def _place(folder: Path) -> Path:
    """Where the pictures of a folder are."""
    if images_in(folder, PHOTO_SUFFIXES) and not (folder / "depth").is_dir():
        return folder
    return next((folder / name for name in PICTURES if (folder / name).is_dir()), folder)


def _masks(root: Path) -> Path | None:
    return next((root / name for name in MASKS if (root / name).is_dir()), None)


def _upright(root: Path) -> bool:
    """Whether pictures are turned as their EXIF says: not those that belong to depth images, which know no turning."""
    return not (root / "depth").is_dir()


def _load(name: str, photo: Path | None, mask: Path | None, masks: Path | None, upright: bool) -> FrameData:
    if photo is None:
        raise InputError(f"{mask}: there is no photograph {name} that this mask belongs to", code="color-missing")
    if masks is not None and mask is None:
        raise InputError(f"{masks}: there is no mask {name} for {photo}", code="mask-missing")
    image = Image(read_color(photo, upright), name)
    return FrameData(image, read_mask(mask, image.color.shape[:2], upright) if mask else None)
