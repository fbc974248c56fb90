"""Export USD scenes for simulators with deformable curves: one cable per chain, for Newton and Isaac Lab."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from ..types import Detection, Floats
from .base import BodyExport, ChainBodies, colors
from .gravity import gravity_of
from .link_frames import link_frames
from .mjcf_scene import Scene, scene_of
from .overlaps import CONTACT_FREE_RADII, Body, overlapping_bodies
from .trees import Grown, grown
from .usd import new_stage, sphere_arrays
from .usd_physics import begin_physics, define_ground

MIN_SEGMENTS = 2  # of a cable: a curve of fewer than three points does not bend, and Newton skips it
SHEAR_CORRECTION = 0.9  # k of k G A for a solid circle, in OpenUSD's proposal of deformable bodies and in Newton
MATERIAL = "/doo3d/material"


class Cable(NamedTuple):
    """A chain as a cable of a simulator.

    Attributes
    ----------
    bodies
        the chain, with its number and its name.
    joints
        (N + 1, 3) m, in the scene; ends at a junction are moved to it. Rings: (N, 3), without the last, equal to the first.
    rest
        (N + 1, 3) m, the joints in the shape at rest, with the same distances. Rings: (N, 3).
    frames, rest_frames
        (N, 3, 3), the orientation of each segment without twist, as detected and at rest.
    """

    bodies: ChainBodies
    joints: Floats
    rest: Floats
    frames: Floats
    rest_frames: Floats


class UsdCable(BodyExport):
    """Export format OpenUSD with deformable curves: one scene per frame, in which each chain is a cable.

    A cable is a linear UsdGeom.BasisCurves with PhysicsCurvesDeformableSimAPI, whose points are the joints of the chain. The
    scene has z up, as in `mjcf`. Where chains meet, PhysicsAttachment prims join their ends at the position of the junction.
    """

    summary: ClassVar[str] = "OpenUSD deformable curves: cables for Newton and Isaac Lab"
    suffixes: ClassVar[tuple[str, ...]] = (".usda", ".usdc", ".usd")

    youngs: float = Field(1e6, gt=0, description="Young's modulus E, Pa")  # the default of OpenUSD's proposal
    poisson: float = Field(0.3, gt=-1, lt=0.5, description="Poisson's ratio")  # likewise
    stretching: float | None = Field(None, ge=0, description="stretching stiffness E A, N; default: from youngs and radius")
    shearing: float | None = Field(None, ge=0, description="shearing stiffness k G A, N; default: from youngs, poisson, radius")
    bending: float | None = Field(None, ge=0, description="bending stiffness E I, N m²; default: from youngs and radius")
    twisting: float | None = Field(None, ge=0, description="twisting stiffness G J, N m²; default: from youngs, poisson, radius")
    damping: float = Field(5e-5, ge=0, description="damping of bending and of twisting, N m² s")
    friction: float = Field(0.5, ge=0, description="friction of the cables and of the ground")
    ground: bool = Field(
        True, description="add the plane that the object lies on; without one, a level plane under the lowest chain"
    )

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the chains of the frame `frames[0]` as a scene, in m and kg, z up; the suffix of `path` chooses text or binary.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
        MissingDependency
            OpenUSD (usd-core) is not installed.
        """
        scene = self.scene(frames[0])
        pxr, stage = new_stage(path, scene.frames, "UsdPhysics", "UsdShade", "Sdf", "Vt")
        if scene.pose is not None:
            stage.GetRootLayer().customLayerData = {"doo3d:pose": pxr["Gf"].Matrix4d(scene.pose.T.tolist())}
        begin_physics(pxr, stage, scene.gravity)
        self._material(pxr, stage)
        if scene.ground is not None:
            _bind(pxr, stage, define_ground(pxr, stage, *scene.ground))
        tree = grown(scene.frames[0])
        cables = self.cables(scene.frames[0], tree)
        for cable in cables:
            self._curve(pxr, stage, cable)
        _attachments(pxr, stage, cables, tree)
        pairs: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for first, second in self.apart(cables, tree):
            pairs.setdefault((first.chain, second.chain), []).append((first.segment, second.segment))
        for (one, other), segments in pairs.items():
            _filter(pxr, stage, (cables[one].bodies.name, cables[other].bodies.name), segments)
        stage.GetRootLayer().Save()

    def scene(self, detection: Detection) -> Scene:
        """Return a detection with z up, under it the ground, (3,) m and its normal (3,), unless the option `ground` is false."""
        return scene_of([detection], gravity_of(detection), lambda chain: float(self.radii_of(chain).max()), True, self.ground)

    def stiffnesses(self, radius: float) -> dict[str, float]:
        """Return E A and k G A, N, and E I and G J, N m², of a solid circle of a radius in m, unless an option sets them."""
        area, shear = math.pi * radius**2, self.youngs / (2 * (1 + self.poisson))
        material = {
            "stretching": self.youngs * area,
            "shearing": SHEAR_CORRECTION * shear * area,
            "bending": self.youngs * area * radius**2 / 4,
            "twisting": shear * area * radius**2 / 2,
        }
        return {name: value if getattr(self, name) is None else getattr(self, name) for name, value in material.items()}

    def cables(self, detection: Detection, tree: Grown) -> list[Cable]:
        """Return the chains as cables, ends at a junction moved to its position, with their shape at rest.

        detection : with z up. tree : its chains, directed away from the roots.
        """
        counts = [max(self.segments or len(chain.occluded), MIN_SEGMENTS) for chain in tree.detection.chains]
        chains = self.bodies_of(tree.detection, counts)
        joints = [bodies.chain.joints.copy() for bodies in chains]
        for junction, ends in zip(detection.junctions, tree.junctions, strict=True):
            for each in ends:
                joints[each.chain][-each.end] = junction.position
        frames = [link_frames(each) for each in joints]
        straight: dict[int, Floats] = {}
        waiting = tree.children(None)
        while waiting:  # the angle between chains at a junction is at rest as it was detected
            number = waiting.pop(0)
            parent = tree.parents[number]
            base = frames[number][0] if parent is None else straight[parent] @ frames[parent][-1].T @ frames[number][0]
            straight[number] = base
            waiting += tree.children(number)
        cables = []
        for number, (bodies, own, turned) in enumerate(zip(chains, joints, frames, strict=True)):
            rest, rest_frames = own, turned
            if self.rest == "straight":
                rest = _polygon(own) if bodies.chain.closed else _line(own, straight[number])
                rest_frames = link_frames(rest) if bodies.chain.closed else np.tile(straight[number], (len(turned), 1, 1))
            end = len(own) - bodies.chain.closed  # a periodic curve closes itself
            cables.append(Cable(bodies, own[:end], rest[:end], turned, rest_frames))
        return cables

    def apart(self, cables: Sequence[Cable], tree: Grown) -> Iterable[tuple[Body, Body]]:
        """Yield the pairs of segments that overlap along a chain or near a junction, and so must not collide.

        cables : the cables. tree : the junctions where they meet.
        """
        shapes = [cable.bodies.chain for cable in cables]
        for number, chain in enumerate(shapes):
            count = len(chain.occluded)
            reach = 1 + math.ceil(CONTACT_FREE_RADII * self.radius_of(chain) / chain.segment_length)
            for k in range(count):
                for step in range(1, reach + 1):
                    if k + step < count or (chain.closed and step < count - reach):  # also across the seam of a ring
                        yield Body(number, k), Body(number, (k + step) % count)
        yield from overlapping_bodies(shapes, list(map(self.radius_of, shapes)), tree.junctions)

    def _material(self, pxr: dict[str, Any], stage: Any) -> None:
        """Define the one material of all cables, since Newton gives welded cables one, and of the ground."""
        material = pxr["UsdShade"].Material.Define(stage, MATERIAL).GetPrim()
        physics = pxr["UsdPhysics"].MaterialAPI.Apply(material)
        physics.CreateStaticFrictionAttr(self.friction)
        physics.CreateDynamicFrictionAttr(self.friction)
        physics.CreateDensityAttr(self.density)
        for name in ("PhysicsCurvesDeformableMaterialAPI", "NewtonCurvesDeformableMaterialAPI"):
            material.AddAppliedSchema(name)
        values = {"physics:youngsModulus": self.youngs, "physics:poissonsRatio": self.poisson}
        names = {"Stretch": self.stretching, "Shear": self.shearing, "Bend": self.bending, "Twist": self.twisting}
        values |= {f"physics:curves{name}Stiffness": value for name, value in names.items() if value is not None}
        values |= {f"newton:curves{name}Damping": self.damping for name in ("Bend", "Twist")}
        for name, value in values.items():
            material.CreateAttribute(name, pxr["Sdf"].ValueTypeNames.Float).Set(value)

    def _curve(self, pxr: dict[str, Any], stage: Any, cable: Cable) -> None:
        """Define the curve of a cable, with its thickness at each point and its shape at rest."""
        geometry, vt, types = pxr["UsdGeom"], pxr["Vt"], pxr["Sdf"].ValueTypeNames
        chain, widths = cable.bodies.chain, 2 * self.radii_of(cable.bodies.chain)[: len(cable.joints)]
        curve = geometry.BasisCurves.Define(stage, _path(cable))
        curve.CreateTypeAttr(geometry.Tokens.linear)
        curve.CreateWrapAttr(geometry.Tokens.periodic if chain.closed else geometry.Tokens.nonperiodic)
        curve.SetWidthsInterpolation(geometry.Tokens.vertex)
        curve.CreateCurveVertexCountsAttr([len(cable.joints)])
        curve.CreateDisplayColorAttr([pxr["Gf"].Vec3f(*(part / 255 for part in colors(cable.bodies.label)[0]))])
        points, diameters, box = sphere_arrays(pxr, cable.joints, widths)
        curve.CreatePointsAttr(points)
        curve.CreateWidthsAttr(diameters)
        curve.CreateExtentAttr(box)
        prim = curve.GetPrim()
        prim.AddAppliedSchema("PhysicsCurvesDeformableSimAPI")
        pxr["UsdPhysics"].CollisionAPI.Apply(prim)
        _bind(pxr, stage, prim)
        prim.CreateAttribute("physics:thicknesses", types.FloatArray).Set(diameters)
        prim.CreateAttribute("physics:thicknesses:elementType", types.Token).Set("point")
        rest = vt.Vec3fArray.FromNumpy(cable.rest.astype(np.float32))
        prim.CreateAttribute("physics:restShapePoints", types.Point3fArray).Set(rest)
        if (
            self.rest == "straight" and not chain.closed
        ):  # else a simulator may twist the frames on their way to the shape at rest
            for name, turns in (("normals", cable.frames), ("physics:restNormals", cable.rest_frames)):
                normals = np.concatenate((turns[:, :, 1], turns[-1:, :, 1])).astype(np.float32)
                prim.CreateAttribute(name, types.Normal3fArray, False).Set(vt.Vec3fArray.FromNumpy(normals))
            curve.SetNormalsInterpolation(geometry.Tokens.vertex)


def _line(joints: Floats, frame: Floats) -> Floats:
    """Return joints (N + 1, 3) m, as far apart as before, along the z axis of a frame (3, 3)."""
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(joints, axis=0), axis=1))))
    return np.asarray(joints[0] + along[:, None] * frame[:, 2])


def _polygon(joints: Floats) -> Floats:
    """Return a ring's (N + 1, 3) m as a level regular polygon of the same perimeter: a straight rod bent to a ring."""
    count = len(joints) - 1
    turn = 2 * math.pi * np.arange(count + 1) / count
    size = np.linalg.norm(np.diff(joints, axis=0), axis=1).mean() / (2 * math.sin(math.pi / count))
    return np.asarray(joints[:-1].mean(axis=0) + size * np.column_stack((np.cos(turn), np.sin(turn), np.zeros(count + 1))))


def _path(cable: Cable) -> str:
    return f"/doo3d/{cable.bodies.name}"


def _bind(pxr: dict[str, Any], stage: Any, prim: Any) -> None:
    """Bind the material of the scene to a prim, for physics."""
    shade = pxr["UsdShade"]
    material = shade.Material(stage.GetPrimAtPath(MATERIAL))
    shade.MaterialBindingAPI.Apply(prim).Bind(material, shade.Tokens.weakerThanDescendants, "physics")


def _attachments(pxr: dict[str, Any], stage: Any, cables: Sequence[Cable], tree: Grown) -> None:
    """Define the attachments that hold the ends of cables together at each junction."""
    types = pxr["Sdf"].ValueTypeNames
    for number, (first, *others) in enumerate(tree.junctions):
        for other in others:
            prim = stage.DefinePrim(f"/doo3d/junction{number}_{cables[other.chain].bodies.name}", "PhysicsAttachment")
            for side, end in enumerate((first, other)):
                cable = cables[end.chain]
                index = end.end * (len(cable.joints) - 1) * (not cable.bodies.chain.closed)
                prim.CreateRelationship(f"physics:src{side}").SetTargets([_path(cable)])
                prim.CreateAttribute(f"physics:type{side}", types.Token).Set("point")
                prim.CreateAttribute(f"physics:indices{side}", types.IntArray).Set([index])
            prim.CreateAttribute("physics:attachmentEnabled", types.Bool).Set(True)


def _filter(pxr: dict[str, Any], stage: Any, names: tuple[str, str], pairs: Sequence[tuple[int, int]]) -> None:
    """Define that pairs of segments of two cables, or of one, do not collide."""
    types = pxr["Sdf"].ValueTypeNames
    prim = stage.DefinePrim(f"/doo3d/apart_{names[0]}_{names[1]}", "PhysicsElementCollisionFilter")
    prim.CreateAttribute("physics:filterEnabled", types.Bool).Set(True)
    for side, (name, segments) in enumerate(zip(names, zip(*pairs, strict=True), strict=True)):
        prim.CreateRelationship(f"physics:src{side}").SetTargets([f"/doo3d/{name}"])
        prim.CreateAttribute(f"physics:groupElemIndices{side}", types.IntArray).Set(list(segments))
        prim.CreateAttribute(f"physics:groupElemCounts{side}", types.IntArray).Set([1] * len(segments))
