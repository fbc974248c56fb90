"""What all exports have in common."""

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

    what : in a few words. suffixes : of its files, the usual one first; none: it is a folder. each : what one file holds.
    flat : 2-D results too.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    what: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    each: ClassVar[Literal["capture", "frame", "chain"]] = "frame"
    flat: ClassVar[bool] = False

    @property
    def suffix(self) -> str:
        """Of the files in a folder."""
        return self.suffixes[0]

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the frames of a capture in order, or one frame, or one frame with one of its chains, to `path`, a new file.

        Raises
        ------
        InputError : something that the format needs is not in the chains. MissingDependency : its library is not installed.
        """
        raise NotImplementedError


class Thick(Export):
    """A format that needs the chains' radius."""

    radius: float | None = Field(None, gt=0, description="m (px in 2-D), of all chains; by default each chain's own")

    def radius_of(self, chain: Chain) -> float:
        """m (px in 2-D).

        Raises
        ------
        InputError : it is not known.
        """
        found = chain.radius if self.radius is None else self.radius
        if not math.isfinite(found) or found <= 0:
            raise InputError(
                "the radius of a chain is not known, and this format needs it: give the option radius, in m",
                code="radius-missing",
            )
        return found

    def radii_of(self, chain: Chain) -> Floats:
        """(N + 1,) m (px in 2-D), at each joint; that of the chain where it is not known."""
        whole = self.radius_of(chain)
        if self.radius is not None:
            return np.full(len(chain.joints), whole)
        known = np.isfinite(chain.radii) & (chain.radii > 0)
        return np.asarray(np.where(known, chain.radii, whole))


def labels(detection: Detection) -> list[int]:
    """The numbers that the chains go by: their ids, or where not all have one of their own, 0, 1, 2."""
    ids = [chain.id for chain in detection.chains if chain.id is not None]
    return ids if len(set(ids)) == len(detection.chains) else list(range(len(detection.chains)))


def colors(label: int) -> tuple[Rgb, Rgb]:
    """RGB, 0 to 255: of a chain where it was seen, and paler, where it is occluded."""
    seen = chain_color(label)
    red, green, blue = ((2 * part + 3 * 255) // 5 for part in seen)
    return seen, (red, green, blue)


def times(frames: Sequence[Detection], rate: float) -> list[float]:
    """s, of each frame: the capture's stamps, or where not all frames have one, `rate` frames per second from 0."""
    stamps = [frame.timestamp for frame in frames if frame.timestamp is not None]
    return stamps if len(stamps) == len(frames) else [i / rate for i in range(len(frames))]


def upright(detection: Detection) -> bool:
    """The z axis points up: all coordinates but a camera's, whose y axis points down (if the camera is held level)."""
    return detection.coordinates != "camera"
