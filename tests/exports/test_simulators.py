"""Models stepped in simulators: mass, length and energy; the ground on the plane that was found, gravity along it."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from builders.chains import LENGTH, RADIUS, helix, ring, straight
from builders.errors import code_in, refuses

import doo3d as library
from doo3d.exports.resampling import resampled
from doo3d.outputs.run_reader import open_results
from doo3d.types import Plane

MASS = 1100 * np.pi * RADIUS**2 * 25 * LENGTH
POSE = "0.4,0,0.56,1,0,0,0"


def found(*chains: library.Chain, **values) -> library.Detection:
    return library.Detection(chains or (helix(),), **{"coordinates": "world"} | values)


def mujoco_model(tmp_path, detection, **options):
    path = library.export(detection, "mjcf", tmp_path / "model.xml", force=True, **options)[0]
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


# --- where is down? -------------------------------------------------------------------------------------------------------


def test_neither_plane_nor_pose_is_a_warning(tmp_path):
    for coordinates, down in (("camera", (0, 9.81, 0)), ("cloud", (0, 0, -9.81))):
        with pytest.warns(library.errors.DooWarning, match="neither a plane under the object nor the pose"):
            model, _ = mujoco_model(tmp_path, found(coordinates=coordinates))
        assert model.opt.gravity == pytest.approx(down)
    model, _ = mujoco_model(tmp_path, found(coordinates="camera"), gravity=(0, 0, 9.81))
    assert model.opt.gravity == pytest.approx((0, 0, 9.81))


def test_a_table_that_is_not_level_is_a_warning(tmp_path):
    tilted = Plane((0.0, np.sin(0.6), np.cos(0.6)), 0.0)
    with pytest.warns(library.errors.DooWarning, match="tilted by 34 degrees"):
        _, data = mujoco_model(tmp_path, found(plane=tilted), ground=True)
    assert data.geom("ground").xmat.reshape(3, 3)[:, 2] == pytest.approx((0, 0, 1))


def test_gravity_and_ground_of_the_plane_that_was_found(tmp_path):
    normal = np.array((0.1, -0.2, -1)) / np.linalg.norm((0.1, -0.2, -1))
    lowest = (helix().joints @ normal).min()
    for height, expected in ((lowest - 0.3, lowest - 0.3), (lowest + 0.1, lowest - RADIUS)):
        model, data = mujoco_model(tmp_path, found(coordinates="camera", plane=Plane(normal, height)), ground=True)
        assert model.opt.gravity == pytest.approx(-9.81 * normal)
        assert data.geom("ground").xmat.reshape(3, 3)[:, 2] == pytest.approx(normal)
        assert data.geom("ground").xpos @ normal == pytest.approx(expected)


def test_a_cable_below_a_camera_falls_onto_the_table(doo3d, capture, tmp_path):
    """From the frames to the simulator by two commands, without a pose, and with one."""
    folder = capture()
    assert doo3d("detect", folder, "-o", "camera")[0] == 0
    assert doo3d("detect", folder, "-o", "base", "--pose", POSE)[0] == 0
    for name, up in (("camera", (0, 0, -1)), ("base", (0, 0, 1))):
        status, _, err = doo3d("export", name, "--to", "mjcf", "-o", f"{name}.xml", "--set", "ground=true", "--segments", "20")
        assert (status, err) == (0, "")
        model = mujoco.MjModel.from_xml_path(str(tmp_path / f"{name}.xml"))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        start = data.site_xpos.copy()
        while data.time < 1.5:
            mujoco.mj_step(model, data)
        chain = next(open_results(name).detections()).chains[0]
        assert len(start) == 21
        fallen = (data.site_xpos - start) @ up
        assert fallen.mean() == pytest.approx(-0.05, abs=0.015)  # the rope was 5 cm above the table
        height = data.site_xpos @ np.array(up) - data.geom("ground").xpos @ np.array(up)
        assert height == pytest.approx(chain.radius, abs=0.003)
        sideways = (data.site_xpos - start).mean(axis=0) - fallen.mean() * np.array(up)
        assert np.linalg.norm(sideways) < 0.01


def test_the_command_says_the_warning_once(doo3d, tmp_path):
    (tmp_path / "x").mkdir()
    frames = [found(coordinates="camera", frame=str(k)) for k in range(3)]
    from doo3d.outputs.detection_json import dumps

    for frame in frames:
        (tmp_path / "x" / f"{frame.frame}.json").write_text(dumps(frame.to_dict()))
    listed = [{"name": frame.frame, "status": "ok"} for frame in frames]
    (tmp_path / "x" / "manifest.json").write_text(dumps({"schema": "doo3d/manifest/1", "frames": listed}))
    status, _, err = doo3d("export", "x", "--to", "mjcf")
    assert status == 0
    assert err.startswith("doo3d: note: frame 0: neither a plane")
    assert err.endswith("(2 more like this)\n")
    status, _, err = doo3d("export", "x", "--to", "urdf", "--segments", "0")
    assert (status, code_in(err)) == (2, "value-out-of-bounds")


# --- number of segments ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 7, 24, 26, 60])
@pytest.mark.parametrize("chain", [helix(), straight(1, -1.0, 12)], ids=["helix", "straight"])
def test_another_number_of_segments(chain, count):
    other = resampled(chain, count)
    assert len(other.occluded) == count
    np.testing.assert_allclose(other.joints[[0, -1]], chain.joints[[0, -1]], atol=1e-9)
    assert other.length <= chain.length + 1e-9
    if count > 6:
        assert other.length > 0.98 * chain.length


def test_a_ring_stays_closed():
    for count in (3, 12, 39, 80):
        other = resampled(ring(), count)
        assert (len(other.occluded), other.closed) == (count, True)
        np.testing.assert_array_equal(other.joints[0], other.joints[-1])
    with refuses("value-out-of-bounds", "segments=2"):
        resampled(ring(), 2)


@pytest.mark.parametrize("name", ["mjcf", "urdf"])
@pytest.mark.parametrize("segments", [None, 10])
def test_the_mass_does_not_depend_on_the_segments(tmp_path, name, segments):
    path = tmp_path / ("a" + {"mjcf": ".xml", "urdf": ".urdf"}[name])
    library.export(found(), name, path, segments=segments)
    model = mujoco.MjModel.from_xml_path(str(path))
    masses = model.body_mass.sum()
    if name == "urdf":  # MuJoCo merges the first segment, held by a fixed joint, with the world
        masses += MASS / (segments or 25)
    assert masses == pytest.approx(MASS, rel=1e-6)


# --- MuJoCo and PyBullet, step by step ------------------------------------------------------------------------------------


def test_mujoco_keeps_length_and_gains_no_energy(tmp_path):
    model, data = mujoco_model(tmp_path, found(), fixed="first", segments=12)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    mujoco.mj_forward(model, data)
    energies, sites = [float(data.energy.sum())], data.site_xpos.copy()
    while data.time < 2.0:
        mujoco.mj_step(model, data)
        energies.append(float(data.energy.sum()))
    assert max(energies) < energies[0] + 0.01 * abs(energies[0])
    assert energies[-1] < energies[0]
    steps = [np.linalg.norm(np.diff(at, axis=0), axis=1) for at in (sites, data.site_xpos)]
    np.testing.assert_allclose(steps[1], steps[0], rtol=1e-6)


@pytest.mark.parametrize("options", [{"base": "free"}, {"segments": 10}], ids=["free", "held, 10 segments"])
def test_pybullet_keeps_mass_and_length_and_gains_no_energy(tmp_path, options):
    bullet = pytest.importorskip("pybullet")
    path = library.export(found(), "urdf", tmp_path / "a.urdf", **options)[0]
    client = bullet.connect(bullet.DIRECT)
    try:
        bullet.setGravity(0, 0, -9.81)
        bullet.setTimeStep(1e-3)
        body = bullet.loadURDF(str(path), flags=bullet.URDF_USE_INERTIA_FROM_FILE)
        bullet.changeDynamics(body, -1, linearDamping=0, angularDamping=0)  # drag of the air, 0.04 / s by default
        links = range(-1, bullet.getNumJoints(body))
        masses = np.array([bullet.getDynamicsInfo(body, link)[0] for link in links])
        assert masses.sum() == pytest.approx(MASS, rel=1e-6)
        revolutes = [link for link in links if link >= 0 and bullet.getJointInfo(body, link)[2] == bullet.JOINT_REVOLUTE]
        assert all(bullet.getJointInfo(body, link)[6] > 0 for link in revolutes)  # damping
        assert all(bullet.getJointInfo(body, link)[8] < bullet.getJointInfo(body, link)[9] for link in revolutes)  # limits
        bullet.setJointMotorControlArray(body, revolutes, bullet.VELOCITY_CONTROL, forces=[0] * len(revolutes))

        def state() -> tuple[float, np.ndarray]:
            parts = [bullet.getLinkState(body, link, computeLinkVelocity=1) for link in links if link >= 0]
            at = np.array([bullet.getBasePositionAndOrientation(body)[0], *(part[0] for part in parts)])
            speed = np.array([bullet.getBaseVelocity(body)[0], *(part[6] for part in parts)])
            return float(masses @ (9.81 * at[:, 2] + 0.5 * (speed**2).sum(axis=1))), at

        names = [bullet.getJointInfo(body, link)[12].decode() for link in links if link >= 0]
        segments = 1 + np.array([k for k, name in enumerate(names) if "segment" in name])
        energy, at = state()
        spans = []
        for _ in range(10):
            for _ in range(50):
                bullet.stepSimulation()
            now, where = state()
            assert now < energy + 0.02 * abs(energy)
            spans.append(np.linalg.norm(np.diff(where[segments], axis=0), axis=1).max())
        assert max(spans) < 1.01 * LENGTH * 25 / (options.get("segments", 25))  # between the middles of neighbors
        fall = (where - at)[segments, 2].mean()
        assert fall == pytest.approx(-9.81 * 0.5**2 / 2, rel=0.02) if "base" in options else fall < -0.02
    finally:
        bullet.disconnect(client)


def test_a_free_robot_has_one_chain(tmp_path):
    other = library.Chain(helix().joints + np.array((0, 0, 0.1)), LENGTH, RADIUS)
    with refuses("options-conflict", "2 objects"):
        library.export(found(helix(), other), "urdf", tmp_path / "a.urdf", base="free")
