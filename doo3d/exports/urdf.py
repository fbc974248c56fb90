"""URDF: cylinders and revolute joints, two or three for a ball joint."""

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
from .base import RadiusExport, colors, labels
from .link_frames import link_frames, relative_rotations
from .xml import escape, tag

AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
LIMITS = (math.pi, math.pi / 2, math.pi)  # rad, about x, y and z: they cover every direction once
TINY_MASS, TINY_INERTIA = 1e-6, 1e-12  # kg, kg m²: of the links between a ball joint's axes; simulators require positive values


class Urdf(RadiusExport):
    """Export format URDF: one robot in which each segment is a link with a cylinder.

    Two neighbouring segments are joined by two or three revolute joints (option `axes`) in place of a ball joint. The root link
    "origin" is at the origin of the detection's coordinates. With all joint angles at 0 the robot has the detected shape.
    """

    summary: ClassVar[str] = "URDF: cylinders, a ball joint is two or three revolute joints"
    suffixes: ClassVar[tuple[str, ...]] = (".urdf",)

    density: float = Field(1100.0, gt=0, description="density of the cylinders, kg/m³")
    damping: float = Field(1e-4, ge=0, description="damping of each revolute joint, N m s/rad")
    axes: Literal[2, 3] = Field(3, description="revolute joints per ball joint: 2 for bending, 3 for bending and twist")
    base: Literal["fixed", "floating"] = Field("fixed", description="joint of the first segment with the root link")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write all chains of the frame `frames[0]` as one robot in XML, in m.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
        """
        path.write_text("\n".join(self._lines(frames[0])) + "\n", encoding="utf-8")

    def _lines(self, detection: Detection) -> Iterator[str]:
        yield '<?xml version="1.0"?>'
        yield f'<robot name="{escape(detection.frame)}">'
        yield tag("link", name="origin")
        for label, chain in zip(labels(detection), detection.chains, strict=True):
            for part, color in zip(("seen", "occluded"), colors(label), strict=True):
                rgba = tag("color", rgba=(*np.round(np.array(color) / 255, 3), 1))
                yield f'<material name="chain{label}_{part}">{rgba}</material>'
            yield from self._chain(f"chain{label}", chain)
        yield "</robot>"

    def _chain(self, name: str, chain: Chain) -> Iterator[str]:
        relative = _roll_pitch_yaw(relative_rotations(link_frames(chain.joints)))
        for k, occluded in enumerate(chain.occluded):
            link, position = f"{name}_segment{k}", (0.0, 0.0, chain.segment_length)
            if k == 0:
                yield _joint(f"{name}_base", self.base, "origin", link, chain.joints[0], relative[0])
            else:
                yield from self._ball(f"{name}_joint{k}", f"{name}_segment{k - 1}", link, np.array(position), relative[k])
            yield from self._link(link, f"{name}_{'occluded' if occluded else 'seen'}", chain)
        yield tag("link", name=f"{name}_end")
        end = np.array((0.0, 0.0, chain.segment_length))
        yield _joint(f"{name}_tip", "fixed", f"{name}_segment{len(chain.occluded) - 1}", f"{name}_end", end, np.zeros(3))

    def _ball(self, name: str, parent: str, child: str, position: Floats, angles: Floats) -> Iterator[str]:
        for i in range(self.axes):
            below = child if i == self.axes - 1 else f"{name}_{'xyz'[i]}"
            elements = tag("axis", xyz=AXES[i]) + tag("limit", lower=-LIMITS[i], upper=LIMITS[i], effort=100, velocity=100)
            elements += tag("dynamics", damping=self.damping)
            yield _joint(f"{name}_r{'xyz'[i]}", "revolute", parent, below, position, angles, elements)
            if below != child:
                moments = dict.fromkeys(("ixx", "iyy", "izz"), TINY_INERTIA) | dict.fromkeys(("ixy", "ixz", "iyz"), 0)
                inertial = tag("mass", value=TINY_MASS) + tag("inertia", **moments)
                yield f'<link name="{below}"><inertial>{inertial}</inertial></link>'
            parent, position, angles = below, np.zeros(3), np.zeros(3)

    def _link(self, name: str, material: str, chain: Chain) -> Iterator[str]:
        radius, length = self.radius_of(chain), chain.segment_length
        mass = self.density * math.pi * radius**2 * length
        transverse, axial = mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2
        center = tag("origin", xyz=(0, 0, length / 2), rpy=(0, 0, 0))
        shape = f"{center}<geometry>{tag('cylinder', radius=radius, length=length)}</geometry>"
        moments = tag("inertia", ixx=transverse, iyy=transverse, izz=axial, ixy=0, ixz=0, iyz=0)
        yield f'<link name="{name}">'
        yield f"<inertial>{center}{tag('mass', value=mass)}{moments}</inertial>"
        yield f"<visual>{shape}{tag('material', name=material)}</visual>"
        yield f"<collision>{shape}</collision></link>"


def _roll_pitch_yaw(rotations: Rotation) -> Floats:
    """Return extrinsic x, y, z Euler angles, (N, 3) rad."""
    with warnings.catch_warnings():  # at a pitch of 90 degrees roll and yaw are not unique: any pair is right
        warnings.filterwarnings("ignore", "Gimbal lock")
        return np.asarray(rotations.as_euler("xyz"))


def _joint(name: str, kind: str, parent: str, child: str, position: Floats, angles: Floats, elements: str = "") -> str:
    ends = tag("parent", link=parent) + tag("child", link=child)
    return f'<joint name="{name}" type="{kind}">{tag("origin", xyz=position, rpy=angles)}{ends}{elements}</joint>'
