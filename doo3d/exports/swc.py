"""Export SWC, the text format of programs for skeletons and neurons."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from ..types import Detection
from .base import RadiusExport, labels
from .trees import grown

VISIBLE, OCCLUDED = 0, 5  # types of a point: 0 is "undefined", 5 and above are custom


class Swc(RadiusExport):
    """Export format SWC, the text format of neuron skeletons: each object is a tree, one line per joint.

    The parent of a joint is the joint before it. A chain that branches off has the last joint of the chain before the junction
    as the parent of its first joint; the first joint of each object has -1. A joint has type 5 if the segment between it
    and its parent is occluded, otherwise type 0.
    """

    summary: ClassVar[str] = "skeleton: n type x y z radius parent"
    suffixes: ClassVar[tuple[str, ...]] = (".swc",)
    supports_2d: ClassVar[bool] = True

    scale: float = Field(1.0, gt=0, description="factor of coordinates and radii; 1e6 gives micrometres, usual for neurons")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the chains of the frame `frames[0]` as text, with a line "n type x y z radius parent" per joint.

        `n` numbers the joints of the file from 1. Coordinates and radii are in m (px in 2-D) times the option `scale`, in full
        precision; in 2-D, z is 0.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
        """
        detection = frames[0]
        unit = "m" if detection.mode == "3d" else "px"
        lines = [f"# doo3d, frame {detection.frame}", f"# unit: {unit} times {self.scale:g}; type {OCCLUDED}: occluded"]
        number, tree, names = 0, grown(detection), labels(detection)
        last: dict[int | None, int] = {None: -1}
        waiting = tree.children(None)
        while waiting:
            index = waiting.pop(0)
            label, chain, parent = names[index], tree.detection.chains[index], last[tree.parents[index]]
            lines.append(f"# chain {label}" + ", a ring: its last point is its first" * chain.closed)
            types = [VISIBLE, *(OCCLUDED if occluded else VISIBLE for occluded in chain.occluded)]
            for k, (kind, joint, radius) in enumerate(zip(types, chain.joints, self.radii_of(chain), strict=True)):
                number += 1
                values = [repr(float(value)) for value in (*(joint * self.scale), 0.0)[:3]]
                lines.append(f"{number} {kind} {' '.join(values)} {float(radius * self.scale)!r} {number - 1 if k else parent}")
            last[index] = number
            waiting = [*tree.children(index), *waiting]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
