"""Export MuJoCo models: nested bodies with capsules and ball joints."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from ..types import Detection, Floats
from .base import BodyExport, ChainBodies, colors
from .gravity import gravity_of
from .link_frames import link_frames, relative_rotations
from .mjcf_scene import Scene, around_bodies, scene_of, surroundings
from .overlaps import CONTACT_FREE_RADII, overlapping_bodies
from .trees import Grown, grown
from .xml import escape, tag

MAX_NESTED_BODIES = 400  # MuJoCo's XML reader stops at 500 nested elements; longer chains continue in a second tree
HINGES = "XYZ"  # axes of the hinges in place of a ball joint, from the body before


class Mjcf(BodyExport):
    """Export format MJCF, for MuJoCo 3 and 4: each segment is a body with a capsule, and ball joints connect the bodies.

    The model uses neither plugins nor composite bodies. The origin of a body is at one end of its segment, and the body's z axis
    points to the other end.
    """

    summary: ClassVar[str] = "MuJoCo: capsules with ball joints"
    suffixes: ClassVar[tuple[str, ...]] = (".xml",)

    bending: float = Field(0.0, ge=0, description="bending stiffness E I about the shape at rest, N m²")
    damping: float = Field(5e-5, ge=0, description="damping of bending, N m² s; a joint's is this over the segment length")
    friction: float = Field(0.5, ge=0, description="sliding friction of the capsules")
    fixed: Literal["none", "first", "last", "both"] = Field(
        "none", description="ends held as by a gripper: the first segment, the last, or both"
    )
    ground: bool | None = Field(
        None,
        description="add the plane that the object lies on; without one, a level plane under the lowest chain. Default: add it "
        "unless ends are fixed or gravity is 0",
    )
    upright: bool = Field(
        True,
        description="turn a camera's or a cloud's coordinates so that z is up and the ground at z = 0; false: keep them. A base "
        "frame or world stays as it is",
    )
    contacts: bool = Field(True, description="contacts of chains with themselves and each other")
    gravity: tuple[float, float, float] | None = Field(
        None,
        description="gravity, m/s², in the results' coordinates; default: 9.81 along -z of a base frame, else towards the plane "
        "that the object lies on",
    )
    timestep: float = Field(0.002, gt=0, description="time step, s")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the chains of the frame `frames[0]` as an MJCF model (XML), in m, with a tree of nested bodies per object.

        The chains of a branched object branch off inside the last body of the chain before the junction, at ball joints.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set, or the option `ground` is set and gravity is
            zero.
        """
        path.write_text("\n".join(self._lines(self._scene(frames[:1]))) + "\n", encoding="utf-8")

    def _scene(self, frames: Sequence[Detection]) -> Scene:
        """Return the frames in the coordinates of the model; the first frame gives the direction of gravity."""
        gravity = gravity_of(frames[0]) if self.gravity is None else np.array(self.gravity, dtype=float)
        has_ground = (self.fixed == "none" and bool(gravity.any())) if self.ground is None else self.ground
        return scene_of(frames, gravity, self.radius_of, self.upright, has_ground)

    def _lines(self, scene: Scene) -> Iterator[str]:
        """Yield the lines of the model of the first frame of a scene."""
        tree = self._tree(scene.frames[0])
        detection = tree.detection
        chains = self.bodies_of(detection)
        yield f'<mujoco model="{escape(detection.frame)}">'
        yield '<compiler angle="radian"/>'
        yield tag("option", timestep=self.timestep, gravity=scene.gravity, integrator="implicitfast")
        yield from surroundings(scene.pose)
        yield from self._defaults()
        yield "<worldbody>"
        yield from around_bodies(scene)
        roots = _roots(chains, tree)
        for root in sorted(roots):
            yield from self._bodies(root, chains, tree, roots)
        yield "</worldbody>"
        yield "<contact>"
        for bodies in chains:
            yield from self._contact_exclusions(bodies)
        yield from self._junction_exclusions(chains, tree)
        yield "</contact>"
        yield "<equality>"
        for number, bodies in enumerate(chains):
            is_held = self.fixed == "both" and (not _is_branched(number, tree) or number in tree.trunk_tips)
            yield from self._constraints(bodies, _is_branched(number, tree), is_held)
        yield from self._ties(chains, tree)
        yield "</equality>"
        yield "</mujoco>"

    def _tree(self, detection: Detection) -> Grown:
        return grown(detection, from_last=self.fixed == "last")

    def _ties(self, chains: list[ChainBodies], tree: Grown) -> Iterator[str]:
        """Yield the constraints at junctions for chains whose bodies could not be nested in the chain before."""
        for number in sorted(_roots(chains, tree)):
            parent = tree.parents[number]
            if parent is None:
                continue
            before, chain = chains[parent], chains[number].chain
            anchor = link_frames(before.chain.joints)[-1].T @ (chain.joints[0] - before.chain.joints[-2])
            bodies = {"body1": before.body(len(before.chain.occluded) - 1), "body2": chains[number].body(0)}
            yield tag("connect", name=f"{chains[number].name}_tie0", **bodies, anchor=anchor, **self._stiff())

    def _stiff(self) -> dict[str, tuple[float, ...]]:
        """Return the attributes of the stiffest constraint that the time step allows."""
        return {"solref": (2 * self.timestep, 1), "solimp": (0.99, 0.999, 0.001, 0.5, 2)}

    def _defaults(self) -> Iterator[str]:
        group = 1 if self.contacts else 2  # without contacts chains touch only the ground, which is in both groups
        yield '<default><default class="chain">'
        yield tag("geom", type="capsule", friction=(self.friction, 0.005, 0.0001), contype=group, conaffinity=1)
        yield "</default></default>"

    def _bodies(
        self, number: int, chains: list[ChainBodies], tree: Grown, roots: set[int], base: tuple[Floats, Floats] | None = None
    ) -> Iterator[str]:
        """Yield the bodies of one chain and, inside its last, those of the chains that branch off there.

        Parameters
        ----------
        number
            index of the chain.
        chains
            all chains.
        tree
            the parent of each chain.
        roots
            the chains that begin a tree of bodies.
        base
            position (3,) m and orientation (3, 3) of the body that the chain branches off from; None for a root.
        """
        name, label, chain, mass = chains[number]  # of cylinders: capsules overlap
        length, radius, count = chain.segment_length, self.radius_of(chain), len(chain.occluded)
        # the tree starts at the held end; chains of branched objects are turned already
        is_reversed = self.fixed == "last" and not _is_branched(number, tree)
        joints, segments = (chain.joints[::-1], range(count)[::-1]) if is_reversed else (chain.joints, range(count))
        frames = link_frames(joints)
        relative = np.roll(relative_rotations(frames).as_quat(), 1, axis=1)  # MuJoCo: w first
        shape = {"fromto": (0, 0, 0, 0, 0, length), "size": radius, "mass": mass}
        # the inertia of a thin segment about its own axis is too small for a solver
        joint = {"stiffness": self.bending / length, "damping": self.damping / length, "armature": mass * length**2}
        depth = 0
        for k, segment in enumerate(segments):
            if k == 0 and base is not None:
                at = base[1].T @ (joints[0] - base[0])
                quaternion = np.roll(relative_rotations((base[1].T @ frames[0])[None]).as_quat()[0], 1)
                yield tag("body", False, name=chains[number].body(segment), pos=at, quat=quaternion)
                yield tag("joint", name=f"{name}_joint{segment}", type="ball", **joint)
            elif k % MAX_NESTED_BODIES == 0:
                yield "</body>" * depth
                depth = 0
                quaternion = np.roll(relative_rotations(frames[k : k + 1]).as_quat()[0], 1)
                yield tag("body", False, name=chains[number].body(segment), pos=joints[k], quat=quaternion)
                if k or self.fixed == "none" or tree.parents[number] is not None:
                    yield tag("freejoint", name=f"{name}_free{k}")
            else:
                yield tag("body", False, name=chains[number].body(segment), pos=(0, 0, length), quat=relative[k])
                yield from self._joint(f"{name}_joint{segment + is_reversed}", relative[k], joint)
            rgba = np.round((*np.array(colors(label)[int(chain.occluded[segment])]) / 255, 1), 3)
            yield tag("geom", **{"class": "chain"}, name=f"{name}_capsule{segment}", **shape, rgba=rgba)
            yield tag("site", name=f"{name}_{segment + is_reversed}", size=radius / 2)
            depth += 1
        yield tag("site", name=f"{name}_{0 if is_reversed else count}", pos=(0, 0, length), size=radius / 2)
        for child in tree.children(number):
            if child not in roots:
                yield from self._bodies(child, chains, tree, roots, (joints[count - 1], frames[count - 1]))
        yield "</body>" * depth

    def _joint(self, name: str, quaternion: Floats, attributes: dict[str, float]) -> Iterator[str]:
        """Yield the joint of a body: a ball, at rest as detected, or three hinges, which MuJoCo lets rest at other angles.

        Parameters
        ----------
        name
            name of the joint.
        quaternion
            (4,), w first, of the body in the one before.
        attributes
            stiffness, damping and armature.
        """
        if not self.is_straight(self.bending):
            yield tag("joint", name=name, type="ball", **attributes)
            return
        angles = Rotation.from_quat(np.roll(quaternion, -1)).inv().as_euler(HINGES)
        for letter, axis, angle in zip(HINGES.lower(), np.eye(3), angles, strict=True):
            yield tag("joint", name=f"{name}_{letter}", type="hinge", axis=axis, springref=angle, **attributes)

    def _junction_exclusions(self, chains: list[ChainBodies], tree: Grown) -> Iterator[str]:
        """Yield the contact exclusions of bodies that overlap near junctions."""
        shapes = [bodies.chain for bodies in chains]
        for first, second in overlapping_bodies(shapes, list(map(self.radius_of, shapes)), tree.junctions):
            names = [chains[body.chain].body(body.segment) for body in (first, second)]
            yield tag("exclude", body1=names[0], body2=names[1])

    def _contact_exclusions(self, bodies: ChainBodies) -> Iterator[str]:
        chain, count = bodies.chain, len(bodies.chain.occluded)
        reach = 1 + math.ceil(CONTACT_FREE_RADII * self.radius_of(chain) / chain.segment_length)
        for k in range(count):
            for step in range(1, reach + 1):
                if k + step < count:
                    yield tag("exclude", body1=bodies.body(k), body2=bodies.body(k + step))
                elif chain.closed and step < count - reach:  # across the seam of a ring
                    yield tag("exclude", body1=bodies.body(k), body2=bodies.body((k + step) % count))

    def _constraints(self, bodies: ChainBodies, is_branched: bool, is_held: bool) -> Iterator[str]:
        name, chain = bodies.name, bodies.chain
        last, base, tip = len(chain.occluded) - 1, (0, 0, 0), (0, 0, chain.segment_length)
        stiff = self._stiff()
        is_reversed = self.fixed == "last" and not is_branched
        for k in range(MAX_NESTED_BODIES, last + 1, MAX_NESTED_BODIES):
            above, below = (last + 1 - k, last - k) if is_reversed else (k - 1, k)
            yield tag("connect", name=f"{name}_tie{k}", body1=bodies.body(above), body2=bodies.body(below), anchor=tip, **stiff)
        if chain.closed:
            ends = (0, last) if is_reversed else (last, 0)
            yield tag(
                "connect", name=f"{name}_closed", body1=bodies.body(ends[0]), body2=bodies.body(ends[1]), anchor=tip, **stiff
            )
        elif is_held:  # for a ring, the first segment is enough
            # two points instead of a weld, which is unstable at the end of a light chain
            yield tag("connect", name=f"{name}_hold{last}", body1=bodies.body(last), anchor=base, **stiff)
            yield tag("connect", name=f"{name}_hold{last + 1}", body1=bodies.body(last), anchor=tip, **stiff)


def _roots(chains: Sequence[ChainBodies], tree: Grown) -> set[int]:
    """Return the chains that begin a tree of bodies: the roots of objects, and those that would be nested too deeply."""
    roots: set[int] = set()
    depths: dict[int, int] = {}
    waiting = tree.children(None)
    while waiting:
        number = waiting.pop(0)
        parent, count = tree.parents[number], len(chains[number].chain.occluded)
        if parent is None or depths[parent] + count > MAX_NESTED_BODIES:
            roots.add(number)
            depths[number] = (count - 1) % MAX_NESTED_BODIES + 1
        else:
            depths[number] = depths[parent] + count
        waiting += tree.children(number)
    return roots


def _is_branched(number: int, tree: Grown) -> bool:
    """Return whether a chain is part of a branched object."""
    return tree.parents[number] is not None or bool(tree.children(number))
