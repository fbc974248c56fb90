"""The base classes of all exports, and their shared names, colors and times of chains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..errors import InputError
from ..types import Chain, Detection, Floats
from ..viz.palette import Rgb, chain_color


class Export(BaseModel):
    """A format, with its options as fields.

    summary : one line for lists. suffixes : of its files, the default first; empty for a folder. file_per : content of one file.
    supports_2d : 2-D results can be exported.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    summary: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    file_per: ClassVar[Literal["capture", "frame", "chain"]] = "frame"
    supports_2d: ClassVar[bool] = False

    @property
    def suffix(self) -> str:
        """The suffix of files in a folder."""
        return self.suffixes[0]

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write a new file.

        Parameters
        ----------
        frames
            all frames of a capture in order, or a single frame, or a single frame with a single chain, as `file_per` says.
        path
            the new file.

        Raises
        ------
        InputError : the chains lack a value that the format needs. MissingDependency : a library is not installed.
        """
        raise NotImplementedError


class RadiusExport(Export):
    """A format that needs the radius of the chains."""

    radius: float | None = Field(None, gt=0, description="radius of all chains, m (px in 2-D); default: each chain's own")

    def radius_of(self, chain: Chain) -> float:
        """Return the radius of a chain in m (px in 2-D).

        Raises
        ------
        InputError : the radius is unknown.
        """
        radius = chain.radius if self.radius is None else self.radius
        if not math.isfinite(radius) or radius <= 0:
            raise InputError(
                "the radius of a chain is unknown, and this format needs it: set the option radius, in m",
                code="radius-missing",
            )
        return radius

    def radii_of(self, chain: Chain) -> Floats:
        """Return the radius at each joint, (N + 1,) m (px in 2-D); the chain's where it is unknown."""
        default = self.radius_of(chain)
        if self.radius is not None:
            return np.full(len(chain.joints), default)
        is_measured = np.isfinite(chain.radii) & (chain.radii > 0)
        return np.asarray(np.where(is_measured, chain.radii, default))


def labels(detection: Detection) -> list[int]:
    """Return the numbers of the chains: their ids if all have different ones, else 0, 1, 2, ..."""
    ids = [chain.id for chain in detection.chains if chain.id is not None]
    return ids if len(set(ids)) == len(detection.chains) else list(range(len(detection.chains)))


def colors(label: int) -> tuple[Rgb, Rgb]:
    """Return the RGB colors, 0 to 255, of a chain's visible segments and, paler, of its occluded ones."""
    visible = chain_color(label)
    red, green, blue = ((2 * part + 3 * 255) // 5 for part in visible)
    return visible, (red, green, blue)


def times(frames: Sequence[Detection], rate: float) -> list[float]:
    """Return the time of each frame in s: its timestamp, or, if one has none, `rate` frames per second from 0."""
    stamps = [frame.timestamp for frame in frames if frame.timestamp is not None]
    return stamps if len(stamps) == len(frames) else [i / rate for i in range(len(frames))]


def is_z_up(detection: Detection) -> bool:
    """Return whether the z axis points up: in all coordinates but a (level) camera's, whose y axis points down."""
    return detection.coordinates != "camera"
