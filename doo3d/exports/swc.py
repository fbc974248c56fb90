"""SWC, the format of programs for skeletons and neurons."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from ..types import Detection
from .base import RadiusExport, labels

VISIBLE, OCCLUDED = 0, 5  # types of a point: 0 is "undefined", 5 and above are custom


class Swc(RadiusExport):
    """SWC, the text format of neuron skeletons: one tree per chain, from the first joint (parent -1) to the last.

    A joint at the end of an occluded segment has type 5, all others have type 0.
    """

    summary: ClassVar[str] = "skeleton: n type x y z radius parent"
    suffixes: ClassVar[tuple[str, ...]] = (".swc",)
    supports_2d: ClassVar[bool] = True

    scale: float = Field(1.0, gt=0, description="factor of coordinates and radii; 1e6 gives micrometres, usual for neurons")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write one frame as text, one line "n type x y z radius parent" per joint.

        Coordinates and radii are in m (px in 2-D) times the option `scale`, in full precision; in 2-D, z is 0.
        """
        detection = frames[0]
        unit = "m" if detection.mode == "3d" else "px"
        lines = [f"# doo3d, frame {detection.frame}", f"# unit: {unit} times {self.scale:g}; type {OCCLUDED}: occluded"]
        number = 0
        for label, chain in zip(labels(detection), detection.chains, strict=True):
            lines.append(f"# chain {label}" + ", a ring: its last point is its first" * chain.closed)
            types = [VISIBLE, *(OCCLUDED if occluded else VISIBLE for occluded in chain.occluded)]
            for k, (kind, joint, radius) in enumerate(zip(types, chain.joints, self.radii_of(chain), strict=True)):
                number += 1
                values = [repr(float(value)) for value in (*(joint * self.scale), 0.0)[:3]]
                lines.append(f"{number} {kind} {' '.join(values)} {float(radius * self.scale)!r} {number - 1 if k else -1}")
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
