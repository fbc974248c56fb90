"""detect --debug-frame and view: files that the libraries of their formats open, and what is in them."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import cv2
import numpy as np
import pytest
import trimesh
from builders.errors import code_in, refuses
from builders.paths import SAMPLES

from doo3d.errors import MissingDependency
from doo3d.outputs.ply import encode_points
from doo3d.viz.backdrop import planar_backdrop
from doo3d.viz.stage_products import Product, draw_product

NAMES = ["1-mask", "2-voxels", "3-skeleton", "4-branches", "5-segments", "6-pruned", "7-merges", "8-chains"]


def read_ply(path):
    """Points and colors, by Open3D."""
    from doo3d.inputs.support.open3d import open3d

    cloud = open3d().io.read_point_cloud(str(path))
    return np.asarray(cloud.points), np.asarray(cloud.colors)


@pytest.mark.slow
def test_detect_keeps_the_stages(doo3d, tmp_path):
    code, out, err = doo3d("detect", SAMPLES / "crossing", "-o", "out", "--debug-frame", "0", "--debug-frame", "000002")
    assert code == 0, err
    assert out.count("files of its stages -> ") == 2
    assert sorted(path.name for path in (tmp_path / "out" / "stages").iterdir()) == ["000000", "000002"]
    folder = tmp_path / "out" / "stages" / "000000"
    expected = {f"{name}{suffix}" for name in NAMES for suffix in (".ply", ".png")} | {"explanation.json", "explanation.txt"}
    assert {path.name for path in folder.iterdir()} == expected
    joints = np.array(json.loads((tmp_path / "out" / "000000.json").read_text())["chains"][0]["joints"])
    points, _ = read_ply(folder / "8-chains.ply")
    np.testing.assert_allclose(points, joints, atol=1e-12)
    for name in NAMES:
        points, colors = read_ply(folder / f"{name}.ply")
        assert len(points) == len(colors) > 50
        assert cv2.imread(str(folder / f"{name}.png")).shape == (720, 1280, 3)
    assert "merges, in order:" in (folder / "explanation.txt").read_text()
    first = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert doo3d("detect", SAMPLES / "crossing", "-o", "out", "--debug-frame", "0")[0] == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == first


def test_stages_of_an_image_and_of_a_frame_without_chains(doo3d, tmp_path, capture):
    assert doo3d("detect", SAMPLES / "photos" / "loop.jpg", "-c", "image", "--debug-frame", "loop")[0] == 0
    points, _ = read_ply(tmp_path / "out" / "stages" / "loop" / "8-chains.ply")
    assert len(points) > 20
    assert not points[:, 2].any()
    assert doo3d("detect", capture(), "-o", "none", "--set", "fit.segment_length=9", "--debug-frame", "0")[0] == 0
    folder = tmp_path / "none" / "stages" / "000000"
    assert len(trimesh.load(folder / "2-voxels.ply").vertices) > 50
    assert b"element vertex 0\n" in (folder / "8-chains.ply").read_bytes()
    assert cv2.imread(str(folder / "8-chains.png")) is not None


def test_no_such_frame(refused, capture):
    assert "--debug-frame 5: " in refused(capture(), "--debug-frame", "5", code="frame-unknown")


def test_edges_of_a_ply(tmp_path):
    points = np.array([[0.0, 0], [1, 0], [1, 2]])
    edges = np.array([[0, 1], [1, 2]])
    (tmp_path / "line.ply").write_bytes(encode_points(points, np.full((3, 3), 7, np.uint8), edges))
    from doo3d.inputs.support.open3d import open3d

    lines = open3d().io.read_line_set(str(tmp_path / "line.ply"))
    np.testing.assert_array_equal(np.asarray(lines.lines), edges)
    np.testing.assert_array_equal(np.asarray(lines.points)[:, :2], points)


def test_a_product_is_drawn_where_it_is():
    image = np.full((80, 120, 3), 90, np.uint8)
    ends = np.array([[20.0, 40.0], [100.0, 40.0]])
    product = Product("x", ends, np.array([[250, 0, 0]] * 2, dtype=np.uint8), np.array([[0, 1]]))
    picture = draw_product(planar_backdrop(image), product).astype(int)
    red = picture[:, :, 0] - picture[:, :, 1] > 100
    assert red[40, 25:95].all()
    assert not red[:30].any()
    assert not red[50:].any()


def rerun(*args):
    """What rerun's own reader says."""
    done = subprocess.run([sys.executable, "-m", "rerun", *map(str, args)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_view_writes_a_recording(doo3d, tmp_path):
    pytest.importorskip("rerun")
    assert doo3d("detect", SAMPLES / "crossing", "-o", "out")[0] == 0
    code, out, err = doo3d("view", "out", "--save", "out.rrd")
    assert (code, out) == (0, "3 frames -> out.rrd\n"), err
    rerun("rrd", "verify", tmp_path / "out.rrd")
    said = rerun("rrd", "print", tmp_path / "out.rrd")
    for place in ("/image -", "/image/stages/1-mask", "/world/cloud", "/world/camera", "/merges", "/world/chains/0", "/summary"):
        assert place in said
    for name in NAMES[1:]:
        assert f"/world/stages/{name}/" in said
    code, _, err = doo3d("view", "out", "--save", "out.rrd")
    assert (code, code_in(err), "out.rrd" in err) == (2, "out-exists", True)
    code, _, err = doo3d("view", "out", "--save", "one.rrd", "--frame", "9")
    assert (code, code_in(err), "--frame 9: " in err) == (2, "frame-unknown", True)


@pytest.mark.slow
def test_view_without_the_capture_and_of_images(doo3d, tmp_path):
    pytest.importorskip("rerun")
    shutil.copytree(SAMPLES / "photos", tmp_path / "photos")
    assert doo3d("detect", "photos", "-o", "out", "-c", "image")[0] == 0
    code, _, err = doo3d("view", "out", "--save", "flat.rrd", "--frame", "loop", "--frame", "0")
    assert code == 0, err
    assert "/image/stages/8-chains/lines" in rerun("rrd", "print", tmp_path / "flat.rrd")
    shutil.rmtree(tmp_path / "photos")
    code, out, err = doo3d("view", "out", "--save", "gone.rrd")
    assert (code, out) == (0, "6 frames -> gone.rrd\n")
    assert "note: the capture cannot be read any more" in err
    said = rerun("rrd", "print", tmp_path / "gone.rrd")
    assert "/image/chains/0" in said
    assert "/image/stages" not in said.replace("/image/stages - data columns: [Clear", "")


def test_view_needs_results(doo3d, tmp_path, monkeypatch):
    code, _, err = doo3d("view", tmp_path, "--save", "x.rrd")
    assert (code, code_in(err)) == (2, "results-missing")
    monkeypatch.setitem(sys.modules, "rerun", None)
    from doo3d.outputs.run_reader import Results
    from doo3d.tools.rerun_viewer import RerunRecording

    with refuses("missing-package", "pip install 'doo3d[view]'", kind=MissingDependency):
        RerunRecording(Results(tmp_path, {}, ()), tmp_path / "x.rrd")
