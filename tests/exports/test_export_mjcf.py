import mujoco
import numpy as np
import pytest
from builders.chains import LENGTH, RADIUS, capture, helix, ring, straight
from builders.errors import refuses
from builders.simulation import joints_of as joints
from builders.simulation import mujoco_state as load

import doo3d

pytestmark = pytest.mark.filterwarnings("ignore::doo3d.errors.DooWarning")  # where down is, test_simulators asks


def run(model, data, seconds=2.0):
    while data.time < seconds:
        mujoco.mj_step(model, data)
    assert not sum(int(np.sum(warning.number)) for warning in data.warning)


def model_of(tmp_path, *chains, coordinates="world", **options):
    found = doo3d.Detection(chains, coordinates=coordinates)
    return load(doo3d.export(found, "mjcf", tmp_path / "model.xml", **options)[0])


def test_each_frame_is_a_model_and_stands_as_it_was_found(tmp_path):
    frames = capture()
    paths = doo3d.export(frames, "mjcf", tmp_path, upright=False)
    assert [path.name for path in paths] == ["000000.xml", "000001.xml", "000002.xml"]
    for path, frame in zip(paths, frames, strict=True):
        _, data = load(path)
        for chain in frame.chains:
            np.testing.assert_allclose(joints(data, chain, f"chain{chain.id}"), chain.joints, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_in_every_direction(tmp_path, axis, sign):
    chain = straight(axis, sign)
    _, data = model_of(tmp_path, chain)
    np.testing.assert_allclose(joints(data, chain), chain.joints, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("chain", [helix(), helix(70), ring(), helix(1)], ids=["helix", "long", "ring", "one segment"])
@pytest.mark.parametrize(
    "options",
    [{"ground": False}, {}, {"fixed": "first"}, {"fixed": "last"}, {"fixed": "both"}, {"fixed": "both", "bending": 1e-4}],
    ids=str,
)
def test_two_seconds_under_gravity(tmp_path, chain, options):
    model, data = model_of(tmp_path, chain, **options)
    np.testing.assert_allclose(joints(data, chain), chain.joints, atol=1e-6)
    run(model, data)
    found = joints(data, chain)
    np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=0), axis=1), LENGTH, rtol=1e-9)
    fixed = options.get("fixed", "none")
    if fixed in ("first", "both"):
        np.testing.assert_allclose(found[:2], chain.joints[:2], atol=2e-3)
    if fixed == "last" or (fixed == "both" and not chain.closed):
        np.testing.assert_allclose(found[-2:], chain.joints[-2:], atol=2e-3)
    if chain.closed:
        assert np.linalg.norm(found[0] - found[-1]) < 0.5 * LENGTH
    if not options:
        assert found[:, 2].min() > chain.joints[:, 2].min() - RADIUS - 1e-3
    elif fixed == "none":
        assert found[:, 2].mean() == pytest.approx(chain.joints[:, 2].mean() - 9.81 * 2**2 / 2, rel=0.01)


def test_bending_stiffness_holds_the_shape(tmp_path):
    chain, lowest = helix(), []
    for bending in (0.0, 1e-2):
        model, data = model_of(tmp_path, chain, fixed="first", bending=bending, force=True)
        run(model, data)
        lowest.append(joints(data, chain)[:, 2].min())
    assert lowest[0] < 0.55
    assert lowest[1] > 0.69


def test_mass_is_that_of_the_cylinders(tmp_path):
    model, _ = model_of(tmp_path, helix(), density=1300.0)
    assert model.body_mass.sum() == pytest.approx(1300 * np.pi * RADIUS**2 * 25 * LENGTH)


def test_gravity_is_down(tmp_path):
    model, _ = model_of(tmp_path, helix(), coordinates="world")
    assert model.opt.gravity.tolist() == [0, 0, -9.81]
    model, data = model_of(tmp_path, helix(), gravity=(3.0, 0, 0), ground=True, force=True)
    assert data.geom("ground").xmat.reshape(3, 3)[:, 2] == pytest.approx([-1, 0, 0])
    run(model, data, 0.3)
    with refuses("options-conflict"):
        model_of(tmp_path, helix(), gravity=(0.0, 0, 0), ground=True, force=True)


def test_neighbours_do_not_push_each_other(tmp_path):
    """Capsules as thick as the segments are long overlap all along the chain."""
    _, data = model_of(tmp_path, helix(), radius=0.012)
    assert data.ncon == 0


def test_strands_touch_and_only_if_asked(tmp_path):
    other = doo3d.Chain(helix().joints + np.array((0, 0, 1.5 * RADIUS)), LENGTH, RADIUS)
    _, data = model_of(tmp_path, helix(), other)
    assert data.ncon > 10
    model, data = model_of(tmp_path, helix(), other, contacts=False, ground=True, force=True)
    run(model, data, 0.4)
    pairs = {tuple(sorted((model.geom(int(a)).name, model.geom(int(b)).name))) for a, b in data.contact.geom}
    assert pairs
    assert all("ground" in pair for pair in pairs)


@pytest.mark.slow
def test_a_chain_longer_than_the_reader_nests(tmp_path):
    chain = helix(501)
    model, data = model_of(tmp_path, chain)
    np.testing.assert_allclose(joints(data, chain), chain.joints, atol=1e-6)
    assert model.neq == 1


def test_no_plugin_and_no_composite(tmp_path):
    model_of(tmp_path, helix())
    text = (tmp_path / "model.xml").read_text()
    assert "composite" not in text
    assert "plugin" not in text
