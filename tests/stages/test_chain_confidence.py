"""The confidence of a chain falls with every kind of evidence against it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, frame_of, line, wave

import doo3d
from doo3d.pipeline import _Clock, run_from_segmentation, run_stages
from doo3d.stages.confidence import Evidence, with_confidence
from doo3d.stages.confidence.evidence import TOLD, UNTOLD, UNTOLD_CLOUD, UNTOLD_IMAGE, UNTOLD_NETWORK
from doo3d.stages.confidence.looks import _straightness
from doo3d.stages.segment import segment
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
    config = doo3d.load_config("default", {"merge.chains": 1})
    return with_confidence(stages.chains if chains is None else chains, crossings, dropped, context, config)[1][0]


def test_nothing_speaks_against_a_plain_cable(plain):
    (evidence,) = plain.evidence
    assert evidence.confidence == plain.chains[0].confidence > 0.95
    assert [getattr(evidence, name) for name in ("joins", "undecided", "beside", "unclaimed", "dropped")] == [0.0] * 5
    assert evidence.bend < 0.1
    assert evidence.residual < 0.4


KINDS = [
    (name, how)
    for weights, how in (
        (TOLD, {}),
        (UNTOLD, {"is_told": False}),
        (UNTOLD_IMAGE, {"is_told": False, "is_planar": True}),
        (UNTOLD_NETWORK, {"is_told": False, "is_planar": True, "is_judged": True}),
    )
    for name in weights
    if name != "base"
]


@pytest.mark.parametrize(("name", "how"), KINDS)
def test_each_kind_of_evidence_lowers_the_confidence(name, how):
    values = [Evidence(**{name: amount}, **how).confidence for amount in (0.0, 0.2, 0.5, 1.0)]
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
    assert evidence_of(plain, mask=more, facts=None).unclaimed == pytest.approx(np.sqrt(share), rel=0.02)


def test_of_a_guessed_mask_only_the_parts_that_a_chain_runs_through_speak_against_it(plain):
    (chain,) = plain.chains
    mask = np.array(plain.context.foreground.mask)
    v, u = (int(np.median(each)) for each in np.nonzero(mask))
    elsewhere, attached = mask.copy(), mask.copy()
    elsewhere[20:40, 100:200] = True
    attached[20:v, u - 10 : u + 10] = True
    known = {"is_told": False, "is_clean": False, "facts": None}
    assert evidence_of(plain, mask=elsewhere, **known) == evidence_of(plain, mask=mask, **known)
    told, guessed = (evidence_of(plain, mask=attached, is_clean=clean, facts=None) for clean in (True, False))
    assert guessed.unclaimed == told.unclaimed > 0.3
    other = replace(chain, joints=chain.joints + np.array((0, 0.05, 0)))
    both = mask | np.roll(mask, 80, axis=0)
    assert evidence_of(plain, [chain, other], mask=both, **known).unclaimed == 0.0
    assert evidence_of(plain, [other], mask=mask, **known).unclaimed == 0.0  # off the mask, it runs through no part


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


def untold(evidence_stages, chains=None):
    """The evidence against the chains where nobody said what the object is, nor how many there are."""
    context = evidence_stages.context.seen_from(replace(evidence_stages.context.foreground, is_told=False))
    chains = evidence_stages.chains if chains is None else chains
    return with_confidence(chains, (), 0.0, context, doo3d.load_config("default"))[1]


def test_what_looks_like_a_cable_is_not_doubted_for_its_looks(plain):
    (evidence,) = untold(plain)
    assert (evidence.flat, evidence.stray, evidence.odd) == (0.0, 0.0, 0.0)
    assert evidence.uneven < 0.1
    assert evidence.stubby == pytest.approx(np.log(40 / (plain.chains[0].length / (2 * plain.chains[0].radius))))
    assert plain.evidence[0].stubby == 0.0  # with a mask nobody doubts what the object is


def test_a_short_wide_chain_does_not_look_like_a_cable():
    frame, mask = frame_of(line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5]), radius=0.012)
    stages = run_stages(frame, doo3d.load_config("default"), mask)
    (evidence,) = untold(stages)
    assert evidence.stubby > 1.2
    assert evidence.confidence < untold(stages_of())[0].confidence - 0.1


def test_a_mark_on_the_surface_and_the_edge_of_a_step_are_flat(plain):
    depth = np.array(plain.context.foreground.depth)
    mask = plain.context.foreground.mask
    flat = np.full_like(depth, 0.5)
    step = flat.copy()
    step[: len(step) // 2] = 0.6
    step[mask] = 0.5
    for changed in (flat, step):
        context = plain.context.seen_from(replace(plain.context.foreground, is_told=False, depth=changed))
        (evidence,) = with_confidence(plain.chains, (), 0.0, context, doo3d.load_config("default"))[1]
        assert evidence.flat > 0.9


def test_a_stub_beside_a_long_chain_is_stray_unless_the_number_is_given(plain):
    (chain,) = plain.chains
    stub = replace(
        chain,
        joints=chain.joints[:3] + np.array((0, 0.03, 0)),
        radii=2 * chain.radii[:3],
        radius=2 * chain.radius,
        occluded=chain.occluded[:2],
        depth_filled=chain.depth_filled[:2],
        from_time=chain.from_time[:2],
        deviations=None,
    )
    whole, short = untold(plain, [chain, stub])
    assert (whole.stray, short.stray) == (0.0, 1.0)
    assert short.odd == pytest.approx(np.log(2))
    given = with_confidence([chain, stub], (), 0.0, plain.context, doo3d.load_config("default", {"merge.chains": 2}))[1]
    assert [each.stray for each in given] == [0.0, 0.0]


def test_what_is_wider_than_max_width_is_no_object_where_none_was_told(plain):
    config = doo3d.load_config("default", {"segment.max_width": 0.006})
    context = plain.context.seen_from(replace(plain.context.foreground, is_told=False))
    assert with_confidence(plain.chains, (), 0.0, context, config)[0][0].confidence == 0.0
    assert with_confidence(plain.chains, (), 0.0, plain.context, config)[0][0].confidence > 0.9


def test_the_edge_between_two_surfaces_lies_between_two_colors(plain):
    height, width = plain.context.foreground.mask.shape
    gray, edge = (np.full((height, width, 3), 128, np.uint8) for _ in range(2))
    (u, v) = CAMERA.project(plain.chains[0].joints).T
    middle = np.interp(np.arange(width), *((u, v) if u[0] < u[-1] else (u[::-1], v[::-1])))
    edge[np.arange(height)[:, None] < middle] = (40, 60, 160)
    for color in (gray, edge):
        color[plain.context.foreground.mask] = (200, 40, 40)
    values = []
    for color in (gray, edge):
        context = plain.context.seen_from(replace(plain.context.foreground, is_told=False, color=color))
        values.append(with_confidence(plain.chains, (), 0.0, context, doo3d.load_config("default"))[1][0].edge)
    assert values[0] < 0.05
    assert values[1] > 0.4


def judged(probability, ends=(-50, 400)):
    """The evidence against the chains of a photograph with a cable from one column to another, of pixels so probable."""
    v, u = np.mgrid[0:240, 0:320]
    on = (np.abs(v - 100 - 0.2 * u) < 4) & (u > ends[0]) & (u < ends[1])
    image = np.where(on[..., None], (30, 60, 200), (200, 190, 170)).astype(np.uint8)
    config = doo3d.load_config("image", {"segment.method": "strands"})
    segmentation = segment(doo3d.Image(image), config.segment)
    known = replace(segmentation.foreground, probability=np.where(on, probability, 0.02).astype(np.float32))
    return run_from_segmentation(replace(segmentation, foreground=known), config, _Clock()).evidence


def test_a_network_that_doubts_a_cable_lowers_its_confidence():
    ((sure,), (doubtful,)) = judged(0.99), judged(0.6)
    assert sure.is_judged
    assert sure.doubted == 0.0
    assert doubtful.doubted > 1.9
    assert doubtful.log_odds < sure.log_odds - 2


def test_a_straight_chain_with_both_ends_in_the_view_is_a_rod():
    assert [judged(0.99, ends)[0].rod > 0.5 for ends in ((-50, 400), (-50, 250), (60, 250))] == [False, False, True]


def test_the_surest_chain_of_a_photograph_counts_for_all():
    (evidence,) = judged(0.6, (60, 250))
    assert evidence.unsure == pytest.approx(sum(replace(evidence, unsure=0.0).losses().values()))


def test_a_straight_chain_within_the_view_may_be_a_rod():
    assert judged(0.99, (60, 250))[0].rod > 0.8
    assert judged(0.99, (-50, 250))[0].rod == 0
    curved = np.column_stack((np.linspace(20, 300, 200), 120 + 30 * np.sin(np.linspace(0, 4, 200))))
    assert _straightness(curved, np.full(200, 4.0)) == 0


def test_in_a_frame_the_surest_chain_counts_for_all_and_a_straight_cable_within_the_view_is_believed(plain):
    config, found = doo3d.load_config("default"), []
    for told in (True, False):
        context = plain.context.seen_from(replace(plain.context.foreground, is_told=told))
        found.append(with_confidence(plain.chains, (), 0.0, context, config)[1][0])
    told, untold = found
    assert told.unsure == 0.0
    assert untold.unsure == pytest.approx(sum(replace(untold, unsure=0.0).losses().values()))
    assert untold.confidence > 0.9


def test_a_cloud_without_a_view_has_weights_of_its_own():
    evidence = Evidence(unsure=2.0, uneven=0.1, is_told=False)
    cloud = replace(evidence, is_in_view=False)
    assert set(evidence.losses()) <= set(UNTOLD)
    assert cloud.log_odds == pytest.approx(UNTOLD_CLOUD["base"] - 0.1 * UNTOLD_CLOUD["uneven"])
