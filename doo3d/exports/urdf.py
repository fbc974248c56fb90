"""URDF: cylinders on revolute joints, three to a ball joint."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from ..types import Chain, Detection, Floats
from .base import Thick, colors, labels
from .link_frames import link_frames, turns
from .xml import escape, tag

AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
LIMITS = (math.pi, math.pi / 2, math.pi)  # rad: about x, y and z in turn; every direction once
TINY_MASS, TINY_INERTIA = 1e-6, 1e-12  # kg, kg m²: of the links between a ball joint's axes, which simulators want above zero


class Urdf(Thick):
    """One robot per frame, whose root link is the origin of the coordinates. All joints at 0 is the shape that was found."""

    what: ClassVar[str] = "URDF: cylinders, a ball joint is two or three revolutes"
    suffixes: ClassVar[tuple[str, ...]] = (".urdf",)

    density: float = Field(1100.0, gt=0, description="kg/m³, of the cylinders")
    damping: float = Field(1e-4, ge=0, description="N m s/rad, of each revolute")
    axes: Literal[2, 3] = Field(3, description="revolutes to a ball joint: bending alone, or twist as well")
    base: Literal["fixed", "floating"] = Field("fixed", description="how the first segment hangs on the root link")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """One robot per frame."""
        path.write_text("\n".join(self._lines(frames[0])) + "\n", encoding="utf-8")

    def _lines(self, found: Detection) -> Iterator[str]:
        yield '<?xml version="1.0"?>'
        yield f'<robot name="{escape(found.frame)}">'
        yield tag("link", name="origin")
        for label, chain in zip(labels(found), found.chains, strict=True):
            for part, color in zip(("seen", "occluded"), colors(label), strict=True):
                rgba = tag("color", rgba=(*np.round(np.array(color) / 255, 3), 1))
                yield f'<material name="chain{label}_{part}">{rgba}</material>'
            yield from self._chain(f"chain{label}", chain)
        yield "</robot>"

    def _chain(self, name: str, chain: Chain) -> Iterator[str]:
        relative = _roll_pitch_yaw(turns(link_frames(chain.joints)))
        for k, hidden in enumerate(chain.occluded):
            link, place = f"{name}_segment{k}", (0.0, 0.0, chain.segment_length)
            if k == 0:
                yield _joint(f"{name}_base", self.base, "origin", link, chain.joints[0], relative[0])
            else:
                yield from self._ball(f"{name}_joint{k}", f"{name}_segment{k - 1}", link, np.array(place), relative[k])
            yield from self._link(link, f"{name}_{'occluded' if hidden else 'seen'}", chain)
        yield tag("link", name=f"{name}_end")
        end = np.array((0.0, 0.0, chain.segment_length))
        yield _joint(f"{name}_tip", "fixed", f"{name}_segment{len(chain.occluded) - 1}", f"{name}_end", end, np.zeros(3))

    def _ball(self, name: str, parent: str, child: str, place: Floats, turn: Floats) -> Iterator[str]:
        for i in range(self.axes):
            below = child if i == self.axes - 1 else f"{name}_{'xyz'[i]}"
            inside = tag("axis", xyz=AXES[i]) + tag("limit", lower=-LIMITS[i], upper=LIMITS[i], effort=100, velocity=100)
            inside += tag("dynamics", damping=self.damping)
            yield _joint(f"{name}_r{'xyz'[i]}", "revolute", parent, below, place, turn, inside)
            if below != child:
                moments = dict.fromkeys(("ixx", "iyy", "izz"), TINY_INERTIA) | dict.fromkeys(("ixy", "ixz", "iyz"), 0)
                inertial = tag("mass", value=TINY_MASS) + tag("inertia", **moments)
                yield f'<link name="{below}"><inertial>{inertial}</inertial></link>'
            parent, place, turn = below, np.zeros(3), np.zeros(3)

    def _link(self, name: str, material: str, chain: Chain) -> Iterator[str]:
        radius, length = self.radius_of(chain), chain.segment_length
        mass = self.density * math.pi * radius**2 * length
        across, along = mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2
        middle = tag("origin", xyz=(0, 0, length / 2), rpy=(0, 0, 0))
        shape = f"{middle}<geometry>{tag('cylinder', radius=radius, length=length)}</geometry>"
        moments = tag("inertia", ixx=across, iyy=across, izz=along, ixy=0, ixz=0, iyz=0)
        yield f'<link name="{name}">'
        yield f"<inertial>{middle}{tag('mass', value=mass)}{moments}</inertial>"
        yield f"<visual>{shape}{tag('material', name=material)}</visual>"
        yield f"<collision>{shape}</collision></link>"


def _roll_pitch_yaw(rotations: Rotation) -> Floats:
    """(N, 3) rad, about the fixed axes x, y, z in turn."""
    with warnings.catch_warnings():  # where the pitch is a right angle roll and yaw are not unique: any pair will do
        warnings.filterwarnings("ignore", "Gimbal lock")
        return np.asarray(rotations.as_euler("xyz"))


def _joint(name: str, kind: str, parent: str, child: str, place: Floats, turn: Floats, inside: str = "") -> str:
    ends = tag("parent", link=parent) + tag("child", link=child)
    return f'<joint name="{name}" type="{kind}">{tag("origin", xyz=place, rpy=turn)}{ends}{inside}</joint>'
