"""Cables in motion from disk: the frames, the truth, and the command."""

import numpy as np
import pytest
from builders.errors import refuses
from builders.photos import write_capture

from doo3d.evaluation.sequences.evaluate import VARIANTS
from doo3d.evaluation.sequences.recorded import recorded_sequences
from doo3d.evaluation.sequences.scenes import make_sequence

SIZE = (320, 240)


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    """Three frames of a rendered sequence, written as another renderer does."""
    sequence = make_sequence("dragged", 0, SIZE, 3, "easy")
    folder = write_capture(tmp_path_factory.mktemp("moving") / "cable_0", sequence.frames("none"))
    np.savez(folder / "truth.npz", curves=np.stack(list(sequence.motion.axes)), radius=sequence.motion.radius)
    return sequence, folder


def test_frames_and_truth_are_those_that_were_written(capture):
    sequence, folder = capture
    (recorded,) = recorded_sequences([folder.parent], 2)
    assert (recorded.name, len(recorded)) == ("cable_0", 2)
    for found, true in zip(recorded.frames(), sequence.frames("none"), strict=False):
        (cable,) = found.truths
        assert cable.radius == pytest.approx(sequence.motion.radius)
        assert np.abs(cable.axis - true.truths[0].axis).max() < 1e-9
        assert (cable.seen == true.truths[0].seen).mean() > 0.95
        assert np.abs(found.frame.depth - true.frame.depth).max() < 1e-4


def test_the_command_measures_them_in_all_variants(capture, doo3d):
    code, out, err = doo3d("evaluate", "sequences", "--own", "none", "--captures", capture[1], "--out", "out")
    assert (code, err) == (0, "")
    assert [line.split()[:2] for line in out.splitlines()[2:7]] == [["cable_0", name] for name in VARIANTS]


def test_a_folder_without_one_is_refused(tmp_path):
    with refuses("truth-missing"):
        recorded_sequences([tmp_path], 2)
