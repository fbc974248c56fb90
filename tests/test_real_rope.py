"""Six real frames of a rope, which are not part of the repository: one chain from eye to eye in each."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from builders.paths import DATA
from scipy.spatial import cKDTree

import doo3d
from doo3d.geometry.polyline import angle, densify

FOLDER = DATA / "rope_d435"
FRAMES = ["000", "002", "004", "006", "008", "010"]

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the real frames are not here")


def depth_file(name):
    return cv2.imread(str(FOLDER / f"{name}_depth.png"), cv2.IMREAD_UNCHANGED)


def frame(name):
    values = json.loads((FOLDER / "camera.json").read_text())
    camera = doo3d.Camera(**{key: values[key] for key in ("fx", "fy", "cx", "cy", "width", "height")})
    return doo3d.Frame(None, (depth_file(name) * values["depth_scale"]).astype(np.float32), camera, name)


def check(joints, segment_length, cloud):
    """What holds for the rope in every frame: joints (N + 1, 3) m, cloud (N, 3) m."""
    assert segment_length == 0.01
    assert 0.93 <= (len(joints) - 1) * segment_length <= 1.07
    line = densify(joints, 0.001)
    covered = cKDTree(line).query(cloud)[0]
    assert np.mean(covered <= 0.010) >= 0.95
    assert cKDTree(cloud).query(line)[0].max() <= 0.040
    edges = np.diff(joints, axis=0)
    bend = np.degrees(angle(edges[1:], edges[:-1]))
    along = np.arange(1, len(joints) - 1) * segment_length
    inner = (along > 0.06) & (along < along[-1] + segment_length - 0.06)
    assert inner.sum() > 70
    assert bend[inner].max() <= 50


def cloud_of(data):
    v, u = np.nonzero(data.depth > 0)
    return data.camera.unproject(np.column_stack((u, v)), data.depth[v, u])


@pytest.mark.parametrize("name", FRAMES)
def test_one_chain_from_eye_to_eye(name):
    data = frame(name)
    detection = doo3d.detect(data, mask=data.depth > 0)
    (chain,) = detection.chains
    check(chain.joints, chain.segment_length, cloud_of(data))


def test_from_the_shell(doo3d, tmp_path):
    """The frames laid out as a capture: depth/ and camera_intrinsic.json."""
    values = json.loads((FOLDER / "camera.json").read_text())
    matrix = [values["fx"], 0, 0, 0, values["fy"], 0, values["cx"], values["cy"], 1]
    intrinsics = {"width": values["width"], "height": values["height"], "intrinsic_matrix": matrix, "depth_scale": 1000.0}
    (tmp_path / "rope" / "depth").mkdir(parents=True)
    (tmp_path / "rope" / "camera_intrinsic.json").write_text(json.dumps(intrinsics))
    for name in FRAMES:
        data = (FOLDER / f"{name}_depth.png").read_bytes()
        (tmp_path / "rope" / "depth" / f"{name}.png").write_bytes(data)
    code, out, err = doo3d("detect", "rope", "-o", "found", "--set", "segment.method=everything")
    assert code == 0, err
    assert len(out.splitlines()) >= len(FRAMES)
    for name in FRAMES:
        document = json.loads((tmp_path / "found" / f"{name}.json").read_text())
        (chain,) = document["chains"]
        check(np.array(chain["joints"]), chain["segment_length"], cloud_of(frame(name)))
        assert (tmp_path / "found" / f"{name}.jpg").stat().st_size > 1000
