"""`doo3d detect --sequence`: a rope that moves, half hidden in some frames, with a frame that lost its depth."""

import json

import mujoco
import numpy as np
import pytest
from builders.captures import FOCAL, HEIGHT, MATRIX, WIDTH, rope, save

from doo3d.outputs.run_reader import open_results

FRAMES, HIDDEN, LOST = 9, (3, 4, 5), 6


@pytest.fixture
def swaying(tmp_path):
    """A capture of a rope whose right third is behind a box in three frames; one frame has no depth at all."""
    folder = tmp_path / "swaying"
    for k in range(FRAMES):
        color, depth, mask = (np.roll(image, 2 * k, axis=0) for image in rope())
        if k in HIDDEN:
            color[:, 210:], depth[:, 210:], mask[:, 210:] = (90, 90, 90), 300, False
        if k == LOST:
            depth[:] = 0
        for part, image in (("color", color), ("depth", depth), ("mask", mask.astype(np.uint8) * 255)):
            save(folder / part / f"{k:03d}.png", image)
    intrinsics = {"width": WIDTH, "height": HEIGHT, "intrinsic_matrix": MATRIX, "depth_scale": 1000}
    (folder / "camera_intrinsic.json").write_text(json.dumps(intrinsics), encoding="utf-8")
    return folder


def contents(out):
    return {file.name: file.read_bytes() for file in out.iterdir() if file.suffix in (".json", ".jpg")}


def test_every_frame_has_the_whole_rope(doo3d, swaying, tmp_path):
    code, printed, errors = doo3d("detect", swaying, "-o", tmp_path / "out", "--sequence")
    assert (code, errors) == (0, "first pass of 9 frames\nsecond pass of 9 frames\n")
    assert printed.count("1 chain") == FRAMES
    detections = list(open_results(tmp_path / "out").detections())
    chains = [detection.chains[0] for detection in detections]
    assert len({len(chain.joints) for chain in chains}) == 1
    assert {chain.id for chain in chains} == {0}
    assert not any(chains[k].from_time.any() for k in (0, 1, 2, 8))
    assert all(0.2 < chains[k].from_time.mean() < 0.6 for k in HIDDEN)
    assert chains[LOST].depth_filled.all()
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text(encoding="utf-8"))
    (item,) = manifest["sequence"]["objects"]
    assert item["length"] == pytest.approx(chains[0].length)
    assert doo3d("export", tmp_path / "out", "--to", "npz", "-o", tmp_path / "out.npz", "--set", "rate=30")[0] == 0
    file = np.load(tmp_path / "out.npz")
    velocities = np.reshape(file["velocities"], (FRAMES, -1, 3))
    true = 2 * 30 * 0.5 / FOCAL  # 2 px per frame
    assert np.median(velocities[1:-1, :, 1]) == pytest.approx(true, rel=0.05)
    np.testing.assert_array_equal(file["from_time"], np.concatenate([chain.from_time for chain in chains]))
    assert doo3d("export", tmp_path / "out", "--to", "mjcf-motion", "--set", "rate=30", "--set", "upright=false")[0] == 0
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    data = mujoco.MjData(model)
    for k, chain in enumerate(chains):
        mujoco.mj_resetDataKeyframe(model, data, k)
        mujoco.mj_forward(model, data)
        found = [data.site(f"chain0_{joint}").xpos for joint in range(len(chain.joints))]
        np.testing.assert_allclose(found, chain.joints, atol=1e-8)
    alone = doo3d("detect", swaying, "-o", tmp_path / "alone")
    assert alone[0] == 1  # the frame without depth fails
    shortest = min(detection.chains[0].length for detection in open_results(tmp_path / "alone").detections())
    assert shortest < 0.8 * item["length"]


@pytest.mark.slow
def test_workers_and_a_resumed_run_write_the_same_bytes(doo3d, swaying, tmp_path):
    once, parted = tmp_path / "once", tmp_path / "parted"
    assert doo3d("detect", swaying, "-o", once, "--sequence")[0] == 0
    assert doo3d("detect", swaying, "-o", parted, "--sequence", "--workers", "2")[0] == 0
    assert contents(once) == contents(parted)
    (parted / "004.png").write_bytes(b"damaged")
    code, _, errors = doo3d("detect", swaying, "-o", parted, "--sequence")
    assert code == 0
    assert "finished already" in errors
    assert contents(once) == contents(parted)


def test_a_run_without_the_sequence_is_another(doo3d, swaying, tmp_path):
    doo3d("detect", swaying, "-o", tmp_path / "out", "--sequence")
    code, _, errors = doo3d("detect", swaying, "-o", tmp_path / "out")
    assert code == 2
    assert "another input" in errors


def test_a_frame_that_is_mended_begins_the_second_pass_again(doo3d, swaying, tmp_path):
    path = swaying / "depth" / "008.png"
    good = path.read_bytes()
    path.write_bytes(b"no image")
    assert doo3d("detect", swaying, "-o", tmp_path / "out", "--sequence")[0] == 1
    path.write_bytes(good)
    assert doo3d("detect", swaying, "-o", tmp_path / "out", "--sequence")[0] == 0
    doo3d("detect", swaying, "-o", tmp_path / "fresh", "--sequence")
    assert contents(tmp_path / "out") == contents(tmp_path / "fresh")


def test_two_ways_for_many_frames_exclude_each_other(doo3d, swaying, tmp_path):
    code, _, errors = doo3d("detect", swaying, "-o", tmp_path / "out", "--sequence", "--fuse-views")
    assert code == 2
    assert "options-conflict" in errors


def test_images_are_refused(doo3d, swaying, tmp_path):
    code, _, errors = doo3d("detect", swaying / "color", "-o", tmp_path / "out", "--sequence", "-c", "image")
    assert code == 2
    assert "config-mode" in errors


def test_depth_in_the_wrong_unit_fails_and_is_not_taken_for_frames_that_show_nothing(doo3d, swaying, tmp_path):
    code, _, errors = doo3d("detect", swaying, "-o", tmp_path / "out", "--sequence", "--input-option", "depth_scale=1")
    assert code == 1  # frame 006, which has no depth, is an empty one
    assert "depth-unit" in errors
