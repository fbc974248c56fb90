"""Meshes: points drawn evenly on their faces."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from builders.errors import refused

from doo3d import detect, load_config
from doo3d.inputs import open_capture

RADIUS = 0.01
BEND = np.array([(0.1 * np.sin(turn), 0.1 * np.cos(turn), 0) for turn in np.linspace(0, 4, 17)])  # 0.4 m


def hose() -> trimesh.Trimesh:
    """A bent hose of rings 25 mm apart, as CAD programs export it."""
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    section = np.stack([np.cos(turn), np.sin(turn)], axis=1) * RADIUS
    outward = BEND / 0.1
    vertices = (BEND[:, None] + section[:, :1] * outward[:, None] + section[:, 1:] * (0, 0, 1)).reshape(-1, 3)
    ring = np.arange(12)
    following = (ring + 1) % 12
    first = np.concatenate(
        [np.stack([ring, following, ring + 12], axis=1), np.stack([following, following + 12, ring + 12], axis=1)]
    )
    return trimesh.Trimesh(vertices, np.concatenate([first + 12 * i for i in range(len(BEND) - 1)]), process=False)


def exported(path, mesh: trimesh.Trimesh | None = None, **options):
    (mesh or hose()).export(path, **options)
    return path


@pytest.mark.parametrize(("name", "options"), [
    ("a.ply", {}), ("a.ply", {"encoding": "ascii"}), ("a.obj", {}), ("a.stl", {}), ("a.stl", {"file_type": "stl_ascii"}),
    ("a.off", {}),
])  # fmt: skip
def test_points_lie_on_the_faces(tmp_path, name, options):
    capture = open_capture(exported(tmp_path / name, **options))
    assert "is a mesh" in capture.notes[0]
    points = capture[0].load().data.points
    assert len(points) == 100_000
    assert np.array_equal(points, capture[0].load().data.points)
    along = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.1, points[:, 2])
    assert along.min() > 0.85 * RADIUS  # of the chords
    assert along.max() < 1.1 * RADIUS


def test_hose_is_found(tmp_path):
    frame = open_capture(exported(tmp_path / "a.obj"))[0].load().data
    (chain,) = detect(frame, load_config("default", {"fit.segment_length": 0.01})).chains
    assert abs(chain.length - 0.4) < 0.02
    assert abs(chain.radius - RADIUS) < 0.001


def test_colors_of_vertices(tmp_path):
    mesh = hose()
    mesh.visual.vertex_colors = np.tile((200, 30, 60, 255), (len(mesh.vertices), 1)).astype(np.uint8)
    for name in ("a.ply", "a.obj"):
        colors = open_capture(exported(tmp_path / name, mesh))[0].load().data.colors
        assert (np.abs(colors.astype(int) - (200, 30, 60)) <= 1).all()


def test_vertices_without_faces(tmp_path):
    (tmp_path / "a.obj").write_text("# points\nv 0 0 1\nv 0.5 0 1\nv 1 0 1\n")
    assert open_capture(tmp_path / "a.obj")[0].load().data.points.tolist() == [[0, 0, 1], [0.5, 0, 1], [1, 0, 1]]


@pytest.mark.parametrize(("name", "content", "code"), [
    ("a.stl", b"x" * 80 + (2**31).to_bytes(4, "little"), "file-damaged"),
    ("a.stl", b"x" * 80 + (9).to_bytes(4, "little"), "file-damaged"),
    ("a.stl", b"\0" * 30, "file-damaged"),
    ("a.obj", b"v 0 0 1\nv 1 0 1\nf 1 2 9\n", "file-damaged"),
    ("a.obj", b"v 0 0 1\nv 1 0 1\nv 2 0 1\nf 1 2 3\n", "file-damaged"),
    ("a.obj", b"v nan 0 1\nv 1 0 1\nv 2 1 1\nf 1 2 3\n", "file-damaged"),
    ("a.obj", b"v a b c\n", "file-damaged"),
    ("a.obj", b"o nothing\n", "cloud-empty"),
    ("a.off", b"OFF\n3 1 0\n", "file-damaged"),
    ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nelement face 99999999999\nend_header\n", "size-too-large"),
    ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nelement face 999\nend_header\n", "file-damaged"),
])  # fmt: skip
def test_damaged_mesh(tmp_path, name, content, code):
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, code, name, index=0)


def test_folder_of_meshes(tmp_path):
    exported(tmp_path / "b.stl")
    exported(tmp_path / "a.obj")
    (tmp_path / "a.mtl").write_text("newmtl a\n")
    assert [frame.name for frame in open_capture(tmp_path)] == ["a", "b"]
