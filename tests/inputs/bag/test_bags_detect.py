"""The command line on a bag: detection as in the folder of the same scene."""

from __future__ import annotations

import json

import numpy as np
import pytest
from builders.paths import SAMPLES

pytest.importorskip("rosbags")
from builders.bags import KINDS, SECOND, BagScript

from doo3d.inputs import open_capture

CROSSING = SAMPLES / "crossing"


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_detection_in_a_bag_equals_that_in_the_folder(doo3d, tmp_path, kind):
    made = BagScript(kind)
    frame_ref = open_capture(CROSSING).frames[0]
    frame = frame_ref.load().data
    camera = frame.camera
    made.image("/cam/aligned_depth_to_color/image_raw", SECOND, np.rint(frame.depth * 1000).astype(np.uint16), "16UC1")
    made.image("/cam/color/image_raw", SECOND, frame.color, "rgb8")
    for name in ("aligned_depth_to_color", "color"):
        made.info(f"/cam/{name}/camera_info", (camera.width, camera.height), (camera.fx, camera.fy, camera.cx, camera.cy))
    bag = made.write(tmp_path / ("bag" if kind != "ros1" else "a.bag"))
    there = open_capture(bag).frames[0].load().data
    assert np.abs(there.depth - frame.depth).max() <= 0.0005
    code, said, wrong = doo3d("detect", bag, "-o", "out")
    assert code == 0, wrong
    assert "1 chain" in said
    assert doo3d("detect", CROSSING, "-o", "folder")[0] == 0
    chains = [json.loads((tmp_path / where / "000000.json").read_text())["chains"] for where in ("out", "folder")]
    lengths = [chain["length"] for (chain,) in chains]
    assert lengths[0] == pytest.approx(lengths[1], abs=0.011)
    ends = [np.array(chain["joints"])[[0, -1]] for (chain,) in chains]
    assert np.abs(ends[0] - ends[1]).max() < 0.01


def test_truncated_bag_from_the_shell(doo3d, tmp_path, capture):
    frame = open_capture(capture()).frames[0].load().data
    made = BagScript("ros1")
    camera = frame.camera
    made.info("/depth/camera_info", (camera.width, camera.height), (camera.fx, camera.fy, camera.cx, camera.cy))
    for i in range(8):
        made.image("/depth/image", SECOND * (i + 1), np.rint(frame.depth * 1000).astype(np.uint16), "16UC1")
    path = made.write(tmp_path / "a.bag")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    code, said, wrong = doo3d("detect", path, "-o", "out")
    assert code == 1
    assert path.name in said + wrong
    assert len(list((tmp_path / "out").glob("0*.json"))) in (3, 4)


def test_missing_topic_from_the_shell(refused, tmp_path):
    made = BagScript("mcap")
    made.image("/depth/image", SECOND, np.ones((4, 4), np.uint16), "16UC1")
    path = made.write(tmp_path / "bag")
    assert "/depth/image" in refused(path, "--input-option", "depth_topic=/nowhere", "-o", "out", code="topic-missing")


def test_image_mode_reads_the_color(doo3d, tmp_path):
    photo = open_capture(CROSSING.parent / "photos" / "loop.jpg").frames[0].load()
    made = BagScript("ros1")
    made.image("/camera/image_raw", SECOND, photo.data.color, "rgb8")
    path = made.write(tmp_path / "a.bag")
    code, _, wrong = doo3d("detect", path, "-o", "out", "-c", "image", "--mask", CROSSING.parent / "photos" / "mask" / "loop.png")
    assert code == 0, wrong
    assert len(json.loads((tmp_path / "out" / "000000.json").read_text())["chains"]) == 1
