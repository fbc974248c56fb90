"""Clouds in texts of other programs, in arrays, and in PTX."""

from __future__ import annotations

import numpy as np
import pytest
from builders.errors import refused, refuses

from doo3d.inputs import ReadOptions, open_capture

POINTS = np.random.default_rng(0).uniform(-1, 1, (300, 3)).round(5)
COLORS = np.random.default_rng(1).integers(0, 256, (300, 3))


def rows(*columns, mark: str = " ") -> str:
    """The rows of a text file; each column is an array of numbers, or one text for all rows."""
    cells = [np.full(len(POINTS), column) if isinstance(column, str) else column.astype(str) for column in columns]
    return "".join(mark.join(row) + "\n" for row in zip(*cells, strict=True))


X, Y, Z = POINTS.T
R, G, B = COLORS.T
INTENSITY = np.arange(len(POINTS)) - 2047
COUNT = f"{len(POINTS)}\n"


def read(path, text: str | None = None):
    if text is not None:
        path.write_text(text, encoding="utf-8")
    opened = open_capture(path)
    assert opened.format == "cloud"
    return opened[0].load().data


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.pts", COUNT + rows(X, Y, Z, INTENSITY, R, G, B)),
        ("a.txt", "//X Y Z R G B\n" + COUNT + rows(X, Y, Z, R, G, B)),
        ("a.asc", "//X Y Z Intensity R G B Scalar field\n" + rows(X, Y, Z, INTENSITY, R, G, B, X)),
        ("a.csv", "x,y,z,r,g,b\n" + rows(X, Y, Z, R, G, B, mark=",")),
        ("b.csv", "\ufeff,R,G,B,X (m),Y (m),Z (m),label\n" + rows(INTENSITY, R, G, B, X, Y, Z, "a cable", mark=",")),
        ("c.csv", '"Points:0","Points:1","Points:2","red","green","blue"\n' + rows(X, Y, Z, R, G, B, mark=",")),
        ("d.csv", "# made by hand\nx;y;z;r;g;b\n" + rows(X, Y, Z, R, G, B, mark=";").replace(".", ",")),
        ("e.csv", "x\ty\tz\tr\tg\tb\n" + rows(X, Y, Z, R, G, B, mark="\t")),
        ("f.csv", "x,y,z,r,g,b\n" + rows(X, Y, Z, R / 255, G / 255, B / 255, mark=",")),
    ],
)
def test_texts_of_other_programs(tmp_path, name, text):
    cloud = read(tmp_path / name, text)
    assert np.array_equal(cloud.points, POINTS)
    assert np.array_equal(cloud.colors, COLORS)


def test_decimal_commas_without_names(tmp_path):
    cloud = read(tmp_path / "a.txt", rows(X, Y, Z, mark=";").replace(".", ","))
    assert np.array_equal(cloud.points, POINTS)


def test_pts_of_several_scans(tmp_path):
    cloud = read(tmp_path / "a.pts", 2 * (COUNT + rows(X, Y, Z)))
    assert np.array_equal(cloud.points, np.vstack([POINTS, POINTS]))


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("a.pts", "301\n" + rows(X, Y, Z), "file-damaged"),
        ("a.pts", "9" * 5000 + "\n" + rows(X, Y, Z), "file-damaged"),
        ("a.pts", "300\n", "cloud-empty"),
        ("a.pts", "hello\n", "file-damaged"),
        ("a.csv", "x,y,z\n1,2,3\n1,2\n", "file-damaged"),
        ("a.csv", "x,y,z\n1,2,3\n1,2,three\n", "file-damaged"),
        ("a.csv", "name,size\nrope,3\n", "format-unknown"),
        ("a.ptx", "2\n3\n", "file-damaged"),
    ],
)
def test_damaged_text(tmp_path, name, text, code):
    with refuses(code, name):
        read(tmp_path / name, text)


def ptx(points: np.ndarray, move: tuple[float, ...] = (0, 0, 0), cells: str = "") -> str:
    """A scan whose scanner is at `move`, turned by 90 degrees about z; the first of its cells has no measurement."""
    x, y, z = (points - move).T
    text = cells or "0 0 0 0.5 0 0 0\n" + rows(y, -x, z, INTENSITY / 4096, R, G, B)
    count, at = len(points) + 1, " ".join(map(str, move))
    return f"1\n{count}\n{at}\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n{at} 1\n{text}"


def test_ptx(tmp_path):
    cloud = read(tmp_path / "a.ptx", ptx(POINTS, (1, 2, 3)))
    assert np.allclose(cloud.points, POINTS, atol=1e-12)
    assert np.array_equal(cloud.colors, COLORS)
    assert cloud.viewpoint.tolist() == [1, 2, 3]
    cloud = read(tmp_path / "b.ptx", ptx(POINTS, (1, 2, 3)) + ptx(POINTS, (4, 5, 6)))
    assert np.allclose(cloud.points, np.vstack([POINTS, POINTS]), atol=1e-12)
    assert cloud.viewpoint is None


@pytest.mark.parametrize("text", [ptx(POINTS)[:-30], ptx(POINTS) + "7\n", ptx(POINTS).replace("301", "9" * 4000, 1)])
def test_damaged_ptx(tmp_path, text):
    with refuses("file-damaged", "a.ptx"):
        read(tmp_path / "a.ptx", text)


@pytest.mark.parametrize("shape", [(300, -1), (20, 15, -1)])
def test_arrays_of_points(tmp_path, shape):
    for name, columns, colors in (
        ("a.npy", [POINTS], None),
        ("b.npy", [POINTS, COLORS], COLORS),
        ("c.npy", [POINTS, COLORS / 255], COLORS),
        ("d.npy", [POINTS, POINTS], None),  # normals
        ("e.npy", [POINTS.astype(np.float32), INTENSITY[:, None].astype(np.float32), COLORS.astype(np.float32)], COLORS),
    ):
        np.save(tmp_path / name, np.hstack(columns).reshape(shape))
        cloud = read(tmp_path / name)
        assert np.allclose(cloud.points, POINTS, atol=1e-6)
        assert (cloud.colors is None) if colors is None else np.array_equal(cloud.colors, colors)


def test_array_with_points_that_are_not_finite(tmp_path):
    np.save(tmp_path / "a.npy", np.vstack([np.full((1, 6), np.nan), np.hstack([POINTS, COLORS])]))
    cloud = read(tmp_path / "a.npy")
    assert np.array_equal(cloud.colors, COLORS)


def test_damaged_array(tmp_path):
    np.save(tmp_path / "a.npy", POINTS)
    content = (tmp_path / "a.npy").read_bytes()
    for broken, code in ((content[:-5], "file-damaged"), (content.replace(b"(300, 3)", b"(99999999999, 3)"), "size-too-large")):
        (tmp_path / "a.npy").write_bytes(broken)
        with refuses(code, "a.npy"):
            read(tmp_path / "a.npy")


def test_folder_of_texts_and_arrays(tmp_path):
    np.save(tmp_path / "a.npy", POINTS)
    (tmp_path / "b.csv").write_text("x,y,z\n" + rows(X, Y, Z, mark=","))
    assert [frame.name for frame in open_capture(tmp_path)] == ["a", "b"]
    (tmp_path / "notes.txt").write_text("a note\n")
    refused(tmp_path, "folder-of-captures", "a.npy, b.csv")


def test_cloud_in_millimetres(tmp_path):
    (tmp_path / "a.ptx").write_text(ptx(1000 * POINTS, (1000, 2000, 3000)))
    cloud = open_capture(tmp_path / "a.ptx", options=ReadOptions(depth_scale=1000))[0].load().data
    assert np.allclose(cloud.points, POINTS, atol=1e-9)
    assert np.allclose(cloud.viewpoint, (1, 2, 3))
