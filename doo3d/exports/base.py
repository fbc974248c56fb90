"""Define the base classes of all export formats, and their common chain numbers, colors, times and up axis."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..errors import InputError
from ..types import Chain, Detection, Floats
from ..viz.palette import Rgb, chain_color, chain_numbers
from .resampling import resampled

labels = chain_numbers
"""Function that returns the number of each chain in exported files, such as 0 in "chain0"."""


class Export(BaseModel):
    """The base class of export formats: each subclass is one format, and its pydantic fields are the options a user can set.

    Attributes
    ----------
    summary
        one line that describes the format in lists.
    suffixes
        the file suffixes that the format accepts, such as (".usda", ".usdc"); the first is the default. Empty if the format
        writes a folder.
    file_per
        the content of one file: "capture" (all frames), "frame" (one frame) or "chain" (one chain of one frame).
    supports_2d
        whether 2-D results, in pixels, can be exported too.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    summary: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    file_per: ClassVar[Literal["capture", "frame", "chain"]] = "frame"
    supports_2d: ClassVar[bool] = False

    @property
    def suffix(self) -> str:
        """The suffix, such as ".ply", of files that are written into a folder under names chosen by doo3d."""
        return self.suffixes[0]

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write one file (or one folder) of this format.

        Parameters
        ----------
        frames
            the detections that the file holds. If `file_per` is "capture", all frames in order; if "frame", a single detection;
            if "chain", a single detection with one chain, or without chains if the frame has none.
        path
            the file to write; it must not exist yet, its folder must.

        Raises
        ------
        InputError
            the chains lack a value that the format needs, such as the radius.
        MissingDependency
            a library that the format needs is not installed.
        """
        raise NotImplementedError


class RadiusExport(Export):
    """The base class of export formats that need the radius of the chains; the option `radius` replaces the detected radius."""

    radius: float | None = Field(None, gt=0, description="radius of all chains, m (px in 2-D); default: each chain's own")

    def radius_of(self, chain: Chain) -> float:
        """Return the radius of a whole chain, m (px in 2-D): the option `radius` if it is set, otherwise the detected radius.

        Raises
        ------
        InputError
            the option is not set and the radius of the chain is unknown (NaN) or not positive.
        """
        radius = chain.radius if self.radius is None else self.radius
        if not math.isfinite(radius) or radius <= 0:
            raise InputError(
                "the radius of a chain is unknown, and this format needs it: set the option radius, in m", code="radius-missing"
            )
        return radius

    def radii_of(self, chain: Chain) -> Floats:
        """Return the radius at each of the N + 1 joints of a chain, (N + 1,) m (px in 2-D).

        If the option `radius` is set, it applies to all joints. Otherwise each joint has its own measured radius, or the radius
        of the whole chain if none was measured there.

        Raises
        ------
        InputError
            the option is not set and the radius of the whole chain is unknown (NaN) or not positive.
        """
        default = self.radius_of(chain)
        if self.radius is not None:
            return np.full(len(chain.joints), default)
        is_measured = np.isfinite(chain.radii) & (chain.radii > 0)
        return np.asarray(np.where(is_measured, chain.radii, default))


class ChainBodies(NamedTuple):
    """A chain as rigid bodies, one per segment.

    Attributes
    ----------
    name
        name of the chain, such as "chain0"; the first part of the names of its bodies and joints.
    label
        number of the chain.
    chain
        the chain, resampled to the number of segments in the option `segments`.
    mass
        mass of each segment, kg; the total is that of the detected chain, whatever the number of segments.
    """

    name: str
    label: int
    chain: Chain
    mass: float

    def body(self, segment: int) -> str:
        """Return the name of the body of a segment, such as "chain0_segment3"."""
        return f"{self.name}_segment{segment}"


class BodyExport(RadiusExport):
    """The base class of export formats for simulators, in which each segment is a rigid body."""

    density: float = Field(1100.0, gt=0, description="density of the cylinders, kg/m³")
    segments: int | None = Field(None, ge=1, description="number of segments of each chain; default: as detected")
    rest: Literal["detected", "straight"] = Field(
        "detected", description="shape in which nothing pulls the chain back: as detected, or straight; it starts as detected"
    )

    def bodies_of(self, detection: Detection, counts: Sequence[int] | None = None) -> list[ChainBodies]:
        """Return the chains of a detection as rigid bodies.

        counts : number of segments of each chain; None for the option `segments`, or else the detected number.

        Raises
        ------
        InputError : the radius of a chain is unknown and the option `radius` is not set, or a ring would have too few segments.
        """
        bodies = []
        if counts is None:
            counts = [self.segments or len(chain.occluded) for chain in detection.chains]
        for label, detected, count in zip(labels(detection), detection.chains, counts, strict=True):
            chain = resampled(detected, count)
            mass = self.density * math.pi * self.radius_of(detected) ** 2 * detected.length / len(chain.occluded)
            bodies.append(ChainBodies(f"chain{label}", label, chain, mass))
        return bodies

    def is_straight(self, bending: float) -> bool:
        """Return whether springs pull the chains to a straight shape.

        bending : stiffness of the springs, E I in N m².

        Raises
        ------
        InputError : the option `rest` asks for it, and the springs have no stiffness.
        """
        if self.rest == "straight" and bending == 0:
            raise InputError("rest=straight needs a stiffness: set bending, E I in N m²", code="options-conflict")
        return self.rest == "straight"


def colors(label: int) -> tuple[Rgb, Rgb]:
    """Return the colors of the visible and of the occluded segments of chain number `label`.

    Each color is (red, green, blue), 0 to 255. The first is the chain's color in all pictures of doo3d, the second is paler.
    """
    visible = chain_color(label)
    red, green, blue = ((2 * part + 3 * 255) // 5 for part in visible)
    return visible, (red, green, blue)


def times(frames: Sequence[Detection], rate: float) -> list[float]:
    """Return the time of each frame, s.

    The times are the frames' timestamps. If any frame has no timestamp, the times are 0, 1 / rate, 2 / rate, ... instead, with
    `rate` in frames per second.
    """
    stamps = [frame.timestamp for frame in frames if frame.timestamp is not None]
    return stamps if len(stamps) == len(frames) else [i / rate for i in range(len(frames))]


def is_z_up(detection: Detection) -> bool:
    """Return whether the z axis of the detection's coordinates is assumed to point up.

    False for a camera's coordinates (x right, y down, z forward), where up is -y if the camera is level. True for the coordinates
    of a world or of a cloud.
    """
    return detection.coordinates != "camera"
