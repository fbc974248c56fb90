"""Detection in a stream: bad frames between good ones, ids that stay, the same chains as frame by frame."""

from __future__ import annotations

import numpy as np
import pytest
from builders.errors import refuses
from builders.paths import ROOT

import doo3d

POSE = (0.4, 0.0, 0.7, 1.0, 0.0, 0.0, 0.0)


def frames(name: str) -> list[doo3d.Frame]:
    return [reference.load().data for reference in doo3d.open_capture(ROOT / "sample_clouds" / name).frames]


def test_frames_that_cannot_be_used_leave_the_ids_as_they_are():
    detector, (first, second, third) = doo3d.Detector({"merge.chains": 1}), frames("crossing")
    before = detector.update(first).chains[0]
    with refuses("mask-shape"):
        detector.update(second, mask=np.ones((2, 2), bool))
    with pytest.raises(TypeError, match=r"doo3d\.Frame"):
        detector.update(None)
    dark = doo3d.Frame(None, np.zeros_like(second.depth), second.camera)
    with refuses("depth-none"):
        detector.update(dark)
    after = detector.update(third).chains[0]
    assert before.id == after.id == 0
    assert np.linalg.norm(before.joints[0] - after.joints[0]) < 0.05
    detector.reset()
    assert detector.update(first).chains[0].id == 0


def test_chains_are_those_of_detect_and_of_a_tracker():
    detector, tracker = doo3d.Detector("default", pose=POSE), doo3d.Tracker()
    for frame in frames("crossing")[:2]:
        alone = tracker.update(doo3d.detect(frame, pose=POSE))
        given = detector.update(frame)
        assert given.coordinates == "world"
        np.testing.assert_array_equal(given.chains[0].joints, alone.chains[0].joints)
        assert given.chains[0].id == alone.chains[0].id


def test_settings_are_checked_on_construction():
    with refuses("key-unknown", "merge.chains", kind=doo3d.ConfigError):
        doo3d.Detector({"merge.chain": 1})
    with pytest.raises(TypeError, match="preset"):
        doo3d.Detector(1)
