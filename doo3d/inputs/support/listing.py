"""Lists of image files in folders, and matching of images to frames by name."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path

from ...errors import InputError
from .images import SUFFIXES


def natural_key(name: str) -> list[tuple[int, str]]:
    """Return the sort key of a name in natural order: 9 before 10."""
    return [(int(part), part) if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name) if part]


def images_in(folder: Path, suffixes: Collection[str] = SUFFIXES) -> dict[str, Path]:
    """Return the images of a folder, stem -> file, in natural order; empty if the folder does not exist.

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
    """Return the images by frame name: matched by stem, or by order if no stem matches and the numbers are equal."""
    if images and not images.keys() & names.keys():
        if len(images) == len(names):
            return dict(zip(names, images.values(), strict=True))
        return {}
    return images


def with_file(error: InputError, file: Path) -> InputError:
    """Return the error with the file's path before its sentence, unless it has one."""
    text = str(error)
    return error if str(file.parent.parent) in text else InputError(f"{file}: {text}", code=error.code)
