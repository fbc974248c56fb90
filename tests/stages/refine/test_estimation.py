"""How well the depth of an axis is known, from the measurements alone."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.stages.refine.estimation import unrest
from doo3d.stages.refine.samples import Stations

RADIUS, HALF, COUNT = 0.004, 2, 2000


def stations(count: int = COUNT) -> Stations:
    along = 0.4 * RADIUS * np.arange(count)
    places = np.column_stack((along, np.zeros(count), 0.6 + 0.05 * np.sin(along / 0.2)))
    path = (np.arange(count) >= count // 2).astype(np.int64)
    return Stations(places, path, np.zeros(count, dtype=bool), [False, False], np.full(count, RADIUS), HALF, 0.4 * RADIUS)


@pytest.mark.parametrize("noise", [0.0001, 0.001])
def test_it_is_the_noise(noise):
    """On a gently bent course, with half of the places not measured at all and a step from one path to the next."""
    given = stations()
    away = np.tile([0.0, 0.0, 1.0], (COUNT, 1))
    places = given.places.copy()
    places[:, 2] += noise * np.random.default_rng(0).normal(size=COUNT) + 0.3 * given.path
    known = np.ones(COUNT, dtype=bool)
    known[: COUNT // 4] = False
    places[~known, 2] += 9.0
    assert unrest(places, away, known, given) == pytest.approx(noise / RADIUS, rel=0.12)


def test_of_too_few_places_nothing_is_known():
    few = stations(6)
    assert unrest(few.places, np.tile([0.0, 0.0, 1.0], (6, 1)), np.ones(6, dtype=bool), few) == 0
