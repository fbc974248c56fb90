"""Standard deviations of joints in a sequence."""

import numpy as np
import pytest

from doo3d.track.deviations import WEIGHTS, deviation_terms, with_deviations
from doo3d.track.objects import SequenceObject
from doo3d.track.observations import Observation
from doo3d.track.shape import Shape
from doo3d.types import Chain, Detection

SEGMENTS, LENGTH, RADIUS = 10, 0.02, 0.005
ITEM = SequenceObject(0, SEGMENTS * LENGTH, RADIUS, SEGMENTS, ())
LINE = np.column_stack((np.arange(SEGMENTS + 1) * LENGTH, np.zeros(SEGMENTS + 1), np.ones(SEGMENTS + 1)))


def shape(seen, shift=0.0):
    seen = np.array(seen, dtype=bool)
    return Shape(LINE + np.array((0, shift, 0)), seen, np.zeros(len(seen), int), 0.0, ~seen, seen)


def observation(deviations):
    chains = () if deviations is None else (Chain(LINE, LENGTH, RADIUS, deviations=deviations),)
    return Observation(Detection(chains), ())


ALL, LEFT = np.ones(SEGMENTS + 1, bool), np.arange(SEGMENTS + 1) < 4
OWN = 1e-4 * np.column_stack((1 + np.arange(SEGMENTS + 1), 2 * np.ones(SEGMENTS + 1)))


def test_seen_joints_have_those_of_the_frame():
    terms = deviation_terms(ITEM, [shape(ALL)], [observation(OWN)], False)
    np.testing.assert_allclose(terms[0, :, 0], OWN)
    assert (terms[0, :, 1] == 0).all()


@pytest.mark.parametrize("past_only", [False, True])
def test_hidden_joints_have_more_with_the_way_and_the_time_to_where_they_were_seen(past_only):
    frames = [shape(ALL), shape(ALL), *[shape(LEFT, 0.01 * k) for k in range(1, 7)], shape(ALL, 0.07)]
    frames[1] = shape(ALL, 0.01)
    terms = deviation_terms(ITEM, frames, [observation(OWN)] * len(frames), past_only)[:, :, 1, 0]
    assert (np.diff(terms[2:8, 4:], axis=1) > 0).all()
    assert (terms[2:8, :4] == 0).all()
    assert (np.diff(terms[2:8, -1]) > 0).all() == past_only
    assert (terms[2:8, -1] < (SEGMENTS - 3) * LENGTH).all()
    if not past_only:
        assert terms[2, -1] == pytest.approx(terms[7, -1])


def test_frames_that_show_nothing_have_the_usual_deviations():
    frames, observations = [shape(ALL), shape(~ALL), None], [observation(OWN), observation(None), observation(None)]
    found = with_deviations(ITEM, frames, observations, False)
    assert found[2] is None
    usual = np.median(OWN, axis=0)
    assert (found[1].deviations > WEIGHTS[0] * usual).all()
    assert with_deviations(ITEM, frames, [observation(None)] * 3, False)[0].deviations is None
