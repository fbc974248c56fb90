"""Masks of a stereo pair are found where people put them, and belong to the right camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from builders.errors import refuses
from builders.pairs import write_image

from doo3d.inputs.rig.pair_images import find_images, paired, with_masks

SHAPE = (24, 32)
LEFT = np.zeros(SHAPE, dtype=bool)
LEFT[4:8] = True
RIGHT = LEFT[:, ::-1] & (np.arange(SHAPE[1]) > 9)
BOTH = np.hstack([LEFT, RIGHT])
NO_FOLDERS = (None, None)


def image(width: int = SHAPE[1]) -> np.ndarray:
    return np.full((SHAPE[0], width, 3), 90, dtype=np.uint8)


def halves(folder: Path, given: Path | None = None):
    """The cameras of images that show both views side by side."""
    write_image(folder / "img_00.png", image(2 * SHAPE[1]))
    cameras = paired(*(find_images(folder, None, side, side) for side in ("left", "right")))
    return with_masks(cameras, folder, NO_FOLDERS, given)


def folders(folder: Path, given: Path | None = None, names: tuple[str, str] = ("left", "right")):
    """The cameras of images in a folder each."""
    for name in names:
        write_image(folder / name / "00.png", image())
    return with_masks(paired(*(find_images(folder, Path(name), name, None) for name in names)), folder, NO_FOLDERS, given)


def masks_of(cameras) -> list[np.ndarray | None]:
    return [camera.load(next(iter(camera.files)))[1] for camera in cameras]


@pytest.mark.parametrize("place", ["img_00_{side}_mask_0.png", "mask/img_00_{side}.png", "mask/{side}/img_00.png"])
def test_masks_with_the_name_of_the_camera_or_in_its_folder_are_its_own(tmp_path, place):
    write_image(tmp_path / place.format(side="left"), LEFT)
    write_image(tmp_path / place.format(side="right"), RIGHT)
    left, right = masks_of(halves(tmp_path))
    assert (left == LEFT).all()
    assert (right == RIGHT).all()


def test_masks_of_several_objects_are_one_mask(tmp_path):
    for k in range(2):
        write_image(tmp_path / f"img_00_left_mask_{k}.png", LEFT & (np.arange(SHAPE[0]) % 2 == k)[:, None])
    left, right = masks_of(halves(tmp_path))
    assert (left == LEFT).all()
    assert right is None


def test_a_mask_side_by_side_is_divided_like_the_images(tmp_path):
    write_image(tmp_path / "mask" / "img_00.png", BOTH)
    left, right = masks_of(halves(tmp_path))
    assert (left == LEFT).all()
    assert (right == RIGHT).all()


def test_masks_that_name_no_camera_are_of_the_left_view(tmp_path):
    write_image(tmp_path / "given" / "img_00.png", LEFT)
    left, right = masks_of(halves(tmp_path / "pairs", tmp_path / "given"))
    assert (left == LEFT).all()
    assert right is None
    left, right = masks_of(folders(tmp_path / "two", write_image(tmp_path / "one.png", LEFT)))
    assert (left == LEFT).all()
    assert right is None


@pytest.mark.parametrize("place", ["{side}/mask/00.png", "mask/{side}/00.png", "masks/00_{side}.png", "{side}/00_mask.png"])
def test_masks_of_two_folders_are_found(tmp_path, place):
    names = ("cam0", "cam1")
    for name, mask in zip(names, (LEFT, RIGHT), strict=True):
        write_image(tmp_path / place.format(side=name), mask)
    left, right = masks_of(folders(tmp_path, names=names))
    assert (left == LEFT).all()
    assert (right == RIGHT).all()


def test_masks_given_replace_those_beside_the_images(tmp_path):
    write_image(tmp_path / "pairs" / "mask" / "img_00.png", BOTH)
    write_image(tmp_path / "given" / "img_00.png", ~BOTH)
    assert (masks_of(halves(tmp_path / "pairs", tmp_path / "given"))[0] == ~LEFT).all()


def test_a_mask_that_does_not_exist_or_one_for_many_frames_is_refused(tmp_path):
    with refuses("file-missing", "gone.png"):
        halves(tmp_path, tmp_path / "gone.png")
    write_image(tmp_path / "img_01.png", image(2 * SHAPE[1]))
    with refuses("frame-count", "2 frames"):
        halves(tmp_path, write_image(tmp_path / "elsewhere" / "mask.png", LEFT))


def test_a_folder_without_masks_for_the_frames_is_refused(tmp_path):
    write_image(tmp_path / "given" / "other.png", LEFT)
    with refuses("mask-missing", "given"):
        halves(tmp_path / "pairs", tmp_path / "given")


def test_a_folder_of_masks_that_the_rig_file_names_has_to_hold_some(tmp_path):
    write_image(tmp_path / "img_00.png", image(2 * SHAPE[1]))
    cameras = paired(*(find_images(tmp_path, None, side, side) for side in ("left", "right")))
    with refuses("mask-missing", "labels", "left"):
        with_masks(cameras, tmp_path, (Path("labels"), None), None)


def test_images_of_both_cameras_in_one_folder_are_told_by_their_names(tmp_path):
    for k in range(2):
        for side in ("left", "right"):
            write_image(tmp_path / f"{k}_{side}.png", image())
    left, right = paired(*(find_images(tmp_path, None, side, None) for side in ("left", "right")))
    assert list(left.files) == list(right.files) == ["0", "1"]
    assert right.files["1"].name == "1_right.png"
