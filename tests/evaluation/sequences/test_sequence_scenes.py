"""Cables in motion with hands and losses of depth: what they hide and lose, and whether the truth is of one cable."""

from dataclasses import replace

import numpy as np
import pytest
from builders.errors import refuses
from builders.paths import DATA

from doo3d.evaluation.sequences.motions import MAX_MARKER_STEP, captured_motion, motion_files
from doo3d.evaluation.sequences.scenes import LEVELS, Hand, Loss, make_sequence

SIZE, FRAMES = (160, 120), 6
MOTION = DATA / "motion"


@pytest.fixture(scope="module")
def easy():
    return make_sequence("dragged", 0, SIZE, FRAMES, "easy")


def capture_file(path, frames=40, markers=10, jump=0.0):
    """Write markers along a sagging cable that swings; `jump` m between its middle markers, as to a branch."""
    along = np.linspace(0.0, 0.6, markers) + jump * (np.arange(markers) >= markers // 2)
    swing = 0.05 * np.sin(np.arange(frames) / 15)
    points = np.zeros((frames, markers, 3))
    points[..., 0] = along
    points[..., 1] = swing[:, None] * np.sin(np.pi * along / 0.6)
    points[..., 2] = 0.3 * (along - 0.3) ** 2
    np.save(path, points.astype(np.float32))
    return path


@pytest.mark.parametrize("motion", ["dragged", "knot"])
def test_own_motions_are_of_one_cable_that_does_not_stretch(motion):
    sequence = make_sequence(motion, 0, SIZE, 40, "easy")
    lengths = [np.linalg.norm(np.diff(axis, axis=0), axis=1).sum() for axis in sequence.motion.axes]
    assert np.ptp(lengths) < 0.02 * np.mean(lengths)
    ends = np.array([axis[[0, -1]] for axis in sequence.motion.axes])
    moved = np.linalg.norm(np.diff(ends, axis=0), axis=2)
    assert moved.max() < 0.02  # m a frame; swapped tips would be far apart
    assert np.abs(ends[-1] - ends[0]).max() > 0.002


def test_an_easy_sequence_has_neither_hands_nor_losses(easy):
    assert (easy.hands, easy.losses, len(easy)) == ((), (), FRAMES)
    rendered = easy.frame(0, "none")
    assert rendered.truths[0].seen.mean() > 0.8
    assert (rendered.frame.depth > 0).all()


def test_the_same_arguments_give_the_same_frame(easy):
    first, again = (make_sequence("dragged", 0, SIZE, FRAMES, "easy").frame(2) for _ in range(2))
    assert np.array_equal(first.frame.depth, again.frame.depth)
    assert np.array_equal(first.frame.color, again.frame.color)
    assert first.frame.timestamp == pytest.approx(2 / 30)
    assert not np.array_equal(first.frame.depth, easy.frame(3).frame.depth)


def test_only_a_rough_sequence_has_look_alikes_and_the_same_arguments_give_the_same_one():
    first, again, other = (make_sequence("dragged", seed, SIZE, FRAMES, "rough") for seed in (0, 0, 1))
    for frame in (0, FRAMES - 1):
        assert np.array_equal(first.frame(frame).frame.color, again.frame(frame).frame.color)
        assert np.array_equal(first.frame(frame).frame.depth, again.frame(frame).frame.depth)
    assert not np.array_equal(first.motion.axes[0], other.motion.axes[0])
    assert [len(make_sequence("dragged", 0, SIZE, FRAMES, level).props) for level in LEVELS] == [2, 0, 0]
    with pytest.raises(ValueError, match="rough, hard, easy"):
        make_sequence("dragged", 0, SIZE, FRAMES, "harder")


def test_a_hand_hides_its_share_while_it_is_there(easy):
    hand = Hand(2.0, 3.0, 0.5, 0.3, 0.85, np.array([0.0, 1.0]), (200, 150, 120))
    sequence = replace(easy, hands=(hand,))
    bare, hidden = easy.frame(2, "none").truths[0], sequence.frame(2, "none").truths[0]
    lost = bare.seen & ~hidden.seen
    assert 0.25 < lost.mean() < 0.75
    assert lost[round(0.5 * (len(lost) - 1))]
    assert np.array_equal(hidden.axis, bare.axis)
    late = replace(easy, hands=(replace(hand, start=20.0, end=21.0),))
    assert np.array_equal(late.frame(2, "none").truths[0].seen, bare.seen)


def test_a_loss_takes_the_depth_of_its_part_in_its_frames(easy):
    sequence = replace(easy, losses=(Loss(1, 2, (0.8, 1.0)), Loss(3, 4, None)))
    before, part, whole = (sequence.frame(k, "none") for k in (0, 1, 3))
    truth = part.truths[0]
    tip, start = (truth.axis[k] for k in (-5, 5))
    pixels = np.rint(part.frame.camera.project(np.array([tip, start]))).astype(int)
    assert [part.frame.depth[v, u] > 0 for u, v in pixels] == [False, True]
    assert (before.frame.depth > 0).all()
    assert not (whole.frame.depth > 0).any()
    assert whole.mask.any()


def test_motion_capture_becomes_a_cable_before_the_camera(tmp_path):
    path = capture_file(tmp_path / "swing.npy")
    sequence = make_sequence(path, 1, SIZE, 5)
    assert sequence.name == "swing-1"
    lengths = [np.linalg.norm(np.diff(axis, axis=0), axis=1).sum() for axis in sequence.motion.axes]
    assert np.mean(lengths) == pytest.approx(0.61, abs=0.02)
    for axis in sequence.motion.axes:
        pixels = sequence.motion.camera.project(axis)
        assert ((pixels > 0) & (pixels < np.array(SIZE))).all()
    assert sequence.frame(0, "none").mask.any()


def test_other_arrays_than_markers_along_one_cable_are_refused(tmp_path):
    short, branched, missing = (tmp_path / f"{name}.npy" for name in ("short", "branched", "missing"))
    capture_file(short, frames=5)
    capture_file(branched, jump=0.07 * (MAX_MARKER_STEP + 1))
    points = np.load(capture_file(missing))
    points[3, 4] = np.nan
    np.save(missing, points)
    (tmp_path / "text.npy").write_text("no array")
    for name, part in (("short", "shape"), ("branched", "marker 5"), ("missing", "marker"), ("text", "no motion capture")):
        with refuses("truth-invalid", f"{name}.npy", part):
            captured_motion(tmp_path / f"{name}.npy", np.random.default_rng(0), SIZE, 10)


def test_files_of_a_folder_come_by_name(tmp_path):
    files = [capture_file(tmp_path / name) for name in ("b.npy", "a.npy")]
    assert motion_files([tmp_path]) == files[::-1]
    assert motion_files([files[0]]) == files[:1]
    (tmp_path / "empty").mkdir()
    for path in (tmp_path / "nothing.npy", tmp_path / "empty"):
        with refuses("file-missing", path.name):
            motion_files([path])


@pytest.mark.skipif(not MOTION.is_dir(), reason="needs shared/data/motion")
def test_real_cables_are_accepted_and_branched_ones_are_not():
    rng = np.random.default_rng(0)
    for path in sorted(MOTION.glob("DLO*.npy")):
        motion = captured_motion(path, rng, (640, 480), 30)
        assert 0.6 < np.linalg.norm(np.diff(motion.axes[0], axis=0), axis=1).sum() < 1.5
    for path in sorted(MOTION.glob("BDLO*.npy")):
        with refuses("truth-invalid", "unbranched"):
            captured_motion(path, rng, (640, 480), 30)
