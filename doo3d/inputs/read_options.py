"""Define the options for reading a capture in which values are missing or wrong."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from ..errors import InputError, invalid_value
from ..guard.parsing import parse_yaml
from .support.pose_file import CAPTURE, TF, read_pose

NONE = "none"
"""Value of the options `color`, `color_topic` and `depth_topic` that turns reading off."""


class ReadOptions(BaseModel):
    """Values for reading a capture in which they are missing or wrong.

    A value given here is used instead of the capture's. None keeps the capture's value or, if it has none, the default of its
    format.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, **options: Any) -> None:
        try:
            super().__init__(**options)
        except ValidationError as error:
            raise invalid_value(error, "ReadOptions ", type(self).model_fields) from None

    color_topic: str | None = Field(None, description="Topic of the color images in a bag; none: read no color.")
    depth_topic: str | None = Field(None, description="Topic of the depth images in a bag; none: read no depth.")
    info_topic: str | None = Field(None, description="Topic of the depth camera's CameraInfo in a bag.")
    cloud_topic: str | None = Field(None, description="Topic of the clouds in a bag; they are read instead of images.")
    tolerance: float = Field(0.03, ge=0, description="Largest difference in time of color and depth of one frame. s.")
    camera: tuple[float, float, float, float] | None = Field(
        None, description="Intrinsics of the depth images: [fx, fy, cx, cy]. px."
    )
    camera_file: Path | None = Field(
        None, description="File with the intrinsics of the depth images: JSON, YAML or RealSense's text. `camera` replaces it."
    )
    cameras: Path | None = Field(
        None, description="File of a rig of several cameras, or the calibration of a stereo pair; see `doo3d.open_rig`."
    )
    depth_scale: float | None = Field(None, gt=0, description="Units of the depth images per metre, such as 1000 or 5000.")
    classification: tuple[int, ...] | None = Field(
        None,
        description="Classes of the points to read from a LAS or LAZ file, such as 14, or [13, 14] for wires (read by default).",
    )
    color: Path | None = Field(
        None, description="Color image that belongs to a single depth image; none: read no color, in any format with depth."
    )
    trajectory: Path | None = Field(
        None, description="File of camera poses in TUM's format: lines of time, tx, ty, tz, qx, qy, qz, qw, camera to world."
    )
    pose: str | tuple[tuple[float, ...], ...] | None = Field(
        None,
        description="Pose of the camera in a robot's base frame, which the results are then in: a file, x,y,z,qx,qy,qz,qw, "
        "capture (the capture's own poses), or tf:FRAME (a frame of a bag).",
    )

    @field_validator("classification", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return (value,) if isinstance(value, int) else value

    @field_validator("pose", mode="before")
    @classmethod
    def _read_pose(cls, value: Any) -> Any:
        """Read the numbers of a pose, so that they are stored instead of a file name."""
        if value is None or (isinstance(value, str) and (value == CAPTURE or value.startswith(TF))):
            return value
        return tuple(map(tuple, read_pose(value).tolist()))

    @staticmethod
    def from_pairs(pairs: list[str] | None, camera_file: Path | None = None, cameras: Path | None = None) -> ReadOptions:
        """Return the options written as a list of `key=value`, such as "depth_scale=5000".

        The keys are the fields of this class; each value is parsed as YAML. `camera_file`, a file or the text "fx,fy,cx,cy", and
        `cameras` replace the pairs of these names.

        Raises
        ------
        InputError : a pair without "=", an unknown key, or a value of the wrong type or out of bounds.
        """
        values: dict[str, Any] = {}
        for pair in pairs or []:
            key, equals, text = pair.partition("=")
            if not equals or not key.strip():
                sentence = "expected key=value, such as depth_topic=/camera/depth or depth_scale=5000"
                raise InputError(f"--input-option {pair}: {sentence}", code="override-invalid")
            values[key.strip()] = parse_yaml(text, f"--input-option {' '.join(pair[:80].split())}")
        values |= {} if camera_file is None else intrinsics_of(camera_file)
        values |= {} if cameras is None else {"cameras": cameras.absolute()}
        return ReadOptions.of(values, "--input-option")

    @staticmethod
    def of(values: Mapping[str, Any], source: str) -> ReadOptions:
        """Return the options given as field -> value; source : origin of the values, named in errors.

        Raises
        ------
        InputError : an unknown key, or a value of the wrong type or out of bounds.
        """
        try:
            return ReadOptions(**{str(key): value for key, value in values.items()})
        except InputError as error:
            raise InputError(str(error).replace("ReadOptions", source, 1), code=error.code) from None


def intrinsics_of(camera: str | Path) -> dict[str, Any]:
    """Return the field of ReadOptions for a camera: `camera` for a text such as "922,922,640,360", else `camera_file`."""
    numbers = str(camera).split(",")
    try:
        return {"camera": tuple(map(float, numbers))} if len(numbers) == 4 else {"camera_file": Path(camera).absolute()}
    except ValueError:
        return {"camera_file": Path(camera).absolute()}


DEFAULT = ReadOptions()

OF_CAMERA = frozenset({"camera", "camera_file"})
"""Options that give the intrinsics."""

OF_DEPTH = OF_CAMERA | {"depth_scale", "color=none"}
"""Options of formats of depth images."""


def without_color(options: ReadOptions) -> bool:
    """Return whether the options turn off the reading of color."""
    return options.color is not None and str(options.color) == NONE


def check_used(options: ReadOptions, used: Collection[str], where: str) -> None:
    """Check that a reader supports all options that are set.

    Parameters
    ----------
    options
        the options, as the user gave them.
    used
        names of the options that the reader supports; "name=value" for an option of which only one value is supported.
    where
        the capture and its format, named in the error.

    Raises
    ------
    InputError : an option is set that is not supported.
    """
    for name in ReadOptions.model_fields:
        value = getattr(options, name)
        if value == getattr(DEFAULT, name) or name in used or f"{name}={value}" in used:
            continue
        if name == "tolerance" and options.trajectory is not None:
            continue
        shown = {"camera_file": "--camera", "cameras": "--cameras"}.get(name, f"--input-option {name}")
        those = f"; the options for it are {', '.join(sorted(used))}" if used else ""
        raise InputError(f"{shown}: has no meaning for {where}{those}: leave it out", code="option-unused")
