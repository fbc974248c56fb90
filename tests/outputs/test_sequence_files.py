"""What the first pass of a sequence leaves of a frame is read as it was written."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from doo3d.errors import InputError
from doo3d.outputs import STRANDS
from doo3d.outputs.detection_json import encode
from doo3d.outputs.sequence_files import encode_strands, read_observation
from doo3d.track.background import BackgroundView
from doo3d.track.observations import Observation, ObservedStrand
from doo3d.track.strand_ends import CUT_OFF, TIP
from doo3d.types import Chain, Cloud, Detection

CHAIN = Chain(np.array([[0, 0, 0.6], [0.01, 0, 0.6], [0.02, 0, 0.6]]) + 1 / 3, 0.01, 0.0042)
ARCS = np.array([0.0, 0.01, 0.021])
VIEW = BackgroundView(np.linspace(0, 2, 12).reshape(3, 4).astype(np.float16), np.array([80, 80, 1.5, 1]))
OBSERVATION = Observation(
    Detection((CHAIN,), frame="one"),
    (
        ObservedStrand(CHAIN.joints, ARCS, 0.021, (TIP, CUT_OFF), 0, CHAIN.joints / 2, np.array([0.0, 0.7, 0.2])),
        ObservedStrand(CHAIN.joints[:2], ARCS[:2], 0.01, (CUT_OFF, CUT_OFF), -1),
    ),
    np.eye(4),
    VIEW,
    is_given=True,
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
    assert_same(read.background, VIEW)
    assert len(read.strands) == 2
    for strand, written in zip(read.strands, OBSERVATION.strands, strict=True):
        assert_same(strand, written)


@pytest.mark.parametrize("given", [(False, False), (True, False), (False, True)])
def test_what_the_caller_gave_is_read_as_it_was(folder, given):
    written = replace(OBSERVATION, background=None, is_given=given[0], object_given=given[1])
    (folder / f"one{STRANDS}").write_bytes(encode_strands(written))
    read = read_observation(folder, "one")
    assert (read.is_given, read.object_given, read.background) == (*given, None)


def test_a_frame_that_failed_shows_nothing(tmp_path):
    read = read_observation(tmp_path, "one")
    assert (read.strands, read.background) == ((), None)


@pytest.mark.parametrize(
    "damaged",
    [{"background": VIEW.to_dict() | {"inverse": "AA=="}}, {"background": [3]}, {"strands": [{}]}],
    ids=["few bytes", "no view", "no strand"],
)
def test_damaged_values_are_refused(folder, damaged):
    path = folder / f"one{STRANDS}"
    path.write_text(json.dumps(json.loads(path.read_text()) | damaged))
    with pytest.raises(InputError, match=f"one{STRANDS}"):
        read_observation(folder, "one")
