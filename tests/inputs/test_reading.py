from pathlib import Path

import pytest

from doo3d.errors import InputError
from doo3d.inputs import Reading


def test_values_are_yaml():
    given = Reading.of(
        ["depth_topic=/camera/depth", "depth_scale=5000", "camera=[525, 525, 319.5, 239.5]", "trajectory=poses.txt"]
    )
    assert given.depth_topic == "/camera/depth"
    assert given.depth_scale == 5000
    assert given.camera == (525, 525, 319.5, 239.5)
    assert given.trajectory == Path("poses.txt")
    assert Reading.of([]) == Reading()


@pytest.mark.parametrize(
    ("pair", "says"),
    [
        ("depth_scale", "depth_scale: expected key=value"),
        ("depth_scale=-1", "depth_scale: .*greater than 0"),
        ("depht_scale=1", "depht_scale: .*; there are color_topic"),
        ("camera=[1, 2]", "camera"),
        ("camera=[1, 2", "cannot be read as YAML"),
    ],
)
def test_what_cannot_be_is_said(pair, says):
    with pytest.raises(InputError, match=f"--read {says}" if not pair.endswith("2") else says):
        Reading.of([pair])
