import numpy as np
import pytest
from scipy.spatial import cKDTree

from doo3d.kernels import nearest


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("reach", [30.0, np.inf])
@pytest.mark.parametrize("scattered", [True, False])
def test_nearest_is_that_of_a_tree(dim, reach, scattered):
    rng = np.random.default_rng(dim)
    t = np.linspace(0, 20, 300)
    places = np.column_stack([200 * np.cos(t) + 10 * t, 200 * np.sin(0.7 * t), 5 * t])[:, :dim].copy()
    points = places[rng.integers(0, 300, 4000)] + rng.normal(0, 20, (4000, dim))
    if not scattered:
        points = points[np.lexsort(points.T)]
    points[7] = np.nan
    distance, found = nearest(points, places, reach)
    true, place = cKDTree(places).query(np.nan_to_num(points, nan=1e9))
    within = true <= min(reach, 1e6)
    assert 0 < (~within).mean() < 0.5
    np.testing.assert_allclose(distance[within], true[within], rtol=1e-12)
    np.testing.assert_array_equal(found[within], place[within])
    assert np.isinf(distance[~within]).all()
    assert not found[~within].any()


@pytest.mark.parametrize("reach", [1.0, 2.0, np.inf])
def test_of_places_equally_near_the_first_is_taken(reach):
    places = np.array([(9.0, 9.0), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0), *np.full((40, 2), 5.0)])
    distance, found = nearest(np.array([(0.0, 0.0), (0.0, 0.0), (5.0, 5.0)]), places, reach)
    assert distance.tolist() == [1, 1, 0]
    assert found.tolist() == [1, 1, 4]


def test_nothing_is_near_where_there_is_nothing():
    assert np.isinf(nearest(np.zeros((2, 3)), np.zeros((0, 3)), 1.0)[0]).all()
    assert len(nearest(np.zeros((0, 3)), np.zeros((4, 3)), np.inf)[0]) == 0
