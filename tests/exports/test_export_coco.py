"""COCO: what pycocotools reads are the labels, boxes and keypoints."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from builders.chains import CAMERA, VIEW, along, capture
from builders.errors import code_in, refuses
from builders.photos import cross, labelled, painted, save

import doo3d
from doo3d.exports.coco import compressed, run_lengths
from doo3d.outputs.run_reader import open_results
from doo3d.types import Detection, View

EMPTY, FULL, DOTS = np.zeros((7, 5), bool), np.ones((7, 5), bool), np.indices((7, 5)).sum(axis=0) % 2 > 0


def written(path, detections, **options):
    return json.loads(doo3d.export(detections, "coco", path, **options)[0].read_text())


@pytest.mark.parametrize(
    "mask", [EMPTY, FULL, DOTS, ~DOTS, labelled(cross()) > 0, np.random.default_rng(0).random((90, 70)) > 0.5]
)
def test_run_lengths_are_those_of_pycocotools(mask):
    counts = run_lengths(mask)
    assert sum(counts) == mask.size
    again = np.repeat(np.arange(len(counts)) % 2, counts).reshape(mask.shape[::-1]).T
    np.testing.assert_array_equal(again, mask)
    coco = pytest.importorskip("pycocotools.mask")
    assert compressed(counts).encode() == coco.encode(np.asfortranarray(mask.astype(np.uint8)))["counts"]


def test_run_lengths_of_a_large_image_are_written_as_known():
    assert compressed([0, 1, 2, 3, 1000, 5, 1]) == "0122Vo02iPO"  # by pycocotools 2.0.11


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # pycocotools and NumPy
def test_the_file_is_read_by_pycocotools(tmp_path):
    coco = pytest.importorskip("pycocotools.coco")
    detections = capture()
    read = coco.COCO(str(doo3d.export(detections, "coco", tmp_path / "a.json")[0]))
    assert [read.imgs[k]["file_name"] for k in (1, 2, 3)] == ["000000.jpg", "000001.jpg", "000002.jpg"]
    labels = detections[0].instance_labels()
    for k, item in enumerate(read.loadAnns(read.getAnnIds(imgIds=1)), start=1):
        mask = read.annToMask(item) > 0
        np.testing.assert_array_equal(mask, labels == k)
        rows, columns = np.nonzero(mask)
        assert item["area"] == mask.sum()
        assert item["bbox"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
        assert item["iscrowd"] == 0
    assert read.getAnnIds(imgIds=2) == []


def test_keypoints_are_the_nodes_in_the_image_with_flags(tmp_path):
    line = along(np.array([[-0.1, 0.0, 0.5], [0.405, 0.0, 0.5]]))
    line = replace(line, occluded=np.arange(len(line.occluded)) < 10, id=7)
    found = Detection((line,), frame="a", view=VIEW)
    values = written(tmp_path / "a.json", found, image_suffix=".png")
    (item,), (category,) = values["annotations"], values["categories"]
    points = np.reshape(item["keypoints"], (14, 3))
    pixels = CAMERA.project(line.nodes(14))
    inside = pixels[:, 0] < 639.5
    np.testing.assert_array_equal(points[:, 2], np.where(inside, np.where(line.nodes(14)[:, 0] < -0.004, 1, 2), 0))
    np.testing.assert_allclose(points[:, :2], np.where(inside[:, None], pixels, 0))
    assert 0 < item["num_keypoints"] == inside.sum() < 14
    assert (item["track_id"], item["confidence"]) == (7, 1.0)
    assert values["images"][0]["file_name"] == "a.png"
    assert (len(category["keypoints"]), category["skeleton"][0], category["skeleton"][-1]) == (14, [1, 2], [13, 14])
    base = np.array([[0, 0, 1, 0.3], [-1, 0, 0, 0], [0, -1, 0, 1.0], [0, 0, 0, 1]])
    moved = written(tmp_path / "b.json", found.transformed(base), count=5)
    np.testing.assert_allclose(np.reshape(moved["annotations"][0]["keypoints"], (5, 3))[0], points[0])


def test_a_run_needs_its_labels(doo3d, tmp_path):
    labels = labelled(cross())
    save(tmp_path / "photos/a.png", painted(labels))
    save(tmp_path / "masks/a.png", np.where(labels > 0, np.uint8(255), np.uint8(0)))
    detect = ("detect", "photos", "-o", "out", "-c", "image", "--mask", "masks")
    assert doo3d(*detect)[0] == 0
    code, _, err = doo3d("export", "out", "--to", "coco")
    assert (code, code_in(err)) == (2, "instances-missing")
    assert "doo3d detect --instances" in err
    assert doo3d(*detect, "--instances")[0] == 0
    assert doo3d("export", "out", "--to", "coco", "--count", "3")[:2] == (0, f"1 file -> {tmp_path / 'out.json'}\n")
    values = json.loads((tmp_path / "out.json").read_text())
    assert [item["area"] for item in values["annotations"]] == [
        int((open_results("out").detection("a").instance_labels() == k).sum()) for k in (1, 2)
    ]
    damaged = tmp_path / "out/a.instances.png"
    damaged.write_bytes(b"")
    with refuses("results-damaged", "a.instances.png"):
        open_results("out").detection("a").instance_labels()


def test_labels_of_a_file_follow_the_chains_that_are_left(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.repeat(np.arange(4, dtype=np.uint16), 5)[None].repeat(3, axis=0))
    view = View(20, 3, None, file=tmp_path / "a.png", numbers=(1, 2, 3))
    chains = [replace(chain, confidence=c) for chain, c in zip([*cross(), cross()[0]], (0.9, 0.0, 0.8), strict=True)]
    found = Detection(tuple(chains), "2d", "image", view=view)
    assert found.instance_labels()[0, ::5].tolist() == [0, 1, 2, 3]
    assert found.confident(0.5).instance_labels()[0, ::5].tolist() == [0, 1, 0, 2]
