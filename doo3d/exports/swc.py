"""SWC: what programs for skeletons and neurons read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from ..types import Detection
from .base import Thick, labels

SEEN, OCCLUDED = 0, 5  # the type of a point: 0 is "undefined", those from 5 on are for the user's own


class Swc(Thick):
    """A tree per chain, from its first joint to its last; the type of a joint is that of the segment which ends there."""

    what: ClassVar[str] = "skeleton: n type x y z radius parent"
    suffixes: ClassVar[tuple[str, ...]] = (".swc",)
    flat: ClassVar[bool] = True

    scale: float = Field(1.0, gt=0, description="times coordinates and radii; 1e6 gives micrometres, as neurons are in")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Numbers in full; in 2-D z is 0."""
        found = frames[0]
        unit = "m" if found.mode == "3d" else "px"
        lines = [f"# doo3d, frame {found.frame}", f"# unit: {unit} times {self.scale:g}; type {OCCLUDED}: occluded"]
        number = 0
        for label, chain in zip(labels(found), found.chains, strict=True):
            lines.append(f"# chain {label}" + ", a ring: its last point is its first" * chain.closed)
            kinds = [SEEN, *(OCCLUDED if hidden else SEEN for hidden in chain.occluded)]
            for k, (kind, at, radius) in enumerate(zip(kinds, chain.joints, self.radii_of(chain), strict=True)):
                number += 1
                values = [repr(float(value)) for value in (*(at * self.scale), 0.0)[:3]]
                lines.append(f"{number} {kind} {' '.join(values)} {float(radius * self.scale)!r} {number - 1 if k else -1}")
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
