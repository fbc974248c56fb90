"""Lists of image files in folders, and matching of images to frames by name."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path

from ...errors import InputError
from .images import SUFFIXES
from .roles import frame_key


def natural_key(name: str) -> list[tuple[int, str]]:
    """Return a key for sorting names in natural order, in which numbers count by value: img9 before img10."""
    return [(int(part), part) if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name) if part]


def images_in(folder: Path, suffixes: Collection[str] = SUFFIXES) -> dict[str, Path]:
    """Return the images in a folder as a dict stem -> path, in natural order of the file names (9 before 10).

    The stem is the file name without its suffix. Hidden files are left out and sub-folders are not searched. The dict is empty if
    the folder does not exist. `suffixes` are the accepted file suffixes in lower case with the dot, such as ".png".

    Raises
    ------
    InputError : two images have the same stem.
    """
    images: dict[str, Path] = {}
    files = [file for file in folder.iterdir() if not file.name.startswith(".")] if folder.is_dir() else []
    for file in sorted(files, key=lambda file: natural_key(file.name)):
        if file.suffix.lower() in suffixes:
            if file.stem in images:
                raise InputError(
                    f"{folder}: two images are called {file.stem} ({images[file.stem].name}, {file.name}): remove one",
                    code="names-clash",
                )
            images[file.stem] = file
    return images


def match_images(images: dict[str, Path], names: Mapping[str, object]) -> dict[str, Path]:
    """Match images to frames and return them as a dict frame name -> path.

    The stem of an image is its file name without the suffix. If the stem of at least one image is a frame's name, `images` is
    returned unchanged, including images that belong to no frame. Otherwise names are compared without words such as depth, color
    and mask (color_0001 belongs to depth_0001), provided that each image so belongs to a frame. Otherwise the first image belongs
    to the first frame and so on, if there are as many images as frames; if not, the dict is empty.

    Parameters
    ----------
    images
        stem -> path, in order.
    names
        mapping whose keys are the frames' names, in order; its values are ignored.
    """
    if images and not images.keys() & names.keys():
        keys, files = {frame_key(name): name for name in names}, {frame_key(stem): file for stem, file in images.items()}
        if len(keys) == len(names) and len(files) == len(images) and files.keys() <= keys.keys():
            return {name: files[key] for key, name in keys.items() if key in files}
        if len(images) == len(names):
            return dict(zip(names, images.values(), strict=True))
        return {}
    return images


def with_file(error: InputError, file: Path) -> InputError:
    """Return an InputError whose message is the path `file` followed by the message of `error`; its code stays the same.

    `error` itself is returned if its message already contains the path of the capture's folder, which is taken to be
    `file.parent.parent`.
    """
    text = str(error)
    return error if str(file.parent.parent) in text else InputError(f"{file}: {text}", code=error.code)
