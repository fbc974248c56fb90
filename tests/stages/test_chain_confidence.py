"""The confidence of a chain falls with every kind of evidence against it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, frame_of, line, wave

import doo3d
from doo3d.pipeline import run_stages
from doo3d.stages.confidence import WEIGHTS, Evidence, with_confidence
from doo3d.types import Connection, Crossing, SegmentRef

STRAIGHT = line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5])


def stages_of(axis=STRAIGHT, radius=0.004):
    frame, mask = frame_of(axis, radius=radius)
    return run_stages(frame, doo3d.load_config("default"), mask)


@pytest.fixture(scope="module")
def plain():
    """The stages of a straight cable, which is easy."""
    return stages_of()


def evidence_of(stages, chains=None, crossings=(), dropped=0.0, **changes) -> Evidence:
    context = stages.context.seen_from(replace(stages.context.foreground, **changes))
    return with_confidence(stages.chains if chains is None else chains, crossings, dropped, context)[1][0]


def test_nothing_speaks_against_a_plain_cable(plain):
    (evidence,) = plain.evidence
    assert evidence.confidence == plain.chains[0].confidence > 0.95
    assert [getattr(evidence, name) for name in ("joins", "undecided", "beside", "unclaimed", "dropped")] == [0.0] * 5
    assert evidence.bend < 0.1
    assert evidence.residual < 0.4


@pytest.mark.parametrize("name", [name for name, weight in WEIGHTS.items() if weight])
def test_each_kind_of_evidence_lowers_the_confidence(name):
    values = [Evidence(**{name: amount}).confidence for amount in (0.0, 0.2, 0.5, 1.0)]
    assert all(more > less for more, less in itertools.pairwise(values))


def test_odds_of_independent_evidence_multiply():
    def odds(**amounts):
        value = Evidence(**amounts).confidence
        return value / (1 - value)

    assert odds(bend=0.3, joins=1.0) * odds() == pytest.approx(odds(bend=0.3) * odds(joins=1.0))


def test_depth_that_is_missing_or_torn_speaks_against_a_chain(plain):
    depth = np.array(plain.context.foreground.depth)
    missing, torn = depth.copy(), depth.copy()
    missing[:, 300:380] = 0
    torn[:, 300:380] += 0.02
    whole = plain.evidence[0]
    assert evidence_of(plain, depth=missing).unsupported > whole.unsupported + 0.3
    assert evidence_of(plain, depth=torn).unsupported > whole.unsupported + 0.3
    assert evidence_of(plain, depth=torn).residual == 3.0


def test_joins_crossings_and_dropped_pieces_speak_against_a_chain(plain):
    (chain,) = plain.chains
    joined = replace(chain, connections=(Connection(3, 0.5), Connection(9, 0.75)))
    assert evidence_of(plain, [joined]).joins == pytest.approx(np.log(1.75))
    crossing = Crossing(SegmentRef(0, 2), SegmentRef(0, 9), chain.joints[2], 0.25)
    assert evidence_of(plain, crossings=[crossing]).undecided == 0.75
    assert evidence_of(plain, dropped=10 * plain.context.radius).dropped == pytest.approx(0.5)
    assert evidence_of(plain, dropped=1.0).dropped == 1.0


def test_a_mask_that_no_chain_explains_speaks_against_all(plain):
    mask = np.array(plain.context.foreground.mask)
    more = mask.copy()
    more[20:40, 100:200] = True
    share = 2000 / more.sum()
    assert evidence_of(plain, mask=more).unclaimed == pytest.approx(np.sqrt(share), rel=0.02)


def test_a_strand_beside_another_one(plain):
    (chain,) = plain.chains
    near, far = (replace(chain, joints=chain.joints + np.array((0, offset, 0))) for offset in (0.007, 0.012))
    assert evidence_of(plain, [chain, near]).beside > 0.95
    assert evidence_of(plain, [chain, far]).beside == 0.0


def test_a_sharp_bend(plain):
    assert stages_of(wave()).evidence[0].bend > 2 * plain.evidence[0].bend


def test_clouds_and_images_have_no_depth_evidence():
    frame, mask = frame_of(STRAIGHT, radius=0.004)
    v, u = np.nonzero(mask)
    points = CAMERA.unproject(np.column_stack((u, v)), frame.depth[v, u])
    cloud = doo3d.detect(doo3d.Cloud(points, segmented=True))
    image = doo3d.detect(np.repeat(np.where(mask, 200, 30).astype(np.uint8)[..., None], 3, 2), doo3d.load_config("image"), mask)
    assert cloud.chains[0].confidence > 0.9
    assert image.chains[0].confidence > 0.9
