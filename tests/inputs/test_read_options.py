import shutil
from pathlib import Path

import pytest
from builders.errors import refuses
from builders.paths import SAMPLES

from doo3d.inputs import ReadOptions, open_capture


def test_values_are_yaml():
    given = ReadOptions.from_pairs(
        ["depth_topic=/camera/depth", "depth_scale=5000", "camera=[525, 525, 319.5, 239.5]", "trajectory=poses.txt"]
    )
    assert given.depth_topic == "/camera/depth"
    assert given.depth_scale == 5000
    assert given.camera == (525, 525, 319.5, 239.5)
    assert given.trajectory == Path("poses.txt")
    assert ReadOptions.from_pairs([]) == ReadOptions()


@pytest.mark.parametrize(
    ("pair", "code", "part"),
    [
        ("depth_scale", "override-invalid", "depth_scale"),
        ("depth_scale=-1", "value-out-of-bounds", "depth_scale"),
        ("depht_scale=1", "key-unknown", "depht_scale"),
        ("camera=[1, 2]", "value-invalid", "camera"),
        ("camera=[1, 2", "yaml-invalid", "camera=[1, 2"),
    ],
)
def test_invalid_options(pair, code, part):
    with refuses(code, part):
        ReadOptions.from_pairs([pair])


def test_a_camera_is_a_file_or_four_numbers():
    assert ReadOptions.from_pairs(["camera=[1, 1, 1, 1]"], Path("922,922.5, 640,360")).camera == (922, 922.5, 640, 360)
    assert ReadOptions.from_pairs([], Path("a,b,c,d")).camera_file == Path("a,b,c,d").absolute()
    assert ReadOptions.from_pairs([], Path("camera.json")).camera_file == Path("camera.json").absolute()


def test_four_numbers_in_the_shell_and_in_python(doo3d, tmp_path):
    shutil.copytree(SAMPLES / "straight", tmp_path / "capture")
    code, out, _ = doo3d("info", "capture", "--camera", "900,901,640,360")
    assert (code, "900" in out, "901" in out) == (0, True, True)
    camera = open_capture("capture", camera="900,901,640,360")[0].load().data.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (900, 901, 640, 360)
