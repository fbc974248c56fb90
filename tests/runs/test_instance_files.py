"""`detect --instances`: the images of labels that a run writes for its frames."""

import cv2
import numpy as np
import pytest
from builders.captures import rope, save
from builders.errors import code_in, refuses
from builders.runs import files_of, read_manifest

import doo3d as api
from doo3d.outputs.run_reader import open_results


def labels_in(folder):
    return {
        file.name.removesuffix(".instances.png"): cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        for file in sorted(folder.glob("*.instances.png"))
    }


def test_a_run_writes_them_and_a_finished_run_adds_them(capture, doo3d, tmp_path):
    source = capture(frames=2, mask=True)
    assert doo3d("detect", source, "-o", "out")[0] == 0
    assert labels_in(tmp_path / "out") == {}
    plain = files_of(tmp_path / "out")
    code, printed, _ = doo3d("detect", source, "-o", "out", "--instances", "--workers", 2)
    assert (code, printed.count("1 chain")) == (0, 2)
    labels = labels_in(tmp_path / "out")
    assert list(labels) == ["000000", "000001"]
    for name, image in labels.items():
        found = open_results(tmp_path / "out").detection(name)
        assert (image.dtype, image.shape) == (np.uint16, (240, 320))
        assert set(np.unique(image)) == {0, 1}
        assert np.mean((image > 0) == rope()[2]) > 0.99
        np.testing.assert_array_equal(found.instance_labels(), image)
    assert all(frame["instances"] for frame in read_manifest(tmp_path / "out")["frames"])
    again = files_of(tmp_path / "out")
    assert {name: again[name] for name in plain if name != "manifest.json"} == {
        name: content for name, content in plain.items() if name != "manifest.json"
    }
    assert "finished already" in doo3d("detect", source, "-o", "out", "--instances")[2]
    assert doo3d("detect", source, "-o", "out")[0] == 0
    assert files_of(tmp_path / "out") == again
    assert doo3d("detect", source, "-o", "out", "--restart")[0] == 0
    assert files_of(tmp_path / "out") == plain


def test_a_missing_file_is_made_again(capture, tmp_path):
    source, out = capture(frames=3, mask=True), tmp_path / "out"
    api.run(source, out, instances=True, pictures="none")
    before, done = files_of(out), []
    (out / "000001.instances.png").unlink()
    api.run(source, out, instances=True, pictures="none", progress=lambda record: done.append(record.name))
    assert done == ["000001"]
    assert files_of(out) == before


def test_frames_of_a_sequence_have_labels_even_without_depth(doo3d, capture, tmp_path):
    source = capture(frames=4, mask=True)
    save(source / "depth/000002.png", 0 * rope()[1])
    masks = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) > 0 for file in sorted((source / "mask").glob("*.png"))]
    assert doo3d("detect", source, "-o", "out", "--sequence", "--instances")[0] == 0
    labels = labels_in(tmp_path / "out")
    assert list(labels) == [f"{k:06d}" for k in range(4)]
    for mask, image in zip(masks, labels.values(), strict=True):
        np.testing.assert_array_equal(image, mask)
    found = api.detect_sequence([frame.load().data for frame in api.open_capture(source)], masks=masks)
    np.testing.assert_array_equal(found[2].instance_labels(), labels["000002"])


def test_a_robots_base_frame_does_not_move_the_labels(capture, tmp_path):
    source = capture(frames=1, mask=True)
    api.run(source, tmp_path / "a", instances=True)
    api.run(source, tmp_path / "b", instances=True, pose=[0.4, 0, 0.7, 1, 0, 0, 0])
    first, second = ((tmp_path / name / "000000.instances.png").read_bytes() for name in "ab")
    assert first == second
    assert open_results(tmp_path / "b").detection("000000").coordinates == "world"


@pytest.mark.parametrize("fused", [True, False])
def test_clouds_have_none(doo3d, refused, tmp_path, fused, capture):
    if fused:
        refused(capture(mask=True), "-o", "out", "--fuse-views", "--instances", code="options-conflict")
        with refuses("options-conflict", "instances=True"):
            api.run(capture("other"), tmp_path / "out", fuse_views=True, instances=True)
        return
    line = np.column_stack((np.linspace(0, 0.3, 900), np.zeros(900), np.full(900, 0.5)))
    np.save(tmp_path / "cloud.npy", line + np.random.default_rng(0).normal(0, 0.002, line.shape))
    code, printed, err = doo3d("detect", tmp_path / "cloud.npy", "-o", "out", "--instances")
    assert code == 2
    assert "a cloud has none" in printed + err
    assert code_in(printed + err)
