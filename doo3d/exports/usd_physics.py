"""Export USD scenes for simulators: rigid bodies with capsules and D6 joints of UsdPhysics."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from ..geometry.polyline import TINY
from ..types import Detection, Floats
from .base import BodyExport, ChainBodies, colors, is_z_up
from .gravity import gravity_of, ground_of
from .link_frames import link_frames
from .overlaps import overlapping_bodies
from .trees import grown
from .usd import new_stage

AXES = ("rotX", "rotY", "rotZ")
LOCKED = ("transX", "transY", "transZ")


class UsdPhysics(BodyExport):
    """Export format OpenUSD with physics: one scene per frame, in which each segment is a rigid body with a capsule.

    The origin of a body is at the middle of its segment, and its z axis points along the segment. Neighboring bodies are joined
    by a D6 joint: translations are locked, bending is limited, and drives give bending stiffness and damping. At a junction, such
    joints connect the last body before it to the first body of each chain after it.
    """

    summary: ClassVar[str] = "OpenUSD with UsdPhysics: capsules with D6 joints"
    suffixes: ClassVar[tuple[str, ...]] = (".usda", ".usdc", ".usd")

    bending: float = Field(0.0, ge=0, description="bending stiffness E I about the shape at rest, N m²")
    damping: float = Field(5e-5, ge=0, description="damping of bending, N m² s; a joint's is this over the segment length")
    limit: float = Field(
        90.0, gt=0, le=180, description="largest turn of a joint about each axis from the shape at rest, degrees"
    )
    fixed: bool = Field(False, description="hold the first segment, as by a gripper")
    ground: bool = Field(
        False, description="add the plane that the object lies on; without one, a level plane under the lowest chain"
    )

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the chains of the frame `frames[0]` as a scene, in m and kg; the suffix of `path` chooses text or binary.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
        MissingDependency
            OpenUSD (usd-core) is not installed.
        """
        detection = frames[0]
        pxr, stage = new_stage(path, [detection], "UsdPhysics")
        turn = np.eye(3) if is_z_up(detection) else np.diag((1.0, -1.0, -1.0))
        tree = grown(detection)
        gravity, chains = gravity_of(detection), self.bodies_of(tree.detection)
        begin_physics(pxr, stage, turn @ gravity)
        if self.ground:
            at, up = ground_of(detection, gravity, [(bodies.chain, self.radius_of(bodies.chain)) for bodies in chains])
            define_ground(pxr, stage, at, up)
        shapes = [bodies.chain for bodies in chains]
        apart: dict[str, list[str]] = {}
        for pair in overlapping_bodies(shapes, list(map(self.radius_of, shapes)), tree.junctions):
            first, second = (_path(chains[body.chain], body.segment) for body in pair)
            apart.setdefault(first, []).append(second)
        for bodies, parent in zip(chains, tree.parents, strict=True):
            self._chain(pxr, stage, bodies, apart, is_held=self.fixed and parent is None)
        for bodies, parent in zip(chains, tree.parents, strict=True):
            if parent is not None:
                self._branch_off(pxr, stage, bodies, chains[parent])
        stage.GetRootLayer().Save()

    def _chain(self, pxr: dict[str, Any], stage: Any, bodies: ChainBodies, apart: dict[str, list[str]], is_held: bool) -> None:
        """Define the bodies and the joints of one chain, and the pairs of bodies without collision.

        Parameters
        ----------
        pxr, stage
            modules of OpenUSD, and the stage.
        bodies
            the chain.
        apart
            path of a body -> paths of bodies of other chains that it does not collide with.
        is_held
            whether the first segment is fixed in space.
        """
        geometry, physics, chain = pxr["UsdGeom"], pxr["UsdPhysics"], bodies.chain
        radius, length, count = self.radius_of(chain), chain.segment_length, len(chain.occluded)
        rotations = Rotation.from_matrix(link_frames(chain.joints))
        centers = (chain.joints[1:] + chain.joints[:-1]) / 2
        geometry.Xform.Define(stage, f"/doo3d/{bodies.name}")
        paths = [_path(bodies, k) for k in range(count)]
        for k, path in enumerate(paths):
            body = geometry.Xform.Define(stage, path)
            place(pxr, body, centers[k], rotations[k])
            physics.RigidBodyAPI.Apply(body.GetPrim())
            physics.MassAPI.Apply(body.GetPrim()).CreateMassAttr(bodies.mass)
            capsule = geometry.Capsule.Define(stage, f"{path}/capsule")
            capsule.CreateAxisAttr(geometry.Tokens.z)
            capsule.CreateRadiusAttr(radius)
            capsule.CreateHeightAttr(length)
            half = float(length / 2 + radius)
            capsule.CreateExtentAttr([(-radius, -radius, -half), (radius, radius, half)])
            color = colors(bodies.label)[int(chain.occluded[k])]
            capsule.CreateDisplayColorAttr([pxr["Gf"].Vec3f(*(part / 255 for part in color))])
            physics.CollisionAPI.Apply(capsule.GetPrim())
            reach = 1 + int(np.ceil(3 * radius / length))  # closer capsules touch at every bend
            near = [other for n, other in enumerate(paths) if 0 < (n - k) % (count if chain.closed else 2 * count) <= reach]
            physics.FilteredPairsAPI.Apply(body.GetPrim()).CreateFilteredPairsRel().SetTargets([*near, *apart.get(path, [])])
        pairs = [(k, k + 1) for k in range(count - 1)] + ([(count - 1, 0)] if chain.closed and count > 2 else [])
        for first, second in pairs:
            self._joint(
                pxr,
                stage,
                f"/doo3d/{bodies.name}/joint{first + 1}",
                (paths[first], paths[second]),
                (np.array((0, 0, length / 2)), length),
                self._turn_at_rest(rotations[first].inv() * rotations[second]),
            )
        if is_held:
            held = physics.FixedJoint.Define(stage, f"/doo3d/{bodies.name}/held")
            held.CreateBody0Rel().SetTargets(["/doo3d"])
            held.CreateBody1Rel().SetTargets([paths[0]])
            held.CreateLocalPos0Attr(pxr["Gf"].Vec3f(*centers[0].tolist()))
            held.CreateLocalRot0Attr(_quaternion(pxr, rotations[0]))

    def _branch_off(self, pxr: dict[str, Any], stage: Any, bodies: ChainBodies, parent: ChainBodies) -> None:
        """Define the joint from the last body of a chain before a junction to the first body of a chain after it."""
        chain, before = bodies.chain, parent.chain
        rotations = Rotation.from_matrix(np.stack((link_frames(before.joints)[-1], link_frames(chain.joints)[0])))
        place = rotations[0].inv().apply(chain.joints[0] - (before.joints[-1] + before.joints[-2]) / 2)
        pair = _path(parent, len(before.occluded) - 1), _path(bodies, 0)
        turn = rotations[0].inv() * rotations[1]
        self._joint(pxr, stage, f"/doo3d/{bodies.name}/joint0", pair, (place, chain.segment_length), turn)

    def _turn_at_rest(self, turn: Rotation) -> Rotation:
        """Return the turn of a joint at rest: as detected or, if straight, its twist alone, which only the seam of a ring has."""
        if not self.is_straight(self.bending):
            return turn
        return Rotation.from_quat(turn.as_quat(canonical=True) * (0, 0, 1, 1) + (0, 0, 0, TINY))

    def _joint(
        self, pxr: dict[str, Any], stage: Any, path: str, bodies: tuple[str, str], at: tuple[Floats, float], turn: Rotation
    ) -> None:
        """Define a D6 joint between the end of one body and the beginning of another.

        Parameters
        ----------
        pxr, stage
            modules of OpenUSD, and the stage.
        path
            path of the joint in the stage.
        bodies
            paths of the two bodies.
        at
            (3,) m, position of the joint in the first body; and the length of a segment of the second body, m.
        turn
            rotation of the second body in the first at which the joint is at rest.
        """
        physics, vector = pxr["UsdPhysics"], pxr["Gf"].Vec3f
        joint = physics.Joint.Define(stage, path)
        joint.CreateBody0Rel().SetTargets([bodies[0]])
        joint.CreateBody1Rel().SetTargets([bodies[1]])
        place, length = at
        joint.CreateLocalPos0Attr(vector(*place.tolist()))
        joint.CreateLocalRot0Attr(_quaternion(pxr, turn))
        joint.CreateLocalPos1Attr(vector(0, 0, -length / 2))
        joint.CreateLocalRot1Attr(_quaternion(pxr, Rotation.identity()))
        for name in (*LOCKED, *AXES):
            limit = physics.LimitAPI.Apply(joint.GetPrim(), name)
            low, high = (1.0, -1.0) if name in LOCKED else (-self.limit, self.limit)  # low above high: locked
            limit.CreateLowAttr(low)
            limit.CreateHighAttr(high)
        per_degree = np.pi / 180  # UsdPhysics counts turns in degrees
        for name in AXES:
            drive = physics.DriveAPI.Apply(joint.GetPrim(), name)
            drive.CreateTypeAttr(physics.Tokens.force)
            drive.CreateStiffnessAttr(float(self.bending / length * per_degree))
            drive.CreateDampingAttr(float(self.damping / length * per_degree))


def _path(bodies: ChainBodies, segment: int) -> str:
    return f"/doo3d/{bodies.name}/segment{segment}"


def begin_physics(pxr: dict[str, Any], stage: Any, gravity: Floats) -> None:
    """Set the unit of mass of a stage, kg, and define its scene of UsdPhysics with a gravity.

    pxr : modules of OpenUSD. stage : the stage. gravity : (3,) m/s², in the world of the stage.
    """
    physics, magnitude = pxr["UsdPhysics"], float(np.linalg.norm(gravity))
    physics.SetStageKilogramsPerUnit(stage, 1.0)
    scene = physics.Scene.Define(stage, "/doo3d/physics")
    scene.CreateGravityDirectionAttr(pxr["Gf"].Vec3f(*(gravity / magnitude).tolist()))
    scene.CreateGravityMagnitudeAttr(magnitude)


def define_ground(pxr: dict[str, Any], stage: Any, at: Floats, normal: Floats) -> Any:
    """Return the prim of a new ground plane with which bodies collide.

    pxr : modules of OpenUSD. stage : the stage. at : (3,) m, a point of the plane. normal : (3,).
    """
    plane = pxr["UsdGeom"].Plane.Define(stage, "/doo3d/ground")
    plane.CreateAxisAttr(pxr["UsdGeom"].Tokens.z)
    place(pxr, plane, at, Rotation.align_vectors([normal], [(0.0, 0.0, 1.0)])[0])
    pxr["UsdPhysics"].CollisionAPI.Apply(plane.GetPrim())
    return plane.GetPrim()


def place(pxr: dict[str, Any], prim: Any, position: Floats, rotation: Rotation) -> None:
    """Set the pose of a new prim of UsdGeom.

    Parameters
    ----------
    pxr
        modules of OpenUSD.
    prim
        the prim.
    position
        (3,) m.
    rotation
        the orientation.
    """
    prim.AddTranslateOp().Set(pxr["Gf"].Vec3d(*np.asarray(position).tolist()))
    prim.AddOrientOp().Set(_quaternion(pxr, rotation))


def _quaternion(pxr: dict[str, Any], rotation: Rotation) -> Any:
    x, y, z, w = rotation.as_quat().tolist()
    return pxr["Gf"].Quatf(w, x, y, z)
