"""The motion of a capture as MuJoCo keyframes: each key puts the joints where the frame has them."""

import dataclasses

import mujoco
import numpy as np
import pytest
from builders.chains import LENGTH, RADIUS, helix, ring
from builders.errors import refuses

import doo3d

pytestmark = pytest.mark.filterwarnings("ignore:frame .* neither a plane:doo3d.errors.DooWarning")


def writhing(count=25, **values):
    """Return a chain of `count` segments that turns and bends through every direction."""
    angle = np.cumsum(np.random.default_rng(values.pop("seed", 0)).normal(0, 0.5, (count, 2)), axis=0)
    steps = np.column_stack(
        (np.cos(angle[:, 0]), np.sin(angle[:, 0]) * np.cos(angle[:, 1]), np.sin(angle[:, 0]) * np.sin(angle[:, 1]))
    )
    joints = LENGTH * np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return doo3d.Chain(joints, LENGTH, RADIUS, **values)


def capture(count=25, frames=6, stamps=True):
    return [
        doo3d.Detection(
            (helix(count, 0.01 * k, id=3), writhing(count, seed=k, id=1)),
            coordinates="world",
            frame=f"{k:06d}",
            timestamp=1.7e9 + k / 25 if stamps else None,
        )
        for k in range(frames)
    ]


def shapes(path, counts):
    """Return for each key of a model the joints of its chains, by the chain's number."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for key in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, key)
        mujoco.mj_forward(model, data)
        found = {n: np.array([data.site(f"chain{n}_{k}").xpos for k in range(count + 1)]) for n, count in counts.items()}
        yield model.key(key).name, data.time, found


@pytest.mark.parametrize("count", [1, 25, pytest.param(450, marks=pytest.mark.slow)])
@pytest.mark.parametrize("stamps", [True, False])
def test_each_key_is_a_frame(tmp_path, count, stamps):
    frames = capture(count, stamps=stamps)
    path = doo3d.export(frames, "mjcf-motion", tmp_path / "motion.xml")[0]
    keys = list(shapes(path, {1: count, 3: count}))
    assert [name for name, _, _ in keys] == [frame.frame for frame in frames]
    np.testing.assert_allclose([time for _, time, _ in keys], np.arange(6) / (25 if stamps else 30), atol=1e-6)
    for (_, _, found), frame in zip(keys, frames, strict=True):
        for chain in frame.chains:
            np.testing.assert_allclose(found[chain.id], chain.joints, atol=1e-9)


def test_a_chain_that_turns_does_not_twist(tmp_path):
    """From frame to frame every ball joint moves by no more than the chain turns there, also through -z, where frames flip."""
    joints = np.column_stack((np.zeros(11), np.zeros(11), -LENGTH * np.arange(11)))
    turns = [np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]]) for a in np.linspace(-0.1, 0.1, 5)]
    frames = [
        doo3d.Detection((doo3d.Chain(joints @ turn.T, LENGTH, RADIUS, id=0),), coordinates="world", frame=f"{k}")
        for k, turn in enumerate(turns)
    ]
    model = mujoco.MjModel.from_xml_path(str(doo3d.export(frames, "mjcf-motion", tmp_path / "motion.xml")[0]))
    for before, after in zip(model.key_qpos[:-1], model.key_qpos[1:], strict=True):
        assert 2 * np.arccos(np.abs(before[3:7] @ after[3:7])) == pytest.approx(0.05, abs=1e-6)
        np.testing.assert_allclose(after[7:], before[7:], atol=1e-9)


def test_frames_without_all_chains_have_no_key(tmp_path):
    frames = capture()
    frames[1] = dataclasses.replace(frames[1], chains=frames[1].chains[:1])
    frames[3] = dataclasses.replace(frames[3], chains=(frames[3].chains[0], writhing(24, id=1)))
    frames[4] = dataclasses.replace(frames[4], chains=frames[4].chains[::-1])  # another order is no matter
    with pytest.warns(doo3d.errors.DooWarning, match="2 of 6 frames have no keyframe: not all chains of frame 000000"):
        path = doo3d.export(frames, "mjcf-motion", tmp_path / "motion.xml")[0]
    keys = list(shapes(path, {1: 25, 3: 25}))
    assert [name for name, _, _ in keys] == ["000000", "000002", "000004", "000005"]
    np.testing.assert_allclose(keys[2][2][1], frames[4].chains[0].joints, atol=1e-9)


def test_rings_and_fewer_segments(tmp_path):
    rings = [doo3d.Detection((dataclasses.replace(ring(), id=0),), coordinates="world", frame=f"{k}") for k in range(2)]
    (_, _, found), _ = shapes(doo3d.export(rings, "mjcf-motion", tmp_path / "rings.xml")[0], {0: 40})
    np.testing.assert_allclose(found[0], ring().joints, atol=1e-9)
    frames = [dataclasses.replace(frame, chains=frame.chains[:1]) for frame in capture()]
    path = doo3d.export(frames, "mjcf-motion", tmp_path / "few.xml", segments=10)[0]
    for (_, _, found), frame in zip(shapes(path, {3: 10}), frames, strict=True):
        np.testing.assert_allclose(found[3][[0, -1]], frame.chains[0].joints[[0, -1]], atol=0.01 * 25 * LENGTH)


def test_what_keyframes_cannot(tmp_path):
    frames = capture()
    with refuses("frame-names-clash"):
        doo3d.export([frames[0], frames[0]], "mjcf-motion", tmp_path / "motion.xml")
    with refuses("value-invalid", "fixed", kind=doo3d.errors.ConfigError):
        doo3d.export(frames, "mjcf-motion", tmp_path / "motion.xml", fixed="first")
