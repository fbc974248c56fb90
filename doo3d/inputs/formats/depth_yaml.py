"""One depth image with its camera in a YAML file beside it, or in what the user says; a colour image may belong to it."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Annotated, ClassVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from ...errors import InputError, invalid_code
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.depth_frames import Files, Sensor, check_pose, load_files
from ..support.images import is_image
from ..support.listing import natural
from .open3d_folder import DEFAULT_DEPTH_SCALE

_BESIDE = (".yaml", ".yml")
_DEPTH = (".png", ".tif", ".tiff", ".exr")
_SAYS = re.compile(rb"^(?:\{\s*)?[\"']?camera[\"']?\s*:", re.MULTILINE)
_MOST = 1 << 16  # bytes of a YAML file that are read: more is none of a camera
_Focal = Annotated[FiniteFloat, Field(gt=0)]


class Beside(BaseModel):
    """What the YAML file of a depth image says; file names are relative to it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    camera: tuple[_Focal, _Focal, FiniteFloat, FiniteFloat]
    depth_scale: Annotated[FiniteFloat, Field(gt=0)] = DEFAULT_DEPTH_SCALE
    color: Path | None = None
    mask: Path | None = None
    pose: tuple[tuple[FiniteFloat, ...], ...] | None = None
    timestamp: FiniteFloat | None = None


class PairsCapture:
    """A depth image, or those of a folder, each with `<name>.yaml` beside it: camera, depth_scale, color, mask, pose, timestamp.

    What the user says of the camera, the unit and (of a single image) the colour goes before it. Of a single image whose
    camera the user says the file may be missing.
    """

    what: ClassVar[str] = "a depth image, or a folder of them, with <name>.yaml (camera: [fx, fy, cx, cy], depth_scale, color)"
    format = "pairs"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        if path.is_dir():
            self.frames = [_entry(_image(file), file, options) for file in _described(path)]
        elif path.suffix.lower() in _BESIDE:
            self.frames = [_entry(_image(path), path, options)]
        else:
            self.frames = [_entry(path, _yaml(path), options)]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Whether `path` is an image with a YAML file of its name that says a camera, that file, or a folder with such."""
        if path.is_dir():
            return bool(_described(path))
        if path.suffix.lower() in _BESIDE:
            return path.is_file() and _says(path) and _image(path).is_file()
        file = _yaml(path)
        return file is not None and _says(file) and is_image(path)


def _described(folder: Path) -> list[Path]:
    """The YAML files of a folder that say a camera and have an image of their name beside them."""
    files = [file for file in folder.iterdir() if file.suffix.lower() in _BESIDE and not file.name.startswith(".")]
    return sorted((file for file in files if _says(file) and _image(file).is_file()), key=lambda file: natural(file.name))


def _says(file: Path) -> bool:
    with file.open("rb") as opened:
        return _SAYS.search(opened.read(_MOST)) is not None


def _yaml(image: Path) -> Path | None:
    return next((file for suffix in _BESIDE if (file := image.with_suffix(suffix)).is_file()), None)


def _image(file: Path) -> Path:
    """The depth image that a YAML file is beside; where there is none, what it would be called."""
    images = [file.with_suffix(suffix) for suffix in _DEPTH]
    return next((image for image in images if image.is_file()), images[0])


def _entry(image: Path, file: Path | None, options: ReadOptions) -> FrameRef:
    # the file is read here for the time alone; one that is broken fails when its frame is loaded
    try:
        time = _read(file, options).timestamp
    except InputError:
        time = None
    return FrameRef(image.stem, image, partial(_load, image, file, options), time)


def _load(image: Path, file: Path | None, options: ReadOptions) -> FrameData:
    said = _read(file, options)
    folder = (file or image).parent
    pose = None if said.pose is None else check_pose(said.pose, f"{file}: pose")
    files = Files(image, folder / said.color if said.color else None, (folder / said.mask,) if said.mask else ())
    return load_files(files, Sensor(said.camera, said.depth_scale), image.stem, said.timestamp, pose, required=True)


def _read(file: Path | None, options: ReadOptions) -> Beside:
    """What the file says, where the user says nothing else.

    Raises
    ------
    InputError : it is not YAML, or a value is missing or cannot be.
    """
    said = {"camera": options.camera, "depth_scale": options.depth_scale, "color": options.color and options.color.absolute()}
    said = {key: value for key, value in said.items() if value is not None}
    values = {} if file is None else _values(file)
    try:
        return Beside(**{**values, **said})
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise InputError(
            f"{file or '--input-option'}: {key}: {first['msg']}; there are {', '.join(Beside.model_fields)}",
            code=invalid_code([first["type"]]),
        ) from None


def _values(file: Path) -> dict[str, object]:
    try:
        with file.open("rb") as opened:
            values = yaml.safe_load(opened.read(_MOST))
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error})", code="file-unreadable") from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{file}: is not YAML ({str(error).splitlines()[0]})", code="yaml-invalid") from None
    if not isinstance(values, dict) or not all(isinstance(key, str) for key in values):
        raise InputError(f"{file}: expected keys and values, camera: [fx, fy, cx, cy] the least of them", code="yaml-invalid")
    return values
