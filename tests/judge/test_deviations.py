"""The standard deviations of joints: what they hold, and that they are about as large as the errors."""

import numpy as np
import pytest
from builders.scenes import cloud_scene

import doo3d
from doo3d.evaluation.metrics.distances import joint_errors
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.model import Truth
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.geometry.curves import Curves
from doo3d.judge.deviations import deviations_of
from doo3d.scene.depth_support import DepthSupport

SIZE = (640, 360)


@pytest.fixture(scope="module")
def rendered():
    return [render(make_scene(family, 5, SIZE), "d435") for family in ("crossing", "occluded", "several")]


def found(scene, mask):
    detection = doo3d.detect(scene.frame, {"merge.chains": len(scene.truths)}, mask)
    return detection.chains, [joint_errors(chain, scene.truths) for chain in detection.chains]


@pytest.mark.parametrize("is_ragged", [False, True])
def test_most_errors_are_within_1_645_deviations(rendered, is_ragged):
    within, ratio = [], []
    for scene in rendered:
        mask = ragged_mask(scene.mask, np.random.default_rng(0)) if is_ragged else scene.mask
        for chain, errors in zip(*found(scene, mask), strict=True):
            known = np.isfinite(errors[:, 0])
            within.append((errors <= 1.645 * chain.deviations)[known])
            ratio.append(np.median(errors[known], axis=0) / np.median(chain.deviations, axis=0))
    assert (np.concatenate(within).mean(axis=0) > 0.75).all()
    assert (np.median(ratio, axis=0) > 0.1).all()


def test_hidden_joints_have_more(rendered):
    for chain in found(rendered[1], rendered[1].mask)[0]:
        hidden = np.append(chain.occluded, False) & np.append(False, chain.occluded)
        if hidden.any():
            assert (chain.deviations[hidden].mean(axis=0) > 2 * np.median(chain.deviations[~hidden], axis=0)).all()


def test_a_cloud_without_viewpoint_has_the_same_in_all_directions_and_an_image_has_none(rendered):
    turn = np.random.default_rng(0).uniform(0, 2 * np.pi, 6000)
    x = np.random.default_rng(1).uniform(0, 0.3, 6000)
    tube = np.column_stack((x, 0.005 * np.cos(turn), 0.005 * np.sin(turn)))
    (chain,) = doo3d.detect(doo3d.Cloud(tube), {"segment.method": "everything", "merge.chains": 1}).chains
    assert (chain.deviations[:, 0] == chain.deviations[:, 1]).all()
    assert (chain.deviations > 0).all()
    image = doo3d.detect(doo3d.Image(rendered[0].frame.color), "image", rendered[0].mask)
    assert image.chains
    assert all(chain.deviations is None for chain in image.chains)


def test_errors_of_joints_leave_out_what_is_along_the_axis():
    x = np.arange(0, 0.2, 4e-4)
    truth = Truth(np.column_stack((x, 0 * x, 0 * x + 0.5)), 0.004)
    joints = np.column_stack((np.linspace(0.013, 0.093, 9), np.full(9, 0.001), np.full(9, 0.502)))
    errors = joint_errors(doo3d.Chain(joints, 0.01, 0.004), (truth,))
    rays = joints / np.linalg.norm(joints, axis=1, keepdims=True)
    along = np.abs(rays @ (0, 0.001, 0.002))
    np.testing.assert_allclose(errors[:, 1], along, atol=2e-6)
    np.testing.assert_allclose((errors**2).sum(axis=1), 0.001**2 + 0.002**2, rtol=1e-2)
    assert np.isnan(joint_errors(doo3d.Chain(joints + 1.0, 0.01, 0.004), (truth,))).all()


@pytest.mark.parametrize("closed", [False, True])
def test_terms_of_a_chain_by_hand(closed):
    """The squared terms are pitch, noise, unsupported, residual, spread, bulge, roughness and hidden."""
    turn = np.linspace(0, 2 * np.pi, 9)
    joints = np.column_stack((np.cos(turn), np.sin(turn), np.full(9, 2.0)))
    joints[8] = joints[0]
    length = float(np.linalg.norm(joints[1] - joints[0]))
    radii, occluded = np.append(np.full(8, 0.1), np.nan), np.append(False, np.ones(7, bool))
    radii[3] = 0.4
    chain = doo3d.Chain(joints, length, 0.1, radii, occluded, closed=closed)
    share, residual = np.append(0.5, np.ones(7)), np.append([np.nan, 5.0], np.full(6, 0.2))
    support = DepthSupport(share, share > 2, residual, np.append([0.5, -4.0], np.full(6, np.nan)))
    (terms,) = deviations_of(Curves.of([joints]), [chain], support, cloud_scene(joints, np.zeros(3), 1e-4), np.eye(8))
    np.testing.assert_allclose(terms[:, 0], 1e-4)
    assert not terms[:, 1].any()
    np.testing.assert_allclose(terms[:, 2], 0.1 * np.append([0.5, 0.25], np.zeros(7)), atol=1e-12)
    np.testing.assert_allclose(terms[:, 3], 0.1 * np.append([3.0, 3.0, 3.0], np.full(6, 0.2)))
    np.testing.assert_allclose(terms[:, 4], 0.1 * np.sqrt((0.5**2 + 1) / 2))
    np.testing.assert_allclose(terms[:, 5], [0, 0, 0, 0.3, 0, 0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(terms[:, 6], 0.3 / 3)
    np.testing.assert_allclose(
        terms[:, 7], length * np.array([0, 0, 1, 2, 3, 3, 2, 1, 0] if closed else [0, 0, *range(1, 8)]), atol=1e-12
    )
