"""Each reading option changes what is read, or is refused: none is ignored, in any format."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from builders.paths import ROOT

from doo3d.errors import InputError
from doo3d.inputs import FORMATS, ReadOptions, open_capture
from doo3d.types import Cloud, Frame, Image

sys.path.insert(0, str(ROOT / "tests" / "campaigns"))

pytest.importorskip("rosbags")

SEEDS = {
    "bag": ("plain.bag", "plain_db3", "mcap", "cloud.bag"),
    "tum": ("tum",),
    "bop": ("bop",),
    "icl": ("icl",),
    "redwood": ("redwood",),
    "record3d": ("record.r3d",),
    "stray": ("stray",),
    "arrays": ("arrays.npz",),
    "lerobot": ("lerobot",),
    "pairs": ("pairs",),
    "folder": ("open3d", "roles", "npy", "scannet"),
    "cloud": ("binary.ply", "cloud.npz"),
    "photos": ("photos",),
    "video": ("a.avi",),
}
"""Format -> inputs of the fuzzer."""

OTHER_CAMERA = (71.0, 72.0, 30.0, 24.0)


@pytest.fixture(scope="module")
def seeds(tmp_path_factory):
    from fuzz_seeds import write_seeds

    folder = tmp_path_factory.mktemp("seeds")
    (folder / "other.json").write_text('{"fx": 71, "fy": 72, "cx": 30, "cy": 24}')
    (folder / "poses.txt").write_text("1.0 9 8 7 0 0 0 1\n")
    return write_seeds(folder), folder


def values_of(folder) -> dict[str, object]:
    return {
        "color_topic": "none",
        "depth_topic": "none",
        "info_topic": "/camera/color/camera_info",
        "cloud_topic": "/points",
        "tolerance": 0.0,
        "camera": OTHER_CAMERA,
        "camera_file": folder / "other.json",
        "depth_scale": 2500.0,
        "classification": 14,
        "color": "none",
        "trajectory": folder / "poses.txt",
        "cameras": folder / "rig.yaml",
        "pose": "0,0,5,0,0,0,1",
    }


def content(capture) -> list[object]:
    """Everything that a capture says and holds, as bytes and numbers that can be compared."""
    frames = []
    for ref in capture.frames:
        loaded = ref.load()
        data = loaded.data
        arrays = {Frame: ("color", "depth"), Cloud: ("points", "colors"), Image: ("color",)}[type(data)]
        values = [getattr(data, name) for name in arrays] + [loaded.mask, loaded.pose, loaded.base_pose]
        shown = [None if value is None else np.asarray(value).tobytes() for value in values]
        frames.append((ref.name, type(data).__name__, getattr(data, "camera", None), shown))
    return frames


def test_every_option_is_tried():
    assert set(values_of(ROOT)) == set(ReadOptions.model_fields)
    assert set(SEEDS) >= {name for name in FORMATS if FORMATS.is_built_in(name)}


@pytest.mark.parametrize("name", [name for names in SEEDS.values() for name in names])
@pytest.mark.parametrize("option", ReadOptions.model_fields)
def test_each_option_changes_what_is_read_or_is_refused(seeds, name, option):
    files, folder = seeds
    if name not in files:
        pytest.skip("its library is not installed")
    is_image = name in ("photos", "a.avi")
    base = ReadOptions(camera=(60, 60, 31.5, 23.5)) if name in ("tum", "icl", "redwood") else ReadOptions()
    if name == "lerobot":
        base = ReadOptions(camera=(60, 60, 31.5, 23.5), color_topic="observation.images.top")
    before = content(open_capture(files[name], is_image, options=base))
    options = base.model_copy(update={option: getattr(ReadOptions(**{option: values_of(folder)[option]}), option)})
    if option == "camera_file":
        options = options.model_copy(update={"camera": None})
    try:
        after = content(open_capture(files[name], is_image, options=options))
    except InputError as error:
        after, refusal = None, error
    else:
        refusal = None
    if refusal is None:
        assert after != before or (name, option) in WITHOUT_EFFECT
    elif refusal.code == "option-unused":
        assert ("--camera" if option == "camera_file" else option) in str(refusal)
    else:
        assert refusal.code in EXPECTED.get(option, ()), refusal


EXPECTED = {
    "tolerance": ("times-apart",),
    "cloud_topic": ("topic-missing",),
    "depth_topic": ("topic-missing",),
    "color_topic": ("topic-missing",),
    "info_topic": ("topic-missing",),
    "trajectory": ("frame-count", "times-apart"),
}
WITHOUT_EFFECT = {
    *((name, "tolerance") for name in ("plain.bag", "plain_db3", "mcap", "redwood")),  # color and depth of one time
    *((name, "info_topic") for name in ("plain.bag", "plain_db3", "mcap")),  # the same intrinsics
    ("cloud.bag", "cloud_topic"),  # the topic that is read anyway
    *(("cloud.bag", option) for option in ("depth_topic", "color_topic")),
}
