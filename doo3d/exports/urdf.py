"""Export URDF robots: cylinders and revolute joints, two or three in place of a ball joint."""

import math
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from ..errors import DooWarning, InputError
from ..geometry.polyline import unit
from ..types import Detection, Floats
from .base import BodyExport, ChainBodies, colors
from .joint_limit import PYBULLET_JOINTS, fitting_counts, joint_count
from .link_frames import link_frames, relative_rotations
from .overlaps import Body, overlapping_bodies
from .trees import Grown, grown
from .xml import escape, tag

AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
LIMITS = (math.pi, math.pi / 2, math.pi)  # rad, about x, y and z: they cover every direction once
LINK_SHARE = 1e-3  # of a segment's mass: that of a link without a shape, since simulators require positive values
DAMPING_SECONDS = 0.1  # in which damping halts a segment swinging alone: explicit integrators are stable at steps well below
FREE_ROOT = "origin"
ROOT = "world"  # simulators hold a root link of this name without inertia (PyBullet), or take it for the world (MuJoCo, Drake)


class Urdf(BodyExport):
    """Export format URDF: one robot in which each segment is a link with a cylinder.

    Two neighboring segments are joined by two or three revolute joints (option `axes`) in place of a ball joint. The root link
    "world" is at the origin of the detection's coordinates. With all joint angles at 0 the robot has the shape at rest, as
    detected or straight. URDF has no springs; the angles of the detected shape of straight chains are in a `model_state`.

    URDF cannot exclude contacts between links, so where two links overlap at a junction, one of them has no collision shape.
    """

    summary: ClassVar[str] = "URDF: cylinders, a ball joint is two or three revolute joints"
    suffixes: ClassVar[tuple[str, ...]] = (".urdf",)

    damping: float | None = Field(
        None, ge=0, description="damping of each revolute joint, N m s/rad; default: a segment swinging alone halts within 0.1 s"
    )
    axes: Literal[2, 3] = Field(3, description="revolute joints per ball joint: 2 for bending, 3 for bending and twist")
    base: Literal["fixed", "floating", "free"] = Field(
        "fixed",
        description="first segment: held (fixed), on a floating joint (floating), or moving with the root (free: one chain, for "
        "simulators without floating joints)",
    )

    max_joints: int | None = Field(
        PYBULLET_JOINTS,
        ge=1,
        description="most joints of the robot: fewer segments than detected are written where `segments` is not given; null: no "
        "limit. PyBullet reads 127",
    )

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write all chains of the frame `frames[0]` as one robot in XML, in m.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set, or `base` is "free" and there are several
            objects.
        """
        path.write_text("\n".join(self._lines(frames[0])) + "\n", encoding="utf-8")

    def _lines(self, detection: Detection) -> Iterator[str]:
        tree = grown(detection)
        is_free = self.base == "free" and bool(tree.detection.chains)
        roots = len(tree.children(None))
        if is_free and roots > 1:
            raise InputError(
                f"base=free: frame {detection.frame} has {roots} objects, and a robot has one root: use base=floating",
                code="options-conflict",
            )
        chains = self.bodies_of(tree.detection, self._counts(tree))
        shapeless = self._shapeless(chains, tree)
        yield '<?xml version="1.0"?>'
        yield f'<robot name="{escape(detection.frame)}">'
        root = FREE_ROOT if is_free else ROOT
        yield _bare_link(root, *_shares(chains[0], self.radius_of(chains[0].chain))) if is_free else tag("link", name=root)
        for number, bodies in enumerate(chains):
            for part, color in zip(("seen", "occluded"), colors(bodies.label), strict=True):
                rgba = tag("color", rgba=(*np.round(np.array(color) / 255, 3), 1))
                yield f'<material name="{bodies.name}_{part}">{rgba}</material>'
            parent = tree.parents[number]
            own = {body.segment for body in shapeless if body.chain == number}
            yield from self._chain(bodies, root, None if parent is None else chains[parent], own)
        if self.rest == "straight":
            yield f'<model_state model="{escape(detection.frame)}">'
            yield from (line for bodies in chains for line in self._state(bodies))
            yield "</model_state>"
        yield "</robot>"

    def _counts(self, tree: Grown) -> list[int]:
        """Return the number of segments of each chain, with a note if PyBullet's limit reduces them."""
        detected = [len(chain.occluded) for chain in tree.detection.chains]
        counts = fitting_counts(tree, self.axes, self.max_joints) if self.segments is None else [self.segments] * len(detected)
        joints, before = joint_count(tree, counts, self.axes), joint_count(tree, detected, self.axes)
        frame, is_default = f"frame {tree.detection.frame}", self.max_joints == PYBULLET_JOINTS
        limit = f"PyBullet reads {PYBULLET_JOINTS}" if is_default else f"max_joints is {self.max_joints}"
        if self.segments is None and counts != detected:
            text = (
                f"{frame}: {sum(detected)} segments would make {before} joints, and {limit}: written with {sum(counts)} segments "
                f"and {joints} joints. --segments N sets the number for each chain, --set max_joints=null keeps all"
            )
        elif self.max_joints is not None and joints > self.max_joints:
            text = f"{frame}: {sum(counts)} segments make {joints} joints, and {limit}: give a smaller --segments N"
        else:
            return counts
        warnings.warn(text, DooWarning, stacklevel=2)
        return counts

    def _shapeless(self, chains: Sequence[ChainBodies], tree: Grown) -> set[Body]:
        """Return the links without a collision shape: of two that overlap at a junction, the one farther from the root."""
        order: dict[int | None, int] = {None: -1}
        waiting = tree.children(None)
        while waiting:
            order[waiting[0]] = len(order)
            waiting = [*waiting[1:], *tree.children(waiting[0])]
        shapes = [bodies.chain for bodies in chains]
        pairs = overlapping_bodies(shapes, list(map(self.radius_of, shapes)), tree.junctions)
        shapeless: set[Body] = set()
        for pair in sorted(tuple(sorted(pair, key=lambda body: order[body.chain])) for pair in pairs):
            if not shapeless & set(pair):
                shapeless.add(pair[1])
        return shapeless

    def _chain(self, bodies: ChainBodies, root: str, parent: ChainBodies | None, shapeless: set[int]) -> Iterator[str]:
        """Yield the XML of the links and joints of one chain.

        Parameters
        ----------
        bodies
            the chain.
        root
            name of the root link.
        parent
            the chain at whose end it branches off, None if it begins at the root link.
        shapeless
            the segments without a collision shape.
        """
        name, _, chain, _ = bodies
        frames = self._frames(chain.joints)
        relative = _roll_pitch_yaw(relative_rotations(frames))
        if self.rest == "straight":
            relative[1:] = 0.0
        end, last = np.array((0.0, 0.0, chain.segment_length)), len(chain.occluded) - 1
        shares = _shares(bodies, self.radius_of(chain))
        for k, occluded in enumerate(chain.occluded):
            link = f"{name}_segment{k}"
            if k == 0 and parent is not None:
                frame, before = self._frames(parent.chain.joints)[-1], len(parent.chain.occluded) - 1
                at = frame.T @ (chain.joints[0] - parent.chain.joints[-2])
                turn = _roll_pitch_yaw(relative_rotations((frame.T @ frames[0])[None]))[0]
                yield from self._ball(f"{name}_joint0", f"{parent.name}_segment{before}", link, at, turn, bodies)
            elif k == 0:
                kind = "floating" if self.base == "floating" else "fixed"
                yield _joint(f"{name}_base", kind, root, link, chain.joints[0], relative[0])
            else:
                yield from self._ball(f"{name}_joint{k}", f"{name}_segment{k - 1}", link, end, relative[k], bodies)
            bare = (
                (self.axes - 1) * (k > 0 or parent is not None) + (k == last) + (k == 0 and parent is None and root == FREE_ROOT)
            )
            yield from self._link(
                link,
                f"{name}_{'occluded' if occluded else 'seen'}",
                bodies,
                bodies.mass * (1 - LINK_SHARE * bare),
                k not in shapeless,
            )
        yield _bare_link(f"{name}_end", *shares)
        yield _joint(f"{name}_tip", "fixed", f"{name}_segment{last}", f"{name}_end", end, np.zeros(3))

    def _frames(self, joints: Floats) -> Floats:
        """Return the orientation of each segment as detected, (N, 3, 3): turned from the segment before it by its joints."""
        frames = link_frames(joints)
        if self.rest == "straight":
            for k, (about_x, about_y) in enumerate(_angles(joints), 1):
                frames[k] = frames[k - 1] @ Rotation.from_euler("XY", (about_x, about_y)).as_matrix()
        return frames

    def _state(self, bodies: ChainBodies) -> Iterator[str]:
        """Yield the positions of the joints of a chain in the detected shape, rad, where they are not 0."""
        for k, angles in enumerate(_angles(bodies.chain.joints), 1):
            for letter, angle in zip("xy", angles, strict=True):
                yield tag("joint_state", joint=f"{bodies.name}_joint{k}_r{letter}", position=angle)

    def _ball(self, name: str, parent: str, child: str, position: Floats, angles: Floats, bodies: ChainBodies) -> Iterator[str]:
        """Yield the revolute joints of a ball joint and the links between them.

        Parameters
        ----------
        name
            name of the ball joint.
        parent, child
            links that it joins.
        position, angles
            pose of the child in the parent in the detected shape: (3,) m, and (3,) rad (roll, pitch, yaw).
        bodies
            the chain.
        """
        radius, length = self.radius_of(bodies.chain), bodies.chain.segment_length
        inertia = bodies.mass * (radius**2 / 4 + length**2 / 3)  # of a segment about its end
        damping = inertia / DAMPING_SECONDS if self.damping is None else self.damping
        for i in range(self.axes):
            below = child if i == self.axes - 1 else f"{name}_{'xyz'[i]}"
            elements = tag("axis", xyz=AXES[i]) + tag("limit", lower=-LIMITS[i], upper=LIMITS[i], effort=100, velocity=100)
            elements += tag("dynamics", damping=damping)
            yield _joint(f"{name}_r{'xyz'[i]}", "revolute", parent, below, position, angles, elements)
            if below != child:
                yield _bare_link(below, *_shares(bodies, radius))
            parent, position, angles = below, np.zeros(3), np.zeros(3)

    def _link(self, name: str, material: str, bodies: ChainBodies, mass: float, collides: bool) -> Iterator[str]:
        radius, length = self.radius_of(bodies.chain), bodies.chain.segment_length
        transverse, axial = mass * (3 * radius**2 + length**2) / 12, mass * (3 * radius**2 + length**2) / 12
        center = tag("origin", xyz=(0, 0, length / 2), rpy=(0, 0, 0))
        shape = f"{center}<geometry>{tag('cylinder', radius=radius, length=length)}</geometry>"
        yield f'<link name="{name}">'
        yield f"<inertial>{center}{tag('mass', value=mass)}{_inertia(transverse, axial)}</inertial>"
        yield f"<visual>{shape}{tag('material', name=material)}</visual>"
        yield f"<collision>{shape}</collision></link>" if collides else "</link>"


def _angles(joints: Floats) -> Floats:
    """Return the turns about x, then y, of each segment from the one before it, (N - 1, 2) rad, for joints (N + 1, 3)."""
    frame, angles = link_frames(joints)[0], []
    for direction in unit(np.diff(joints, axis=0))[1:]:
        x, y, z = frame.T @ direction
        angles.append((math.atan2(-y, z), math.asin(min(max(x, -1.0), 1.0))))
        frame = frame @ Rotation.from_euler("XY", angles[-1]).as_matrix()
    return np.array(angles).reshape(-1, 2)


def _shares(bodies: ChainBodies, radius: float) -> tuple[float, float]:
    """Return mass (kg) and moment of inertia (kg m²) of a link without a shape, taken from the segment next to it."""
    return LINK_SHARE * bodies.mass, bodies.mass * (3 * radius**2 + bodies.chain.segment_length**2) / 12


def _bare_link(name: str, mass: float, moment: float) -> str:
    return f'<link name="{name}"><inertial>{tag("mass", value=mass)}{_inertia(moment, moment)}</inertial></link>'


def _inertia(transverse: float, axial: float) -> str:
    return tag("inertia", ixx=transverse, iyy=transverse, izz=axial, ixy=0, ixz=0, iyz=0)


def _roll_pitch_yaw(rotations: Rotation) -> Floats:
    """Return extrinsic x, y, z Euler angles, (N, 3) rad."""
    with warnings.catch_warnings():  # at a pitch of 90 degrees roll and yaw are not unique: any pair is right
        warnings.filterwarnings("ignore", "Gimbal lock")
        return np.asarray(rotations.as_euler("xyz"))


def _joint(name: str, kind: str, parent: str, child: str, position: Floats, angles: Floats, elements: str = "") -> str:
    ends = tag("parent", link=parent) + tag("child", link=child)
    return f'<joint name="{name}" type="{kind}">{tag("origin", xyz=position, rpy=angles)}{ends}{elements}</joint>'
