"""The scores, of chains whose score is known."""

import numpy as np
import pytest
from builders.photos import HEIGHT, WIDTH, cross, labelled, strand

from doo3d.evaluation.photos import score as photos_score
from doo3d.evaluation.photos.score import drawn_pixels, sample_chain, score_photo, trace_cable
from doo3d.types import Chain, Crossing, Detection, SegmentRef, View

SHAPE = (HEIGHT, WIDTH)


def plain(chain, shape):
    """Pixel by pixel, segment by segment: the slow way to draw."""
    out = np.zeros(shape, dtype=bool)
    last = len(chain.joints) - 2
    for y, x in np.ndindex(shape):
        for i, (a, b) in enumerate(zip(chain.joints[:-1], chain.joints[1:], strict=True)):
            t = (np.array((x, y)) - a) @ (b - a) / ((b - a) @ (b - a))
            if not chain.closed and ((i == 0 and t < 0) or (i == last and t > 1)):
                continue
            t = min(max(t, 0), 1)
            wide = chain.radii[i] + t * (chain.radii[i + 1] - chain.radii[i])
            out[y, x] |= np.hypot(*(np.array((x, y)) - a - t * (b - a))) <= wide
    return out


def found(chains, mask, crossings=()):
    return Detection(tuple(chains), "2d", "image", crossings=tuple(crossings), view=View.of(mask, mask.shape))


def ring(count=24, radius=30.0):
    turn = np.linspace(0, 2 * np.pi, count + 1)
    joints = np.column_stack((50 + radius * np.cos(turn), 40 + radius * np.sin(turn)))
    return Chain(joints, float(np.linalg.norm(joints[1] - joints[0])), 3.0, closed=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    "chain",
    [
        strand((10.3, 20.2), (60.1, 25.7), (80.4, 60.9), radius=3.7),
        strand((-20, 30), (40, 31), (120, 70), radius=5.2),
        strand((10, 10), (60, 50), length=8.0, radii=np.linspace(1, 9, 9)),
        ring(),
        strand((40, 40), (52, 44), length=12.0),
    ],
)
def test_drawing_is_what_the_plain_way_draws(chain, monkeypatch):
    wanted = plain(chain, (80, 100))
    for cells in (photos_score._MAX_BOX_PIXELS, 1):
        monkeypatch.setattr(photos_score, "_MAX_BOX_PIXELS", cells)
        assert (drawn_pixels(chain, (80, 100)) == wanted).all()


def test_ends_are_flat_and_sides_as_wide_as_said():
    drawn = drawn_pixels(strand((20, 50), (100, 50), radius=5.5), SHAPE)
    rows, columns = np.nonzero(drawn)
    assert (columns.min(), columns.max(), rows.min(), rows.max()) == (20, 100, 45, 55)
    assert drawn.sum() == 81 * 11


def test_radii_that_are_not_known_draw_nothing():
    assert not drawn_pixels(strand((20.5, 50.5), (100.5, 50.5), radius=float("nan")), SHAPE).any()


def test_the_truth_itself_scores_full_but_for_what_lies_below():
    chains = cross()
    on_top = Crossing(SegmentRef(0, 11), SegmentRef(1, 15), np.array((100.0, 75.0)))
    score = score_photo(found(chains[::-1], labelled(chains) > 0, [on_top]), labelled(chains))
    hidden = 9 * 9 / (161 * 9)  # of the lower cable
    assert score.drawn == pytest.approx((1 + 2 * (1 - hidden) / (2 - hidden)) / 2)
    assert score.instances == 1
    assert score.match == [1, 0]
    assert score.correct


def test_apart_the_labels_are_met_exactly():
    chains = [strand((20, 30), (180, 30)), strand((20, 90), (180, 110))]
    labels = labelled(chains)
    score = score_photo(found(chains, labels > 0), labels)
    assert (score.drawn, score.instances) == (1, 1)


def test_what_is_missing_counts_nothing_and_what_is_too_much_only_as_count():
    chains = [strand((20, 30), (180, 30)), strand((20, 90), (180, 90))]
    labels = labelled(chains)
    one = score_photo(found(chains[:1], labels > 0), labels)
    assert one.drawn == one.instances == 0.5  # the pixels of the other cable are far away
    assert one.match == [0, -1]
    three = score_photo(found([*chains, strand((20, 140), (180, 140))], labels > 0), labels)
    assert (three.drawn, three.instances, three.correct) == (1, 1, False)
    none = score_photo(found([], labels > 0), labels)
    assert (none.drawn, none.instances, none.chains) == (0, 0, 0)


def test_pixels_outside_the_labels_cost():
    chains = [strand((20, 30), (180, 30))]
    labels = labelled(chains)
    mask = labels > 0
    mask[35:39, 20:181] = True
    assert score_photo(found(chains, mask), labels).instances == pytest.approx(2 * 9 / (9 + 13))
    assert score_photo(found(chains, mask), labels).drawn == 1


def test_cables_that_change_places_at_a_crossing_cost_half():
    first, second = cross()
    turned = [strand((20, 75), (100, 75), (100, 15)), strand((180, 75), (100, 75), (100, 135))]
    labels = labelled([first, second])
    assert score_photo(found(turned, labels > 0), labels).instances < 0.65


def test_of_a_cable_in_two_chains_one_counts():
    chains = [strand((20, 30), (95, 30)), strand((100, 30), (180, 30))]
    labels = labelled([strand((20, 30), (180, 30))])
    score = score_photo(found(chains, labels > 0), labels)
    assert score.instances == pytest.approx(2 * 83 / (161 + 83))  # cut in the middle between them
    assert not score.correct


def test_samples_lie_on_the_chain_close_together():
    line = sample_chain(strand((10, 50), (100, 50), (100, 100), length=7.0))
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps.max() <= photos_score.SAMPLE_SPACING_PX + 1e-9
    assert steps.min() > 0.3


def test_a_cable_is_traced_by_itself():
    chain = strand((20, 75), (180, 75))
    labels = labelled([chain])
    assert trace_cable(chain, labels, 1).traced
    half = trace_cable(strand((20, 75), (100, 75)), labels, 1)
    assert half.recall == pytest.approx(0.54, abs=0.03)
    assert half.precision == 1
    assert not half.traced
    astray = trace_cable(strand((20, 75), (180, 75), (180, 135)), labels, 1)
    assert astray.recall == 1
    assert astray.precision == pytest.approx(164 / 220, abs=0.03)
    assert trace_cable(strand((20, 82), (180, 82)), labels, 1).recall == 0
    assert trace_cable(None, labels, 1) == {"recall": 0.0, "precision": 0.0, "traced": False}


def test_below_another_cable_the_way_through_is_right():
    below, above = cross(radius=6.0)
    labels = labelled([below, above])
    through = trace_cable(below, labels, 1)
    assert through.recall == 1
    assert through.precision > 0.99
    along = trace_cable(strand((20, 75), (100, 75), (100, 135)), labels, 1)
    assert along.precision < 0.75  # beyond the crossing the other cable is no excuse


def test_specks_of_the_label_are_not_the_cable():
    chain = strand((20, 75), (180, 75))
    labels = labelled([chain])
    labels[20:25, ::10] = 1
    assert trace_cable(chain, labels, 1).recall == 1
    labels[20:28, 40:60] = 1
    assert trace_cable(chain, labels, 1).recall < 0.95
