"""The measurement of rigs: chains drawn into the views of a pair, and rendered pairs and rigs scored."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from builders.pairs import BASELINE, CAMERA, drawn_pair, stereo_pair, view, wave, write_image
from builders.paths import DATA

import doo3d
from doo3d.evaluation.benchmark import rigs
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.inputs.rig.calibration_files import read_stereo_pair
from doo3d.types import Chain

ZED_PAIRS = DATA / "zed_pairs"


def chain(curve, offset=0.0):
    nodes = Chain(curve[::1499], float(np.linalg.norm(curve[-1] - curve[0])), 0.004)
    return nodes if offset == 0 else Chain(nodes.joints + np.array([0.0, offset, 0.0]), nodes.segment_length, 0.004)


def test_a_chain_drawn_where_it_is_covers_the_mask_of_either_view():
    curve = np.linspace((-0.05, -0.05, 0.7), (0.1, 0.05, 0.65), 1500)
    for side in (0, 1):
        mask = view([curve], side * BASELINE)[1]
        covered, near, distance = rigs.drawn_into([chain(curve)], stereo_pair().rectified(), side, mask)
        assert covered > 0.9
        assert near > 0.99
        assert distance <= 1


def test_a_chain_beside_the_mask_covers_none_of_it():
    curve = np.linspace((-0.05, -0.05, 0.7), (0.1, 0.05, 0.65), 1500)
    covered, _, distance = rigs.drawn_into([chain(curve, 0.03)], stereo_pair().rectified(), 1, view([curve], BASELINE)[1])
    assert covered == 0
    assert distance > 10


def test_nothing_found_is_infinitely_far():
    mask = view([wave()], 0.0)[1]
    assert rigs.drawn_into([], stereo_pair().rectified(), 0, mask) == (0.0, 0.0, float("inf"))


def test_a_folder_of_pairs_gives_a_row_each_and_the_worst(tmp_path):
    images = drawn_pair([wave()])
    for side in ("left", "right"):
        write_image(tmp_path / side / "0.png", getattr(images, side))
        write_image(tmp_path / side / "mask" / "0.png", getattr(images, f"{side}_mask"))
    pinhole = [CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy]
    cameras = [
        {"name": name, "images": name, "intrinsics": pinhole, "pose": [x, 0, 0, 0, 0, 0, 1]}
        for name, x in (("left", 0), ("right", BASELINE))
    ]
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump({"cameras": cameras}))
    lines = list(rigs.real_pairs(tmp_path, tmp_path / "rig.yaml", None, left_only=True))
    assert lines[2].startswith("| 0 | 1 |")
    assert lines[-1].startswith("| least")


@pytest.mark.slow
def test_a_rendered_pair_and_a_rig_are_right():
    scene = make_scene("open", 1, (640, 480))
    config = doo3d.load_config()
    assert rigs.pair_score(scene, config, 1).image_correct
    blocked, views = rigs.hidden_views(scene, 0)
    assert rigs.rig_score(blocked, views, config).correct


@pytest.mark.skipif(not ZED_PAIRS.is_dir(), reason="the pairs are not part of the project")
def test_chains_of_real_pairs_cover_the_mask_of_the_view_that_was_not_used():
    cells = list(rigs.real_pairs(ZED_PAIRS, ZED_PAIRS / "zed_2i_cal_data.yaml", None, left_only=True))[-1].split("|")
    assert float(cells[6].strip(" %")) > 97
    assert float(cells[8]) <= 1.5


@pytest.mark.skipif(not ZED_PAIRS.is_dir(), reason="the pairs are not part of the project")
def test_the_factory_calibration_fits_its_images():
    pair = read_stereo_pair([ZED_PAIRS / "zed_2i_cal_data.yaml"], (1280, 720), None)
    assert pair.baseline == pytest.approx(0.1197, abs=1e-4)
