"""The confidence of a chain falls with every kind of evidence against it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, frame_of, line, wave

import doo3d
from doo3d.judge import Evidence
from doo3d.judge.clutter import CABLE_WIDTHS, CLEAR_CONTRAST
from doo3d.judge.confidence import with_confidence
from doo3d.judge.evidence import WEIGHTS_AUTO, WEIGHTS_GIVEN
from doo3d.judge.interpretations import USUAL
from doo3d.pipeline import _walk, run_stages
from doo3d.scene.frame_facts import FrameFacts
from doo3d.segment import segment
from doo3d.segment.observe import Observed
from doo3d.types import Connection

STRAIGHT = line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5])


def stages_of(axis=STRAIGHT, radius=0.004):
    frame, mask = frame_of(axis, radius=radius)
    return run_stages(frame, doo3d.load_config("default"), mask)


@pytest.fixture(scope="module")
def plain():
    """The stages of a straight cable, which is easy."""
    return stages_of()


def evidence_of(stages, chains=None, dropped=0.0, joined=(), mask=None, depth=None, **changes) -> Evidence:
    scene = stages.scene
    if mask is not None or depth is not None:
        changes["facts"] = FrameFacts(scene.mask if mask is None else mask, scene.depth if depth is None else depth)
    scene = replace(scene, **changes)
    return with_confidence(stages.chains if chains is None else chains, dropped, scene, (), joined)[1][0]


def test_nothing_speaks_against_a_plain_cable(plain):
    (evidence,) = plain.evidence
    assert evidence.confidence == plain.chains[0].confidence > 0.95
    assert [getattr(evidence, name) for name in ("joins", "unclaimed", "dropped", "mask_ahead")] == [0.0] * 4
    assert evidence.bend < 0.1
    assert evidence.residual < 0.4


KINDS = [
    (name, object_given)
    for weights, object_given in ((WEIGHTS_GIVEN, True), (WEIGHTS_AUTO, False))
    for name in weights
    if name != "base"
]


def test_there_are_few_weights_and_each_lowers_the_confidence():
    assert len(WEIGHTS_GIVEN) + len(WEIGHTS_AUTO) <= 30
    assert min((*WEIGHTS_GIVEN.values(), *WEIGHTS_AUTO.values())) > 0


@pytest.mark.parametrize(("name", "object_given"), KINDS)
def test_each_kind_of_evidence_lowers_the_confidence(name, object_given):
    values = [Evidence(**{name: amount}, object_given=object_given).confidence for amount in (0.0, 0.2, 0.5, 1.0)]
    assert all(more > less for more, less in itertools.pairwise(values))


def test_odds_of_independent_evidence_multiply():
    def odds(**amounts):
        value = Evidence(**amounts).confidence
        return value / (1 - value)

    assert odds(bend=0.3, joins=1.0) * odds() == pytest.approx(odds(bend=0.3) * odds(joins=1.0))


def test_depth_that_is_missing_or_torn_speaks_against_a_chain(plain):
    depth = np.array(plain.scene.depth)
    missing, torn = depth.copy(), depth.copy()
    missing[:, 300:380] = 0
    torn[:, 300:380] += 0.02
    whole = plain.evidence[0]
    assert evidence_of(plain, depth=missing).unsupported > whole.unsupported + 0.3
    assert evidence_of(plain, depth=torn).unsupported > whole.unsupported + 0.3
    assert evidence_of(plain, depth=torn).residual == 3.0


def test_joins_and_dropped_pieces_speak_against_a_chain(plain):
    (chain,) = plain.chains
    joined = replace(chain, connections=(Connection(3, 0.5), Connection(9, 0.75)))
    assert evidence_of(plain, [joined]).joins == pytest.approx(np.log(1.75))
    assert evidence_of(plain, dropped=10 * plain.scene.radius).dropped == pytest.approx(0.5)
    assert evidence_of(plain, dropped=1.0).dropped == 1.0


def test_a_mask_that_no_chain_explains_speaks_against_all(plain):
    mask = np.array(plain.scene.mask)
    more = mask.copy()
    more[20:40, 100:200] = True
    share = 2000 / more.sum()
    assert evidence_of(plain, mask=more).unclaimed == pytest.approx(np.sqrt(share), rel=0.02)


def test_of_a_guessed_mask_only_the_parts_that_a_chain_runs_through_speak_against_it(plain):
    (chain,) = plain.chains
    mask = np.array(plain.scene.mask)
    v, u = (int(np.median(each)) for each in np.nonzero(mask))
    elsewhere, attached = mask.copy(), mask.copy()
    elsewhere[20:40, 100:200] = True
    attached[20:v, u - 10 : u + 10] = True
    known = {"object_given": False, "is_clean": False}
    assert evidence_of(plain, mask=elsewhere, **known) == evidence_of(plain, mask=mask, **known)
    told, guessed = (evidence_of(plain, mask=attached, is_clean=clean) for clean in (True, False))
    assert guessed.unclaimed == told.unclaimed > 0.3
    other = replace(chain, joints=chain.joints + np.array((0, 0.05, 0)))
    both = mask | np.roll(mask, 80, axis=0)
    assert evidence_of(plain, [chain, other], mask=both, **known).unclaimed == 0.0
    assert evidence_of(plain, [other], mask=mask, **known).unclaimed == 0.0  # off the mask, it runs through no part


def test_a_mask_that_continues_ahead_of_an_end_speaks_against_a_chain(plain):
    (chain,) = plain.chains
    half = replace(
        chain,
        joints=chain.joints[: len(chain.joints) // 2],
        radii=chain.radii[: len(chain.joints) // 2],
        occluded=chain.occluded[: len(chain.joints) // 2 - 1],
        depth_filled=chain.depth_filled[: len(chain.joints) // 2 - 1],
        from_time=chain.from_time[: len(chain.joints) // 2 - 1],
        deviations=None,
    )
    assert evidence_of(plain, [half]).mask_ahead == 1.0
    assert evidence_of(plain, [half], joined={(0, 1)}).mask_ahead == 0.0
    assert evidence_of(plain, [replace(half, closed=True)]).mask_ahead == 0.0


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


def untold(stages):
    """The evidence against the chains where nobody said what the object is, nor how many there are."""
    return with_confidence(stages.chains, 0.0, replace(stages.scene, object_given=False))[1]


def test_what_looks_like_a_cable_is_not_doubted_for_its_looks(plain):
    (evidence,) = untold(plain)
    assert (evidence.flat, evidence.faint, evidence.network_doubt) == (0.0, 0.0, 0.0)
    assert evidence.uneven < 0.1
    assert evidence.stubby == pytest.approx(np.log(CABLE_WIDTHS * 2 * plain.chains[0].radius / plain.chains[0].length))


def test_a_short_wide_chain_does_not_look_like_a_cable():
    frame, mask = frame_of(line([-0.12, 0.0, 0.5], [0.12, 0.02, 0.5]), radius=0.012)
    stages = run_stages(frame, doo3d.load_config("default"), mask)
    (evidence,) = untold(stages)
    assert evidence.stubby > untold(stages_of())[0].stubby + 1
    assert evidence.confidence < untold(stages_of())[0].confidence - 0.1


def test_a_mark_on_the_surface_and_the_edge_of_a_step_are_flat(plain):
    depth = np.array(plain.scene.depth)
    mask = plain.scene.mask
    flat = np.full_like(depth, 0.5)
    step = flat.copy()
    step[: len(step) // 2] = 0.6
    step[mask] = 0.5
    for changed in (flat, step):
        assert evidence_of(plain, depth=changed, object_given=False).flat > 0.9


def test_what_is_wider_than_max_width_is_no_object_where_none_was_told(plain):
    scene = plain.scene.with_settings(doo3d.load_config("default", {"segment.max_width": 0.006}))
    assert with_confidence(plain.chains, 0.0, replace(scene, object_given=False))[0][0].confidence == 0.0
    assert with_confidence(plain.chains, 0.0, scene)[0][0].confidence > 0.9


def test_a_strand_that_has_the_color_of_one_side_is_faint(plain):
    mask, values = plain.scene.mask, []
    height, width = mask.shape
    for shade in (128, 190):
        color = np.full((height, width, 3), 128, np.uint8)
        (u, v) = CAMERA.project(plain.chains[0].joints).T
        middle = np.interp(np.arange(width), *((u, v) if u[0] < u[-1] else (u[::-1], v[::-1])))
        color[np.arange(height)[:, None] < middle] = shade
        color[mask] = (200, 200, 200)
        values.append(untold(run_stages(doo3d.Image(color), doo3d.load_config("image"), mask))[0].faint)
    assert values[0] == 0.0
    assert values[1] == pytest.approx(np.log(CLEAR_CONTRAST / 10), abs=0.2)


def judged(probability, ends=(-50, 400)):
    """The evidence against the chains of a photograph with a cable from one column to another, of pixels so probable."""
    v, u = np.mgrid[0:240, 0:320]
    on = (np.abs(v - 100 - 0.2 * u) < 4) & (u > ends[0]) & (u < ends[1])
    image = np.where(on[..., None], (30, 60, 200), (200, 190, 170)).astype(np.uint8)
    config = doo3d.load_config("image", {"segment.method": "strands"})
    segmentation = segment(doo3d.Image(image), config.segment)
    known = replace(segmentation.scene, probability=np.where(on, probability, 0.02).astype(np.float32))
    return _walk(Observed(replace(segmentation, scene=known), doo3d.Image(image), config), USUAL).evidence


def test_a_network_that_doubts_a_cable_lowers_its_confidence():
    ((sure,), (doubtful,)) = judged(0.99), judged(0.6)
    assert sure.network_doubt == 0.0
    assert doubtful.network_doubt > 1.9
    assert doubtful.log_odds < sure.log_odds - 1


def test_the_surest_chain_of_a_photograph_counts_for_all():
    (evidence,) = judged(0.6, (60, 250))
    assert evidence.frame_doubt == pytest.approx(sum(replace(evidence, frame_doubt=0.0).losses().values()))


def test_in_a_frame_the_surest_chain_counts_for_all_and_a_short_straight_cable_is_believed(plain):
    (evidence,) = untold(plain)
    assert plain.evidence[0].frame_doubt == 0.0
    assert evidence.frame_doubt == pytest.approx(sum(replace(evidence, frame_doubt=0.0).losses().values()))
    assert evidence.confidence > 0.8
