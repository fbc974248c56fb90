"""How a capture is to be read, where it does not say so itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..errors import InputError, invalid_code


class ReadOptions(BaseModel):
    """What the user says about a capture. Everything may be left to what the capture says, or to its format's convention."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    color_topic: str | None = Field(None, description="the topic of the colour images in a bag.")
    depth_topic: str | None = Field(None, description="the topic of the depth images in a bag.")
    info_topic: str | None = Field(None, description="the topic of the depth camera's CameraInfo in a bag.")
    cloud_topic: str | None = Field(None, description="the topic of the clouds in a bag; they are read instead of images.")
    tolerance: float = Field(0.03, ge=0, description="s; colour and depth farther apart than this do not belong together.")
    camera: tuple[float, float, float, float] | None = Field(None, description="[fx, fy, cx, cy] px, of the depth images.")
    depth_scale: float | None = Field(None, gt=0, description="units of the depth images per metre, such as 1000 or 5000.")
    color: Path | None = Field(None, description="the colour image that belongs to a single depth image.")
    trajectory: Path | None = Field(
        None, description="a file of camera poses, in TUM's format: lines of time, tx, ty, tz, qx, qy, qz, qw, camera to world."
    )

    @staticmethod
    def from_pairs(pairs: list[str]) -> ReadOptions:
        """From KEY=VALUE pairs, values as YAML.

        Raises
        ------
        InputError : a pair without "=", a key that there is not, a value that cannot be.
        """
        values: dict[str, Any] = {}
        for pair in pairs:
            key, equals, text = pair.partition("=")
            if not equals or not key.strip():
                raise InputError(
                    f"--input-option {pair}: expected key=value, such as depth_topic=/camera/depth or depth_scale=5000",
                    code="override-invalid",
                )
            try:
                values[key.strip()] = yaml.safe_load(text)
            except yaml.YAMLError as error:
                raise InputError(
                    f"--input-option {pair}: the value cannot be read as YAML ({error})", code="yaml-invalid"
                ) from None
        try:
            return ReadOptions(**values)
        except ValidationError as error:
            first = error.errors()[0]
            key = ".".join(map(str, first["loc"]))
            known = f"; there are {', '.join(ReadOptions.model_fields)}" if first["type"] == "extra_forbidden" else ""
            raise InputError(f"--input-option {key}: {first['msg']}{known}", code=invalid_code([first["type"]])) from None


DEFAULT = ReadOptions()
