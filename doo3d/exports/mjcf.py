"""MuJoCo: nested bodies with capsules on ball joints."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..types import Chain, Detection, Floats
from .base import Thick, colors, labels, upright
from .link_frames import link_frames, turns
from .xml import escape, tag

GRAVITY = 9.81  # m/s^2
NESTED = 400  # bodies: MuJoCo's XML reader stops at 500 nested elements; longer chains continue in a second tree
NEAR = 3.0  # radii along the chain: capsules nearer than that touch where it bends, and do not push each other


class Mjcf(Thick):
    """MJCF that MuJoCo 3 and 4 load: no plugin, no composite."""

    what: ClassVar[str] = "MuJoCo: capsules on ball joints"
    suffixes: ClassVar[tuple[str, ...]] = (".xml",)

    density: float = Field(1100.0, gt=0, description="kg/m³, of the cylinders")
    bending: float = Field(0.0, ge=0, description="N m², bending stiffness E I about the shape that was found")
    damping: float = Field(5e-5, ge=0, description="N m² s, of bending: that of a joint is this over the segment length")
    friction: float = Field(0.5, ge=0, description="sliding friction of the capsules")
    fixed: Literal["none", "first", "last", "both"] = Field(
        "none", description="ends held as in a gripper: the first segment, the last, or both"
    )
    ground: bool = Field(False, description="a plane square to gravity, under the lowest chain")
    contacts: bool = Field(True, description="chains touch themselves and each other")
    gravity: tuple[float, float, float] | None = Field(
        None, description="m/s²; by default 9.81 down: -z, or in the coordinates of a camera, held level, +y"
    )
    timestep: float = Field(0.002, gt=0, description="s")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """One model per frame."""
        path.write_text("\n".join(self._lines(frames[0])) + "\n", encoding="utf-8")

    def _lines(self, found: Detection) -> Iterator[str]:
        gravity = np.array(self.gravity or ((0, 0, -GRAVITY) if upright(found) else (0, GRAVITY, 0)), dtype=float)
        named = [(f"chain{label}", chain, label) for label, chain in zip(labels(found), found.chains, strict=True)]
        yield f'<mujoco model="{escape(found.frame)}">'
        yield '<compiler angle="radian"/>'
        yield tag("option", timestep=self.timestep, gravity=gravity, integrator="implicitfast")
        yield from self._defaults()
        yield "<worldbody>"
        if self.ground:
            yield from self._ground(found.chains, gravity)
        for name, chain, label in named:
            yield from self._bodies(name, chain, label)
        yield "</worldbody>"
        yield "<contact>"
        for name, chain, _ in named:
            yield from self._excluded(name, chain)
        yield "</contact>"
        yield "<equality>"
        for name, chain, _ in named:
            yield from self._held(name, chain)
        yield "</equality>"
        yield "</mujoco>"

    def _defaults(self) -> Iterator[str]:
        own = 1 if self.contacts else 2  # without contacts chains touch the ground alone, which is of both groups
        yield '<default><default class="chain">'
        yield tag("geom", type="capsule", friction=(self.friction, 0.005, 0.0001), contype=own, conaffinity=1)
        yield "</default></default>"

    def _ground(self, chains: Sequence[Chain], gravity: Floats) -> Iterator[str]:
        size = np.linalg.norm(gravity)
        if size == 0:
            raise InputError("a ground needs a gravity that is not 0 0 0", code="options-conflict")
        up = -gravity / size
        feet = [float((chain.joints @ up).min()) - self.radius_of(chain) for chain in chains]
        middle = np.mean([chain.joints.mean(axis=0) for chain in chains], axis=0) if chains else np.zeros(3)
        place = middle + (min(feet, default=0.0) - middle @ up) * up
        yield tag("geom", name="ground", type="plane", pos=place, zaxis=up, size=(0, 0, 1), contype=3, conaffinity=3)

    def _bodies(self, name: str, chain: Chain, label: int) -> Iterator[str]:
        length, radius, count = chain.segment_length, self.radius_of(chain), len(chain.occluded)
        back = self.fixed == "last"  # the tree grows from the end that is held
        joints, segments = (chain.joints[::-1], range(count)[::-1]) if back else (chain.joints, range(count))
        frames = link_frames(joints)
        relative = np.roll(turns(frames).as_quat(), 1, axis=1)  # MuJoCo: w first
        mass = self.density * math.pi * radius**2 * length  # the cylinder's: capsules overlap
        shape = {"fromto": (0, 0, 0, 0, 0, length), "size": radius, "mass": mass}
        # the inertia of a thin segment about its own axis is too small for a solver
        joint = {"stiffness": self.bending / length, "damping": self.damping / length, "armature": mass * length**2}
        depth = 0
        for k, segment in enumerate(segments):
            if k % NESTED == 0:
                yield "</body>" * depth
                depth = 0
                turn = np.roll(turns(frames[k : k + 1]).as_quat()[0], 1)
                yield tag("body", False, name=_body(name, segment), pos=joints[k], quat=turn)
                if k or self.fixed == "none":
                    yield tag("freejoint", name=f"{name}_free{k}")
            else:
                yield tag("body", False, name=_body(name, segment), pos=(0, 0, length), quat=relative[k])
                yield tag("joint", name=f"{name}_joint{segment + back}", type="ball", **joint)
            rgba = np.round((*np.array(colors(label)[int(chain.occluded[segment])]) / 255, 1), 3)
            yield tag("geom", **{"class": "chain"}, name=f"{name}_capsule{segment}", **shape, rgba=rgba)
            yield tag("site", name=f"{name}_{segment + back}", size=radius / 2)
            depth += 1
        yield tag("site", name=f"{name}_{0 if back else count}", pos=(0, 0, length), size=radius / 2)
        yield "</body>" * depth

    def _excluded(self, name: str, chain: Chain) -> Iterator[str]:
        count = len(chain.occluded)
        reach = 1 + math.ceil(NEAR * self.radius_of(chain) / chain.segment_length)
        for k in range(count):
            for step in range(1, reach + 1):
                if k + step < count:
                    yield tag("exclude", body1=_body(name, k), body2=_body(name, k + step))
                elif chain.closed and step < count - reach:  # round the seam of a ring
                    yield tag("exclude", body1=_body(name, k), body2=_body(name, (k + step) % count))

    def _held(self, name: str, chain: Chain) -> Iterator[str]:
        last, base, tip = len(chain.occluded) - 1, (0, 0, 0), (0, 0, chain.segment_length)
        firm = {"solref": (2 * self.timestep, 1), "solimp": (0.99, 0.999, 0.001, 0.5, 2)}  # as stiff as the step allows
        back = self.fixed == "last"
        for k in range(NESTED, last + 1, NESTED):
            above, below = (last + 1 - k, last - k) if back else (k - 1, k)
            yield tag("connect", name=f"{name}_tie{k}", body1=_body(name, above), body2=_body(name, below), anchor=tip, **firm)
        if chain.closed:
            ends = (0, last) if back else (last, 0)
            yield tag(
                "connect", name=f"{name}_closed", body1=_body(name, ends[0]), body2=_body(name, ends[1]), anchor=tip, **firm
            )
        elif self.fixed == "both":  # of a ring the first segment is enough
            # two points hold the last segment: a weld is not stable at the end of so light a chain
            yield tag("connect", name=f"{name}_hold{last}", body1=_body(name, last), anchor=base, **firm)
            yield tag("connect", name=f"{name}_hold{last + 1}", body1=_body(name, last), anchor=tip, **firm)


def _body(name: str, segment: int) -> str:
    return f"{name}_segment{segment}"
