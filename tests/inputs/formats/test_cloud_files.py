"""Cloud files: content and errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from builders.captures import cut
from builders.errors import refused

from doo3d.inputs import open_capture
from doo3d.inputs.support.open3d import open3d
from doo3d.types import Cloud

COUNT = 500


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(0.2, 1.0, (COUNT, 3))


@pytest.fixture
def colors():
    return np.random.default_rng(1).integers(0, 256, (COUNT, 3), dtype=np.uint8)


def write(path: Path, points, colors=None, **options) -> Path:
    o3d = open3d()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    if colors is not None:
        cloud.colors = o3d.utility.Vector3dVector(colors / 255.0)
    assert o3d.io.write_point_cloud(str(path), cloud, **options)
    return path


def read(path: Path) -> Cloud:
    opened = open_capture(path)
    assert opened.format == "cloud"
    (frame_ref,) = opened.frames
    data = frame_ref.load().data
    assert isinstance(data, Cloud)
    return data


@pytest.mark.parametrize("options", [{}, {"write_ascii": True}, {"compressed": True}], ids=["binary", "ascii", "compressed"])
@pytest.mark.parametrize("suffix", ["ply", "pcd"])
def test_points_and_colors(tmp_path, points, colors, suffix, options):
    cloud = read(write(tmp_path / f"a.{suffix}", points, colors, **options))
    assert cloud.name == "a"
    assert cloud.viewpoint is None
    assert np.abs(cloud.points - points).max() < 1e-6
    assert np.array_equal(cloud.colors, colors)


@pytest.mark.parametrize("suffix", ["ply", "pcd"])
def test_points_without_colors(tmp_path, points, suffix):
    assert read(write(tmp_path / f"a.{suffix}", points)).colors is None


@pytest.mark.parametrize(
    "line",
    ["{0} {1} {2}", "{0},{1},{2}", "{0}, {1}, {2}", "{0};{1};{2}", "{0}\t{1}\t{2}", "  {0}   {1} {2}  "],
)
def test_xyz_separators(tmp_path, points, line):
    path = tmp_path / "a.xyz"
    path.write_text("# made by hand\n" + "".join(line.format(*point) + "\n" for point in points.tolist()))
    cloud = read(path)
    assert np.array_equal(cloud.points, points)
    assert cloud.colors is None


def test_long_comment_is_skipped_quickly(tmp_path):
    path = tmp_path / "a.xyz"
    path.write_text("#" + " #" * 1500 + "\n0.1 0.2 0.3\n")
    assert read(path).points.tolist() == [[0.1, 0.2, 0.3]]


def test_pcd_without_its_comment(tmp_path, points):
    path = write(tmp_path / "a.pcd", points)
    path.write_bytes(path.read_bytes().partition(b"\n")[2])
    assert len(read(path.rename(tmp_path / "scan")).points) == COUNT


def test_xyz_with_colors_and_with_normals(tmp_path, points, colors):
    path = tmp_path / "a.xyz"
    np.savetxt(path, np.hstack([points, colors]))
    assert np.array_equal(read(path).colors, colors)
    np.savetxt(path, np.hstack([points, np.random.default_rng(2).uniform(-1, 1, points.shape)]))
    assert read(path).colors is None


def test_xyz_of_one_point(tmp_path):
    path = tmp_path / "a.xyz"
    path.write_text("0.1 0.2 0.3")
    assert read(path).points.tolist() == [[0.1, 0.2, 0.3]]


def test_npz(tmp_path, points, colors):
    np.savez(tmp_path / "a.npz", points=points, colors=colors)
    cloud = read(tmp_path / "a.npz")
    assert np.array_equal(cloud.points, points)
    assert np.array_equal(cloud.colors, colors)
    np.savez(tmp_path / "b.npz", points=points.astype(np.float32), colors=colors / 255.0)
    assert np.array_equal(read(tmp_path / "b.npz").colors, colors)


def test_format_is_detected_by_content_not_by_name(tmp_path, points):
    path = write(tmp_path / "a.ply", points).rename(tmp_path / "scan")
    assert len(read(path).points) == COUNT


def test_names_with_spaces_and_non_ascii_letters(tmp_path, points):
    for suffix in ("ply", "pcd"):
        cloud = read(write(tmp_path / f"Kabel über 電線 1.{suffix}", points))
        assert cloud.name == "Kabel über 電線 1"
        assert len(cloud.points) == COUNT


def test_non_finite_points_are_dropped(tmp_path, points):
    points[7] = np.nan
    assert len(read(write(tmp_path / "a.pcd", points)).points) == COUNT - 1


# --- what cannot be read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kept", [0.0, 0.001, 0.03, 0.5, 0.9, 0.998])
@pytest.mark.parametrize("options", [{}, {"write_ascii": True}, {"compressed": True}], ids=["binary", "ascii", "compressed"])
@pytest.mark.parametrize("suffix", ["ply", "pcd"])
def test_truncated(tmp_path, points, colors, suffix, options, kept, capfd):
    path = write(tmp_path / f"a.{suffix}", points, colors, **options)
    cut(path, kept)
    refused(path, "file-damaged" if path.stat().st_size else "file-empty", f"a.{suffix}", index=0)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.98])
def test_truncated_npz(tmp_path, points, kept):
    path = tmp_path / "a.npz"
    np.savez(path, points=points)
    cut(path, kept)
    refused(path, "file-damaged", "a.npz", index=0)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("1 2 3\n4 5\n6 7 8 9\n", "file-damaged"),
        ("1 2 3\n4 5 x\n", "file-damaged"),
        ("1 2\n3 4\n", "points-shape"),
        ("1 2 3\n4 5", "file-damaged"),
        ("# 1 2 3\n", "cloud-empty"),
    ],
)
def test_ragged_xyz(tmp_path, text, code):
    path = tmp_path / "a.xyz"
    path.write_text(text)
    refused(path, code, "a.xyz", index=0)


def test_no_points(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    (tmp_path / "a.ply").write_text(header)
    np.savez(tmp_path / "a.npz", points=np.zeros((0, 3)))
    np.savez(tmp_path / "nan.npz", points=np.full((4, 3), np.nan))
    for name in ("a.ply", "a.npz", "nan.npz"):
        refused(tmp_path / name, "cloud-empty", name, index=0)


def test_npz_without_points(tmp_path):
    np.savez(tmp_path / "a.npz", xyz=np.zeros((3, 3)))
    refused(tmp_path / "a.npz", "points-missing", "a.npz", "xyz", index=0)


@pytest.mark.parametrize(
    ("arrays", "code"),
    [
        ({"points": np.zeros((5, 2))}, "points-shape"),
        ({"points": np.array(["a", "b"])}, "points-shape"),
        ({"points": np.array([{"x": 1}], dtype=object)}, "file-damaged"),
        ({"points": np.ones((5, 3)), "colors": np.ones((4, 3), np.uint8)}, "colors-shape"),
        ({"points": np.ones((5, 3)), "colors": np.full((5, 3), 7.5)}, "color-type"),
    ],
)
def test_npz_with_wrong_arrays(tmp_path, arrays, code):
    np.savez(tmp_path / "a.npz", **arrays)
    refused(tmp_path / "a.npz", code, "a.npz", index=0)
