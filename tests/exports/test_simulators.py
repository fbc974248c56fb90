"""Models stepped in simulators: mass, length and energy; the ground on the plane that was found, gravity along it."""

import mujoco
import numpy as np
import pytest
from builders.chains import LENGTH, RADIUS, helix, ring, straight
from builders.errors import code_in, refuses
from builders.paths import SAMPLES
from builders.simulation import joints_of, mujoco_state

import doo3d as library
from doo3d.exports.resampling import resampled
from doo3d.outputs.run_reader import open_results
from doo3d.types import Plane

MASS = 1100 * np.pi * RADIUS**2 * 25 * LENGTH
POSE = "0.4,0,0.56,1,0,0,0"


def found(*chains: library.Chain, **values) -> library.Detection:
    return library.Detection(chains or (helix(),), **{"coordinates": "world"} | values)


def mujoco_model(tmp_path, detection, **options):
    return mujoco_state(library.export(detection, "mjcf", tmp_path / "model.xml", force=True, **options)[0])


# --- where is down? -------------------------------------------------------------------------------------------------------


def test_neither_plane_nor_pose_is_a_warning(tmp_path):
    for coordinates, down in (("camera", (0, 9.81, 0)), ("cloud", (0, 0, -9.81))):
        with pytest.warns(library.errors.DooWarning, match="neither a plane under the object nor the pose"):
            model, _ = mujoco_model(tmp_path, found(coordinates=coordinates), upright=False)
        assert model.opt.gravity == pytest.approx(down)
    model, _ = mujoco_model(tmp_path, found(coordinates="camera"), gravity=(0, 0, 9.81), upright=False)
    assert model.opt.gravity == pytest.approx((0, 0, 9.81))


def test_a_table_that_is_not_level_is_a_warning(tmp_path):
    normal = np.array((0.0, np.sin(0.6), np.cos(0.6)))
    tilted = Plane(normal, float((helix().joints @ normal).min()) - RADIUS)
    with pytest.warns(library.errors.DooWarning, match="tilted by 34 degrees"):
        _, data = mujoco_model(tmp_path, found(plane=tilted), ground=True)
    assert data.geom("ground").xmat.reshape(3, 3)[:, 2] == pytest.approx((0, 0, 1))


def test_gravity_and_ground_of_the_plane_that_was_found(tmp_path):
    normal = np.array((0.1, -0.2, -1)) / np.linalg.norm((0.1, -0.2, -1))
    lowest = (helix().joints @ normal).min()
    for height, expected in ((lowest - 4 * RADIUS, lowest - 4 * RADIUS), (lowest + 0.1, lowest - RADIUS)):
        model, data = mujoco_model(tmp_path, found(coordinates="camera", plane=Plane(normal, height)), upright=False)
        assert model.opt.gravity == pytest.approx(-9.81 * normal)
        assert data.geom("ground").xmat.reshape(3, 3)[:, 2] == pytest.approx(normal)
        assert data.geom("ground").xpos @ normal == pytest.approx(expected)


@pytest.mark.parametrize("gravity", [(0, 0, 9.81), (0, 9.81, 0), (0.5, 0.3, 9.0), (9.81, 0, 0), (0, 0, -9.81)], ids=str)
@pytest.mark.parametrize("coordinates", ["camera", "cloud"])
def test_z_is_up_and_the_ground_at_zero(tmp_path, coordinates, gravity):
    detection = found(coordinates=coordinates)
    model, data = mujoco_model(tmp_path, detection, gravity=gravity)
    assert model.opt.gravity == pytest.approx((0, 0, -np.linalg.norm(gravity)))
    pose = model.numeric("pose").data.reshape(4, 4)
    assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3))
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    assert pose[:3, :3] @ gravity == pytest.approx(model.opt.gravity)
    assert pose[0, 0] >= 0
    joints = joints_of(data, detection.chains[0])
    assert joints == pytest.approx(detection.chains[0].joints @ pose[:3, :3].T + pose[:3, 3])
    assert data.geom("ground").xpos[2] == pytest.approx(0)
    assert data.geom("ground").xmat.reshape(3, 3)[:, 2] == pytest.approx((0, 0, 1))
    assert joints[:, 2].min() == pytest.approx(RADIUS)
    assert model.ncam == (coordinates == "camera")
    if model.ncam:  # it looks along its -z axis, with y up; the optical frame has z forward and y down
        assert data.camera("capture").xmat.reshape(3, 3) == pytest.approx(pose[:3, :3] @ np.diag((1, -1, -1)))
        assert data.camera("capture").xpos == pytest.approx(pose[:3, 3])


def test_a_base_frame_stays_as_it_is(tmp_path):
    model, data = mujoco_model(tmp_path, found())
    assert data.site("chain0_0").xpos == pytest.approx(helix().joints[0])
    assert (model.nnumeric, model.ncam) == (0, 0)


def test_light_and_ground_unless_an_end_is_held(tmp_path):
    for options, has_ground in (
        ({}, True),
        ({"ground": False}, False),
        ({"fixed": "first"}, False),
        ({"gravity": (0, 0, 0)}, False),
    ):
        model, _ = mujoco_model(tmp_path, found(), **options)
        names = [model.geom(k).name for k in range(model.ngeom)]
        assert ("ground" in names) == has_ground
        assert model.nlight == 1
        assert model.vis.headlight.ambient.min() + model.vis.headlight.diffuse.min() > 0.6
        assert model.tex_type.tolist().count(mujoco.mjtTexture.mjTEXTURE_SKYBOX) == 1
    assert "ground" in mujoco_model(tmp_path, found(), fixed="first", ground=True)[1].geom("ground").name


def rest(path, seconds=1.0):
    """Step a model, from its first key if it has any; return its rise, its greatest speed and its last, mm and m/s, and its data.

    The rise is the greatest height of any joint above where it began.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    start = before = data.site_xpos.copy()
    rise = fastest = speed = 0.0
    while data.time < seconds:
        mujoco.mj_step(model, data)
        rise = max(rise, float((data.site_xpos - start)[:, 2].max()))
        speed = float(np.linalg.norm(data.site_xpos - before, axis=1).max()) / model.opt.timestep
        fastest, before = max(fastest, speed), data.site_xpos.copy()
    assert not sum(int(np.sum(warning.number)) for warning in data.warning)
    return 1000 * rise, fastest, speed, data


@pytest.mark.parametrize(
    ("sample", "to", "config"),
    [("crossing", "mjcf", "default"), ("two_cables", "mjcf-motion", "default"), ("two_cables", "mjcf", "harness")],
)
def test_a_cable_on_a_table_lies_still_from_the_start(doo3d, tmp_path, sample, to, config):
    """What was found on the table stays there: crossings hardly push each other apart, and nothing falls far or flies."""
    assert doo3d("detect", SAMPLES / sample, "-o", "out", "-c", config)[0] == 0
    frame = [] if to == "mjcf-motion" else ["--frame", "000000"]
    status, _, err = doo3d("export", "out", "--to", to, "-o", "model.xml", "--segments", "25", *frame)
    assert (status, err) == (0, "")
    rise, fastest, last, data = rest(tmp_path / "model.xml")
    chains = next(open_results("out").detections()).chains
    radius = max(chain.radius for chain in chains)
    assert rise < 4
    assert fastest < 0.5
    assert last < 0.02
    assert -0.001 < data.site_xpos[:, 2].min() - min(chain.radius for chain in chains) < 0.002
    assert data.site_xpos[:, 2].max() < 6 * radius


def test_strands_that_overlap_are_not_thrown_apart(tmp_path):
    """Three cables through each other at a crossing, as if all had been found at one depth."""
    turns = [np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]) for a in (0.0, 1.0, 2.1)]
    line = straight(0, 1.0, 20).joints - (0.1, 0, 0)
    chains = [library.Chain(line @ turn.T, LENGTH, RADIUS) for turn in turns]
    path = library.export(found(*chains), "mjcf", tmp_path / "a.xml")[0]
    rise, fastest, last, data = rest(path)
    assert rise < 1000 * 5 * RADIUS  # the uppermost comes to lie on two others
    assert fastest < 1.0
    assert last < 0.05
    assert data.site_xpos[:, 2].max() < 5.5 * RADIUS
    assert data.site_xpos[:, 2].min() > -2.2 * RADIUS


def test_a_cable_below_a_camera_falls_onto_the_table(doo3d, capture, tmp_path):
    """From the frames to the simulator by two commands, without a pose, and with one."""
    folder = capture()
    assert doo3d("detect", folder, "-o", "camera")[0] == 0
    assert doo3d("detect", folder, "-o", "base", "--pose", POSE)[0] == 0
    for name, up in (("camera", (0, 0, -1)), ("base", (0, 0, 1))):
        options = ["--set", "upright=false", "--segments", "20"]
        status, _, err = doo3d("export", name, "--to", "mjcf", "-o", f"{name}.xml", *options)
        assert (status, err) == (0, "")
        model, data = mujoco_state(tmp_path / f"{name}.xml")
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


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("counts", [(107,), (60, 80), (321,), (24, 300, 5)], ids=str)
def test_a_long_cable_is_written_with_as_many_joints_as_pybullet_reads(tmp_path, counts, axes):
    bullet = pytest.importorskip("pybullet")
    chains = [
        library.Chain(straight(1, 1.0, count).joints + np.array((0.1 * k, 0, 0)), LENGTH, RADIUS)
        for k, count in enumerate(counts)
    ]
    with pytest.warns(library.errors.DooWarning, match=f"{sum(counts)} segments would make .* PyBullet reads 127.*--segments N"):
        path = library.export(found(*chains), "urdf", tmp_path / "a.urdf", axes=axes)[0]
    client = bullet.connect(bullet.DIRECT)
    try:
        body = bullet.loadURDF(str(path), flags=bullet.URDF_USE_INERTIA_FROM_FILE)
        links = [bullet.getJointInfo(body, link)[12].decode() for link in range(bullet.getNumJoints(body))]
        assert 110 < len(links) <= 127
        for k, chain in enumerate(chains):
            end = bullet.getLinkState(body, links.index(f"chain{k}_end"))[0]
            assert end == pytest.approx(chain.joints[-1], abs=1e-4)
        lengths = [chain.length / sum(f"chain{k}_segment" in name for name in links) for k, chain in enumerate(chains)]
        assert max(lengths) < 2 * min(lengths)
        bullet.setTimeStep(1e-4)
        bullet.stepSimulation()
        assert np.isfinite(bullet.getLinkState(body, len(links) - 1)[0]).all()
    finally:
        bullet.disconnect(client)


def test_a_robot_has_the_segments_that_are_asked_for(tmp_path):
    chain, path = straight(1, 1.0, 107), tmp_path / "a.urdf"
    for options, count in (({"segments": 20}, 20), ({"max_joints": None}, 107), ({"max_joints": None, "segments": 60}, 60)):
        library.export(found(chain), "urdf", path, force=True, **options)
        assert path.read_text().count('<link name="chain0_segment') == count
    with pytest.warns(library.errors.DooWarning, match="60 segments make 179 joints, and PyBullet reads 127"):
        library.export(found(chain), "urdf", path, force=True, segments=60)
    assert path.read_text().count('<link name="chain0_segment') == 60
    library.export(found(straight(1, 1.0, 42)), "urdf", path, force=True)  # 125 joints: as detected, and no note


def test_a_robot_of_very_many_chains_has_a_segment_each(tmp_path):
    chains = [library.Chain(straight(1, 1.0, 4).joints + np.array((0.1 * k, 0, 0)), LENGTH, RADIUS) for k in range(70)]
    with pytest.warns(library.errors.DooWarning, match="written with 70 segments and 140 joints"):
        library.export(found(*chains), "urdf", tmp_path / "a.urdf")


def test_a_free_robot_has_one_chain(tmp_path):
    other = library.Chain(helix().joints + np.array((0, 0, 0.1)), LENGTH, RADIUS)
    with refuses("options-conflict", "2 objects"):
        library.export(found(helix(), other), "urdf", tmp_path / "a.urdf", base="free")
