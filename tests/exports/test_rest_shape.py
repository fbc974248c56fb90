"""The shape at rest: exports start as detected, and their springs pull to the detected or to a straight shape."""

import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np
import pytest
from builders.chains import LENGTH, capture, helix, ring
from builders.errors import refuses
from builders.simulation import joints_of, mujoco_state
from pxr import Gf, Usd, UsdGeom, UsdPhysics

import doo3d

BENDING = 1e-3


def found(*chains):
    return doo3d.Detection(chains or (helix(),), coordinates="world")


def bend(joints):
    """Return the angle at each inner joint, rad."""
    along = np.diff(joints, axis=0) / np.linalg.norm(np.diff(joints, axis=0), axis=1)[:, None]
    return np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1, 1))


@pytest.mark.parametrize("options", [{}, {"fixed": "last"}, {"fixed": "first"}], ids=str)
def test_mujoco_starts_as_detected_and_relaxes(tmp_path, options):
    options |= {"bending": BENDING, "gravity": (0, 0, 0)}
    path = doo3d.export(found(), "mjcf", tmp_path / "a.xml", rest="straight", **options)[0]
    model, data = mujoco_state(path)
    np.testing.assert_allclose(joints_of(data, helix()), helix().joints, atol=1e-6)
    for _ in range(500):
        mujoco.mj_step(model, data)
    after = joints_of(data, helix())
    assert bend(after).max() < bend(helix().joints).min() / 4
    data.qpos = model.qpos_spring
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(bend(joints_of(data, helix())), 0, atol=1e-6)
    assert np.ptp(joints_of(data, helix()), axis=0).max() > 0.5 * 25 * LENGTH


def test_keyframes_put_hinges_where_the_frames_have_them(tmp_path):
    frames = [frame for frame in capture("world") if len(frame.chains)]
    shown = [doo3d.Detection(frame.chains[:1], coordinates="world", frame=frame.frame) for frame in frames]
    shown[1] = doo3d.Detection(
        (doo3d.Chain(helix().joints[::-1] * (1, -1, 1), LENGTH, 0.004, id=0),), frame="z", coordinates="world"
    )
    model, data = mujoco_state(doo3d.export(shown, "mjcf-motion", tmp_path / "a.xml", rest="straight", bending=BENDING)[0])
    for key, frame in enumerate(shown):
        mujoco.mj_resetDataKeyframe(model, data, key)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(joints_of(data, frame.chains[0]), frame.chains[0].joints, atol=1e-6)


def test_joints_of_usd_physics_rest_straight_where_bodies_are_as_detected(tmp_path):
    for chain in (helix(), ring()):
        path = doo3d.export(found(chain), "usd-physics", tmp_path / f"{chain.closed}.usda", rest="straight", bending=BENDING)[0]
        stage = Usd.Stage.Open(str(path))
        centers = [
            UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()).ExtractTranslation()
            for prim in stage.Traverse()
            if prim.HasAPI(UsdPhysics.RigidBodyAPI)
        ]
        np.testing.assert_allclose(centers, (chain.joints[1:] + chain.joints[:-1]) / 2, atol=1e-6)
        joints = [UsdPhysics.Joint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Joint)]
        for joint in joints:
            turn = Gf.Rotation(Gf.Quatd(joint.GetLocalRot0Attr().Get()))
            assert turn.TransformDir(Gf.Vec3d(0, 0, 1))[2] == pytest.approx(1)
            assert UsdPhysics.DriveAPI(joint.GetPrim(), "rotX").GetStiffnessAttr().Get() > 0


@pytest.mark.parametrize("axes", [2, 3])
def test_a_robot_is_straight_at_zero_and_has_the_detected_angles(tmp_path, axes):
    pybullet = pytest.importorskip("pybullet")
    options = {"rest": "straight", "axes": axes, "segments": 20}
    path = doo3d.export(found(), "urdf", tmp_path / "a.urdf", **options)[0]
    detected = doo3d.export(found(), "urdf", tmp_path / "b.urdf", axes=axes, segments=20)[0]
    state = {item.get("joint"): float(item.get("position")) for item in ElementTree.parse(path).iter("joint_state")}
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body, other = (pybullet.loadURDF(str(each), useFixedBase=True) for each in (path, detected))
        names = [pybullet.getJointInfo(body, j)[1].decode() for j in range(pybullet.getNumJoints(body))]

        def links(robot):
            count = pybullet.getNumJoints(robot)
            return np.array([pybullet.getLinkState(robot, j, computeForwardKinematics=True)[4] for j in range(count)])

        np.testing.assert_allclose(bend(links(body)[[n for n, name in enumerate(names) if name.endswith("rx")]]), 0, atol=1e-5)
        for name, position in state.items():
            pybullet.resetJointState(body, names.index(name), position)
        np.testing.assert_allclose(links(body), links(other), atol=1e-5)
    finally:
        pybullet.disconnect(client)


def test_other_programs_read_the_robot(tmp_path):
    path = doo3d.export(found(), "urdf", tmp_path / "a.urdf", rest="straight")[0]
    yourdfpy = pytest.importorskip("yourdfpy")
    assert len(yourdfpy.URDF.load(str(path)).joint_map) > 25
    assert mujoco.MjModel.from_xml_path(str(path)).njnt == 72


@pytest.mark.parametrize("name", ["mjcf", "usd-physics"])
def test_a_straight_shape_needs_springs(tmp_path, name):
    with refuses("options-conflict", "rest=straight", "bending"):
        doo3d.export(found(), name, tmp_path / "a", rest="straight")
