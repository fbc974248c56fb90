import numpy as np
import pytest
import yourdfpy
from builders.chains import LENGTH, RADIUS, capture, helix, ring, straight

import doo3d


def load(path):
    return yourdfpy.URDF.load(str(path), build_scene_graph=True, load_meshes=False)


def joints(robot, chain, name="chain0"):
    links = [f"{name}_segment{k}" for k in range(len(chain.occluded))] + [f"{name}_end"]
    return np.array([robot.get_transform(link, "world")[:3, 3] for link in links])


def test_the_shape_is_that_of_the_chain(tmp_path):
    frames = capture()
    for path, frame in zip(doo3d.export(frames, "urdf", tmp_path), frames, strict=True):
        robot = load(path)
        assert robot.validate()
        for chain in frame.chains:
            np.testing.assert_allclose(joints(robot, chain, f"chain{chain.id}"), chain.joints, atol=1e-9)


@pytest.mark.parametrize("chain", [helix(1), ring(), *(straight(axis, sign) for axis in range(3) for sign in (1.0, -1.0))])
@pytest.mark.parametrize("axes", [2, 3])
def test_any_chain_with_two_axes_or_three(tmp_path, chain, axes):
    robot = load(doo3d.export(doo3d.Detection((chain,)), "urdf", tmp_path / "chain.urdf", axes=axes)[0])
    assert len(robot.actuated_joints) == axes * (len(chain.occluded) - 1)
    np.testing.assert_allclose(joints(robot, chain), chain.joints, atol=1e-6)


def test_cylinders_lie_between_the_joints_and_weigh_what_they_do(tmp_path):
    chain = helix()
    robot = load(doo3d.export(doo3d.Detection((chain,)), "urdf", tmp_path / "chain.urdf", density=1000.0)[0])
    for k in range(25):
        link = robot.link_map[f"chain0_segment{k}"]
        assert link.visuals[0].geometry.cylinder.radius == RADIUS
        assert link.visuals[0].geometry.cylinder.length == LENGTH
        middle = robot.get_transform(link.name, "world") @ link.visuals[0].origin
        np.testing.assert_allclose(middle[:3, 3], (chain.joints[k] + chain.joints[k + 1]) / 2, atol=1e-9)
        assert link.inertial.mass == pytest.approx(1000 * np.pi * RADIUS**2 * LENGTH, rel=0.01)
        assert np.linalg.eigvalsh(link.inertial.inertia).min() > 0
        assert link.visuals[0].material.name == f"chain0_{'occluded' if chain.occluded[k] else 'seen'}"


def test_a_joint_turns_what_comes_after_it(tmp_path):
    chain = straight(0, 1.0, 4)
    robot = load(doo3d.export(doo3d.Detection((chain,)), "urdf", tmp_path / "chain.urdf")[0])
    robot.update_cfg({"chain0_joint2_rx": np.pi / 2})
    found = joints(robot, chain)
    np.testing.assert_allclose(found[:3], chain.joints[:3], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=0), axis=1), LENGTH, rtol=1e-9)
    assert np.linalg.norm(found[4] - found[2]) == pytest.approx(2 * LENGTH)
    assert abs((found[4] - found[2]) @ (1, 0, 0)) < 1e-9


def test_the_base_may_float(tmp_path):
    path = doo3d.export(doo3d.Detection((helix(),)), "urdf", tmp_path / "chain.urdf", base="floating")[0]
    assert load(path).joint_map["chain0_base"].type == "floating"
