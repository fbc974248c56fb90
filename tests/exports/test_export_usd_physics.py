"""UsdPhysics: checked by OpenUSD's own validators, read back by its parser of physics."""

import numpy as np
import pytest
from builders.chains import LENGTH, RADIUS, helix, ring
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdValidation

import doo3d
from doo3d.types import Plane

TABLE = Plane((0.0, 0.0, -1.0), -1.2)


def scene(tmp_path, *chains, coordinates="world", plane=None, suffix=".usda", **options):
    detection = doo3d.Detection(chains, coordinates=coordinates, plane=plane)
    return Usd.Stage.Open(str(doo3d.export(detection, "usd-physics", tmp_path / f"a{suffix}", force=True, **options)[0]))


def world(stage, path):
    return np.array(UsdGeom.Xformable(stage.GetPrimAtPath(path)).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
@pytest.mark.parametrize("chain", [helix(), ring(), helix(1)], ids=["helix", "ring", "one segment"])
@pytest.mark.parametrize("options", [{}, {"fixed": True, "ground": True}, {"segments": 8}], ids=str)
def test_the_validators_of_usd_find_nothing(tmp_path, chain, suffix, options):
    stage = scene(tmp_path, chain, suffix=suffix, **options)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert any("PhysicsJointChecker" in validator.GetMetadata().name for validator in validators)
    assert [error.GetMessage() for error in UsdValidation.ValidationContext(validators).Validate(stage)] == []


def test_bodies_stand_where_the_chain_was_found_and_weigh_as_much(tmp_path):
    chain = helix()
    stage = scene(tmp_path, chain)
    mass = 0.0
    for k in range(25):
        matrix = world(stage, f"/doo3d/chain0/segment{k}")
        ends = [np.array((0, 0, z, 1)) @ matrix for z in (-LENGTH / 2, LENGTH / 2)]
        np.testing.assert_allclose([end[:3] for end in ends], chain.joints[k : k + 2], atol=1e-6)
        prim = stage.GetPrimAtPath(f"/doo3d/chain0/segment{k}")
        assert prim.HasAPI(UsdPhysics.RigidBodyAPI)
        mass += UsdPhysics.MassAPI(prim).GetMassAttr().Get()
    assert mass == pytest.approx(1100 * np.pi * RADIUS**2 * 25 * LENGTH, rel=1e-5)


def test_joints_hold_ends_together_with_limits_and_drives(tmp_path):
    stage = scene(tmp_path, ring(), bending=1e-4, limit=45)
    joints = [UsdPhysics.Joint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Joint)]
    assert len(joints) == 40
    for joint in joints:
        anchors = []
        for body, position, turn in (
            (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
            (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
        ):
            matrix = Gf.Matrix4d().SetRotate(turn.Get()) * Gf.Matrix4d().SetTranslate(Gf.Vec3d(position.Get()))
            anchors.append(np.array(matrix) @ world(stage, body.GetTargets()[0]))
        np.testing.assert_allclose(anchors[0][3], anchors[1][3], atol=1e-6)
        if not joint.GetPath().name == "joint40":  # the seam of a ring has its own turn
            np.testing.assert_allclose(anchors[0], anchors[1], atol=1e-5)
        prim = joint.GetPrim()
        limits = {name: UsdPhysics.LimitAPI(prim, name) for name in ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")}
        assert all(
            (limit.GetLowAttr().Get() > limit.GetHighAttr().Get()) == name.startswith("t") for name, limit in limits.items()
        )
        assert limits["rotY"].GetHighAttr().Get() == 45
        drive = UsdPhysics.DriveAPI(prim, "rotX")
        assert drive.GetStiffnessAttr().Get() == pytest.approx(1e-4 / LENGTH * np.pi / 180)
        assert drive.GetDampingAttr().Get() > 0


def test_gravity_points_to_the_table_in_the_world_of_the_stage(tmp_path):
    table = Plane(TABLE.normal, -float(helix().joints[:, 2].max()) - helix().radius)
    stage = scene(tmp_path, helix(), coordinates="camera", plane=table, ground=True)
    gravity = UsdPhysics.Scene(stage.GetPrimAtPath("/doo3d/physics"))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    down = np.array(gravity.GetGravityDirectionAttr().Get())
    np.testing.assert_allclose(down, (0, 0, -1), atol=1e-6)  # the camera looks along -z of the stage
    ground, cable = world(stage, "/doo3d/ground")[3, :3], world(stage, "/doo3d/chain0/segment0")[3, :3]
    assert (ground - cable) @ down > helix().radius / 2
    np.testing.assert_allclose(world(stage, "/doo3d/ground")[2, :3], -down, atol=1e-6)


def test_a_plane_far_behind_the_object_is_no_ground(tmp_path):
    wall = Plane(TABLE.normal, -float(helix().joints[:, 2].max()) - 0.5)
    with pytest.warns(doo3d.errors.DooWarning, match="does not lie on the plane behind it.* --set gravity="):
        stage = scene(tmp_path, helix(), coordinates="camera", plane=wall, ground=True)
    down = np.array(UsdPhysics.Scene(stage.GetPrimAtPath("/doo3d/physics")).GetGravityDirectionAttr().Get())
    np.testing.assert_allclose(down, (0, -1, 0), atol=1e-6)  # that of a level camera
