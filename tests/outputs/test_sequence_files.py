"""What the first pass of a sequence leaves of a frame is read as it was written."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from doo3d.camera.background import BackgroundView
from doo3d.errors import InputError
from doo3d.outputs import STRANDS
from doo3d.outputs.detection_json import encode
from doo3d.outputs.sequence_files import encode_strands, read_background, read_observation
from doo3d.track.depth_readings import NODES, PER_NODE
from doo3d.track.observations import Observation, ObservedStrand
from doo3d.track.strand_ends import CUT_OFF, TIP
from doo3d.types import Chain, Cloud, Detection

CHAIN = Chain(np.array([[0, 0, 0.6], [0.01, 0, 0.6], [0.02, 0, 0.6]]) + 1 / 3, 0.01, 0.0042)
ARCS = np.array([0.0, 0.01, 0.021])
VIEW = BackgroundView(
    np.arange(12, dtype=np.uint8).reshape(3, 4),
    np.linspace(0, 2, 12).reshape(3, 4).astype(np.float16),
    np.array([80, 80, 1.5, 1]),
)
OBSERVATION = Observation(
    Detection((CHAIN,), frame="one"),
    (
        ObservedStrand(CHAIN.joints, ARCS, 0.021, (TIP, CUT_OFF), 0, CHAIN.joints / 2, np.array([0.0, 0.7, 0.2])),
        ObservedStrand(CHAIN.joints[:2], ARCS[:2], 0.01, (CUT_OFF, CUT_OFF), -1),
    ),
    np.eye(4),
    VIEW,
    (np.where(np.arange(2 * NODES * PER_NODE) % 7, 1 / 3, np.nan).reshape(2, NODES, PER_NODE).astype(np.float32),),
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "one.json").write_bytes(encode(OBSERVATION.detection, Cloud(np.zeros((1, 3)))))
    (tmp_path / f"one{STRANDS}").write_bytes(encode_strands(OBSERVATION))
    return tmp_path


def assert_same(read, written):
    for field in fields(written):
        np.testing.assert_array_equal(getattr(read, field.name), getattr(written, field.name), err_msg=field.name)


def test_an_observation_is_read_as_it_was(folder):
    read = read_observation(folder, "one")
    np.testing.assert_array_equal(read.detection.chains[0].joints, CHAIN.joints)
    np.testing.assert_array_equal(read.pose, np.eye(4))
    np.testing.assert_array_equal(read.readings, OBSERVATION.readings)
    assert len(read.strands) == 2
    for strand, written in zip(read.strands, OBSERVATION.strands, strict=True):
        assert_same(strand, written)
    assert_same(read_background(folder, "one"), VIEW)


@pytest.mark.parametrize("readings", [["AAAA"], [3], None])
def test_damaged_readings_are_refused(folder, readings):
    path = folder / f"one{STRANDS}"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"readings": readings}))
    with pytest.raises(InputError, match=f"one{STRANDS}"):
        read_observation(folder, "one")


def test_readings_of_a_cloud_are_none(folder, tmp_path):
    path = folder / f"one{STRANDS}"
    path.write_bytes(encode_strands(replace(OBSERVATION, readings=(None,))))
    assert read_observation(folder, "one").readings == (None,)


def test_the_background_is_read_where_it_is_asked_for(folder):
    assert read_observation(folder, "one").background is None


def test_a_frame_that_failed_shows_nothing(tmp_path):
    assert read_observation(tmp_path, "one").strands == ()
    assert read_background(tmp_path, "one") is None


def test_a_damaged_background_is_refused(folder):
    path = folder / f"one{STRANDS}"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"background": {"shape": [3, 4], "gray": "AA=="}}))
    with pytest.raises(InputError, match=f"one{STRANDS}"):
        read_background(folder, "one")
