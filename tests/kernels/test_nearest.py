import numpy as np
import pytest
from scipy.spatial import cKDTree

from doo3d.kernels import fill_cells, nearest, nearest_of_own, neighborhood_spreads, points_around


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("limited", [True, False])
@pytest.mark.parametrize("scattered", [True, False])
def test_nearest_is_that_of_a_tree(dim, limited, scattered):
    rng = np.random.default_rng(dim)
    t = np.linspace(0, 20, 300)
    places = np.column_stack([200 * np.cos(t) + 10 * t, 200 * np.sin(0.7 * t), 5 * t])[:, :dim].copy()
    points = places[rng.integers(0, 300, 4000)] + rng.normal(0, 20, (4000, dim))
    if not scattered:
        points = points[np.lexsort(points.T)]
    distance, found = nearest(points, places, 30.0, limited)
    true, place = cKDTree(places).query(points)
    within = true <= 30
    assert 0.05 < (~within).mean() < 0.5
    np.testing.assert_allclose(distance[within], true[within], rtol=1e-12)
    np.testing.assert_array_equal(found[within], place[within])
    if limited:
        assert np.isinf(distance[~within]).all()
    else:
        np.testing.assert_array_equal(found[~within], place[~within])


def test_of_places_equally_near_the_first_is_taken():
    places = np.array([(9.0, 9.0), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0)])
    distance, found = nearest(np.zeros((3, 2)), places, 2.0, True)
    assert distance.tolist() == [1, 1, 1]
    assert found.tolist() == [1, 1, 1]


def test_nothing_is_near_where_there_is_nothing():
    assert np.isinf(nearest(np.zeros((2, 3)), np.zeros((0, 3)), 1.0, False)[0]).all()
    assert len(nearest(np.zeros((0, 3)), np.zeros((4, 3)), 1.0, False)[0]) == 0


def test_of_own_targets_the_nearest_is_found():
    rng = np.random.default_rng(0)
    bounds, target_bounds = np.array([0, 20, 20, 50]), np.array([0, 30, 40, 45])
    points, targets = rng.normal(size=(50, 3)), rng.normal(size=(45, 3))
    found = nearest_of_own(points, bounds, targets, target_bounds, 0.3)
    assert found[:20].tolist() == cKDTree(targets[:30]).query(points[:20])[1].tolist()
    assert found[20:].tolist() == (40 + cKDTree(targets[40:]).query(points[20:])[1]).tolist()


@pytest.mark.parametrize("reach", [0.05, 0.4, 9.0])
def test_neighborhoods_are_those_of_a_tree(reach):
    rng = np.random.default_rng(0)
    points, centers = rng.normal(size=(500, 3)), rng.normal(size=(20, 3))
    points[7] = np.nan
    finite = np.delete(points, 7, axis=0)
    lists = [
        finite[index] - center for index, center in zip(cKDTree(finite).query_ball_point(centers, reach), centers, strict=True)
    ]
    counts, means, covariances = neighborhood_spreads(points, centers, reach)
    assert counts.tolist() == [len(each) for each in lists]
    filled = [each if len(each) else np.zeros((1, 3)) for each in lists]
    np.testing.assert_allclose(means, [each.mean(axis=0) for each in filled], atol=1e-12)
    np.testing.assert_allclose(covariances, [np.cov(each.T, ddof=0).ravel() for each in filled], atol=1e-9)
    axes = np.linalg.qr(rng.normal(size=(20, 3, 3)))[0][:, :2].copy()
    cells = [np.floor((each - mean) @ axis.T / 0.1) for each, mean, axis in zip(lists, means, axes, strict=True)]
    for k, each in enumerate(cells):
        occupied = len(np.unique(each, axis=0))
        at = (centers[k : k + 1], reach, counts[k : k + 1], means[k : k + 1], axes[k : k + 1].reshape(1, 6), 0.1)
        assert not occupied or fill_cells(points, *at, occupied - 0.5).all()
        assert not fill_cells(points, *at, occupied).any()


@pytest.mark.parametrize("spread", [1.0, 1e3, 1e9])
def test_points_around_positions_are_all_within_reach_and_few_others(spread):
    rng = np.random.default_rng(0)
    points, positions = rng.uniform(-20, 20, (5000, 2)), rng.uniform(-10, 10, (12, 2))
    points[7] = np.nan
    positions[0] *= spread
    found = points_around(points, positions, 0.7)
    distance = np.linalg.norm(np.where(np.isfinite(points), points, 1e6)[:, None] - positions, axis=2).min(axis=1)
    assert set(np.flatnonzero(distance <= 0.7)) <= set(found)
    assert (np.diff(found) > 0).all()
    assert spread > 1 or distance[found].max() < 8 * 0.7
    assert len(points_around(points, np.zeros((0, 2)), 0.7)) == 0


def test_points_around_positions_far_away_are_refused():
    with pytest.raises(ValueError, match="far away"):
        points_around(np.zeros((1, 2)), np.array([[1e200, 0.0]]), 1.0)
