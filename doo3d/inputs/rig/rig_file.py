"""Read the file that describes a rig: its cameras, the folders of their images, and their calibration."""

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from ...errors import InputError, invalid_value
from ...guard.guarding import prefixed
from ...guard.parsing import read_json, read_yaml
from ...types import Camera, Floats
from ...types.display import counted
from ..bag.undistortion import Lens
from ..support.images import Size
from ..support.pose_file import read_pose
from .calibration_files import read_stereo_pair
from .stereo_pair import StereoPair

_Positive = Annotated[FiniteFloat, Field(gt=0)]
_OURS = {"cameras", "calibration"}  # keys of which a rig file has at least one, and no calibration file


class RigCamera(BaseModel):
    """The description of one camera in a rig file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(description="Name of the camera, such as left; unique in the rig.", min_length=1)
    images: Path | None = Field(None, description="Folder of its images without depth, in INPUT. Default: INPUT itself.")
    side_by_side: Literal["left", "right"] | None = Field(
        None, description="The half of each image that is this camera's, if one image holds both. Default: all of it."
    )
    masks: Path | None = Field(None, description="Folder of its masks, in INPUT. Default: mask/ or masks/, or beside the images.")
    capture: Path | None = Field(None, description="Its capture with depth, in INPUT: a folder, a bag, clouds.")
    camera: Path | None = Field(None, description="File with the intrinsics of its depth images, beside the rig file.")
    depth_scale: _Positive | None = Field(None, description="Units of its depth images per metre.")
    pose: tuple[tuple[float, ...], ...] | None = Field(
        None, description="Camera to rig, m: x,y,z,qx,qy,qz,qw, a 4x4 matrix, or a file beside the rig file."
    )
    intrinsics: tuple[_Positive, _Positive, FiniteFloat, FiniteFloat] | None = Field(
        None, description="[fx, fy, cx, cy] of its images. px."
    )
    distortion: tuple[FiniteFloat, ...] = Field((), description="Its lens: k1, k2, p1, p2, k3, ... as in OpenCV. Default: none.")
    distortion_model: str = Field("plumb_bob", description="plumb_bob, rational_polynomial or equidistant (OpenCV's fisheye).")
    size: tuple[int, int] | None = Field(None, description="[width, height] that the intrinsics are for. px.")


class RigFile(BaseModel):
    """The content of a rig file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    cameras: tuple[RigCamera, ...] = Field((), description="The cameras. Default: a pair, left and right.")
    calibration: tuple[Path, ...] = Field(
        (), description="Calibration of a stereo pair, beside the rig file: one file of ZED or OpenCV, or two of OpenCV or ROS."
    )
    unit: Literal["m", "mm"] | None = Field(None, description="Unit of the translation in `calibration`: OpenCV's has none.")
    rectified: bool = Field(False, description="Whether the images are rectified already.")


def read_rig_file(path: Path) -> RigFile:
    """Read a rig file, or a calibration file of a stereo pair as a rig of its two cameras; paths become absolute.

    Raises
    ------
    InputError : the file cannot be read, a key is unknown or missing, or a value is impossible.
    """
    if path.suffix.lower() not in (".yaml", ".yml", ".json"):
        return RigFile(calibration=(path.absolute(),))
    try:
        values = read_json(path) if path.suffix.lower() == ".json" else read_yaml(path)
    except InputError as error:
        if error.code not in ("yaml-invalid", "json-invalid") or b"opencv-matrix" not in path.read_bytes():
            raise
        values = None  # OpenCV's YAML is none
    if not isinstance(values, dict) or not _OURS & values.keys():
        return RigFile(calibration=(path.absolute(),))
    try:
        rig = RigFile(**_resolved(values, path.absolute()))
    except ValidationError as error:
        model = RigCamera if error.errors()[0]["loc"][0] == "cameras" else RigFile
        raise invalid_value(error, f"{path}: ", model.model_fields) from None
    except TypeError:
        raise InputError(f"{path}: its keys have to be names, such as cameras", code="rig-invalid") from None
    _check(rig, path)
    return rig


def _resolved(values: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the content of a rig file with its pose files read and its paths made absolute."""
    values, root = dict(values), path.parent
    given = values.get("calibration")
    given = [given] if isinstance(given, str) else given
    if isinstance(given, list):
        values["calibration"] = [root / each if isinstance(each, str) else each for each in given]
    cameras = values.get("cameras")
    if isinstance(cameras, list):
        values["cameras"] = [_resolved_camera(camera, path) if isinstance(camera, dict) else camera for camera in cameras]
    return values


def _resolved_camera(values: dict[str, Any], path: Path) -> dict[str, Any]:
    values, pose, root = dict(values), values.get("pose"), path.parent
    if isinstance(values.get("camera"), str):
        values["camera"] = root / values["camera"]
    if pose is not None:
        is_file = isinstance(pose, str) and (root / pose).is_file()
        with prefixed(f"{path}: the camera {values.get('name')}"):
            values["pose"] = tuple(map(tuple, read_pose(root / pose if is_file else pose).tolist()))
    return values


def _check(rig: RigFile, path: Path) -> None:
    names = [camera.name for camera in rig.cameras]

    def refused(sentence: str) -> InputError:
        return InputError(f"{path}: {sentence}", code="rig-invalid")

    if len(set(names)) < len(names):
        raise refused(f"two cameras have the same name: {', '.join(names)}")
    if is_depth_rig(rig):
        for camera in rig.cameras:
            if camera.capture is None or camera.pose is None:
                missing = "capture" if camera.capture is None else "pose"
                raise refused(f"the camera {camera.name} has no `{missing}`: cameras with depth need capture and pose each")
        if rig.calibration:
            raise refused("`calibration` is for a stereo pair, whose cameras have `images`; these have `capture`")
        return
    if len(names) not in (0, 2) or (not names and not rig.calibration):
        has = counted(len(names), "camera")
        raise refused(f"it has {has}, expected two with `images`, left and right, or any number with `capture`")
    if rig.calibration:
        return
    for camera in rig.cameras:
        for key in ("intrinsics", "pose"):
            if getattr(camera, key) is None:
                raise refused(f"the camera {camera.name} has no `{key}`, and there is no `calibration` of the pair")


def is_depth_rig(rig: RigFile) -> bool:
    """Return whether the cameras of a rig are depth cameras, which have captures of their own."""
    return any(camera.capture is not None for camera in rig.cameras)


def stereo_pair_of(rig: RigFile, size: Size | None, path: Path) -> StereoPair:
    """Return the calibration of the two cameras of a rig.

    Parameters
    ----------
    rig
        the content of the rig file.
    size
        (width, height) px of one camera's images.
    path
        the rig file, named in errors.

    Raises
    ------
    InputError : a calibration cannot be read or used, or is for images of another size.
    """
    if rig.calibration:
        return read_stereo_pair(rig.calibration, size, rig.unit, rig.rectified)
    lenses, poses = [], list[Floats]()
    for camera in rig.cameras:
        given = camera.size or size
        if camera.intrinsics is None or given is None or (size is not None and given != size):
            shown = "unknown" if size is None else f"{size[0]}x{size[1]}"
            sizes = f"the camera {camera.name} is calibrated for {camera.size}, but the size of its images is {shown}"
            raise InputError(f"{path}: {sizes}", code="intrinsics-size")
        lenses.append(Lens(Camera(*camera.intrinsics, *given), camera.distortion_model, camera.distortion))
        poses.append(np.array(camera.pose))
    motion = np.linalg.inv(poses[1]) @ poses[0]
    return StereoPair(lenses[0], lenses[1], tuple(motion[:3, :3].ravel().tolist()), tuple(motion[:3, 3].tolist()), str(path))
