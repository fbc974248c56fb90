"""Find the roles of images in folders (depth, color, mask) by name and content, and match them to frames by name."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Literal

from ...errors import InputError
from ...guard.guarding import check_regular, read_head
from .arrays import array_header
from .images import DEPTH_SUFFIXES, SUFFIXES, raw_size_file

Role = Literal["depth", "color", "mask"]
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_DEPTH = {"depth", "depths"}
_COLOR = {"color", "colors", "colour", "rgb", "bgr", "image", "images", "img", "imgs", "photo"}
_MASK = {"mask", "masks", "seg", "segmentation"}
_CLASSES = {"semantic", "instance"}  # of segmentations of a whole scene, which are no masks of an object
_PREVIEW = {"preview", "colormap", "colorized", "colored", "vis", "viz", "visualization", "pseudo"}
_OTHER = {"aligned", "registered", "raw", "to"}  # as in aligned_depth_to_color; no part of the frame's name
_ROLE_WORDS = _DEPTH | _COLOR | _MASK | _OTHER
RAY_DISTANCE = "distance_to_camera"  # Omniverse Replicator's name of distances along the rays
_REPLICATORS_DEPTH = re.compile(f"distance_to_image_plane|{RAY_DISTANCE}", re.IGNORECASE)
_PNG = b"\x89PNG\r\n\x1a\n"
_MIN_SIDE_PX = 16  # of an array that is an image


def words_of(name: str) -> list[str]:
    """Return the words in a name, in lower case: aligned_depth-02 and AlignedDepth02 have the words aligned and depth."""
    return [word.lower() for word in _WORD.findall(_REPLICATORS_DEPTH.sub("depth", name))]


def is_distance(file: Path) -> bool:
    """Return whether an image or its folder has the name of Replicator's distances along the rays."""
    return any(RAY_DISTANCE in name.lower() for name in (file.name, file.parent.name))


def role_of(name: str) -> Role | None:
    """Return the role of an image or a folder of images by the words of its name; None without such a word.

    A name with both depth and color means depth (aligned_depth_to_color); a colored preview of depth has no role.
    """
    words = set(words_of(name))
    if words & _MASK:
        return None if words & _CLASSES else "mask"
    if words & _DEPTH:
        return None if words & _PREVIEW else "depth"
    return "color" if words & _COLOR else None


def frame_key(stem: str) -> str:
    """Return the common part of the names of a frame's images: 000 for 000_depth, frame_0 for frame_0.depth."""
    stem = _REPLICATORS_DEPTH.sub("depth", stem)
    rest = _WORD.sub(lambda word: "" if word[0].lower() in _ROLE_WORDS else word[0], stem)
    return re.sub(r"([-_. ])[-_. ]+", r"\1", rest).strip("-_. ")


def is_depth_content(file: Path) -> bool:
    """Return whether a file is a depth image by its header: a 16-bit single-channel PNG, or a 2-D array of numbers (.npy)."""
    if file.suffix.lower() == ".npy":
        return _is_depth_array(file)
    return _png_kind(file) == b"\x10\0"


def may_be_depth(file: Path) -> bool:
    """Return whether a file with depth in its name can be depth: no 8-bit PNG or JPEG (a preview), no raw data without size."""
    suffix = file.suffix.lower()
    if suffix == ".png":
        return not b"\0" < _png_kind(file)[:1] <= b"\x08"
    if suffix == ".raw":
        return raw_size_file(file).is_file()
    return suffix in DEPTH_SUFFIXES and suffix not in (".jpg", ".jpeg", ".bmp")


def _png_kind(file: Path) -> bytes:
    """Return the two bytes of a PNG's header with bits per channel and color type (0: gray); empty for other files."""
    head = read_head(file, 26)
    return head[24:] if head.startswith(_PNG) else b""


def _is_depth_array(file: Path) -> bool:
    try:
        shape, _, dtype = array_header(file)
    except (ValueError, EOFError, OSError):
        return False
    sides = shape[:2] if len(shape) == 2 or (len(shape) == 3 and shape[2] == 1) else (0,)
    return min(sides) >= _MIN_SIDE_PX and dtype.kind in "uif" and dtype.itemsize > 1


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
    for file in sorted((each for each in files if each.suffix.lower() in suffixes), key=lambda each: natural_key(each.name)):
        if (first := images.setdefault(file.stem, file)) is not file:
            sentence = f"{folder}: two images are called {file.stem} ({first.name}, {file.name}): remove one"
            raise InputError(sentence, code="names-clash")
        check_regular(file)
    return images


def first_folder(path: Path, *names: str) -> Path | None:
    """Return the first sub-folder with one of the names; None if there is none."""
    return next((path / name for name in names if (path / name).is_dir()), None)


def depth_images(path: Path) -> dict[str, Path]:
    """Return stem -> path of the images in the sub-folder depth/; raise InputError if there are none."""
    if depth := images_in(path / "depth"):
        return depth
    raise InputError(f"{path / 'depth'}: holds no depth images", code="folder-empty")


def match_images(images: dict[str, Path], names: Mapping[str, object]) -> dict[str, Path]:
    """Match images to frames and return them as a dict frame name -> path.

    The stem of an image is its file name without the suffix. If the stem of at least one image is a frame's name, `images` is
    returned unchanged, including images that belong to no frame. Otherwise names are compared without words such as depth, color
    and mask (color_0001 belongs to depth_0001); this match is used if each image then belongs to a frame. Otherwise images and
    frames are matched in order, if their numbers are equal; if not, the dict is empty.

    Parameters
    ----------
    images
        stem -> path, in order.
    names
        mapping whose keys are the frames' names, in order; its values are ignored.
    """
    if not images or images.keys() & names.keys():
        return images
    keys, files = {frame_key(name): name for name in names}, {frame_key(stem): file for stem, file in images.items()}
    if len(keys) == len(names) and len(files) == len(images) and files.keys() <= keys.keys():
        return {name: files[key] for key, name in keys.items() if key in files}
    return dict(zip(names, images.values(), strict=True)) if len(images) == len(names) else {}
