"""List depth images with their camera in a YAML file beside each or in the options, and with optional color images."""

import re
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from ...errors import InputError, invalid_value
from ...guard.guarding import guarded, read_head
from ...guard.parsing import parse_yaml
from ..read_options import ReadOptions, without_color
from ..support.depth_frames import check_pose
from ..support.images import is_image
from ..support.known_cameras import KnownCamera
from ..support.listing import natural_key
from .image_folder import DEFAULT_DEPTH_SCALE, Files, Sensor

_YAML_SUFFIXES = (".yaml", ".yml")
_DEPTH_SUFFIXES = (".png", ".tif", ".tiff", ".exr")
_CAMERA_KEY = re.compile(rb"^(?:\{\s*)?[\"']?camera[\"']?\s*:", re.MULTILINE)
_MAX_YAML_BYTES = 1 << 16  # read at most; a longer file does not describe a camera
_Focal = Annotated[FiniteFloat, Field(gt=0)]


class DepthImageInfo(BaseModel):
    """Content of the YAML file that describes a depth image.

    Attributes
    ----------
    camera
        the intrinsics (fx, fy, cx, cy) in px.
    depth_scale
        units of the depth image per metre.
    color, mask
        paths of the color and of the mask image, relative to the YAML file; None if there is no such image.
    pose
        camera to world as the four rows of a (4, 4) matrix, x_world = pose @ x_camera, m; None if unknown.
    timestamp
        time of the frame, s; None if unknown.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    camera: tuple[_Focal, _Focal, FiniteFloat, FiniteFloat]
    depth_scale: Annotated[FiniteFloat, Field(gt=0)] = DEFAULT_DEPTH_SCALE
    color: Path | None = None
    mask: Path | None = None
    pose: tuple[tuple[FiniteFloat, ...], ...] | None = None
    timestamp: FiniteFloat | None = None


def can_read_pair(path: Path) -> bool:
    """Return whether `path` is a pair of a depth image and a YAML file, or a folder with such pairs.

    `path` may be either file of a pair. The two files have the same name except for the suffix, and the YAML file has the
    key `camera`.
    """
    if path.is_dir():
        return bool(_yaml_files(path))
    if path.suffix.lower() in _YAML_SUFFIXES:
        return path.is_file() and _has_camera(path) and _image_of(path).is_file()
    file = _yaml_of(path)
    return file is not None and _has_camera(file) and is_image(path)


def list_pairs(path: Path, options: ReadOptions, notes: list[str]) -> list[Files]:
    """Return the frames of a depth image, its YAML file, or a folder with such pairs.

    The options `camera`, `depth_scale` and (for a single image) `color` replace the file's values. If the options give the
    camera, the YAML file of a single image may be missing. A damaged YAML file fails when its frame is loaded.
    """
    if not path.is_dir():
        is_yaml = path.suffix.lower() in _YAML_SUFFIXES
        return [_files(_image_of(path) if is_yaml else path, path if is_yaml else _yaml_of(path), options)]
    yaml_files = _yaml_files(path)
    if options.color is not None and not without_color(options) and len(yaml_files) > 1:
        sentence = f"is one image, but {path} holds several depth images: name the color images in their YAML files"
        raise InputError(f"--input-option color={options.color}: {sentence}", code="frame-count")
    return [_files(_image_of(file), file, options) for file in yaml_files]


def _yaml_files(folder: Path) -> list[Path]:
    """Return the YAML files of a folder that have a camera and an image of their name beside them."""
    files = [file for file in folder.iterdir() if file.suffix.lower() in _YAML_SUFFIXES and not file.name.startswith(".")]
    return sorted(
        (file for file in files if _has_camera(file) and _image_of(file).is_file()), key=lambda file: natural_key(file.name)
    )


def _has_camera(file: Path) -> bool:
    return _CAMERA_KEY.search(read_head(file, _MAX_YAML_BYTES)) is not None


def _yaml_of(image: Path) -> Path | None:
    return next((file for suffix in _YAML_SUFFIXES if (file := image.with_suffix(suffix)).is_file()), None)


def _image_of(file: Path) -> Path:
    """Return the depth image beside a YAML file; if there is none, the path expected for it."""
    images = [file.with_suffix(suffix) for suffix in _DEPTH_SUFFIXES]
    return next((image for image in images if image.is_file()), images[0])


def _files(image: Path, file: Path | None, options: ReadOptions) -> Files:
    def described(files: Files) -> Files:
        info, folder = _read_info(file, options), (file or image).parent
        return files._replace(
            color=folder / info.color if info.color else None,
            masks=(folder / info.mask,) if info.mask else (),
            time=info.timestamp,
            pose=None if info.pose is None else check_pose(info.pose, f"{file}: pose"),
            sensor=Sensor(KnownCamera(info.camera), info.depth_scale, options.depth_scale),
        )

    return Files(image.stem, image, source=file).completed(described)


def _read_info(file: Path | None, options: ReadOptions) -> DepthImageInfo:
    """Return the content of the YAML file, overridden by the options.

    Raises
    ------
    InputError : the file is not YAML, or a value is missing, of the wrong type or out of bounds.
    """
    values: dict[str, object] = {}
    if file is not None:
        with guarded(file):
            values = parse_yaml(read_head(file, _MAX_YAML_BYTES), str(file))
        if not isinstance(values, dict) or not all(isinstance(key, str) for key in values):
            sentence = f"{file}: expected keys and values, with at least camera: [fx, fy, cx, cy]"
            raise InputError(sentence, code="yaml-invalid")
    given = {"camera": options.camera, "depth_scale": options.depth_scale, "color": options.color and options.color.absolute()}
    values |= {key: value for key, value in given.items() if value is not None}
    values |= {"color": None} if without_color(options) else {}
    try:
        return DepthImageInfo.model_validate(values)
    except ValidationError as error:
        raise invalid_value(error, f"{file or '--input-option'}: ", DepthImageInfo.model_fields) from None
