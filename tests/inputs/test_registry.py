"""Detection of the format of a path, and the errors for unknown ones."""

from __future__ import annotations

import numpy as np
import pytest
from builders.errors import refused, refuses

from doo3d.inputs import FORMATS, IMAGE_FORMATS, open_capture


def test_every_registered_class_can_be_imported():
    from doo3d.inputs import format_class

    for name in FORMATS:
        assert callable(format_class(name).can_read)


def test_missing_path(tmp_path):
    refused(tmp_path / "nowhere", "file-missing", "nowhere")


def test_empty_folder(tmp_path):
    refused(tmp_path, "folder-empty", str(tmp_path), "doo3d info --formats")


def test_folder_of_captures_names_them(capture):
    inside = capture("recordings/first")
    refused(inside.parent, "folder-of-captures", "recordings", "first")


def test_single_depth_image_has_the_camera_and_the_color_of_its_folder(capture):
    opened = open_capture(capture(mask=True) / "depth" / "000000.png")
    assert opened.format == "folder"
    (frame_ref,) = opened.frames
    loaded = frame_ref.load()
    assert loaded.data.camera.fx == 400
    assert loaded.data.color is not None
    assert loaded.mask is not None
    assert open_capture(opened.path, images_only=True).format in IMAGE_FORMATS


@pytest.mark.parametrize("flat", [False, True])
def test_clouds_are_clouds_in_both_modes(tmp_path, flat):
    np.savez(tmp_path / "a.npz", points=np.ones((3, 3)))
    assert open_capture(tmp_path / "a.npz", flat).format == "cloud"


@pytest.mark.parametrize("content", [b"", b"hello\n", bytes(range(256)), b"{}", b"\x89PNG"])
def test_unknown_file_says_where_the_formats_are(tmp_path, content):
    path = tmp_path / "a.bin"
    path.write_bytes(content)
    with refuses("format-unknown", "a.bin", "doo3d info --formats") as caught:
        open_capture(path)
    assert len(str(caught.value)) < 300 + len(str(path))


@pytest.mark.parametrize(
    ("name", "words"), [("a.csv", "x y z first"), ("a.npy", "(N, 3)"), ("a.glb", "OBJ"), ("a.zip", "unpack")]
)
def test_unknown_file_says_what_would_be_read(tmp_path, name, words):
    (tmp_path / name).write_bytes(b"nothing\n")
    refused(tmp_path / name, "format-unknown", name, words)


def test_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "a.npz"
    np.savez(path, points=np.ones((3, 3)))

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("pathlib.Path.open", refuse)
    refused(path, "file-unreadable", "a.npz", "Permission denied")


@pytest.mark.parametrize(
    ("files", "parts"),
    [
        (["a.zip", "b.zip"], ["2 .zip", "unpack"]),
        (["a.mat", "b.mat", "c.pdf"], ["2 .mat", "1 .pdf", "numpy.savez('capture.npz', depth=depth, K=K)"]),
        (["left/x.dat", "right/x.dat"], ["left/", "right/", "<frame>_depth.png"]),
        (["notes.md"], ["1 .md", "<frame>_depth.png", "camera.json"]),
    ],
)
def test_unknown_folder_is_answered_with_what_is_in_it_and_what_would_make_it_readable(tmp_path, files, parts):
    for file in files:
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_bytes(b"\x01\x02nothing known")
    refused(tmp_path, "format-unknown", str(tmp_path), "To make it readable", *parts)


@pytest.mark.parametrize(("name", "part"), [("a.zip", "unpack"), ("a.h5", "numpy.savez")])
def test_unknown_file_is_answered_with_what_would_make_it_readable(tmp_path, name, part):
    (tmp_path / name).write_bytes(b"\x01\x02nothing known")
    refused(tmp_path / name, "format-unknown", name, part)


def test_dataset_of_lerobot_is_named(tmp_path):
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "info.json").write_text('{"codebase_version": "v3.0"}')
    (tmp_path / "videos").mkdir()
    refused(tmp_path, "format-unknown", "LeRobotDataset", "numpy.savez")
