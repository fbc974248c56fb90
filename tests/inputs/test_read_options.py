from pathlib import Path

import pytest
from builders.errors import refuses

from doo3d.inputs import ReadOptions


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
